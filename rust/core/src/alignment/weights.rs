//! Which cells of which frames to believe.
//!
//! A cell sees the body at `x = h + p(t)`: the surface `h` of the body at this cell, and the position `p` of the body.
//! Both are estimated in turns with the weights of the observations. What does not move like the rest (a stray point,
//! an edge that is met in one frame and missed in the next, another car) loses its weight, by Tukey's biweight.

use super::profile::{Cell, Sighting};
use crate::real::median;

/// The weight of the edge of a body, in points. It is 5 times as noisy as a point, because other points make it each
/// time.
const EDGE: f64 = 0.04;

/// What the cells of all frames show side by side: one entry for each cell of each frame, frame after frame. The last
/// cell is the edge of the body.
pub(super) struct CellObservations {
    /// The first entry of each frame, and the end of the last.
    pub starts: Vec<usize>,
    /// The cell of each entry.
    pub cell: Vec<usize>,
    /// The number of points behind each entry.
    pub count: Vec<f64>,
    /// The mean distance of each entry, m.
    pub x: Vec<f64>,
    /// The mean height of each entry above that of its cell, m.
    pub rise: Vec<f64>,
    /// The place of each cell but the edge.
    pub places: Vec<Place>,
}

/// The place of a cell.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub column: i32,
    pub level: i32,
    /// Mean height, m.
    pub height: f64,
}

impl CellObservations {
    /// Numbers the cells that more than one frame shows; others say nothing about motion.
    pub fn new(sightings: &[Sighting]) -> Self {
        let at = |cell: &Cell| (cell.column, cell.level);
        let mut shown: Vec<(i32, i32)> =
            sightings.iter().flat_map(|sighting| sighting.profile.cells.iter().map(at)).collect();
        #[allow(clippy::stable_sort_primitive, reason = "it merges sorted runs")]
        shown.sort();
        let mut shared: Vec<(i32, i32)> =
            shown.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect();
        shared.dedup();

        let most = shown.len() + sightings.len();
        let mut observed = CellObservations {
            starts: vec![0],
            cell: Vec::with_capacity(most),
            count: Vec::with_capacity(most),
            x: Vec::with_capacity(most),
            rise: Vec::with_capacity(most),
            places: Vec::new(),
        };
        for Sighting { edge, profile, .. } in sightings {
            let mut number = 0;
            for cell in &profile.cells {
                while number < shared.len() && shared[number] < at(cell) {
                    number += 1;
                }
                if shared.get(number) == Some(&at(cell)) {
                    observed.push(number, cell.count, cell.x, cell.z);
                }
            }
            observed.push(shared.len(), EDGE, *edge, 0.0);
            observed.starts.push(observed.cell.len());
        }
        observed.level_out(&shared);
        observed
    }

    /// The number of frames.
    pub fn frames(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of cells, the edge included.
    pub fn cells(&self) -> usize {
        self.places.len() + 1
    }

    /// The entries of each frame.
    pub fn by_frame(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        self.starts.windows(2).map(|pair| pair[0]..pair[1])
    }

    fn push(&mut self, cell: usize, count: f64, x: f64, z: f64) {
        self.cell.push(cell);
        self.count.push(count);
        self.x.push(x);
        self.rise.push(z);
    }

    /// Turns heights into heights above the mean of their cell.
    fn level_out(&mut self, shared: &[(i32, i32)]) {
        let mut sums = vec![(0.0, 0.0); shared.len() + 1];
        for (i, &cell) in self.cell.iter().enumerate() {
            sums[cell].0 += self.count[i];
            sums[cell].1 += self.count[i] * self.rise[i];
        }
        let height = |cell: usize| sums[cell].1 / sums[cell].0;
        for (rise, &cell) in self.rise.iter_mut().zip(&self.cell) {
            *rise -= height(cell);
        }
        let place = |(cell, &(column, level)): (usize, &(i32, i32))| Place { column, level, height: height(cell) };
        self.places = shared.iter().enumerate().map(place).collect();
    }
}

/// The rounds in which weights are computed again.
const ROUNDS: usize = 3;
/// The end of Tukey's biweight in standard deviations; it is 95 % efficient where all is normal.
const BIWEIGHT: f64 = 4.7;
/// Standard deviation of normal numbers over the median of their absolute values.
const NORMAL: f64 = 1.4826;
/// The prior weight of the given range noise, in residuals.
const KNOWN_NOISE: f64 = 8.0;
/// The fewest cells in common that make a median.
const ENOUGH: usize = 3;
/// A weight below any that matters, against division by 0.
const NOTHING: f64 = 1e-12;

/// The weights of the observations, and what they imply.
pub(super) struct Weights {
    /// The weight of each entry.
    pub weight: Vec<f64>,
    /// The distance of each entry with the slope of the surface taken out, m.
    pub x: Vec<f64>,
    /// The variance of a point, m^2.
    pub noise: f64,
}

/// Iteratively reweighted least squares: estimates the surface, the position of each frame and the weights in turns.
pub(super) fn irls_weights(observed: &CellObservations, range_noise: f64) -> Weights {
    let (entries, cells) = (observed.x.len(), observed.cells());
    let mut found = Weights { weight: observed.count.clone(), x: observed.x.clone(), noise: range_noise * range_noise };
    let mut positions = first_positions(observed);
    let free = entries.saturating_sub(cells + observed.frames() - 1).max(1) as f64;
    let mut residual = vec![0.0; entries];
    for _ in 0..ROUNDS {
        let (mut surface, mut total) = (vec![0.0; cells], vec![NOTHING; cells]);
        for (range, position) in observed.by_frame().zip(&positions) {
            for i in range {
                let (cell, weight) = (observed.cell[i], found.weight[i]);
                surface[cell] += weight * (found.x[i] - position);
                total[cell] += weight;
            }
        }
        surface.iter_mut().zip(&total).for_each(|(sum, total)| *sum /= total);
        let slopes = slopes(observed, &surface, &total);
        for i in 0..entries {
            found.x[i] = observed.x[i] - slopes[observed.cell[i]] * observed.rise[i];
        }
        for (range, position) in observed.by_frame().zip(&mut positions) {
            let (mut sum, mut total) = (0.0, NOTHING);
            for i in range.clone() {
                sum += found.weight[i] * (found.x[i] - surface[observed.cell[i]]);
                total += found.weight[i];
            }
            *position = sum / total;
            for i in range {
                let apart = found.x[i] - surface[observed.cell[i]] - *position;
                residual[i] = apart * apart * observed.count[i];
            }
        }
        let spread = NORMAL * NORMAL * median(&mut residual.clone()) * entries as f64 / free;
        found.noise = (KNOWN_NOISE * range_noise * range_noise + free * spread) / (KNOWN_NOISE + free);
        let end = BIWEIGHT * BIWEIGHT * found.noise;
        for i in 0..entries {
            let inside = (1.0 - residual[i] / end).max(0.0);
            found.weight[i] = observed.count[i] * inside * inside;
        }
    }
    found
}

/// Puts each frame where it agrees best with those before it: at the median of what its cells say.
fn first_positions(observed: &CellObservations) -> Vec<f64> {
    let edge = observed.cells() - 1;
    let mut sums = vec![(0.0, 0.0); observed.cells()];
    let mut differences = Vec::new();
    let mut positions = Vec::with_capacity(observed.frames());
    for range in observed.by_frame() {
        let difference = |i: usize| {
            let (count, sum) = sums[observed.cell[i]];
            (count > 0.0).then(|| observed.x[i] - sum / count)
        };
        differences.clear();
        differences.extend(range.clone().filter(|i| observed.cell[*i] != edge).filter_map(difference));
        if differences.len() < ENOUGH {
            differences.extend(range.clone().filter(|i| observed.cell[*i] == edge).filter_map(difference));
        }
        let position = if differences.is_empty() { 0.0 } else { median(&mut differences) };
        for i in range {
            let (count, sum) = &mut sums[observed.cell[i]];
            *count += observed.count[i];
            *sum += observed.count[i] * (observed.x[i] - position);
        }
        positions.push(position);
    }
    positions
}

/// The most levels between two cells of a column that show the slope of the surface.
const REACH: i32 = 10;
/// A step between two levels that is steeper than this is an edge.
const STEEPEST: f64 = 2.0;

/// The weighted sums of steps ahead and of rises, whose quotient is a mean slope.
#[derive(Clone, Copy, Default)]
struct MeanSlope {
    step: f64,
    rise: f64,
}

impl MeanSlope {
    fn add(&mut self, weight: f64, step: f64, rise: f64) {
        self.step += weight * step;
        self.rise += weight * rise;
    }

    fn value(self) -> f64 {
        self.step / self.rise.max(1e-12)
    }
}

/// The slope of the surface at each cell: how much farther ahead it is for each metre upwards. It is 0 at edges of the
/// surface and for the edge of the body.
///
/// Rings move over the body as it comes nearer, and along a slanted window they would seem to be motion. All columns
/// together decide the slope of a level, by the limiter MC [van Leer 1977].
fn slopes(observed: &CellObservations, surface: &[f64], total: &[f64]) -> Vec<f64> {
    let mut slopes = vec![0.0; observed.cells()];
    let levels = observed.places.iter().map(|place| place.level);
    let (Some(lowest), Some(highest)) = (levels.clone().min(), levels.max()) else { return slopes };
    let number = |place: &Place| usize::try_from(place.level - lowest).unwrap_or(0);
    let size = usize::try_from(highest - lowest).unwrap_or(0) + 1;
    let (mut above, mut below) = (vec![MeanSlope::default(); size], vec![MeanSlope::default(); size]);
    for (i, pair) in observed.places.windows(2).enumerate() {
        let [lower, upper] = [pair[0], pair[1]];
        let (step, rise) = (surface[i + 1] - surface[i], (upper.height - lower.height).max(0.01));
        let joined = lower.column == upper.column && upper.level - lower.level <= REACH;
        if joined && step.abs() <= STEEPEST * rise {
            let weight = total[i].min(total[i + 1]);
            above[number(&lower)].add(weight, step, rise);
            below[number(&upper)].add(weight, step, rise);
        }
    }
    for (slope, place) in slopes.iter_mut().zip(&observed.places) {
        *slope = limited(above[number(place)].value(), below[number(place)].value());
    }
    slopes
}

/// The mean of two slopes, but no more than twice either, and 0 where their signs differ.
fn limited(above: f64, below: f64) -> f64 {
    if above * below <= 0.0 {
        return 0.0;
    }
    let least = (f64::midpoint(above, below).abs()).min(2.0 * above.abs().min(below.abs()));
    least.copysign(above)
}
