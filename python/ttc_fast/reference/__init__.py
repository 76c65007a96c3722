"""``ttc_fast`` in plain NumPy: the same names and signatures, written to be read.

This is the specification of the kernels, and what they are tested against: it shares no arithmetic with them and does
nothing clever. Read it in this order:

- ``formula``: time-to-collision from clearance and closing speed; all else prepares its input or reads its output
- ``geometry``: where beams point, how the sensor moves, how far the vehicle reaches along a beam
- ``readings``: what a number in ``ranges`` means
- ``vote``: which beam decides
- ``scan`` and ``bare``: these put together, as ``ScanTTC`` and ``ittc``
- ``results`` and ``arguments``: what comes out, and what may go in

What has no arithmetic of its own (``Status``, ``NoDataError``, the settings ``KthSmallest`` and ``NeighbourSupport``,
the two sign helpers) is not written twice: those are the same objects as in ``ttc_fast``.
"""

from ttc_fast._core import KthSmallest, NeighbourSupport, NoDataError
from ttc_fast.reference.bare import ittc
from ttc_fast.reference.results import Counts, CountsBatch, Nearest, NearestBatch
from ttc_fast.reference.scan import ScanTTC
from ttc_fast.signs import closing_speed_from_ego_velocity, range_rate_from_target_velocity
from ttc_fast.status import Status

__all__ = [
    "Counts",
    "CountsBatch",
    "KthSmallest",
    "Nearest",
    "NearestBatch",
    "NeighbourSupport",
    "NoDataError",
    "ScanTTC",
    "Status",
    "closing_speed_from_ego_velocity",
    "ittc",
    "range_rate_from_target_velocity",
]
