//! From what is known of each beam to one answer for the scan.

use super::RangeRate;
use super::judge::Coverage;
use crate::scan::vote::{self, Hit};
use crate::scan::{Counts, Range, View};
use crate::status::Status;

/// The beam that comes nearest in time by its own range rate, and everything that says why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatedNearest {
    /// Least time-to-collision, s.
    pub ttc: f64,
    /// What it means.
    pub status: Status,
    /// The beam that decided: the one of `ttc`, else the first in contact, else none.
    pub beam: Option<usize>,
    /// Direction of that beam in the sensor frame, rad. NaN without a beam, as all that follows.
    pub angle: f64,
    /// Its reading, m.
    pub range: f64,
    /// What is left of it outside the outline, m.
    pub clearance: f64,
    /// How fast its range shrinks, m/s; NaN where unknown.
    pub closing_speed: f64,
    /// Of that speed, m/s.
    pub standard_error: f64,
    /// How often each case of a reading occurred.
    pub counts: Counts,
    /// Beams whose range rate is known.
    pub rated: u32,
    /// Beams that see something whose range rate is unknown.
    pub unrated: u32,
    /// Least clearance of those, m; infinite without one.
    pub nearest_unrated: f64,
}

impl RatedNearest {
    /// What is said of a scan that is not newer than the last.
    pub(super) const OUT_OF_ORDER: RatedNearest = RatedNearest {
        ttc: f64::INFINITY,
        status: Status::Invalid,
        beam: None,
        angle: f64::NAN,
        range: f64::NAN,
        clearance: f64::NAN,
        closing_speed: f64::NAN,
        standard_error: f64::NAN,
        counts: Counts {
            valid: 0,
            invalid: 0,
            too_close: 0,
            no_return: 0,
            out_of_range: 0,
            beyond_limits: 0,
            masked: 0,
            contact: 0,
        },
        rated: 0,
        unrated: 0,
        nearest_unrated: f64::INFINITY,
    };
}

impl RangeRate {
    pub(super) fn nearest<T: Range>(&self, view: &View<'_, T>, coverage: Coverage, stale: bool) -> RatedNearest {
        let counts = view.counts();
        let (best, supported) = self.best();
        let shown = if best.closes() {
            Some(best.index)
        } else if counts.contact > 0 {
            view.first_contact()
        } else {
            None
        };
        let status = if !view.observes() {
            Status::NoData
        } else if stale {
            Status::Stale
        } else if coverage.unrated > 0 && coverage.rated == 0 {
            Status::WarmingUp
        } else if counts.contact > 0 {
            Status::Contact
        } else if !supported {
            Status::TooFew
        } else if best.closes() {
            Status::Closing
        } else if coverage.rated > 0 {
            Status::NotClosing
        } else {
            Status::Clear
        };
        let range = shown.map_or(f64::NAN, |beam| view.usable(beam));
        RatedNearest {
            ttc: best.ttc,
            status,
            beam: shown,
            angle: shown.map_or(f64::NAN, |beam| self.scan.settings.angle(beam)),
            range,
            clearance: shown.map_or(f64::NAN, |beam| view.exact.clearance(beam, range)),
            closing_speed: shown.map_or(f64::NAN, |beam| -self.beams.range_rate[beam]),
            standard_error: shown.map_or(f64::NAN, |beam| self.beams.standard_error[beam]),
            counts,
            rated: coverage.rated,
            unrated: coverage.unrated,
            nearest_unrated: coverage.nearest_unrated,
        }
    }

    /// The deciding beam, and whether the vote confirmed it. Only beams that close vote.
    fn best(&self) -> (Hit, bool) {
        let Some(newest) = self.history.newest() else { return (Hit::NONE, true) };
        let width = self.scan.settings.beams;
        let times = &self.beams.ttc[..width];
        let each = times.iter().enumerate().map(|(beam, ttc)| Hit { ttc: *ttc, index: beam });
        let closing: Vec<Hit> = each.filter(Hit::closes).collect();
        let closes = |beam: usize| if times[beam] < f64::INFINITY { newest.readings[beam] } else { f64::NAN };
        vote::elect(self.settings.beam_vote, closing, width, closes)
    }
}
