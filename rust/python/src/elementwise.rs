//! A formula over numbers and arrays: numbers give a float, arrays are read in place and give an array of their dtype.

use crate::array::{Floats, Numbers, as_array, promote, refuse_shared};
use crate::util::run::{interruptible, level};
use crate::util::{number, value_error};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use ttc_fast_core::column::{Table, TableMut};
use ttc_fast_core::interrupt::worked;
use ttc_fast_core::motion::{Operand, each, each_status};
use ttc_fast_core::real::Real;
use ttc_fast_core::{Error, Status};

/// A name, which numbers it takes, and the value as it came.
#[derive(Clone, Copy)]
pub struct Argument<'a, 'py>(pub &'static str, pub Domain, pub &'a Bound<'py, PyAny>);

/// Which numbers an argument takes. Elements of arrays are for the formula to judge.
#[derive(Clone, Copy)]
pub enum Domain {
    NotNan,
    Finite,
    AtLeastZero,
    AboveZero,
}

/// `formula` of the arguments.
pub fn apply<'py, const N: usize>(
    arguments: [Argument<'_, 'py>; N],
    formula: impl Fn([f64; N]) -> f64 + Copy + Send,
) -> PyResult<Bound<'py, PyAny>> {
    apply_with_status(arguments, formula, None, |_| Status::Invalid)
}

/// `formula` of the arguments and, if they are arrays and it is asked for, the `status` of each element.
pub fn apply_with_status<'py, const N: usize>(
    arguments: [Argument<'_, 'py>; N],
    formula: impl Fn([f64; N]) -> f64 + Copy + Send,
    status_out: Option<&Bound<'py, PyAny>>,
    status: impl Fn([f64; N]) -> Status + Copy + Send,
) -> PyResult<Bound<'py, PyAny>> {
    let py = arguments[0].2.py();
    let mut numbers = [0.0; N];
    let mut arrays = [false; N];
    for (i, Argument(name, domain, value)) in arguments.into_iter().enumerate() {
        let is_array = value.cast_exact::<PyUntypedArray>().is_ok_and(|array| array.ndim() > 0);
        match (!is_array).then(|| number(name, value)) {
            Some(Ok(number)) => numbers[i] = domain.checked(name, number)?,
            _ => arrays[i] = true,
        }
    }
    if arrays == [false; N] {
        if status_out.is_some() {
            return Err(PyTypeError::new_err("status_out is for arrays; the arguments are numbers"));
        }
        return Ok(PyFloat::new(py, formula(numbers)).into_any());
    }
    let views = views(&arguments, arrays)?;
    let first = views.iter().flatten().next().expect("there is an array");
    let out = first.empty_like(first.dtype())?;
    let status_out = status_out.map(|out| status_output(&views, out)).transpose()?;
    let work = Work { numbers, formula, status, status_out };
    match first.numbers() {
        Numbers::Single(_) => work.run(py, tables(&views, Numbers::single), first.output("out", &out)?)?,
        Numbers::Double(_) => work.run(py, tables(&views, Numbers::double), first.output("out", &out)?)?,
    }
    Ok(out)
}

impl Domain {
    fn checked(self, argument: &str, value: f64) -> PyResult<f64> {
        let (fits, wanted) = match self {
            Domain::NotNan => (!value.is_nan(), "a number"),
            Domain::Finite => (value.is_finite(), "a finite number"),
            Domain::AtLeastZero => (value.is_finite() && value >= 0.0, "finite and at least 0"),
            Domain::AboveZero => (value.is_finite() && value > 0.0, "finite and above 0"),
        };
        if fits { Ok(value) } else { Err(PyValueError::new_err(format!("{argument} must be {wanted}, got {value:?}"))) }
    }
}

/// The arrays among the arguments, in one shape and dtype.
fn views<'py, const N: usize>(
    arguments: &[Argument<'_, 'py>; N],
    arrays: [bool; N],
) -> PyResult<[Option<Floats<'py>>; N]> {
    let mut found: [Option<Bound<'py, PyUntypedArray>>; N] = [const { None }; N];
    for (i, Argument(name, _, value)) in arguments.iter().enumerate().filter(|(i, _)| arrays[*i]) {
        found[i] = Some(as_array(name, value)?);
    }
    let mut shapes = found.iter().flatten().map(PyUntypedArrayMethods::shape);
    let first = shapes.next().expect("there is an array");
    if shapes.any(|shape| shape != first) {
        broadcast(arguments[0].2.py(), &mut found)?;
    }
    promote(&mut found)?;
    let mut views: [Option<Floats<'py>>; N] = [const { None }; N];
    for (i, array) in found.into_iter().enumerate() {
        views[i] = array.map(|array| Floats::view(arguments[i].0, array)).transpose()?;
    }
    Ok(views)
}

/// Views of the same memory with the shape that all have together.
fn broadcast<'py, const N: usize>(
    py: Python<'py>,
    arrays: &mut [Option<Bound<'py, PyUntypedArray>>; N],
) -> PyResult<()> {
    let given: Vec<_> = arrays.iter().flatten().cloned().collect();
    let shapes: Vec<String> = given.iter().map(|array| format!("{:?}", array.shape())).collect();
    let numpy = py.import(intern!(py, "numpy"))?;
    let same = numpy.call_method1(intern!(py, "broadcast_arrays"), pyo3::types::PyTuple::new(py, given)?);
    let same = same.map_err(|_| {
        PyValueError::new_err(format!("the shapes of the arrays do not broadcast: {}", shapes.join(", ")))
    })?;
    let mut same = same.try_iter()?;
    for array in arrays.iter_mut().flatten() {
        *array = same.next().expect("as many as were given")?.cast_into()?;
    }
    Ok(())
}

fn status_output<'py, const N: usize>(
    views: &[Option<Floats<'py>>; N],
    out: &Bound<'py, PyAny>,
) -> PyResult<TableMut<'py, u8>> {
    let mut views = views.iter().flatten();
    let table = views.next().expect("there is an array").output::<u8>("status_out", out)?;
    let out = out.cast::<PyUntypedArray>()?;
    views.try_for_each(|view| refuse_shared("status_out", out, "an input", view.array()))?;
    Ok(table)
}

fn tables<'a, 'py, T: Real, const N: usize>(
    views: &'a [Option<Floats<'py>>; N],
    of_type: impl Fn(Numbers<'a>) -> Option<Table<'a, T>>,
) -> [Option<Table<'a, T>>; N] {
    views.each_ref().map(|view| view.as_ref().and_then(|view| of_type(view.numbers())))
}

struct Work<'py, F, S, const N: usize> {
    numbers: [f64; N],
    formula: F,
    status: S,
    status_out: Option<TableMut<'py, u8>>,
}

impl<F, S, const N: usize> Work<'_, F, S, N>
where
    F: Fn([f64; N]) -> f64 + Copy + Send,
    S: Fn([f64; N]) -> Status + Copy + Send,
{
    fn run<T: Real>(
        mut self,
        py: Python<'_>,
        tables: [Option<Table<'_, T>>; N],
        mut out: TableMut<'_, T>,
    ) -> PyResult<()> {
        let (rows, columns) = tables.iter().flatten().next().map_or((0, 0), |table| (table.rows(), table.columns()));
        let work = move || -> Result<(), Error> {
            for row in 0..rows {
                worked(columns.max(1) * N);
                let operands: [Operand<'_, T>; N] = std::array::from_fn(|i| match &tables[i] {
                    Some(table) => Operand::Each(table.row(row)),
                    None => Operand::Same(self.numbers[i]),
                });
                each(level(), operands, self.formula, &mut out.row(row))?;
                if let Some(out) = &mut self.status_out {
                    each_status(level(), operands, self.status, &mut out.row(row))?;
                }
            }
            Ok(())
        };
        interruptible(py, rows * columns.max(1) * N, work)?.map_err(value_error)
    }
}
