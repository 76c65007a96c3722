//! Pairs of matches: which of them count, the quotients of their distances, and passes over all of them.
//!
//! A pair tells how many times as far apart its matches are now. Roots are expensive and keep the order, so that
//! everything is done with quotients of squared distances. A pass takes a strip of matches with blocks of others,
//! sixteen pairs at a time, and hands them to a [`Visitor`].

use super::matches::{Block, MOST, Matches, Places};
use crate::lanes::{LANES, Lanes, each};
use crate::real::Real;
use crate::simd::{Instructions, Level};
use std::cell::Cell;
use std::ops::Range;

/// Two previous positions whose squared distance is at most this are the same spot. It is the square of the smallest
/// step above 1 in float64.
pub(super) const SAME_SPOT: f64 = f64::EPSILON * f64::EPSILON;

/// Which pairs count: those whose matches were apart, and are far enough apart now.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    /// The least distance now, squared.
    pub least: f64,
}

impl Rule {
    pub(super) fn new(min_distance: f64) -> Self {
        Rule { least: min_distance * min_distance }
    }

    /// The quotient of the squared distances of a pair, now over before, and whether the pair counts.
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

/// The squared distances of a group of points from one point.
#[inline(always)]
pub(super) fn squared_lanes<T: Real>([x, y]: [&Lanes<T>; 2], from: [T; 2]) -> Lanes<T> {
    std::array::from_fn(|lane| {
        let [x, y] = [x[lane] - from[0], y[lane] - from[1]];
        x * x + y * y
    })
}

/// The quotients of the squared distances of a match from each of a block, now over before; NaN where the pair does not
/// count.
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

/// One ratio of distances for all pairs, and the number of pairs that it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ratio {
    pub ratio: f64,
    pub pairs: usize,
}

impl Ratio {
    /// The mean of the ratios that belong to two quotients.
    pub(super) fn between(low: f64, high: f64, pairs: usize) -> Self {
        Ratio { ratio: f64::midpoint(low.sqrt(), high.sqrt()), pairs }
    }
}

/// The ranks, from 0, of the order statistics whose mean is the median: one rank for an odd count, two for an even one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Middle {
    pub low: usize,
    pub high: usize,
}

impl Middle {
    /// The ranks for `count` values, of which there is at least one.
    pub(super) fn of(count: usize) -> Self {
        Middle { low: (count - 1) / 2, high: count / 2 }
    }
}

/// The key that quotients are sorted by: their bits, which are in order because quotients are at least 0. Bits are
/// quicker to compare than values.
#[inline(always)]
#[allow(clippy::trivially_copy_pass_by_ref, reason = "a key function gets a reference")]
pub(super) fn in_order(quotient: &f64) -> u64 {
    quotient.to_bits()
}

/// Two values that the median should lie between, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bracket {
    pub low: f64,
    pub high: f64,
}

impl Bracket {
    /// The bracket that holds any quotient.
    pub(super) const ALL: Bracket = Bracket { low: 0.0, high: f64::INFINITY };

    /// The bracket around the median of all values, by a sample. The sample has `below` values below this bracket,
    /// `above` values above it, and the values `inside` it.
    ///
    /// The new bracket is as wide as `deviations` standard deviations of the rank of a sample's median. An end that the
    /// sample says nothing about stays as it is.
    pub(super) fn narrowed(self, inside: &mut [f64], below: usize, above: usize, deviations: f64) -> Self {
        let count = below + inside.len() + above;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number above 0")]
        let margin = (deviations * 0.5 * (count as f64).sqrt()).ceil() as usize;
        let low = (count / 2).checked_sub(margin + below);
        let high = (count / 2 + margin).checked_sub(below).filter(|high| *high < inside.len());
        let mut narrow = self;
        if let Some(high) = high {
            narrow.high = *inside.select_nth_unstable_by_key(high, in_order).1;
        }
        if let Some(low) = low.filter(|low| *low < inside.len()) {
            // The values up to `high` are in front now.
            let front = high.map_or(inside.len(), |high| high + 1);
            narrow.low = *inside[..front.max(low + 1)].select_nth_unstable_by_key(low, in_order).1;
        }
        narrow
    }

    /// Whether a value is inside the bracket.
    pub(super) fn holds(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// All pairs of some matches, and how to go through them.
pub(super) struct AllPairs<'m, T> {
    /// The matches in an order that samples may be taken from.
    pub sampled: &'m Matches<T>,
    /// The matches in an order that lets blocks be left out, if there are `places`.
    pub matches: &'m Matches<T>,
    pub places: &'m [Places<T>],
    pub rule: Rule,
    pub level: Level,
    pub threads: usize,
}

/// Visits pairs.
pub(super) trait Visitor<T> {
    /// Visits the pairs of match `i`, which is `from`, with a block of matches that begins with match `j`. Lanes of NaN
    /// do not count.
    fn visit<I: Instructions>(&mut self, simd: I, i: usize, from: [T; 4], j: usize, block: &Block<T>);

    /// Says at the end of a strip whether to go on.
    fn continues(&mut self) -> bool {
        true
    }
}

/// Matches, and which of their pairs to visit.
pub(super) struct Pairs<'m, T> {
    pub matches: &'m Matches<T>,
    /// The bounds of the blocks, if they are patches of the picture. If there are none, no block is left out.
    pub places: &'m [Places<T>],
    /// Pairs whose squared distance now is less than this need not be visited.
    pub least: T,
    pub part: Part,
}

impl<T: Real> Pairs<'_, T> {
    /// Visits each pair.
    #[inline(always)]
    pub(super) fn each<I: Instructions>(&self, simd: I, visitor: &mut impl Visitor<T>) {
        let Pairs { matches, places, least, part } = self;
        for number in part.strips() {
            let Some(strip) = part.strip(matches, number) else { continue };
            for (i, from) in strip.rows {
                if let Some((j, block)) = strip.own(i) {
                    visitor.visit(simd, i, from, j, &block);
                }
            }
            if places.is_empty() {
                for (j, block) in strip.rest() {
                    for (i, from) in strip.rows {
                        visitor.visit(simd, i, from, j, block);
                    }
                }
            } else {
                for (at, places) in places.iter().enumerate().skip(strip.first / LANES) {
                    let mut near = places.in_reach(simd, &strip.rows, *least) & strip.behind(at * LANES);
                    while near != 0 {
                        let at = at * LANES + near.trailing_zeros() as usize;
                        near &= near - 1;
                        for (i, from) in strip.rows {
                            visitor.visit(simd, i, from, at * LANES, &matches.blocks()[at]);
                        }
                    }
                }
            }
            if !visitor.continues() {
                return;
            }
        }
    }
}

/// Some of the pairs `i < j`: those of a range of double strips, or an even sample of those.
///
/// A strip is [`ROWS`] matches with the blocks of matches from their own on. Strips get shorter, so a double strip is
/// one from each end, and all double strips are of about one length.
#[derive(Clone)]
pub(super) struct Part {
    pub double_strips: Range<usize>,
    /// The sample takes one block in this many.
    pub every: usize,
}

/// The matches that are compared with a block while it is in the cache. They belong to one block themselves.
const ROWS: usize = 2;
const _: () = assert!(LANES.is_multiple_of(ROWS));

/// Some matches in a row, and the blocks of matches behind them.
struct Strip<'m, T> {
    /// The matches and their numbers; NaN behind the last of all.
    rows: [(usize, [T; 4]); ROWS],
    own: Option<&'m Block<T>>,
    rest: &'m [Block<T>],
    first: usize,
    every: usize,
}

impl Part {
    /// The number of double strips of `matches` matches.
    pub(super) fn double_strips(matches: usize) -> usize {
        matches.div_ceil(2 * ROWS)
    }

    /// The most groups of pairs in this part, and in one of its strips.
    pub(super) fn most_groups(&self, matches: usize) -> (usize, usize) {
        let of_strip = ROWS * (matches.div_ceil(LANES).div_ceil(self.every) + 1);
        (self.double_strips.len() * 2 * of_strip, of_strip)
    }

    /// The numbers of its strips.
    #[inline(always)]
    fn strips(&self) -> Range<usize> {
        2 * self.double_strips.start..2 * self.double_strips.end
    }

    /// Strip `number`; `None` for the second time of a strip that both ends share.
    #[inline(always)]
    fn strip<'m, T: Real>(&self, matches: &'m Matches<T>, number: usize) -> Option<Strip<'m, T>> {
        let (near, far) = (number / 2, matches.len().div_ceil(ROWS) - 1 - number / 2);
        let strip = if number.is_multiple_of(2) { near } else { far };
        (number.is_multiple_of(2) || near != far).then(|| Strip::new(matches, strip, self.every))
    }
}

impl<'m, T: Real> Strip<'m, T> {
    /// NaN, then 0: a window of it blanks the first lanes of a block that it is added to.
    const BLANKS: [T; 2 * LANES] = {
        let mut blanks = [T::NAN; 2 * LANES];
        let mut lane = LANES;
        while lane < 2 * LANES {
            blanks[lane] = T::ZERO;
            lane += 1;
        }
        blanks
    };

    /// A strip of one block in `every`. Each strip begins at another block, so that a sample holds some of all.
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

    /// The block of match `i` itself with NaN up to that match, and the number of its first match.
    #[inline(always)]
    fn own(&self, i: usize) -> Option<(usize, Block<T>)> {
        self.own.map(|[x0, y0, x1, y1]| {
            let blanks: Lanes<T> = std::array::from_fn(|lane| Self::BLANKS[LANES - 1 - i % LANES + lane]);
            let blanked = |x: &Lanes<T>| std::array::from_fn(|lane| x[lane] + blanks[lane]);
            (i - i % LANES, [blanked(x0), *y0, blanked(x1), *y1])
        })
    }

    /// A bit for each of sixteen blocks, from `block` on, that lies behind this strip's own.
    #[inline(always)]
    fn behind(&self, block: usize) -> u16 {
        u16::MAX.checked_shl(u32::try_from(self.first.saturating_sub(block)).unwrap_or(u32::MAX)).unwrap_or(0)
    }

    /// Each other block with the number of its first match.
    #[inline(always)]
    fn rest(&self) -> impl Iterator<Item = (usize, &'m Block<T>)> + use<'m, T> {
        let (first, every) = (self.first, self.every);
        self.rest.iter().step_by(every).enumerate().map(move |(at, block)| ((first + at * every) * LANES, block))
    }
}

/// Pairs that a pass cannot decide in the type of the positions, and leaves to be decided one by one in float64.
///
/// The memory is there from the beginning: a call in the loop that might ask for more would cost the loop all its
/// registers.
pub(super) struct Borderline {
    /// The first `used` of these are groups.
    words: Vec<u64>,
    used: usize,
    room: usize,
    overflown: bool,
}

thread_local! {
    /// The memory of the last call: new pages from the system take as long as a pass over a thousand matches.
    static KEPT: Cell<Vec<u64>> = const { Cell::new(Vec::new()) };
}

/// The most memory that is kept for the next call, in words.
const MOST_KEPT: usize = 1 << 16;

impl Drop for Borderline {
    fn drop(&mut self) {
        if self.words.len() <= MOST_KEPT {
            KEPT.set(std::mem::take(&mut self.words));
        }
    }
}

impl Borderline {
    /// Room for all groups of a part, or for `room` of them and those of one strip.
    pub(super) fn new(part: &Part, matches: usize, room: usize) -> Self {
        let (all, of_strip) = part.most_groups(matches);
        let least = all.min(room.saturating_add(of_strip)) + 1;
        let mut words = KEPT.take();
        if words.len() < least {
            words.resize(least, 0);
        }
        Borderline { words, used: 0, room, overflown: false }
    }

    /// Notes the pairs of match `i` with those lanes from match `j` on whose bit is set.
    #[inline(always)]
    pub(super) fn note(&mut self, i: usize, j: usize, bits: u16) {
        self.words[self.used] = Group::new(i, j, bits).0;
        self.used += usize::from(bits != 0);
    }

    /// Says at the end of a strip whether there were too many pairs. They are all forgotten then.
    #[inline(always)]
    pub(super) fn is_overflown(&mut self) -> bool {
        if self.used > self.room {
            (self.used, self.overflown) = (0, true);
        }
        self.overflown
    }

    /// The quotients of the pairs that count, in float64.
    pub(super) fn quotients<T: Real>(&self, matches: &Matches<T>, rule: Rule) -> Vec<f64> {
        let groups = &self.words[..self.used];
        let pairs: usize = groups.iter().map(|word| Group(*word).len()).sum();
        let mut quotients = vec![0.0; pairs + 1];
        let mut used = 0;
        for word in groups {
            Group(*word).for_each(|i, j| {
                // It is written whether the pair counts or not, without a branch that would be guessed wrongly.
                let (quotient, counts) = rule.quotient(matches, i, j);
                quotients[used] = quotient;
                used += usize::from(counts);
            });
        }
        quotients.truncate(used);
        quotients
    }
}

const _: () = assert!(MOST <= 1 << 24);

/// A group of pairs in one word: match `i` with some of the lanes from match `j` on. It has 24 bits each for `i` and
/// `j`, and a bit for each lane.
#[derive(Clone, Copy, Default)]
struct Group(u64);

impl Group {
    #[inline(always)]
    fn new(i: usize, j: usize, bits: u16) -> Self {
        Group((i as u64) << 40 | (j as u64) << 16 | u64::from(bits))
    }

    /// The number of its pairs.
    fn len(self) -> usize {
        (self.0 & 0xffff).count_ones() as usize
    }

    /// Calls with each of its pairs.
    #[inline(always)]
    fn for_each(self, mut pair: impl FnMut(usize, usize)) {
        #[allow(clippy::cast_possible_truncation, reason = "24 bits")]
        let [i, j] = [self.0 >> 40, self.0 >> 16 & 0xff_ffff].map(|place| place as usize);
        let mut bits = self.0 & 0xffff;
        while bits != 0 {
            pair(i, j + bits.trailing_zeros() as usize);
            bits &= bits - 1;
        }
    }
}
