//! Results as Python sees them. A class lists its fields once, each with its unit, and the rest follows from that
//! table: getters, `repr`, a table for notebooks, equality, hash, pickling, `_asdict` and `_make`.
//!
//! A result keeps the core's struct, and a batch the structs of its rows: a field becomes a Python object or a NumPy
//! array when it is asked for. Two results are equal when all their fields are, where NaN equals NaN and 0.0 equals
//! -0.0.

use crate::util::enums::{self, Member};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArray};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyTuple};
use std::hash::{DefaultHasher, Hash, Hasher};
use ttc_fast_core::Status;

/// The methods of a result: `results! { Class: core::Struct { field "unit", ... } }`. With `Class, Batch of "scan"` in
/// the place of `Class`, those of a batch as well, each row of which is a scan.
macro_rules! results {
    ($class:ident, $batch:ident of $row:literal: $core:ty { $($field:ident $unit:literal),* $(,)? }) => {
        $crate::macros::results! { $class: $core { $($field $unit),* } }
        $crate::macros::batch! { $batch of $class, $row: $core { $($field $unit),* } }
    };
    ($class:ident: $core:ty { $($field:ident $unit:literal),* $(,)? }) => {
        #[pymethods]
        impl $class {
            $(#[getter]
            fn $field<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                $crate::macros::Value::to_python(&self.0.$field, py)
            })*

            #[classmethod]
            fn _make(_class: &Bound<'_, pyo3::types::PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
                type Core = $core;
                let [$($field),*] = $crate::macros::as_many(values)?;
                Ok($class(Core { $($field: $crate::macros::Value::from_python(&$field)?),* }))
            }

            fn __eq__(&self, other: &Self) -> bool {
                $crate::macros::Value::key(&self.0) == $crate::macros::Value::key(&other.0)
            }

            fn __hash__(&self) -> u64 {
                $crate::macros::hash_of($crate::macros::Value::key(&self.0))
            }
        }

        impl $class {
            fn fields<'py>(&self, py: Python<'py>) -> PyResult<Vec<$crate::macros::Field<'py>>> {
                Ok(vec![$($crate::macros::Field::new(stringify!($field), $unit, self.$field(py)?)?),*])
            }
        }

        $crate::macros::fields_shown! { $class, |_result| None }

        impl $crate::macros::Value for $core {
            fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                Ok(Bound::new(py, $class(*self))?.into_any())
            }

            fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
                Ok(object.cast::<$class>()?.get().0)
            }

            fn key(&self) -> impl PartialEq + std::hash::Hash + use<> {
                let key = ();
                $(let key = (key, $crate::macros::Value::key(&self.$field));)*
                key
            }
        }
    };
}
pub(crate) use results;

/// The methods of a batch of results.
macro_rules! batch {
    ($batch:ident of $class:ident, $row:literal: $core:ty { $($field:ident $unit:literal),* }) => {
        #[pymethods]
        impl $batch {
            $(#[getter]
            fn $field<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                $crate::macros::Column::to_column(py, self.0.iter().map(|row| row.$field))
            })*

            #[classmethod]
            fn _make(_class: &Bound<'_, pyo3::types::PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
                type Core = $core;
                let [$($field),*] = $crate::macros::as_many(values)?;
                $(let $field = $crate::macros::Column::from_column(&$field)?;)*
                let rows = $crate::macros::equally_many(&[$($field.len()),*])?;
                Ok($batch(rows.map(|row| Core { $($field: $field[row]),* }).collect()))
            }

            fn __len__(&self) -> usize {
                self.0.len()
            }

            fn __getitem__(&self, index: isize) -> PyResult<$class> {
                $crate::macros::row_at(&self.0, index, $row).map($class)
            }

            fn __eq__(&self, other: &Self) -> bool {
                let keys = |batch: &'_ Self| batch.0.iter().map($crate::macros::Value::key).collect::<Vec<_>>();
                self.0.len() == other.0.len() && keys(self) == keys(other)
            }
        }

        impl $batch {
            fn fields<'py>(&self, py: Python<'py>) -> PyResult<Vec<$crate::macros::Field<'py>>> {
                Ok(vec![$($crate::macros::Field::column(stringify!($field), $unit, self.$field(py)?, &self.0, |row| {
                    $crate::macros::Value::to_python(&row.$field, py)
                })?),*])
            }
        }

        $crate::macros::fields_shown! { $batch, |batch| Some(format!("{} {}s", batch.0.len(), $row)) }

        impl $crate::macros::Column for $core {
            fn to_column(py: Python<'_>, rows: impl ExactSizeIterator<Item = Self>) -> PyResult<Bound<'_, PyAny>> {
                Ok(Bound::new(py, $batch(rows.collect()))?.into_any())
            }

            fn from_column(column: &Bound<'_, PyAny>) -> PyResult<Vec<Self>> {
                Ok(column.cast::<$batch>()?.get().0.clone())
            }
        }
    };
}
pub(crate) use batch;

/// What a result and a batch show of their fields.
macro_rules! fields_shown {
    ($class:ident, |$it:ident| $size:expr) => {
        #[pymethods]
        impl $class {
            fn _asdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
                $crate::macros::as_dict(py, self.fields(py)?)
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
                $crate::macros::reduced(slf, slf.get().fields(slf.py())?)
            }

            fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
                let $it = self;
                Ok($crate::macros::as_text(stringify!($class), $size, &self.fields(py)?))
            }

            fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
                Ok($crate::macros::as_html(stringify!($class), &self.fields(py)?))
            }
        }
    };
}
pub(crate) use fields_shown;

/// The value of a field.
pub trait Value: Sized {
    /// The value as a Python object.
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
    /// The value that a Python object stands for.
    fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self>;
    /// What is compared and hashed.
    fn key(&self) -> impl PartialEq + Hash + use<Self>;
}

/// The values that a field has in the rows of a batch.
pub trait Column: Sized {
    /// The values as an array, or as a batch.
    fn to_column(py: Python<'_>, rows: impl ExactSizeIterator<Item = Self>) -> PyResult<Bound<'_, PyAny>>;
    /// The values that such an array or batch holds.
    fn from_column(column: &Bound<'_, PyAny>) -> PyResult<Vec<Self>>;
}

impl Value for f64 {
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyFloat::new(py, *self).into_any())
    }

    fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        object.extract()
    }

    /// All NaNs are alike, and so are the zeros.
    fn key(&self) -> impl PartialEq + Hash + use<> {
        if self.is_nan() { f64::NAN.to_bits() } else { (self + 0.0).to_bits() }
    }
}

impl Value for Option<[f64; 2]> {
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.map(|[low, high]| (low, high)).into_bound_py_any(py)
    }

    fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        object.extract()
    }

    fn key(&self) -> impl PartialEq + Hash + use<> {
        self.map(|[low, high]| (low.key(), high.key()))
    }
}

/// Whole numbers.
macro_rules! whole {
    ($($kind:ty),*) => { $(
        impl Value for $kind {
            fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.into_bound_py_any(py)
            }

            fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
                object.extract()
            }

            fn key(&self) -> impl PartialEq + Hash + use<> {
                *self
            }
        }
    )* };
}
whole!(u32, usize);

/// The index of what decided, which Python sees as -1 where nothing did.
macro_rules! index {
    ($($kind:ty),*) => { $(
        impl Value for Option<$kind> {
            fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                index_or_none(*self).into_bound_py_any(py)
            }

            fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
                Ok(<$kind>::try_from(object.extract::<i64>()?).ok())
            }

            fn key(&self) -> impl PartialEq + Hash + use<> {
                *self
            }
        }
    )* };
}
index!(u32, usize);

fn index_or_none<T: TryInto<i64>>(index: Option<T>) -> i64 {
    index.and_then(|index| index.try_into().ok()).unwrap_or(-1)
}

impl<T: Member> Value for T {
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        enums::member(py, *self)
    }

    fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        enums::numbered(object.extract()?)
    }

    fn key(&self) -> impl PartialEq + Hash + use<T> {
        self.number()
    }
}

/// Fields that a batch has as an array: what an element of it is, and the way there and back.
macro_rules! arrays {
    ($($kind:ty as $element:ty: $to:expr, $from:expr;)*) => { $(
        impl Column for $kind {
            fn to_column(py: Python<'_>, rows: impl ExactSizeIterator<Item = Self>) -> PyResult<Bound<'_, PyAny>> {
                Ok(PyArray1::from_iter(py, rows.map($to)).into_any())
            }

            fn from_column(column: &Bound<'_, PyAny>) -> PyResult<Vec<Self>> {
                let column = column.cast::<PyArray1<$element>>()?.to_vec()?;
                column.into_iter().map($from).collect()
            }
        }
    )* };
}
arrays! {
    f64 as f64: |number| number, Ok;
    u32 as u32: |number| number, Ok;
    Option<usize> as i64: index_or_none, |index| Ok(usize::try_from(index).ok());
    Status as u8: |status| status as u8, |number| enums::numbered(number.into());
}

/// A field of one result or batch.
pub struct Field<'py> {
    name: &'static str,
    unit: &'static str,
    value: Bound<'py, PyAny>,
    shown: String,
}

impl<'py> Field<'py> {
    /// The field of a result.
    pub fn new(name: &'static str, unit: &'static str, value: Bound<'py, PyAny>) -> PyResult<Self> {
        let shown = shown(&value, unit)?;
        Ok(Field { name, unit, value, shown })
    }

    /// The field of a batch, which is `value`, and shows that of the first and last rows.
    pub fn column<R>(
        name: &'static str,
        unit: &'static str,
        value: Bound<'py, PyAny>,
        rows: &[R],
        of: impl Fn(&R) -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        if !value.is_instance_of::<PyUntypedArray>() {
            return Field::new(name, unit, value);
        }
        let ends = |rows: &[R]| rows.iter().map(|row| shown(&of(row)?, unit)).collect::<PyResult<Vec<_>>>();
        let parts = if rows.len() <= 2 * SHOWN {
            ends(rows)?
        } else {
            [ends(&rows[..SHOWN])?, vec![String::from("...")], ends(&rows[rows.len() - SHOWN..])?].concat()
        };
        Ok(Field { name, unit, value, shown: format!("[{}]", parts.join(", ")) })
    }

    /// Whether `repr` says it: not what is missing or empty.
    fn is_said(&self) -> bool {
        !(self.value.is_none() || self.shown == "''")
    }
}

/// So many rows of a batch are shown at each end.
const SHOWN: usize = 3;

/// A value as text: a float with 4 digits after the point, or 6 if it has no unit, and a member of an enum by its name.
fn shown(value: &Bound<'_, PyAny>, unit: &str) -> PyResult<String> {
    if let Ok(number) = value.cast::<PyFloat>() {
        let digits = if unit.is_empty() { 6 } else { 4 };
        Ok(format!("{:.digits$}", number.value()))
    } else if let Ok(tuple) = value.cast::<PyTuple>() {
        let parts = tuple.iter().map(|part| shown(&part, unit)).collect::<PyResult<Vec<_>>>()?;
        Ok(format!("({})", parts.join(", ")))
    } else if value.is_instance_of::<PyInt>() && value.hasattr("name")? {
        value.getattr("name")?.extract()
    } else {
        Ok(value.repr()?.to_string())
    }
}

/// `_asdict`.
pub fn as_dict<'py>(py: Python<'py>, fields: Vec<Field<'py>>) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    fields.into_iter().try_for_each(|field| dict.set_item(field.name, field.value))?;
    Ok(dict)
}

/// `__reduce__`: the class's `_make`, and the values that it takes.
pub fn reduced<'py>(object: &Bound<'py, PyAny>, fields: Vec<Field<'py>>) -> PyResult<Bound<'py, PyAny>> {
    let values = PyTuple::new(object.py(), fields.into_iter().map(|field| field.value))?;
    (object.get_type().getattr("_make")?, (values,)).into_bound_py_any(object.py())
}

/// `__repr__`.
pub fn as_text(class: &str, size: Option<String>, fields: &[Field<'_>]) -> String {
    let said = fields.iter().filter(|field| field.is_said());
    let parts: Vec<String> =
        size.into_iter().chain(said.map(|field| format!("{}={}", field.name, field.shown))).collect();
    format!("{class}({})", parts.join(", "))
}

/// `_repr_html_`: a table of names, values and units.
pub fn as_html(class: &str, fields: &[Field<'_>]) -> String {
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
    let row = |Field { name, unit, shown, .. }: &Field<'_>| {
        format!("<tr><th>{name}</th><td>{}</td><td>{unit}</td></tr>", escaped(shown))
    };
    format!("<table><caption>{class}</caption>{}</table>", fields.iter().map(row).collect::<String>())
}

/// The values for `_make`, one for each field.
pub fn as_many<'py, const N: usize>(values: &Bound<'py, PyAny>) -> PyResult<[Bound<'py, PyAny>; N]> {
    let values = values.try_iter()?.collect::<PyResult<Vec<_>>>()?;
    <[_; N]>::try_from(values).map_err(|values| {
        PyValueError::new_err(format!("values must be {N}, one for each field, got {}", values.len()))
    })
}

/// The rows of columns that are all of one length.
pub fn equally_many(lengths: &[usize]) -> PyResult<std::ops::Range<usize>> {
    match lengths {
        [first, others @ ..] if others.iter().all(|length| length == first) => Ok(0..*first),
        _ => Err(PyValueError::new_err("values must be columns of one length")),
    }
}

/// Row `index` of a batch, counted from its end if it is negative.
pub fn row_at<R: Copy>(rows: &[R], index: isize, row: &str) -> PyResult<R> {
    let from_start = if index < 0 { index + rows.len().cast_signed() } else { index };
    let found = usize::try_from(from_start).ok().and_then(|index| rows.get(index)).copied();
    found.ok_or_else(|| PyIndexError::new_err(format!("{row} {index} of a batch of {}", rows.len())))
}

/// `__hash__`.
pub fn hash_of(key: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    key.hash(&mut hasher);
    hasher.finish()
}
