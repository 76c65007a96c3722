//! Time until a gap is used up at constant closing speed, or at constant closing acceleration.

use crate::status::Status;

/// Seconds until `distance` is used up at `closing_speed`; infinite when it does not shrink or something is NaN.
///
/// At or inside contact: 0 while closing.
#[inline(always)]
#[must_use]
pub fn ttc_constant_velocity(distance: f64, closing_speed: f64) -> f64 {
    ttc_constant_acceleration(distance, closing_speed, 0.0)
}

/// The first positive root of `distance = v t + a t^2 / 2`; infinite without one, or when something is NaN.
///
/// At or inside contact: 0 while closing. Of the two forms of a root of a quadratic, the one without cancellation is
/// taken: `2 d / (v + sqrt(v^2 + 2 a d))` while closing, which becomes `d / v` as `a` becomes 0.
#[inline(always)]
#[must_use]
pub fn ttc_constant_acceleration(distance: f64, closing_speed: f64, closing_acceleration: f64) -> f64 {
    let (d, v, a) = (distance, closing_speed, closing_acceleration);
    let known = v.is_finite() & a.is_finite() & !d.is_nan();
    let closes = (v > 0.0) | ((v == 0.0) & (a > 0.0));
    let root = (v * v + 2.0 * a * d).sqrt(); // NaN where the gap never closes, which no comparison below lets through
    let sum = v + root;
    let closing = if (root == v) | (a == 0.0) { d / v } else { 2.0 * (d / sum) };
    let turning = (root - v) / a; // opens at first, and the acceleration brings it back
    let time = if closes & (sum > 0.0) { closing } else { f64::INFINITY };
    let time = if (v < 0.0) & (a > 0.0) & (root > 0.0) { turning } else { time };
    let time = if d <= 0.0 { if closes { 0.0 } else { f64::INFINITY } } else { time };
    if known & (d < f64::INFINITY) & (time >= 0.0) { time } else { f64::INFINITY }
}

/// What the time of the two formulae above means.
#[inline(always)]
#[must_use]
pub fn status(distance: f64, closing_speed: f64, closing_acceleration: f64) -> Status {
    if distance.is_nan() || !closing_speed.is_finite() || !closing_acceleration.is_finite() {
        Status::Invalid
    } else if distance <= 0.0 {
        Status::Contact
    } else if distance == f64::INFINITY {
        Status::Clear
    } else if ttc_constant_acceleration(distance, closing_speed, closing_acceleration) < f64::INFINITY {
        Status::Closing
    } else {
        Status::NotClosing
    }
}

#[cfg(test)]
mod tests {
    use super::{status, ttc_constant_acceleration, ttc_constant_velocity};
    use crate::status::Status;

    const INF: f64 = f64::INFINITY;

    #[test]
    fn the_first_root() {
        assert!((ttc_constant_acceleration(10.0, 10.0, -2.0) - (5.0 - 15.0_f64.sqrt())).abs() < 1e-12);
        assert_eq!(ttc_constant_acceleration(10.0, 10.0, -6.0), INF);
        assert_eq!(ttc_constant_acceleration(8.0, 0.0, 1.0), 4.0);
        assert_eq!(ttc_constant_acceleration(6.0, -2.0, 2.0), 1.0 + 7.0_f64.sqrt());
        assert_eq!(ttc_constant_acceleration(6.0, 0.0, 0.0), INF);
        assert_eq!(ttc_constant_acceleration(6.0, -2.0, -2.0), INF);
    }

    #[test]
    fn small_accelerations_change_little() {
        for a in [1e-300, 1e-18, 1e-9, 1e-6, -1e-6, -1e-9, -1e-18, -1e-300] {
            let (time, plain) = (ttc_constant_acceleration(10.0, 3.0, a), ttc_constant_velocity(10.0, 3.0));
            assert!((time / plain - 1.0).abs() <= a.abs() * 10.0 / 9.0 + 1e-15, "{a}");
        }
    }

    #[test]
    fn contact_space_and_nonsense() {
        assert_eq!([ttc_constant_velocity(0.0, 1.0), ttc_constant_velocity(-1.0, -1.0)], [0.0, INF]);
        assert_eq!([ttc_constant_velocity(-1.0, 0.0), ttc_constant_velocity(INF, 3.0)], [INF, INF]);
        for [d, v, a] in [[f64::NAN, 1.0, 0.0], [1.0, f64::NAN, 0.0], [1.0, 1.0, f64::NAN], [1.0, INF, 0.0]] {
            assert_eq!(ttc_constant_acceleration(d, v, a), INF);
            assert_eq!(status(d, v, a), Status::Invalid);
        }
        assert_eq!(status(INF, 1.0, 0.0), Status::Clear);
        assert_eq!(status(-INF, 1.0, 0.0), Status::Contact);
        assert_eq!(status(3.0, 1.0, -5.0), Status::NotClosing);
        assert_eq!(status(3.0, 1.0, 5.0), Status::Closing);
    }
}
