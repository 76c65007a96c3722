//! Distances ahead and the points that they are of, in the order in which they came.

use super::candidates::Candidate;
use super::order::{Cut, Found, Least, Nth};
use crate::lanes::{LANES, Lanes, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Level};

/// Candidates that are kept; their distances are finite.
pub(super) struct Kept<T> {
    /// Distances, and then perhaps infinite ones up to a whole number of groups of lanes.
    x: Vec<T>,
    index: Vec<u32>,
}

impl<T: Real> Kept<T> {
    /// None yet, with room for so many.
    pub(super) fn with_capacity(room: usize) -> Self {
        Kept { x: Vec::with_capacity(room + LANES), index: Vec::with_capacity(room + LANES) }
    }

    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.index.len()
    }

    /// One more.
    #[inline(always)]
    pub(super) fn push(&mut self, x: T, index: usize) {
        self.x.push(x);
        #[allow(clippy::cast_possible_truncation, reason = "Points::new admits fewer than 2^32 points")]
        self.index.push(index as u32);
    }

    /// Some more: those of the points `first .. first + LANES` whose bit is set. Whole registers are written, and what is
    /// too much is dropped: without a branch, for no processor could guess it.
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

    /// These, then others.
    pub(super) fn extend(&mut self, other: &Self) {
        self.x.truncate(self.len());
        self.x.extend_from_slice(&other.x[..other.len()]);
        self.index.extend_from_slice(&other.index);
    }

    /// All, in the order in which they came.
    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = Candidate<T>> {
        self.x.iter().zip(&self.index).map(|(&x, &index)| Candidate { x, index })
    }

    /// The distance of the nearest; infinite if there is none.
    pub(super) fn least(&mut self, level: Level) -> T {
        level.run(Least(self.groups()))
    }

    /// The `n`-th nearest, from 1; of two as near the one that came first. There must be as many.
    pub(super) fn nth(&mut self, n: usize, level: Level) -> Candidate<T> {
        let Found { x, place } = level.run(Nth { values: self.groups(), n });
        Candidate { x, index: self.index[place] }
    }

    /// How many are below a limit, and the least distance that is not; infinite if there is none.
    pub(super) fn cut(&mut self, limit: T, level: Level) -> (usize, T) {
        level.run(Cut { values: self.groups(), limit })
    }

    /// The distances up to `limit`.
    pub(super) fn up_to(&self, limit: T) -> Vec<T> {
        self.x[..self.len()].iter().copied().filter(|x| *x <= limit).collect()
    }

    /// Forget all but the `n` nearest; gives the last of them. There must be as many.
    pub(super) fn thin(&mut self, n: usize, level: Level) -> T {
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

    /// The distances as lanes.
    fn groups(&mut self) -> &[Lanes<T>] {
        self.x.resize(self.len().next_multiple_of(LANES), T::INFINITY);
        self.x.as_chunks().0
    }
}
