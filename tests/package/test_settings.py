"""The one description of each setting agrees with the constructor that it describes."""

from __future__ import annotations

import contextlib
import inspect
import math
import re
from typing import Any

import pytest

import ttc_fast
from ttc_fast._settings import GATE, RANGE_RATE, REQUIRED, SCAN, Count, Kind, Number, Setting, settings_of
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.configuration import BRAKE, CRITERIA, Configuration, ConfigurationError
from ttc_fast.ros.settings import AT_START, NodeSettings, parameters_of_node

SCAN_OF_3 = ttc_fast.ScanTTC(0.0, 0.1, 3)
NEEDED: dict[str, dict[str, Any]] = {
    "ScanTTC": {"angle_min": 0.0, "angle_increment": 0.1, "beams": 3},
    "RangeRate": {"scan": SCAN_OF_3},
    "BrakeController": {"scan": SCAN_OF_3},
}
NOT_SETTINGS = {"RangeRate": {"scan"}, "BrakeController": {"criteria", "scan", "path", "range_rate", "views"}}
"""Arguments that are objects which the caller makes."""
DESCRIBED: dict[str, tuple[Setting, ...]] = {
    "ScanTTC": SCAN,
    "Gate": GATE,
    "RangeRate": RANGE_RATE,
    "BrakeController": BRAKE,
    **{name: settings_of(kind) for name, kind in CRITERIA.items()},
}
ALL = [(name, each) for name, table in DESCRIBED.items() for each in table]
EVERY = [pytest.param(*pair, id=f"{pair[0]}.{pair[1].name}") for pair in ALL]
NUMBERS = [
    pytest.param(*pair, id=f"{pair[0]}.{pair[1].name}") for pair in ALL if isinstance(pair[1].kind, (Number, Count))
]
PART = {"scan": SCAN, "gate": GATE, "range_rate": RANGE_RATE, "brake": BRAKE}


@pytest.mark.parametrize("name", DESCRIBED)
def test_names_and_defaults_are_those_of_the_constructor(name: str) -> None:
    parameters = inspect.signature(getattr(ttc_fast, name)).parameters
    expected = {key: each.default for key, each in parameters.items() if key not in NOT_SETTINGS.get(name, ())}
    assert {each.name: inspect.Parameter.empty if each.default is REQUIRED else each.default
            for each in DESCRIBED[name]} == expected  # fmt: skip


@pytest.mark.parametrize(("name", "setting"), EVERY)
def test_defaults_can_be_given(name: str, setting: Setting) -> None:
    if setting.default is not REQUIRED:
        assert setting.check(setting.default) == setting.default
        assert setting.read(setting.plain_default) == setting.default
        getattr(ttc_fast, name)(**{**NEEDED.get(name, {}), setting.name: setting.default})


def out_of_range(kind: Kind) -> list[float]:
    """Numbers that the description refuses."""
    if isinstance(kind, Count):
        return [kind.least - 1]
    assert isinstance(kind, Number)
    wrong = [math.nan] if kind.infinite else [math.nan, math.inf, -math.inf]
    wrong += [0.0, -1.0] if kind.positive else []
    wrong += [] if kind.least is None else [kind.least - 1e-6]
    return wrong + ([] if kind.most is None else [kind.most * 1.001])


@pytest.mark.parametrize(("name", "setting"), NUMBERS)
def test_the_constructor_refuses_what_the_description_refuses(name: str, setting: Setting) -> None:
    for value in out_of_range(setting.kind):
        with pytest.raises(ValueError, match=setting.name):
            setting.check(value)
        if setting.name == "no_data":  # NaN is an answer that the caller may choose
            continue
        with pytest.raises((ValueError, OverflowError)):
            getattr(ttc_fast, name)(**{**NEEDED.get(name, {}), setting.name: value})


@pytest.mark.parametrize(("name", "setting"), EVERY)
def test_each_has_a_sentence_and_a_unit_that_the_docstring_has_too(name: str, setting: Setting) -> None:
    assert re.fullmatch(r"[A-Za-z(].{10,}\.", setting.sentence)
    doc = inspect.getdoc(getattr(ttc_fast, name)) or ""
    found = re.search(rf"^(?:\w+, )*{setting.name}\b[^\n]* :[^\n]*\n((?: .*\n?)+)", doc, re.MULTILINE)
    assert found is not None
    unit = setting.kind.unit.replace("m, m and rad", "rad")
    if setting.name != "no_data":  # which is whatever the caller wants to see
        assert re.search(rf"(?<!\w){re.escape(unit)}(?!\w)", found[1].replace("seconds", "s"))


@pytest.mark.parametrize("value", [True, "1.0", None, [1.0], {}, "x"])
@pytest.mark.parametrize("setting", [each for each in parameters_of_node() if isinstance(each.kind, (Number, Count))])
def test_what_is_no_number_is_none_in_a_file(setting: Setting, value: Any) -> None:
    with pytest.raises(TypeError, match=f"{setting.name} must be a"):
        setting.read(value)


@pytest.mark.parametrize("value", [5, True, "x", None, [], [{}], {}, [[1]], 10**400, -1, math.nan])
@pytest.mark.parametrize("part", PART)
def test_every_value_of_a_file_is_read_or_refused(part: str, value: Any) -> None:
    for each in PART[part]:
        with contextlib.suppress(ConfigurationError):
            settings = Configuration.of({part: {each.name: value}})
            settings.controller(settings.scanner(**{**NEEDED["ScanTTC"], "range_max": 30.0}))


def test_the_fields_of_the_node_describe_themselves() -> None:
    described = {each.name for each in settings_of(NodeSettings)}
    assert set(NodeSettings.__dataclass_fields__) - described == {"brake", "parts"}
    assert {each.name for each in settings_of(BrakeSettings)} == set(BrakeSettings.__dataclass_fields__)
    assert described >= AT_START
