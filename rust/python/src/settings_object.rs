//! Objects that hold settings, as Python sees them: one macro, so that all behave alike.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A setting as Python gives it, and as it is kept.
pub trait Setting: Sized {
    type Argument;
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

/// What an object with settings looks like from Python: checked settings, their getters, `repr`, equality and pickling.
macro_rules! settings_object {
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
            fn new($($setting: <$type as $crate::settings_object::Setting>::Argument),*) -> PyResult<Self> {
                let object = $name { $($setting: <$type as $crate::settings_object::Setting>::checked(stringify!($setting), $setting)?),* };
                object.core().checked().map_err($crate::errors::value_error)?;
                Ok(object)
            }

            fn __repr__(&self) -> String {
                let settings: Vec<String> = vec![$(format!(concat!(stringify!($setting), "={:?}"), self.$setting)),*];
                format!(concat!(stringify!($name), "({})"), settings.join(", "))
            }

            fn __hash__(&self) -> u64 {
                crate::hash(&self.__repr__())
            }

            fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyTuple>> {
                #[allow(unused_imports, reason = "an object without settings converts none")]
                use pyo3::IntoPyObjectExt;
                let settings: Vec<Bound<'py, PyAny>> = vec![$(self.$setting.into_bound_py_any(py)?),*];
                pyo3::types::PyTuple::new(py, settings)
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
pub(crate) use settings_object;
