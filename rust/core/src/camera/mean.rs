//! Means of the pairs' ratios: the mean of all, and the mean without the lowest and the highest.

use super::matches::{Block, Matches};
use super::pairs::{Pairs, Part, Ratio, Rule, Visitor, in_order, quotients};
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// The mean of all ratios; `None` if no pair counts.
pub(super) fn mean<T: Real>(matches: &Matches<T>, rule: Rule, level: Level) -> Option<Ratio> {
    let (sum, pairs) = level.run(Sum { matches, rule });
    (pairs > 0).then(|| Ratio { ratio: sum / pairs as f64, pairs })
}

/// The mean without a share of the lowest ratios and the same share of the highest; `None` if no pair counts.
///
/// The number of pairs in the result is that of the ratios that are left.
pub(super) fn trimmed<T: Real>(matches: &Matches<T>, rule: Rule, share: f64) -> Option<Ratio> {
    let pairs = (0..matches.len()).flat_map(|i| (i + 1..matches.len()).map(move |j| rule.quotient(matches, i, j)));
    let mut quotients: Vec<f64> = pairs.filter(|(_, counts)| *counts).map(|(quotient, _)| quotient).collect();
    let count = quotients.len();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "share is in [0, 0.5)")]
    let cut = (share * count as f64) as usize;
    let left = count.checked_sub(2 * cut).filter(|left| *left > 0)?;
    if cut > 0 {
        quotients.select_nth_unstable_by_key(cut, in_order);
        quotients[cut..].select_nth_unstable_by_key(left - 1, in_order);
    }
    let sum: f64 = quotients[cut..cut + left].iter().map(|quotient| quotient.sqrt()).sum();
    Some(Ratio { ratio: sum / left as f64, pairs: left })
}

/// Adds up the ratios of the pairs that count, lane by lane, so that the sum does not depend on the level.
struct Sum<'m, T> {
    matches: &'m Matches<T>,
    rule: Rule,
}

impl<T: Real> Kernel for Sum<'_, T> {
    type Output = (f64, usize);

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> (f64, usize) {
        let Sum { matches, rule } = self;
        let part = Part { double_strips: 0..Part::double_strips(matches.len()), every: 1 };
        let mut ratios = Ratios { rule, sums: [0.0; LANES], counts: [0.0; LANES] };
        Pairs { matches, places: &[], least: T::ZERO, part }.each(simd, &mut ratios);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count, exact below 2^53")]
        (ratios.sums.iter().sum(), ratios.counts.iter().sum::<f64>() as usize)
    }
}

/// The sums of ratios and the counts of pairs of each lane.
struct Ratios {
    rule: Rule,
    sums: Lanes<f64>,
    counts: Lanes<f64>,
}

impl<T: Real> Visitor<T> for Ratios {
    #[inline(always)]
    fn visit<I: Instructions>(&mut self, _: I, _: usize, from: [T; 4], _: usize, block: &Block<T>) {
        let quotients = quotients(block, from, self.rule);
        for lane in 0..LANES {
            let counts = quotients[lane] >= 0.0;
            self.sums[lane] += if counts { quotients[lane].sqrt() } else { 0.0 };
            self.counts[lane] += if counts { 1.0 } else { 0.0 };
        }
    }
}
