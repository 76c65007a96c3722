//! The pairs of matches, a match beside a block of others at a time.

use super::matches::{Block, Matches};
use super::tiles::Places;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::Instructions;
use std::ops::Range;

/// Something that looks at pairs.
pub(super) trait Look<T> {
    /// Look at match `i`, which is `from`, beside a block of matches that begins with match `j`. Lanes of NaN do not count.
    fn look<I: Instructions>(&mut self, simd: I, i: usize, from: [T; 4], j: usize, block: &Block<T>);

    /// Whether to go on after some of the rows.
    fn goes_on(&mut self) -> bool {
        true
    }
}

/// Matches, and which of their pairs to look at.
pub(super) struct Pairs<'m, T> {
    pub matches: &'m Matches<T>,
    /// Of the blocks, if they are patches of the picture; if there are none, no block is left out.
    pub places: &'m [Places<T>],
    /// Pairs that are less than this apart now, squared, need not be looked at.
    pub least: T,
    pub part: Part,
}

impl<T: Real> Pairs<'_, T> {
    /// Look at each.
    #[inline(always)]
    pub(super) fn each<I: Instructions>(&self, simd: I, look: &mut impl Look<T>) {
        let Pairs { matches, places, least, part } = self;
        for number in part.strips() {
            let Some(strip) = part.strip(matches, number) else { continue };
            for (i, from) in strip.rows {
                if let Some((j, block)) = strip.own(i) {
                    look.look(simd, i, from, j, &block);
                }
            }
            if places.is_empty() {
                for (j, block) in strip.rest() {
                    for (i, from) in strip.rows {
                        look.look(simd, i, from, j, block);
                    }
                }
            } else {
                for (at, places) in places.iter().enumerate().skip(strip.first / LANES) {
                    let mut near = places.in_reach(simd, &strip.rows, *least) & strip.behind(at * LANES);
                    while near != 0 {
                        let at = at * LANES + near.trailing_zeros() as usize;
                        near &= near - 1;
                        for (i, from) in strip.rows {
                            look.look(simd, i, from, at * LANES, &matches.blocks()[at]);
                        }
                    }
                }
            }
            if !look.goes_on() {
                return;
            }
        }
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
struct Strip<'m, T> {
    /// The matches, and which they are; behind the last of all there is NaN.
    rows: [(usize, [T; 4]); ROWS],
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
    fn strips(&self) -> Range<usize> {
        2 * self.double_strips.start..2 * self.double_strips.end
    }

    /// Strip `number`, unless it is one that both ends have in common, the second time.
    #[inline(always)]
    fn strip<'m, T: Real>(&self, matches: &'m Matches<T>, number: usize) -> Option<Strip<'m, T>> {
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
    fn own(&self, i: usize) -> Option<(usize, Block<T>)> {
        self.own.map(|[x0, y0, x1, y1]| {
            let blanks: Lanes<T> = std::array::from_fn(|lane| Self::BLANKS[LANES - 1 - i % LANES + lane]);
            let blanked = |x: &Lanes<T>| std::array::from_fn(|lane| x[lane] + blanks[lane]);
            (i - i % LANES, [blanked(x0), *y0, blanked(x1), *y1])
        })
    }

    /// Of sixteen blocks from one on a bit for each that is one of the others.
    #[inline(always)]
    fn behind(&self, block: usize) -> u16 {
        u16::MAX.checked_shl(u32::try_from(self.first.saturating_sub(block)).unwrap_or(u32::MAX)).unwrap_or(0)
    }

    /// Each other block with the match that it begins with.
    #[inline(always)]
    fn rest(&self) -> impl Iterator<Item = (usize, &'m Block<T>)> + use<'m, T> {
        let (first, every) = (self.first, self.every);
        self.rest.iter().step_by(every).enumerate().map(move |(at, block)| ((first + at * every) * LANES, block))
    }
}
