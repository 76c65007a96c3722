//! The Python binding: signatures, arrays to views, results and errors to Python objects. No arithmetic here.

#![allow(clippy::doc_markdown, reason = "docstrings for Python users are numpydoc, not rustdoc")]

mod alignment;
mod array;
mod axes;
mod beams;
mod camera;
mod cloud;
mod cloud_tracker;
mod ego_motion;
mod elementwise;
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
mod nearest_point;
mod number;
mod path;
mod points;
mod range_rate;
mod road;
mod scan;
mod scan_path;
mod settings_object;
mod tracked;
mod tracker;

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
    m.add_class::<nearest_point::NearestPoint>()?;
    m.add_class::<nearest_point::NearestPointBatch>()?;
    m.add_class::<path::SweptPath>()?;
    m.add_class::<scan_path::ScanSweptPath>()?;
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
    for name in [
        wrap_pyfunction!(motion::ttc_constant_velocity, m)?,
        wrap_pyfunction!(motion::ttc_constant_acceleration, m)?,
        wrap_pyfunction!(motion::time_headway, m)?,
        wrap_pyfunction!(motion::deceleration_to_avoid_crash, m)?,
        wrap_pyfunction!(motion::stopping_distance, m)?,
        wrap_pyfunction!(motion::rss_longitudinal_distance, m)?,
    ] {
        m.add_function(name)?;
    }
    m.add_class::<tracker::SlidingLine>()?;
    m.add_class::<tracker::SlidingParabola>()?;
    m.add_class::<tracker::TheilSen>()?;
    m.add_class::<tracker::AlphaBeta>()?;
    m.add_class::<tracker::KalmanCV>()?;
    m.add_class::<tracker::KalmanCA>()?;
    m.add_class::<tracker::EstimatedNoise>()?;
    m.add_class::<tracker::DistanceTracker>()?;
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
