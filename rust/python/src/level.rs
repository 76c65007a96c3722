//! The instruction-set level, chosen once when the module is imported.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::OnceLock;
use ttc_fast_core::simd::Level;

const VARIABLE: &str = "TTC_FAST_SIMD";
static CHOSEN: OnceLock<Level> = OnceLock::new();

/// Choose the best level, or the one that the environment lowers it to; gives its name.
pub fn choose() -> PyResult<String> {
    let level = match std::env::var(VARIABLE) {
        Err(_) => Level::best(),
        Ok(name) => Level::at_most(&name).ok_or_else(|| {
            PyValueError::new_err(format!(
                "{VARIABLE} must be baseline, avx2 or avx512, got {name:?}; unset it for the best"
            ))
        })?,
    };
    Ok(CHOSEN.get_or_init(|| level).to_string())
}

/// The chosen level.
pub fn current() -> Level {
    *CHOSEN.get_or_init(Level::best)
}
