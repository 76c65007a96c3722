//! Similarities between two pictures: scale, turn and shift at once.

use super::matches::Matches;
use super::pairs::SAME_SPOT;
use crate::real::Real;

/// The map `now = turn before + shift`, where points and the turn are complex numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Similarity {
    pub turn: [f64; 2],
    pub shift: [f64; 2],
}

/// Matches about their centres.
pub(super) struct Centred {
    pub before: [f64; 2],
    pub now: [f64; 2],
    /// Sum of squared distances from the centre, before.
    pub size: f64,
    /// Sum of the products of a point now and the conjugate of the point before.
    pub product: [f64; 2],
}

impl Centred {
    /// Centres matches; `None` if there are none, or if all are on one spot. Sums are taken in order.
    pub(super) fn of<T: Real>(matches: &Matches<T>) -> Option<Self> {
        let count = matches.len() as f64;
        let [mut before, mut now] = [[0.0; 2]; 2];
        for i in 0..matches.len() {
            let (p, c) = matches.get(i);
            (before, now) = (plus(before, p), plus(now, c));
        }
        (before, now) = (before.map(|sum| sum / count), now.map(|sum| sum / count));
        let (mut size, mut product) = (0.0, [0.0; 2]);
        for i in 0..matches.len() {
            let (p, c) = matches.get(i);
            let (p, c) = (minus(p, before), minus(c, now));
            size += p[0] * p[0] + p[1] * p[1];
            product = plus(product, [p[0] * c[0] + p[1] * c[1], p[0] * c[1] - p[1] * c[0]]);
        }
        (size > SAME_SPOT * count).then_some(Centred { before, now, size, product })
    }

    /// The similarity of the least squared distances in the later picture.
    pub(super) fn similarity(&self) -> Similarity {
        Similarity::about(self.product.map(|part| part / self.size), self.before, self.now)
    }
}

impl Similarity {
    /// The similarity of the least squared distances in the later picture.
    pub(super) fn fitted<T: Real>(matches: &Matches<T>) -> Option<Self> {
        Centred::of(matches).map(|matches| matches.similarity())
    }

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
        let moved = [turn[0] * before[0] - turn[1] * before[1], turn[0] * before[1] + turn[1] * before[0]];
        Similarity { turn, shift: minus(now, moved) }
    }

    /// The factor by which it enlarges.
    pub(super) fn scale(self) -> f64 {
        (self.turn[0] * self.turn[0] + self.turn[1] * self.turn[1]).sqrt()
    }

    /// Where the similarity puts a match now, less where the match is.
    #[inline(always)]
    pub(super) fn residual(self, p: [f64; 2], c: [f64; 2]) -> [f64; 2] {
        let x = self.turn[0] * p[0] - self.turn[1] * p[1] + self.shift[0] - c[0];
        let y = self.turn[0] * p[1] + self.turn[1] * p[0] + self.shift[1] - c[1];
        [x, y]
    }

    /// The squared distance of a match from where the similarity puts it now.
    #[inline(always)]
    pub(super) fn squared_residual(self, p: [f64; 2], c: [f64; 2]) -> f64 {
        let [x, y] = self.residual(p, c);
        x * x + y * y
    }
}

#[inline(always)]
pub(super) fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

#[inline(always)]
pub(super) fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
