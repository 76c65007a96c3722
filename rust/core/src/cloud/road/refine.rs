//! From a coarse plane to a fitted one: iteratively reweighted least squares with Tukey's biweight [Huber, Robust
//! Statistics; Beaton and Tukey 1974].

use super::stacks::Stack;
use super::{Road, RoadSearch};

/// The tolerance of each step, m, unless the final one is wider: wide enough for the coarse plane at first.
const STEPS: [f64; 8] = [0.3, 0.2, 0.15, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Below the road it is so many times as wide as above it: of two planes that a kerb parts, the lower is the road.
const BELOW: f64 = 2.0;

/// A fitted plane, and what it rests on.
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

/// Fit the plane again and again to the patches that agree with it; stop when they are a mere line.
pub(super) fn refine(stacks: &[Stack], coarse: Road, search: &RoadSearch) -> Refined {
    let mut refined = Refined { road: coarse, inliers: 0, patches: 0, width: 0.0, rms: f64::NAN };
    for step in STEPS {
        let tolerance = search.tolerance.max(step);
        let patches: Vec<_> = stacks.iter().filter_map(|stack| agreeing(stack, &refined.road, tolerance)).collect();
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

/// The part of a stack near the road, if its ground is.
fn agreeing(stack: &Stack, road: &Road, tolerance: f64) -> Option<Patch> {
    let distance = |[x, y, z]: [f64; 3]| {
        let height = road.height(x, y, z);
        height.abs() / if height > 0.0 { tolerance } else { BELOW * tolerance }
    };
    let near = |mean| distance(mean) < 1.0;
    if !near(stack.ground) {
        return None;
    }
    let (mut points, mut sum) = (0.0, [0.0; 3]);
    for voxel in stack.voxels.iter().filter(|voxel| near(voxel.mean)) {
        points += voxel.points;
        sum = std::array::from_fn(|axis| sum[axis] + voxel.sum[axis]);
    }
    let mean = sum.map(|sum| sum / points);
    let weight = (1.0 - distance(mean).powi(2)).powi(2);
    Some(Patch { mean, points, weight })
}

/// Weighted mean and covariances of patches.
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

    /// How wide an even strip is that spreads as much in its narrowest direction: the square root of 12 times the lesser
    /// eigenvalue of the covariance.
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
