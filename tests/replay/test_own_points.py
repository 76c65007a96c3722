"""A replay of clouds names the points that stay with the lidar while the rest of the world moves, and removes none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.log_files import pcd_folder
from ttc_fast.cli import main
from ttc_fast.replay import Replay, Settings
from ttc_fast.replay.own_points import FRAMES, LEAST_FRAMES, OwnPoints

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

HEIGHT = 1.6
BONNET = np.stack(np.meshgrid(np.arange(1.05, 1.9, 0.1), np.arange(-0.55, 0.6, 0.1), [-0.55]), -1).reshape(-1, 3)


def worlds(frames: int, *own: NDArray[Any], speed: float = 10.0) -> list[NDArray[np.float32]]:
    """A road with rings, poles beside it that are driven past, a wall ahead, and what stays with the lidar."""
    rng = np.random.default_rng(3)
    poles = rng.uniform([3.0, -12.0, -1.2], [80.0, 12.0, 1.0], (4000, 3))
    poles = poles[np.abs(poles[:, 1]) > 3.0]
    angles = np.linspace(-np.pi, np.pi, 200)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(200)])
    rings = np.vstack([2.0 * ring, 4.0 * ring]) - [0.0, 0.0, HEIGHT]
    wall = np.stack(np.meshgrid([60.0], np.arange(-1.5, 1.6, 0.1), np.arange(-1.2, 0.5, 0.1)), -1).reshape(-1, 3)
    move = np.array([0.1 * speed, 0.0, 0.0])
    clouds = [np.vstack([rings, *own, np.vstack([poles, wall]) - k * move]) for k in range(frames)]
    return [each.astype(np.float32) for each in clouds]


def seen(clouds: list[NDArray[np.float32]]) -> OwnPoints:
    own = OwnPoints(HEIGHT)
    for each in clouds:
        own.add(each)
    return own


def test_a_bonnet_is_found_while_the_world_moves() -> None:
    box = seen(worlds(FRAMES, BONNET)).box()
    assert box is not None
    assert box == pytest.approx(np.array([[1.0, -0.6, -0.6], [1.9, 0.6, -0.5]]))


@pytest.mark.parametrize(
    "clouds",
    [
        worlds(FRAMES, BONNET, speed=0.0),  # all of it stays, so that it says nothing of the bonnet
        worlds(LEAST_FRAMES - 1, BONNET),
        worlds(FRAMES),  # rings of the road stay, and are no vehicle
        [BONNET.astype(np.float32)] * FRAMES,  # there is no world
        [np.zeros((0, 3), np.float32)] * FRAMES,
    ],
    ids=["standing", "few clouds", "nothing near", "no world", "empty"],
)
def test_nothing_is_said_where_nothing_can_be_known(clouds: list[NDArray[np.float32]]) -> None:
    assert seen(clouds).box() is None


def test_they_are_named_before_the_rows_with_the_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = pcd_folder(tmp_path / "clouds", worlds(FRAMES, BONNET))
    arguments = ["replay", str(folder), "--sensor-height", str(HEIGHT), "--rows", "0"]
    assert main([*arguments, "--gate-x", "0", "50"]) == 0
    said = capsys.readouterr().out
    assert "own points  points stay at x 1.0 to 1.9 m" in said
    assert "--gate-x from 1.9 m on leaves them out" in said
    assert main([*arguments, "--gate-x", "2", "50"]) == 0
    assert "the gate leaves them out" in capsys.readouterr().out


def test_a_car_that_drives_along_close_ahead_counts(tmp_path: Path) -> None:
    """It stays in its place as a bonnet does. It may be named, and is never removed."""
    car = np.stack(np.meshgrid([2.5, 2.6], np.arange(-0.8, 0.9, 0.1), np.arange(-1.0, 0.0, 0.1)), -1).reshape(-1, 3)
    settings = Settings(log_options={"sensor_height": HEIGHT}, gate={"x": (0.0, 50.0)})
    rows = list(Replay(pcd_folder(tmp_path / "clouds", worlds(FRAMES, car)), settings))
    assert {round(row.nearest, 2) for row in rows} == {2.5}
