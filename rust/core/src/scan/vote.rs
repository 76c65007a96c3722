//! Which beam counts: the nearest in time, or the nearest that is not a speckle.

use crate::error::{Error, non_negative};

/// A beam and its time-to-collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub ttc: f64,
    pub index: usize,
}

impl Hit {
    /// No beam: it never comes.
    pub(crate) const NONE: Hit = Hit { ttc: f64::INFINITY, index: usize::MAX };

    /// Whether it ever comes.
    #[inline(always)]
    pub(crate) fn closes(&self) -> bool {
        self.ttc < f64::INFINITY
    }

    /// Earlier, or as early at a lower index.
    #[inline(always)]
    pub(crate) fn precedes(&self, other: &Hit) -> bool {
        self.ttc < other.ttc || (self.ttc == other.ttc && self.index < other.index)
    }

    /// This one if it comes at all and precedes the other, else the other.
    #[inline(always)]
    pub(crate) fn or(self, other: Hit) -> Hit {
        if self.closes() && self.precedes(&other) { self } else { other }
    }

    pub(crate) fn order(&self, other: &Hit) -> std::cmp::Ordering {
        self.ttc.total_cmp(&other.ttc).then(self.index.cmp(&other.index))
    }
}

/// How a speckle is outvoted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamVote {
    /// The `k`-th smallest time-to-collision of the scan.
    KthSmallest(usize),
    /// The least time-to-collision of the beams that their neighbours support.
    Neighbours(Neighbours),
}

/// A beam is supported when at least `count` of the `window` beams on each side have a usable range within `gap`
/// metres of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    /// How many must agree.
    pub count: usize,
    /// How many beams to look at on each side.
    pub window: usize,
    /// How far their ranges may differ, m.
    pub gap: f64,
}

/// Looking farther than this to each side is not a neighbourhood.
const WIDEST_WINDOW: usize = 128;

impl BeamVote {
    pub(super) fn checked(self) -> Result<Self, Error> {
        match self {
            BeamVote::KthSmallest(0) => Err(Error::new("k", "must be at least 1, got 0")),
            BeamVote::KthSmallest(_) => Ok(self),
            BeamVote::Neighbours(neighbours) => neighbours.checked().map(BeamVote::Neighbours),
        }
    }
}

impl Neighbours {
    /// These settings, if they make sense.
    ///
    /// # Errors
    /// When no beam could ever be supported, or the gap is not a distance.
    pub fn checked(self) -> Result<Self, Error> {
        non_negative("gap", self.gap)?;
        if self.count == 0 {
            return Err(Error::new("count", "must be at least 1, got 0"));
        }
        if self.window > WIDEST_WINDOW {
            return Err(Error::new("window", format!("must be at most {WIDEST_WINDOW}, got {}", self.window)));
        }
        let most = 2 * self.window;
        if self.count > most {
            let got = self.count;
            return Err(Error::new(
                "count",
                format!("must be at most 2 * window = {most}, or no beam can be supported; got {got}"),
            ));
        }
        Ok(self)
    }
}

/// The beam among those that close that the vote elects, or the first of them where it elects none; and whether it did,
/// or there was nobody to elect. `usable` is the range of a beam, NaN without one.
pub(super) fn elect(
    beam_vote: BeamVote,
    closing: Vec<Hit>,
    beams: usize,
    usable: impl Fn(usize) -> f64,
) -> (Hit, bool) {
    let Some(first) = closing.iter().copied().min_by(Hit::order) else { return (Hit::NONE, true) };
    let winner = winner(beam_vote, closing, beams, usable);
    (winner.unwrap_or(first), winner.is_some())
}

/// The beam that wins the vote among those that close, if one does.
fn winner(beam_vote: BeamVote, mut closing: Vec<Hit>, beams: usize, usable: impl Fn(usize) -> f64) -> Option<Hit> {
    match beam_vote {
        BeamVote::KthSmallest(k) => {
            let place = k.checked_sub(1).filter(|place| *place < closing.len())?;
            Some(*closing.select_nth_unstable_by(place, Hit::order).1)
        }
        BeamVote::Neighbours(neighbours) => closing.into_iter().fold(None, |best, each| {
            let sooner = best.is_none_or(|best| each.precedes(&best));
            if sooner && neighbours.support(each.index, beams, &usable) { Some(each) } else { best }
        }),
    }
}

impl Neighbours {
    /// Whether enough of the beams around `beam` agree with it.
    fn support(self, beam: usize, beams: usize, usable: impl Fn(usize) -> f64) -> bool {
        let own = usable(beam);
        let around = beam.saturating_sub(self.window)..beams.min(beam + self.window + 1);
        around.filter(|other| *other != beam && (usable(*other) - own).abs() <= self.gap).count() >= self.count
    }
}
