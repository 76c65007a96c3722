//! Matched keypoints, which of them count, and an order in which whole blocks can be left out.
//!
//! Pairs count only from some distance on, and most of a car's are nearer to each other than that. When neighbours in
//! the picture are neighbours in memory, whole blocks are out of reach of a match.

use crate::column::Column;
use crate::error::Error;
use crate::lanes::{LANES, Lanes, each};
use crate::real::Real;
use crate::simd::Instructions;

/// No picture is this wide, px. A number farther out is not a position, and its square might not be finite.
const FARTHEST: f64 = 1e9;

/// There are fewer matches than this, because the pairs of more would take hours.
pub(super) const MOST: usize = 1 << 20;

/// Matched keypoints in the memory of the caller. Match `i` moved from `previous` number `i` to `current` number `i`.
#[derive(Clone, Copy, Debug)]
pub struct Keypoints<'a, T> {
    /// Columns x and y in the earlier picture, px.
    pub previous: [Column<'a, T>; 2],
    /// Columns x and y in the later picture, px.
    pub current: [Column<'a, T>; 2],
}

/// The x and y before and the x and y now of a group of matches.
pub(super) type Block<T> = [Lanes<T>; 4];

/// The matches that count, in groups of lanes.
///
/// They are copied because each is read about as often as there are others.
pub(super) struct Matches<T> {
    /// All matches, with NaN behind the last.
    blocks: Vec<Block<T>>,
    len: usize,
}

impl<T: Real> Matches<T> {
    /// Gathers every match whose four numbers are positions.
    pub(super) fn gather(keypoints: Keypoints<'_, T>) -> Result<Self, Error> {
        let columns = [keypoints.previous, keypoints.current].concat();
        let len = columns[0].len();
        if let Some(other) = columns.iter().map(Column::len).find(|other| *other != len) {
            let problem = format!("must have one row for each of previous, which has {len}, got {other}");
            return Err(Error::new("current", problem));
        }
        if len >= MOST {
            return Err(Error::new("previous", format!("must have fewer than {MOST} rows, got {len}")));
        }
        let mut matches = Self::with_room(len);
        for i in 0..len {
            let [x0, y0, x1, y1] = [0, 1, 2, 3].map(|column: usize| columns[column].get(i));
            // One by one: an array of them would go through memory in pieces, and the processor would wait for it.
            if is_position(x0) & is_position(y0) & is_position(x1) & is_position(y1) {
                matches.push([x0, y0, x1, y1]);
            }
        }
        Ok(matches)
    }

    /// The matches of some numbers, in their order.
    pub(super) fn select(&self, those: &[usize]) -> Self {
        let mut matches = Self::with_room(those.len());
        for i in those {
            matches.push(self.row(*i));
        }
        matches
    }

    fn with_room(len: usize) -> Self {
        Matches { blocks: Vec::with_capacity(len.div_ceil(LANES)), len: 0 }
    }

    fn push(&mut self, row: [T; 4]) {
        let (at, lane) = (self.len / LANES, self.len % LANES);
        if lane == 0 {
            self.blocks.push([[T::NAN; LANES]; 4]);
        }
        let block = &mut self.blocks[at];
        (0..4).for_each(|column| block[column][lane] = row[column]);
        self.len += 1;
    }

    /// The same matches in another form, block by block.
    #[inline(always)]
    pub(super) fn map<U>(&self, form: impl FnMut(&Block<T>) -> Block<U>) -> Matches<U> {
        Matches { blocks: self.blocks.iter().map(form).collect(), len: self.len }
    }

    /// All matches in groups of lanes, with NaN behind the last.
    #[inline(always)]
    pub(super) fn blocks(&self) -> &[Block<T>] {
        &self.blocks
    }

    /// The number of matches.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// A bit for each lane that holds a match.
    pub(super) fn all(&self) -> Vec<u16> {
        let lanes = |at| u16::MAX >> LANES.saturating_sub(self.len - at);
        (0..self.len).step_by(LANES).map(lanes).collect()
    }

    /// The matches whose bits are set.
    pub(super) fn those(&self, those: &[u16]) -> Self {
        let is_one = |i: &usize| those[i / LANES] >> (i % LANES) & 1 == 1;
        self.select(&(0..self.len).filter(is_one).collect::<Vec<_>>())
    }

    /// Whether there are no matches.
    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The x and y before and the x and y now of match `i`.
    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> [T; 4] {
        let block = &self.blocks[i / LANES];
        [0, 1, 2, 3].map(|column: usize| block[column][i % LANES])
    }

    /// The positions of match `i` before and now.
    #[inline(always)]
    pub(super) fn get(&self, i: usize) -> ([f64; 2], [f64; 2]) {
        let [x0, y0, x1, y1] = self.row(i).map(T::to_f64);
        ([x0, y0], [x1, y1])
    }
}

/// A block in float64.
#[inline(always)]
pub(super) fn widened<T: Real>(block: &Block<T>) -> Block<f64> {
    block.map(|column| each(column, T::to_f64))
}

fn is_position<T: Real>(value: T) -> bool {
    (-FARTHEST..=FARTHEST).contains(&value.to_f64())
}

/// Tiles are worth it from this many matches on. With fewer, patches are too large for any to be left out.
const WORTH_IT: usize = 24 * LANES;

/// Matches in an order in which neighbours in memory are neighbours in the later picture: blocks are patches of it.
pub(super) struct Tiles<T> {
    pub matches: Matches<T>,
    /// The number that each match had before.
    pub order: Vec<usize>,
    /// The bounds of the blocks, a lane for each.
    pub places: Vec<Places<T>>,
}

/// The bounds of some blocks in the later picture: least and largest x, least and largest y.
pub(super) struct Places<T>([Lanes<T>; 4]);

impl<T: Real> Tiles<T> {
    /// Sorts matches into tiles; `None` of too few.
    pub(super) fn new(matches: &Matches<T>) -> Option<Self> {
        if matches.len() < WORTH_IT {
            return None;
        }
        let order = by_cells(matches);
        let matches = matches.select(&order);
        let bounds = matches.blocks().iter().map(|[_, _, x, y]| (bounds(x), bounds(y)));
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
        Some(Tiles { places: places.collect(), order, matches })
    }
}

impl<T: Real> Places<T> {
    /// A bit for each block that may hold a match whose squared distance now from one of some matches is at least
    /// `squared`.
    #[inline(always)]
    pub(super) fn in_reach<I: Instructions, const N: usize>(
        &self,
        simd: I,
        from: &[(usize, [T; 4]); N],
        squared: T,
    ) -> u16 {
        let Places([left, right, top, bottom]) = self;
        let mut farthest = [T::from_f64(-1.0); LANES]; // for lanes without a block
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

/// The largest difference of a number from those between two others.
#[inline(always)]
fn apart<T: Real>(x: T, low: T, high: T) -> T {
    let (above, below) = (x - low, high - x);
    if above > below { above } else { below }
}

/// The least and the largest lane; NaN is passed over.
fn bounds<T: Real>(x: &Lanes<T>) -> (T, T) {
    let (mut low, mut high) = (x[0], x[0]);
    for x in x {
        low = if *x < low { *x } else { low };
        high = if *x > high { *x } else { high };
    }
    (low, high)
}

/// The numbers of the matches, sorted by the cells of a grid over the later picture, row by row, there and back. A cell
/// holds about a block.
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
