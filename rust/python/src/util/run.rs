//! How kernels run: at which instruction-set level, and whether other Python threads run meanwhile.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::OnceLock;
use ttc_fast_core::interrupt::until;
use ttc_fast_core::simd::Level;

const VARIABLE: &str = "TTC_FAST_SIMD";
static CHOSEN: OnceLock<Level> = OnceLock::new();

/// Choose the best level, or the one that the environment lowers it to, when the module is imported; return its name.
pub fn choose_level() -> PyResult<String> {
    let level = match std::env::var(VARIABLE) {
        Err(_) => Level::best(),
        Ok(name) => Level::at_most(&name).ok_or_else(|| {
            PyValueError::new_err(format!(
                "{VARIABLE} must be one of {}, got {name:?}; unset it for the best",
                Level::NAMES.join(", ")
            ))
        })?,
    };
    Ok(CHOSEN.get_or_init(|| level).to_string())
}

/// The chosen level.
pub fn level() -> Level {
    *CHOSEN.get_or_init(Level::best)
}

/// Work on fewer numbers than this is over before releasing the GIL pays.
const WORTH_RELEASING: usize = 1 << 16;

/// Run `work` on `numbers` numbers. If there are many, other Python threads run meanwhile, and a signal whose handler
/// raises, as Ctrl-C does, ends it.
#[inline(always)]
pub fn interruptible<R: Send>(py: Python<'_>, numbers: usize, work: impl FnOnce() -> R + Send) -> PyResult<R> {
    if numbers < WORTH_RELEASING {
        return Ok(work());
    }
    py.detach(|| until(is_interrupted, work)).map_err(|_| PyErr::fetch(py))
}

/// Whether a handler of a signal raised; the error is set then.
fn is_interrupted() -> bool {
    Python::attach(|py| py.check_signals().map_err(|error| error.restore(py)).is_err())
}

/// Run `work` on `numbers` numbers, without the GIL if there are many. It is for what remembers, and runs to its end.
#[inline(always)]
pub fn release<R: Send>(py: Python<'_>, numbers: usize, work: impl FnOnce() -> R + Send) -> R {
    if numbers >= WORTH_RELEASING { py.detach(work) } else { work() }
}
