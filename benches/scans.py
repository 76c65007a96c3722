"""``ScanTTC``, ``ittc`` and ``RangeRate``: scans of the rooms that a car drives through.

Each question about scans is asked in two ways: in the library's words, and by a function of ``by_numpy``, and of
``by_numba`` where it has one of that name, which gets tables made once.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import by_numba, by_numpy, car, native
from benches.case import OURS, TWO_THREADS, Case, Goal, Implementation, Share
from benches.inputs import turns
from ttc_fast import reference

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

RATED_SCANS = 64

SHORT_SCAN = (
    "Part of it is the call itself (scan.min of 1 beam, below). Of what is left, a prototype of the kernel takes about "
    "half with 271 beams, and nearly all with more. The rest is to decide in float64: the least of the lanes, the "
    "block it is in, the beam and its time wait for one another, about 150 cycles."
)
LONG_SCAN = (
    "The bytes bound it more than anything: the whole call runs at about two thirds of the speed of a bare read "
    "(below). The rest is four operations for each 64 bytes, and deciding in the few blocks of beams that are left."
)
PER_BEAM = (
    "The way to the second cache bounds it: for each 64 bytes of ranges ahead, 128 of tables are read (offsets and "
    "inverse cosines) and 64 written; a copy reads 64 and writes 64. With a third fewer operations (ranges compared "
    "and times selected in one step) 1080 beams, whose tables stay in the first cache, took 13 % less time, and "
    "65,536 the same."
)
BATCH = "Each row is a search of its own, and takes what the kernel takes for a single scan of 1080 beams (above)."
RATES = (
    "Arithmetic bounds it: about forty operations in float64 for each beam and remembered scan (6 of them at 10 Hz, 21 "
    "at 40 Hz), and what is summed up for a beam does not fit in the registers."
)
COUNTS = (
    "It counts the readings of each kind as well, which takes about 4 ns for 16 beams: with 4096, longer than the "
    "search."
)
TURNING = "A beam takes its cosine and its sine, two products and a reciprocal, instead of one factor from a table."
THREADS = (
    "The thread that asks works on whatever nobody has begun, and waits for nobody who has not. So it depends on the "
    "second thread: where it got a core in time, a batch took 0.53 of the time of one thread; where it came too "
    "late, 1.0 to 1.03; and on a machine busy with other work up to 1.2, because a helper that is interrupted "
    "within its piece is waited for."
)


@dataclass(frozen=True)
class Question:
    """One question, in the words of the library and as a function with its tables."""

    call: str
    library: str
    function: str
    arguments: str
    exact: str
    """The time of each beam, in the words of ``by_numpy``."""
    every_beam: bool = False
    """Whether the answer has a time for each beam, or only the least."""


_ONE, _TURNING, _EACH, _TURNING_EACH = (
    "ranges, speed, cosines, offsets",
    "ranges, speed, sideways, cosines, sines, offsets",
    "ranges, speeds, cosines, offsets",
    "ranges, speeds, each_sideways, cosines, sines, offsets",
)
_EXACT, _EXACT_EACH = f"per_beam({_ONE})", f"per_beam_each({_EACH})"
_EXACT_TURNING = "times(ranges, speed * cosines + sideways * sines, offsets)"
MIN = Question("min", "scan.min(ranges, speed)", "least", _ONE, _EXACT)
NEAREST = Question("nearest", "scan.nearest(ranges, speed)", "nearest", _ONE, _EXACT)
EVERY = Question("per_beam", "scan.per_beam(ranges, speed, out=out)", "per_beam", _ONE, _EXACT, True)
ITTC = Question(
    "ittc", "ittc(ranges, closing_speed=closing, out=out)", "ittc", "ranges, closing", "ittc(ranges, closing)", True
)
MIN_TURNING = Question("min, turning", "scan.min(ranges, speed, yaw_rate)", "least_turning", _TURNING, _EXACT_TURNING)
NEAREST_TURNING = Question(
    "nearest, turning", "scan.nearest(ranges, speed, yaw_rate)", "nearest_turning", _TURNING, _EXACT_TURNING
)
BATCHES = (
    Question("min", "scan.min(ranges, speeds)", "least_each", _EACH, _EXACT_EACH),
    Question("nearest", "scan.nearest(ranges, speeds)", "nearest_each", _EACH, _EXACT_EACH),
    Question("per_beam", "scan.per_beam(ranges, speeds, out=out)", "per_beam_each", _EACH, _EXACT_EACH, True),
)
BATCH_TURNING = Question(
    *("min, turning", "scan.min(ranges, speeds, yaw_rates)", "least_turning_each", _TURNING_EACH),
    f"times_each({_TURNING_EACH})",
)

_scenes = {name: lru_cache(maxsize=2)(scene) for name, scene in car.SCENES.items()}


def _parts(answer: Any) -> tuple[Any, Any]:
    """Return the times, and the beams if the answer names them."""
    if isinstance(answer, tuple):
        times, beams = answer
        return times, beams
    return getattr(answer, "ttc", answer), getattr(answer, "beam", None)


@dataclass(frozen=True)
class Scans:
    """A question about scans of one size, or about batches of ``rows`` scans."""

    question: Question
    beams: int
    dtype: str = "float32"
    rows: int | None = None
    scene: str = "rooms"
    """One of ``car.SCENES``."""
    is_one: bool = False
    """Whether it is the same scan, or batch, again and again."""

    def case(self, *goals: Goal, why: str = "", by_level: bool = False) -> Case:
        """Make the case."""
        size = f"{self.beams}" if self.rows is None else f"{self.rows}x{self.beams}"
        scene = ("" if self.scene == "rooms" else f" {self.scene}") + " same scan" * self.is_one
        return Case(
            *(self.question.call, f"{size} {self.dtype}{scene}", self.inputs, self._implementations(), self.compare),
            *(goals, by_level, why),
        )

    def inputs(self) -> list[Any]:
        """Make scans, or batches of them."""
        calls = turns(self._nbytes())
        scans = _scenes[self.scene](calls * (self.rows or 1), self.beams, self.dtype)
        every = list(scans if self.rows is None else scans.reshape(calls, self.rows, self.beams))
        return every[:1] if self.is_one else every

    def compare(self, implementation: Implementation, inputs: Sequence[Any]) -> None:
        """Hold every answer to plain NumPy in float64."""
        exact = Implementation(self.question.exact, self._tables(by_numpy, "float64"))
        # Of float32 tables and differences of float32 ranges; of ratios in float64 otherwise.
        rtol = 1e-4 if self.dtype == "float32" else 1e-9
        for ranges in inputs:
            every, answer = exact.answer(ranges.astype(np.float64)), implementation.answer(ranges)
            assert np.isfinite(every).any(), "nothing to find"
            times, beams = _parts(answer)
            expected = every if self.question.every_beam else every.min(axis=-1)
            np.testing.assert_allclose(times, expected, rtol, err_msg=f"{implementation} is wrong")
            if beams is not None:
                chosen = np.take_along_axis(every, np.expand_dims(beams, -1), axis=-1)[..., 0]
                np.testing.assert_allclose(chosen, expected, rtol, err_msg=f"{implementation} names a wrong beam")

    def _nbytes(self) -> int:
        return self.beams * (self.rows or 1) * np.dtype(self.dtype).itemsize

    def _implementations(self) -> dict[str, Callable[[], Implementation]]:
        question = self.question
        call = f"{question.function}({question.arguments})"
        every: dict[str, Callable[[], Implementation]] = {
            OURS: lambda: Implementation(question.library, self._objects(ttc_fast)),
            "reference": lambda: Implementation(question.library, self._objects(reference)),
            "NumPy": lambda: Implementation(call, self._tables(by_numpy, self.dtype)),
        }
        if hasattr(by_numba, question.function):
            every["numba"] = lambda: Implementation(call, self._tables(by_numba, "float64"))
        every |= native.bare(self._nbytes(), copies=question.every_beam)
        if self.rows is not None:
            every[TWO_THREADS] = lambda: Implementation(question.library, self._objects(ttc_fast, threads=2))
        return every

    def _objects(self, module: ModuleType, **settings: Any) -> dict[str, Any]:
        """Return the names of an expression in the library's words."""
        shape = self.beams if self.rows is None else (self.rows, self.beams)
        scan = module.ScanTTC(*car.place(self.beams), **car.SETTINGS, **settings)
        return {"scan": scan, "ittc": module.ittc, "out": np.empty(shape, self.dtype), **self._motion(self.dtype)}

    def _tables(self, module: ModuleType, dtype: str) -> dict[str, Any]:
        """Return the names of an expression that calls a function with tables of ``dtype``."""
        cosines, sines = car.directions(self.beams)
        tables = {"cosines": cosines, "sines": sines, "offsets": car.offsets(self.beams)}
        tables = {name: table.astype(dtype) for name, table in tables.items()}
        return {**vars(module), **tables, **self._motion(dtype)}

    def _motion(self, dtype: str) -> dict[str, Any]:
        rng = np.random.default_rng(0)
        speeds, yaw_rates = rng.uniform(0.5, 10.0, self.rows or 1), rng.uniform(-1.0, 1.0, self.rows or 1)
        return {
            "speed": car.SPEED,
            "speeds": speeds.astype(dtype),
            "yaw_rate": car.YAW_RATE,
            "sideways": car.YAW_RATE * car.MOUNT[0],
            "yaw_rates": yaw_rates.astype(dtype),
            "each_sideways": (yaw_rates * car.MOUNT[0]).astype(dtype),
            "closing": (car.SPEED * car.directions(self.beams)[0]).astype(self.dtype),
        }


def _call_of_one_beam() -> Case:
    """Make the case of a call without a kernel."""
    names = {"scan": ttc_fast.ScanTTC(0.0, 0.1, 1), "speed": car.SPEED}

    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        assert implementation.answer(inputs[0]) == 2.0 / car.SPEED

    call = {OURS: lambda: Implementation(MIN.library, names)}
    return Case("min", "1 float32", lambda: [np.array([2.0], np.float32)], call, compare)


def _prototype(beams: int) -> Goal:
    """Return the goal of a call beside one of one beam and a prototype of the kernel."""
    scans = turns(4 * beams)

    def kernel() -> Implementation:
        return native.least_keys(scans, car.directions(beams)[0], car.RANGE_MIN, car.RANGE_MAX)

    kernels = {native.PROTOTYPE: kernel} if native.AVAILABLE else {}

    def pool() -> list[Any]:
        return [car.rooms(scans, beams, "float32")]

    case = Case("prototype", f"{beams} float32", pool, kernels, compare=lambda *_: None)  # it verifies itself
    label = "call of 1 beam + prototype"
    return Goal(1.35, other=ONE_BEAM, plus=Share(case, native.PROTOTYPE, scans * native.ROUNDS), label=label)


def _same_scan(beams: int) -> Goal:
    """Return the goal that new scans take hardly longer than one that the processor knows by heart."""
    return Goal(1.1, other=Scans(MIN, beams, is_one=True).case(), label="same scan again and again")


ONE_BEAM = _call_of_one_beam()
MINIMUM = {
    beams: Scans(MIN, beams).case(
        *(Goal(numpy, "NumPy"), Goal(numba, "numba"), *((_prototype(beams), _same_scan(beams)) if is_short else ())),
        why=SHORT_SCAN if is_short else LONG_SCAN,
        by_level=beams in (1080, 65_536),
    )
    for beams, numpy, numba, is_short in (
        (271, 100, 9, True),
        (1080, 75, 14, True),
        (4096, 50, 20, True),
        (65_536, 34, 22, False),
    )
}


def _beside_min(limit: float, beams: int) -> tuple[Goal, ...]:
    """Return the goal of another question about short scans beside ``min``."""
    return (Goal(limit, other=MINIMUM[beams], label="min, straight"),) if beams < 65_536 else ()


_turning = {
    scene: Scans(MIN_TURNING, 1080, scene=scene).case(*(_beside_min(1.6, 1080) if scene == "rooms" else ()))
    for scene in car.SCENES
}
_nearest_turning = {
    scene: Scans(NEAREST_TURNING, 1080, scene=scene).case(Goal(4, other=other, label="min, same scans"))
    for scene, other in _turning.items()
}
_per_beam = {
    beams: Scans(EVERY, beams).case(Goal(20, "NumPy"), Goal(0.6, native.COPY), why=PER_BEAM, by_level=beams == 1080)
    for beams in (1080, 65_536)
}
_batch = Scans(BATCHES[0], 1080, rows=1024).case(
    *(Goal(33, "NumPy"), Goal(3, "numba"), Goal(0.5, native.READ)),
    Goal(1.6, ours=TWO_THREADS, label="one thread", why=THREADS),
    why=BATCH,
    by_level=True,
)
_beside_float32 = Goal(2.2, other=_batch, label="float32")
CASES = [
    *MINIMUM.values(),
    *(
        Scans(NEAREST, beams).case(*_beside_min(2.5, beams), why=COUNTS, by_level=beams == 1080)
        for beams in (271, 1080, 4096, 65_536)
    ),
    *(Scans(MIN_TURNING, beams).case(*_beside_min(1.6, beams), why=TURNING) for beams in (271, 4096, 65_536)),
    *_per_beam.values(),
    *(Scans(EVERY, beams).case() for beams in (271, 4096)),
    *(Scans(ITTC, beams).case() for beams in (271, 1080, 4096, 65_536)),
    *(*_turning.values(), *_nearest_turning.values()),
    Scans(MIN, 1080, "float64").case(Goal(2.2, other=MINIMUM[1080], label="float32"), why=SHORT_SCAN),
    Scans(MIN, 65_536, "float64").case(Goal(2.2, other=MINIMUM[65_536], label="float32"), why=LONG_SCAN),
    Scans(EVERY, 65_536, "float64").case(Goal(2.2, other=_per_beam[65_536], label="float32"), why=PER_BEAM),
    *(Scans(question, 1080, "float64").case() for question in (NEAREST, EVERY, ITTC)),
    _batch,
    Scans(BATCHES[0], 1080, "float64", rows=1024).case(_beside_float32, why=BATCH),
    Scans(BATCH_TURNING, 1080, rows=1024).case(Goal(3, "numba"), Goal(0.3, native.READ), why=BATCH),
    *(Scans(question, 1080, rows=1024).case() for question in BATCHES[1:]),
]


@lru_cache(maxsize=4)
def _scans_of_a_room(beams: int) -> list[Any]:
    """Make scans of one room, each with noise, error codes and dropouts of its own."""
    rng = np.random.default_rng(beams)
    scans = car.rooms(1, beams, "float64") + rng.normal(0.0, 0.01, (RATED_SCANS, beams))
    scans[rng.random(scans.shape) < 0.02] = np.nan
    return list(scans.astype("float32"))


def _range_rate(beams: int, hertz: int, *goals: Goal) -> Case:
    """Make the case of a car that stands, and whose scanner turns ``hertz`` times a second."""

    def made(module: ModuleType) -> Implementation:
        """Make an implementation with a clock of its own."""
        rates = module.RangeRate(module.ScanTTC(*car.place(beams), **car.SETTINGS))
        names = {"rates": rates, "stamps": itertools.count(0.0, 1.0 / hertz)}
        return Implementation("rates.update(ranges, next(stamps))", names)

    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        specified = made(reference)
        for ranges in inputs[:16]:
            said, right = implementation.answer(ranges), specified.answer(ranges)
            assert (said.ttc, said.status, said.rated) == (right.ttc, right.status, right.rated)
        assert said.rated > beams / 3

    implementations = {OURS: partial(made, ttc_fast), "reference": partial(made, reference)}
    inputs = partial(_scans_of_a_room, beams)
    return Case(
        "RangeRate.update", f"{beams} at {hertz} Hz float32", inputs, implementations, compare, goals, why=RATES
    )


RATE_CASES = [
    _range_rate(271, 10),
    *(_range_rate(1080, hertz, Goal(20, "reference")) for hertz in (10, 40)),
    _range_rate(4096, 10),
]
