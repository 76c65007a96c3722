//! Euclidean clustering, as far as the nearest cluster that is large enough.
//!
//! Candidates are taken nearest first. Each that no cluster has yet is the nearest point of a new one, which is grown
//! through a grid of cells as wide as the longest link: all links of a point end in the 27 cells around its own. The
//! first cluster with enough points is the answer, so on most frames one cluster is grown.

use super::candidates::{Candidate, Estimate};
use crate::real::Real;
use rustc_hash::FxHashMap;

type Point = [f64; 3];
type Cell = [i64; 3];

/// The nearest point of the nearest cluster of at least `min_points`.
pub(super) fn nearest<T: Real>(
    candidates: &mut [Candidate<T>],
    tolerance: f64,
    min_points: usize,
    position: impl Fn(&Candidate<T>) -> Point,
) -> Option<Estimate> {
    candidates.sort_unstable_by(Candidate::order);
    let points: Vec<Point> = candidates.iter().map(position).collect();
    let mut grid = Grid::new(&points, tolerance);
    for (seed, candidate) in candidates.iter().enumerate() {
        let support = grid.grow(seed);
        if support >= min_points {
            return Some(Estimate { x: candidate.x.wide(), index: Some(candidate.index), support });
        }
    }
    None
}

/// The end of a list.
const END: u32 = u32::MAX;

/// Points that no cluster has yet, a linked list for each cell.
struct Grid<'a> {
    points: &'a [Point],
    tolerance: f64,
    /// Width of a cell: a hair more than the longest link, so that rounding a coordinate never hides one.
    width: f64,
    /// The first point of each cell.
    first: FxHashMap<Cell, u32>,
    /// The point after each in its cell.
    next: Vec<u32>,
}

impl<'a> Grid<'a> {
    fn new(points: &'a [Point], tolerance: f64) -> Self {
        let (width, next) = (tolerance * (1.0 + 1e-9), vec![END; points.len()]);
        let mut grid = Grid { points, tolerance, width, first: FxHashMap::default(), next };
        for (i, point) in (0..).zip(points) {
            let before = grid.first.insert(grid.cell(point), i);
            grid.next[i as usize] = before.unwrap_or(END);
        }
        grid
    }

    #[allow(clippy::cast_possible_truncation, reason = "the cast saturates; points that far out share a cell")]
    fn cell(&self, point: &Point) -> Cell {
        point.map(|coordinate| (coordinate / self.width).floor() as i64)
    }

    /// Take the cluster of point `seed` out of the grid; how many points it has, 0 if it was taken before.
    fn grow(&mut self, seed: usize) -> usize {
        let mut found = Vec::new();
        self.take(&self.cell(&self.points[seed]), &mut found, |i| i == seed);
        let mut grown = 0;
        while grown < found.len() {
            let point = self.points[found[grown]];
            let [x, y, z] = self.cell(&point);
            let (points, limit) = (self.points, self.tolerance * self.tolerance);
            for step in 0..27 {
                let around = |axis: i64, divisor: i64| axis.saturating_add(step / divisor % 3 - 1);
                let cell = [around(x, 1), around(y, 3), around(z, 9)];
                self.take(&cell, &mut found, |i| squared_distance(&point, &points[i]) <= limit);
            }
            grown += 1;
        }
        found.len()
    }

    /// Take the points of a cell out of the grid that `linked` accepts.
    fn take(&mut self, cell: &Cell, found: &mut Vec<usize>, linked: impl Fn(usize) -> bool) {
        let Some(first) = self.first.get_mut(cell) else { return };
        let (mut at, mut kept) = (*first, END);
        while at != END {
            let (i, next) = (at as usize, self.next[at as usize]);
            if linked(i) {
                found.push(i);
                if kept == END { *first = next } else { self.next[kept as usize] = next }
            } else {
                kept = at;
            }
            at = next;
        }
    }
}

fn squared_distance(a: &Point, b: &Point) -> f64 {
    let apart: Point = std::array::from_fn(|axis| a[axis] - b[axis]);
    apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
}
