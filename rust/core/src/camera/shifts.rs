//! Quotients of even samples of all pairs.
//!
//! The pairs of matches `i` and `i + shift` hold each match twice, and lie in memory one after the other: sixteen of
//! them are two groups of lanes. Shifts from 1 to half the number of matches, around the end to the beginning, make all
//! pairs. A sample takes one shift from each of as many equal parts of that range. Detectors deliver matches from top to
//! bottom, or on a grid, so the shift is at another place within each part.
//!
//! Order statistics of many quotients are looked for in two steps: a few of them say about where the value is, and only
//! those nearby are sorted.

use super::matches::Matches;
use super::pairs::{Bracket, Rule, in_order, quotients};
use crate::lanes::{LANES, Lanes, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// Matches in columns, the first half of them again behind the last.
pub(super) struct Shifts {
    count: usize,
    columns: [Vec<f64>; 4],
    rule: Rule,
    level: Level,
}

impl Shifts {
    pub(super) fn new<T: Real>(matches: &Matches<T>, rule: Rule, level: Level) -> Self {
        let count = matches.len();
        let column = |column: usize| {
            let mut all = vec![f64::NAN; count + count / 2 + LANES];
            for i in 0..count {
                all[i] = matches.row(i)[column].to_f64();
            }
            all.copy_within(..count / 2, count);
            all
        };
        Shifts { count, columns: std::array::from_fn(column), rule, level }
    }

    /// The number of shifts that make all pairs.
    pub(super) fn all(&self) -> usize {
        self.count / 2
    }

    /// The quotients of the pairs of at most `most` shifts that count.
    pub(super) fn quotients(&self, most: usize) -> Vec<f64> {
        self.level.run(Sample { matches: self, shifts: most.min(self.all()) })
    }
}

/// The step between the places of shifts within their parts.
const STEP: usize = 7;

struct Sample<'m> {
    matches: &'m Shifts,
    shifts: usize,
}

impl Kernel for Sample<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Vec<f64> {
        let Sample { matches: Shifts { count, columns, rule, .. }, shifts } = self;
        let all = count / 2;
        let [x0, y0, x1, y1] = columns;
        let mut kept = Kept::new(shifts * count);
        for part in 0..shifts {
            let (low, high) = (part * all / shifts, (part + 1) * all / shifts);
            let shift = 1 + low + part * STEP % (high - low);
            // Half of an even number of matches leads from one half to the other, and back.
            let end = if 2 * shift == *count { shift } else { *count };
            for i in (0..end).step_by(LANES) {
                let group = |at| [window(x0, at), window(y0, at), window(x1, at), window(y1, at)];
                let quotients = quotients(group(i), group(i + shift), *rule);
                let live = u16::MAX >> LANES.saturating_sub(end - i);
                kept.append(simd, &quotients, f64::within(simd, &quotients, &[0.0; LANES], &[f64::MAX; LANES]) & live);
            }
        }
        kept.values()
    }
}

/// Lanes that are kept, one after the other.
struct Kept {
    values: Vec<f64>,
    len: usize,
}

impl Kept {
    /// Room for a number of values. A call in the inner loop that might ask for more would cost it all its registers.
    fn new(most: usize) -> Self {
        Kept { values: vec![0.0; most + LANES], len: 0 }
    }

    /// Makes room for more values.
    fn reserve(&mut self, more: usize) {
        self.values.resize(self.len + more + LANES, 0.0);
    }

    #[inline(always)]
    fn append<I: Instructions>(&mut self, simd: I, x: &Lanes<f64>, keep: u16) {
        let kept = if keep == u16::MAX { *x } else { f64::compress(simd, x, keep) };
        self.values[self.len..self.len + LANES].copy_from_slice(&kept);
        self.len += keep.count_ones() as usize;
    }

    fn values(mut self) -> Vec<f64> {
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
pub(super) fn bracket(values: &[f64], share: f64, deviations: f64, level: Level) -> Bracket {
    let rough = rough(values, share, deviations.max(DEVIATIONS));
    let (below, mut inside) = level.run(Inside { values, bracket: rough });
    rough.narrowed(&mut inside, below, values.len(), share, deviations)
}

/// The value of a rank, from 0.
pub(super) fn nth(values: &[f64], rank: usize, level: Level) -> f64 {
    let share = (rank as f64 + 0.5) / values.len() as f64;
    let (below, mut inside) = level.run(Inside { values, bracket: rough(values, share, DEVIATIONS) });
    match rank.checked_sub(below).filter(|place| *place < inside.len()) {
        Some(place) => *inside.select_nth_unstable_by_key(place, in_order).1,
        None => *values.to_vec().select_nth_unstable_by_key(rank, in_order).1,
    }
}

/// The share of values that are inside a bracket, by some of them; NaN without any.
pub(super) fn share_inside(values: &[f64], bracket: Bracket) -> f64 {
    let every = if values.len() < FEW { 1 } else { EVERY };
    let inside = values.iter().step_by(every).filter(|value| bracket.holds(**value)).count();
    inside as f64 / values.len().div_ceil(every) as f64
}

fn rough(values: &[f64], share: f64, deviations: f64) -> Bracket {
    if values.len() < FEW {
        return Bracket::ALL;
    }
    let mut sample: Vec<f64> = values.iter().copied().step_by(EVERY).collect();
    let count = sample.len();
    Bracket::ALL.narrowed(&mut sample, 0, count, share, deviations)
}

/// The groups of values that room is made for at a time.
const ROOM: usize = 64;

/// The group of values from a place on, with NaN behind the last.
#[inline(always)]
pub(super) fn group(values: &[f64], at: usize) -> Lanes<f64> {
    let rest = &values[at..];
    rest.first_chunk().copied().unwrap_or_else(|| {
        let mut last = [f64::NAN; LANES];
        last[..rest.len()].copy_from_slice(rest);
        last
    })
}

/// Counts the values below a bracket, and keeps those inside.
struct Inside<'a> {
    values: &'a [f64],
    bracket: Bracket,
}

impl Kernel for Inside<'_> {
    type Output = (usize, Vec<f64>);

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> (usize, Vec<f64>) {
        let Inside { values, bracket: Bracket { low, high } } = self;
        let (mut below, mut kept) = ([0.0; LANES], Kept::new(0));
        for at in (0..values.len()).step_by(LANES) {
            if at % (LANES * ROOM) == 0 {
                kept.reserve(LANES * ROOM);
            }
            let x = group(values, at);
            for lane in 0..LANES {
                below[lane] += if x[lane] < low { 1.0 } else { 0.0 };
            }
            kept.append(simd, &x, f64::within(simd, &x, &[low; LANES], &[high; LANES]));
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let below = below.iter().sum::<f64>() as usize;
        (below, kept.values())
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
                let shifts = Shifts::new(&matches, rule, level);
                let mut found = shifts.quotients(usize::MAX);
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
