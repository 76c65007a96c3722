//! The first entry of a frame, exactly, without computing every point exactly.
//!
//! First the bounds of all points: most can never enter within the horizon. Then the few that may, those with the least
//! bounds first, until no bound is below the best time any more. Rounding of bounds costs time, never the answer.

use super::bounds::{Bounded, Bounds};
use super::entry::Sweep;
use super::frame::Frame;
use crate::column::ColumnMut;
use crate::hit::Hit;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::status::Status;

/// So many points are decided before the others are looked at again; twice as many the next time.
const FIRST: usize = 4;

/// A point that may enter, and the square of the way that it needs at least.
#[derive(Clone, Copy)]
struct Candidate<T> {
    way: T,
    index: usize,
}

/// The point that is hit first.
pub(crate) fn least<T: Real>(level: Level, frame: impl Frame<T>, sweep: &Sweep) -> Hit {
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

/// Every point that is hit.
pub(crate) fn entering<T: Real>(level: Level, frame: impl Frame<T>, sweep: &Sweep) -> Vec<Hit> {
    let Some(bounds) = Bounds::new(sweep, frame.error(sweep.reach)) else { return Vec::new() };
    let candidates = level.run(Gather { frame, bounds, limit: bounds.limit(sweep.horizon) });
    candidates.into_iter().map(|candidate| decide(&frame, sweep, candidate.index)).filter(Hit::closes).collect()
}

/// One point exactly.
#[inline(always)]
fn decide<T: Real>(frame: &impl Frame<T>, sweep: &Sweep, index: usize) -> Hit {
    Hit { ttc: sweep.ttc(frame.point(index), frame.touches(index)), index }
}

/// Move those that pass to the front, and say how many there are.
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

/// Times of all points into `out`, and what they mean into `status_out`.
pub(crate) fn each<'o, T: Real>(
    level: Level,
    frame: impl Frame<T>,
    sweep: &Sweep,
    out: &mut ColumnMut<'o, T>,
    status_out: Option<&mut ColumnMut<'o, u8>>,
) {
    let bounds = Bounds::new(sweep, frame.error(sweep.reach));
    level.run(Each { frame, sweep, bounds, out, status_out });
}

/// Computes all of them.
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
            // What they mean comes first: `out` may be where the points are read from.
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
    /// Times of the points with a bit, and a bit for each that is hit.
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

    /// What the points mean as long as they are not going to be hit.
    fn status(&self, at: usize) -> Lanes<u8> {
        let status =
            |index| if index < self.frame.len() { self.frame.status(index, self.sweep) } else { Status::Clear };
        std::array::from_fn(|lane| status(at + lane) as u8)
    }
}
