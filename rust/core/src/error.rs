//! The one error of the crate, and the checks that give it: an argument, what is wrong with it, and what would be
//! right.

use std::fmt;
use std::ops::RangeInclusive;

/// An argument that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The argument's name as the caller wrote it.
    pub argument: &'static str,
    /// What was wrong and what would be right.
    pub problem: String,
}

impl Error {
    #[cold]
    pub(crate) fn new(argument: &'static str, problem: impl Into<String>) -> Self {
        Error { argument, problem: problem.into() }
    }

    /// This error with a hint behind it.
    pub(crate) fn hint(self, hint: &str) -> Self {
        Error { problem: format!("{}; {hint}", self.problem), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.argument, self.problem)
    }
}

impl std::error::Error for Error {}

/// Checks that `value` is a finite number, and returns it.
#[inline(always)]
pub(crate) fn finite(argument: &'static str, value: f64) -> Result<f64, Error> {
    if value.is_finite() { Ok(value) } else { Err(not_finite(argument, value)) }
}

#[cold]
fn not_finite(argument: &'static str, value: f64) -> Error {
    Error::new(argument, format!("must be a finite number, got {value:?}"))
}

/// Checks that `value` is a finite number of at least 0, and returns it.
pub(crate) fn non_negative(argument: &'static str, value: f64) -> Result<f64, Error> {
    checked(value.is_finite() && value >= 0.0, argument, value, "must be finite and at least 0")
}

/// Checks that `value` is a finite number above 0, and returns it.
pub(crate) fn positive(argument: &'static str, value: f64) -> Result<f64, Error> {
    checked(value.is_finite() && value > 0.0, argument, value, "must be finite and above 0")
}

/// Checks that `value` is a share, from 0 to 1, and returns it.
pub(crate) fn share(argument: &'static str, value: f64) -> Result<f64, Error> {
    checked((0.0..=1.0).contains(&value), argument, value, "must be in [0, 1]")
}

/// Checks that `value` is a duration above 0 and at most `longest`, all in seconds, and returns it.
pub(crate) fn duration(argument: &'static str, value: f64, longest: f64) -> Result<f64, Error> {
    checked(value > 0.0 && value <= longest, argument, value, format!("must be above 0 and at most {longest} s"))
}

/// Checks that `dt` seconds can lie between two frames, and returns it.
pub(crate) fn elapsed(dt: f64) -> Result<f64, Error> {
    checked(dt.is_finite() && dt > 0.0, "dt", dt, "must be finite and above 0 s")
        .map_err(|error| error.hint("it is the time between the two, from their stamps"))
}

/// Checks that `count` is at least 1, and returns it.
pub(crate) fn at_least_one(argument: &'static str, count: usize) -> Result<usize, Error> {
    if count >= 1 { Ok(count) } else { Err(Error::new(argument, "must be at least 1, got 0")) }
}

/// Checks that `count` lies in a range, and returns it.
pub(crate) fn count_in(argument: &'static str, count: usize, range: RangeInclusive<usize>) -> Result<usize, Error> {
    if range.contains(&count) {
        return Ok(count);
    }
    let (least, most) = range.into_inner();
    Err(Error::new(argument, format!("must be at least {least} and at most {most}, got {count}")))
}

/// Checks that an array of `got` entries has one for each of `count` things, such as "beams".
#[inline(always)]
pub(crate) fn one_entry_each(argument: &'static str, got: usize, count: usize, things: &str) -> Result<(), Error> {
    if got == count { Ok(()) } else { Err(wrong_length(argument, got, count, things)) }
}

#[cold]
fn wrong_length(argument: &'static str, got: usize, count: usize, things: &str) -> Error {
    Error::new(argument, format!("must have one entry for each of the {count} {things}, got {got}"))
}

fn checked(fits: bool, argument: &'static str, value: f64, wanted: impl fmt::Display) -> Result<f64, Error> {
    if fits { Ok(value) } else { Err(Error::new(argument, format!("{wanted}, got {value:?}"))) }
}
