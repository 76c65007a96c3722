//! Numbers from Python.

use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyFloat;

/// A Python number.
#[inline(always)]
pub fn number(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(float) = value.cast_exact::<PyFloat>() { Ok(float.value()) } else { converted(argument, value) }
}

/// The number that another object stands for.
#[cold]
fn converted(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let ndim = value.getattr_opt(intern!(value.py(), "ndim"))?.map_or(Ok(0), |ndim| ndim.extract::<usize>());
    let number = if matches!(ndim, Ok(0)) { value.extract::<f64>().ok() } else { None };
    number.ok_or_else(|| PyTypeError::new_err(format!("{argument} must be a number, got {}", describe(value))))
}

/// What a value is, for a message.
pub fn describe(value: &Bound<'_, PyAny>) -> String {
    let kind = value.get_type().name().map_or_else(|_| String::from("an object"), |name| name.to_string());
    let shape = value.getattr(intern!(value.py(), "shape")).and_then(|shape| shape.str()).ok();
    shape.map_or_else(|| kind.clone(), |shape| format!("{kind} of shape {shape}"))
}
