//! Instantaneous time-to-collision (iTTC) over the beams of a planar laser scanner.
//!
//! For each beam, iTTC is the clearance along it divided by the speed at which the sensor moves along it. A caller
//! makes a [`ScanTtc`] from [`settings`]; [`tables`] are computed once, from where the beams point and where the
//! vehicle's outline ends along them. Then scans arrive. [`readings`] says what a number in `ranges` means. [`search`]
//! finds the beam with the least time, and computes exactly only the few beams that a [`bound`] does not rule out; with
//! a [`vote`], every beam is computed and the vote decides. [`per_beam`] computes all beams, in the type of the ranges.
//! [`swept`] asks which beam's point the moving outline hits first, and [`field_of_view`] which part of its path no beam
//! looks at.

mod bound;
mod field_of_view;
mod per_beam;
mod readings;
mod search;
mod settings;
mod swept;
mod tables;
mod vote;

pub use settings::{LimitsPolicy, Settings, TooClose};
pub use swept::ScanSweptPath;
pub use vote::{BeamVote, Neighbours};
pub(crate) use {readings::Rules, tables::KernelTables};

use crate::column::{Column, ColumnMut, Source};
use crate::error::{Error, one_entry_each};
use crate::hit::{Counts, Hit};
use crate::lanes::groups;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use crate::vehicle::Motion;
use per_beam::{Pace, Scan, Statuses, Straight, Times, Turning};
use readings::CountReadings;
use search::first_hit;
use tables::{Beams, Blocks, ExactBeams, Tables};

/// The nearest beam in time, and everything that says why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The least time-to-collision, s.
    pub ttc: f64,
    /// What that time means.
    pub status: Status,
    /// The beam that decided: the one of `ttc`, else the first in contact, else none.
    pub beam: Option<usize>,
    /// The direction of that beam in the sensor frame, rad. Without a beam it is NaN, as are
    /// `range`, `clearance` and `closing_speed`.
    pub angle: f64,
    /// The reading of that beam, m.
    pub range: f64,
    /// What is left of the reading outside the outline, m.
    pub clearance: f64,
    /// The speed of the sensor along the beam, m/s.
    pub closing_speed: f64,
    /// How often each case of a reading occurred.
    pub counts: Counts,
}

/// A planar laser scanner on a vehicle. It never changes, and many threads can use it.
#[derive(Clone, Debug)]
pub struct ScanTtc {
    pub(crate) settings: Settings,
    pub(crate) level: Level,
    pub(crate) beams: Beams,
    blocks: Blocks,
    single: KernelTables<f32>,
    double: KernelTables<f64>,
}

/// A type that ranges can have.
pub trait Range: Real {
    #[doc(hidden)]
    #[allow(private_interfaces, reason = "the trait is closed: only this file implements it")]
    fn kernel_tables(scan: &ScanTtc) -> &KernelTables<Self>;
}

impl Range for f32 {
    #[allow(private_interfaces, reason = "as in the trait")]
    fn kernel_tables(scan: &ScanTtc) -> &KernelTables<f32> {
        &scan.single
    }
}

impl Range for f64 {
    #[allow(private_interfaces, reason = "as in the trait")]
    fn kernel_tables(scan: &ScanTtc) -> &KernelTables<f64> {
        &scan.double
    }
}

impl ScanTtc {
    /// Makes the tables of a scanner, to be used at instruction-set level `level`.
    ///
    /// # Errors
    /// When a setting makes no sense.
    pub fn new(settings: Settings, level: Level) -> Result<Self, Error> {
        settings.check()?;
        let beams = Beams::new(&settings);
        Ok(ScanTtc {
            single: KernelTables::new(&settings, &beams),
            double: KernelTables::new(&settings, &beams),
            blocks: Blocks::new(&beams, settings.beams),
            beams,
            level,
            settings,
        })
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the least time-to-collision, s, or `None` when nothing valid was observed.
    ///
    /// With [`Settings::beam_vote`] it is the time of the beam that the vote elects; where too few beams close for a
    /// vote, it is the plain least.
    ///
    /// # Errors
    /// When the number of ranges or the motion makes no sense.
    #[inline(always)]
    pub fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error> {
        let exact = self.exact(ranges.len(), motion)?;
        let best = match self.settings.beam_vote {
            None => first_hit(ranges, self, exact),
            Some(beam_vote) => self.moving(ranges, exact).voted(beam_vote).0,
        };
        Ok((best.closes() || self.moving(ranges, exact).observes()).then_some(best.ttc))
    }

    /// Returns the nearest beam in time, and everything that says why.
    ///
    /// # Errors
    /// When the number of ranges or the motion makes no sense.
    pub fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Nearest, Error> {
        let view = self.view(ranges, motion)?;
        let (best, confirmed) = view.best();
        Ok(view.nearest(best, confirmed))
    }

    /// Writes the time-to-collision of each beam into `out`, and what it means into `status_out`.
    ///
    /// # Errors
    /// When a length or the motion makes no sense.
    pub fn per_beam<'o, T: Range>(
        &self,
        ranges: Column<'_, T>,
        motion: Motion,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error> {
        let view = self.view(ranges, motion)?;
        self.check_outputs(out, status_out.as_deref())?;
        let (tables, velocity) = (&view.kernel().tables, view.exact.velocity);
        if let Some(pace) = Straight::new(tables, velocity) {
            view.per_beam(pace, out, status_out);
        } else {
            view.per_beam(Turning::new(tables, velocity), out, status_out);
        }
        Ok(())
    }

    /// Checks a motion, as every function that takes one does.
    ///
    /// # Errors
    /// When the motion makes no sense for this scanner.
    pub fn check_motion(&self, motion: Motion) -> Result<(), Error> {
        motion.sensor_velocity(self.settings.mount).map(|_| ())
    }

    /// Checks that an array has one entry for each beam.
    ///
    /// # Errors
    /// When it has not.
    #[inline(always)]
    pub fn check_beams(&self, argument: &'static str, got: usize) -> Result<(), Error> {
        one_entry_each(argument, got, self.settings.beams, "beams")
    }

    fn check_outputs<T: Copy>(
        &self,
        out: &ColumnMut<'_, T>,
        status_out: Option<&ColumnMut<'_, u8>>,
    ) -> Result<(), Error> {
        self.check_beams("out", out.len())?;
        status_out.map_or(Ok(()), |status_out| self.check_beams("status_out", status_out.len()))
    }

    /// Returns one scan in one motion, if both make sense.
    pub(crate) fn view<'a, T: Range>(&'a self, ranges: Column<'a, T>, motion: Motion) -> Result<View<'a, T>, Error> {
        Ok(self.moving(ranges, self.exact(ranges.len(), motion)?))
    }

    fn moving<'a, T: Range>(&'a self, ranges: Column<'a, T>, exact: ExactBeams<'a>) -> View<'a, T> {
        View { ranges, scan: self, exact }
    }

    /// Returns the beams in a motion, if it makes sense and there is a range for each.
    #[inline(always)]
    fn exact(&self, ranges: usize, motion: Motion) -> Result<ExactBeams<'_>, Error> {
        self.check_beams("ranges", ranges)?;
        let velocity = motion.sensor_velocity(self.settings.mount)?;
        Ok(ExactBeams { beams: &self.beams, velocity, min_closing_speed: self.settings.min_closing_speed })
    }
}

/// One scan in one motion, which all questions are asked of.
pub(crate) struct View<'a, T> {
    ranges: Column<'a, T>,
    scan: &'a ScanTtc,
    exact: ExactBeams<'a>,
}

impl<'a, T: Range> View<'a, T> {
    fn kernel(&self) -> &'a KernelTables<T> {
        T::kernel_tables(self.scan)
    }

    /// Returns the deciding beam, and whether the vote, if there is one, confirms it.
    fn best(&self) -> (Hit, bool) {
        match self.scan.settings.beam_vote {
            None => (first_hit(self.ranges, self.scan, self.exact), true),
            Some(beam_vote) => self.voted(beam_vote),
        }
    }

    /// Returns the beam that a vote elects. A vote computes every beam: it is for being right rather than fast.
    fn voted(&self, beam_vote: BeamVote) -> (Hit, bool) {
        let ttc = |index| Hit { ttc: self.exact.ttc(index, self.usable(index)), index };
        self.elected(beam_vote, (0..self.ranges.len()).map(ttc).filter(Hit::closes).collect())
    }

    /// Returns the beam that a vote elects among those that close.
    fn elected(&self, beam_vote: BeamVote, closing: Vec<Hit>) -> (Hit, bool) {
        let usable = |beam| if self.exact.beams.ignores(beam) { f64::NAN } else { self.usable(beam) };
        beam_vote.elect(closing, &self.scan.settings, usable)
    }

    /// Says why `best` decides.
    fn nearest(&self, best: Hit, confirmed: bool) -> Nearest {
        let counts = self.counts();
        let beam = self.deciding(best, &counts);
        let range = beam.map_or(f64::NAN, |beam| self.usable(beam));
        Nearest {
            ttc: best.ttc,
            status: self.status(best, confirmed, &counts),
            beam,
            angle: beam.map_or(f64::NAN, |beam| self.scan.settings.angle(beam)),
            range,
            clearance: beam.map_or(f64::NAN, |beam| self.clearance(beam, range)),
            closing_speed: beam.map_or(f64::NAN, |beam| self.exact.closing(beam)),
            counts,
        }
    }

    /// Returns the beam that decides: the best if it closes, else the first in contact, if there is one.
    pub(crate) fn deciding(&self, best: Hit, counts: &Counts) -> Option<usize> {
        if best.closes() {
            Some(best.index)
        } else if counts.contact > 0 {
            (0..self.ranges.len()).find(|beam| self.clearance(*beam, self.usable(*beam)) <= 0.0)
        } else {
            None
        }
    }

    fn status(&self, best: Hit, confirmed: bool, counts: &Counts) -> Status {
        let hit_too_close = self.scan.settings.too_close == TooClose::Hit && counts.too_close > 0;
        let there = counts.valid > 0 || hit_too_close;
        let far = counts.beyond_limits > 0;
        if counts.contact > 0 {
            Status::Contact
        } else if !confirmed {
            Status::TooFew
        } else if best.closes() {
            Status::Closing
        } else if there || (far && self.scan.settings.limits_policy == LimitsPolicy::Clamp) {
            Status::NotClosing
        } else if far || counts.no_return > 0 {
            Status::Clear
        } else {
            Status::NoData
        }
    }

    fn per_beam<'o>(&self, pace: impl Pace<T>, out: &mut ColumnMut<'o, T>, status_out: Option<&mut ColumnMut<'o, u8>>) {
        let KernelTables { tables, rules } = self.kernel();
        let (rules, offset, min_closing_speed) =
            (*rules, groups(&tables.offset), T::from_f64(self.exact.min_closing_speed));
        let ranges = self.ranges;
        // The times last: they may be written over the ranges.
        if let Some(status_out) = status_out {
            let out = status_out.reborrow();
            self.scan.level.run(Statuses { scan: Scan { ranges, rules, offset, pace, min_closing_speed }, out });
        }
        if let (Some(ranges), Some(out)) = (ranges.dense(), out.dense()) {
            self.scan.level.run(Times { scan: Scan { ranges, rules, offset, pace, min_closing_speed }, out });
        } else {
            let out = out.reborrow();
            Level::BASELINE.run(Times { scan: Scan { ranges, rules, offset, pace, min_closing_speed }, out });
        }
    }

    /// Counts how often each case of a reading occurs.
    pub(crate) fn counts(&self) -> Counts {
        match self.ranges.dense() {
            Some(ranges) => self.counts_of(self.scan.level, ranges),
            None => self.counts_of(Level::BASELINE, self.ranges),
        }
    }

    fn counts_of(&self, level: Level, ranges: impl Source<T>) -> Counts {
        let KernelTables { tables: Tables { offset_below, looking, .. }, rules } = self.kernel();
        let (rules, looking) = (*rules, *looking);
        level
            .run(CountReadings::<_, _, false> { ranges, rules, offset_below, looking })
            .or_else(|| level.run(CountReadings::<_, _, true> { ranges, rules, offset_below, looking }))
            .expect("the strict kernel counts any scan")
    }

    /// Whether any beam saw anything. Usually one of the first did.
    pub(crate) fn observes(&self) -> bool {
        (0..self.ranges.len())
            .any(|beam| !self.exact.beams.ignores(beam) && self.kernel().rules.observed(self.ranges.get(beam)))
    }

    /// The range of a beam to compute with, m; NaN without one.
    pub(crate) fn usable(&self, beam: usize) -> f64 {
        self.kernel().rules.usable(self.ranges.get(beam)).to_f64()
    }

    /// What is left of a range outside the outline, m.
    pub(crate) fn clearance(&self, beam: usize, range: f64) -> f64 {
        self.exact.clearance(beam, range)
    }
}
