//! Which cells of which frames to believe.
//!
//! A cell sees the body at `x = h + p(t)`: the surface `h` of the body at this cell, and the position `p` of the body.
//! Both are estimated in turns with the weights of the observations. What does not move like the rest (a stray point,
//! an edge that is met in one frame and missed in the next, another car) loses its weight, by Tukey's biweight.
//!
//! The observations are a table with a row for each frame and a column for each cell, 0 where a frame does not show a
//! cell. So nearly all of the work are loops along rows, which become lanes.

use super::profile::{Cell, Place, Sighting, Slots};
use crate::lanes::{AlignedTables, LANES, groups, sum};
use crate::real::median;
use crate::simd::{Instructions, Kernel};

/// The weight of the edge of a body, in points. It is 5 times as noisy as a point, because other points make it each
/// time.
const EDGE: f64 = 0.04;

/// What the cells of all frames show: one by one, and side by side in tables. The last cell is the edge of the body.
///
/// Tables hold row after row, and rows are padded to whole groups of lanes.
pub(super) struct CellObservations {
    /// The length of a row.
    pub width: usize,
    /// The observations that are there, frame after frame, that of the edge last in each.
    shown: Vec<Observation>,
    /// The first observation of each frame, and the end of the last.
    starts: Vec<usize>,
    /// The number of points behind each, 0 where there is none, their mean distance and their mean height, m.
    count_x_z: AlignedTables,
    /// The level of each cell but the edge, above the lowest.
    level: Vec<usize>,
    /// The number of levels.
    levels: usize,
    /// The steps that show the slope of the surface.
    steps: Vec<Step>,
}

/// A cell in a frame.
struct Observation {
    cell: usize,
    /// The number of points behind it.
    count: f64,
    /// Their mean distance, m.
    x: f64,
}

impl CellObservations {
    /// Numbers the cells that more than one frame shows; others say nothing about motion.
    pub fn new(sightings: &[Sighting]) -> Self {
        let cells = || sightings.iter().flat_map(|sighting| &sighting.profile.cells);
        let slots = Slots::new(cells().map(|cell| (cell.column, cell.level)));
        let mut seen_in = vec![0_u8; slots.len()]; // at most 16 frames
        cells().for_each(|cell| seen_in[slots.of((cell.column, cell.level))] += 1);
        let (mut number, mut places) = (vec![0; slots.len()], Vec::with_capacity(slots.len()));
        for (slot, number) in number.iter_mut().enumerate().filter(|(slot, _)| seen_in[*slot] > 1) {
            *number = places.len();
            places.push(slots.place(slot));
        }
        let (frames, edge) = (sightings.len(), places.len());
        let width = (edge + 1).next_multiple_of(LANES);
        let mut count_x_z = AlignedTables::new(3, frames * width);
        let [count, seen, z] = count_x_z.write();
        let (mut shown, mut starts) = (Vec::with_capacity(cells().count() + frames), vec![0]);
        for (frame, Sighting { edge: nearest, profile, .. }) in sightings.iter().enumerate() {
            let mut show = |cell: usize, points: f64, x: f64, height: f64| {
                shown.push(Observation { cell, count: points, x });
                let at = frame * width + cell;
                (count[at], seen[at], z[at]) = (points, x, height);
            };
            for &Cell { column, level, count, x, z } in &profile.cells {
                let slot = slots.of((column, level));
                if seen_in[slot] > 1 {
                    show(number[slot], count, x, z);
                }
            }
            show(edge, EDGE, *nearest, 0.0);
            starts.push(shown.len());
        }
        let above_lowest = |level: i32| level.abs_diff(slots.lowest) as usize;
        let level = places.iter().map(|(_, level)| above_lowest(*level)).collect();
        let step = |(cell, pair): (usize, &[Place])| {
            let [(column, lower), (other, upper)] = [pair[0], pair[1]];
            let levels = [lower, upper].map(above_lowest);
            (column == other && upper - lower <= REACH).then_some(Step { cell, levels })
        };
        let steps = places.windows(2).enumerate().filter_map(step).collect();
        CellObservations { width, shown, starts, count_x_z, level, levels: slots.levels, steps }
    }

    /// The number of frames.
    pub fn frames(&self) -> usize {
        self.starts.len() - 1
    }

    /// The observations of each frame.
    #[inline(always)]
    fn by_frame(&self) -> impl Iterator<Item = &[Observation]> {
        self.starts.windows(2).map(|pair| &self.shown[pair[0]..pair[1]])
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
/// Cells that are farther than this from the median of their frame contradict it, in range noises.
const FAR: f64 = 5.0;
/// A weight below any that matters, against division by 0.
const NOTHING: f64 = 1e-12;

/// The weights of the observations, and what they imply.
pub(super) struct Weights {
    /// The weight of each observation, and its distance with the slope of the surface taken out, m.
    pub weight_x: AlignedTables,
    /// The position of the body in each frame, m, by the weights of the last round but one.
    pub positions: Vec<f64>,
    /// The surface at each cell as these positions put it, m, and the weight of the cell, never 0.
    pub surface_total: AlignedTables,
    /// The variance of a point, m^2.
    pub noise: f64,
    /// The variance of each frame because its cells contradict each other, m^2; 0 where they agree.
    pub doubt: Vec<f64>,
}

/// Iteratively reweighted least squares: estimates the surface, the position of each frame and the weights in turns.
pub(super) struct IrlsWeights<'a> {
    pub observed: &'a CellObservations,
    pub range_noise: f64,
}

impl Kernel for IrlsWeights<'_> {
    type Output = Weights;

    #[inline(always)]
    fn run<I: Instructions>(self, _simd: I) -> Weights {
        let IrlsWeights { observed, range_noise } = self;
        let CellObservations { width, ref shown, ref count_x_z, .. } = *observed;
        let [count, seen, z] = count_x_z.read();
        let (mut positions, doubt) = first_positions(observed, FAR * range_noise);
        let (mut weight_x, mut surface_total) = (AlignedTables::new(2, count.len()), AlignedTables::new(6, width));
        let [weight, x] = weight_x.write();
        x.copy_from_slice(seen);
        let [surface, total, before, slope, height, residual] = surface_total.write();
        total.fill(NOTHING);
        for (count, z) in count.chunks_exact(width).zip(z.chunks_exact(width)) {
            for (((total, height), count), z) in total.iter_mut().zip(&mut *height).zip(count).zip(z) {
                *total += count;
                *height += count * z;
            }
        }
        height.iter_mut().zip(&*total).for_each(|(sum, points)| *sum /= points);
        let free = shown.len().saturating_sub(observed.level.len() + observed.frames()).max(1) as f64;
        let (mut noise, mut by) = (range_noise * range_noise, 0.0);
        let mut middle = noise / (NORMAL * NORMAL);
        let mut near = vec![0; shown.len() + 1];
        for round in 0..=ROUNDS {
            // Weights by the residuals of the round before, and the surface that they imply.
            before.copy_from_slice(surface);
            surface.fill(0.0);
            total.fill(0.0);
            for (frame, position) in positions.iter().enumerate() {
                let row = frame * width..(frame + 1) * width;
                let (weight, count, x) = (&mut weight[row.clone()], &count[row.clone()], &x[row]);
                let cells = before.iter().zip(&mut *surface).zip(&mut *total);
                for (((weight, count), x), ((before, surface), total)) in weight.iter_mut().zip(count).zip(x).zip(cells)
                {
                    let apart = x - before - position;
                    let inside = (1.0 - apart * apart * count * by).max(0.0);
                    *weight = count * inside * inside;
                    *surface += *weight * (x - position);
                    *total += *weight;
                }
            }
            for (sum, total) in surface.iter_mut().zip(&mut *total) {
                *total = total.max(NOTHING); // not added: the few weights of a cell may be as small
                *sum /= *total;
            }
            if round == ROUNDS {
                break;
            }
            let slopes = slopes(observed, [surface, total, height]);
            slope.iter_mut().zip(&observed.level).for_each(|(slope, level)| *slope = slopes[*level]);
            for (frame, position) in positions.iter_mut().enumerate() {
                let row = frame * width..(frame + 1) * width;
                let (seen, z) = (&seen[row.clone()], &z[row.clone()]);
                let (weight, x) = (&weight[row.clone()], &mut x[row]);
                for ((((x, seen), z), slope), height) in x.iter_mut().zip(seen).zip(z).zip(&*slope).zip(&*height) {
                    *x = seen - slope * (z - height);
                }
                let (mut ahead, mut all) = ([0.0; LANES], [0.0; LANES]);
                for ((weight, x), surface) in groups(weight).iter().zip(groups(x)).zip(groups(surface)) {
                    for lane in 0..LANES {
                        ahead[lane] += weight[lane] * (x[lane] - surface[lane]);
                        all[lane] += weight[lane];
                    }
                }
                *position = sum(ahead) / sum(all).max(NOTHING);
            }
            let expected = (middle * EXPECTED[round].0, middle * EXPECTED[round].1);
            middle = median_residual(observed, [x, surface, &positions], residual, &mut near, expected);
            let spread = NORMAL * NORMAL * middle * shown.len() as f64 / free;
            noise = (KNOWN_NOISE * range_noise * range_noise + free * spread) / (KNOWN_NOISE + free);
            by = 1.0 / (BIWEIGHT * BIWEIGHT * noise);
        }
        Weights { weight_x, positions, surface_total, noise, doubt }
    }
}

/// The median of each round is expected between these times the one before: residuals shrink from round to round.
const EXPECTED: [(f64, f64); ROUNDS] = [(0.5, 1.5), (0.7, 1.02), (0.7, 1.02)];

/// The median of the squared residuals of all observations, each times the number of its points; infinite where squares
/// overflow. Only those in the `expected` interval are looked at closely; where the median is not among them, all are.
#[inline(always)]
fn median_residual(
    observed: &CellObservations,
    [x, surface, positions]: [&[f64]; 3],
    residual: &mut [f64],
    near: &mut [u64],
    expected: (f64, f64),
) -> f64 {
    let ([count, ..], width) = (observed.count_x_z.read::<3>(), observed.width);
    let (all, upper) = (observed.shown.len(), observed.shown.len() / 2);
    for (low, high) in [expected, (0.0, f64::MAX)] {
        let (mut below, mut len) = (0, 0);
        let rows = x.chunks_exact(width).zip(count.chunks_exact(width));
        for (((x, count), position), shown) in rows.zip(positions).zip(observed.by_frame()) {
            for (((residual, x), surface), count) in residual.iter_mut().zip(x).zip(surface).zip(count) {
                let apart = x - surface - position;
                *residual = apart * apart * count;
            }
            for Observation { cell, .. } in shown {
                let residual = residual[*cell];
                near[len] = residual.to_bits(); // in the order of the numbers, as they are not negative
                below += usize::from(residual < low);
                len += usize::from((low <= residual) & (residual <= high));
            }
        }
        if below < upper && upper < below + len {
            let (before, &mut middle, _) = near[..len].select_nth_unstable(upper - below);
            let lower = before.iter().copied().max().unwrap_or(middle);
            let [lower, middle] = [lower, middle].map(f64::from_bits);
            return if all % 2 == 1 { middle } else { f64::midpoint(lower, middle) };
        }
    }
    f64::INFINITY
}

/// Puts each frame where it agrees best with those before it, and says how far its cells contradict each other.
///
/// That is the median of what its cells say. Where the few rings of a lidar meet other parts of the body in one frame,
/// the cells may fall into two groups, each of which agrees in itself. Then no majority is to be believed: the frame is
/// put where the edge of the body says, with a variance that holds both groups.
#[inline(always)]
fn first_positions(observed: &CellObservations, far: f64) -> (Vec<f64>, Vec<f64>) {
    let [mut points, mut ahead] = std::array::from_fn(|_| vec![0.0; observed.level.len() + 1]);
    let mut differences = Vec::with_capacity(points.len());
    let (mut positions, mut doubt) = (Vec::with_capacity(observed.frames()), vec![0.0; observed.frames()]);
    for (shown, doubt) in observed.by_frame().zip(&mut doubt) {
        differences.clear();
        let known = shown.iter().filter(|seen| points[seen.cell] > 0.0);
        differences.extend(known.map(|seen| seen.x - ahead[seen.cell] / points[seen.cell]));
        // The last is that of the edge.
        let of_edge = if differences.len() > ENOUGH { differences.pop() } else { None };
        let mut position = if differences.is_empty() { 0.0 } else { median(&mut differences) };
        if let Some(of_edge) = of_edge {
            let is_far = |difference: &f64| (difference - position).abs() > far;
            if 4 * differences.iter().filter(|difference| is_far(difference)).count() > differences.len() {
                let mut apart: Vec<f64> =
                    differences.iter().filter(|each| is_far(each)).map(|each| (each - position).abs()).collect();
                *doubt = median(&mut apart).powi(2);
                position = of_edge;
            }
        }
        for &Observation { cell, count, x } in shown {
            points[cell] += count;
            ahead[cell] += count * (x - position);
        }
        positions.push(position);
    }
    (positions, doubt)
}

/// The most levels between two cells of a column that show the slope of the surface.
const REACH: i32 = 10;
/// A step between two levels that is steeper than this is an edge.
const STEEPEST: f64 = 2.0;

/// A step from a cell to the next one above it in the same column.
struct Step {
    /// Number of the lower cell; the upper one follows.
    cell: usize,
    /// The levels of both, above the lowest.
    levels: [usize; 2],
}

/// The weighted sums of steps ahead and of rises, whose quotient is a mean slope.
#[derive(Clone, Copy, Default)]
struct MeanSlope {
    step: f64,
    rise: f64,
}

impl MeanSlope {
    #[inline(always)]
    fn add(&mut self, weight: f64, step: f64, rise: f64) {
        self.step += weight * step;
        self.rise += weight * rise;
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self.step / self.rise.max(1e-12)
    }
}

/// The slope of the surface at each level: how much farther ahead it is for each metre upwards. It is 0 at edges of the
/// surface.
///
/// Rings move over the body as it comes nearer, and along a slanted window they would seem to be motion. All columns
/// together decide the slope of a level, by the limiter MC [van Leer 1977].
#[inline(always)]
fn slopes(observed: &CellObservations, [surface, total, height]: [&[f64]; 3]) -> Vec<f64> {
    let mut sides = vec![[MeanSlope::default(); 2]; observed.levels];
    for &Step { cell, levels: [lower, upper] } in &observed.steps {
        let rise = (height[cell + 1] - height[cell]).max(0.01);
        let step = surface[cell + 1] - surface[cell];
        if step.abs() <= STEEPEST * rise {
            let weight = total[cell].min(total[cell + 1]);
            sides[lower][0].add(weight, step, rise);
            sides[upper][1].add(weight, step, rise);
        }
    }
    sides.into_iter().map(|[above, below]| limited(above.value(), below.value())).collect()
}

/// The mean of two slopes, but no more than twice either, and 0 where their signs differ.
fn limited(above: f64, below: f64) -> f64 {
    if above * below <= 0.0 {
        return 0.0;
    }
    let least = (f64::midpoint(above, below).abs()).min(2.0 * above.abs().min(below.abs()));
    least.copysign(above)
}
