//! Time-to-collision from how a thing grows in the picture, with no distance at all.
//!
//! [`matches`] says which matched keypoints count. An [`estimator`] makes one scale of them: [`median`] is the exact
//! median of all pairs' ratios, with [`ties`] where many are equal; [`mean`] is their mean; [`similarity`] is a fit to
//! all matches, and [`consensus`] finds the matches that move as one body. [`pairs`] goes through all pairs, sixteen at
//! a time, and [`residuals`] compares their ratios in float32. [`spread`] is the standard error of the scale.

mod consensus;
mod estimator;
mod matches;
mod mean;
mod median;
mod pairs;
mod residuals;
mod shifts;
mod similarity;
mod spread;
mod ties;

pub use estimator::Estimator;
pub use matches::Keypoints;

use crate::error::{Error, elapsed, non_negative, positive};
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use estimator::Estimate;
use matches::Matches;
use pairs::Rule;

/// Time-to-collision from the size of a thing in the picture over its size `dt` seconds before, s.
///
/// It is `dt / (scale - 1)`, and infinite when the thing does not grow.
///
/// # Errors
/// When the scale is not finite and above 0, or `dt` is not a time.
pub fn ttc_from_scale(scale: f64, dt: f64) -> Result<f64, Error> {
    positive("scale", scale).map_err(|error| error.hint("it is the size now over the size before"))?;
    elapsed(dt)?;
    Ok(time(scale, dt))
}

/// Time-to-collision from two heights of one thing in the picture, `dt` seconds apart, s.
///
/// It is `previous dt / (current - previous)`, and infinite when the thing does not grow.
///
/// # Errors
/// When a height is not finite and above 0, or `dt` is not a time.
pub fn ttc_from_heights(previous: f64, current: f64, dt: f64) -> Result<f64, Error> {
    for (argument, height) in [("previous", previous), ("current", current)] {
        positive(argument, height).map_err(|error| error.hint("it is the height of a thing that is seen, px"))?;
    }
    elapsed(dt)?;
    let grown = current - previous;
    Ok(if grown <= 0.0 { f64::INFINITY } else { previous * (dt / grown) })
}

/// Half a 90 % interval in standard deviations of a normal number.
const QUANTILE: f64 = 1.644_853_626_951_472_6;

/// The time for a scale that is a number.
fn time(scale: f64, dt: f64) -> f64 {
    if scale <= 1.0 { f64::INFINITY } else { dt / (scale - 1.0) }
}

/// Time-to-collision from matched keypoints, and the scale that it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointTtc {
    /// Time-to-collision, s; infinite where nothing closes or too little is known.
    pub ttc: f64,
    /// What the numbers mean.
    pub status: Status,
    /// The size in the picture now over the size before. NaN without a scale.
    pub scale: f64,
    /// The standard error of the scale. NaN with fewer than three matches.
    pub spread: f64,
    /// Lower and upper end of the 90 % interval, s, in [0, inf]. `None` without a spread.
    pub ttc_interval: Option<[f64; 2]>,
    /// The number of pairs in support that count; 0 for an estimator that asks for none.
    pub pairs: usize,
    /// The number of matches that count.
    pub matches: usize,
    /// The number of matches that stand behind the scale.
    pub support: usize,
}

/// Time-to-collision from keypoints matched between two pictures taken `dt` seconds apart.
///
/// # Errors
/// When `dt` is not a time, the distance or the estimator's settings make no sense, or the numbers of positions differ.
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
        ttc_interval: None,
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
    let ttc = time(scale, dt);
    let status = if ttc < f64::INFINITY { Status::Closing } else { Status::NotClosing };
    let half = QUANTILE * spread;
    let ttc_interval = (!half.is_nan()).then(|| [time(scale + half, dt), time(scale - half, dt)]);
    Ok(KeypointTtc { ttc, status, scale, spread, ttc_interval, pairs, support, ..nothing })
}

#[cfg(test)]
mod tests {
    use super::{ttc_from_heights, ttc_from_scale};

    #[test]
    fn growing_standing_shrinking() {
        assert!((ttc_from_scale(1.05, 0.1).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(ttc_from_scale(1.0, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_scale(0.5, 0.1).unwrap(), f64::INFINITY);
        assert!((ttc_from_heights(100.0, 105.0, 0.1).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(ttc_from_heights(105.0, 105.0, 0.1).unwrap(), f64::INFINITY);
        assert!(ttc_from_scale(0.0, 0.1).is_err());
        assert!(ttc_from_heights(0.0, 105.0, 0.1).is_err());
        assert!(ttc_from_heights(100.0, 105.0, 0.0).is_err());
    }
}
