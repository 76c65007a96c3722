//! Pairs of matches, and which of them count.

use super::matches::{Block, MOST, Matches};
use crate::lanes::{LANES, Lanes, each};
use crate::real::Real;
use std::ops::Range;

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
    let [before, now] = [[from[0], from[1]], [from[2], from[3]]].map(|from| from.map(T::wide));
    let wide = |lanes: &Lanes<T>| each(*lanes, T::wide);
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

/// Some of the pairs `i < j`: those of a range of double strips, or an even sample of them.
///
/// A strip is [`ROWS`] matches beside the blocks of matches from their own on. Strips get shorter, so a double strip is one
/// from each end: all are of about the same length.
#[derive(Clone)]
pub(super) struct Part {
    pub double_strips: Range<usize>,
    /// One block in so many.
    pub every: usize,
}

/// Matches that are compared with a block while it is at hand. They are of one block themselves.
const ROWS: usize = 2;
const _: () = assert!(LANES.is_multiple_of(ROWS));

/// Some matches in a row, and the matches behind them in blocks.
pub(super) struct Strip<'m, T> {
    /// The matches, and which they are; behind the last of all there is NaN.
    pub rows: [(usize, [T; 4]); ROWS],
    own: Option<&'m Block<T>>,
    rest: &'m [Block<T>],
    first: usize,
    every: usize,
}

impl Part {
    /// How many double strips there are of so many matches.
    pub(super) fn double_strips(matches: usize) -> usize {
        matches.div_ceil(2 * ROWS)
    }

    /// No more groups of pairs than this are in it, and in one of its strips.
    pub(super) fn most_groups(&self, matches: usize) -> (usize, usize) {
        let of_strip = ROWS * (matches.div_ceil(LANES).div_ceil(self.every) + 1);
        (self.double_strips.len() * 2 * of_strip, of_strip)
    }

    /// Numbers for its strips.
    #[inline(always)]
    pub(super) fn strips(&self) -> Range<usize> {
        2 * self.double_strips.start..2 * self.double_strips.end
    }

    /// Strip `number`, unless it is one that both ends have in common, the second time.
    #[inline(always)]
    pub(super) fn strip<'m, T: Real>(&self, matches: &'m Matches<T>, number: usize) -> Option<Strip<'m, T>> {
        let (near, far) = (number / 2, matches.len().div_ceil(ROWS) - 1 - number / 2);
        let strip = if number.is_multiple_of(2) { near } else { far };
        (number.is_multiple_of(2) || near != far).then(|| Strip::new(matches, strip, self.every))
    }
}

impl<'m, T: Real> Strip<'m, T> {
    /// NaN, then 0: a window of it blanks the first lanes of what it is added to.
    const BLANKS: [T; 2 * LANES] = {
        let mut blanks = [T::NAN; 2 * LANES];
        let mut lane = LANES;
        while lane < 2 * LANES {
            blanks[lane] = T::ZERO;
            lane += 1;
        }
        blanks
    };

    /// Of one block in `every`. Each strip begins elsewhere, so that a sample has a bit of all.
    #[inline(always)]
    fn new(matches: &'m Matches<T>, strip: usize, every: usize) -> Self {
        let (i, skipped) = (strip * ROWS, strip % every);
        let own = i / LANES;
        let block = &matches.blocks()[own];
        let rows = std::array::from_fn(|row| (i + row, block.map(|column| column[i % LANES + row])));
        let first = own + if skipped == 0 { every } else { skipped };
        let rest = matches.blocks().get(first..).unwrap_or_default();
        Strip { rows, own: (skipped == 0).then_some(block), rest, first, every }
    }

    /// The block of match `i` itself, with NaN up to there, and the match that it begins with.
    #[inline(always)]
    pub(super) fn own(&self, i: usize) -> Option<(usize, Block<T>)> {
        self.own.map(|[x0, y0, x1, y1]| {
            let blanks: Lanes<T> = std::array::from_fn(|lane| Self::BLANKS[LANES - 1 - i % LANES + lane]);
            let blanked = |x: &Lanes<T>| std::array::from_fn(|lane| x[lane] + blanks[lane]);
            (i - i % LANES, [blanked(x0), *y0, blanked(x1), *y1])
        })
    }

    /// Each other block with the match that it begins with.
    #[inline(always)]
    pub(super) fn rest(&self) -> impl Iterator<Item = (usize, &'m Block<T>)> + use<'m, T> {
        let (first, every) = (self.first, self.every);
        self.rest.iter().step_by(every).enumerate().map(move |(at, block)| ((first + at * every) * LANES, block))
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
