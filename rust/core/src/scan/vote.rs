//! Which beam decides, where a speckle must not: the nearest in time that a vote confirms.
//!
//! The beams that close stand for election, and one of two rules elects: the `k`-th smallest time-to-collision, or the
//! least among the beams that their neighbours support. Where the rule elects none, the nearest in time decides,
//! unconfirmed.

use super::settings::Settings;
use crate::error::{Error, at_least_one, non_negative};
use crate::hit::Hit;

/// How a speckle is outvoted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamVote {
    /// The `k`-th smallest time-to-collision of the scan decides.
    KthSmallest(usize),
    /// The least time-to-collision of the beams that their neighbours support decides.
    Neighbours(Neighbours),
}

/// A beam is supported when at least `count` of the `window` beams on each side have a usable range within `gap`
/// metres of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    /// How many must agree.
    pub count: usize,
    /// How many beams on each side are neighbours.
    pub window: usize,
    /// How far their ranges may differ, m.
    pub gap: f64,
}

/// Looking farther than this to each side is not a neighbourhood.
const WIDEST_WINDOW: usize = 128;

impl BeamVote {
    pub(crate) fn checked(self) -> Result<Self, Error> {
        match self {
            BeamVote::KthSmallest(k) => at_least_one("k", k).map(BeamVote::KthSmallest),
            BeamVote::Neighbours(neighbours) => neighbours.checked().map(BeamVote::Neighbours),
        }
    }

    /// Returns the deciding one of the beams that close, and whether the vote confirms it: no beam at all is confirmed.
    ///
    /// `usable` gives the range of each beam, NaN without one.
    pub(crate) fn elect(self, closing: Vec<Hit>, scanner: &Settings, usable: impl Fn(usize) -> f64) -> (Hit, bool) {
        let Some(first) = closing.iter().copied().min_by(Hit::order) else { return (Hit::NONE, true) };
        let winner = self.winner(closing, scanner, usable);
        (winner.unwrap_or(first), winner.is_some())
    }

    /// Returns the beam that wins the vote among those that close, if one does.
    fn winner(self, mut closing: Vec<Hit>, scanner: &Settings, usable: impl Fn(usize) -> f64) -> Option<Hit> {
        match self {
            BeamVote::KthSmallest(k) => {
                let place = k.checked_sub(1).filter(|place| *place < closing.len())?;
                Some(*closing.select_nth_unstable_by(place, Hit::order).1)
            }
            BeamVote::Neighbours(neighbours) => closing.into_iter().fold(None, |best, each| {
                let sooner = best.is_none_or(|best| each.precedes(&best));
                if sooner && neighbours.support(each.index, scanner, &usable) { Some(each) } else { best }
            }),
        }
    }
}

impl Neighbours {
    /// Returns these settings, if they make sense.
    ///
    /// # Errors
    /// When no beam could ever be supported, or the gap is not a distance.
    pub fn checked(self) -> Result<Self, Error> {
        let Neighbours { count, window, gap } = self;
        non_negative("gap", gap)?;
        at_least_one("count", count)?;
        if window > WIDEST_WINDOW {
            return Err(Error::new("window", format!("must be at most {WIDEST_WINDOW}, got {window}")));
        }
        let most = 2 * window;
        if count > most {
            let problem = format!("must be at most 2 * window = {most}, or no beam can be supported; got {count}");
            return Err(Error::new("count", problem));
        }
        Ok(self)
    }

    /// Whether enough of the beams around `beam` agree with it, across the seam of a scanner that looks all around too.
    fn support(self, beam: usize, scanner: &Settings, usable: impl Fn(usize) -> f64) -> bool {
        let (own, beams) = (usable(beam), scanner.beams);
        let agrees = |other: &usize| (usable(*other) - own).abs() <= self.gap;
        if scanner.goes_around() {
            let steps = 1..=self.window.min((beams - 1) / 2);
            let around = steps.flat_map(|steps| [(beam + beams - steps) % beams, (beam + steps) % beams]);
            return around.filter(agrees).count() >= self.count;
        }
        let around = beam.saturating_sub(self.window)..beams.min(beam + self.window + 1);
        around.filter(|other| *other != beam && agrees(other)).count() >= self.count
    }
}
