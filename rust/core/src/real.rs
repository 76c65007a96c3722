//! The two number types that sensors deliver.

use std::ops::{Add, Div, Mul, Sub};

/// `f32` or `f64`: what a kernel needs to know of its element type.
pub trait Real:
    Copy
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

    /// The nearest value of this type.
    fn of(value: f64) -> Self;
    /// The same value as `f64`; always exact.
    fn wide(self) -> f64;
    /// Whether it is not a number.
    fn is_nan(self) -> bool;
}

macro_rules! real {
    ($($float:ident),*) => {$(
        impl Real for $float {
            const ZERO: Self = 0.0;
            const INFINITY: Self = $float::INFINITY;
            const NAN: Self = $float::NAN;
            const MAX: Self = $float::MAX;
            const SLACK: Self = 16.0 * $float::EPSILON;
            const TINY: Self = $float::MIN_POSITIVE;

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, reason = "rounding to the element type is the purpose")]
            fn of(value: f64) -> Self {
                value as $float
            }

            #[inline(always)]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one body for f32 and f64")]
            fn wide(self) -> f64 {
                self as f64
            }

            #[inline(always)]
            fn is_nan(self) -> bool {
                $float::is_nan(self)
            }
        }
    )*};
}

real!(f32, f64);
