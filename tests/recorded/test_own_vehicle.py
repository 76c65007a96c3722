"""The bonnet of the car of KITTI, which the lidar sees from 0.3 to 2.54 m ahead, and a car at 7.9 m."""

from __future__ import annotations

import csv
import gzip
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.bags import Cloud, write
from tests.support.common import every_module
from ttc_fast import Gate, Status
from ttc_fast.replay import Replay, Settings

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Cloud4 = NDArray[np.float32]

HEIGHT = 1.73
FROM_THE_SENSOR = Gate.above_road(HEIGHT, x=(0.0, math.inf))


@pytest.fixture(scope="module")
def frames(data: Path) -> list[Cloud4]:
    paths = sorted((data / "kitti/velodyne").glob("*.bin.gz"))
    return [np.frombuffer(gzip.decompress(path.read_bytes()), "<f4").reshape(-1, 4) for path in paths]


@pytest.fixture(scope="module")
def distances(data: Path) -> list[float]:
    with open(data / "kitti/corridor_distances.csv") as table:
        return [float(row["d_ref"]) for row in csv.DictReader(table)]


@every_module
@pytest.mark.parametrize(
    "gate", [Gate.above_road(HEIGHT), Gate.above_road(HEIGHT, front=2.6)], ids=["default", "front"]
)
def test_the_first_two_frames(module: Any, frames: list[Cloud4], gate: Gate) -> None:
    """The bonnet is nearer than 0.5 m, and does not close; the car ahead does, in about 13 s."""
    held = module.ttc_from_clouds(*frames[:2], 0.1, gate=FROM_THE_SENSOR)
    assert (held.status, held.distance < 0.5) == (Status.NOT_CLOSING, True)
    seen = module.ttc_from_clouds(*frames[:2], 0.1, gate=gate)
    assert seen.status is Status.CLOSING
    assert seen.distance == pytest.approx(7.9, abs=0.1)
    assert seen.ttc == pytest.approx(13.0, abs=2.0)


@every_module
def test_a_tracker_whose_gate_holds_the_bonnet_looks_past_it(
    module: Any, frames: list[Cloud4], distances: list[float]
) -> None:
    tracker = module.CloudTracker(FROM_THE_SENSOR)
    for number, frame in enumerate(frames):
        seen = tracker.update(frame, number / 10)
        if number >= 8:
            assert tracker.own_vehicle == pytest.approx(0.5, abs=0.1)
            assert seen.status is Status.CLOSING
            assert seen.distance == pytest.approx(distances[number], abs=0.25)


def pcd(points: Cloud4) -> bytes:
    lines = ["VERSION .7", "FIELDS x y z intensity", "SIZE 4 4 4 4", "TYPE F F F F", "COUNT 1 1 1 1"]
    lines += [f"WIDTH {len(points)}", "HEIGHT 1", f"POINTS {len(points)}", "DATA binary", ""]
    return "\n".join(lines).encode() + points.tobytes()


def recorded(frames: list[Cloud4], kind: str, folder: Path) -> Path:
    """Write the first frames as a log of a kind."""
    frames = frames[:6]
    if kind == "bag":
        fields = [(name, "<f4") for name in ("x", "y", "z", "intensity")]
        records = [np.ascontiguousarray(frame).view(fields).ravel() for frame in frames]
        return write(folder, "bag", [Cloud(i / 10, i / 10, each) for i, each in enumerate(records)])
    if kind == "npz":
        points, counts = np.concatenate(frames), np.array([len(frame) for frame in frames])
        np.savez(folder / "log.npz", t=np.arange(6) / 10, points=points, counts=counts, sensor_height=HEIGHT)
        return folder / "log.npz"
    for i, frame in enumerate(frames):
        (folder / f"{i:03}.{kind}").write_bytes(pcd(frame) if kind == "pcd" else frame.tobytes())
    return folder


@pytest.mark.parametrize("kind", ["bin", "pcd", "bag", "npz"])
def test_every_reader_begins_beyond_the_bonnet(kind: str, frames: list[Cloud4], tmp_path: Path) -> None:
    options = {} if kind == "npz" else {"sensor_height": HEIGHT}
    replay = Replay(recorded(frames, kind, tmp_path), Settings(log_options=options))
    rows = list(replay)
    assert [row.status for row in rows] == [Status.WARMING_UP] * 2 + [Status.CLOSING] * 4
    assert rows[0].distance == pytest.approx(7.97, abs=0.03)
    assert rows[-1].ttc == pytest.approx(13.4, abs=1.0)
    assert not [line for line in replay.summary.odd if "vehicle" in line]
    assert ("1.5 times the height" in replay.summary.assumed) == (kind != "bin")


def test_the_height_that_a_format_stands_for_is_said(frames: list[Cloud4], tmp_path: Path) -> None:
    """Bare clouds may come of a lidar of another car."""
    log = recorded(frames, "bin", tmp_path)
    assert "the lidar is 1.73 m above the road, as in KITTI frames: say it with" in Replay(log).pipeline.assumed
    for said in (Settings(log_options={"sensor_height": HEIGHT}), Settings(gate={"z": (-1.5, 0.27)})):
        assert "above the road" not in Replay(log, said).pipeline.assumed


def test_a_gate_that_holds_the_bonnet_is_said_in_the_summary(data: Path) -> None:
    replay = Replay(data / "kitti/velodyne", Settings(gate={"x": (0.0, math.inf), "z": (-1.5, 0.27)}))
    assert [row.status for row in replay][8:] == [Status.CLOSING] * 12
    (line,) = (line for line in replay.summary.odd if "vehicle" in line)
    assert line.startswith(
        "the gate holds the vehicle itself, 0.51 m ahead of the lidar: it was passed over in 12 frames"
    )
    assert replay.summary.assumed == "" or "vehicle" not in replay.summary.assumed
