//! Which points cannot matter, without knowing when they enter.
//!
//! Two facts hold for every static point, turning or not. What it keeps on its way is
//!
//! ```text
//! level(x, y) = vy x - vx y + omega/2 (x^2 + y^2)
//! ```
//!
//! so it can only enter where the outline has that level: a ring about the instantaneous centre, or a strip when driving
//! straight. And it keeps its speed, so it cannot enter sooner than the straight way to the outline takes.
//!
//! Both are computed in lanes of the points' own type, with slack for every rounding: they let points through that do not
//! matter, never the other way round. Velocities are divided by the fastest, which keeps them near 1: times become ways.

use super::entry::Sweep;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::Instructions;
use crate::vehicle::Outline;

/// A sweep, as the bounds see it.
#[derive(Clone, Copy)]
pub(super) struct Bounds<T> {
    vx: T,
    vy: T,
    omega: T,
    half: T,
    /// The outline, wider by what positions may be off.
    outline: [T; 4],
    /// The levels of the outline.
    levels: (T, T),
    /// What the square of a speed may be off.
    slack: T,
    fastest: f64,
}

/// Points, by their bounds.
pub(super) struct Bounded<T> {
    /// A bit for each that may enter in time.
    pub bits: u16,
    /// Not above the square of the way until it enters; meaningless without its bit.
    pub ways: Lanes<T>,
}

impl<T: Real> Bounds<T> {
    /// Bounds for positions that are off by up to `error`, or `None` if nothing moves.
    pub(super) fn new(sweep: &Sweep, error: f64) -> Option<Self> {
        let Sweep { vx, vy, omega, reach, .. } = *sweep;
        let fastest = vx.abs() + vy.abs() + omega.abs() * reach;
        if fastest == 0.0 {
            return None;
        }
        let (vx, vy, half) = (vx / fastest, vy / fastest, omega / fastest / 2.0);
        let Outline { x_rear, x_front, y_right, y_left } = sweep.outline;
        let rounding = 2.0 * T::SLACK.to_f64();
        let off = error + 4.0 * sweep.touch + rounding * reach;
        let (x_low, x_high) = range(vy, half, x_rear, x_front);
        let (y_low, y_high) = range(-vx, half, y_right, y_left);
        Some(Bounds {
            vx: T::from_f64(vx),
            vy: T::from_f64(vy),
            omega: T::from_f64(2.0 * half),
            half: T::from_f64(half),
            outline: [
                T::not_above(x_rear - off),
                T::not_below(x_front + off),
                T::not_above(y_right - off),
                T::not_below(y_left + off),
            ],
            levels: (T::not_above(x_low + y_low - 3.0 * off), T::not_below(x_high + y_high + 3.0 * off)),
            slack: T::not_below(2.0 * rounding + 4.0 * off / reach),
            fastest,
        })
    }

    /// The square of the way that may be covered in `seconds`; bounds above it cannot matter.
    #[inline(always)]
    pub(super) fn limit(&self, seconds: f64) -> T {
        let way = self.fastest * seconds;
        T::from_f64(way * way * (1.0 + 4.0 * T::SLACK.to_f64())) + T::TINY
    }

    /// Bounds of points of which none that is not a number counts.
    #[inline(always)]
    pub(super) fn lanes<I: Instructions>(&self, simd: I, [x, y]: &[Lanes<T>; 2], limit: T) -> Bounded<T> {
        let level: Lanes<T> = std::array::from_fn(|lane| {
            x[lane] * (self.vy + self.half * x[lane]) + y[lane] * (self.half * y[lane] - self.vx)
        });
        let [x_rear, x_front, y_right, y_left] = self.outline;
        let ways = std::array::from_fn(|lane| {
            let (dx, dy) = (outside(x[lane], x_rear, x_front), outside(y[lane], y_right, y_left));
            let (sx, sy) = (self.omega * y[lane] - self.vx, self.omega * x[lane] + self.vy);
            (dx * dx + dy * dy) / (sx * sx + sy * sy + self.slack)
        });
        let in_ring = T::within(simd, &level, &[self.levels.0; LANES], &[self.levels.1; LANES]);
        Bounded { bits: in_ring & T::within(simd, &ways, &[T::ZERO; LANES], &[limit; LANES]), ways }
    }
}

/// How far a coordinate is outside an interval.
#[inline(always)]
fn outside<T: Real>(value: T, low: T, high: T) -> T {
    let below = low - value;
    let above = value - high;
    let more = if below > above { below } else { above };
    if more > T::ZERO { more } else { T::ZERO }
}

/// Least and greatest value of `rate p + half p^2` on an interval.
fn range(rate: f64, half: f64, low: f64, high: f64) -> (f64, f64) {
    let value = |p: f64| p * (rate + half * p);
    let vertex = if half == 0.0 { low } else { (-rate / (2.0 * half)).clamp(low, high) };
    let values = [value(low), value(high), value(vertex)];
    (values.into_iter().fold(f64::INFINITY, f64::min), values.into_iter().fold(f64::NEG_INFINITY, f64::max))
}
