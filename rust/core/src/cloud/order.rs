//! The n-th smallest of many distances, found by counting.
//!
//! Values stay where they are, in groups of lanes, and positive infinity fills the last group. An interval that holds
//! the value is cut in four until as many values are at most one of the cuts as are asked for. Each step is a pass over
//! lanes without a branch. In any order of the values, there are about half as many steps as bits in their number; ties
//! may take half as many as a value has bits.

use crate::lanes::{LANES, Lanes, least};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, alone};

/// One of the values and its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found<T> {
    pub x: T,
    pub place: usize,
}

/// Looks for the first of the least values, and for the greatest of those that are finite; there must be one.
pub(super) struct Ends<'a, T>(pub &'a [Lanes<T>]);

impl<T: Real> Kernel for Ends<'_, T> {
    type Output = (Found<T>, T);

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> (Found<T>, T) {
        let least = not_below(simd, self.0, T::ZERO - T::MAX);
        (first_equal(simd, self.0, least), greatest(simd, self.0, T::MAX))
    }
}

/// Looks for the `n`-th smallest value, from 1; of equal values the one with the lower place comes first.
pub(super) struct Nth<'a, T> {
    /// The values; none is NaN.
    pub values: &'a [Lanes<T>],
    /// The number of finite values, which is at least `n`.
    pub len: usize,
    /// The least and the greatest of them.
    pub ends: (T, T),
    pub n: usize,
}

impl<T: Real> Kernel for Nth<'_, T> {
    type Output = Found<T>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Found<T> {
        let Nth { values, len, ends: (least, greatest), n } = self;
        // Fewer than `n` values are up to `low`, and `count` of them, at least `n`, up to `high`.
        let (mut low, mut high, mut count) = (least.below(), greatest, len);
        while let Some(middle) = T::between(low, high) {
            let before = T::between(low, middle).unwrap_or(low);
            let behind = T::between(middle, high).unwrap_or(middle);
            let cuts = [before, middle, behind];
            for (cut, up_to) in cuts.into_iter().zip(up_to(simd, values, cuts)) {
                if up_to >= n {
                    (high, count) = (cut, up_to);
                    break;
                }
                low = cut;
            }
            if count == n {
                high = self::greatest(simd, values, high);
                break;
            }
        }
        last_equal(simd, values, high, count - n)
    }
}

/// Counts the values below a limit, and finds the least that is not below it.
pub(super) struct Cut<'a, T> {
    pub values: &'a [Lanes<T>],
    pub limit: T,
}

impl<T: Real> Kernel for Cut<'_, T> {
    type Output = (usize, T);

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> (usize, T) {
        let [below] = up_to(simd, self.values, [self.limit.below()]);
        (below, not_below(simd, self.values, self.limit))
    }
}

/// The number of values that are at most each of some limits.
#[inline(always)]
fn up_to<T: Real, I: Instructions, const N: usize>(simd: I, values: &[Lanes<T>], limits: [T; N]) -> [usize; N] {
    /// The groups that are counted at a time, so that the counts in the lanes stay exact.
    const GROUPS: usize = 1 << 16;
    let mut totals = [0; N];
    for some in values.chunks(GROUPS) {
        let counts = if I::BITS { count_bits(simd, some, limits) } else { count_lanes(some, limits) };
        for i in 0..N {
            totals[i] += counts[i];
        }
    }
    totals
}

#[inline(always)]
fn count_bits<T: Real, I: Instructions, const N: usize>(simd: I, values: &[Lanes<T>], limits: [T; N]) -> [usize; N] {
    let mut counts = [0; N];
    for x in values {
        for i in 0..N {
            counts[i] += alone(T::at_most(simd, x, limits[i]).count_ones()) as usize;
        }
    }
    counts
}

#[inline(always)]
fn count_lanes<T: Real, const N: usize>(values: &[Lanes<T>], limits: [T; N]) -> [usize; N] {
    let (one, mut counts) = (T::from_f64(1.0), [[T::ZERO; LANES]; N]);
    for x in values {
        for i in 0..N {
            for lane in 0..LANES {
                counts[i][lane] = counts[i][lane] + if x[lane] <= limits[i] { one } else { T::ZERO };
            }
        }
    }
    let mut sums = [0; N];
    for i in 0..N {
        sums[i] = sum(counts[i]);
    }
    sums
}

/// The sum of the counts in all lanes.
#[inline(always)]
fn sum<T: Real>(mut counts: Lanes<T>) -> usize {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            counts[lane] = counts[lane] + counts[lane + half];
        }
        half /= 2;
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let counted = counts[0].to_f64() as usize;
    counted
}

/// The least value from `limit` on; infinite if there is none.
#[inline(always)]
fn not_below<T: Real, I: Instructions>(simd: I, values: &[Lanes<T>], limit: T) -> T {
    let mut lowest = [T::INFINITY; LANES];
    for x in values {
        let mut above = [T::INFINITY; LANES];
        for lane in 0..LANES {
            above[lane] = if x[lane] >= limit { x[lane] } else { T::INFINITY };
        }
        T::keep_least(simd, &mut lowest, &above);
    }
    least(lowest)
}

/// The greatest value up to `limit`; minus infinity if there is none.
#[inline(always)]
fn greatest<T: Real, I: Instructions>(simd: I, values: &[Lanes<T>], limit: T) -> T {
    let mut lowest = [T::INFINITY; LANES];
    for x in values {
        let mut negated = [T::INFINITY; LANES];
        for lane in 0..LANES {
            negated[lane] = if x[lane] <= limit { T::ZERO - x[lane] } else { T::INFINITY };
        }
        T::keep_least(simd, &mut lowest, &negated);
    }
    T::ZERO - least(lowest)
}

/// The first value equal to `x`.
#[inline(always)]
fn first_equal<T: Real, I: Instructions>(simd: I, values: &[Lanes<T>], x: T) -> Found<T> {
    for (group, lanes) in values.iter().enumerate() {
        let bits = T::within(simd, lanes, &[x; LANES], &[x; LANES]);
        if bits != 0 {
            return found(values, group, bits.trailing_zeros());
        }
    }
    unreachable!("x is one of the values")
}

/// The value equal to `x` that comes before `skipped` others.
#[inline(always)]
fn last_equal<T: Real, I: Instructions>(simd: I, values: &[Lanes<T>], x: T, mut skipped: usize) -> Found<T> {
    for (group, lanes) in values.iter().enumerate().rev() {
        let mut bits = T::within(simd, lanes, &[x; LANES], &[x; LANES]);
        let count = bits.count_ones() as usize;
        if skipped < count {
            for _ in 0..skipped {
                bits ^= 1 << bits.ilog2();
            }
            return found(values, group, bits.ilog2());
        }
        skipped -= count;
    }
    unreachable!("x is one of the values")
}

#[inline(always)]
fn found<T: Real>(values: &[Lanes<T>], group: usize, lane: u32) -> Found<T> {
    let lane = lane as usize % LANES;
    Found { x: values[group][lane], place: group * LANES + lane }
}

#[cfg(test)]
mod tests {
    use super::{Cut, Ends, Found, Nth};
    use crate::lanes::{LANES, padded};
    use crate::real::Real;
    use crate::simd::Level;
    use proptest::prelude::*;

    fn check<T: Real>(values: &[T]) {
        let whole = padded(values.iter().copied(), T::INFINITY);
        let groups = whole.as_chunks::<LANES>().0;
        let mut places: Vec<usize> = (0..values.len()).collect();
        places.sort_by(|a, b| values[*a].to_f64().partial_cmp(&values[*b].to_f64()).expect("no NaN")); // stable
        for level in Level::all() {
            for (n, &place) in places.iter().enumerate() {
                let (least, greatest) = level.run(Ends(groups));
                assert_eq!(least, Found { x: values[places[0]], place: places[0] }, "{level}: {values:?}");
                let ends = (least.x, greatest);
                let found = level.run(Nth { values: groups, len: values.len(), ends, n: n + 1 });
                assert_eq!(found, Found { x: values[place], place }, "{level}: {} of {values:?}", n + 1);
                let limit = values[place];
                let below = values.iter().filter(|x| **x < limit).count();
                assert_eq!(level.run(Cut { values: groups, limit }), (below, limit), "{level}: {values:?}");
            }
        }
    }

    #[test]
    fn ties_zeros_of_both_signs_and_the_smallest_numbers() {
        check(&[0.0_f32, -0.0, 1e-45, -1e-45, 0.0, 1.0, 1.0, f32::MAX, -f32::MAX, 1.0]);
        check(&[0.0_f64, -0.0, 5e-324, -5e-324, 0.0, 1.0, 1.0, f64::MAX, -f64::MAX, 1.0]);
        check(&[2.0_f32; 40]);
    }

    proptest! {
        #[test]
        fn of_any_values(values in prop::collection::vec(-1e6_f32..1e6, 1..100), coarse in prop::bool::ANY) {
            let values: Vec<f32> = values.into_iter().map(|x| if coarse { (x / 2e5).round() } else { x }).collect();
            check(&values);
            check(&values.iter().copied().map(f64::from).collect::<Vec<_>>());
        }
    }
}
