//! The least time-to-collision of a scan, exactly, without computing all of them exactly.
//!
//! A time-to-collision is a division per beam, and only one beam matters. So the search is a branch and bound:
//!
//! 1. *Bound.* In the type of the ranges, and with as little arithmetic as possible, every beam gets a number that
//!    is not above its true value. Each block of beams keeps only its least bound.
//! 2. *Decide.* The beams with the least bound, or nearly, are computed exactly, in `f64`. Then every other beam whose
//!    bound does not exceed the best value so far. As bounds never lie above the truth, no better beam can be missed,
//!    however the bounds were rounded: rounding costs time, never the answer. Flat walls, where many beams tie
//!    within `f32`, are only more beams to decide.
//!
//! There are two ways to bound a beam. Driving straight, closing speed is `speed * cos(angle)`, and speed is a common
//! factor: the order of the beams does not depend on it, `clearance / |cos|` will do, and `1 / |cos|` is a table.
//! Any other motion has to divide.

use super::reading::Rules;
use super::tables::{Exact, Tables};
use super::vote::Best;
use crate::column::Source;
use crate::lanes::{LANES, Lanes, each, keep_least, least, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};

/// At most this many blocks, so that their bounds fit on the stack.
const BLOCKS: usize = 64;
/// At least this many groups in a block.
const GROUPS: usize = 4;

/// A number for each beam that is not above its time-to-collision times `scale`; NaN where it cannot have any.
///
/// Beams that have none may get a number all the same: deciding will find out. Readings of -inf are left to the search.
pub(super) trait Bound<T> {
    fn lanes(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T>;
    fn scale(&self) -> f64;
}

/// Bounds for a sensor that moves along the vehicle's x axis, with ranges taken as they are.
pub(super) struct Straight<'a, T> {
    inverse: &'a [T],
    offset: &'a [T],
    range_min: T,
    speed: f64,
}

impl<'a, T: Real> Straight<'a, T> {
    pub(super) fn new(tables: &'a Tables<T>, rules: &Rules<T>, speed: f64) -> Self {
        let inverse = if speed > 0.0 { &tables.inverse_forward } else { &tables.inverse_reverse };
        Straight { inverse, offset: &tables.offset_above, range_min: rules.range_min, speed: speed.abs() }
    }
}

impl<T: Real> Bound<T> for Straight<'_, T> {
    #[inline(always)]
    fn lanes(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (inverse, offset) = (window(self.inverse, at), window(self.offset, at));
        std::array::from_fn(|lane| {
            let range = if ranges[lane] >= self.range_min { ranges[lane] } else { T::NAN };
            (range - offset[lane]) * inverse[lane]
        })
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        self.speed
    }
}

/// Bounds for any motion and any rules.
pub(super) struct Turning<'a, T> {
    tables: &'a Tables<T>,
    rules: Rules<T>,
    velocity: (T, T),
    slack: T,
}

impl<'a, T: Real> Turning<'a, T> {
    pub(super) fn new(tables: &'a Tables<T>, rules: Rules<T>, (vx, vy): (f64, f64)) -> Self {
        let slack = T::of((vx.abs() + vy.abs()) * T::SLACK.wide()) + T::TINY;
        Turning { tables, rules, velocity: (T::of(vx), T::of(vy)), slack }
    }
}

impl<T: Real> Bound<T> for Turning<'_, T> {
    #[inline(always)]
    fn lanes(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (cos, sin) = (window(&self.tables.cos, at), window(&self.tables.sin, at));
        let offset = window(&self.tables.offset_above, at);
        let below_one = T::of(1.0) - T::SLACK;
        std::array::from_fn(|lane| {
            let range = if ranges[lane] >= self.rules.range_min { ranges[lane] } else { T::NAN };
            let range = if range > self.rules.clamp.1 { self.rules.clamp.1 } else { range };
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
    pub rules: Rules<T>,
    pub bound: B,
    pub exact: Exact<'a>,
    /// The least so far: `Best::NONE` to begin with.
    pub best: Best,
}

impl<T: Real, S: Source<T>, B: Bound<T>> Kernel for Search<'_, T, S, B> {
    type Output = Best;

    #[inline(always)]
    fn run<I: Instructions>(mut self, _: I) -> Best {
        let groups = self.ranges.len().div_ceil(LANES);
        let size = groups.div_ceil(BLOCKS).max(GROUPS);
        let blocks = groups.div_ceil(size);
        let block = |block: usize| (block * size, groups.min((block + 1) * size));

        let mut bounds = [[T::ZERO; LANES]; BLOCKS];
        let mut lowest = [T::INFINITY; LANES];
        for (i, bound) in bounds.iter_mut().enumerate().take(blocks) {
            *bound = self.bound_of(block(i));
            keep_least(&mut lowest, *bound);
        }

        // The beams with the least bound, or nearly: usually the best is among them.
        let lowest = least(lowest);
        let cap = if lowest > T::ZERO { lowest + lowest * (T::SLACK + T::SLACK) } else { T::TINY };
        self.decide_blocks(&bounds[..blocks], block, cap);
        if self.limit() > cap {
            self.decide_blocks(&bounds[..blocks], block, T::INFINITY);
        }
        self.best
    }
}

impl<T: Real, S: Source<T>, B: Bound<T>> Search<'_, T, S, B> {
    /// Where a group begins, and its ranges. The last group overlaps the one before it rather than be a short one:
    /// seeing a beam twice does no harm, and short loads are slow.
    #[inline(always)]
    fn group(&self, group: usize) -> (usize, Lanes<T>) {
        let at = (group * LANES).min(self.ranges.len() - LANES);
        (at, self.ranges.lanes(at))
    }

    /// The least bounds of some groups, lane by lane.
    #[inline(always)]
    fn bound_of(&self, (from, to): (usize, usize)) -> Lanes<T> {
        let mut lowest = [T::INFINITY; LANES];
        let mut nearest = [T::INFINITY; LANES];
        for group in from..to {
            let (at, ranges) = self.group(group);
            keep_least(&mut lowest, self.bound.lanes(at, &ranges));
            keep_least(&mut nearest, ranges);
        }
        // A reading of -inf may be a hit at any distance down to 0.
        keep_least(
            &mut lowest,
            each(nearest, |range| if range == T::ZERO - T::INFINITY { T::ZERO } else { T::INFINITY }),
        );
        lowest
    }

    /// Bounds above this cannot matter any more. Rounding it to `T` is covered by the slack in the bounds, and
    /// underflow by `TINY`.
    #[inline(always)]
    fn limit(&self) -> T {
        T::of(self.best.ttc * self.bound.scale()) + T::TINY
    }

    /// Compute the beams, in blocks with such bounds, that may still matter and whose bound is not above `cap`.
    #[inline(always)]
    fn decide_blocks(&mut self, bounds: &[Lanes<T>], block: impl Fn(usize) -> (usize, usize), cap: T) {
        for (i, bounds) in bounds.iter().enumerate() {
            let limit = if cap < self.limit() { cap } else { self.limit() };
            if any(bounds, |bound| bound <= limit) {
                self.decide(block(i), cap);
            }
        }
    }

    #[inline(always)]
    fn decide(&mut self, (from, to): (usize, usize), cap: T) {
        for group in from..to {
            let (at, ranges) = self.group(group);
            let limit = if cap < self.limit() { cap } else { self.limit() };
            let bounds = self.bound.lanes(at, &ranges);
            let minus_infinity = |range: T| range == T::ZERO - T::INFINITY;
            if any(&bounds, |bound| bound <= limit) | any(&ranges, minus_infinity) {
                for lane in 0..LANES {
                    if bounds[lane] <= limit || minus_infinity(ranges[lane]) {
                        self.decide_beam(at + lane, ranges[lane]);
                    }
                }
            }
        }
    }

    /// Few beams come here.
    #[inline(always)]
    fn decide_beam(&mut self, beam: usize, range: T) {
        let candidate = Best { ttc: self.exact.ttc(beam, self.rules.usable(range).wide()), beam };
        if candidate.closes() && candidate.precedes(&self.best) {
            self.best = candidate;
        }
    }
}

/// Whether a condition holds in any lane.
#[inline(always)]
fn any<T: Copy>(x: &Lanes<T>, condition: impl Fn(T) -> bool) -> bool {
    x.iter().fold(false, |any, value| any | condition(*value))
}
