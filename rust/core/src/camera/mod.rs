//! Time-to-collision from how a thing grows in the picture, with no distance at all.
//!
//! [`matches`] says which matched keypoints count, [`pairs`] which pairs of them do. [`median`] is the exact median of the
//! pairs' ratios: [`bracket`], [`tiles`] and [`count`] find it where ratios differ, [`ties`] where many are the same. [`mean`],
//! [`similarity`] and [`consensus`] are other ways to one scale, [`scale`] makes a time of it.

mod bracket;
mod consensus;
mod count;
mod estimator;
mod matches;
mod mean;
mod median;
mod pairs;
mod scale;
mod search;
mod similarity;
mod strips;
mod ties;
mod tiles;
mod undecided;

pub use estimator::Estimator;
pub use matches::Keypoints;
pub use scale::{ttc_from_heights, ttc_from_scale};

use crate::error::elapsed;
use crate::error::{Error, non_negative};
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use estimator::Estimate;
use matches::Matches;
use pairs::Rule;

/// Time-to-collision from matched keypoints, and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointTtc {
    /// s; infinite where nothing closes or too little is known.
    pub ttc: f64,
    /// What it means.
    pub status: Status,
    /// How many times as large the thing looks now. NaN without one.
    pub scale: f64,
    /// Standard error of the scale. NaN with fewer than three matches.
    pub spread: f64,
    /// Ratios of distances that the scale rests on; 0 for an estimator that needs none.
    pub pairs: usize,
    /// Matches that count.
    pub matches: usize,
    /// How many of them stand behind the scale.
    pub support: usize,
}

/// Time-to-collision by keypoints matched between two pictures taken `dt` seconds apart.
///
/// # Errors
/// When `dt` is not a time, the distance or the estimator's settings make no sense, or there are not as many positions now as
/// before.
pub fn ttc_from_keypoints<T: Real>(
    keypoints: Keypoints<'_, T>,
    dt: f64,
    min_distance: f64,
    estimator: Estimator,
    level: Level,
    threads: usize,
) -> Result<KeypointTtc, Error> {
    elapsed(dt)?;
    let rule = Rule::new(non_negative("min_distance", min_distance)?);
    let estimator = estimator.checked()?;
    let matches = Matches::gather(keypoints)?;
    let nothing = KeypointTtc {
        ttc: f64::INFINITY,
        status: Status::NoData,
        scale: f64::NAN,
        spread: f64::NAN,
        pairs: 0,
        matches: matches.len(),
        support: 0,
    };
    if matches.is_empty() {
        return Ok(nothing);
    }
    let Some(Estimate { scale, spread, pairs, support }) = estimator.estimate(&matches, rule, level, threads) else {
        return Ok(KeypointTtc { status: Status::TooFew, ..nothing });
    };
    let ttc = scale::time(scale, dt);
    let status = if ttc < f64::INFINITY { Status::Closing } else { Status::NotClosing };
    Ok(KeypointTtc { ttc, status, scale, spread, pairs, support, ..nothing })
}
