//! `CloudTracker`, and `Alignment`, how it finds a motion.

use super::TrackedTTC;
use crate::cloud::estimator_or_default;
use crate::estimators::estimator_object;
use crate::gate::{Gate, gate};
use crate::macros::{for_each_type, settings};
use crate::points::Cloud;
use crate::util::run::{level, release};
use crate::util::state::{Format, item, lock};
use crate::util::value_error;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Mutex;
use ttc_fast_core::alignment::{self as core, Cell, Profile, Sighting, Trend};
use ttc_fast_core::cloud::{self, Body, CloudMemory, CloudSettings, CloudTrack, StillBody};

/// Follows the nearest body ahead from cloud to cloud, and never two at once, nor the vehicle itself.
///
/// Parameters
/// ----------
/// gate : Gate, optional
///     Which points count; by default ``Gate()``, in which the road and the vehicle's own bonnet count too. For the raw
///     cloud of a car, use ``Gate.above_road(..., front=...)``, which begins beyond the vehicle.
/// estimator : estimator object, optional
///     How the edge of the body is found in a cloud; by default ``KthSmallest(10)``. In rain or spray, give
///     ``Supported(5, 0.2)``: ten drops before the body decide otherwise.
/// method : Alignment, optional
///     How the motion of the body is found; by default ``Alignment()``.
/// front_offset : float
///     Distance from the sensor to the bumper, m.
/// jump : float
///     An edge this far from where it was expected is another body's, m: the tracker begins anew with that.
/// max_gap : float
///     A body not seen for longer than this is forgotten, s. A cloud that is repeated for 0.8 of it shows a scene that
///     stands; before, a repeated cloud is no measurement.
/// min_closing_speed : float
///     A closing speed at or below this is not closing, m/s.
///
/// Raises
/// ------
/// TypeError, ValueError
///     If an object is of the wrong kind, or a number makes no sense.
///
/// Notes
/// -----
/// A body that keeps its distance to 0.1 m for 0.5 s, while what is beyond moves by 0.3 m, is the vehicle itself if it is
/// nearer than ``front_offset - 0.2``, or nearer than 3 m without a ``front_offset``. The tracker then follows what is
/// beyond ``front_offset`` or 3 m, and ``own_vehicle`` says so, until the near body moves. Until the half second has
/// passed the answer is about the near body, so this is no substitute for a gate that begins beyond the vehicle.
///
/// Any thread may call any method, and a call waits for the one before. A tracker can be pickled, with what it
/// remembers.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> tracker = ttc_fast.CloudTracker()
/// >>> y, z = (side.ravel() for side in np.meshgrid(np.linspace(-0.8, 0.8, 33), np.linspace(-1.0, 0.5, 31)))
/// >>> for frame in range(6):
/// ...     wall = np.column_stack([np.full(y.size, 12.0 - 0.4 * frame), y, z])
/// ...     seen = tracker.update(wall, stamp=0.1 * frame)
/// >>> seen.status.name, round(seen.ttc, 2), [round(end, 2) for end in seen.ttc_interval]
/// ('CLOSING', 2.5, [2.44, 2.56])
#[pyclass(frozen, module = "ttc_fast")]
pub struct CloudTracker {
    tracker: Mutex<cloud::CloudTracker>,
    settings: CloudSettings,
}

#[pymethods]
impl CloudTracker {
    #[new]
    #[pyo3(signature = (gate=None, *, estimator=None, method=None, front_offset=0.0, jump=0.5, max_gap=0.5, min_closing_speed=0.05))]
    fn new(
        gate: Option<&Bound<'_, PyAny>>,
        estimator: Option<&Bound<'_, PyAny>>,
        method: Option<&Bound<'_, PyAny>>,
        front_offset: f64,
        jump: f64,
        max_gap: f64,
        min_closing_speed: f64,
    ) -> PyResult<Self> {
        let settings = CloudSettings {
            gate: *self::gate(gate)?,
            estimator: estimator_or_default(estimator)?,
            method: alignment(method)?,
            front_offset,
            jump,
            max_gap,
            min_closing_speed,
        };
        let tracker = Mutex::new(cloud::CloudTracker::new(settings).map_err(value_error)?);
        Ok(CloudTracker { tracker, settings })
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
    ///     estimator, the plain nearest was used. WARMING_UP: fewer than 3 frames of this body so far. LOST: the body
    ///     is not there any more; for ``max_gap`` it is taken to go on as it did. NO_DATA: no valid point. INVALID: the
    ///     stamp is not finite, or not later than the last one; nothing is remembered of such a cloud, and the answer
    ///     is that of the last body seen. A cloud that is repeated to the bit under a new stamp is no measurement: the
    ///     body is predicted, the interval widens, and ``age`` says for how long.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``robust_min_x``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> tracker = ttc_fast.CloudTracker(estimator=ttc_fast.Minimum())
    /// >>> tracker.update(np.array([[8.0, 0.0, 0.5]]), stamp=3.0)
    /// TrackedTTC(ttc=inf, status=WARMING_UP, distance=8.0000, closing_speed=NaN, age=0.0000)
    fn update(&self, py: Python<'_>, points: &Bound<'_, PyAny>, stamp: &Bound<'_, PyAny>) -> PyResult<TrackedTTC> {
        let stamp = crate::util::number("stamp", stamp)?;
        let cloud = Cloud::view("points", points)?;
        let points = cloud.points();
        let mut guard = lock(py, &self.tracker);
        let tracker = &mut *guard;
        let seen =
            release(py, 3 * points.len(), || for_each_type!(points, points => tracker.update(points, stamp, level())));
        seen.map(TrackedTTC).map_err(value_error)
    }

    /// Forget everything, as a new tracker with the same settings.
    ///
    /// Returns
    /// -------
    /// None
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> tracker = ttc_fast.CloudTracker(estimator=ttc_fast.Minimum())
    /// >>> _ = tracker.update(np.array([[8.0, 0.0, 0.5]]), stamp=3.0)
    /// >>> tracker.reset()
    /// >>> tracker.update(np.array([[8.0, 0.0, 0.5]]), stamp=0.0).status.name
    /// 'WARMING_UP'
    fn reset(&self, py: Python<'_>) {
        lock(py, &self.tracker).remember(CloudMemory::default());
    }

    /// Return what the tracker remembers, as numbers, strings and lists that JSON can hold.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``class`` and ``version``; ``stamp`` of the last frame; the ``present`` body and the one before,
    ///     ``shelved``, each with its ``sightings`` and ``trend``; ``still``, a body that keeps its distance close to
    ///     the sensor, and what is ``beyond`` it meanwhile. For ``restore``.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> print(*ttc_fast.CloudTracker().state())
    /// class version stamp present shelved still beyond
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let CloudMemory { nearest, beyond, still } = lock(py, &self.tracker).memory();
        let state = FORMAT.state(py)?;
        track_to(&state, &nearest)?;
        state.set_item("still", still.map(|still| still_to(py, &still)).transpose()?)?;
        let inner = PyDict::new(py);
        track_to(&inner, &beyond)?;
        state.set_item("beyond", inner)?;
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
    /// >>> import json, numpy as np, ttc_fast
    /// >>> tracker, other = ttc_fast.CloudTracker(), ttc_fast.CloudTracker()
    /// >>> _ = tracker.update(np.full((20, 3), 5.0) - [0, 5, 5], stamp=0.0)
    /// >>> other.restore(json.loads(json.dumps(tracker.state())))
    /// >>> json.dumps(other.state()) == json.dumps(tracker.state())
    /// True
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let restored = memory(FORMAT.check(state)?)?;
        lock(py, &self.tracker).remember(restored);
        Ok(())
    }

    /// How far ahead of the sensor the vehicle itself is seen in the gate, m; None where it is not. Begin the gate
    /// beyond the vehicle then.
    #[getter]
    fn own_vehicle(&self, py: Python<'_>) -> Option<f64> {
        lock(py, &self.tracker).own_vehicle()
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.state(py)
    }

    fn __setstate__(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        self.restore(py, state)
    }
}

settings! {
    CloudTracker |it, py| {
        gate: Gate(it.settings.gate),
        estimator: estimator_object(py, it.settings.estimator)?,
        method: Alignment(it.settings.method),
        front_offset: it.settings.front_offset,
        jump: it.settings.jump,
        max_gap: it.settings.max_gap,
        min_closing_speed: it.settings.min_closing_speed,
    }
}

const FORMAT: Format = Format { class: "CloudTracker", version: 4 };

/// Column, level, count, x and z of a cell.
type Row = [f64; 5];

/// The numbers of a cell.
fn row(cell: &Cell) -> Row {
    [f64::from(cell.column), f64::from(cell.level), cell.count, cell.x, cell.z]
}

/// A cell from numbers.
fn cell([column, level, count, x, z]: Row) -> PyResult<Cell> {
    #[allow(clippy::cast_possible_truncation, reason = "checked by the way back")]
    let whole = |number: f64| {
        let whole = number as i32;
        let exact = f64::from(whole) == number;
        exact.then_some(whole).ok_or_else(|| PyValueError::new_err("state must hold whole numbers of cells"))
    };
    Ok(Cell { column: whole(column)?, level: whole(level)?, count, x, z })
}

/// What a state from Python holds.
fn memory(state: &Bound<'_, PyDict>) -> PyResult<CloudMemory> {
    let still = item(state, "still")?.extract::<Option<Bound<'_, PyDict>>>()?;
    let still = still.map(|still| still_from(&still)).transpose()?;
    let memory = CloudMemory { nearest: track(state)?, beyond: track(&item(state, "beyond")?.cast_into()?)?, still };
    memory.checked().map_err(value_error)
}

fn still_to<'py>(py: Python<'py>, it: &StillBody) -> PyResult<Bound<'py, PyDict>> {
    let state = PyDict::new(py);
    state.set_item("distance", it.distance)?;
    state.set_item("since", it.since)?;
    state.set_item("seen", it.seen)?;
    state.set_item("stamp", it.stamp)?;
    state.set_item("world_moved", it.world_moved)?;
    state.set_item("is_own", it.is_own)?;
    state.set_item("hides", it.hides)?;
    Ok(state)
}

fn still_from(state: &Bound<'_, PyDict>) -> PyResult<StillBody> {
    Ok(StillBody {
        distance: number(state, "distance")?,
        since: number(state, "since")?,
        seen: number(state, "seen")?,
        stamp: number(state, "stamp")?,
        world_moved: number(state, "world_moved")?,
        is_own: item(state, "is_own")?.extract()?,
        hides: item(state, "hides")?.extract()?,
    })
}

fn track(state: &Bound<'_, PyDict>) -> PyResult<CloudTrack> {
    let body = |name| body_from(&item(state, name)?.cast_into()?);
    let (present, shelved) = (body("present")?, body("shelved")?);
    Ok(CloudTrack { stamp: item(state, "stamp")?.extract()?, present, shelved })
}

fn track_to(state: &Bound<'_, PyDict>, track: &CloudTrack) -> PyResult<()> {
    state.set_item("stamp", track.stamp)?;
    state.set_item("present", body_to(state.py(), &track.present)?)?;
    state.set_item("shelved", body_to(state.py(), &track.shelved)?)
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

fn number(state: &Bound<'_, PyDict>, name: &str) -> PyResult<f64> {
    item(state, name)?.extract()
}

/// How a ``CloudTracker`` finds the motion of the body ahead: from all of it, not from its nearest point.
///
/// The side of the body that faces the sensor is divided into cells. Each cell sees the body at a distance that is its
/// own plus the body's motion, which is the same for all cells; both are estimated together from the frames of a
/// window, with weights that outvote what does not move like the rest.
///
/// Parameters
/// ----------
/// cell : tuple of float
///     Width and height of a cell, m: about as large as rings and beams are apart where it matters.
/// depth : float
///     How far behind its nearest point a body counts, m.
/// window : float
///     Time for which a frame counts, s; of those frames, the last 16.
/// range_noise : float
///     Standard deviation of a range, m, by the data sheet of the sensor. What the points themselves say counts more.
///
/// Raises
/// ------
/// ValueError
///     If a setting is not above 0 and finite.
///
/// Notes
/// -----
/// Two-way least squares of cells and frames with Tukey's biweight; then models of motion with jerk, averaged by their
/// posterior odds [Hoeting et al., Bayesian model averaging, 1999].
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.Alignment(window=0.5)
/// Alignment(cell=(0.2, 0.05), depth=0.8, window=0.5, range_noise=0.02)
#[pyclass(frozen, module = "ttc_fast")]
pub struct Alignment(pub core::Alignment);

#[pymethods]
impl Alignment {
    #[new]
    #[pyo3(signature = (cell=[0.2, 0.05], *, depth=0.8, window=1.0, range_noise=0.02),
           text_signature = "(cell=(0.2, 0.05), *, depth=0.8, window=1.0, range_noise=0.02)")]
    fn new(cell: [f64; 2], depth: f64, window: f64, range_noise: f64) -> PyResult<Self> {
        core::Alignment { cell, depth, window, range_noise }.checked().map(Alignment).map_err(value_error)
    }
}

settings! {
    value Alignment |it, py| {
        cell: {
            let [width, height] = it.0.cell;
            (width, height)
        },
        depth: it.0.depth,
        window: it.0.window,
        range_noise: it.0.range_noise,
    }
}

/// The method that an argument says, which is `Alignment()` where it is missing.
pub fn alignment(object: Option<&Bound<'_, PyAny>>) -> PyResult<core::Alignment> {
    object.map_or_else(
        || Ok(core::Alignment::default()),
        |object| {
            object
                .cast::<Alignment>()
                .map(|method| method.get().0)
                .map_err(|_| PyTypeError::new_err(format!("method must be an Alignment, got {object}")))
        },
    )
}
