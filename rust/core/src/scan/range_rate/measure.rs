//! What a scan measured, to be compared with what later scans measure.

use super::history::{GROUP, Group, group};
use crate::column::Source;
use crate::real::Real;
use crate::scan::reading::Rules;
use crate::simd::{Instructions, Kernel};

/// Writes the usable readings of a scan into `memory`, in whole groups; NaN where there is none.
///
/// A reading of -inf is none: it says that something is nearer than `range_min`, not where.
pub(super) struct Measure<'a, T, S> {
    pub ranges: S,
    pub rules: Rules<T>,
    /// NaN where a beam is ignored.
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
