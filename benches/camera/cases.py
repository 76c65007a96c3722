"""What is asked of a camera: the scale of so many matches, and who finds it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import benches
import ttc_fast
from benches.camera import by_numpy
from benches.contestant import Contestant
from ttc_fast import Consensus, LeastSquares, MedianRatio, reference

SIZES = (50, 200, 1000, 3000)
SOURCE = (
    "a car 150 px wide and high that grows by a hundredth, with 0.4 px of noise; about three of ten pairs are 100 px "
    "apart"
)
LEAST = 100.0
POOL = 2
_CALL = "ttc_from_keypoints(*matches, 0.1, estimator=estimator)"


@dataclass(frozen=True)
class Case:
    """An estimator over so many matches. Light: matches and contestants are made when asked for."""

    estimator: Any
    matches: int
    dtype: str = "float32"
    kind: str = "noisy"
    """One of ``KINDS``."""

    def __str__(self) -> str:
        kind = "" if self.kind == "noisy" else f" {self.kind}"
        return f"{self.estimator} {self.size} {self.dtype}{kind}"

    @property
    def call(self) -> str:
        """The estimator."""
        return str(self.estimator)

    @property
    def size(self) -> str:
        """In matches."""
        return str(self.matches)

    @property
    def nbytes(self) -> int:
        """Of the positions that one call reads."""
        return self.matches * 4 * np.dtype(self.dtype).itemsize

    def pool(self) -> list[Any]:
        """Matches, to be asked about in turn."""
        return _matches(self.matches, self.dtype, self.kind)

    @property
    def names(self) -> list[str]:
        """Of everybody who can do the job here; ttc_fast first."""
        plain = self.estimator == MedianRatio() and self.kind == "noisy"
        optional = {
            "NumPy": plain,
            "SciPy": plain and by_numpy.HAS_SCIPY,
            benches.TWO_THREADS: plain and self.matches >= 2000,
        }
        return ["ttc_fast", "reference", *(name for name, is_here in optional.items() if is_here)]

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""
        own = {"estimator": self.estimator, "least": LEAST}
        match name:
            case "ttc_fast":
                return Contestant(name, _CALL, {**vars(ttc_fast), **own}, "matches")
            case benches.TWO_THREADS:
                call = _CALL.replace("estimator)", "estimator, threads=2)")
                return Contestant(name, call, {**vars(ttc_fast), **own}, "matches")
            case "reference":
                return Contestant(name, _CALL, {**vars(reference), **own}, "matches")
            case "NumPy":
                return Contestant(name, "median_ratio(*matches, least)", {**vars(by_numpy), **own}, "matches")
            case "SciPy":
                return Contestant(name, "median_ratio_by_scipy(*matches, least)", {**vars(by_numpy), **own}, "matches")
            case _:
                raise ValueError(f"name must be one of {self.names}, got {name!r}")

    def check(self, contestant: Contestant) -> None:
        """AssertionError if an answer is not that of the reference: a median of the library to the bit."""
        for matches, expected in zip(self.pool(), _expected(self), strict=True):
            answer = contestant.answer(matches)
            ours = hasattr(answer, "scale")
            rtol = 0.0 if ours and isinstance(self.estimator, MedianRatio) else 1e-12 if ours else 1e-6
            scale = getattr(answer, "scale", answer)
            np.testing.assert_allclose(scale, expected, rtol, err_msg=f"{self}: {contestant.name} is wrong")


def _noisy(random: np.random.Generator, count: int) -> tuple[Any, Any]:
    before = random.uniform((550.0, 180.0), (700.0, 330.0), (count, 2))
    return before, (before - 600.0) * 1.01 + 600.0 + random.normal(0.0, 0.4, (count, 2))


def _on_pixels(random: np.random.Generator, count: int) -> tuple[Any, Any]:
    before, now = _noisy(random, count)
    return np.round(before), np.round(now)


def _almost_equal(random: np.random.Generator, count: int) -> tuple[Any, Any]:
    before, _ = _noisy(random, count)
    return before, before * 1.01


def _equal(random: np.random.Generator, count: int) -> tuple[Any, Any]:
    before, _ = _noisy(random, count)
    return before, before * 2.0


def _near(random: np.random.Generator, count: int) -> tuple[Any, Any]:
    before, now = _noisy(random, count)
    return before, now * 0.4


KINDS = {
    "noisy": _noisy,
    "on pixels": _on_pixels,
    "ratios almost equal": _almost_equal,
    "ratios equal": _equal,
    "hardly a pair counts": _near,
}


@lru_cache(maxsize=8)
def _matches(count: int, dtype: str, kind: str) -> list[Any]:
    random = np.random.default_rng(2026)
    return [tuple(array.astype(dtype) for array in KINDS[kind](random, count)) for _ in range(POOL)]


@lru_cache(maxsize=64)
def _expected(case: Case) -> list[float]:
    every = [(before, now) for before, now in case.pool()]
    return [reference.ttc_from_keypoints(before, now, 0.1, estimator=case.estimator).scale for before, now in every]


MEDIANS = {count: Case(MedianRatio(), count) for count in SIZES}
KIND_CASES = [Case(MedianRatio(), count, kind=kind) for count in (200, 3000) for kind in KINDS if kind != "noisy"]
CASES = [
    *MEDIANS.values(),
    *KIND_CASES,
    *(Case(MedianRatio(), count, "float64") for count in (200, 3000)),
    *(Case(estimator, count) for estimator in (Consensus(), LeastSquares()) for count in (50, 200, 1000)),
]
