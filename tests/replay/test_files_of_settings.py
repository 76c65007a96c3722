"""One file of settings for logs of every kind: what a log cannot use is replaced and said, or refused."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.bags import Cloud, Odom, write
from ttc_fast import EstimateThreshold, IttcThreshold, StoppingDistance, SweptPathThreshold
from ttc_fast.brake import Reason
from ttc_fast.cli import main
from ttc_fast.configuration import ConfigurationError
from ttc_fast.replay import Replay, Settings, sample
from ttc_fast.ros.files import read_configuration

CLOUDS = sample("clouds")
NODES = """
/**:
  ros__parameters:
    use_sim_time: true
/car/ttc_fast:
  ros__parameters:
    ttc_threshold: 0.9
    hold: 0.2
    {more}
/car/other:
  ros__parameters:
    rate: 20
"""
OUTLINE = "outline: [-1.0, 2.5, -0.9, 0.9]"
BEAMS = '[[criteria]]\nkind = "IttcThreshold"\nthreshold = 0.9\n'
ESTIMATE = '[[criteria]]\nkind = "EstimateThreshold"\nthreshold = 0.4\n'


@pytest.fixture
def table(tmp_path: Path) -> Path:
    rows = "\n".join(f"{i / 10},{20 - 0.5 * i}" for i in range(39))
    (tmp_path / "gaps.csv").write_text(f"stamp,distance\n{rows}\n")
    return tmp_path / "gaps.csv"


@pytest.mark.parametrize(
    ("more", "name"), [("", "IttcThreshold"), (OUTLINE, "SweptPathThreshold"), ("criterion: ittc", "IttcThreshold")]
)
def test_parameters_of_nodes_serve_a_table(
    more: str, name: str, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "car.yaml").write_text(NODES.format(more=more))
    replay = Replay(table, Settings(read_configuration(tmp_path / "car.yaml")))
    rows = list(replay)
    assert replay.pipeline.controller.criteria == (EstimateThreshold(0.9), StoppingDistance())
    assert replay.threshold == replay.summary.threshold == 0.9
    assert replay.summary.assumed.startswith(f"{name}(threshold=0.9) of the file needs a scan")
    assert replay.summary.assumed.endswith("EstimateThreshold(threshold=0.9) takes its place here")
    first = next(row for row in rows if row.reason is Reason.CRITERION)
    assert first.criterion == "EstimateThreshold"
    assert first.ttc < 0.9
    assert main(["replay", str(table), "--config", str(tmp_path / "car.yaml"), "--rows", "0"]) == 0
    assert f"ASSUMED     {name}(threshold=0.9) of the file" in capsys.readouterr().out


def test_an_outline_of_a_file_is_that_of_a_cloud(tmp_path: Path) -> None:
    """The front of the outline is where distances begin, and the path is assessed where there is a speed."""
    (tmp_path / "car.yaml").write_text(NODES.format(more=OUTLINE))
    settings = read_configuration(tmp_path / "car.yaml")
    points = np.array([(x, y, 0.0, 1.0) for x in (9.0, 9.1) for y in np.linspace(-1, 1, 30)], "<f4")
    records = points.view([(name, "<f4") for name in ("x", "y", "z", "intensity")]).ravel()
    clouds = [Cloud(i / 10, i / 10, records) for i in range(5)]
    odometry = [Odom(i / 10, i / 10, speed=2.0) for i in range(5)]
    moving = [each for pair in zip(odometry, clouds, strict=True) for each in pair]
    for items, criteria in (
        (moving, (SweptPathThreshold(0.9), StoppingDistance())),
        (clouds, (EstimateThreshold(0.9), StoppingDistance())),
    ):
        kind = "bag" if items is clouds else "mcap"
        replay = Replay(write(tmp_path, kind, items), Settings(settings, {"sensor_height": 1.0}))
        rows = list(replay)
        assert replay.pipeline.lidar.front_offset == 2.5
        assert replay.pipeline.controller.criteria == criteria
        assert rows[2].distance == pytest.approx(6.5, abs=0.01)  # the last is held for frozen
        assert ("takes its place" in replay.summary.assumed) is (items is clouds)


def test_a_criterion_beside_one_for_estimates_is_left_out_and_said(table: Path, tmp_path: Path) -> None:
    (tmp_path / "car.toml").write_text(BEAMS + ESTIMATE)
    replay = Replay(table, Settings(read_configuration(tmp_path / "car.toml")))
    assert replay.pipeline.controller.criteria == (EstimateThreshold(0.4),)
    assert replay.summary.assumed == "IttcThreshold(threshold=0.9) of the file needs a scan: it is left out here"
    (tmp_path / "car.toml").write_text(BEAMS)
    replay = Replay(table, Settings(read_configuration(tmp_path / "car.toml")))
    assert replay.pipeline.controller.criteria == (EstimateThreshold(0.9),)


def test_settings_of_another_shape_are_refused_by_name() -> None:
    for settings in ({"log_options": (1.0,)}, {"gate": None}, {"gate": {"x": 1.0}}, {"gate": {"y": (1.0, 2.0, 3.0)}}):
        name = next(iter(settings))
        with pytest.raises((TypeError, ValueError), match=name):
            Settings(**settings)
    with pytest.raises(ValueError, match=r"gate has no setting 'heigth': "):
        Settings(gate={"heigth": (0.0, 1.0)})


def test_a_criterion_of_an_option_is_refused_with_a_remedy(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for log in (table, CLOUDS):
        with pytest.raises(ConfigurationError, match=r"IttcThreshold needs a scan: .* use EstimateThreshold"):
            Replay(log, Settings(criteria=(IttcThreshold(),)))
    path = ["replay", str(CLOUDS), "--criterion", "SweptPathThreshold", "--rows", "0"]
    assert main(path) == 2
    assert "SweptPathThreshold needs an outline" in capsys.readouterr().err
    path += ["--outline", "-1", "2.5", "-0.9", "0.9"]
    assert main(path) == 2
    assert "SweptPathThreshold needs the speed: --speed says it" in capsys.readouterr().err
    assert main([*path, "--speed", "9"]) == 0
