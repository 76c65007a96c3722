"""``ttc_from_keypoints``: the scale of matched keypoints, and who finds it."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import by_numpy, native
from benches.case import OURS, TWO_THREADS, Case, Goal, Implementation
from benches.inputs import FEWEST, turns
from ttc_fast import Consensus, LeastSquares, MedianRatio, TrimmedMeanRatio, reference

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

SOURCE = (
    "a car 150 px wide and high that grows by a hundredth, with 0.4 px of noise; about three of ten pairs are 100 px "
    "apart"
)
LEAST = 100.0
"""The least distance of a pair that counts, px."""
MOST_PICTURES = 12_000
"""The reference takes seconds for many matches, whose pairs no branch predictor learns: they come in fewer pictures."""
ONE_BY_ONE = (
    "Of 200 matches, the pass over all pairs takes about a third, and deciding the few hundred ratios that may be the "
    "median a quarter: one by one in float64, where the prototype ranks them in float32. The rest are the sample, the "
    "standard error and the call, which do not shrink as the pairs do. Of 3000 matches, most of it is the pass."
)
IMAGE = "Most pairs of an image are 100 px apart, and three of ten of a car: what is too near takes no time."
REFINED = (
    "It hardly depends on the number of pairs: two fifths of it are the votes on 200 similarities, a quarter fits to "
    "the matches that agree, in turn, and a seventh the count of their pairs."
)
SAMPLE = (
    "Each pair of the sample, of which there are 64 for each match, takes a division and most of them a root in "
    "float64; the median compares in float32."
)
ALIKE = (
    "Ratios that are the same have to be computed in float64 for every pair, which takes several times a comparison "
    "in float32."
)


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


def _image(noise: float) -> Callable[[np.random.Generator, int], tuple[Any, Any]]:
    """Return what makes matches all over a picture that grows by a twentieth."""

    def matches(random: np.random.Generator, count: int) -> tuple[Any, Any]:
        before = random.uniform(0.0, 1200.0, (count, 2))
        return before, before * 1.05 + random.normal(0.0, noise, (count, 2))

    return matches


IMAGES = {f"all over the image, {noise} px": _image(noise) for noise in (0, 3, 30)}
ORDINARY = "all over the image, 3 px"
ODD = {
    "on pixels": _on_pixels,
    "ratios almost equal": _almost_equal,
    "ratios equal": _equal,
    "hardly a pair counts": _near,
}
KINDS = {"noisy": _noisy, **ODD, **IMAGES}


def _pictures(count: int) -> int:
    """Return the number of pictures that take turns."""
    return turns(16 * count, most=max(FEWEST, MOST_PICTURES // count))


@lru_cache(maxsize=8)
def _matches(count: int, dtype: str, kind: str) -> list[Any]:
    random = np.random.default_rng(2026)
    return [tuple(array.astype(dtype) for array in KINDS[kind](random, count)) for _ in range(_pictures(count))]


@lru_cache(maxsize=64)
def _scales(estimator: Any, count: int, dtype: str, kind: str) -> list[float]:
    """Return the scales by the reference."""
    specified: Any = reference.ttc_from_keypoints
    return [specified(*each, 0.1, estimator=estimator).scale for each in _matches(count, dtype, kind)]


def _case(estimator: Any, count: int, *goals: Goal, dtype: str = "float32", kind: str = "noisy") -> Case:
    own = {"estimator": estimator, "least": LEAST}

    def made(expression: str, module: Any) -> Implementation:
        return Implementation(expression, {**vars(module), **own}, "matches")

    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        """Hold every scale to that of the reference: a median of the library to the bit."""
        for matches, expected in zip(inputs, _scales(estimator, count, dtype, kind), strict=True):
            answer = implementation.answer(matches)
            ours = hasattr(answer, "scale")
            rtol = 0.0 if ours and isinstance(estimator, MedianRatio) else 1e-12 if ours else 1e-6
            scale = getattr(answer, "scale", answer)
            np.testing.assert_allclose(scale, expected, rtol, err_msg=f"{implementation} is wrong")

    library = "ttc_from_keypoints(*matches, 0.1, estimator=estimator)"
    every: dict[str, Callable[[], Implementation]] = {
        OURS: partial(made, library, ttc_fast),
        "reference": partial(made, library, reference),
    }
    if estimator == MedianRatio() and kind == "noisy":
        every["NumPy"] = partial(made, "median_ratio(*matches, least)", by_numpy)
        if by_numpy.distance is not None:
            every["SciPy"] = partial(made, "median_ratio_by_scipy(*matches, least)", by_numpy)
        if count >= 2000:
            every[TWO_THREADS] = partial(made, library.replace("r)", "r, threads=2)"), ttc_fast)
    size = f"{count} {dtype}{'' if kind == 'noisy' else ' ' + kind}"
    return Case(str(estimator), size, partial(_matches, count, dtype, kind), every, compare, goals)


def _prototype(count: int, limit: float, why: str) -> Goal:
    """Return the goal of a call beside a prototype of the median, at a car's matches."""

    def pool() -> list[Any]:
        return [np.array(_matches(count, "float32", "noisy"))]

    def kernel() -> Implementation:
        return native.median_ratios(_scales(MedianRatio(), count, "float32", "noisy"), count, LEAST)

    kernels = {native.PROTOTYPE: kernel} if native.HAS_MEDIAN else {}
    case = Case("median prototype", f"{count} float32", pool, kernels, compare=lambda *_: None)  # it verifies itself
    of = _pictures(count) * native.ROUNDS
    return Goal(limit, native.PROTOTYPE, case, of=of, label="prototype, a car", why=why)


COUNTS = (200, 1000, 3000)
_medians = {
    count: _case(
        MedianRatio(),
        count,
        Goal(limit, "reference", why=ONE_BY_ONE),
        *([_prototype(count, 1.4, ONE_BY_ONE)] if count in COUNTS else []),
    )
    for count, limit in ((50, 30), (200, 140), (1000, 270), (3000, 350))
}


def _beside_median(estimator: Any, count: int, limit: float, why: str) -> Case:
    """Return a case all over the image that may take ``limit`` times as long as the median of a car's matches."""
    goal = Goal(limit, other=_medians[count], label="median of a car", why=why)
    return _case(estimator, count, goal, kind=ORDINARY)


CASES = [
    *_medians.values(),
    *(_case(MedianRatio(), 200, kind=kind) for kind in ODD),
    *(_case(MedianRatio(), 3000, Goal(10, other=_medians[3000], label="noisy", why=ALIKE), kind=kind) for kind in ODD),
    *(_case(MedianRatio(), count, _prototype(count, 2.5, IMAGE), kind=kind) for count in COUNTS for kind in IMAGES),
    *(_beside_median(Consensus(), count, 1.5, REFINED) for count in COUNTS),
    *(_beside_median(TrimmedMeanRatio(), count, 3, SAMPLE) for count in COUNTS),
    *(
        _case(MedianRatio(), count, Goal(2.2, other=_medians[count], label="float32", why=ALIKE), dtype="float64")
        for count in (200, 3000)
    ),
    *(_case(estimator, count) for estimator in (Consensus(), LeastSquares()) for count in (50, 200, 1000)),
]
