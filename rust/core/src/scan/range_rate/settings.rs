//! How range rates are found and judged.

use super::MOST_SCANS;
use crate::error::Error;
use crate::scan::{BeamVote, Neighbours};

/// A window longer than this has nothing to do with a collision, s.
const LONGEST_WINDOW: f64 = 60.0;

/// How range rates are found and judged.
#[derive(Clone, Debug, PartialEq)]
pub struct RateSettings {
    /// A rate is fitted to the scans of so many seconds.
    pub window: f64,
    /// And to at least so many.
    pub min_scans: usize,
    /// Standard deviation of a reading, m.
    pub noise: f64,
    /// What changes faster is another surface, m/s.
    pub max_speed: f64,
    /// What changes its speed faster is another surface, m/s^2.
    pub max_acceleration: f64,
    /// So many standard deviations a reading may be off before it belongs to another surface.
    pub gate: f64,
    /// So many standard errors a closing speed must be above 0.
    pub significance: f64,
    /// Neighbouring beams farther apart than this see different surfaces, m.
    pub edge: f64,
    /// How a speckle is outvoted, among the beams that close.
    pub beam_vote: BeamVote,
}

impl Default for RateSettings {
    fn default() -> Self {
        RateSettings {
            window: 0.5,
            min_scans: 4,
            noise: 0.01,
            max_speed: 20.0,
            max_acceleration: 5.0,
            gate: 3.0,
            significance: 3.0,
            edge: 0.2,
            beam_vote: BeamVote::Neighbours(Neighbours { count: 6, window: 4, gap: 0.2 }),
        }
    }
}

impl RateSettings {
    pub(super) fn check(&self) -> Result<(), Error> {
        positive("window", self.window)?;
        if self.window > LONGEST_WINDOW {
            return Err(Error::new("window", format!("must be at most {LONGEST_WINDOW} s, got {:?}", self.window)));
        }
        if !(3..=MOST_SCANS).contains(&self.min_scans) {
            let got = self.min_scans;
            return Err(Error::new("min_scans", format!("must be at least 3 and at most {MOST_SCANS}, got {got}")));
        }
        positive("noise", self.noise)?;
        positive("max_speed", self.max_speed)?;
        positive("max_acceleration", self.max_acceleration)?;
        positive("gate", self.gate)?;
        positive("significance", self.significance)?;
        positive("edge", self.edge)?;
        self.beam_vote.checked().map(|_| ())
    }
}

fn positive(argument: &'static str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::new(argument, format!("must be finite and above 0, got {value:?}")))
}
