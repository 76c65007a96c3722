//! What a number in `ranges` means (REP 117, `sensor_msgs/LaserScan`), and how often each case occurs.

use super::settings::{LimitsPolicy, Settings, TooClose};
use crate::column::Source;
use crate::hit::Counts;
use crate::lanes::{LANES, Lanes, lanes, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, alone};

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

    /// Whether no range to compute with is so large that a bound on its time could overflow.
    #[inline(always)]
    pub(super) fn is_bounded(&self) -> bool {
        self.usable_max < T::from_f64(1e20)
    }

    /// The range to compute with: a valid reading, moved into the user's limits if they clamp; NaN where there is none.
    #[inline(always)]
    pub(crate) fn usable(&self, r: T) -> T {
        self.clamped(self.valid(r))
    }

    /// The range to compute with of a reading that is not -inf, where limits do not clamp: fewer steps, one after the other.
    #[inline(always)]
    pub(super) fn ordinary(&self, r: T) -> T {
        if (r >= self.range_min) & (r <= self.usable_max) { r } else { T::NAN }
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

/// Counts every case of a scan. Unless it is `STRICT`, it returns nothing where readings are clamped or -inf.
///
/// There is no branch that depends on an ordinary scan: where a reading is odd, no processor can guess. The kernel counts
/// sets of readings that hold one another, and their differences are the cases.
pub(super) struct CountReadings<'a, T, S, const STRICT: bool> {
    pub ranges: S,
    pub rules: Rules<T>,
    /// The largest range of each beam that is in contact; NaN where the beam is ignored.
    pub offset_below: &'a [T],
    /// The number of beams that are not ignored.
    pub looking: u32,
}

impl<T: Real, S: Source<T>, const STRICT: bool> Kernel for CountReadings<'_, T, S, STRICT> {
    type Output = Option<Counts>;
    const AVX512: bool = !STRICT;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Option<Counts> {
        let beams = self.ranges.len();
        let whole = beams / LANES * LANES;
        let (mut counts, mut least_reading) = ([0; 6], [T::INFINITY; LANES]);
        for at in (0..whole).step_by(LANES) {
            self.count(simd, &mut counts, &mut least_reading, at, self.ranges.lanes(at));
        }
        if whole < beams {
            self.count(simd, &mut counts, &mut least_reading, whole, self.ranges.lanes_or(whole, T::NAN));
        }
        if !STRICT && (self.rules.clamps() || T::at_most(simd, &least_reading, T::ZERO - T::INFINITY) != 0) {
            return None;
        }
        let [numbers, finite, in_range, valid, contact, too_close] = counts;
        Some(Counts {
            valid,
            invalid: self.looking - numbers,
            too_close,
            no_return: numbers - finite,
            out_of_range: finite - too_close - in_range,
            beyond_limits: in_range - valid,
            masked: u32::try_from(beams).expect("settings bound the number of beams") - self.looking,
            contact,
        })
    }
}

impl<T: Real, S, const STRICT: bool> CountReadings<'_, T, S, STRICT> {
    /// Adds the number of readings of a group that are in each set.
    #[inline(always)]
    fn count<I: Instructions>(
        &self,
        simd: I,
        counts: &mut [u32; 6],
        least_reading: &mut Lanes<T>,
        at: usize,
        readings: Lanes<T>,
    ) {
        let rules = self.rules;
        let offset = *window(self.offset_below, at); // a copy: what lies behind a reference is read where a lane needs it
        // An ignored beam has no clearance; otherwise that is infinite only where the reading is.
        let clearance = lanes(|lane| readings[lane] - offset[lane]);
        let (numbers, finite) = (T::at_most(simd, &clearance, T::INFINITY), T::at_most(simd, &clearance, T::MAX));
        let in_range = numbers & rules.within(simd, &readings, rules.range_max);
        let valid = if rules.far_limit < rules.range_max {
            in_range & rules.within(simd, &readings, rules.far_limit)
        } else {
            in_range
        };
        let mut sets = [numbers, finite, in_range, valid, valid & T::at_most(simd, &clearance, T::ZERO), 0];
        if STRICT {
            let clearance = lanes(|lane| rules.usable(readings[lane]) - offset[lane]);
            sets[4] = T::at_most(simd, &clearance, T::ZERO);
            sets[5] = numbers & T::at_most(simd, &readings, T::ZERO - T::INFINITY);
        } else {
            T::keep_least(simd, least_reading, &readings);
        }
        for (count, set) in counts.iter_mut().zip(sets) {
            *count += alone(set.count_ones());
        }
    }
}
