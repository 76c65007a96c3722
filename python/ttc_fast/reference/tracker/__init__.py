"""``DistanceTracker`` and ``ScaleTracker``: closing speed and time-to-collision over several frames.

- ``filter`` and ``window``: from distances of one target to a posterior of distance and closing speed, by each method
- ``track``: one target, how noisy its distances are, whether the model follows them, whether the gap is stationary
- ``repeats``: a new measurement, or the last one handed over again
- ``answer``: from a posterior to a time-to-collision with its interval
- ``association``: which target a distance belongs to, and all this put together
- ``scale``: the tracker of a camera, which takes distances beside scales
"""

from ttc_fast.reference.tracker.answer import TrackedTTC
from ttc_fast.reference.tracker.association import DistanceTracker
from ttc_fast.reference.tracker.scale import ScaleTracker

__all__ = ["DistanceTracker", "ScaleTracker", "TrackedTTC"]
