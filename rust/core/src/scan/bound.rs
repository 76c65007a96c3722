//! Bounds on the time-to-collision of beams, in `f32`.
//!
//! There are two ways to bound. When the sensor moves straight ahead or back, the closing speed is `speed *
//! cos(angle)`, and the speed is a common factor: the order of the beams does not depend on it, and `clearance / |cos|`
//! is enough, where `1 / |cos|` is a table. Any other motion takes a division.

use super::tables::{Ahead, Block, Blocks};
use crate::lanes::{LANES, Lanes, each, lanes};
use crate::real::Real;
use crate::simd::Instructions;
use std::ops::Range;

/// Bounds on `scale` times the time-to-collision of beams.
pub(super) trait Bound: Copy {
    /// Returns the blocks that have a beam that may close.
    fn blocks<I: Instructions>(&self, simd: I) -> Range<usize>;
    /// Returns for each lane a number not above that of the beam with this range; NaN where the range is below `low` or
    /// none, and where the beam certainly does not close.
    fn below<I: Instructions>(&self, simd: I, block: usize, group: usize, ranges: &Lanes<f32>, low: f32) -> Lanes<f32>;
    /// Returns the factor of all times.
    fn scale(&self) -> f64;
}

/// Bounds for a sensor that moves along the vehicle's x axis.
#[derive(Clone, Copy)]
pub(super) struct Straight<'a> {
    inverse: &'a [Block],
    inside: &'a [Block],
    speed: f64,
}

impl<'a> Straight<'a> {
    #[inline(always)]
    pub(super) fn new(ahead: &'a Ahead, speed: f64) -> Self {
        let Ahead { inverse, inside, .. } = ahead;
        Straight { inverse, inside: &inside[..inverse.len()], speed: speed.abs() }
    }
}

impl Bound for Straight<'_> {
    #[inline(always)]
    fn blocks<I: Instructions>(&self, _: I) -> Range<usize> {
        0..self.inverse.len()
    }

    #[inline(always)]
    fn below<I: Instructions>(&self, _: I, block: usize, group: usize, ranges: &Lanes<f32>, low: f32) -> Lanes<f32> {
        let (inverse, inside) = (&self.inverse[block].0[group], &self.inside[block].0[group]);
        lanes(|lane| {
            let bound = I::mul_add(ranges[lane], inverse[lane], -inside[lane]);
            if ranges[lane] >= low { bound } else { f32::NAN }
        })
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        self.speed
    }
}

/// Bounds for any motion.
#[derive(Clone, Copy)]
pub(super) struct Turning<'a> {
    blocks: &'a Blocks,
    velocity: (f32, f32),
    slack: f32,
    least_closing: f32,
}

impl<'a> Turning<'a> {
    #[inline(always)]
    pub(super) fn new(blocks: &'a Blocks, (vx, vy): (f64, f64), min_closing_speed: f64) -> Self {
        // Faster than it is by more than all roundings of the tables and of the bound.
        let slack = f32::from_f64((vx.abs() + vy.abs()) * f32::SLACK.to_f64()) + f32::TINY;
        let faster = 1.0 + f32::SLACK.to_f64();
        let velocity = (f32::from_f64(vx * faster), f32::from_f64(vy * faster));
        let least_closing = f32::from_f64(min_closing_speed).max(f32::TINY);
        Turning { blocks, velocity, slack, least_closing }
    }

    /// Returns closing speeds in some directions, not below the true ones.
    #[inline(always)]
    fn closing<I: Instructions>(&self, cos: &Lanes<f32>, sin: &Lanes<f32>, slack: f32) -> Lanes<f32> {
        lanes(|lane| I::mul_add(self.velocity.0, cos[lane], I::mul_add(self.velocity.1, sin[lane], slack)))
    }
}

impl Bound for Turning<'_> {
    #[inline(always)]
    fn blocks<I: Instructions>(&self, simd: I) -> Range<usize> {
        let (vx, vy) = self.velocity;
        let slack = (vx.abs() + vy.abs()) * self.blocks.spread + self.slack;
        let (mut first, mut end) = (0, 0);
        for (at, [cos, sin]) in self.blocks.middle.iter().enumerate() {
            let receding = each(self.closing::<I>(cos, sin, slack), |closing| -closing);
            let closing = u32::from(simd.at_most_f32(&receding, -self.least_closing));
            if closing != 0 {
                first = if end == 0 { at * LANES + closing.trailing_zeros() as usize } else { first };
                end = at * LANES + (u32::BITS - closing.leading_zeros()) as usize;
            }
        }
        first..end
    }

    #[inline(always)]
    fn below<I: Instructions>(&self, simd: I, block: usize, group: usize, ranges: &Lanes<f32>, low: f32) -> Lanes<f32> {
        let Blocks { cos, sin, offset, .. } = self.blocks;
        let offset = &offset[block].0[group];
        let closing = self.closing::<I>(&cos[block].0[group], &sin[block].0[group], self.slack);
        let inverse = simd.reciprocal_f32(&closing);
        lanes(|lane| {
            let bound = (ranges[lane] - offset[lane]) * inverse[lane];
            let bound = if ranges[lane] >= low { bound } else { f32::NAN };
            if closing[lane] >= self.least_closing { bound } else { f32::NAN }
        })
    }

    #[inline(always)]
    fn scale(&self) -> f64 {
        1.0
    }
}
