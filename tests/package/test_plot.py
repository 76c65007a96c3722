"""`ttc_fast.plot`: every kind of answer, drawn by the code that draws replays."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import ttc_fast
from ttc_fast import BrakeController, CloudTracker, DistanceTracker, Gate, KthSmallest, Motion, ScanSweptPath, ScanTTC
from ttc_fast.logs import CloudLog, ScanLog, open_log
from ttc_fast.plotting.style import ALARM, CAUTION
from ttc_fast.replay import sample

OUTLINE = (-0.1, 0.4, -0.15, 0.15)
SCAN = ScanTTC(-1.5, 0.01, 301, range_max=30.0, mount=(0.27, 0.0, 0.0), outline=OUTLINE)
RANGES = np.full(301, 6.0)
RANGES[145:156] = 3.0
POINTS = np.column_stack([np.full(50, 3.0), np.linspace(-0.5, 0.5, 50)])


def drawn(figure: Figure, colour: str) -> int:
    """How many points have a colour."""
    lines = [line for axes in figure.axes for line in axes.lines if line.get_color() == colour]
    return sum(len(np.asarray(line.get_xdata())) for line in lines)


def texts(figure: Figure) -> str:
    return "\n".join(
        text
        for axes in figure.axes
        for text in (axes.get_title(loc="left"), axes.get_ylabel(), *axes.get_legend_handles_labels()[1])
    )


def clouds() -> tuple[CloudLog, Gate, CloudTracker]:
    log = open_log(sample("clouds"))
    assert isinstance(log, CloudLog)
    lidar = log.lidar
    assert lidar.sensor_height is not None
    gate = Gate.above_road(lidar.sensor_height, clearance=0.25, headroom=2.0, front=lidar.own_reach)
    return log, gate, CloudTracker(gate, front_offset=lidar.front_offset)


def test_a_scan_shows_what_the_outline_will_touch() -> None:
    figure = ttc_fast.plot(ScanSweptPath(SCAN).nearest(RANGES, 4.0), RANGES, scan=SCAN, motion=4.0)
    threats = (ScanSweptPath(SCAN).per_beam(RANGES, 4.0) < 1.5).sum()
    assert drawn(figure, ALARM) == threats > 5
    said = texts(figure)
    for part in (
        "CLOSING: 0.72 s to collision, 2.87 m",
        "its path in 1.5 s",
        "nearest in time",
        "contact within 1.5 s",
    ):
        assert part in said


def test_without_a_motion_the_beam_that_decided_is_shown() -> None:
    figure = ttc_fast.plot(SCAN.nearest(RANGES, 4.0), RANGES, scan=SCAN)
    assert drawn(figure, ALARM) == 1
    assert "its path" not in texts(figure)


def test_a_decision_has_the_threshold_of_its_criterion() -> None:
    brake = BrakeController([ttc_fast.SweptPathThreshold(0.8)], scan=SCAN, trigger=(1, 1))
    decision = brake.update(0.0, ranges=RANGES, stamp=0.0, motion=Motion(4.0))
    said = texts(ttc_fast.plot(decision, RANGES, scan=SCAN, motion=Motion(4.0)))
    assert "BRAKE (CRITERION)" in said
    assert "contact within 0.8 s" in said


def test_a_decision_on_a_cloud() -> None:
    path = ttc_fast.SweptPath(OUTLINE)
    brake = BrakeController(path=path, trigger=(1, 1))
    decision = brake.update(0.0, points=POINTS, stamp=0.0, motion=Motion(4.0))
    for answer in (decision, path.nearest(POINTS, 4.0)):
        figure = ttc_fast.plot(answer, POINTS, outline=OUTLINE, motion=Motion(4.0))
        assert drawn(figure, ALARM) == (np.abs(POINTS[:, 1]) <= 0.15).sum()


def test_a_cloud_shows_the_body_and_the_stray_point() -> None:
    log, gate, tracker = clouds()
    for frame in log:
        seen = tracker.update(frame.points, frame.stamp)
    figure = ttc_fast.plot(seen, frame.points, gate=gate, front_offset=log.lidar.front_offset)
    assert drawn(figure, ALARM) > 100
    assert drawn(figure, CAUTION) == 1
    found = ttc_fast.robust_min_x(frame.points, gate=gate, estimator=KthSmallest(10))
    assert f"FOUND: {found.x:.2f} m" in texts(ttc_fast.plot(found, frame.points, gate=gate))


@pytest.mark.parametrize("axes", [("x", "y", "z"), ("y", "-x", "z")])
def test_a_cloud_of_any_layout(axes: tuple[str, str, str]) -> None:
    x, y = POINTS.T
    stored = np.column_stack([x, y, 0 * x] if axes[0] == "x" else [-y, x, 0 * x])
    gate = Gate(axes=axes)
    found = ttc_fast.robust_min_x(stored, gate=gate, estimator=KthSmallest(10))
    records = np.array([tuple(row) for row in stored], [(name, float) for name in "xyz"])
    for cloud in (
        stored,
        records,
        tuple(np.ascontiguousarray(column) for column in stored.T),
        stored.reshape(5, 10, 3),
    ):
        assert drawn(ttc_fast.plot(found, cloud, gate=gate), ALARM) == 50


def test_a_tracker_over_time() -> None:
    tracker = DistanceTracker()
    answers = [tracker.update(30.0 - i, stamp=0.1 * i) for i in range(20)]
    figure = ttc_fast.plot([*answers, tracker.update(None, stamp=2.1)], stamps=0.1 * np.arange(21))
    assert [axes.get_ylabel() for axes in figure.axes] == ["time to collision, s", "distance, m", "speed, m/s"]
    assert "90 % interval" in texts(figure)
    assert ttc_fast.plot([tracker.update(None, stamp=2.2)]).axes  # without a single number


def test_a_notebook_shows_it_and_axes_may_be_given() -> None:
    figure = ttc_fast.plot(SCAN.nearest(RANGES, 4.0), RANGES, scan=SCAN)
    assert figure._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    mine = Figure()
    axes = mine.add_subplot()
    assert ttc_fast.plot(SCAN.nearest(RANGES, 4.0), RANGES, scan=SCAN, axes=axes) is mine
    assert axes.lines


def test_the_panels_of_a_history_take_the_place_of_given_axes() -> None:
    mine = Figure()
    place, other = mine.subplots(2)
    tracker = DistanceTracker()
    answers = [tracker.update(30.0 - i, stamp=0.1 * i) for i in range(20)]
    assert ttc_fast.plot(answers, axes=place) is mine
    drawn_into = [axes for axes in mine.axes if axes is not other]
    assert [bool(axes.lines) for axes in drawn_into] == [True] * 3
    assert min(axes.get_position().y0 for axes in drawn_into) > other.get_position().y1
    with pytest.raises(ValueError, match="axes must be a subplot"):
        ttc_fast.plot(answers, axes=mine.add_axes((0.0, 0.0, 1.0, 1.0)))


def test_nothing_valid_is_drawn_as_nothing() -> None:
    blind = np.full(301, np.nan)
    assert drawn(ttc_fast.plot(SCAN.nearest(blind, 4.0), blind, scan=SCAN, motion=4.0), ALARM) == 0
    none = np.zeros((0, 3))
    found = ttc_fast.robust_min_x(none, gate=Gate(), estimator=KthSmallest(10))
    assert drawn(ttc_fast.plot(found, none), ALARM) == 0


@pytest.mark.parametrize(
    ("arguments", "settings", "said"),
    [
        ((3, RANGES), {}, "result must be an answer about one frame"),
        (([], RANGES), {}, "result must be an answer about one frame"),
        ((SCAN.nearest(np.stack([RANGES] * 2), 1.0), RANGES), {"scan": SCAN}, r"of a batch, result\[i\] is one"),
        ((SCAN.nearest(RANGES, 1.0),), {"scan": SCAN}, "frame must be the ranges or points"),
        ((SCAN.nearest(RANGES, 1.0), RANGES), {}, "scan must be the ScanTTC of the ranges"),
        ((SCAN.nearest(RANGES, 1.0), RANGES[:9]), {"scan": SCAN}, "ranges must have one entry for each of the 301"),
        ((ttc_fast.SweptPath(OUTLINE).nearest(POINTS, 1.0), POINTS), {}, "outline must be that of the vehicle"),
        (([DistanceTracker().update(1.0, stamp=0.0)],), {"stamps": [1.0, 2.0]}, "stamps must be 1, one for each"),
    ],
)
def test_what_cannot_be_drawn(arguments: tuple[Any, ...], settings: dict[str, Any], said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        ttc_fast.plot(*arguments, **settings)


def test_without_matplotlib_it_says_what_to_install() -> None:
    program = "import sys; sys.modules['matplotlib'] = None; import ttc_fast; ttc_fast.plot(1, 2)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "ttc_fast.plot needs matplotlib, which is not installed: pip install '.[plot]'" in done.stderr


def test_the_samples_draw_as_in_a_replay() -> None:
    log = open_log(sample("scans"))
    assert isinstance(log, ScanLog)
    scan = ScanTTC(**vars(log.scanner))
    *_, frame = (frame for frame, _ in zip(log, range(60), strict=False))
    assert frame.speed is not None
    nearest = ScanSweptPath(scan).nearest(frame.ranges, frame.speed, frame.yaw_rate)
    motion = Motion(frame.speed, frame.yaw_rate)
    assert drawn(ttc_fast.plot(nearest, frame.ranges, scan=scan, motion=motion), ALARM) > 3
