//! Pairs of matches, and which of them count.

use super::matches::{Block, MOST, Matches};
use crate::lanes::{Lanes, each};
use crate::real::Real;

/// Two previous positions whose distance, squared, is no more than this are the same spot: that of the smallest step
/// above 1 in float64.
pub(super) const SAME_SPOT: f64 = f64::EPSILON * f64::EPSILON;

/// Which pairs count: those that were apart, and are far enough apart now.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    /// The least distance now, squared.
    pub least: f64,
}

impl Rule {
    pub(super) fn new(min_distance: f64) -> Self {
        Rule { least: min_distance * min_distance }
    }

    /// Quotient of the squared distances of a pair, now over before, and whether the pair counts.
    #[inline(always)]
    pub(super) fn quotient<T: Real>(self, matches: &Matches<T>, i: usize, j: usize) -> (f64, bool) {
        let ((before_i, now_i), (before_j, now_j)) = (matches.get(i), matches.get(j));
        let (before, now) = (squared(before_i, before_j), squared(now_i, now_j));
        (now / before, (before > SAME_SPOT) & (now >= self.least))
    }
}

#[inline(always)]
fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
    let [x, y] = [b[0] - a[0], b[1] - a[1]];
    x * x + y * y
}

/// Squared distances of a group of points from one.
#[inline(always)]
pub(super) fn squared_lanes<T: Real>([x, y]: [&Lanes<T>; 2], from: [T; 2]) -> Lanes<T> {
    std::array::from_fn(|lane| {
        let [x, y] = [x[lane] - from[0], y[lane] - from[1]];
        x * x + y * y
    })
}

/// Quotients of the squared distances of a match and each of a block, now over before; NaN where the pair does not count.
#[inline(always)]
pub(super) fn quotients<T: Real>([x0, y0, x1, y1]: &Block<T>, from: [T; 4], rule: Rule) -> Lanes<f64> {
    let [before, now] = [[from[0], from[1]], [from[2], from[3]]].map(|from| from.map(T::to_f64));
    let wide = |lanes: &Lanes<T>| each(*lanes, T::to_f64);
    let before = squared_lanes([&wide(x0), &wide(y0)], before);
    let now = squared_lanes([&wide(x1), &wide(y1)], now);
    std::array::from_fn(|lane| {
        let counts = (before[lane] > SAME_SPOT) & (now[lane] >= rule.least);
        if counts { now[lane] / before[lane] } else { f64::NAN }
    })
}

/// One ratio of distances for all pairs, and how many of them it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ratio {
    pub ratio: f64,
    pub pairs: usize,
}

impl Ratio {
    /// The mean of two, by the quotients of their squared distances.
    pub(super) fn between(low: f64, high: f64, pairs: usize) -> Self {
        Ratio { ratio: f64::midpoint(low.sqrt(), high.sqrt()), pairs }
    }
}

const _: () = assert!(MOST <= 1 << 24);

/// A group of pairs, match `i` with some of the lanes from match `j` on, in one word: 24 bits each for `i` and `j`, and a bit for
/// each lane.
#[derive(Clone, Copy, Default)]
pub(super) struct Group(pub u64);

impl Group {
    #[inline(always)]
    pub(super) fn new(i: usize, j: usize, bits: u16) -> Self {
        Group((i as u64) << 40 | (j as u64) << 16 | u64::from(bits))
    }

    /// How many pairs it has.
    pub(super) fn len(self) -> usize {
        (self.0 & 0xffff).count_ones() as usize
    }

    /// Each pair of it.
    #[inline(always)]
    pub(super) fn for_each(self, mut pair: impl FnMut(usize, usize)) {
        #[allow(clippy::cast_possible_truncation, reason = "24 bits")]
        let [i, j] = [self.0 >> 40, self.0 >> 16 & 0xff_ffff].map(|place| place as usize);
        let mut bits = self.0 & 0xffff;
        while bits != 0 {
            pair(i, j + bits.trailing_zeros() as usize);
            bits &= bits - 1;
        }
    }
}
