//! Whether a gap stands still.
//!
//! A standing car is in front for hours, and of any filter's noise a time-to-collision could be made. So a line with fading
//! memory is asked first: it has fewer freedoms than most filters, and tells earlier whether a gap shrinks at all.

use super::noise::clipped;
use super::posterior::{Measured, Posterior};
use super::recursive::{Model, Recursive};

/// Memory of the line, s.
const MEMORY: f64 = 0.4;
/// It is not level when it rises or falls by this many standard deviations.
const SIGNIFICANT: f64 = 6.0;
/// Distances of so short a time count as one, s: the noise of a front edge that wanders does not average out in less.
const TOGETHER: f64 = 0.1;
/// Frames for which the line remembers how much distances surprised it.
const FRAMES: f64 = 30.0;
/// Surprises widen the doubt about its slope by no more than the root of this: it is no model of a car that brakes.
const MOST_SPREAD: f64 = 4.0;
/// A lone distance pulls at it as if it were at most this many standard deviations away.
const PULL: f64 = 3.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Standing {
    pub(super) line: Recursive,
    /// The surprise of the last distance, standard deviations.
    pub(super) last: f64,
    /// Mean square of surprises: were the gap standing, the line would be the right model, and they tell its noise.
    pub(super) spread: f64,
}

impl Standing {
    pub(super) fn new() -> Self {
        let line = Model { speed_wander: 0.0, acceleration_wander: 0.0, acceleration: 0.0, memory: Some(MEMORY) };
        Standing { line: Recursive::new(line), last: 0.0, spread: 1.0 }
    }

    /// Take a distance; no lone outlier may tilt the line.
    pub(super) fn push(&mut self, new: Measured) {
        if self.line.frames == 0 {
            return self.line.push(new);
        }
        let new = Measured { variance: new.variance * (TOGETHER / (new.stamp - self.line.stamp)).max(1.0), ..new };
        if self.line.frames == 1 {
            return self.line.push(new);
        }
        let expected = self.line.at(new.stamp);
        let deviation = (expected.dd + new.variance).sqrt();
        let surprise = (new.distance - expected.distance) / deviation;
        let alone = surprise.signum() * self.last < PULL;
        let pull = if alone { surprise.clamp(-PULL, PULL) } else { surprise };
        self.last = surprise;
        self.spread += (clipped(surprise).powi(2) - self.spread) / FRAMES;
        self.line.push(Measured { distance: expected.distance + pull * deviation, ..new });
    }

    /// Whether the gap closes, by what a filter believes of it: `quantile` is half an interval in standard deviations,
    /// `widening` the factor for surprises that are alike.
    ///
    /// While the line may be level, the gap stands still, whatever the filter makes of its noise. Once it is not, the
    /// filter decides; against the line, which is late, only if it is certain.
    pub(super) fn closes(&self, posterior: &Posterior, quantile: f64, widening: f64) -> bool {
        let line = self.line.at(self.line.stamp);
        let spread = self.spread.clamp(1.0, MOST_SPREAD);
        let deviations = line.closing_speed / (line.vv * spread * widening).sqrt();
        // A line through few frames proves less.
        let significant = SIGNIFICANT * (1.0 + 4.0 / (f64::from(self.line.frames) - 2.0));
        let certain = posterior.closing_speed > quantile * posterior.vv.sqrt();
        deviations > significant || (deviations < -significant && certain)
    }
}
