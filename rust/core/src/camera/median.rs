//! The exact median of all pairs' ratios.
//!
//! A sample of the pairs says about where the median is. Then a pass over all pairs proves it: it counts the ratios
//! below a narrow bracket and above it, in float32 with [`Residuals`], and the few inside are decided one by one in
//! float64. Where many are equal, too many would be inside, and [`ties`] counts those.

use super::matches::{Block, Matches, Tiles, widened};
use super::pairs::{AllPairs, Borderline, Bracket, Middle, Pairs, Ratio, Rule, Visitor};
use super::residuals::{Limits, Residuals};
use super::shifts::{Shifts, bracket, nth, share_inside};
use super::similarity::Centred;
use super::ties;
use crate::lanes::LANES;
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level, alone};

/// Of fewer matches every pair is in the sample.
const FEW: usize = 64;
/// The sample has this times the cube root of the number of matches as pairs for each match: more make the bracket
/// narrower, and cost more than is left inside.
const SHIFTS: f64 = 2.5;
/// The half width of a bracket in standard deviations of a sample's median, and that of the second attempt.
const DEVIATIONS: [f64; 2] = [2.5, 12.0];
/// The share of all ratios that may be inside a bracket beside those that its width lets in.
const CROWD: f64 = 0.125;
/// The groups of pairs that may be borderline, beside those that are expected.
const LEAST_ROOM: usize = 4096;
/// The most such groups, and the most pairs of a sample: a call takes some hundred MB at most.
const MOST_ROOM: usize = 1 << 24;

/// The median of all pairs' ratios, of matches about their centre; `None` if no pair counts.
pub(super) fn median<T: Real>(
    matches: &Matches<T>,
    centred: Option<Centred>,
    rule: Rule,
    level: Level,
    threads: usize,
) -> Option<Ratio> {
    if matches.len() < FEW {
        return median_of(&Shifts::new(&matches.map(widened)).values(rule, FEW, level), level);
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number above 0")]
    let many = (SHIFTS * (matches.len() as f64).cbrt()) as usize;
    let shifts = many.min(MOST_ROOM / matches.len()).max(1);
    let median = by_counting(matches, centred, shifts, rule, level, threads);
    median.unwrap_or_else(|_| ties::median(matches, shifts, rule, level, threads))
}

/// The number of pairs that count; `None` if there are none.
pub(super) fn pairs<T: Real>(
    matches: &Matches<T>,
    centred: Option<Centred>,
    rule: Rule,
    level: Level,
    threads: usize,
) -> Option<usize> {
    let residuals = Residuals::new(matches, centred, rule, level);
    let tiles = Tiles::new(&residuals.matches);
    // Every pair that was apart for certain is below this bracket.
    let limits = residuals.limits(Bracket { low: f64::INFINITY, high: f64::INFINITY });
    let all = AllPairs::of(&residuals.matches, tiles.as_ref(), rule, limits.possible, level, threads);
    let counted = all.each_part(|pairs| {
        let parts = pairs.parts().map(|pairs| {
            let counted = level.run(Count { pairs, limits, room: usize::MAX });
            counted.below + counted.borderline.quotients(matches, number(tiles.as_ref()), rule).len()
        });
        parts.sum::<usize>()
    });
    Some(counted.into_iter().sum()).filter(|pairs| *pairs > 0)
}

/// The number that a match has outside of tiles.
fn number(tiles: Option<&Tiles<f32>>) -> impl Fn(usize) -> usize {
    move |i| tiles.map_or(i, |tiles| tiles.order[i])
}

/// The median of the ratios of some quotients.
fn median_of(quotients: &[f64], level: Level) -> Option<Ratio> {
    let pairs = Some(quotients.len()).filter(|pairs| *pairs > 0)?;
    let Middle { low, high } = Middle::of(pairs);
    let low_value = nth(quotients, low, level);
    let high_value = if low == high { low_value } else { nth(quotients, high, level) };
    Some(Ratio::between(low_value, high_value, pairs))
}

/// The reason that a bracket did not lead to the median: too many ratios are inside, or the median is not.
struct Failure;

/// The median, proven by a pass in float32, by a sample of some shifts; `Ok(None)` if no pair counts.
fn by_counting<T: Real>(
    matches: &Matches<T>,
    centred: Option<Centred>,
    shifts: usize,
    rule: Rule,
    level: Level,
    threads: usize,
) -> Result<Option<Ratio>, Failure> {
    let residuals = Residuals::new(matches, centred, rule, level);
    let sample = Shifts::new(&residuals.matches).values(&residuals, shifts, level);
    let tiles = Tiles::new(&residuals.matches);
    for deviations in DEVIATIONS {
        let bracket = bracket(&sample, 0.5, deviations, level);
        let inside = share_inside(&sample, bracket.widened(residuals.slack_of_excess()));
        let expected = deviations / (sample.len() as f64).sqrt();
        // It is NaN of an empty sample.
        if inside.is_nan() || inside > expected + CROWD {
            return Err(Failure);
        }
        let limits = residuals.limits(bracket);
        let pairs = AllPairs::of(&residuals.matches, tiles.as_ref(), rule, limits.possible, level, threads);
        let ends = Bracket { low: residuals.quotient(bracket.low), high: residuals.quotient(bracket.high) };
        let decide = |borderline: &Borderline| borderline.quotients(matches, number(tiles.as_ref()), rule);
        if let Ok(median) = pairs.proven_median(limits, ends, inside, decide) {
            return Ok(median);
        }
    }
    Err(Failure)
}

impl AllPairs<'_, f32> {
    /// The median, if it is between the ends of the bracket, which has these limits, and not too many other ratios are;
    /// `None` if no pair counts.
    fn proven_median(
        &self,
        limits: Limits,
        ends: Bracket,
        share: f64,
        decide: impl Fn(&Borderline) -> Vec<f64> + Sync,
    ) -> Result<Option<Ratio>, Failure> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of groups")]
        let expected = (self.groups() as f64 * (1.5 * LANES as f64 * share).min(1.0)) as usize;
        let counted = self.each_part(|pairs| {
            let room = (LEAST_ROOM + expected).min(MOST_ROOM);
            let counted = self.level.run(Count { pairs, limits, room });
            (!counted.overflown).then(|| (decide(&counted.borderline), counted))
        });
        let (mut inside, mut below, mut pairs) = (Vec::new(), 0, 0);
        for piece in counted {
            let (decided, counted) = piece.ok_or(Failure)?;
            below += counted.below;
            pairs += counted.below + counted.above + decided.len();
            if inside.is_empty() { inside = decided } else { inside.extend(decided) }
        }
        if pairs == 0 {
            return Ok(None);
        }
        let Middle { low, high } = Middle::of(pairs);
        let place = |rank: usize| rank.checked_sub(below).filter(|place| *place < inside.len()).ok_or(Failure);
        let (low, high) = (place(low)?, place(high)?);
        // The bits of numbers of at least 0 are in order, and quicker to compare.
        let (front, high_value, _) = inside.select_nth_unstable_by_key(high, |quotient| quotient.to_bits());
        let high_value = *high_value;
        let low_value = if low == high { high_value } else { front.iter().copied().fold(0.0, f64::max) };
        // Pairs that were counted below are below the bracket for certain, but borderline ones may be, too.
        let holds = ends.holds(low_value) && ends.holds(high_value);
        if holds { Ok(Some(Ratio::between(low_value, high_value, pairs))) } else { Err(Failure) }
    }
}

/// The result of a counting pass.
struct Counted {
    /// The pairs that count and are below the bracket.
    below: usize,
    /// The pairs that count and are above the bracket.
    above: usize,
    /// All other pairs that may count.
    borderline: Borderline,
    /// Whether there were too many borderline pairs, so that the pass was given up.
    overflown: bool,
}

/// One pass over pairs that counts on which side of a bracket they lie.
///
/// It is trusted only where rounding cannot matter. A pair for which rounding could matter, and every pair inside the
/// bracket, is noted as borderline, to be decided in float64.
struct Count<'m> {
    pairs: Pairs<'m, f32>,
    limits: Limits,
    /// The most groups that may be borderline, give or take a row.
    room: usize,
}

impl Kernel for Count<'_> {
    type Output = Counted;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Counted {
        let Count { pairs, limits, room } = self;
        let mut borderline = Borderline::new(&pairs, room);
        let mut counting = Counting { limits, below: 0, above: 0, borderline: &mut borderline, overflown: false };
        pairs.each(simd, &mut counting);
        let Counting { below, above, overflown, .. } = counting;
        Counted { below, above, borderline, overflown }
    }
}

/// The counts so far.
struct Counting<'u> {
    limits: Limits,
    below: usize,
    above: usize,
    /// A reference, because a value that is dropped in case of a panic has to be in memory, and the others should be in
    /// registers.
    borderline: &'u mut Borderline,
    overflown: bool,
}

impl Visitor<f32> for Counting<'_> {
    #[inline(always)]
    fn visit<I: Instructions>(&mut self, simd: I, i: usize, from: [f32; 4], j: usize, block: &Block<f32>) {
        let sides = self.limits.sides(simd, from, block);
        self.below += alone(sides.below.count_ones()) as usize;
        self.above += alone(sides.above.count_ones()) as usize;
        self.borderline.note(i, j, sides.open);
    }

    #[inline(always)]
    fn continues(&mut self) -> bool {
        self.overflown = self.borderline.is_overflown();
        !self.overflown
    }
}

#[cfg(test)]
mod tests {
    use super::median;
    use crate::camera::matches::{Keypoints, Matches};
    use crate::camera::pairs::{Ratio, Rule};
    use crate::camera::similarity::{Centred, Selection};
    use crate::column::Column;
    use crate::simd::Level;
    use proptest::prelude::*;

    fn matches(columns: &[Vec<f32>; 4]) -> Matches<f32> {
        let [x0, y0, x1, y1] = columns.each_ref().map(|column| Column::new(column));
        Matches::gather(Keypoints { previous: [x0, y0], current: [x1, y1] }).expect("columns of one length")
    }

    /// The median by sorting all quotients.
    fn naive(matches: &Matches<f32>, rule: Rule) -> Option<Ratio> {
        let pairs = (0..matches.len()).flat_map(|i| (i + 1..matches.len()).map(move |j| (i, j)));
        let quotients = pairs.map(|(i, j)| rule.quotient(matches, i, j)).filter(|(_, counts)| *counts);
        let mut quotients: Vec<f64> = quotients.map(|(quotient, _)| quotient).collect();
        quotients.sort_unstable_by(f64::total_cmp);
        let (low, high) = (quotients.len().checked_sub(1)? / 2, quotients.len() / 2);
        Some(Ratio::between(quotients[low], quotients[high], quotients.len()))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// On a grid many ratios are equal; the finer the grid, the fewer.
        #[test]
        fn it_is_that_of_all_pairs(
            count in prop_oneof![0_usize..70, Just(300), Just(450)],
            step in prop_oneof![Just(0.001_f32), Just(1.0), Just(40.0)],
            wrong in prop_oneof![Just(0.0_f32), Just(0.3)], far in prop_oneof![Just(0.0_f32), Just(50_000.0)],
            seed in any::<u64>(), least in prop_oneof![Just(0.0), Just(100.0), Just(400.0)],
        ) {
            let mut state = seed;
            let mut random = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as f32 / (1_u32 << 24) as f32
            };
            let mut columns: [Vec<f32>; 4] = Default::default();
            for _ in 0..count {
                let before = [200.0 * random(), 200.0 * random()];
                let now = if random() < wrong { [400.0 * random(), 400.0 * random()] } else { before.map(|x| 1.02 * x) };
                let numbers = [before[0] + far, before[1], now[0] + random(), now[1] + random() - far];
                columns.iter_mut().zip(numbers).for_each(|(column, x)| column.push((x / step).round() * step));
            }
            let (matches, rule) = (matches(&columns), Rule::new(least));
            for level in Level::all() {
                for threads in [1, 3] {
                    let all = Selection { matches: &matches, those: &matches.all(), level };
                let found = median(&matches, Centred::of(all), rule, level, threads);
                    prop_assert_eq!(found, naive(&matches, rule));
                }
            }
        }
    }
}
