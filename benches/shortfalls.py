"""Why a goal is out of reach: kept here, and shown wherever a run falls short of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benches import native
from benches.clouds.jobs import OPEN3D_MINIMUM

if TYPE_CHECKING:
    from benches.goal import Goal

_SHORT_SCAN = (
    "Part of it is the call itself (scan.min of 1 beam, below). Of 1080 beams, the kernel alone takes about 230 ns: 60 "
    "of them any number of beams takes, to pass its arguments and to decide in float64 the sixteen beams that promise "
    "most; 60 more the pass over the readings; the rest bounds of 17 blocks, and on average 1.8 further groups of "
    "sixteen to decide. The same scan again and again takes as long: it is not branches that are guessed wrongly."
)
_LONG_SCAN = (
    "The bytes bound it more than anything: the whole call runs at about two thirds of the speed of a bare read "
    "(below). The rest is three operations for each 64 bytes, and deciding in the few blocks of beams that are left."
)
_PER_BEAM = (
    "Arithmetic bounds it, not the bytes: a beam takes the same time among 4096 as among 65,536. Three comparisons and "
    "selects make a reading usable, one finds contact, one an answer that is none; with two products and a difference "
    "they follow one another. A copy has none of that, and moves 8 bytes a beam; beams ahead "
    "move 16, those behind 4."
)
_BATCH = (
    "Each row is a search of its own, and takes more than the kernel takes for a single scan of 1080 beams; a bare "
    "read of the bytes takes about a fifth of it."
)
_RATES = (
    "Arithmetic bounds it: about forty operations in float64 for each beam and remembered scan (6 of them at 10 Hz, 21 "
    "at 40 Hz), and what is summed up for a beam does not fit in the registers."
)
_HITS = (
    "Points inside the gate take 4 to 10 ns each, to be kept, bounded and selected from, and the sector ahead that "
    "this cloud is cut from has a large share of them (about 140 of 1k, 580 of 20k): with a gate that "
    "nothing passes, 1k points take 0.3 of the time and 20k points 0.6 of it. Of 1k points the goal is less than the "
    "call itself takes (robust_min_x of 1 point, below)."
)
_GATE = (
    "A gate that nothing passes takes what a bare read takes. The rest are the points inside, about 580 of a frame at "
    "4 ns each, and the call; estimators that need all of them sort or select them too."
)
_CLUSTER = (
    "About four fifths of it is linking the gated points: half of that a search of a tree for each of about 580, half "
    "sorting them and building the tree. The same frame again and again takes half the time: what is left are branches "
    "that a new frame makes the processor guess wrongly."
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
        "Every point ties with the k-th smallest, so that no bound excludes any: all of them are kept, and thinned "
        "out again and again."
    ),
    ("KthSmallest(k=20) 114k records", "NumPy"): (
        "The bytes between the fields are read as well, because they lie in the same cache lines: 48 bytes a point."
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
