//! The side of a body that faces the sensor, cell by cell.

use super::{Alignment, median};
use crate::cloud::candidates::Candidates;
use crate::cloud::gate::Gate;
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;

/// What is known of a cell with points in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// To the left, in widths of a cell.
    pub column: i32,
    /// Upwards, in heights of a cell.
    pub level: i32,
    /// Points that count.
    pub count: f64,
    /// Their mean distance ahead, m.
    pub x: f64,
    /// Their mean height, m.
    pub z: f64,
}

/// Cells in the order of their columns, upwards in each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// Those with points in them.
    pub cells: Vec<Cell>,
}

/// A point of the body, and the cell it is in.
#[derive(Clone, Copy)]
struct Placed {
    place: u32,
    x: f64,
    z: f64,
}

/// Columns and levels are numbered up to here, to either side.
pub(in crate::cloud) const FARTHEST: i32 = 32_000;
/// Points further from the median of their cell than this times the range noise don't count.
const WIDE: f64 = 3.0;

impl Profile {
    /// Sum up the body in the gate whose nearest point is at `edge`.
    pub(in crate::cloud) fn new<T: Real>(
        points: Points<'_, T>,
        gate: &Gate,
        edge: f64,
        settings: &Alignment,
        level: Level,
    ) -> Self {
        let end = edge + settings.depth;
        // A little further than needed: bounds are rounded to the type of the points.
        let (from, to) = gate.x;
        let nearer = Gate { x: (from, to.min(end + end.abs() * 1e-6)), ..*gate };
        let found = Candidates::gather(points, &nearer, None, level, 1);
        let body =
            found.kept.iter().map(|candidate| (candidate.x.to_f64(), candidate.index)).filter(|(x, _)| *x <= end);
        let mut placed: Vec<Placed> = body
            .map(|(x, index)| {
                let [_, y, z] = gate.oriented(points.get(index as usize)).map(Real::to_f64);
                Placed { place: place(y, z, settings.cell), x, z }
            })
            .collect();
        // Stable, because rings come in order: long runs are sorted already.
        placed.sort_by_key(|point| point.place);
        let mut scratch = Vec::new();
        let wide = WIDE * settings.range_noise;
        let cells = placed.chunk_by(|one, other| one.place == other.place).map(|points| {
            scratch.clear();
            scratch.extend(points.iter().map(|point| point.x));
            sum_up(points, median(&mut scratch), wide)
        });
        Profile { cells: cells.collect() }
    }
}

/// Column and level in one number that orders them.
fn place(y: f64, z: f64, [width, height]: [f64; 2]) -> u32 {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped, and shifted above 0")]
    let number = |at: f64| (at.floor().clamp(-f64::from(FARTHEST), f64::from(FARTHEST)) + f64::from(FARTHEST)) as u32;
    number(y / width) << 16 | number(z / height)
}

/// A cell from its points. Of two that are far apart neither is the majority: both count.
fn sum_up(points: &[Placed], median: f64, wide: f64) -> Cell {
    let near = |point: &Placed| (point.x - median).abs() <= wide;
    let none = !points.iter().any(near);
    let (mut count, mut x, mut z) = (0.0, 0.0, 0.0);
    for point in points.iter().filter(|point| none || near(point)) {
        count += 1.0;
        x += point.x;
        z += point.z;
    }
    let number = |place: u32| place.cast_signed() - FARTHEST;
    let place = points[0].place;
    Cell { column: number(place >> 16), level: number(place & 0xffff), count, x: x / count, z: z / count }
}
