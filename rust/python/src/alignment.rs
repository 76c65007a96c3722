//! `Alignment`, the settings.

use crate::errors::value_error;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use ttc_fast_core::alignment as core;

/// How a ``CloudTracker`` finds the motion of the body ahead: from all of it, not from its nearest point.
///
/// The side of the body that faces the sensor is divided into cells. Each cell sees the body at a distance that is its own
/// plus the body's motion, which is the same for all cells; both are estimated together from the frames of a window, with
/// weights that outvote what does not move like the rest.
///
/// Parameters
/// ----------
/// cell : tuple of float
///     Width and height of a cell, m: about as large as rings and beams are apart where it matters.
/// depth : float
///     How far behind its nearest point a body counts, m.
/// window : float
///     How long frames count, s; of those, the last 16. Frames that do not fit one acceleration are left out, oldest first.
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
/// Regression within cells ("fixed effects") with Tukey's biweight; a line and a parabola, averaged by their posterior
/// odds [Hoeting et al., Bayesian model averaging, 1999].
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> ttc_fast.Alignment(window=0.5)
/// Alignment(cell=(0.2, 0.05), depth=0.8, window=0.5, range_noise=0.02)
#[pyclass(frozen, eq, module = "ttc_fast")]
#[derive(Clone, Copy, PartialEq)]
pub struct Alignment(pub core::Alignment);

#[pymethods]
impl Alignment {
    #[new]
    #[pyo3(signature = (cell=[0.2, 0.05], *, depth=0.8, window=1.0, range_noise=0.02),
           text_signature = "(cell=(0.2, 0.05), *, depth=0.8, window=1.0, range_noise=0.02)")]
    fn new(cell: [f64; 2], depth: f64, window: f64, range_noise: f64) -> PyResult<Self> {
        core::Alignment { cell, depth, window, range_noise }.checked().map(Alignment).map_err(value_error)
    }

    #[getter]
    fn cell(&self) -> (f64, f64) {
        self.0.cell.into()
    }

    #[getter]
    fn depth(&self) -> f64 {
        self.0.depth
    }

    #[getter]
    fn window(&self) -> f64 {
        self.0.window
    }

    #[getter]
    fn range_noise(&self) -> f64 {
        self.0.range_noise
    }

    fn __repr__(&self) -> String {
        let core::Alignment { cell: [width, height], depth, window, range_noise } = self.0;
        format!(
            "Alignment(cell=({width:?}, {height:?}), depth={depth:?}, window={window:?}, range_noise={range_noise:?})"
        )
    }

    fn __hash__(&self) -> u64 {
        crate::hash(&self.__repr__())
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, PyDict>)> {
        let settings = PyDict::new(py);
        settings.set_item("cell", self.cell())?;
        settings.set_item("depth", self.0.depth)?;
        settings.set_item("window", self.0.window)?;
        settings.set_item("range_noise", self.0.range_noise)?;
        Ok(((), settings))
    }
}

/// `method=...`.
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
