//! The robust nearest distance ahead in a point cloud.
//!
//! [`gate`] says which points count, [`candidates`] finds those, [`estimator`]
//! makes one distance of them, [`shrinking`]
//! a time of two. [`road`] is what a gate may stand on.

mod alignment;
mod candidates;
mod cluster;
mod collect;
mod estimator;
mod gate;
mod kept;
mod order;
mod road;
mod shrinking;
mod tracker;
mod tree;

use candidates::{Candidates, Estimate};
pub use {
    alignment::{Alignment, Cell, Profile, Sighting, Trend, trend},
    estimator::Estimator,
    gate::{Axis, Gate, Interval, REP_103},
    road::{Refusal, Road, RoadFit, RoadSearch, RoadStatus, fit_road},
    shrinking::{CloudTtc, ttc_from_clouds},
    tracker::{Body, CloudSettings, CloudTrack, CloudTracker},
};

use crate::error::Error;
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;

/// What was found in a cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Detection {
    /// Something is ahead, and the estimator vouches for it.
    Found = 0,
    /// There are valid points, and none inside the gate.
    Clear = 1,
    /// There are candidates, but too few for the estimator.
    TooFew = 2,
    /// There is no valid point at all.
    NoData = 3,
}

/// The robust nearest distance ahead, and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinX {
    /// The estimate, m. NaN when there are too few candidates or no data, infinite when clear.
    pub x: f64,
    /// The plain nearest candidate, m. Infinite when clear, NaN without data.
    pub nearest_x: f64,
    /// Points inside the gate.
    pub candidates: usize,
    /// How many of them stand behind the estimate.
    pub support: usize,
    /// The point that the estimate is, if it is one.
    pub index: Option<u32>,
    /// What was found.
    pub detection: Detection,
}

/// The robust nearest distance ahead of the points inside a gate, looked for by up to `threads` threads.
///
/// # Errors
/// When the gate or the estimator makes no sense, or the gate bounds an intensity that the points lack.
pub fn robust_min_x<T: Real>(
    points: Points<'_, T>,
    gate: &Gate,
    estimator: Estimator,
    level: Level,
    threads: usize,
) -> Result<MinX, Error> {
    gate.check()?;
    let estimator = estimator.checked()?;
    gate::check_intensity(gate, &points)?;
    let Candidates { count, mut kept, .. } = Candidates::gather(points, gate, estimator.wanted(), level, threads);
    let nothing =
        MinX { x: f64::NAN, nearest_x: f64::NAN, candidates: 0, support: 0, index: None, detection: Detection::NoData };
    if kept.len() == 0 {
        let clear = MinX { x: f64::INFINITY, nearest_x: f64::INFINITY, detection: Detection::Clear, ..nothing };
        return Ok(if points.any_valid() { clear } else { nothing });
    }
    let seen = MinX { nearest_x: kept.least(level).to_f64(), candidates: count, ..nothing };
    Ok(match estimator.estimate(&mut kept, &points, gate, level) {
        None => MinX { detection: Detection::TooFew, ..seen },
        Some(Estimate { x, index, support }) => MinX { x, index, support, detection: Detection::Found, ..seen },
    })
}
