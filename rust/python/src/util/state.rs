//! What remembers, and how it is kept: the class and the version of a state, and a lock that waits.

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What a class calls the states that it gives.
pub struct Format {
    pub class: &'static str,
    /// Raised when the contents of a state change.
    pub version: u32,
}

impl Format {
    /// A new state, with its class and version.
    pub fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let state = PyDict::new(py);
        state.set_item("class", self.class)?;
        state.set_item("version", self.version)?;
        Ok(state)
    }

    /// `state` as a dict, if it is of this class and version.
    pub fn check<'a, 'py>(&self, state: &'a Bound<'py, PyAny>) -> PyResult<&'a Bound<'py, PyDict>> {
        let Format { class, version } = self;
        let Ok(dict) = state.cast::<PyDict>() else {
            let problem = format!("state must be a dict that the state() of a {class} gave, got {state}");
            return Err(PyTypeError::new_err(problem));
        };
        for (key, expected) in
            [("class", class.into_bound_py_any(state.py())?), ("version", version.into_bound_py_any(state.py())?)]
        {
            let got = item(dict, key)?;
            if !got.eq(&expected)? {
                return Err(PyValueError::new_err(format!("state must be of {key} {expected}, got {got}")));
            }
        }
        Ok(dict)
    }
}

/// An item of a state.
pub fn item<'py>(state: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    state
        .get_item(name)?
        .ok_or_else(|| PyValueError::new_err(format!("state has no {name}: it must come from state()")))
}

/// What is behind the lock. A call waits for the one before, and lets other Python threads run while it waits.
pub fn lock<'a, T>(py: Python<'_>, mutex: &'a Mutex<T>) -> MutexGuard<'a, T> {
    // No code of the caller's runs while the lock is held, and no panic leaves a change half done.
    mutex.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
}
