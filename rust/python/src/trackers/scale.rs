//! `ScaleTracker`.

use super::TrackedTTC;
use crate::macros::settings;
use crate::util::state::{Format, item, lock};
use crate::util::{number, value_error};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Mutex;
use ttc_fast_core::tracker::{self, Reading, Readings, ScaleSettings};

/// Time-to-collision over several pictures, by how a target grows; with distances and displacements where there are any.
///
/// Parameters
/// ----------
/// distance : float
///     About how far away targets are, m. Only the accelerations that are expected depend on it, so a guess will do.
/// max_gap : float
///     Time without a measurement after which the past says nothing any more, s.
/// min_closing_speed : float
///     Closing at or below this, m/s, is not closing. Without distances it is the speed of a target ``distance`` away.
///
/// Raises
/// ------
/// ValueError
///     If ``distance`` or ``max_gap`` is not above 0 and finite, or ``min_closing_speed`` is negative or not finite.
///
/// Notes
/// -----
/// A bank of Kalman filters, averaged by their evidence of the newest second, as in ``MotionMixture``. A scale tells the
/// mean closing speed since the update before as a share of the distance now, ``(scale - 1) / dt``: without distances
/// the tracker knows the TTC, and neither ``distance`` nor ``closing_speed``. An outlier pulls as if it were three
/// standard deviations away. All scales of a target share an error, because its parts are not equally far away: 5 % of
/// ``scale - 1``, or half of ``spread`` where that is more, is in the interval for that.
///
/// All measurements must be of one target: call ``reset`` when another one is followed. A distance that is nearer than
/// expected by more than six standard deviations begins anew at once; one that is farther is left out, and begins anew
/// when it is the third in a row.
///
/// Any thread may call any method, and a call waits for the one before. A tracker can be pickled, with what it
/// remembers.
///
/// Examples
/// --------
/// A car that is 6 m away at last and closes at 5 m/s, in ten pictures a second:
///
/// >>> import ttc_fast
/// >>> distances = [10.0 - 0.5 * picture for picture in range(9)]
/// >>> tracker = ttc_fast.ScaleTracker()
/// >>> seen = tracker.update(None, stamp=0.0)                     # the first picture has no scale
/// >>> for picture in range(1, 9):
/// ...     scale = distances[picture - 1] / distances[picture]    # of ttc_from_keypoints, with its spread
/// ...     seen = tracker.update(scale, 0.1 * picture, 1e-3)
/// >>> round(seen.ttc, 1), seen.status.name, seen.distance
/// (1.2, 'CLOSING', nan)
///
/// The lidar knows how far away it is:
///
/// >>> seen = tracker.update(6.0 / 5.5, 0.9, 1e-3, distance=5.5, distance_noise=0.02)
/// >>> round(seen.ttc, 1), round(seen.closing_speed, 1)
/// (1.1, 5.0)
#[pyclass(frozen, module = "ttc_fast")]
pub struct ScaleTracker {
    tracker: Mutex<tracker::ScaleTracker>,
    settings: ScaleSettings,
}

#[pymethods]
impl ScaleTracker {
    #[new]
    #[pyo3(signature = (distance=10.0, *, max_gap=1.0, min_closing_speed=0.05))]
    fn new(distance: f64, max_gap: f64, min_closing_speed: f64) -> PyResult<Self> {
        let settings = ScaleSettings { distance, max_gap, min_closing_speed };
        let tracker = Mutex::new(tracker::ScaleTracker::new(settings).map_err(value_error)?);
        Ok(ScaleTracker { tracker, settings })
    }

    /// Take one more picture, and return the answer.
    ///
    /// Parameters
    /// ----------
    /// scale : float or None
    ///     Size of the target in this picture over its size at the update before, as ``ttc_from_keypoints`` gives it.
    ///     None and NaN say that there is none; so has the first picture.
    /// stamp : float
    ///     When the picture was taken, s, by any clock. A stamp that is not after the one before gives INVALID and
    ///     changes nothing.
    /// spread : float, optional
    ///     Standard error of the scale. A scale with a NaN for it does not count.
    /// distance : float, optional
    ///     Distance of the target now, m, by another sensor. From the first one on the tracker knows ``distance`` and
    ///     ``closing_speed``. None and NaN say that there is none.
    /// distance_noise : float, optional
    ///     Standard deviation of the distance, m.
    /// displacement : float, optional
    ///     How much nearer the target came since the update before, m, such as by an alignment of two clouds. It counts
    ///     from the first distance on. None and NaN say that there is none.
    /// displacement_noise : float, optional
    ///     Standard deviation of the displacement, m.
    ///
    /// Returns
    /// -------
    /// TrackedTTC
    ///     ``ttc``, ``distance``, ``closing_speed``, intervals and ``status``: CLOSING. NOT_CLOSING. CONTACT: the
    ///     distance is 0 or below. WARMING_UP: there is a distance, and fewer than three of them and no scale since.
    ///     LOST: nothing was measured in this picture; for ``max_gap`` the target is taken to go on as it did. NO_DATA:
    ///     nothing was measured for longer. INVALID: the stamp is not finite or not after the one before, and what
    ///     stands beside is the last answer; or numbers overflowed, and the tracker begins anew. ``distance`` and
    ///     ``closing_speed`` are NaN, and the interval of the closing speed is None, while there was no distance.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If an argument is not a number.
    /// ValueError
    ///     If ``scale`` is not above 0 and finite, another number is infinite, or the standard deviation of a number is
    ///     missing, not finite, or not above 0; ``spread`` may be 0.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.ScaleTracker()
    /// >>> tracker.update(None, 0.0).status.name
    /// 'NO_DATA'
    /// >>> seen = tracker.update(1.05, 0.1, 0.002)
    /// >>> round(seen.ttc, 1), seen.status.name
    /// (2.0, 'CLOSING')
    #[pyo3(signature = (scale, stamp, spread=None, *, distance=None, distance_noise=None, displacement=None,
                        displacement_noise=None))]
    #[allow(clippy::too_many_arguments, reason = "arguments of Python")]
    fn update(
        &self,
        py: Python<'_>,
        scale: &Bound<'_, PyAny>,
        stamp: &Bound<'_, PyAny>,
        spread: Option<&Bound<'_, PyAny>>,
        distance: Option<&Bound<'_, PyAny>>,
        distance_noise: Option<&Bound<'_, PyAny>>,
        displacement: Option<&Bound<'_, PyAny>>,
        displacement_noise: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<TrackedTTC> {
        let scale = (!scale.is_none()).then_some(scale);
        let stamp = number("stamp", stamp)?;
        let readings = Readings {
            scale: reading("scale", scale, "spread", spread)?,
            distance: reading("distance", distance, "distance_noise", distance_noise)?,
            displacement: reading("displacement", displacement, "displacement_noise", displacement_noise)?,
        };
        lock(py, &self.tracker).update(readings, stamp).map(TrackedTTC).map_err(value_error)
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
    /// >>> tracker = ttc_fast.ScaleTracker()
    /// >>> _ = tracker.update(None, 0.0), tracker.update(1.05, 0.1, 0.002)
    /// >>> tracker.reset()
    /// >>> tracker.update(None, 0.0).status.name
    /// 'NO_DATA'
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        *lock(py, &self.tracker) = tracker::ScaleTracker::new(self.settings).map_err(value_error)?;
        Ok(())
    }

    /// Return what the tracker remembers, as numbers, strings and lists that JSON can hold.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``class``, ``version`` and ``numbers``, for ``restore``. NaN and inf may be among the numbers, which Python's
    ///     ``json`` writes and reads.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> print(*ttc_fast.ScaleTracker().state())
    /// class version numbers
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let state = FORMAT.state(py)?;
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
    ///     If it is no such state, or one of another class or version. The tracker then remembers what it did.
    ///
    /// Examples
    /// --------
    /// >>> import json, ttc_fast
    /// >>> tracker, other = ttc_fast.ScaleTracker(), ttc_fast.ScaleTracker()
    /// >>> _ = tracker.update(None, 0.0), tracker.update(1.05, 0.1, 0.002)
    /// >>> other.restore(json.loads(json.dumps(tracker.state())))
    /// >>> other.update(1.06, 0.2, 0.002).ttc == tracker.update(1.06, 0.2, 0.002).ttc
    /// True
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let numbers: Vec<f64> = item(FORMAT.check(state)?, "numbers")?.extract()?;
        let restored = tracker::ScaleTracker::from_numbers(self.settings, &numbers).map_err(value_error)?;
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
    ScaleTracker |it, py| {
        distance: it.settings.distance,
        max_gap: it.settings.max_gap,
        min_closing_speed: it.settings.min_closing_speed,
    }
}

const FORMAT: Format = Format { class: "ScaleTracker", version: 1 };

/// A number and its standard error, either of which may be missing.
fn reading(
    name: &str,
    value: Option<&Bound<'_, PyAny>>,
    noise_name: &str,
    noise: Option<&Bound<'_, PyAny>>,
) -> PyResult<Reading> {
    let value = value.map_or(Ok(f64::NAN), |value| number(name, value))?;
    let missing = noise.is_none();
    let noise = noise.map_or(Ok(f64::NAN), |noise| number(noise_name, noise))?;
    if missing && !value.is_nan() {
        return Err(PyValueError::new_err(format!("{noise_name} must be given with {name}")));
    }
    Ok(Reading { value, noise })
}
