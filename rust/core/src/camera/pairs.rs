//! Pairs of matches: which of them count, the quotients of their distances, and passes over all of them.
//!
//! A pair tells how many times as far apart its matches are now. Roots are expensive and keep the order, so that
//! everything is done with quotients of squared distances. A pass takes a strip of matches with blocks of others,
//! sixteen pairs at a time, and hands them to a [`Visitor`].

use super::matches::{Block, MOST, Matches, Places, Tiles};
use super::shifts::Measure;
use crate::interrupt::worked;
use crate::lanes::{LANES, Lanes, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Level};
use crate::threads::pieces;
use std::cell::Cell;
use std::cmp::Ordering;
use std::ops::Range;

/// Two previous positions whose squared distance is at most this are the same spot. It is the square of the smallest
/// step above 1 in float64.
pub(super) const SAME_SPOT: f64 = f64::EPSILON * f64::EPSILON;

/// Squared distances below this are not trusted, because smaller ones may have lost digits to underflow. It is above
/// `SAME_SPOT`.
pub(super) const TRUSTED: f64 = 1e-30;
const _: () = assert!(TRUSTED > SAME_SPOT);

/// The fewest double strips of matches that are worth a thread of their own.
const LEAST_PIECE: usize = 128;

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

impl Measure<f64> for Rule {
    /// The quotients of the squared distances of pairs, now over before; NaN where a pair does not count.
    #[inline(always)]
    fn of<I: Instructions>(self, _: I, a: [&Lanes<f64>; 4], b: [&Lanes<f64>; 4]) -> Lanes<f64> {
        lanes(|lane| {
            let [before, now] = [0, 2].map(|column| {
                let [x, y] = [b[column][lane] - a[column][lane], b[column + 1][lane] - a[column + 1][lane]];
                x * x + y * y
            });
            let counts = (before > SAME_SPOT) & (now >= self.least);
            if counts { now / before } else { f64::NAN }
        })
    }
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

/// The order of values, none of which is NaN.
#[inline(always)]
pub(super) fn in_order<T: Real>(a: &T, b: &T) -> Ordering {
    a.partial_cmp(b).unwrap_or(Ordering::Equal)
}

/// Two values that the median should lie between, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bracket {
    pub low: f64,
    pub high: f64,
}

impl Bracket {
    /// The bracket that holds any value.
    pub(super) const ALL: Bracket = Bracket { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// The bracket around the value that a share of all values is below, by a sample of `count` values. The sample has
    /// `below` values below this bracket, and the values `inside` it.
    ///
    /// The new bracket reaches `deviations` standard deviations of the rank in the sample to each side. An end that the
    /// sample says nothing about stays as it is.
    pub(super) fn narrowed<T: Real>(
        self,
        inside: &mut [T],
        below: usize,
        count: usize,
        share: f64,
        deviations: f64,
    ) -> Self {
        let rank = share * count as f64;
        let margin = deviations * (rank * (1.0 - share)).sqrt() + 1.0;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is at least 0")]
        let place = |rank: f64| (rank >= 0.0).then_some(rank as usize)?.checked_sub(below);
        let high = place((rank + margin).ceil()).filter(|high| *high < inside.len());
        let mut narrow = self;
        if let Some(high) = high {
            narrow.high = inside.select_nth_unstable_by(high, in_order).1.to_f64();
        }
        if let Some(low) = place((rank - margin).floor()).filter(|low| *low < inside.len()) {
            // The values up to `high` are in front now.
            let front = high.map_or(inside.len(), |high| high + 1);
            narrow.low = inside[..front.max(low + 1)].select_nth_unstable_by(low, in_order).1.to_f64();
        }
        narrow
    }

    /// The bracket with both ends farther out.
    pub(super) fn widened(self, by: f64) -> Self {
        Bracket { low: self.low - by, high: self.high + by }
    }

    /// Whether a value is inside the bracket.
    pub(super) fn holds(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// Matches, where they are and which of their pairs count, and who goes through all of them.
pub(super) struct AllPairs<'m, T> {
    pub matches: &'m Matches<T>,
    pub places: &'m [Places<T>],
    pub rule: Rule,
    /// Pairs whose squared distance now is less than this need not be visited.
    least: T,
    pub level: Level,
    threads: usize,
}

impl<'m, T: Real> AllPairs<'m, T> {
    /// All pairs of matches, which lie in tiles if there are enough of them.
    pub(super) fn of(
        matches: &'m Matches<T>,
        tiles: Option<&'m Tiles<T>>,
        rule: Rule,
        least: T,
        level: Level,
        threads: usize,
    ) -> Self {
        let (matches, places) = tiles.map_or((matches, &[] as &[_]), |tiles| (&tiles.matches, &tiles.places));
        AllPairs { matches, places, rule, least, level, threads }
    }

    /// About the number of groups of pairs.
    pub(super) fn groups(&self) -> usize {
        self.matches.len() * self.matches.len() / (2 * LANES)
    }

    /// The results of `pass` for parts of all pairs, one for each piece of work for a thread.
    pub(super) fn each_part<R: Send>(&self, pass: impl Fn(Pairs<'m, T>) -> R + Sync) -> Vec<R> {
        let AllPairs { matches, places, least, .. } = *self;
        pieces(self.threads, double_strips(matches.len()), LEAST_PIECE, |double_strips| {
            pass(Pairs { matches, places, least, double_strips })
        })
    }
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

/// Matches, and which of their pairs `i < j` to visit.
pub(super) struct Pairs<'m, T> {
    pub matches: &'m Matches<T>,
    /// The bounds of the blocks, if they are patches of the picture. If there are none, no block is left out.
    pub places: &'m [Places<T>],
    /// Pairs whose squared distance now is less than this need not be visited.
    pub least: T,
    pub double_strips: Range<usize>,
}

impl<T: Real> Pairs<'_, T> {
    /// Visits each pair.
    #[inline(always)]
    pub(super) fn each<I: Instructions>(&self, simd: I, visitor: &mut impl Visitor<T>) {
        let Pairs { matches, places, least, double_strips } = self;
        for half in 2 * double_strips.start..2 * double_strips.end {
            let Some(strip) = Strip::of(matches, half) else { continue };
            for (i, from) in strip.rows {
                let (j, block) = strip.own(i);
                visitor.visit(simd, i, from, j, &block);
            }
            if places.is_empty() {
                for (at, block) in matches.blocks().iter().enumerate().skip(strip.behind) {
                    for (i, from) in strip.rows {
                        visitor.visit(simd, i, from, at * LANES, block);
                    }
                }
            } else {
                for (at, places) in places.iter().enumerate().skip(strip.behind / LANES) {
                    let mut near = places.in_reach(simd, &strip.rows, *least) & strip.is_behind(at * LANES);
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
            if half % STRIPS_BETWEEN == 0 {
                worked(STRIPS_BETWEEN * ROWS * matches.len());
            }
        }
    }

    /// These pairs in parts whose groups fit into the memory that is kept.
    pub(super) fn parts(self) -> impl Iterator<Item = Self> {
        let Range { start, end } = self.double_strips;
        let of_double_strip = 2 * self.most_groups().1;
        let each = (MOST_KEPT / of_double_strip).max(1);
        (start..end).step_by(each).map(move |at| Pairs { double_strips: at..end.min(at + each), ..self })
    }

    /// The most groups of pairs among these, and in one strip.
    fn most_groups(&self) -> (usize, usize) {
        let of_strip = ROWS * (self.matches.blocks().len() + 1);
        (self.double_strips.len() * 2 * of_strip, of_strip)
    }
}

/// A strip of matches and the blocks of matches from their own on.
///
/// Strips get shorter, so a double strip is one from each end, and all double strips are of about one length.
struct Strip<'m, T> {
    /// The matches and their numbers; NaN behind the last of all.
    rows: [(usize, [T; 4]); ROWS],
    own: &'m Block<T>,
    /// The number of the first block behind its own.
    behind: usize,
}

/// The matches that are compared with a block while it is in the cache. They belong to one block themselves.
const ROWS: usize = 2;
const _: () = assert!(LANES.is_multiple_of(ROWS));

/// The strips that are visited before their work is counted.
const STRIPS_BETWEEN: usize = 16;

/// The number of double strips of some matches.
fn double_strips(matches: usize) -> usize {
    matches.div_ceil(2 * ROWS)
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

    /// Half number `half` of the double strips; `None` for the second time of a strip that both ends share.
    #[inline(always)]
    fn of(matches: &'m Matches<T>, half: usize) -> Option<Self> {
        let (near, far) = (half / 2, matches.len().div_ceil(ROWS) - 1 - half / 2);
        let is_near = half.is_multiple_of(2);
        (is_near || near != far).then(|| Strip::new(matches, if is_near { near } else { far }))
    }

    #[inline(always)]
    fn new(matches: &'m Matches<T>, strip: usize) -> Self {
        let i = strip * ROWS;
        let own = &matches.blocks()[i / LANES];
        let rows = std::array::from_fn(|row| (i + row, own.map(|column| column[i % LANES + row])));
        Strip { rows, own, behind: i / LANES + 1 }
    }

    /// The block of match `i` itself with NaN up to that match, and the number of its first match.
    #[inline(always)]
    fn own(&self, i: usize) -> (usize, Block<T>) {
        let [x0, y0, x1, y1] = self.own;
        let blanks: Lanes<T> = std::array::from_fn(|lane| Self::BLANKS[LANES - 1 - i % LANES + lane]);
        let blanked = |x: &Lanes<T>| std::array::from_fn(|lane| x[lane] + blanks[lane]);
        (i - i % LANES, [blanked(x0), *y0, blanked(x1), *y1])
    }

    /// A bit for each of sixteen blocks, from `block` on, that lies behind this strip's own.
    #[inline(always)]
    fn is_behind(&self, block: usize) -> u16 {
        u16::MAX.checked_shl(u32::try_from(self.behind.saturating_sub(block)).unwrap_or(u32::MAX)).unwrap_or(0)
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
    /// Room for all groups of some pairs, or for `room` of them and those of one strip.
    pub(super) fn new<T: Real>(pairs: &Pairs<'_, T>, room: usize) -> Self {
        let (all, of_strip) = pairs.most_groups();
        let least = all.min(room.saturating_add(of_strip)) + 1;
        let mut words = KEPT.take();
        if words.len() < least {
            words.resize(least, 0);
        }
        Borderline { words, used: 0, room, overflown: false }
    }

    /// Notes the pairs of match `i` with those lanes from match `j` on whose bit is set.
    #[inline(always)]
    pub(super) fn note(&mut self, i: usize, j: usize, bits: u32) {
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

    /// The quotients in float64 of the pairs that count, of matches whose numbers are `order` of those in the pass.
    pub(super) fn quotients<T: Real>(
        &self,
        matches: &Matches<T>,
        order: impl Fn(usize) -> usize,
        rule: Rule,
    ) -> Vec<f64> {
        let groups = &self.words[..self.used];
        let pairs: usize = groups.iter().map(|word| Group(*word).len()).sum();
        let mut quotients = vec![0.0; pairs + 1];
        let mut used = 0;
        for word in groups {
            Group(*word).for_each(|i, j| {
                // It is written whether the pair counts or not, without a branch that would be guessed wrongly.
                let (quotient, counts) = rule.quotient(matches, order(i), order(j));
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
    fn new(i: usize, j: usize, bits: u32) -> Self {
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
