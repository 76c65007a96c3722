//! Time-to-collision from how a target grows in the picture, with distances where there are any.
//!
//! The state is that of a [`KalmanFilter`]: distance, closing speed and closing acceleration. A scale tells the mean
//! closing speed since the update before as a share of the distance now, `(scale - 1) / dt`. A displacement tells it in
//! metres. Both are linear in the state, as a distance is, so that one bank of filters, with the models of
//! [`crate::mixture`], takes all three. As long as no distance was given, its unit is free: after each update the
//! distance is known, and is what the settings say.
//!
//! Scales of one target err alike, because its parts are not equally far away. No number of pictures averages that out:
//! it joins the variance of the answer. Beside distances it must not, so there it joins the variance of each scale, as
//! an error that stays for half a second.

use super::answer::TrackedTtc;
use super::filter::{KalmanFilter, Model, Posterior, State};
use super::track::NORMAL;
use crate::error::{Error, non_negative, positive};
use crate::mixture::{MODELS, SYSTEMATIC};
use crate::status::Status;

/// Time in which evidence falls to 1/e, s.
const MEMORY: f64 = 1.0;
/// Prior probability of each noise, and its standard deviation over the standard error that is given.
const NOISES: [(f64, f64); 3] = [(0.3, 0.5), (0.4, 1.0), (0.3, 2.0)];
/// How far the speed of the line drifts within one second, m/s.
const SPEED_NOISE: f64 = 0.03;
/// Standard deviation of the closing speed before anything is measured, m/s.
const FASTEST: f64 = 50.0;
/// An outlier pulls as if it were at most this many standard deviations away.
const PULL: f64 = 3.0;
/// A distance this many standard deviations away is that of another target.
const OTHER: f64 = 6.0;
/// No scale is more certain than this.
const LEAST_SPREAD: f64 = 1e-6;
/// The error that all scales of a target share is at least this part of `scale - 1`.
const SHARED: f64 = 0.05;
/// It is at least this part of their standard error, too.
const SHARED_OF_SPREAD: f64 = 0.5;
/// The time for which that error stays the same, s.
const SHARED_FOR: f64 = 0.5;
/// The distances that tell a motion where nothing else does, and those in a row that are too far away for the target
/// before they make another one.
const DISTANCES: u32 = 3;

/// The settings of a [`ScaleTracker`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleSettings {
    /// About how far away targets are, m. Only the accelerations that are expected depend on it.
    pub distance: f64,
    /// A target without a measurement for longer than this is forgotten, s.
    pub max_gap: f64,
    /// A closing speed at or below this does not count as closing, m/s.
    pub min_closing_speed: f64,
}

impl Default for ScaleSettings {
    fn default() -> Self {
        ScaleSettings { distance: 10.0, max_gap: 1.0, min_closing_speed: 0.05 }
    }
}

/// A number and its standard error. NaN says that there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// What was measured.
    pub value: f64,
    /// Its standard error.
    pub noise: f64,
}

impl Reading {
    /// Nothing measured.
    pub const NONE: Reading = Reading { value: f64::NAN, noise: f64::NAN };

    fn is_some(self) -> bool {
        !self.value.is_nan()
    }
}

/// What was measured of a target since the update before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings {
    /// Its size in the picture now over that at the update before.
    pub scale: Reading,
    /// How much nearer it came, m.
    pub displacement: Reading,
    /// Its distance now, m.
    pub distance: Reading,
}

impl Readings {
    fn checked(mut self) -> Result<Self, Error> {
        if self.scale.is_some() {
            positive("scale", self.scale.value)?;
            if self.scale.noise.is_nan() {
                self.scale = Reading::NONE;
            }
        }
        for (argument, number) in [("distance", self.distance.value), ("displacement", self.displacement.value)] {
            if number.is_infinite() {
                return Err(Error::new(
                    argument,
                    format!("must be finite, or NaN where there is none, got {number:?}"),
                ));
            }
        }
        for (argument, error, reading) in [
            ("spread", self.scale.noise, self.scale),
            ("distance_noise", self.distance.noise, self.distance),
            ("displacement_noise", self.displacement.noise, self.displacement),
        ] {
            if reading.is_some() && argument == "spread" {
                non_negative(argument, error)?;
            } else if reading.is_some() {
                positive(argument, error)?;
            }
        }
        Ok(self)
    }
}

/// One filter of the bank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Member {
    pub(super) filter: KalmanFilter,
    /// Variance of a measurement over that which is given.
    noise: f64,
    /// Variance of the acceleration at first, m^2/s^4.
    acceleration: f64,
    /// The logarithm of the prior probability.
    prior: f64,
    /// The logarithm of the evidence, times any number that all members share.
    pub(super) evidence: f64,
    /// The distance at the update before.
    before: f64,
}

/// A measurement of `h` times the state, and its variance by the given standard error and beside it.
#[derive(Clone, Copy)]
struct Linear {
    h: [f64; 3],
    value: f64,
    variance: f64,
    shared: f64,
}

impl Member {
    fn new(number: usize, distance: f64, stamp: f64) -> Self {
        let (model, (share, noise)) = (MODELS[number / NOISES.len()], NOISES[number % NOISES.len()]);
        let white = if model.jerk == 0.0 { SPEED_NOISE } else { 0.0 };
        let mut filter = KalmanFilter::new(Model {
            acceleration_process_noise: white * white,
            jerk_process_noise: model.jerk,
            acceleration: model.acceleration,
            memory: None,
        });
        filter.stamp = stamp;
        let prior = (model.share * share).ln();
        let acceleration = model.acceleration * model.acceleration;
        let mut member =
            Member { filter, noise: noise * noise, acceleration, prior, evidence: prior, before: distance };
        member.begin(distance, 0.0);
        member
    }

    /// Begins with a distance, and no idea of a motion.
    fn begin(&mut self, distance: f64, noise: f64) {
        let covariance = [noise * noise, 0.0, 0.0, FASTEST * FASTEST, 0.0, self.acceleration];
        self.filter.state = State { mean: [distance, 0.0, 0.0], covariance };
    }

    fn predict(&mut self, stamp: f64, kept: f64) {
        self.before = self.filter.state.mean[0];
        (self.filter.state, self.filter.stamp) = (self.filter.predict(stamp), stamp);
        self.evidence = self.prior + kept * (self.evidence - self.prior);
    }

    /// Corrects the state, and learns how well it was predicted.
    fn correct(&mut self, Linear { h, value, variance, shared }: Linear) {
        let State { mean, covariance: [dd, dv, da, vv, va, aa] } = self.filter.state;
        let dot = |row: [f64; 3]| row[0] * h[0] + row[1] * h[1] + row[2] * h[2];
        let reach = [dot([dd, dv, da]), dot([dv, vv, va]), dot([da, va, aa])];
        let innovation = value - dot(mean);
        let total = (dot(reach) + variance * self.noise + shared).max((innovation / PULL).powi(2));
        let less = |i: usize, j: usize| reach[i] * reach[j] / total;
        self.filter.state = State {
            mean: std::array::from_fn(|i| mean[i] + reach[i] / total * innovation),
            covariance: [
                dd - less(0, 0),
                dv - less(0, 1),
                da - less(0, 2),
                vv - less(1, 1),
                va - less(1, 2),
                aa - less(2, 2),
            ],
        };
        // The logarithm of the likelihood, in standard errors of the measurement.
        self.evidence -= 0.5 * (innovation * innovation / total + (total / (variance + shared)).ln());
    }

    /// Takes a scale: the mean closing speed of `dt` seconds is `(scale - 1) / dt` of the distance now.
    fn correct_by_scale(&mut self, Reading { value: scale, noise }: Reading, dt: f64, is_metric: bool) {
        let (rate, size) = ((scale - 1.0) / dt, self.before / scale);
        let variance = (noise.max(LEAST_SPREAD) * size / dt).powi(2);
        let shared = (SHARED * rate.abs()).max(SHARED_OF_SPREAD * noise / dt) * size;
        let shared = if is_metric { shared * shared * SHARED_FOR / dt } else { 0.0 };
        self.correct(Linear { h: [-rate, 1.0, -dt / 2.0], value: 0.0, variance, shared });
    }

    /// Lets the distance now be `distance`, with a standard error. What was learnt is a share of it.
    fn scaled(&mut self, distance: f64, noise: f64) {
        let State { mean: [d, v, a], covariance: [dd, dv, da, vv, va, aa] } = self.filter.state;
        if d <= 0.0 || distance <= 0.0 {
            return self.begin(distance, noise);
        }
        let (v, a, unit) = (v / d, a / d, distance / d);
        let squared = noise * noise;
        let shared = if noise > 0.0 { (SHARED * v * distance).powi(2) } else { 0.0 };
        self.filter.state = State {
            mean: [distance, v * distance, a * distance],
            covariance: [
                squared,
                v * squared,
                a * squared,
                unit * unit * (vv - 2.0 * v * dv + v * v * dd) + v * v * squared + shared,
                unit * unit * (va - a * dv - v * da + v * a * dd) + v * a * squared,
                unit * unit * (aa - 2.0 * a * da + a * a * dd) + a * a * squared,
            ],
        };
    }
}

/// What a [`ScaleTracker`] knows of one target.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Target {
    pub(super) members: [Member; MODELS.len() * NOISES.len()],
    /// Whether a distance was given, so that the unit is a metre.
    pub(super) is_metric: bool,
    /// The updates that measured a speed.
    pub(super) speeds: u32,
    /// The updates that measured a distance.
    pub(super) distances: u32,
    /// The newest distances in a row that were too far away for the target.
    pub(super) too_far: u32,
    /// The mean standard error of the newest scales over the time that each is of, 1/s.
    pub(super) spread: f64,
    /// The stamp of the newest measurement, or that of the beginning, s.
    pub(super) measured: f64,
}

impl Target {
    pub(super) fn new(distance: f64, stamp: f64) -> Self {
        let members = std::array::from_fn(|number| Member::new(number, distance, stamp));
        Target { members, is_metric: false, speeds: 0, distances: 0, too_far: 0, spread: 0.0, measured: stamp }
    }

    /// How far a distance is beyond where the target is expected, in standard deviations.
    fn beyond(&self, Reading { value, noise }: Reading) -> f64 {
        let posterior = self.posterior();
        (value - posterior.distance) / (posterior.dd + noise * noise).sqrt()
    }

    pub(super) fn is_finite(&self) -> bool {
        let finite = |member: &Member| {
            let State { mean, covariance } = member.filter.state;
            member.evidence.is_finite() && mean.iter().chain(&covariance).all(|value| value.is_finite())
        };
        self.members.iter().all(finite)
    }

    fn posterior(&self) -> Posterior {
        let weights = self.members.map(|member| member.evidence.exp());
        let sum: f64 = weights.iter().sum();
        let parts = weights.iter().zip(&self.members).map(|(weight, member)| (weight / sum, &member.filter.state));
        let mut mean = Posterior::of_mixture(parts);
        let common = (SHARED * mean.closing_speed.abs()).max(SHARED_OF_SPREAD * self.spread * mean.distance);
        mean.vv += if self.is_metric { (SYSTEMATIC * mean.closing_speed).powi(2) } else { common * common };
        mean
    }
}

/// Follows how one target grows in the picture, and its distance where there is one.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleTracker {
    pub(super) settings: ScaleSettings,
    /// The first stamp. Times are counted from it.
    pub(super) origin: Option<f64>,
    /// The newest stamp, s since the origin.
    pub(super) newest: f64,
    pub(super) target: Target,
    pub(super) answer: TrackedTtc,
}

impl ScaleTracker {
    /// A tracker that has seen nothing.
    ///
    /// # Errors
    /// When a setting is out of its domain.
    pub fn new(settings: ScaleSettings) -> Result<Self, Error> {
        let ScaleSettings { distance, max_gap, min_closing_speed } = settings;
        positive("distance", distance)?;
        positive("max_gap", max_gap)?;
        non_negative("min_closing_speed", min_closing_speed)?;
        let (target, answer) = (Target::new(distance, 0.0), TrackedTtc::nothing(Status::NoData, f64::NAN));
        Ok(ScaleTracker { settings, origin: None, newest: 0.0, target, answer })
    }

    /// The settings of the tracker.
    #[must_use]
    pub fn settings(&self) -> &ScaleSettings {
        &self.settings
    }

    /// The answer after one more picture, taken at `stamp` (s). Scale and displacement are since the update before.
    ///
    /// # Errors
    /// When a scale is not above 0, a number is infinite, or a standard error is missing, negative or not finite.
    pub fn update(&mut self, readings: Readings, stamp: f64) -> Result<TrackedTtc, Error> {
        let mut readings = readings.checked()?;
        let seconds = stamp - self.origin.unwrap_or(stamp);
        if !seconds.is_finite() || (self.origin.is_some() && seconds <= self.newest) {
            return Ok(self.answer.with(Status::Invalid));
        }
        if self.origin.is_none() {
            (readings.scale, readings.displacement) = (Reading::NONE, Reading::NONE);
        }
        self.origin.get_or_insert(stamp);
        let dt = seconds - self.newest;
        self.newest = seconds;
        if seconds - self.target.measured > self.settings.max_gap {
            self.target = Target::new(self.settings.distance, seconds);
            (readings.scale, readings.displacement) = (Reading::NONE, Reading::NONE);
        }
        self.take(readings, dt);
        self.answer = if self.target.is_finite() {
            self.answer_now()
        } else {
            self.target = Target::new(self.settings.distance, seconds); // beyond what numbers can hold
            TrackedTtc::nothing(Status::Invalid, f64::NAN)
        };
        Ok(self.answer)
    }

    fn take(&mut self, mut readings: Readings, dt: f64) {
        let kept = (-dt / MEMORY).exp();
        self.target.members.iter_mut().for_each(|member| member.predict(self.newest, kept));
        if self.target.is_metric && readings.distance.is_some() {
            let beyond = self.target.beyond(readings.distance);
            self.target.too_far = if beyond > OTHER { self.target.too_far.saturating_add(1) } else { 0 };
            if beyond < -OTHER || self.target.too_far >= DISTANCES {
                self.target = Target::new(self.settings.distance, self.newest);
                (readings.scale, readings.displacement) = (Reading::NONE, Reading::NONE);
            } else if beyond > OTHER {
                readings.distance = Reading::NONE;
            }
        }
        let Readings { scale, displacement, distance } = readings;
        let target = &mut self.target;
        let was_metric = target.is_metric;
        target.is_metric |= distance.is_some();
        let is_metric = target.is_metric;
        let moved = displacement.is_some() && is_metric;
        if !(scale.is_some() || moved || distance.is_some()) {
            return;
        }
        for member in &mut target.members {
            if distance.is_some() && was_metric {
                let Reading { value, noise } = distance;
                member.correct(Linear { h: [1.0, 0.0, 0.0], value, variance: noise * noise, shared: 0.0 });
            } else if distance.is_some() {
                member.scaled(distance.value, distance.noise);
            }
            if scale.is_some() && member.before > 0.0 {
                member.correct_by_scale(scale, dt, is_metric);
            }
            if moved {
                let variance = (displacement.noise / dt).powi(2);
                let value = displacement.value / dt;
                member.correct(Linear { h: [0.0, 1.0, -dt / 2.0], value, variance, shared: 0.0 });
            }
            if !is_metric {
                member.scaled(self.settings.distance, 0.0);
            }
        }
        let best = target.members.iter().map(|member| member.evidence).fold(f64::NEG_INFINITY, f64::max);
        target.members.iter_mut().for_each(|member| member.evidence -= best);
        if scale.is_some() {
            let old = if target.speeds == 0 { 0.0 } else { kept };
            target.spread = old * target.spread + (1.0 - old) * scale.noise / dt;
        }
        target.measured = self.newest;
        target.speeds = target.speeds.saturating_add(u32::from(scale.is_some() || moved));
        target.distances = target.distances.saturating_add(u32::from(distance.is_some()));
    }

    fn answer_now(&self) -> TrackedTtc {
        let Target { is_metric, speeds, distances, measured, .. } = self.target;
        if speeds == 0 && distances == 0 {
            return TrackedTtc::nothing(Status::NoData, f64::NAN);
        }
        let posterior = self.target.posterior();
        let mut answer = if speeds == 0 && distances < DISTANCES {
            TrackedTtc::only_where(Status::WarmingUp, posterior.distance)
        } else {
            TrackedTtc::new(posterior, NORMAL, posterior.closing_speed > self.settings.min_closing_speed)
        };
        if !is_metric {
            answer = TrackedTtc { distance: f64::NAN, closing_speed: f64::NAN, closing_speed_interval: None, ..answer };
        }
        let status = if measured == self.newest { answer.status } else { Status::Lost };
        TrackedTtc { status, age: self.newest - measured, ..answer }
    }
}
