//! The robust nearest distance ahead: from the points inside the gate to one distance.
//!
//! A pass gathers the candidates, and an estimator makes one distance of them. Each estimator answers the same
//! question, how far ahead the nearest real thing is, with its own idea of which points are not real. Estimators see
//! candidates only as distances ahead, except for the cluster, which needs points.

use super::buffer::{Candidate, Ranking};
use super::cluster;
use super::gate::{CheckedGate, check_intensity};
use super::pass::Candidates;
use crate::error::{Error, at_least_one, non_negative, positive, share};
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use std::cmp::Ordering;

/// The result of the search for a distance in a cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Detection {
    /// The estimator found a distance.
    Found = 0,
    /// There are valid points, and none inside the gate.
    Clear = 1,
    /// There are candidates, but too few for the estimator.
    TooFew = 2,
    /// There is no valid point at all.
    NoData = 3,
}

/// The robust nearest distance ahead, and the candidates that it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinX {
    /// The estimate, m. NaN when there are too few candidates or no data, infinite when clear.
    pub x: f64,
    /// The plain nearest candidate, m. Infinite when clear, NaN without data.
    pub nearest_x: f64,
    /// The number of points inside the gate.
    pub candidates: usize,
    /// The number of candidates that stand behind the estimate.
    pub support: usize,
    /// The index of the point that the estimate is, if it is a single point.
    pub index: Option<u32>,
    /// The result of the search.
    pub detection: Detection,
}

/// Finds the robust nearest distance ahead of the points inside a gate, by up to `threads` threads.
///
/// # Errors
/// When the estimator makes no sense, or the gate bounds an intensity that the points lack.
pub fn robust_min_x<T: Real>(
    points: &Points<'_, T>,
    gate: &CheckedGate,
    estimator: Estimator,
    level: Level,
    threads: usize,
) -> Result<MinX, Error> {
    let estimator = estimator.checked()?;
    check_intensity(gate, points)?;
    let mut found = Candidates::none(estimator.nearest_needed());
    found.gather(points, gate, level, threads);
    Ok(nearest_of(&mut found, points, gate, estimator, level))
}

/// The robust nearest distance of candidates, which are all, or at least those that the estimator needs.
pub(super) fn nearest_of<T: Real>(
    Candidates { count, kept, .. }: &mut Candidates<T>,
    points: &Points<'_, T>,
    gate: &CheckedGate,
    estimator: Estimator,
    level: Level,
) -> MinX {
    let nothing =
        MinX { x: f64::NAN, nearest_x: f64::NAN, candidates: 0, support: 0, index: None, detection: Detection::NoData };
    if kept.len() == 0 {
        let clear = MinX { x: f64::INFINITY, nearest_x: f64::INFINITY, detection: Detection::Clear, ..nothing };
        return if points.any_valid() { clear } else { nothing };
    }
    let ranking = kept.ranking(level);
    let seen = MinX { nearest_x: ranking.least().to_f64(), candidates: *count, ..nothing };
    match estimator.estimate(&ranking, points, gate, level) {
        None => MinX { detection: Detection::TooFew, ..seen },
        Some(Estimate { x, index, support }) => MinX { x, index, support, detection: Detection::Found, ..seen },
    }
}

/// The way to one distance that survives outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimator {
    /// The nearest candidate. It survives no outlier.
    Minimum,
    /// The `k`-th nearest candidate. It survives `k - 1` stray points.
    KthSmallest(usize),
    /// A quantile by NumPy's linear rule; 0.5 is the median.
    Quantile(f64),
    /// The mean of the `k` nearest candidates.
    MeanOfLowest(usize),
    /// The nearest candidate not below Tukey's fence, Q1 - factor (Q3 - Q1).
    InterquartileFence(f64),
    /// The nearest candidate with at least `points` candidates in `[x, x + gap]`, itself included.
    Supported {
        /// The number of candidates that is enough.
        points: usize,
        /// Length of the interval, m.
        gap: f64,
    },
    /// The nearest point of the nearest group of at least `min_points` points linked by steps of at most `tolerance`.
    Cluster {
        /// The longest link, m.
        tolerance: f64,
        /// The number of points that is enough.
        min_points: usize,
    },
}

impl Estimator {
    /// Returns the estimator if its settings make sense.
    ///
    /// # Errors
    /// When a count is 0, a quantile is outside [0, 1], or a length or factor is negative or not finite.
    #[inline(always)]
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Estimator::Minimum => {}
            Estimator::KthSmallest(k) | Estimator::MeanOfLowest(k) => {
                at_least_one("k", k)?;
            }
            Estimator::Quantile(q) => {
                share("q", q)?;
            }
            Estimator::InterquartileFence(factor) => {
                non_negative("factor", factor)?;
            }
            Estimator::Supported { points, gap } => {
                at_least_one("points", points)?;
                non_negative("gap", gap)?;
            }
            Estimator::Cluster { tolerance, min_points } => {
                at_least_one("min_points", min_points)?;
                positive("tolerance", tolerance)?;
            }
        }
        Ok(self)
    }

    /// The number of nearest candidates that the estimator needs; all if `None`.
    fn nearest_needed(self) -> Option<usize> {
        match self {
            Estimator::Minimum => Some(1),
            Estimator::KthSmallest(k) | Estimator::MeanOfLowest(k) => Some(k),
            _ => None,
        }
    }

    /// The estimate, unless there are too few candidates for one.
    fn estimate<T: Real>(
        self,
        kept: &Ranking<'_, T>,
        points: &Points<'_, T>,
        gate: &CheckedGate,
        level: Level,
    ) -> Option<Estimate> {
        match self {
            Estimator::Minimum => kth(kept, 1),
            Estimator::KthSmallest(k) => kth(kept, k),
            Estimator::MeanOfLowest(k) => mean_of_lowest(kept, k),
            Estimator::Quantile(q) => {
                let x = quantile(kept, q)?;
                let (support, _) = kept.cut(T::not_above(x).above());
                Some(Estimate { x, index: None, support })
            }
            Estimator::InterquartileFence(factor) => fenced(kept, factor),
            Estimator::Supported { points, gap } => supported(kept, points, gap),
            Estimator::Cluster { tolerance, min_points } => {
                let candidates: Vec<Candidate<T>> = kept.iter().collect();
                let position =
                    |candidate: &Candidate<T>| gate.oriented(points.get(candidate.index as usize)).map(T::to_f64);
                let (nearest, support) = cluster::nearest(candidates, tolerance, min_points, level, position)?;
                Some(Estimate { x: nearest.x.to_f64(), index: Some(nearest.index), support })
            }
        }
    }
}

/// A distance, and the candidates that it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate {
    x: f64,
    /// The index of the point that the distance is, if it is a single point.
    index: Option<u32>,
    /// The number of candidates that stand behind it.
    support: usize,
}

/// The `k`-th nearest candidate.
fn kth<T: Real>(kept: &Ranking<'_, T>, k: usize) -> Option<Estimate> {
    (kept.len() >= k).then(|| {
        let Candidate { x, index } = kept.nth(k);
        Estimate { x: x.to_f64(), index: Some(index), support: k }
    })
}

/// The mean of the `k` nearest candidates, added from the nearest on.
fn mean_of_lowest<T: Real>(kept: &Ranking<'_, T>, k: usize) -> Option<Estimate> {
    if kept.len() < k {
        return None;
    }
    let last = kept.nth(k).x;
    let mut lowest = kept.up_to(last.below());
    lowest.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
    lowest.resize(k, last);
    let x = || lowest.iter().map(|x| x.to_f64());
    let mean = x().sum::<f64>() / k as f64;
    // A sum beyond the largest number has a mean all the same.
    let mean = if mean.is_finite() { mean } else { x().map(|x| x / k as f64).sum() };
    Some(Estimate { x: mean, index: None, support: k })
}

/// The quantile by NumPy's linear rule: between the two order statistics around `q (n - 1)`, weighed from the nearer
/// one.
fn quantile<T: Real>(kept: &Ranking<'_, T>, q: f64) -> Option<f64> {
    let last = kept.len().checked_sub(1)?;
    let place = q * last as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "q is in [0, 1]")]
    let below = (place.floor() as usize).min(last);
    let nearer = kept.nth(below + 1).x;
    let low = nearer.to_f64();
    let weight = place - below as f64;
    if weight == 0.0 {
        return Some(low);
    }
    // The next order statistic may be equal.
    let (count, next) = kept.cut(nearer.above());
    let high = if count > below + 1 { low } else { next.to_f64() };
    if high == low {
        return Some(low);
    }
    // From whichever end is nearer, as NumPy does, so that the result never leaves the interval.
    let difference = high - low;
    if difference == f64::INFINITY {
        return Some(low * (1.0 - weight) + high * weight);
    }
    Some(if weight >= 0.5 { high - difference * (1.0 - weight) } else { low + difference * weight })
}

/// The nearest candidate not below the fence.
fn fenced<T: Real>(kept: &Ranking<'_, T>, factor: f64) -> Option<Estimate> {
    let (first, third) = (quantile(kept, 0.25)?, quantile(kept, 0.75)?);
    let range = third - first;
    let spread = if range.is_finite() { factor * range } else { factor * third - factor * first };
    let fence = first - spread;
    if fence.is_nan() {
        return None; // a spread beyond the largest number
    }
    let (outside, _) = kept.cut(T::not_below(fence));
    let Candidate { x, index } = kept.nth(outside + 1);
    Some(Estimate { x: x.to_f64(), index: Some(index), support: kept.len() - outside })
}

/// The nearest candidate with `points` candidates within `gap` behind it.
fn supported<T: Real>(kept: &Ranking<'_, T>, points: usize, gap: f64) -> Option<Estimate> {
    /// The growth of the part that is sorted: at first this many times `points`, then this many times more.
    const MORE: usize = 8;
    let enough = |pair: &[T]| pair[points - 1].to_f64() <= pair[0].to_f64() + gap;
    let mut some = points;
    while kept.len() >= points {
        some = some.saturating_mul(MORE).min(kept.len());
        let limit = kept.nth(some).x;
        let mut nearest = kept.up_to(limit);
        nearest.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
        if let Some(at) = nearest.windows(points).position(enough) {
            let x = nearest[at];
            let (reached, _) = kept.cut(T::not_above(x.to_f64() + gap).above());
            return Some(Estimate { x: x.to_f64(), index: Some(kept.nth(at + 1).index), support: reached - at });
        }
        if some == kept.len() {
            break;
        }
    }
    None
}
