//! The points inside the gate, or as many of them as the estimate needs.

use super::gate::{Gate, Rest};
use super::points::{Columns, Layout, Packed, Points, Row};
use crate::column::{Column, Records};
use crate::lanes::LANES;
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::threads::pieces;
use std::ops::Range;

/// A point inside the gate: its distance ahead, and which it is.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Candidate<T> {
    pub x: T,
    pub index: u32,
}

impl<T: Real> Candidate<T> {
    /// Nearest first, and of two as near the one with the lower index.
    pub(super) fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.partial_cmp(other).unwrap_or(std::cmp::Ordering::Equal)
    }
}

/// A distance, and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub x: f64,
    /// The point that it is, if it is one.
    pub index: Option<u32>,
    /// How many candidates stand behind it.
    pub support: usize,
}

/// The candidates of a cloud.
pub(super) struct Candidates<T> {
    /// How many there are.
    pub count: usize,
    /// All of them, or if only the nearest were asked for at least those; in no order.
    pub kept: Vec<Candidate<T>>,
    /// How many of the nearest are needed; all if `None`.
    wanted: Option<usize>,
    /// Points beyond this are not among the nearest.
    cap: T,
}

/// One in this many groups of points is looked at first, to know early how near the nearest are.
const SAMPLE: usize = 64;
/// More nearest points than wanted may be kept before they are thinned out.
const ROOM: usize = 2048;
/// Fewer points than this are not worth a thread of their own.
const LEAST_PIECE: usize = 1 << 16;

impl<T: Real> Candidates<T> {
    /// Every candidate, or at least the nearest `wanted` of them, found by up to `threads` threads.
    pub(super) fn gather(
        points: Points<'_, T>,
        gate: &Gate,
        wanted: Option<usize>,
        level: Level,
        threads: usize,
    ) -> Self {
        let nothing = || Candidates { count: 0, kept: Vec::new(), wanted, cap: T::MAX };
        let mut cap = T::MAX;
        if wanted.is_some_and(|wanted| points.len() > ROOM.max(SAMPLE.saturating_mul(wanted))) {
            // The nearest of a sample are no nearer than the nearest of all: a bound to begin with, in any order.
            let mut sample = nothing();
            sample.collect(points, 0..points.len(), gate, level, SAMPLE);
            cap = sample.thin().unwrap_or(cap);
        }
        let found = pieces(threads, points.len(), LEAST_PIECE, |range| {
            let mut piece = Candidates { cap, ..nothing() };
            piece.collect(points, range, gate, level, 1);
            piece
        });
        found.into_iter().reduce(Self::with).unwrap_or_else(nothing)
    }

    /// These and others.
    fn with(mut self, other: Self) -> Self {
        self.count += other.count;
        self.kept.extend(other.kept);
        self
    }

    /// Collect from the points of a range, or from one in `every` groups of them.
    fn collect(&mut self, points: Points<'_, T>, range: Range<usize>, gate: &Gate, level: Level, every: usize) {
        for (first, row) in points.rows(range) {
            let into = &mut *self;
            if let Some(records) = Records::new(row.xyz) {
                let fourth = gate.intensity.is_some() && row.intensity.is_some_and(|it| it.is_fourth(&records));
                if let Some(records) = records.back_to_back() {
                    level.run(Collect { layout: Packed(records), row, gate, fourth, first, every, into });
                } else {
                    level.run(Collect { layout: Packed(records), row, gate, fourth, first, every, into });
                }
            } else if let [Some(x), Some(y), Some(z)] = row.xyz.map(Column::dense) {
                level.run(Collect { layout: Columns([x, y, z]), row, gate, fourth: false, first, every, into });
            } else {
                level.run(Collect { layout: Columns(row.xyz), row, gate, fourth: false, first, every, into });
            }
        }
    }

    #[inline(always)]
    fn keep(&mut self, x: T, index: usize) {
        if x > self.cap {
            return;
        }
        #[allow(clippy::cast_possible_truncation, reason = "Points::new admits fewer than 2^32 points")]
        self.kept.push(Candidate { x, index: index as u32 });
        if let Some(wanted) = self.wanted
            && self.kept.len() >= wanted.saturating_mul(2).saturating_add(ROOM)
            && let Some(last) = self.thin()
        {
            // Points come in order: whatever is as near as the last of the nearest comes too late.
            self.cap = last.below();
        }
    }

    /// Forget all but the nearest, if there are more than wanted; gives the last of those.
    fn thin(&mut self) -> Option<T> {
        let wanted = self.wanted.filter(|wanted| self.kept.len() >= *wanted)?;
        let (_, last, _) = self.kept.select_nth_unstable_by(wanted - 1, Candidate::order);
        let last = last.x;
        self.kept.truncate(wanted);
        Some(last)
    }
}

/// Collects the candidates of a row, from one in `every` groups of points.
struct Collect<'a, 'c, T, L> {
    layout: L,
    row: Row<'a, T>,
    gate: &'a Gate,
    /// Whether the gate bounds the fourth number of each record, which is the intensity.
    fourth: bool,
    /// Index of the first point of the row.
    first: usize,
    every: usize,
    into: &'c mut Candidates<T>,
}

impl<T: Real, L: Layout<T>> Kernel for Collect<'_, '_, T, L> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) {
        let Collect { layout, row, gate, fourth, first, every, into } = self;
        let (low, high) = gate.boxed::<T>();
        let (bounds, zero) = (L::bounds(low, high), L::bounds([T::ZERO; 4], [T::ZERO; 4]));
        let holds_zero = (0..3).all(|column| low[column] <= T::ZERO && T::ZERO <= high[column]);
        let rest = Rest::new(gate, row, fourth);
        // A point is read again once its bits say that it is inside. It is judged by what is read then, in case somebody
        // wrote to it meanwhile.
        let read = |i: usize| {
            let stored = row.xyz.map(|column| column.get(i));
            let boxed = (0..3).all(|column| low[column] <= stored[column] && stored[column] <= high[column]);
            (boxed && stored != [T::ZERO; 3]).then_some(stored)
        };
        let near = |cap: T| {
            let (low, high) = gate.nearer_than(cap, (low, high));
            L::bounds(low, high)
        };
        let (mut cap, mut nearest) = (into.cap, near(into.cap));

        for at in (0..layout.whole()).step_by(LANES * every) {
            let mut bits = layout.inside(simd, at, &bounds, fourth);
            if bits == 0 {
                continue;
            }
            if holds_zero {
                bits &= !layout.inside(simd, at, &zero, false);
            }
            if rest.is_empty() {
                into.count += bits.count_ones() as usize;
                bits &= layout.inside(simd, at, &nearest, false);
            }
            while bits != 0 {
                let i = at + L::place(bits.trailing_zeros() as usize);
                bits &= bits - 1;
                if let Some(x) = read(i).and_then(|stored| rest.admit(i, stored)) {
                    into.count += usize::from(!rest.is_empty());
                    into.keep(x, first + i);
                }
            }
            if into.cap < cap {
                (cap, nearest) = (into.cap, near(into.cap));
            }
        }

        // The last few, one by one.
        let rest = Rest::new(gate, row, false);
        for i in layout.whole()..row.xyz[0].len() {
            if let Some(x) = read(i).and_then(|stored| rest.admit(i, stored)) {
                into.count += 1;
                into.keep(x, first + i);
            }
        }
    }
}
