//! From matches to one scale, each estimator with its own idea of which of them to trust.

use super::consensus::Search;
use super::matches::Matches;
use super::pairs::{Ratio, Rule};
use super::similarity::{Similarity, spread};
use super::{mean, median};
use crate::error::Error;
use crate::real::Real;
use crate::simd::Level;

/// More take seconds, and find nothing else.
const MOST_TRIALS: usize = 1_000_000;

/// How mismatches and background are survived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimator {
    /// The median of all pairs' ratios.
    MedianRatio,
    /// Their mean without this share of the lowest, and of the highest.
    TrimmedMeanRatio(f64),
    /// The similarity of least squares over all matches: survives nothing.
    LeastSquares,
    /// The mean ratio of the matches that move as one body.
    Consensus {
        /// A match farther than this from where it should be, px, does not belong to it.
        tolerance: f64,
        /// How many pairs of matches are tried.
        trials: usize,
        /// Of the random choice of those.
        seed: u64,
    },
}

impl Default for Estimator {
    fn default() -> Self {
        // What rounding can do to a position at the coarsest of eight levels of a pyramid: 1.2^7 px in x and in y.
        Estimator::Consensus { tolerance: 5.0, trials: 200, seed: 0 }
    }
}

/// A scale, and what it rests on.
pub(super) struct Estimate {
    pub scale: f64,
    pub spread: f64,
    pub pairs: usize,
    pub support: usize,
}

impl Estimator {
    /// The estimator, if its settings make sense.
    ///
    /// # Errors
    /// When a share is outside [0, 0.5), a tolerance is not above 0 and finite, or nothing is to be tried.
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Estimator::TrimmedMeanRatio(share) if !(0.0..0.5).contains(&share) => {
                Err(Error::new("share", format!("must be at least 0 and below 0.5, got {share:?}")))
            }
            Estimator::Consensus { tolerance, .. } if !(tolerance > 0.0 && tolerance.is_finite()) => {
                Err(Error::new("tolerance", format!("must be finite and above 0 px, got {tolerance:?}")))
            }
            Estimator::Consensus { trials, .. } if !(1..=MOST_TRIALS).contains(&trials) => {
                Err(Error::new("trials", format!("must be at least 1 and at most {MOST_TRIALS}, got {trials}")))
            }
            _ => Ok(self),
        }
    }

    /// The scale, unless too few matches or pairs count.
    pub(super) fn estimate<T: Real>(
        self,
        matches: &Matches<T>,
        rule: Rule,
        level: Level,
        threads: usize,
    ) -> Option<Estimate> {
        Some(match self {
            Estimator::MedianRatio => resting_on(matches, median::median(matches, rule, level, threads)?),
            Estimator::TrimmedMeanRatio(share) => resting_on(matches, mean::trimmed(matches, rule, share)?),
            Estimator::LeastSquares => {
                let ratio = Similarity::fitted(matches)?.scale();
                resting_on(matches, Ratio { ratio, pairs: 0 })
            }
            Estimator::Consensus { tolerance, trials, seed } => {
                let agreed = Search { tolerance, trials, seed }.agreed(matches, level)?;
                resting_on(&agreed, mean::mean(&agreed, rule, level)?)
            }
        })
    }
}

/// What a ratio of so many matches rests on.
fn resting_on<T: Real>(matches: &Matches<T>, Ratio { ratio, pairs }: Ratio) -> Estimate {
    Estimate { scale: ratio, spread: spread(matches, ratio), pairs, support: matches.len() }
}
