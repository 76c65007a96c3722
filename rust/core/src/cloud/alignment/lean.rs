//! How surfaces lean.

use super::witnesses::{Place, Witnesses};

/// Levels between two cells of a column that show how the surface leans.
const REACH: i32 = 10;
/// A step between two levels that is steeper than this is an edge.
const STEEPEST: f64 = 2.0;

/// A sum of steps and one of rises.
#[derive(Clone, Copy, Default)]
struct Slope {
    step: f64,
    rise: f64,
}

impl Slope {
    fn add(&mut self, weight: f64, step: f64, rise: f64) {
        self.step += weight * step;
        self.rise += weight * rise;
    }

    fn value(self) -> f64 {
        self.step / self.rise.max(1e-12)
    }
}

/// How much further ahead the surface is for each metre upwards, for each cell; 0 at edges and for the edge of the body.
///
/// Rings move over the body as it comes nearer: without this, they would be seen to move along a slanted window. All
/// columns together decide for each level, by the limiter MC [van Leer 1977].
pub(super) fn lean(seen: &Witnesses, surface: &[f64], total: &[f64]) -> Vec<f64> {
    let mut leans = vec![0.0; seen.cells()];
    let levels = seen.places.iter().map(|place| place.level);
    let (Some(lowest), Some(highest)) = (levels.clone().min(), levels.max()) else { return leans };
    let number = |place: &Place| usize::try_from(place.level - lowest).unwrap_or(0);
    let size = usize::try_from(highest - lowest).unwrap_or(0) + 1;
    let (mut above, mut below) = (vec![Slope::default(); size], vec![Slope::default(); size]);
    for (i, pair) in seen.places.windows(2).enumerate() {
        let [lower, upper] = [pair[0], pair[1]];
        let (step, rise) = (surface[i + 1] - surface[i], (upper.height - lower.height).max(0.01));
        let joined = lower.column == upper.column && upper.level - lower.level <= REACH;
        if joined && step.abs() <= STEEPEST * rise {
            let weight = total[i].min(total[i + 1]);
            above[number(&lower)].add(weight, step, rise);
            below[number(&upper)].add(weight, step, rise);
        }
    }
    for (lean, place) in leans.iter_mut().zip(&seen.places) {
        *lean = limited(above[number(place)].value(), below[number(place)].value());
    }
    leans
}

/// The mean of two slopes, but no more than twice either, and 0 where they disagree.
fn limited(above: f64, below: f64) -> f64 {
    if above * below <= 0.0 {
        return 0.0;
    }
    let least = (f64::midpoint(above, below).abs()).min(2.0 * above.abs().min(below.abs()));
    least.copysign(above)
}
