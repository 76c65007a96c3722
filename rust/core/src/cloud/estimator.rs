//! From the candidates to one distance.
//!
//! Each estimator answers the same question, how far ahead the nearest real thing is, with its own idea of which points are
//! not real. They see candidates only as distances ahead, except for the cluster, which needs points.

use super::candidates::{Candidate, Estimate};
use super::cluster;
use super::gate::Gate;
use super::kept::Kept;
use crate::error::{Error, at_least_one, non_negative, positive, share};
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use std::cmp::Ordering;

/// How outliers are survived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimator {
    /// The nearest candidate: survives nothing.
    Minimum,
    /// The `k`-th nearest: survives `k - 1` stray points.
    KthSmallest(usize),
    /// A quantile by linear interpolation, NumPy's rule; 0.5 is the median.
    Quantile(f64),
    /// The mean of the `k` nearest.
    MeanOfLowest(usize),
    /// The nearest not below Q1 - factor (Q3 - Q1), Tukey's fence.
    InterquartileFence(f64),
    /// The nearest with at least `points` candidates in `[x, x + gap]`, itself included.
    Supported {
        /// How many candidates are enough.
        points: usize,
        /// Within how much more distance, m.
        gap: f64,
    },
    /// The nearest point of the nearest group of at least `min_points` points linked by steps of at most `tolerance`.
    Cluster {
        /// Longest link, m.
        tolerance: f64,
        /// How many points are enough.
        min_points: usize,
    },
}

impl Estimator {
    /// The estimator, if its settings make sense.
    ///
    /// # Errors
    /// When a count is 0, a quantile is outside [0, 1], or a length or factor is negative or not finite.
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

    /// How many of the nearest candidates it needs; all if `None`.
    pub(super) fn wanted(self) -> Option<usize> {
        match self {
            Estimator::Minimum => Some(1),
            Estimator::KthSmallest(k) | Estimator::MeanOfLowest(k) => Some(k),
            _ => None,
        }
    }

    /// The estimate, unless there are too few candidates for one.
    pub(super) fn estimate<T: Real>(
        self,
        kept: &mut Kept<T>,
        points: &Points<'_, T>,
        gate: &Gate,
        level: Level,
    ) -> Option<Estimate> {
        match self {
            Estimator::Minimum => kth(kept, 1, level),
            Estimator::KthSmallest(k) => kth(kept, k, level),
            Estimator::MeanOfLowest(k) => mean_of_lowest(kept, k, level),
            Estimator::Quantile(q) => {
                let x = quantile(kept, q, level)?;
                let (support, _) = kept.cut(T::not_above(x).above(), level);
                Some(Estimate { x, index: None, support })
            }
            Estimator::InterquartileFence(factor) => fenced(kept, factor, level),
            Estimator::Supported { points, gap } => supported(kept, points, gap, level),
            Estimator::Cluster { tolerance, min_points } => {
                let candidates: Vec<Candidate<T>> = kept.iter().collect();
                cluster::nearest(candidates, tolerance, min_points, level, |candidate| {
                    gate.oriented(points.get(candidate.index as usize)).map(T::to_f64)
                })
            }
        }
    }
}

/// The `k`-th nearest.
fn kth<T: Real>(kept: &mut Kept<T>, k: usize, level: Level) -> Option<Estimate> {
    (kept.len() >= k).then(|| {
        let Candidate { x, index } = kept.nth(k, level);
        Estimate { x: x.to_f64(), index: Some(index), support: k }
    })
}

/// The mean of the `k` nearest, added from the nearest on.
fn mean_of_lowest<T: Real>(kept: &mut Kept<T>, k: usize, level: Level) -> Option<Estimate> {
    if kept.len() < k {
        return None;
    }
    kept.thin(k, level);
    let mut lowest: Vec<Candidate<T>> = kept.iter().collect();
    lowest.sort_unstable_by(Candidate::order);
    let x = || lowest.iter().map(|candidate| candidate.x.to_f64());
    let mean = x().sum::<f64>() / k as f64;
    // A sum beyond the largest number has a mean all the same.
    let mean = if mean.is_finite() { mean } else { x().map(|x| x / k as f64).sum() };
    Some(Estimate { x: mean, index: None, support: k })
}

/// NumPy's linear rule: between the two order statistics around `q (n - 1)`, weighed from the nearer one.
fn quantile<T: Real>(kept: &mut Kept<T>, q: f64, level: Level) -> Option<f64> {
    let last = kept.len().checked_sub(1)?;
    let place = q * last as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "q is in [0, 1]")]
    let below = (place.floor() as usize).min(last);
    let nearer = kept.nth(below + 1, level).x;
    let low = nearer.to_f64();
    let weight = place - below as f64;
    if weight == 0.0 {
        return Some(low);
    }
    // The next may be as near.
    let (count, next) = kept.cut(nearer.above(), level);
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

/// The nearest not below the fence.
fn fenced<T: Real>(kept: &mut Kept<T>, factor: f64, level: Level) -> Option<Estimate> {
    let (first, third) = (quantile(kept, 0.25, level)?, quantile(kept, 0.75, level)?);
    let range = third - first;
    let spread = if range.is_finite() { factor * range } else { factor * third - factor * first };
    let fence = first - spread;
    if fence.is_nan() {
        return None; // a spread beyond the largest number
    }
    let (outside, _) = kept.cut(T::not_below(fence), level);
    let Candidate { x, index } = kept.nth(outside + 1, level);
    Some(Estimate { x: x.to_f64(), index: Some(index), support: kept.len() - outside })
}

/// The nearest with `points` candidates within `gap` behind it.
fn supported<T: Real>(kept: &mut Kept<T>, points: usize, gap: f64, level: Level) -> Option<Estimate> {
    /// So many times as many of the nearest are sorted as are asked for, then so many times more.
    const MORE: usize = 8;
    let enough = |pair: &[T]| pair[points - 1].to_f64() <= pair[0].to_f64() + gap;
    let mut some = points;
    while kept.len() >= points {
        some = some.saturating_mul(MORE).min(kept.len());
        let limit = kept.nth(some, level).x;
        let mut nearest = kept.up_to(limit);
        nearest.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
        if let Some(at) = nearest.windows(points).position(enough) {
            let x = nearest[at];
            let (reached, _) = kept.cut(T::not_above(x.to_f64() + gap).above(), level);
            return Some(Estimate { x: x.to_f64(), index: Some(kept.nth(at + 1, level).index), support: reached - at });
        }
        if some == kept.len() {
            break;
        }
    }
    None
}
