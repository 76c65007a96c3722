//! The Python binding: signatures, arrays to views, results and errors to Python objects. No arithmetic here.

#![allow(clippy::doc_markdown, reason = "docstrings for Python users are numpydoc, not rustdoc")]

mod alignment;
mod array;
mod axes;
mod camera;
mod cloud;
mod cloud_tracker;
mod enums;
mod errors;
mod estimator;
mod gate;
mod gil;
mod ittc;
mod level;
mod minimum;
mod motion;
mod nearest;
mod points;
mod range_rate;
mod road;
mod scan;
mod settings;
mod tracked;

use pyo3::prelude::*;

/// Rust kernels of ``ttc_fast``; import the names from ``ttc_fast`` itself.
#[pymodule(gil_used = false)]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    // NumPy's C interface is looked up once; better now than in the first call of a control loop.
    numpy::dtype::<f32>(m.py());
    m.add("SIMD_LEVEL", level::choose()?)?;
    m.add("NoDataError", m.py().get_type::<errors::NoDataError>())?;
    m.add_class::<minimum::NeighbourSupport>()?;
    m.add_class::<nearest::Counts>()?;
    m.add_class::<nearest::CountsBatch>()?;
    m.add_class::<nearest::Nearest>()?;
    m.add_class::<nearest::NearestBatch>()?;
    m.add_class::<scan::ScanTTC>()?;
    m.add_class::<range_rate::RangeRate>()?;
    m.add_class::<range_rate::RangeRateNearest>()?;
    m.add_function(wrap_pyfunction!(ittc::ittc, m)?)?;
    m.add_class::<estimator::Minimum>()?;
    m.add_class::<estimator::KthSmallest>()?;
    m.add_class::<estimator::Quantile>()?;
    m.add_class::<estimator::MeanOfLowest>()?;
    m.add_class::<estimator::InterquartileFence>()?;
    m.add_class::<estimator::Supported>()?;
    m.add_class::<estimator::Cluster>()?;
    m.add_class::<gate::Gate>()?;
    m.add_class::<road::Road>()?;
    m.add_class::<road::RoadFit>()?;
    m.add_function(wrap_pyfunction!(road::fit_road, m)?)?;
    m.add_class::<alignment::Alignment>()?;
    m.add_class::<cloud_tracker::CloudTracker>()?;
    m.add_class::<tracked::TrackedTTC>()?;
    m.add_class::<cloud::MinX>()?;
    m.add_class::<cloud::CloudTTC>()?;
    m.add_function(wrap_pyfunction!(cloud::robust_min_x, m)?)?;
    m.add_function(wrap_pyfunction!(cloud::ttc_from_distances, m)?)?;
    m.add_function(wrap_pyfunction!(cloud::ttc_from_clouds, m)?)?;
    m.add_class::<camera::MedianRatio>()?;
    m.add_class::<camera::TrimmedMeanRatio>()?;
    m.add_class::<camera::LeastSquares>()?;
    m.add_class::<camera::Consensus>()?;
    m.add_class::<camera::KeypointTTC>()?;
    m.add_function(wrap_pyfunction!(camera::ttc_from_scale, m)?)?;
    m.add_function(wrap_pyfunction!(camera::ttc_from_heights, m)?)?;
    m.add_function(wrap_pyfunction!(camera::ttc_from_keypoints, m)?)?;
    Ok(())
}

/// Hash of a settings object, by what it looks like. Equal settings look alike but for the sign of a zero.
fn hash(repr: &str) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    repr.replace("-0.0", "0.0").hash(&mut hasher);
    hasher.finish()
}

/// `threads=...`.
fn threads(threads: i64) -> PyResult<usize> {
    usize::try_from(threads).ok().filter(|threads| (1..=MOST_THREADS).contains(threads)).ok_or_else(|| {
        let problem = format!("threads must be at least 1 and at most {MOST_THREADS}, got {threads}");
        pyo3::exceptions::PyValueError::new_err(problem)
    })
}

/// More than any machine has.
const MOST_THREADS: usize = 1024;
