//! The plane that fits a cloud best.
//!
//! One pass sorts the points into square metres of ground, and above each a column of voxels. The columns vote for a
//! coarse plane, a Hough transform, which is then refined to fit the columns that agree with it.
//!
//! Near the car a square metre holds thousands of points and far away a few; fitted to points, a road would be the road
//! in front of the bumper. So every square metre counts as one patch.

use super::search::{LAYERS_PER_METRE, RoadSearch};
use super::voxels::{Voxel, voxels};
use crate::cloud::Road;
use crate::lanes::padded;
use crate::points::Points;
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// Finds the plane that fits a cloud best, and counts all patches; `None` where no point could be road.
pub(super) fn plane<T: Real>(points: &Points<'_, T>, search: &RoadSearch, level: Level) -> Option<(Refined, usize)> {
    let voxels = voxels(points, search, level);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the size of the region is checked")]
    let layers = search.shape()[2] as u32;
    let same = |one: &Voxel, next: &Voxel| one.number / layers == next.number / layers;
    let columns: Vec<_> = voxels.chunk_by(same).map(VoxelColumn::new).collect();
    if columns.is_empty() {
        return None;
    }
    let coarse = level.run(HoughVote { columns: &columns, search });
    Some((refine(&columns, coarse, search), columns.len()))
}

/// One in this many points of a column may lie below the road, because reflections do.
const ONE_BELOW_IN: f64 = 10.0;
/// The flatness of a column of which all points are in the ground or just above.
const FLAT: f64 = 1000.0;

/// The voxels above a square metre that hold points.
struct VoxelColumn<'a> {
    voxels: &'a [Voxel],
    /// The mean position of the lowest voxel with no more than a tenth of the points below it, m.
    ground: [f64; 3],
    /// The share of the points in the ground or just above, in whole thousandths: all of them over a road, few where there
    /// is a wall or a bush. Sums of whole numbers are exact in any order, so equal votes are equal.
    flatness: u32,
}

impl<'a> VoxelColumn<'a> {
    /// The column of at least one voxel.
    fn new(voxels: &'a [Voxel]) -> Self {
        let all: f64 = voxels.iter().map(|voxel| voxel.points).sum();
        let mut up_to = 0.0;
        let mut is_low = |voxel: &Voxel| {
            up_to += voxel.points;
            up_to * ONE_BELOW_IN < all
        };
        let lowest = voxels.iter().take_while(|voxel| is_low(voxel)).count();
        let ground = &voxels[lowest];
        let flat = voxels[lowest..].iter().filter(|voxel| voxel.number <= ground.number + 1);
        let flatness = flat.map(|voxel| voxel.points).sum::<f64>() / all;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share")]
        let flatness = (FLAT * flatness).round_ties_even() as u32;
        VoxelColumn { voxels, ground: ground.mean, flatness }
    }
}

/// Two neighbouring slopes of the vote differ by this much in height across the whole region, m. That is little enough
/// for the first step of the refinement.
const SLOPE_STEP: f64 = 0.6;

/// The plane with most votes; of several the flattest, then the lowest.
///
/// Every plane on a grid of slopes and heights that could be the road is tried, and the one that the ground of most
/// columns lies on wins. There is no starting point to get stuck at, and nothing random. Walls and bushes lie on many
/// planes, a little on each, so a vote weighs as much as its column is flat.
struct HoughVote<'a> {
    columns: &'a [VoxelColumn<'a>],
    search: &'a RoadSearch,
}

impl Kernel for HoughVote<'_> {
    type Output = Road;

    #[inline(always)]
    fn run<I: Instructions>(self, _simd: I) -> Road {
        let HoughVote { columns, search } = self;
        let lowest = -search.sensor_height - search.height_tolerance;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a checked number above 0")]
        let bins = ((2.0 * search.height_tolerance * LAYERS_PER_METRE).ceil() as usize).max(2);
        let [x, y, z] = std::array::from_fn(|axis| padded(columns.iter().map(|column| column.ground[axis]), 0.0));
        let flatness = padded(columns.iter().map(|column| column.flatness), 0);
        let (mut along_x, mut place) = (z.clone(), z.clone());
        let mut winner = (0, Road { slope_x: 0.0, slope_y: 0.0, offset: -search.sensor_height });
        let mut below = vec![0; bins + 1]; // the votes below each border of bins
        for slope_x in slopes(search.x, search.max_slope) {
            along_x.iter_mut().zip(&x).zip(&z).for_each(|((along, x), z)| *along = z - slope_x * x);
            for slope_y in slopes(search.y, search.max_slope) {
                for ((place, along), y) in place.iter_mut().zip(&along_x).zip(&y) {
                    *place = (along - slope_y * y - lowest) * LAYERS_PER_METRE;
                }
                for (bin, below) in below.iter_mut().enumerate() {
                    let votes = place.iter().zip(&flatness);
                    *below = votes.map(|(place, flatness)| if *place < bin as f64 { *flatness } else { 0 }).sum();
                }
                // Two bins together, or a road on the border between them would lose half its votes.
                for (bin, below) in below.windows(3).enumerate() {
                    let votes = below[2] - below[0];
                    if votes > winner.0 {
                        let offset = lowest + (bin + 1) as f64 / LAYERS_PER_METRE;
                        winner = (votes, Road { slope_x, slope_y, offset });
                    }
                }
            }
        }
        winner.1
    }
}

/// The slopes of the grid up to the steepest, the flattest first.
fn slopes((low, high): (f64, f64), steepest: f64) -> impl Iterator<Item = f64> {
    #[allow(clippy::cast_possible_truncation, reason = "the size of the region is checked")]
    let steps = (steepest * (high - low) / SLOPE_STEP).ceil() as i32;
    let signed = (1..=steps).flat_map(|step| [-step, step]);
    std::iter::once(0).chain(signed).map(move |step| f64::from(step) * steepest / f64::from(steps.max(1)))
}

/// The tolerance of each step, m, unless that of the search is wider. The first is wide enough for the coarse plane.
const STEPS: [f64; 8] = [0.3, 0.2, 0.15, 0.0, 0.0, 0.0, 0.0, 0.0];
/// The tolerance below the road is this many times that above it: of two planes that a kerb parts, the lower is the
/// road.
const BELOW: f64 = 2.0;

/// A fitted plane, and the patches that it rests on.
#[derive(Clone, Copy)]
pub(super) struct Refined {
    pub road: Road,
    pub inliers: usize,
    pub patches: usize,
    pub width: f64,
    pub rms: f64,
}

/// A square metre of road.
struct Patch {
    mean: [f64; 3],
    points: f64,
    weight: f64,
}

/// Fits the plane again and again to the patches that agree with it, and stops when these are a mere line.
///
/// This is iteratively reweighted least squares with Tukey's biweight [Huber, Robust Statistics; Beaton and Tukey
/// 1974].
fn refine(columns: &[VoxelColumn<'_>], coarse: Road, search: &RoadSearch) -> Refined {
    let mut refined = Refined { road: coarse, inliers: 0, patches: 0, width: 0.0, rms: f64::NAN };
    for step in STEPS {
        let tolerance = search.tolerance.max(step);
        let patches: Vec<_> = columns.iter().filter_map(|column| agreeing(column, &refined.road, tolerance)).collect();
        let moments = Moments::of(&patches);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let inliers = patches.iter().map(|patch| patch.points).sum::<f64>() as usize;
        let seen = Refined { inliers, patches: patches.len(), width: moments.width(), ..refined };
        if seen.width < search.min_width {
            return seen;
        }
        let Ok(road) = moments.plane().checked() else {
            return seen; // a line after all, so long that rounding made it wide
        };
        refined = Refined { road, rms: rms(&patches, &road), ..seen };
    }
    refined
}

/// The part of a column near the road, if its ground is near the road.
fn agreeing(column: &VoxelColumn<'_>, road: &Road, tolerance: f64) -> Option<Patch> {
    let distance = |[x, y, z]: [f64; 3]| {
        let height = road.height(x, y, z);
        height.abs() / if height > 0.0 { tolerance } else { BELOW * tolerance }
    };
    let near = |mean| distance(mean) < 1.0;
    if !near(column.ground) {
        return None;
    }
    let (mut points, mut sum) = (0.0, [0.0; 3]);
    for voxel in column.voxels.iter().filter(|voxel| near(voxel.mean)) {
        points += voxel.points;
        sum = std::array::from_fn(|axis| sum[axis] + voxel.sum[axis]);
    }
    let mean = sum.map(|sum| sum / points);
    let weight = (1.0 - distance(mean).powi(2)).powi(2);
    Some(Patch { mean, points, weight })
}

/// The weighted mean and covariances of patches.
struct Moments {
    weight: f64,
    mean: [f64; 3],
    xx: f64,
    xy: f64,
    yy: f64,
    xz: f64,
    yz: f64,
}

impl Moments {
    fn of(patches: &[Patch]) -> Self {
        let weight: f64 = patches.iter().map(|patch| patch.weight).sum();
        let mean = std::array::from_fn(|axis| average(patches, weight, |patch| patch.mean[axis]));
        let covariance = |a: usize, b: usize| {
            average(patches, weight, |patch| (patch.mean[a] - mean[a]) * (patch.mean[b] - mean[b]))
        };
        let (xx, xy, yy) = (covariance(0, 0), covariance(0, 1), covariance(1, 1));
        Moments { weight, mean, xx, xy, yy, xz: covariance(0, 2), yz: covariance(1, 2) }
    }

    /// The width of an even strip that spreads as much in its narrowest direction, m: the square root of 12 times the
    /// lesser eigenvalue of the covariance.
    fn width(&self) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        let (mean, difference) = (f64::midpoint(self.xx, self.yy), (self.xx - self.yy) / 2.0);
        (12.0 * (mean - difference.hypot(self.xy)).max(0.0)).sqrt()
    }

    /// The plane of least squares. The determinant is no less than the fourth power of the width, over 144.
    fn plane(&self) -> Road {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        let slope_x = (self.xz * self.yy - self.yz * self.xy) / determinant;
        let slope_y = (self.yz * self.xx - self.xz * self.xy) / determinant;
        let [x, y, z] = self.mean;
        Road { slope_x, slope_y, offset: z - slope_x * x - slope_y * y }
    }
}

fn average(patches: &[Patch], weight: f64, of: impl Fn(&Patch) -> f64) -> f64 {
    patches.iter().map(|patch| patch.weight * of(patch)).sum::<f64>() / weight
}

fn rms(patches: &[Patch], road: &Road) -> f64 {
    let weight: f64 = patches.iter().map(|patch| patch.weight).sum();
    let square = |patch: &Patch| road.height(patch.mean[0], patch.mean[1], patch.mean[2]).powi(2);
    average(patches, weight, square).sqrt()
}
