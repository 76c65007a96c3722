//! The Python binding: signatures, arrays to views, results and errors to Python objects. No arithmetic here.

#![allow(clippy::doc_markdown, reason = "docstrings for Python users are numpydoc, not rustdoc")]

mod array;
mod errors;
mod ittc;
mod level;
mod minimum;
mod motion;
mod nearest;
mod scan;

use pyo3::prelude::*;

/// Rust kernels of ``ttc_fast``; import the names from ``ttc_fast`` itself.
#[pymodule(gil_used = false)]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("SIMD_LEVEL", level::choose()?)?;
    m.add("NoDataError", m.py().get_type::<errors::NoDataError>())?;
    m.add_class::<minimum::KthSmallest>()?;
    m.add_class::<minimum::NeighbourSupport>()?;
    m.add_class::<nearest::Counts>()?;
    m.add_class::<nearest::CountsBatch>()?;
    m.add_class::<nearest::Nearest>()?;
    m.add_class::<nearest::NearestBatch>()?;
    m.add_class::<scan::ScanTTC>()?;
    m.add_function(wrap_pyfunction!(ittc::ittc, m)?)?;
    Ok(())
}
