//! Euclidean clustering, as far as the nearest cluster that is large enough.
//!
//! Candidates are taken nearest first. A candidate that belongs to no cluster yet is the nearest point of a new one,
//! which grows point after point: each asks a [`Tree`] of boxes for all that is near and in no cluster yet, until
//! nothing is left. The first cluster with enough points is the answer, so on most frames one cluster is grown. A point
//! that is taken leaves the tree, so that each is found once, however many points lie on one spot.
//!
//! In the tree points that lie together stand together, in groups of one for each lane; sixteen groups, each a box,
//! make a group of the level above, and so on up to a single one. A point is a box without extent, so every level is
//! asked the same.
//!
//! Distances are rounded as a plain loop over all points would round them, and rounding keeps the order of what it
//! rounds: a box is never farther from a point than what is in it, and no link is lost to rounding.

use super::buffer::Candidate;
use crate::interrupt::worked;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use std::iter;

/// The nearest candidates that are sorted at first. The others are sorted only if no cluster of these is large enough.
const LIKELY_SEEDS: usize = 32;

/// Work on more points than this is counted.
const MANY: usize = 4096;

/// The points that ask the tree before their work is counted.
const POINTS_BETWEEN: usize = 1024;

/// The nearest point of the nearest cluster of at least `min_points`, and the number of points in that cluster.
pub(super) fn nearest<T: Real>(
    mut candidates: Vec<Candidate<T>>,
    tolerance: f64,
    min_points: usize,
    level: Level,
    position: impl Fn(&Candidate<T>) -> Point,
) -> Option<(Candidate<T>, usize)> {
    let few = candidates.len().min(LIKELY_SEEDS);
    if few < candidates.len() {
        candidates.select_nth_unstable_by(few, Candidate::order);
    }
    candidates[..few].sort_unstable_by(Candidate::order);
    let tree = Tree::new(candidates.iter().map(position));
    let others = || {
        let mut others: Vec<usize> = (few..candidates.len()).collect();
        others.sort_unstable_by(|a, b| candidates[*a].order(&candidates[*b]));
        others
    };
    let seeds = (0..few).chain(iter::once_with(others).flatten());
    let (seed, support) = level.run(Search { tree, seeds, limit: tolerance * tolerance, min_points })?;
    Some((candidates[seed], support))
}

/// Looks for the first cluster with enough points, and returns its first point and its size.
struct Search<S> {
    tree: Tree,
    /// The numbers of all points, nearest first.
    seeds: S,
    /// The longest link, squared, m^2.
    limit: f64,
    min_points: usize,
}

impl<S: Iterator<Item = usize>> Kernel for Search<S> {
    type Output = Option<(usize, usize)>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Self::Output {
        let Search { mut tree, seeds, limit, min_points } = self;
        let (mut taken, mut asked, mut to_grow) = (0, 0_usize, Vec::with_capacity(tree.len()));
        for seed in seeds {
            if !tree.is_free(seed) {
                continue;
            }
            let others = taken;
            tree.take(seed, &mut to_grow);
            taken += 1;
            // The point found last lies at the rim, so few points find all the others; once none is left to find, the
            // rest need not be asked.
            while taken < tree.len()
                && let Some(place) = to_grow.pop()
            {
                let (point, known) = (tree.point(place), to_grow.len());
                tree.take_near(simd, &point, limit, &mut to_grow);
                taken += to_grow.len() - known;
                asked += 1;
                if asked % POINTS_BETWEEN == 0 {
                    worked(POINTS_BETWEEN * LANES);
                }
            }
            if taken - others >= min_points {
                return Some((seed, taken - others));
            }
        }
        None
    }
}

/// Coordinates forward, left and up, m.
pub(super) type Point = [f64; 3];

/// The number of levels is below this for points that 32 bits can number.
const MOST_LEVELS: usize = 9;

/// A tree of boxes over points, each of them free until it is taken.
struct Tree {
    /// The points in their places.
    points: Vec<Point>,
    /// The place of each point, in the order in which they came.
    places: Vec<u32>,
    /// The groups of points, then the groups of those groups, up to a single one.
    levels: Vec<Vec<Group>>,
}

/// Boxes, one for each lane.
#[derive(Clone)]
struct Group {
    low: [Lanes<f64>; 3],
    high: [Lanes<f64>; 3],
    /// A bit for each box that holds free points.
    free: u16,
}

/// A point, and its number in the order in which points came.
type Numbered = (Point, u32);

impl Tree {
    fn new(points: impl ExactSizeIterator<Item = Point>) -> Self {
        let mut numbered: Vec<Numbered> = points.zip(0..).collect();
        let (low, high) = numbered.iter().fold(NOTHING, |bounds, (point, _)| around(bounds, (*point, *point)));
        arrange(&mut numbered, std::array::from_fn(|axis| high[axis] - low[axis]));
        let mut places = vec![0; numbered.len()];
        for (place, (_, number)) in (0..).zip(&numbered) {
            places[*number as usize] = place;
        }
        let points: Vec<Point> = numbered.into_iter().map(|(point, _)| point).collect();
        let mut boxes: Vec<Bounds> = points.iter().map(|point| (*point, *point)).collect();
        let mut levels = Vec::new();
        while levels.is_empty() || boxes.len() > 1 {
            let groups = boxes.chunks(LANES).map(Group::new).collect();
            boxes = boxes.chunks(LANES).map(|boxes| boxes.iter().copied().fold(NOTHING, around)).collect();
            levels.push(groups);
        }
        Tree { points, places, levels }
    }

    fn len(&self) -> usize {
        self.points.len()
    }

    /// The point at a place.
    fn point(&self, place: u32) -> Point {
        self.points[place as usize]
    }

    /// Whether point `number` is still free.
    fn is_free(&self, number: usize) -> bool {
        let place = self.places[number] as usize;
        self.levels[0][place / LANES].free >> (place % LANES) & 1 == 1
    }

    /// Takes point `number` and adds its place to `found`.
    fn take(&mut self, number: usize, found: &mut Vec<u32>) {
        let place = self.places[number];
        self.levels[0][place as usize / LANES].free &= !(1 << (place as usize % LANES));
        found.push(place);
    }

    /// Takes all free points whose squared distance from `point` is at most `limit`, and adds their places to `found`.
    #[inline(always)]
    fn take_near<I: Instructions>(&mut self, simd: I, point: &Point, limit: f64, found: &mut Vec<u32>) {
        let top = self.levels.len() - 1;
        // On each level the group that is looked at, and those of its boxes that are still to be looked at.
        let (mut at, mut near) = ([0; MOST_LEVELS], [0; MOST_LEVELS]);
        let mut level = top;
        near[top] = self.levels[top][0].near(simd, point, limit);
        loop {
            let group = &mut self.levels[level][at[level]];
            if level == 0 {
                group.free &= !near[0];
                push_places(found, at[0], near[0]);
                near[0] = 0;
            }
            if near[level] != 0 {
                let lane = near[level].trailing_zeros() as usize;
                near[level] &= near[level] - 1;
                let below = at[level] * LANES + lane;
                level -= 1;
                at[level] = below;
                near[level] = self.levels[level][below].near(simd, point, limit);
            } else if level == top {
                return;
            } else {
                let (is_empty, lane) = (group.free == 0, at[level] % LANES);
                level += 1;
                self.levels[level][at[level]].free &= !(u16::from(is_empty) << lane);
            }
        }
    }
}

#[inline(always)]
fn push_places(found: &mut Vec<u32>, group: usize, mut near: u16) {
    while near != 0 {
        #[allow(clippy::cast_possible_truncation, reason = "points are numbered by 32 bits")]
        found.push((group * LANES) as u32 + near.trailing_zeros());
        near &= near - 1;
    }
}

impl Group {
    /// A bit for each box that holds free points and is within `limit`, squared, of `point`.
    #[inline(always)]
    fn near<I: Instructions>(&self, simd: I, point: &Point, limit: f64) -> u16 {
        let mut squared = [0.0; LANES];
        for axis in 0..3 {
            let (low, high, at) = (&self.low[axis], &self.high[axis], point[axis]);
            for lane in 0..LANES {
                let (before, behind) = (low[lane] - at, at - high[lane]);
                let outside = if before > behind { before } else { behind };
                let apart = if outside > 0.0 { outside } else { 0.0 };
                squared[lane] += apart * apart;
            }
        }
        self.free & f64::within(simd, &squared, &[0.0; LANES], &[limit; LANES])
    }

    /// A group of at most as many boxes as there are lanes.
    fn new(boxes: &[Bounds]) -> Self {
        let (low, high) = NOTHING;
        let mut group = Group { low: low.map(|low| [low; LANES]), high: high.map(|high| [high; LANES]), free: 0 };
        for (lane, (low, high)) in boxes.iter().enumerate() {
            for axis in 0..3 {
                (group.low[axis][lane], group.high[axis][lane]) = (low[axis], high[axis]);
            }
            group.free |= 1 << lane;
        }
        group
    }
}

/// The lowest and the highest corner of a box.
type Bounds = (Point, Point);

/// A box that holds nothing.
const NOTHING: Bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);

/// The box around two boxes.
#[inline(always)]
fn around((low, high): Bounds, (other_low, other_high): Bounds) -> Bounds {
    let lower = |a: f64, b: f64| if b < a { b } else { a };
    let higher = |a: f64, b: f64| if b > a { b } else { a };
    let each = |of: fn(f64, f64) -> f64, a: Point, b: Point| std::array::from_fn(|axis| of(a[axis], b[axis]));
    (each(lower, low, other_low), each(higher, high, other_high))
}

/// Sorts points so that neighbours stand together: it halves them along the longest axis, and the halves again, down to
/// single groups.
fn arrange(points: &mut [Numbered], mut extent: Point) {
    if points.len() <= LANES {
        return;
    }
    if points.len() > MANY {
        worked(points.len());
    }
    let axis = (1..3).fold(0, |longest, axis| if extent[axis] > extent[longest] { axis } else { longest });
    // Both halves begin with a whole group, and so on below.
    let half = points.len().next_power_of_two() / 2;
    points.select_nth_unstable_by(half, |(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
    extent[axis] /= 2.0;
    let (before, behind) = points.split_at_mut(half);
    arrange(before, extent);
    arrange(behind, extent);
}
