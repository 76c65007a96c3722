"""What the driver asks for and takes over: every test runs against the core and through each adapter."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import CAR
from tests.support.ros_harness import Drive
from ttc_fast.ros.settings import NodeSettings, SettingError, full_name

if TYPE_CHECKING:
    from collections.abc import Callable

    Make = Callable[..., Any]

PERIOD = 0.025
BEAMS = 360
AROUND = {"angle_min": -math.pi, "angle_increment": 2 * math.pi / BEAMS}
WALL = {"outline": list(CAR), "stopping_distance": True}
DRIVEN = {**WALL, "commanded_topic": "/drive_in", "wheelbase": 0.33}


SCANS = itertools.count()


def ahead(distance: float, noise: float = 1e-4) -> Any:
    """Return a scan all around of a wall ahead, in a wide hall. No two scans that follow each other are alike."""
    angles = AROUND["angle_min"] + AROUND["angle_increment"] * np.arange(BEAMS)
    with np.errstate(divide="ignore"):
        hall = np.where(np.cos(angles) > 0, np.minimum(distance / np.cos(angles), 25.0), 25.0)
    return hall + noise * (next(SCANS) % 2)


def stopped(node: Any, distance: float = 0.6) -> Any:
    """Return a node that has braked from 4 m/s, and whose car stands before the wall."""
    for speed in (4.0, 4.0, 4.0, 4.0, 0.0, 0.0, 0.0):
        node.now += PERIOD
        node.odometry(speed)
        seen = node.scan(ahead(distance), **AROUND)
    assert seen.brake is True
    return node


def stand(node: Any, frames: int = 1, distance: float = 0.6) -> Any:
    for _ in range(frames):
        node.now += PERIOD
        node.odometry(0.0)
        seen = node.scan(ahead(distance), **AROUND)
    return seen


class TestCommanded:
    def test_backwards_is_let_go_and_forwards_is_not(self, make: Make) -> None:
        node = stopped(make(**DRIVEN))
        node.ask(2.0)
        assert stand(node, 4).brake is True
        node.ask(-1.0)
        assert stand(node).brake is False

    def test_where_nothing_moves_and_scans_are_alike_it_is_let_go_within_half_a_second(self, make: Make) -> None:
        """With the usual votes, hold and timeouts."""
        node = stopped(make(**DRIVEN, trigger=[3, 4], release=[3, 5], hold=0.5))
        asked = node.now + 1.0
        while True:
            node.now += PERIOD
            node.odometry(0.0)
            node.ask(-1.0 if node.now >= asked else 2.0)
            if node.scan(ahead(0.6, noise=0.0), **AROUND).brake is False:
                break
        assert 0.0 <= node.now - asked < 0.5

    def test_what_was_asked_for_long_ago_is_not_asked_for(self, make: Make) -> None:
        node = stopped(make(**DRIVEN, commanded_timeout=0.2))
        node.ask(-1.0)
        node.now += 0.2
        assert stand(node).brake is True
        assert "commanded speed" not in node.diagnostics().values

    def test_a_command_that_is_not_finite_is_dropped(self, make: Make) -> None:
        node = stopped(make(**DRIVEN))
        node.ask(math.nan)
        node.ask(-1.0, math.inf)
        assert stand(node).brake is True
        assert node.diagnostics().values["dropped: /drive_in"].startswith("2; is not finite")
        node.ask(1e9)
        assert stand(node).brake is True
        assert "no motion of a vehicle" in node.diagnostics().values["dropped: /drive_in"]

    def test_a_steering_angle_bends_the_path(self, make: Make) -> None:
        """The wall is 2 m ahead: full steering turns away from it in a circle of 0.78 m, and straight ahead is near."""
        for steering_angle, brakes in ((0.0, True), (0.4, False)):
            node = stopped(make(**DRIVEN), 2.0)
            node.ask(3.0, steering_angle)
            assert stand(node, distance=2.0).brake is brakes

    @pytest.mark.parametrize("degrees", [17.0, -17.0, 90.0, 1.6])
    def test_a_steering_angle_in_degrees_is_no_motion_asked_for(self, make: Make, degrees: float) -> None:
        node = stopped(make(**DRIVEN), 2.0)
        for _ in range(4):
            node.ask(-3.0, degrees)
            assert stand(node, distance=2.0).brake is True
        said = node.diagnostics().values["odd: /drive_in, steering_angle"]
        assert said.startswith(f"4; is {degrees:g}, which is no steering angle in rad, and is perhaps in degrees")
        node.ask(-3.0, 0.1)
        assert stand(node, distance=2.0).brake is False

    def test_a_twist_is_taken_as_well(self, make: Make) -> None:
        for yaw_rate, brakes in ((0.0, True), (4.0, False)):
            node = stopped(make(**{**DRIVEN, "commanded_topic": "/cmd_vel"}), 2.0)
            node.twist(3.0, yaw_rate)
            assert stand(node, distance=2.0).brake is brakes

    def test_without_a_wheelbase_the_path_is_straight_and_that_is_said(self, make: Make) -> None:
        node = stopped(make(**{**DRIVEN, "wheelbase": 0.0}), 2.0)
        node.ask(3.0, 0.4)
        assert stand(node, distance=2.0).brake is True
        assert "no wheelbase is set" in node.diagnostics().values["odd: /drive_in, wheelbase"]

    def test_it_brakes_with_the_wheels_where_the_driver_has_them(self, make: Make) -> None:
        node = stopped(make(**DRIVEN))
        assert node.steering_angle() == 0.0
        node.ask(2.0, -0.25)
        assert node.steering_angle() == -0.25
        node.now += 0.51
        assert node.steering_angle() == 0.0

    def test_a_clock_that_is_set_back_forgets_it(self, make: Make) -> None:
        node = stopped(make(**DRIVEN))
        node.now += 100.0
        node.ask(-1.0)
        node.now -= 100.0
        assert node.wait(0.0).brake is True
        assert "commanded speed" not in node.diagnostics().values


class TestMux:
    def test_what_is_asked_for_goes_out_as_it_came(self, make: Make) -> None:
        node = make(**WALL, mux=True, wheelbase=0.33)
        asked = Drive(1.5, 0.25, 2.5, 0.5, -1.25)
        node.now += PERIOD
        node.odometry(1.0)
        assert node.scan(ahead(20.0), **AROUND) == (False, None, None)
        assert node.ask(**asked._asdict()) == [asked]

    def test_a_braked_car_is_sent_0_instead(self, make: Make) -> None:
        node = stopped(make(**WALL, mux=True, wheelbase=0.33))
        assert node.ask(2.0, 0.25) == [Drive(0.0, 0.25, 6.0)]
        assert node.ask(-1.0) == [Drive(0.0, 0.0, 6.0)]
        assert stand(node).brake is False
        assert node.ask(-1.0) == [Drive(-1.0)]

    def test_without_scans_nothing_goes_out(self, make: Make) -> None:
        node = make(**WALL, mux=True)
        assert node.ask(2.0) == [Drive(0.0, 0.0, 6.0)]
        node.now += PERIOD
        node.odometry(1.0)
        node.scan(ahead(20.0), **AROUND)
        assert node.ask(2.0) == [Drive(2.0)]
        node.now += 1.0
        assert node.ask(2.0) == [Drive(0.0, 0.0, 6.0)]

    def test_a_command_that_is_not_finite_is_not_sent_on(self, make: Make) -> None:
        node = make(**WALL, mux=True)
        node.now += PERIOD
        node.odometry(1.0)
        node.scan(ahead(20.0), **AROUND)
        assert node.ask(math.nan) == []


class TestOverride:
    def test_it_holds_as_long_as_it_is_confirmed(self, make: Make) -> None:
        node = stopped(make(**WALL, override_topic="/override", override_timeout=0.11))
        node.override(True)
        assert stand(node, 4).brake is False
        assert "OVERRIDE" in node.diagnostics().message
        assert stand(node).brake is True
        node.override(True)
        assert stand(node).brake is False
        node.override(False)
        assert stand(node).brake is True

    def test_a_button_of_a_joystick(self, make: Make) -> None:
        node = stopped(make(**WALL, override_topic="/joy", override_button=4))
        node.press([0, 0, 0, 0, 1])
        assert stand(node).brake is False
        node.press([1, 1, 1, 1, 0])
        assert stand(node).brake is True

    def test_a_joystick_without_that_button(self, make: Make) -> None:
        node = stopped(make(**WALL, override_topic="/joy", override_button=4))
        node.press([1, 1, 1, 1])
        assert stand(node).brake is True
        why = "1; has 4 buttons, counted from 0, and override_button is 4"
        assert node.diagnostics().values["dropped: /joy"] == why

    def test_a_car_that_sees_nothing_is_let_go_too(self, make: Make) -> None:
        node = make(**WALL, override_topic="/override")
        assert node.wait(0.1).brake is True
        node.override(True)
        assert node.wait(0.1).brake is False


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"mux": True, "drive_topic": ""}, "mux needs a drive_topic"),
        ({"mux": True, "drive_always": True}, "drive_always must be false with mux"),
        ({"mux": True, "drive_topic": "drive_in"}, "commanded_topic and drive_topic are both drive_in"),
        ({"commanded_topic": "drive"}, "name another topic for what the driver asks for"),
        ({"commanded_topic": "my drive"}, "commanded_topic must be the name of a topic, such as scan"),
        ({"odom_topics": ["odom", "1odom"]}, "odom_topics must be the name of a topic"),
        ({"commanded_timeout": 0.0}, "commanded_timeout must be finite and above 0"),
        ({"override_button": -1}, "override_button must be"),
        ({"override_button": 1.5}, "override_button must be"),
        ({"wheelbase": -0.3}, "wheelbase must be finite and at least 0"),
    ],
)
def test_what_is_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingError) as caught:
        NodeSettings.of(given)
    assert says in str(caught.value)


def test_topics_that_become_the_same_by_their_full_names_are_refused() -> None:
    with pytest.raises(SettingError, match="are both /drive"):
        NodeSettings(mux=True).resolved(lambda topic: "/drive" if topic.startswith("drive") else full_name(topic))
