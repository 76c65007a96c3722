//! The bare formula.

use crate::array::{Floats, Numbers, as_array, outputs};
use crate::util;
use crate::util::run::{level, release};
use crate::util::value_error;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use ttc_fast_core::column::{ColumnMut, Table, TableMut};
use ttc_fast_core::ittc::{Rate, Speeds};
use ttc_fast_core::real::Real;

/// Instantaneous time-to-collision of each range: ``range / max(closing_speed, 0)``, infinite where not closing.
///
/// Exactly one of ``closing_speed`` and ``range_rate`` says how fast the ranges shrink.
///
/// Parameters
/// ----------
/// ranges : ndarray, float32 or float64, shape (N,) or (B, N)
///     Distances, m; read in place, whatever the stride and alignment. +inf is free space (result inf), -inf an object
///     too near to measure (contact), NaN and negative numbers are invalid (result inf).
/// closing_speed : float, or ndarray of the dtype and shape of ``ranges``
///     Speed at which the distance shrinks, m/s, positive when approaching. Non-finite elements are invalid.
/// range_rate : float, or ndarray of the dtype and shape of ``ranges``
///     dr/dt, m/s, positive when opening: the negative of ``closing_speed``.
/// min_closing_speed : float
///     Closing at or below this, m/s, is not closing.
/// out : ndarray of the dtype and shape of ``ranges``, optional
///     Where to write the result. May be ``ranges`` itself.
/// status_out : uint8 ndarray of the shape of ``ranges``, optional
///     Where to write the ``Status`` of each element.
///
/// Returns
/// -------
/// ndarray
///     Seconds, in [0, inf], of the dtype and shape of ``ranges``; ``out`` if given.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype, or not exactly one rate is given.
/// ValueError
///     If shapes differ, or a number is not finite.
///
/// Notes
/// -----
/// The formula is the F1TENTH course's, iTTC = r / max(-r_dot, 0), with the speed by its name instead of by its sign.
///
/// Examples
/// --------
/// A wall 10 m ahead at 5 m/s; then the same while reversing.
///
/// >>> import numpy as np, ttc_fast
/// >>> ttc_fast.ittc(np.array([10.0]), closing_speed=5.0)
/// array([2.])
/// >>> ttc_fast.ittc(np.array([10.0]), closing_speed=-5.0)
/// array([inf])
/// >>> ttc_fast.ittc(np.array([10.0]), range_rate=-5.0)
/// array([2.])
#[pyfunction]
#[pyo3(signature = (ranges, *, closing_speed=None, range_rate=None, min_closing_speed=0.0, out=None, status_out=None))]
pub fn ittc<'py>(
    py: Python<'py>,
    ranges: &Bound<'py, PyAny>,
    closing_speed: Option<&Bound<'py, PyAny>>,
    range_rate: Option<&Bound<'py, PyAny>>,
    min_closing_speed: f64,
    out: Option<&Bound<'py, PyAny>>,
    status_out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let rate = match (closing_speed, range_rate) {
        (Some(speed), None) => Rate::ClosingSpeed(speed),
        (None, Some(rate)) => Rate::RangeRate(rate),
        _ => return Err(PyTypeError::new_err("give exactly one of closing_speed and range_rate")),
    };
    if !(min_closing_speed >= 0.0 && min_closing_speed.is_finite()) {
        let got = min_closing_speed;
        return Err(PyValueError::new_err(format!("min_closing_speed must be finite and at least 0, got {got:?}")));
    }
    let (name, speeds) = match &rate {
        Rate::ClosingSpeed(speeds) => ("closing_speed", *speeds),
        Rate::RangeRate(speeds) => ("range_rate", *speeds),
    };
    let array = as_array("ranges", ranges)?;
    let number = util::number(name, speeds).ok();
    let ranges = Floats::view("ranges", array)?;
    let speeds = match number {
        Some(speed) => Speed::same(name, speed, &ranges)?,
        None => Speed::each(name, speeds, &ranges)?,
    };
    let (out, status) = outputs(&ranges, out, status_out)?;
    if let Speed::Each(speeds) = &speeds {
        for (argument, output) in [("out", Some(&out)), ("status_out", status_out)] {
            if let Some(output) = output {
                speeds.refuse_shifted(argument, output.cast()?)?;
            }
        }
    }
    let job = (rate, min_closing_speed, status);
    let wrong_dtype = || PyTypeError::new_err(format!("{name} must have the dtype of ranges, {}", ranges.dtype()));
    match ranges.numbers() {
        Numbers::Single(table) => {
            let speeds = speeds.table(Numbers::single).ok_or_else(wrong_dtype)?;
            run(py, &table, &speeds, job, ranges.output("out", &out)?)?;
        }
        Numbers::Double(table) => {
            let speeds = speeds.table(Numbers::double).ok_or_else(wrong_dtype)?;
            run(py, &table, &speeds, job, ranges.output("out", &out)?)?;
        }
    }
    Ok(out)
}

/// A rate as it came: one number, or an array like the ranges.
enum Speed<'py> {
    Same(f64),
    Each(Floats<'py>),
}

impl<'py> Speed<'py> {
    fn same(argument: &str, speed: f64, ranges: &Floats<'py>) -> PyResult<Self> {
        if speed.is_finite() && (matches!(ranges.numbers(), Numbers::Double(_)) || f32::from_f64(speed).is_finite()) {
            return Ok(Speed::Same(speed));
        }
        let problem = format!("{argument} must be a finite number in the dtype of ranges, got {speed:?}");
        Err(PyValueError::new_err(problem))
    }

    fn each(argument: &str, object: &Bound<'py, PyAny>, ranges: &Floats<'py>) -> PyResult<Self> {
        let speeds = Floats::view(argument, as_array(argument, object)?)?;
        if speeds.shape() != ranges.shape() {
            let (expected, got) = (ranges.shape(), speeds.shape());
            return Err(PyValueError::new_err(format!(
                "{argument} must be a number or have the shape {expected:?} of ranges, got {got:?}"
            )));
        }
        Ok(Speed::Each(speeds))
    }

    /// The rate in the type of the ranges, unless the array is of another.
    fn table<'a, T: Real>(&'a self, of_type: impl Fn(Numbers<'a>) -> Option<Table<'a, T>>) -> Option<Rates<'a, T>> {
        match self {
            Speed::Same(speed) => Some(Rates::Same(T::from_f64(*speed))),
            Speed::Each(speeds) => of_type(speeds.numbers()).map(Rates::Each),
        }
    }
}

/// A rate in the type of the ranges.
enum Rates<'a, T> {
    Same(T),
    Each(Table<'a, T>),
}

impl<T: Real> Rates<'_, T> {
    fn row(&self, row: usize) -> Speeds<'_, T> {
        match self {
            Rates::Same(speed) => Speeds::Same(*speed),
            Rates::Each(table) => Speeds::Each(table.row(row)),
        }
    }
}

type Job<'a, 'py> = (Rate<&'a Bound<'py, PyAny>>, f64, Option<TableMut<'py, u8>>);

fn run<T: Real>(
    py: Python<'_>,
    ranges: &Table<'_, T>,
    speeds: &Rates<'_, T>,
    (rate, min_closing_speed, mut status): Job<'_, '_>,
    mut out: TableMut<'_, T>,
) -> PyResult<()> {
    let closing = matches!(rate, Rate::ClosingSpeed(_));
    let work = move || {
        for row in 0..ranges.rows() {
            let speeds = speeds.row(row);
            let rate = if closing { Rate::ClosingSpeed(speeds) } else { Rate::RangeRate(speeds) };
            let mut status: Option<ColumnMut<'_, u8>> = status.as_mut().map(|status| status.row(row));
            let least = T::from_f64(min_closing_speed);
            ttc_fast_core::ittc::ittc(level(), ranges.row(row), rate, least, &mut out.row(row), status.as_mut())?;
        }
        Ok(())
    };
    release(py, ranges.rows() * ranges.columns(), work).map_err(value_error)
}
