//! Which beam's point is hit first: the swept path of [`crate::path`] over the beams of a scanner.

use super::field_of_view::{FieldOfView, widest};
use super::readings::Rules;
use super::tables::{ExactBeams, KernelTables, Tables};
use super::{Nearest, Range, ScanTtc, View};
use crate::column::{Column, ColumnMut, Source, by_layout};
use crate::error::{Error, non_negative};
use crate::hit::Hit;
use crate::lanes::{Lanes, window};
use crate::path::{Course, Frame, PlannedPath, Sweep, SweptPath, Way};
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use crate::vehicle::Motion;

/// A scanner, and how far ahead it looks. Beams, validity and limits are the scanner's, the outline is its vehicle's.
#[derive(Clone, Debug)]
pub struct ScanSweptPath {
    scan: ScanTtc,
    path: SweptPath,
    view: FieldOfView,
}

impl ScanSweptPath {
    /// Makes the swept path of a scanner's vehicle.
    ///
    /// # Errors
    /// When the scanner has no outline, or the horizon is no time.
    pub fn new(scan: ScanTtc, horizon: f64) -> Result<Self, Error> {
        let outline = scan.settings.outline.ok_or_else(|| {
            Error::new("scan", "must have an outline: ScanTTC(..., outline=(x_rear, x_front, y_right, y_left))")
        })?;
        let path = SweptPath::new(outline, horizon, scan.level)?;
        let view = FieldOfView::new(&scan.settings, &scan.beams);
        Ok(ScanSweptPath { scan, path, view })
    }

    /// The scanner.
    #[must_use]
    pub fn scan(&self) -> &ScanTtc {
        &self.scan
    }

    /// How far ahead it looks, s.
    #[must_use]
    pub fn horizon(&self) -> f64 {
        self.path.horizon()
    }

    /// Makes the path that the vehicle will follow from points in its present frame, m.
    ///
    /// # Errors
    /// As [`SweptPath::plan`].
    pub fn plan(&self, points: &[[f64; 2]]) -> Result<PlannedPath, Error> {
        self.path.plan(points)
    }

    /// Checks a course, as every function that takes one does.
    ///
    /// # Errors
    /// When the motion makes no sense for the scanner or its outline, or the speed has another sign than the way that
    /// the path leads.
    pub fn check(&self, course: Course<'_>) -> Result<(), Error> {
        self.scan.check_motion(course.motion()?)?;
        self.path.check(course)
    }

    /// Returns the least time until the point of a beam enters the outline, s; `None` when nothing valid was observed.
    ///
    /// # Errors
    /// When the number of ranges or the course makes no sense.
    pub fn min<T: Range>(&self, ranges: Column<'_, T>, course: Course<'_>) -> Result<Option<f64>, Error> {
        let (view, way) = self.view(ranges, course)?;
        let (best, _) = view.first(&way);
        Ok((best.closes() || view.observes()).then_some(best.ttc))
    }

    /// Returns the beam whose point is hit first, and everything that says why.
    ///
    /// # Errors
    /// When the number of ranges or the course makes no sense.
    pub fn nearest<T: Range>(&self, ranges: Column<'_, T>, course: Course<'_>) -> Result<Nearest, Error> {
        let (view, way) = self.view(ranges, course)?;
        let (best, confirmed) = view.first(&way);
        Ok(view.nearest(best, confirmed))
    }

    /// Writes the time until the point of each beam enters the outline into `out`, and what it means into `status_out`.
    ///
    /// # Errors
    /// When a length or the course makes no sense.
    pub fn per_beam<'o, T: Range>(
        &self,
        ranges: Column<'_, T>,
        course: Course<'_>,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error> {
        let (view, way) = self.view(ranges, course)?;
        self.scan.check_outputs(out, status_out.as_deref())?;
        match ranges.dense() {
            Some(ranges) => way.each(self.scan.level, view.beams(ranges), out, status_out),
            None => way.each(Level::BASELINE, view.beams(ranges), out, status_out),
        }
        Ok(())
    }

    /// Returns how wide the widest part of the path is at which no beam looks, neither of this scanner nor of others,
    /// m. Each part has to be seen at the time `ahead`, s, before the vehicle gets there.
    ///
    /// # Errors
    /// When the motion or the time makes no sense.
    pub fn unseen<'a>(
        &self,
        motion: Motion,
        ahead: f64,
        others: impl IntoIterator<Item = &'a ScanSweptPath>,
    ) -> Result<f64, Error> {
        self.check(motion.into())?;
        let (outline, ahead) = (self.path.outline(), non_negative("ahead", ahead)?);
        let unseen = |view: &FieldOfView| view.unseen(outline, motion, ahead);
        let by_none = others.into_iter().fold(unseen(&self.view), |by_none, other| by_none & unseen(&other.view));
        Ok(widest(by_none, outline, motion))
    }

    fn view<'a, T: Range>(
        &'a self,
        ranges: Column<'a, T>,
        course: Course<'a>,
    ) -> Result<(View<'a, T>, Way<'a>), Error> {
        Ok((self.scan.view(ranges, course.motion()?)?, self.path.way(course)?))
    }
}

impl<T: Range> View<'_, T> {
    fn beams<S: Source<T>>(&self, ranges: S) -> Beams<'_, T, S> {
        let (KernelTables { tables, rules }, mount) = (self.kernel(), self.scan.settings.mount);
        Beams { ranges, tables, rules, exact: self.exact, mount: (mount.x, mount.y) }
    }

    /// Returns the deciding beam, and whether the vote, if there is one, confirms it.
    fn first(&self, way: &Way<'_>) -> (Hit, bool) {
        let (level, vote) = (self.scan.level, self.scan.settings.beam_vote);
        by_layout!(self.ranges, |ranges| match vote {
            None => (way.least(level, self.beams(ranges)), true),
            Some(vote) => self.elected(vote, way.entering(level, self.beams(ranges))),
        })
    }
}

/// The beams of one scan, as points in the vehicle frame.
#[derive(Clone, Copy)]
struct Beams<'a, T, S> {
    ranges: S,
    tables: &'a Tables<T>,
    rules: &'a Rules<T>,
    exact: ExactBeams<'a>,
    mount: (f64, f64),
}

impl<T: Real, S: Source<T>> Beams<'_, T, S> {
    #[inline(always)]
    fn range(&self, beam: usize) -> f64 {
        self.rules.usable(self.ranges.lanes::<1>(beam)[0]).to_f64()
    }
}

impl<T: Real, S: Source<T>> Frame<T> for Beams<'_, T, S> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.ranges.len()
    }

    #[inline(always)]
    fn lanes(&self, at: usize) -> [Lanes<T>; 2] {
        let whole = at + crate::lanes::LANES <= self.len();
        let ranges: Lanes<T> = if whole { self.ranges.lanes(at) } else { self.ranges.lanes_or(at, T::NAN) };
        let (cos, sin) = (window(&self.tables.cos, at), window(&self.tables.sin, at));
        let offset = window(&self.tables.offset, at);
        let (x, y) = (T::from_f64(self.mount.0), T::from_f64(self.mount.1));
        let range: Lanes<T> = std::array::from_fn(|lane| {
            let usable = self.rules.usable(ranges[lane]);
            if offset[lane] >= T::ZERO { usable } else { T::NAN }
        });
        [
            std::array::from_fn(|lane| x + range[lane] * cos[lane]),
            std::array::from_fn(|lane| y + range[lane] * sin[lane]),
        ]
    }

    #[inline(always)]
    fn error(&self, reach: f64) -> f64 {
        T::SLACK.to_f64() * (reach + self.mount.0.abs() + self.mount.1.abs())
    }

    #[inline(always)]
    fn point(&self, beam: usize) -> [f64; 2] {
        let (range, ExactBeams { beams, .. }) = (self.range(beam), self.exact);
        if beams.ignores(beam) {
            return [f64::NAN; 2];
        }
        [self.mount.0 + range * beams.cos[beam], self.mount.1 + range * beams.sin[beam]]
    }

    #[inline(always)]
    fn touches(&self, beam: usize) -> bool {
        // Where the sensor is outside the outline, a reading of 0 touches the sensor, which may be anywhere.
        self.exact.beams.offset[beam] > 0.0 && self.exact.clearance(beam, self.range(beam)) <= 0.0
    }

    #[inline(always)]
    fn origin(&self) -> [f64; 2] {
        [self.mount.0, self.mount.1]
    }

    fn status(&self, beam: usize, _: &Sweep) -> Status {
        let range = self.range(beam);
        if self.exact.beams.ignores(beam) {
            Status::NoData
        } else if self.exact.clearance(beam, range) <= 0.0 {
            Status::Contact
        } else if !range.is_nan() {
            Status::NotClosing
        } else if self.rules.observed(self.ranges.lanes::<1>(beam)[0]) {
            Status::Clear
        } else {
            Status::Invalid
        }
    }
}
