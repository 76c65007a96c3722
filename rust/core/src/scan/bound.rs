//! Bounds on the time-to-collision of beams, in the type of the ranges.
//!
//! There are two ways to bound. Driving straight, closing speed is `speed * cos(angle)`, and speed is a common factor: the order
//! of the beams does not depend on it, `clearance / |cos|` will do, and `1 / |cos|` is a table. Any other motion has to
//! divide.

use super::readings::Rules;
use super::tables::Envelope;
use crate::lanes::{Lanes, lanes, window};
use crate::real::Real;

/// What bounds the time-to-collision times `scale` of the beams in each lane of an envelope.
pub(super) trait Bound<T> {
    /// Not above that of any beam with any range from `ranges` up; NaN where there cannot be any.
    fn below(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T>;
    /// Not below that of the one beam in each lane, with just these ranges; NaN where it may be infinite.
    fn above(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T>;
    fn scale(&self) -> f64;
}

/// Bounds for a sensor that moves along the vehicle's x axis, with ranges taken as they are.
pub(super) struct Straight<'a, T> {
    inverse: &'a [T],
    offset: &'a [T],
    speed: f64,
    /// Beams with a smaller inverse close fast enough to count, for certain.
    largest_inverse: T,
}

impl<'a, T: Real> Straight<'a, T> {
    #[inline(always)]
    pub(super) fn new(envelope: &'a Envelope<T>, speed: f64, min_closing_speed: f64) -> Self {
        let inverse = if speed > 0.0 { &envelope.inverse_forward } else { &envelope.inverse_reverse };
        let largest_inverse = T::from_f64(speed.abs() / min_closing_speed) * just_below_one();
        Straight { inverse, offset: &envelope.offset, speed: speed.abs(), largest_inverse }
    }
}

impl<T: Real> Bound<T> for Straight<'_, T> {
    #[inline(always)]
    fn below(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (inverse, offset) = (window(self.inverse, at), window(self.offset, at));
        lanes(|lane| (ranges[lane] - offset[lane]) * inverse[lane])
    }

    #[inline(always)]
    fn above(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (inverse, offset) = (window(self.inverse, at), window(self.offset, at));
        lanes(|lane| {
            let above = clearance_above(ranges[lane], offset[lane]) * inverse[lane] * just_above_one();
            if inverse[lane] < self.largest_inverse { above } else { T::NAN }
        })
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
    min_closing_speed: T,
}

impl<'a, T: Real> Turning<'a, T> {
    #[inline(always)]
    pub(super) fn new(
        envelope: &'a Envelope<T>,
        rules: &Rules<T>,
        (vx, vy): (f64, f64),
        min_closing_speed: f64,
    ) -> Self {
        let slack = T::from_f64((vx.abs() + vy.abs()) * (T::SLACK.to_f64() + envelope.spread.to_f64())) + T::TINY;
        let (velocity, min_closing_speed) = ((T::from_f64(vx), T::from_f64(vy)), T::from_f64(min_closing_speed));
        Turning { envelope, farthest: rules.clamp.1, velocity, slack, min_closing_speed }
    }

    /// Closing speeds in the middle of the envelope; no beam's is farther from it than `slack`.
    #[inline(always)]
    fn closing(&self, at: usize) -> Lanes<T> {
        let (cos, sin) = (window(&self.envelope.cos, at), window(&self.envelope.sin, at));
        lanes(|lane| self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane])
    }
}

impl<T: Real> Bound<T> for Turning<'_, T> {
    #[inline(always)]
    fn below(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (closing, offset) = (self.closing(at), window(&self.envelope.offset, at));
        let below_one = T::from_f64(1.0) - T::SLACK;
        lanes(|lane| {
            let range = if ranges[lane] > self.farthest { self.farthest } else { ranges[lane] };
            let closing = closing[lane] + self.slack;
            let bound = (range - offset[lane]) / closing * below_one;
            if closing > T::ZERO { bound } else { T::NAN }
        })
    }

    #[inline(always)]
    fn above(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T> {
        let (closing, offset) = (self.closing(at), window(&self.envelope.offset, at));
        lanes(|lane| {
            let closing = closing[lane] - self.slack;
            let above = clearance_above(ranges[lane], offset[lane]) / closing * just_above_one();
            if closing > self.min_closing_speed { above } else { T::NAN }
        })
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        1.0
    }
}

/// Not below the true clearance; offsets in tables are not below the true ones, by a few roundings.
#[inline(always)]
fn clearance_above<T: Real>(range: T, offset: T) -> T {
    let clearance = range - offset * just_below_one();
    // In contact the time is 0. A comparison with NaN is false, so that it stays.
    if clearance < T::ZERO { T::ZERO } else { clearance }
}

/// Farther from one than all roundings of a table and a bound together.
#[inline(always)]
fn just_above_one<T: Real>() -> T {
    T::from_f64(1.0 + 4.0 * T::SLACK.to_f64())
}

#[inline(always)]
fn just_below_one<T: Real>() -> T {
    T::from_f64(1.0 - 4.0 * T::SLACK.to_f64())
}
