//! What a number in `ranges` means (REP 117, `sensor_msgs/LaserScan`), and how often each case occurs.

use super::settings::{LimitsPolicy, Settings, TooClose};
use crate::column::Source;
use crate::hit::Counts;
use crate::lanes::{LANES, Lanes, lanes, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};

/// The rules by which readings count, with bounds rounded to the type of the ranges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules<T> {
    /// The end of the sensor's range that is near.
    pub range_min: T,
    /// The end of the sensor's range that is far.
    range_max: T,
    /// The user's far limit; infinite without limits.
    far_limit: T,
    /// The interval that readings are moved into; from 0 to infinity where limits do not clamp.
    pub clamp: (T, T),
    /// The range that -inf counts as; NaN where it is ignored.
    too_close: T,
    /// The largest range to compute with before clamping.
    usable_max: T,
}

impl<T: Real> Rules<T> {
    pub(super) fn new(settings: &Settings) -> Self {
        let (range_min, range_max) = (T::from_f64(settings.range_min), T::from_f64(settings.range_max));
        let limits = settings.limits.map(|(near, far)| (T::from_f64(near), T::from_f64(far)));
        let (near, far) = limits.unwrap_or((T::ZERO, T::INFINITY));
        let clamps = settings.limits_policy == LimitsPolicy::Clamp;
        let farthest = if clamps || range_max < far { range_max } else { far };
        Rules {
            range_min,
            range_max,
            far_limit: far,
            clamp: if clamps { (near, far) } else { (T::ZERO, T::INFINITY) },
            too_close: match settings.too_close {
                TooClose::Hit => range_min,
                TooClose::Ignore => T::NAN,
            },
            usable_max: if farthest < T::MAX { farthest } else { T::MAX },
        }
    }

    /// Whether readings are moved into the user's limits.
    pub(super) fn clamps(&self) -> bool {
        self.clamp.1 < T::INFINITY || self.clamp.0 > T::ZERO
    }

    /// The range to compute with: a valid reading, moved into the user's limits if they clamp; NaN where there is none.
    #[inline(always)]
    pub(crate) fn usable(&self, r: T) -> T {
        self.clamped(self.valid(r))
    }

    /// The valid reading before it is moved into the user's limits; NaN where there is none.
    #[inline(always)]
    pub(super) fn valid(&self, r: T) -> T {
        let r = if r == T::ZERO - T::INFINITY { self.too_close } else { r };
        let r = if r >= self.range_min { r } else { T::NAN };
        if r <= self.usable_max { r } else { T::NAN }
    }

    #[inline(always)]
    fn clamped(&self, r: T) -> T {
        let r = if r < self.clamp.0 { self.clamp.0 } else { r };
        if r > self.clamp.1 { self.clamp.1 } else { r }
    }

    /// A bit for each lane that is finite, not below `range_min` and not above `farthest`.
    #[inline(always)]
    fn within<I: Instructions>(&self, simd: I, ranges: &Lanes<T>, farthest: T) -> u16 {
        let farthest = if farthest < T::MAX { farthest } else { T::MAX };
        T::within(simd, ranges, &[self.range_min; LANES], &[farthest; LANES])
    }

    /// Whether the sensor saw anything at all: a reading within its range, or free space.
    #[inline(always)]
    pub(crate) fn observed(&self, r: T) -> bool {
        let too_close = r == T::ZERO - T::INFINITY;
        let hit = too_close & !self.too_close.is_nan();
        hit | (r == T::INFINITY) | ((r >= self.range_min) & (r <= self.range_max))
    }
}

/// Counts every case of a scan.
pub(super) struct CountReadings<'a, T, S> {
    pub ranges: S,
    pub rules: Rules<T>,
    /// The largest range of each beam that is in contact; NaN where the beam is ignored.
    pub offset_below: &'a [T],
}

impl<T: Real, S: Source<T>> Kernel for CountReadings<'_, T, S> {
    type Output = Counts;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Counts {
        let beams = self.ranges.len();
        let whole = beams / LANES * LANES;
        let mut counts = Counts::default();
        for at in (0..whole).step_by(LANES) {
            self.count(simd, &mut counts, at, &self.ranges.lanes(at), u16::MAX);
        }
        if whole < beams {
            let there = u16::MAX >> (whole + LANES - beams);
            self.count(simd, &mut counts, whole, &self.ranges.lanes_or(whole, T::NAN), there);
        }
        counts
    }
}

impl<T: Real, S> CountReadings<'_, T, S> {
    /// Counts the readings of a group that are `there`. Most groups are ordinary: all are valid, none is in contact.
    #[inline(always)]
    fn count<I: Instructions>(&self, simd: I, counts: &mut Counts, at: usize, ranges: &Lanes<T>, there: u16) {
        let Rules { range_max, far_limit, .. } = self.rules;
        let is_limited = far_limit < range_max;
        let farthest = if is_limited { far_limit } else { range_max };
        let offset = window(self.offset_below, at);
        let valid = self.rules.within(simd, ranges, farthest);
        let outside = lanes(|lane| ranges[lane] - offset[lane]);
        let outside = T::within(simd, &outside, &[T::ZERO.above(); LANES], &[T::INFINITY; LANES]);
        if valid & outside == u16::MAX {
            counts.valid += there.count_ones();
            return;
        }
        let minus_infinity = T::ZERO - T::INFINITY;
        let looked = T::within(simd, offset, &[minus_infinity; LANES], &[T::INFINITY; LANES]);
        let finite = T::within(simd, ranges, &[T::ZERO - T::MAX; LANES], &[T::MAX; LANES]);
        let no_return = T::within(simd, ranges, &[T::INFINITY; LANES], &[T::INFINITY; LANES]);
        let too_close = T::within(simd, ranges, &[minus_infinity; LANES], &[minus_infinity; LANES]);
        let in_range = if is_limited { self.rules.within(simd, ranges, range_max) } else { valid };
        let contact = if too_close != 0 || self.rules.clamps() {
            let clearance = lanes(|lane| self.rules.usable(ranges[lane]) - offset[lane]);
            T::within(simd, &clearance, &[minus_infinity; LANES], &[T::ZERO; LANES])
        } else {
            valid & !outside
        };

        let number = |bits: u16| (bits & looked & there).count_ones();
        counts.valid += number(valid);
        counts.invalid += number(!(finite | no_return | too_close));
        counts.too_close += number(too_close);
        counts.no_return += number(no_return);
        counts.out_of_range += number(finite & !in_range);
        counts.beyond_limits += number(in_range & !valid);
        counts.masked += (!looked & there).count_ones();
        counts.contact += number(contact);
    }
}
