//! `DistanceTracker`.

use super::method::{EstimatedNoise, KalmanCA, method, noise};
use crate::errors::value_error;
use crate::number::number;
use crate::tracked::TrackedTTC;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::sync::{Mutex, MutexGuard, PoisonError};
use ttc_fast_core::tracker::{self, Settings};

/// Closing speed and time-to-collision from the distance of the nearest target, frame by frame, with their uncertainty.
///
/// Parameters
/// ----------
/// method : method object, optional
///     How distances become a closing speed; by default ``KalmanCA()``. Others are ``KalmanCV``, ``SlidingLine``,
///     ``SlidingParabola``, ``TheilSen`` and ``AlphaBeta``.
/// noise : float or EstimatedNoise, optional
///     Standard deviation of one distance, m; by default it is learnt, ``EstimatedNoise()``.
/// gate : float
///     A distance more than so many standard deviations from where the target is expected does not belong to it.
/// jump : float
///     Such a distance that is nearer by more than this, m, is a new target and leads at once. Others wait for
///     confirmation.
/// confirm : int
///     So many frames in a row, from 2, that fit each other and not the target make a new one.
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
/// A gap counts as closing when the closing speed is above ``min_closing_speed`` and a line with a memory of 0.4 s is not
/// level by 6 standard deviations, more while it has few frames: a standing car is in front for hours, and noise must not
/// make a TTC of it. Intervals are widened by (1 + r) / (1 - r), with r how much a surprise resembles the one of the frame
/// before, because surprises that are alike say that the model lags behind or the noise wanders. The interval of the TTC is
/// Fieller's (1954) of the ratio of distance and closing speed. docs/tracking.md has the reasons, and how often the truth
/// lies inside.
///
/// Any thread may call any method.
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
    inner: Mutex<tracker::DistanceTracker>,
    method: Py<PyAny>,
    noise: Py<PyAny>,
}

#[pymethods]
impl DistanceTracker {
    #[new]
    #[pyo3(signature = (method=None, *, noise=None, gate=4.0, jump=1.0, confirm=3, max_gap=1.0, max_speed=100.0, min_closing_speed=0.05))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        method: Option<Bound<'_, PyAny>>,
        noise: Option<Bound<'_, PyAny>>,
        gate: f64,
        jump: f64,
        confirm: i64,
        max_gap: f64,
        max_speed: f64,
        min_closing_speed: f64,
    ) -> PyResult<Self> {
        let method = method.map_or_else(|| py.get_type::<KalmanCA>().call0(), Ok)?;
        let noise = noise.map_or_else(|| py.get_type::<EstimatedNoise>().call0(), Ok)?;
        let settings = Settings {
            method: self::method(&method)?,
            noise: self::noise(&noise)?,
            innovation_gate: gate,
            jump,
            confirm: u32::try_from(confirm.max(0)).unwrap_or(u32::MAX),
            max_gap,
            max_speed,
            min_closing_speed,
        };
        let inner = Mutex::new(tracker::DistanceTracker::new(settings).map_err(value_error)?);
        Ok(DistanceTracker { inner, method: method.unbind(), noise: noise.unbind() })
    }

    /// The answer after one more frame.
    ///
    /// Parameters
    /// ----------
    /// distance : float or None
    ///     Distance to contact, m; 0 or below is contact. None, NaN and inf say that the target is not in this frame.
    /// stamp : float
    ///     When it was measured, s, by any clock. A stamp that is not after the one before gives INVALID and changes nothing.
    /// noise : float, optional
    ///     Standard deviation of this one distance, m, in the place of the tracker's.
    ///
    /// Returns
    /// -------
    /// TrackedTTC
    ///     ``ttc``, ``distance``, ``closing_speed``, intervals and ``status``: CLOSING. NOT_CLOSING: the gap does not shrink,
    ///     or not by more than noise may. CONTACT: the distance is 0 or below, from a target's first frame on. WARMING_UP: a
    ///     target of so few frames that nothing can be said but where it is. LOST: the target is not in this frame; for
    ///     ``max_gap`` it is taken to go on as it did. STALE: the frame before was longer ago than ``max_gap``, and this one
    ///     is the first of a new target.
    ///     INVALID: the frame cannot be used, because its stamp is not finite or not after the one before, or the distance
    ///     is -inf; nothing is remembered of it, and what stands beside is the last answer. NO_DATA: there is no target, and
    ///     nothing was measured. CLEAR: there is no target, and inf says that there is nothing to hit.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If one of them is not a number.
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
        distance: &Bound<'_, PyAny>,
        stamp: &Bound<'_, PyAny>,
        noise: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<TrackedTTC> {
        let distance = if distance.is_none() { f64::NAN } else { number("distance", distance)? };
        let stamp = number("stamp", stamp)?;
        let noise = noise.map(|noise| number("noise", noise)).transpose()?;
        self.tracker().update(distance, stamp, noise).map(TrackedTTC).map_err(value_error)
    }

    /// What the tracker remembers, in plain lists and numbers, as JSON can hold.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``version`` and ``numbers``, for ``restore``. NaN and inf may be among them; Python's ``json`` knows them.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> print(*ttc_fast.DistanceTracker().state())
    /// version numbers
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let numbers = self.tracker().numbers();
        let state = PyDict::new(py);
        state.set_item("version", VERSION)?;
        state.set_item("numbers", numbers)?;
        Ok(state)
    }

    /// Remember what another tracker with the same settings did, and go on from there, bit for bit.
    ///
    /// Parameters
    /// ----------
    /// state : dict
    ///     From ``state()``.
    ///
    /// Returns
    /// -------
    /// None
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If it is no such state.
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
    fn restore(&self, state: &Bound<'_, PyDict>) -> PyResult<()> {
        let item = |name: &str| {
            state
                .get_item(name)?
                .ok_or_else(|| PyValueError::new_err(format!("state has no {name}: it must come from state()")))
        };
        let version: u32 = item("version")?.extract()?;
        if version != VERSION {
            return Err(PyValueError::new_err(format!("state must be of version {VERSION}, got {version}")));
        }
        let numbers: Vec<f64> = item("numbers")?.extract()?;
        let settings = *self.tracker().settings();
        *self.tracker() = tracker::DistanceTracker::from_numbers(settings, &numbers).map_err(value_error)?;
        Ok(())
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let settings = *self.tracker().settings();
        let keywords = PyDict::new(py);
        keywords.set_item("noise", &self.noise)?;
        keywords.set_item("gate", settings.innovation_gate)?;
        keywords.set_item("jump", settings.jump)?;
        keywords.set_item("confirm", settings.confirm)?;
        keywords.set_item("max_gap", settings.max_gap)?;
        keywords.set_item("max_speed", settings.max_speed)?;
        keywords.set_item("min_closing_speed", settings.min_closing_speed)?;
        Ok((PyTuple::new(py, [&self.method])?, keywords))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.state(py)
    }

    fn __setstate__(&self, state: &Bound<'_, PyDict>) -> PyResult<()> {
        self.restore(state)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("DistanceTracker({}, noise={})", self.method.bind(py).repr()?, self.noise.bind(py).repr()?))
    }
}

/// Of the dict that `state` gives.
const VERSION: u32 = 1;

impl DistanceTracker {
    /// No code of the caller's runs while the lock is held, and nothing in it panics half-way through a change.
    fn tracker(&self) -> MutexGuard<'_, tracker::DistanceTracker> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
