//! Which cells of which frames to believe.
//!
//! A cell sees the body at `x = h + p(t)`: the surface `h` of the body at this cell, and the position `p` of the body.
//! Both are estimated in turns with the weights of the observations. What does not move like the rest (a stray point,
//! an edge that is met in one frame and missed in the next, another car) loses its weight, by Tukey's biweight.
//!
//! The observations are a table with a row for each frame and a column for each cell, 0 where a frame does not show a
//! cell. So nearly all of the work are loops along rows, which become lanes.

use super::profile::{Cell, Profile, Sighting};
use crate::lanes::{LANES, groups, sum};
use crate::real::median;
use crate::simd::{Instructions, Kernel};

/// The weight of the edge of a body, in points. It is 5 times as noisy as a point, because other points make it each
/// time.
const EDGE: f64 = 0.04;

/// What the cells of all frames show side by side. The last cell is the edge of the body.
///
/// Tables hold row after row, and rows are padded to whole groups of lanes.
pub(super) struct CellObservations {
    /// The length of a row.
    pub width: usize,
    /// The number of points behind each observation; 0 where there is none.
    count: Vec<f64>,
    /// The mean distance of each, m.
    seen: Vec<f64>,
    /// The mean height of each above that of its cell, m.
    rise: Vec<f64>,
    /// The cell of each observation, frame after frame, that of the edge last in each.
    cell: Vec<usize>,
    /// The first observation of each frame, and the end of the last.
    starts: Vec<usize>,
    /// The level of each cell but the edge, above the lowest.
    level: Vec<usize>,
    /// The number of levels.
    levels: usize,
    /// The steps that show the slope of the surface.
    steps: Vec<Step>,
}

/// The number of no cell.
const NONE: usize = usize::MAX;

impl CellObservations {
    /// Numbers the cells that more than one frame shows; others say nothing about motion.
    pub fn new(sightings: &[Sighting]) -> Self {
        let slots = Slots::new(sightings);
        let mut shown = vec![0_u8; slots.len()];
        for cell in cells(sightings) {
            shown[slots.of(cell.column, cell.level)] += 1; // of at most 16 frames
        }
        let (mut number, mut places) = (vec![NONE; slots.len()], Vec::new());
        for (slot, number) in number.iter_mut().enumerate().filter(|(slot, _)| shown[*slot] > 1) {
            *number = places.len();
            places.push(slots.place(slot));
        }
        let edge = places.len();
        let width = (edge + 1).next_multiple_of(LANES);
        let [mut count, mut seen, mut rise] = std::array::from_fn(|_| vec![0.0; sightings.len() * width]);
        let (mut cell, mut starts) = (Vec::with_capacity(cells(sightings).count() + sightings.len()), vec![0]);
        for (frame, Sighting { edge: nearest, profile, .. }) in sightings.iter().enumerate() {
            let [count, seen, rise] =
                [&mut count, &mut seen, &mut rise].map(|table| &mut table[frame * width..][..width]);
            for &Cell { column, level, count: some, x, z } in &profile.cells {
                let number = number[slots.of(column, level)];
                if number < edge {
                    (count[number], seen[number], rise[number]) = (some, x, z);
                    cell.push(number);
                }
            }
            (count[edge], seen[edge]) = (EDGE, *nearest);
            cell.push(edge);
            starts.push(cell.len());
        }
        let (mut points, mut height) = (vec![NOTHING; width], vec![0.0; width]);
        for (count, z) in count.chunks_exact(width).zip(rise.chunks_exact(width)) {
            for (((points, height), count), z) in points.iter_mut().zip(&mut height).zip(count).zip(z) {
                *points += count;
                *height += count * z;
            }
        }
        height.iter_mut().zip(&points).for_each(|(sum, points)| *sum /= points);
        for row in rise.chunks_exact_mut(width) {
            row.iter_mut().zip(&height).for_each(|(z, height)| *z -= height);
        }
        let above_lowest = |level: i32| level.abs_diff(slots.lowest) as usize;
        let level = places.iter().map(|(_, level)| above_lowest(*level)).collect();
        let step = |(cell, pair): (usize, &[(i32, i32)])| {
            let [(column, lower), (other, upper)] = [pair[0], pair[1]];
            (column == other && upper - lower <= REACH).then(|| Step {
                cell,
                levels: [lower, upper].map(above_lowest),
                rise: (height[cell + 1] - height[cell]).max(0.01),
            })
        };
        let steps = places.windows(2).enumerate().filter_map(step).collect();
        CellObservations { width, count, seen, rise, cell, starts, level, levels: slots.levels, steps }
    }

    /// The number of frames.
    pub fn frames(&self) -> usize {
        self.starts.len() - 1
    }

    /// The cells that each frame shows.
    #[inline(always)]
    fn shown(&self) -> impl Iterator<Item = &[usize]> {
        self.starts.windows(2).map(|pair| &self.cell[pair[0]..pair[1]])
    }
}

fn cells(sightings: &[Sighting]) -> impl Iterator<Item = &Cell> {
    sightings.iter().flat_map(|Sighting { profile: Profile { cells }, .. }| cells)
}

/// Numbers for all places that sightings show, in the order of columns and upwards in each.
struct Slots {
    /// The first column.
    first: i32,
    /// The lowest level.
    lowest: i32,
    columns: usize,
    levels: usize,
    /// The places in order, where they are too far apart for a number for each place in between.
    sparse: Vec<(i32, i32)>,
}

impl Slots {
    fn new(sightings: &[Sighting]) -> Self {
        let (mut least, mut most) = ([i32::MAX; 2], [i32::MIN; 2]);
        for Cell { column, level, .. } in cells(sightings) {
            least = [least[0].min(*column), least[1].min(*level)];
            most = [most[0].max(*column), most[1].max(*level)];
        }
        let size = |i: usize| if least[i] > most[i] { 0 } else { most[i].abs_diff(least[i]) as usize + 1 };
        let (columns, levels) = (size(0), size(1));
        let mut sparse = Vec::new();
        if columns * levels > DENSE * (LANES + cells(sightings).count()) {
            sparse.extend(cells(sightings).map(|cell| (cell.column, cell.level)));
            sparse.sort_unstable();
            sparse.dedup();
        }
        Slots { first: least[0], lowest: least[1], columns, levels, sparse }
    }

    fn len(&self) -> usize {
        if self.sparse.is_empty() { self.columns * self.levels } else { self.sparse.len() }
    }

    /// The column and the level of a number.
    fn place(&self, slot: usize) -> (i32, i32) {
        let from = |least: i32, above: usize| least.saturating_add_unsigned(u32::try_from(above).unwrap_or(u32::MAX));
        match self.sparse.get(slot) {
            Some(place) => *place,
            None => (from(self.first, slot / self.levels), from(self.lowest, slot % self.levels)),
        }
    }

    #[inline(always)]
    fn of(&self, column: i32, level: i32) -> usize {
        if self.sparse.is_empty() {
            column.abs_diff(self.first) as usize * self.levels + level.abs_diff(self.lowest) as usize
        } else {
            self.sparse.partition_point(|place| *place < (column, level))
        }
    }
}

/// The most places for each cell that is shown.
const DENSE: usize = 4;

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
    /// The weight of each observation.
    pub weight: Vec<f64>,
    /// The distance of each with the slope of the surface taken out, m.
    pub x: Vec<f64>,
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
        let CellObservations { width, ref count, ref seen, ref rise, ref cell, .. } = *observed;
        let (mut positions, doubt) = first_positions(observed, FAR * range_noise);
        let (mut weight, mut x, mut noise) = (count.clone(), seen.clone(), range_noise * range_noise);
        let [mut surface, mut total, mut slope] = std::array::from_fn(|_| vec![0.0; width]);
        let (mut residual, mut residuals) = (vec![0.0; count.len()], Vec::with_capacity(cell.len()));
        let free = cell.len().saturating_sub(observed.level.len() + observed.frames()).max(1) as f64;
        let mut middle = noise / (NORMAL * NORMAL);
        for _ in 0..ROUNDS {
            surface.fill(0.0);
            total.fill(NOTHING);
            for ((weight, x), position) in weight.chunks_exact(width).zip(x.chunks_exact(width)).zip(&positions) {
                for (((surface, total), weight), x) in surface.iter_mut().zip(&mut total).zip(weight).zip(x) {
                    *surface += weight * (x - position);
                    *total += weight;
                }
            }
            surface.iter_mut().zip(&total).for_each(|(sum, total)| *sum /= total);
            let slopes = slopes(observed, &surface, &total);
            slope.iter_mut().zip(&observed.level).for_each(|(slope, level)| *slope = slopes[*level]);
            residuals.clear();
            for (frame, (position, shown)) in positions.iter_mut().zip(observed.shown()).enumerate() {
                let row = frame * width..(frame + 1) * width;
                let (count, seen, rise) = (&count[row.clone()], &seen[row.clone()], &rise[row.clone()]);
                let (weight, x, residual) = (&weight[row.clone()], &mut x[row.clone()], &mut residual[row]);
                for (((x, seen), rise), slope) in x.iter_mut().zip(seen).zip(rise).zip(&slope) {
                    *x = seen - slope * rise;
                }
                let (mut ahead, mut all) = ([0.0; LANES], [0.0; LANES]);
                for ((weight, x), surface) in groups(weight).iter().zip(groups(x)).zip(groups(&surface)) {
                    for lane in 0..LANES {
                        ahead[lane] += weight[lane] * (x[lane] - surface[lane]);
                        all[lane] += weight[lane];
                    }
                }
                *position = sum(ahead) / (sum(all) + NOTHING);
                for (((residual, x), surface), count) in residual.iter_mut().zip(&*x).zip(&surface).zip(count) {
                    let apart = x - surface - *position;
                    *residual = apart * apart * count;
                }
                residuals.extend(shown.iter().map(|cell| residual[*cell]));
            }
            middle = median_near(middle, &mut residuals);
            let spread = NORMAL * NORMAL * middle * cell.len() as f64 / free;
            noise = (KNOWN_NOISE * range_noise * range_noise + free * spread) / (KNOWN_NOISE + free);
            let by = 1.0 / (BIWEIGHT * BIWEIGHT * noise);
            for ((weight, residual), count) in weight.iter_mut().zip(&residual).zip(count) {
                let inside = (1.0 - residual * by).max(0.0);
                *weight = count * inside * inside;
            }
        }
        Weights { weight, x, noise, doubt }
    }
}

/// A median is expected within this factor of a guess.
const NEAR: f64 = 1.5;

/// The median of at least one number that is not negative. It is found sooner where it is near the guess.
#[inline(always)]
fn median_near(guess: f64, values: &mut [f64]) -> f64 {
    let (low, high) = (guess / NEAR, guess * NEAR);
    let below = values.iter().filter(|value| **value < low).count();
    let (mut near, mut len) = (vec![0.0; values.len()], 0);
    for value in &*values {
        near[len] = *value;
        len += usize::from((low <= *value) & (*value <= high));
    }
    let upper = values.len() / 2;
    if below >= upper || upper >= below + len {
        return median(values);
    }
    let (lower, upper, _) = near[..len].select_nth_unstable_by(upper - below, f64::total_cmp);
    let lower = lower.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if values.len() % 2 == 1 { *upper } else { f64::midpoint(lower, *upper) }
}

/// Puts each frame where it agrees best with those before it, and says how far its cells contradict each other.
///
/// That is the median of what its cells say. Where the few rings of a lidar meet other parts of the body in one frame,
/// the cells may fall into two groups, each of which agrees in itself. Then no majority is to be believed: the frame is
/// put where the edge of the body says, with a variance that holds both groups.
#[inline(always)]
fn first_positions(observed: &CellObservations, far: f64) -> (Vec<f64>, Vec<f64>) {
    let [mut points, mut ahead] = std::array::from_fn(|_| vec![0.0; observed.width]);
    let mut differences = Vec::with_capacity(observed.width);
    let (mut positions, mut doubt) = (Vec::with_capacity(observed.frames()), vec![0.0; observed.frames()]);
    let rows = observed.count.chunks_exact(observed.width).zip(observed.seen.chunks_exact(observed.width));
    for (((count, seen), shown), doubt) in rows.zip(observed.shown()).zip(&mut doubt) {
        differences.clear();
        let known = shown.iter().filter(|cell| points[**cell] > 0.0);
        differences.extend(known.map(|cell| seen[*cell] - ahead[*cell] / points[*cell]));
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
        for (((points, ahead), count), seen) in points.iter_mut().zip(&mut ahead).zip(count).zip(seen) {
            *points += count;
            *ahead += count * (seen - position);
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
    /// How much higher the upper one is, m.
    rise: f64,
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
fn slopes(observed: &CellObservations, surface: &[f64], total: &[f64]) -> Vec<f64> {
    let mut sides = vec![[MeanSlope::default(); 2]; observed.levels];
    for &Step { cell, levels: [lower, upper], rise } in &observed.steps {
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
