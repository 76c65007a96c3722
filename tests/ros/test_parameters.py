"""Parameters of the node: what is refused says which and why, and files of every kind say the same."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import ttc_fast.ros
from tests.support.common import CAR
from ttc_fast.cli import main
from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.files import read_parameters
from ttc_fast.ros.settings import NodeSettings, SettingError, parameters_of_node

PACKAGE = Path(__file__).parents[2] / "ros"
OUTLINE = list(CAR)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"ttc_treshold": 1.0}, "there is no parameter 'ttc_treshold': did you mean ttc_threshold?"),
        ({"ttc_threshold": 0.0}, "ttc_threshold must be finite and above 0"),
        ({"ttc_threshold": "1.0"}, "ttc_threshold must be a number, got '1.0'"),
        ({"ttc_threshold": True}, "ttc_threshold must be a number"),
        ({"min_range": 3.0, "max_range": 1.0}, "limits"),
        ({"limits_policy": "cut"}, "limits_policy"),
        ({"criterion": "iTTC"}, "criterion must be 'ittc', 'swept' or ''"),
        ({"criterion": "swept"}, "needs an outline"),
        ({"outline": [1.0]}, "outline must be 4 numbers"),
        ({"outline": [0.4, -0.1, -0.15, 0.15]}, "outline"),
        ({"outline": "car"}, "outline must be a list of numbers"),
        ({"mount": [0.1, 0.0]}, "mount must be 3 numbers"),
        ({"odom_topics": "/odom"}, "odom_topics must be a list of names of topics"),
        ({"scan_topic": 1}, "scan_topic must be a text"),
        ({"scan_topic": ""}, "scan_topic or points_topic must be set"),
        ({"points_topic": "/points"}, "points_topic needs an outline"),
        ({"points_topic": "/points", "outline": OUTLINE, "criterion": "ittc"}, "criterion 'ittc' judges beams"),
        ({"drive_always": 1}, "drive_always must be true or false"),
        ({"brake_speed": -1.0}, "brake_speed must be finite and at least 0"),
        ({"watchdog_period": 0.0}, "watchdog_period must be finite and above 0 s"),
        ({"trigger": [3, 2]}, "trigger must be two integers (N, M)"),
        ({"when_blind": "none"}, "when_blind must be"),
        ({"hold": -1.0}, "hold must be finite and at least 0"),
        ({"deceleration": 0.0}, "deceleration must be finite and above 0"),
    ],
)
def test_what_is_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingError) as caught:
        NodeSettings.of(given)
    assert says in str(caught.value)


def test_integers_are_numbers() -> None:
    assert NodeSettings.of({"ttc_threshold": 1, "max_range": 10, "outline": [-1, 4, -1, 1]}).ttc_threshold == 1


def test_every_parameter_has_a_default_that_is_accepted() -> None:
    NodeSettings.of({each.name: each.plain_default for each in parameters_of_node()})


@pytest.mark.parametrize("name", [each.name for each in parameters_of_node()])
def test_ranges_hold_their_defaults(name: str) -> None:
    [each] = [each for each in parameters_of_node() if each.name == name]
    assert each.usual is None or each.usual[0] <= each.default <= each.usual[1]


TOML = 'ttc_threshold = 0.8\noutline = [-0.1, 0.4, -0.15, 0.15]\nwhen_blind = "warn"\n'
FLAT = "ttc_threshold: 0.8\noutline: [-0.1, 0.4, -0.15, 0.15]\nwhen_blind: warn\n"
ROS_2 = "/**:\n  ros__parameters:\n" + "".join(f"    {line}\n" for line in FLAT.splitlines())


@pytest.mark.parametrize(("name", "text"), [("a.toml", TOML), ("a.yaml", FLAT), ("a.yml", ROS_2)])
def test_files(tmp_path: Path, name: str, text: str) -> None:
    if not name.endswith("toml"):
        pytest.importorskip("yaml", reason="needs PyYAML")
    (tmp_path / name).write_text(text)
    expected = {"ttc_threshold": 0.8, "outline": OUTLINE, "when_blind": "warn"}
    assert read_parameters(tmp_path / name) == expected
    BrakeNode(NodeSettings.of(expected))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("gate:\n  x: [2.0, 40.0]\n", {"gate": {"x": [2.0, 40.0]}}),
        ("ttc_fast:\n  hold: 1.0\n", {"hold": 1.0}),
        ("hold: 1.0\nuse_sim_time: true\n", {"hold": 1.0}),
        ("my_brake:\n  ros__parameters:\n    hold: 1.0\n    use_sim_time: true\n", {"hold": 1.0}),
        ("car:\n  ttc_fast:\n    ros__parameters: {hold: 1.0}\n", {"hold": 1.0}),
        ("/car/ttc_fast:\n  ros__parameters: {hold: 1.0}\namcl:\n  ros__parameters: {alpha1: 0.2}\n", {"hold": 1.0}),
        ("/**:\n  ros__parameters: {hold: 2.0, release_at: 1.5}\nttc_fast:\n  ros__parameters: {hold: 1.0}\n",
         {"hold": 1.0, "release_at": 1.5}),
    ],
)  # fmt: skip
def test_files_of_several_nodes_give_those_of_this_one(tmp_path: Path, text: str, expected: dict[str, Any]) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML")
    (tmp_path / "a.yaml").write_text(text)
    assert read_parameters(tmp_path / "a.yaml") == expected


def test_a_file_of_other_nodes_is_refused_by_their_names(tmp_path: Path) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML")
    (tmp_path / "a.yaml").write_text("amcl:\n  ros__parameters: {a: 1}\nslam:\n  ros__parameters: {b: 1}\n")
    with pytest.raises(SettingError, match=r"several nodes, /amcl, /slam, and none is ttc_fast"):
        read_parameters(tmp_path / "a.yaml")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.toml", "x =", "is not TOML"),
        ("a.yaml", "x: [", "is not YAML"),
        ("a.yaml", "- 1", "must be a table of parameters"),
        ("a.txt", "", "must end in .toml, .yaml or .yml"),
        ("none.toml", None, "cannot be read: No such file"),
        ("a.toml", "ttc_treshold = 1.0", "did you mean ttc_threshold?"),
        ("a.toml", "[dds]\ndomain = 1000", "dds: "),
    ],
)
def test_files_that_cannot_be_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str | None, says: str
) -> None:
    if name.endswith("yaml"):
        pytest.importorskip("yaml", reason="needs PyYAML")
    if text is not None:
        (tmp_path / name).write_text(text)
    assert main(["node", "--ros1", "--config", str(tmp_path / name)]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count(name) == 1


@pytest.mark.skipif(find_spec("rclpy") is not None, reason="rclpy is installed")
def test_an_adapter_without_its_library(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["node", "--rclpy"]) == 4
    assert "--rclpy needs rclpy, which is not installed: rclpy comes with ROS 2: source" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["brake.yaml", "brake_ros1.yaml"])
def test_the_files_of_the_ros_package(name: str) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML")
    given = read_parameters(PACKAGE / "config" / name)
    assert {"min_range", "max_range", "ttc_threshold", "speed_topic"} <= set(given)
    NodeSettings.of(given)
    assert given == {each.name: each.plain_default for each in parameters_of_node() if each.name in given}


@pytest.mark.parametrize("name", ["brake.yaml", "brake_ros1.yaml"])
def test_the_files_of_the_ros_package_name_the_units(name: str) -> None:
    units = {each.name: each.kind.unit for each in parameters_of_node()}
    text = (PACKAGE / "config" / name).read_text(encoding="utf-8")
    described = re.findall(r"^ *(?:# )?(\w+): [^#\n]*(?:# ?([^\n]*))?$", text, re.MULTILINE)
    for parameter, comment in described:
        unit = units[parameter].partition(",")[0]
        assert not unit or re.search(rf"\b{re.escape(unit)}(?!\w)", comment), parameter
    assert {"outline", "mount", "hold"} <= {parameter for parameter, _ in described}


def test_launch_files_rename_the_topics_that_the_node_has() -> None:
    topics = {each.default for each in parameters_of_node() if each.name in ("scan_topic", "drive_topic")}
    topics |= {NodeSettings.odom_topics[0], NodeSettings(mux=True).driver_topic}
    ros1 = (PACKAGE / "launch" / "brake.launch").read_text(encoding="utf-8")
    assert set(re.findall(r'<remap from="([^"]+)" to="\$\(arg \w+\)"', ros1)) == topics
    assert {
        default
        for name, default in re.findall(r'<arg name="(\w+)" default="([^"]+)"', ros1)
        if name not in ("config", "ns")
    } == topics
    ros2 = (PACKAGE / "launch" / "brake.launch.py").read_text(encoding="utf-8")
    (listed,) = re.findall(r"^TOPICS = \((.*)\)$", ros2, re.MULTILINE)
    assert set(re.findall(r'"([^"]+)"', listed)) == topics


def test_the_package_needs_every_package_that_the_nodes_import() -> None:
    found = ElementTree.parse(PACKAGE / "package.xml").getroot()
    for version, name, others in (("1", "rospy_node", {"roslaunch"}), ("2", "rclpy_node", {"launch", "launch_ros"})):
        tree = ast.parse(Path(ttc_fast.ros.__file__).with_name(f"{name}.py").read_text(encoding="utf-8"))
        imports = {each.module for each in ast.walk(tree) if isinstance(each, ast.ImportFrom) and each.module}
        imports |= {alias.name for each in ast.walk(tree) if isinstance(each, ast.Import) for alias in each.names}
        needed = {each.partition(".")[0] for each in imports} - sys.stdlib_module_names - {"ttc_fast", "numpy"}
        given = [each for each in found.iter("exec_depend") if version in each.get("condition", version)]
        assert needed | others | {"python3-numpy"} <= {each.text for each in given}


def test_help_lists_every_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["node", "--help-all"])
    shown = " ".join(capsys.readouterr().out.split())
    for each in parameters_of_node():
        assert f"{each.name} {each.description}" in shown


def test_nothing_that_exists_when_a_node_begins_is_walked_again() -> None:
    code = "import gc; from ttc_fast.ros.core import freeze_heap; freeze_heap(); print(len(gc.get_objects()))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert int(said) < 100
