//! When to let other Python threads run.

use pyo3::prelude::*;

/// Work on fewer numbers than this is over before releasing the GIL pays.
const WORTH_RELEASING: usize = 1 << 16;

/// Run `work` on so many numbers, without the GIL if it is long.
#[inline(always)]
pub fn release<R: Send>(py: Python<'_>, numbers: usize, work: impl FnOnce() -> R + Send) -> R {
    if numbers >= WORTH_RELEASING { py.detach(work) } else { work() }
}
