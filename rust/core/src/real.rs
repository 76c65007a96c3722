//! The two number types that sensors deliver.

use crate::lanes::Lanes;
use crate::simd::{Instructions, Sieve};
use std::ops::{Add, Div, Mul, Sub};

/// `f32` or `f64`: what a kernel needs to know of its element type.
pub trait Real:
    Copy
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
    /// 0
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

    /// The nearest value of this type.
    fn of(value: f64) -> Self;
    /// The largest value of this type that is not above `value`.
    fn not_above(value: f64) -> Self;
    /// The smallest value of this type that is not below `value`.
    fn not_below(value: f64) -> Self;
    /// The largest value below it.
    #[must_use]
    fn below(self) -> Self;
    /// The same value as `f64`; always exact.
    fn wide(self) -> f64;
    /// For each lane a bit, whether `low <= x <= high`.
    fn within<I: Instructions>(simd: I, x: &Lanes<Self>, low: &Lanes<Self>, high: &Lanes<Self>) -> u16;
    /// Whether any of 16 points passes the sieve: no is certain.
    fn may_pass<I: Instructions>(simd: I, points: &[Lanes<Self>; 4], sieve: &Sieve<Self>) -> bool;
    /// Whether it is not a number.
    fn is_nan(self) -> bool;
    /// Whether `low <= self <= high`, for `0 <= low <= high`.
    ///
    /// One comparison instead of two: bit patterns of floats from +0 up are ordered as the floats are, and those of
    /// negative numbers and NaN lie above them all. Compilers keep one comparison in lanes better than two and an `&`.
    fn between(self, low: Self, high: Self) -> bool;
}

macro_rules! real {
    ($($float:ident $within:ident $may_pass:ident),*) => {$(
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
            fn of(value: f64) -> Self {
                value as $float
            }

            fn not_above(value: f64) -> Self {
                let nearest = Self::of(value);
                if nearest.wide() > value { nearest.next_down() } else { nearest }
            }

            fn not_below(value: f64) -> Self {
                let nearest = Self::of(value);
                if nearest.wide() < value { nearest.next_up() } else { nearest }
            }

            fn below(self) -> Self {
                self.next_down()
            }

            #[inline(always)]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one body for f32 and f64")]
            fn wide(self) -> f64 {
                self as f64
            }

            #[inline(always)]
            fn within<I: Instructions>(simd: I, x: &Lanes<Self>, low: &Lanes<Self>, high: &Lanes<Self>) -> u16 {
                simd.$within(x, low, high)
            }

            #[inline(always)]
            fn may_pass<I: Instructions>(simd: I, points: &[Lanes<Self>; 4], sieve: &Sieve<Self>) -> bool {
                simd.$may_pass(points, sieve)
            }

            #[inline(always)]
            fn is_nan(self) -> bool {
                $float::is_nan(self)
            }

            #[inline(always)]
            fn between(self, low: Self, high: Self) -> bool {
                let bits = |x: $float| (x + 0.0).to_bits(); // adding 0 turns -0 into +0
                bits(self).wrapping_sub(bits(low)) <= bits(high).wrapping_sub(bits(low))
            }
        }
    )*};
}

real!(f32 within_f32 may_pass_f32, f64 within_f64 may_pass_f64);

#[cfg(test)]
mod tests {
    use super::Real;

    #[test]
    fn between_is_two_comparisons() {
        let values =
            [0.0, -0.0, 1e-45, 0.1, 1.0, f32::MAX, f32::INFINITY, f32::NAN, -f32::NAN, -1.0, f32::NEG_INFINITY];
        for x in values {
            for low in values.into_iter().filter(|low| *low >= 0.0) {
                for high in values.into_iter().filter(|high| *high >= low) {
                    assert_eq!(x.between(low, high), low <= x && x <= high, "{low} <= {x} <= {high}");
                }
            }
        }
    }
}
