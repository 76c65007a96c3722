//! Errors of the core as Python exceptions.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, PyResult};
use ttc_fast_core::Error;

create_exception!(
    ttc_fast,
    NoDataError,
    PyValueError,
    "Nothing valid was observed in a frame that was to become one number.\n\n\
     A blind sensor is not free space. Catch this, or say at construction what a blind scan\n\
     means, with ``no_data=``.\n"
);

/// An argument that makes no sense.
pub fn value_error(error: Error) -> PyErr {
    let Error { argument, problem } = error;
    PyValueError::new_err(format!("{argument} {problem}"))
}

/// The same, in one row of a batch.
pub fn value_error_in_row(row: usize) -> impl Fn(Error) -> PyErr {
    move |Error { argument, problem }| PyValueError::new_err(format!("{argument} {problem} (row {row})"))
}

/// Nothing valid was observed by a `class`, in a single `frame` or in one row of a batch.
pub fn no_data(class: &str, frame: &str, row: Option<usize>) -> PyErr {
    let place = row.map_or_else(|| format!("the {frame}"), |row| format!("{frame} {row} of the batch"));
    NoDataError::new_err(format!(
        "nothing valid was observed in {place}: a blind sensor is not free space; \
         .nearest() says what was lost, and {class}(no_data=...) chooses what a blind {frame} means"
    ))
}

/// `no_data=...`.
pub fn check_no_data(no_data: Option<f64>) -> PyResult<()> {
    if no_data.is_some_and(|value| value.is_nan() || value < 0.0) {
        return Err(PyValueError::new_err("no_data must be a time in [0, inf], in seconds"));
    }
    Ok(())
}
