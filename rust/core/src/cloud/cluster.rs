//! Euclidean clustering, as far as the nearest cluster that is large enough.
//!
//! Candidates are taken nearest first. Each that no cluster has yet is the nearest point of a new one, which is grown
//! through a grid of cells as wide as the longest link: all links of a point end in the 27 cells around its own. The
//! first cluster with enough points is the answer, so on most frames one cluster is grown.

use super::candidates::Candidate;
use super::estimator::Estimate;
use crate::real::Real;
use std::collections::HashMap;

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

/// Points that no cluster has yet, by cell.
struct Grid<'a> {
    points: &'a [Point],
    tolerance: f64,
    /// Width of a cell: a hair more than the longest link, so that rounding a coordinate never hides one.
    width: f64,
    cells: HashMap<Cell, Vec<usize>>,
}

impl<'a> Grid<'a> {
    fn new(points: &'a [Point], tolerance: f64) -> Self {
        let mut grid = Grid { points, tolerance, width: tolerance * (1.0 + 1e-9), cells: HashMap::new() };
        for (i, point) in points.iter().enumerate() {
            grid.cells.entry(grid.cell(point)).or_default().push(i);
        }
        grid
    }

    #[allow(clippy::cast_possible_truncation, reason = "the cast saturates; points that far out share a cell")]
    fn cell(&self, point: &Point) -> Cell {
        point.map(|coordinate| (coordinate / self.width).floor() as i64)
    }

    /// Take the cluster of point `seed` out of the grid; how many points it has, 0 if it was taken before.
    fn grow(&mut self, seed: usize) -> usize {
        let mut found = self.take(&self.cell(&self.points[seed]), |i| i == seed);
        let mut grown = 0;
        while grown < found.len() {
            let point = self.points[found[grown]];
            let [x, y, z] = self.cell(&point);
            for step in 0..27 {
                let around = |axis: i64, divisor: i64| axis.saturating_add(step / divisor % 3 - 1);
                let cell = [around(x, 1), around(y, 3), around(z, 9)];
                let (points, limit) = (self.points, self.tolerance * self.tolerance);
                found.extend(self.take(&cell, |i| squared_distance(&point, &points[i]) <= limit));
            }
            grown += 1;
        }
        found.len()
    }

    /// Take the points of a cell out of the grid that `linked` accepts.
    fn take(&mut self, cell: &Cell, linked: impl Fn(usize) -> bool) -> Vec<usize> {
        self.cells.get_mut(cell).map_or_else(Vec::new, |members| members.extract_if(.., |i| linked(*i)).collect())
    }
}

fn squared_distance(a: &Point, b: &Point) -> f64 {
    let apart: Point = std::array::from_fn(|axis| a[axis] - b[axis]);
    apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
}
