//! One target: its filter, how well the filter follows it, and whether it comes closer at all.

use super::filter::Filter;
use super::noise::{NoiseLevel, Whiteness};
use super::posterior::{Measured, Posterior};
use super::settings::{Method, Settings};
use super::standing::Standing;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Track {
    pub(super) filter: Filter,
    pub(super) standing: Standing,
    pub(super) whiteness: Whiteness,
    pub(super) last: Measured,
    /// Frames in a row that were its own.
    pub(super) run: u32,
}

/// How a distance compares with what a track expects.
pub(super) struct Surprise {
    /// Measured less expected, m.
    pub miss: f64,
    /// In standard deviations of the noise alone, so that a lag is a surprise too; None after a single frame.
    pub deviations: Option<f64>,
    pub fits: bool,
}

impl Track {
    pub(super) fn empty(method: Method) -> Self {
        Track {
            filter: Filter::new(method),
            standing: Standing::new(),
            whiteness: Whiteness::new(),
            last: Measured { stamp: 0.0, distance: 0.0, variance: 1.0, own: false },
            run: 0,
        }
    }

    pub(super) fn new(method: Method, first: Measured) -> Self {
        let mut track = Track::empty(method);
        track.put(first);
        track
    }

    /// Whether it has seen too few frames to say anything.
    pub(super) fn is_young(&self) -> bool {
        self.filter.frames() < self.filter.frames_needed()
    }

    pub(super) fn surprise(&self, new: Measured, settings: &Settings, noise: &NoiseLevel) -> Surprise {
        let Some(expected) = self.filter.at(new.stamp, noise.variance()) else {
            let miss = new.distance - self.last.distance;
            let farthest = settings.max_speed * (new.stamp - self.last.stamp);
            return Surprise { miss, deviations: None, fits: miss.abs() <= farthest };
        };
        let miss = new.distance - expected.distance;
        let deviations = miss / (expected.dd - expected.lag + new.variance).sqrt();
        let wide = (expected.dd * self.whiteness.factor() + new.variance).sqrt();
        Surprise { miss, deviations: Some(deviations), fits: miss.abs() <= settings.gate * wide }
    }

    /// Take a distance that fits.
    pub(super) fn take(&mut self, new: Measured, surprise: &Surprise) {
        if let Some(deviations) = surprise.deviations {
            self.whiteness.learn(deviations);
        }
        self.put(new);
    }

    fn put(&mut self, new: Measured) {
        self.filter.push(new);
        self.standing.push(new);
        self.last = new;
        self.run = self.run.saturating_add(1);
    }

    /// Distance and closing speed at `stamp`, once there are frames enough.
    pub(super) fn at(&self, stamp: f64, noise: &NoiseLevel) -> Option<Posterior> {
        if self.is_young() {
            return None;
        }
        Some(self.filter.at(stamp, noise.variance())?.widened(self.whiteness.factor()))
    }
}
