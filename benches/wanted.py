"""The goals, in groups that are measured together, in turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import benches
from benches import native
from benches.camera import cases as camera
from benches.clouds import cases as clouds
from benches.clouds import jobs as estimators
from benches.clouds import street, tracking
from benches.goal import Goal, at_level, faster, within
from benches.paths import cases as paths
from benches.scans import jobs, rates
from benches.scans.cases import TIES, WALL
from benches.scans.cases import Case as Scan
from benches.tracks import cases as tracks

if TYPE_CHECKING:
    from benches.case import Case


def _least(beams: int, numpy: float, numba: float) -> list[Goal]:
    case = Scan(jobs.MIN, beams)
    return [faster(case, "NumPy", numpy), faster(case, "numba", numba)]


def _per_beam(beams: int) -> list[Goal]:
    case = Scan(jobs.PER_BEAM, beams)
    return [faster(case, "NumPy", 20), faster(case, native.COPY, 0.6)]


def _kth(points: int, numpy: float) -> Goal:
    return faster(clouds.KTH[points], "NumPy", numpy)


def _estimator(case: clouds.Case) -> list[Goal]:
    if case.job is estimators.CLUSTER:
        return [faster(case, native.READ, 0.7), faster(case, "SciPy", 20), faster(case, "Open3D", 20)]
    return [faster(case, native.READ, 0.7)]


_FRAME, _MILLION = clouds.KTH[street.FRAME], clouds.KTH[1_000_000]
_BATCH = Scan(jobs.MIN_BATCH, 1080, rows=1024)
_RANDOM = next(case for case in clouds.ORDERS if case.order == "random order")
_MEDIANS = {50: 30, 200: 140, 1000: 270, 3000: 350}
_SINGLE, _LONG = Scan(jobs.MIN, 1080), Scan(jobs.MIN, 65_536)

# A hundred updates take as long as three hundred scans of 1080 beams: a microsecond each, where that takes 0.33.
GROUPS: list[list[Goal]] = [
    [within(tracks.KALMAN, _SINGLE, 300, "ScanTTC.min, 1080 beams"), faster(tracks.KALMAN, "reference", 100)],
    [within(tracks.LINE, _SINGLE, 300, "ScanTTC.min, 1080 beams"), faster(tracks.LINE, "NumPy", 100)],
    _least(271, 100, 9),
    _least(1080, 75, 14),
    _least(4096, 50, 20),
    _least(65_536, 34, 22),
    [
        within(case, Scan(jobs.TURNING, 1080, scene=case.scene), 4, "min, same scans")
        for case in (Scan(jobs.NEAREST_TURNING, 1080), WALL, TIES)
    ],
    *([faster(rates.Case(1080, hertz), "reference", 20)] for hertz in (10, 40)),
    _per_beam(1080),
    _per_beam(65_536),
    [faster(_BATCH, "NumPy", 33), faster(_BATCH, native.READ, 0.5)],
    [_kth(1_000, 70)],
    [_kth(20_000, 35)],
    [
        _kth(street.FRAME, 22),
        faster(_FRAME, native.CPP, 3.2),
        faster(_FRAME, estimators.OPEN3D_MINIMUM, 230),
        faster(_FRAME, native.READ, 0.9),
    ],
    [_kth(1_000_000, 22), faster(_MILLION, native.READ, 0.9)],
    *(_estimator(case) for case in clouds.EVERY if case.job is not estimators.KTH),
    *([within(*pair, 3, "the gate pass alone")] for pair in zip(tracking.FOLLOWED, tracking.GATED, strict=True)),
    [
        within(case, _RANDOM, 2, "random order")
        for case in clouds.ORDERS
        if case.order not in ("as recorded", "random order")
    ],
    *([faster(case, "NumPy", 8), faster(case, estimators.COPYING, 1)] for case in clouds.RECORDS),
    [within(Scan(jobs.MIN, beams, "float64"), Scan(jobs.MIN, beams), 2.2, "float32") for beams in (1080, 65_536)],
    [within(Scan(jobs.PER_BEAM, 65_536, "float64"), Scan(jobs.PER_BEAM, 65_536), 2.2, "float32")],
    [within(clouds.FLOAT64, _FRAME, 2.2, "float32")],
    *([faster(case, "reference", 30)] for case in paths.CASES),
    [faster(case, "NumPy", limit) for case, limit in zip(paths.POINTS, (4, 30), strict=True)],
    *([faster(camera.MEDIANS[count], "reference", limit)] for count, limit in _MEDIANS.items()),
    [within(case, camera.MEDIANS[case.matches], 10, "noisy") for case in camera.KIND_CASES if case.matches == 3000],
    [faster(case, "ttc_fast", 1.6, "one thread", ours=benches.TWO_THREADS) for case in (_BATCH, _MILLION)],
]

LEVELLED: list[Case] = [_SINGLE, _LONG, Scan(jobs.NEAREST, 1080), Scan(jobs.PER_BEAM, 1080), _BATCH, _FRAME, _MILLION]
LEVELS: list[Goal] = [
    at_level(case, level, limit) for level, limit in (("avx2", 1.8), ("baseline", 4)) for case in LEVELLED
]
