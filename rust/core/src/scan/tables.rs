//! What is known of each beam before a scan arrives.

use super::geometry::{Mount, Outline};
use crate::lanes::padded;
use crate::real::Real;

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
pub(super) struct Exact<'a> {
    pub beams: &'a Beams,
    pub velocity: (f64, f64),
    pub min_closing_speed: f64,
}

impl Exact<'_> {
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
        let closing = self.closing(beam);
        let clearance = self.clearance(beam, range);
        if closing.is_nan() || closing <= self.min_closing_speed || clearance.is_nan() {
            f64::INFINITY
        } else if clearance <= 0.0 {
            0.0
        } else {
            clearance / closing
        }
    }
}

/// The beams in the type of the ranges: what bounds and per-beam results are computed from.
#[derive(Clone, Debug)]
pub(super) struct Tables<T> {
    pub cos: Vec<T>,
    pub sin: Vec<T>,
    /// From the sensor to the outline, rounded to nearest; NaN where the beam is ignored.
    pub offset: Vec<T>,
    /// The largest number not above the truth: a range up to it is in contact, exactly.
    pub offset_below: Vec<T>,
    /// Not below the truth: what is left of a range after it is not above the true clearance.
    pub offset_above: Vec<T>,
    /// Not above `1 / cos`, for beams that close when driving forward, NaN for the others.
    pub inverse_forward: Vec<T>,
    /// Not above `1 / -cos`, for beams that close when reversing, NaN for the others.
    pub inverse_reverse: Vec<T>,
}

impl<T: Real> Tables<T> {
    pub(super) fn new(beams: &Beams) -> Self {
        let slack = T::SLACK.wide();
        let inverse = |cos: f64| if cos > 0.0 { T::of((1.0 - slack) / cos) } else { T::NAN };
        Tables {
            cos: table(&beams.cos, T::of),
            sin: table(&beams.sin, T::of),
            offset: table(&beams.offset, T::of),
            offset_below: table(&beams.offset, T::not_above),
            offset_above: table(&beams.offset, |offset| T::not_below(offset * (1.0 + slack))),
            inverse_forward: table(&beams.cos, inverse),
            inverse_reverse: table(&beams.cos, |cos| inverse(-cos)),
        }
    }
}

fn table<T>(exact: &[f64], f: impl Fn(f64) -> T) -> Vec<T> {
    exact.iter().map(|value| f(*value)).collect()
}
