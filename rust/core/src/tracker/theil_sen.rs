//! The Theil-Sen line: the median slope of all pairs, and the median of what it leaves.

use super::posterior::{Measured, Posterior};
use std::f64::consts::FRAC_PI_2;

/// Variance of a median of normal numbers over that of their mean.
const MEDIAN: f64 = FRAC_PI_2;
/// Variance of the median of pairwise slopes over that of least squares, for normal noise.
const PAIRS: f64 = std::f64::consts::PI / 3.0;

/// The line at `stamp`, with `acceleration` (std) not followed by it.
pub(super) fn median_line(frames: &[Measured], stamp: f64, variance: f64, acceleration: f64) -> Posterior {
    let n = frames.len() as f64;
    let mean = |f: &dyn Fn(&Measured) -> f64| frames.iter().map(f).sum::<f64>() / n;
    let pairs = frames
        .iter()
        .enumerate()
        .flat_map(|(i, a)| frames[..i].iter().map(move |b| (a.distance - b.distance) / (a.stamp - b.stamp)));
    let slope = median(pairs.collect());
    let distance = median(frames.iter().map(|frame| frame.distance - slope * (frame.stamp - stamp)).collect());
    let noise = mean(&|frame| if frame.own { frame.variance } else { variance });
    let centre = mean(&|frame| frame.stamp - stamp);
    let spread = mean(&|frame| (frame.stamp - stamp - centre).powi(2));
    let (of_centre, of_slope) = (MEDIAN * noise / n, PAIRS * noise / (n * spread));
    // What half an acceleration times the square of time does to the line: the projection of least squares.
    let square = |frame: &Measured| (frame.stamp - stamp).powi(2);
    let level = mean(&square);
    let tilt = mean(&|frame| (frame.stamp - stamp - centre) * (square(frame) - level)) / spread;
    let (missed_d, missed_v) = (0.5 * acceleration * (level - tilt * centre), -0.5 * acceleration * tilt);
    Posterior {
        distance,
        closing_speed: -slope,
        dd: of_centre + centre * centre * of_slope + missed_d * missed_d,
        dv: centre * of_slope + missed_d * missed_v,
        vv: of_slope + missed_v * missed_v,
        lag: missed_d * missed_d,
    }
}

/// The middle value, or the mean of the two in the middle.
fn median(mut values: Vec<f64>) -> f64 {
    let half = values.len() / 2;
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(half, f64::total_cmp);
    if !even {
        return upper;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    f64::midpoint(lower, upper)
}
