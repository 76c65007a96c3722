//! `CloudTracker`.

use crate::alignment::alignment;
use crate::cloud::estimator_or_default;
use crate::errors::value_error;
use crate::gate::gate;
use crate::gil::release;
use crate::level;
use crate::points::{AnyPoints, Cloud};
use crate::tracked::TrackedTTC;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use ttc_fast_core::alignment::{Cell, Profile, Sighting, Trend};
use ttc_fast_core::cloud::{self, Body, CloudSettings, CloudTrack};

/// Follows the nearest body ahead from cloud to cloud, and never two at once.
///
/// Parameters
/// ----------
/// gate : Gate, optional
///     Which points count; by default ``Gate()``, in which the road and one's own bonnet count too. On the raw cloud of a
///     car, use ``Gate.above_road(...)`` with ``x`` from the bumper on.
/// estimator : estimator object, optional
///     How the edge of the body is found; by default ``KthSmallest(10)``.
/// method : Alignment, optional
///     How its motion is; by default ``Alignment()``.
/// front_offset : float
///     From the sensor to the bumper, m.
/// jump : float
///     An edge this far from where it was expected is another body's, m: the tracker begins anew with that.
/// max_gap : float
///     A body not seen for longer than this is forgotten, s.
///
/// Raises
/// ------
/// TypeError, ValueError
///     If an object is of the wrong kind, or a number makes no sense.
///
/// Notes
/// -----
/// Two threads may not update one tracker at the same time. A tracker can be pickled, with what it remembers.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> tracker = ttc_fast.CloudTracker()
/// >>> y, z = (side.ravel() for side in np.meshgrid(np.linspace(-0.8, 0.8, 33), np.linspace(-1.0, 0.5, 31)))
/// >>> for frame in range(6):
/// ...     wall = np.column_stack([np.full(y.size, 12.0 - 0.4 * frame), y, z])
/// ...     seen = tracker.update(wall, stamp=0.1 * frame)
/// >>> seen
/// TrackedTTC(ttc=2.5000, status=CLOSING, distance=10.0000, closing_speed=4.0000)
#[pyclass(module = "ttc_fast")]
pub struct CloudTracker {
    tracker: cloud::CloudTracker,
    settings: Py<PyDict>,
}

#[pymethods]
impl CloudTracker {
    #[new]
    #[pyo3(signature = (gate=None, *, estimator=None, method=None, front_offset=0.0, jump=0.5, max_gap=0.5))]
    fn new(
        py: Python<'_>,
        gate: Option<&Bound<'_, PyAny>>,
        estimator: Option<&Bound<'_, PyAny>>,
        method: Option<&Bound<'_, PyAny>>,
        front_offset: f64,
        jump: f64,
        max_gap: f64,
    ) -> PyResult<Self> {
        let settings = PyDict::new(py);
        settings.set_item("gate", gate)?;
        settings.set_item("estimator", estimator)?;
        settings.set_item("method", method)?;
        settings.set_item("front_offset", front_offset)?;
        settings.set_item("jump", jump)?;
        settings.set_item("max_gap", max_gap)?;
        let chosen = CloudSettings {
            gate: *self::gate(gate)?,
            estimator: estimator_or_default(estimator)?,
            method: alignment(method)?,
            front_offset,
            jump,
            max_gap,
        };
        let tracker = cloud::CloudTracker::new(chosen).map_err(value_error)?;
        Ok(CloudTracker { tracker, settings: settings.unbind() })
    }

    /// Take in a cloud, and say how the body ahead moves.
    ///
    /// Parameters
    /// ----------
    /// points : ndarray or tuple of ndarray
    ///     Points as for ``robust_min_x``.
    /// stamp : float
    ///     When they were taken, s, from any origin.
    ///
    /// Returns
    /// -------
    /// TrackedTTC
    ///     ``ttc``, ``distance``, ``closing_speed``, intervals and ``status``: CLEAR: nothing in the gate. NOT_CLOSING,
    ///     CLOSING. CONTACT: the distance is 0 or below, from the first frame on. TOO_FEW: too few points for the
    ///     estimator, the plain nearest was used. WARMING_UP: fewer than 3 frames of this body so far. LOST: the body is
    ///     not there any more; for ``max_gap`` it is taken to go on as it did. NO_DATA: no valid point. INVALID: the stamp is
    ///     not finite, or not later than the last one; nothing is remembered of such a cloud, and the answer is that of the
    ///     last body seen.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As ``robust_min_x``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> tracker = ttc_fast.CloudTracker(estimator=ttc_fast.Minimum())
    /// >>> tracker.update(np.array([[8.0, 0.0, 0.5]]), stamp=3.0)
    /// TrackedTTC(ttc=inf, status=WARMING_UP, distance=8.0000, closing_speed=NaN)
    fn update(&mut self, py: Python<'_>, points: &Bound<'_, PyAny>, stamp: &Bound<'_, PyAny>) -> PyResult<TrackedTTC> {
        let stamp = crate::number::number("stamp", stamp)?;
        let cloud = Cloud::view("points", points)?;
        let points = cloud.points();
        let tracker = &mut self.tracker;
        let seen = release(py, 3 * points.len(), || match points {
            AnyPoints::Single(points) => tracker.update(points, stamp, level::current()),
            AnyPoints::Double(points) => tracker.update(points, stamp, level::current()),
        });
        seen.map(TrackedTTC).map_err(value_error)
    }

    /// What the tracker remembers, in plain lists and numbers, as JSON can hold.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``stamp`` of the last frame; the ``present`` body and the one before, ``shelved``, each with its ``sightings`` and
    ///     ``trend``; for ``restore``.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> print(*ttc_fast.CloudTracker().state())
    /// stamp present shelved
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let CloudTrack { stamp, present, shelved } = &self.tracker.track;
        let state = PyDict::new(py);
        state.set_item("stamp", stamp)?;
        state.set_item("present", body_to(py, present)?)?;
        state.set_item("shelved", body_to(py, shelved)?)?;
        Ok(state)
    }

    /// Remember what another tracker with the same settings did.
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
    /// TypeError, ValueError, KeyError
    ///     If it is no such state.
    ///
    /// Examples
    /// --------
    /// >>> import json, numpy as np, ttc_fast
    /// >>> tracker, other = ttc_fast.CloudTracker(), ttc_fast.CloudTracker()
    /// >>> _ = tracker.update(np.full((20, 3), 5.0) - [0, 5, 5], stamp=0.0)
    /// >>> other.restore(json.loads(json.dumps(tracker.state())))
    /// >>> json.dumps(other.state()) == json.dumps(tracker.state())
    /// True
    fn restore(&mut self, state: &Bound<'_, PyDict>) -> PyResult<()> {
        self.tracker.track = track(state)?;
        Ok(())
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyTuple>, Py<PyDict>) {
        (PyTuple::empty(py), self.settings.clone_ref(py))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.state(py)
    }

    fn __setstate__(&mut self, state: &Bound<'_, PyDict>) -> PyResult<()> {
        self.restore(state)
    }
}

/// Column, level, count, x and z of a cell.
type Row = [f64; 5];

/// A cell as numbers.
fn row(cell: &Cell) -> Row {
    [f64::from(cell.column), f64::from(cell.level), cell.count, cell.x, cell.z]
}

/// And back.
fn cell([column, level, count, x, z]: Row) -> PyResult<Cell> {
    #[allow(clippy::cast_possible_truncation, reason = "checked by the way back")]
    let whole = |number: f64| {
        let whole = number as i32;
        let exact = f64::from(whole) == number;
        exact.then_some(whole).ok_or_else(|| PyValueError::new_err("state must hold whole numbers of cells"))
    };
    Ok(Cell { column: whole(column)?, level: whole(level)?, count, x, z })
}

/// A state from Python, if it is one.
fn track(state: &Bound<'_, PyDict>) -> PyResult<CloudTrack> {
    let stamp = item(state, "stamp")?.extract()?;
    let body = |name| body_from(&item(state, name)?.cast_into()?);
    CloudTrack { stamp, present: body("present")?, shelved: body("shelved")? }.checked().map_err(value_error)
}

fn body_to<'py>(py: Python<'py>, Body { sightings, trend }: &Body) -> PyResult<Bound<'py, PyDict>> {
    let sightings = sightings.iter().map(|sighting| {
        let each = PyDict::new(py);
        each.set_item("stamp", sighting.stamp)?;
        each.set_item("edge", sighting.edge)?;
        each.set_item("cells", sighting.profile.cells.iter().map(row).collect::<Vec<_>>())?;
        Ok(each)
    });
    let state = PyDict::new(py);
    state.set_item("sightings", sightings.collect::<PyResult<Vec<_>>>()?)?;
    state.set_item("trend", trend.map(|it| [it.distance, it.closing_speed, it.variance]))?;
    Ok(state)
}

fn body_from(state: &Bound<'_, PyDict>) -> PyResult<Body> {
    let mut sightings = Vec::new();
    for each in item(state, "sightings")?.try_iter()? {
        let each = each?.cast_into::<PyDict>()?;
        let cells = item(&each, "cells")?.extract::<Vec<Row>>()?;
        let profile = Profile { cells: cells.into_iter().map(cell).collect::<PyResult<_>>()? };
        sightings.push(Sighting { stamp: number(&each, "stamp")?, edge: number(&each, "edge")?, profile });
    }
    let trend = item(state, "trend")?.extract::<Option<[f64; 3]>>()?;
    let trend = trend.map(|[distance, closing_speed, variance]| Trend { distance, closing_speed, variance });
    Ok(Body { sightings, trend })
}

fn item<'py>(state: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    state
        .get_item(name)?
        .ok_or_else(|| PyValueError::new_err(format!("state has no {name}: it must come from state()")))
}

fn number(state: &Bound<'_, PyDict>, name: &str) -> PyResult<f64> {
    item(state, name)?.extract()
}
