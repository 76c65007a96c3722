//! What is known of each beam before a scan arrives.

use super::formula::ttc;
use super::geometry::{Mount, Outline};
use crate::lanes::{LANES, Lanes, lanes, padded, window};
use crate::real::Real;
use std::ops::Range;

/// The beams in `f64`: the truth that decisions are made with.
#[derive(Clone, Debug)]
pub(super) struct Beams {
    /// Direction of each beam in the vehicle frame.
    pub cos: Vec<f64>,
    pub sin: Vec<f64>,
    /// From the sensor to the outline; NaN where the beam is ignored, and in the padding.
    pub offset: Vec<f64>,
}

impl Beams {
    pub(super) fn new(
        angles: impl ExactSizeIterator<Item = f64> + Clone,
        mount: Mount,
        outline: Option<Outline>,
        mask: Option<&[bool]>,
    ) -> Self {
        let directions = angles.map(|angle| (angle + mount.yaw).sin_cos());
        let offsets = directions.clone().enumerate().map(|(beam, (sin, cos))| {
            if mask.is_some_and(|mask| mask[beam]) {
                f64::NAN
            } else {
                outline.map_or(0.0, |outline| outline.offset((mount.x, mount.y), (cos, sin)))
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

/// The beams for one motion of the sensor.
#[derive(Clone, Copy)]
pub(super) struct ExactBeams<'a> {
    pub beams: &'a Beams,
    pub velocity: (f64, f64),
    pub min_closing_speed: f64,
}

impl ExactBeams<'_> {
    /// Closing speed of one beam.
    #[inline(always)]
    pub(super) fn closing(&self, beam: usize) -> f64 {
        self.velocity.0 * self.beams.cos[beam] + self.velocity.1 * self.beams.sin[beam]
    }

    /// Clearance of one beam.
    #[inline(always)]
    pub(super) fn clearance(&self, beam: usize, range: f64) -> f64 {
        range - self.beams.offset[beam]
    }

    /// Time-to-collision of a usable range; infinite where there is none.
    #[inline(always)]
    pub(super) fn ttc(&self, beam: usize, range: f64) -> f64 {
        ttc(self.clearance(beam, range), self.closing(beam), self.min_closing_speed)
    }

    /// The same of beams `at .. at + LANES`.
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

/// The beams in the type of the ranges: what bounds and per-beam results are computed from.
#[derive(Clone, Debug)]
pub(super) struct Tables<T> {
    /// From the sensor to the outline, rounded to nearest; NaN where the beam is ignored.
    pub offset: Vec<T>,
    /// The largest number not above the truth: a range up to it is in contact, exactly.
    pub offset_below: Vec<T>,
    /// `1 / cos`, rounded to nearest.
    pub inverse: Vec<T>,
    /// The least and the largest `cos` of each group.
    pub extremes: Vec<(T, T)>,
    /// Every beam by itself.
    pub beams: Envelope<T>,
    /// Each lane of each block.
    pub blocks: Envelope<T>,
    /// How many groups of lanes there are, and how many in a block.
    groups: usize,
    block: usize,
}

/// What no beam of a set exceeds, for one set after the other: each beam, or the beams that one lane of a block sees.
#[derive(Clone, Debug)]
pub(super) struct Envelope<T> {
    /// The direction in the middle.
    pub cos: Vec<T>,
    pub sin: Vec<T>,
    /// No direction is farther from the middle than this, in any set.
    pub spread: T,
    /// Not below the truth: what is left of a range after it is not above the true clearance. NaN without beams.
    pub offset: Vec<T>,
    /// Not above any `1 / cos` of the beams that close when driving forward; NaN without one.
    pub inverse_forward: Vec<T>,
    /// Not above any `1 / -cos` of the beams that close when reversing; NaN without one.
    pub inverse_reverse: Vec<T>,
}

/// At most this many blocks, so that their bounds fit on the stack.
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
