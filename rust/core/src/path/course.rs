//! How a vehicle goes on from now: it keeps its motion, or follows a path that is planned.

use super::frame::Frame;
use super::planned::{Following, PlannedPath};
use super::search;
use super::sweep::Sweep;
use crate::column::ColumnMut;
use crate::error::Error;
use crate::hit::Hit;
use crate::real::Real;
use crate::simd::Level;
use crate::vehicle::Motion;

/// How a vehicle goes on from now.
#[derive(Clone, Copy, Debug)]
pub enum Course<'a> {
    /// It keeps its motion.
    Steady(Motion),
    /// It follows a path at a speed, m/s, negative when reversing.
    Planned(&'a PlannedPath, f64),
}

impl From<Motion> for Course<'_> {
    fn from(motion: Motion) -> Self {
        Course::Steady(motion)
    }
}

impl Course<'_> {
    /// Returns how the vehicle moves now.
    pub(crate) fn motion(self) -> Result<Motion, Error> {
        match self {
            Course::Steady(motion) => Ok(motion),
            Course::Planned(path, speed) => path.motion(speed),
        }
    }
}

/// The outline on a course: what tells when points enter.
pub(crate) enum Way<'a> {
    Steady(Sweep),
    Planned(Following<'a>),
}

impl Way<'_> {
    /// The present motion.
    pub(super) fn now(&self) -> &Sweep {
        match self {
            Way::Steady(sweep) => sweep,
            Way::Planned(following) => &following.now,
        }
    }

    /// Returns the point that is hit first.
    pub(crate) fn least<T: Real>(&self, level: Level, frame: impl Frame<T>) -> Hit {
        match self {
            Way::Steady(sweep) => search::least(level, frame, sweep),
            Way::Planned(following) => following.least(level, frame),
        }
    }

    /// Returns every point that is hit.
    pub(crate) fn entering<T: Real>(&self, level: Level, frame: impl Frame<T>) -> Vec<Hit> {
        match self {
            Way::Steady(sweep) => search::entering(level, frame, sweep),
            Way::Planned(following) => following.entering(level, frame),
        }
    }

    /// Writes the times of all points into `out`, and what they mean into `status_out`.
    pub(crate) fn each<'o, T: Real>(
        &self,
        level: Level,
        frame: impl Frame<T>,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) {
        match self {
            Way::Steady(sweep) => search::each(level, frame, sweep, out, status_out),
            Way::Planned(following) => following.each(level, frame, out, status_out),
        }
    }
}
