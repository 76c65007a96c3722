"""``DistanceTracker``: closing speed and time-to-collision over several frames.

- ``filters``: from distances of one target to a posterior of distance and closing speed, by each method
- ``noise``: how noisy distances are, and whether the model follows them
- ``standing``: whether a gap stands still
- ``answer``: from a posterior to a time-to-collision with its interval
- ``distance``: which target a distance belongs to, and all this put together
"""

from ttc_fast.reference.tracker.answer import TrackedTTC
from ttc_fast.reference.tracker.distance import DistanceTracker

__all__ = ["DistanceTracker", "TrackedTTC"]
