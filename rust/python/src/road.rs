//! `Road`.

use pyo3::prelude::*;
use ttc_fast_core::cloud;

/// The road as a plane, ``z = slope_x x + slope_y y + offset``.
///
/// Parameters
/// ----------
/// slope_x : float
///     Rise per metre forward.
/// slope_y : float
///     Rise per metre to the left.
/// offset : float
///     Height at the origin, m: about minus the height of the sensor.
///
/// Raises
/// ------
/// ValueError
///     If a number is not finite.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> road = ttc_fast.Road(0.02, 0.0, -1.73)
/// >>> round(road.height(10.0, 0.0, -1.03), 3)
/// 0.5
#[pyclass(frozen, eq, module = "ttc_fast")]
#[derive(Clone, Copy, PartialEq)]
pub struct Road(pub cloud::Road);

#[pymethods]
impl Road {
    #[new]
    fn new(slope_x: f64, slope_y: f64, offset: f64) -> PyResult<Self> {
        let road = cloud::Road { slope_x, slope_y, offset };
        road.checked().map(Road).map_err(crate::errors::value_error)
    }

    #[getter]
    fn slope_x(&self) -> f64 {
        self.0.slope_x
    }

    #[getter]
    fn slope_y(&self) -> f64 {
        self.0.slope_y
    }

    #[getter]
    fn offset(&self) -> f64 {
        self.0.offset
    }

    /// Height of a point above the road, m.
    ///
    /// Parameters
    /// ----------
    /// x, y, z : float
    ///     Forward, left and up, m.
    ///
    /// Returns
    /// -------
    /// float
    fn height(&self, x: f64, y: f64, z: f64) -> f64 {
        self.0.height(x, y, z)
    }

    fn __getnewargs__(&self) -> (f64, f64, f64) {
        (self.0.slope_x, self.0.slope_y, self.0.offset)
    }

    pub fn __repr__(&self) -> String {
        let cloud::Road { slope_x, slope_y, offset } = self.0;
        format!("Road(slope_x={slope_x:?}, slope_y={slope_y:?}, offset={offset:?})")
    }
}
