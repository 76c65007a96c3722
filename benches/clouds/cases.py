"""What is asked of clouds: jobs of some size, order and layout, and who does them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import benches
import ttc_fast
from benches import native
from benches.clouds import by_numpy, by_others, jobs, street
from benches.contestant import Contestant
from ttc_fast import Gate, reference

if TYPE_CHECKING:
    from types import ModuleType

GATE = Gate(x=street.X, y=street.Y, z=street.Z, intensity=street.INTENSITY)
_CALL = "robust_min_x(points, gate=gate, estimator=estimator)"
SIZES = {1_000: "1k", 20_000: "20k", street.FRAME: "114k", 1_000_000: "1M"}


@dataclass(frozen=True)
class Case:
    """A job over one kind of cloud. Light: clouds and contestants are made when asked for."""

    job: jobs.Job
    points: int
    dtype: str = "float32"
    order: str = "as recorded"
    """One of ``street.ORDERS``."""
    step: int | None = None
    """Of records, bytes."""

    def __str__(self) -> str:
        order = "" if self.order == "as recorded" else f" {self.order}"
        return f"{self.job.name} {self.size} {self.dtype}{order}"

    @property
    def call(self) -> str:
        """The estimator."""
        return self.job.name

    @property
    def size(self) -> str:
        """In points, and bytes of a record."""
        return SIZES[self.points] if self.step is None else f"{SIZES[self.points]} records of {self.step} B"

    @property
    def nbytes(self) -> int:
        """Of the cloud that one call reads."""
        return self.points * (self.step or 4 * np.dtype(self.dtype).itemsize)

    def pool(self) -> list[Any]:
        """Clouds, to be asked about in turn."""
        return _clouds(self.points, self.dtype, self.order, self.step)

    @property
    def names(self) -> list[str]:
        """Of everybody who can do the job here; ttc_fast first."""
        rows = self.step is None and self.dtype == "float32"
        whole_frame = rows and self.points == street.FRAME
        scipy, open3d = by_others.spatial is not None, by_others.open3d is not None
        optional = {
            "NumPy": self.job.numpy is not None,
            native.READ: native.AVAILABLE,
            native.CPP: native.AVAILABLE and rows and self.job is jobs.KTH,
            "SciPy": whole_frame and scipy and "SciPy" in self.job.others,
            "Open3D": whole_frame and open3d and "Open3D" in self.job.others,
            jobs.OPEN3D_MINIMUM: whole_frame and open3d and jobs.OPEN3D_MINIMUM in self.job.others,
            jobs.COPYING: self.step is not None,
            benches.TWO_THREADS: self.points >= 1_000_000,
        }
        return ["ttc_fast", "reference", *(name for name, is_here in optional.items() if is_here)]

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""
        match name:
            case "ttc_fast":
                return self._library(name, ttc_fast, _CALL)
            case benches.TWO_THREADS:
                return self._library(name, ttc_fast, _CALL.replace(")", ", threads=2)"))
            case jobs.COPYING:
                return self._library(name, ttc_fast, _CALL.replace("points", "as_rows(points)"))
            case "reference":
                return self._library(name, reference, _CALL)
            case "NumPy" if self.job.numpy is not None:
                return Contestant(name, self.job.numpy, vars(by_numpy), "points")
            case native.READ:
                return native.bare_read(self.nbytes)
            case native.CPP:
                return self._cpp(self.job.estimator)
            case _:
                return self._other(name)

    def check(self, contestant: Contestant) -> None:
        """AssertionError if an answer is not that of the reference: to the bit where it is a point's own distance."""
        for points in self.pool():
            answer = contestant.answer(points)
            if contestant.verify is not None:
                assert contestant.verify(points, answer), f"{self}: {contestant.name} is wrong"
                continue
            expected = self._expected(points)
            assert np.isfinite(expected.x), f"{self}: nothing to find"
            rtol = 0.0 if expected.index >= 0 else 1e-6
            x = getattr(answer, "x", answer)
            np.testing.assert_allclose(x, expected.x, rtol, err_msg=f"{self}: {contestant.name} is wrong")
            assert getattr(answer, "index", expected.index) == expected.index, f"{self}: {contestant.name}, index"

    def _expected(self, points: Any) -> Any:
        return reference.robust_min_x(points, gate=GATE, estimator=self.job.estimator)  # type: ignore[arg-type]

    def _library(self, name: str, module: ModuleType, expression: str) -> Contestant:
        names = {"gate": GATE, "estimator": self.job.estimator, "as_rows": by_numpy.as_rows}
        return Contestant(name, expression, {**vars(module), **names}, "points")

    def _cpp(self, estimator: Any) -> Contestant:
        bounds = np.array([street.X, street.Y, street.Z, street.INTENSITY], np.float32)
        names = {"kth": native.library().kth_smallest, "count": self.points, "k": estimator.k, "kept": bounds}
        names["bounds"] = native.address(bounds)
        return Contestant(native.CPP, "kth(points, count, k, bounds)", names, "points", native.address)

    def _other(self, name: str) -> Contestant:
        expression, names = self.job.others[name], vars(by_others)
        if name != jobs.OPEN3D_MINIMUM:
            return Contestant(name, expression, names, "points")
        names = {**names, "box": by_others.open3d_box()}
        return Contestant(name, expression, names, "points", by_others.open3d_cloud, _is_inside)


def _is_inside(_: Any, x: Any) -> bool:
    """Another question than ours: all that can be said of its answer."""
    return bool(street.X[0] <= x <= street.X[1])


@lru_cache(maxsize=8)
def _clouds(points: int, dtype: str, order: str, step: int | None) -> list[Any]:
    clouds = [street.ORDERS[order](cloud).astype(dtype) for cloud in street.clouds(points)]
    return clouds if step is None else [street.records(cloud, step) for cloud in clouds]


KTH = {points: Case(jobs.KTH, points) for points in SIZES}
EVERY = [Case(job, street.FRAME) for job in jobs.JOBS]
RECORDS = [Case(jobs.KTH, street.FRAME, step=step) for step in street.STEPS]
ORDERS = [Case(jobs.KTH, 1_000_000, order=order) for order in street.ORDERS]
FLOAT64 = Case(jobs.KTH, street.FRAME, "float64")
CASES = [*dict.fromkeys([*KTH.values(), *EVERY, *RECORDS, FLOAT64, *ORDERS])]
