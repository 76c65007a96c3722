//! Filters that remember one state instead of frames: Kalman's, and the alpha-beta filter with fading memory.
//!
//! The state is distance, closing speed and closing acceleration, and the covariance of their errors. The methods differ
//! in what drives the state between frames and in the gains; the rest is one recursion. An alpha-beta filter keeps its
//! acceleration at 0, and the covariance carries what that may cost (a consider state, as Schmidt's).

use super::posterior::{Measured, Posterior};

/// What drives the state, and how much of a surprise it takes over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Model {
    /// Spectral density of white acceleration, m^2/s^3.
    pub speed_wander: f64,
    /// Spectral density of white jerk, m^2/s^5.
    pub acceleration_wander: f64,
    /// Std of the acceleration at first, m/s^2.
    pub acceleration: f64,
    /// Memory of an alpha-beta filter, s; Kalman's gains without.
    pub memory: Option<f64>,
}

/// A state: its mean and the covariance of its errors, upper triangle by rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct State {
    /// Distance, closing speed, closing acceleration.
    pub mean: [f64; 3],
    /// dd, dv, da, vv, va, aa.
    pub covariance: [f64; 6],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Recursive {
    model: Model,
    pub(super) frames: u32,
    pub(super) stamp: f64,
    pub(super) state: State,
}

impl Recursive {
    pub(super) fn new(model: Model) -> Self {
        Recursive { model, frames: 0, stamp: 0.0, state: State::default() }
    }

    pub(super) fn push(&mut self, new: Measured) {
        self.frames = self.frames.saturating_add(1);
        self.state = match self.frames {
            1 => State { mean: [new.distance, 0.0, 0.0], covariance: [new.variance, 0.0, 0.0, 0.0, 0.0, 0.0] },
            2 => self.by_two(new),
            _ => self.corrected(new),
        };
        self.stamp = new.stamp;
    }

    /// The line through the first two distances: what a filter with no idea of the speed beforehand has by then.
    fn by_two(&self, new: Measured) -> State {
        let (dt, first, acceleration) = (new.stamp - self.stamp, self.state, self.model.acceleration.powi(2));
        let both = (new.variance + first.covariance[0]) / (dt * dt);
        let wander = self.model.speed_wander * dt / 3.0 + acceleration * dt * dt / 4.0;
        State {
            mean: [new.distance, (first.mean[0] - new.distance) / dt, 0.0],
            covariance: [new.variance, -new.variance / dt, 0.0, both + wander, acceleration * dt / 2.0, acceleration],
        }
    }

    fn corrected(&self, new: Measured) -> State {
        let State { mean: [d, v, a], covariance: [dd, dv, da, vv, va, aa] } = self.moved(new.stamp);
        let surprise = new.distance - d;
        let total = dd + new.variance;
        let [kd, kv, ka] = match self.model.memory {
            None => [dd / total, dv / total, da / total],
            Some(memory) => self.fading(memory, new.stamp - self.stamp),
        };
        // Right for any gains, not only for Kalman's (Joseph's form, multiplied out).
        State {
            mean: [d + kd * surprise, v + kv * surprise, a + ka * surprise],
            covariance: [
                dd - 2.0 * kd * dd + kd * kd * total,
                dv - kd * dv - kv * dd + kd * kv * total,
                da - kd * da - ka * dd + kd * ka * total,
                vv - 2.0 * kv * dv + kv * kv * total,
                va - kv * da - ka * dv + kv * ka * total,
                aa - 2.0 * ka * da + ka * ka * total,
            ],
        }
    }

    /// The gains of a least-squares line whose weights fade, and before it has that much to remember, of one whose
    /// weights do not.
    fn fading(&self, memory: f64, dt: f64) -> [f64; 3] {
        let (n, kept) = (f64::from(self.frames), (-dt / memory).exp());
        let growing = n * (n + 1.0);
        let alpha = (1.0 - kept * kept).max(2.0 * (2.0 * n - 1.0) / growing);
        let beta = ((1.0 - kept) * (1.0 - kept)).max(6.0 / growing);
        [alpha, -beta / dt, 0.0]
    }

    /// The state moved on to `stamp`.
    fn moved(&self, stamp: f64) -> State {
        let t = stamp - self.stamp;
        let half = 0.5 * t * t;
        let cube = t * t * t;
        let State { mean: [distance, speed, acceleration], covariance: [dd, dv, da, vv, va, aa] } = self.state;
        let Model { speed_wander: white, acceleration_wander: jerk, .. } = self.model;
        let to_speed = da - t * va - half * aa;
        State {
            mean: [distance - speed * t - acceleration * half, speed + acceleration * t, acceleration],
            covariance: [
                dd - 2.0 * (t * dv + half * da)
                    + t * t * vv
                    + 2.0 * t * half * va
                    + half * half * aa
                    + white * cube / 3.0
                    + jerk * cube * t * t / 20.0,
                dv - t * vv - half * va + t * to_speed - white * half - jerk * cube * t / 8.0,
                to_speed - jerk * cube / 6.0,
                vv + 2.0 * t * va + t * t * aa + white * t + jerk * cube / 3.0,
                va + t * aa + jerk * half,
                aa + jerk * t,
            ],
        }
    }

    pub(super) fn at(&self, stamp: f64) -> Posterior {
        let State { mean: [distance, closing_speed, _], covariance: [dd, dv, da, vv, _, aa] } = self.moved(stamp);
        // With gains that do not depend on it, an acceleration that is only allowed for adds a square to the covariance.
        let lag = if self.model.memory.is_some() && aa > 0.0 { da * da / aa } else { 0.0 };
        Posterior { distance, closing_speed, dd, dv, vv, lag }
    }
}
