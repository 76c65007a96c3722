//! The exact median of all pairs' ratios.
//!
//! A sample of the pairs says about where the median is, and a larger one says it more exactly. Then a pass over all
//! pairs proves it: it counts the ratios below a narrow bracket and above it, and decides the few inside one by one in
//! float64. Where many ratios are equal, too many are inside, and [`ties`] counts those.

use super::matches::{Block, Matches, Places, Tiles};
use super::pairs::{
    AllPairs, Borderline, Bracket, Middle, Pairs, Part, Ratio, Rule, SAME_SPOT, Visitor, in_order, squared_lanes,
};
use super::ties;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::threads::pieces;
use std::ops::RangeInclusive;

/// The last sample takes one group of pairs in this many.
const LAST: RangeInclusive<usize> = 4..=24;
/// The last sample has at least this many groups, if there are as many.
const LAST_GROUPS: usize = 128;
/// Each sample is this many times as large as the one before it.
const GROWTH: usize = 16;
/// The first sample has at least this many groups.
const FIRST_GROUPS: usize = 16;
/// The half width of a bracket in standard deviations of a sample's median, and that of the second attempt.
const DEVIATIONS: [f64; 2] = [3.0, 12.0];
/// The factor on the width for the first samples, whose few matches make pairs that are not independent.
const FIRST_DEVIATIONS: f64 = 2.0;
/// The groups of pairs that may be borderline, beside an eighth of all.
const LEAST_ROOM: usize = 4096;
/// The fewest double strips of matches that are worth a thread of their own.
const LEAST_PIECE: usize = 128;

/// The median of all pairs' ratios; `None` if no pair counts.
pub(super) fn median<T: Real>(matches: &Matches<T>, rule: Rule, level: Level, threads: usize) -> Option<Ratio> {
    let tiles = Tiles::new(matches);
    let pairs = match &tiles {
        Some(Tiles { mixed, tiled, places }) => {
            AllPairs { sampled: mixed, matches: tiled, places, rule, level, threads }
        }
        None => AllPairs { sampled: matches, matches, places: &[], rule, level, threads },
    };
    for deviations in DEVIATIONS {
        match pairs.proven_median(pairs.bracket(deviations)) {
            Ok(median) => return median,
            Err(Failure::Many) => break,
            Err(Failure::Outside) => {}
        }
    }
    ties::median(&pairs)
}

/// The reason that a bracket did not lead to the median.
enum Failure {
    /// Too many ratios are inside.
    Many,
    /// The median is not inside.
    Outside,
}

impl<T: Real> AllPairs<'_, T> {
    /// The bracket that should hold the median, by samples of the pairs.
    fn bracket(&self, deviations: f64) -> Bracket {
        let groups = self.groups();
        let last = (groups / LAST_GROUPS).clamp(*LAST.start(), *LAST.end());
        let samples = std::iter::successors(Some(last), |every| Some(every * GROWTH));
        let samples: Vec<usize> = samples.take_while(|every| groups / every >= FIRST_GROUPS).collect();
        samples.into_iter().rev().fold(Bracket::ALL, |bracket, every| {
            let wider = if every == last { 1.0 } else { FIRST_DEVIATIONS };
            self.by_sample(bracket, every, wider * deviations)
        })
    }

    /// About the number of groups of pairs.
    fn groups(&self) -> usize {
        self.matches.len() * self.matches.len() / (2 * LANES)
    }

    /// A narrower bracket, by a sample of one group of pairs in `every`.
    fn by_sample(&self, bracket: Bracket, every: usize, deviations: f64) -> Bracket {
        let double_strips = 0..Part::double_strips(self.matches.len());
        let part = Part { double_strips, every };
        let (matches, rule) = (self.sampled, self.rule);
        let counted = self.level.run(Count { matches, places: &[], rule, bracket, part, room: usize::MAX });
        let mut inside = counted.borderline.quotients(matches, rule);
        bracket.narrowed(&mut inside, counted.below, counted.above, deviations)
    }

    /// The median, if it is inside the bracket and not too many other ratios are; `None` if no pair counts.
    fn proven_median(&self, bracket: Bracket) -> Result<Option<Ratio>, Failure> {
        let n = self.matches.len();
        let room = LEAST_ROOM + self.groups() / 8;
        let counted = pieces(self.threads, Part::double_strips(n), LEAST_PIECE, |double_strips| {
            let counted = self.count(bracket, Part { double_strips, every: 1 }, room);
            (!counted.overflown).then(|| (counted.borderline.quotients(self.matches, self.rule), counted))
        });
        let (mut inside, mut below, mut pairs) = (Vec::new(), 0, 0);
        for piece in counted {
            let (decided, counted) = piece.ok_or(Failure::Many)?;
            below += counted.below;
            pairs += counted.below + counted.above + decided.len();
            if inside.is_empty() { inside = decided } else { inside.extend(decided) }
        }
        if pairs == 0 {
            return Ok(None);
        }
        let Middle { low, high } = Middle::of(pairs);
        let place = |rank: usize| rank.checked_sub(below).filter(|place| *place < inside.len()).ok_or(Failure::Outside);
        let (low, high) = (place(low)?, place(high)?);
        let (front, high_value, _) = inside.select_nth_unstable_by_key(high, in_order);
        let high_value = *high_value;
        let low_value = if low == high { high_value } else { front.iter().copied().fold(0.0, f64::max) };
        // Pairs that were counted below are below the bracket for certain, but borderline ones may be, too.
        if !(bracket.holds(low_value) && bracket.holds(high_value)) {
            return Err(Failure::Outside);
        }
        Ok(Some(Ratio::between(low_value, high_value, pairs)))
    }

    fn count(&self, bracket: Bracket, part: Part, room: usize) -> Counted {
        let (matches, places, rule) = (self.matches, self.places, self.rule);
        self.level.run(Count { matches, places, rule, bracket, part, room })
    }
}

/// Squared distances below this are not trusted, because smaller ones may have lost digits to underflow. It is above
/// `SAME_SPOT`.
const TRUSTED: f64 = 1e-30;
const _: () = assert!(TRUSTED > SAME_SPOT);

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
    matches: &'m Matches<T>,
    /// The bounds of the blocks, if they are patches. If there are none, no block is left out.
    places: &'m [Places<T>],
    rule: Rule,
    bracket: Bracket,
    part: Part,
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
    fn new(rule: Rule, bracket: Bracket) -> Self {
        let (less, more) = (1.0 - T::SLACK.to_f64(), 1.0 + T::SLACK.to_f64());
        let low = T::not_above(bracket.low * less);
        // Whatever is below the bracket has a trusted distance before, too.
        let certain = (rule.least * more).max(TRUSTED).max(low.to_f64() * TRUSTED * more);
        Limits {
            possible: if rule.least < TRUSTED { T::ZERO } else { T::not_above(rule.least * less) },
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
        let Count { matches, places, rule, bracket, part, room } = self;
        let limits = Limits::new(rule, bracket);
        let mut borderline = Borderline::new(&part, matches.len(), room);
        let mut counting = Counting {
            limits,
            tally: Tally::new(),
            strips: 0,
            below: 0,
            above: 0,
            borderline: &mut borderline,
            overflown: false,
        };
        Pairs { matches, places, least: limits.possible, part }.each(simd, &mut counting);
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
