//! `ScanTTC`.

use crate::estimators::{beam_vote, beam_vote_object};
use crate::macros::settings;
use crate::scan_query::{BeamQuery, MotionArguments};
use crate::util::run::level;
use crate::util::{Given, check_no_data, count, threads, value_error};
use numpy::PyArray1;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use std::f64::consts::TAU;
use ttc_fast_core::scan::{LimitsPolicy, ScanTtc, Settings, TooClose};
use ttc_fast_core::vehicle::{Mount, Outline};

/// Instantaneous time-to-collision (iTTC) of the beams of one laser scanner.
///
/// Made once for a scanner, then called for every scan. Immutable, and usable from many threads.
///
/// Each beam's iTTC is its clearance over the speed at which the sensor moves along it. The sensor's velocity is that
/// of the vehicle's origin plus yaw rate times mount position. A static world is assumed: what moves by itself is not
/// seen to close faster.
///
/// Parameters
/// ----------
/// angle_min : float
///     Direction of the first beam in the sensor frame, rad; 0 is the sensor's forward, counter-clockwise is positive.
/// angle_increment : float
///     Angle from one beam to the next, rad; negative for a scanner that turns clockwise.
/// beams : int
///     Number of beams.
/// range_min, range_max : float
///     The *sensor's* range, m. Finite readings outside it are discarded, as sensor_msgs/LaserScan says. Honour
///     ``range_min``: many drivers report errors as tiny ranges.
/// limits : (float, float), optional
///     The *user's* (near, far), m. Valid readings beyond ``far`` are out of the horizon and never the cause; valid
///     readings below ``near`` are kept as they are.
/// limits_policy : {"horizon", "clamp"}
///     "clamp" moves valid readings into ``limits`` instead, literally, which can invent or hide obstacles.
/// mount : (float, float, float)
///     x, y (m) and yaw (rad) of the sensor in the vehicle frame.
/// outline : (float, float, float, float), optional
///     (x_rear, x_front, y_right, y_left) of the vehicle in its own frame, m; rear and right usually negative.
///     Clearance is range less the way to the outline along the beam; without an outline it is the range. Beams of a
///     sensor outside the outline that look at the vehicle are masked. A reading inside the outline is CONTACT.
/// mask : sequence of bool, optional
///     True for each beam that is to be ignored (one's own antenna): one entry for each of the ``beams``.
/// min_closing_speed : float
///     Closing at or below this, m/s, is not closing.
/// too_close : {"hit", "ignore"}
///     Meaning of -inf: a hit at ``range_min``, or nothing.
/// no_data : float, optional
///     The time that ``min`` gives for a scan in which nothing valid was observed. Without it, ``min`` raises
///     ``NoDataError``.
/// minimum : KthSmallest or NeighbourSupport, optional
///     How a speckle is outvoted; by default the nearest beam decides. Where too few beams close for a vote, the plain
///     nearest is given, with status TOO_FEW.
/// threads : int
///     How many threads may share a batch in ``min`` and ``nearest``. One scan is always the work of one thread, and no
///     answer depends on it.
///
/// Raises
/// ------
/// ValueError
///     If a setting makes no sense; the message names it and says what would be right.
/// TypeError
///     If a setting is of the wrong type.
///
/// Notes
/// -----
/// iTTC = r / max(-r_dot, 0), from the F1TENTH course; r_dot by rigid-body kinematics, v + omega x p. iTTC is the time
/// in which the beam would shrink to nothing, not the time to contact: a wall passed at the side counts.
///
/// Arrays are read in place. Another thread that writes to one meanwhile may give a mix of two scans, never a read out
/// of bounds.
///
/// Examples
/// --------
/// A wall 10 m ahead, 181 beams, at 5 m/s:
///
/// >>> import math, numpy as np, ttc_fast
/// >>> scan = ttc_fast.ScanTTC(-math.pi / 2, math.pi / 180, 181, range_min=0.06, range_max=30.0)
/// >>> angles = -math.pi / 2 + math.pi / 180 * np.arange(181)
/// >>> with np.errstate(divide="ignore"):
/// ...     ranges = (10.0 / np.cos(angles)).astype(np.float32)
/// >>> scan.min(ranges, 5.0)
/// 2.0
/// >>> scan.min(ranges, -5.0)
/// inf
/// >>> nearest = scan.nearest(ranges, 5.0)
/// >>> nearest.beam, nearest.status.name, nearest.counts.valid
/// (90, 'CLOSING', 141)
#[pyclass(frozen, module = "ttc_fast")]
pub struct ScanTTC {
    scan: ScanTtc,
    no_data: Option<f64>,
    threads: usize,
}

#[pymethods]
impl ScanTTC {
    #[new]
    #[pyo3(
        signature = (angle_min, angle_increment, beams, *, range_min=0.0, range_max=f64::INFINITY, limits=None,
            limits_policy="horizon", mount=[0.0, 0.0, 0.0], outline=None, mask=None, min_closing_speed=0.01,
            too_close="hit", no_data=None, minimum=None, threads=1),
        text_signature = "(angle_min, angle_increment, beams, *, range_min=0.0, range_max=1e999, limits=None, \
            limits_policy='horizon', mount=(0.0, 0.0, 0.0), outline=None, mask=None, min_closing_speed=0.01, \
            too_close='hit', no_data=None, minimum=None, threads=1)"
    )]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        angle_min: f64,
        angle_increment: f64,
        beams: i64,
        range_min: f64,
        range_max: f64,
        limits: Option<[f64; 2]>,
        limits_policy: &str,
        mount: [f64; 3],
        outline: Option<[f64; 4]>,
        mask: Option<&Bound<'_, PyAny>>,
        min_closing_speed: f64,
        too_close: &str,
        no_data: Option<f64>,
        minimum: Option<&Bound<'_, PyAny>>,
        threads: i64,
    ) -> PyResult<Self> {
        check_no_data(no_data)?;
        let settings = Settings {
            angle_min,
            angle_increment,
            beams: count("beams", beams, 1)?,
            range_min,
            range_max,
            limits: limits.map(|[near, far]| (near, far)),
            limits_policy: one_of("limits_policy", limits_policy, POLICIES)?,
            mount: {
                let [x, y, yaw] = mount;
                Mount { x, y, yaw }
            },
            outline: outline.map(|[x_rear, x_front, y_right, y_left]| Outline { x_rear, x_front, y_right, y_left }),
            mask: mask.map(bools).transpose()?,
            min_closing_speed,
            too_close: one_of("too_close", too_close, TOO_CLOSE)?,
            beam_vote: minimum.map(beam_vote).transpose()?,
        };
        let scan = ScanTtc::new(settings, level()).map_err(value_error)?;
        Ok(ScanTTC { scan, no_data, threads: self::threads(threads)? })
    }

    /// Make one from the first message of a scanner.
    ///
    /// Parameters
    /// ----------
    /// msg : sensor_msgs/LaserScan, of ROS 1, ROS 2 or anything with the same fields
    ///     ``angle_min``, ``angle_increment``, ``range_min``, ``range_max`` and the length of ``ranges`` are taken from
    ///     it. ``angle_max``, if it is neither missing nor 0, has to fit them to within one beam and full turns.
    /// **settings
    ///     The other settings of ``ScanTTC``; one that the message has too overrides the message.
    ///
    /// Returns
    /// -------
    /// ScanTTC
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If the message lacks a field.
    /// ValueError
    ///     If ``angle_max`` contradicts the number of readings, and as in ``ScanTTC``.
    ///
    /// Examples
    /// --------
    /// >>> import types, numpy as np, ttc_fast
    /// >>> msg = types.SimpleNamespace(angle_min=-1.0, angle_increment=0.5, range_min=0.1, range_max=30.0,
    /// ...                             ranges=np.full(5, 4.0, np.float32))
    /// >>> ttc_fast.ScanTTC.from_message(msg, outline=(-0.1, 0.4, -0.15, 0.15)).min(msg.ranges, 2.0)
    /// 1.8
    #[classmethod]
    #[pyo3(signature = (msg, **settings), text_signature = "(msg, **settings)")]
    fn from_message<'py>(
        cls: &Bound<'py, PyType>,
        msg: &Bound<'py, PyAny>,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = cls.py();
        let field = |name: &str| {
            msg.getattr(name).map_err(|_| {
                PyTypeError::new_err(format!("msg must be a sensor_msgs/LaserScan; it has no field {name}"))
            })
        };
        let arguments = PyDict::new(py);
        for name in ["angle_min", "angle_increment", "range_min", "range_max"] {
            arguments.set_item(name, field(name)?)?;
        }
        let beams = field("ranges")?.len();
        let beams = beams.map_err(|_| PyTypeError::new_err("msg must have ranges with a length, one for each beam"))?;
        arguments.set_item("beams", beams)?;
        let own = |name: &str| settings.is_none_or(|settings| !settings.contains(name).unwrap_or(false));
        if ["angle_min", "angle_increment", "beams"].into_iter().all(own) && msg.hasattr("angle_max")? {
            let number = |name: &str| crate::util::number(name, &field(name)?);
            check_last_beam(number("angle_min")?, number("angle_increment")?, beams, number("angle_max")?)?;
        }
        if let Some(settings) = settings {
            arguments.update(settings.as_mapping())?;
        }
        cls.call((), Some(&arguments))
    }

    /// Return the least time-to-collision of a scan, s.
    ///
    /// Parameters
    /// ----------
    /// ranges : ndarray, float32 or float64, shape (beams,) or (B, beams)
    ///     m; read in place, whatever the stride and alignment. NaN is invalid, +inf free space, -inf too close.
    /// speed : float, or (B,) for a batch
    ///     Forward speed of the vehicle's origin, m/s; negative when reversing. Odometry without a sign would take
    ///     reversing for driving forward.
    /// yaw_rate : float, or (B,) for a batch
    ///     Yaw rate, counter-clockwise, rad/s.
    /// lateral_speed : float, or (B,) for a batch
    ///     Speed of the vehicle's origin to the left, m/s.
    ///
    /// Returns
    /// -------
    /// float, or float64 ndarray of shape (B,)
    ///     A time in [0, inf]; infinite when nothing closes. With ``minimum=``, the result of the vote, or the plain
    ///     least where too few beams close for a vote.
    ///
    /// Raises
    /// ------
    /// NoDataError
    ///     If nothing valid was observed in a scan, unless ``no_data=`` says what that means.
    /// TypeError
    ///     If ``ranges`` has another dtype, or a motion is not a number.
    /// ValueError
    ///     If ``ranges`` has another shape, or a motion is not finite.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3)
    /// >>> scan.min(np.array([9.0, 10.0, 9.0]), 5.0)
    /// 2.0
    /// >>> scan.min(np.array([[9.0, 10.0, 9.0], [9.0, np.inf, np.nan]]), np.array([5.0, -5.0]))
    /// array([ 2., inf])
    #[pyo3(signature = (ranges, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0)")]
    fn min<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.query().min(py, ranges, MotionArguments::of(speed, &yaw_rate, &lateral_speed))
    }

    /// Return the nearest beam in time, and everything that says why.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     These are as in ``min``.
    ///
    /// Returns
    /// -------
    /// Nearest, or NearestBatch for a batch
    ///     ``ttc``, ``status``, ``beam``, ``angle``, ``range``, ``clearance``, ``closing_speed`` and ``counts``. A scan
    ///     in which nothing valid was observed has status NO_DATA (and ttc inf); nothing is raised for it.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``min``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3)
    /// >>> scan.nearest(np.array([9.0, 10.0, np.nan]), 5.0).beam
    /// 1
    /// >>> scan.nearest(np.full(3, np.nan), 5.0).status.name
    /// 'NO_DATA'
    #[pyo3(signature = (ranges, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0)")]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.query().nearest(py, ranges, MotionArguments::of(speed, &yaw_rate, &lateral_speed))
    }

    /// Return the time-to-collision of each beam, s.
    ///
    /// Computed in the dtype of ``ranges``, to a few units in its last place, so that the least may differ from ``min``
    /// in the last digits.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     These are as in ``min``.
    /// out : ndarray of the dtype and shape of ``ranges``, optional
    ///     Where to write the result. May be ``ranges`` itself.
    /// status_out : uint8 ndarray of the shape of ``ranges``, optional
    ///     Where to write the ``Status`` of each beam: CLEAR for free space and beyond the limits, NOT_CLOSING,
    ///     CLOSING, CONTACT, NO_DATA where masked, INVALID where the reading says nothing.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Times in [0, inf], of the dtype and shape of ``ranges``; ``out`` if given. Infinite where a beam is invalid.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``min``; also for an ``out`` or ``status_out`` of another dtype or shape, read-only or overlapping.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(0.0, np.pi / 3, 3, range_min=0.1)
    /// >>> status = np.empty(3, np.uint8)
    /// >>> scan.per_beam(np.array([10.0, 10.0, 0.01]), 5.0, status_out=status).round(3)
    /// array([ 2.,  4., inf])
    /// >>> status.tolist() == [ttc_fast.Status.CLOSING, ttc_fast.Status.CLOSING, ttc_fast.Status.INVALID]
    /// True
    #[pyo3(signature = (ranges, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, out=None, status_out=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0, *, out=None, status_out=None)")]
    #[allow(clippy::too_many_arguments, reason = "arguments of a Python method")]
    fn per_beam<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        out: Option<&Bound<'py, PyAny>>,
        status_out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.query().per_beam(py, ranges, MotionArguments::of(speed, &yaw_rate, &lateral_speed), out, status_out)
    }

    /// The direction of each beam in the sensor frame, rad, float64 of shape (beams,).
    #[getter]
    fn angles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.scan.settings().angles())
    }
}

settings! {
    value ScanTTC |it, py| {
        angle_min: it.scan.settings().angle_min,
        angle_increment: it.scan.settings().angle_increment,
        beams: it.scan.settings().beams,
        range_min: it.scan.settings().range_min,
        range_max: it.scan.settings().range_max,
        limits: it.scan.settings().limits,
        limits_policy: name_of(it.scan.settings().limits_policy, POLICIES),
        mount: {
            let Mount { x, y, yaw } = it.scan.settings().mount;
            (x, y, yaw)
        },
        outline: it.scan.settings().outline.map(|o| (o.x_rear, o.x_front, o.y_right, o.y_left)),
        mask: it.scan.settings().mask.as_ref().map(|mask| PyTuple::new(py, mask)).transpose()?,
        min_closing_speed: it.scan.settings().min_closing_speed,
        too_close: name_of(it.scan.settings().too_close, TOO_CLOSE),
        no_data: it.no_data,
        minimum: it.scan.settings().beam_vote.map(|vote| beam_vote_object(py, vote)).transpose()?,
        threads: it.threads,
    }
}

impl ScanTTC {
    /// The scanner of the core.
    pub fn core(&self) -> &ScanTtc {
        &self.scan
    }

    /// A question about its scans, which `criterion` answers.
    pub fn query_of<'a, C>(&self, criterion: &'a C) -> BeamQuery<'a, C> {
        BeamQuery { criterion, no_data: self.no_data, threads: self.threads }
    }

    fn query(&self) -> BeamQuery<'_, ScanTtc> {
        self.query_of(&self.scan)
    }
}

const POLICIES: [(&str, LimitsPolicy); 2] = [("horizon", LimitsPolicy::Horizon), ("clamp", LimitsPolicy::Clamp)];
const TOO_CLOSE: [(&str, TooClose); 2] = [("hit", TooClose::Hit), ("ignore", TooClose::Ignore)];

/// The choice called `name`.
fn one_of<T: Copy>(argument: &str, name: &str, choices: [(&str, T); 2]) -> PyResult<T> {
    let [(first, _), (second, _)] = choices;
    choices
        .into_iter()
        .find(|(choice, _)| *choice == name)
        .map(|(_, value)| value)
        .ok_or_else(|| PyValueError::new_err(format!("{argument} must be {first:?} or {second:?}, got {name:?}")))
}

fn name_of<T: Copy + PartialEq>(value: T, choices: [(&'static str, T); 2]) -> &'static str {
    let [(first, one), (second, _)] = choices;
    if value == one { first } else { second }
}

/// A mask, from a bool array or any sequence of bools.
fn bools(mask: &Bound<'_, PyAny>) -> PyResult<Vec<bool>> {
    mask.try_iter()
        .and_then(|values| values.map(|value| value?.extract::<bool>()).collect())
        .map_err(|_| PyTypeError::new_err("mask must be a sequence of bools, True where a beam is to be ignored"))
}

/// Refuse a message whose last reading is elsewhere than at its `angle_max`; one beam may be counted too many. Which way
/// round `angle_max` was counted does not matter, unless the readings go round more than once.
fn check_last_beam(angle_min: f64, angle_increment: f64, beams: usize, angle_max: f64) -> PyResult<()> {
    let last = angle_min + angle_increment * (beams.max(1) - 1) as f64;
    let tolerated = 2.0 * angle_increment.abs();
    let is_one_turn = (last - angle_min).abs() < TAU + tolerated;
    let turns = if is_one_turn { ((last - angle_max) / TAU).round() } else { 0.0 };
    let apart = (last - angle_max - turns * TAU).abs();
    if angle_max == 0.0 || !apart.is_finite() || apart < tolerated {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "msg contradicts itself: its {beams} readings end at {last:?} rad, and angle_max is {angle_max:?} rad; \
         pass angle_min= or angle_increment= to say where its beams point"
    )))
}
