"""What is asked of scanners: jobs of some size, and who does them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import benches
import ttc_fast
from benches import native
from benches.contestant import Contestant
from benches.scans import by_numba, by_numpy, car, jobs
from benches.scans.answers import check
from ttc_fast import reference

if TYPE_CHECKING:
    from types import ModuleType

POOL_BYTES, POOL_SCANS = 1 << 19, 64
"""Scans take turns, so that no branch predictor learns one by heart; together they stay near the processor."""


_scenes = {name: lru_cache(maxsize=2)(scene) for name, scene in car.SCENES.items()}


@dataclass(frozen=True)
class Case:
    """A job of one size. Light: scans and contestants are made when asked for."""

    job: jobs.Job
    beams: int
    dtype: str = "float32"
    rows: int | None = None
    """Of a batch."""
    scene: str = "rooms"
    """One of ``car.SCENES``."""

    def __str__(self) -> str:
        where = "" if self.scene == "rooms" else f" {self.scene}"
        return f"{self.job.name} {self.size} {self.dtype}{where}"

    @property
    def call(self) -> str:
        """The name of the job."""
        return self.job.name

    @property
    def size(self) -> str:
        """In beams, or scans x beams."""
        return f"{self.beams}" if self.rows is None else f"{self.rows}x{self.beams}"

    @property
    def nbytes(self) -> int:
        """Of the ranges that one call reads."""
        return self.beams * (self.rows or 1) * np.dtype(self.dtype).itemsize

    def pool(self) -> list[Any]:
        """Scans, or batches of them, to be asked about in turn."""
        calls = min(max(POOL_BYTES // self.nbytes, 2), POOL_SCANS)
        scans = _scenes[self.scene](calls * (self.rows or 1), self.beams, self.dtype)
        return list(scans if self.rows is None else scans.reshape(calls, self.rows, self.beams))

    @property
    def names(self) -> list[str]:
        """Of everybody who can do the job; ttc_fast first."""
        optional = {
            "numba": hasattr(by_numba, self.job.function),
            native.COPY if self.job.every_beam else native.READ: native.AVAILABLE,
            benches.TWO_THREADS: self.rows is not None,
        }
        return ["ttc_fast", "reference", "NumPy", *(name for name, is_here in optional.items() if is_here)]

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""
        call = f"{self.job.function}({self.job.arguments})"
        match name:
            case "ttc_fast":
                return Contestant(name, self.job.library, self._objects(ttc_fast))
            case "reference":
                return Contestant(name, self.job.library, self._objects(reference))
            case "NumPy":
                return Contestant(name, call, self._tables(by_numpy, self.dtype))
            case "numba":
                return Contestant(name, call, self._tables(by_numba, "float64"))
            case native.READ:
                return native.bare_read(self.nbytes)
            case native.COPY:
                return native.bare_copy(self.nbytes)
            case benches.TWO_THREADS:
                return Contestant(name, self.job.library, self._objects(ttc_fast, threads=2))
            case _:
                raise ValueError(f"name must be one of {self.names}, got {name!r}")

    def check(self, contestant: Contestant) -> None:
        """AssertionError if an answer is not that of plain NumPy in float64."""
        exact = Contestant("exact", self.job.exact, self._tables(by_numpy, "float64"))
        check(contestant, exact, self.pool(), every_beam=self.job.every_beam)

    def _objects(self, module: ModuleType, **settings: Any) -> dict[str, Any]:
        """The names of an expression in the library's words."""
        shape = self.beams if self.rows is None else (self.rows, self.beams)
        scan = module.ScanTTC(*car.place(self.beams), **car.SETTINGS, **settings)
        return {"scan": scan, "ittc": module.ittc, "out": np.empty(shape, self.dtype), **self._motion(self.dtype)}

    def _tables(self, module: ModuleType, dtype: str) -> dict[str, Any]:
        """The names of an expression that calls a function with tables of ``dtype``."""
        cosines, sines = car.directions(self.beams)
        tables = {"cosines": cosines, "sines": sines, "offsets": car.offsets(self.beams)}
        tables = {name: table.astype(dtype) for name, table in tables.items()}
        return {**vars(module), **tables, **self._motion(dtype)}

    def _motion(self, dtype: str) -> dict[str, Any]:
        speeds = np.random.default_rng(0).uniform(0.5, 10.0, self.rows or 1)
        return {
            "speed": car.SPEED,
            "speeds": speeds.astype(dtype),
            "yaw_rate": car.YAW_RATE,
            "sideways": car.YAW_RATE * car.MOUNT[0],
            "closing": (car.SPEED * car.directions(self.beams)[0]).astype(self.dtype),
        }


WALL = Case(jobs.NEAREST_TURNING, 1080, scene="wall")
TIES = Case(jobs.NEAREST_TURNING, 1080, scene="ties")
CASES = [
    *(Case(job, beams) for job in (jobs.MIN, jobs.NEAREST) for beams in (271, 1080, 4096, 65_536)),
    *(Case(job, beams) for job in (jobs.PER_BEAM, jobs.ITTC) for beams in (271, 1080, 4096, 65_536)),
    *(Case(jobs.TURNING, beams) for beams in (1080, 65_536)),
    *(Case(jobs.TURNING, 1080, scene=scene) for scene in ("wall", "ties")),
    *(WALL, TIES),
    *(Case(job, 1080, "float64") for job in (jobs.MIN, jobs.NEAREST, jobs.PER_BEAM, jobs.ITTC)),
    *(Case(job, 65_536, "float64") for job in (jobs.MIN, jobs.PER_BEAM)),
    *(Case(job, 1080, rows=1024) for job in (jobs.MIN_BATCH, jobs.NEAREST_BATCH, jobs.PER_BEAM_BATCH)),
]
