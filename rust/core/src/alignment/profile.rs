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

/// The column and the level of a cell.
pub(super) type Place = (i32, i32);

/// A point of the body, and the cell it is in.
#[derive(Clone, Copy, Default)]
struct Placed {
    place: Place,
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
        let slots = Slots::new(placed.iter().map(|point| point.place));
        let slot: Vec<usize> = placed.iter().map(|point| slots.of(point.place)).collect();
        let mut ends = vec![0; slots.len()];
        for slot in &slot {
            ends[*slot] += 1;
        }
        let mut before = 0;
        for end in &mut ends {
            before += std::mem::replace(end, before);
        }
        let mut sorted = vec![Placed::default(); placed.len()];
        for (slot, point) in slot.into_iter().zip(placed) {
            sorted[ends[slot]] = point;
            ends[slot] += 1;
        }
        let (mut scratch, mut start) = (Vec::new(), 0);
        let farthest = FARTHEST_FROM_MEDIAN * settings.range_noise;
        let cells = ends.into_iter().filter_map(|end| {
            let points = &sorted[std::mem::replace(&mut start, end)..end];
            scratch.clear();
            scratch.extend(points.iter().map(|point| point.x));
            (!points.is_empty()).then(|| sum_up(points, median(&mut scratch), farthest))
        });
        Profile { cells: cells.collect() }
    }
}

/// The cell of a point.
fn place(y: f64, z: f64, [width, height]: [f64; 2]) -> Place {
    let number = |at: f64| {
        let at = at.clamp(-f64::from(FARTHEST), f64::from(FARTHEST));
        #[allow(clippy::cast_possible_truncation, reason = "clamped")]
        let towards_0 = at as i32;
        // `floor` is a call where a processor may lack the instruction.
        towards_0 - i32::from(f64::from(towards_0) > at)
    };
    (number(y / width), number(z / height))
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
    let (column, level) = points[0].place;
    Cell { column, level, count, x: x / count, z: z / count }
}

/// Numbers for all of some places, in the order of columns and upwards in each.
pub(super) struct Slots {
    /// The first column.
    first: i32,
    /// The lowest level.
    pub lowest: i32,
    columns: usize,
    pub levels: usize,
    /// The places in order, where they are too far apart for a number for each place in between.
    sparse: Vec<Place>,
}

/// The most numbers for each place.
const DENSE: usize = 4;
/// The numbers that are few, however few places there are.
const FEW: usize = 64;

impl Slots {
    pub fn new(places: impl Iterator<Item = Place> + Clone) -> Self {
        let (mut least, mut most, mut count) = ([i32::MAX; 2], [i32::MIN; 2], 0);
        places.clone().for_each(|(column, level)| {
            least = [least[0].min(column), least[1].min(level)];
            most = [most[0].max(column), most[1].max(level)];
            count += 1;
        });
        let size = |i: usize| if least[i] > most[i] { 0 } else { most[i].abs_diff(least[i]) as usize + 1 };
        let (columns, levels) = (size(0), size(1));
        let mut sparse = Vec::new();
        if columns * levels > FEW + DENSE * count {
            sparse.extend(places);
            sparse.sort_unstable();
            sparse.dedup();
        }
        Slots { first: least[0], lowest: least[1], columns, levels, sparse }
    }

    pub fn len(&self) -> usize {
        if self.sparse.is_empty() { self.columns * self.levels } else { self.sparse.len() }
    }

    /// The place of a number.
    pub fn place(&self, slot: usize) -> Place {
        let from = |least: i32, above: usize| least.saturating_add_unsigned(u32::try_from(above).unwrap_or(u32::MAX));
        match self.sparse.get(slot) {
            Some(place) => *place,
            None => (from(self.first, slot / self.levels), from(self.lowest, slot % self.levels)),
        }
    }

    /// The number of one of the places.
    #[inline(always)]
    pub fn of(&self, (column, level): Place) -> usize {
        if self.sparse.is_empty() {
            column.abs_diff(self.first) as usize * self.levels + level.abs_diff(self.lowest) as usize
        } else {
            self.sparse.partition_point(|place| *place < (column, level))
        }
    }
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
