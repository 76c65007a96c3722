//! The least time-to-collision of a scan, exactly, without computing all of them exactly.
//!
//! A time-to-collision is a division per beam, and only one beam matters. So the search is a branch and bound, from
//! coarse to fine, and in the type of the ranges until the end:
//!
//! 1. *Blocks.* Each lane of a block of beams keeps only the least valid reading it sees, and gets a number that is not above
//!    the true value of any of its beams: that reading, with the least favourable offset and direction among them.
//! 2. *Groups.* The block with the least bound is looked at first, then every other whose bound does not exceed the best
//!    value so far. There every beam gets a bound of its own.
//! 3. *Beams.* A group of beams whose bounds do not exceed the best so far is computed exactly, in `f64` and in lanes.
//!
//! As bounds never lie above the truth, no better beam can be missed, however the bounds were rounded: rounding costs
//! time, never the answer. Flat walls, where many beams tie within `f32`, are only more groups to compute.
//!
//! There are two ways to bound, the same for blocks and beams. Driving straight, closing speed is `speed * cos(angle)`, and
//! speed is a common factor: the order of the beams does not depend on it, `clearance / |cos|` will do, and `1 / |cos|` is
//! a table. Any other motion has to divide.

use super::reading::Rules;
use super::tables::{BLOCKS, Envelope, Exact, Tables, start};
use super::vote::Best;
use crate::column::Source;
use crate::lanes::{LANES, Lanes, each, lanes, least, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};
use arrayvec::ArrayVec;

/// A number for each lane that is not above the time-to-collision times `scale` of any range from `ranges` up, along any
/// beam in the lane's envelope; NaN where there cannot be any.
pub(super) trait Bound<T> {
    fn lanes(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T>;
    fn scale(&self) -> f64;
}

/// Bounds for a sensor that moves along the vehicle's x axis, with ranges taken as they are.
pub(super) struct Straight<'a, T> {
    inverse: &'a [T],
    offset: &'a [T],
    speed: f64,
}

impl<'a, T: Real> Straight<'a, T> {
    pub(super) fn new(envelope: &'a Envelope<T>, speed: f64) -> Self {
        let inverse = if speed > 0.0 { &envelope.inverse_forward } else { &envelope.inverse_reverse };
        Straight { inverse, offset: &envelope.offset, speed: speed.abs() }
    }
}

impl<T: Real> Bound<T> for Straight<'_, T> {
    #[inline(always)]
    fn lanes(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (inverse, offset) = (window(self.inverse, at), window(self.offset, at));
        lanes(|lane| (ranges[lane] - offset[lane]) * inverse[lane])
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        self.speed
    }
}

/// Bounds for any motion and any rules.
pub(super) struct Turning<'a, T> {
    envelope: &'a Envelope<T>,
    farthest: T,
    velocity: (T, T),
    slack: T,
}

impl<'a, T: Real> Turning<'a, T> {
    pub(super) fn new(envelope: &'a Envelope<T>, rules: &Rules<T>, (vx, vy): (f64, f64)) -> Self {
        let slack = T::of((vx.abs() + vy.abs()) * (T::SLACK.wide() + envelope.spread.wide())) + T::TINY;
        Turning { envelope, farthest: rules.clamp.1, velocity: (T::of(vx), T::of(vy)), slack }
    }
}

impl<T: Real> Bound<T> for Turning<'_, T> {
    #[inline(always)]
    fn lanes(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (cos, sin) = (window(&self.envelope.cos, at), window(&self.envelope.sin, at));
        let offset = window(&self.envelope.offset, at);
        let below_one = T::of(1.0) - T::SLACK;
        lanes(|lane| {
            let range = if ranges[lane] > self.farthest { self.farthest } else { ranges[lane] };
            let closing = self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane] + self.slack;
            let bound = (range - offset[lane]) / closing * below_one;
            if closing > T::ZERO { bound } else { T::NAN }
        })
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        1.0
    }
}

/// The search itself.
pub(super) struct Search<'a, T, S, B> {
    /// At least one group of lanes of them.
    pub ranges: S,
    pub rules: &'a Rules<T>,
    pub tables: &'a Tables<T>,
    /// Of each beam.
    pub beams: B,
    /// Of the lanes of each block.
    pub blocks: B,
    pub exact: Exact<'a>,
}

impl<T: Real, S: Source<T>, B: Bound<T>> Kernel for Search<'_, T, S, B> {
    type Output = Best;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Best {
        let mut bounds = ArrayVec::<Lanes<T>, BLOCKS>::new();
        let mut lowest = [T::INFINITY; LANES];
        for block in 0..self.tables.blocks() {
            let bound = self.bound_of(simd, block);
            T::keep_least(simd, &mut lowest, &bound);
            bounds.push(bound);
        }
        // The block that promises most comes first: usually the best beam is there, and excludes the other blocks.
        let lowest = least(lowest);
        let first = bounds.iter().position(|bound| reaches(simd, bound, lowest));
        let mut best = Best::NONE;
        for (turn, block) in first.into_iter().chain(0..bounds.len()).enumerate() {
            let is_new = turn == 0 || first != Some(block);
            if is_new && reaches(simd, &bounds[block], self.limit(best)) {
                best = self.decided(simd, block, best);
            }
        }
        best
    }
}

impl<T: Real, S: Source<T>, B: Bound<T>> Search<'_, T, S, B> {
    /// Bounds of the least reading that each lane of a block sees.
    #[inline(always)]
    fn bound_of<I: Instructions>(&self, simd: I, block: usize) -> Lanes<T> {
        let low = self.rules.range_min;
        let (mut nearest, mut lowest) = ([T::INFINITY; LANES], [T::INFINITY; LANES]);
        for group in self.tables.groups(block) {
            let ranges: Lanes<T> = self.ranges.lanes(start(group, self.ranges.len()));
            let valid = each(ranges, |range| if range >= low { range } else { T::NAN });
            T::keep_least(simd, &mut nearest, &valid);
            T::keep_least(simd, &mut lowest, &ranges);
        }
        // A reading of -inf may be a hit at any distance down to 0.
        let minus_infinity = T::ZERO - T::INFINITY;
        let nearest = lanes(|lane| if lowest[lane] == minus_infinity { T::ZERO } else { nearest[lane] });
        self.blocks.lanes(block * LANES, &nearest)
    }

    /// Bounds above this cannot matter any more. Rounding it to `T` is covered by the slack in the bounds, and
    /// underflow by `TINY`.
    #[inline(always)]
    fn limit(&self, best: Best) -> T {
        T::of(best.ttc * self.beams.scale()) + T::TINY
    }

    /// The best after the groups of a block that may still matter are computed.
    #[inline(always)]
    fn decided<I: Instructions>(&self, simd: I, block: usize, mut best: Best) -> Best {
        let rules = *self.rules; // a copy: what lies behind a reference is only read where a lane needs it
        for group in self.tables.groups(block) {
            let at = start(group, self.ranges.len());
            let usable = each(self.ranges.lanes(at), |range| rules.usable(range));
            if reaches(simd, &self.beams.lanes(at, &usable), self.limit(best)) {
                let candidate = self.best_of(simd, at, &usable);
                best = if candidate.closes() && candidate.precedes(&best) { candidate } else { best };
            }
        }
        best
    }

    /// The best of a group. In lanes, all of its beams cost little more than one.
    #[inline(always)]
    fn best_of<I: Instructions>(&self, simd: I, at: usize, ranges: &Lanes<T>) -> Best {
        let ttc = self.exact.ttc_lanes(at, ranges);
        let lowest = least(ttc);
        let ties = f64::within(simd, &ttc, &[lowest; LANES], &[lowest; LANES]);
        Best { ttc: lowest, beam: at + ties.trailing_zeros() as usize }
    }
}

/// Whether the bound of any lane is not above `limit`.
#[inline(always)]
fn reaches<T: Real, I: Instructions>(simd: I, bounds: &Lanes<T>, limit: T) -> bool {
    T::within(simd, bounds, &[T::ZERO - T::INFINITY; LANES], &[limit; LANES]) != 0
}
