//! The Python binding: signatures, arrays to views, results and errors to Python objects. No arithmetic here.

#![allow(clippy::doc_markdown, reason = "docstrings for Python users are numpydoc, not rustdoc")]

mod array;
mod camera;
mod cloud;
mod elementwise;
mod estimators;
mod gate;
mod ittc;
mod macros;
mod motion;
mod nearest;
mod path;
mod points;
mod range_rate;
mod road;
mod scan;
mod scan_path;
mod scan_query;
mod trackers;
mod util;

use pyo3::prelude::*;

/// Rust kernels of ``ttc_fast``; import the names from ``ttc_fast`` itself.
#[pymodule(gil_used = false)]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    // NumPy's C interface is looked up once; better now than in the first call of a control loop.
    numpy::dtype::<f32>(m.py());
    m.add("SIMD_LEVEL", util::run::choose_level()?)?;
    m.add("BUILD_PROFILE", env!("TTC_FAST_BUILD_PROFILE"))?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("NoDataError", m.py().get_type::<util::NoDataError>())?;
    m.add_class::<estimators::NeighbourSupport>()?;
    m.add_class::<nearest::Counts>()?;
    m.add_class::<nearest::CountsBatch>()?;
    m.add_class::<nearest::Nearest>()?;
    m.add_class::<nearest::NearestBatch>()?;
    m.add_class::<scan::ScanTTC>()?;
    m.add_class::<range_rate::RangeRate>()?;
    m.add_class::<range_rate::RangeRateNearest>()?;
    m.add_class::<path::NearestPoint>()?;
    m.add_class::<path::NearestPointBatch>()?;
    m.add_class::<path::SweptPath>()?;
    m.add_class::<scan_path::ScanSweptPath>()?;
    m.add_function(wrap_pyfunction!(ittc::ittc, m)?)?;
    m.add_class::<estimators::Minimum>()?;
    m.add_class::<estimators::KthSmallest>()?;
    m.add_class::<estimators::Quantile>()?;
    m.add_class::<estimators::MeanOfLowest>()?;
    m.add_class::<estimators::InterquartileFence>()?;
    m.add_class::<estimators::Supported>()?;
    m.add_class::<estimators::Cluster>()?;
    m.add_class::<gate::Gate>()?;
    m.add_class::<road::Road>()?;
    m.add_class::<road::RoadFit>()?;
    m.add_function(wrap_pyfunction!(road::fit_road, m)?)?;
    m.add_class::<trackers::cloud::Alignment>()?;
    m.add_class::<trackers::cloud::CloudTracker>()?;
    m.add_class::<trackers::TrackedTTC>()?;
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
    m.add_class::<trackers::SlidingLine>()?;
    m.add_class::<trackers::SlidingParabola>()?;
    m.add_class::<trackers::TheilSen>()?;
    m.add_class::<trackers::AlphaBeta>()?;
    m.add_class::<trackers::KalmanCV>()?;
    m.add_class::<trackers::MotionMixture>()?;
    m.add_class::<trackers::KalmanCA>()?;
    m.add_class::<trackers::EstimatedNoise>()?;
    m.add_class::<trackers::distance::DistanceTracker>()?;
    m.add_class::<trackers::scale::ScaleTracker>()?;
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
