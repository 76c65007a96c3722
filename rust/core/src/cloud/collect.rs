//! The pass over the points of a row, sixteen at a time.

use super::candidates::Candidates;
use super::gate::{Axis, Gate, Rest};
use crate::lanes::{LANES, each};
use crate::points::{IntensityRow, Layout, Row};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level, Prefilter};
use std::ops::Range;

/// Where to look, and for what.
#[derive(Clone, Copy)]
pub(super) struct Search<'a, T> {
    /// Index of the first point of the row.
    pub first: usize,
    pub row: Row<'a, T>,
    pub gate: &'a Gate,
    /// Whether the gate bounds the fourth number of each record, which is the intensity.
    pub fourth: bool,
    pub level: Level,
}

/// Collects the candidates of a row, from one in `every` groups of points from point `from` on.
///
/// Gives the point to go on from, where it stopped because many were found before anything bounded them.
pub(super) struct Collect<'a, 'c, T, L> {
    pub layout: L,
    pub search: Search<'a, T>,
    pub from: usize,
    pub every: usize,
    pub into: &'c mut Candidates<T>,
}

impl<T: Real, L: Layout<T>> Kernel for Collect<'_, '_, T, L> {
    type Output = Option<usize>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Option<usize> {
        let Collect { layout, search, from, every, into } = self;
        let (low, high) = search.gate.boxed::<T>();
        let prefilter = L::prefilter(low, high, search.fourth);
        let groups = Groups::new(layout, search, (low, high));

        let (whole, step) = (layout.whole(), LANES * every);
        if from == 0 {
            groups.take_few(simd, 0..whole.start, into);
        }
        let mut at = from.max(whole.start);
        loop {
            at = search.level.run(Next { layout, prefilter: &prefilter, from: at, end: whole.end, step });
            if at >= whole.end {
                break;
            }
            // Where there is a point there is likely to be another: without the prefilter, until there is none.
            let mut any = true;
            while any && at < whole.end {
                any = groups.take(simd, at, u16::MAX, into);
                at += step;
                if into.is_full() {
                    let is_first = into.cap == T::MAX;
                    into.thin(search.level);
                    if is_first && every == 1 {
                        return Some(at);
                    }
                }
            }
        }
        if every == 1 {
            groups.take_few(simd, whole.end..search.row.xyz[0].len(), into);
        }
        None
    }
}

/// Looks for a group that may hold a point inside, from one in each `step` from point `from` on.
struct Next<'a, T, L> {
    layout: L,
    prefilter: &'a Prefilter<T>,
    from: usize,
    end: usize,
    step: usize,
}

impl<T: Real, L: Layout<T>> Kernel for Next<'_, T, L> {
    type Output = usize;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> usize {
        let Next { layout, prefilter, from: mut at, end, step } = self;
        let prefilter = *prefilter; // in registers
        while at < end && !layout.may_hold(simd, at, &prefilter) {
            at += step;
        }
        at
    }
}

/// The points of a row, to be taken when they are in the gate.
struct Groups<'a, T, L: Layout<T>> {
    layout: L,
    row: Row<'a, T>,
    first: usize,
    gate: &'a Gate,
    bounds: L::Bounds,
    fourth: bool,
    /// Whether (0, 0, 0) is in the box; points there never count.
    holds_zero: bool,
    /// Where it is not the fourth number.
    intensity: Option<IntensityRow<'a>>,
    rest: Option<Rest<'a>>,
    low: [T; 4],
    high: [T; 4],
    /// The bounds on how far ahead.
    ahead: (T, T),
}

impl<'a, T: Real, L: Layout<T>> Groups<'a, T, L> {
    #[inline(always)]
    fn new(layout: L, search: Search<'a, T>, (low, high): ([T; 4], [T; 4])) -> Self {
        let Search { row, first, gate, fourth, .. } = search;
        let Axis { column, flipped } = gate.axes[0];
        let ahead = (low[column], high[column]);
        let ahead = if flipped { (T::ZERO - ahead.1, T::ZERO - ahead.0) } else { ahead };
        let holds_zero = (0..3).all(|column| low[column] <= T::ZERO && T::ZERO <= high[column]);
        Groups {
            layout,
            row,
            first,
            gate,
            bounds: L::bounds(low, high),
            fourth,
            holds_zero,
            intensity: row.intensity.filter(|_| gate.intensity.is_some() && !fourth),
            rest: Rest::new(gate),
            low,
            high,
            ahead,
        }
    }

    /// Take those of the points `at .. at + LANES` that are in the gate and whose bit in `among` is set; says whether any is.
    #[inline(always)]
    fn take<I: Instructions>(&self, simd: I, at: usize, among: u16, into: &mut Candidates<T>) -> bool {
        let mut inside = among & self.layout.inside(simd, at, &self.bounds, self.fourth);
        if inside == 0 {
            return false;
        }
        if self.intensity.is_some() {
            inside = self.bright(at, inside);
        }
        let stored = self.layout.forward(at);
        let may_be_zero =
            self.holds_zero && inside & T::within(simd, &stored, &[T::ZERO; LANES], &[T::ZERO; LANES]) != 0;
        if may_be_zero || self.rest.is_some() {
            self.take_singly(at, inside, into);
        } else {
            let ahead = if self.gate.axes[0].flipped { each(stored, |x| T::ZERO - x) } else { stored };
            // Read a second time, so judged again, in case somebody wrote to it meanwhile.
            into.keep_lanes(simd, &ahead, self.ahead, inside, self.first + at);
        }
        true
    }

    /// Those whose intensity lies within its bounds, of the points from `at` on whose bit is set.
    #[inline(never)] // as the next one: what is rare would take registers from what is not
    fn bright(&self, at: usize, some: u16) -> u16 {
        let (Some(intensity), Some(bounds)) = (&self.intensity, self.gate.intensity) else { return some };
        each_bit(some).fold(0, |bright, i| bright | u16::from(intensity.within(at + i, bounds)) << i)
    }

    /// Take those in the gate, of the points from `at` on whose bit is set, one by one.
    #[inline(never)]
    fn take_singly(&self, at: usize, some: u16, into: &mut Candidates<T>) {
        each_bit(some).for_each(|i| self.take_one(at + i, into));
    }

    /// Take those of a few points, fewer than `LANES`, that are in the gate.
    #[inline(always)]
    fn take_few<I: Instructions>(&self, simd: I, few: Range<usize>, into: &mut Candidates<T>) {
        let (mut next, readable) = (few.start, self.layout.readable());
        if readable >= LANES && next < few.end.min(readable) {
            // Together with others, which have been taken or will be.
            let (at, end) = (next.min(readable - LANES), few.end.min(readable));
            let among = u16::MAX << (next - at) & u16::MAX >> (LANES - (end - at));
            self.take(simd, at, among, into);
            next = end;
        }
        for i in next..few.end {
            self.take_one(i, into);
        }
    }

    /// Take one point if it is in the gate.
    #[inline(always)]
    fn take_one(&self, i: usize, into: &mut Candidates<T>) {
        let stored = self.row.xyz.map(|column| column.get(i));
        let inside = |column: usize| (self.low[column] <= stored[column]) & (stored[column] <= self.high[column]);
        let is_zero = |column: usize| stored[column] == T::ZERO;
        let bright = match (&self.row.intensity, self.gate.intensity) {
            (Some(intensity), Some(bounds)) => intensity.within(i, bounds),
            _ => true,
        };
        if !(inside(0) & inside(1) & inside(2) & bright) || is_zero(0) & is_zero(1) & is_zero(2) {
            return;
        }
        if let Some(x) = self.rest.map_or(Some(self.gate.ahead(stored)), |rest| rest.admit(stored)) {
            into.keep(x, self.first + i);
        }
    }
}

/// The places of the bits that are set.
fn each_bit(mut bits: u16) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (bits != 0).then_some(bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        place
    })
}
