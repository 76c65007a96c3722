//! Matched keypoints, and which of them count.

use crate::column::Column;
use crate::error::Error;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;

/// No picture is this wide, px. What lies farther out is not a position, and its square might not be a number.
const FARTHEST: f64 = 1e9;

/// There are fewer matches than this: their pairs would take days.
pub(super) const MOST: usize = 1 << 24;

/// Matched keypoints as the caller has them: match `i` went from `previous` number `i` to `current` number `i`.
#[derive(Clone, Copy, Debug)]
pub struct Keypoints<'a, T> {
    /// x and y in the earlier picture, px.
    pub previous: [Column<'a, T>; 2],
    /// x and y in the later picture, px.
    pub current: [Column<'a, T>; 2],
}

/// x and y before, x and y now, of a group of matches.
pub(super) type Block<T> = [Lanes<T>; 4];

/// The matches that count, one after the other.
///
/// They are gathered because every one is read about as often as there are others.
pub(super) struct Matches<T> {
    /// x and y before, x and y now, of each match.
    rows: Vec<[T; 4]>,
    /// The same in groups of lanes, with NaN behind the last.
    blocks: Vec<Block<T>>,
}

impl<T: Real> Matches<T> {
    /// Every match whose four numbers are positions.
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
        let mut rows = Vec::with_capacity(len);
        for i in 0..len {
            let [x0, y0, x1, y1] = [0, 1, 2, 3].map(|column: usize| columns[column].get(i));
            // One by one: as an array they would go through memory, in pieces, and be waited for.
            if is_position(x0) & is_position(y0) & is_position(x1) & is_position(y1) {
                rows.push([x0, y0, x1, y1]);
            }
        }
        Ok(Self::of(rows))
    }

    /// Some of the matches.
    pub(super) fn select(&self, those: &[usize]) -> Self {
        Self::of(those.iter().map(|i| self.rows[*i]).collect())
    }

    fn of(rows: Vec<[T; 4]>) -> Self {
        let block = |rows: &[[T; 4]]| {
            let mut block = [[T::NAN; LANES]; 4];
            for (lane, row) in rows.iter().enumerate() {
                (0..4).for_each(|column| block[column][lane] = row[column]);
            }
            block
        };
        Matches { blocks: rows.chunks(LANES).map(block).collect(), rows }
    }

    /// All of them in groups of lanes, with NaN behind the last.
    #[inline(always)]
    pub(super) fn blocks(&self) -> &[Block<T>] {
        &self.blocks
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Where match `i` was and where it is.
    #[inline(always)]
    pub(super) fn get(&self, i: usize) -> ([f64; 2], [f64; 2]) {
        let [x0, y0, x1, y1] = self.rows[i].map(T::to_f64);
        ([x0, y0], [x1, y1])
    }
}

fn is_position<T: Real>(value: T) -> bool {
    (-FARTHEST..=FARTHEST).contains(&value.to_f64())
}
