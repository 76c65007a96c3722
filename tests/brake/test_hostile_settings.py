"""Files of settings that are made to fill the memory, or that are damaged: each ends in a ConfigurationError."""

from __future__ import annotations

import random
import re
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest

from tests.support.common import peak_of
from tests.support.mutations import mutations
from ttc_fast.configuration import Configuration, ConfigurationError
from ttc_fast.ros.files import read_configuration, read_parameters
from ttc_fast.ros.settings import NodeSettings

if TYPE_CHECKING:
    from pathlib import Path

PARTS = """[scan]
mount = [0.27, 0.0, 0.0]
outline = [-0.1, 0.4, -0.15, 0.15]
limits = [0.0, 8.0]
mask = [true, false]
[gate]
x = [2.0, 40.0]
axes = ["x", "y", "z"]
[range_rate]
window = 0.5
[[criteria]]
kind = "SweptPathThreshold"
threshold = 1.0
[brake]
trigger = [2, 3]
when_blind = "brake"
hold = 0.5
"""
NODES = """/**:
  ros__parameters:
    use_sim_time: true
    ttc_threshold: 0.9
car/ttc_fast:
  ros__parameters:
    outline: [-0.1, 0.4, -0.15, 0.15]
    mount: [0.1, 0.0, 0.0]
    trigger: [1, 2]
    when_blind: brake
    stopping_distance: true
    odom_topics: [/odom, "/vesc/odom"]
"""
FILES = {"car.toml": PARTS, "car.yaml": NODES}
VALUES = """
5 -1 true [] {} '' 'x' 1e999 -1e308 nan inf [1] ['a','b'] 2020-01-01 99999999999999999999999 [[1]] [inf,1] [nan,nan]
[1e308,-1e308,1,2] {a=1} 0 1e-320 null ~ [~] !!binary&x *a [-1,-1] [1,99999] 0x1F 12:30:45 1_000
"""
LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 10)}]\n"
    for before, name in zip("abcdefghi", "bcdefghij", strict=True)
)
MERGES = "a: &a {x: 1}\n" + "".join(
    f"{name}: &{name} {{<<: [{', '.join([f'*{before}'] * 10)}]}}\n"
    for before, name in zip("abcdefghi", "bcdefghij", strict=True)
)


def use(file: Path) -> None:
    """Read a file in every way; a ConfigurationError is the only one that may come."""
    with suppress(ConfigurationError):
        read_configuration(file).controller()
    with suppress(ConfigurationError):
        NodeSettings.of({name: value for name, value in read_parameters(file).items() if name != "dds"}).configuration()
    with suppress(ConfigurationError):
        Configuration.read(file).controller()


@pytest.mark.parametrize("name", FILES)
def test_damaged_settings_end_in_a_configuration_error(name: str, tmp_path: Path) -> None:
    for content in mutations(FILES[name].encode(), 150, seed=3):
        (tmp_path / name).write_bytes(content)
        use(tmp_path / name)


@pytest.mark.parametrize("name", FILES)
def test_values_of_another_kind_end_in_a_configuration_error(name: str, tmp_path: Path) -> None:
    rng = random.Random(5)
    lines = FILES[name].splitlines()
    for _ in range(150):
        changed = list(lines)
        for _ in range(rng.randint(1, 2)):
            at = rng.randrange(len(changed))
            changed[at] = re.sub(r"(?<=[=:] ).+", lambda _: rng.choice(VALUES.split()), changed[at])
        (tmp_path / name).write_text("\n".join(changed))
        use(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("car.yaml", LAUGHS, "it has 90 aliases, more than 16: write out what they stand for"),
        ("car.yaml", MERGES, "it has 90 aliases"),
        ("car.yaml", "hold: " + "9" * 2_000_000, "has more than 1 MB, which are no settings"),
        ("car.yaml", "[" * 90_000, "is nested too deeply"),
        ("car.yaml", "- " * 40_000, "is nested too deeply"),
        ("car.toml", "a = " + "[" * 90_000, "is nested too deeply"),
        ("car.toml", "a." * 40_000 + "a = 1", "is nested too deeply"),
        ("car.toml", "hold = " + "9" * 90_000, "is not TOML"),
        ("car.toml", f"criteria = [{'1, ' * 20_000}]", "kind must be one of"),
        ("car.toml", f"outline = [{'1, ' * 20_000}]", r"outline must be 4 numbers .*, got \[1, 1, .*\.\.\.\]$"),
        ("car.toml", f"scan = '{'x' * 900_000}'", r"scan must be a table of settings, got 'xxx.*\.\.\..*xxx'$"),
    ],
)
def test_what_is_made_to_fill_the_memory_is_refused(name: str, text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)

    def refuse() -> None:
        with pytest.raises(ConfigurationError, match=said) as caught:
            read_configuration(tmp_path / name)
        assert len(str(caught.value)) < 1500

    assert peak_of(refuse) < 200e6


def test_a_device_is_no_file_of_settings(tmp_path: Path) -> None:
    (tmp_path / "car.toml").symlink_to("/dev/zero")
    with pytest.raises(ConfigurationError, match="has more than 1 MB"):
        read_configuration(tmp_path / "car.toml")
