//! The time-to-collision and the status of every beam, in the type of the ranges.
//!
//! A [`Pace`] gives closing speeds, and the times that clearances last at them: by a table of `1 / cos` when the sensor
//! moves straight ahead or back, else by division. [`Scan`] makes times and statuses of a group of beams, [`Times`] and
//! [`Statuses`] write them.

use super::readings::Rules;
use super::tables::Tables;
use crate::column::{Sink, Source};
use crate::formula::finish_ttc;
use crate::lanes::{LANES, Lanes, each, groups, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};
use crate::status::Status;

/// Closing speeds of beams, and how long clearances last at them.
pub(super) trait Pace<T>: Copy {
    /// Returns the closing speeds of the beams of a group.
    fn closing(&self, group: usize) -> Lanes<T>;
    /// Returns clearance over closing speed, where that speed is positive.
    fn times(&self, group: usize, clearance: &Lanes<T>, closing: &Lanes<T>) -> Lanes<T>;
    /// Returns a number not above the least closing speed of a group of beams, and one not below the largest.
    fn extremes(&self, group: usize) -> (T, T);
    /// Cuts the tables to the first groups, so that an index below their number need not be checked again.
    #[must_use]
    fn first(self, groups: usize) -> Self;
}

/// The pace of a sensor that moves along the vehicle's x axis. A multiplication takes a fraction of a division's time.
#[derive(Clone, Copy)]
pub(super) struct Straight<'a, T> {
    cos: &'a [Lanes<T>],
    inverse: &'a [Lanes<T>],
    extremes: &'a [(T, T)],
    speed: T,
    per_speed: T,
}

impl<'a, T: Real> Straight<'a, T> {
    /// Makes one if the velocity is along the x axis, and no product with `1 / velocity` can overflow or lose digits.
    pub(super) fn new(tables: &'a Tables<T>, (vx, vy): (f64, f64)) -> Option<Self> {
        let Tables { cos, inverse, extremes, .. } = tables;
        let (cos, inverse) = (groups(cos), groups(inverse));
        let straight = Straight { cos, inverse, extremes, speed: T::from_f64(vx), per_speed: T::from_f64(1.0 / vx) };
        (vy == 0.0 && (1e-3..1e6).contains(&vx.abs())).then_some(straight)
    }
}

impl<T: Real> Pace<T> for Straight<'_, T> {
    #[inline(always)]
    fn closing(&self, group: usize) -> Lanes<T> {
        let cos = &self.cos[group];
        lanes(|lane| self.speed * cos[lane])
    }

    #[inline(always)]
    fn times(&self, group: usize, clearance: &Lanes<T>, _: &Lanes<T>) -> Lanes<T> {
        let inverse = &self.inverse[group];
        lanes(|lane| clearance[lane] * (inverse[lane] * self.per_speed))
    }

    #[inline(always)]
    fn extremes(&self, group: usize) -> (T, T) {
        let (low, high) = self.extremes[group];
        let (first, second) = (self.speed * low, self.speed * high);
        if first < second { (first, second) } else { (second, first) }
    }

    #[inline(always)]
    fn first(self, groups: usize) -> Self {
        let Straight { cos, inverse, extremes, .. } = self;
        Straight { cos: &cos[..groups], inverse: &inverse[..groups], extremes: &extremes[..groups], ..self }
    }
}

/// The pace of any motion.
#[derive(Clone, Copy)]
pub(super) struct Turning<'a, T> {
    cos: &'a [Lanes<T>],
    sin: &'a [Lanes<T>],
    velocity: (T, T),
}

impl<'a, T: Real> Turning<'a, T> {
    pub(super) fn new(tables: &'a Tables<T>, (vx, vy): (f64, f64)) -> Self {
        let (cos, sin) = (groups(&tables.cos), groups(&tables.sin));
        Turning { cos, sin, velocity: (T::from_f64(vx), T::from_f64(vy)) }
    }
}

impl<T: Real> Pace<T> for Turning<'_, T> {
    #[inline(always)]
    fn closing(&self, group: usize) -> Lanes<T> {
        let (cos, sin) = (&self.cos[group], &self.sin[group]);
        lanes(|lane| self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane])
    }

    #[inline(always)]
    fn times(&self, _: usize, clearance: &Lanes<T>, closing: &Lanes<T>) -> Lanes<T> {
        lanes(|lane| clearance[lane] / closing[lane])
    }

    #[inline(always)]
    fn extremes(&self, _: usize) -> (T, T) {
        (T::ZERO - T::INFINITY, T::INFINITY)
    }

    #[inline(always)]
    fn first(self, groups: usize) -> Self {
        Turning { cos: &self.cos[..groups], sin: &self.sin[..groups], ..self }
    }
}

/// One scan at one pace, which both kernels read. It holds all by value: what lies behind a reference is read again
/// after every write to memory that is not known to be apart from it.
#[derive(Clone, Copy)]
pub(super) struct Scan<'a, T, S, P> {
    pub ranges: S,
    pub rules: Rules<T>,
    pub offset: &'a [Lanes<T>],
    pub pace: P,
    pub min_closing_speed: T,
}

impl<T: Real, S: Source<T>, P: Pace<T>> Scan<'_, T, S, P> {
    /// Cuts the tables to the groups of its ranges.
    #[inline(always)]
    fn trimmed(self) -> Self {
        let groups = self.ranges.len().div_ceil(LANES);
        Scan { offset: &self.offset[..groups], pace: self.pace.first(groups), ..self }
    }

    /// Returns the times of a group. Most groups lie ahead, where all beams close, or behind, where none does.
    #[inline(always)]
    fn times(&self, group: usize, ranges: Lanes<T>, clamps: bool) -> Lanes<T> {
        let (slowest, fastest) = self.pace.extremes(group);
        let all_close = slowest > self.min_closing_speed;
        if !all_close && fastest <= self.min_closing_speed {
            return [T::INFINITY; LANES];
        }
        let offset = &self.offset[group];
        let rules = self.rules;
        let usable = if clamps { each(ranges, |r| rules.usable(r)) } else { each(ranges, |r| rules.valid(r)) };
        let clearance = lanes(|lane| usable[lane] - offset[lane]);
        if all_close {
            let times = self.pace.times(group, &clearance, &[T::INFINITY; LANES]);
            lanes(|lane| finish_ttc(times[lane], clearance[lane], T::INFINITY, T::ZERO))
        } else {
            let closing = self.pace.closing(group);
            let times = self.pace.times(group, &clearance, &closing);
            lanes(|lane| finish_ttc(times[lane], clearance[lane], closing[lane], self.min_closing_speed))
        }
    }

    /// Returns the statuses of a group.
    #[inline(always)]
    fn statuses(&self, group: usize, ranges: Lanes<T>) -> Lanes<u8> {
        let offset = &self.offset[group];
        let clearance = lanes(|lane| self.rules.usable(ranges[lane]) - offset[lane]);
        let closing = self.pace.closing(group);
        lanes(|lane| {
            let (looked, seen) = (!offset[lane].is_nan(), self.rules.observed(ranges[lane]));
            status(clearance[lane], closing[lane] > self.min_closing_speed, looked, seen) as u8
        })
    }
}

/// Writes one time-to-collision for each beam.
pub(super) struct Times<'a, T, S, P, W> {
    pub scan: Scan<'a, T, S, P>,
    pub out: W,
}

impl<T: Real, S: Source<T>, P: Pace<T>, W: Sink<T>> Kernel for Times<'_, T, S, P, W> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        if self.scan.rules.clamps() { self.write(true) } else { self.write(false) }
    }
}

impl<T: Real, S: Source<T>, P: Pace<T>, W: Sink<T>> Times<'_, T, S, P, W> {
    /// Writes all times. Each call is compiled for a `clamps` that is known: whether readings are moved into limits.
    #[inline(always)]
    fn write(self, clamps: bool) {
        let (scan, mut out) = (self.scan.trimmed(), self.out);
        let whole = scan.ranges.len() / LANES;
        for group in 0..whole {
            let at = group * LANES;
            out.put(at, scan.times(group, scan.ranges.lanes(at), clamps));
        }
        if whole * LANES < scan.ranges.len() {
            let at = whole * LANES;
            out.put_last(at, scan.times(whole, scan.ranges.lanes_or(at, T::NAN), clamps));
        }
    }
}

/// Writes one status for each beam.
pub(super) struct Statuses<'a, T, S, P, W> {
    pub scan: Scan<'a, T, S, P>,
    pub out: W,
}

impl<T: Real, S: Source<T>, P: Pace<T>, W: Sink<u8>> Kernel for Statuses<'_, T, S, P, W> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        let (scan, mut out) = (self.scan.trimmed(), self.out);
        let whole = scan.ranges.len() / LANES;
        for group in 0..whole {
            let at = group * LANES;
            out.put(at, scan.statuses(group, scan.ranges.lanes(at)));
        }
        if whole * LANES < scan.ranges.len() {
            let at = whole * LANES;
            out.put_last(at, scan.statuses(whole, scan.ranges.lanes_or(at, T::NAN)));
        }
    }
}

#[inline(always)]
fn status<T: Real>(clearance: T, closes: bool, looked: bool, seen: bool) -> Status {
    if !looked {
        Status::NoData
    } else if clearance <= T::ZERO {
        Status::Contact
    } else if clearance > T::ZERO {
        if closes { Status::Closing } else { Status::NotClosing }
    } else if seen {
        Status::Clear
    } else {
        Status::Invalid
    }
}

#[cfg(test)]
mod tests {
    use crate::column::{Column, ColumnMut};
    use crate::scan::{ScanTtc, Settings};
    use crate::simd::Level;
    use crate::vehicle::{Motion, Outline};

    /// Beams point ahead, across and behind, so that all, none or some beams of a group close. The slow ones do not
    /// count, and a reading inside the outline has time 0 only where the beam closes.
    #[test]
    fn groups_that_close_in_part_are_decided_beam_by_beam() {
        let outline = Some(Outline { x_rear: -1.0, x_front: 1.0, y_right: -1.0, y_left: 1.0 });
        let settings = Settings { outline, min_closing_speed: 0.5, ..Settings::new(0.0, 0.03, 100) };
        let ranges: Vec<f32> = (0..100).map(|beam| if beam % 3 == 0 { 0.5 } else { 5.0 }).collect();
        for (level, speed) in Level::all().into_iter().flat_map(|level| [(level, 2.0), (level, -2.0)]) {
            let scan = ScanTtc::new(settings.clone(), level).unwrap();
            let mut times = vec![f32::NAN; 100];
            let motion = Motion { speed, ..Motion::default() };
            scan.per_beam(Column::new(&ranges), motion, &mut ColumnMut::new(&mut times), None).unwrap();
            for (beam, (angle, time)) in settings.angles().zip(times).enumerate() {
                let closes = speed * angle.cos() > 0.5;
                let expected = (closes, time == 0.0, time.is_finite());
                assert_eq!(expected, (closes, closes && beam % 3 == 0, closes), "{level}, {speed} m/s, beam {beam}");
            }
        }
    }
}
