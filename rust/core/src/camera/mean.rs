//! The mean of the pairs' ratios without the lowest and the highest.
//!
//! It is that of all pairs, or of a sample of them where there are many more pairs than matches. Each of the sample's
//! pairs has errors of two matches, and a match is in so many of the pairs that its error is as small as it would be in
//! all: the standard error of the mean is larger by less than a hundredth.

use super::matches::{Matches, widened};
use super::pairs::{Bracket, Ratio, Rule};
use super::shifts::{Shifts, group, nth};
use crate::lanes::LANES;
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
    let between = level.run(Between { quotients: &quotients, ends: Bracket { low, high } });
    // Of the ratios equal to an end, some are cut off.
    let [at_low, at_high] = [between.above_low, between.below_high].map(|others| (count - others - cut) as f64);
    let sum = between.roots + at_low * low.sqrt() + at_high * high.sqrt();
    Some(Ratio { ratio: sum / pairs as f64, pairs })
}

/// Adds up the roots of the quotients strictly between two ends, lane by lane, so that the sum does not depend on the
/// level.
struct Between<'a> {
    quotients: &'a [f64],
    ends: Bracket,
}

/// The sum of roots, and the numbers of quotients strictly on one side of each end.
struct Sides {
    roots: f64,
    above_low: usize,
    below_high: usize,
}

impl Kernel for Between<'_> {
    type Output = Sides;

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) -> Sides {
        let Between { quotients, ends: Bracket { low, high } } = self;
        let [mut roots, mut above_low, mut below_high] = [[0.0; LANES]; 3];
        for at in (0..quotients.len()).step_by(LANES) {
            let x = group(quotients, at);
            for lane in 0..LANES {
                let (is_above, is_below) = (x[lane] > low, x[lane] < high);
                roots[lane] += if is_above & is_below { x[lane].sqrt() } else { 0.0 };
                above_low[lane] += if is_above { 1.0 } else { 0.0 };
                below_high[lane] += if is_below { 1.0 } else { 0.0 };
            }
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count, exact below 2^53")]
        let [above_low, below_high] = [above_low, below_high].map(|counts| counts.iter().sum::<f64>() as usize);
        Sides { roots: roots.iter().sum(), above_low, below_high }
    }
}
