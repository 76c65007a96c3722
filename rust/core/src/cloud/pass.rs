//! One pass over a cloud finds the points inside the gate, or as many of them as the estimate needs.
//!
//! [`Candidates::gather`] cuts the cloud into pieces for threads and each piece into rows; a row in whatever layout
//! goes to the kernel [`Collect`], which takes sixteen points at a time. Most points are outside, so the kernel
//! [`Next`] runs ahead with a quick test, the prefilter, to the next group that may hold a point inside.
//!
//! An estimator that wants the `k` nearest needs no others. When more candidates have come than that, a sample of the
//! remaining points says how near the nearest are at least, and the pass goes on with that bound.

use super::buffer::CandidateBuffer;
use super::gate::{Axis, CheckedGate, NonBoxGate};
use crate::lanes::{LANES, Lanes, each};
use crate::points::{IntensityRow, Layout, OnLayout, Points, Row};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level, Prefilter};
use crate::threads::pieces;
use std::ops::Range;

/// The candidates of a cloud.
pub(super) struct Candidates<T: Real> {
    /// The number of points inside the gate.
    pub count: usize,
    /// All candidates in the order of points; if only the nearest are wanted, at least those.
    pub kept: CandidateBuffer<T>,
    /// A point beyond this distance is not among the nearest.
    cap: T,
    /// The number of nearest candidates that the estimate needs; all if `None`.
    wanted: Option<usize>,
}

/// The sample that bounds the nearest of many candidates takes one in this many groups of points.
const SAMPLE: usize = 64;
/// The candidates that are kept beyond twice as many as wanted, before all but the nearest are dropped.
const ROOM: usize = 1024;
/// The fewest points that are worth a thread of their own.
const LEAST_PIECE: usize = 1 << 16;

impl<T: Real> Candidates<T> {
    /// Adds those of the points, or at least the nearest `wanted` of them, by up to `threads` threads.
    pub(super) fn gather(&mut self, points: &Points<'_, T>, gate: &CheckedGate, level: Level, threads: usize) {
        let (bounds, non_box) = (&gate.as_box::<T>(), NonBoxGate::new(gate));
        let collect = |range: Range<usize>, into: &mut Self| {
            points.each_row(range, gate.intensity.is_some(), |first, row| {
                into.collect(&Search { first, row, gate, bounds, non_box, level });
            });
        };
        if threads == 1 {
            return collect(0..points.len(), self); // no list for one: a small cloud would notice
        }
        let wanted = self.wanted;
        let found = pieces(threads, points.len(), LEAST_PIECE, |range| {
            let mut piece = Candidates::none(wanted);
            collect(range, &mut piece);
            piece
        });
        for piece in &found {
            self.add(piece);
        }
    }

    /// No candidates yet, of which the nearest `wanted` are needed, or all.
    #[inline(always)]
    pub(super) fn none(wanted: Option<usize>) -> Self {
        Candidates { count: 0, kept: CandidateBuffer::new(), cap: T::MAX, wanted }
    }

    /// Adds the candidates of the points that come after these.
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.kept.extend(&other.kept);
    }

    /// Collects from a row in whatever layout.
    fn collect(&mut self, search: &Search<'_, T>) {
        let len = search.row.xyz[0].len();
        if len < LANES {
            (0..len).for_each(|i| search.take_one(i, self));
            return;
        }
        search.row.in_layout(search.gate.axes[0].column, (self, search));
    }

    /// Collects from a row in its layout.
    fn collect_as<L: Layout<T>>(&mut self, layout: L, search: &Search<'_, T>) {
        let Some(from) = search.level.run(Collect { layout, search, from: 0, every: 1, into: self }) else { return };
        // There are many candidates, and more are likely to come. The nearest of a sample are no nearer than the
        // nearest of all, in whatever order points come, so they are a bound. A small sample bounds the large one,
        // whose order may be bad too.
        for every in [SAMPLE * SAMPLE, SAMPLE] {
            let mut sample = Candidates { cap: self.cap, ..Candidates::none(self.wanted) };
            search.level.run(Collect { layout, search, from, every, into: &mut sample });
            self.cap = sample.keep_nearest(search.level).unwrap_or(self.cap);
        }
        search.level.run(Collect { layout, search, from, every: 1, into: self });
    }

    /// Counts a candidate, and keeps it if it is near enough.
    #[inline(always)]
    fn keep(&mut self, x: T, index: usize) {
        self.count += 1;
        if x <= self.cap {
            self.kept.push(x, index);
        }
    }

    /// Counts those of the points `first .. first + LANES` whose bit is set, and keeps those that lie between `low` and
    /// `high` and are near enough.
    #[inline(always)]
    fn keep_lanes<I: Instructions>(&mut self, simd: I, x: &Lanes<T>, (low, high): (T, T), inside: u16, first: usize) {
        self.count += inside.count_ones() as usize;
        let high = if self.cap < high { self.cap } else { high };
        let near = inside & T::within(simd, x, &[low; LANES], &[high; LANES]);
        if near != 0 {
            self.kept.append(simd, x, near, first);
        }
    }

    /// Whether it is time to drop all but the nearest.
    #[inline(always)]
    fn is_full(&self) -> bool {
        self.wanted.is_some_and(|wanted| self.kept.len() >= wanted.saturating_mul(2).saturating_add(ROOM))
    }

    /// Drops all but the nearest, if there are as many as wanted, and returns the distance of the last of those.
    fn keep_nearest(&mut self, level: Level) -> Option<T> {
        let wanted = self.wanted.filter(|wanted| self.kept.len() >= *wanted)?;
        let last = self.kept.keep_nearest(wanted, level);
        // Points come in order, and ties go to the lower index: a later point at the distance of the last one loses.
        self.cap = last.below();
        Some(last)
    }
}

/// A row to search, and the gate to search it by.
struct Search<'a, T> {
    /// Index of the first point of the row.
    first: usize,
    /// The row, with its intensities where the gate bounds them.
    row: &'a Row<'a, T>,
    gate: &'a CheckedGate,
    /// The box of the gate.
    bounds: &'a ([T; 4], [T; 4]),
    /// The rest of it.
    non_box: Option<NonBoxGate<'a>>,
    level: Level,
}

impl<T: Real> Search<'_, T> {
    /// Takes a point if it is in the gate.
    #[inline(always)]
    fn take_one(&self, i: usize, into: &mut Candidates<T>) {
        let Search { first, row, gate, bounds: (low, high), non_box, .. } = self;
        let stored = row.xyz.map(|column| column.get(i));
        let inside = |column: usize| (low[column] <= stored[column]) & (stored[column] <= high[column]);
        let is_zero = |column: usize| stored[column] == T::ZERO;
        let bright = match (&row.intensity, gate.intensity) {
            (Some(intensity), Some(bounds)) => intensity.within(i, bounds),
            _ => true,
        };
        if !(inside(0) & inside(1) & inside(2) & bright) || is_zero(0) & is_zero(1) & is_zero(2) {
            return;
        }
        if let Some(x) = non_box.map_or(Some(gate.ahead(&stored)), |gate| gate.admit(stored)) {
            into.keep(x, first + i);
        }
    }
}

impl<T: Real> OnLayout<T> for (&mut Candidates<T>, &Search<'_, T>) {
    fn run<L: Layout<T>>(self, layout: L) {
        self.0.collect_as(layout, self.1);
    }
}

/// Collects the candidates of a row, from one in `every` groups of points from point `from` on.
///
/// Returns the point to go on from if it stopped early, because many candidates came before anything bounded them.
struct Collect<'a, 'c, T: Real, L> {
    layout: L,
    search: &'a Search<'a, T>,
    from: usize,
    every: usize,
    into: &'c mut Candidates<T>,
}

impl<T: Real, L: Layout<T>> Kernel for Collect<'_, '_, T, L> {
    type Output = Option<usize>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Option<usize> {
        let Collect { layout, search, from, every, into } = self;
        let prefilter = layout.prefilter(search.bounds.0, search.bounds.1);
        let groups = Groups::new(layout, search);

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
            // Where there is a point inside, the next group is likely to hold one too: no prefilter until a group holds
            // none.
            let mut any = true;
            while any && at < whole.end {
                any = groups.take(simd, at, u16::MAX, into);
                at += step;
                if into.is_full() {
                    let is_first = into.cap == T::MAX;
                    into.keep_nearest(search.level);
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

/// Looks for a group that may hold a point inside, every `step` points from point `from` on.
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

/// The points of a row in groups of lanes, and the gate in the arrangement of those lanes.
struct Groups<'a, T, L: Layout<T>> {
    layout: L,
    search: &'a Search<'a, T>,
    bounds: L::Bounds,
    /// Whether (0, 0, 0) is in the box; points there never count.
    holds_zero: bool,
    /// The intensities, where they are bounded and are not the fourth number.
    intensity: Option<&'a IntensityRow<'a>>,
    /// Bounds on the distance ahead, on a straight path.
    ahead: (T, T),
}

impl<'a, T: Real, L: Layout<T>> Groups<'a, T, L> {
    #[inline(always)]
    fn new(layout: L, search: &'a Search<'a, T>) -> Self {
        let (low, high) = *search.bounds;
        let Axis { column, flipped } = search.gate.axes[0];
        let ahead = (low[column], high[column]);
        let ahead = if flipped { (T::ZERO - ahead.1, T::ZERO - ahead.0) } else { ahead };
        let holds_zero = (0..3).all(|column| low[column] <= T::ZERO && T::ZERO <= high[column]);
        let intensity = search.row.intensity.as_ref().filter(|_| !layout.compares_fourth());
        Groups { layout, search, bounds: L::bounds(low, high), holds_zero, intensity, ahead }
    }

    /// Takes those of the points `at .. at + LANES` that are in the gate and whose bit in `among` is set; says whether
    /// any is.
    #[inline(always)]
    fn take<I: Instructions>(&self, simd: I, at: usize, among: u16, into: &mut Candidates<T>) -> bool {
        let mut inside = among & self.layout.inside(simd, at, &self.bounds);
        if inside == 0 {
            return false;
        }
        if self.intensity.is_some() {
            inside = self.bright(at, inside);
        }
        let stored = self.layout.forward(at);
        let may_be_zero =
            self.holds_zero && inside & T::within(simd, &stored, &[T::ZERO; LANES], &[T::ZERO; LANES]) != 0;
        if may_be_zero || self.search.non_box.is_some() {
            self.take_singly(at, inside, into);
        } else {
            let ahead = if self.search.gate.axes[0].flipped { each(stored, |x| T::ZERO - x) } else { stored };
            // The distances were read a second time, so they are compared again: another thread may have written
            // meanwhile.
            into.keep_lanes(simd, &ahead, self.ahead, inside, self.search.first + at);
        }
        true
    }

    /// Clears the bits of the points from `at` on whose intensity is out of its bounds.
    #[inline(never)] // as the next function: rare code would take registers from the loop
    fn bright(&self, at: usize, bits: u16) -> u16 {
        let (Some(intensity), Some(bounds)) = (self.intensity, self.search.gate.intensity) else { return bits };
        each_bit(bits).fold(0, |bright, i| bright | u16::from(intensity.within(at + i, bounds)) << i)
    }

    /// Takes the points from `at` on whose bit is set one by one.
    #[inline(never)]
    fn take_singly(&self, at: usize, bits: u16, into: &mut Candidates<T>) {
        each_bit(bits).for_each(|i| self.search.take_one(at + i, into));
    }

    /// Takes the points at one end of a row, which are fewer than `LANES`.
    #[inline(always)]
    fn take_few<I: Instructions>(&self, simd: I, few: Range<usize>, into: &mut Candidates<T>) {
        let (mut next, readable) = (few.start, self.layout.readable());
        if readable >= LANES && next < few.end.min(readable) {
            // Read as lanes, together with neighbours that their own group takes.
            let (at, end) = (next.min(readable - LANES), few.end.min(readable));
            let among = u16::MAX << (next - at) & u16::MAX >> (LANES - (end - at));
            self.take(simd, at, among, into);
            next = end;
        }
        for i in next..few.end {
            self.search.take_one(i, into);
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
