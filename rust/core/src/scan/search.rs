//! The least time-to-collision of a scan, exactly, without computing all of them exactly.
//!
//! A time-to-collision is a division per beam, and only one beam matters. So the search is a branch and bound:
//!
//! 1. *Bound.* In the type of the ranges, and with as little arithmetic as possible, every beam gets a number that
//!    is not above its true value. Each block of beams keeps only its least bound.
//! 2. *Decide.* The block with the least bound is computed exactly, in `f64`. Then every other block whose bound
//!    does not exceed the best value so far. As bounds never lie above the truth, no better beam can be missed,
//!    however the bounds were rounded: rounding costs time, never the answer. Flat walls, where many beams tie
//!    within `f32`, are only more beams to decide.
//!
//! There are two ways to bound a beam. Driving straight, closing speed is `speed * cos(angle)`, and speed is a common
//! factor: the order of the beams does not depend on it, `clearance / |cos|` will do, and `1 / |cos|` is a table.
//! Any other motion has to divide.

use super::reading::Rules;
use super::tables::{Exact, Tables};
use super::tally::Tally;
use crate::column::Source;
use crate::lanes::{LANES, Lanes, each, keep_least, least};
use crate::real::Real;
use crate::simd::Kernel;

/// At most this many blocks, so that their bounds fit on the stack.
const BLOCKS: usize = 64;
/// At least this many groups in a block.
const GROUPS: usize = 8;

/// A number for each beam that is not above its time-to-collision times `scale`; NaN where the beam cannot close.
pub(super) trait Bound<T> {
    fn lanes(&self, group: usize, ranges: Lanes<T>) -> Lanes<T>;
    fn scale(&self) -> f64;
}

/// Bounds for a sensor that moves along the vehicle's x axis.
pub(super) struct Straight<'a, T> {
    tables: &'a Tables<T>,
    inverse: &'a [Lanes<T>],
    speed: f64,
}

impl<'a, T: Real> Straight<'a, T> {
    pub(super) fn new(tables: &'a Tables<T>, speed: f64) -> Self {
        let inverse = if speed > 0.0 { &tables.inverse_forward } else { &tables.inverse_reverse };
        Straight { tables, inverse, speed: speed.abs() }
    }
}

impl<T: Real> Bound<T> for Straight<'_, T> {
    #[inline(always)]
    fn lanes(&self, group: usize, ranges: Lanes<T>) -> Lanes<T> {
        let clearance = self.tables.clearance_below(group, ranges);
        let inverse = &self.inverse[group];
        std::array::from_fn(|lane| clearance[lane] * inverse[lane])
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        self.speed
    }
}

/// Bounds for any motion.
pub(super) struct Turning<'a, T> {
    tables: &'a Tables<T>,
    velocity: (T, T),
    slack: T,
}

impl<'a, T: Real> Turning<'a, T> {
    pub(super) fn new(tables: &'a Tables<T>, (vx, vy): (f64, f64)) -> Self {
        let slack = T::of((vx.abs() + vy.abs()) * T::SLACK.wide()) + T::TINY;
        Turning { tables, velocity: (T::of(vx), T::of(vy)), slack }
    }
}

impl<T: Real> Bound<T> for Turning<'_, T> {
    #[inline(always)]
    fn lanes(&self, group: usize, ranges: Lanes<T>) -> Lanes<T> {
        let clearance = self.tables.clearance_below(group, ranges);
        let (cos, sin) = (&self.tables.cos[group], &self.tables.sin[group]);
        let below_one = T::of(1.0) - T::SLACK;
        std::array::from_fn(|lane| {
            let closing = self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane] + self.slack;
            let bound = clearance[lane] / closing * below_one;
            if closing > T::ZERO { bound } else { T::NAN }
        })
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        1.0
    }
}

/// The search itself: what `tally` has seen when it ends decides the answer.
pub(super) struct Search<'a, 't, T, S, B, V> {
    pub ranges: S,
    pub rules: Rules<T>,
    pub bound: B,
    pub exact: Exact<'a>,
    pub tally: &'t mut V,
}

impl<T: Real, S: Source<T>, B: Bound<T>, V: Tally<T, S>> Kernel for Search<'_, '_, T, S, B, V> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let groups = self.ranges.len().div_ceil(LANES);
        let size = GROUPS.max(groups.div_ceil(BLOCKS));
        let blocks = groups.div_ceil(size);

        let mut bounds = [T::INFINITY; BLOCKS];
        for (block, bound) in bounds.iter_mut().enumerate().take(blocks) {
            *bound = self.bound_of(block * size, groups.min((block + 1) * size));
        }

        let first = (0..blocks).fold(0, |best, block| if bounds[block] < bounds[best] { block } else { best });
        self.decide(first * size, groups.min((first + 1) * size));
        for block in 0..blocks {
            if block != first && bounds[block] <= self.limit() {
                self.decide(block * size, groups.min((block + 1) * size));
            }
        }
    }
}

impl<T: Real, S: Source<T>, B: Bound<T>, V: Tally<T, S>> Search<'_, '_, T, S, B, V> {
    /// The usable ranges of a group.
    #[inline(always)]
    fn readings(&self, group: usize) -> Lanes<T> {
        each(self.ranges.lanes(group * LANES, T::NAN), |r| self.rules.usable(r))
    }

    /// The least bound of groups `from .. to`.
    #[inline(always)]
    fn bound_of(&self, from: usize, to: usize) -> T {
        let mut lowest = [T::INFINITY; LANES];
        for group in from..to {
            keep_least(&mut lowest, self.bound.lanes(group, self.readings(group)));
        }
        least(lowest)
    }

    /// Bounds above this cannot matter any more. Rounding it to `T` is covered by the slack in the bounds, and
    /// underflow by `TINY`.
    #[inline(always)]
    fn limit(&self) -> T {
        T::of(self.tally.limit() * self.bound.scale()) + T::TINY
    }

    /// Show the tally every beam of groups `from .. to` that may still matter.
    #[inline(always)]
    fn decide(&mut self, from: usize, to: usize) {
        for group in from..to {
            let readings = self.readings(group);
            if least(self.bound.lanes(group, readings)) <= self.limit() {
                let ttc = self.exact.ttc(group, each(readings, T::wide));
                if least(ttc) <= self.tally.limit() {
                    self.tally.show(group * LANES, &ttc, &self.ranges);
                }
            }
        }
    }
}
