//! The mean of the pairs' ratios without the lowest and the highest.
//!
//! It is that of all pairs, or of a sample of them where there are many more pairs than matches. Each of the sample's
//! pairs has errors of two matches, and a match is in so many of the pairs that its error is as small as it would be in
//! all: the standard error of the mean is larger by less than a hundredth.

use super::matches::{Matches, widened};
use super::pairs::{Bracket, Ratio, Rule};
use super::shifts::{Inside, Shifts, group, nth};
use crate::lanes::{LANES, sum};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// A sample has this many pairs for each match, each of which is in twice as many.
const SHIFTS: usize = 64;

/// The mean without a share of the lowest ratios and the same share of the highest; `None` if no pair counts.
///
/// The number of pairs in the result is that of the ratios that are left.
pub(super) fn trimmed<T: Real>(matches: &Matches<T>, rule: Rule, share: f64, level: Level) -> Option<Ratio> {
    let quotients = Shifts::new(&matches.map(widened)).values(rule, SHIFTS, level);
    let count = quotients.len();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "share is in [0, 0.5)")]
    let cut = (share * count as f64) as usize;
    let pairs = count.checked_sub(2 * cut).filter(|left| *left > 0)?;
    let (low, high) = (nth(&quotients, cut, level), nth(&quotients, count - 1 - cut, level));
    if low == high {
        return Some(Ratio { ratio: low.sqrt(), pairs });
    }
    let (below, inside) = level.run(Inside { values: &quotients, bracket: Bracket { low, high } });
    // Of the ratios equal to an end, some are cut off.
    let low_cut = cut - below;
    let high_cut = inside.len() - pairs - low_cut;
    let sum = level.run(Roots(&inside)) - low_cut as f64 * low.sqrt() - high_cut as f64 * high.sqrt();
    Some(Ratio { ratio: sum / pairs as f64, pairs })
}

/// Adds up the roots of numbers, lane by lane, so that the sum does not depend on the level.
struct Roots<'a>(&'a [f64]);

impl Kernel for Roots<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) -> f64 {
        let mut roots = [0.0; LANES];
        for at in (0..self.0.len()).step_by(LANES) {
            let x = group(self.0, at);
            for lane in 0..LANES {
                roots[lane] += if x[lane] > 0.0 { x[lane].sqrt() } else { 0.0 };
            }
        }
        sum(roots)
    }
}
