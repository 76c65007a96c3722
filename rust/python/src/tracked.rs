//! What trackers say.

use crate::enums;
use pyo3::prelude::*;
use ttc_fast_core::tracker::TrackedTtc;

/// Time-to-collision over several frames, and what it rests on.
///
/// Attributes
/// ----------
/// ttc : float
///     ``distance / closing_speed``, s, in [0, inf]; inf where nothing closes or too little is known.
/// ttc_interval : tuple of float or None
///     The truth is in here nine times of ten, s; the upper end is inf where the gap may not be closing. None where
///     ``closing_speed_interval`` is.
/// distance : float
///     Distance to contact, m. inf when clear, NaN where nothing is known.
/// closing_speed : float
///     m/s, positive when approaching; NaN where it is not known.
/// closing_speed_interval : tuple of float or None
///     The truth is in here nine times of ten, m/s. None while warming up, and where there is no target.
/// status : Status
///     What it means; ``update`` of each tracker says when it gives which.
#[pyclass(frozen, module = "ttc_fast")]
pub struct TrackedTTC(pub TrackedTtc);

#[pymethods]
impl TrackedTTC {
    #[getter]
    fn ttc(&self) -> f64 {
        self.0.ttc
    }

    #[getter]
    fn ttc_interval(&self) -> Option<(f64, f64)> {
        self.0.ttc_interval.map(Into::into)
    }

    #[getter]
    fn distance(&self) -> f64 {
        self.0.distance
    }

    #[getter]
    fn closing_speed(&self) -> f64 {
        self.0.closing_speed
    }

    #[getter]
    fn closing_speed_interval(&self) -> Option<(f64, f64)> {
        self.0.closing_speed_interval.map(Into::into)
    }

    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        enums::status(py, self.0.status)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let TrackedTtc { ttc, distance, closing_speed, .. } = self.0;
        let status = self.status(py)?.getattr("name")?;
        Ok(format!(
            "TrackedTTC(ttc={ttc:.4}, status={status}, distance={distance:.4}, closing_speed={closing_speed:.4})"
        ))
    }
}
