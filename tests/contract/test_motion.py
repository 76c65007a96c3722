"""The formulae of motion: known values, what holds of every value, and what is refused."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import ttc_fast
from tests.support.common import every_module
from ttc_fast import Status

if TYPE_CHECKING:
    from collections.abc import Callable

ordinary = st.floats(1e-3, 1e3)
signed = st.floats(-1e3, 1e3)

VALID: dict[str, dict[str, float]] = {
    "ttc_constant_velocity": {"distance": 10.0, "closing_speed": 5.0},
    "ttc_constant_acceleration": {"distance": 10.0, "closing_speed": 10.0, "closing_acceleration": -2.0},
    "time_headway": {"distance": 30.0, "speed": 20.0},
    "deceleration_to_avoid_crash": {"distance": 10.0, "closing_speed": 10.0},
    "stopping_distance": {"speed": 10.0, "deceleration": 5.0, "reaction_time": 0.5},
    "rss_longitudinal_distance": {
        "rear_speed": 20.0,
        "front_speed": 20.0,
        "response_time": 1.0,
        "acceleration_max": 2.0,
        "braking_min": 4.0,
        "braking_max": 8.0,
    },
}
ANSWERS = {
    "ttc_constant_velocity": 2.0,
    "ttc_constant_acceleration": 5.0 - math.sqrt(15.0),
    "time_headway": 1.5,
    "deceleration_to_avoid_crash": 5.0,
    "stopping_distance": 15.0,
    "rss_longitudinal_distance": 56.5,
}
POSITIONAL = {"distance", "speed", "rear_speed", "front_speed"}
ARGUMENTS = [(name, argument) for name, arguments in VALID.items() for argument in arguments]


def called(module: Any, name: str, **changed: Any) -> Any:
    """The formula with its valid arguments, some of them changed."""
    arguments = VALID[name] | changed
    keywords = {key: value for key, value in arguments.items() if key not in POSITIONAL or _is_keyword(name, key)}
    return getattr(module, name)(*(arguments[key] for key in arguments if key not in keywords), **keywords)


def _is_keyword(name: str, key: str) -> bool:
    return name == "time_headway" and key == "speed"


@every_module
@pytest.mark.parametrize("name", VALID)
def test_known_values_as_number_and_as_array(module: Any, name: str) -> None:
    one = called(module, name)
    assert type(one) is float
    assert one == pytest.approx(ANSWERS[name], rel=1e-15)
    for dtype in (np.float32, np.float64):
        arrays = {key: np.full(3, value, dtype) for key, value in VALID[name].items()}
        many = called(module, name, **arrays)
        assert many.dtype == dtype
        np.testing.assert_array_equal(many, np.full(3, one, dtype))


@every_module
@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_a_nan_is_refused_as_a_number_and_marked_in_an_array(module: Any, name: str, argument: str) -> None:
    with pytest.raises(ValueError, match=argument):
        called(module, name, **{argument: math.nan})
    many = called(module, name, **{argument: np.array([math.nan, VALID[name][argument]])})
    unknown = math.inf if name.startswith("ttc") else math.nan
    np.testing.assert_array_equal(many, [unknown, called(module, name)])


@every_module
@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_what_is_no_number(module: Any, name: str, argument: str) -> None:
    for value in ("fast", None, {1.0, 2.0}, np.array(["fast"])):
        with pytest.raises((TypeError, ValueError), match=argument):
            called(module, name, **{argument: value})


OUT_OF_DOMAIN = [
    ("stopping_distance", "deceleration", 0.0),
    ("stopping_distance", "deceleration", -1.0),
    ("stopping_distance", "reaction_time", -0.1),
    ("rss_longitudinal_distance", "response_time", -0.1),
    ("rss_longitudinal_distance", "acceleration_max", -0.1),
    ("rss_longitudinal_distance", "braking_min", 0.0),
    ("rss_longitudinal_distance", "braking_max", -8.0),
]


@every_module
@pytest.mark.parametrize(("name", "argument", "value"), OUT_OF_DOMAIN)
def test_what_is_out_of_its_domain(module: Any, name: str, argument: str, value: float) -> None:
    with pytest.raises(ValueError, match=argument):
        called(module, name, **{argument: value})
    assert np.isnan(called(module, name, **{argument: np.array([value])})).all()


@every_module
def test_arrays_broadcast(module: Any) -> None:
    distance, speed = np.array([[10.0], [20.0]]), np.array([5.0, 2.0, -1.0])
    out = module.ttc_constant_velocity(distance, closing_speed=speed)
    np.testing.assert_array_equal(out, [[2.0, 5.0, np.inf], [4.0, 10.0, np.inf]])
    with pytest.raises(ValueError, match="broadcast"):
        module.ttc_constant_velocity(np.ones(3), closing_speed=np.ones(2))
    mixed = module.ttc_constant_velocity(np.full(3, 0.1), closing_speed=np.ones(3, np.float32))
    assert mixed.dtype == np.float64
    np.testing.assert_array_equal(mixed, 0.1)
    for empty in (np.ones(0), np.ones((0, 4)), np.ones((3, 0))):
        assert module.ttc_constant_velocity(empty, closing_speed=5.0).shape == empty.shape


@every_module
def test_each_element_has_a_status(module: Any) -> None:
    distance = np.array([10.0, 10.0, 0.0, -np.inf, np.inf, np.nan, 10.0])
    speed = np.array([5.0, -1.0, 1.0, -1.0, 1.0, 1.0, np.inf])
    status = np.empty(7, np.uint8)
    ttc = module.ttc_constant_velocity(distance, closing_speed=speed, status_out=status)
    np.testing.assert_array_equal(ttc, [2.0, np.inf, 0.0, np.inf, np.inf, np.inf, np.inf])
    expected = ["CLOSING", "NOT_CLOSING", "CONTACT", "CONTACT", "CLEAR", "INVALID", "INVALID"]
    assert [Status(int(value)).name for value in status] == expected
    with pytest.raises(TypeError, match="status_out"):
        module.ttc_constant_velocity(1.0, closing_speed=1.0, status_out=status)
    with pytest.raises(ValueError, match="status_out"):
        module.ttc_constant_velocity(distance, closing_speed=1.0, status_out=status[:3])


def test_arrays_are_read_in_place_whatever_their_layout() -> None:
    records = np.zeros(50, np.dtype({"names": ["d", "v"], "formats": ["f4", "f4"], "offsets": [1, 7], "itemsize": 13}))
    records["d"], records["v"] = np.linspace(1.0, 40.0, 50), np.linspace(-5.0, 15.0, 50)
    expected = ttc_fast.ttc_constant_velocity(records["d"].copy(), closing_speed=records["v"].copy())
    distance, speed = records["d"], records["v"]
    assert not distance.flags.aligned
    np.testing.assert_array_equal(ttc_fast.ttc_constant_velocity(distance, closing_speed=speed), expected)
    backwards = ttc_fast.ttc_constant_velocity(distance[::-1], closing_speed=speed[::-1])
    np.testing.assert_array_equal(backwards, expected[::-1])
    status = np.empty(8, np.uint8)
    shared = status.view(np.float64)
    with pytest.raises(ValueError, match="status_out"):
        ttc_fast.ttc_constant_velocity(shared, closing_speed=1.0, status_out=status[:1])


@every_module
@given(distance=ordinary, speed=signed, acceleration=st.floats(-50, 50, allow_subnormal=False))  # they have no digits
def test_the_root_solves_the_equation_and_is_the_first(
    module: Any, distance: float, speed: float, acceleration: float
) -> None:
    time = module.ttc_constant_acceleration(distance, closing_speed=speed, closing_acceleration=acceleration)
    assert time > 0
    earlier = np.linspace(0.0, min(time, 1e6), 100)[1:-1]
    gone = speed * earlier + acceleration * earlier**2 / 2
    assert (gone < distance * (1 + 1e-9)).all()
    if time < math.inf:
        terms = abs(speed * time), abs(acceleration * time * time / 2), distance
        assert speed * time + acceleration * time * time / 2 == pytest.approx(distance, abs=1e-9 * max(terms))


@every_module
@given(distance=ordinary, speed=ordinary, acceleration=st.floats(-1e-9, 1e-9))
def test_it_is_continuous_as_the_acceleration_vanishes(
    module: Any, distance: float, speed: float, acceleration: float
) -> None:
    plain = module.ttc_constant_velocity(distance, closing_speed=speed)
    assert plain == distance / speed
    share = abs(acceleration) * distance / speed**2
    assume(share < 0.1)
    bent = module.ttc_constant_acceleration(distance, closing_speed=speed, closing_acceleration=acceleration)
    assert bent == pytest.approx(plain, rel=share + 1e-14)


def simulated_gap(rear: float, front: float, rss: dict[str, float]) -> float:
    """The least gap that keeps two cars apart, stepped through the worst case."""
    t, dt = np.arange(0.0, 40.0, 1e-3), 1e-3
    accelerates = np.where(t < rss["response_time"], rss["acceleration_max"], -rss["braking_min"])
    rear_speed = np.maximum(rear + np.cumsum(accelerates) * dt, 0.0)
    front_speed = np.maximum(front - rss["braking_max"] * t, 0.0)
    return max(0.0, float(np.max(np.cumsum((rear_speed - front_speed) * dt))))


@pytest.mark.parametrize(("rear", "front"), [(20.0, 20.0), (30.0, 5.0), (10.0, 10.0), (15.0, 0.0)])
def test_rss_keeps_cars_apart_in_its_worst_case(rear: float, front: float) -> None:
    """Both stand in the end where this holds: the gap is what one goes farther than the other."""
    rss = {"response_time": 0.7, "acceleration_max": 2.0, "braking_min": 4.0, "braking_max": 8.0}
    gap = ttc_fast.rss_longitudinal_distance(rear, front, **rss)
    assert gap == pytest.approx(simulated_gap(rear, front, rss), abs=0.05)


@every_module
def test_rss_does_not_jump_where_a_car_stands(module: Any) -> None:
    rss = {"response_time": 1.0, "acceleration_max": 2.0, "braking_min": 4.0, "braking_max": 8.0}
    around = [module.rss_longitudinal_distance(10.0, front, **rss) for front in (-0.01, 0.0, 0.01)]
    assert max(around) - min(around) < 1e-4
    assert module.rss_longitudinal_distance(0.0, 30.0, **rss) == 0.0


def test_scalars_of_every_kind_are_numbers() -> None:
    kinds: list[Callable[[int], Any]] = [int, np.int64, np.float32, np.array]
    for kind in kinds:
        out = ttc_fast.ttc_constant_velocity(kind(10), closing_speed=kind(5))
        assert type(out) is float
        assert out == 2.0
