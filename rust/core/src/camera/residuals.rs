//! Matches in float32 that tell ratios apart far better than positions in float32 would.
//!
//! Nearly all matches follow one similarity, and its scale s is about the scale that is looked for. So a match is kept
//! as its residual r, where it is now less where the similarity puts it, and its place now, n, from the centre. For a
//! pair, with R and N the differences of its matches,
//!
//! > now^2 - s^2 before^2 = |N|^2 - |N - R|^2 = R . (2 N - R),
//!
//! which is a product with a number that is small and has all its digits, in the place of a small difference of large
//! numbers. Over now^2 it is the pair's excess, 1 - s^2 / quotient, which grows with the quotient: 0 for the scale of the
//! similarity, and infinitely far below for a quotient of 0. To compare it with a limit takes no division.
//!
//! Whatever the similarity is, comparisons are trusted only where rounding cannot matter; with a good one, that is
//! nearly everywhere.

use super::matches::{Block, Matches};
use super::pairs::{Bracket, Rule, TRUSTED};
use super::shifts::Measure;
use super::similarity::{Centred, minus, squared, times};
use crate::lanes::{LANES, Lanes, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level, alone};

/// Matches as residuals of a similarity.
pub(super) struct Residuals {
    /// The x and y of each residual, then x and y now from the centre.
    pub matches: Matches<f32>,
    /// The square of the similarity's scale.
    squared_scale: f64,
    /// The squared distance now from which on a pair counts.
    least: f64,
    /// No number of a residual is larger.
    most: f64,
    /// No coordinate is farther from the centre now.
    farthest: f64,
}

impl Residuals {
    /// The residuals of the similarity that fits the matches best, if it is one.
    pub(super) fn new<T: Real>(matches: &Matches<T>, centred: Option<Centred>, rule: Rule, level: Level) -> Self {
        let fitted = centred.map(|centred| (centred.turn(), centred.before, centred.now));
        // The numbers of float32 would end far from any scale in use.
        let usable = fitted.filter(|(turn, ..)| (1e-6..1e6).contains(&squared(*turn)));
        let (turn, before, now) = usable.unwrap_or_else(|| {
            let (before, now) = matches.get(0);
            ([1.0, 0.0], before, now)
        });
        let (matches, [most, farthest]) = level.run(Relate { matches, turn, before, now });
        let squared_scale = squared(turn);
        Residuals { matches, squared_scale, least: rule.least, most, farthest }
    }

    /// The quotient that belongs to an excess.
    pub(super) fn quotient(&self, excess: f64) -> f64 {
        if excess < 1.0 { self.squared_scale / (1.0 - excess) } else { f64::INFINITY }
    }

    /// What rounding can do to `now^2 - s^2 before^2` of a pair: residuals and places are off by half a unit in the last
    /// place of the largest, and every operation adds as much. What was apart before by more than this is trusted.
    fn slack(&self) -> f64 {
        let both = self.most + self.farthest;
        let float32 = 32.0 * EPSILON * self.most * (self.most + 2.0 * self.farthest);
        float32 + 256.0 * f64::EPSILON * both * both + 2.0 * TRUSTED * (1.0 + self.squared_scale)
    }

    /// What rounding can do to a squared distance now, beside its own last digits.
    fn slack_now(&self) -> f64 {
        2.0 * EPSILON * self.farthest * self.farthest
    }

    /// About what rounding can do to the excess of an ordinary pair.
    pub(super) fn slack_of_excess(&self) -> f64 {
        self.slack() / self.least.max(self.farthest * self.farthest / 4.0)
    }

    /// The limits of a bracket of excesses, moved by more than rounding can do.
    pub(super) fn limits(&self, bracket: Bracket) -> Limits {
        let Residuals { least, farthest, .. } = *self;
        let by = 4.0 * EPSILON * (least + farthest * least.sqrt() + EPSILON * farthest * farthest);
        let line = |excess: f64, side: f64| {
            let slope = excess + side * (8.0 * EPSILON * excess.abs() + EXACT * (1.0 + excess.abs()));
            let offset = side * 1.01 * (self.slack() + 2.0 * excess.abs() * self.slack_now());
            if side < 0.0 {
                Line { slope: f32::not_above(slope), offset: f32::not_above(offset) }
            } else {
                Line { slope: f32::not_below(slope), offset: f32::not_below(offset) }
            }
        };
        Limits {
            possible: f32::not_above((least - by).max(0.0)),
            certain: f32::not_below(least + by),
            low: line(bracket.low.min(APART), -1.0),
            high: line(bracket.high, 1.0),
            apart: line(APART, -1.0),
        }
    }
}

/// The distance of 1 from the next number.
const EPSILON: f64 = f32::EPSILON as f64;
/// More than rounding in float64 can do to a quotient.
const EXACT: f64 = 1e-13;
/// A pair with a larger excess was so much nearer before that it may have been on one spot.
const APART: f64 = 1.0 - 1.0 / 1024.0;

/// A limit for `now^2 - s^2 before^2` that depends on now^2.
#[derive(Clone, Copy)]
struct Line {
    slope: f32,
    offset: f32,
}

/// The limits of a bracket and a rule.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// A smaller squared distance now does not count for certain.
    pub possible: f32,
    /// A squared distance now of at least this counts for certain.
    certain: f32,
    /// What is below this line is below the bracket, and was apart before.
    low: Line,
    /// What is above this line is above the bracket.
    high: Line,
    /// What is below this line was apart before.
    apart: Line,
}

/// A bit for each of some pairs on either side of a bracket, and for each that may count and is on none for certain.
pub(super) struct Sides {
    pub below: u32,
    pub above: u32,
    pub open: u32,
}

impl Limits {
    /// The sides of the pairs of a match with those of a block.
    #[inline(always)]
    pub(super) fn sides<I: Instructions>(&self, simd: I, from: [f32; 4], block: &Block<f32>) -> Sides {
        let Limits { possible, certain, low, high, apart } = *self;
        let from = from.map(|x| [x; LANES]);
        let [near, difference] = differences::<I>(from.each_ref(), block.each_ref());
        let from_line =
            |line: Line, sign: f32| lanes(|at| I::mul_add(sign * line.slope, near[at], sign * difference[at]));
        let possible = simd.at_most_f32(&near, -possible);
        let certain = simd.at_most_f32(&near, -certain);
        let below = simd.and_at_most_f32(certain, &from_line(low, 1.0), low.offset);
        let above = simd.and_at_most_f32(certain, &from_line(high, -1.0), -high.offset);
        let above = simd.and_at_most_f32(above, &from_line(apart, 1.0), apart.offset);
        let [below, above] = [below, above].map(|bits| alone(u32::from(bits)));
        Sides { below, above, open: u32::from(possible) & !(below | above) }
    }
}

/// The squared distances now of pairs of two groups of matches, negated, and `now^2 - s^2 before^2`.
#[inline(always)]
fn differences<I: Instructions>(a: [&Lanes<f32>; 4], b: [&Lanes<f32>; 4]) -> [Lanes<f32>; 2] {
    let [mut near, mut difference] = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        let [rx, ry, x, y] = [0, 1, 2, 3].map(|column: usize| b[column][lane] - a[column][lane]);
        near[lane] = I::mul_add(-x, x, -(y * y));
        difference[lane] = I::mul_add(rx, I::mul_add(2.0, x, -rx), ry * I::mul_add(2.0, y, -ry));
    }
    [near, difference]
}

impl Measure<f32> for &Residuals {
    /// The excess of pairs; NaN where a pair does not count.
    #[inline(always)]
    fn of<I: Instructions>(self, simd: I, a: [&Lanes<f32>; 4], b: [&Lanes<f32>; 4]) -> Lanes<f32> {
        let ([near, difference], least) = (differences::<I>(a, b), f32::from_f64(self.least));
        let over = simd.reciprocal_f32(&near);
        lanes(|lane| {
            let counts = (-near[lane] >= least) & (difference[lane] < -near[lane]);
            if counts { -difference[lane] * over[lane] } else { f32::NAN }
        })
    }
}

/// Computes residuals, the largest number among them, and the largest coordinate now.
struct Relate<'m, T> {
    matches: &'m Matches<T>,
    turn: [f64; 2],
    before: [f64; 2],
    now: [f64; 2],
}

impl<T: Real> Kernel for Relate<'_, T> {
    type Output = (Matches<f32>, [f64; 2]);
    const AVX512: bool = false;

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) -> Self::Output {
        let Relate { matches, turn, before, now } = self;
        let mut largest = [[0.0_f32; LANES]; 2];
        let related = matches.map(|[x0, y0, x1, y1]| {
            let mut block = [[0.0; LANES]; 4];
            for lane in 0..LANES {
                let place = minus([x1[lane].to_f64(), y1[lane].to_f64()], now);
                let turned = times(turn, minus([x0[lane].to_f64(), y0[lane].to_f64()], before));
                let residual = minus(place, turned);
                for (column, value) in [residual[0], residual[1], place[0], place[1]].into_iter().enumerate() {
                    block[column][lane] = f32::from_f64(value);
                    let size = block[column][lane].abs();
                    let largest = &mut largest[column / 2][lane];
                    *largest = if size > *largest { size } else { *largest };
                }
            }
            block
        });
        (related, largest.map(|sizes| f64::from(sizes.iter().copied().fold(0.0, f32::max))))
    }
}
