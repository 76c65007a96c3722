//! The exact median of all pairs' ratios where many ratios are equal, or almost.
//!
//! Positions on the pixels of a picture, and a thing that hardly moves, make ratios of exactly 1 by the thousand. So
//! the ends of a bracket are values of a sample here, every quotient is computed in float64, and those equal to an end
//! are counted, not kept. Such a pass takes several times as long as one that only counts, and one or two are enough.

use super::matches::{Block, Matches, Tiles, widened};
use super::pairs::{AllPairs, Borderline, Bracket, Middle, Pairs, Ratio, Rule, TRUSTED, Visitor, in_order};
use super::shifts::{Measure, Shifts};
use crate::lanes::{LANES, Lanes, least};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// The groups of pairs whose values inside a bracket are kept.
const ROOM: usize = 1 << 18;
/// The distance of the ends from where the value should be, in standard deviations of the rank of a sample's median.
const DEVIATIONS: f64 = 3.0;

/// The median of all pairs' ratios, from a sample of some shifts; `None` if no pair counts.
pub(super) fn median<T: Real>(
    matches: &Matches<T>,
    shifts: usize,
    rule: Rule,
    level: Level,
    threads: usize,
) -> Option<Ratio> {
    let matches = matches.map(widened);
    let sample = &Shifts::new(&matches).values(rule, shifts, level);
    let least = if rule.least < TRUSTED { 0.0 } else { rule.least * (1.0 - f64::SLACK) };
    let tiles = Tiles::new(&matches);
    let pairs = AllPairs::of(&matches, tiles.as_ref(), rule, least, level, threads);
    let mut region = Region::ALL;
    loop {
        let sides = pairs.split(pairs.ends(region, sample)?);
        let middle = Middle::of(sides.count());
        match sides.value_at(middle.low) {
            Some(low) => {
                let high = sides.value_at(middle.high);
                let high = high.unwrap_or_else(|| pairs.split(Bracket { low, high: low }).next);
                return Some(Ratio::between(low, high, sides.count()));
            }
            None => region = sides.region_of(middle.low, region),
        }
    }
}

/// The values strictly between two others, one of which is looked for.
#[derive(Clone, Copy)]
struct Region {
    open: Bracket,
    /// The number of values before them.
    before: usize,
    /// The share of them before the one that is looked for.
    share: f64,
}

impl Region {
    /// All values, with the median in the middle.
    const ALL: Region = Region { open: Bracket { low: -1.0, high: f64::INFINITY }, before: 0, share: 0.5 };
}

impl AllPairs<'_, f64> {
    /// Two values of the region between which the one that is looked for should be; `None` if the region has no values.
    fn ends(&self, region: Region, sample: &[f64]) -> Option<Bracket> {
        let Bracket { low, high } = region.open;
        let mut sample: Vec<f64> = sample.iter().copied().filter(|value| low < *value && *value < high).collect();
        if sample.is_empty() {
            sample = self.split(region.open).kept;
        }
        sample.sort_unstable_by(in_order);
        let last = sample.len().checked_sub(1)?;
        let margin = DEVIATIONS * 0.5 * (sample.len() as f64).sqrt();
        let place = region.share * last as f64;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number of at least 0")]
        let at = |place: f64| sample[(place.max(0.0) as usize).min(last)];
        Some(Bracket { low: at((place - margin).floor()), high: at((place + margin).ceil()) })
    }

    /// Counts the values on each side of two values.
    fn split(&self, bracket: Bracket) -> Sides {
        let sides = self.each_part(|pairs| self.level.run(Split { pairs, rule: self.rule, bracket }));
        sides.into_iter().reduce(Sides::with).expect("there is at least one piece")
    }
}

/// The numbers of values on each side of a bracket, and at its ends.
struct Sides {
    bracket: Bracket,
    below: usize,
    at_low: usize,
    /// The number of values strictly inside.
    inside: usize,
    /// The values inside, or the first of them if there are too many.
    kept: Vec<f64>,
    /// The number of values at the upper end; 0 if both ends are equal.
    at_high: usize,
    above: usize,
    /// The least value above.
    next: f64,
}

impl Sides {
    /// Adds the numbers of other pairs.
    fn with(mut self, other: Self) -> Self {
        self.below += other.below;
        self.at_low += other.at_low;
        self.inside += other.inside;
        self.kept.extend(other.kept);
        self.at_high += other.at_high;
        self.above += other.above;
        self.next = self.next.min(other.next);
        self
    }

    /// The value of a rank, if it is known.
    fn value_at(&self, rank: usize) -> Option<f64> {
        let Bracket { low, high } = self.bracket;
        let rank = rank.checked_sub(self.below)?;
        let Some(inside) = rank.checked_sub(self.at_low) else { return Some(low) };
        let Some(beyond) = inside.checked_sub(self.inside) else {
            let complete = self.kept.len() == self.inside;
            return complete.then(|| *self.kept.clone().select_nth_unstable_by(inside, in_order).1);
        };
        match beyond.checked_sub(self.at_high) {
            None => Some(high),
            Some(0) => Some(self.next),
            Some(_) => None,
        }
    }

    /// The number of all values.
    fn count(&self) -> usize {
        self.below + self.at_low + self.inside + self.at_high + self.above
    }

    /// The part of the region `looked` at that holds a rank whose value is not known.
    fn region_of(&self, rank: usize, looked: Region) -> Region {
        let Bracket { low, high } = self.bracket;
        let beyond = self.count() - self.above;
        let (open, before, behind) = if rank < self.below {
            (Bracket { low: looked.open.low, high: low }, looked.before, self.below)
        } else if rank < beyond {
            (self.bracket, self.below + self.at_low, beyond - self.at_high)
        } else {
            (Bracket { low: high, high: looked.open.high }, beyond, self.count())
        };
        Region { open, before, share: (rank - before) as f64 / (behind - before) as f64 }
    }
}

/// Splits the quotients of pairs at two values.
struct Split<'m> {
    pairs: Pairs<'m, f64>,
    rule: Rule,
    bracket: Bracket,
}

impl Kernel for Split<'_> {
    type Output = Sides;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Sides {
        let Split { pairs, rule, bracket } = self;
        let mut inside = Borderline::new(&pairs, ROOM);
        let mut splitting = Splitting { rule, tally: Tally::new(bracket), inside: &mut inside };
        pairs.each(simd, &mut splitting);
        let tally = splitting.tally;
        tally.sides(inside.quotients(pairs.matches, |i| i, rule))
    }
}

struct Splitting<'u> {
    rule: Rule,
    tally: Tally,
    inside: &'u mut Borderline,
}

impl Visitor<f64> for Splitting<'_> {
    #[inline(always)]
    fn visit<I: Instructions>(&mut self, simd: I, i: usize, from: [f64; 4], j: usize, block: &Block<f64>) {
        let from = from.map(|x| [x; LANES]);
        let inside = self.tally.add(simd, &self.rule.of(simd, from.each_ref(), block.each_ref()));
        self.inside.note(i, j, u32::from(inside));
    }

    #[inline(always)]
    fn continues(&mut self) -> bool {
        self.inside.is_overflown(); // the counts stay right
        true
    }
}

/// The counts of each lane; they are exact, as there are fewer than 2^53 pairs.
struct Tally {
    bracket: Bracket,
    below: Lanes<f64>,
    at_low: Lanes<f64>,
    inside: Lanes<f64>,
    at_high: Lanes<f64>,
    above: Lanes<f64>,
    next: Lanes<f64>,
}

impl Tally {
    #[inline(always)]
    fn new(bracket: Bracket) -> Self {
        let zero = [0.0; LANES];
        let next = [f64::INFINITY; LANES];
        Tally { bracket, below: zero, at_low: zero, inside: zero, at_high: zero, above: zero, next }
    }

    /// Counts values, passes over NaN, and returns the bits of those strictly inside.
    #[inline(always)]
    fn add<I: Instructions>(&mut self, simd: I, values: &Lanes<f64>) -> u16 {
        let Bracket { low, high } = self.bracket;
        let one_if = |condition: bool| if condition { 1.0 } else { 0.0 };
        let mut inside = [f64::NAN; LANES];
        for lane in 0..LANES {
            let value = values[lane];
            let is_inside = (value > low) & (value < high);
            self.below[lane] += one_if(value < low);
            self.at_low[lane] += one_if(value == low);
            self.inside[lane] += one_if(is_inside);
            self.at_high[lane] += one_if((value == high) & (low < high));
            self.above[lane] += one_if(value > high);
            self.next[lane] = if (value > high) & (value < self.next[lane]) { value } else { self.next[lane] };
            inside[lane] = if is_inside { value } else { f64::NAN };
        }
        f64::within(simd, &inside, &[low; LANES], &[high; LANES])
    }

    fn sides(self, kept: Vec<f64>) -> Sides {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let sum = |counts: Lanes<f64>| counts.iter().sum::<f64>() as usize;
        Sides {
            bracket: self.bracket,
            below: sum(self.below),
            at_low: sum(self.at_low),
            inside: sum(self.inside),
            kept,
            at_high: sum(self.at_high),
            above: sum(self.above),
            next: least(self.next),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Bracket, Sides};

    #[test]
    fn a_value_is_known_by_its_rank_from_the_first_to_the_one_above() {
        let bracket = Bracket { low: 1.0, high: 2.0 };
        let kept = vec![1.7, 1.2];
        let sides = Sides { bracket, below: 4, at_low: 3, inside: 2, kept, at_high: 1, above: 5, next: 2.5 };
        let values: Vec<Option<f64>> = (3..12).map(|rank| sides.value_at(rank)).collect();
        let known = [1.0, 1.0, 1.0, 1.2, 1.7, 2.0, 2.5];
        let expected: Vec<Option<f64>> = [None].into_iter().chain(known.map(Some)).chain([None]).collect();
        assert_eq!(values, expected);
    }

    #[test]
    fn what_was_not_kept_is_not_known() {
        let bracket = Bracket { low: 1.0, high: 2.0 };
        let sides = Sides { bracket, below: 0, at_low: 1, inside: 9, kept: vec![], at_high: 1, above: 0, next: 3.0 };
        assert_eq!([0, 1, 9, 10, 11].map(|rank| sides.value_at(rank)), [Some(1.0), None, None, Some(2.0), Some(3.0)]);
    }
}
