//! The road as a plane, and how it is found in a cloud.
//!
//! A cloud is boiled down to [`stacks`] of voxels in one pass; these [`vote`] for a coarse plane, which [`refine`] fits to
//! them. [`search`] says where to look and what to accept.

mod refine;
mod search;
mod stacks;
mod vote;

pub use search::RoadSearch;

use crate::error::{Error, finite};
use crate::points::Points;
use crate::real::Real;
use refine::Refined;

/// A plane `z = slope_x x + slope_y y + offset` in the vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Road {
    /// Rise per metre forward.
    pub slope_x: f64,
    /// Rise per metre to the left.
    pub slope_y: f64,
    /// Height at the origin, m; about minus the height of the sensor.
    pub offset: f64,
}

impl Road {
    /// The road, if its numbers are finite.
    ///
    /// # Errors
    /// When one is not.
    pub fn checked(self) -> Result<Self, Error> {
        finite("slope_x", self.slope_x)?;
        finite("slope_y", self.slope_y)?;
        finite("offset", self.offset)?;
        Ok(self)
    }

    /// Height of a point above the road, m.
    #[inline(always)]
    #[must_use]
    pub fn height(&self, x: f64, y: f64, z: f64) -> f64 {
        z - (self.slope_x * x + self.slope_y * y + self.offset)
    }
}

/// Whether a road was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RoadStatus {
    /// There is one.
    Found = 0,
    /// There are valid points, and no plane among them passes for a road.
    NotFound = 1,
    /// There is no valid point at all.
    NoData = 2,
}

/// Why there is no road.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// No valid point at all.
    NoData,
    /// No point where a road could be.
    Nothing,
    /// Too little of it is seen.
    TooSmall,
    /// What is seen of it is a strip.
    TooNarrow,
    /// Steeper than allowed.
    TooSteep,
    /// Above the sensor, or too far above or below where the sensor's height puts it.
    WrongHeight,
    /// Too much of the ground disagrees.
    Outvoted,
}

impl Refusal {
    /// In words.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Refusal::NoData => "no valid point",
            Refusal::Nothing => "no point where a road could be",
            Refusal::TooSmall => "fewer than min_patches of it are seen",
            Refusal::TooNarrow => "what is seen of it is narrower than min_width",
            Refusal::TooSteep => "steeper than max_slope",
            Refusal::WrongHeight => "above the sensor, or farther than height_tolerance from sensor_height",
            Refusal::Outvoted => "less than min_share of the patches agree",
        }
    }
}

/// The road of a cloud, or why there is none, and what that rests on.
///
/// The numbers are those of the best plane, also when it is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadFit {
    /// The road.
    pub road: Result<Road, Refusal>,
    /// Points within the tolerance of it, in patches that agree.
    pub inliers: usize,
    /// Patches that agree, of a square metre each.
    pub patches: usize,
    /// How many of all patches that is; 0 if there are none.
    pub share: f64,
    /// Of the strip of road that is seen, m.
    pub width: f64,
    /// Root mean square of the heights of patches above it, m. NaN without a plane.
    pub rms: f64,
}

impl RoadFit {
    /// Whether a road was found.
    #[must_use]
    pub fn status(&self) -> RoadStatus {
        match self.road {
            Ok(_) => RoadStatus::Found,
            Err(Refusal::NoData) => RoadStatus::NoData,
            Err(_) => RoadStatus::NotFound,
        }
    }

    fn nothing(refusal: Refusal) -> Self {
        RoadFit { road: Err(refusal), inliers: 0, patches: 0, share: 0.0, width: 0.0, rms: f64::NAN }
    }
}

/// Find the road in a cloud.
///
/// # Errors
/// When the settings make no sense.
pub fn fit_road<T: Real>(points: &Points<'_, T>, search: &RoadSearch) -> Result<RoadFit, Error> {
    let search = search.checked()?;
    let stacks = stacks::gather(points, &search);
    if stacks.is_empty() {
        return Ok(RoadFit::nothing(if points.any_valid() { Refusal::Nothing } else { Refusal::NoData }));
    }
    let coarse = vote::elect(&stacks, &search);
    let Refined { road, inliers, patches, width, rms } = refine::refine(&stacks, coarse, &search);
    let share = patches as f64 / stacks.len() as f64;
    let refusal = if patches < search.min_patches {
        Some(Refusal::TooSmall)
    } else if width < search.min_width {
        Some(Refusal::TooNarrow)
    } else if road.slope_x.abs().max(road.slope_y.abs()) > search.max_slope {
        Some(Refusal::TooSteep)
    } else if road.offset >= 0.0 || (road.offset + search.sensor_height).abs() > search.height_tolerance {
        Some(Refusal::WrongHeight)
    } else if share < search.min_share {
        Some(Refusal::Outvoted)
    } else {
        None
    };
    Ok(RoadFit { road: refusal.map_or(Ok(road), Err), inliers, patches, share, width, rms })
}
