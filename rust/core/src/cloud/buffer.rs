//! The candidates that a pass keeps: distances ahead, and the points that they belong to, in the order in which they
//! came.
//!
//! Distances are stored apart from the numbers of points, so that kernels count and compare them as lanes.

use super::order::{Cut, Ends, Found, Nth};
use crate::lanes::{LANES, Lanes, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Level};
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

/// The most candidates whose memory is kept for the next buffer.
const KEPT: usize = 1 << 14;

impl<T: Real> Drop for CandidateBuffer<T> {
    fn drop(&mut self) {
        if self.x.capacity() <= KEPT {
            T::spare().set((take(&mut self.x), take(&mut self.index)));
        }
    }
}

impl<T: Real> CandidateBuffer<T> {
    /// An empty buffer, in the memory of the last one of this thread.
    pub(super) fn new() -> Self {
        let (mut x, mut index) = T::spare().take();
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

    /// The candidates, of which there must be one, to ask for order statistics.
    #[inline(always)]
    pub(super) fn ranking(&mut self, level: Level) -> Ranking<'_, T> {
        self.x.resize(self.len().next_multiple_of(LANES), T::INFINITY);
        let x = self.x.as_chunks().0;
        let (first, greatest) = level.run(Ends(x));
        Ranking { x, index: &self.index, first, greatest, level }
    }

    /// Drops all but the `n` nearest, and returns the distance of the last of them. There must be as many.
    pub(super) fn keep_nearest(&mut self, n: usize, level: Level) -> T {
        let ranking = self.ranking(level);
        let last = ranking.nth(n).x;
        let mut ties = n - ranking.cut(last).0;
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
}

/// All candidates of a buffer, the first of the nearest, and the greatest distance.
pub(super) struct Ranking<'a, T> {
    /// Distances, and infinite ones up to a whole number of groups.
    x: &'a [Lanes<T>],
    index: &'a [u32],
    first: Found<T>,
    greatest: T,
    level: Level,
}

impl<T: Real> Ranking<'_, T> {
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.index.len()
    }

    /// The least distance; 0.0 where it is -0.0.
    #[inline(always)]
    pub(super) fn least(&self) -> T {
        self.first.x + T::ZERO
    }

    /// The `n`-th nearest candidate, from 1; of two at one distance the one that came first. There must be as many.
    #[inline(always)]
    pub(super) fn nth(&self, n: usize) -> Candidate<T> {
        let ends = (self.first.x, self.greatest);
        let nth = || self.level.run(Nth { values: self.x, len: self.len(), ends, n });
        let Found { x, place } = if n == 1 { self.first } else { nth() };
        Candidate { x, index: self.index[place] }
    }

    /// The number of distances below `limit`, and the least distance that is not below it; infinite if there is none.
    pub(super) fn cut(&self, limit: T) -> (usize, T) {
        self.level.run(Cut { values: self.x, limit })
    }

    /// The distances of at most `limit`.
    pub(super) fn up_to(&self, limit: T) -> Vec<T> {
        self.x.as_flattened()[..self.len()].iter().copied().filter(|x| *x <= limit).collect()
    }

    /// The candidates in the order in which they came.
    pub(super) fn iter(&self) -> impl Iterator<Item = Candidate<T>> {
        self.x.as_flattened().iter().zip(self.index).map(|(&x, &index)| Candidate { x, index })
    }
}
