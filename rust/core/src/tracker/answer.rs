//! The answer of a tracker: from a posterior of distance and closing speed to a time-to-collision with its interval.

use super::filter::Posterior;
use crate::status::Status;

/// Time-to-collision over several frames, with its 90 % intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedTtc {
    /// Time-to-collision, s, in [0, inf]; infinite where nothing closes or too little is known.
    pub ttc: f64,
    /// Lower and upper end, s; the upper end is infinite where the gap may not be closing. `None` while warming up.
    pub ttc_interval: Option<[f64; 2]>,
    /// Distance to contact, m. NaN without a target, infinite when clear.
    pub distance: f64,
    /// Closing speed, m/s, positive when approaching. NaN while warming up and without a target.
    pub closing_speed: f64,
    /// Lower and upper end, m/s. `None` while warming up.
    pub closing_speed_interval: Option<[f64; 2]>,
    /// What the numbers mean.
    pub status: Status,
    /// Time since the newest measurement that was not the one before handed over again, s; infinite before the first.
    pub age: f64,
}

impl TrackedTtc {
    /// An answer without a motion: nothing is known but the status and perhaps a distance.
    pub(crate) fn nothing(status: Status, distance: f64) -> Self {
        TrackedTtc {
            ttc: f64::INFINITY,
            ttc_interval: None,
            distance,
            closing_speed: f64::NAN,
            closing_speed_interval: None,
            status,
            age: f64::INFINITY,
        }
    }

    /// An answer that knows no more than the distance. Contact outranks the status, as the more urgent news.
    pub(crate) fn only_where(status: Status, distance: f64) -> Self {
        TrackedTtc::nothing(if distance <= 0.0 { Status::Contact } else { status }, distance)
    }

    /// The answer that a posterior gives. `quantile` is half an interval in standard deviations, and `closes` says
    /// whether the gap closes.
    pub(super) fn new(posterior: Posterior, quantile: f64, closes: bool) -> Self {
        let Posterior { distance, closing_speed, vv, .. } = posterior;
        let half = quantile * vv.sqrt();
        if !(half.is_finite() && distance.is_finite() && closing_speed.is_finite()) {
            return TrackedTtc::nothing(Status::Invalid, f64::NAN); // beyond what numbers can hold
        }
        let (ttc, status) = if distance <= 0.0 {
            (if closing_speed > 0.0 { 0.0 } else { f64::INFINITY }, Status::Contact)
        } else if closes {
            (distance / closing_speed, Status::Closing)
        } else {
            (f64::INFINITY, Status::NotClosing)
        };
        let [low, high] = ratio_interval(posterior, quantile).map(bounded);
        TrackedTtc {
            ttc,
            ttc_interval: Some([low.min(ttc), high.max(ttc)]),
            distance,
            closing_speed,
            closing_speed_interval: Some([closing_speed - half, closing_speed + half]),
            status,
            age: 0.0,
        }
    }

    pub(super) fn with(self, status: Status) -> Self {
        TrackedTtc { status, ..self }
    }
}

/// The time, or infinity beyond some days: so slow a motion is none.
pub(crate) fn bounded(time: f64) -> f64 {
    if time > 1e6 { f64::INFINITY } else { time }
}

/// The interval of all times `T >= 0` for which `distance - T closing_speed` is within `quantile` standard deviations
/// of 0 (Fieller 1954).
///
/// The condition is `g T^2 - 2 b T + c <= 0`. Where the closing speed may be 0, g is below 0 and the times have no
/// upper end.
fn ratio_interval(posterior: Posterior, quantile: f64) -> [f64; 2] {
    let Posterior { distance, closing_speed, dd, dv, vv, .. } = posterior;
    let squared = quantile * quantile;
    let g = closing_speed * closing_speed - squared * vv;
    let b = distance * closing_speed - squared * dv;
    let c = if distance > 0.0 { distance * distance - squared * dd } else { 0.0 };
    let root = (b * b - g * c).max(0.0).sqrt();
    let low = if c <= 0.0 {
        0.0
    } else if b > 0.0 {
        c / (b + root)
    } else if g < 0.0 {
        (b - root) / g
    } else {
        f64::INFINITY // certainly opening
    };
    let high = if g > 0.0 && b + root > 0.0 { (b + root) / g } else { f64::INFINITY };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::{TrackedTtc, ratio_interval};
    use crate::status::Status;
    use crate::tracker::filter::Posterior;

    fn posterior(distance: f64, closing_speed: f64, vv: f64) -> Posterior {
        Posterior { distance, closing_speed, dd: 0.01, dv: 0.0, vv, model_bias: 0.0 }
    }

    #[test]
    fn certain_speeds_bound_both_ends() {
        let [low, high] = ratio_interval(posterior(10.0, 5.0, 0.04), 1.645);
        assert!(low > 1.8 && low < 2.0 && high > 2.0 && high < 2.2, "{low} {high}");
        // Each end is where 0 is just `quantile` standard deviations away.
        for time in [low, high] {
            let deviations = (10.0 - 5.0 * time) / (0.01 + time * time * 0.04_f64).sqrt();
            assert!((deviations.abs() - 1.645).abs() < 1e-9);
        }
    }

    #[test]
    fn speeds_about_zero_have_no_upper_end() {
        let [low, high] = ratio_interval(posterior(10.0, 0.1, 0.04), 1.645);
        assert!(low > 20.0 && low < 25.0 && high == f64::INFINITY);
        let [low, high] = ratio_interval(posterior(10.0, -0.1, 0.04), 1.645);
        assert!(low > 40.0 && high == f64::INFINITY);
        assert_eq!(ratio_interval(posterior(10.0, -5.0, 0.04), 1.645), [f64::INFINITY; 2]);
        assert_eq!(ratio_interval(posterior(0.1, 1.0, 0.04), 1.645)[0], 0.0);
    }

    #[test]
    fn contact() {
        let touching = TrackedTtc::new(posterior(-0.2, 1.0, 0.01), 1.645, true);
        assert_eq!((touching.ttc, touching.status), (0.0, Status::Contact));
        assert_eq!(touching.ttc_interval.unwrap()[0], 0.0);
        assert_eq!(TrackedTtc::new(posterior(-0.2, -1.0, 0.01), 1.645, false).ttc, f64::INFINITY);
    }
}
