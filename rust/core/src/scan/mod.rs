//! Instantaneous time-to-collision (iTTC) over the beams of a planar laser scanner.
//!
//! For each beam, iTTC is the clearance along it divided by the speed at which the sensor moves along it. The
//! parts: [`settings`] and [`motion`] are what a caller says, [`geometry`] knows where beams point and how far the vehicle's
//! outline is along them, [`tables`] keeps that in the forms the kernels read, [`reading`] says what a number in `ranges` means,
//! [`bound`] between what an iTTC must lie, [`search`] finds the least, [`vote`] says which beam counts, [`per_beam`] computes them
//! all, and a [`view`] is one scan that all this is asked of. [`swept`] asks of the same beams which is hit first.

mod bound;
mod formula;
mod geometry;
mod motion;
mod per_beam;
mod prepared;
pub mod range_rate;
mod reading;
mod search;
mod settings;
mod swept;
mod tables;
mod view;
mod vote;

pub(crate) use {formula::ttc, vote::Hit};
pub use {
    geometry::{Mount, Outline},
    motion::Motion,
    reading::{Counts, LimitsPolicy, TooClose},
    settings::Settings,
    swept::ScanSweptPath,
    vote::{BeamVote, Neighbours},
};
use {
    prepared::KernelTables,
    search::first_hit,
    tables::{Beams, ExactBeams},
    view::View,
};

use crate::column::{Column, ColumnMut};
use crate::error::Error;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;

/// The nearest beam in time, and everything that says why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
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
    /// Speed of the sensor along the beam, m/s.
    pub closing_speed: f64,
    /// How often each case of a reading occurred.
    pub counts: Counts,
}

/// A planar laser scanner on a vehicle. Immutable, and usable from many threads.
#[derive(Clone, Debug)]
pub struct ScanTtc {
    settings: Settings,
    level: Level,
    beams: Beams,
    single: KernelTables<f32>,
    double: KernelTables<f64>,
}

/// A type that ranges can have.
pub trait Range: Real {
    #[doc(hidden)]
    #[allow(private_interfaces, reason = "the trait is closed: only this file implements it")]
    fn prepared(scan: &ScanTtc) -> &KernelTables<Self>;
}

impl Range for f32 {
    #[allow(private_interfaces, reason = "as in the trait")]
    fn prepared(scan: &ScanTtc) -> &KernelTables<f32> {
        &scan.single
    }
}

impl Range for f64 {
    #[allow(private_interfaces, reason = "as in the trait")]
    fn prepared(scan: &ScanTtc) -> &KernelTables<f64> {
        &scan.double
    }
}

impl ScanTtc {
    /// Prepare the tables for a scanner, to be used at instruction-set level `level`.
    ///
    /// # Errors
    /// When a setting makes no sense.
    pub fn new(settings: Settings, level: Level) -> Result<Self, Error> {
        settings.check()?;
        let beams = Beams::new(settings.angles(), settings.mount, settings.outline, settings.mask.as_deref());
        Ok(ScanTtc {
            single: KernelTables::new(&settings, &beams),
            double: KernelTables::new(&settings, &beams),
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

    /// Least time-to-collision, s, or `None` when nothing valid was observed.
    ///
    /// With [`Settings::beam_vote`], what the vote says; where too few beams close for a vote, the plain least.
    ///
    /// # Errors
    /// When the number of ranges or the motion makes no sense.
    #[inline(always)]
    pub fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error> {
        let exact = self.exact(ranges.len(), motion)?;
        let best = match self.settings.beam_vote {
            None => first_hit(self.level, ranges, T::prepared(self), exact),
            Some(beam_vote) => self.moving(ranges, exact).voted(beam_vote).0,
        };
        Ok((best.closes() || self.moving(ranges, exact).observes()).then_some(best.ttc))
    }

    /// The nearest beam in time, and everything that says why.
    ///
    /// # Errors
    /// When the number of ranges or the motion makes no sense.
    pub fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Nearest, Error> {
        let view = self.view(ranges, motion)?;
        let (best, supported) = view.best();
        Ok(self.nearest_of(&view, best, supported))
    }

    /// Time-to-collision of each beam into `out`, and what it means into `status_out`.
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
        let (tables, velocity) = (&view.prepared.tables, view.exact.velocity);
        if let Some(pace) = per_beam::Straight::new(tables, velocity) {
            view.per_beam(pace, out, status_out);
        } else {
            view.per_beam(per_beam::Turning::new(tables, velocity), out, status_out);
        }
        Ok(())
    }

    /// Whether a motion makes sense for this scanner. Those that take a motion check it too.
    ///
    /// # Errors
    /// When it does not.
    pub fn check_motion(&self, motion: Motion) -> Result<(), Error> {
        motion.of_sensor(self.settings.mount).map(|_| ())
    }

    fn view<'a, T: Range>(&'a self, ranges: Column<'a, T>, motion: Motion) -> Result<View<'a, T>, Error> {
        Ok(self.moving(ranges, self.exact(ranges.len(), motion)?))
    }

    /// One scan in a motion that makes sense.
    fn moving<'a, T: Range>(&'a self, ranges: Column<'a, T>, exact: ExactBeams<'a>) -> View<'a, T> {
        View {
            ranges,
            prepared: T::prepared(self),
            exact,
            level: self.level,
            beam_vote: self.settings.beam_vote,
            mount: self.settings.mount,
        }
    }

    /// The beams in a motion, if it makes sense and there is a range for each.
    #[inline(always)]
    fn exact(&self, ranges: usize, motion: Motion) -> Result<ExactBeams<'_>, Error> {
        self.check_beams("ranges", ranges)?;
        let velocity = motion.of_sensor(self.settings.mount)?;
        Ok(ExactBeams { beams: &self.beams, velocity, min_closing_speed: self.settings.min_closing_speed })
    }

    /// Whether an array has one entry for each beam.
    ///
    /// # Errors
    /// When it has not.
    #[inline(always)]
    pub fn check_beams(&self, argument: &'static str, got: usize) -> Result<(), Error> {
        if got == self.settings.beams { Ok(()) } else { Err(self.wrong_length(argument, got)) }
    }

    #[cold]
    fn wrong_length(&self, argument: &'static str, got: usize) -> Error {
        let beams = self.settings.beams;
        Error::new(argument, format!("must have one entry for each of the {beams} beams, got {got}"))
    }

    /// Everything that says why `best` decides.
    fn nearest_of<T: Real>(&self, view: &View<'_, T>, best: Hit, supported: bool) -> Nearest {
        let counts = view.counts();
        let beam = if best.ttc < f64::INFINITY {
            Some(best.index)
        } else if counts.contact > 0 {
            view.first_contact()
        } else {
            None
        };
        let range = beam.map_or(f64::NAN, |beam| view.usable(beam));
        Nearest {
            ttc: best.ttc,
            status: self.status(best, supported, &counts),
            beam,
            angle: beam.map_or(f64::NAN, |beam| self.settings.angle(beam)),
            range,
            clearance: beam.map_or(f64::NAN, |beam| view.exact.clearance(beam, range)),
            closing_speed: beam.map_or(f64::NAN, |beam| view.exact.closing(beam)),
            counts,
        }
    }

    fn check_outputs<T: Copy>(
        &self,
        out: &ColumnMut<'_, T>,
        status_out: Option<&ColumnMut<'_, u8>>,
    ) -> Result<(), Error> {
        self.check_beams("out", out.len())?;
        status_out.map_or(Ok(()), |status_out| self.check_beams("status_out", status_out.len()))
    }

    fn status(&self, best: Hit, supported: bool, counts: &Counts) -> Status {
        let hit_too_close = self.settings.too_close == TooClose::Hit && counts.too_close > 0;
        let there = counts.valid > 0 || hit_too_close;
        let far = counts.beyond_limits > 0;
        if counts.contact > 0 {
            Status::Contact
        } else if !supported {
            Status::TooFew
        } else if best.ttc < f64::INFINITY {
            Status::Closing
        } else if there || (far && self.settings.limits_policy == LimitsPolicy::Clamp) {
            Status::NotClosing
        } else if far || counts.no_return > 0 {
            Status::Clear
        } else {
            Status::NoData
        }
    }
}
