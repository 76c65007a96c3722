//! Formulae of motion along a line, for numbers and for arrays of them.
//!
//! Each formula is one plain function of `f64`. [`each`] applies it to arrays of either type, element by element: it
//! computes in `f64` and rounds once. Times-to-collision come first: at constant closing speed, at constant closing
//! acceleration, and from two distances. Then comes what beside them says how much room there is: headway, braking,
//! stopping and the RSS distance. There NaN in gives NaN out, for no number that is unknown may pass for a safe one.

mod each;

pub use each::{Operand, each, each_status};

use crate::error::{Error, elapsed, finite};
use crate::status::Status;

/// Returns the seconds until `distance` is used up at `closing_speed`; infinite when it does not shrink or a number is
/// NaN.
///
/// At or inside contact it is 0 while closing.
#[inline(always)]
#[must_use]
pub fn ttc_constant_velocity(distance: f64, closing_speed: f64) -> f64 {
    ttc_constant_acceleration(distance, closing_speed, 0.0)
}

/// Returns the first positive root of `distance = v t + a t^2 / 2`; infinite without one, or when a number is NaN.
///
/// At or inside contact it is 0 while closing. Of the two forms of a root of a quadratic, the one without cancellation
/// is taken: `2 d / (v + sqrt(v^2 + 2 a d))` while closing, which becomes `d / v` as `a` becomes 0.
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

/// Returns what the time of [`ttc_constant_acceleration`] means.
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

/// Returns the time-to-collision by two distances `dt` seconds apart, if the gap goes on shrinking as it did.
///
/// It is `current dt / (previous - current)`, and infinite when the gap does not shrink. At or inside contact it is 0
/// while closing.
///
/// # Errors
/// When a distance is not finite, or `dt` is not a time.
pub fn ttc_from_distances(previous: f64, current: f64, dt: f64) -> Result<f64, Error> {
    finite("previous", previous)?;
    finite("current", current)?;
    elapsed(dt)?;
    let shrunk = previous - current;
    Ok(if shrunk <= 0.0 {
        f64::INFINITY
    } else if current <= 0.0 {
        0.0
    } else {
        let product = current * dt;
        if product < f64::INFINITY { product / shrunk } else { current / shrunk * dt }
    })
}

/// Returns the seconds until a follower at `speed` is where the rear of the one ahead is now; infinite when it does not
/// drive towards it, 0 in contact while it does.
#[inline(always)]
#[must_use]
pub fn time_headway(distance: f64, speed: f64) -> f64 {
    let time = if distance <= 0.0 { 0.0 } else { distance / speed };
    let time = if speed > 0.0 { time } else { f64::INFINITY };
    if distance.is_nan() | speed.is_nan() { f64::NAN } else { time }
}

/// Returns the constant deceleration that just avoids contact, `dv^2 / (2 d)`; 0 when not closing, infinite in contact
/// while closing.
#[inline(always)]
#[must_use]
pub fn deceleration_to_avoid_crash(distance: f64, closing_speed: f64) -> f64 {
    let needed = if distance <= 0.0 { f64::INFINITY } else { closing_speed * (closing_speed / (2.0 * distance)) };
    let needed = if closing_speed > 0.0 { needed } else { 0.0 };
    if distance.is_nan() | closing_speed.is_nan() { f64::NAN } else { needed }
}

/// Returns how far a vehicle goes until it stands: `v t + v^2 / (2 a)`, with the speed's magnitude.
///
/// It is NaN also for a deceleration that is not above 0 and a reaction time below 0.
#[inline(always)]
#[must_use]
pub fn stopping_distance(speed: f64, deceleration: f64, reaction_time: f64) -> f64 {
    let v = speed.abs();
    let distance = v * reaction_time + v * (v / (2.0 * deceleration));
    if (deceleration > 0.0) & (reaction_time >= 0.0) { distance } else { f64::NAN }
}

/// How the two cars of an RSS distance behave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rss {
    /// How long the rear car takes to respond, s.
    pub response_time: f64,
    /// What the rear car may do while it has not responded yet, m/s^2.
    pub acceleration_max: f64,
    /// The least that the rear car brakes with after that, m/s^2.
    pub braking_min: f64,
    /// The most that the front car may brake with, m/s^2.
    pub braking_max: f64,
}

/// Returns the RSS safe longitudinal distance of two cars that drive in one direction.
///
/// The paper has speeds of at least 0. Here speeds keep their sign, `v |v|` in the place of `v^2`, so that noise about
/// a standing car's 0 makes no jump.
///
/// It is NaN also for a behaviour out of its domain.
#[inline(always)]
#[must_use]
pub fn rss_longitudinal_distance(rear_speed: f64, front_speed: f64, rss: Rss) -> f64 {
    let Rss { response_time: t, acceleration_max: a, braking_min, braking_max } = rss;
    let after = rear_speed + t * a;
    let rear = rear_speed * t + 0.5 * a * t * t + after * (after.abs() / (2.0 * braking_min));
    let front = front_speed * (front_speed.abs() / (2.0 * braking_max));
    let distance = rear - front;
    let distance = if distance < 0.0 { 0.0 } else { distance };
    let sensible = (t >= 0.0) & (a >= 0.0) & (braking_min > 0.0) & (braking_max > 0.0);
    if sensible { distance } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::{
        Rss, deceleration_to_avoid_crash, rss_longitudinal_distance, status, stopping_distance, time_headway,
        ttc_constant_acceleration, ttc_constant_velocity, ttc_from_distances,
    };
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

    #[test]
    fn shrinking_standing_growing_touching() {
        assert!((ttc_from_distances(10.0, 9.5, 0.1).unwrap() - 1.9).abs() < 1e-12);
        assert_eq!(ttc_from_distances(9.5, 9.5, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_distances(9.5, 10.0, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_distances(0.1, -0.1, 0.1).unwrap(), 0.0);
        assert_eq!(ttc_from_distances(-0.2, -0.1, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_distances(1.5e308, 1e308, 10.0).unwrap(), 20.0);
        assert!(ttc_from_distances(1.0, 0.5, 0.0).is_err());
        assert!(ttc_from_distances(f64::INFINITY, 0.5, 0.1).is_err());
    }

    #[test]
    fn known_values() {
        assert_eq!(time_headway(20.0, 10.0), 2.0);
        assert_eq!([time_headway(20.0, 0.0), time_headway(20.0, -1.0), time_headway(-1.0, 3.0)], [INF, INF, 0.0]);
        assert_eq!(deceleration_to_avoid_crash(10.0, 10.0), 5.0);
        assert_eq!([deceleration_to_avoid_crash(10.0, -1.0), deceleration_to_avoid_crash(0.0, 1.0)], [0.0, INF]);
        assert_eq!(stopping_distance(10.0, 5.0, 1.0), 20.0);
        assert_eq!(stopping_distance(-10.0, 5.0, 1.0), 20.0);
        let rss = Rss { response_time: 1.0, acceleration_max: 2.0, braking_min: 4.0, braking_max: 8.0 };
        assert_eq!(rss_longitudinal_distance(20.0, 20.0, rss), 20.0 + 1.0 + 22.0 * 22.0 / 8.0 - 25.0);
        assert_eq!(rss_longitudinal_distance(5.0, 40.0, rss), 0.0);
    }

    #[test]
    fn what_is_unknown_stays_unknown() {
        let rss = Rss { response_time: 1.0, acceleration_max: 2.0, braking_min: 4.0, braking_max: 8.0 };
        assert!(time_headway(f64::NAN, 1.0).is_nan() && time_headway(1.0, f64::NAN).is_nan());
        assert!(deceleration_to_avoid_crash(f64::NAN, -1.0).is_nan());
        assert!(stopping_distance(f64::NAN, 5.0, 1.0).is_nan() && stopping_distance(1.0, 0.0, 1.0).is_nan());
        assert!(rss_longitudinal_distance(f64::NAN, 1.0, rss).is_nan());
        assert!(rss_longitudinal_distance(1.0, 1.0, Rss { braking_min: -1.0, ..rss }).is_nan());
    }
}
