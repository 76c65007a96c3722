"""``robust_min_x`` and ``CloudTracker``: what is asked of clouds, and who answers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import by_numpy, native, street
from benches.case import OURS, TWO_THREADS, Case, Goal, Implementation, close_to_reference
from benches.scans import THREADS
from evaluation import lidar, recorded
from ttc_fast import Gate, reference

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from types import ModuleType

GATE = Gate(x=street.X, y=street.Y, z=street.Z, intensity=street.INTENSITY)
SIZES = {1_000: "1k", 20_000: "20k", street.FRAME: "114k", 1_000_000: "1M"}
COPYING = "copied first"
OPEN3D_MINIMUM = "Open3D crop, outliers, min"
KTH = ttc_fast.KthSmallest(20)
BY_NUMPY: dict[Any, str] = {
    KTH: "kth_smallest(points, 20)",
    ttc_fast.Minimum(): "minimum(points)",
    ttc_fast.Quantile(0.5): "quantile(points, 0.5)",
    ttc_fast.MeanOfLowest(10): "mean_of_lowest(points, 10)",
    ttc_fast.InterquartileFence(1.5): "interquartile_fence(points, 1.5)",
    ttc_fast.Supported(5, 0.1): "supported(points, 5, 0.1)",
}
CLUSTER = ttc_fast.Cluster(0.2, 10)
_CALL = "robust_min_x(points, gate=gate, estimator=estimator)"
FRAMES = 20
"""Frames of a drive that ``CloudTracker`` follows."""

HITS = (
    "Of 1k points (about 140 of them inside the gate) about a quarter is the call (robust_min_x of one point), a "
    "seventh finding the order statistic, and the rest reading and keeping the points. 20k points are 320 KB, and do "
    "not stay in the first cache: a bare read of them takes most of the time."
)
GATE_PASS = (
    "The bytes bound it: a bare read takes nine tenths of the time. The rest are the call, the points inside, and "
    "finding an order statistic of them, about 3 % of the time."
)
CLUSTERED = (
    "Two fifths of it is the pass over the points. Most of the rest is reading the gated points, about 580, a second "
    "time and building a tree of them; the search of the tree takes a tenth."
)
ALIGNMENT = (
    "The fit over a window takes about 45 us whatever the size of the cloud, because it depends on the car ahead "
    "and not on the points around it: most of the call over 12k points. The rounds of reweighting take a quarter "
    "of it, because their tables do not stay in the first cache; the profile takes a sixth, and laying cells side by "
    "side and asking for memory a tenth each."
)
BETWEEN_FIELDS = (
    "The bytes between the fields are read as well, because they lie in the same cache lines: 48 bytes a point. A "
    "bare read of these bytes takes as long."
)
SHORT = (
    "There are two keywords, and the answer is an object, unlike that of scan.min: the call alone, without the kernel, "
    "takes longer than the goal. The kernel takes about a third, most of it for the views of the columns, the "
    "memory of the candidates and the search for the nearest of them, whatever the number of points."
)
ROAD = (
    "About half of it numbers the voxels of the points in the region, which are half of the frame, and adds them up. A "
    "quarter finds these points; the rest are the votes on planes and the fit."
)
FEW_INSIDE = (
    "This gate leaves its outlier removal about 440 points of a frame, and the crop takes a third of the time; "
    "wider gates leave it more to do."
)
ALL_EQUAL = "Every point is inside: each is compared with the gate exactly, and its distance with the bound."
TWICE_THE_BYTES = (
    "Twice the bytes, and half as many numbers in a register, make 2; so close to its limit the row changes sides "
    "from run to run."
)


@dataclass(frozen=True)
class Clouds:
    """An estimator over one kind of cloud."""

    points: int
    estimator: Any = KTH
    dtype: str = "float32"
    order: str = "as recorded"
    """One of ``street.ORDERS``."""
    step: int | None = None
    """The bytes of a record, where the points are records."""

    def case(self, *goals: Goal, why: str = GATE_PASS, by_level: bool = False) -> Case:
        """Make the case."""
        records = f" records of {self.step} B" if self.step else ""
        order = "" if self.order == "as recorded" else f" {self.order}"
        size = f"{SIZES[self.points]}{records} {self.dtype}{order}"
        inputs = partial(_clouds, self.points, self.dtype, self.order, self.step)
        return Case(
            str(self.estimator), size, inputs, self._implementations(), self.compare, goals, by_level=by_level, why=why
        )

    def compare(self, implementation: Implementation, inputs: Sequence[Any]) -> None:
        """Hold every answer to that of the reference: to the bit where it is a point's own distance."""
        for points in inputs:
            answer = implementation.answer(points)
            expected: Any = reference.robust_min_x(points, gate=GATE, estimator=self.estimator)
            assert np.isfinite(expected.x), f"{self}: nothing to find"
            rtol = 0.0 if expected.index >= 0 else 1e-6
            message = f"{self}: {implementation} is wrong"
            np.testing.assert_allclose(getattr(answer, "x", answer), expected.x, rtol, err_msg=message)
            assert getattr(answer, "index", expected.index) == expected.index, f"{message}, index"

    def _implementations(self) -> dict[str, Callable[[], Implementation]]:
        rows = self.step is None and self.dtype == "float32"
        ours = partial(self._library, ttc_fast)
        every: dict[str, Callable[[], Implementation]] = {OURS: ours, "reference": partial(self._library, reference)}
        if self.estimator in BY_NUMPY:
            every["NumPy"] = lambda: Implementation(BY_NUMPY[self.estimator], vars(by_numpy), "points")
        every |= native.bare(self.points * (self.step or 4 * np.dtype(self.dtype).itemsize))
        if native.AVAILABLE and rows and self.estimator == KTH:
            every[native.CPP] = self._cpp
        if rows and self.points == street.FRAME:
            every |= _others(self.estimator)
        if self.step is not None:
            every[COPYING] = lambda: ours(_CALL.replace("points", "as_rows(points)"))
        if self.points >= 1_000_000:
            every[TWO_THREADS] = lambda: ours(_CALL.replace(")", ", threads=2)"))
        return every

    def _library(self, module: ModuleType, expression: str = _CALL) -> Implementation:
        names = {"gate": GATE, "estimator": self.estimator, "as_rows": by_numpy.as_rows}
        return Implementation(expression, {**vars(module), **names}, "points")

    def _cpp(self) -> Implementation:
        bounds = np.array([street.X, street.Y, street.Z, street.INTENSITY], np.float32)
        names = {"kth": native.library().kth_smallest, "count": self.points, "k": self.estimator.k, "kept": bounds}
        names["bounds"] = native.address(bounds)
        return Implementation("kth(points, count, k, bounds)", names, "points", native.address)


def _others(estimator: Any) -> dict[str, Callable[[], Implementation]]:
    """Return what SciPy and Open3D make of a whole frame, where they are installed."""

    def clusters(library: str) -> Callable[[], Implementation]:
        return lambda: Implementation(f"{library}_cluster(points, 0.2, 10)", vars(by_numpy), "points")

    def open3d_minimum() -> Implementation:
        names = {**vars(by_numpy), "box": by_numpy.open3d_box()}
        return Implementation("open3d_minimum(points, box)", names, "points", by_numpy.open3d_cloud, _is_inside)

    scipy, open3d = by_numpy.spatial is not None, by_numpy.open3d is not None
    if estimator == KTH and open3d:
        return {OPEN3D_MINIMUM: open3d_minimum}
    if estimator != CLUSTER:
        return {}
    return {name: clusters(name.lower()) for name, is_here in (("SciPy", scipy), ("Open3D", open3d)) if is_here}


def _is_inside(_: Any, x: Any) -> bool:
    """Open3D answers another question than ours: this is all that can be said of its answer."""
    return bool(street.X[0] <= x <= street.X[1])


def _short(call: str, expression: str, data: Any, **names: Any) -> Case:
    """Make the case of a call that has next to nothing to compute."""
    implementations = {OURS: lambda: Implementation(expression, {**vars(ttc_fast), **names}, "data")}
    compare = close_to_reference("x", Implementation("8.0", {}, "data"))
    return Case(call, "at 8 m", lambda: [np.array(data, np.float32)], implementations, compare)


def _road() -> Case:
    """Make the case of the road in a frame, beside a gate pass."""

    def made(module: ModuleType) -> Implementation:
        return Implementation("fit_road(points)", vars(module), "points")

    every = {OURS: partial(made, ttc_fast), "reference": partial(made, reference)}
    compare = close_to_reference("rms", made(reference), 1e-6)
    beside = Goal(6, other=FRAME, label="the gate pass", why=ROAD)
    return Case(
        "fit_road",
        SIZES[street.FRAME],
        partial(_clouds, street.FRAME, "float32", "as recorded", None),
        every,
        compare,
        [beside],
    )


@lru_cache(maxsize=8)
def _clouds(points: int, dtype: str, order: str, step: int | None) -> list[Any]:
    clouds = [street.ORDERS[order](cloud).astype(dtype) for cloud in street.clouds(points)]
    return clouds if step is None else [street.records(cloud, step) for cloud in clouds]


FRAME = Clouds(street.FRAME).case(
    *(Goal(22, "NumPy"), Goal(3.2, native.CPP), Goal(230, OPEN3D_MINIMUM, why=FEW_INSIDE), Goal(0.9, native.READ)),
    by_level=True,
)
_two_threads = Goal(1.6, ours=TWO_THREADS, label="one thread", why=THREADS)
_million = Clouds(1_000_000).case(Goal(22, "NumPy"), Goal(0.9, native.READ), _two_threads, by_level=True)
_random = Clouds(1_000_000, order="random order").case()
_cluster = (Goal(0.5, native.READ), Goal(20, "SciPy"), Goal(20, "Open3D"))
_beam = _short("scan.min of one beam", "scan.min(data, 1.0)", [8.0], scan=ttc_fast.ScanTTC(0.0, 0.1, 1))
_point = replace(
    _short(
        "robust_min_x of one point",
        _CALL.replace("points", "data"),
        [[8.0, 0.0, 0.0, 0.5]],
        gate=Gate(),
        estimator=ttc_fast.Minimum(),
    ),
    goals=[Goal(2, other=_beam, label="scan.min of one beam", why=SHORT)],
)
CASES = [
    *(_beam, _point),
    Clouds(1_000).case(Goal(45, "NumPy"), why=HITS),
    Clouds(20_000).case(Goal(30, "NumPy"), why=HITS),
    *(FRAME, _million),
    *(Clouds(street.FRAME, each).case(Goal(0.7, native.READ)) for each in BY_NUMPY if each != KTH),
    Clouds(street.FRAME, CLUSTER).case(*_cluster, why=CLUSTERED),
    *(
        Clouds(street.FRAME, step=step).case(Goal(8, "NumPy", why=BETWEEN_FIELDS), Goal(1, COPYING))
        for step in street.STEPS
    ),
    Clouds(street.FRAME, dtype="float64").case(Goal(2.2, other=FRAME, label="float32", why=TWICE_THE_BYTES)),
    _road(),
    _random,
    *(
        Clouds(1_000_000, order=order).case(
            Goal(2, other=_random, label="random order"), why=ALL_EQUAL if order == "all equal" else GATE_PASS
        )
        for order in street.ORDERS
        if order not in ("as recorded", "random order")
    ),
]


@lru_cache
def _drive(kind: str) -> tuple[list[Any], Gate]:
    """Return frames of KITTI of 114k points, or simulated ones of some 12k, which also stand in without recordings."""
    if kind == "recorded" and recorded.clouds():
        return recorded.clouds()[:FRAMES], recorded.GATE
    frames = lidar.Approach(kind, 20.0, 3.0).frames(seed=1)[:FRAMES]
    return [frame.points for frame in frames], lidar.GATE


def _over_a_drive(kind: str, call: str, job: Callable[[ModuleType, Any, Gate], float], *goals: Goal) -> Case:
    """Make the case of a job over the frames of a drive, after which it begins anew."""

    def made(module: ModuleType) -> Implementation:
        return Implementation("job(frames)", {"job": lambda frames: job(module, frames, _drive(kind)[1])}, "frames")

    implementations: Mapping[str, Callable[[], Implementation]] = {
        OURS: partial(made, ttc_fast),
        "reference": partial(made, reference),
    }
    compare = close_to_reference("", made(reference), 1e-6)
    inputs = lambda: [_drive(kind)[0]]  # noqa: E731
    return Case(call, f"{FRAMES} {kind} frames", inputs, implementations, compare, goals, why=ALIGNMENT)


def _followed(module: ModuleType, frames: Sequence[Any], gate: Gate) -> float:
    update = module.CloudTracker(gate).update
    for number, points in enumerate(frames):
        speed: float = update(points, number / recorded.RATE).closing_speed
    return speed


def _gated(module: ModuleType, frames: Sequence[Any], gate: Gate) -> float:
    for points in frames:
        x: float = module.robust_min_x(points, gate=gate).x
    return x


_gate_passes = {kind: _over_a_drive(kind, "robust_min_x", _gated) for kind in ("recorded", "simulated")}
TRACKED = [
    *(
        _over_a_drive(kind, "CloudTracker.update", _followed, Goal(6, other=gated, label="the gate pass alone"))
        for kind, gated in _gate_passes.items()
    ),
    *_gate_passes.values(),
]
