//! The points inside the gate, or as many of them as the estimate needs.

use super::collect::{Collect, Search};
use super::gate::Gate;
use super::points::{Columns, Layout, Packed, Points, Row};
use crate::column::{Column, Records};
use crate::real::Real;
use crate::simd::Level;
use crate::threads::pieces;
use std::cmp::Ordering;
use std::ops::Range;

/// A point inside the gate: its distance ahead, and which it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate<T> {
    pub x: T,
    pub index: u32,
}

impl<T: Real> Candidate<T> {
    /// Nearest first, and of two as near the one with the lower index.
    #[inline(always)]
    pub(super) fn order(&self, other: &Self) -> Ordering {
        // What sorts asks is whether it is less, and that without a branch: half of those would be guessed wrongly.
        if self.is_before(other) {
            Ordering::Less
        } else if other.is_before(self) {
            Ordering::Greater
        } else {
            Ordering::Equal
        }
    }

    #[inline(always)]
    fn is_before(&self, other: &Self) -> bool {
        (self.x < other.x) | ((self.x == other.x) & (self.index < other.index))
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
    /// Points beyond this are not among the nearest.
    pub cap: T,
    /// How many of the nearest are needed; all if `None`.
    wanted: Option<usize>,
}

/// When there are many candidates, this part of the groups of points tells how near the nearest are.
const SAMPLE: usize = 64;
/// More nearest points than wanted may be kept before they are thinned out.
const ROOM: usize = 64;
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
        let piece = |range: Range<usize>| {
            let mut piece = Candidates::nothing(wanted, range.len());
            points.rows(range).for_each(|(first, row)| piece.collect(first, row, gate, level));
            piece
        };
        if threads == 1 {
            return piece(0..points.len()); // no list for one: a small cloud would notice
        }
        let found = pieces(threads, points.len(), LEAST_PIECE, piece);
        found.into_iter().reduce(Self::with).unwrap_or_else(|| Candidates::nothing(wanted, 0))
    }

    /// None yet, of at most `points`.
    fn nothing(wanted: Option<usize>, points: usize) -> Self {
        Candidates { count: 0, kept: Vec::with_capacity(points.min(2 * ROOM)), cap: T::MAX, wanted }
    }

    /// These and others.
    fn with(mut self, other: Self) -> Self {
        self.count += other.count;
        self.kept.extend(other.kept);
        self
    }

    /// Collect from a row, whose first point is point `first` of the cloud.
    fn collect(&mut self, first: usize, row: Row<'_, T>, gate: &Gate, level: Level) {
        if let Some(records) = Records::new(row.xyz) {
            let fourth = gate.intensity.is_some() && row.intensity.is_some_and(|it| it.is_fourth(&records));
            if let Some(records) = records.back_to_back() {
                self.collect_as(Packed(records), Search { first, row, gate, fourth, level });
            } else {
                self.collect_as(Packed(records), Search { first, row, gate, fourth, level });
            }
        } else if let [Some(x), Some(y), Some(z)] = row.xyz.map(Column::dense) {
            self.collect_as(Columns([x, y, z]), Search { first, row, gate, fourth: false, level });
        } else {
            self.collect_as(Columns(row.xyz), Search { first, row, gate, fourth: false, level });
        }
    }

    /// Collect from a row in its layout.
    fn collect_as<L: Layout<T>>(&mut self, layout: L, search: Search<'_, T>) {
        let Some(from) = search.level.run(Collect { layout, search, from: 0, every: 1, into: self }) else { return };
        // They are many, and more are likely to come. The nearest of a sample are no nearer than the nearest of all: a bound,
        // in whatever order points come. A small sample bounds the large one, which may come in a bad order too.
        for every in [SAMPLE * SAMPLE, SAMPLE] {
            let mut sample = Candidates { cap: self.cap, ..Candidates::nothing(self.wanted, 2 * ROOM) };
            search.level.run(Collect { layout, search, from, every, into: &mut sample });
            self.cap = sample.thin().unwrap_or(self.cap);
        }
        search.level.run(Collect { layout, search, from, every: 1, into: self });
    }

    #[inline(always)]
    pub(super) fn keep(&mut self, x: T, index: usize) {
        if x <= self.cap {
            #[allow(clippy::cast_possible_truncation, reason = "Points::new admits fewer than 2^32 points")]
            self.kept.push(Candidate { x, index: index as u32 });
        }
    }

    /// Whether so many more than wanted are kept that it is time to thin them out.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.wanted.is_some_and(|wanted| self.kept.len() >= wanted.saturating_mul(2).saturating_add(ROOM))
    }

    /// Forget all but the nearest, if there are more than wanted; gives the last of those.
    pub(super) fn thin(&mut self) -> Option<T> {
        let wanted = self.wanted.filter(|wanted| self.kept.len() >= *wanted)?;
        let (_, last, _) = self.kept.select_nth_unstable_by(wanted - 1, Candidate::order);
        let last = last.x;
        self.kept.truncate(wanted);
        // Points come in order: whatever is as near as the last of the nearest comes too late.
        self.cap = last.below();
        Some(last)
    }
}
