"""Scanners, scans and motions for hypothesis: ordinary ones, and all that is known to break code like this."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import ttc_fast
from tests.support.common import CAR

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray


# Lanes come in groups of 16, groups in blocks of 8, and there are 64 blocks: counts around each multiple.
EDGES = (1, 2, 15, 16, 17, 31, 33, 127, 128, 129, 255, 257, 1023, 1025, 8191, 8192, 8193, 8209)

dtypes = st.sampled_from([np.float32, np.float64])
seeds = st.integers(0, 2**32 - 1)


@dataclass
class Case:
    """One scanner, one scan or batch, one motion (or a motion for each row)."""

    settings: dict[str, Any]
    ranges: NDArray[Any]
    motion: tuple[Any, ...]


@st.composite
def settings(draw: st.DrawFn, beams: int) -> dict[str, Any]:
    """Draw arguments of ``ScanTTC``."""
    view = draw(st.sampled_from([1e-6, 1.0, math.pi, 1.5 * math.pi, 2 * math.pi, 4 * math.pi - 1e-9]))
    turn = draw(st.sampled_from([1, -1]))
    range_min = draw(st.sampled_from([0.0, 1e-42, 0.02, 0.1, 1.0]))
    return {
        "angle_min": draw(st.sampled_from([0.0, -turn * view / 2, -turn * view / 2, 0.3, -2.0])),
        "angle_increment": turn * view / max(beams - 1, 1),
        "beams": beams,
        "range_min": range_min,
        "range_max": draw(st.sampled_from([math.inf, math.inf, 1e300, 81.91, 30.0, 5.6, range_min * 1.5 + 1e-30])),
        "limits": draw(limits(range_min)),
        "limits_policy": draw(st.sampled_from(["horizon", "clamp"])),
        "mount": draw(mounts),
        "outline": draw(st.none() | st.just(CAR) | outlines()),
        "mask": draw(masks(beams)),
        "min_closing_speed": draw(st.sampled_from([0.01, 0.0, 0.1, 1e-300, 2.0])),
        "too_close": draw(st.sampled_from(["hit", "ignore"])),
        "no_data": draw(st.sampled_from([None, 0.0, 3.5, math.inf])),
        "minimum": draw(minima),
    }


def limits(range_min: float) -> st.SearchStrategy[tuple[float, float] | None]:
    fars = st.sampled_from([10.0, 10.0, 25.0, 1.5, 1e300, math.inf, range_min * 1.01 + 1e-40])
    shares = st.sampled_from([0.0, 0.1, 0.999])
    return st.none() | st.builds(lambda far, share: (min(far, 20.0) * share, far), fars, shares)


# Inside the car, on its edges, outside it; looking forward, sideways and backward.
mounts = st.tuples(
    st.sampled_from([0.25, 0.25, 0.0, 0.4, -0.1]) | st.floats(-1, 1),
    st.sampled_from([0.0, 0.0, 0.1, 0.15, -0.15]) | st.floats(-0.5, 0.5),
    st.sampled_from([0.0, math.pi, -math.pi / 2, 0.1]) | st.floats(-4, 4),
)


def outlines() -> st.SearchStrategy[tuple[float, float, float, float]]:
    length = st.floats(0.01, 3)
    return st.tuples(length.map(lambda x: -x), length, length.map(lambda y: -y), length)


def masks(beams: int) -> st.SearchStrategy[NDArray[np.bool_] | None]:
    def mask(share: float, seed: int) -> NDArray[np.bool_] | None:
        return np.random.default_rng(seed).random(beams) < share if share > 0 else None

    return st.builds(mask, st.sampled_from([0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.3, 1.0]), seeds)


minima = (
    st.none()
    | st.integers(1, 40).map(ttc_fast.KthSmallest)
    | st.integers(1, 4).flatmap(
        lambda window: st.builds(
            ttc_fast.NeighbourSupport,
            st.integers(1, 2 * window),
            st.just(window),
            st.sampled_from([0.0, 0.05, 0.2, 5.0]),
        )
    )
)

speeds = (
    st.sampled_from([5.0, -3.0, 0.0, -0.0, 0.01, 0.1, 1e-7, 5e-324, 1e-42, 1e8]) | st.floats(-60, 60) | st.floats(1, 20)
)
yaw_rates = st.sampled_from([0.0, 0.0, 2.0, -1e-12]) | st.floats(-6, 6)
lateral_speeds = st.sampled_from([0.0, 0.0, -0.0, 0.5, 1e-300]) | st.floats(-5, 5)


def readings(settings: dict[str, Any], dtype: Any) -> NDArray[Any]:
    """Return values that mean something special to a scanner with these settings, in ``dtype``."""
    bounds = [settings["range_min"], settings["range_max"], *(settings["limits"] or ())]
    info = np.finfo(dtype)
    with np.errstate(over="ignore", under="ignore"):
        edges = np.array(bounds, dtype)
        values = np.concatenate(
            [
                edges,
                np.nextafter(edges, dtype(-np.inf)),
                np.nextafter(edges, dtype(np.inf)),
                np.array([np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, -info.max], dtype),
                np.array([info.smallest_subnormal, info.tiny, info.max, info.max / 2], dtype),
                np.array([0.001, 0.015, 0.15, 1.0, 2.0, 1e6], dtype),
            ]
        )
    return values


def scan(rng: np.random.Generator, settings: dict[str, Any], dtype: Any) -> NDArray[Any]:
    """Draw a scan of any number of beams: some world, with some special readings sprinkled in."""
    beams = settings["beams"]
    angles = settings["angle_min"] + settings["angle_increment"] * np.arange(beams) + settings["mount"][2]
    distance = rng.uniform(0.2, 12)
    with np.errstate(all="ignore"):
        worlds: list[Callable[[], NDArray[np.float64]]] = [
            lambda: np.full(beams, distance),
            lambda: distance / np.abs(np.cos(angles)),  # a wall, ahead and behind
            lambda: distance * np.abs(np.cos(angles)),  # every closing beam ties, but for rounding
            lambda: rng.uniform(0.3, 15, beams),
            lambda: distance + rng.normal(0, 0.02, beams),
            lambda: 10.0 ** rng.uniform(-45, 38, beams),
            lambda: rng.choice(np.array([np.nan, np.inf, -np.inf]), beams),
            lambda: np.full(beams, rng.choice(np.array([np.nan, np.inf, -np.inf, 0.0, -0.0]))),
        ]
        world = worlds[rng.integers(len(worlds))]
        ranges: NDArray[Any] = world().astype(dtype)
    special = rng.random(beams) < rng.choice([0.0, 0.01, 0.3])
    ranges[special] = rng.choice(readings(settings, dtype), np.count_nonzero(special))
    return ranges


@st.composite
def cases(draw: st.DrawFn, sizes: Sequence[int] = EDGES) -> Case:
    """Draw one scan and its motion. Few beams are drawn one by one, so that failures shrink; many come from a seed."""
    dtype = draw(dtypes)
    few = draw(st.booleans())
    chosen = draw(settings(draw(st.integers(1, 20) if few else st.sampled_from(sizes))))
    if few:
        ordinary = st.floats(0.25, 15, width=32)
        values = ordinary | ordinary | st.sampled_from(list(readings(chosen, dtype)))
        ranges = draw(hnp.arrays(dtype, chosen["beams"], elements=values, fill=st.nothing()))
    else:
        ranges = scan(np.random.default_rng(draw(seeds)), chosen, dtype)
    return Case(chosen, ranges, (draw(speeds), draw(yaw_rates), draw(lateral_speeds)))


@st.composite
def batches(draw: st.DrawFn) -> Case:
    """Draw a batch of scans, each motion a number for all rows or one for each."""
    dtype, rows = draw(dtypes), draw(st.integers(0, 5))
    chosen = draw(settings(draw(st.sampled_from([1, 17, 129]))))
    rng = np.random.default_rng(draw(seeds))
    ranges = np.array([scan(rng, chosen, dtype) for _ in range(rows)], dtype).reshape(rows, chosen["beams"])
    motion = tuple(
        draw(quantity | st.lists(quantity, min_size=rows, max_size=rows).map(np.array))
        for quantity in (speeds, yaw_rates, lateral_speeds)
    )
    return Case(chosen, ranges, motion)
