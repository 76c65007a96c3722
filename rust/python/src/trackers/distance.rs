//! `DistanceTracker`.

use super::{TrackedTTC, method, method_object, noise, noise_object};
use crate::macros::settings;
use crate::util::state::{Format, item, lock};
use crate::util::{count, number, value_error};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Mutex;
use ttc_fast_core::tracker::{self, Settings};

/// Closing speed and time-to-collision from the distance of the nearest target, frame by frame, with their uncertainty.
///
/// Parameters
/// ----------
/// method : method object, optional
///     How distances become a closing speed; by default ``MotionMixture()``. Others are ``KalmanCA``, ``KalmanCV``,
///     ``SlidingLine``, ``SlidingParabola``, ``TheilSen`` and ``AlphaBeta``.
/// noise : float or EstimatedNoise, optional
///     Standard deviation of one distance, m; by default it is learnt, ``EstimatedNoise()``.
/// gate : float
///     A distance that is this many standard deviations away from where the target is expected belongs to another
///     target.
/// jump : float
///     Such a distance that is nearer by more than this, m, is a new target and leads at once. Others wait for
///     confirmation.
/// confirm : int
///     This many frames in a row, from 2, that fit each other and not the target make a new one.
/// max_gap : float
///     Time without the target after which the past says nothing any more, s.
/// max_speed : float
///     Two first distances that would need a faster motion than this, m/s, are not of one target.
/// min_closing_speed : float
///     Closing at or below this, m/s, is not closing.
///
/// Raises
/// ------
/// TypeError
///     If ``method`` or ``noise`` is of another kind.
/// ValueError
///     If a number is out of its domain.
///
/// Notes
/// -----
/// A gap counts as closing when the closing speed is above ``min_closing_speed`` and a line with a memory of 0.4 s is
/// not level by 6 standard deviations, more while it has few frames: a standing car is in front for hours, and noise
/// must not make a TTC of it. Intervals are widened by (1 + r) / (1 - r), with r the correlation of an innovation with
/// the one before it, because innovations that are alike show that the model lags behind or that the noise is not white.
/// The interval of the TTC is Fieller's (1954) of the ratio of distance and closing speed. docs/tracking.md has the
/// reasons, and how often the truth lies inside.
///
/// Any thread may call any method, and a call waits for the one before. A tracker can be pickled, with what it
/// remembers.
///
/// Examples
/// --------
/// A car ahead, measured every tenth of a second with 2 cm of noise:
///
/// >>> import numpy as np, ttc_fast
/// >>> noise = np.random.default_rng(1).normal(0.0, 0.02, 20)
/// >>> tracker = ttc_fast.DistanceTracker()
/// >>> for frame in range(20):
/// ...     result = tracker.update(30.0 - 0.8 * frame + noise[frame], stamp=1.7e9 + 0.1 * frame)
/// >>> result.status.name, round(result.ttc, 1)
/// ('CLOSING', 1.8)
/// >>> low, high = result.ttc_interval
/// >>> low < 14.8 / 8.0 < high
/// True
/// >>> tracker.update(None, stamp=1.7e9 + 2.0).status.name    # not seen in this frame
/// 'LOST'
#[pyclass(frozen, module = "ttc_fast")]
pub struct DistanceTracker {
    tracker: Mutex<tracker::DistanceTracker>,
    settings: Settings,
}

#[pymethods]
impl DistanceTracker {
    #[new]
    #[pyo3(signature = (method=None, *, noise=None, gate=4.0, jump=1.0, confirm=3, max_gap=1.0, max_speed=100.0,
                        min_closing_speed=0.05))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        method: Option<&Bound<'_, PyAny>>,
        noise: Option<&Bound<'_, PyAny>>,
        gate: f64,
        jump: f64,
        confirm: i64,
        max_gap: f64,
        max_speed: f64,
        min_closing_speed: f64,
    ) -> PyResult<Self> {
        let default = Settings::default();
        let settings = Settings {
            method: method.map_or(Ok(default.method), self::method)?,
            noise: noise.map_or(Ok(default.noise), self::noise)?,
            innovation_gate: gate,
            jump,
            confirm: count("confirm", confirm, 2)?,
            max_gap,
            max_speed,
            min_closing_speed,
        };
        let tracker = Mutex::new(tracker::DistanceTracker::new(settings).map_err(value_error)?);
        Ok(DistanceTracker { tracker, settings })
    }

    /// Take one more frame, and return the answer.
    ///
    /// Parameters
    /// ----------
    /// distance : float or None
    ///     Distance to contact, m; 0 or below is contact. None, NaN and inf say that the target is not in this frame.
    /// stamp : float
    ///     When it was measured, s, by any clock. A stamp that is not after the one before gives INVALID and changes
    ///     nothing.
    /// noise : float, optional
    ///     Standard deviation of this one distance, m, in the place of the tracker's.
    ///
    /// Returns
    /// -------
    /// TrackedTTC
    ///     ``ttc``, ``distance``, ``closing_speed``, intervals and ``status``: CLOSING. NOT_CLOSING: the gap does not
    ///     shrink, or not by more than noise may. CONTACT: the distance is 0 or below, from a target's first frame on.
    ///     WARMING_UP: a target of so few frames that nothing can be said but where it is. LOST: the target is not in
    ///     this frame; for ``max_gap`` it is taken to go on as it did. STALE: the frame before was longer ago than
    ///     ``max_gap``, and this one is the first of a new target. INVALID: the frame cannot be used, because its stamp
    ///     is not finite or not after the one before, or the distance is -inf; nothing is remembered of it, and what
    ///     stands beside is the last answer. NO_DATA: there is no target, and nothing was measured. CLEAR: there is no
    ///     target, and inf says that there is nothing to hit.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If an argument is not a number.
    /// ValueError
    ///     If ``noise`` is not above 0 and finite.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(noise=0.02)
    /// >>> for frame in range(5):
    /// ...     result = tracker.update(10.0 - 0.5 * frame, stamp=0.1 * frame)
    /// >>> round(result.ttc, 6), result.status.name
    /// (1.6, 'CLOSING')
    /// >>> tracker.update(8.0, stamp=0.4).status.name
    /// 'INVALID'
    #[pyo3(signature = (distance, stamp, noise=None))]
    fn update(
        &self,
        py: Python<'_>,
        distance: &Bound<'_, PyAny>,
        stamp: &Bound<'_, PyAny>,
        noise: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<TrackedTTC> {
        let distance = if distance.is_none() { f64::NAN } else { number("distance", distance)? };
        let stamp = number("stamp", stamp)?;
        let noise = noise.map(|noise| number("noise", noise)).transpose()?;
        lock(py, &self.tracker).update(distance, stamp, noise).map(TrackedTTC).map_err(value_error)
    }

    /// Forget everything, as a new tracker with the same settings.
    ///
    /// Returns
    /// -------
    /// None
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker()
    /// >>> for frame in range(5):
    /// ...     result = tracker.update(10.0 - 0.5 * frame, stamp=0.1 * frame)
    /// >>> tracker.reset()
    /// >>> tracker.update(8.0, stamp=0.0).status.name
    /// 'WARMING_UP'
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        *lock(py, &self.tracker) = tracker::DistanceTracker::new(self.settings).map_err(value_error)?;
        Ok(())
    }

    /// Return what the tracker remembers, as numbers, strings and lists that JSON can hold.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``class``, ``version``, ``method`` and ``numbers``, for ``restore``. NaN and inf may be among the numbers,
    ///     which Python's ``json`` writes and reads.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> print(*ttc_fast.DistanceTracker().state())
    /// class version method numbers
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let state = FORMAT.state(py)?;
        state.set_item("method", self.method_name(py)?)?;
        state.set_item("numbers", lock(py, &self.tracker).numbers())?;
        Ok(state)
    }

    /// Remember what another tracker with the same settings remembered, and go on from there, bit for bit.
    ///
    /// Parameters
    /// ----------
    /// state : dict
    ///     A state that ``state()`` gave.
    ///
    /// Returns
    /// -------
    /// None
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If it is no such state, or one of another class, version or method. The tracker then remembers what it did.
    ///
    /// Examples
    /// --------
    /// >>> import json, ttc_fast
    /// >>> tracker, other = ttc_fast.DistanceTracker(), ttc_fast.DistanceTracker()
    /// >>> for frame in range(5):
    /// ...     result = tracker.update(10.0 - 0.5 * frame, stamp=0.1 * frame)
    /// >>> other.restore(json.loads(json.dumps(tracker.state())))
    /// >>> other.update(7.5, stamp=0.5).ttc == tracker.update(7.5, stamp=0.5).ttc
    /// True
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = FORMAT.check(state)?;
        let (own, method) = (self.method_name(py)?, item(state, "method")?);
        if !method.eq(&own)? {
            return Err(PyValueError::new_err(format!(
                "state must be of a tracker with the method {own}, got {method}"
            )));
        }
        let numbers: Vec<f64> = item(state, "numbers")?.extract()?;
        let restored = tracker::DistanceTracker::from_numbers(self.settings, &numbers).map_err(value_error)?;
        *lock(py, &self.tracker) = restored;
        Ok(())
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.state(py)
    }

    fn __setstate__(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        self.restore(py, state)
    }
}

settings! {
    DistanceTracker |it, py| {
        method: method_object(py, it.settings.method)?,
        noise: noise_object(py, it.settings.noise)?,
        gate: it.settings.innovation_gate,
        jump: it.settings.jump,
        confirm: it.settings.confirm,
        max_gap: it.settings.max_gap,
        max_speed: it.settings.max_speed,
        min_closing_speed: it.settings.min_closing_speed,
    }
}

const FORMAT: Format = Format { class: "DistanceTracker", version: 2 };

impl DistanceTracker {
    /// The class of the method, which decides what the numbers of a state are.
    fn method_name<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        method_object(py, self.settings.method)?.get_type().getattr("__name__")
    }
}
