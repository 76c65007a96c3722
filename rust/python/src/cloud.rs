//! The cloud functions and their results.

use crate::estimators::estimator;
use crate::gate::gate;
use crate::macros::{for_each_type, results};
use crate::points::{AnyPoints, Cloud};
use crate::util::run::{interruptible, level};
use crate::util::{threads as checked_threads, value_error};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use ttc_fast_core::cloud::{self, Estimator};

/// The robust nearest distance ahead, and what it rests on.
///
/// Attributes
/// ----------
/// x : float
///     The estimate, m. NaN when there are too few candidates or no data, inf when clear.
/// nearest_x : float
///     The plain nearest candidate, m. inf when clear, NaN without data.
/// candidates : int
///     Points inside the gate.
/// support : int
///     Points inside the gate that support the estimate.
/// index : int
///     The index of the point that is the estimate, counting rows of points in order; -1 where it is no single point.
/// detection : Detection
///     FOUND, CLEAR, TOO_FEW or NO_DATA.
#[pyclass(frozen, module = "ttc_fast")]
pub struct MinX(cloud::MinX);

results! {
    MinX: cloud::MinX { x "m", nearest_x "m", candidates "", support "", index "", detection "" }
}

/// Time-to-collision from two clouds, and what it rests on.
///
/// Attributes
/// ----------
/// ttc : float
///     Time-to-collision, s, in [0, inf]; inf where nothing closes or too little is known.
/// status : Status
///     CLEAR: nothing in the gate. NOT_CLOSING, CLOSING. CONTACT: the distance is 0 or below, whatever the earlier
///     cloud showed. TOO_FEW: the plain nearest points were used, because the estimator had too few. WARMING_UP:
///     something is there that the earlier cloud did not show. NO_DATA: the current cloud holds no valid point.
/// distance : float
///     Distance from the bumper to the nearest thing in the current cloud, m. inf when clear, NaN without data.
/// closing_speed : float
///     m/s, positive when approaching. NaN unless both clouds show a distance.
/// previous, current : MinX
///     What was found in each cloud.
#[pyclass(frozen, module = "ttc_fast")]
pub struct CloudTTC(cloud::CloudTtc);

results! {
    CloudTTC: cloud::CloudTtc { ttc "s", status "", distance "m", closing_speed "m/s", previous "", current "" }
}

/// The robust nearest distance ahead of the points inside a gate.
///
/// Parameters
/// ----------
/// points : ndarray or tuple of ndarray
///     float32 or float64 coordinates, read in place whatever the stride and alignment: rows (N, 3) or wider, whose
///     fourth column is the intensity; (H, W, 3) or wider for an organised cloud; a record array with fields x, y, z
///     and perhaps intensity (an integer of up to 32 bits, float32 or float64); or a tuple of columns (x, y, z) or
///     (x, y, z, intensity). ``from_pointcloud2`` reads a ROS message. Rows with a non-finite coordinate, and rows
///     exactly (0, 0, 0), never count.
/// gate : Gate, optional
///     Which points count; by default ``Gate()``, a lane 4 m wide that begins at the sensor, in which the road and the
///     vehicle's own bonnet count too. For the raw cloud of a car, use ``Gate.above_road(..., front=...)``, which begins
///     beyond the vehicle.
/// estimator : estimator object, optional
///     How outliers are survived; by default ``KthSmallest(10)``.
/// threads : int
///     How many threads may share the work; worth it from about a million points. The answer does not depend on it.
///
/// Returns
/// -------
/// MinX
///     ``x``, ``nearest_x``, ``candidates``, ``support``, ``index`` and ``detection``.
///
/// Raises
/// ------
/// TypeError
///     If the points have another dtype, or an object is of the wrong kind.
/// ValueError
///     If the points have another shape, the gate bounds an intensity that they lack, or ``threads`` is below 1.
///
/// Notes
/// -----
/// Ties go to the lowest index. Another thread that writes to the points meanwhile may give a mix of two clouds, never
/// a read out of bounds.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> points = np.array([[3.0, 0.0, 0.5], [8.0, 0.1, 0.5], [8.1, 0.2, 0.5], [9.0, 5.0, 0.5]])
/// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.KthSmallest(2))
/// MinX(x=8.0000, nearest_x=3.0000, candidates=3, support=2, index=1, detection=FOUND)
#[pyfunction]
#[pyo3(signature = (points, *, gate=None, estimator=None, threads=1))]
pub fn robust_min_x(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    gate: Option<&Bound<'_, PyAny>>,
    estimator: Option<&Bound<'_, PyAny>>,
    threads: i64,
) -> PyResult<MinX> {
    let threads = checked_threads(threads)?;
    let (gate, estimator) = (self::gate(gate)?, estimator_or_default(estimator)?);
    let cloud = Cloud::view("points", points)?;
    let points = cloud.points();
    let found = interruptible(
        py,
        3 * points.len(),
        || for_each_type!(points, points => cloud::robust_min_x(points, gate, estimator, level(), threads)),
    )?;
    found.map(MinX).map_err(value_error)
}

/// Time-to-collision by two distances ``dt`` seconds apart, if the gap goes on shrinking as it did.
///
/// Parameters
/// ----------
/// previous, current : float
///     Distances to contact, m; 0 or below is contact.
/// dt : float
///     Time between them, s, from their stamps.
///
/// Returns
/// -------
/// float
///     ``current dt / (previous - current)``, s; inf when the gap does not shrink, 0 in contact while it shrinks.
///
/// Raises
/// ------
/// ValueError
///     If a distance is not finite, or ``dt`` is not above 0 and finite.
///
/// Notes
/// -----
/// The constant-velocity model: TTC = d1 dt / (d0 - d1).
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> round(ttc_fast.ttc_from_distances(10.0, 9.5, 0.1), 6)
/// 1.9
#[pyfunction]
pub fn ttc_from_distances(previous: f64, current: f64, dt: f64) -> PyResult<f64> {
    ttc_fast_core::motion::ttc_from_distances(previous, current, dt).map_err(value_error)
}

/// Time-to-collision by two clouds taken ``dt`` seconds apart, from how the robust nearest distance shrinks.
///
/// Two frames give a noisy speed: a tracker over several frames is the better base for a decision.
///
/// Parameters
/// ----------
/// previous, current : ndarray or tuple of ndarray
///     Points as for ``robust_min_x``. Both clouds have one dtype.
/// dt : float
///     Time between them, s, from their stamps.
/// gate : Gate, optional
///     Which points count; by default ``Gate()``, in which the road and the vehicle's own bonnet count too. Two clouds
///     do not tell a bonnet from a car that keeps its distance: use ``Gate.above_road(..., front=...)``.
/// estimator : estimator object, optional
///     How outliers are survived; by default ``KthSmallest(10)``.
/// front_offset : float
///     Distance from the sensor to the bumper, m.
///
/// Returns
/// -------
/// CloudTTC
///     ``ttc``, ``status``, ``distance``, ``closing_speed``, and what was found in each cloud.
///
/// Raises
/// ------
/// TypeError, ValueError
///     As in ``robust_min_x``; also if ``dt`` is not above 0 and finite, or the dtypes differ.
///
/// Notes
/// -----
/// The constant-velocity model: TTC = d1 dt / (d0 - d1).
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> car = np.array([[10.0, 0.0, 0.5], [10.2, 0.1, 0.5], [10.1, -0.4, 0.6]])
/// >>> seen = ttc_fast.ttc_from_clouds(car, car - [0.5, 0, 0], 0.1, estimator=ttc_fast.Minimum())
/// >>> round(seen.ttc, 6), seen.status.name, round(seen.closing_speed, 6)
/// (1.9, 'CLOSING', 5.0)
#[pyfunction]
#[pyo3(signature = (previous, current, dt, *, gate=None, estimator=None, front_offset=0.0))]
pub fn ttc_from_clouds(
    py: Python<'_>,
    previous: &Bound<'_, PyAny>,
    current: &Bound<'_, PyAny>,
    dt: f64,
    gate: Option<&Bound<'_, PyAny>>,
    estimator: Option<&Bound<'_, PyAny>>,
    front_offset: f64,
) -> PyResult<CloudTTC> {
    let (gate, estimator) = (self::gate(gate)?, estimator_or_default(estimator)?);
    let (previous, current) = (Cloud::view("previous", previous)?, Cloud::view("current", current)?);
    let clouds = (previous.points(), current.points());
    let level = level();
    let found = interruptible(py, 3 * (clouds.0.len() + clouds.1.len()), || match clouds {
        (AnyPoints::Single(previous), AnyPoints::Single(current)) => {
            Some(cloud::ttc_from_clouds([previous, current], dt, gate, estimator, front_offset, level))
        }
        (AnyPoints::Double(previous), AnyPoints::Double(current)) => {
            Some(cloud::ttc_from_clouds([previous, current], dt, gate, estimator, front_offset, level))
        }
        _ => None,
    })?;
    let found = found.ok_or_else(|| PyTypeError::new_err("previous and current must have the same dtype"))?;
    found.map(CloudTTC).map_err(value_error)
}

/// The estimator that an argument says, which is `KthSmallest(10)` where it is missing.
pub fn estimator_or_default(object: Option<&Bound<'_, PyAny>>) -> PyResult<Estimator> {
    object.map_or(Ok(Estimator::KthSmallest(10)), estimator)
}
