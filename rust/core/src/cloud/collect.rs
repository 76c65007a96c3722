//! The pass over the points of a row, sixteen at a time.

use super::candidates::Candidates;
use super::gate::{Gate, Rest};
use super::points::{Layout, Row};
use crate::lanes::LANES;
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
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
        let Collect { layout, search: Search { row, first, gate, fourth, .. }, from, every, into } = self;
        let (low, high) = gate.boxed::<T>();
        let (sieve, bounds) = (L::sieve(low, high, fourth), L::bounds(low, high));
        let zero = L::bounds([T::ZERO; 4], [T::ZERO; 4]);
        let holds_zero = (0..3).all(|column| low[column] <= T::ZERO && T::ZERO <= high[column]);
        let rest = Rest::new(gate, row, fourth);
        let is_box = rest.is_empty();
        // A point is read again once its bits say that it is inside. It is judged by what is read then, in case somebody
        // wrote to it meanwhile.
        let read = |i: usize| {
            let stored = row.xyz.map(|column| column.get(i));
            let inside = |column: usize| (low[column] <= stored[column]) & (stored[column] <= high[column]);
            let is_zero = |column: usize| stored[column] == T::ZERO;
            let counts = inside(0) & inside(1) & inside(2) & !(is_zero(0) & is_zero(1) & is_zero(2));
            counts.then_some(stored)
        };
        let near = |cap: T| {
            let (low, high) = gate.nearer_than(cap, (low, high));
            (L::sieve(low, high, false), L::bounds(low, high))
        };
        let mut nearest = near(into.cap);
        // The first few and the last few, one by one.
        let singly = |some: Range<usize>, into: &mut Candidates<T>| {
            let rest = Rest::new(gate, row, false);
            for i in some {
                if let Some(x) = read(i).and_then(|stored| rest.admit(i, stored)) {
                    into.count += 1;
                    into.keep(x, first + i);
                }
            }
        };

        let (whole, step) = (layout.whole(), LANES * every);
        if from == 0 {
            singly(0..whole.start, into);
        }
        let mut at = from.max(whole.start);
        loop {
            while at < whole.end && !layout.may_hold(simd, at, &sieve) {
                at += step;
            }
            if at >= whole.end {
                break;
            }
            // Where there is a point there is likely to be another: without the sieve, until there is none.
            let mut inside = u64::MAX;
            while at < whole.end && inside != 0 {
                inside = layout.inside(simd, at, &bounds, fourth);
                if holds_zero {
                    inside &= !layout.inside(simd, at, &zero, false);
                }
                let mut hits = inside;
                if is_box {
                    into.count += inside.count_ones() as usize;
                    let any = layout.may_hold(simd, at, &nearest.0);
                    hits &= if any { layout.inside(simd, at, &nearest.1, false) } else { 0 };
                }
                while hits != 0 {
                    let i = at + L::place(hits.trailing_zeros() as usize);
                    hits &= hits - 1;
                    let Some(stored) = read(i) else { continue };
                    if is_box {
                        into.keep(gate.ahead(stored), first + i);
                    } else if let Some(x) = rest.admit(i, stored) {
                        into.count += 1;
                        into.keep(x, first + i);
                    }
                }
                at += step;
                if into.is_full() {
                    let is_first = into.cap == T::MAX;
                    into.thin();
                    if is_first && every == 1 {
                        return Some(at);
                    }
                    nearest = near(into.cap);
                }
            }
        }
        if every == 1 {
            singly(whole.end..row.xyz[0].len(), into);
        }
        None
    }
}
