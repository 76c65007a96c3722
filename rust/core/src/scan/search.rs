//! The least time-to-collision of a scan, exactly, without computing all of them exactly.
//!
//! A time-to-collision takes a division per beam, and only one beam matters. So the search goes straight through the
//! beams with numbers that are not above their times, in `f32`, and computes few in `f64`:
//!
//! 1. *Keys.* Each beam gets a number that is not above its true time: its [`Bound`]. Each lane of a block of beams
//!    keeps the least.
//! 2. *A limit.* The least of all, and a little more for rounding, is about where the answer lies.
//! 3. *Beams.* In each block with a key up to the limit, which usually is one, the beams with such keys are computed
//!    exactly, in `f64`.
//!
//! No key lies on the wrong side of the truth, however it was rounded. So if the best time is not above the limit, no
//! beam beyond the limit is better. Else the search goes on, up to the best time: rounding costs time, never the answer.
//!
//! There is no branch that depends on where the nearest beam is. A processor guesses such a branch wrongly on each new
//! scan, and a wrong guess takes as long as a hundred beams.

use super::ScanTtc;
use super::bound::{Bound, Straight, Turning};
use super::readings::Rules;
use super::tables::{ExactBeams, GROUPS, start};
use crate::column::{Column, Source};
use crate::hit::Hit;
use crate::lanes::{LANES, Lanes, each, least};
use crate::real::Real;
use crate::scan;
use crate::simd::{Instructions, Kernel};
use arrayvec::ArrayVec;
use std::ops::Range;

/// Below this speed, m/s, products lose digits, and bounds would not hold.
const SLOWEST: f64 = 1e-290;

/// As few beams as this are computed one by one: a search among them would take longer.
const FEW: usize = 4;

/// The blocks of a long scan are taken together in this many stretches: there is one bit for each, and the least keys of
/// all of them fit on the stack.
const STRETCHES: usize = u64::BITS as usize;

/// Where closing speeds count from less than this part of the speed on, nearly all beams ahead do; and at a speed above
/// this, m/s, no bound overflows.
const SLOW: f64 = 0.05;

/// Returns the beam with the least time-to-collision.
///
/// All of it is inlined, and it passes no reference to a function that is not: what a reference points to has to lie in
/// memory, and to write it there and read it back takes as long as a hundred beams.
#[inline(always)]
pub(super) fn first_hit<T: scan::Range>(ranges: Column<'_, T>, scan: &ScanTtc, exact: ExactBeams<'_>) -> Hit {
    let ((vx, vy), min_closing_speed) = (exact.velocity, exact.min_closing_speed);
    let fastest = vx.abs() + vy.abs();
    if fastest <= min_closing_speed {
        return Hit::NONE;
    }
    if fastest < SLOWEST || ranges.len() <= FEW {
        one_by_one(ranges, &T::kernel_tables(scan).rules, exact)
    } else if vy == 0.0 && min_closing_speed < SLOW * fastest {
        let ahead = if vx > 0.0 { &scan.blocks.forward } else { &scan.blocks.reverse };
        let Range { start, end } = ahead.beams;
        searched(ranges.slice(start, end), start, scan, exact, Straight::new(ahead, vx))
    } else {
        searched(ranges, 0, scan, exact, Turning::new(&scan.blocks, (vx, vy), min_closing_speed))
    }
}

#[inline(always)]
fn one_by_one<T: Real>(ranges: Column<'_, T>, rules: &Rules<T>, exact: ExactBeams<'_>) -> Hit {
    let mut best = Hit::NONE;
    for beam in 0..ranges.len() {
        let candidate = Hit { ttc: exact.ttc(beam, rules.usable(ranges.get(beam)).to_f64()), index: beam };
        best = candidate.or(best);
    }
    best
}

#[inline(always)]
fn searched<T: scan::Range>(
    ranges: Column<'_, T>,
    before: usize,
    scan: &ScanTtc,
    exact: ExactBeams<'_>,
    bound: impl Bound,
) -> Hit {
    let (level, rules) = (scan.level, (&scan.single.rules, &T::kernel_tables(scan).rules));
    let few: Lanes<T>;
    let ranges = if ranges.len() < LANES {
        few = ranges.lanes_or(0, T::NAN);
        Column::new(&few)
    } else {
        ranges
    };
    let best = if let Some(ranges) = ranges.dense() {
        let (vx, vy) = exact.velocity;
        let is_ordinary = !rules.1.clamps() && vx.abs() + vy.abs() > SLOW;
        is_ordinary
            .then(|| level.run(Search::<_, _, _, false> { ranges, before, rules, bound, exact }))
            .flatten()
            .or_else(|| level.run(Search::<_, _, _, true> { ranges, before, rules, bound, exact }))
    } else {
        level.run(Search::<_, _, _, true> { ranges, before, rules, bound, exact })
    };
    best.unwrap_or(Hit::NONE)
}

/// The search for one kind of bounds. Unless it is `STRICT`, it returns nothing of a scan that is out of the ordinary:
/// where a reading is -inf, or where the least keys are of beams that do not count after all.
struct Search<'a, T, S, B, const STRICT: bool> {
    /// The ranges, at least one group of lanes.
    ranges: S,
    /// How many beams there are before the first of them.
    before: usize,
    /// The rules for keys, and those that decide.
    rules: (&'a Rules<f32>, &'a Rules<T>),
    bound: B,
    exact: ExactBeams<'a>,
}

/// The least keys of a stretch of blocks, in a cache line.
#[repr(align(64))]
struct LeastKeys(Lanes<f32>);

impl<T: Real, S: Source<T>, B: Bound, const STRICT: bool> Kernel for Search<'_, T, S, B, STRICT> {
    type Output = Option<Hit>;
    const AVX512: bool = !STRICT;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Option<Hit> {
        let blocks = self.bound.blocks(simd);
        let whole = blocks.end.min(self.ranges.len() / (GROUPS * LANES));
        let stretch = blocks.len() / (STRETCHES - 1) + 1; // one more stretch is the last block, if it is not whole
        let mut stretches = ArrayVec::<LeastKeys, STRETCHES>::new();
        let (mut lowest, mut least_reading) = ([f32::INFINITY; LANES], [f32::INFINITY; LANES]);
        let (mut keys, mut left) = ([f32::INFINITY; LANES], stretch);
        for block in blocks.start..whole {
            let readings: [Lanes<T>; GROUPS] = self.ranges.four_lanes(block * GROUPS * LANES);
            for group in 0..GROUPS {
                let readings = each(readings[group], T::to_f32);
                simd.keep_least_f32(&mut keys, &self.keys(simd, block, group, &readings));
                simd.keep_least_f32(&mut least_reading, &readings);
            }
            left -= 1;
            if left == 0 || block + 1 == whole {
                simd.keep_least_f32(&mut lowest, &keys);
                stretches.push(LeastKeys(keys));
                (keys, left) = ([f32::INFINITY; LANES], stretch);
            }
        }
        if whole < blocks.end {
            for group in 0..GROUPS {
                let readings = self.readings(whole, group);
                simd.keep_least_f32(&mut keys, &self.keys(simd, whole, group, &readings));
                simd.keep_least_f32(&mut least_reading, &readings);
            }
            simd.keep_least_f32(&mut lowest, &keys);
            stretches.push(LeastKeys(keys));
        }

        let lowest = least(lowest);
        if !STRICT && simd.at_most_f32(&least_reading, f32::NEG_INFINITY) != 0 {
            return None;
        }
        if !STRICT && lowest == f32::INFINITY && self.rules.0.is_bounded() {
            return Some(Hit::NONE);
        }
        // In contact the time is 0. The keys of others are below their times by a few roundings, as a rule.
        let lowest = if lowest > 0.0 { lowest } else { 0.0 };
        let mut limit = lowest + 4.0 * f32::SLACK * (lowest + 1.0);
        loop {
            let mut best = Hit::NONE;
            let mut reaching = 0_u64;
            for (at, LeastKeys(keys)) in stretches.iter().enumerate() {
                reaching |= u64::from(simd.at_most_f32(keys, limit) != 0) << at;
            }
            while reaching != 0 {
                let first = (blocks.start + reaching.trailing_zeros() as usize * stretch).min(whole);
                reaching &= reaching - 1;
                for block in first..(first + stretch).min(if first < whole { whole } else { blocks.end }) {
                    best = self.up_to(simd, block, limit).or(best);
                }
            }
            // Rounding it to `f32` is covered by the slack in the bounds, and underflow by `TINY`.
            let needed = f32::from_f64(best.ttc * self.bound.scale()) + f32::TINY;
            if needed <= limit || limit == f32::INFINITY {
                return Some(best);
            }
            if !STRICT && !best.closes() {
                return None; // the least keys are of readings that do not count
            }
            limit = needed;
        }
    }
}

impl<T: Real, S: Source<T>, B: Bound, const STRICT: bool> Search<'_, T, S, B, STRICT> {
    /// Returns where a group begins.
    #[inline(always)]
    fn start(&self, block: usize, group: usize) -> usize {
        start(block * GROUPS + group, self.ranges.len())
    }

    /// Returns the readings of a group.
    #[inline(always)]
    fn readings(&self, block: usize, group: usize) -> Lanes<f32> {
        each(self.ranges.lanes(self.start(block, group)), T::to_f32)
    }

    /// Returns the keys of a group.
    #[inline(always)]
    fn keys<I: Instructions>(&self, simd: I, block: usize, group: usize, readings: &Lanes<f32>) -> Lanes<f32> {
        let rules = *self.rules.0; // a copy: what lies behind a reference is only read where a lane needs it
        if STRICT {
            let usable = each(*readings, |reading| rules.usable(reading));
            return self.bound.below(simd, block, group, &usable, rules.range_min);
        }
        self.bound.below(simd, block, group, readings, rules.range_min)
    }

    /// Returns the best of the beams of a block with a key up to a limit.
    #[inline(always)]
    fn up_to<I: Instructions>(&self, simd: I, block: usize, limit: f32) -> Hit {
        let (mut best, mut bits) = (Hit::NONE, 0_u64);
        for group in 0..GROUPS {
            let keys = self.keys(simd, block, group, &self.readings(block, group));
            bits |= u64::from(simd.at_most_f32(&keys, limit)) << (group * LANES);
        }
        while bits != 0 {
            let group = bits.trailing_zeros() as usize / LANES;
            let of_group = u64::from(u16::MAX) << (group * LANES);
            best = self.best_of(simd, self.start(block, group), bits & of_group).or(best);
            bits &= !of_group;
        }
        best
    }

    /// Returns the best of the beams of a group that are `left`. Usually one is; in lanes, all of them cost as much as
    /// a few.
    #[inline(always)]
    fn best_of<I: Instructions>(&self, simd: I, at: usize, left: u64) -> Hit {
        let rules = *self.rules.1;
        if left.is_power_of_two() {
            let index = at + left.trailing_zeros() as usize % LANES;
            let [reading] = self.ranges.lanes(index);
            let range = if STRICT { rules.usable(reading) } else { rules.ordinary(reading) };
            let index = self.before + index;
            return Hit { ttc: self.exact.ttc(index, range.to_f64()), index };
        }
        let ranges = each(self.ranges.lanes(at), |reading| rules.usable(reading));
        let ttc = self.exact.ttc_lanes(self.before + at, &ranges);
        let lowest = least(ttc);
        let ties = f64::within(simd, &ttc, &[lowest; LANES], &[lowest; LANES]);
        Hit { ttc: lowest, index: self.before + at + ties.trailing_zeros() as usize }
    }
}

#[cfg(test)]
mod tests {
    use super::{first_hit, one_by_one};
    use crate::column::Column;
    use crate::scan::{LimitsPolicy, Range, ScanTtc, Settings, TooClose};
    use crate::simd::Level;
    use crate::vehicle::{Motion, Mount, Outline};
    use proptest::prelude::*;

    const CAR: Outline = Outline { x_rear: -0.1, x_front: 0.45, y_right: -0.15, y_left: 0.15 };
    const ODD: [f64; 9] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 0.06, 0.2, 1e30, 3e38];

    fn settings() -> impl Strategy<Value = Settings> {
        let beams = prop_oneof![40 => 1..700_usize, 1 => 4000..13_000_usize];
        let field = (beams, -4.0..4.0, 0.0..6.3);
        let rules = (
            prop::sample::select(vec![0.0, 0.06, 1.0]),
            prop::sample::select(vec![30.0, f64::INFINITY]),
            prop::sample::select(vec![None, Some((0.5, 8.0)), Some((0.0, 1e3))]),
            prop::sample::select(vec![LimitsPolicy::Horizon, LimitsPolicy::Clamp]),
            prop::sample::select(vec![TooClose::Hit, TooClose::Ignore]),
        );
        let car = (prop::sample::select(vec![0.0, 0.01, 1.0, 4.0]), any::<bool>(), -0.1..0.1, -3.2..3.2);
        (field, rules, car).prop_map(|((beams, angle_min, view), rules, (min_closing_speed, has_outline, y, yaw))| {
            let (range_min, range_max, limits, limits_policy, too_close) = rules;
            Settings {
                range_min,
                range_max,
                limits,
                limits_policy,
                too_close,
                min_closing_speed,
                mount: Mount { x: 0.2, y, yaw },
                outline: has_outline.then_some(CAR),
                ..Settings::new(angle_min, (view + 1e-3) / beams as f64, beams)
            }
        })
    }

    fn motion() -> impl Strategy<Value = Motion> {
        let speed = prop_oneof![-20.0..20.0, prop::sample::select(vec![0.0, 1.0, 5.0, -5.0, 1e-300, 1e-5])];
        let turn = prop_oneof![3 => Just(0.0), 1 => -3.0..3.0];
        (speed, turn.clone(), turn).prop_map(|(speed, yaw_rate, lateral_speed)| Motion {
            speed,
            yaw_rate,
            lateral_speed,
        })
    }

    /// A wall across, all around, as near in time in each direction, or anything; some readings are odd.
    fn ranges(settings: &Settings) -> impl Strategy<Value = Vec<f64>> + use<> {
        let angles: Vec<f64> = settings.angles().map(|angle| angle + settings.mount.yaw).collect();
        let reading = prop_oneof![20 => (0.0..1.0).prop_map(Ok), 1 => prop::sample::select(ODD.to_vec()).prop_map(Err)];
        (0..4_u8, 0.2..20.0, prop::collection::vec(reading, angles.len())).prop_map(move |(kind, far, readings)| {
            let ordinary = |chance: f64, angle: f64| match kind {
                0 => far / angle.cos().abs(),
                1 => far,
                2 => far * angle.cos().abs(),
                _ => far * chance,
            };
            readings
                .iter()
                .zip(&angles)
                .map(|(reading, angle)| reading.map_or_else(|odd| odd, |u| ordinary(u, *angle)))
                .collect()
        })
    }

    fn agrees<T: Range>(settings: &Settings, ranges: &[f64], motion: Motion) {
        let ranges: Vec<T> = ranges.iter().map(|range| T::from_f64(*range)).collect();
        for level in Level::all() {
            let scan = ScanTtc::new(settings.clone(), level).expect("the settings make sense");
            let exact = scan.exact(ranges.len(), motion).expect("the motion makes sense");
            let expected = one_by_one(Column::new(&ranges), &T::kernel_tables(&scan).rules, exact);
            assert_eq!(first_hit(Column::new(&ranges), &scan, exact), expected, "{level}");
        }
    }

    #[test]
    fn limits_that_float32_cannot_hold_clamp_float64_ranges() {
        let settings = Settings {
            limits: Some((1e-50, 1e300)),
            limits_policy: LimitsPolicy::Clamp,
            ..Settings::new(-0.5, 0.05, 20)
        };
        for (reading, others) in [(0.0, 30.0), (1e-60, 30.0), (1e305, f64::NAN)] {
            let mut ranges = [others; 20];
            ranges[10] = reading;
            agrees::<f64>(&settings, &ranges, Motion { speed: 5.0, ..Motion::default() });
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn the_search_finds_what_every_beam_by_itself_gives(
            (settings, motion, ranges) in (settings(), motion())
                .prop_flat_map(|(settings, motion)| { let ranges = ranges(&settings); (Just(settings), Just(motion), ranges) })
        ) {
            agrees::<f32>(&settings, &ranges, motion);
            agrees::<f64>(&settings, &ranges, motion);
        }
    }
}
