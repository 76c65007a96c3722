//! A bank of Kalman filters, averaged by their evidence.
//!
//! No single process noise is right: a gap closes steadily for seconds, and then a driver brakes. So several filters see
//! each distance, one for each model of motion and for each guess at the noise. How well a filter predicted the newest
//! distances is its evidence, and older evidence fades (dynamic model averaging, Raftery, Karny and Ettler 2010). The
//! average over the filters, weighed by their evidence, is the posterior; its covariance is that of the mixture.
//!
//! The models are those of [`crate::mixture`]. Only the line differs: it would never forget, so its speed is a slow
//! random walk.

use super::filter::{KalmanFilter, Measurement, Model, Posterior, State};
use crate::mixture::MODELS;

/// Prior probability of each noise, and its standard deviation over the noise that is given or learnt.
const NOISES: [(f64, f64); 3] = [(0.3, 0.3), (0.4, 1.0), (0.3, 2.0)];
/// How far the speed of the line drifts within one second, m/s.
const SPEED_NOISE: f64 = 0.03;

/// One filter of the bank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Member {
    pub(super) filter: KalmanFilter,
    /// Variance of a distance over the variance that is given or learnt.
    noise: f64,
    /// The logarithm of the prior probability.
    prior: f64,
    /// The logarithm of the evidence, times any number that all members share.
    pub(super) evidence: f64,
}

/// The number of filters.
const MEMBERS: usize = MODELS.len() * NOISES.len();

/// Kalman filters side by side, and how much each is believed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FilterBank {
    /// Time in which evidence falls to 1/e, s.
    memory: f64,
    pub(super) members: [Member; MEMBERS],
    /// What was predicted last. A frame asks for it several times.
    predicted: Option<Predicted>,
}

/// The states of all filters at one stamp, and what the mixture says there.
#[derive(Clone, Debug, PartialEq)]
struct Predicted {
    stamp: f64,
    states: [State; MEMBERS],
    posterior: Posterior,
}

impl FilterBank {
    /// A bank for bodies whose accelerations are `scale` times those of cars on a road.
    pub(super) fn new(memory: f64, scale: f64) -> Self {
        let member = |i: usize| {
            let (model, (share, noise)) = (MODELS[i / NOISES.len()], NOISES[i % NOISES.len()]);
            let white = if model.jerk == 0.0 { SPEED_NOISE * scale } else { 0.0 };
            let prior = (model.share * share).ln();
            let filter = KalmanFilter::new(Model {
                acceleration_process_noise: white * white,
                jerk_process_noise: model.jerk * scale * scale,
                acceleration: model.acceleration * scale,
                memory: None,
            });
            Member { filter, noise: noise * noise, prior, evidence: prior }
        };
        FilterBank { memory, members: std::array::from_fn(member), predicted: None }
    }

    /// The frames that the filters have seen.
    pub(super) fn frames(&self) -> u32 {
        self.members[0].filter.frames
    }

    /// Predicts the states at `stamp`, and keeps them until the next update.
    pub(super) fn predict(&mut self, stamp: f64) {
        if self.frames() >= 2 {
            self.predicted = Some(self.predicted_at(stamp));
        }
    }

    fn predicted_at(&self, stamp: f64) -> Predicted {
        let states = std::array::from_fn(|i| self.members[i].filter.predict(stamp));
        Predicted { stamp, states, posterior: self.mixture(&states) }
    }

    /// Takes a distance into each filter, and learns how well it was predicted.
    pub(super) fn update(&mut self, new: Measurement) {
        let first = &self.members[0].filter;
        let predicted = (first.frames >= 2).then(|| match self.predicted.take() {
            Some(predicted) if predicted.stamp == new.stamp => predicted.states,
            _ => std::array::from_fn(|i| self.members[i].filter.predict(new.stamp)),
        });
        self.predicted = None;
        let kept = (-(new.stamp - first.stamp) / self.memory).exp();
        for (i, member) in self.members.iter_mut().enumerate() {
            let measured = Measurement { variance: new.variance * member.noise, ..new };
            let state = predicted.map_or(member.filter.state, |states| states[i]);
            if predicted.is_some() {
                let (innovation, total) = (new.distance - state.mean[0], state.covariance[0] + measured.variance);
                // The logarithm of the likelihood, with lengths in standard deviations of the noise.
                let likelihood = -0.5 * (innovation * innovation / total + (total / new.variance).ln());
                member.evidence = member.prior + kept * (member.evidence - member.prior) + likelihood;
            }
            member.filter.update_from(state, measured);
        }
        let best = self.members.iter().map(|member| member.evidence).fold(f64::NEG_INFINITY, f64::max);
        for member in &mut self.members {
            member.evidence = if best.is_finite() { member.evidence - best } else { member.prior };
        }
        self.predict(new.stamp);
    }

    /// What the mixture says of `stamp`, from two frames on.
    pub(super) fn posterior(&self, stamp: f64) -> Posterior {
        match &self.predicted {
            Some(predicted) if predicted.stamp == stamp => predicted.posterior,
            _ => self.predicted_at(stamp).posterior,
        }
    }

    /// The average of states of all filters, weighed by their evidence.
    fn mixture(&self, states: &[State; MEMBERS]) -> Posterior {
        let weights = self.members.map(|member| member.evidence.exp());
        let sum: f64 = weights.iter().sum();
        // From the first member on, so that no digits are lost where the target is far.
        let ([first, speed, _], mut moved) = (states[0].mean, [0.0; 2]);
        for (weight, State { mean: [d, v, _], .. }) in weights.iter().zip(states) {
            let share = weight / sum;
            moved[0] += share * (d - first);
            moved[1] += share * (v - speed);
        }
        let [distance, closing_speed] = [first + moved[0], speed + moved[1]];
        let mut mean = Posterior { distance, closing_speed, dd: 0.0, dv: 0.0, vv: 0.0, model_bias: 0.0 };
        for (weight, state) in weights.iter().zip(states) {
            let ([d, v, _], [dd, dv, _, vv, _, _]) = (state.mean, state.covariance);
            let (share, d, v) = (weight / sum, d - distance, v - closing_speed);
            mean.dd += share * (dd + d * d);
            mean.dv += share * (dv + d * v);
            mean.vv += share * (vv + v * v);
        }
        mean
    }
}
