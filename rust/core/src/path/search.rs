//! The first entry of a frame's points, exactly, without computing every point exactly.
//!
//! [`Bounds`] says of all points which can matter, in lanes of their own type: most can never enter within the horizon.
//! Of the few that may, [`least`] computes exactly those with the least bounds first, until no bound is below the best
//! time any more.
//!
//! The bounds rest on two facts, which hold for every static point, turning or not. What it keeps on its way is
//!
//! ```text
//! level(x, y) = vy x - vx y + omega/2 (x^2 + y^2)
//! ```
//!
//! so it can only enter where the outline has that level: a ring about the instantaneous centre, or a strip when
//! driving straight. And it keeps its speed, so it cannot enter sooner than the straight way to the outline takes.
//!
//! Both are computed with slack for every rounding: they let points through that do not matter, never the other way
//! round, so that rounding costs time, never the answer. Velocities are divided by the fastest, which keeps them near
//! 1: times become ways.

use super::frame::Frame;
use super::sweep::Sweep;
use crate::column::ColumnMut;
use crate::hit::Hit;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::status::Status;
use crate::vehicle::Outline;

/// What bounds when points enter, in one sweep.
#[derive(Clone, Copy)]
struct Bounds<T> {
    /// The scaled speed forward.
    vx: T,
    /// The scaled speed to the left.
    vy: T,
    /// The scaled yaw rate, 1/m.
    omega: T,
    /// Half the scaled yaw rate, 1/m.
    half: T,
    /// The outline, wider by how far positions may be off.
    outline: [T; 4],
    /// The least and the largest level of the outline.
    levels: (T, T),
    /// How far the square of a scaled speed may be off.
    slack: T,
    /// The speed that all are divided by, m/s. No point is faster.
    fastest: f64,
}

/// A group of points, by their bounds.
struct Bounded<T> {
    /// A bit for each point that may enter in time.
    bits: u16,
    /// For each point a number not above the square of its way until it enters; meaningless without its bit.
    ways: Lanes<T>,
}

impl<T: Real> Bounds<T> {
    /// Makes bounds for positions that are off by up to `error`, or `None` if nothing moves.
    fn new(sweep: &Sweep, error: f64) -> Option<Self> {
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

    /// Returns the square of the way that may be covered in `seconds`; points with ways above it cannot matter.
    #[inline(always)]
    fn limit(&self, seconds: f64) -> T {
        let way = self.fastest * seconds;
        T::from_f64(way * way * (1.0 + 4.0 * T::SLACK.to_f64())) + T::TINY
    }

    /// Bounds a group of points. A point whose x is NaN gets no bit.
    #[inline(always)]
    fn lanes<I: Instructions>(&self, simd: I, [x, y]: &[Lanes<T>; 2], limit: T) -> Bounded<T> {
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

/// Returns how far a coordinate is outside an interval.
#[inline(always)]
fn outside<T: Real>(value: T, low: T, high: T) -> T {
    let below = low - value;
    let above = value - high;
    let more = if below > above { below } else { above };
    if more > T::ZERO { more } else { T::ZERO }
}

/// Returns the least and the greatest value of `rate p + half p^2` on an interval.
fn range(rate: f64, half: f64, low: f64, high: f64) -> (f64, f64) {
    let value = |p: f64| p * (rate + half * p);
    let vertex = if half == 0.0 { low } else { (-rate / (2.0 * half)).clamp(low, high) };
    let values = [value(low), value(high), value(vertex)];
    (values.into_iter().fold(f64::INFINITY, f64::min), values.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// How many points are computed exactly before the bounds of the others are compared again. The number doubles each
/// time.
const FIRST: usize = 4;

/// A point that may enter.
#[derive(Clone, Copy)]
struct Candidate<T> {
    /// The square of the way that it needs at least.
    way: T,
    index: usize,
}

/// Returns the point that is hit first.
pub(super) fn least<T: Real>(level: Level, frame: impl Frame<T>, sweep: &Sweep) -> Hit {
    let mut best = Hit::NONE;
    let Some(bounds) = Bounds::new(sweep, frame.error(sweep.reach)) else { return best };
    let mut candidates = level.run(Gather { frame, bounds, limit: bounds.limit(sweep.horizon) });
    let (mut rest, mut few) = (candidates.as_mut_slice(), FIRST);
    while !rest.is_empty() {
        let count = few.min(rest.len());
        few = few.saturating_mul(2);
        rest.select_nth_unstable_by(count - 1, |a, b| a.way.partial_cmp(&b.way).unwrap_or(std::cmp::Ordering::Equal));
        let (first, others) = rest.split_at_mut(count);
        for candidate in first {
            if candidate.way <= bounds.limit(best.ttc) {
                best = decide(&frame, sweep, candidate.index).or(best);
            }
        }
        let limit = bounds.limit(best.ttc);
        let left = keep(others, |candidate| candidate.way <= limit);
        rest = &mut others[..left];
    }
    best
}

/// Returns every point that is hit.
pub(super) fn entering<T: Real>(level: Level, frame: impl Frame<T>, sweep: &Sweep) -> Vec<Hit> {
    let Some(bounds) = Bounds::new(sweep, frame.error(sweep.reach)) else { return Vec::new() };
    let candidates = level.run(Gather { frame, bounds, limit: bounds.limit(sweep.horizon) });
    candidates.into_iter().map(|candidate| decide(&frame, sweep, candidate.index)).filter(Hit::closes).collect()
}

/// Computes one point exactly.
#[inline(always)]
fn decide<T: Real>(frame: &impl Frame<T>, sweep: &Sweep, index: usize) -> Hit {
    Hit { ttc: sweep.ttc(frame.point(index), frame.touches(index)), index }
}

/// Moves the items that pass to the front, and returns how many there are.
fn keep<C: Copy>(items: &mut [C], passes: impl Fn(&C) -> bool) -> usize {
    let mut kept = 0;
    for i in 0..items.len() {
        if passes(&items[i]) {
            items[kept] = items[i];
            kept += 1;
        }
    }
    kept
}

/// Finds the points that may enter.
struct Gather<F, T> {
    frame: F,
    bounds: Bounds<T>,
    limit: T,
}

impl<T: Real, F: Frame<T>> Kernel for Gather<F, T> {
    type Output = Vec<Candidate<T>>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Vec<Candidate<T>> {
        let mut candidates = Vec::with_capacity(4 * LANES);
        for at in (0..self.frame.len()).step_by(LANES) {
            let Bounded { mut bits, ways } = self.bounds.lanes(simd, &self.frame.lanes(at), self.limit);
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                candidates.push(Candidate { way: ways[lane], index: at + lane });
            }
        }
        candidates
    }
}

/// Writes the times of all points into `out`, and what they mean into `status_out`.
pub(super) fn each<'o, T: Real>(
    level: Level,
    frame: impl Frame<T>,
    sweep: &Sweep,
    out: &mut ColumnMut<'o, T>,
    status_out: Option<&mut ColumnMut<'o, u8>>,
) {
    let bounds = Bounds::new(sweep, frame.error(sweep.reach));
    level.run(Each { frame, sweep, bounds, out, status_out });
}

/// Writes the times of all points.
struct Each<'a, 'o, T, F> {
    frame: F,
    sweep: &'a Sweep,
    bounds: Option<Bounds<T>>,
    out: &'a mut ColumnMut<'o, T>,
    status_out: Option<&'a mut ColumnMut<'o, u8>>,
}

impl<T: Real, F: Frame<T>> Kernel for Each<'_, '_, T, F> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(mut self, simd: I) {
        let limit = self.bounds.map_or(T::ZERO, |bounds| bounds.limit(self.sweep.horizon));
        for at in (0..self.frame.len()).step_by(LANES) {
            // The statuses come first: the points may be read from where `out` writes.
            let mut status = self.status_out.is_some().then(|| self.status(at));
            let points = self.frame.lanes(at);
            let bits = self.bounds.map_or(0, |bounds| bounds.lanes(simd, &points, limit).bits);
            let (ttc, hit) = self.decide(at, bits);
            self.out.set_lanes(at, ttc);
            if let (Some(status), Some(status_out)) = (status.as_mut(), self.status_out.as_mut()) {
                for lane in 0..LANES {
                    let closes = hit >> lane & 1 == 1 && status[lane] == Status::NotClosing as u8;
                    status[lane] = if closes { Status::Closing as u8 } else { status[lane] };
                }
                status_out.set_lanes(at, *status);
            }
        }
    }
}

impl<T: Real, F: Frame<T>> Each<'_, '_, T, F> {
    /// Returns the times of the points with a bit, and a bit for each that is hit.
    #[inline(always)]
    fn decide(&self, at: usize, mut bits: u16) -> (Lanes<T>, u16) {
        let (mut times, mut hit) = ([T::INFINITY; LANES], 0);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let decided = decide(&self.frame, self.sweep, at + lane);
            times[lane] = T::from_f64(decided.ttc);
            hit |= u16::from(decided.closes()) << lane;
        }
        (times, hit)
    }

    /// Returns what the points mean unless they are going to be hit.
    fn status(&self, at: usize) -> Lanes<u8> {
        let status =
            |index| if index < self.frame.len() { self.frame.status(index, self.sweep) } else { Status::Clear };
        std::array::from_fn(|lane| status(at + lane) as u8)
    }
}
