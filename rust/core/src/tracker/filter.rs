//! The filters that remember one state instead of frames: Kalman's filter, and the alpha-beta filter with fading
//! memory.
//!
//! The state is distance, closing speed and closing acceleration, with the covariance of their errors. Each distance
//! takes two steps: `predict` moves the state on to the stamp of the distance, and `update` corrects it by the
//! innovation, which is the measured less the predicted distance. The methods differ in the process noise that enters
//! between frames and in the gains; everything else is one recursion.
//!
//! An alpha-beta filter keeps its acceleration at 0, and the covariance carries what that may cost: the acceleration is
//! a consider state, as Schmidt's.

/// One distance, and how much it is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measurement {
    /// Time since the first stamp of the tracker, s.
    pub stamp: f64,
    /// Measured distance, m.
    pub distance: f64,
    /// Variance of the distance, m^2.
    pub variance: f64,
    /// Whether the variance came with the distance, rather than from the noise level that all distances share.
    pub has_own_variance: bool,
}

/// Mean and covariance of distance and closing speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Posterior {
    /// Mean distance, m.
    pub distance: f64,
    /// Mean closing speed, m/s.
    pub closing_speed: f64,
    /// Variance of the distance, m^2.
    pub dd: f64,
    /// Covariance of distance and closing speed, m^2/s.
    pub dv: f64,
    /// Variance of the closing speed, m^2/s^2.
    pub vv: f64,
    /// The part of `dd` that allows for motion which the model does not follow, rather than for noise, m^2.
    pub model_bias: f64,
}

impl Posterior {
    /// The average of states, each with its share; the shares add up to 1.
    #[inline]
    pub(super) fn of_mixture<'s>(parts: impl Iterator<Item = (f64, &'s State)> + Clone) -> Self {
        // From the first state on, so that no digits are lost where the target is far.
        let [first, speed, _] = parts.clone().next().map_or([0.0; 3], |(_, state)| state.mean);
        let mut moved = [0.0; 2];
        for (share, State { mean: [d, v, _], .. }) in parts.clone() {
            moved[0] += share * (d - first);
            moved[1] += share * (v - speed);
        }
        let [distance, closing_speed] = [first + moved[0], speed + moved[1]];
        let mut mean = Posterior { distance, closing_speed, dd: 0.0, dv: 0.0, vv: 0.0, model_bias: 0.0 };
        for (share, State { mean: [d, v, _], covariance: [dd, dv, _, vv, _, _] }) in parts {
            let (d, v) = (d - distance, v - closing_speed);
            mean.dd += share * (dd + d * d);
            mean.dv += share * (dv + d * v);
            mean.vv += share * (vv + v * v);
        }
        mean
    }

    /// Multiplies every variance by `factor`.
    pub(super) fn widened(self, factor: f64) -> Self {
        let Posterior { dd, dv, vv, model_bias, .. } = self;
        Posterior { dd: dd * factor, dv: dv * factor, vv: vv * factor, model_bias: model_bias * factor, ..self }
    }
}

/// What enters the state between frames, and how the gains are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Model {
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_process_noise: f64,
    /// Spectral density of white jerk, m^2/s^5.
    pub jerk_process_noise: f64,
    /// Standard deviation of the acceleration at first, m/s^2.
    pub acceleration: f64,
    /// Memory of an alpha-beta filter, s. `None` asks for Kalman's gains.
    pub memory: Option<f64>,
}

/// The mean of a state and the covariance of its errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct State {
    /// Distance, closing speed and closing acceleration.
    pub mean: [f64; 3],
    /// The upper triangle by rows: dd, dv, da, vv, va, aa.
    pub covariance: [f64; 6],
}

/// A recursive filter over the distances of one target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KalmanFilter {
    model: Model,
    pub(super) frames: u32,
    pub(super) stamp: f64,
    pub(super) state: State,
}

impl KalmanFilter {
    pub(super) fn new(model: Model) -> Self {
        KalmanFilter { model, frames: 0, stamp: 0.0, state: State::default() }
    }

    /// The state moved on to `stamp`.
    #[inline]
    pub(super) fn predict(&self, stamp: f64) -> State {
        let t = stamp - self.stamp;
        if t == 0.0 {
            return self.state;
        }
        let half = 0.5 * t * t;
        let cube = t * t * t;
        let State { mean: [distance, speed, acceleration], covariance: [dd, dv, da, vv, va, aa] } = self.state;
        let Model { acceleration_process_noise: white, jerk_process_noise: jerk, .. } = self.model;
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

    /// Takes a distance into the state.
    pub(super) fn update(&mut self, new: Measurement) {
        let predicted = if self.frames < 2 { self.state } else { self.predict(new.stamp) };
        self.update_from(&predicted, &new);
    }

    /// Takes a distance into the state that was predicted for its stamp. The first two distances need none.
    #[inline]
    pub(super) fn update_from(&mut self, predicted: &State, new: &Measurement) {
        self.frames = self.frames.saturating_add(1);
        self.state = match self.frames {
            1 => State { mean: [new.distance, 0.0, 0.0], covariance: [new.variance, 0.0, 0.0, 0.0, 0.0, 0.0] },
            2 => self.started_by(new),
            _ => self.corrected(predicted, new),
        };
        self.stamp = new.stamp;
    }

    /// The line through the first two distances. A filter that knows nothing of the speed beforehand has this by then.
    fn started_by(&self, new: &Measurement) -> State {
        let (dt, first, acceleration) = (new.stamp - self.stamp, self.state, self.model.acceleration.powi(2));
        let both = (new.variance + first.covariance[0]) / (dt * dt);
        let process_noise = self.model.acceleration_process_noise * dt / 3.0 + acceleration * dt * dt / 4.0;
        State {
            mean: [new.distance, (first.mean[0] - new.distance) / dt, 0.0],
            covariance: [
                new.variance,
                -new.variance / dt,
                0.0,
                both + process_noise,
                acceleration * dt / 2.0,
                acceleration,
            ],
        }
    }

    /// The predicted state, corrected by the innovation.
    fn corrected(&self, predicted: &State, new: &Measurement) -> State {
        let State { mean: [d, v, a], covariance: [dd, dv, da, vv, va, aa] } = *predicted;
        let innovation = new.distance - d;
        let total = dd + new.variance;
        let [kd, kv, ka] = match self.model.memory {
            None => [dd / total, dv / total, da / total],
            Some(memory) => self.fading_gains(memory, new.stamp - self.stamp),
        };
        // Joseph's form, multiplied out: it is right for any gains, not only for Kalman's.
        State {
            mean: [d + kd * innovation, v + kv * innovation, a + ka * innovation],
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

    /// The gains of a least-squares line whose weights fade. Until the filter has seen enough frames to forget any, the
    /// gains are those of a line whose weights do not fade.
    fn fading_gains(&self, memory: f64, dt: f64) -> [f64; 3] {
        let (n, kept) = (f64::from(self.frames), (-dt / memory).exp());
        let growing = n * (n + 1.0);
        let alpha = (1.0 - kept * kept).max(2.0 * (2.0 * n - 1.0) / growing);
        let beta = ((1.0 - kept) * (1.0 - kept)).max(6.0 / growing);
        [alpha, -beta / dt, 0.0]
    }

    /// What the filter says of `stamp`.
    pub(super) fn posterior(&self, stamp: f64) -> Posterior {
        let State { mean: [distance, closing_speed, _], covariance: [dd, dv, da, vv, _, aa] } = self.predict(stamp);
        // With gains that do not depend on it, an acceleration that is only allowed for adds a square to the
        // covariance.
        let model_bias = if self.model.memory.is_some() && aa > 0.0 { da * da / aa } else { 0.0 };
        Posterior { distance, closing_speed, dd, dv, vv, model_bias }
    }
}
