//! What every function of the binding needs: arguments checked the same way, and the core's errors as Python's.

pub mod enums;
pub mod run;
pub mod state;

use pyo3::create_exception;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use std::convert::Infallible;
use ttc_fast_core::Error;

create_exception!(
    ttc_fast,
    NoDataError,
    PyValueError,
    "Nothing valid was observed in a frame that was to become one number.\n\n\
     A blind sensor is not free space. Catch this, or say at construction what a blind scan\n\
     means, with ``no_data=``.\n"
);

/// The exception for an argument that makes no sense.
pub fn value_error(error: Error) -> PyErr {
    let Error { argument, problem } = error;
    PyValueError::new_err(format!("{argument} {problem}"))
}

/// The exception for an argument that makes no sense in one row of a batch.
pub fn value_error_in_row(row: usize) -> impl Fn(Error) -> PyErr {
    move |Error { argument, problem }| PyValueError::new_err(format!("{argument} {problem} (row {row})"))
}

/// The exception for a frame in which a `class` observed nothing valid: a single `frame`, or one row of a batch.
pub fn no_data(class: &str, frame: &str, row: Option<usize>) -> PyErr {
    let place = row.map_or_else(|| format!("the {frame}"), |row| format!("{frame} {row} of the batch"));
    NoDataError::new_err(format!(
        "nothing valid was observed in {place}: a blind sensor is not free space; \
         .nearest() says what was lost, and {class}(no_data=...) chooses what a blind {frame} means"
    ))
}

/// Refuse a `no_data=` that is no time.
pub fn check_no_data(no_data: Option<f64>) -> PyResult<()> {
    if no_data.is_some_and(|value| value.is_nan() || value < 0.0) {
        return Err(PyValueError::new_err("no_data must be a time in [0, inf], in seconds"));
    }
    Ok(())
}

/// A number that may be left out. None is no number: it arrives as an object, and [`number`] refuses it by name.
#[derive(Clone, Copy)]
pub struct Given<'a, 'py>(Option<Borrowed<'a, 'py, PyAny>>);

impl<'py> Given<'_, 'py> {
    /// What a call without the number has.
    pub const NOTHING: Self = Given(None);

    /// What was given, if anything was.
    #[inline(always)]
    pub fn given(&self) -> Option<&Bound<'py, PyAny>> {
        self.0.as_deref()
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Given<'a, 'py> {
    type Error = Infallible;

    #[inline(always)]
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> Result<Self, Infallible> {
        Ok(Given(Some(object)))
    }
}

/// A number, from a Python number or anything that stands for one.
#[inline(always)]
pub fn number(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(float) = value.cast_exact::<PyFloat>() { Ok(float.value()) } else { converted(argument, value) }
}

/// The number that an object stands for, such as an int, a NumPy scalar or an array without dimensions.
#[cold]
fn converted(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let ndim = value.getattr_opt(intern!(value.py(), "ndim"))?.map_or(Ok(0), |ndim| ndim.extract::<usize>());
    let number = if matches!(ndim, Ok(0)) { value.extract::<f64>().ok() } else { None };
    number.ok_or_else(|| PyTypeError::new_err(format!("{argument} must be a number, got {}", describe(value))))
}

/// What a value is, for a message.
pub fn describe(value: &Bound<'_, PyAny>) -> String {
    let kind = type_name(value);
    let shape = value.getattr(intern!(value.py(), "shape")).and_then(|shape| shape.str()).ok();
    shape.map_or_else(|| kind.clone(), |shape| format!("{kind} of shape {shape}"))
}

/// The name of an object's type, for a message.
pub fn type_name(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| String::from("an object"), |name| name.to_string())
}

/// A whole number that is at least `least`.
pub fn count<T: TryFrom<i64>>(argument: &str, count: i64, least: i64) -> PyResult<T> {
    let fitting = (count >= least).then(|| T::try_from(count).ok()).flatten();
    fitting.ok_or_else(|| PyValueError::new_err(format!("{argument} must be at least {least}, got {count}")))
}

/// A number of threads.
pub fn threads(threads: i64) -> PyResult<usize> {
    usize::try_from(threads).ok().filter(|threads| (1..=MOST_THREADS).contains(threads)).ok_or_else(|| {
        let problem = format!("threads must be at least 1 and at most {MOST_THREADS}, got {threads}");
        PyValueError::new_err(problem)
    })
}

/// More threads than any machine runs at once.
const MOST_THREADS: usize = 1024;
