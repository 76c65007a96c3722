//! The settings of range rates, and how they are checked.

use crate::error::{Error, count_in, positive};
use crate::scan::{BeamVote, Neighbours};

/// The largest number of scans that are remembered, however long the window.
pub const MOST_SCANS: usize = 64;

/// The longest window, s; what lies farther back has nothing to do with a collision.
const LONGEST_WINDOW: f64 = 60.0;

/// How range rates are fitted, and which of them count.
#[derive(Clone, Debug, PartialEq)]
pub struct RateSettings {
    /// How far back the scans reach that a rate is fitted to, s.
    pub window: f64,
    /// The least number of scans that a rate is fitted to.
    pub min_scans: usize,
    /// The standard deviation of a reading, m.
    pub noise: f64,
    /// How fast the range of one surface may change, m/s; what changes faster is another surface.
    pub max_speed: f64,
    /// How fast that speed may change, m/s^2; what changes its speed faster is another surface.
    pub max_acceleration: f64,
    /// How many standard deviations a reading may be off its surface.
    pub gate: f64,
    /// How many standard errors a closing speed must exceed.
    pub significance: f64,
    /// How far the readings of neighbouring beams on one surface may differ, m.
    pub edge: f64,
    /// Which of the beams that close decides.
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
        count_in("min_scans", self.min_scans, 3..=MOST_SCANS)?;
        positive("noise", self.noise)?;
        positive("max_speed", self.max_speed)?;
        positive("max_acceleration", self.max_acceleration)?;
        positive("gate", self.gate)?;
        positive("significance", self.significance)?;
        positive("edge", self.edge)?;
        self.beam_vote.checked().map(|_| ())
    }
}
