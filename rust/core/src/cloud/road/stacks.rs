//! The ground in square metres, and above each a stack of voxels.
//!
//! Near the car a square metre holds thousands of points and far away a few; fitted to points, a road would be the road
//! in front of the bumper. So every square metre counts as one patch.

use super::RoadSearch;
use crate::column::Column;
use crate::points::Points;
use crate::real::Real;

/// Voxels are a metre long and wide, and so much less high.
pub(super) const LAYERS_PER_METRE: f64 = 5.0;
/// One in so many points of a stack may lie below the road: reflections do.
const BELOW: f64 = 10.0;

/// Points of a voxel, and the sum of each of their coordinates. Numbers only, so that fresh memory need not be written.
type Sums = [f64; 4];

/// What a voxel holds.
#[derive(Clone, Copy)]
pub(super) struct Voxel {
    /// How many points.
    pub points: f64,
    /// Sum of each of their coordinates, m.
    pub sum: [f64; 3],
    /// Mean of each, m.
    pub mean: [f64; 3],
}

impl Voxel {
    fn new(&[points, x, y, z]: &Sums) -> Self {
        Voxel { points, sum: [x, y, z], mean: [x / points, y / points, z / points] }
    }
}

/// The voxels above a square metre that hold points.
pub(super) struct Stack {
    pub voxels: Vec<Voxel>,
    /// Mean position of the lowest of them, but for a tenth of the points, m.
    pub ground: [f64; 3],
    /// Part of the points that is there or just above: all over a road, few where there is a wall or a bush.
    pub flatness: f64,
}

impl Stack {
    fn new(layers: &[Sums]) -> Option<Self> {
        let all: f64 = layers.iter().map(|[points, ..]| points).sum();
        let mut up_to = 0.0;
        let lowest = layers.iter().position(|[points, ..]| {
            up_to += points;
            up_to > 0.0 && up_to * BELOW >= all
        })?;
        let flat: f64 = layers[lowest..].iter().take(2).map(|[points, ..]| points).sum();
        let voxels = layers.iter().filter(|[points, ..]| *points > 0.0).map(Voxel::new).collect();
        Some(Stack { voxels, ground: Voxel::new(&layers[lowest]).mean, flatness: flat / all })
    }
}

/// One coordinate of the points of a row: where it is stored, and what it may be.
struct Ruler<'a, T> {
    column: Column<'a, T>,
    low: T,
    high: T,
    sign: f64,
}

impl<T: Real> Ruler<'_, T> {
    /// The coordinate of point `i`, if it is in bounds.
    #[inline(always)]
    fn read(&self, i: usize) -> Option<f64> {
        let stored = self.column.get(i);
        (self.low <= stored && stored <= self.high).then(|| self.sign * stored.to_f64())
    }
}

/// Sort the points that could be road into stacks; those without a point are left out.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "distances from a corner of the region")]
pub(super) fn gather<T: Real>(points: &Points<'_, T>, search: &RoadSearch) -> Vec<Stack> {
    let ((x_low, x_high), (y_low, y_high)) = (search.x, search.y);
    let squares = |low: f64, high: f64| ((high - low).ceil() as usize).max(1);
    let (rows, columns) = (squares(x_low, x_high), squares(y_low, y_high));
    let (middle, reach) = (-search.sensor_height, search.reach());
    let layers = (2.0 * reach * LAYERS_PER_METRE).ceil() as usize;
    let mut sums = vec![Sums::default(); rows * columns * layers];

    let (low, high) = search.region().boxed::<T>();
    for (_, row) in points.rows(0..points.len()) {
        let [ahead, across, above] = search.axes.map(|axis| Ruler {
            column: row.xyz[axis.column],
            low: low[axis.column],
            high: high[axis.column],
            sign: if axis.flipped { -1.0 } else { 1.0 },
        });
        for i in 0..row.xyz[0].len() {
            // One after the other: half of the points are behind.
            let Some(x) = ahead.read(i) else { continue };
            let Some(y) = across.read(i) else { continue };
            let Some(z) = above.read(i) else { continue };
            if [x, y, z] == [0.0; 3] {
                continue;
            }
            if (z - middle).abs() > search.reach_at(x, y) {
                continue;
            }
            // The far edges belong to the last square and the last layer.
            let square = ((x - x_low) as usize).min(rows - 1) * columns + ((y - y_low) as usize).min(columns - 1);
            let layer = (((z - (middle - reach)) * LAYERS_PER_METRE) as usize).min(layers - 1);
            let voxel = &mut sums[square * layers + layer];
            *voxel = [voxel[0] + 1.0, voxel[1] + x, voxel[2] + y, voxel[3] + z];
        }
    }
    sums.chunks_exact(layers).filter_map(Stack::new).collect()
}
