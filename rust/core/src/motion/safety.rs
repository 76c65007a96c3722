//! What beside a time-to-collision says how much room there is: headway, braking, stopping, the RSS distance.
//!
//! NaN in, NaN out: no number that is unknown may pass for a safe one.

/// Seconds until a follower at `speed` is where the rear of the one ahead is now; infinite when it does not drive
/// towards it, 0 in contact while it does.
#[inline(always)]
#[must_use]
pub fn time_headway(distance: f64, speed: f64) -> f64 {
    let time = if distance <= 0.0 { 0.0 } else { distance / speed };
    let time = if speed > 0.0 { time } else { f64::INFINITY };
    if distance.is_nan() | speed.is_nan() { f64::NAN } else { time }
}

/// The constant deceleration that just avoids contact, `dv^2 / (2 d)`; 0 when not closing, infinite in contact while
/// closing.
#[inline(always)]
#[must_use]
pub fn deceleration_to_avoid_crash(distance: f64, closing_speed: f64) -> f64 {
    let needed = if distance <= 0.0 { f64::INFINITY } else { closing_speed * (closing_speed / (2.0 * distance)) };
    let needed = if closing_speed > 0.0 { needed } else { 0.0 };
    if distance.is_nan() | closing_speed.is_nan() { f64::NAN } else { needed }
}

/// How far a vehicle goes until it stands: `v t + v^2 / (2 a)`, with the speed's magnitude.
///
/// NaN also for a deceleration that is not above 0 and a reaction time below 0.
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
    /// The rear car's, s.
    pub response_time: f64,
    /// What the rear car may do while it has not responded yet, m/s^2.
    pub acceleration_max: f64,
    /// The least that the rear car brakes with after that, m/s^2.
    pub braking_min: f64,
    /// The most that the front car may brake with, m/s^2.
    pub braking_max: f64,
}

/// The RSS safe longitudinal distance of two cars that drive in one direction.
///
/// The paper has speeds of at least 0. Here speeds keep their sign, `v |v|` in the place of `v^2`, so that noise about a
/// standing car's 0 makes no jump.
///
/// NaN also for a behaviour out of its domain.
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
    use super::{Rss, deceleration_to_avoid_crash, rss_longitudinal_distance, stopping_distance, time_headway};

    const INF: f64 = f64::INFINITY;

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
