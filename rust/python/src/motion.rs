//! The formulae of motion, over numbers and arrays.

use crate::elementwise::{Argument, Domain, apply, apply_with_status};
use pyo3::prelude::*;
use ttc_fast_core::motion::{self, Rss};

/// Seconds until a distance is used up at constant closing speed: ``distance / closing_speed``.
///
/// Parameters
/// ----------
/// distance : float, or ndarray of float32 or float64 with 1 or 2 dimensions
///     Distance to contact, m. 0 or below is contact: the result is 0 while closing and inf while not. +inf is free
///     space.
/// closing_speed : float, or ndarray of the same dtype
///     Speed at which the distance shrinks, m/s, positive when approaching. At 0 or below the result is inf.
/// status_out : uint8 ndarray of the shape of the result, optional
///     Where to write the ``Status`` of each element: INVALID, CONTACT, CLEAR, CLOSING or NOT_CLOSING.
///
/// Returns
/// -------
/// float or ndarray
///     Seconds, in [0, inf]: a float for numbers; for arrays, which are read in place and broadcast against each other,
///     an array of their dtype. An element of which something is NaN, or the speed infinite, is inf and has the status
///     INVALID.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype than float32 or float64, or two have different ones.
/// ValueError
///     If a number is NaN, or a speed not finite, or shapes do not broadcast.
///
/// Notes
/// -----
/// J. C. Hayward, Near-miss determination through use of a scale of danger (1972).
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> ttc_fast.ttc_constant_velocity(10.0, closing_speed=5.0)
/// 2.0
/// >>> ttc_fast.ttc_constant_velocity(np.array([10.0, 20.0]), closing_speed=np.array([5.0, -1.0]))
/// array([ 2., inf])
#[pyfunction]
#[pyo3(signature = (distance, *, closing_speed, status_out=None))]
pub fn ttc_constant_velocity<'py>(
    distance: &Bound<'py, PyAny>,
    closing_speed: &Bound<'py, PyAny>,
    status_out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let arguments =
        [Argument("distance", Domain::NotNan, distance), Argument("closing_speed", Domain::Finite, closing_speed)];
    let formula = |[distance, speed]: [f64; 2]| motion::ttc_constant_velocity(distance, speed);
    let status = |[distance, speed]: [f64; 2]| motion::status(distance, speed, 0.0);
    apply_with_status(arguments, formula, status_out, status)
}

/// Seconds until a distance is used up at constant closing acceleration.
///
/// The first positive root of ``distance = closing_speed t + closing_acceleration t^2 / 2``.
///
/// Parameters
/// ----------
/// distance : float, or ndarray of float32 or float64 with 1 or 2 dimensions
///     Distance to contact, m. 0 or below is contact: the result is 0 while closing and inf while not. +inf is free
///     space.
/// closing_speed : float, or ndarray of the same dtype
///     Speed at which the distance shrinks, m/s, positive when approaching.
/// closing_acceleration : float, or ndarray of the same dtype
///     Derivative of ``closing_speed``, m/s^2: positive when the closing becomes faster, negative when a car brakes.
/// status_out : uint8 ndarray of the shape of the result, optional
///     Where to write the ``Status`` of each element: INVALID, CONTACT, CLEAR, CLOSING or NOT_CLOSING.
///
/// Returns
/// -------
/// float or ndarray
///     Seconds, in [0, inf]; inf where the gap never closes. A float for numbers; for arrays, which are read in place
///     and broadcast against each other, an array of their dtype. An element of which something is NaN, or speed or
///     acceleration infinite, is inf and has the status INVALID.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype than float32 or float64, or two have different ones.
/// ValueError
///     If a number is NaN, or speed or acceleration not finite, or shapes do not broadcast.
///
/// Notes
/// -----
/// The modified time-to-collision of K. Ozbay et al., Derivation and validation of new simulation-based surrogate
/// safety measure, Transportation Research Record 2083 (2008), by the form of its root that does not cancel: it becomes
/// ``distance / closing_speed`` as the acceleration becomes 0.
///
/// Examples
/// --------
/// 10 m apart, closing at 10 m/s, and a car brakes with 2 m/s^2: the later root, 8.873 s, would be wrong.
///
/// >>> import ttc_fast
/// >>> round(ttc_fast.ttc_constant_acceleration(10.0, closing_speed=10.0, closing_acceleration=-2.0), 3)
/// 1.127
/// >>> ttc_fast.ttc_constant_acceleration(10.0, closing_speed=10.0, closing_acceleration=-6.0)
/// inf
#[pyfunction]
#[pyo3(signature = (distance, *, closing_speed, closing_acceleration, status_out=None))]
pub fn ttc_constant_acceleration<'py>(
    distance: &Bound<'py, PyAny>,
    closing_speed: &Bound<'py, PyAny>,
    closing_acceleration: &Bound<'py, PyAny>,
    status_out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let arguments = [
        Argument("distance", Domain::NotNan, distance),
        Argument("closing_speed", Domain::Finite, closing_speed),
        Argument("closing_acceleration", Domain::Finite, closing_acceleration),
    ];
    let formula =
        |[distance, speed, acceleration]: [f64; 3]| motion::ttc_constant_acceleration(distance, speed, acceleration);
    let status = |[distance, speed, acceleration]: [f64; 3]| motion::status(distance, speed, acceleration);
    apply_with_status(arguments, formula, status_out, status)
}

/// Seconds until a follower is where the one ahead is now: ``distance / speed``.
///
/// Parameters
/// ----------
/// distance : float, or ndarray of float32 or float64 with 1 or 2 dimensions
///     Gap to the car ahead, m; 0 or below is contact, +inf says that there is none.
/// speed : float, or ndarray of the same dtype
///     The follower's own speed, m/s, positive towards the one ahead.
///
/// Returns
/// -------
/// float or ndarray
///     Seconds, in [0, inf]: inf when the follower does not drive towards the one ahead, 0 in contact while it does. A
///     float for numbers; for arrays, which are read in place and broadcast against each other, an array of their
///     dtype, NaN where something is NaN.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype than float32 or float64, or two have different ones.
/// ValueError
///     If a number is NaN, or the speed not finite, or shapes do not broadcast.
///
/// Notes
/// -----
/// K. Vogel, A comparison of headway and time to collision as safety indicators, Accident Analysis and Prevention 35
/// (2003); here the gap counts, from bumper to bumper.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.time_headway(30.0, speed=20.0)
/// 1.5
#[pyfunction]
#[pyo3(signature = (distance, *, speed))]
pub fn time_headway<'py>(distance: &Bound<'py, PyAny>, speed: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let arguments = [Argument("distance", Domain::NotNan, distance), Argument("speed", Domain::Finite, speed)];
    apply(arguments, |[distance, speed]| motion::time_headway(distance, speed))
}

/// The constant deceleration that just avoids a crash (DRAC): ``closing_speed^2 / (2 distance)``.
///
/// Parameters
/// ----------
/// distance : float, or ndarray of float32 or float64 with 1 or 2 dimensions
///     Distance to contact, m; 0 or below is contact, +inf says that nothing is ahead.
/// closing_speed : float, or ndarray of the same dtype
///     Speed at which the distance shrinks, m/s, positive when approaching.
///
/// Returns
/// -------
/// float or ndarray
///     m/s^2, in [0, inf]: 0 when not closing, inf in contact while closing. A float for numbers; for arrays, which are
///     read in place and broadcast against each other, an array of their dtype, NaN where something is NaN.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype than float32 or float64, or two have different ones.
/// ValueError
///     If a number is NaN, or the speed not finite, or shapes do not broadcast.
///
/// Notes
/// -----
/// D. F. Cooper, N. Ferguson, Traffic studies at T-junctions, Traffic Engineering and Control 17 (1976), for one who
/// begins to brake at once, behind a car of constant speed.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.deceleration_to_avoid_crash(10.0, closing_speed=10.0)
/// 5.0
#[pyfunction]
#[pyo3(signature = (distance, *, closing_speed))]
pub fn deceleration_to_avoid_crash<'py>(
    distance: &Bound<'py, PyAny>,
    closing_speed: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let arguments =
        [Argument("distance", Domain::NotNan, distance), Argument("closing_speed", Domain::Finite, closing_speed)];
    apply(arguments, |[distance, speed]| motion::deceleration_to_avoid_crash(distance, speed))
}

/// How far a vehicle goes until it stands: ``speed reaction_time + speed^2 / (2 deceleration)``.
///
/// Parameters
/// ----------
/// speed : float, or ndarray of float32 or float64 with 1 or 2 dimensions
///     m/s; forward or reverse, only its magnitude counts.
/// deceleration : float, or ndarray of the same dtype
///     Deceleration of the brakes, m/s^2, above 0.
/// reaction_time : float, or ndarray of the same dtype
///     Time until they do, s, at least 0.
///
/// Returns
/// -------
/// float or ndarray
///     m. A float for numbers; for arrays, which are read in place and broadcast against each other, an array of their
///     dtype, NaN where something is NaN or out of its domain.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype than float32 or float64, or two have different ones.
/// ValueError
///     If a number is not finite, ``deceleration`` not above 0 or ``reaction_time`` below 0, or shapes do not
///     broadcast.
///
/// Notes
/// -----
/// AASHTO, A Policy on Geometric Design of Highways and Streets, section on stopping sight distance, for a level road.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.stopping_distance(10.0, deceleration=5.0, reaction_time=0.5)
/// 15.0
#[pyfunction]
#[pyo3(signature = (speed, *, deceleration, reaction_time))]
pub fn stopping_distance<'py>(
    speed: &Bound<'py, PyAny>,
    deceleration: &Bound<'py, PyAny>,
    reaction_time: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let arguments = [
        Argument("speed", Domain::Finite, speed),
        Argument("deceleration", Domain::AboveZero, deceleration),
        Argument("reaction_time", Domain::AtLeastZero, reaction_time),
    ];
    let formula = |[speed, deceleration, time]: [f64; 3]| motion::stopping_distance(speed, deceleration, time);
    apply(arguments, formula)
}

/// The safe longitudinal distance of responsibility-sensitive safety (RSS), for two cars that drive in one direction.
///
/// With at least this gap, the rear car can stop in time whatever the front one does within ``braking_max``: even if it
/// itself accelerates until it responds, and then only brakes with ``braking_min``.
///
/// Parameters
/// ----------
/// rear_speed, front_speed : float, or ndarray of float32 or float64 with 1 or 2 dimensions
///     m/s, positive in the direction in which both drive.
/// response_time : float, or ndarray of the same dtype
///     The rear car's, s, at least 0.
/// acceleration_max : float, or ndarray of the same dtype
///     The most that the rear car accelerates until it responds, m/s^2, at least 0.
/// braking_min : float, or ndarray of the same dtype
///     The least that the rear car brakes with after that, m/s^2, above 0.
/// braking_max : float, or ndarray of the same dtype
///     The most that the front car brakes with, m/s^2, above 0.
///
/// Returns
/// -------
/// float or ndarray
///     m, at least 0. A float for numbers; for arrays, which are read in place and broadcast against each other, an
///     array of their dtype, NaN where something is NaN or out of its domain.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype than float32 or float64, or two have different ones.
/// ValueError
///     If a number is not finite or out of its domain, or shapes do not broadcast.
///
/// Notes
/// -----
/// ``max(0, v_r t + a t^2 / 2 + (v_r + a t)^2 / (2 b_min) - v_f^2 / (2 b_max))``: S. Shalev-Shwartz, S. Shammah, A.
/// Shashua, On a formal model of safe and scalable self-driving cars, arXiv 1708.06374 (2017), lemma 2. The paper has
/// speeds of at least 0; here ``v |v|`` stands for each ``v^2``, so that noise about the 0 of a standing car makes no
/// jump. Oncoming traffic has another formula, lemma 3, which this is not.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> braking = {"acceleration_max": 2.0, "braking_min": 4.0, "braking_max": 8.0}
/// >>> ttc_fast.rss_longitudinal_distance(20.0, 20.0, response_time=1.0, **braking)
/// 56.5
#[pyfunction]
#[pyo3(signature = (rear_speed, front_speed, *, response_time, acceleration_max, braking_min, braking_max))]
pub fn rss_longitudinal_distance<'py>(
    rear_speed: &Bound<'py, PyAny>,
    front_speed: &Bound<'py, PyAny>,
    response_time: &Bound<'py, PyAny>,
    acceleration_max: &Bound<'py, PyAny>,
    braking_min: &Bound<'py, PyAny>,
    braking_max: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let arguments = [
        Argument("rear_speed", Domain::Finite, rear_speed),
        Argument("front_speed", Domain::Finite, front_speed),
        Argument("response_time", Domain::AtLeastZero, response_time),
        Argument("acceleration_max", Domain::AtLeastZero, acceleration_max),
        Argument("braking_min", Domain::AboveZero, braking_min),
        Argument("braking_max", Domain::AboveZero, braking_max),
    ];
    let formula = |[rear, front, response_time, acceleration_max, braking_min, braking_max]: [f64; 6]| {
        motion::rss_longitudinal_distance(
            rear,
            front,
            Rss { response_time, acceleration_max, braking_min, braking_max },
        )
    };
    apply(arguments, formula)
}
