//! What is known of a scanner before a scan arrives.

use super::geometry::{Mount, Outline};
use super::reading::{LimitsPolicy, TooClose};
use super::vote::BeamVote;
use crate::error::{Error, finite, non_negative};

/// A sensor whose beams span more than this is more likely described in degrees, rad.
const WIDEST_VIEW: f64 = 4.0 * std::f64::consts::PI;

/// More beams than any scanner has, so that tables fit in memory and counts in 32 bits.
const MOST_BEAMS: usize = 1 << 22;

/// No scanner's range begins farther away than this, m. Keeps bounds finite in `f32` too.
const FARTHEST: f64 = 1e30;

/// Everything that is known of a scanner before a scan arrives.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Direction of the first beam in the sensor frame, rad.
    pub angle_min: f64,
    /// From one beam to the next, rad; negative for a scanner that turns clockwise.
    pub angle_increment: f64,
    /// Number of beams.
    pub beams: usize,
    /// Readings below this are discarded, m.
    pub range_min: f64,
    /// Readings above this are discarded, m.
    pub range_max: f64,
    /// The user's (near, far), m.
    pub limits: Option<(f64, f64)>,
    /// What the limits do.
    pub limits_policy: LimitsPolicy,
    /// Where the sensor sits.
    pub mount: Mount,
    /// The vehicle's shape.
    pub outline: Option<Outline>,
    /// Beams to ignore.
    pub mask: Option<Vec<bool>>,
    /// Closing at or below this is not closing, m/s.
    pub min_closing_speed: f64,
    /// What -inf means.
    pub too_close: TooClose,
    /// How a speckle is outvoted.
    pub beam_vote: Option<BeamVote>,
}

impl Settings {
    /// The least that describes a scanner; everything else at its default.
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
        if !(1..=MOST_BEAMS).contains(&self.beams) {
            let got = self.beams;
            return Err(Error::new("beams", format!("must be at least 1 and at most {MOST_BEAMS}, got {got}")));
        }
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
        if let Some(mask) = &self.mask
            && mask.len() != self.beams
        {
            let (got, beams) = (mask.len(), self.beams);
            return Err(Error::new("mask", format!("must have one entry for each of the {beams} beams, got {got}")));
        }
        non_negative("min_closing_speed", self.min_closing_speed)?;
        self.mount.checked()?;
        self.outline.map(Outline::checked).transpose()?;
        self.beam_vote.map(BeamVote::checked).transpose()?;
        Ok(())
    }

    /// Direction of each beam in the sensor frame, rad.
    #[must_use]
    pub fn angles(&self) -> impl ExactSizeIterator<Item = f64> + Clone {
        (0..self.beams).map(|beam| self.angle(beam))
    }

    pub(super) fn angle(&self, beam: usize) -> f64 {
        self.angle_min + self.angle_increment * beam as f64
    }
}
