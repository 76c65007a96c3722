//! From matches to one scale. Each estimator has its own idea of which matches to trust.

use super::consensus::Ransac;
use super::matches::Matches;
use super::pairs::{Ratio, Rule};
use super::similarity::{Centred, Selection};
use super::spread::{Strained, spread};
use super::{mean, median};
use crate::error::{Error, count_in, positive};
use crate::real::Real;
use crate::simd::Level;

/// The most pairs of matches that may be tried. More take seconds and find nothing else.
const MOST_TRIALS: usize = 1_000_000;

/// The way to one scale that survives mismatches and background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimator {
    /// The median of all pairs' ratios.
    MedianRatio,
    /// The mean of the pairs' ratios without this share of the lowest, and of the highest.
    TrimmedMeanRatio(f64),
    /// The scale of the least-squares similarity over all matches. It survives no mismatch.
    LeastSquares,
    /// The least-squares scale of the matches that move as one body, with the strain that they show.
    Consensus {
        /// A match farther than this from where the body puts it, px, does not belong to the body.
        tolerance: f64,
        /// The pairs of matches that are tried.
        trials: usize,
        /// Seed of the random choice of pairs.
        seed: u64,
    },
}

impl Default for Estimator {
    fn default() -> Self {
        // Rounding at the coarsest of eight levels of a pyramid moves a position by up to 1.2^7 px in x and in y.
        Estimator::Consensus { tolerance: 5.0, trials: 200, seed: 0 }
    }
}

/// A scale, and the matches that it rests on.
pub(super) struct Estimate {
    pub scale: f64,
    pub spread: f64,
    pub pairs: usize,
    pub support: usize,
}

impl Estimator {
    /// Returns the estimator if its settings make sense.
    ///
    /// # Errors
    /// When a share is outside [0, 0.5), a tolerance is not above 0 and finite, or nothing is to be tried.
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Estimator::MedianRatio | Estimator::LeastSquares => {}
            Estimator::TrimmedMeanRatio(share) => {
                if !(0.0..0.5).contains(&share) {
                    return Err(Error::new("share", format!("must be at least 0 and below 0.5, got {share:?}")));
                }
            }
            Estimator::Consensus { tolerance, trials, .. } => {
                positive("tolerance", tolerance)?;
                count_in("trials", trials, 1..=MOST_TRIALS)?;
            }
        }
        Ok(self)
    }

    /// The scale; `None` if too few matches or pairs count.
    pub(super) fn estimate<T: Real>(
        self,
        matches: &Matches<T>,
        rule: Rule,
        level: Level,
        threads: usize,
    ) -> Option<Estimate> {
        let every = matches.all();
        let all = Selection { matches, those: &every, level };
        let by = |ratio: Ratio, centred: Option<Centred>| Estimate {
            scale: ratio.ratio,
            spread: spread(all, centred, ratio.ratio),
            pairs: ratio.pairs,
            support: matches.len(),
        };
        Some(match self {
            Estimator::MedianRatio => {
                let centred = Centred::of(all);
                by(median::median(matches, centred, rule, level, threads)?, centred)
            }
            Estimator::TrimmedMeanRatio(share) => by(mean::trimmed(matches, rule, share, level)?, Centred::of(all)),
            Estimator::LeastSquares => {
                let centred = Centred::of(all)?;
                by(Ratio { ratio: centred.similarity().scale(), pairs: 0 }, Some(centred))
            }
            Estimator::Consensus { tolerance, trials, seed } => {
                let agreed = Ransac { tolerance, trials, seed }.inliers(matches, level)?;
                let those = Selection { matches, those: &agreed, level };
                let agreed = matches.those(&agreed);
                let pairs = median::pairs(&agreed, Centred::of(those), rule, level, threads)?;
                let fitted = Strained::fitted(those)?;
                Estimate { scale: fitted.scale(), spread: fitted.spread(), pairs, support: agreed.len() }
            }
        })
    }
}
