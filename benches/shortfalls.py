"""Why a goal is out of reach: kept here, and shown wherever a run falls short of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benches import native
from benches.clouds.jobs import OPEN3D_MINIMUM

if TYPE_CHECKING:
    from benches.goal import Goal

_SHORT_SCAN = (
    "Part of it is the call itself (scan.min of 1 beam, below). Of 1080 beams, the kernel alone takes about 180 ns: 80 "
    "the pass over the readings and the bounds of 17 blocks, 30 the limit that the most promising of them gives, 50 "
    "the beams of the 1.5 blocks that are left, and to decide one or two of them in float64. These wait for one "
    "another. The same scan again and again takes 150: a new one makes the processor guess some branches wrongly, and "
    "doing without branches takes longer (docs/design.md)."
)
_LONG_SCAN = (
    "The bytes bound it more than anything: the whole call runs at about two thirds of the speed of a bare read "
    "(below). The rest is three operations for each 64 bytes, and deciding in the few blocks of beams that are left."
)
_PER_BEAM = (
    "The way to the second cache bounds it: for each 64 bytes of ranges ahead, 128 of tables are read (offsets and "
    "inverse cosines) and 64 written; a copy reads 64 and writes 64. With a third fewer operations (ranges compared "
    "and times selected in one step) 1080 beams, whose tables stay in the first cache, took 13 % less time, and "
    "65,536 the same."
)
_BATCH = (
    "Each row is a search of its own, and takes what the kernel takes for a single scan of 1080 beams (above); a bare "
    "read of the bytes takes about a quarter of it."
)
_RATES = (
    "Arithmetic bounds it: about forty operations in float64 for each beam and remembered scan (6 of them at 10 Hz, 21 "
    "at 40 Hz), and what is summed up for a beam does not fit in the registers."
)
_HITS = (
    "Of 1k points (about 140 of them inside the gate) nearly two fifths is the call (robust_min_x of 1 point, below), "
    "a fifth finding the order statistic, and the rest reading and keeping the points; the call and a bare read of the "
    "bytes from Python each take longer than the goal. 20k points are 320 KB, and do not stay in the first cache: a "
    "bare read of them takes seven tenths of the time, and more than the goal."
)
_GATE = (
    "The bytes bound it: a bare read takes nine tenths of the time. The rest are the call, the points inside, and "
    "finding an order statistic of them, about 3 % of the time."
)
_CLUSTER = (
    "Two fifths of it is the pass over the points. Most of the rest is reading the gated points, about 580, a second "
    "time and building a tree of them; the search of the tree takes a tenth."
)
_ALIGNMENT = (
    "The fit over a window takes about 70 us whatever the size of the cloud, because it depends on the car ahead "
    "and not on the points around it: more than a pass over 114k points, and most of the call over 12k."
)
_THREADS = (
    "The thread that asks works on whatever nobody has begun, and waits for nobody who has not. So it depends on the "
    "second thread: where it got a core in time, a batch took 0.53 of the time of one thread; where it came too "
    "late, 1.0 to 1.03; and on a machine busy with other work up to 1.2, because a helper that is interrupted "
    "within its piece is waited for."
)

WHY: dict[tuple[str, str | None], str] = {
    ("MedianRatio() 3000", "one thread"): _THREADS,
    ("MedianRatio() 3000", "noisy"): (
        "Ratios that are the same, or differ in their last digits only, have to be computed in float64 for every pair, "
        "which takes several times a comparison in float32."
    ),
    ("MedianRatio()", "reference"): (
        "Half of it is the pass over all pairs; the other half are samples, the few hundred ratios that are decided "
        "one by one, and the call, which do not shrink as the pairs do."
    ),
    ("min 1024x1080", "one thread"): _THREADS,
    ("KthSmallest(k=20) 1M", "one thread"): _THREADS,
    ("min 1024x1080", None): _BATCH,
    ("min 65536", None): _LONG_SCAN,
    ("min ", None): _SHORT_SCAN,
    ("per_beam", None): _PER_BEAM,
    ("RangeRate", None): _RATES,
    ("CloudTracker.update", None): _ALIGNMENT,
    ("KthSmallest(k=20) 1M float32 all equal", None): (
        "Every point is inside: each is compared with the gate exactly, and its distance with the bound."
    ),
    ("KthSmallest(k=20) 114k records", "NumPy"): (
        "The bytes between the fields are read as well, because they lie in the same cache lines: 48 bytes a point. A "
        "bare read of these bytes takes as long."
    ),
    ("KthSmallest(k=20) 114k", OPEN3D_MINIMUM): (
        "This gate leaves its outlier removal about 440 points of a frame, and the crop takes a third of the time; "
        "wider gates leave it more to do."
    ),
    ("KthSmallest(k=20) 1k", None): _HITS,
    ("KthSmallest(k=20) 20k", None): _HITS,
    ("KthSmallest(k=20) 114k float64", None): (
        "Twice the bytes, and half as many numbers in a register, make 2; so close to its limit the row changes sides "
        "from run to run."
    ),
    ("Cluster", None): _CLUSTER,
    ("", native.READ): _GATE,
    ("KthSmallest", None): _GATE,
}
"""By the beginning of what is asked and whom it is compared with, or None for anybody; the first that fits counts."""


def why(goal: Goal) -> str:
    """The first reason that fits, or that there is none yet."""
    asked = str(goal.ours.case)
    reasons = (text for (call, who), text in WHY.items() if asked.startswith(call) and who in (goal.who, None))
    return next(reasons, "Not explained yet.")
