//! The candidates that a pass keeps: distances ahead, and the points that they belong to, in the order in which they
//! came.
//!
//! Distances are stored apart from the numbers of points, so that kernels count and compare them as lanes.

use super::order::{Cut, Found, Least, Nth};
use crate::lanes::{LANES, Lanes, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Level};
use std::cell::Cell;
use std::cmp::Ordering;
use std::mem::take;

/// A point inside the gate: its distance ahead, m, and its number in the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate<T> {
    pub x: T,
    pub index: u32,
}

impl<T: Real> Candidate<T> {
    /// Orders the nearest first, and of two at one distance the one with the lower index.
    #[inline(always)]
    pub(super) fn order(&self, other: &Self) -> Ordering {
        // A sort asks whether one is less. The answer is found without a branch: half of the branches would be guessed
        // wrongly.
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

/// The candidates of a pass; their distances are finite.
pub(super) struct CandidateBuffer<T: Real> {
    /// Distances, and then perhaps infinite ones up to a whole number of groups of lanes.
    x: Vec<T>,
    index: Vec<u32>,
}

thread_local! {
    static SPARE: Cell<Vec<u32>> = const { Cell::new(Vec::new()) };
}
/// The most candidates whose memory is kept for the next buffer.
const KEPT: usize = 1 << 14;

impl<T: Real> Drop for CandidateBuffer<T> {
    fn drop(&mut self) {
        if self.x.capacity() <= KEPT {
            T::spare().set(take(&mut self.x));
            SPARE.set(take(&mut self.index));
        }
    }
}

impl<T: Real> CandidateBuffer<T> {
    /// An empty buffer, in the memory of the last one of this thread.
    pub(super) fn new() -> Self {
        let (mut x, mut index) = (T::spare().take(), SPARE.take());
        x.clear();
        index.clear();
        CandidateBuffer { x, index }
    }

    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.index.len()
    }

    /// Adds a candidate.
    #[inline(always)]
    pub(super) fn push(&mut self, x: T, index: usize) {
        self.x.push(x);
        #[allow(clippy::cast_possible_truncation, reason = "Points::new admits fewer than 2^32 points")]
        self.index.push(index as u32);
    }

    /// Adds those of the points `first .. first + LANES` whose bit is set. Whole registers are written and the rest is
    /// dropped, without a branch: no processor could guess it.
    #[inline(always)]
    pub(super) fn append<I: Instructions>(&mut self, simd: I, x: &Lanes<T>, keep: u16, first: usize) {
        #[allow(clippy::cast_possible_truncation, reason = "Points::new admits fewer than 2^32 points")]
        let index = lanes(|lane| first as u32 + lane as u32);
        let len = self.len() + keep.count_ones() as usize;
        self.x.extend_from_slice(&T::compress(simd, x, keep));
        self.x.truncate(len);
        self.index.extend_from_slice(&simd.compress_u32(&index, keep));
        self.index.truncate(len);
    }

    /// Adds all candidates of another buffer.
    pub(super) fn extend(&mut self, other: &Self) {
        self.x.truncate(self.len());
        self.x.extend_from_slice(&other.x[..other.len()]);
        self.index.extend_from_slice(&other.index);
    }

    /// The candidates in the order in which they came.
    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = Candidate<T>> {
        self.x.iter().zip(&self.index).map(|(&x, &index)| Candidate { x, index })
    }

    /// The least distance; infinite if the buffer is empty.
    pub(super) fn least(&mut self, level: Level) -> T {
        level.run(Least(self.groups()))
    }

    /// The `n`-th nearest candidate, from 1; of two at one distance the one that came first. There must be as many.
    pub(super) fn nth(&mut self, n: usize, level: Level) -> Candidate<T> {
        let Found { x, place } = level.run(Nth { values: self.groups(), n });
        Candidate { x, index: self.index[place] }
    }

    /// The number of distances below `limit`, and the least distance that is not below it; infinite if there is none.
    pub(super) fn cut(&mut self, limit: T, level: Level) -> (usize, T) {
        level.run(Cut { values: self.groups(), limit })
    }

    /// The distances of at most `limit`.
    pub(super) fn up_to(&self, limit: T) -> Vec<T> {
        self.x[..self.len()].iter().copied().filter(|x| *x <= limit).collect()
    }

    /// Drops all but the `n` nearest, and returns the distance of the last of them. There must be as many.
    pub(super) fn keep_nearest(&mut self, n: usize, level: Level) -> T {
        let last = self.nth(n, level).x;
        let mut ties = n - self.cut(last, level).0;
        let mut len = 0;
        for place in 0..self.len() {
            let (x, index) = (self.x[place], self.index[place]);
            let tie = (x == last) & (ties > 0);
            (self.x[len], self.index[len]) = (x, index);
            ties -= usize::from(tie);
            len += usize::from((x < last) | tie);
        }
        self.x.truncate(len);
        self.index.truncate(len);
        last
    }

    /// The distances in groups of lanes.
    fn groups(&mut self) -> &[Lanes<T>] {
        self.x.resize(self.len().next_multiple_of(LANES), T::INFINITY);
        self.x.as_chunks().0
    }
}
