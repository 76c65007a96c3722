//! The voxels of a region, and the points in them.
//!
//! One pass compares sixteen points at a time with the region, and gathers those groups in batches that have a point in
//! it. Plain loops number the voxels of a batch. A lidar sees a voxel with many points in a row, so the sums of a voxel
//! stay in registers until a point in another comes.

use super::search::{LAYERS_PER_METRE, RoadSearch};
use crate::cloud::Axis;
use crate::column::Source;
use crate::lanes::{LANES, Lanes};
use crate::points::{Layout, OnLayout, Points, Row};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// The voxels that hold points which could be road, square metre after square metre and upwards in each.
pub(super) fn voxels<T: Real>(points: &Points<'_, T>, search: &RoadSearch, level: Level) -> Vec<Voxel> {
    let mut grid = Grid::new(search);
    let mut batch = Batch::new(search);
    points.each_row(0..points.len(), false, |_, row| {
        row.in_layout(0, InRow { row, batch: &mut batch, grid: &mut grid, level });
    });
    level.run(Sort { batch: &mut batch, grid: &mut grid });
    grid.voxels()
}

/// A voxel that holds points.
#[derive(Clone, Copy)]
pub(super) struct Voxel {
    /// The number of the voxel in the region.
    pub number: u32,
    /// The number of points.
    pub points: f64,
    /// The sum of each of their coordinates, m.
    pub sum: [f64; 3],
    /// The mean of each of their coordinates, m.
    pub mean: [f64; 3],
}

/// The voxels of a region, numbered square metre after square metre and upwards in each.
struct Grid {
    /// The least coordinates, m.
    corner: [f64; 3],
    /// The number of the last voxel forward, to the left and up.
    last: [f64; 3],
    /// For each voxel 0 where there is no point, else one more than its place among those that hold points.
    places: Vec<u32>,
    /// The voxels that hold points, in the order in which they were met.
    filled: Vec<Voxel>,
}

impl Grid {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the size of the region is checked")]
    fn new(search: &RoadSearch) -> Self {
        let shape = search.shape();
        let corner = [search.x.0, search.y.0, -search.sensor_height - search.reach()];
        let places = vec![0; shape.iter().product::<f64>() as usize];
        Grid { corner, last: shape.map(|count| count - 1.0), places, filled: Vec::new() }
    }

    /// The voxel of a number.
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "the size of the region is checked")]
    fn voxel(&mut self, number: u32) -> &mut Voxel {
        let place = &mut self.places[number as usize];
        if *place == 0 {
            self.filled.push(Voxel { number, points: 0.0, sum: [0.0; 3], mean: [0.0; 3] });
            *place = self.filled.len() as u32;
        }
        &mut self.filled[*place as usize - 1]
    }

    /// The voxels that hold points, in the order of their numbers.
    fn voxels(mut self) -> Vec<Voxel> {
        self.filled.sort_unstable_by_key(|voxel| voxel.number);
        for Voxel { points, sum, mean, .. } in &mut self.filled {
            *mean = sum.map(|sum| sum / *points);
        }
        self.filled
    }
}

/// The most points of a batch, whose tables stay in the first cache.
const BATCH: usize = 512;

/// Points, of which some could be road.
struct Batch<'a, T> {
    search: &'a RoadSearch,
    /// The box of the region.
    bounds: ([T; 4], [T; 4]),
    len: usize,
    /// The coordinates as stored.
    stored: [[T; BATCH]; 3],
    /// The coordinates forward, left and up, m, and the numbers of the voxels.
    xyz: [[f64; BATCH]; 3],
    number: [u32; BATCH],
}

impl<'a, T: Real> Batch<'a, T> {
    fn new(search: &'a RoadSearch) -> Self {
        let (stored, xyz, number) = ([[T::ZERO; BATCH]; 3], [[0.0; BATCH]; 3], [0; BATCH]);
        let bounds = search.region().expect("the search was checked").as_box();
        Batch { search, bounds, len: 0, stored, xyz, number }
    }
}

/// Gathers the points of a row in batches, and sorts these.
struct InRow<'a, 'p, T> {
    row: &'a Row<'p, T>,
    batch: &'a mut Batch<'p, T>,
    grid: &'a mut Grid,
    level: Level,
}

impl<T: Real> OnLayout<T> for InRow<'_, '_, T> {
    fn run<L: Layout<T>>(self, layout: L) {
        self.level.run(Gather { layout, of: self });
    }
}

struct Gather<'a, 'p, T, L> {
    layout: L,
    of: InRow<'a, 'p, T>,
}

impl<T: Real, L: Layout<T>> Kernel for Gather<'_, '_, T, L> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) {
        let Gather { layout, of: InRow { row, batch, grid, level } } = self;
        let bounds = L::bounds(batch.bounds.0, batch.bounds.1);
        let prefilter = layout.prefilter(batch.bounds.0, batch.bounds.1);
        let mut take = |xyz: [Lanes<T>; 3], count: usize| {
            for (stored, lanes) in batch.stored.iter_mut().zip(&xyz) {
                stored[batch.len..batch.len + LANES].copy_from_slice(lanes);
            }
            batch.len += count;
            if batch.len + LANES > BATCH {
                level.run(Sort { batch, grid });
            }
        };
        let whole = layout.readable() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            if layout.may_hold(simd, at, &prefilter) && layout.inside(simd, at, &bounds) != 0 {
                take(layout.xyz(at), LANES);
            }
        }
        let len = row.xyz[0].len();
        for at in (whole..len).step_by(LANES) {
            take(row.xyz.map(|column| column.lanes_or(at, T::ZERO)), LANES.min(len - at));
        }
    }
}

/// Sorts the points of a batch into voxels, and leaves it empty.
struct Sort<'a, 'p, T> {
    batch: &'a mut Batch<'p, T>,
    grid: &'a mut Grid,
}

/// From here to twice as much, numbers are 1 apart.
const WHOLE: f64 = (1_u64 << 52) as f64;

impl<T: Real> Kernel for Sort<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the last bits of a whole number beyond 2^52 are that less 2^52"
    )]
    fn run<I: Instructions>(self, _simd: I) {
        let Sort { batch: Batch { search, bounds: (low, high), len, stored, xyz, number }, grid } = self;
        let len = std::mem::take(len);
        let axes = search.axes.map(|Axis { column, flipped }| {
            let [low, high] = [low[column], high[column]].map(Real::to_f64);
            (&stored[column][..len], if flipped { (-1.0, -high, -low) } else { (1.0, low, high) })
        });
        let [rows, columns, layers] = grid.last;
        let [ahead, left, up] = grid.corner;
        // Rounded down, as `floor` is a call where a processor may lack the instruction.
        let cell = |at: f64, last: f64| {
            let at = if at > 0.0 { at } else { 0.0 };
            let at = if at < last { at } else { last };
            let nearest = (at + WHOLE) - WHOLE;
            if nearest > at { nearest - 1.0 } else { nearest }
        };
        let nowhere = grid.places.len();
        for i in 0..len {
            let [x, y, z] = axes.map(|(stored, (sign, ..))| sign * stored[i].to_f64());
            let [x_in, y_in, z_in] = [(x, 0), (y, 1), (z, 2)].map(|(at, axis)| {
                let (_, low, high) = axes[axis].1;
                (low <= at) & (at <= high)
            });
            let is_zero = (x == 0.0) & (y == 0.0) & (z == 0.0);
            let is_near = (z + search.sensor_height).abs() <= search.reach_at(x, y);
            let could_be = x_in & y_in & z_in & is_near & !is_zero;
            let square = cell(x - ahead, rows) * (columns + 1.0) + cell(y - left, columns);
            let at = square * (layers + 1.0) + cell((z - up) * LAYERS_PER_METRE, layers);
            let at = if could_be { at } else { nowhere as f64 };
            (xyz[0][i], xyz[1][i], xyz[2][i], number[i]) = (x, y, z, (at + WHOLE).to_bits() as u32);
        }
        let [x, y, z] = xyz.each_ref().map(|of| &of[..len]);
        let (number, mut i) = (&number[..len], 0);
        while let Some(&here) = number.get(i) {
            if here as usize == nowhere {
                i += 1;
                continue;
            }
            let voxel = grid.voxel(here);
            let (first, mut sum) = (i, voxel.sum);
            while number.get(i) == Some(&here) {
                sum = [sum[0] + x[i], sum[1] + y[i], sum[2] + z[i]];
                i += 1;
            }
            voxel.sum = sum;
            voxel.points += (i - first) as f64;
        }
    }
}
