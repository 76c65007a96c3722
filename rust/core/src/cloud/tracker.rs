//! Time-to-collision of the body ahead, from cloud to cloud.

use super::alignment::{Alignment, Cell, FARTHEST, Profile, Sighting, Trend, trend};
use super::estimator::Estimator;
use super::gate::Gate;
use super::{Detection, robust_min_x};
use crate::error::{Error, finite};
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use crate::tracker::TrackedTtc;
use std::mem::take;

/// What a tracker is told once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudSettings {
    /// Which points count.
    pub gate: Gate,
    /// How the edge of the body is found.
    pub estimator: Estimator,
    /// How its motion is.
    pub method: Alignment,
    /// From the sensor to the bumper, m.
    pub front_offset: f64,
    /// An edge this far from where it was expected is another body's, m.
    pub jump: f64,
    /// A body not seen for longer than this is forgotten, s.
    pub max_gap: f64,
}

impl Default for CloudSettings {
    fn default() -> Self {
        CloudSettings {
            gate: Gate::default(),
            estimator: Estimator::KthSmallest(10),
            method: Alignment::default(),
            front_offset: 0.0,
            jump: 0.5,
            max_gap: 0.5,
        }
    }
}

/// A body, as often as it was seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Body {
    /// Oldest first.
    pub sightings: Vec<Sighting>,
    /// How it moved at the last of them.
    pub trend: Option<Trend>,
}

/// What a tracker remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudTrack {
    /// Of the last frame, whatever it showed, s.
    pub stamp: Option<f64>,
    /// The body that is followed.
    pub present: Body,
    /// The one before, in case the present one was but a flicker.
    pub shelved: Body,
}

impl CloudTrack {
    /// The track, if a tracker could have it.
    ///
    /// # Errors
    /// When numbers are not finite, sightings or cells are out of order, or there are too many.
    pub fn checked(self) -> Result<Self, Error> {
        if self.stamp.is_some_and(|stamp| !stamp.is_finite()) {
            return Err(Error::new("state", "must hold a finite stamp"));
        }
        self.present.check(self.stamp)?;
        self.shelved.check(self.stamp)?;
        Ok(self)
    }
}

impl Body {
    fn check(&self, newest: Option<f64>) -> Result<(), Error> {
        let wrong = |problem: &str| Err(Error::new("state", problem));
        let cells = || self.sightings.iter().flat_map(|sighting| &sighting.profile.cells);
        let numbers = cells().flat_map(|cell| [cell.count, cell.x, cell.z]);
        let sighted = self.sightings.iter().flat_map(|sighting| [sighting.stamp, sighting.edge]);
        let trend = self.trend.iter().flat_map(|trend| [trend.distance, trend.closing_speed, trend.variance]);
        if !numbers.chain(sighted).chain(trend).all(f64::is_finite) {
            return wrong("must hold finite numbers");
        }
        let later = |pair: &[Sighting]| pair[0].stamp < pair[1].stamp;
        let last = self.sightings.last().map(|sighting| sighting.stamp);
        if self.sightings.len() > MOST || !self.sightings.windows(2).all(later) || last > newest {
            return wrong(&format!("must hold at most {MOST} sightings of a body, oldest first, none after its stamp"));
        }
        if self.trend.is_some_and(|trend| self.sightings.is_empty() || trend.variance < 0.0) {
            return wrong("must hold the sightings of a trend, and a variance of at least 0");
        }
        let ordered = |sighting: &Sighting| {
            let place = |cell: &Cell| (cell.column, cell.level);
            sighting.profile.cells.windows(2).all(|pair| place(&pair[0]) < place(&pair[1]))
        };
        let numbered = -FARTHEST..=FARTHEST;
        let possible =
            |cell: &Cell| cell.count > 0.0 && numbered.contains(&cell.column) && numbered.contains(&cell.level);
        if !self.sightings.iter().all(ordered) || !cells().all(possible) {
            return wrong("must hold cells in order, with points in them");
        }
        Ok(())
    }

    /// Forget what is too old, and all of it if it was gone for too long.
    fn forget(&mut self, stamp: f64, window: f64, max_gap: f64) {
        let gone = self.sightings.last().is_some_and(|last| stamp - last.stamp > max_gap);
        // Stamps are rounded: the window's own end counts.
        self.sightings.retain(|sighting| !gone && stamp - sighting.stamp <= window * (1.0 + 1e-6));
        if self.sightings.is_empty() {
            self.trend = None;
        }
    }

    /// Whether a sighting is of this body.
    fn continues(&self, now: &Sighting, jump: f64) -> bool {
        let Some(last) = self.sightings.last() else { return false };
        let dt = now.stamp - last.stamp;
        let (edge, speed) = match (&self.trend, &self.sightings[..]) {
            (Some(trend), _) => (trend.distance, trend.closing_speed),
            (None, [.., before, last]) => (last.edge, (before.edge - last.edge) / (last.stamp - before.stamp)),
            (None, _) => return (now.edge - last.edge).abs() <= jump + FASTEST * dt,
        };
        (now.edge - (edge - speed * dt)).abs() <= jump + HARDEST * dt * dt / 2.0
    }

    fn add(&mut self, sighting: Sighting, range_noise: f64) {
        self.sightings.push(sighting);
        let excess = self.sightings.len().saturating_sub(MOST);
        self.sightings.drain(..excess);
        let enough = self.sightings.len() >= ENOUGH;
        self.trend = enough.then(|| trend(&self.sightings, range_noise)).flatten();
    }
}

/// Follows the nearest body ahead, and never two at once.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudTracker {
    settings: CloudSettings,
    /// What it remembers; to be saved and restored.
    pub track: CloudTrack,
}

/// Frames that a closing speed needs.
const ENOUGH: usize = 3;
/// More frames than this are not kept: of those in the window, the last.
const MOST: usize = 16;
/// No two cars close faster, m/s.
const FASTEST: f64 = 60.0;
/// Closing speeds don't change faster, m/s^2.
const HARDEST: f64 = 20.0;
/// Of a normal distribution, nine tenths are within so many standard deviations.
const NINE_TENTHS: f64 = 1.645;

impl CloudTracker {
    /// A tracker that has seen nothing.
    ///
    /// # Errors
    /// When a setting makes no sense.
    pub fn new(settings: CloudSettings) -> Result<Self, Error> {
        settings.gate.checked()?;
        settings.estimator.checked()?;
        settings.method.checked()?;
        finite("front_offset", settings.front_offset)?;
        for (name, value) in [("jump", settings.jump), ("max_gap", settings.max_gap)] {
            if value.is_nan() || value <= 0.0 {
                return Err(Error::new(name, format!("must be above 0, got {value:?}")));
            }
        }
        Ok(CloudTracker { settings, track: CloudTrack::default() })
    }

    /// What it was told.
    #[must_use]
    pub fn settings(&self) -> &CloudSettings {
        &self.settings
    }

    /// Take in a cloud, and say how the body ahead moves.
    ///
    /// # Errors
    /// As [`robust_min_x`].
    pub fn update<T: Real>(&mut self, points: Points<'_, T>, stamp: f64, level: Level) -> Result<TrackedTtc, Error> {
        let CloudSettings { gate, estimator, method, .. } = self.settings;
        let found = robust_min_x(points, &gate, estimator, level, 1)?;
        if !stamp.is_finite() || self.track.stamp.is_some_and(|last| stamp <= last) {
            return Ok(TrackedTtc { status: Status::Invalid, ..self.answer(false) });
        }
        self.track.stamp = Some(stamp);
        for body in [&mut self.track.present, &mut self.track.shelved] {
            body.forget(stamp, method.window, self.settings.max_gap);
        }
        let edge = match found.detection {
            Detection::NoData => return Ok(TrackedTtc::nothing(Status::NoData, f64::NAN)),
            Detection::Clear => return Ok(self.coast(stamp)),
            Detection::Found => found.x,
            Detection::TooFew => found.nearest_x,
        };
        let profile = Profile::new(points, &gate, edge, &method, level);
        self.follow(Sighting { stamp, edge, profile });
        Ok(self.answer(found.detection == Detection::TooFew))
    }

    /// Give a sighting to the body that it is of, or begin another.
    fn follow(&mut self, sighting: Sighting) {
        let CloudTrack { present, shelved, .. } = &mut self.track;
        if !present.continues(&sighting, self.settings.jump) {
            if shelved.continues(&sighting, self.settings.jump) {
                *present = take(shelved);
            } else {
                let before = take(present);
                // What was never seen to move is not worth coming back to.
                if before.trend.is_some() {
                    *shelved = before;
                }
            }
        }
        present.add(sighting, self.settings.method.range_noise);
    }

    /// What is known of the body at its last sighting.
    fn answer(&self, too_few: bool) -> TrackedTtc {
        let offset = self.settings.front_offset;
        let Some(trend) = &self.track.present.trend else {
            let edge = self.track.present.sightings.last().map_or(f64::NAN, |last| last.edge);
            return TrackedTtc::only_where(Status::WarmingUp, edge - offset);
        };
        let (distance, speed) = (trend.distance - offset, trend.closing_speed);
        let spread = NINE_TENTHS * trend.variance.sqrt();
        let status = if distance <= 0.0 {
            Status::Contact
        } else if too_few {
            Status::TooFew
        } else if speed > 0.0 {
            Status::Closing
        } else {
            Status::NotClosing
        };
        // What is not known of the distance counts for as much as it makes of the time.
        let apart = NINE_TENTHS * self.settings.method.range_noise / distance.max(self.settings.method.range_noise);
        let either_way = spread.hypot(speed * apart);
        TrackedTtc {
            ttc: time(distance, speed),
            ttc_interval: Some([time(distance, speed + either_way), time(distance, speed - either_way)]),
            distance,
            closing_speed: speed,
            closing_speed_interval: Some([speed - spread, speed + spread]),
            status,
        }
    }

    /// Nothing is ahead: the body that was there a moment ago goes on as it did.
    fn coast(&self, stamp: f64) -> TrackedTtc {
        let Some(last) = self.track.present.sightings.last() else {
            return TrackedTtc::nothing(Status::Clear, f64::INFINITY);
        };
        let Some(trend) = &self.track.present.trend else { return TrackedTtc::nothing(Status::Lost, f64::NAN) };
        let distance = trend.distance - trend.closing_speed * (stamp - last.stamp) - self.settings.front_offset;
        let ttc = time(distance, trend.closing_speed);
        TrackedTtc { ttc, closing_speed: trend.closing_speed, ..TrackedTtc::nothing(Status::Lost, distance) }
    }
}

/// At a constant speed; 0 in contact, infinite where nothing closes.
fn time(distance: f64, closing_speed: f64) -> f64 {
    if closing_speed <= 0.0 { f64::INFINITY } else { distance.max(0.0) / closing_speed }
}
