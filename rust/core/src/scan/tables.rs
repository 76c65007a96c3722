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
use std::array;
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
        KernelTables { tables: Tables::new(beams), rules: Rules::new(settings) }
    }
}

/// The beams in the type of the ranges: what bounds and per-beam results are computed from.
#[derive(Clone, Debug)]
pub(crate) struct Tables<T> {
    /// The cosine of the direction of each beam, rounded to nearest.
    pub cos: Vec<T>,
    /// The sine of the direction of each beam, rounded to nearest.
    pub sin: Vec<T>,
    /// The distance from the sensor to the outline, rounded to nearest; NaN where the beam is ignored.
    pub offset: Vec<T>,
    /// The largest number not above that distance: exactly the ranges up to it are in contact.
    pub offset_below: Vec<T>,
    /// `1 / cos` of each beam, rounded to nearest.
    pub inverse: Vec<T>,
    /// The number of beams that are not ignored.
    pub looking: u32,
    /// The least and the largest `cos` of each group.
    pub extremes: Vec<(T, T)>,
}

/// The beams in `f32`, in blocks of four groups: what the search reads.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    /// The cosine of the direction, rounded to nearest.
    pub cos: Vec<Block>,
    /// The sine of the direction, rounded to nearest.
    pub sin: Vec<Block>,
    /// A number above the offset by more than all roundings, so that a range less it is not above the true clearance;
    /// NaN where the beam is ignored.
    pub offset: Vec<Block>,
    /// The cosine and the sine in the middle of each block, for 16 blocks at a time.
    pub middle: Vec<[Lanes<f32>; 2]>,
    /// No direction is farther from the middle of its block than this.
    pub spread: f32,
    /// The beams that close when driving forward.
    pub forward: Ahead,
    /// The beams that close when reversing.
    pub reverse: Ahead,
}

/// The beams that close when the sensor moves along the vehicle's x axis, and whatever is between them.
#[derive(Clone, Debug)]
pub(crate) struct Ahead {
    pub beams: Range<usize>,
    /// A number below `1 / |cos|` by more than all roundings; NaN where the beam does not close.
    pub inverse: Vec<Block>,
    /// A number above the offset times `1 / |cos|` by more than all roundings; NaN where the beam is ignored.
    pub inside: Vec<Block>,
}

/// How many groups are in a block.
pub(super) const GROUPS: usize = 4;

/// A number for each beam of a block, in whole cache lines: reading two at once takes twice as long.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Block(pub [Lanes<f32>; GROUPS]);

/// Where a group begins. The last group overlaps the one before it rather than be a short one, and is there again until
/// its block is full: seeing a beam twice does no harm, and short loads are slow.
#[inline(always)]
pub(super) fn start(group: usize, beams: usize) -> usize {
    (group * LANES).min(beams - LANES)
}

impl<T: Real> Tables<T> {
    pub(super) fn new(beams: &Beams) -> Self {
        Tables {
            cos: table(&beams.cos, T::from_f64),
            sin: table(&beams.sin, T::from_f64),
            offset: table(&beams.offset, T::from_f64),
            offset_below: table(&beams.offset, T::not_above),
            inverse: table(&beams.cos, |cos| T::from_f64(1.0 / cos)),
            looking: beams.offset.iter().map(|offset| u32::from(!offset.is_nan())).sum(),
            extremes: beams.cos.chunks_exact(LANES).map(|cos| extremes(cos.iter().copied())).collect(),
        }
    }
}

impl Blocks {
    pub(super) fn new(beams: &Beams, count: usize) -> Self {
        let all = 0..count;
        let (cos, sin) = (blocks(&all, |beam| beams.cos[beam]), blocks(&all, |beam| beams.sin[beam]));
        let middle_of = |Block(block): &Block| {
            let (low, high): (f32, f32) =
                extremes(block.as_flattened().iter().map(|x| x.to_f64()).filter(|x| !x.is_nan()));
            low.midpoint(high)
        };
        let middles = cos.iter().zip(&sin).map(|(cos, sin)| [middle_of(cos), middle_of(sin)]).collect::<Vec<_>>();
        let away =
            |beam: usize, [cos, sin]: [f32; 2]| (beams.cos[beam] - cos.to_f64()).hypot(beams.sin[beam] - sin.to_f64());
        let block_of = |beam: usize| middles[beam / (GROUPS * LANES)];
        // The last groups of the last block may be beams of the block before it.
        let near_the_end =
            (count.saturating_sub(GROUPS * LANES)..count).map(|beam| away(beam, middles[middles.len() - 1]));
        let spread = all.clone().map(|beam| away(beam, block_of(beam))).chain(near_the_end).fold(0.0, f64::max);
        let middle =
            |part: usize, group: &[[f32; 2]]| lanes(|lane| group.get(lane).map_or(f32::NAN, |middle| middle[part]));
        Blocks {
            cos,
            sin,
            offset: blocks(&all, |beam| beams.offset[beam] * (1.0 + slack())),
            middle: middles.chunks(LANES).map(|group| [middle(0, group), middle(1, group)]).collect(),
            spread: f32::not_below(spread),
            forward: Ahead::new(beams, count, 1.0),
            reverse: Ahead::new(beams, count, -1.0),
        }
    }
}

impl Ahead {
    fn new(beams: &Beams, count: usize, direction: f64) -> Self {
        let inverse = |beam: usize| 1.0 / (direction * beams.cos[beam]);
        let closing = |beam: &usize| direction * beams.cos[*beam] > 0.0 && !beams.ignores(*beam);
        let first = (0..count).find(closing).unwrap_or(count).min(count.saturating_sub(LANES));
        let end = (0..count).rfind(closing).map_or(0, |last| last + 1).max((first + LANES).min(count));
        let within = first..end;
        let below = |beam: usize| inverse(beam) * (1.0 - slack());
        Ahead {
            inverse: blocks(&within, |beam| if closing(&beam) { below(beam) } else { f64::NAN }),
            inside: blocks(&within, |beam| beams.offset[beam] * inverse(beam).abs() * (1.0 + slack())),
            beams: within,
        }
    }
}

fn slack() -> f64 {
    f32::SLACK.to_f64()
}

/// A number for each of some beams, in blocks. The last groups begin where they end with the last beam, and lanes
/// without a beam are NaN.
fn blocks(beams: &Range<usize>, f: impl Fn(usize) -> f64) -> Vec<Block> {
    let count = beams.len().max(LANES);
    let number = |beam: usize| if beam < beams.end { f32::from_f64(f(beam)) } else { f32::NAN };
    let group = |group: usize| lanes(|lane| number(beams.start + start(group, count) + lane));
    (0..count.div_ceil(GROUPS * LANES)).map(|block| Block(array::from_fn(|i| group(block * GROUPS + i)))).collect()
}

fn table<T>(exact: &[f64], f: impl Fn(f64) -> T) -> Vec<T> {
    exact.iter().map(|value| f(*value)).collect()
}

/// The least and the largest of some numbers; rounding keeps their order.
fn extremes<T: Real>(values: impl Iterator<Item = f64>) -> (T, T) {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    (T::from_f64(low), T::from_f64(high))
}
