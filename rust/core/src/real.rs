//! The two number types that sensors deliver.

use crate::lanes::Lanes;
use crate::simd::{Instructions, Prefilter};
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Sub};
use std::thread::LocalKey;

/// The element type of a kernel, `f32` or `f64`.
pub trait Real:
    Copy
    + Default
    + std::fmt::Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// The number 0.
    const ZERO: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// Not a number.
    const NAN: Self;
    /// The largest finite value.
    const MAX: Self;
    /// Sixteen units in the last place of 1: more than the few roundings of any bound in this crate add up to.
    const SLACK: Self;
    /// The smallest normal value: more than underflow can ever hide.
    const TINY: Self;
    /// Not a number, with all bits set.
    const ALL_BITS: Self;

    /// Returns the nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// Returns the largest number of this type that is not above `value`.
    fn not_above(value: f64) -> Self;
    /// Returns the smallest number of this type that is not below `value`.
    fn not_below(value: f64) -> Self;
    /// Returns the largest number below it.
    #[must_use]
    fn below(self) -> Self;
    /// Returns the smallest number above it.
    #[must_use]
    fn above(self) -> Self;
    /// Returns the number halfway between two others in the order of all numbers, if there is one between them. From
    /// any two numbers, as many halvings as the type has bits lead to any number between them.
    fn between(low: Self, high: Self) -> Option<Self>;
    /// Returns the number as `f64`, which is exact.
    fn to_f64(self) -> f64;
    /// Returns the nearest `f32`; a finite number stays finite.
    fn to_f32(self) -> f32;
    /// Returns a bit for each lane where `low <= x <= high`.
    fn within<I: Instructions>(simd: I, x: &Lanes<Self>, low: &Lanes<Self>, high: &Lanes<Self>) -> u16;
    /// Returns a bit for each lane that is not above `limit`.
    fn at_most<I: Instructions>(simd: I, x: &Lanes<Self>, limit: Self) -> u16;
    /// Whether any of 16 points passes the prefilter: no is certain.
    fn may_pass<I: Instructions>(simd: I, points: &[Lanes<Self>; 4], prefilter: &Prefilter<Self>) -> bool;
    /// Keeps the smaller of each pair in `least`. A NaN in `x` is passed over.
    fn keep_least<I: Instructions>(simd: I, least: &mut Lanes<Self>, x: &Lanes<Self>);
    /// Returns the lanes whose bit is set, in order, and any numbers behind them.
    fn compress<I: Instructions>(simd: I, x: &Lanes<Self>, keep: u16) -> Lanes<Self>;
    /// Whether it is not a number.
    fn is_nan(self) -> bool;
    /// Memory for numbered values that this thread does not use now, so that a short call need not ask for any.
    fn spare() -> &'static LocalKey<Cell<(Vec<Self>, Vec<u32>)>>;
}

macro_rules! real {
    ($($float:ident $int:ident $within:ident $at_most:ident $may_pass:ident $keep_least:ident $compress:ident),* $(,)?) => {$(
        impl Real for $float {
            const ZERO: Self = 0.0;
            const INFINITY: Self = $float::INFINITY;
            const NAN: Self = $float::NAN;
            const MAX: Self = $float::MAX;
            const SLACK: Self = 16.0 * $float::EPSILON;
            const TINY: Self = $float::MIN_POSITIVE;
            const ALL_BITS: Self = $float::from_bits(!0);

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, reason = "rounding to the element type is the purpose")]
            fn from_f64(value: f64) -> Self {
                value as $float
            }

            fn not_above(value: f64) -> Self {
                let nearest = Self::from_f64(value);
                if nearest.to_f64() > value { nearest.next_down() } else { nearest }
            }

            fn not_below(value: f64) -> Self {
                let nearest = Self::from_f64(value);
                if nearest.to_f64() < value { nearest.next_up() } else { nearest }
            }

            fn below(self) -> Self {
                self.next_down()
            }

            fn above(self) -> Self {
                self.next_up()
            }

            #[inline(always)]
            fn between(low: Self, high: Self) -> Option<Self> {
                // Bits of floats are in order once those below zero are turned around; and so turned back.
                let turned = |bits: $int| bits ^ ((bits >> ($int::BITS - 1)) & $int::MAX);
                let (low, high) = (turned(low.to_bits().cast_signed()), turned(high.to_bits().cast_signed()));
                let middle = (low & high) + ((low ^ high) >> 1);
                (middle != low).then(|| $float::from_bits(turned(middle).cast_unsigned()))
            }

            #[inline(always)]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one body for f32 and f64")]
            fn to_f64(self) -> f64 {
                self as f64
            }

            #[inline(always)]
            #[allow(
                clippy::cast_lossless,
                clippy::cast_possible_truncation,
                clippy::unnecessary_cast,
                reason = "one body for f32 and f64"
            )]
            fn to_f32(self) -> f32 {
                let largest = f32::MAX as $float;
                let is_too_large = largest < $float::MAX && self > largest && self < $float::INFINITY;
                (if is_too_large { largest } else { self }) as f32
            }

            #[inline(always)]
            fn within<I: Instructions>(simd: I, x: &Lanes<Self>, low: &Lanes<Self>, high: &Lanes<Self>) -> u16 {
                simd.$within(x, low, high)
            }

            #[inline(always)]
            fn at_most<I: Instructions>(simd: I, x: &Lanes<Self>, limit: Self) -> u16 {
                simd.$at_most(x, limit)
            }

            #[inline(always)]
            fn may_pass<I: Instructions>(simd: I, points: &[Lanes<Self>; 4], prefilter: &Prefilter<Self>) -> bool {
                simd.$may_pass(points, prefilter)
            }

            #[inline(always)]
            fn keep_least<I: Instructions>(simd: I, least: &mut Lanes<Self>, x: &Lanes<Self>) {
                simd.$keep_least(least, x);
            }

            #[inline(always)]
            fn compress<I: Instructions>(simd: I, x: &Lanes<Self>, keep: u16) -> Lanes<Self> {
                simd.$compress(x, keep)
            }

            #[inline(always)]
            fn is_nan(self) -> bool {
                $float::is_nan(self)
            }

            fn spare() -> &'static LocalKey<Cell<(Vec<Self>, Vec<u32>)>> {
                thread_local! {
                    static SPARE: Cell<(Vec<$float>, Vec<u32>)> = const { Cell::new((Vec::new(), Vec::new())) };
                }
                &SPARE
            }
        }
    )*};
}

real! {
    f32 i32 within_f32 at_most_f32 may_pass_f32 keep_least_f32 compress_f32,
    f64 i64 within_f64 at_most_f64 may_pass_f64 keep_least_f64 compress_f64,
}

/// The median of at least one number; the numbers lose their order.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    match *values {
        [only] => return only,
        [one, other] => return f64::midpoint(one, other),
        [a, b, c] => return a.min(b).max(a.max(b).min(c)),
        [a, b, c, d] => return f64::midpoint(a.min(b).max(c.min(d)), a.max(b).min(c.max(d))),
        _ => {}
    }
    let middle = values.len() / 2;
    let odd = values.len() % 2 == 1;
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    if odd { upper } else { f64::midpoint(below.iter().copied().fold(f64::NEG_INFINITY, f64::max), upper) }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn medians() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        for [a, b, c, d] in [[4.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0], [2.0, 4.0, 1.0, 3.0], [3.0, 2.0, 4.0, 1.0]] {
            assert_eq!(median(&mut [a, b, c]), median(&mut [a, b, c, 0.0, 9.0]));
            assert_eq!(median(&mut [a, b, c, d]), 2.5);
        }
    }
}
