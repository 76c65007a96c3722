//! What the cells of several frames say, side by side.

use super::{Cell, Sighting};

/// How many points the edge of a body is worth: it is 5 times as noisy as a point, as other points make it each time.
const EDGE: f64 = 0.04;

/// One entry for each cell of each frame, frame after frame. The last cell is the edge of the body.
pub(super) struct Witnesses {
    /// Where the entries of each frame begin, and where the last end.
    pub starts: Vec<usize>,
    /// Which cell an entry is of.
    pub cell: Vec<usize>,
    /// Points behind each entry.
    pub count: Vec<f64>,
    /// Their mean distance, m.
    pub x: Vec<f64>,
    /// Their mean height above that of the cell, m.
    pub rise: Vec<f64>,
    /// Column, level and mean height of each cell but the edge.
    pub places: Vec<Place>,
}

/// Where a cell is.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub column: i32,
    pub level: i32,
    /// m
    pub height: f64,
}

impl Witnesses {
    /// Number the cells that more than one frame shows; others say nothing about motion.
    pub fn new(sightings: &[Sighting]) -> Self {
        let at = |cell: &Cell| (cell.column, cell.level);
        let mut shown: Vec<(i32, i32)> =
            sightings.iter().flat_map(|sighting| sighting.profile.cells.iter().map(at)).collect();
        #[allow(clippy::stable_sort_primitive, reason = "it merges what comes in order")]
        shown.sort();
        let mut shared: Vec<(i32, i32)> =
            shown.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect();
        shared.dedup();

        let most = shown.len() + sightings.len();
        let mut seen = Witnesses {
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
                    seen.push(number, cell.count, cell.x, cell.z);
                }
            }
            seen.push(shared.len(), EDGE, *edge, 0.0);
            seen.starts.push(seen.cell.len());
        }
        seen.level_out(&shared);
        seen
    }

    /// How many frames there are.
    pub fn frames(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many cells there are, the edge included.
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

    /// Heights become heights above the mean of their cell.
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
