//! When static points enter the moving vehicle: the exact first entry into its outline, in closed form.
//!
//! With speed and yaw rate constant, a static point moves on a circle about the instantaneous centre of rotation, seen
//! from the vehicle; on a line when the vehicle drives straight. [`frame`] is where points come from: a cloud, or the
//! beams of a scanner. [`sweep`] says when a point's path first meets the outline, how far the point is from it now,
//! and how fast that shrinks. [`search`] finds the point that is first, and computes exactly only the few points that
//! bounds do not rule out. [`planned`] does so for a path that is planned, instead of a motion that stays. A [`course`]
//! is one or the other.

mod course;
mod frame;
mod planned;
mod search;
mod sweep;

pub use {course::Course, planned::PlannedPath};
pub(crate) use {course::Way, frame::Frame, sweep::Sweep};

use crate::column::{Column, ColumnMut, by_layout};
use crate::error::{Error, duration, one_entry_each};
use crate::hit::{Counts, Hit};
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;
use crate::vehicle::Outline;
use frame::Planar;
use planned::Following;
use sweep::Approach;

/// The longest horizon, s.
const LONGEST: f64 = 1e6;

/// A vehicle's outline, and how far ahead it looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweptPath {
    outline: Outline,
    horizon: f64,
    level: Level,
}

/// The point that is hit first, and everything that says why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPoint {
    /// The least time until a point enters the outline, s.
    pub ttc: f64,
    /// What that time means.
    pub status: Status,
    /// The point that decided: the one of `ttc`, else the first in contact, else none.
    pub index: Option<usize>,
    /// Its x, m. Without a point it is NaN, as are `y`, `clearance` and `closing_speed`.
    pub x: f64,
    /// Its y, m.
    pub y: f64,
    /// The distance from the outline to the point, m; negative inside.
    pub clearance: f64,
    /// How fast the clearance shrinks now, m/s.
    pub closing_speed: f64,
    /// How many points are valid, invalid and in contact.
    pub counts: Counts,
}

impl SweptPath {
    /// Makes a swept path, to be computed at instruction-set level `level`.
    ///
    /// # Errors
    /// When the outline is no rectangle, or the horizon no time.
    pub fn new(outline: Outline, horizon: f64, level: Level) -> Result<Self, Error> {
        outline.checked()?;
        duration("horizon", horizon, LONGEST)?;
        Ok(SweptPath { outline, horizon, level })
    }

    /// The outline it was made with.
    #[must_use]
    pub fn outline(&self) -> Outline {
        self.outline
    }

    /// How far ahead it looks, s.
    #[must_use]
    pub fn horizon(&self) -> f64 {
        self.horizon
    }

    /// Makes the path that the vehicle will follow from points in its present frame, m.
    ///
    /// # Errors
    /// When there are fewer than two places among the points, one is not finite, the first is farther from the origin
    /// than the vehicle is long, or the path turns by 90 degrees or more at a point.
    pub fn plan(&self, points: &[[f64; 2]]) -> Result<PlannedPath, Error> {
        PlannedPath::new(self.outline, points)
    }

    /// Checks a course, as every function that takes one does.
    ///
    /// # Errors
    /// When the motion makes no sense for this outline, or the speed has another sign than the way that the path leads.
    pub fn check(&self, course: Course<'_>) -> Result<(), Error> {
        self.way(course).map(|_| ())
    }

    /// Returns the outline on a course, if that makes sense.
    pub(crate) fn way<'a>(&self, course: Course<'a>) -> Result<Way<'a>, Error> {
        let now = Sweep::new(self.outline, self.horizon, course.motion()?)?;
        Ok(match course {
            Course::Steady(_) => Way::Steady(now),
            Course::Planned(path, speed) => Way::Planned(Following::new(path, now, speed)),
        })
    }

    /// Returns the least time until one of the points of a row enters the outline, s; infinite when none does within
    /// the horizon, `None` when there is no valid point.
    ///
    /// # Errors
    /// When the course makes no sense.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn min<T: Real>(&self, points: &Points<'_, T>, row: usize, course: Course<'_>) -> Result<Option<f64>, Error> {
        let (way, points) = (self.way(course)?, Planar(points.xyz(row)));
        let best = by_layout!(points, |points| way.least(self.level, points));
        Ok((best.closes() || points.any_valid()).then_some(best.ttc))
    }

    /// Returns the point of a row that is hit first, and everything that says why.
    ///
    /// # Errors
    /// When the course makes no sense.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn nearest<T: Real>(
        &self,
        points: &Points<'_, T>,
        row: usize,
        course: Course<'_>,
    ) -> Result<NearestPoint, Error> {
        let (way, points) = (self.way(course)?, Planar(points.xyz(row)));
        let (best, counts) =
            by_layout!(points, |points| (way.least(self.level, points), points.count(self.level, self.outline)));
        Ok(why(points, way.now(), best, counts))
    }

    /// Writes the time until each point of a row enters the outline into `out`, and what it means into `status_out`.
    ///
    /// # Errors
    /// When a length or the course makes no sense.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn per_point<'o, T: Real>(
        &self,
        points: &Points<'_, T>,
        row: usize,
        course: Course<'_>,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error> {
        let (way, points) = (self.way(course)?, Planar(points.xyz(row)));
        check_outputs(points.len(), out, status_out.as_deref())?;
        by_layout!(points, |points| way.each(self.level, points, out, status_out));
        Ok(())
    }
}

fn check_outputs<T: Copy>(
    points: usize,
    out: &ColumnMut<'_, T>,
    status_out: Option<&ColumnMut<'_, u8>>,
) -> Result<(), Error> {
    one_entry_each("out", out.len(), points, "points")?;
    status_out.map_or(Ok(()), |status_out| one_entry_each("status_out", status_out.len(), points, "points"))
}

/// Says why `best` decides.
fn why<T: Real>(points: Planar<Column<'_, T>>, sweep: &Sweep, best: Hit, counts: Counts) -> NearestPoint {
    let index = if best.closes() {
        Some(best.index)
    } else if counts.contact > 0 {
        points.first_inside(sweep)
    } else {
        None
    };
    let [x, y] = index.map_or([f64::NAN; 2], |index| points.point(index));
    let Approach { clearance, closing_speed } = sweep.approach([x, y]);
    NearestPoint { ttc: best.ttc, status: status(best, counts), index, x, y, clearance, closing_speed, counts }
}

fn status(best: Hit, counts: Counts) -> Status {
    if counts.contact > 0 {
        Status::Contact
    } else if best.closes() {
        Status::Closing
    } else if counts.valid > 0 {
        Status::NotClosing
    } else {
        Status::NoData
    }
}

#[cfg(test)]
mod tests {
    use super::SweptPath;
    use crate::Status;
    use crate::column::{Column, ColumnMut, Table};
    use crate::points::Points;
    use crate::real::Real;
    use crate::simd::Level;
    use crate::vehicle::{Motion, Outline};

    const CAR: Outline = Outline { x_rear: -0.1, x_front: 0.4, y_right: -0.15, y_left: 0.15 };

    fn plane<'a>(x: &'a [f32], y: &'a [f32]) -> Points<'a, f32> {
        let table = |column| Table::new(Column::new(column));
        Points::batch([table(x), table(y), table(x)]).unwrap()
    }

    #[test]
    fn min_nearest_and_per_point_agree_at_every_level() {
        let place = |i: u16| (f32::from(i * 37 % 501) / 50.0 - 5.0, f32::from(i * 101 % 499) / 50.0 - 5.0);
        let (x, y): (Vec<f32>, Vec<f32>) = (0..200).map(place).unzip();
        let points = plane(&x, &y);
        for (speed, yaw_rate) in [(2.0, 0.0), (-2.0, 0.3), (0.0, 1.5), (3.0, 1e-16), (0.0, 0.0)] {
            let motion = Motion { speed, yaw_rate, lateral_speed: 0.0 }.into();
            let mut said = vec![];
            for level in Level::all() {
                let path = SweptPath::new(CAR, 2.0, level).unwrap();
                let mut times = [0.0_f32; 200];
                path.per_point(&points, 0, motion, &mut ColumnMut::new(&mut times), None).unwrap();
                let nearest = path.nearest(&points, 0, motion).unwrap();
                assert_eq!(path.min(&points, 0, motion).unwrap(), Some(nearest.ttc));
                assert_eq!(times.into_iter().fold(f32::INFINITY, f32::min), f32::from_f64(nearest.ttc));
                assert!(nearest.ttc.is_infinite() || times[nearest.index.unwrap()] == f32::from_f64(nearest.ttc));
                said.push((nearest.ttc.to_bits(), nearest.index));
            }
            assert!(said.iter().all(|each| *each == said[0]), "{said:?}");
        }
    }

    #[test]
    fn what_is_refused() {
        let path = SweptPath::new(CAR, 5.0, Level::BASELINE).unwrap();
        let (x, y) = ([1.0_f32, 2.0], [0.0_f32; 2]);
        let mut short = [0.0_f32; 1];
        let out = &mut ColumnMut::new(&mut short);
        assert_eq!(path.per_point(&plane(&x, &y), 0, Motion::default().into(), out, None).unwrap_err().argument, "out");
        let spinning = Motion { yaw_rate: 4e8, ..Motion::default() };
        assert_eq!(path.check(spinning.into()).unwrap_err().argument, "yaw_rate");
        assert!(SweptPath::new(CAR, f64::INFINITY, Level::BASELINE).is_err());
        assert!(SweptPath::new(Outline { x_front: 1e7, ..CAR }, 5.0, Level::BASELINE).is_err());
        assert_eq!(path.nearest(&plane(&[], &[]), 0, Motion::default().into()).unwrap().status, Status::NoData);
    }
}
