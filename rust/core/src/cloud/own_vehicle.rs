//! The tracker of clouds, which looks past the vehicle that carries the sensor.
//!
//! Bonnet and bumper are in the clouds of many lidars, and nearer than anything else. A gate should begin beyond them;
//! where it does not, the nearest body is the vehicle itself, and says for ever that nothing closes. So while
//! something is as near as the vehicle may reach, what is beyond that reach is followed as well. The vehicle keeps its
//! distance while what is beyond moves. Then the answer is about what is beyond, until the near body moves too: a car
//! that stood close ahead is the target again as soon as it is [`KEEPS`] away from where it was.
//!
//! What is between the near body and the end of the reach is not seen then. A body that comes to the end of the reach
//! may be there afterwards, and nothing is clear until one is seen to come out again, or the near body moves.

use super::gate::Gate;
use super::tracker::{BodyTracker, CloudSettings, CloudTrack};
use crate::error::Error;
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use crate::tracker::TrackedTtc;

/// The vehicle reaches no farther ahead of the sensor than this, m, where `front_offset` is not given.
pub const REACH: f64 = 3.0;
/// With a `front_offset`, only what is farther behind the bumper than this is the vehicle, m: what touches the bumper
/// is not.
const BEHIND_BUMPER: f64 = 0.2;
/// A body that keeps its distance stays within this of it, m.
pub const KEEPS: f64 = 0.1;
/// A closing speed up to this is none, m/s.
const STANDS: f64 = 0.05;
/// A body nearer than the still one by this is another, m.
const NEARER: f64 = 0.3;
/// What is beyond has to move by this, m, ...
const WORLD_MOVES: f64 = 0.3;
/// ... and the near body has to keep its distance for this, s.
const LONG_ENOUGH: f64 = 0.5;
/// A body that is seen up to this far beyond the reach has come out of it, m.
const COMES_OUT: f64 = 1.0;
/// A still body that was not seen for longer than this is forgotten, s.
const GONE: f64 = 1.0;

/// A body close to the sensor that keeps its distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillBody {
    /// The distance from the sensor that it keeps, m.
    pub distance: f64,
    /// Stamp since which it has kept it, s.
    pub since: f64,
    /// Stamp at which it was last seen, s.
    pub seen: f64,
    /// Stamp up to which the motion of what is beyond is summed up, s.
    pub stamp: f64,
    /// The way that what is beyond has moved meanwhile, m.
    pub world_moved: f64,
    /// Whether it is the vehicle itself.
    pub is_own: bool,
    /// Whether another body came so near that it may be between this one and the end of the reach.
    pub hides: bool,
}

impl StillBody {
    fn new(distance: f64, stamp: f64) -> Self {
        StillBody { distance, since: stamp, seen: stamp, stamp, world_moved: 0.0, is_own: false, hides: false }
    }

    /// What is known of the body after another frame: of the near body, `distance` from the sensor, and of what is
    /// beyond. `None` if it is gone, or something nearer is there.
    fn after(self, near: &TrackedTtc, distance: Option<f64>, beyond: &TrackedTtc, stamp: f64) -> Option<Self> {
        let mut now = StillBody { stamp, hides: self.hides_after(beyond), ..self };
        now.world_moved += moved(beyond) * (stamp - self.stamp);
        let Some(distance) = distance else { return (stamp - self.seen <= GONE).then_some(now) };
        let Some([low, high]) = near.closing_speed_interval else {
            let replaced = distance < self.distance - NEARER || stamp - self.seen > GONE;
            return (!replaced).then_some(now);
        };
        if (distance - self.distance).abs() > KEEPS {
            return Some(StillBody::new(distance, stamp));
        }
        now.seen = stamp;
        let stands = near.closing_speed.abs() <= ((high - low) / 2.0).max(STANDS);
        now.is_own |= stands && now.world_moved >= WORLD_MOVES && stamp - self.since >= LONG_ENOUGH;
        Some(now)
    }

    /// Whether a body may be hidden after another frame, of which `beyond` says what is seen beyond the reach.
    fn hides_after(&self, beyond: &TrackedTtc) -> bool {
        match beyond.status {
            _ if beyond.distance <= REACH + KEEPS => true,
            Status::Lost | Status::Clear | Status::NoData | Status::Stale | Status::Invalid => self.hides,
            _ => self.hides && beyond.distance > REACH + COMES_OUT,
        }
    }

    fn check(&self, newest: Option<f64>) -> Result<(), Error> {
        let numbers = [self.distance, self.since, self.seen, self.stamp, self.world_moved];
        let ordered = self.since <= self.seen && self.seen <= self.stamp && Some(self.stamp) <= newest;
        if numbers.into_iter().all(f64::is_finite) && self.world_moved >= 0.0 && ordered {
            return Ok(());
        }
        Err(Error::new("state", "must hold a body that keeps its distance, with finite numbers and stamps in order"))
    }
}

/// The speed at which a body certainly moves, m/s; 0 where it may stand.
fn moved(body: &TrackedTtc) -> f64 {
    let Some([low, high]) = body.closing_speed_interval else { return 0.0 };
    let speed = body.closing_speed.abs();
    if speed > ((high - low) / 2.0).max(STANDS) { speed } else { 0.0 }
}

/// Everything that a tracker of clouds remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudMemory {
    /// The nearest body in the gate.
    pub nearest: CloudTrack,
    /// The nearest body beyond the reach of the vehicle, while something is within it.
    pub beyond: CloudTrack,
    /// The body within that reach that keeps its distance.
    pub still: Option<StillBody>,
}

impl CloudMemory {
    /// Returns the memory if a tracker could have it.
    ///
    /// # Errors
    /// When numbers are not finite, sightings or cells are out of order, or there are too many.
    pub fn checked(self) -> Result<Self, Error> {
        let CloudMemory { nearest, beyond, still } = self;
        let (nearest, beyond) = (nearest.checked()?, beyond.checked()?);
        if let Some(still) = &still {
            still.check(nearest.stamp)?;
        }
        Ok(CloudMemory { nearest, beyond, still })
    }
}

/// Follows the nearest body ahead that is not the vehicle itself, and never two at once.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudTracker {
    nearest: BodyTracker,
    /// `None` where the gate ends within the reach of the vehicle.
    beyond: Option<BodyTracker>,
    still: Option<StillBody>,
}

impl CloudTracker {
    /// A tracker that has seen nothing.
    ///
    /// # Errors
    /// When a setting makes no sense.
    pub fn new(settings: CloudSettings) -> Result<Self, Error> {
        let nearest = BodyTracker::new(settings)?;
        let (from, to) = settings.gate.x;
        let from = from.max(reach(&settings));
        let beyond = if from < to {
            let gate = Gate { x: (from, to), ..*settings.gate }.checked()?;
            Some(BodyTracker::new(CloudSettings { gate, ..settings })?)
        } else {
            None
        };
        Ok(CloudTracker { nearest, beyond, still: None })
    }

    /// Takes a cloud, and says how the body ahead moves.
    ///
    /// # Errors
    /// When the gate bounds an intensity that the points lack.
    pub fn update<T: Real>(&mut self, points: &Points<'_, T>, stamp: f64, level: Level) -> Result<TrackedTtc, Error> {
        let seen = self.nearest.update(points, stamp, level)?;
        let settings = self.nearest.settings();
        let distance = seen.distance + settings.front_offset;
        let distance = (distance < within(settings) && seen.status != Status::Lost).then_some(distance);
        let Some(beyond) = &mut self.beyond else { return Ok(seen) };
        if distance.is_none() && self.still.is_none() {
            beyond.track = CloudTrack::default();
            return Ok(seen);
        }
        let farther = beyond.update(points, stamp, level)?;
        if seen.status != Status::Invalid {
            self.still = match (self.still, distance) {
                (Some(still), _) => still.after(&seen, distance, &farther, stamp),
                (None, Some(distance)) if seen.closing_speed_interval.is_some() => {
                    Some(StillBody::new(distance, stamp))
                }
                _ => None,
            };
        }
        let hides = self.still.is_some_and(|still| still.hides) && settings.front_offset <= 0.0;
        Ok(match farther.status {
            _ if self.own_vehicle().is_none() => seen,
            Status::Clear | Status::NotClosing if hides => TrackedTtc { status: Status::Lost, ..farther },
            _ => farther,
        })
    }

    /// How far ahead of the sensor the vehicle itself is seen in the gate, m, if it is.
    #[must_use]
    pub fn own_vehicle(&self) -> Option<f64> {
        self.still.filter(|still| still.is_own).map(|still| still.distance)
    }

    /// Everything that is remembered, to be saved.
    #[must_use]
    pub fn memory(&self) -> CloudMemory {
        let beyond = self.beyond.as_ref().map_or_else(CloudTrack::default, |beyond| beyond.track.clone());
        CloudMemory { nearest: self.nearest.track.clone(), beyond, still: self.still }
    }

    /// Remembers what another tracker with the same settings remembered; the default is nothing.
    pub fn remember(&mut self, memory: CloudMemory) {
        self.nearest.track = memory.nearest;
        self.still = memory.still;
        if let Some(beyond) = &mut self.beyond {
            beyond.track = memory.beyond;
        }
    }
}

/// How far ahead of the sensor the vehicle reaches at most, m.
fn reach(settings: &CloudSettings) -> f64 {
    if settings.front_offset > 0.0 { settings.front_offset } else { REACH }
}

/// Bodies nearer to the sensor than this may be the vehicle, m.
fn within(settings: &CloudSettings) -> f64 {
    if settings.front_offset > 0.0 { settings.front_offset - BEHIND_BUMPER } else { REACH }
}
