//! The scans that a rate is fitted to, in the directions in which the beams point now.
//!
//! [`Measure`] takes from a scan what it measured. [`History`] keeps that for the last scans. As the vehicle turns, a
//! beam looks where other beams looked before: [`Turned`] computes what an old scan would have measured along the beams
//! of now.

use super::settings::MOST_SCANS;
use crate::column::Source;
use crate::real::Real;
use crate::scan::{Rules, ScanTtc};
use crate::simd::{Instructions, Kernel};
use std::collections::VecDeque;

/// The number of beams that a kernel works on at once. It is large enough for compilers to keep loops over them, which
/// they turn into lanes better than straight code of this length, and small enough for all sums of them to stay near
/// the processor.
pub(super) const GROUP: usize = 64;

/// One group of beams.
pub(super) type Group = [f64; GROUP];

/// Returns the group of readings `at ..` of a padded scan.
#[inline(always)]
pub(super) fn group(readings: &[f64], at: usize) -> &Group {
    readings[at..].first_chunk().expect("readings are padded to whole groups")
}

/// Writes the usable readings of a scan into `memory`, in whole groups; NaN where there is none.
///
/// A reading of -inf is none of them: it says that something is nearer than `range_min`, not where.
pub(super) struct Measure<'a, T, S> {
    pub ranges: S,
    pub rules: Rules<T>,
    /// The distance from the sensor to the outline along each beam, m; NaN where a beam is ignored.
    pub offset: &'a [f64],
    pub memory: Vec<f64>,
}

impl<T: Real, S: Source<T>> Kernel for Measure<'_, T, S> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<I: Instructions>(mut self, _: I) -> Vec<f64> {
        let beams = self.ranges.len();
        let whole = beams / GROUP * GROUP;
        self.memory.resize(beams.next_multiple_of(GROUP), f64::NAN);
        for at in (0..whole).step_by(GROUP) {
            self.group(at, self.ranges.lanes(at));
        }
        if whole < beams {
            self.group(whole, self.ranges.lanes_or(whole, T::NAN));
        }
        self.memory
    }
}

impl<T: Real, S> Measure<'_, T, S> {
    #[inline(always)]
    fn group(&mut self, at: usize, ranges: [T; GROUP]) {
        let offset = group(self.offset, at);
        let mut readings: Group = [f64::NAN; GROUP];
        for i in 0..GROUP {
            let measured = (ranges[i] > T::ZERO - T::INFINITY) & !offset[i].is_nan();
            readings[i] = if measured { self.rules.usable(ranges[i]).to_f64() } else { f64::NAN };
        }
        self.memory[at..at + GROUP].copy_from_slice(&readings);
    }
}

/// A scan that is remembered.
#[derive(Clone, Debug)]
pub(super) struct Remembered {
    /// When it was taken, s.
    pub stamp: f64,
    /// How far the vehicle had turned since the first of all scans, rad.
    pub heading: f64,
    /// What was measured, m; NaN where nothing was, and in the padding.
    pub readings: Vec<f64>,
}

/// What the last scans measured, the newest first.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    scans: VecDeque<Remembered>,
    spare: Option<Vec<f64>>,
}

impl History {
    pub(super) fn newest(&self) -> Option<&Remembered> {
        self.scans.front()
    }

    /// Goes through the scans from the newest to the oldest.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &Remembered> + ExactSizeIterator {
        self.scans.iter()
    }

    /// Forgets what is older than `window` at `stamp`, and enough for one more to be one of at most [`MOST_SCANS`].
    pub(super) fn forget(&mut self, stamp: f64, window: f64) {
        while self.scans.back().is_some_and(|scan| stamp - scan.stamp > window || self.scans.len() >= MOST_SCANS) {
            self.spare = self.scans.pop_back().map(|scan| scan.readings);
        }
    }

    /// Returns empty memory for the readings of the next scan.
    pub(super) fn memory(&mut self) -> Vec<f64> {
        let mut readings = self.spare.take().unwrap_or_default();
        readings.clear();
        readings
    }

    /// Takes back memory that was not needed.
    pub(super) fn spare(&mut self, readings: Vec<f64>) {
        self.spare = Some(readings);
    }

    /// The stamp of the oldest scan since which nothing has changed, s; infinite without a scan.
    pub(super) fn unchanged_since(&self) -> f64 {
        let Some(newest) = self.newest() else { return f64::INFINITY };
        let same = self.scans.iter().take_while(|scan| looks_like(&scan.readings, &newest.readings));
        same.last().map_or(newest.stamp, |scan| scan.stamp)
    }

    pub(super) fn remember(&mut self, scan: Remembered) {
        self.scans.push_front(scan);
    }

    pub(super) fn clear(&mut self) {
        self.scans.clear();
    }
}

/// Whether two scans measured the same numbers; NaN is the same as NaN, and -0 the same as 0.
pub(super) fn looks_like(one: &[f64], other: &[f64]) -> bool {
    one.iter().zip(other).all(|(one, other)| one == other || (one.is_nan() && other.is_nan()))
}

/// An earlier scan, in the directions in which the beams point now.
#[derive(Clone, Copy)]
pub(super) struct Past<'a> {
    /// How long before the newest scan it was taken, s.
    pub age: f64,
    /// What it measured, m, in whole groups; NaN where nothing was.
    pub readings: &'a [f64],
}

/// Returns all scans but the newest, the newer first, in the directions in which the beams point now.
pub(super) fn past<'a>(history: &'a History, turned: &'a mut Vec<f64>, scan: &ScanTtc, edge: f64) -> Vec<Past<'a>> {
    let mut scans = history.iter();
    let Some(newest) = scans.next() else { return vec![] };
    let length = newest.readings.len();
    turned.resize(length * MOST_SCANS, f64::NAN);
    let mut rooms = turned.chunks_exact_mut(length);
    let settings = &scan.settings;
    scans
        .filter_map(|old| {
            let angle = newest.heading - old.heading;
            let age = newest.stamp - old.stamp;
            if angle == 0.0 {
                return Some(Past { age, readings: &old.readings });
            }
            let turn = Turn::new(angle, settings.angle_increment, settings.beams)?;
            let out = rooms.next()?;
            scan.level.run(Turned { readings: &old.readings, turn, edge, out: &mut *out });
            Some(Past { age, readings: out })
        })
        .collect()
}

/// How far the beams have turned since a scan: by a number of whole beams, and part of one.
#[derive(Clone, Copy)]
struct Turn {
    whole: isize,
    part: f64,
}

impl Turn {
    /// Makes a turn by an angle, rad; `None` when no beam of now looks where one looked then.
    fn new(turned: f64, increment: f64, beams: usize) -> Option<Self> {
        let shift = turned / increment;
        let whole = shift.floor();
        #[allow(clippy::cast_possible_truncation, reason = "a whole number, not above the number of beams")]
        (shift.abs() <= beams as f64).then_some(Turn { whole: whole as isize, part: shift - whole })
    }
}

/// Writes what a scan measured where the beams point now. A beam of now lies between two beams of then: where their
/// readings are on one surface, it takes a reading from the line between them; where they differ by more than `edge`,
/// the reading of the closer beam; where the scan did not look, NaN.
struct Turned<'a> {
    readings: &'a [f64],
    turn: Turn,
    edge: f64,
    out: &'a mut [f64],
}

impl Kernel for Turned<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        let Turn { whole, part } = self.turn;
        for (at, out) in self.out.chunks_exact_mut(GROUP).enumerate() {
            let at = (at * GROUP).cast_signed() + whole;
            let (first, second) = (anywhere(self.readings, at), anywhere(self.readings, at + 1));
            let between: Group = std::array::from_fn(|lane| {
                let apart = second[lane] - first[lane];
                let nearer = if part < 0.5 { first[lane] } else { second[lane] };
                if apart.abs() <= self.edge { first[lane] + part * apart } else { nearer }
            });
            out.copy_from_slice(&between);
        }
    }
}

/// Returns the readings from `at`, and NaN where that is outside the scan.
#[inline(always)]
fn anywhere(readings: &[f64], at: isize) -> Group {
    let reading = |at: isize| usize::try_from(at).ok().and_then(|at| readings.get(at).copied()).unwrap_or(f64::NAN);
    let inside = usize::try_from(at).ok().and_then(|at| readings.get(at..)?.first_chunk());
    inside.copied().unwrap_or_else(|| std::array::from_fn(|lane| reading(at + lane.cast_signed())))
}
