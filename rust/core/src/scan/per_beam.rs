//! The time-to-collision of every beam, in the type of the ranges.

use super::reading::Rules;
use super::tables::Tables;
use crate::column::{Sink, Source};
use crate::lanes::{LANES, Lanes, each, lanes, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};
use crate::status::Status;

/// Closing speeds of beams, and how long clearances last at them.
pub(super) trait Pace<T>: Copy {
    fn closing(&self, at: usize) -> Lanes<T>;
    /// Clearance over closing speed, where that is positive.
    fn times(&self, at: usize, clearance: &Lanes<T>, closing: &Lanes<T>) -> Lanes<T>;
}

/// The pace of a sensor that moves along the vehicle's x axis. A multiplication takes a fraction of a division's time.
#[derive(Clone, Copy)]
pub(super) struct Straight<'a, T> {
    cos: &'a [T],
    inverse: &'a [T],
    speed: T,
    per_speed: T,
}

impl<'a, T: Real> Straight<'a, T> {
    /// If the velocity is such a one, and no product with `1 / velocity` can overflow or lose digits.
    pub(super) fn new(tables: &'a Tables<T>, (vx, vy): (f64, f64)) -> Option<Self> {
        let (cos, inverse) = (&tables.beams.cos, &tables.inverse);
        let straight = Straight { cos, inverse, speed: T::of(vx), per_speed: T::of(1.0 / vx) };
        (vy == 0.0 && (1e-3..1e6).contains(&vx.abs())).then_some(straight)
    }
}

impl<T: Real> Pace<T> for Straight<'_, T> {
    #[inline(always)]
    fn closing(&self, at: usize) -> Lanes<T> {
        let cos = window(self.cos, at);
        lanes(|lane| self.speed * cos[lane])
    }

    #[inline(always)]
    fn times(&self, at: usize, clearance: &Lanes<T>, _: &Lanes<T>) -> Lanes<T> {
        let inverse = window(self.inverse, at);
        lanes(|lane| clearance[lane] * (inverse[lane] * self.per_speed))
    }
}

/// The pace of any motion.
#[derive(Clone, Copy)]
pub(super) struct Turning<'a, T> {
    cos: &'a [T],
    sin: &'a [T],
    velocity: (T, T),
}

impl<'a, T: Real> Turning<'a, T> {
    pub(super) fn new(tables: &'a Tables<T>, (vx, vy): (f64, f64)) -> Self {
        Turning { cos: &tables.beams.cos, sin: &tables.beams.sin, velocity: (T::of(vx), T::of(vy)) }
    }
}

impl<T: Real> Pace<T> for Turning<'_, T> {
    #[inline(always)]
    fn closing(&self, at: usize) -> Lanes<T> {
        let (cos, sin) = (window(self.cos, at), window(self.sin, at));
        lanes(|lane| self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane])
    }

    #[inline(always)]
    fn times(&self, _: usize, clearance: &Lanes<T>, closing: &Lanes<T>) -> Lanes<T> {
        lanes(|lane| clearance[lane] / closing[lane])
    }
}

/// One scan at one pace: what both kernels read. All by value, for what lies behind a reference is read again after
/// every write to memory that is not known to be apart from it.
#[derive(Clone, Copy)]
pub(super) struct Scan<'a, T, S, P> {
    pub ranges: S,
    pub rules: Rules<T>,
    pub offset: &'a [T],
    pub pace: P,
    pub min_closing_speed: T,
}

impl<T: Real, S: Source<T>, P: Pace<T>> Scan<'_, T, S, P> {
    /// The clearances and closing speeds of beams `at .. at + LANES`, which read `ranges`.
    #[inline(always)]
    fn group(&self, at: usize, ranges: Lanes<T>) -> (Lanes<T>, Lanes<T>) {
        let usable = each(ranges, |r| self.rules.usable(r));
        let offset = window(self.offset, at);
        (lanes(|lane| usable[lane] - offset[lane]), self.pace.closing(at))
    }

    #[inline(always)]
    fn times(&self, at: usize, ranges: Lanes<T>) -> Lanes<T> {
        let (clearance, closing) = self.group(at, ranges);
        let times = self.pace.times(at, &clearance, &closing);
        lanes(|lane| meaning(times[lane], clearance[lane], closing[lane], self.min_closing_speed))
    }

    #[inline(always)]
    fn statuses(&self, at: usize, ranges: Lanes<T>) -> Lanes<u8> {
        let (clearance, closing) = self.group(at, ranges);
        let offset = window(self.offset, at);
        lanes(|lane| {
            let (looked, seen) = (!offset[lane].is_nan(), self.rules.observed(ranges[lane]));
            status(clearance[lane], closing[lane] > self.min_closing_speed, looked, seen) as u8
        })
    }
}

/// Writes one time-to-collision for each beam.
pub(super) struct Times<'a, T, S, P, W> {
    pub scan: Scan<'a, T, S, P>,
    pub out: W,
}

impl<T: Real, S: Source<T>, P: Pace<T>, W: Sink<T>> Kernel for Times<'_, T, S, P, W> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        let Times { scan, mut out } = self;
        let whole = scan.ranges.len() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            out.put(at, scan.times(at, scan.ranges.lanes(at)));
        }
        if whole < scan.ranges.len() {
            out.put_last(whole, scan.times(whole, scan.ranges.lanes_or(whole, T::NAN)));
        }
    }
}

/// Writes one status for each beam.
pub(super) struct Statuses<'a, T, S, P, W> {
    pub scan: Scan<'a, T, S, P>,
    pub out: W,
}

impl<T: Real, S: Source<T>, P: Pace<T>, W: Sink<u8>> Kernel for Statuses<'_, T, S, P, W> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        let Statuses { scan, mut out } = self;
        let whole = scan.ranges.len() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            out.put(at, scan.statuses(at, scan.ranges.lanes(at)));
        }
        if whole < scan.ranges.len() {
            out.put_last(whole, scan.statuses(whole, scan.ranges.lanes_or(whole, T::NAN)));
        }
    }
}

/// Clearance over closing speed: 0 in contact, infinite where the beam does not close or has no reading.
#[inline(always)]
pub(crate) fn ttc<T: Real>(clearance: T, closing: T, min_closing_speed: T) -> T {
    meaning(clearance / closing, clearance, closing, min_closing_speed)
}

/// The same, with the quotient at hand.
#[inline(always)]
fn meaning<T: Real>(ttc: T, clearance: T, closing: T, min_closing_speed: T) -> T {
    let ttc = if clearance <= T::ZERO { T::ZERO } else { ttc };
    let ttc = if closing > min_closing_speed { ttc } else { T::INFINITY };
    if ttc >= T::ZERO { ttc } else { T::INFINITY }
}

#[inline(always)]
fn status<T: Real>(clearance: T, closes: bool, looked: bool, seen: bool) -> Status {
    if !looked {
        Status::NoData
    } else if clearance <= T::ZERO {
        Status::Contact
    } else if clearance > T::ZERO {
        if closes { Status::Closing } else { Status::NotClosing }
    } else if seen {
        Status::Clear
    } else {
        Status::Invalid
    }
}
