//! The road as a plane, found in a cloud.
//!
//! [`search`] says where to look and what to accept; [`fit`] finds the plane that fits the cloud best; [`fit_road`]
//! decides whether that plane is a road. A [`Gate`](crate::cloud::Gate) can stand on it.

mod fit;
mod search;
mod voxels;

pub use search::RoadSearch;

use crate::cloud::Road;
use crate::error::Error;
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use fit::{Refined, plane};

/// Whether a road was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RoadStatus {
    /// A road was found.
    Found = 0,
    /// There are valid points, and no plane among them passes for a road.
    NotFound = 1,
    /// There is no valid point at all.
    NoData = 2,
}

/// The reason that there is no road.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// There is no valid point at all.
    NoData,
    /// There is no point where a road could be.
    Nothing,
    /// Too little of the plane is seen.
    TooSmall,
    /// The part of the plane that is seen is a strip.
    TooNarrow,
    /// The plane is steeper than allowed.
    TooSteep,
    /// The plane is above the sensor, or too far from where the height of the sensor puts it.
    WrongHeight,
    /// Too much of the ground disagrees.
    Outvoted,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Refusal; 7] = [
        Refusal::NoData,
        Refusal::Nothing,
        Refusal::TooSmall,
        Refusal::TooNarrow,
        Refusal::TooSteep,
        Refusal::WrongHeight,
        Refusal::Outvoted,
    ];

    /// The reason in words.
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

/// The road of a cloud or the reason that there is none, and the patches that this rests on.
///
/// The numbers are those of the best plane, even if it is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadFit {
    /// The road, or the reason that there is none.
    pub road: Result<Road, Refusal>,
    /// The points within the tolerance of the plane, in patches that agree.
    pub inliers: usize,
    /// The patches that agree, of a square metre each.
    pub patches: usize,
    /// The share of all patches that agree; 0 if there are none.
    pub share: f64,
    /// Width of the road that is seen in its narrowest direction, m.
    pub width: f64,
    /// Root mean square of the heights of patches above the plane, m. NaN without a plane.
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

/// Finds the road in a cloud.
///
/// # Errors
/// When the settings make no sense.
pub fn fit_road<T: Real>(points: &Points<'_, T>, search: &RoadSearch, level: Level) -> Result<RoadFit, Error> {
    let search = search.checked()?;
    let Some((Refined { road, inliers, patches, width, rms }, all)) = plane(points, &search, level) else {
        return Ok(RoadFit::nothing(if points.any_valid() { Refusal::Nothing } else { Refusal::NoData }));
    };
    let share = patches as f64 / all as f64;
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
