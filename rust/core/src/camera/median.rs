//! The exact median of all pairs' ratios.
//!
//! A sample of the pairs says about where the median is, a larger one more exactly, and a pass over all of them proves it: so
//! many are below a narrow bracket, so many above, and the few inside are decided one by one in float64. Where they are
//! not few, because many are the same, [`ties`](super::ties) counts those.

use super::bracket::{Bracket, Middle, in_order};
use super::count::{Count, Counted};
use super::matches::Matches;
use super::pairs::{Ratio, Rule};
use super::search::Search;
use super::strips::Part;
use super::ties;
use super::tiles::Tiles;
use crate::lanes::LANES;
use crate::real::Real;
use crate::simd::Level;
use crate::threads::pieces;
use std::ops::RangeInclusive;

/// The last sample is of one group of pairs in so many, but at least of
const LAST: RangeInclusive<usize> = 4..=24;
/// so many, if there are as many.
const LAST_GROUPS: usize = 128;
/// Each sample before it is so many times as small, down to
const GROWTH: usize = 16;
/// so many groups.
const FIRST_GROUPS: usize = 16;
/// How wide a bracket is, in standard deviations of a sample's median; if that was too narrow, the next.
const DEVIATIONS: [f64; 2] = [3.0, 12.0];
/// The first samples have too few matches in them for their pairs to be independent: they need more.
const FIRST_DEVIATIONS: f64 = 2.0;
/// More groups of pairs than this, and an eighth of all, are not few.
const LEAST_ROOM: usize = 4096;
/// Fewer double strips of matches than this are not worth a thread of their own.
const LEAST_PIECE: usize = 128;

/// Their median; none if no pair counts.
pub(super) fn median<T: Real>(matches: &Matches<T>, rule: Rule, level: Level, threads: usize) -> Option<Ratio> {
    let tiles = Tiles::new(matches);
    let search = match &tiles {
        Some(Tiles { mixed, tiled, places }) => Search { sampled: mixed, matches: tiled, places, rule, level, threads },
        None => Search { sampled: matches, matches, places: &[], rule, level, threads },
    };
    for deviations in DEVIATIONS {
        match search.proven(search.bracket(deviations)) {
            Ok(median) => return median,
            Err(Failure::Many) => break,
            Err(Failure::Outside) => {}
        }
    }
    ties::median(&search)
}

/// Why a bracket did not lead to the median.
enum Failure {
    /// Too many ratios are inside.
    Many,
    /// The median is not.
    Outside,
}

impl<T: Real> Search<'_, T> {
    /// Where the median should be, by samples of the pairs.
    fn bracket(&self, deviations: f64) -> Bracket {
        let groups = self.groups();
        let last = (groups / LAST_GROUPS).clamp(*LAST.start(), *LAST.end());
        let samples = std::iter::successors(Some(last), |every| Some(every * GROWTH));
        let samples: Vec<usize> = samples.take_while(|every| groups / every >= FIRST_GROUPS).collect();
        samples.into_iter().rev().fold(Bracket::ALL, |bracket, every| {
            let wider = if every == last { 1.0 } else { FIRST_DEVIATIONS };
            self.narrowed(bracket, every, wider * deviations)
        })
    }

    /// About how many groups of pairs there are.
    fn groups(&self) -> usize {
        self.matches.len() * self.matches.len() / (2 * LANES)
    }

    /// A narrower bracket, by a sample of the pairs.
    fn narrowed(&self, bracket: Bracket, every: usize, deviations: f64) -> Bracket {
        let double_strips = 0..Part::double_strips(self.matches.len());
        let part = Part { double_strips, every };
        let (matches, rule) = (self.sampled, self.rule);
        let counted = self.level.run(Count { matches, places: &[], rule, bracket, part, room: usize::MAX });
        let mut inside = counted.undecided.decided(matches, rule);
        bracket.around(&mut inside, counted.below, counted.above, deviations)
    }

    /// The median, if it is inside the bracket and not too many others are; none if no pair counts.
    fn proven(&self, bracket: Bracket) -> Result<Option<Ratio>, Failure> {
        let n = self.matches.len();
        let room = LEAST_ROOM + self.groups() / 8;
        let counted = pieces(self.threads, Part::double_strips(n), LEAST_PIECE, |double_strips| {
            let counted = self.count(bracket, Part { double_strips, every: 1 }, room);
            (!counted.overflown).then(|| (counted.undecided.decided(self.matches, self.rule), counted))
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
        // What was counted below is below the bracket for certain, but what was decided may be, too.
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

    /// All of them, sorted.
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

        /// On a grid many ratios are the same; the finer it is, the fewer.
        #[test]
        fn it_is_that_of_all_pairs(
            count in prop_oneof![0_usize..70, Just(300), Just(450)], step in prop_oneof![Just(0.001_f32), Just(1.0), Just(40.0)],
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
