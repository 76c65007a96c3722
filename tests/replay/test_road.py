"""A replay of clouds finds out how high the lidar is, by the road; where it cannot, it asks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.bags import Cloud, write
from tests.support.log_files import pcd_folder
from ttc_fast.cli import main
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import CloudFrame, open_log
from ttc_fast.replay import Replay, Settings, sample

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


def sampled() -> list[NDArray[Any]]:
    """The clouds of a sample, whose lidar is 1.73 m above the road."""
    return [frame.points[:, :3].copy() for frame in open_log(sample("clouds")) if isinstance(frame, CloudFrame)]


def test_the_height_is_found_and_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = pcd_folder(tmp_path / "clouds", sampled())
    assert main(["replay", str(folder), "--rows", "1"]) == 0
    out = capsys.readouterr().out
    assert "road        1.73 m below the lidar (within 0.00 m), slope +0.0%, in 5 of the first 5 clouds" in out
    assert "--sensor-height overrides it" in out
    assert out.index("road  ") < out.index("frame   t, s") < out.index("least TTC")  # what was used comes first
    (alone,) = Replay(folder / "0003.pcd")
    assert alone.distance == pytest.approx(14.6, abs=0.1)


def test_it_replays_as_with_the_true_height(tmp_path: Path) -> None:
    folder = pcd_folder(tmp_path / "clouds", sampled())
    found, told = Replay(folder), Replay(folder, Settings(log_options={"sensor_height": 1.73}))
    assert found.pipeline.lidar.sensor_height == pytest.approx(1.73, abs=0.01)
    assert [row.distance for row in found] == pytest.approx([row.distance for row in told], abs=0.02, nan_ok=True)
    assert told.pipeline.lidar.sensor_height == 1.73


@pytest.mark.parametrize("height", [0.3, 1.0, 2.4, 3.0])
def test_lidars_of_other_heights(height: float, tmp_path: Path) -> None:
    raised = [points + np.array([0.0, 0.0, 1.73 - height], points.dtype) for points in sampled()[:5]]
    replay = Replay(pcd_folder(tmp_path / "clouds", raised))
    assert replay.pipeline.lidar.sensor_height == pytest.approx(height, abs=0.02)


def test_clouds_of_a_bag(tmp_path: Path) -> None:
    kind = [(name, "<f4") for name in "xyz"]
    records = [np.array(list(map(tuple, points)), kind) for points in sampled()]
    items = [Cloud(i / 10, i / 10, each) for i, each in enumerate(records)]
    replay = Replay(write(tmp_path, "bag", items))
    assert replay.pipeline.lidar.sensor_height == pytest.approx(1.73, abs=0.01)
    assert replay.log.sensor == "/points, frame lidar"  # type: ignore[union-attr]
    assert len(list(replay)) == len(items)


def tilted(slope: float) -> list[NDArray[Any]]:
    return [points + np.outer(points[:, 0] * slope, [0.0, 0.0, 1.0]).astype(points.dtype) for points in sampled()]


@pytest.mark.parametrize(
    ("clouds", "why"),
    [
        ([np.full((50, 3), 7.0, np.float32)] * 3, r"no road was found in 3 of the first 3 clouds"),
        (tilted(0.05), r"the road ahead rises by 5\.0%"),
        (tilted(-0.04), r"the road ahead falls by 4\.0%"),
        (
            [points + np.array([0.0, 0.0, 0.3 * (i % 2)], np.float32) for i, points in enumerate(sampled())],
            r"the road in the first clouds is 1\.43 to 1\.73 m below the lidar",
        ),
    ],
    ids=["no road", "uphill", "downhill", "it jumps"],
)
def test_what_cannot_be_found_is_asked(
    clouds: list[NDArray[Any]], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = pcd_folder(tmp_path / "clouds", clouds)
    with pytest.raises(ConfigurationError, match=f"{why}.*say it with the option sensor_height"):
        Replay(folder)
    assert main(["replay", str(folder)]) == 2
    assert "say it with --sensor-height, or say which heights with --gate-z" in capsys.readouterr().err
    assert main(["replay", str(folder), "--gate-z", "-1.5", "0.3"]) == 0


def test_settings_are_no_dict() -> None:
    for wrong in ({}, {"speed": 2.0}):
        with pytest.raises(TypeError, match=r"settings must be Settings, such as Settings\(log_options=.*got dict"):
            Replay(sample("scans"), wrong)  # type: ignore[arg-type]
