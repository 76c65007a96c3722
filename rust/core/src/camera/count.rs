//! One pass over pairs that counts on which side of a bracket their quotients lie.
//!
//! No root and no division: `now / before < low` is `now < low before`. It is done in the type of the positions, so it is
//! only trusted where rounding cannot matter; a pair for which it could, and every pair inside the bracket, is written down
//! to be decided in float64.

use super::bracket::Bracket;
use super::matches::{Block, Matches};
use super::pairs::{Rule, SAME_SPOT, squared_lanes};
use super::strips::{Look, Pairs, Part};
use super::tiles::Places;
use super::undecided::Undecided;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};

/// Squared distances below this are not trusted: smaller ones may have lost digits to underflow. It is above `SAME_SPOT`.
const TRUSTED: f64 = 1e-30;
const _: () = assert!(TRUSTED > SAME_SPOT);

/// What was found.
pub(super) struct Counted {
    /// Pairs that count and are below the bracket.
    pub below: usize,
    /// Pairs that count and are above it.
    pub above: usize,
    /// All other pairs that may count.
    pub undecided: Undecided,
    /// Whether there were too many of those, and the pass was given up.
    pub overflown: bool,
}

/// Counts pairs.
pub(super) struct Count<'m, T> {
    pub matches: &'m Matches<T>,
    /// Of the blocks, if they are patches; if not, none is left out.
    pub places: &'m [Places<T>],
    pub rule: Rule,
    pub bracket: Bracket,
    pub part: Part,
    /// How many groups may be undecided, give or take a row.
    pub room: usize,
}

/// The limits of a bracket and a rule, moved by more than rounding.
#[derive(Clone, Copy)]
struct Limits<T> {
    /// A smaller distance now does not count for certain.
    possible: T,
    /// A distance now of at least this counts for certain.
    certain: T,
    /// Times the distance before: up to this, the distance now is below the bracket.
    low: T,
    /// Times the distance now: up to this, the distance before puts the pair above the bracket.
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
        let mut undecided = Undecided::new(&part, matches.len(), room);
        let mut counting = Counting {
            limits,
            tally: Tally::new(),
            strips: 0,
            below: 0,
            above: 0,
            undecided: &mut undecided,
            overflown: false,
        };
        Pairs { matches, places, least: limits.possible, part }.each(simd, &mut counting);
        counting.flush();
        let Counting { below, above, overflown, .. } = counting;
        Counted { below, above, undecided, overflown }
    }
}

/// After so many strips counts are put together: by then each is still small enough to be exact in its type.
const FLUSH: usize = 64;

/// What is known so far.
struct Counting<'u, T> {
    limits: Limits<T>,
    tally: Tally<T>,
    strips: usize,
    below: usize,
    above: usize,
    /// Elsewhere: what is dropped in case of a panic has to be in memory, and what is here should be in registers.
    undecided: &'u mut Undecided,
    overflown: bool,
}

impl<T: Real> Look<T> for Counting<'_, T> {
    #[inline(always)]
    fn look<I: Instructions>(&mut self, simd: I, i: usize, from: [T; 4], j: usize, block: &Block<T>) {
        let open = self.tally.add(simd, &self.limits, from, block);
        self.undecided.note(i, j, open);
    }

    #[inline(always)]
    fn goes_on(&mut self) -> bool {
        self.strips += 1;
        if self.strips.is_multiple_of(FLUSH) {
            self.flush();
        }
        self.overflown = self.undecided.is_overflown();
        !self.overflown
    }
}

impl<T: Real> Counting<'_, T> {
    #[inline(always)]
    fn flush(&mut self) {
        self.tally.flush(&mut self.below, &mut self.above);
    }
}

/// What has been counted, by lanes.
struct Tally<T> {
    below: Lanes<T>,
    above: Lanes<T>,
}

impl<T: Real> Tally<T> {
    #[inline(always)]
    fn new() -> Self {
        Tally { below: [T::ZERO; LANES], above: [T::ZERO; LANES] }
    }

    /// Count a match beside those of a block, and give the bits of those that are still to be decided.
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
        // Whether `open` is at least `possible`; asked this way round, because the other half of it never changes.
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
