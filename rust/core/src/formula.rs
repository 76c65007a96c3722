//! The formula: clearance over closing speed.

use crate::real::Real;

/// Clearance over closing speed: 0 in contact, infinite where the beam does not close or has no reading.
#[inline(always)]
pub(crate) fn ttc<T: Real>(clearance: T, closing: T, min_closing_speed: T) -> T {
    finish_ttc(clearance / closing, clearance, closing, min_closing_speed)
}

/// Makes a time-to-collision of `ttc`, the quotient of clearance and closing speed.
#[inline(always)]
pub(crate) fn finish_ttc<T: Real>(ttc: T, clearance: T, closing: T, min_closing_speed: T) -> T {
    let ttc = if clearance <= T::ZERO { T::ZERO } else { ttc };
    let ttc = if closing > min_closing_speed { ttc } else { T::INFINITY };
    if ttc >= T::ZERO { ttc } else { T::INFINITY }
}
