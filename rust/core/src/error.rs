//! The one error of the crate: an argument, what is wrong with it, and what to do instead.

use std::fmt;

/// An argument that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The argument's name as the caller wrote it.
    pub argument: &'static str,
    /// What was wrong and what would be right.
    pub problem: String,
}

impl Error {
    pub(crate) fn new(argument: &'static str, problem: impl Into<String>) -> Self {
        Error { argument, problem: problem.into() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.argument, self.problem)
    }
}

impl std::error::Error for Error {}

/// `value`, if it is a finite number.
#[inline(always)]
pub(crate) fn finite(argument: &'static str, value: f64) -> Result<f64, Error> {
    if value.is_finite() { Ok(value) } else { Err(not_finite(argument, value)) }
}

#[cold]
fn not_finite(argument: &'static str, value: f64) -> Error {
    Error::new(argument, format!("must be a finite number, got {value:?}"))
}

/// `value`, if it is a finite number of at least 0.
pub(crate) fn non_negative(argument: &'static str, value: f64) -> Result<f64, Error> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(Error::new(argument, format!("must be finite and at least 0, got {value:?}")))
    }
}
