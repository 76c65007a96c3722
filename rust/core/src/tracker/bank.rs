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
    predicted: Predicted,
}

/// The states of all filters at one stamp, and what the mixture says there.
#[derive(Clone, Debug, PartialEq)]
struct Predicted {
    /// Minus infinity before anything is predicted.
    stamp: f64,
    states: [State; MEMBERS],
    /// How much each filter is believed; the sum is 1.
    weights: [f64; MEMBERS],
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
        FilterBank { memory, members: std::array::from_fn(member), predicted: Predicted::NOTHING }
    }

    /// The frames that the filters have seen.
    pub(super) fn frames(&self) -> u32 {
        self.members[0].filter.frames
    }

    /// Predicts the states at `stamp`, and keeps them until the next update.
    pub(super) fn predict(&mut self, stamp: f64) {
        if self.frames() >= 2 {
            let fresh = self.predicted.stamp.is_infinite(); // as after the memory was read from outside
            self.predicted.take(&self.members, stamp, fresh);
        }
    }

    /// Takes a distance into each filter, and learns how well it was predicted.
    pub(super) fn update(&mut self, new: Measurement) {
        let first = &self.members[0].filter;
        let predicts = first.frames >= 2;
        let kept = (-(new.stamp - first.stamp) / self.memory).exp();
        let is_predicted = self.predicted.stamp == new.stamp;
        for (member, state) in self.members.iter_mut().zip(&self.predicted.states) {
            let measured = Measurement { variance: new.variance * member.noise, ..new };
            if predicts {
                let state = if is_predicted { *state } else { member.filter.predict(new.stamp) };
                let (innovation, total) = (new.distance - state.mean[0], state.covariance[0] + measured.variance);
                // The logarithm of the likelihood, with lengths in standard deviations of the noise.
                let likelihood = -0.5 * (innovation * innovation / total + (total / new.variance).ln());
                member.evidence = member.prior + kept * (member.evidence - member.prior) + likelihood;
                member.filter.update_from(&state, &measured);
            } else {
                member.filter.update(measured);
            }
        }
        let best = self.members.iter().map(|member| member.evidence).fold(f64::NEG_INFINITY, f64::max);
        for member in &mut self.members {
            member.evidence = if best.is_finite() { member.evidence - best } else { member.prior };
        }
        if self.frames() >= 2 {
            self.predicted.take(&self.members, new.stamp, true);
        }
    }

    /// What the mixture says of `stamp`, from two frames on.
    pub(super) fn posterior(&self, stamp: f64) -> Posterior {
        if self.predicted.stamp == stamp {
            return self.predicted.posterior;
        }
        let mut predicted = Predicted::NOTHING;
        predicted.take(&self.members, stamp, true);
        predicted.posterior
    }
}

impl Predicted {
    const NOTHING: Predicted = Predicted {
        stamp: f64::NEG_INFINITY,
        states: [State { mean: [0.0; 3], covariance: [0.0; 6] }; MEMBERS],
        weights: [0.0; MEMBERS],
        posterior: Posterior { distance: 0.0, closing_speed: 0.0, dd: 0.0, dv: 0.0, vv: 0.0, model_bias: 0.0 },
    };

    /// Predicts the states of all filters at `stamp`. `learnt` says whether their evidence is new.
    fn take(&mut self, members: &[Member; MEMBERS], stamp: f64, learnt: bool) {
        self.stamp = stamp;
        for (state, member) in self.states.iter_mut().zip(members) {
            *state = member.filter.predict(stamp);
        }
        if learnt {
            for (weight, member) in self.weights.iter_mut().zip(members) {
                *weight = member.evidence.exp();
            }
            let sum: f64 = self.weights.iter().sum();
            self.weights.iter_mut().for_each(|weight| *weight /= sum);
        }
        self.posterior = Posterior::of_mixture(self.weights.iter().copied().zip(&self.states));
    }
}
