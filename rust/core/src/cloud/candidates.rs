//! The points inside the gate, or as many of them as the estimate needs.

use super::collect::{Collect, Search};
use super::gate::Gate;
use super::kept::Kept;
use crate::column::{Column, Records};
use crate::lanes::{LANES, Lanes};
use crate::points::{Columns, Layout, Packed, Points, Row};
use crate::real::Real;
use crate::simd::{Instructions, Level};
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
    /// All of them, or if only the nearest were asked for at least those; in the order of points.
    pub kept: Kept<T>,
    /// Points beyond this are not among the nearest.
    pub cap: T,
    /// How many of the nearest are needed; all if `None`.
    wanted: Option<usize>,
}

/// When there are many candidates, this part of the groups of points tells how near the nearest are.
const SAMPLE: usize = 64;
/// So many more nearest points than wanted, or twice as many, may be kept before they are thinned out.
const ROOM: usize = 1024;
/// There is room for one in so many points to be kept at first: a small cloud would notice what more memory takes.
const SPARSE: usize = 5;
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
            let mut piece = Candidates::nothing(wanted, range.len() / SPARSE);
            points.rows(range).for_each(|(first, row)| piece.collect(first, row, gate, level));
            piece
        };
        if threads == 1 {
            return piece(0..points.len()); // no list for one: a small cloud would notice
        }
        let found = pieces(threads, points.len(), LEAST_PIECE, piece);
        found.into_iter().reduce(|all, piece| all.with(&piece)).unwrap_or_else(|| Candidates::nothing(wanted, 0))
    }

    /// None yet, with room for so many.
    fn nothing(wanted: Option<usize>, room: usize) -> Self {
        Candidates { count: 0, kept: Kept::with_capacity(room.min(ROOM)), cap: T::MAX, wanted }
    }

    /// These, and those of points that come after them.
    fn with(mut self, other: &Self) -> Self {
        self.count += other.count;
        self.kept.extend(&other.kept);
        self
    }

    /// Collect from a row, whose first point is point `first` of the cloud.
    fn collect(&mut self, first: usize, row: Row<'_, T>, gate: &Gate, level: Level) {
        let ahead = gate.axes[0].column;
        if let Some(records) = Records::new(row.xyz) {
            let fourth = gate.intensity.is_some() && row.intensity.is_some_and(|it| it.is_fourth(&records));
            let search = Search { first, row, gate, fourth, level };
            let forward = records.starting_at(ahead);
            if let (Some(records), Some(forward)) = (records.back_to_back(), forward.back_to_back()) {
                self.collect_as(Packed { records, forward }, search);
            } else {
                self.collect_as(Packed { records, forward }, search);
            }
            return;
        }
        let search = Search { first, row, gate, fourth: false, level };
        if let [Some(x), Some(y), Some(z)] = row.xyz.map(Column::dense) {
            let xyz = [x, y, z];
            self.collect_as(Columns { xyz, forward: xyz[ahead] }, search);
        } else {
            self.collect_as(Columns { xyz: row.xyz, forward: row.xyz[ahead] }, search);
        }
    }

    /// Collect from a row in its layout.
    fn collect_as<L: Layout<T>>(&mut self, layout: L, search: Search<'_, T>) {
        let Some(from) = search.level.run(Collect { layout, search, from: 0, every: 1, into: self }) else { return };
        // They are many, and more are likely to come. The nearest of a sample are no nearer than the nearest of all: a bound,
        // in whatever order points come. A small sample bounds the large one, which may come in a bad order too.
        for every in [SAMPLE * SAMPLE, SAMPLE] {
            let mut sample = Candidates { cap: self.cap, ..Candidates::nothing(self.wanted, ROOM) };
            search.level.run(Collect { layout, search, from, every, into: &mut sample });
            self.cap = sample.thin(search.level).unwrap_or(self.cap);
        }
        search.level.run(Collect { layout, search, from, every: 1, into: self });
    }

    /// One more, if it is near enough.
    #[inline(always)]
    pub(super) fn keep(&mut self, x: T, index: usize) {
        self.count += 1;
        if x <= self.cap {
            self.kept.push(x, index);
        }
    }

    /// Those of the points `first .. first + LANES` whose bit is set, as far as they lie between `low` and `high` and are
    /// near enough.
    #[inline(always)]
    pub(super) fn keep_lanes<I: Instructions>(
        &mut self,
        simd: I,
        x: &Lanes<T>,
        (low, high): (T, T),
        inside: u16,
        first: usize,
    ) {
        self.count += inside.count_ones() as usize;
        let high = if self.cap < high { self.cap } else { high };
        let near = inside & T::within(simd, x, &[low; LANES], &[high; LANES]);
        if near != 0 {
            self.kept.append(simd, x, near, first);
        }
    }

    /// Whether so many more than wanted are kept that it is time to thin them out.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.wanted.is_some_and(|wanted| self.kept.len() >= wanted.saturating_mul(2).saturating_add(ROOM))
    }

    /// Forget all but the nearest, if there are as many as wanted; gives the last of those.
    pub(super) fn thin(&mut self, level: Level) -> Option<T> {
        let wanted = self.wanted.filter(|wanted| self.kept.len() >= *wanted)?;
        let last = self.kept.thin(wanted, level);
        // Points come in order: whatever is as near as the last of the nearest comes too late.
        self.cap = last.below();
        Some(last)
    }
}
