//! The bare formula.

use crate::array::{Floats, Numbers, as_array, outputs, promote};
use crate::util;
use crate::util::run::{interruptible, level};
use crate::util::value_error;
use numpy::{PyArray1, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use ttc_fast_core::column::{ColumnMut, Table, TableMut};
use ttc_fast_core::interrupt::worked;
use ttc_fast_core::ittc::{Rate, Speeds};
use ttc_fast_core::real::Real;

/// Instantaneous time-to-collision of each range: ``range / max(closing_speed, 0)``, infinite where not closing.
///
/// Exactly one of ``closing_speed`` and ``range_rate`` says how fast the ranges shrink.
///
/// Parameters
/// ----------
/// ranges : float, or array_like of float32 or float64, shape (N,) or (B, N)
///     Distances, m. Arrays are read in place, whatever the stride and alignment; lists and tuples are copied. +inf is
///     free space (result inf), -inf an object too near to measure (contact), NaN and negative numbers are invalid
///     (result inf).
/// closing_speed : float, or array_like that broadcasts to the shape of ``ranges``
///     Speed at which the distance shrinks, m/s, positive when approaching. Non-finite elements are invalid.
/// range_rate : float, or array_like that broadcasts to the shape of ``ranges``
///     dr/dt, m/s, positive when opening: the negative of ``closing_speed``.
/// min_closing_speed : float
///     Closing at or below this, m/s, is not closing.
/// out : ndarray of the dtype and shape of the result, optional
///     Where to write the result. May be ``ranges`` itself.
/// status_out : uint8 ndarray of the shape of the result, optional
///     Where to write the ``Status`` of each element.
///
/// Returns
/// -------
/// ndarray or float
///     Seconds, in [0, inf]; ``out`` if given. Two numbers give a float, arrays an array of their dtype. Where float32
///     and float64 meet, the result is float64, and what was float32 is copied.
///
/// Raises
/// ------
/// TypeError
///     If an array has another dtype, or not exactly one rate is given.
/// ValueError
///     If the shapes do not go together, or a number is not finite.
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
/// >>> ttc_fast.ittc(10.0, range_rate=-5.0)
/// 2.0
/// >>> ttc_fast.ittc(10.0, range_rate=5.0)
/// inf
///
/// A scan, with the range rate of each beam.
///
/// >>> angles = np.array([0.0, np.pi / 3, np.pi])
/// >>> ttc_fast.ittc(np.full(3, 10.0, np.float32), range_rate=-5.0 * np.cos(angles))
/// array([ 2.,  4., inf])
#[pyfunction]
#[pyo3(
    signature = (ranges, *unnamed, closing_speed=None, range_rate=None, min_closing_speed=0.0, out=None, status_out=None),
    text_signature = "(ranges, *, closing_speed=None, range_rate=None, min_closing_speed=0.0, out=None, status_out=None)"
)]
pub fn ittc<'py>(
    ranges: &Bound<'py, PyAny>,
    unnamed: &Bound<'py, PyTuple>,
    closing_speed: Option<&Bound<'py, PyAny>>,
    range_rate: Option<&Bound<'py, PyAny>>,
    min_closing_speed: f64,
    out: Option<&Bound<'py, PyAny>>,
    status_out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = ranges.py();
    if !unnamed.is_empty() {
        return Err(PyTypeError::new_err(
            "ittc takes the rate by name, because its sign depends on it: closing_speed= is positive when approaching, \
             range_rate= (r_dot) is positive when opening",
        ));
    }
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
    let number = util::number(name, speeds).ok();
    if !ranges.cast_exact::<PyUntypedArray>().is_ok_and(|ranges| ranges.ndim() > 0)
        && let Ok(range) = util::number("ranges", ranges)
    {
        return of_one_range(py, range, number, rate, min_closing_speed, out, status_out);
    }
    let mut arrays = [Some(as_array("ranges", ranges)?), None];
    if number.is_none() {
        let speeds = as_array(name, speeds)?;
        let shape = arrays.iter().flatten().map(PyUntypedArrayMethods::shape).next();
        let fits = shape == Some(speeds.shape());
        arrays[1] = Some(if fits { speeds } else { stretched(name, &speeds, shape.unwrap_or(&[]))? });
        promote(&mut arrays)?;
    }
    let [Some(ranges), speeds] = arrays else { unreachable!("there are ranges") };
    let ranges = Floats::view("ranges", ranges)?;
    let speeds = match (number, speeds) {
        (Some(speed), _) => Speed::same(name, speed, &ranges)?,
        (None, Some(speeds)) => Speed::Each(Floats::view(name, speeds)?),
        (None, None) => unreachable!("a rate is a number or an array"),
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
    match ranges.numbers() {
        Numbers::Single(table) => {
            let speeds = speeds.table(Numbers::single).expect("both have one dtype");
            run(py, &table, &speeds, job, ranges.output("out", &out)?)?;
        }
        Numbers::Double(table) => {
            let speeds = speeds.table(Numbers::double).expect("both have one dtype");
            run(py, &table, &speeds, job, ranges.output("out", &out)?)?;
        }
    }
    Ok(out)
}

/// The iTTC of one range: a float for one rate, an array for an array of rates.
#[cold]
fn of_one_range<'py>(
    py: Python<'py>,
    range: f64,
    number: Option<f64>,
    rate: Rate<&Bound<'py, PyAny>>,
    min_closing_speed: f64,
    out: Option<&Bound<'py, PyAny>>,
    status_out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (closing_speed, range_rate) = match rate {
        Rate::ClosingSpeed(speeds) => (Some(speeds), None),
        Rate::RangeRate(speeds) => (None, Some(speeds)),
    };
    let ranges = match (number, closing_speed, range_rate) {
        (Some(_), ..) => PyArray1::from_slice(py, &[range]).into_any(),
        (None, Some(rates), _) => full_like("closing_speed", rates, range)?,
        (None, None, rates) => full_like("range_rate", rates.expect("one of the two is given"), range)?,
    };
    if number.is_some() && (out.is_some() || status_out.is_some()) {
        return Err(PyTypeError::new_err("out and status_out are for arrays; the range and its rate are numbers"));
    }
    let ttc = ittc(&ranges, &PyTuple::empty(py), closing_speed, range_rate, min_closing_speed, out, status_out)?;
    if number.is_some() { ttc.call_method0("item") } else { Ok(ttc) }
}

/// An array of one range for each of the rates, in their dtype.
fn full_like<'py>(argument: &str, rates: &Bound<'py, PyAny>, range: f64) -> PyResult<Bound<'py, PyAny>> {
    let rates = Floats::view(argument, as_array(argument, rates)?)?;
    let numpy = rates.array().py().import(intern!(rates.array().py(), "numpy"))?;
    numpy.call_method1(intern!(numpy.py(), "full_like"), (rates.array(), range))
}

/// The rates with the shape of the ranges, where NumPy would broadcast them to it: the same rates for every scan.
#[cold]
fn stretched<'py>(
    argument: &str,
    rates: &Bound<'py, PyUntypedArray>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let numpy = rates.py().import(intern!(rates.py(), "numpy"))?;
    let same = numpy.call_method1(intern!(numpy.py(), "broadcast_to"), (rates, shape.to_vec()));
    let got = rates.shape();
    same.map_err(|_| {
        let problem = format!("{argument} must be a number or broadcast to the shape {shape:?} of ranges, got {got:?}");
        PyValueError::new_err(problem)
    })?
    .cast_into()
    .map_err(PyErr::from)
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
            worked(ranges.columns().max(1));
            let speeds = speeds.row(row);
            let rate = if closing { Rate::ClosingSpeed(speeds) } else { Rate::RangeRate(speeds) };
            let mut status: Option<ColumnMut<'_, u8>> = status.as_mut().map(|status| status.row(row));
            let least = T::from_f64(min_closing_speed);
            ttc_fast_core::ittc::ittc(level(), ranges.row(row), rate, least, &mut out.row(row), status.as_mut())?;
        }
        Ok(())
    };
    interruptible(py, ranges.rows() * ranges.columns().max(1), work)?.map_err(value_error)
}
