//! What the range rate of each beam means: a time-to-collision and a status.
//!
//! A beam closes if its closing speed is above the least that counts, and above enough of its standard errors that
//! noise does not explain it. The time is then the clearance over that speed.

use super::fit::{LineFit, Rates};
use super::history::{GROUP, Group, Past, group};
use crate::column::{ColumnMut, Source};
use crate::real::Real;
use crate::scan::Rules;
use crate::simd::{Instructions, Kernel};
use crate::status::Status;

/// Arrays to write what is known of each beam to.
#[derive(Default)]
pub struct Outputs<'o, T> {
    /// The range rates, m/s; NaN where unknown.
    pub range_rate: Option<ColumnMut<'o, T>>,
    /// The standard errors of the range rates, m/s; NaN where unknown.
    pub standard_error: Option<ColumnMut<'o, T>>,
    /// The statuses.
    pub status: Option<ColumnMut<'o, u8>>,
}

impl<T: Real> Outputs<'_, T> {
    /// Writes that nothing is known, because the scan makes no sense.
    pub(super) fn fill_invalid(&mut self, beams: usize) {
        for at in (0..beams).step_by(GROUP) {
            for out in [&mut self.range_rate, &mut self.standard_error].into_iter().flatten() {
                out.set_lanes(at, [T::NAN; GROUP]);
            }
            if let Some(out) = self.status.as_mut() {
                out.set_lanes(at, [Status::Invalid as u8; GROUP]);
            }
        }
    }
}

/// Fits a line to every beam, and says what its slope means.
pub(super) struct Classify<'a, 'o, T, S> {
    pub ranges: S,
    pub rules: Rules<T>,
    pub offset: &'a [f64],
    pub newest: &'a [f64],
    pub past: &'a [Past<'a>],
    pub line_fit: LineFit,
    pub least: Least,
    pub beams: &'a mut Beams,
    pub outputs: &'a mut Outputs<'o, T>,
}

/// What a closing speed must exceed to count.
#[derive(Clone, Copy)]
pub(super) struct Least {
    /// A number of its standard errors.
    pub significance: f64,
    /// A speed, m/s.
    pub closing_speed: f64,
}

/// What is known of each beam, in whole groups.
#[derive(Clone, Debug, Default)]
pub(super) struct Beams {
    /// The range rates, m/s; NaN where unknown.
    pub range_rate: Vec<f64>,
    /// The standard errors of the range rates, m/s; NaN where unknown.
    pub standard_error: Vec<f64>,
    /// The times-to-collision, s; infinite where nothing closes.
    pub ttc: Vec<f64>,
}

impl Beams {
    pub(super) fn new(beams: usize) -> Self {
        let unknown = vec![f64::NAN; beams.next_multiple_of(GROUP)];
        Beams { range_rate: unknown.clone(), standard_error: unknown.clone(), ttc: unknown }
    }
}

/// How many beams have a range rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coverage {
    /// The number of beams with a range rate.
    pub rated: u32,
    /// The number of beams with a clearance and no range rate.
    pub unrated: u32,
    /// The least clearance of the latter, m; infinite without one.
    pub nearest_unrated: f64,
}

impl<T: Real, S: Source<T>> Kernel for Classify<'_, '_, T, S> {
    type Output = Coverage;

    #[inline(always)]
    fn run<I: Instructions>(mut self, _: I) -> Coverage {
        let mut coverage = LaneCoverage { rated: [0; GROUP], unrated: [0; GROUP], nearest: [f64::INFINITY; GROUP] };
        let whole = self.ranges.len() / GROUP * GROUP;
        for at in (0..whole).step_by(GROUP) {
            self.group(at, self.ranges.lanes(at), &mut coverage);
        }
        if whole < self.ranges.len() {
            self.group(whole, self.ranges.lanes_or(whole, T::NAN), &mut coverage);
        }
        Coverage {
            rated: coverage.rated.iter().sum(),
            unrated: coverage.unrated.iter().sum(),
            nearest_unrated: coverage.nearest.into_iter().fold(f64::INFINITY, f64::min),
        }
    }
}

/// The coverage of each lane.
struct LaneCoverage {
    rated: [u32; GROUP],
    unrated: [u32; GROUP],
    nearest: Group,
}

impl<T: Real, S> Classify<'_, '_, T, S> {
    #[inline(always)]
    fn group(&mut self, at: usize, ranges: [T; GROUP], coverage: &mut LaneCoverage) {
        let Rates { range_rate, standard_error } = self.line_fit.fit(self.newest, self.past, at);
        let offset = group(self.offset, at);
        let (mut clearance, mut ttc) = ([f64::NAN; GROUP], [f64::INFINITY; GROUP]);
        let mut closes = [false; GROUP];
        for i in 0..GROUP {
            let free = self.rules.usable(ranges[i]).to_f64() - offset[i];
            let closing = -range_rate[i];
            let counts = (closing > self.least.closing_speed) & (closing > self.least.significance * standard_error[i]);
            let time = if free > 0.0 { free / closing } else { 0.0 };
            ttc[i] = if counts { time } else { f64::INFINITY };
            (clearance[i], closes[i]) = (free, counts);
        }
        for i in 0..GROUP {
            let known = !range_rate[i].is_nan();
            let unrated = !clearance[i].is_nan() & !known;
            let nearer = unrated & (clearance[i] < coverage.nearest[i]);
            coverage.rated[i] += u32::from(known);
            coverage.unrated[i] += u32::from(unrated);
            coverage.nearest[i] = if nearer { clearance[i] } else { coverage.nearest[i] };
        }
        self.beams.range_rate[at..at + GROUP].copy_from_slice(&range_rate);
        self.beams.standard_error[at..at + GROUP].copy_from_slice(&standard_error);
        self.beams.ttc[at..at + GROUP].copy_from_slice(&ttc);
        if let Some(out) = self.outputs.range_rate.as_mut() {
            out.set_lanes(at, range_rate.map(T::from_f64));
        }
        if let Some(out) = self.outputs.standard_error.as_mut() {
            out.set_lanes(at, standard_error.map(T::from_f64));
        }
        if let Some(out) = self.outputs.status.as_mut() {
            let each: [u8; GROUP] = std::array::from_fn(|lane| {
                let status = if offset[lane].is_nan() {
                    Status::NoData
                } else if clearance[lane] <= 0.0 {
                    Status::Contact
                } else if closes[lane] {
                    Status::Closing
                } else if !range_rate[lane].is_nan() {
                    Status::NotClosing
                } else if clearance[lane] > 0.0 {
                    Status::WarmingUp
                } else if self.rules.observed(ranges[lane]) {
                    Status::Clear
                } else {
                    Status::Invalid
                };
                status as u8
            });
            out.set_lanes(at, each);
        }
    }
}
