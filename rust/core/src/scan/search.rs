//! The least time-to-collision of a scan, exactly, without computing all of them exactly.
//!
//! A time-to-collision takes a division per beam, and only one beam matters. So the search is a branch and bound, from
//! coarse to fine, and in the type of the ranges until the end:
//!
//! 1. *Blocks.* Each lane of a block of beams keeps only the least valid reading it sees. With the least favourable
//!    offset and direction among its beams, that reading gives a number that is not above the true time of any of them.
//! 2. *A limit.* Each beam of the block with the least bound gets a number that is not below its true time. The least
//!    of these is the limit: the answer cannot lie above it, and seldom lies far below.
//! 3. *Groups.* In each block whose bound does not exceed the limit, every beam gets a bound of its own.
//! 4. *Beams.* The beams whose bounds do not exceed the limit are computed exactly, in `f64`, and lower the limit.
//!
//! No bound lies on the wrong side of the truth, however it was rounded, so that no better beam is missed: rounding
//! costs time, never the answer. On flat walls, where many beams tie within `f32`, more beams are computed.

use super::bound::{Bound, Straight, Turning};
use super::readings::Rules;
use super::tables::{BLOCKS, Envelope, ExactBeams, KernelTables, Tables, start};
use crate::column::{Column, Source};
use crate::hit::Hit;
use crate::lanes::{LANES, Lanes, each, least};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use arrayvec::ArrayVec;

/// Below this speed, m/s, products lose digits, and bounds would not hold.
const SLOWEST: f64 = 1e-290;

/// As few beams as this are computed one by one: a search among them would take longer.
const FEW: usize = 4;

/// Returns the beam with the least time-to-collision.
///
/// All of it is inlined, and it passes no reference to a function that is not: what a reference points to has to lie in
/// memory, and to write it there and read it back takes as long as a hundred beams.
#[inline(always)]
pub(super) fn first_hit<T: Real>(
    level: Level,
    ranges: Column<'_, T>,
    kernel: &KernelTables<T>,
    exact: ExactBeams<'_>,
) -> Hit {
    let ((vx, vy), min_closing_speed) = (exact.velocity, exact.min_closing_speed);
    let fastest = vx.abs() + vy.abs();
    if fastest <= min_closing_speed {
        return Hit::NONE;
    }
    let rules = &kernel.rules;
    if fastest < SLOWEST || ranges.len() <= FEW {
        one_by_one(ranges, rules, exact)
    } else if vy == 0.0 && !rules.clamps() {
        searched(level, ranges, kernel, exact, |envelope| Straight::new(envelope, vx, min_closing_speed))
    } else {
        searched(level, ranges, kernel, exact, |envelope| Turning::new(envelope, rules, (vx, vy), min_closing_speed))
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
fn searched<'a, T: Real, B: Bound<T>>(
    level: Level,
    ranges: Column<'_, T>,
    kernel: &'a KernelTables<T>,
    exact: ExactBeams<'a>,
    bound: impl Fn(&'a Envelope<T>) -> B,
) -> Hit {
    let KernelTables { tables, rules } = kernel;
    if ranges.len() < LANES {
        let few: Lanes<T> = ranges.lanes_or(0, T::NAN);
        return level.run(Search { ranges: Column::new(&few), rules, tables, bound, exact });
    }
    match ranges.dense() {
        Some(ranges) => level.run(Search { ranges, rules, tables, bound, exact }),
        None => level.run(Search { ranges, rules, tables, bound, exact }),
    }
}

/// The search for one kind of bounds.
struct Search<'a, T, S, F> {
    /// The ranges, at least one group of lanes.
    ranges: S,
    rules: &'a Rules<T>,
    tables: &'a Tables<T>,
    /// Makes the bounds of an envelope.
    bound: F,
    exact: ExactBeams<'a>,
}

impl<'a, T: Real, S: Source<T>, B: Bound<T>, F: Fn(&'a Envelope<T>) -> B> Kernel for Search<'a, T, S, F> {
    type Output = Hit;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Hit {
        let (beams, blocks) = ((self.bound)(&self.tables.beams), (self.bound)(&self.tables.blocks));
        let mut bounds = ArrayVec::<Lanes<T>, BLOCKS>::new();
        let (mut lowest, mut least_reading) = ([T::INFINITY; LANES], [T::INFINITY; LANES]);
        for block in 0..self.tables.blocks() {
            let nearest = self.nearest(simd, block, &mut least_reading);
            let bound = blocks.below(block * LANES, &nearest);
            T::keep_least(simd, &mut lowest, &bound);
            bounds.push(bound);
        }
        // A reading of -inf may be a hit at any distance down to 0, and is in no block's bound.
        let minus_infinity = [T::ZERO - T::INFINITY; LANES];
        let is_too_close = T::within(simd, &least_reading, &minus_infinity, &minus_infinity) != 0;
        let mut limit = self.first_limit(simd, &bounds, &lowest, &beams);
        let mut best = Hit::NONE;
        for block in 0..bounds.len() {
            if is_too_close || reaching(simd, &bounds[block], limit) != 0 {
                (best, limit) = self.decided(simd, block, &beams, (best, limit));
            }
        }
        best
    }
}

impl<T: Real, S: Source<T>, F> Search<'_, T, S, F> {
    /// Returns the least reading that each lane of a block sees among those that may be valid. The least of all
    /// readings goes into `lowest`.
    #[inline(always)]
    fn nearest<I: Instructions>(&self, simd: I, block: usize, lowest: &mut Lanes<T>) -> Lanes<T> {
        let low = self.rules.range_min;
        let mut nearest = [T::INFINITY; LANES];
        for group in self.tables.groups(block) {
            let ranges: Lanes<T> = self.ranges.lanes(start(group, self.ranges.len()));
            let valid = each(ranges, |range| if range >= low { range } else { T::NAN });
            T::keep_least(simd, &mut nearest, &valid);
            T::keep_least(simd, lowest, &ranges);
        }
        nearest
    }

    /// Returns a limit from the block with the `lowest` bound, which usually has the answer in it.
    #[inline(always)]
    fn first_limit<I: Instructions>(
        &self,
        simd: I,
        bounds: &[Lanes<T>],
        lowest: &Lanes<T>,
        beams: &impl Bound<T>,
    ) -> T {
        let promise = least(*lowest);
        let lane = T::within(simd, lowest, &[promise; LANES], &[promise; LANES]).trailing_zeros() as usize % LANES;
        let first = bounds.iter().position(|bound| bound[lane] == promise);
        let mut above = [T::INFINITY; LANES];
        for group in first.map_or(0..0, |block| self.tables.groups(block)) {
            let (at, usable) = self.usable(group);
            T::keep_least(simd, &mut above, &beams.above(at, &usable));
        }
        least(above) + T::TINY
    }

    /// Returns where a group begins, and its usable ranges.
    #[inline(always)]
    fn usable(&self, group: usize) -> (usize, Lanes<T>) {
        let rules = *self.rules; // a copy: what lies behind a reference is only read where a lane needs it
        let at = start(group, self.ranges.len());
        (at, each(self.ranges.lanes(at), |range| rules.usable(range)))
    }

    /// Computes the beams of a block that may still matter, and returns the best so far and the limit.
    #[inline(always)]
    fn decided<I: Instructions>(
        &self,
        simd: I,
        block: usize,
        beams: &impl Bound<T>,
        (mut best, mut limit): (Hit, T),
    ) -> (Hit, T) {
        for group in self.tables.groups(block) {
            let (at, usable) = self.usable(group);
            let left = reaching(simd, &beams.below(at, &usable), limit);
            if left != 0 {
                best = self.best_of(simd, at, &usable, left).or(best);
                // Rounding it to `T` is covered by the slack in the bounds, and underflow by `TINY`.
                let new = T::from_f64(best.ttc * beams.scale()) + T::TINY;
                limit = if new < limit { new } else { limit };
            }
        }
        (best, limit)
    }

    /// Returns the best of the beams of a group that are `left`. Usually one is; in lanes, all of them cost as much as
    /// a few.
    #[inline(always)]
    fn best_of<I: Instructions>(&self, simd: I, at: usize, ranges: &Lanes<T>, left: u16) -> Hit {
        if left.is_power_of_two() {
            let lane = left.trailing_zeros() as usize % LANES;
            return Hit { ttc: self.exact.ttc(at + lane, ranges[lane].to_f64()), index: at + lane };
        }
        let ttc = self.exact.ttc_lanes(at, ranges);
        let lowest = least(ttc);
        let ties = f64::within(simd, &ttc, &[lowest; LANES], &[lowest; LANES]);
        Hit { ttc: lowest, index: at + ties.trailing_zeros() as usize }
    }
}

/// Returns a bit for each lane whose bound is not above `limit`.
#[inline(always)]
fn reaching<T: Real, I: Instructions>(simd: I, bounds: &Lanes<T>, limit: T) -> u16 {
    T::within(simd, bounds, &[T::ZERO - T::INFINITY; LANES], &[limit; LANES])
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
        let field = (1..700_usize, -4.0..4.0, 0.0..6.3);
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

    /// A wall across, all around, or anything; some readings are odd.
    fn ranges(settings: &Settings) -> impl Strategy<Value = Vec<f64>> + use<> {
        let angles: Vec<f64> = settings.angles().map(|angle| angle + settings.mount.yaw).collect();
        let reading = prop_oneof![20 => (0.0..1.0).prop_map(Ok), 1 => prop::sample::select(ODD.to_vec()).prop_map(Err)];
        (0..3_u8, 0.2..20.0, prop::collection::vec(reading, angles.len())).prop_map(move |(kind, far, readings)| {
            let ordinary = |chance: f64, angle: f64| match kind {
                0 => far / angle.cos().abs(),
                1 => far,
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
            let kernel = T::kernel_tables(&scan);
            let expected = one_by_one(Column::new(&ranges), &kernel.rules, exact);
            assert_eq!(first_hit(level, Column::new(&ranges), kernel, exact), expected, "{level}");
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
