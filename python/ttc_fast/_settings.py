"""Settings, each described once: name, kind, default, unit, range, and one sentence.

What a setting needs elsewhere follows from its description: the check of a constructor (``check``), the reading of a
value from TOML, YAML or ROS (``read``), its default as such a file has it (``plain_default``), and its line in a help
text (``description``).

The settings of a Python class are fields of a dataclass, made by ``setting``; ``settings_of`` returns them. The
settings of the Rust classes are the tables ``SCAN``, ``GATE`` and ``RANGE_RATE``: their constructors check the ranges.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from contextvars import ContextVar
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from ttc_fast import _validate

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable

REQUIRED = dataclasses.MISSING
"""The default of an argument that has none."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of values. By itself it stands for an object that the constructor checks and that no file can hold.

    Attributes
    ----------
    unit : str
        The unit of the values, or "".
    reason : str
        Why a value out of range makes no sense; a message ends with it.
    """

    unit: str = ""
    reason: str = ""

    def check(self, name: str, value: Any) -> Any:
        """Return the value in its own type. A TypeError or ValueError says why it cannot be used."""
        return value

    def read(self, name: str, value: Any) -> Any:
        """Return a value of a file or of ROS in its own type, or raise as ``check`` does."""
        return self.check(name, value)


@dataclass(frozen=True, kw_only=True)
class Number(Kind):
    """A number: above 0, or from ``least`` to ``most``, and finite unless ``infinite`` says that inf is one too."""

    positive: bool = False
    least: float | None = None
    most: float | None = None
    infinite: bool = False

    def check(self, name: str, value: Any) -> float:
        """Return the value as a float."""
        if self.infinite:
            return _validate.not_nan(name, value, self.least, self.unit)
        if self.positive:
            return _validate.positive(name, value, self.unit)
        if self.least is not None and self.most is not None:
            return _validate.from_to(name, value, self.least, self.most, self.unit)
        if self.least is not None:
            return _validate.at_least(name, value, self.least, self.reason, unit=self.unit)
        return _validate.finite(name, value)


@dataclass(frozen=True, kw_only=True)
class Count(Kind):
    """A whole number from ``least`` to ``most``."""

    least: int = 0
    most: int | None = None

    def check(self, name: str, value: Any) -> int:
        """Return the value as an int."""
        return _validate.count(name, value, self.least, self.most)


@dataclass(frozen=True, kw_only=True)
class Flag(Kind):
    """True or false."""

    def check(self, name: str, value: Any) -> bool:
        """Return the value as a bool."""
        return _validate.flag(name, value)

    def read(self, name: str, value: Any) -> bool:
        """Return the value of a file, where it is called true or false."""
        if not isinstance(value, bool):
            raise TypeError(f"{name} must be true or false, got {_validate.shown(value)}")
        return value


@dataclass(frozen=True, kw_only=True)
class Text(Kind):
    """A text."""

    def check(self, name: str, value: Any) -> str:
        """Return the value."""
        return _validate.text(name, value)


@dataclass(frozen=True, kw_only=True)
class Choice(Kind):
    """One of a few options: texts, or members of an enumeration, whose names a file has in lower case."""

    options: tuple[Any, ...]

    def check(self, name: str, value: Any) -> Any:
        """Return the value."""
        return _validate.choice(name, value, self.options, self.reason)

    def read(self, name: str, value: Any) -> Any:
        """Return the option of this name, or the option itself."""
        by_name = {_plain(option): option for option in self.options}
        if isinstance(self.options[0], Enum):
            if isinstance(value, Enum):
                return self.check(name, value)
            value = value.lower() if isinstance(value, str) else value
        return by_name[_validate.choice(name, value, tuple(by_name), self.reason)]


@dataclass(frozen=True, kw_only=True)
class Numbers(Kind):
    """Several numbers, each of which has a name.

    Where ``ordered`` is < or <=, each two of them are a lower end and an upper one, in this order.
    """

    names: tuple[str, ...] = ("low", "high")
    ordered: str = ""

    def check(self, name: str, value: Any) -> tuple[float, ...]:
        """Return the value as a tuple of floats."""
        numbers = _validate.numbers(name, value, self.names)
        if self.ordered:
            _validate.ordered(name, numbers, self.names, self.ordered)
        return numbers


@dataclass(frozen=True, kw_only=True)
class Texts(Kind):
    """A list of texts, as ``what`` calls them."""

    what: str

    def check(self, name: str, value: Any) -> tuple[str, ...]:
        """Return the value as a tuple."""
        return _validate.texts(name, value, self.what)


@dataclass(frozen=True, kw_only=True)
class Flags(Kind):
    """A list or array of true and false."""

    def check(self, name: str, value: Any) -> Any:
        """Return the value."""
        return _validate.flags(name, value)


@dataclass(frozen=True, kw_only=True)
class Votes(Kind):
    """Two numbers: (N, M) mean N of the last M frames, (share, seconds) a share of the frames of the last seconds."""

    def check(self, name: str, value: Any) -> tuple[int, int] | tuple[float, float]:
        """Return the value as two ints or two floats."""
        return _validate.votes(name, value)


@dataclass(frozen=True)
class Setting:
    """The description of a setting.

    Attributes
    ----------
    name : str
        The name that the setting has everywhere.
    kind : Kind
        The values that it can have, and their unit.
    default : object
        The default; ``REQUIRED`` where there is none. Where it is None, None can be given as well.
    sentence : str
        What the setting does.
    usual : (float, float) or None
        The range that a slider of ROS offers. Values outside it may be right.

    Examples
    --------
    >>> from ttc_fast._settings import Number, Setting
    >>> hold = Setting("hold", Number(unit="s", least=0.0), 0.5, "For this long it brakes on.")
    >>> hold.check(2), hold.description
    (2.0, 'For this long it brakes on (s, default 0.5).')
    >>> hold.check(-1.0)
    Traceback (most recent call last):
        ...
    ValueError: hold must be finite and at least 0 s, got -1.0
    """

    name: str
    kind: Kind
    default: Any
    sentence: str
    usual: tuple[float, float] | None = None

    def check(self, value: Any) -> Any:
        """Return the value of an argument in its own type. A TypeError or ValueError says why it cannot be used."""
        return None if value is None and self.default is None else self.kind.check(self.name, value)

    def read(self, value: Any) -> Any:
        """Return the value of a file or of ROS in its own type, or raise as ``check`` does.

        An empty list stands for None, which neither TOML nor ROS has.
        """
        if self.default is None and (value is None or (isinstance(value, (list, tuple)) and not value)):
            return None
        return self.kind.read(self.name, value)

    @property
    def plain_default(self) -> Any:
        """The default as a file or ROS has it: no None, no tuple, no enumeration."""
        return _plain(self.default)

    @property
    def description(self) -> str:
        """The sentence with the unit and the default."""
        notes = [self.kind.unit] if self.kind.unit else []
        if self.default is not REQUIRED and self.default not in (None, ""):
            import json

            notes.append(f"default {json.dumps(_plain(self.default)).replace('Infinity', 'inf')}")
        return f"{self.sentence.removesuffix('.')} ({', '.join(notes)})." if notes else self.sentence


def setting(default: Any, kind: Kind, sentence: str, usual: tuple[float, float] | None = None) -> Any:
    """Make a field of a dataclass that is a setting; see ``Setting``."""
    return dataclasses.field(default=default, metadata={"kind": kind, "sentence": sentence, "usual": usual})


def settings_of(kind: Any) -> tuple[Setting, ...]:
    """Return the settings of a dataclass; fields that ``setting`` did not make are none."""
    return _settings_of(kind)


@functools.cache
def _settings_of(kind: Hashable) -> tuple[Setting, ...]:
    fields = [each for each in dataclasses.fields(kind) if "sentence" in each.metadata]  # type: ignore[arg-type]
    return tuple(Setting(each.name, default=each.default, **each.metadata) for each in fields)


def check_fields(instance: Any) -> None:
    """Raise a TypeError or ValueError for the first setting of a dataclass object that cannot be used."""
    for each in settings_of(type(instance)):
        each.check(getattr(instance, each.name))


ON_COMMAND_LINE: ContextVar[bool] = ContextVar("ON_COMMAND_LINE", default=False)
"""Whether messages are for a user of the command line; ``ttc_fast.cli`` sets it."""


def flag_of(name: str) -> str:
    """Return how an option is typed on the command line."""
    return f"--{name.replace('_', '-')}"


def option(name: str, value: str = "") -> str:
    """Return how an option is typed, perhaps with its value, where the user is: on the command line or in Python.

    Examples
    --------
    >>> from ttc_fast._settings import ON_COMMAND_LINE, option
    >>> option("stamp_column"), option("clock", "recorded")
    ('the option stamp_column', "the option clock='recorded'")
    >>> token = ON_COMMAND_LINE.set(True)
    >>> option("stamp_column"), option("clock", "recorded")
    ('--stamp-column', '--clock recorded')
    >>> ON_COMMAND_LINE.reset(token)
    """
    if ON_COMMAND_LINE.get():
        import shlex

        return f"{flag_of(name)} {shlex.quote(value)}" if value else flag_of(name)
    return f"the option {name}={value!r}" if value else f"the option {name}"


def hint(name: str, names: Iterable[str]) -> str:
    """Return what may have been meant by a name that is none of these."""
    import difflib  # which takes longer to import than all of this file, for a message that is rare

    names = list(names)
    close = [each for each in names if name and each.startswith(name)] or difflib.get_close_matches(name, names, 1)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"


def _plain(value: Any) -> Any:
    if value is None:
        return []
    if isinstance(value, tuple):
        return list(value)
    return value.name.lower() if isinstance(value, Enum) else value


OUTLINE = Numbers(names=("x_rear", "x_front", "y_right", "y_left"), unit="m", ordered="<")
BOUNDS = Numbers(unit="m", ordered="<=")
MOUNT = Numbers(names=("x", "y", "yaw"), unit="m, m and rad")
POLICY = Choice(options=("horizon", "clamp"))
BEAM_VOTE = "How a speckle is outvoted: KthSmallest or NeighbourSupport."

SCAN = (
    Setting("angle_min", Number(unit="rad"), REQUIRED, "Direction of the first beam in the sensor frame."),
    Setting("angle_increment", Number(unit="rad"), REQUIRED, "Angle from one beam to the next."),
    Setting("beams", Count(least=1), REQUIRED, "Number of beams."),
    Setting("range_min", Number(unit="m", least=0.0), 0.0, "Finite readings below this are discarded."),
    Setting("range_max", Number(unit="m", infinite=True), math.inf, "Finite readings above this are discarded."),
    Setting("limits", Numbers(names=("near", "far"), unit="m"), None, "Valid readings beyond far are never the cause."),
    Setting("limits_policy", POLICY, "horizon", "With clamp, valid readings are moved into the limits."),
    Setting("mount", MOUNT, (0.0, 0.0, 0.0), "Position and direction of the sensor in the vehicle frame."),
    Setting("outline", OUTLINE, None, "Outline of the vehicle in its own frame."),
    Setting("mask", Flags(), None, "True where a beam is to be ignored."),
    Setting("min_closing_speed", Number(unit="m/s", least=0.0), 0.01, "Closing at or below this is not closing."),
    Setting("too_close", Choice(options=("hit", "ignore")), "hit", "What -inf means: a hit at range_min, or nothing."),
    Setting("no_data", Number(unit="s", infinite=True), None, "What min gives for a scan without a valid reading."),
    Setting("minimum", Kind(), None, BEAM_VOTE),
    Setting("threads", Count(least=1), 1, "How many threads may share a batch of scans."),
)
"""The arguments of ``ScanTTC``."""

GATE = (
    Setting("x", BOUNDS, (0.0, math.inf), "Bounds forward, or along the path if curvature is not 0."),
    Setting("y", BOUNDS, (-2.0, 2.0), "Bounds to the left, or from the path if curvature is not 0."),
    Setting("z", BOUNDS, None, "Bounds upward."),
    Setting("intensity", Numbers(ordered="<="), None, "Bounds of the intensity, in the units stored."),
    Setting("axes", Texts(what="coordinates"), ("x", "y", "z"), "Stored coordinates that are forward, left and up."),
    Setting("curvature", Number(unit="1/m"), 0.0, "Curvature of the path, positive to the left."),
    Setting("road", Kind(), None, "A fitted Road, from which height is measured."),
    Setting("height", BOUNDS, None, "Bounds above the road."),
)
"""The arguments of ``Gate``."""

RANGE_RATE = (
    Setting("window", Number(unit="s", positive=True), 0.5, "A rate is fitted to the scans of this last time."),
    Setting("min_scans", Count(least=3), 4, "A beam has no rate before this many readings of one surface."),
    Setting("noise", Number(unit="m", positive=True), 0.01, "Standard deviation of a reading."),
    Setting("max_speed", Number(unit="m/s", positive=True), 20.0, "A range that changes faster is another surface's."),
    Setting(
        "max_acceleration",
        Number(unit="m/s^2", positive=True),
        5.0,
        "A range whose rate changes faster is another surface's.",
    ),
    Setting(
        "gate",
        Number(positive=True),
        3.0,
        "Readings that are further off, in standard deviations, belong to another surface.",
    ),
    Setting(
        "significance",
        Number(positive=True),
        3.0,
        "A beam closes when its closing speed is more than this many standard errors.",
    ),
    Setting(
        "edge",
        Number(unit="m", positive=True),
        0.2,
        "Neighbouring beams whose ranges differ by more see different surfaces.",
    ),
    Setting("minimum", Kind(), None, BEAM_VOTE),
)
"""The arguments of ``RangeRate``, but for the scanner."""
