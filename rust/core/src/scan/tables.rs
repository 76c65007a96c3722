//! What is known of each beam before a scan arrives, in the forms that the kernels read.
//!
//! [`Beams`] is the truth, in `f64`: directions, and the distances from the sensor to the outline. [`ExactBeams`] is
//! the beams in one motion, and decides. [`Tables`] is the beams in the type of the ranges, and bounds what the search
//! need not decide.

use super::readings::Rules;
use super::settings::Settings;
use crate::formula::ttc;
use crate::lanes::{LANES, Lanes, lanes, padded, window};
use crate::real::Real;
use std::ops::Range;

/// The beams in `f64`.
#[derive(Clone, Debug)]
pub(crate) struct Beams {
    /// The cosine of the direction of each beam in the vehicle frame.
    pub cos: Vec<f64>,
    /// The sine of the direction of each beam in the vehicle frame.
    pub sin: Vec<f64>,
    /// The distance from the sensor to the outline along each beam, m; NaN where the beam is ignored, and in the
    /// padding.
    pub offset: Vec<f64>,
}

impl Beams {
    pub(super) fn new(settings: &Settings) -> Self {
        let mount = settings.mount;
        let directions = settings.angles().map(|angle| (angle + mount.yaw).sin_cos());
        let offsets = directions.clone().enumerate().map(|(beam, (sin, cos))| {
            if settings.mask.as_ref().is_some_and(|mask| mask[beam]) {
                f64::NAN
            } else {
                settings.outline.map_or(0.0, |outline| outline.offset((mount.x, mount.y), (cos, sin)))
            }
        });
        Beams {
            offset: padded(offsets, f64::NAN),
            sin: padded(directions.clone().map(|(sin, _)| sin), 0.0),
            cos: padded(directions.map(|(_, cos)| cos), 0.0),
        }
    }

    /// Whether a beam is masked or looks at the vehicle itself.
    pub(super) fn ignores(&self, beam: usize) -> bool {
        self.offset[beam].is_nan()
    }
}

/// The beams in one motion of the sensor.
#[derive(Clone, Copy)]
pub(crate) struct ExactBeams<'a> {
    pub beams: &'a Beams,
    pub velocity: (f64, f64),
    pub min_closing_speed: f64,
}

impl ExactBeams<'_> {
    /// The closing speed of one beam, m/s.
    #[inline(always)]
    pub(super) fn closing(&self, beam: usize) -> f64 {
        self.velocity.0 * self.beams.cos[beam] + self.velocity.1 * self.beams.sin[beam]
    }

    /// The clearance of one beam, m.
    #[inline(always)]
    pub(super) fn clearance(&self, beam: usize, range: f64) -> f64 {
        range - self.beams.offset[beam]
    }

    /// The time-to-collision of one beam with a usable range, s; infinite without one.
    #[inline(always)]
    pub(super) fn ttc(&self, beam: usize, range: f64) -> f64 {
        ttc(self.clearance(beam, range), self.closing(beam), self.min_closing_speed)
    }

    /// The times-to-collision of the beams `at .. at + LANES`, s; infinite where there is no usable range.
    #[inline(always)]
    pub(super) fn ttc_lanes<T: Real>(&self, at: usize, ranges: &Lanes<T>) -> Lanes<f64> {
        let (cos, sin) = (window(&self.beams.cos, at), window(&self.beams.sin, at));
        let offset = window(&self.beams.offset, at);
        lanes(|lane| {
            let closing = self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane];
            ttc(ranges[lane].to_f64() - offset[lane], closing, self.min_closing_speed)
        })
    }
}

/// Everything that a kernel reads besides the scan itself.
#[derive(Clone, Debug)]
pub(crate) struct KernelTables<T> {
    pub tables: Tables<T>,
    pub rules: Rules<T>,
}

impl<T: Real> KernelTables<T> {
    pub(super) fn new(settings: &Settings, beams: &Beams) -> Self {
        KernelTables { tables: Tables::new(beams, settings.beams), rules: Rules::new(settings) }
    }
}

/// The beams in the type of the ranges: what bounds and per-beam results are computed from.
#[derive(Clone, Debug)]
pub(crate) struct Tables<T> {
    /// The distance from the sensor to the outline, rounded to nearest; NaN where the beam is ignored.
    pub offset: Vec<T>,
    /// The largest number not above that distance: exactly the ranges up to it are in contact.
    pub offset_below: Vec<T>,
    /// `1 / cos` of each beam, rounded to nearest.
    pub inverse: Vec<T>,
    /// The least and the largest `cos` of each group.
    pub extremes: Vec<(T, T)>,
    /// Bounds of every beam by itself.
    pub beams: Envelope<T>,
    /// Bounds of the beams that each lane of each block sees.
    pub blocks: Envelope<T>,
    /// How many groups of lanes there are.
    groups: usize,
    /// How many groups are in a block.
    block: usize,
}

/// What no beam of a set exceeds, for one set after the other: each beam, or the beams that one lane of a block sees.
#[derive(Clone, Debug)]
pub(crate) struct Envelope<T> {
    /// The cosine of the direction in the middle.
    pub cos: Vec<T>,
    /// The sine of the direction in the middle.
    pub sin: Vec<T>,
    /// No direction is farther from the middle than this, in any set.
    pub spread: T,
    /// A number that is not below the true offsets, so that a range less it is not above the true clearance; NaN
    /// without beams.
    pub offset: Vec<T>,
    /// A number that is not above `1 / cos` of any beam that closes when driving forward; NaN without one.
    pub inverse_forward: Vec<T>,
    /// A number that is not above `1 / -cos` of any beam that closes when reversing; NaN without one.
    pub inverse_reverse: Vec<T>,
}

/// The largest number of blocks; the bounds of all of them fit on the stack.
pub(super) const BLOCKS: usize = 128;

/// Where a group begins. The last group overlaps the one before it rather than be a short one: seeing a beam twice
/// does no harm, and short loads are slow.
#[inline(always)]
pub(super) fn start(group: usize, beams: usize) -> usize {
    (group * LANES).min(beams - LANES)
}

impl<T: Real> Tables<T> {
    pub(super) fn new(beams: &Beams, count: usize) -> Self {
        let groups = count.div_ceil(LANES);
        // Every block is looked at, and then the groups of one or two: this many cost the least.
        let block = (groups / 4).isqrt().max(1).max(groups.div_ceil(BLOCKS));
        let seen = (0..groups.div_ceil(block) * LANES).map(|lane| {
            let (first, lane) = (lane / LANES * block, lane % LANES);
            (first..groups.min(first + block)).map(move |group| start(group, count.max(LANES)) + lane)
        });
        Tables {
            offset: table(&beams.offset, T::from_f64),
            offset_below: table(&beams.offset, T::not_above),
            inverse: table(&beams.cos, |cos| T::from_f64(1.0 / cos)),
            extremes: beams.cos.chunks_exact(LANES).map(extremes).collect(),
            beams: Envelope::new(beams, (0..beams.offset.len()).map(std::iter::once)),
            blocks: Envelope::new(beams, seen),
            groups,
            block,
        }
    }

    /// How many blocks there are.
    #[inline(always)]
    pub(super) fn blocks(&self) -> usize {
        self.blocks.offset.len() / LANES
    }

    /// The groups of a block.
    #[inline(always)]
    pub(super) fn groups(&self, block: usize) -> Range<usize> {
        block * self.block..self.groups.min((block + 1) * self.block)
    }
}

impl<T: Real> Envelope<T> {
    fn new<S: Iterator<Item = usize> + Clone>(beams: &Beams, sets: impl Iterator<Item = S>) -> Self {
        let slack = T::SLACK.to_f64();
        let inverse = |cos: f64| if cos > 0.0 { T::from_f64((1.0 - slack) / cos) } else { T::NAN };
        let mut envelope = Envelope {
            cos: vec![],
            sin: vec![],
            spread: T::ZERO,
            offset: vec![],
            inverse_forward: vec![],
            inverse_reverse: vec![],
        };
        let mut spread = 0.0_f64;
        for set in sets {
            let counts = set.filter(|beam| !beams.ignores(*beam));
            let highest = |values: &[f64]| counts.clone().map(|beam| values[beam]).fold(f64::NAN, f64::max);
            let lowest = |values: &[f64]| counts.clone().map(|beam| values[beam]).fold(f64::NAN, f64::min);
            let middle = |values: &[f64]| lowest(values).midpoint(highest(values));
            let (cos, sin) = (middle(&beams.cos), middle(&beams.sin));
            let away = counts.clone().map(|beam| (beams.cos[beam] - cos).hypot(beams.sin[beam] - sin));
            spread = away.fold(spread, f64::max);
            envelope.cos.push(T::from_f64(cos));
            envelope.sin.push(T::from_f64(sin));
            envelope.offset.push(T::not_below(highest(&beams.offset) * (1.0 + slack)));
            envelope.inverse_forward.push(inverse(highest(&beams.cos)));
            envelope.inverse_reverse.push(inverse(-lowest(&beams.cos)));
        }
        Envelope { spread: T::not_below(spread * (1.0 + slack)), ..envelope }
    }
}

fn table<T>(exact: &[f64], f: impl Fn(f64) -> T) -> Vec<T> {
    exact.iter().map(|value| f(*value)).collect()
}

/// The least and the largest of some numbers; rounding keeps their order.
fn extremes<T: Real>(values: &[f64]) -> (T, T) {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    (T::from_f64(low), T::from_f64(high))
}
