"""Replays: rows of every kind of log are what the brake decides, and what they come to."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import KINDS, Cloud, Scan, drive, write
from tests.support.common import CAR
from ttc_fast import (
    BrakeController,
    CloudTracker,
    Command,
    DistanceTracker,
    Estimate,
    EstimateThreshold,
    Gate,
    IttcThreshold,
    Motion,
    Reason,
    ScanSweptPath,
    ScanTTC,
    Status,
    StoppingDistance,
    SweptPathThreshold,
)
from ttc_fast.configuration import Configuration, ConfigurationError
from ttc_fast.logs import CloudLog, LogError, ScanLog, open_log
from ttc_fast.replay import Replay, Row, Settings, Summary, sample
from ttc_fast.replay.drawing import in_space
from ttc_fast.replay.run import MOST_ROWS, Series
from ttc_fast.replay.summary import is_isolated


def written(folder: Path, distances: list[float], dt: float = 0.1) -> Path:
    path = folder / "distances.csv"
    lines = [f"{i * dt},{distance}" for i, distance in enumerate(distances)]
    path.write_text("\n".join(["stamp,distance", *lines]))
    return path


def test_a_scan_says_what_the_kernel_says_and_what_the_controller_decides() -> None:
    log = open_log(sample("scans"))
    assert isinstance(log, ScanLog)
    scan = ScanTTC(**vars(log.scanner))
    path, controller = ScanSweptPath(scan), BrakeController(scan=scan)
    rows = list(Replay(sample("scans")))
    for row, frame in zip(rows, log, strict=True):
        assert frame.speed is not None
        motion = Motion(frame.speed, frame.yaw_rate, 0.0, frame.stamp)
        decision = controller.update(frame.stamp, ranges=frame.ranges, stamp=frame.stamp, motion=motion)
        assert (row.command, row.reason) == (decision.command, decision.reason)
        nearest = path.nearest(frame.ranges, frame.speed, frame.yaw_rate)
        assert (row.ttc, row.status, row.beam) == (nearest.ttc, nearest.status, nearest.beam)
        assert row.valid == nearest.counts.valid
    assert {row.command for row in rows} == set(Command)


def test_a_cloud_says_what_the_tracker_says() -> None:
    log = open_log(sample("clouds"))
    assert isinstance(log, CloudLog)
    lidar = log.lidar
    assert lidar.sensor_height is not None
    z = (lidar.height[0] - lidar.sensor_height, lidar.height[1] - lidar.sensor_height)
    tracker = CloudTracker(Gate(x=(lidar.own_reach, math.inf), z=z), front_offset=lidar.front_offset)
    rows = list(Replay(sample("clouds")))
    for row, frame in zip(rows, log, strict=True):
        seen = tracker.update(frame.points, frame.stamp)
        assert (row.ttc, row.status) == (seen.ttc, seen.status)
        np.testing.assert_array_equal((row.distance, row.closing_speed), (seen.distance, seen.closing_speed))
        assert (row.closing_low, row.closing_high) == (
            seen.closing_speed_interval or (row.closing_low, row.closing_high)
        )
    assert [row.command for row in rows][-3:] == [Command.BRAKE] * 3


def test_points_on_the_path_are_judged_with_an_outline_and_a_speed() -> None:
    said = {"speed": 10.0, "outline": (-2.0, 2.0, -0.9, 0.9)}
    rows = list(Replay(sample("clouds"), Settings(log_options=said)))
    first = rows[0]
    assert first.status is Status.CLOSING  # the tracker knows no speed yet
    assert first.beam >= 0
    assert first.closing_speed == 10.0
    assert first.ttc == pytest.approx(first.distance / 10.0)
    assert first.criterion == "SweptPathThreshold"


def test_the_outline_says_where_the_bumper_is(tmp_path: Path) -> None:
    with np.load(sample("clouds")) as archive:
        np.savez(tmp_path / "bare.npz", **{name: archive[name] for name in archive if name != "front_offset"})
    bare = Replay(tmp_path / "bare.npz")
    from_the_lidar, told = ([row.distance for row in each] for each in (bare, Replay(sample("clouds"))))
    np.testing.assert_allclose(np.array(from_the_lidar) - 2.0, told)
    assert "nearer than 2.59 m, 1.5 times the height of the lidar" in bare.summary.assumed
    outlined = Replay(tmp_path / "bare.npz", Settings(log_options={"outline": (-2.2, 2.0, -0.9, 0.9)}))
    np.testing.assert_allclose([row.distance for row in outlined], told)
    assert outlined.summary.assumed == ""


ROBOT = (-0.1, 0.4, -0.15, 0.15)


def test_distances_start_at_the_outline_whatever_the_log_says() -> None:
    """The log says 2 m. What is 16 m ahead of the lidar is 15.6 m ahead of this outline, in every row of a run."""
    from_the_log = [row.distance for row in Replay(sample("clouds"))]
    wanted = np.array(from_the_log) + 1.6
    for settings, begins in (
        (Settings(log_options={"outline": ROBOT}), "from the front of the outline, 0.4 m ahead of the lidar"),
        (Settings(Configuration(scan={"outline": ROBOT})), "from the front of the outline, 0.4 m ahead of the lidar"),
        (
            Settings(log_options={"outline": ROBOT, "speed": 5.0}),
            "along the path, from the outline, x -0.1 to 0.4 m, y -0.15 to 0.15 m",
        ),
        (
            Settings(log_options={"outline": ROBOT, "speed": 5.0}, criteria=(EstimateThreshold(), StoppingDistance())),
            "along the path, from the outline, x -0.1 to 0.4 m, y -0.15 to 0.15 m; from its front to what the tracker "
            "follows, where that comes first",
        ),
    ):
        replay = Replay(sample("clouds"), settings)
        distances = [row.distance for row in replay][:11]  # a stray point is nearer on the path in the last frame
        np.testing.assert_allclose(distances, wanted[:11], atol=0.3)
        assert dict(replay.pipeline.about)["distance"] == begins


def test_where_the_path_decides_the_row_is_about_the_path() -> None:
    """The tracker would say less, as the car ahead brakes: it decides nothing, and is no TTC of the row."""
    said = {"outline": ROBOT, "speed": 5.0}
    replay = Replay(sample("clouds"), Settings(log_options=said))
    for row in replay:
        assert row.closing_speed == 5.0
        assert row.ttc == pytest.approx(row.distance / 5.0)
        assert math.isnan(row.ttc_low)
    asked = list(Replay(sample("clouds"), Settings(log_options=said, criteria=(EstimateThreshold(),))))
    assert asked[-1].ttc == pytest.approx(0.866, abs=0.001)
    assert asked[-1].ttc_low < asked[-1].ttc < asked[-1].ttc_high


def test_a_front_offset_that_contradicts_the_outline_is_refused() -> None:
    with pytest.raises(
        ConfigurationError, match=r"its front is 0.4 m ahead .* the option front_offset says 2 m; leave"
    ):
        Replay(sample("clouds"), Settings(log_options={"outline": ROBOT, "front_offset": 2.0}))
    same = Replay(sample("clouds"), Settings(log_options={"outline": ROBOT, "front_offset": 0.1, "mount": (0.3, 0, 0)}))
    assert same.pipeline.lidar.front_offset == pytest.approx(0.1)


def test_clouds_on_the_path_that_repeat_are_said_again(tmp_path: Path) -> None:
    with np.load(sample("clouds")) as archive:
        count = int(archive["counts"][0])
        points = np.tile(archive["points"][:count], (3, 1))
        np.savez(
            tmp_path / "still.npz", t=np.arange(3) / 10, points=points, counts=np.full(3, count), sensor_height=1.73
        )
    rows = list(Replay(tmp_path / "still.npz", Settings(log_options={"outline": ROBOT, "speed": 5.0})))
    assert [row.distance for row in rows] == [rows[0].distance] * 3
    assert [row.frame for row in rows] == [0, 1, 2]


def without_the_vehicle(log: Path, **settings: Any) -> Replay:
    """Replay the sample to its end, as if the log did not say where the vehicle ends."""
    with np.load(sample("clouds")) as archive:
        np.savez(log, **{name: archive[name] for name in archive if name != "front_offset"})
    replay = Replay(log, Settings(**settings))
    assert len(list(replay)) == replay.log.frame_count
    return replay


def test_a_gate_that_holds_the_vehicle_is_said(tmp_path: Path) -> None:
    replay = without_the_vehicle(tmp_path / "bare.npz", gate={"x": (0.0, math.inf)})
    (line,) = replay.summary.odd
    assert line.startswith("the gate holds the vehicle itself, ")
    assert "the option front_offset" in line
    assert replay.summary.assumed == ""


@pytest.mark.parametrize("option", [{"front_offset": 2.0}, {"outline": (-2.2, 2.0, -0.9, 0.9)}])
def test_where_the_user_says_where_the_vehicle_ends_nothing_is_assumed(option: dict[str, Any], tmp_path: Path) -> None:
    replay = without_the_vehicle(tmp_path / "bare.npz", log_options=option)
    assert (replay.summary.assumed, replay.summary.odd) == ("", [])
    assert replay.pipeline.gate.x == (2.0, math.inf)


def lidar_of_a_robot(folder: Path, near: Callable[[int], float], frames: int = 12) -> Path:
    """A wall comes closer at 1 m/s from 9 m, and something is near; nothing says where the vehicle ends."""
    rng = np.random.default_rng(6)
    clouds = []
    for i in range(frames):
        x = np.repeat([9.0 - 0.1 * i, near(i)], 100)
        clouds.append(np.column_stack([x, rng.uniform(-0.5, 0.5, 200), rng.uniform(-1.2, -0.8, 200)])[np.isfinite(x)])
    counts = np.array([len(cloud) for cloud in clouds])
    stamps = np.arange(frames) / 10
    np.savez(folder / "robot.npz", t=stamps, points=np.concatenate(clouds), counts=counts, sensor_height=1.73)
    return folder / "robot.npz"


def test_what_may_be_the_vehicle_is_passed_over(tmp_path: Path) -> None:
    rows = list(Replay(lidar_of_a_robot(tmp_path, lambda _: 1.5)))
    assert rows[-1].status is Status.CLOSING
    assert rows[-1].distance == pytest.approx(7.9, abs=0.05)


def test_what_comes_closer_is_not_the_vehicle(tmp_path: Path) -> None:
    rows = list(Replay(lidar_of_a_robot(tmp_path, lambda i: 2.5 - 0.1 * i, frames=18)))
    assert [row.distance for row in rows[2:]] == pytest.approx([2.5 - 0.1 * i for i in range(2, 18)], abs=0.05)
    assert any(row.command is Command.BRAKE for row in rows)


def test_where_nothing_else_is_ahead_what_is_near_is_not_taken_for_free_space(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    points = np.column_stack([np.full(100, 1.5), rng.uniform(-0.5, 0.5, 100), rng.uniform(-1.2, -0.8, 100)])
    np.savez(tmp_path / "one.npz", t=np.zeros(1), points=points, counts=np.array([100]), sensor_height=1.73)
    (row,) = Replay(tmp_path / "one.npz")
    assert (row.status, row.distance) == (Status.WARMING_UP, 1.5)


def test_where_not_even_the_height_is_known_points_count_from_the_lidar_on(tmp_path: Path) -> None:
    clouds = [Cloud(i / 10, i / 10) for i in range(3)]
    replay = Replay(write(tmp_path, "bag", clouds), Settings(gate={"z": (-1.0, 1.0)}))
    list(replay)
    assert replay.pipeline.gate.x == (0.0, math.inf)
    assert "points count from the lidar on, as it is not known where the vehicle ends" in replay.summary.assumed


def test_a_distance_says_what_the_tracker_says(tmp_path: Path) -> None:
    distances = [20.0 - 0.8 * i for i in range(24)]
    rows = list(Replay(written(tmp_path, distances)))
    tracker, controller = DistanceTracker(), BrakeController()
    for i, (row, distance) in enumerate(zip(rows, distances, strict=True)):
        seen, stamp = tracker.update(distance, i * 0.1), row.stamp
        assert (row.ttc, row.status) == (seen.ttc, seen.status)
        assert row.command is controller.update(stamp, estimate=Estimate.of(seen, stamp)).command
    # It has just started: until the tracker knows a closing speed, what is ahead may close.
    assert (rows[0].command, rows[0].reason) == (Command.BRAKE, Reason.NO_MOTION)
    assert rows[-1].command is Command.BRAKE


def test_without_a_speed_the_ranges_tell_what_closes(tmp_path: Path) -> None:
    scans = [Scan(i / 40, i / 40, np.full(64, 6.0 - 0.05 * i, np.float32)) for i in range(60)]
    rows = list(Replay(write(tmp_path, "bag", scans)))
    assert rows[0].reason is Reason.CLEAR or rows[0].status is Status.WARMING_UP
    assert math.isnan(rows[-1].speed)
    assert rows[-1].closing_speed == pytest.approx(2.0, rel=0.1)
    assert rows[-1].status is Status.CLOSING


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_bag_gives_the_same_rows(kind: str, tmp_path: Path) -> None:
    settings = Settings(log_options={"outline": CAR})
    for folder in ("one", "other"):
        (tmp_path / folder).mkdir()
    rows = list(Replay(write(tmp_path / "one", kind, drive(60)), settings))
    others = list(Replay(write(tmp_path / "other", "bag", drive(60)), settings))
    assert len(rows) == 60
    assert [row[:8] for row in rows] == [row[:8] for row in others]


def test_a_blind_scan_is_invalid_and_braked_for(tmp_path: Path) -> None:
    blind = [Scan(i / 40, i / 40, np.full(19, np.nan, np.float32)) for i in range(40)]
    seen = Replay(write(tmp_path, "bag", blind), Settings(log_options={"speed": 1.0}))
    rows = list(seen)
    assert {row.status for row in rows} == {Status.NO_DATA}
    assert rows[-1].command is Command.BRAKE
    assert rows[-1].reason is Reason.BLIND
    assert seen.summary.invalid == 40


def test_a_gap_is_stale_and_braked_for(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    stamps = [i / 10 for i in range(14)]  # it brakes at the start, as its tracker knows no closing speed yet
    path.write_text("stamp,distance\n" + "\n".join(f"{t},{20 + t}" for t in (*stamps, 2.3, 2.4)))
    log = Replay(path)
    assert [row.command for row in log][6:] == [Command.NONE] * 8 + [Command.BRAKE] * 2
    assert (log.summary.stale, log.summary.brakes) == (1, 1)
    assert log.summary.start is not None
    assert log.summary.longest_gap == pytest.approx(1.0)
    assert [event.begin.reason for event in log.summary.events] == [Reason.STALE]
    patient = Replay(path, Settings(Configuration(brake={"sensor_timeout": 2.0})))
    assert {row.command for row in list(patient)[6:]} == {Command.NONE}
    assert patient.summary.stale == 0


def test_a_clock_that_is_set_back_begins_anew(tmp_path: Path) -> None:
    items = [
        Scan(stamp, i / 40, np.full(19, 3.0, np.float32)) for i, stamp in enumerate([5.0, 5.025, 1.0, 1.025, 1.05])
    ]
    log = Replay(write(tmp_path, "bag", items), Settings(log_options={"speed": 4.0}))
    rows = list(log)
    assert log.summary.resets == 1
    assert [row.status for row in rows] == [Status.CLOSING] * 5
    assert rows[2].reason is Reason.VOTING  # its votes are counted from the start


def test_options_win_over_the_configuration(tmp_path: Path) -> None:
    file = tmp_path / "car.toml"
    file.write_text(
        '[scan]\noutline = [-0.1, 0.4, -0.15, 0.15]\n[[criteria]]\nkind = "SweptPathThreshold"\nthreshold = 0.9\n'
    )
    configured = Configuration.read(file)
    path = sample("scans")
    by_file = Replay(path, Settings(configured))
    rows = list(by_file)
    assert by_file.threshold == 0.9
    assert {row.criterion for row in rows} == {"SweptPathThreshold"}
    by_option = Replay(
        path, Settings(configured, {"outline": (-0.1, 1.4, -0.15, 0.15)}, criteria=(SweptPathThreshold(2.0),))
    )
    longer = list(by_option)
    assert by_option.threshold == 2.0
    assert longer[60].distance == pytest.approx(rows[60].distance - 1.0, abs=0.01)
    plain = Replay(path, Settings(criteria=(IttcThreshold(0.3),)))
    assert {row.criterion for row in plain} == {"IttcThreshold"}


def test_a_configured_gate_is_kept_but_for_what_is_said() -> None:
    lidar = Replay(sample("clouds")).log
    assert isinstance(lidar, CloudLog)
    gate = Gate(x=(3.0, 40.0), z=(-1.5, 0.0), curvature=0.01)
    assert Settings(Configuration(gate=gate)).gate_of(lidar.lidar) == gate
    said = Settings(Configuration(gate=gate), gate={"x": (4.0, 9.0)}).gate_of(lidar.lidar)
    assert said == Gate(x=(4.0, 9.0), z=(-1.5, 0.0), curvature=0.01)


def test_a_lidar_of_unknown_height_is_asked_for(data: Path) -> None:
    with pytest.raises(ConfigurationError, match="the option sensor_height"):
        Replay(data / "clouds" / "nebula_vlp16.pcd")


def test_the_frame_of_the_least_ttc_is_kept_where_nothing_brakes() -> None:
    log = Replay(sample("scans"), Settings(log_options={"speed": 0.5}, criteria=(IttcThreshold(0.01),)))
    rows = list(log)
    assert log.key_frame is not None
    assert not log.braked
    kept, frame = log.key_frame
    assert kept is log.summary.least
    assert kept.ttc < 1.0
    assert (kept.stamp, frame.stamp) == (rows[kept.frame].stamp, rows[kept.frame].stamp)


def test_what_a_lidar_stores_where_nothing_came_back_is_no_obstacle() -> None:
    """Moved by the mount it would lie inside the outline."""
    said = {"outline": (-1.0, 4.0, -1.0, 1.0), "mount": (1.5, 0.0, 0.1), "speed": 5.0}
    pipeline = Replay(sample("clouds"), Settings(log_options=said, gate={"x": (0.0, 40.0), "z": (-1.0, 1.0)})).pipeline
    points = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 0.0, 0.5]], np.float32)
    placed = pipeline.obstacles(points)
    assert np.isnan(placed[0]).all()
    assert placed[1:, 2].tolist() == [0.0, 0.5]


def test_a_cloud_tells_the_plain_nearest_point_beside_the_tracked_distance() -> None:
    rows = list(Replay(sample("clouds")))
    strays = [row.frame for row in rows if row.nearest < row.distance - 0.5]
    assert strays == [2, 3, 7, 11]
    assert all((row.valid or 0) > 50 for row in rows)


def test_a_scanner_upside_down_sees_left_what_was_right(tmp_path: Path) -> None:
    ranges = np.full(19, 9.0, np.float32)
    ranges[:6] = 2.0  # a wall to the right of a scanner that stands upright
    path = write(tmp_path, "bag", [Scan(0.0, 0.0, ranges)])
    for upside_down, side in ((None, -1.0), (True, 1.0)):
        (only,) = Replay(path, Settings(log_options={"speed": 1.0, "upside_down": upside_down}))
        assert math.copysign(1.0, only.angle) == side


def row(frame: int, ttc: float, command: Command = Command.NONE, stamp: float | None = None, **rest: Any) -> Row:
    at = 0.1 * frame if stamp is None else stamp
    return Row(frame, at, 1.0, 1.0, ttc, Status.CLOSING, command, Reason.CLEAR, criterion="x", **rest)


def test_exposure_is_counted_below_the_threshold() -> None:
    summary = Summary("log", 1.5, 0.3)
    for each in (row(0, 2.0), row(1, 1.0), row(2, 0.5), row(3, 2.0), row(4, 1.0), row(20, 3.0)):
        summary.add(each)
    assert summary.exposed == pytest.approx(0.1 + 0.1 + 0.3)  # the last for no longer than the brake waits
    assert summary.integrated == pytest.approx(0.1 * 0.5 + 0.1 * 1.0 + 0.3 * 0.5)
    assert summary.judged == pytest.approx(0.4 + 0.3)
    assert summary.least is not None
    assert (summary.least.frame, summary.frames) == (2, 6)


def test_exposure_is_what_minderhoud_and_bovy_say() -> None:
    summary, dt = Summary("log", 3.0, 0.3), 0.01
    for frame in range(1001):  # 10 m/s towards what stands 50 m ahead, and on from the stop of time at 0.01 s
        summary.add(row(frame, 5.0 - frame * dt if frame < 500 else math.inf, stamp=frame * dt))
    summary.end()
    assert summary.exposed == pytest.approx(3.0, abs=2 * dt)
    assert summary.integrated == pytest.approx(3.0**2 / 2, rel=0.01)


@pytest.mark.parametrize("status", [Status.NO_DATA, Status.INVALID, Status.WARMING_UP, Status.STALE, Status.LOST])
def test_rows_that_tell_nothing_are_not_exposed_and_not_least(status: Status) -> None:
    summary = Summary("log", 1.5, 0.3)
    for frame in range(5):
        summary.add(row(frame, 0.5)._replace(status=status if frame in (1, 2) else Status.CLOSING))
    summary.end()
    assert summary.exposed == pytest.approx(0.2)
    assert summary.judged == pytest.approx(0.2)
    silent = Summary("log", 1.5, 0.3)
    for frame in range(5):
        silent.add(row(frame, 0.5)._replace(status=status))
    silent.end()
    assert (silent.least, silent.exposed, silent.judged) == (None, 0.0, 0.0)


def test_a_stray_reading_counts_as_its_neighbours_do() -> None:
    summary = Summary("log", 1.5, 0.3)
    for frame, ttc in enumerate((3.0, 0.1, 2.8, 1.2, 0.05, 1.0, 0.9)):
        summary.add(row(frame, ttc))
    summary.end()
    assert summary.isolated == 2
    assert summary.least is not None
    assert summary.least_isolated is not None
    assert (summary.least.ttc, summary.least_isolated.ttc) == (0.9, 0.05)
    assert summary.exposed == pytest.approx(0.3)
    assert summary.integrated == pytest.approx(0.1 * (0.3 + 0.5 + 0.5))


def test_what_really_comes_is_no_stray() -> None:
    hit = [row(0, 0.12), row(1, 0.0)._replace(status=Status.CONTACT), row(2, math.inf)._replace(status=Status.CLEAR)]
    assert not is_isolated(*hit, longest=0.3)
    apart = [row(0, 9.0, stamp=0.0), row(1, 0.5, stamp=2.0), row(2, 9.0, stamp=4.0)]
    assert not is_isolated(*apart, longest=0.3)
    assert is_isolated(*apart, longest=2.5)
    unknown = [row(0, math.inf)._replace(status=Status.WARMING_UP), row(1, 0.5), row(2, 9.0)]
    assert not is_isolated(*unknown, longest=0.3)


def test_events_are_from_the_first_to_the_last_row_that_brakes() -> None:
    summary = Summary("log", 1.5, 0.3)
    commands = (Command.NONE, Command.WARN, Command.BRAKE, Command.BRAKE, Command.NONE, Command.BRAKE)
    for frame, command in enumerate(commands):
        summary.add(row(frame, 5.0 - frame, command))
    assert (summary.brakes, summary.warnings) == (2, 1)
    told = [(event.begin.frame, event.frames, round(event.end, 1)) for event in summary.events]
    assert told == [(2, 2, 0.3), (5, 1, 0.5)]


START = [Reason.NO_MOTION, Reason.WAITING]
FOR_A_REASON = {Reason.CRITERION, Reason.HOLD, Reason.STANDSTILL, Reason.BLIND, Reason.STALE, *START}


def came_to(*reasons: Reason) -> Summary:
    """Summarize rows with these reasons, of which those of the start and blind ones are evaluated by nothing."""
    summary = Summary("log", 1.5, 0.3)
    for frame, reason in enumerate(reasons):
        command = Command.BRAKE if reason in FOR_A_REASON else Command.NONE
        each = row(frame, 5.0, command)._replace(reason=reason)
        unseen = {Reason.BLIND: Status.NO_DATA, **dict.fromkeys(START, Status.WARMING_UP)}
        if reason in unseen:
            each = each._replace(criterion="", status=unseen[reason], closing_speed=math.nan, ttc=math.inf)
        summary.add(each)
    summary.end()
    return summary


def spans(summary: Summary) -> list[tuple[int, int]]:
    return [(event.begin.frame, event.frames) for event in summary.events]


@pytest.mark.parametrize("reason", START)
def test_what_brakes_until_something_is_evaluated_is_no_brake_of_the_drive(reason: Reason) -> None:
    warming = came_to(reason, reason, Reason.HOLD, Reason.CLEAR, Reason.CRITERION, Reason.HOLD)
    assert warming.start is not None
    assert (warming.brakes, spans(warming)) == (1, [(4, 2)])
    assert (warming.start.begin.frame, warming.start.frames) == (0, 3)
    assert warming.start.end == pytest.approx(0.2)
    assert str(warming.start) == f"frame 0, 0.000 to 0.200 s, 3 frames: {reason.name}"
    again = Summary.of_json(warming.to_json())
    assert repr((again.start, again.events)) == repr((warming.start, warming.events))


def test_one_braking_for_two_reasons_at_the_start_is_one_event() -> None:
    blind = came_to(Reason.BLIND, Reason.BLIND, Reason.NO_MOTION, Reason.NO_MOTION)
    assert (blind.start, blind.brakes, spans(blind)) == (None, 1, [(0, 4)])


def test_a_frame_without_points_is_drawn_empty() -> None:
    for nothing in (np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))):
        assert in_space(nothing).shape == (0, 3)
    assert in_space(np.ones((4, 2))).tolist() == [[1.0, 1.0, 0.0]] * 4


@pytest.mark.parametrize("lost", [Reason.NO_MOTION, Reason.BLIND, Reason.STALE])
def test_what_is_lost_later_in_the_drive_is_a_brake(lost: Reason) -> None:
    assert spans(came_to(Reason.NO_MOTION, Reason.HOLD, Reason.CLEAR, lost, lost, Reason.CLEAR)) == [(3, 2)]
    assert spans(came_to(Reason.NO_MOTION, Reason.HOLD, lost, Reason.HOLD, Reason.CLEAR)) == [(2, 2)]
    assert spans(came_to(Reason.CLEAR, lost)) == [(1, 1)]


def test_a_scanner_that_is_blind_from_the_start_and_a_drive_that_is_never_evaluated_are_brakes() -> None:
    assert spans(came_to(Reason.BLIND, Reason.BLIND, Reason.CLEAR)) == [(0, 2)]
    never = came_to(*[Reason.NO_MOTION] * 5)
    assert (never.brakes, never.start, spans(never)) == (1, None, [(0, 5)])


def test_frames_that_do_not_tell_what_comes_closer_are_all_counted() -> None:
    replay = Replay(sample("clouds"))
    unknown = [row.frame for row in replay if row.status is Status.WARMING_UP]
    assert unknown == [0, 1]
    summary = replay.summary
    assert (summary.unknown, summary.with_known_ttc, summary.frames) == (2, 10, 12)


def test_a_series_stays_small_and_keeps_what_matters() -> None:
    series, count = Series(), 10 * MOST_ROWS + 7
    for frame in range(count):
        command = Command.BRAKE if frame == 12345 else Command.NONE
        series.add(row(frame, 0.25 if frame == 23456 else 9.0, command))
        assert len(series.rows) <= MOST_ROWS
    series.end()
    assert series.step == 16
    frames = [each.frame for each in series.rows]
    assert {12345, 23456} <= set(frames)
    assert frames == sorted(frames)
    assert frames[-1] >= count - series.step


@pytest.mark.parametrize("tenth", range(10))
@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_a_bag_cut_short_is_replayed_as_far_as_it_goes(kind: str, tenth: int, tmp_path: Path) -> None:
    path = write(tmp_path, kind, drive(100, 256))
    whole = [each[:8] for each in Replay(path)]
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * tenth // 10])
    rows: list[Any] = []
    with pytest.raises(LogError, match=str(path)):  # noqa: PT012 - the rows before it are what matters
        for each in Replay(path):
            rows.append(each[:8])
    assert len(rows) < len(whole)
    np.testing.assert_array_equal([each[:2] for each in rows], [each[:2] for each in whole[: len(rows)]])


def test_flipped_bytes_are_survived(tmp_path: Path) -> None:
    path = write(tmp_path, "bag", drive(60, 128))
    content, rng = np.frombuffer(path.read_bytes(), np.uint8), np.random.default_rng(3)
    for _ in range(60):
        damaged = content.copy()
        damaged[rng.integers(0, len(content), 8)] = rng.integers(0, 256, 8)
        path.write_bytes(damaged.tobytes())
        try:
            rows = list(Replay(path))
        except (LogError, ConfigurationError):
            continue
        assert all(0.0 <= each.ttc <= math.inf for each in rows)
