//! Time-to-collision of the body ahead, from cloud to cloud.
//!
//! Each cloud shows a body: its edge, which is the robust nearest distance, and its profile behind the edge. The
//! tracker gives this sighting to the body that it continues, or begins another, and the alignment of the profiles
//! tells how the body moves.
//!
//! A cloud that is handed over again under a new stamp shows nothing new: the body is predicted. A scene that stands,
//! seen without noise, gives the same cloud for ever; from `PATIENCE` of `max_gap` on a repeated cloud is measured.

use super::buffer::Candidate;
use super::estimator::{Detection, Estimator, nearest_of};
use super::gate::{CheckedGate, check_intensity};
use super::pass::Candidates;
use crate::alignment::{Alignment, Cell, FARTHEST, Profile, Sighting, Trend, trend};
use crate::error::{Error, finite, non_negative};
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use crate::tracker::{TrackedTtc, bounded};
use std::mem::take;

/// The settings of a tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudSettings {
    /// The points that count.
    pub gate: CheckedGate,
    /// The way in which the edge of the body is found.
    pub estimator: Estimator,
    /// The way in which the motion of the body is found.
    pub method: Alignment,
    /// Distance from the sensor to the bumper, m.
    pub front_offset: f64,
    /// An edge farther than this from where it was predicted belongs to another body, m.
    pub jump: f64,
    /// A body that is not seen for longer than this is forgotten, s.
    pub max_gap: f64,
    /// A closing speed at or below this does not count as closing, m/s.
    pub min_closing_speed: f64,
}

impl Default for CloudSettings {
    fn default() -> Self {
        CloudSettings {
            gate: CheckedGate::default(),
            estimator: Estimator::KthSmallest(10),
            method: Alignment::default(),
            front_offset: 0.0,
            jump: 0.5,
            max_gap: 0.5,
            min_closing_speed: 0.05,
        }
    }
}

/// A body and its sightings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Body {
    /// The sightings, oldest first.
    pub sightings: Vec<Sighting>,
    /// The motion at the last of them.
    pub trend: Option<Trend>,
}

/// Everything that is remembered of the bodies in a gate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudTrack {
    /// Stamp of the last frame, whatever it showed, s.
    pub stamp: Option<f64>,
    /// The body that is followed.
    pub present: Body,
    /// The body that was followed before, in case the present one is but a flicker.
    pub shelved: Body,
}

impl CloudTrack {
    /// Returns the track if a tracker could have it.
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
        if !self.sightings.iter().all(is_finite) {
            return wrong("must hold finite numbers");
        }
        let later = |pair: &[Sighting]| pair[0].stamp < pair[1].stamp;
        let last = self.sightings.last().map(|sighting| sighting.stamp);
        if self.sightings.len() > MOST || !self.sightings.windows(2).all(later) || last > newest {
            return wrong(&format!("must hold at most {MOST} sightings of a body, oldest first, none after its stamp"));
        }
        if self.trend.is_some_and(|trend| self.sightings.is_empty() || !is_possible(&trend)) {
            return wrong("must hold the sightings of a trend, which is finite, with a variance of at least 0");
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

    /// Forgets sightings that are too old, and all of them if the body was gone for too long.
    fn forget(&mut self, stamp: f64, window: f64, max_gap: f64) {
        let gone = self.sightings.last().is_some_and(|last| stamp - last.stamp > max_gap);
        // Stamps are rounded, so a sighting at the end of the window counts.
        self.sightings.retain(|sighting| !gone && stamp - sighting.stamp <= window * (1.0 + 1e-6));
        if self.sightings.is_empty() {
            self.trend = None;
        }
    }

    /// Whether a sighting belongs to this body.
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

    /// Stamp of the oldest sighting since which the body has looked the same to the bit.
    fn unchanged_since(&self) -> Option<f64> {
        let mut newer_first = self.sightings.iter().rev();
        let last = newer_first.next()?;
        Some(newer_first.take_while(|sighting| looks_like(sighting, last)).last().unwrap_or(last).stamp)
    }

    /// Whether a sighting is the last one handed over again. After `patience` (s) it is one of a body that stands.
    fn is_repeated_by(&self, now: &Sighting, patience: f64) -> bool {
        self.sightings.last().is_some_and(|last| looks_like(now, last))
            && self.unchanged_since().is_some_and(|since| now.stamp - since < patience)
    }

    fn add(&mut self, sighting: Sighting, range_noise: f64, level: Level) {
        self.sightings.push(sighting);
        let excess = self.sightings.len().saturating_sub(MOST);
        self.sightings.drain(..excess);
        let enough = self.sightings.len() >= ENOUGH;
        self.trend = enough.then(|| trend(&self.sightings, range_noise, level)).flatten().filter(is_possible);
    }
}

/// Whether all numbers of a sighting are finite: sums of coordinates near the largest number overflow.
fn is_finite(sighting: &Sighting) -> bool {
    let cells = sighting.profile.cells.iter().flat_map(|cell| [cell.count, cell.x, cell.z]);
    cells.chain([sighting.stamp, sighting.edge]).all(f64::is_finite)
}

/// Whether a trend can be: squares of coordinates beyond 1e154 overflow.
fn is_possible(trend: &Trend) -> bool {
    trend.distance.is_finite() && trend.closing_speed.is_finite() && trend.variance.is_finite() && trend.variance >= 0.0
}

/// Whether two frames show the same, to the bit.
fn looks_like(one: &Sighting, other: &Sighting) -> bool {
    one.edge == other.edge && one.profile == other.profile
}

/// Follows the nearest body in a gate, and never two at once.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTracker {
    settings: CloudSettings,
    /// Everything that the tracker remembers, to be saved and restored.
    pub track: CloudTrack,
}

/// The fewest frames that a closing speed needs.
const ENOUGH: usize = 3;
/// The most frames that are kept: of those in the window, the last.
const MOST: usize = 16;
/// The fastest closing speed of two cars, m/s.
const FASTEST: f64 = 60.0;
/// The fastest change of a closing speed, m/s^2.
const HARDEST: f64 = 20.0;
/// Nine tenths of a normal distribution are within this many standard deviations.
const NINE_TENTHS: f64 = 1.645;
/// A cloud that is repeated for longer than this part of `max_gap` shows a scene that stands. Lidars turn faster than
/// that.
const PATIENCE: f64 = 0.8;
/// Standard deviation of the acceleration of a body that is predicted, m/s^2.
const ACCELERATION: f64 = 1.6;

impl BodyTracker {
    /// A tracker that has seen nothing.
    ///
    /// # Errors
    /// When a setting makes no sense.
    #[allow(clippy::large_types_passed_by_value, reason = "the tracker keeps them")]
    pub fn new(settings: CloudSettings) -> Result<Self, Error> {
        settings.estimator.checked()?;
        settings.method.checked()?;
        finite("front_offset", settings.front_offset)?;
        for (name, value) in [("jump", settings.jump), ("max_gap", settings.max_gap)] {
            if value.is_nan() || value <= 0.0 {
                return Err(Error::new(name, format!("must be above 0, got {value:?}")));
            }
        }
        non_negative("min_closing_speed", settings.min_closing_speed)?;
        Ok(BodyTracker { settings, track: CloudTrack::default() })
    }

    /// The settings of the tracker.
    #[must_use]
    pub fn settings(&self) -> &CloudSettings {
        &self.settings
    }

    /// Takes a cloud, and says how the body ahead moves.
    ///
    /// # Errors
    /// When the gate bounds an intensity that the points lack.
    pub fn update<T: Real>(&mut self, points: &Points<'_, T>, stamp: f64, level: Level) -> Result<TrackedTtc, Error> {
        let CloudSettings { gate, estimator, method, .. } = self.settings;
        check_intensity(&gate, points)?;
        let mut candidates = Candidates::none(None);
        candidates.gather(points, &gate, level, 1);
        let found = nearest_of(&mut candidates, points, &gate, estimator, level);
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
        let end = edge + method.depth;
        let body = candidates.kept.iter().filter(|candidate| candidate.x.to_f64() <= end);
        let body = body.map(|Candidate { x, index }| {
            let [_, y, z] = gate.oriented(points.get(index as usize)).map(Real::to_f64);
            [x.to_f64(), y, z]
        });
        let profile = Profile::new(body, &method);
        let sighting = Sighting { stamp, edge, profile };
        if !is_finite(&sighting) {
            return Ok(TrackedTtc::only_where(Status::WarmingUp, edge - self.settings.front_offset));
        }
        if !self.track.present.is_repeated_by(&sighting, PATIENCE * self.settings.max_gap) {
            self.follow(sighting, level);
        }
        Ok(self.answer(found.detection == Detection::TooFew))
    }

    /// Gives a sighting to the body that it belongs to, or begins another.
    fn follow(&mut self, sighting: Sighting, level: Level) {
        let CloudTrack { present, shelved, .. } = &mut self.track;
        if !present.continues(&sighting, self.settings.jump) {
            if shelved.continues(&sighting, self.settings.jump) {
                *present = take(shelved);
            } else {
                let before = take(present);
                // A body whose motion was never found is not worth coming back to.
                if before.trend.is_some() {
                    *shelved = before;
                }
            }
        }
        present.add(sighting, self.settings.method.range_noise, level);
    }

    /// The answer about the body at the newest stamp: that of its last sighting, or later where a cloud was repeated.
    fn answer(&self, too_few: bool) -> TrackedTtc {
        let (offset, body) = (self.settings.front_offset, &self.track.present);
        let last = body.sightings.last();
        let Some(trend) = &body.trend else {
            let edge = last.map_or(f64::NAN, |last| last.edge);
            return TrackedTtc { age: self.age(), ..TrackedTtc::only_where(Status::WarmingUp, edge - offset) };
        };
        let later = last.zip(self.track.stamp).map_or(0.0, |(last, stamp)| stamp - last.stamp);
        let speed = trend.closing_speed;
        let distance = trend.distance - speed * later - offset;
        let spread = NINE_TENTHS * (trend.variance + (ACCELERATION * later).powi(2)).sqrt();
        let closes = speed > self.settings.min_closing_speed;
        let status = if distance <= 0.0 {
            Status::Contact
        } else if too_few {
            Status::TooFew
        } else if closes {
            Status::Closing
        } else {
            Status::NotClosing
        };
        // The error of the distance counts by its share in the time.
        let apart = NINE_TENTHS * self.settings.method.range_noise / distance.max(self.settings.method.range_noise);
        let either_way = spread.hypot(speed * apart);
        TrackedTtc {
            ttc: self.time_to(distance, speed),
            ttc_interval: Some([speed + either_way, speed - either_way].map(|speed| bounded(time(distance, speed)))),
            distance,
            closing_speed: speed,
            closing_speed_interval: Some([speed - spread, speed + spread]),
            status,
            age: self.age(),
        }
    }

    /// Time-to-collision, s; infinite where the gap does not close.
    fn time_to(&self, distance: f64, speed: f64) -> f64 {
        if speed > self.settings.min_closing_speed { time(distance, speed) } else { f64::INFINITY }
    }

    /// The time since the newest cloud that was not the one before again, s; infinite without a body.
    fn age(&self) -> f64 {
        let since = self.track.present.unchanged_since();
        self.track.stamp.zip(since).map_or(f64::INFINITY, |(stamp, since)| stamp - since)
    }

    /// The answer when nothing is ahead: the body that was there a moment ago goes on as it did.
    fn coast(&self, stamp: f64) -> TrackedTtc {
        let Some(last) = self.track.present.sightings.last() else {
            return TrackedTtc::nothing(Status::Clear, f64::INFINITY);
        };
        let Some(trend) = &self.track.present.trend else { return TrackedTtc::nothing(Status::Lost, f64::NAN) };
        let distance = trend.distance - trend.closing_speed * (stamp - last.stamp) - self.settings.front_offset;
        TrackedTtc {
            ttc: self.time_to(distance, trend.closing_speed),
            closing_speed: trend.closing_speed,
            age: self.age(),
            ..TrackedTtc::nothing(Status::Lost, distance)
        }
    }
}

/// Time to cover `distance` at a constant speed, s; 0 in contact, infinite where nothing closes.
fn time(distance: f64, closing_speed: f64) -> f64 {
    if closing_speed <= 0.0 { f64::INFINITY } else { distance.max(0.0) / closing_speed }
}
