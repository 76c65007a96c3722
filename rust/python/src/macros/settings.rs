//! Objects that hold settings, as Python sees them. A class lists its settings once, each with how it is read, and the
//! rest follows from that table: getters, `repr`, pickling and copying by the constructor's keywords, and for values
//! equality and hash.

use crate::util;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// The methods of a class with settings: `settings! { Class |it, py| { name: value, ... } }`, each name a keyword of
/// the constructor. `name: value => default` is left out of `repr` while it has that value. With `value Class` in the
/// place of `Class`, objects with the same settings are equal, and can be hashed.
macro_rules! settings {
    (value $class:ident |$it:ident, $py:ident| { $($table:tt)* }) => {
        $crate::macros::settings! { $class |$it, $py| { $($table)* } }

        #[pymethods]
        impl $class {
            fn __eq__(&self, py: Python<'_>, other: &Self) -> PyResult<bool> {
                $crate::macros::values(py, self.settings(py)?)?.eq($crate::macros::values(py, other.settings(py)?)?)
            }

            fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
                $crate::macros::values(py, self.settings(py)?)?.hash()
            }
        }
    };
    ($class:ident |$it:ident, $py:ident| { $($name:ident: $value:expr $(=> $default:expr)?),* $(,)? }) => {
        #[pymethods]
        impl $class {
            $(#[getter]
            fn $name<'py>(&self, $py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                let $it = self;
                pyo3::IntoPyObjectExt::into_bound_py_any($value, $py)
            })*

            fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, pyo3::types::PyDict>)> {
                Ok(((), $crate::macros::keywords(py, self.settings(py)?)?))
            }

            fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
                $crate::macros::call(stringify!($class), self.settings(py)?)
            }
        }

        impl $class {
            #[allow(unused_variables, reason = "without settings there is nothing to convert")]
            fn settings<'py>(&self, py: Python<'py>) -> PyResult<Vec<$crate::macros::Setting<'py>>> {
                Ok(vec![$($crate::macros::Setting {
                    name: stringify!($name),
                    value: self.$name(py)?,
                    default: [$(pyo3::IntoPyObjectExt::into_bound_py_any($default, py)?)?].into_iter().next(),
                }),*])
            }
        }
    };
}
pub(crate) use settings;

/// A class that is a value of the core, or one variant of it: `settings_class! { Class(name: type = default, ...),
/// "(signature)" => Kind: Kind::Variant { name, ... } }`. What stands last is an expression and a pattern.
macro_rules! settings_class {
    ($(#[$doc:meta])* $class:ident($($name:ident: $type:ty $(= $default:expr)?),*), $signature:literal
            => $kind:ty: $($core:tt)+) => {
        $(#[$doc])*
        #[pyclass(frozen, module = "ttc_fast")]
        #[derive(Clone, Copy)]
        pub struct $class {
            $($name: $type,)*
        }

        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = ($($name $(= $default)?),*), text_signature = $signature)]
            fn new($($name: <$type as $crate::macros::Argument>::Given),*) -> PyResult<Self> {
                let object = $class { $($name: $crate::macros::Argument::checked(stringify!($name), $name)?),* };
                object.core().checked().map_err($crate::util::value_error)?;
                Ok(object)
            }
        }

        $crate::macros::settings! { value $class |it, py| { $($name: it.$name),* } }

        impl $class {
            /// The value of the core.
            pub fn core(self) -> $kind {
                let $class { $($name),* } = self;
                $($core)+
            }

            /// The object for a value of the core, if this is its class.
            pub fn of(core: $kind) -> Option<Self> {
                #[allow(irrefutable_let_patterns, reason = "a struct has one variant")]
                if let $($core)+ = core { Some($class { $($name),* }) } else { None }
            }
        }
    };
}
pub(crate) use settings_class;

/// Two functions for a value of the core that is one of several classes: from the object to the value, and back.
macro_rules! choices {
    ($value:ident, $object:ident: $kind:ty, $wanted:literal { $($class:ident),* }) => {
        /// The value that an object stands for.
        pub fn $value(object: &Bound<'_, PyAny>) -> PyResult<$kind> {
            $(if let Ok(object) = object.cast_exact::<$class>() { // no class has subclasses
                return Ok(object.get().core());
            })*
            let (argument, wanted) = (stringify!($value), $wanted);
            Err(pyo3::exceptions::PyTypeError::new_err(format!("{argument} must be {wanted}, got {object}")))
        }

        /// The object that stands for a value.
        #[allow(dead_code, reason = "not every function gives back what it took")]
        pub fn $object(py: Python<'_>, value: $kind) -> PyResult<Bound<'_, PyAny>> {
            $(if let Some(object) = $class::of(value) {
                return pyo3::IntoPyObjectExt::into_bound_py_any(object, py);
            })*
            unreachable!("each variant has a class")
        }
    };
}
pub(crate) use choices;

/// A setting as Python gives it, and as it is kept.
pub trait Argument: Sized {
    /// What Python gives.
    type Given;
    /// The setting, if what is given can be one.
    fn checked(name: &str, given: Self::Given) -> PyResult<Self>;
}

impl Argument for f64 {
    type Given = f64;
    fn checked(_: &str, given: f64) -> PyResult<Self> {
        Ok(given)
    }
}

impl Argument for usize {
    type Given = i64;
    fn checked(name: &str, given: i64) -> PyResult<Self> {
        usize::try_from(given).or_else(|_| util::count(name, given, 1)) // the core knows where 0 makes sense
    }
}

impl Argument for u64 {
    type Given = i64;
    fn checked(name: &str, given: i64) -> PyResult<Self> {
        util::count(name, given, 0)
    }
}

/// A setting of an object.
pub struct Setting<'py> {
    pub name: &'static str,
    pub value: Bound<'py, PyAny>,
    /// The value that `repr` leaves out, if there is one.
    pub default: Option<Bound<'py, PyAny>>,
}

/// The values, which make two objects equal.
pub fn values<'py>(py: Python<'py>, settings: Vec<Setting<'py>>) -> PyResult<Bound<'py, PyTuple>> {
    PyTuple::new(py, settings.into_iter().map(|setting| setting.value))
}

/// The keywords that make such an object again.
pub fn keywords<'py>(py: Python<'py>, settings: Vec<Setting<'py>>) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    settings.into_iter().try_for_each(|setting| keywords.set_item(setting.name, setting.value))?;
    Ok(keywords)
}

/// The call that makes such an object again. A setting that is None is left out, and a long sequence is cut.
pub fn call(class: &str, settings: Vec<Setting<'_>>) -> PyResult<String> {
    let mut parts = Vec::new();
    for Setting { name, value, default } in settings {
        let long = value.cast::<PyTuple>().ok().filter(|tuple| tuple.len() > LONGEST);
        if let Some(tuple) = long {
            parts.push(format!("{name}=({}, ...)", tuple.get_item(0)?.repr()?));
        } else if !(value.is_none() || default.is_some_and(|default| value.eq(default).unwrap_or(false))) {
            parts.push(format!("{name}={}", value.repr()?));
        }
    }
    Ok(format!("{class}({})", parts.join(", ")))
}

/// A longer sequence is not shown whole.
const LONGEST: usize = 8;
