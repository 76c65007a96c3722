//! Similarities between two pictures: scale, turn and shift at once.

use super::matches::{Block, Matches};
use super::pairs::SAME_SPOT;
use crate::lanes::{LANES, Lanes, lanes, sum};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// The map `now = turn before + shift`, where points and the turn are complex numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Similarity {
    pub turn: [f64; 2],
    pub shift: [f64; 2],
}

/// Some of the matches: a bit for each lane of each block.
#[derive(Clone, Copy)]
pub(super) struct Selection<'m, T> {
    pub matches: &'m Matches<T>,
    pub those: &'m [u16],
    pub level: Level,
}

impl<T: Real> Selection<'_, T> {
    /// The number of these matches.
    pub(super) fn len(self) -> usize {
        count(self.those)
    }

    /// The sums of some terms of each match, of where it was and where it is. They do not depend on the level.
    pub(super) fn sums<const N: usize>(self, terms: impl Fn([f64; 2], [f64; 2]) -> [f64; N]) -> [f64; N] {
        self.level.run(Sums { selected: self, terms })
    }
}

/// The number of bits that are set.
pub(super) fn count(those: &[u16]) -> usize {
    those.iter().map(|bits| bits.count_ones() as usize).sum()
}

struct Sums<'m, T, F> {
    selected: Selection<'m, T>,
    terms: F,
}

impl<T: Real, F: Fn([f64; 2], [f64; 2]) -> [f64; N], const N: usize> Kernel for Sums<'_, T, F> {
    type Output = [f64; N];

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) -> [f64; N] {
        let Sums { selected: Selection { matches, those, .. }, terms } = self;
        let mut sums = [[0.0; LANES]; N];
        for ([x0, y0, x1, y1], bits) in matches.blocks().iter().zip(those) {
            for lane in 0..LANES {
                let terms = terms([x0[lane].to_f64(), y0[lane].to_f64()], [x1[lane].to_f64(), y1[lane].to_f64()]);
                for (sum, term) in sums.iter_mut().zip(terms) {
                    sum[lane] += if bits >> lane & 1 == 1 { term } else { 0.0 };
                }
            }
        }
        sums.map(sum)
    }
}

/// Matches about their centres.
#[derive(Clone, Copy)]
pub(super) struct Centred {
    pub before: [f64; 2],
    pub now: [f64; 2],
    /// Sum of squared distances from the centre, before.
    pub size: f64,
    /// Sum of the products of a point now and the conjugate of the point before.
    pub product: [f64; 2],
}

impl Centred {
    /// Centres matches; `None` if there are none, or if all are on one spot.
    pub(super) fn of<T: Real>(selected: Selection<'_, T>) -> Option<Self> {
        let count = selected.len() as f64;
        let [px, py, cx, cy] = selected.sums(|p, c| [p[0], p[1], c[0], c[1]]).map(|sum| sum / count);
        let (before, now) = ([px, py], [cx, cy]);
        let [size, along, across] = selected.sums(|p, c| {
            let (p, c) = (minus(p, before), minus(c, now));
            [squared(p), p[0] * c[0] + p[1] * c[1], p[0] * c[1] - p[1] * c[0]]
        });
        (size > SAME_SPOT * count).then_some(Centred { before, now, size, product: [along, across] })
    }

    /// Scale and turn of the similarity of the least squared distances in the later picture.
    pub(super) fn turn(&self) -> [f64; 2] {
        self.product.map(|part| part / self.size)
    }

    /// The similarity of the least squared distances in the later picture.
    pub(super) fn similarity(&self) -> Similarity {
        Similarity::about(self.turn(), self.before, self.now)
    }
}

impl Similarity {
    /// The similarity that takes two matches where they went; `None` if both were on one spot.
    pub(super) fn through<T: Real>(matches: &Matches<T>, i: usize, j: usize) -> Option<Self> {
        let ((before, now), (p, c)) = (matches.get(i), matches.get(j));
        let (p, c) = (minus(p, before), minus(c, now));
        let size = p[0] * p[0] + p[1] * p[1];
        let product = [p[0] * c[0] + p[1] * c[1], p[0] * c[1] - p[1] * c[0]];
        (size > SAME_SPOT).then(|| Self::about(product.map(|part| part / size), before, now))
    }

    /// The similarity with a turn that takes one point where it went.
    pub(super) fn about(turn: [f64; 2], before: [f64; 2], now: [f64; 2]) -> Self {
        Similarity { turn, shift: minus(now, times(turn, before)) }
    }

    /// The factor by which it enlarges.
    pub(super) fn scale(self) -> f64 {
        squared(self.turn).sqrt()
    }

    /// Where the similarity puts a match now, less where the match is.
    #[inline(always)]
    pub(super) fn residual(self, p: [f64; 2], c: [f64; 2]) -> [f64; 2] {
        let x = self.turn[0] * p[0] - self.turn[1] * p[1] + self.shift[0] - c[0];
        let y = self.turn[0] * p[1] + self.turn[1] * p[0] + self.shift[1] - c[1];
        [x, y]
    }

    /// The squared distances of the matches of a block, computed in their type.
    #[inline(always)]
    pub(super) fn squared_residuals_in<T: Real>(self, [px, py, cx, cy]: &Block<T>) -> Lanes<T> {
        let ([a, b], [x, y]) = (self.turn.map(T::from_f64), self.shift.map(T::from_f64));
        lanes(|lane| {
            let x = a * px[lane] - b * py[lane] + x - cx[lane];
            let y = a * py[lane] + b * px[lane] + y - cy[lane];
            x * x + y * y
        })
    }

    /// More than rounding can do to such a distance, where no coordinate is larger than `farthest`.
    #[inline(always)]
    pub(super) fn rounding<T: Real>(self, farthest: f64) -> f64 {
        let [a, b, x, y] = [self.turn[0], self.turn[1], self.shift[0], self.shift[1]].map(f64::abs);
        T::SLACK.to_f64() * ((1.0 + a + b) * farthest + x + y)
    }

    /// The squared distance of a match from where the similarity puts it now.
    #[inline(always)]
    pub(super) fn squared_residual(self, p: [f64; 2], c: [f64; 2]) -> f64 {
        squared(self.residual(p, c))
    }
}

/// The square of the length.
#[inline(always)]
pub(super) fn squared([x, y]: [f64; 2]) -> f64 {
    x * x + y * y
}

/// The product of complex numbers.
#[inline(always)]
pub(super) fn times(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

#[inline(always)]
pub(super) fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

#[inline(always)]
pub(super) fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
