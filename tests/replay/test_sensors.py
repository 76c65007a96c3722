"""What drivers really send, in a replay; and that a replay decides as a node does on the same messages, bit for bit."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.bags import BEGIN, KINDS, Cloud, Item, Odom, Recorded, Scan, Static, write
from tests.support.common import CAR
from tests.support.dds_harness import DdsHarness
from tests.support.ros_harness import CoreHarness, RclpyHarness, RospyHarness
from ttc_fast._exit_codes import PARTIAL
from ttc_fast.brake import Reason
from ttc_fast.cli import main
from ttc_fast.configuration import Configuration
from ttc_fast.logs import LogError, open_log
from ttc_fast.replay import Replay, Row, Settings
from ttc_fast.sensors.odometry import Pose

if TYPE_CHECKING:
    from pathlib import Path

OUTLINE = tuple(CAR)
BEAMS = 181
PERIOD = 0.11
"""s from scan to scan. No time of the brake is a multiple of it, where the rounding of stamps would decide."""


def angles(beams: int = BEAMS) -> Any:
    return np.linspace(-1.5, 1.5, beams)


def wall(distance: float, beams: int = BEAMS) -> Any:
    """Something of 0.4 rad ahead, in a hall of 9 m."""
    return np.where(np.abs(angles(beams)) < 0.2, max(distance, 0.3), 9.0).astype(np.float32)


def approach(frames: int = 60, *, odometry: bool = True, **scan: Any) -> list[Recorded]:
    """Drive at a wall at 1 m/s; ``scan`` has what each scan is given, by its number."""
    items: list[Recorded] = []
    for i in range(frames):
        now = PERIOD * i
        given = {name: value(i) for name, value in scan.items()}
        beams = given.pop("beams", BEAMS)
        if odometry:
            items.append(Odom(now - 1 / 64, now - 1 / 64, speed=1.0, x=now))
        given = {"stamp": now, "recorded": now, "ranges": wall(6.0 - now, beams), **given}
        items.append(Scan(**given))
    return items


def replayed(folder: Path, items: list[Recorded], kind: str = "mcap", **options: Any) -> tuple[list[Row], Replay, str]:
    """Rows, the replay, and what was lost."""
    folder.mkdir(exist_ok=True)
    log = Replay(write(folder, kind, items), Settings(log_options={"outline": OUTLINE, **options}))
    rows, lost = [], ""
    try:
        for row in log:
            rows.append(row)
    except LogError as error:
        lost = str(error)
    return rows, log, lost


def decisions(rows: list[Row]) -> list[tuple[Any, ...]]:
    return [(row.command, row.reason, row.ttc, row.value) for row in rows]


# Scans


def test_scans_that_measure_their_time_anew_are_all_judged(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    plain, _, _ = replayed(tmp_path / "a", approach(odometry=False))
    rows, log, lost = replayed(
        tmp_path / "b", approach(odometry=False, time_increment=lambda i: (0.1 + rng.normal(0.0, 1e-4)) / 181)
    )
    assert decisions(rows) == decisions(plain)  # the range rates go on
    assert (lost, log.summary.odd) == ("", [])


def test_a_senseless_time_between_beams_is_said(tmp_path: Path) -> None:
    rows, log, _ = replayed(tmp_path, approach(time_increment=lambda i: 153333.0))
    assert any(row.reason is Reason.CRITERION for row in rows)
    assert "60 times: is 153333 s from one beam to the next" in log.summary.odd[0]


def test_scans_of_a_few_readings_more_or_less_are_all_judged(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    counts = [BEAMS + int(rng.integers(-2, 3)) for _ in range(60)]
    for odometry in (True, False):
        rows, _, lost = replayed(tmp_path / str(odometry), approach(odometry=odometry, beams=lambda i: counts[i]))
        assert (len(rows), lost) == (60, "")
        assert any(row.reason is Reason.CRITERION for row in rows)


@pytest.mark.parametrize(
    "odd",
    [
        {"ranges": np.zeros(0, np.float32)},
        {"ranges": np.ones(1, np.float32), "increment": math.inf, "time_increment": math.inf},
        {"angle_max": 0.5},
    ],
)
def test_an_odd_first_scan_is_lost_and_the_others_are_judged(odd: dict[str, Any], tmp_path: Path) -> None:
    rows, _, lost = replayed(tmp_path, [Scan(-0.125, -0.125, **odd), *approach()])
    assert len(rows) == 60
    assert any(row.reason is Reason.CRITERION for row in rows)
    assert "The 60 frames that could be read" in lost


def test_a_scanner_whose_angles_contradict_its_readings_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"181 readings that end at 1\.5 rad, and angle_max 3 rad: nobody knows where"):
        replayed(tmp_path, approach(angle_max=lambda i: 3.0))


def test_a_count_off_by_one_is_said(tmp_path: Path) -> None:
    rows, log, lost = replayed(tmp_path, approach(increment=lambda i: 3.0 / BEAMS))
    assert (len(rows), lost) == (60, "")
    assert "a beam off" in log.summary.odd[0]


# Odometry


def turned(items: list[Recorded], yaw: float, factor: float | None = None) -> list[Recorded]:
    """The same drive along another heading: with the twist in the frame of the world, or times a factor."""
    made: list[Recorded] = []
    for item in items:
        if isinstance(item, Odom):
            cos, sin = math.cos(yaw), math.sin(yaw)
            speed, lateral_speed = (cos, sin) if factor is None else (factor, item.lateral_speed)
            placed = replace(item, x=item.x * cos, y=item.x * sin, yaw=yaw)
            made.append(replace(placed, speed=speed, lateral_speed=lateral_speed))
        else:
            made.append(item)
    return made


@pytest.mark.parametrize("yaw", [math.pi, 2.0])
def test_a_twist_in_the_frame_of_the_world_is_turned(yaw: float, tmp_path: Path) -> None:
    rows, log, _ = replayed(tmp_path / "a", turned(approach(), yaw))
    plain, _, _ = replayed(tmp_path / "b", approach())
    assert [row.speed for row in rows[20:]] == pytest.approx([1.0] * 40)
    assert [row.command for row in rows[20:]] == [row.command for row in plain[20:]]
    assert "the twist is in the frame of the world" in log.summary.odd[0]


@pytest.mark.parametrize("factor", [-1.0, 3.6])
def test_a_twist_that_contradicts_its_poses_is_said_and_not_used(factor: float, tmp_path: Path) -> None:
    rows, log, _ = replayed(tmp_path, turned(approach(), 1.0, factor))
    assert all(math.isnan(row.speed) for row in rows[30:])
    assert "the speed is taken as unknown" in log.summary.odd[0]


def test_sideways_motion_brakes(tmp_path: Path) -> None:
    items: list[Recorded] = []
    for i in range(60):
        items.append(Odom(i / 8, i / 8, lateral_speed=1.0, y=i / 8))
        ranges = np.where(np.abs(angles() - 1.3) < 0.3, max(6.0 - i / 8, 0.3), 9.0).astype(np.float32)
        items.append(Scan(i / 8, i / 8, ranges))
    rows, _, _ = replayed(tmp_path, items, outline=(-0.2, 0.6, -0.3, 0.3))
    assert any(row.reason is Reason.CRITERION for row in rows)


# Frames


def test_two_scanners_on_one_topic_are_refused_until_one_is_chosen(tmp_path: Path) -> None:
    both = approach(frame=lambda i: "rear" if i % 2 else "front")
    with pytest.raises(LogError, match="/scan has messages of two sensors, with the frame_id 'front' and 'rear'"):
        replayed(tmp_path, both)
    rows, log, lost = replayed(tmp_path / "front", both, frame="front")
    assert (len(rows), lost) == (30, "")
    assert "frame_id, 30 times: 'rear' is ignored" in log.summary.odd[0]
    with pytest.raises(LogError, match="has no messages with the frame_id 'left', but 'front', 'rear'"):
        replayed(tmp_path / "left", both, frame="left")


def test_scans_in_millimetres_are_said(tmp_path: Path) -> None:
    scans = approach(ranges=lambda i: 1000.0 * wall(6.0 - PERIOD * i), range_max=lambda i: 12_000.0)
    _, log, _ = replayed(tmp_path, scans)
    assert any("ranges, 60 times: half of them are 9000 m or more, read as" in each for each in log.summary.odd)


def test_a_slash_before_the_name_of_a_frame_makes_no_second_sensor(tmp_path: Path) -> None:
    rows, log, lost = replayed(tmp_path, approach(frame=lambda i: "/laser" if i % 2 else "laser"))
    assert (len(rows), lost) == (60, "")
    assert not any("frame_id" in each for each in log.summary.odd)


def test_a_second_scanner_that_comes_late_ends_the_replay(tmp_path: Path) -> None:
    rows, _, lost = replayed(tmp_path, approach(260, frame=lambda i: "rear" if i == 250 else "front"))
    assert len(rows) == 250
    assert "messages of two sensors, with the frame_id 'front' and 'rear'" in lost


def test_two_lidars_on_one_topic_are_refused_until_one_is_chosen(tmp_path: Path) -> None:
    clouds: list[Recorded] = [Cloud(i / 8, i / 8, frame="left" if i % 2 else "right") for i in range(8)]
    path = write(tmp_path, "mcap", clouds)
    with pytest.raises(LogError, match="/points has messages of two sensors"):
        open_log(path)
    assert len(list(open_log(path, frame="left"))) == 4


# Clocks


def test_a_first_stamp_of_zero_is_a_lost_frame_and_the_others_are_stamped(tmp_path: Path) -> None:
    """A simulation at half of real time."""
    for lost_frame in (0, 30):
        folder = tmp_path / str(lost_frame)
        folder.mkdir()
        log: Any = open_log(
            write(folder, "mcap", [Cloud(None if i == lost_frame else i / 8, i / 4) for i in range(60)])
        )
        frames = iter(log)
        stamps = [next(frames).stamp for _ in range(59)]
        with pytest.raises(LogError, match=r"has no stamp, and others of its topic have one\. The 59 frames"):
            next(frames)
        assert log.clock == "stamps of the messages"
        assert np.diff(stamps).max() == pytest.approx(0.125 if lost_frame == 0 else 0.25)


def test_odometry_without_stamps_counts_as_measured_when_it_came(tmp_path: Path) -> None:
    items = [Odom(None, item.recorded, speed=1.0, x=item.x) if isinstance(item, Odom) else item for item in approach()]
    rows, _, lost = replayed(tmp_path, items)
    assert [row.speed for row in rows] == [1.0] * 60
    assert lost == ""


def test_odometry_that_comes_late_does_not_replace_newer_one(tmp_path: Path) -> None:
    items: list[Recorded] = []
    for item in approach():
        items.append(item)
        if isinstance(item, Odom):
            items.append(Odom(item.recorded - 0.3, item.recorded, speed=0.0))
    rows, log, _ = replayed(tmp_path, items)
    assert [row.speed for row in rows] == [1.0] * 60
    assert "is older than what came before" in log.summary.odd[0]


@pytest.mark.parametrize("ahead", [-3e8, 3600.0])
def test_two_clocks_that_cannot_be_compared_are_named_and_one_is_chosen(ahead: float, tmp_path: Path) -> None:
    items = [
        Odom(item.recorded + ahead, item.recorded, speed=1.0) if isinstance(item, Odom) else item for item in approach()
    ]
    rows, _, lost = replayed(tmp_path / "a", items)
    assert all(math.isnan(row.speed) for row in rows)
    assert "two clocks that cannot be compared; the option clock='recorded' takes" in lost
    rows, log, lost = replayed(tmp_path / "b", items, clock="recorded")
    assert [row.speed for row in rows] == [1.0] * 60
    assert (lost, log.log.clock) == ("", "times of recording, as chosen")


@pytest.mark.parametrize(("ahead", "why"), [(5.0, "later than the frame"), (-5.0, "5.02 s older than the frame")])
def test_odometry_whose_clock_is_off_by_seconds_is_named(ahead: float, why: str, tmp_path: Path) -> None:
    items = [
        Odom(item.recorded + ahead, item.recorded, speed=1.0) if isinstance(item, Odom) else item for item in approach()
    ]
    rows, log, _ = replayed(tmp_path, items)
    assert all(math.isnan(row.speed) for row in rows[:40])
    assert any("/odom, clock" in each for each in log.summary.odd)
    assert why in log.summary.odd[0] or ahead < 0.0


def test_stamps_that_stand_still_are_no_silence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, "mcap", approach(stamp=lambda i: 1.0))
    main(["replay", str(path), "--outline", *map(str, OUTLINE), "--rows", "0"])
    text = capsys.readouterr().out
    assert "stands still" in text
    assert "nothing ever closes" not in text


def test_the_command_names_two_sensors_and_ends_with_a_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, "mcap", approach(frame=lambda i: "rear" if i % 2 else "front"))
    assert main(["replay", str(path), "--outline", *map(str, OUTLINE)]) not in (0, PARTIAL)
    assert "choose one with --frame" in capsys.readouterr().err


# Static transforms

LEFT = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))


@pytest.mark.parametrize("kind", KINDS)
def test_the_mount_comes_from_the_static_transforms_of_the_bag(kind: str, tmp_path: Path) -> None:
    placed: list[Recorded] = [
        Static(0.0, -1.0, "base_link", "mast", (0.2, 0.0, 1.0)),
        Static(0.0, -1.0, "mast", "laser", (0.1, 0.0, 0.0), LEFT),
    ]
    log: Any = open_log(write(tmp_path, kind, [*placed, *approach(4)]))
    assert log.scanner.mount == pytest.approx((0.3, 0.0, math.pi / 2))
    assert log.mounted == "by the static transforms from base_link to laser"


def test_the_summary_says_which_mount_was_used_and_the_user_wins(tmp_path: Path) -> None:
    items = [Static(0.0, -1.0, "base_link", "laser", (0.2, 0.0, 1.0), LEFT), *approach()]
    rows, log, _ = replayed(tmp_path / "a", items)
    assert "at x 0.2 m, y 0 m, yaw 1.5708 rad, by the static transforms" in dict(log.pipeline.about)["scanner"]
    assert not any(row.reason is Reason.CRITERION for row in rows)
    rows, log, _ = replayed(tmp_path / "b", items, mount=(0.0, 0.0, 0.0))
    assert "static" not in dict(log.pipeline.about)["scanner"]
    assert any(row.reason is Reason.CRITERION for row in rows)
    rows, _, _ = replayed(tmp_path / "c", items, base_frame="map")
    assert any(row.reason is Reason.CRITERION for row in rows)


def test_a_scanner_that_hangs_upside_down(tmp_path: Path) -> None:
    items = [Static(0.0, -1.0, "base_link", "laser", rotation=(1.0, 0.0, 0.0, 0.0)), *approach(4)]
    log: Any = open_log(write(tmp_path, "mcap", items))
    assert (log.scanner.angle_min, log.scanner.angle_increment < 0.0) == (1.5, True)


@pytest.mark.parametrize("kind", KINDS)
def test_a_static_transform_that_was_recorded_late_places_the_sensor_all_the_same(kind: str, tmp_path: Path) -> None:
    scans: list[Recorded] = [Scan(i / 8, i / 8) for i in range(300)]
    log: Any = open_log(write(tmp_path, kind, [*scans, Static(0.0, 40.0, "base_link", "laser", (0.2, 0.0, 1.0), LEFT)]))
    assert log.scanner.mount == pytest.approx((0.2, 0.0, math.pi / 2))


def test_a_scanner_that_no_transform_places_is_said(tmp_path: Path) -> None:
    _, log, _ = replayed(tmp_path, [Static(0.0, -1.0, "base_link", "imu", (0.2, 0.0, 1.0), LEFT), *approach(9)])
    assert "yaw 0 rad, as no static transform places laser" in dict(log.pipeline.about)["scanner"]


def test_a_scanner_that_is_tilted_is_refused_until_the_user_places_it(tmp_path: Path) -> None:
    down = (0.0, math.sin(math.radians(15)), 0.0, math.cos(math.radians(15)))
    items = [Static(0.0, -1.0, "base_link", "laser", rotation=down), *approach(9)]
    rows, _, lost = replayed(tmp_path / "a", items)
    assert rows == []
    assert "/scan is tilted by 30 degrees" in lost
    rows, _, lost = replayed(tmp_path / "b", items, mount=(0.2, 0.0, 0.0))
    assert (len(rows), lost) == (9, "")


def test_a_mask_of_other_beams_refuses_the_scan_and_not_the_log(tmp_path: Path) -> None:
    path = write(tmp_path, "mcap", approach(beams=lambda i: BEAMS + (i % 3 == 2)))
    configuration = Configuration(scan={"mask": np.ones(BEAMS, bool)})
    log = Replay(path, Settings(configuration, {"outline": OUTLINE}))
    with pytest.raises(LogError, match=r"cannot be read with these settings: scan: mask .*The 40 frames that could"):
        list(log)
    assert log.summary.frames == 40


def test_clouds_of_optical_frames_are_read_with_their_axes(tmp_path: Path) -> None:
    log: Any = open_log(write(tmp_path, "mcap", [Cloud(0.0, 0.0, frame="camera_optical_frame")]))
    assert log.lidar.axes == ("z", "-x", "-y")
    list(log)
    assert "has z forward" in log.odd.sentences()[0]


# Node and replay


def played(node: Any, items: list[Recorded]) -> list[tuple[Any, ...]]:
    """Send the messages to a node whose clock is at their stamps, and return its decisions on scans."""
    core = getattr(node.node, "core", node.node)
    seen = []
    for item in items:
        stamp = BEGIN / 1e9 + (item.recorded if item.stamp is None else item.stamp)
        node.now = stamp
        if isinstance(item, Odom):
            pose = Pose(item.x, item.y, item.yaw)
            node.odometry(
                item.speed, item.yaw_rate, lateral_speed=item.lateral_speed, pose=pose, stamp=item.stamp and stamp
            )
        elif isinstance(item, Static):
            node.transform(item.parent, item.child, item.at, item.rotation)
        elif isinstance(item, Cloud):
            node.points(item.points, frame=item.frame, stamp=stamp)
            decision = core._latest
            seen.append((decision.command, decision.reason, decision.threats, decision.value))
        elif isinstance(item, Scan):
            geometry = {
                "angle_min": item.angle_min,
                "angle_max": item.angle_max,
                "angle_increment": float(np.float32(item.step)),
                "time_increment": item.time_increment,
                "range_min": 0.0625,
                "range_max": 30.0,
            }
            node.scan(item.ranges, stamp=stamp, frame=item.frame, **geometry)
            decision = core._latest
            seen.append((decision.command, decision.reason, decision.threats, decision.value))
    return seen


DRIVES: dict[str, list[Recorded]] = {
    "plain": approach(),
    "repeats": [
        replace(each, stamp=each.recorded + late, recorded=each.recorded + late)
        for each in approach()
        for late in ((0.0, 0.004, 0.008, 0.03) if isinstance(each, Scan) else (0.0,))
    ],
    "varying counts": approach(beams=lambda i: BEAMS + i % 5),
    "world frame": turned(approach(), 2.0),
    "other units": turned(approach(), 1.0, 3.6),
    "sideways": [
        Odom(each.stamp, each.recorded, speed=0.5, lateral_speed=0.8) if isinstance(each, Odom) else each
        for each in approach()
    ],
}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("transport", ["core", "rospy", "rclpy", "dds"])
def test_a_node_decides_as_the_replay_of_the_same_messages(
    transport: str, drive: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    items = DRIVES[drive]
    rows, _, _ = replayed(tmp_path, items, "bag" if transport == "rospy" else "mcap")
    parameters = {"outline": list(OUTLINE)}
    kinds = {"rospy": RospyHarness, "rclpy": RclpyHarness, "dds": DdsHarness}
    node: Any = CoreHarness(**parameters) if transport == "core" else kinds[transport](monkeypatch, **parameters)
    try:
        decided = played(node, items)
    finally:
        node.close()
    assert [each[:2] for each in decided] == [(row.command, row.reason) for row in rows]
    by_motion = [not math.isnan(row.speed) for row in rows]
    new = [known and each[2] is not None for each, known in zip(decided, by_motion, strict=True)]
    ttcs = [each[2].path.ttc if known else None for each, known in zip(decided, new, strict=True)]
    assert ttcs == [row.ttc if known else None for row, known in zip(rows, new, strict=True)]
    known = [pair for pair, known in zip(zip(rows, decided, strict=True), by_motion, strict=True) if known]
    assert all(each[3] == row.value for row, each in known if row.criterion)
    assert all(math.isnan(row.value) for row, _ in known if not row.criterion)
    assert len(known) > 10


WIDE = np.dtype([("ring", "<u2"), ("z", "<f4"), ("x", "<f4"), ("y", "<f4"), ("intensity", "<f4"), ("t", "<f8")])
NARROW = np.dtype([(name, "<f4") for name in "xyz"])
HEIGHTS = (0.05, 2.0)
"""m above the origin of the vehicle, which is the default of the node."""


def clouds(
    yaw: float = 0.0, up: float = 0.0, *, late: int = 0, changing: bool = False, closing: float = 3.0
) -> list[Recorded]:
    """Drive at a wall at 3 m/s, below a bridge and over a kerb, with a lidar that is turned and ``up`` m high.

    The first ``late`` clouds come without odometry; the fields of the clouds may change on the way, and the wall may
    come closer by itself.
    """
    rng = np.random.default_rng(5)
    at = (0.5, 0.0, up)
    turned = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    is_placed = bool(yaw or up)
    items: list[Recorded] = [Static(0.0, -1.0, "base_link", "lidar", at, turned)] if is_placed else []
    for i in range(40):
        now = PERIOD * i
        if i >= late:
            items.append(Odom(now - 1 / 64, now - 1 / 64, speed=3.0, x=3.0 * now))
        distance = max(15.0 - closing * now, 0.7)
        wall = np.column_stack([np.full(200, distance), rng.uniform(-2, 2, 200), rng.uniform(0.1, 1.9, 200)])
        bridge, kerb = wall * (0.5, 1.0, 0.0) + (0.0, 0.0, 3.0), wall * (0.3, 1.0, 0.0)
        there = np.concatenate([wall, bridge, kerb]) - (at if is_placed else (0.0, 0.0, 0.0))
        cos, sin = math.cos(yaw), math.sin(yaw)
        rows = there @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # as the turned lidar has them
        rows[rng.integers(0, 600, 30)] = 0.0  # where nothing came back
        records = np.zeros(600, WIDE if changing and i % 3 == 1 else NARROW)
        for name, column in zip("xyz", rows.T, strict=True):
            records[name] = column
        items.append(Cloud(now, now, records.reshape(20, 30) if changing and i % 3 == 2 else records))
    return items


CLOUDS: dict[str, tuple[list[Recorded], float]] = {
    "plain": (clouds(), 0.0),
    "lidar to the left, on a mast": (clouds(math.pi / 2, 1.25), 1.25),
    "lidar back": (clouds(math.pi, 0.5), 0.5),
    "changing fields": (clouds(0.7, 0.5, changing=True), 0.5),
    "odometry comes late": (clouds(late=8), 0.0),
    "oncoming": (clouds(closing=7.0), 0.0),
}


@pytest.mark.parametrize("drive", CLOUDS)
@pytest.mark.parametrize("transport", ["core", "rospy", "rclpy", "dds"])
def test_a_node_decides_as_the_replay_of_the_same_clouds(
    transport: str, drive: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    items, up = CLOUDS[drive]
    heights = (HEIGHTS[0] - up, HEIGHTS[1] - up)
    path = write(tmp_path, "bag" if transport == "rospy" else "mcap", items)
    rows = list(Replay(path, Settings(log_options={"outline": OUTLINE}, gate={"z": heights})))
    parameters = {"outline": list(OUTLINE), "scan_topic": "", "points_topic": "/points"}
    kinds = {"rospy": RospyHarness, "rclpy": RclpyHarness, "dds": DdsHarness}
    node: Any = CoreHarness(**parameters) if transport == "core" else kinds[transport](monkeypatch, **parameters)
    try:
        decided = played(node, items)
    finally:
        if transport == "dds":
            node.close()
    assert [each[:2] for each in decided] == [(row.command, row.reason) for row in rows]
    assert all(each[3] == row.value for each, row in zip(decided, rows, strict=True) if row.criterion)
    assert all(math.isnan(row.value) and math.isnan(row.threshold) for row in rows if not row.criterion)
    assert Reason.CRITERION in [row.reason for row in rows]
    assert Reason.CLEAR in [row.reason for row in rows]


def test_the_tracker_of_a_replay_looks_ahead_of_the_vehicle_whatever_the_yaw(tmp_path: Path) -> None:
    """The lidar looks back and is read by the transforms, by a mount, or by axes; the wall is 15 m ahead."""
    items, up = CLOUDS["lidar back"]
    heights = (HEIGHTS[0] - up, HEIGHTS[1] - up)
    bare: list[Recorded] = [each for each in items if not isinstance(each, Static | Odom)]
    ways: list[tuple[list[Recorded], dict[str, Any]]] = [
        (items, {}),
        (bare, {"mount": (0.5, 0.0, math.pi)}),
        (bare, {"axes": ("-x", "-y", "z")}),
    ]
    for number, (recorded, said) in enumerate(ways):
        folder = tmp_path / str(number)
        folder.mkdir()
        replay = Replay(write(folder, "mcap", recorded), Settings(log_options=said, gate={"z": heights}))
        first, *_, last = replay
        assert first.distance == pytest.approx(14.5, abs=0.01)
        assert last.closing_speed == pytest.approx(3.0, abs=0.2)


@pytest.mark.parametrize("gap", [0, 20])
def test_range_rates_of_node_and_replay_are_the_same_bits(gap: int, tmp_path: Path) -> None:
    """Odometry is never there, or fails on the way while the vehicle turns."""
    items: list[Recorded] = [
        item if isinstance(item, Scan) else Odom(item.stamp, item.recorded, speed=1.0, yaw_rate=0.3)
        for i, item in enumerate(approach())
        if isinstance(item, Scan) or i < 2 * gap
    ]
    rows, log, _ = replayed(tmp_path, items)
    node = CoreHarness(outline=list(OUTLINE)).node
    odometry = {row.stamp: row for row in rows if not math.isnan(row.speed)}
    frames: Any = open_log(log.log.path)
    for row, frame in zip(rows, frames, strict=True):
        if row.stamp in odometry and frame.speed is not None:
            node.on_odometry(frame.stamp, frame.stamp - frame.speed_age, frame.speed, frame.yaw_rate)
        decision = node.on_scan(frame.stamp, frame.stamp, scan_of(list(items), frame)).decision
        assert (decision.command, decision.reason) == (row.command, row.reason)
        assert decision.value == row.value or not row.criterion
        if decision.threats is not None:
            threat = decision.threats.path or decision.threats.beams
            assert threat is not None
            assert threat.ttc == row.ttc
    assert any(row.reason is Reason.CRITERION for row in rows)


def scan_of(items: list[Item], frame: Any) -> Any:
    from types import SimpleNamespace

    geometry = frame.geometry
    return SimpleNamespace(
        angle_min=geometry.angle_min,
        angle_increment=geometry.angle_increment,
        range_min=geometry.range_min,
        range_max=geometry.range_max,
        time_increment=frame.time_increment,
        ranges=frame.ranges,
    )
