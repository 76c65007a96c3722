//! Which of the decided beams counts: the nearest, or the nearest that is not a speckle.

use super::reading::Rules;
use super::tables::Beams;
use crate::column::Source;
use crate::error::{Error, non_negative};
use crate::real::Real;

/// How a speckle is outvoted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Minimum {
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

impl Minimum {
    pub(super) fn checked(self) -> Result<Self, Error> {
        match self {
            Minimum::KthSmallest(0) => Err(Error::new("k", "must be at least 1, got 0")),
            Minimum::KthSmallest(_) => Ok(self),
            Minimum::Neighbours(neighbours) => neighbours.checked().map(Minimum::Neighbours),
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
        let most = self.window.saturating_mul(2);
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

/// Collects decided beams. Their order is not defined, so ties are settled by index; one may be shown twice.
pub(super) trait Tally<T, S> {
    /// Values above this cannot change the answer.
    fn limit(&self) -> f64;
    /// A beam that closes, at or below the limit.
    fn show(&mut self, candidate: Best, ranges: &S);
}

/// A beam and its time-to-collision; infinity and no beam to begin with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Best {
    pub ttc: f64,
    pub beam: usize,
}

impl Best {
    pub(super) const NONE: Best = Best { ttc: f64::INFINITY, beam: usize::MAX };

    fn precedes(&self, other: &Best) -> bool {
        self.ttc < other.ttc || (self.ttc == other.ttc && self.beam < other.beam)
    }
}

impl<T, S> Tally<T, S> for Best {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.ttc
    }

    #[inline(always)]
    fn show(&mut self, candidate: Best, _: &S) {
        if candidate.precedes(self) {
            *self = candidate;
        }
    }
}

/// The nearest beam after a vote, beside the plain nearest.
pub(super) struct Vote<'a, T> {
    pub plain: Best,
    minimum: Minimum,
    rules: Rules<T>,
    beams: &'a Beams,
    /// The `k` best so far, in order. One entry when neighbours decide.
    kept: Vec<Best>,
}

impl<'a, T: Real> Vote<'a, T> {
    pub(super) fn new(minimum: Minimum, rules: Rules<T>, beams: &'a Beams) -> Self {
        Vote { plain: Best::NONE, minimum, rules, beams, kept: Vec::new() }
    }

    fn places(&self) -> usize {
        match self.minimum {
            Minimum::KthSmallest(k) => k,
            Minimum::Neighbours(_) => 1,
        }
    }

    /// The beam that won the vote, if any did.
    pub(super) fn winner(&self) -> Option<Best> {
        self.kept.get(self.places() - 1).copied()
    }

    fn supported<S: Source<T>>(&self, neighbours: Neighbours, beam: usize, ranges: &S) -> bool {
        let usable = |beam: usize| self.rules.usable(ranges.lanes::<1>(beam)[0]).wide();
        let own = usable(beam);
        let last = ranges.len().min(beam.saturating_add(neighbours.window).saturating_add(1));
        (beam.saturating_sub(neighbours.window)..last)
            .filter(|other| *other != beam && !self.beams.ignores(*other))
            .filter(|other| (usable(*other) - own).abs() <= neighbours.gap)
            .count()
            >= neighbours.count
    }
}

impl<T: Real, S: Source<T>> Tally<T, S> for Vote<'_, T> {
    fn limit(&self) -> f64 {
        self.winner().map_or(f64::INFINITY, |best| best.ttc)
    }

    fn show(&mut self, candidate: Best, ranges: &S) {
        if candidate.precedes(&self.plain) {
            self.plain = candidate;
        }
        if let Minimum::Neighbours(neighbours) = self.minimum
            && !self.supported(neighbours, candidate.beam, ranges)
        {
            return;
        }
        let place = self.kept.partition_point(|kept| kept.precedes(&candidate));
        if self.kept.get(place) != Some(&candidate) {
            self.kept.insert(place, candidate);
            self.kept.truncate(self.places());
        }
    }
}
