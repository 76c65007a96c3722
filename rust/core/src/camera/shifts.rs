//! Quotients of even samples of all pairs, or what else a pass wants to know of each pair.
//!
//! The pairs of matches `i` and `i + shift` hold each match twice, and lie in memory one after the other: sixteen of
//! them are two groups of lanes. Shifts from 1 to half the number of matches, around the end to the beginning, make all
//! pairs. A sample takes one shift from each of as many equal parts of that range. Detectors deliver matches from top to
//! bottom, or on a grid, so the shift is at another place within each part.
//!
//! Order statistics of many values are looked for in two steps: a few of them say about where the value is, and only
//! those nearby are sorted.

use super::matches::Matches;
use super::pairs::{Bracket, in_order};
use crate::lanes::{LANES, Lanes, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// What a sample holds of each pair.
pub(super) trait Measure<T>: Copy {
    /// The values of pairs of two groups of matches, lane by lane; NaN where a pair does not count.
    fn of<I: Instructions>(self, simd: I, a: [&Lanes<T>; 4], b: [&Lanes<T>; 4]) -> Lanes<T>;
}

/// Matches in columns, the first half of them again behind the last.
pub(super) struct Shifts<T> {
    count: usize,
    columns: [Vec<T>; 4],
}

impl<T: Real> Shifts<T> {
    pub(super) fn new(matches: &Matches<T>) -> Self {
        let count = matches.len();
        let column = |column: usize| {
            let mut all = Vec::with_capacity(count + count / 2 + 2 * LANES);
            matches.blocks().iter().for_each(|block| all.extend_from_slice(&block[column]));
            all.truncate(count);
            all.extend_from_within(..count / 2);
            all.extend_from_slice(&[T::NAN; LANES]);
            all
        };
        Shifts { count, columns: std::array::from_fn(column) }
    }

    /// The values of the pairs of at most `most` shifts that count.
    pub(super) fn values(&self, measure: impl Measure<T>, most: usize, level: Level) -> Vec<T> {
        // Half the number of matches makes all pairs.
        level.run(Sample { matches: self, measure, shifts: most.min(self.count / 2) })
    }
}

/// The step between the places of shifts within their parts.
const STEP: usize = 7;

struct Sample<'m, T, M> {
    matches: &'m Shifts<T>,
    measure: M,
    shifts: usize,
}

impl<T: Real, M: Measure<T>> Kernel for Sample<'_, T, M> {
    type Output = Vec<T>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Vec<T> {
        let Sample { matches: Shifts { count, columns }, measure, shifts } = self;
        let all = count / 2;
        let [x0, y0, x1, y1] = columns;
        let (least, most) = ([T::ZERO - T::MAX; LANES], [T::MAX; LANES]);
        let mut kept = Kept::new(shifts * count);
        for part in 0..shifts {
            let (low, high) = (part * all / shifts, (part + 1) * all / shifts);
            let shift = 1 + low + part * STEP % (high - low);
            // Half of an even number of matches leads from one half to the other, and back.
            let end = if 2 * shift == *count { shift } else { *count };
            for i in (0..end).step_by(LANES) {
                let group = |at| [window(x0, at), window(y0, at), window(x1, at), window(y1, at)];
                let values = measure.of(simd, group(i), group(i + shift));
                let live = u16::MAX >> LANES.saturating_sub(end - i);
                kept.append(simd, &values, T::within(simd, &values, &least, &most) & live);
            }
        }
        kept.values()
    }
}

/// Lanes that are kept, one after the other.
struct Kept<T> {
    values: Vec<T>,
    len: usize,
}

impl<T: Real> Kept<T> {
    /// Room for a number of values. A call in the inner loop that might ask for more would cost it all its registers.
    fn new(most: usize) -> Self {
        Kept { values: vec![T::ZERO; most + LANES], len: 0 }
    }

    /// Makes room for more values.
    fn reserve(&mut self, more: usize) {
        self.values.resize(self.len + more + LANES, T::ZERO);
    }

    #[inline(always)]
    fn append<I: Instructions>(&mut self, simd: I, x: &Lanes<T>, keep: u16) {
        let kept = if keep == u16::MAX { *x } else { T::compress(simd, x, keep) };
        self.values[self.len..self.len + LANES].copy_from_slice(&kept);
        self.len += keep.count_ones() as usize;
    }

    fn values(mut self) -> Vec<T> {
        self.values.truncate(self.len);
        self.values
    }
}

/// The values of a sample are one of this many.
const EVERY: usize = 16;
/// Fewer values than this are not sampled.
const FEW: usize = 512;
/// The half width of a sample's bracket, in standard deviations of its order statistics.
const DEVIATIONS: f64 = 4.0;

/// The bracket around the value that a share of all values is below, by some of them.
pub(super) fn bracket<T: Real>(values: &[T], share: f64, deviations: f64, level: Level) -> Bracket {
    let rough = rough(values, share, deviations.max(DEVIATIONS));
    let (below, mut inside) = level.run(Inside { values, bracket: rough });
    rough.narrowed(&mut inside, below, values.len(), share, deviations)
}

/// The value of a rank, from 0.
pub(super) fn nth<T: Real>(values: &[T], rank: usize, level: Level) -> T {
    let share = (rank as f64 + 0.5) / values.len() as f64;
    let (below, mut inside) = level.run(Inside { values, bracket: rough(values, share, DEVIATIONS) });
    match rank.checked_sub(below).filter(|place| *place < inside.len()) {
        Some(place) => *inside.select_nth_unstable_by(place, in_order).1,
        None => *values.to_vec().select_nth_unstable_by(rank, in_order).1,
    }
}

/// The share of values that are inside a bracket, by some of them; NaN without any.
pub(super) fn share_inside<T: Real>(values: &[T], bracket: Bracket) -> f64 {
    let every = if values.len() < FEW { 1 } else { EVERY };
    let inside = values.iter().step_by(every).filter(|value| bracket.holds(value.to_f64())).count();
    inside as f64 / values.len().div_ceil(every) as f64
}

fn rough<T: Real>(values: &[T], share: f64, deviations: f64) -> Bracket {
    if values.len() < FEW {
        return Bracket::ALL;
    }
    let mut sample: Vec<T> = values.iter().copied().step_by(EVERY).collect();
    let count = sample.len();
    Bracket::ALL.narrowed(&mut sample, 0, count, share, deviations)
}

/// The groups of values that room is made for at a time.
const ROOM: usize = 64;

/// The group of values from a place on, with NaN behind the last.
#[inline(always)]
pub(super) fn group<T: Real>(values: &[T], at: usize) -> Lanes<T> {
    let rest = &values[at..];
    rest.first_chunk().copied().unwrap_or_else(|| {
        let mut last = [T::NAN; LANES];
        last[..rest.len()].copy_from_slice(rest);
        last
    })
}

/// Counts the values below a bracket, and keeps those inside.
pub(super) struct Inside<'a, T> {
    pub values: &'a [T],
    pub bracket: Bracket,
}

impl<T: Real> Kernel for Inside<'_, T> {
    type Output = (usize, Vec<T>);

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> (usize, Vec<T>) {
        let Inside { values, bracket: Bracket { low, high } } = self;
        let [low, high] = [low, high].map(|end| [T::from_f64(end); LANES]);
        let (mut below, mut kept) = ([0_u32; LANES], Kept::new(0));
        for at in (0..values.len()).step_by(LANES) {
            if at % (LANES * ROOM) == 0 {
                kept.reserve(LANES * ROOM);
            }
            let x = group(values, at);
            for lane in 0..LANES {
                below[lane] += u32::from(x[lane] < low[lane]);
            }
            kept.append(simd, &x, T::within(simd, &x, &low, &high));
        }
        (below.iter().map(|count| *count as usize).sum(), kept.values())
    }
}

#[cfg(test)]
mod tests {
    use super::{Shifts, nth};
    use crate::camera::matches::{Keypoints, Matches};
    use crate::camera::pairs::Rule;
    use crate::column::Column;
    use crate::simd::Level;

    #[test]
    fn all_shifts_make_each_pair_once() {
        let rule = Rule::new(0.0);
        for count in [0, 1, 2, 3, 16, 17, 31, 32, 50] {
            // Hardly two pairs have the same quotient.
            let column =
                |by: usize| -> Vec<f64> { (0..count).map(|i| (i * i * by % 1009) as f64 + 0.1 * i as f64).collect() };
            let [before, now] = [37, 53].map(column);
            let zero = vec![0.0; count];
            let columns = |x| [Column::new(x), Column::new(zero.as_slice())];
            let keypoints = Keypoints { previous: columns(&before), current: columns(&now) };
            let matches = Matches::gather(keypoints).expect("columns of one length");
            let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
            let mut expected: Vec<f64> = pairs.map(|(i, j)| rule.quotient(&matches, i, j).0).collect();
            expected.sort_unstable_by(f64::total_cmp);
            for level in Level::all() {
                let mut found = Shifts::new(&matches).values(rule, usize::MAX, level);
                found.sort_unstable_by(f64::total_cmp);
                assert_eq!(found, expected, "{level}, {count}");
            }
        }
    }

    #[test]
    fn values_of_all_ranks() {
        for count in [1, 15, 16, 17, 700] {
            let values: Vec<f64> = (0..count).map(|i| f64::from((i * 617) % 701 / 2)).collect();
            let mut sorted = values.clone();
            sorted.sort_unstable_by(f64::total_cmp);
            for level in Level::all() {
                for (rank, value) in sorted.iter().enumerate() {
                    assert_eq!(nth(&values, rank, level), *value, "{level}, {rank} of {count}");
                }
            }
        }
    }
}
