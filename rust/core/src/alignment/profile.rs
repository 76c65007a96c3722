//! The side of a body that faces the sensor, summed up cell by cell in each frame.

use crate::error::{Error, positive};
use crate::real::median;

/// Settings of the alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Width and height of a cell, m.
    pub cell: [f64; 2],
    /// The points of a body count up to this far behind its nearest point, m.
    pub depth: f64,
    /// The age up to which frames count, s.
    pub window: f64,
    /// Standard deviation of a range, m.
    pub range_noise: f64,
}

impl Default for Alignment {
    fn default() -> Self {
        Alignment { cell: [0.2, 0.05], depth: 0.8, window: 1.0, range_noise: 0.02 }
    }
}

impl Alignment {
    /// Returns the settings if they make sense.
    ///
    /// # Errors
    /// When a setting is not above 0 and finite.
    pub fn checked(self) -> Result<Self, Error> {
        let [width, height] = self.cell;
        let settings = [("cell", width), ("cell", height), ("depth", self.depth), ("window", self.window)];
        for (name, value) in settings.into_iter().chain([("range_noise", self.range_noise)]) {
            positive(name, value)?;
        }
        Ok(self)
    }
}

/// A cell with points in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Number of the cell to the left, in widths of a cell.
    pub column: i32,
    /// Number of the cell upwards, in heights of a cell.
    pub level: i32,
    /// The number of points that count.
    pub count: f64,
    /// The mean distance ahead of these points, m.
    pub x: f64,
    /// The mean height of these points, m.
    pub z: f64,
}

/// A body in one frame: its cells in the order of their columns, upwards in each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// The cells with points in them.
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
pub(crate) const FARTHEST: i32 = 32_000;
/// Points farther from the median of their cell than this times the range noise do not count.
const FARTHEST_FROM_MEDIAN: f64 = 3.0;

impl Profile {
    /// Sums up the points of a body, each as (ahead, left, up), m.
    pub(crate) fn new(body: impl Iterator<Item = [f64; 3]>, settings: &Alignment) -> Self {
        let mut placed = Vec::with_capacity(body.size_hint().1.unwrap_or(0));
        placed.extend(body.map(|[x, y, z]| Placed { place: place(y, z, settings.cell), x, z }));
        // Numbers sort faster than points.
        let key = |(i, point): (usize, &Placed)| u64::from(point.place) << 32 | i as u64;
        let mut keys: Vec<u64> = placed.iter().enumerate().map(key).collect();
        keys.sort_unstable();
        #[allow(clippy::cast_possible_truncation, reason = "the lower half is the number of a point")]
        let placed: Vec<Placed> = keys.into_iter().map(|key| placed[key as u32 as usize]).collect();
        let mut scratch = Vec::new();
        let farthest = FARTHEST_FROM_MEDIAN * settings.range_noise;
        let cells = placed.chunk_by(|one, other| one.place == other.place).map(|points| {
            scratch.clear();
            scratch.extend(points.iter().map(|point| point.x));
            sum_up(points, median(&mut scratch), farthest)
        });
        Profile { cells: cells.collect() }
    }
}

/// Column and level in one number that orders them.
fn place(y: f64, z: f64, [width, height]: [f64; 2]) -> u32 {
    let number = |at: f64| {
        let at = at.clamp(-f64::from(FARTHEST), f64::from(FARTHEST));
        #[allow(clippy::cast_possible_truncation, reason = "clamped")]
        let towards_0 = at as i32;
        // `floor` is a call where a processor may lack the instruction.
        (towards_0 - i32::from(f64::from(towards_0) > at) + FARTHEST).cast_unsigned()
    };
    number(y / width) << 16 | number(z / height)
}

/// A cell from its points. Of two points far apart neither is the majority, so both count.
fn sum_up(points: &[Placed], median: f64, farthest: f64) -> Cell {
    let near = |point: &Placed| (point.x - median).abs() <= farthest;
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

/// A body in one frame: its stamp, its edge and its profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Stamp of the frame, s.
    pub stamp: f64,
    /// The robust nearest distance, m.
    pub edge: f64,
    /// The side that faces the sensor.
    pub profile: Profile,
}
