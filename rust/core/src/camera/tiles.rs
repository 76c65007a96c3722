//! Matches in patches of the picture, and which patches can be left out.
//!
//! Pairs count only from some distance on, and most of a car's are nearer to each other than that. When neighbours in the
//! picture are neighbours in memory, whole blocks are out of reach of a match.

use super::matches::Matches;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::Instructions;

/// With fewer matches than this, patches are too large for any to be left out.
const WORTH_IT: usize = 24 * LANES;

/// Matches in two orders.
pub(super) struct Tiles<T> {
    /// Those far apart are neighbours: detectors deliver them from top to bottom, and a sample by place in memory has to be
    /// one by place in the picture.
    pub mixed: Matches<T>,
    /// Neighbours are neighbours: blocks are patches of the later picture.
    pub tiled: Matches<T>,
    /// Where the blocks are: a lane for each.
    pub places: Vec<Places<T>>,
}

/// Bounds of some blocks in the later picture: least and largest x, least and largest y.
pub(super) struct Places<T>([Lanes<T>; 4]);

impl<T: Real> Tiles<T> {
    /// None of few matches.
    pub(super) fn new(matches: &Matches<T>) -> Option<Self> {
        if matches.len() < WORTH_IT {
            return None;
        }
        let (mixed, tiled) = (matches.select(&mixed(matches.len())), matches.select(&by_cells(matches)));
        let bounds = tiled.blocks().iter().map(|[_, _, x, y]| (bounds(x), bounds(y)));
        let bounds: Vec<_> = bounds.collect();
        let places = bounds.chunks(LANES).map(|bounds| {
            let mut places = [[T::NAN; LANES]; 4];
            for (lane, ((left, right), (top, bottom))) in bounds.iter().enumerate() {
                for (place, bound) in places.iter_mut().zip([left, right, top, bottom]) {
                    place[lane] = *bound;
                }
            }
            Places(places)
        });
        Some(Tiles { mixed, places: places.collect(), tiled })
    }
}

impl<T: Real> Places<T> {
    /// A bit for each block that may have a match at least so far, squared, from one of some matches now.
    #[inline(always)]
    pub(super) fn in_reach<I: Instructions, const N: usize>(
        &self,
        simd: I,
        from: &[(usize, [T; 4]); N],
        squared: T,
    ) -> u16 {
        let Places([left, right, top, bottom]) = self;
        let mut farthest = [T::from_f64(-1.0); LANES]; // stays where there is no block
        for (_, [_, _, x, y]) in from {
            for lane in 0..LANES {
                let (x, y) = (apart(*x, left[lane], right[lane]), apart(*y, top[lane], bottom[lane]));
                let distance = x * x + y * y;
                farthest[lane] = if distance > farthest[lane] { distance } else { farthest[lane] };
            }
        }
        T::within(simd, &[squared; LANES], &[T::ZERO; LANES], &farthest)
    }
}

/// How far a number can be from those between two others.
#[inline(always)]
fn apart<T: Real>(x: T, low: T, high: T) -> T {
    let (above, below) = (x - low, high - x);
    if above > below { above } else { below }
}

/// The least and the largest, but NaN.
fn bounds<T: Real>(x: &Lanes<T>) -> (T, T) {
    let (mut low, mut high) = (x[0], x[0]);
    for x in x {
        low = if *x < low { *x } else { low };
        high = if *x > high { *x } else { high };
    }
    (low, high)
}

/// All of so many, neighbours far apart.
fn mixed(count: usize) -> Vec<usize> {
    // Steps by the golden ratio, which fill any range evenly. A step that divides the count would come back too soon.
    let mut step = count * 618 / 1000;
    while !is_coprime(step, count) {
        step += 1;
    }
    let following = |at: &usize| Some(if at + step < count { at + step } else { at + step - count });
    std::iter::successors(Some(0), following).take(count).collect()
}

fn is_coprime(mut a: usize, mut b: usize) -> bool {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

/// The matches by cells of a grid over the later picture, row by row, there and back: about a block in each.
fn by_cells<T: Real>(matches: &Matches<T>) -> Vec<usize> {
    let count = matches.len();
    let side = (count as f64 / LANES as f64).sqrt().ceil();
    let positions = (0..count).map(|i| matches.get(i).1);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for position in positions.clone() {
        for axis in 0..2 {
            low[axis] = low[axis].min(position[axis]);
            high[axis] = high[axis].max(position[axis]);
        }
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to less than a side")]
    let cell = |position: [f64; 2]| {
        let [column, row] = [0, 1].map(|axis| {
            let span = high[axis] - low[axis];
            let place = if span > 0.0 { (position[axis] - low[axis]) / span * side } else { 0.0 };
            place.min(side - 1.0) as usize
        });
        let side = side as usize;
        row * side + if row.is_multiple_of(2) { column } else { side - 1 - column }
    };
    let cells: Vec<usize> = positions.map(cell).collect();
    let mut ends = vec![0; cells.iter().max().map_or(0, |last| last + 1)];
    for cell in &cells {
        ends[*cell] += 1;
    }
    let mut end = 0;
    for entry in &mut ends {
        end += *entry;
        *entry = end;
    }
    let mut order = vec![0; count];
    for (i, cell) in cells.iter().enumerate().rev() {
        ends[*cell] -= 1;
        order[ends[*cell]] = i;
    }
    order
}
