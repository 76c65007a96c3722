//! `Gate`.

use crate::macros::settings;
use crate::road::Road;
use crate::util::enums::{axes, axis_names};
use crate::util::{describe, value_error};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::LazyLock;
use ttc_fast_core::cloud::{self, Interval};

/// Which points of a cloud count: a corridor ahead, and optionally a height band and bright enough returns.
///
/// Bounds are inclusive. They are rounded to the dtype of the coordinates (those of ``intensity`` to its own dtype if
/// that is a float), in kernel and reference alike. Rows with a non-finite x, y or z, and rows exactly (0, 0, 0), never
/// count.
///
/// Parameters
/// ----------
/// x : (float, float)
///     Bounds ahead, m; along the path if ``curvature`` is not 0. The default begins at the sensor, so that bonnet and
///     bumper are inside the gate where the sensor sees them: begin it beyond the vehicle.
/// y : (float, float)
///     Bounds to the left, m; from the path if ``curvature`` is not 0. The default is a lane 4 m wide.
/// z : (float, float), optional
///     Bounds of the height, m. Without them the road is inside the gate: see ``above_road``, ``height`` and ``fit_road``.
/// intensity : (float, float), optional
///     Bounds of the intensity, in the units stored. A cloud without intensity is then refused.
/// axes : (str, str, str)
///     Which stored coordinate is forward, left and up, each "x", "y" or "z", with "-" before it if it points the other
///     way. nuScenes stores x right and y forward: ``("y", "-x", "z")``.
/// curvature : float
///     Curvature of the path, 1/m: yaw rate over speed, positive to the left. 0 is straight. On a curve the result is
///     the distance along the path, computed in float64.
/// road : Road, optional
///     A fitted road that ``height`` is measured from.
/// height : (float, float), optional
///     Bounds of the height above ``road``, m, computed in float64.
///
/// Raises
/// ------
/// ValueError
///     If bounds are swapped or NaN, the axes do not name each coordinate once, or only one of ``road`` and ``height``
///     is given.
///
/// Notes
/// -----
/// The path is a circle about (0, 1 / curvature); its lateral offset is (2 y - k (x^2 + y^2)) / (1 + |(k x, 1 - k y)|),
/// smooth as k goes to 0 [plane geometry].
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.Gate(x=(2.0, 20.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
/// Gate(x=(2.0, 20.0), y=(-2.0, 2.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
#[pyclass(frozen, module = "ttc_fast")]
pub struct Gate(pub cloud::CheckedGate);

/// Two bounds, or the error that says how a gate is written.
fn bounds<const NAME: char>(value: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    value.extract().map_err(|error: PyErr| {
        let text = format!(
            "{NAME} must be two numbers, (low, high), m, got {}: write Gate(x=(2.6, 40.0), y=(-2.0, 2.0)), or \
             Gate.above_road(sensor_height) to leave out the road",
            describe(value)
        );
        let is_value = error.is_instance_of::<PyValueError>(value.py());
        if is_value { PyValueError::new_err(text) } else { PyTypeError::new_err(text) }
    })
}

fn bounds_if_any<const NAME: char>(value: &Bound<'_, PyAny>) -> PyResult<Option<[f64; 2]>> {
    if value.is_none() { Ok(None) } else { bounds::<NAME>(value).map(Some) }
}

#[pymethods]
impl Gate {
    #[new]
    #[pyo3(
        signature = (x=[0.0, f64::INFINITY], y=[-2.0, 2.0], z=None, intensity=None, axes=None, *, curvature=0.0,
            road=None, height=None),
        text_signature = "(x=(0.0, 1e999), y=(-2.0, 2.0), z=None, intensity=None, axes=('x', 'y', 'z'), *, \
            curvature=0.0, road=None, height=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        #[pyo3(from_py_with = bounds::<'x'>)] x: [f64; 2],
        #[pyo3(from_py_with = bounds::<'y'>)] y: [f64; 2],
        #[pyo3(from_py_with = bounds_if_any::<'z'>)] z: Option<[f64; 2]>,
        intensity: Option<[f64; 2]>,
        axes: Option<[String; 3]>,
        curvature: f64,
        road: Option<PyRef<'_, Road>>,
        height: Option<[f64; 2]>,
    ) -> PyResult<Self> {
        let (x, y) = (x.into(), y.into());
        let [z, intensity, height] = [z, intensity, height].map(|bounds| bounds.map(Interval::from));
        let above = match (road, height) {
            (Some(road), Some(height)) => Some((road.0, height)),
            (None, None) => None,
            (Some(_), None) => return Err(PyValueError::new_err("road needs height=(low, high), the band above it")),
            (None, Some(_)) => {
                return Err(PyValueError::new_err("height needs road=..., which is None where fit_road found none"));
            }
        };
        let gate = cloud::Gate { x, y, z, intensity, axes: self::axes(axes)?, curvature, above };
        gate.checked().map(Gate).map_err(value_error)
    }

    /// A gate on a height band above a flat road and beyond the vehicle, for a sensor ``sensor_height`` above the road.
    ///
    /// Parameters
    /// ----------
    /// sensor_height : float
    ///     Height of the sensor above the road, m.
    /// clearance : float
    ///     Points lower above the road than this do not count, m.
    /// headroom : float
    ///     Points higher above the road than this do not count, m.
    /// front : float, optional
    ///     Distance from the sensor to the foremost part of its own vehicle, m. The gate begins there, or at the lower
    ///     bound of ``x`` if that is farther. Where neither ``front`` nor ``x`` is given, it begins 1.5 times
    ///     ``sensor_height`` ahead: a lidar on the roof of a car sees the bonnet no farther. Whatever is nearer is not
    ///     seen then, so give ``front`` where it is known. ``x`` alone holds as it is given.
    /// **settings
    ///     The other settings of ``Gate``.
    ///
    /// Returns
    /// -------
    /// Gate
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``headroom`` is below ``clearance``, ``front`` is negative, not finite or beyond the end of ``x``, or ``Gate``
    ///     refuses another setting.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> gate = ttc_fast.Gate.above_road(1.75, clearance=0.25, headroom=2.25, front=2.5)
    /// >>> gate.x, gate.z
    /// ((2.5, inf), (-1.5, 0.5))
    #[staticmethod]
    #[pyo3(signature = (sensor_height, clearance=0.2, headroom=2.0, *, front=None, **settings),
           text_signature = "(sensor_height, clearance=0.2, headroom=2.0, *, front=None, **settings)")]
    fn above_road(
        py: Python<'_>,
        sensor_height: f64,
        clearance: f64,
        headroom: f64,
        front: Option<f64>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let settings = settings.map_or_else(|| Ok(PyDict::new(py)), Bound::copy)?;
        if settings.contains("z")? {
            return Err(PyTypeError::new_err("above_road sets z from sensor_height, clearance and headroom"));
        }
        let band = cloud::Gate::height_band(sensor_height, clearance, headroom).map_err(value_error)?;
        settings.set_item("z", band)?;
        let whole = py.get_type::<Gate>().call((), Some(&settings))?.cast_into::<Gate>()?.get().0;
        if front.is_none() && settings.contains("x")? {
            return Ok(Gate(whole));
        }
        let beyond = whole.beyond_vehicle(front, sensor_height).and_then(cloud::Gate::checked);
        beyond.map(Gate).map_err(value_error)
    }
}

settings! {
    value Gate |it, py| {
        x: it.0.x,
        y: it.0.y,
        z: it.0.z,
        intensity: it.0.intensity,
        axes: axis_names(it.0.axes) => axis_names(cloud::REP_103),
        curvature: it.0.curvature => 0.0,
        road: it.0.above.map(|(road, _)| Road(road)),
        height: it.0.above.map(|(_, height)| height),
    }
}

/// The gate that an argument says, which is `Gate()` where it is missing.
pub fn gate<'a>(object: Option<&'a Bound<'_, PyAny>>) -> PyResult<&'a cloud::CheckedGate> {
    static DEFAULT: LazyLock<cloud::CheckedGate> = LazyLock::new(cloud::CheckedGate::default);
    let Some(object) = object else { return Ok(&DEFAULT) };
    match object.cast_exact::<Gate>() {
        Ok(gate) => Ok(&gate.get().0),
        Err(_) => Err(PyTypeError::new_err(format!("gate must be a Gate, got {object}"))),
    }
}
