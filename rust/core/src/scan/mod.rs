//! Instantaneous time-to-collision (iTTC) over the beams of a planar laser scanner.
//!
//! For each beam, iTTC is the clearance along it divided by the speed at which the sensor moves along it. The
//! parts: [`geometry`] says where beams point and how far the vehicle's outline is along them, [`tables`]
//! keeps that in the forms the kernels read, [`reading`] says what a number in `ranges` means, [`bound`] says between what an
//! iTTC must lie, [`search`] finds the least, [`vote`] says which beam counts, [`per_beam`] computes them all. [`swept`] asks of the same beams which is hit
//! first.

mod bound;
mod formula;
mod geometry;
mod per_beam;
pub mod range_rate;
mod reading;
mod search;
mod swept;
mod tables;
mod vote;

pub(crate) use {formula::ttc, vote::Best};
pub use {
    geometry::{Mount, Outline},
    reading::{Counts, LimitsPolicy, TooClose},
    swept::ScanSweptPath,
    vote::{Minimum, Neighbours},
};
use {
    per_beam::{Pace, Scan, Statuses, Times},
    reading::{Census, Rules},
    search::first_hit,
    tables::{Beams, Exact, Tables},
};

use crate::column::{Column, ColumnMut};
use crate::error::{Error, finite, non_negative};
use crate::lanes::groups;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;

/// A sensor whose beams span more than this is more likely described in degrees, rad.
const WIDEST_VIEW: f64 = 4.0 * std::f64::consts::PI;

/// More beams than any scanner has, so that tables fit in memory and counts in 32 bits.
const MOST_BEAMS: usize = 1 << 22;

/// No vehicle is faster than light, m/s. Keeps every product far from overflow.
const FASTEST: f64 = 299_792_458.0;

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
    pub minimum: Option<Minimum>,
}

/// Motion of the vehicle's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Forward, m/s; negative when reversing.
    pub speed: f64,
    /// Counter-clockwise, rad/s.
    pub yaw_rate: f64,
    /// To the left, m/s.
    pub lateral_speed: f64,
}

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
    single: Prepared<f32>,
    double: Prepared<f64>,
}

#[derive(Clone, Debug)]
struct Prepared<T> {
    tables: Tables<T>,
    rules: Rules<T>,
}

/// A type that ranges can have.
pub trait Range: Real {
    #[doc(hidden)]
    #[allow(private_interfaces, reason = "the trait is closed: only this file implements it")]
    fn prepared(scan: &ScanTtc) -> &Prepared<Self>;
}

impl Range for f32 {
    #[allow(private_interfaces, reason = "as in the trait")]
    fn prepared(scan: &ScanTtc) -> &Prepared<f32> {
        &scan.single
    }
}

impl Range for f64 {
    #[allow(private_interfaces, reason = "as in the trait")]
    fn prepared(scan: &ScanTtc) -> &Prepared<f64> {
        &scan.double
    }
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
            minimum: None,
        }
    }

    fn check(&self) -> Result<(), Error> {
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
                return Err(Error::new(argument, format!("has the angle {angle}; angles are in radians, not degrees")));
            }
        }
        let view = self.angle_increment.abs() * (self.beams - 1) as f64;
        if view > WIDEST_VIEW {
            return Err(Error::new(
                "angle_increment",
                format!("spans {view:.1} rad over {} beams; angles are in radians, not degrees", self.beams),
            ));
        }
        non_negative("range_min", self.range_min)?;
        if self.range_min > FARTHEST {
            let got = self.range_min;
            return Err(Error::new("range_min", format!("must be below {FARTHEST:e} m, got {got}")));
        }
        if self.range_max.is_nan() || self.range_max <= self.range_min {
            let (low, high) = (self.range_min, self.range_max);
            return Err(Error::new("range_max", format!("must be above range_min = {low}, got {high}")));
        }
        if let Some((near, far)) = self.limits
            && !(near >= 0.0 && near < far)
        {
            return Err(Error::new("limits", format!("must be (near, far) with 0 <= near < far, got ({near}, {far})")));
        }
        if let Some((_, far)) = self.limits
            && far <= self.range_min
        {
            let low = self.range_min;
            return Err(Error::new(
                "limits",
                format!("end at {far}, not beyond range_min = {low}: no reading could ever count"),
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
        self.minimum.map(Minimum::checked).transpose()?;
        Ok(())
    }

    /// Direction of each beam in the sensor frame, rad.
    #[must_use]
    pub fn angles(&self) -> impl ExactSizeIterator<Item = f64> + Clone {
        (0..self.beams).map(|beam| self.angle(beam))
    }

    fn angle(&self, beam: usize) -> f64 {
        self.angle_min + self.angle_increment * beam as f64
    }
}

impl Motion {
    /// Velocity of the sensor in the vehicle frame: v + omega x p.
    #[inline(always)]
    pub(crate) fn of_sensor(self, mount: Mount) -> Result<(f64, f64), Error> {
        finite("speed", self.speed)?;
        finite("yaw_rate", self.yaw_rate)?;
        finite("lateral_speed", self.lateral_speed)?;
        let velocity = (self.speed - self.yaw_rate * mount.y, self.lateral_speed + self.yaw_rate * mount.x);
        if velocity.0.abs() < FASTEST && velocity.1.abs() < FASTEST {
            Ok(velocity)
        } else {
            Err(self.too_fast(velocity))
        }
    }

    #[cold]
    fn too_fast(self, (vx, vy): (f64, f64)) -> Error {
        let argument = if self.speed.abs() >= FASTEST {
            "speed"
        } else if self.lateral_speed.abs() >= FASTEST {
            "lateral_speed"
        } else {
            "yaw_rate"
        };
        Error::new(argument, format!("moves the sensor faster than light, at ({vx}, {vy}) m/s"))
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
            single: Prepared::new(&settings, &beams),
            double: Prepared::new(&settings, &beams),
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
    /// With [`Settings::minimum`], what the vote says; where too few beams close for a vote, the plain least.
    ///
    /// # Errors
    /// When the number of ranges or the motion makes no sense.
    #[inline(always)]
    pub fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error> {
        let exact = self.exact(ranges.len(), motion)?;
        let best = match self.settings.minimum {
            None => first_hit(self.level, ranges, T::prepared(self), exact),
            Some(minimum) => self.moving(ranges, exact).voted(minimum).0,
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
    fn moving<'a, T: Range>(&'a self, ranges: Column<'a, T>, exact: Exact<'a>) -> View<'a, T> {
        View {
            ranges,
            prepared: T::prepared(self),
            exact,
            level: self.level,
            minimum: self.settings.minimum,
            mount: self.settings.mount,
        }
    }

    /// The beams in a motion, if it makes sense and there is a range for each.
    #[inline(always)]
    fn exact(&self, ranges: usize, motion: Motion) -> Result<Exact<'_>, Error> {
        self.check_beams("ranges", ranges)?;
        let velocity = motion.of_sensor(self.settings.mount)?;
        Ok(Exact { beams: &self.beams, velocity, min_closing_speed: self.settings.min_closing_speed })
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
    fn nearest_of<T: Real>(&self, view: &View<'_, T>, best: Best, supported: bool) -> Nearest {
        let counts = view.counts();
        let beam = if best.ttc < f64::INFINITY {
            Some(best.beam)
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

    fn status(&self, best: Best, supported: bool, counts: &Counts) -> Status {
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

impl<T: Real> Prepared<T> {
    fn new(settings: &Settings, beams: &Beams) -> Self {
        let sensor = (settings.range_min, settings.range_max);
        Prepared {
            tables: Tables::new(beams, settings.beams),
            rules: Rules::new(sensor, settings.limits, settings.limits_policy, settings.too_close),
        }
    }
}

/// One scan in one motion.
struct View<'a, T> {
    ranges: Column<'a, T>,
    prepared: &'a Prepared<T>,
    exact: Exact<'a>,
    level: Level,
    minimum: Option<Minimum>,
    mount: Mount,
}

impl<T: Real> View<'_, T> {
    /// The deciding beam, and whether a vote (if one was asked for) confirmed it.
    fn best(&self) -> (Best, bool) {
        match self.minimum {
            None => (first_hit(self.level, self.ranges, self.prepared, self.exact), true),
            Some(minimum) => self.voted(minimum),
        }
    }

    /// The vote is for those who would rather be right than fast: every beam is computed.
    fn voted(&self, minimum: Minimum) -> (Best, bool) {
        self.elected(minimum, self.closing())
    }

    /// The beam among those that close that a vote elects, or the first of them where it elects none.
    fn elected(&self, minimum: Minimum, closing: Vec<Best>) -> (Best, bool) {
        let usable = |beam| if self.exact.beams.ignores(beam) { f64::NAN } else { self.usable(beam) };
        vote::elect(minimum, closing, self.ranges.len(), usable)
    }

    /// Every beam that closes.
    fn closing(&self) -> Vec<Best> {
        let ttc = |beam| Best { ttc: self.exact.ttc(beam, self.usable(beam)), beam };
        (0..self.ranges.len()).map(ttc).filter(Best::closes).collect()
    }

    fn per_beam<'o>(&self, pace: impl Pace<T>, out: &mut ColumnMut<'o, T>, status_out: Option<&mut ColumnMut<'o, u8>>) {
        let Prepared { tables, rules } = self.prepared;
        let (rules, offset, min_closing_speed) = (*rules, groups(&tables.offset), T::of(self.exact.min_closing_speed));
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

    fn counts(&self) -> Counts {
        let Prepared { tables, rules } = self.prepared;
        match self.ranges.dense() {
            Some(ranges) => self.level.run(Census { ranges, rules: *rules, tables }),
            None => self.level.run(Census { ranges: self.ranges, rules: *rules, tables }),
        }
    }

    /// Whether any beam saw anything. Usually one of the first did.
    fn observes(&self) -> bool {
        (0..self.ranges.len())
            .any(|beam| !self.exact.beams.ignores(beam) && self.prepared.rules.observed(self.ranges.get(beam)))
    }

    fn usable(&self, beam: usize) -> f64 {
        self.prepared.rules.usable(self.ranges.get(beam)).wide()
    }

    fn first_contact(&self) -> Option<usize> {
        (0..self.ranges.len()).find(|beam| self.exact.clearance(*beam, self.usable(*beam)) <= 0.0)
    }
}
