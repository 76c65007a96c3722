//! What a number in `ranges` means (REP 117, `sensor_msgs/LaserScan`).

use super::tables::Tables;
use crate::column::Source;
use crate::real::Real;
use crate::simd::{Instructions, Kernel};

/// What a reading of -inf, an object nearer than `range_min`, counts as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TooClose {
    /// A hit at `range_min`.
    #[default]
    Hit,
    /// Nothing: the literal "ignore infinities".
    Ignore,
}

/// What the user's limits do to a valid reading outside them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LimitsPolicy {
    /// Beyond the far limit is out of the horizon and never the cause; below the near limit is kept as it is.
    #[default]
    Horizon,
    /// Readings are clamped into the limits, literally.
    Clamp,
}

/// How often each case occurred in one scan. Every beam is counted once in the first seven; `contact` is apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Valid readings within the user's limits.
    pub valid: u32,
    /// NaN.
    pub invalid: u32,
    /// -inf: an object nearer than `range_min`.
    pub too_close: u32,
    /// +inf: observed free space.
    pub no_return: u32,
    /// Finite and outside the sensor's `[range_min, range_max]`: discarded.
    pub out_of_range: u32,
    /// Valid readings beyond the user's far limit.
    pub beyond_limits: u32,
    /// Ignored because of `mask`, or because the beam looks at the vehicle itself.
    pub masked: u32,
    /// Readings inside the outline.
    pub contact: u32,
}

/// The rules, with bounds rounded to the type of the ranges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules<T> {
    range_min: T,
    range_max: T,
    far_limit: T,
    clamp: (T, T),
    too_close: T,
    usable_max: T,
}

impl<T: Real> Rules<T> {
    pub(super) fn new(
        (range_min, range_max): (f64, f64),
        limits: Option<(f64, f64)>,
        policy: LimitsPolicy,
        too_close: TooClose,
    ) -> Self {
        let (near, far) = limits.map_or((T::ZERO, T::INFINITY), |(near, far)| (T::of(near), T::of(far)));
        let clamps = policy == LimitsPolicy::Clamp;
        let range_max = T::of(range_max);
        let farthest = if clamps || range_max < far { range_max } else { far };
        Rules {
            range_min: T::of(range_min),
            range_max,
            far_limit: far,
            clamp: if clamps { (near, far) } else { (T::ZERO, T::INFINITY) },
            too_close: match too_close {
                TooClose::Hit => T::of(range_min),
                TooClose::Ignore => T::NAN,
            },
            usable_max: if farthest < T::MAX { farthest } else { T::MAX },
        }
    }

    /// The range to compute with, or NaN where there is none.
    #[inline(always)]
    pub(super) fn usable(&self, r: T) -> T {
        let r = if r == T::ZERO - T::INFINITY { self.too_close } else { r };
        let low = if r < self.clamp.0 { self.clamp.0 } else { r };
        let clamped = if low > self.clamp.1 { self.clamp.1 } else { low };
        if r.between(self.range_min, self.usable_max) { clamped } else { T::NAN }
    }

    /// Whether the sensor saw anything at all there: a reading it vouches for, or free space.
    #[inline(always)]
    pub(super) fn observed(&self, r: T) -> bool {
        let too_close = r == T::ZERO - T::INFINITY;
        let hit = too_close & !self.too_close.is_nan();
        hit | (r == T::INFINITY) | ((r >= self.range_min) & (r <= self.range_max))
    }
}

/// Counts every case of a scan.
pub(super) struct Census<'a, T, S> {
    pub ranges: S,
    pub rules: Rules<T>,
    pub tables: &'a Tables<T>,
}

/// Beams counted in one go. Long enough that the compiler keeps the loop and works on many beams at once.
const CHUNK: usize = 128;

impl<T: Real, S: Source<T>> Kernel for Census<'_, T, S> {
    type Output = Counts;

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) -> Counts {
        let offset = self.tables.offset_below.as_slice();
        let beams = self.ranges.len();
        let mut counts = Counts::default();
        for at in (0..beams).step_by(CHUNK) {
            if at + CHUNK <= beams {
                let ranges: [T; CHUNK] = self.ranges.lanes(at);
                self.count(&mut counts, &ranges, &offset[at..at + CHUNK]);
            } else {
                let ranges: [T; CHUNK] = self.ranges.lanes_or(at, T::NAN);
                self.count(&mut counts, &ranges[..beams - at], &offset[at..beams]);
            }
        }
        counts
    }
}

impl<T: Real, S> Census<'_, T, S> {
    #[inline(always)]
    fn count(&self, counts: &mut Counts, ranges: &[T], offset: &[T]) {
        let Rules { range_min, range_max, far_limit, .. } = self.rules;
        let [mut valid, mut invalid, mut too_close, mut no_return] = [0_u32; 4];
        let [mut out_of_range, mut beyond_limits, mut masked, mut contact] = [0_u32; 4];
        for (&r, &offset) in ranges.iter().zip(offset) {
            let looked = !offset.is_nan();
            let finite = (r > T::ZERO - T::INFINITY) & (r < T::INFINITY);
            let in_range = finite & (r >= range_min) & (r <= range_max);
            masked += u32::from(!looked);
            invalid += u32::from(looked & r.is_nan());
            too_close += u32::from(looked & (r == T::ZERO - T::INFINITY));
            no_return += u32::from(looked & (r == T::INFINITY));
            out_of_range += u32::from(looked & finite & !in_range);
            beyond_limits += u32::from(looked & in_range & (r > far_limit));
            valid += u32::from(looked & in_range & (r <= far_limit));
            contact += u32::from(self.rules.usable(r) <= offset);
        }
        counts.valid += valid;
        counts.invalid += invalid;
        counts.too_close += too_close;
        counts.no_return += no_return;
        counts.out_of_range += out_of_range;
        counts.beyond_limits += beyond_limits;
        counts.masked += masked;
        counts.contact += contact;
    }
}
