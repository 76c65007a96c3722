//! `Gate`.

use crate::axes;
use crate::errors::value_error;
use crate::road::Road;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::LazyLock;
use ttc_fast_core::cloud::{self, Interval};

/// Which points of a cloud count: a corridor ahead, and optionally a height band and bright enough returns.
///
/// Bounds are inclusive. They are rounded to the dtype of the coordinates (those of ``intensity`` to its own dtype if that is a
/// float), in kernel and reference alike. Rows with a non-finite x, y or z, and rows exactly (0, 0, 0), never count.
///
/// Parameters
/// ----------
/// x : (float, float)
///     Forward, m; along the path if ``curvature`` is not 0.
/// y : (float, float)
///     Left, m; from the path if ``curvature`` is not 0. The default is a lane 4 m wide.
/// z : (float, float), optional
///     Up, m. Without it the road, and one's own bonnet, are inside the gate: see ``above_road``, ``height`` and ``fit_road``.
/// intensity : (float, float), optional
///     In the units stored. A cloud without intensity is then refused.
/// axes : (str, str, str)
///     Which stored coordinate is forward, left and up, each "x", "y" or "z", with "-" before it if it points the other way.
///     nuScenes stores x right and y forward: ``("y", "-x", "z")``.
/// curvature : float
///     Of the path, 1/m: yaw rate over speed, positive to the left. 0 is straight. On a curve the result is the distance along
///     the path, computed in float64.
/// road : Road, optional
///     A fitted road that ``height`` is measured from.
/// height : (float, float), optional
///     Above ``road``, m, computed in float64.
///
/// Raises
/// ------
/// ValueError
///     If bounds are swapped or NaN, the axes do not name each coordinate once, or only one of ``road`` and ``height`` is given.
///
/// Notes
/// -----
/// The path is a circle about (0, 1 / curvature); its lateral offset is (2 y - k (x^2 + y^2)) / (1 + |(k x, 1 - k y)|), smooth as
/// k goes to 0 [plane geometry].
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.Gate(x=(2.0, 20.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
/// Gate(x=(2.0, 20.0), y=(-2.0, 2.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
#[pyclass(frozen, eq, module = "ttc_fast")]
#[derive(Clone, Copy, PartialEq)]
pub struct Gate(pub cloud::Gate);

#[pymethods]
impl Gate {
    #[new]
    #[pyo3(
        signature = (x=[0.0, f64::INFINITY], y=[-2.0, 2.0], z=None, intensity=None, axes=None, *, curvature=0.0, road=None,
            height=None),
        text_signature = "(x=(0.0, 1e999), y=(-2.0, 2.0), z=None, intensity=None, axes=('x', 'y', 'z'), *, curvature=0.0, \
            road=None, height=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        x: [f64; 2],
        y: [f64; 2],
        z: Option<[f64; 2]>,
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
        let gate = cloud::Gate { x, y, z, intensity, axes: axes::parse(axes)?, curvature, above };
        gate.checked().map(Gate).map_err(value_error)
    }

    /// A gate on a height band above a flat road, for a sensor ``sensor_height`` above it.
    ///
    /// Parameters
    /// ----------
    /// sensor_height : float
    ///     Of the sensor above the road, m.
    /// clearance : float
    ///     Points lower above the road than this do not count, m.
    /// headroom : float
    ///     Points higher above the road than this do not count, m.
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
    ///     If ``headroom`` is below ``clearance``, or as ``Gate``.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> ttc_fast.Gate.above_road(1.75, clearance=0.25, headroom=2.25).z
    /// (-1.5, 0.5)
    #[staticmethod]
    #[pyo3(signature = (sensor_height, clearance=0.2, headroom=2.0, **settings),
           text_signature = "(sensor_height, clearance=0.2, headroom=2.0, **settings)")]
    fn above_road<'py>(
        py: Python<'py>,
        sensor_height: f64,
        clearance: f64,
        headroom: f64,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let settings = settings.map_or_else(|| Ok(PyDict::new(py)), Bound::copy)?;
        if settings.contains("z")? {
            return Err(PyTypeError::new_err("above_road sets z from sensor_height, clearance and headroom"));
        }
        let band = cloud::Gate::height_band(sensor_height, clearance, headroom).map_err(value_error)?;
        settings.set_item("z", band)?;
        py.get_type::<Gate>().call((), Some(&settings))
    }

    #[getter]
    fn x(&self) -> Interval {
        self.0.x
    }

    #[getter]
    fn y(&self) -> Interval {
        self.0.y
    }

    #[getter]
    fn z(&self) -> Option<Interval> {
        self.0.z
    }

    #[getter]
    fn intensity(&self) -> Option<Interval> {
        self.0.intensity
    }

    #[getter]
    fn axes(&self) -> (String, String, String) {
        let [forward, left, up] = self.0.axes.map(axes::name);
        (forward, left, up)
    }

    #[getter]
    fn curvature(&self) -> f64 {
        self.0.curvature
    }

    #[getter]
    fn road(&self) -> Option<Road> {
        self.0.above.map(|(road, _)| Road(road))
    }

    #[getter]
    fn height(&self) -> Option<Interval> {
        self.0.above.map(|(_, height)| height)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, PyDict>)> {
        let settings = PyDict::new(py);
        settings.set_item("x", self.x())?;
        settings.set_item("y", self.y())?;
        settings.set_item("z", self.z())?;
        settings.set_item("intensity", self.intensity())?;
        settings.set_item("axes", self.axes())?;
        settings.set_item("curvature", self.curvature())?;
        settings.set_item("road", self.road())?;
        settings.set_item("height", self.height())?;
        Ok(((), settings))
    }

    fn __hash__(&self) -> u64 {
        crate::hash(&self.__repr__())
    }

    fn __repr__(&self) -> String {
        let mut parts = vec![format!("x={}", pair(self.0.x)), format!("y={}", pair(self.0.y))];
        parts.extend(self.0.z.map(|z| format!("z={}", pair(z))));
        parts.extend(self.0.intensity.map(|intensity| format!("intensity={}", pair(intensity))));
        if self.0.axes != cloud::REP_103 {
            let [forward, left, up] = self.0.axes.map(axes::name);
            parts.push(format!("axes=('{forward}', '{left}', '{up}')"));
        }
        if self.0.curvature != 0.0 {
            parts.push(format!("curvature={:?}", self.0.curvature));
        }
        if let Some((road, height)) = self.0.above {
            parts.push(format!("road={}, height={}", Road(road).__repr__(), pair(height)));
        }
        format!("Gate({})", parts.join(", "))
    }
}

fn pair((low, high): Interval) -> String {
    format!("({low:?}, {high:?})")
}

/// `gate=...`.
pub fn gate<'a>(object: Option<&'a Bound<'_, PyAny>>) -> PyResult<&'a cloud::Gate> {
    static DEFAULT: LazyLock<cloud::Gate> = LazyLock::new(cloud::Gate::default);
    let Some(object) = object else { return Ok(&DEFAULT) };
    match object.cast::<Gate>() {
        Ok(gate) => Ok(&gate.get().0),
        Err(_) => Err(PyTypeError::new_err(format!("gate must be a Gate, got {object}"))),
    }
}
