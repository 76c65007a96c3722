//! Settings objects in Python: what they have in common.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// What a settings object of a given name looks like from Python: checked settings, their getters, `repr`, equality and pickling.
macro_rules! settings {
    ($(#[$doc:meta])* $name:ident($($setting:ident: $type:ty $(= $default:expr)?),*), $signature:literal => $kind:ty: $core:expr) => {
        $(#[$doc])*
        #[pyclass(frozen, eq, module = "ttc_fast")]
        #[derive(Clone, Copy, PartialEq)]
        pub struct $name {
            $(#[pyo3(get)] $setting: $type,)*
        }

        #[pymethods]
        #[allow(clippy::trivially_copy_pass_by_ref, reason = "Python hands methods a reference")]
        impl $name {
            #[new]
            #[pyo3(signature = ($($setting $(= $default)?),*), text_signature = $signature)]
            fn new($($setting: <$type as Setting>::Argument),*) -> PyResult<Self> {
                let settings = $name { $($setting: <$type as Setting>::checked(stringify!($setting), $setting)?),* };
                settings.core().checked().map_err($crate::errors::value_error)?;
                Ok(settings)
            }

            fn __repr__(&self) -> String {
                let settings: Vec<String> = vec![$(format!(concat!(stringify!($setting), "={:?}"), self.$setting)),*];
                format!(concat!(stringify!($name), "({})"), settings.join(", "))
            }

            fn __hash__(&self) -> u64 {
                crate::hash(&self.__repr__())
            }

            fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
                let settings: Vec<Bound<'py, PyAny>> = vec![$(self.$setting.into_bound_py_any(py)?),*];
                PyTuple::new(py, settings)
            }
        }

        impl $name {
            pub fn core(&self) -> $kind {
                let $name { $($setting),* } = *self;
                $core
            }
        }
    };
}

pub(crate) use settings;

/// A setting as Python gives it, and as it is kept.
pub trait Setting: Sized {
    /// As Python gives it.
    type Argument;
    /// As it is kept.
    fn checked(name: &str, argument: Self::Argument) -> PyResult<Self>;
}

impl Setting for f64 {
    type Argument = f64;
    fn checked(_: &str, argument: f64) -> PyResult<Self> {
        Ok(argument)
    }
}

impl Setting for usize {
    type Argument = i64;
    fn checked(name: &str, argument: i64) -> PyResult<Self> {
        usize::try_from(argument)
            .map_err(|_| PyValueError::new_err(format!("{name} must be at least 1, got {argument}")))
    }
}

impl Setting for u64 {
    type Argument = i64;
    fn checked(name: &str, argument: i64) -> PyResult<Self> {
        u64::try_from(argument).map_err(|_| PyValueError::new_err(format!("{name} must be at least 0, got {argument}")))
    }
}
