//! A tree of boxes over points, to find and take out those near a point.
//!
//! Points that lie together stand together, in groups of one for each lane; sixteen groups, each a box, make a group of the
//! level above, and so on up to a single one. A point is a box without extent, so every level is asked the same.
//!
//! Distances are rounded as a plain loop over all points would round them, and rounding keeps the order of what it rounds:
//! a box is never farther from a point than what is in it, and no link is lost to rounding.

use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::Instructions;

/// x, y and z.
pub(super) type Point = [f64; 3];

/// More levels than points that 32 bits can number need.
const MOST_LEVELS: usize = 9;

/// Points, each of them free until it is taken.
pub(super) struct Tree {
    /// In their places.
    points: Vec<Point>,
    /// Where each is, in the order in which they came.
    places: Vec<u32>,
    /// The groups of points, then the groups of those, up to a single one.
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
    pub(super) fn new(points: impl ExactSizeIterator<Item = Point>) -> Self {
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

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// The point at a place.
    pub(super) fn point(&self, place: u32) -> Point {
        self.points[place as usize]
    }

    /// Whether point `number` is still free.
    pub(super) fn is_free(&self, number: usize) -> bool {
        let place = self.places[number] as usize;
        self.levels[0][place / LANES].free >> (place % LANES) & 1 == 1
    }

    /// Take point `number`; its place joins `found`.
    pub(super) fn take(&mut self, number: usize, found: &mut Vec<u32>) {
        let place = self.places[number];
        self.levels[0][place as usize / LANES].free &= !(1 << (place as usize % LANES));
        found.push(place);
    }

    /// Take all free points whose squared distance from `point` is at most `limit`; their places join `found`.
    #[inline(always)]
    pub(super) fn take_near<I: Instructions>(&mut self, simd: I, point: &Point, limit: f64, found: &mut Vec<u32>) {
        let top = self.levels.len() - 1;
        // On each level the group that is looked at, and its boxes that are still to be.
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
    /// A bit for each box that holds free points and is as near.
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

    /// At most so many boxes as there are lanes.
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

/// Put points that lie together together: halves along the longest axis, and halves of those, down to single groups.
fn arrange(points: &mut [Numbered], mut extent: Point) {
    if points.len() <= LANES {
        return;
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
