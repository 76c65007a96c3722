//! Bounds on the time-to-collision of beams, in the type of the ranges.
//!
//! There are two ways to bound. When the sensor moves straight ahead or back, the closing speed is `speed *
//! cos(angle)`, and the speed is a common factor: the order of the beams does not depend on it, and `clearance / |cos|`
//! is enough, where `1 / |cos|` is a table. Any other motion takes a division.

use super::readings::Rules;
use super::tables::Envelope;
use crate::lanes::{Lanes, lanes, window};
use crate::real::Real;

/// Bounds on `scale` times the time-to-collision of the beams in each lane of an envelope.
pub(super) trait Bound<T> {
    /// Returns for each lane a number not above that of any beam with any range from `ranges` up; NaN where no beam can
    /// close.
    fn below(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T>;
    /// Returns for each lane a number not below that of its one beam with just this range; NaN where that may be
    /// infinite.
    fn above(&self, at: usize, ranges: &Lanes<T>) -> Lanes<T>;
    /// Returns the factor of all times.
    fn scale(&self) -> f64;
}

/// Bounds for a sensor that moves along the vehicle's x axis, with ranges taken as they are.
pub(super) struct Straight<'a, T> {
    inverse: &'a [T],
    offset: &'a [T],
    speed: f64,
    /// A beam with a smaller inverse certainly closes fast enough to count.
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

    /// Returns the closing speeds in the middle of the envelope. No beam's closing speed differs by more than `slack`.
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

/// Returns a number not below the true clearance, from an offset that is above the true one by a few roundings at most.
#[inline(always)]
fn clearance_above<T: Real>(range: T, offset: T) -> T {
    let clearance = range - offset * just_below_one();
    // In contact the time is 0. A comparison with NaN is false, so that NaN stays.
    if clearance < T::ZERO { T::ZERO } else { clearance }
}

/// Returns a number farther above 1 than all roundings of a table and a bound together.
#[inline(always)]
fn just_above_one<T: Real>() -> T {
    T::from_f64(1.0 + 4.0 * T::SLACK.to_f64())
}

/// Returns a number farther below 1 than all roundings of a table and a bound together.
#[inline(always)]
fn just_below_one<T: Real>() -> T {
    T::from_f64(1.0 - 4.0 * T::SLACK.to_f64())
}
