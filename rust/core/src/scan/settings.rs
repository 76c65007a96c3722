//! The settings of a scanner, and how they are checked.

use super::vote::BeamVote;
use crate::error::{Error, count_in, finite, non_negative, one_entry_each};
use crate::vehicle::{Mount, Outline};
use std::f64::consts::{PI, TAU};

/// A sensor whose beams span more than this is more likely described in degrees, rad.
const WIDEST_VIEW: f64 = 4.0 * PI;

/// More beams than any scanner has. Tables of as many fit in memory, and their counts in 32 bits.
const MOST_BEAMS: usize = 1 << 22;

/// No scanner's range begins farther away than this, m. This keeps bounds finite in `f32` too.
const FARTHEST: f64 = 1e30;

/// What a reading of -inf counts as, which says that an object is nearer than `range_min`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TooClose {
    /// It is a hit at `range_min`.
    #[default]
    Hit,
    /// It is nothing: infinities are ignored, literally.
    Ignore,
}

/// What the user's limits do to a valid reading outside them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LimitsPolicy {
    /// A reading beyond the far limit is out of the horizon and never the cause; one below the near limit is kept as it
    /// is.
    #[default]
    Horizon,
    /// Readings are clamped into the limits, literally.
    Clamp,
}

/// Everything that is known of a scanner before a scan arrives.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The direction of the first beam in the sensor frame, rad.
    pub angle_min: f64,
    /// The angle from one beam to the next, rad; negative for a scanner that turns clockwise.
    pub angle_increment: f64,
    /// The number of beams.
    pub beams: usize,
    /// Readings below this are discarded, m.
    pub range_min: f64,
    /// Readings above this are discarded, m.
    pub range_max: f64,
    /// The user's limits (near, far), m.
    pub limits: Option<(f64, f64)>,
    /// What the limits do to valid readings outside them.
    pub limits_policy: LimitsPolicy,
    /// Where the sensor sits.
    pub mount: Mount,
    /// The vehicle's shape.
    pub outline: Option<Outline>,
    /// Which beams are ignored.
    pub mask: Option<Vec<bool>>,
    /// Closing at or below this is not closing, m/s.
    pub min_closing_speed: f64,
    /// What a reading of -inf counts as.
    pub too_close: TooClose,
    /// Which beam decides; without a vote the nearest in time.
    pub beam_vote: Option<BeamVote>,
}

impl Settings {
    /// The settings of a scanner with these beams, and everything else at its default.
    #[must_use]
    pub fn new(angle_min: f64, angle_increment: f64, beams: usize) -> Self {
        Settings {
            angle_min,
            angle_increment,
            beams,
            range_min: 0.0,
            range_max: f64::INFINITY,
            limits: None,
            limits_policy: LimitsPolicy::default(),
            mount: Mount::default(),
            outline: None,
            mask: None,
            min_closing_speed: 0.01,
            too_close: TooClose::default(),
            beam_vote: None,
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        finite("angle_min", self.angle_min)?;
        finite("angle_increment", self.angle_increment)?;
        count_in("beams", self.beams, 1..=MOST_BEAMS)?;
        if self.angle_increment == 0.0 && self.beams > 1 {
            return Err(Error::new("angle_increment", "must not be 0 with more than one beam"));
        }
        for (argument, angle) in [("angle_min", self.angle_min), ("mount", self.mount.yaw)] {
            if angle.abs() > WIDEST_VIEW {
                return Err(Error::new(
                    argument,
                    format!("has the angle {angle:?}; angles are in radians, not degrees"),
                ));
            }
        }
        let view = self.angle_increment.abs() * (self.beams - 1) as f64;
        if view > WIDEST_VIEW {
            let tenths = (view * 10.0).round() / 10.0;
            return Err(Error::new(
                "angle_increment",
                format!("spans {tenths:?} rad over {} beams; angles are in radians, not degrees", self.beams),
            ));
        }
        non_negative("range_min", self.range_min)?;
        if self.range_min > FARTHEST {
            let got = self.range_min;
            return Err(Error::new("range_min", format!("must be below {FARTHEST:e} m, got {got:?}")));
        }
        if self.range_max.is_nan() || self.range_max <= self.range_min {
            let (low, high) = (self.range_min, self.range_max);
            return Err(Error::new("range_max", format!("must be above range_min = {low:?}, got {high:?}")));
        }
        if let Some((near, far)) = self.limits
            && !(near >= 0.0 && near < far)
        {
            return Err(Error::new(
                "limits",
                format!("must be (near, far) with 0 <= near < far, got ({near:?}, {far:?})"),
            ));
        }
        if let Some((_, far)) = self.limits
            && far <= self.range_min
        {
            let low = self.range_min;
            return Err(Error::new(
                "limits",
                format!("end at {far:?}, not beyond range_min = {low:?}: no reading could ever count"),
            ));
        }
        self.mask.as_ref().map_or(Ok(()), |mask| one_entry_each("mask", mask.len(), self.beams, "beams"))?;
        non_negative("min_closing_speed", self.min_closing_speed)?;
        self.mount.checked()?;
        self.outline.map(Outline::checked).transpose()?;
        self.beam_vote.map(BeamVote::checked).transpose()?;
        Ok(())
    }

    /// The direction of each beam in the sensor frame, rad.
    #[must_use]
    pub fn angles(&self) -> impl ExactSizeIterator<Item = f64> + Clone {
        (0..self.beams).map(|beam| self.angle(beam))
    }

    /// Whether the beams go all around, so that the first is a neighbour of the last.
    pub(crate) fn goes_around(&self) -> bool {
        let increment = self.angle_increment.abs();
        let seam = TAU - increment * (self.beams - 1) as f64;
        -0.5 * increment <= seam && seam <= 1.5 * increment
    }

    pub(crate) fn angle(&self, beam: usize) -> f64 {
        self.angle_min + self.angle_increment * beam as f64
    }
}
