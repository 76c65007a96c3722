"""Settings from a file: the same names as everywhere, and errors that say which setting and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from ttc_fast import BrakeController, Command, IttcThreshold, StoppingDistance
from ttc_fast.configuration import Configuration, ConfigurationError

if TYPE_CHECKING:
    from pathlib import Path

FILE = """
[scan]
outline = [-0.1, 0.4, -0.15, 0.15]
limits = [0.1, 10.0]

[gate]
y = [-1.0, 1.0]

[range_rate]
window = 0.4

[[criteria]]
kind = "IttcThreshold"
threshold = 0.7

[[criteria]]
kind = "StoppingDistance"
deceleration = 4.0

[brake]
trigger = [1, 2]
when_blind = "warn"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "brake.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("mark", ["", "\ufeff"])  # editors of Windows begin a file with a byte-order mark
def test_a_file(mark: str, tmp_path: Path) -> None:
    settings = Configuration.read(written(tmp_path, mark + FILE))
    assert settings.criteria == (IttcThreshold(0.7), StoppingDistance(deceleration=4.0))
    assert settings.brake == {"trigger": (1, 2), "when_blind": Command.WARN}
    scan = settings.scanner(angle_min=-1.0, angle_increment=0.1, beams=21, range_max=30.0)
    controller = settings.controller(scan)
    assert isinstance(controller, BrakeController)
    assert controller.update(0.0).command is Command.WARN


def test_nothing_set_is_the_default() -> None:
    scan = Configuration().scanner(angle_min=-1.0, angle_increment=0.1, beams=21)
    assert Configuration().controller(scan).update(0.0).command is Command.BRAKE


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"scann": {}}, "did you mean scan"),
        ({"scan": {"outlin": []}}, "scan has no setting 'outlin': did you mean outline"),
        ({"scan": 5}, "scan must be a table"),
        ({"criteria": [{"kind": "Ittc"}]}, "kind must be one of IttcThreshold"),
        ({"criteria": [{"threshold": 1.0}]}, "kind must be one of"),
        ({"criteria": [{"kind": "IttcThreshold", "threshold": -1.0}]}, "IttcThreshold: threshold must be finite"),
        ({"criteria": [{"kind": "IttcThreshold", "deceleration": 1.0}]}, "no setting 'deceleration'"),
        ({"brake": {"when_blind": "pray"}}, "when_blind must be 'brake' or 'warn'"),
        ({"brake": {"scan": {}}}, "brake has no setting 'scan'"),
        ({"gate": {"y": [2.0, -2.0]}}, "gate: "),
    ],
)
def test_what_cannot_be_used_is_named(parts: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        Configuration.of(parts)


def test_settings_that_only_fail_together_are_named_as_well() -> None:
    scan = Configuration().scanner(angle_min=-1.0, angle_increment=0.1, beams=21)
    settings = Configuration.of({"criteria": [{"kind": "SweptPathThreshold"}]})
    with pytest.raises(ConfigurationError, match="brake: SweptPathThreshold needs an outline"):
        settings.controller(scan)


@pytest.mark.parametrize(("text", "says"), [("[scan", "is not TOML"), ("[brake]\nhold = 'x'", "")])
def test_a_damaged_file_is_named(tmp_path: Path, text: str, says: str) -> None:
    path = written(tmp_path, text)
    if says:
        with pytest.raises(ConfigurationError, match=f"brake.toml: {says}"):
            Configuration.read(path)
    with pytest.raises(ConfigurationError, match=r"missing\.toml: cannot be read"):
        Configuration.read(tmp_path / "missing.toml")
