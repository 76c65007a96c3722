//! The exact median of all pairs' ratios.
//!
//! A sample of the pairs says about where the median is. Then a pass over all pairs proves it: it counts the ratios
//! below a narrow bracket and above it, in the type of the positions, and the few inside are decided one by one in
//! float64. Where ratios differ by little more than that type can tell, too many would be inside, and the pass counts in
//! float64. Where many are equal even so, [`ties`] counts those.

use super::matches::{Block, Matches, Tiles};
use super::pairs::{
    AllPairs, Borderline, Bracket, Middle, Pairs, Ratio, Rule, TRUSTED, Visitor, in_order, squared_lanes,
};
use super::shifts::{Shifts, bracket, nth, share_inside};
use super::ties;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// Of fewer matches every pair is in the sample.
const FEW: usize = 64;
/// The sample has this times the cube root of the number of matches as pairs for each match: more make the bracket
/// narrower, and cost more than is left inside.
const SHIFTS: f64 = 2.5;
/// The half width of a bracket in standard deviations of a sample's median, and that of the second attempt.
const DEVIATIONS: [f64; 2] = [3.0, 12.0];
/// The share of all ratios that may be inside a bracket beside those that its width lets in.
const CROWD: f64 = 0.125;
/// The groups of pairs that may be borderline, beside those that are expected.
const LEAST_ROOM: usize = 4096;
/// The most such groups, and the most pairs of a sample: a call takes some hundred MB at most.
const MOST_ROOM: usize = 1 << 24;

/// The median of all pairs' ratios; `None` if no pair counts.
pub(super) fn median<T: Real>(matches: &Matches<T>, rule: Rule, level: Level, threads: usize) -> Option<Ratio> {
    let shifts = Shifts::new(matches, rule, level);
    if matches.len() < FEW {
        return median_of(&shifts.quotients(shifts.all()), level);
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number above 0")]
    let many = (SHIFTS * (matches.len() as f64).cbrt()) as usize;
    let sample = shifts.quotients(many.min(MOST_ROOM / matches.len()).max(1));
    let median = by_counting(matches, &sample, rule, level, threads);
    let median = median.or_else(|_| by_counting(&matches.widened(), &sample, rule, level, threads));
    median.unwrap_or_else(|_| {
        let matches = matches.widened();
        let tiles = Tiles::new(&matches);
        ties::median(&AllPairs::of(&matches, tiles.as_ref(), rule, level, threads), &sample)
    })
}

/// The number of pairs that count; `None` if there are none.
pub(super) fn pairs<T: Real>(matches: &Matches<T>, rule: Rule, level: Level, threads: usize) -> Option<usize> {
    /// No quotient is this large if what was apart before is apart by more than underflow can hide.
    const ABOVE_ALL: f64 = 1e20;
    let tiles = Tiles::new(matches);
    let all = AllPairs::of(matches, tiles.as_ref(), rule, level, threads);
    let bracket = Bracket { low: ABOVE_ALL, high: f64::INFINITY };
    let counted = all.each_part(|pairs| {
        let parts = pairs.parts().map(|pairs| {
            let counted = level.run(Count { pairs, rule, bracket, room: usize::MAX });
            counted.below + counted.borderline.quotients(all.matches, rule).len()
        });
        parts.sum::<usize>()
    });
    Some(counted.into_iter().sum()).filter(|pairs| *pairs > 0)
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

/// The median, proven by a pass in the type of the positions.
fn by_counting<T: Real>(
    matches: &Matches<T>,
    sample: &[f64],
    rule: Rule,
    level: Level,
    threads: usize,
) -> Result<Option<Ratio>, Failure> {
    let mut tiles = None;
    for deviations in DEVIATIONS {
        let bracket = bracket(sample, 0.5, deviations, level);
        let inside = share_inside(sample, bracket.widened(T::SLACK.to_f64()));
        let expected = deviations / (sample.len() as f64).sqrt();
        // It is NaN of an empty sample.
        if inside.is_nan() || inside > expected + CROWD {
            return Err(Failure);
        }
        let tiles = tiles.get_or_insert_with(|| Tiles::new(matches)).as_ref();
        let pairs = AllPairs::of(matches, tiles, rule, level, threads);
        if let Ok(median) = pairs.proven_median(bracket, inside) {
            return Ok(median);
        }
    }
    Err(Failure)
}

impl<T: Real> AllPairs<'_, T> {
    /// The median, if it is inside the bracket and not too many other ratios are; `None` if no pair counts.
    fn proven_median(&self, bracket: Bracket, share: f64) -> Result<Option<Ratio>, Failure> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of groups")]
        let expected = (self.groups() as f64 * (1.5 * LANES as f64 * share).min(1.0)) as usize;
        let counted = self.each_part(|pairs| {
            let room = (LEAST_ROOM + expected).min(MOST_ROOM);
            let counted = self.level.run(Count { pairs, rule: self.rule, bracket, room });
            (!counted.overflown).then(|| (counted.borderline.quotients(self.matches, self.rule), counted))
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
        let (front, high_value, _) = inside.select_nth_unstable_by_key(high, in_order);
        let high_value = *high_value;
        let low_value = if low == high { high_value } else { front.iter().copied().fold(0.0, f64::max) };
        // Pairs that were counted below are below the bracket for certain, but borderline ones may be, too.
        let holds = bracket.holds(low_value) && bracket.holds(high_value);
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

/// One pass over pairs that counts on which side of a bracket their quotients lie.
///
/// It takes no root and no division: `now / before < low` is `now < low before`. It works in the type of the positions,
/// and is trusted only where rounding cannot matter. A pair for which rounding could matter, and every pair inside the
/// bracket, is noted as borderline, to be decided in float64.
struct Count<'m, T> {
    pairs: Pairs<'m, T>,
    rule: Rule,
    bracket: Bracket,
    /// The most groups that may be borderline, give or take a row.
    room: usize,
}

/// The limits of a bracket and a rule, moved by more than rounding can do.
#[derive(Clone, Copy)]
struct Limits<T> {
    /// A smaller distance now does not count for certain.
    possible: T,
    /// A distance now of at least this counts for certain.
    certain: T,
    /// A distance now of at most this times the distance before is below the bracket.
    low: T,
    /// A distance before of at most this times the distance now is above the bracket.
    high: T,
    trusted: T,
}

impl<T: Real> Limits<T> {
    fn new(rule: Rule, bracket: Bracket, possible: T) -> Self {
        let (less, more) = (1.0 - T::SLACK.to_f64(), 1.0 + T::SLACK.to_f64());
        let low = T::not_above(bracket.low * less);
        // Whatever is below the bracket has a trusted distance before, too.
        let certain = (rule.least * more).max(TRUSTED).max(low.to_f64() * TRUSTED * more);
        Limits {
            possible,
            certain: T::not_below(certain),
            low,
            high: T::not_above(less / bracket.high),
            trusted: T::not_below(TRUSTED),
        }
    }
}

impl<T: Real> Kernel for Count<'_, T> {
    type Output = Counted;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Counted {
        let Count { pairs, rule, bracket, room } = self;
        let limits = Limits::new(rule, bracket, pairs.least);
        let mut borderline = Borderline::new(&pairs, room);
        let mut counting = Counting {
            limits,
            tally: Tally::new(),
            strips: 0,
            below: 0,
            above: 0,
            borderline: &mut borderline,
            overflown: false,
        };
        pairs.each(simd, &mut counting);
        counting.flush();
        let Counting { below, above, overflown, .. } = counting;
        Counted { below, above, borderline, overflown }
    }
}

/// The strips after which the counts of lanes are added up; until then each is small enough to be exact in its type.
const FLUSH: usize = 64;

/// The counts so far.
struct Counting<'u, T> {
    limits: Limits<T>,
    tally: Tally<T>,
    strips: usize,
    below: usize,
    above: usize,
    /// A reference, because a value that is dropped in case of a panic has to be in memory, and the others should be in
    /// registers.
    borderline: &'u mut Borderline,
    overflown: bool,
}

impl<T: Real> Visitor<T> for Counting<'_, T> {
    #[inline(always)]
    fn visit<I: Instructions>(&mut self, simd: I, i: usize, from: [T; 4], j: usize, block: &Block<T>) {
        let open = self.tally.add(simd, &self.limits, from, block);
        self.borderline.note(i, j, open);
    }

    #[inline(always)]
    fn continues(&mut self) -> bool {
        self.strips += 1;
        if self.strips.is_multiple_of(FLUSH) {
            self.flush();
        }
        self.overflown = self.borderline.is_overflown();
        !self.overflown
    }
}

impl<T: Real> Counting<'_, T> {
    #[inline(always)]
    fn flush(&mut self) {
        self.tally.flush(&mut self.below, &mut self.above);
    }
}

/// The counts of each lane.
struct Tally<T> {
    below: Lanes<T>,
    above: Lanes<T>,
}

impl<T: Real> Tally<T> {
    #[inline(always)]
    fn new() -> Self {
        Tally { below: [T::ZERO; LANES], above: [T::ZERO; LANES] }
    }

    /// Counts the pairs of a match with those of a block, and returns the bits of the borderline ones.
    #[inline(always)]
    fn add<I: Instructions>(&mut self, simd: I, limits: &Limits<T>, from: [T; 4], [x0, y0, x1, y1]: &Block<T>) -> u16 {
        let Limits { possible, certain, low, high, trusted } = *limits;
        let before = squared_lanes([x0, y0], [from[0], from[1]]);
        let now = squared_lanes([x1, y1], [from[2], from[3]]);
        let one = T::from_f64(1.0);
        let mut open = now;
        for lane in 0..LANES {
            let (before, now) = (before[lane], now[lane]);
            let is_below = (now >= certain) & (now <= before * low);
            let is_above = (now >= certain) & (before >= trusted) & (before <= now * high);
            self.below[lane] = self.below[lane] + if is_below { one } else { T::ZERO };
            self.above[lane] = self.above[lane] + if is_above { one } else { T::ZERO };
            open[lane] = if is_below | is_above { T::NAN } else { now };
        }
        // Whether `open` is at least `possible`; asked this way round, because the other half of the question never
        // changes.
        T::within(simd, &[possible; LANES], &[T::ZERO; LANES], &open)
    }

    #[inline(always)]
    fn flush(&mut self, below: &mut usize, above: &mut usize) {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let sum = |counts: &Lanes<T>| counts.iter().map(|count| count.to_f64() as usize).sum::<usize>();
        (*below, *above) = (*below + sum(&self.below), *above + sum(&self.above));
        *self = Tally::new();
    }
}

#[cfg(test)]
mod tests {
    use super::median;
    use crate::camera::matches::{Keypoints, Matches};
    use crate::camera::pairs::{Ratio, Rule};
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
                let numbers = [before[0], before[1], 1.02 * before[0] + random(), 1.02 * before[1] + random()];
                columns.iter_mut().zip(numbers).for_each(|(column, x)| column.push((x / step).round() * step));
            }
            let (matches, rule) = (matches(&columns), Rule::new(least));
            for level in Level::all() {
                for threads in [1, 3] {
                    prop_assert_eq!(median(&matches, rule, level, threads), naive(&matches, rule));
                }
            }
        }
    }
}
