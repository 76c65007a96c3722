//! What can be asked of one scan in one motion.

use super::geometry::Mount;
use super::per_beam::{Pace, Scan, Statuses, Times};
use super::prepared::KernelTables;
use super::reading::{CountReadings, Counts};
use super::search::first_hit;
use super::tables::ExactBeams;
use super::vote::{self, BeamVote, Hit};
use crate::column::{Column, ColumnMut};
use crate::lanes::groups;
use crate::real::Real;
use crate::simd::Level;

/// One scan in one motion.
pub(super) struct View<'a, T> {
    pub ranges: Column<'a, T>,
    pub prepared: &'a KernelTables<T>,
    pub exact: ExactBeams<'a>,
    pub level: Level,
    pub beam_vote: Option<BeamVote>,
    pub mount: Mount,
}

impl<T: Real> View<'_, T> {
    /// The deciding beam, and whether a vote (if one was asked for) confirmed it.
    pub(super) fn best(&self) -> (Hit, bool) {
        match self.beam_vote {
            None => (first_hit(self.level, self.ranges, self.prepared, self.exact), true),
            Some(beam_vote) => self.voted(beam_vote),
        }
    }

    /// The vote is for those who would rather be right than fast: every beam is computed.
    pub(super) fn voted(&self, beam_vote: BeamVote) -> (Hit, bool) {
        self.elected(beam_vote, self.closing())
    }

    /// The beam among those that close that a vote elects, or the first of them where it elects none.
    pub(super) fn elected(&self, beam_vote: BeamVote, closing: Vec<Hit>) -> (Hit, bool) {
        let usable = |beam| if self.exact.beams.ignores(beam) { f64::NAN } else { self.usable(beam) };
        vote::elect(beam_vote, closing, self.ranges.len(), usable)
    }

    /// Every beam that closes.
    fn closing(&self) -> Vec<Hit> {
        let ttc = |beam| Hit { ttc: self.exact.ttc(beam, self.usable(beam)), index: beam };
        (0..self.ranges.len()).map(ttc).filter(Hit::closes).collect()
    }

    pub(super) fn per_beam<'o>(
        &self,
        pace: impl Pace<T>,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) {
        let KernelTables { tables, rules } = self.prepared;
        let (rules, offset, min_closing_speed) =
            (*rules, groups(&tables.offset), T::from_f64(self.exact.min_closing_speed));
        let ranges = self.ranges;
        // The times last: they may be written over the ranges.
        if let Some(status_out) = status_out {
            let out = status_out.reborrow();
            self.level.run(Statuses { scan: Scan { ranges, rules, offset, pace, min_closing_speed }, out });
        }
        if let (Some(ranges), Some(out)) = (ranges.dense(), out.dense()) {
            self.level.run(Times { scan: Scan { ranges, rules, offset, pace, min_closing_speed }, out });
        } else {
            let out = out.reborrow();
            self.level.run(Times { scan: Scan { ranges, rules, offset, pace, min_closing_speed }, out });
        }
    }

    pub(super) fn counts(&self) -> Counts {
        let KernelTables { tables, rules } = self.prepared;
        match self.ranges.dense() {
            Some(ranges) => self.level.run(CountReadings { ranges, rules: *rules, tables }),
            None => self.level.run(CountReadings { ranges: self.ranges, rules: *rules, tables }),
        }
    }

    /// Whether any beam saw anything. Usually one of the first did.
    pub(super) fn observes(&self) -> bool {
        (0..self.ranges.len())
            .any(|beam| !self.exact.beams.ignores(beam) && self.prepared.rules.observed(self.ranges.get(beam)))
    }

    pub(super) fn usable(&self, beam: usize) -> f64 {
        self.prepared.rules.usable(self.ranges.get(beam)).to_f64()
    }

    pub(super) fn first_contact(&self) -> Option<usize> {
        (0..self.ranges.len()).find(|beam| self.exact.clearance(*beam, self.usable(*beam)) <= 0.0)
    }
}
