//! The matches that move as one body: random sample consensus (RANSAC) over similarities.
//!
//! A match that does not belong to the body ahead, be it background or a mismatch, moves in another way. So the
//! similarity that most matches agree with is looked for, by two matches at a time. It is refined
//! until it is fitted to the matches that agree with it, with the strain that they show: once from there, and once from
//! the matches that a fit without strain settles on. Strain may take background for a part of the body, and then fewer
//! matches agree in the end; so the larger consensus counts.

use super::matches::{Block, Matches};
use super::similarity::{Centred, Selection, Similarity, count};
use super::spread::Strained;
use crate::interrupt::worked;
use crate::lanes::{LANES, Lanes, lanes, sum};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};

/// The settings of the search for a consensus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ransac {
    /// A match farther than this from where the similarity puts it, px, does not agree.
    pub tolerance: f64,
    /// The pairs of matches that are tried.
    pub trials: usize,
    /// Seed of the random choice of pairs.
    pub seed: u64,
}

/// All but a twentieth of positions with a normal error are within this many standard deviations, squared: -2 ln 0.05.
const WIDTH_SQUARED: f64 = 5.991_464_547_107_982;
/// No match is left out for less than this, px.
const LEAST_TOLERANCE: f64 = 0.1;
/// With more than this share of coordinates unchanged, positions are rounded.
const UNCHANGED: f64 = 0.1;
/// The most rounds of the refinement, which settles long before.
const MOST_ROUNDS: usize = 20;

impl Ransac {
    /// A bit for each match that agrees; `None` if there are fewer than two, or if no two agree.
    pub(super) fn inliers<T: Real>(self, matches: &Matches<T>, level: Level) -> Option<Vec<u16>> {
        let squared = self.tolerance * self.tolerance;
        let best = level.run(Search { ransac: self, matches, squared })?;
        let all = Selection { matches, those: &matches.all(), level };
        let least = if is_rounded(all) { squared } else { squared.min(LEAST_TOLERANCE * LEAST_TOLERANCE) };
        let refinement = Refinement { matches, squared, least, level };
        let first = refinement.agreeing(|p, c| best.squared_residual(p, c), &vec![0; matches.blocks().len()]);
        let unstrained = refinement.settled(first.clone(), |those| {
            let fitted = Centred::of(those)?.similarity();
            Some(move |p, c| fitted.squared_residual(p, c))
        });
        let [direct, by_similarity] = [first, unstrained].map(|those| {
            refinement
                .settled(those, |those| Strained::fitted(those).map(|fitted| move |p, c| fitted.squared_residual(p, c)))
        });
        Some(if count(&by_similarity) > count(&direct) { by_similarity } else { direct })
    }
}

/// Finds the similarity through two matches that most matches agree with; of several the first.
struct Search<'m, T> {
    ransac: Ransac,
    matches: &'m Matches<T>,
    /// A match whose squared residual is larger does not agree, px^2.
    squared: f64,
}

impl<T: Real> Kernel for Search<'_, T> {
    type Output = Option<Similarity>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Option<Similarity> {
        let Search { ransac: Ransac { tolerance, trials, seed }, matches, squared } = self;
        let farthest = farthest(matches);
        let others = matches.len().checked_sub(1).filter(|others| *others > 0)?;
        let mut random = SplitMix64(seed);
        let mut best = None;
        let mut most = 1;
        for _ in 0..trials {
            worked(matches.len());
            let (first, second) = random.below(matches.len(), others);
            let second = second + usize::from(second >= first);
            if let Some(similarity) = Similarity::through(matches, first, second) {
                // Votes in the type of the positions are no fewer, and most similarities do not get enough of them.
                let rounding = similarity.rounding::<T>(farthest);
                let enough = T::not_below((tolerance + rounding) * (tolerance + rounding) * (1.0 + T::SLACK.to_f64()));
                let rough = |block: &Block<T>| similarity.squared_residuals_in(block);
                if rounding < 1.0 && votes(simd, matches, rough, enough, most) <= most {
                    continue;
                }
                let votes = votes(
                    simd,
                    matches,
                    |block| each_match(block, &|p, c| similarity.squared_residual(p, c)),
                    squared,
                    most,
                );
                if votes > most {
                    (best, most) = (Some(similarity), votes);
                }
            }
        }
        best
    }
}

/// Counts the matches that agree, or fewer of them once there cannot be more than `most`: of matches that nearly all move
/// as one body, most similarities are given up after a few that do not agree.
#[inline(always)]
fn votes<T: Real, U: Real>(
    simd: impl Instructions,
    matches: &Matches<T>,
    residuals: impl Fn(&Block<T>) -> Lanes<U>,
    squared: U,
    most: usize,
) -> usize {
    let (mut votes, mut left) = (0, matches.len());
    for block in matches.blocks() {
        votes += U::within(simd, &residuals(block), &[U::ZERO; LANES], &[squared; LANES]).count_ones() as usize;
        left = left.saturating_sub(LANES);
        if votes + left <= most {
            break;
        }
    }
    votes
}

/// The largest coordinate, px.
#[inline(always)]
fn farthest<T: Real>(matches: &Matches<T>) -> f64 {
    let mut farthest = [T::ZERO; LANES];
    for column in matches.blocks().iter().flatten() {
        for lane in 0..LANES {
            let size = if column[lane] < T::ZERO { T::ZERO - column[lane] } else { column[lane] };
            farthest[lane] = if size > farthest[lane] { size } else { farthest[lane] };
        }
    }
    farthest.iter().fold(0.0, |most, size| size.to_f64().max(most))
}

/// The search for matches that agree with a map that is fitted to them.
struct Refinement<'m, T> {
    matches: &'m Matches<T>,
    /// A match whose squared residual is larger does not agree, px^2.
    squared: f64,
    /// No match is left out for less than this, px^2.
    least: f64,
    level: Level,
}

impl<T: Real> Refinement<'_, T> {
    /// The matches that it settles on, from those of a first guess.
    fn settled<R: Residual>(&self, mut agreed: Vec<u16>, fit: impl Fn(Selection<'_, T>) -> Option<R>) -> Vec<u16> {
        for _ in 0..MOST_ROUNDS {
            let those = Selection { matches: self.matches, those: &agreed, level: self.level };
            let Some(residual) = fit(those) else { break };
            let next = self.agreeing(residual, &agreed);
            if count(&next) < 3 || next == agreed {
                break;
            }
            agreed = next;
        }
        agreed
    }

    /// A bit for each match that agrees with a map by the errors of those that agreed, if there are any.
    fn agreeing(&self, residual: impl Residual, agreed: &[u16]) -> Vec<u16> {
        self.level.run(Agreeing { refinement: self, residual, agreed })
    }
}

/// The squared residual of a match under a map, from where it was and where it is.
trait Residual: Fn([f64; 2], [f64; 2]) -> f64 {}

impl<R: Fn([f64; 2], [f64; 2]) -> f64> Residual for R {}

struct Agreeing<'m, T, R> {
    refinement: &'m Refinement<'m, T>,
    residual: R,
    agreed: &'m [u16],
}

impl<T: Real, R: Residual> Kernel for Agreeing<'_, T, R> {
    type Output = Vec<u16>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Vec<u16> {
        let Agreeing { refinement: Refinement { matches, squared, least, .. }, residual, agreed } = self;
        let residuals: Vec<_> = matches.blocks().iter().map(|block| each_match(block, &residual)).collect();
        let mut sums = [0.0; LANES];
        for (residuals, bits) in residuals.iter().zip(agreed) {
            for lane in 0..LANES {
                sums[lane] += if bits >> lane & 1 == 1 { residuals[lane] } else { 0.0 };
            }
        }
        // The variance of a coordinate of those that agreed, px^2; NaN of none.
        let noise = sum(sums) / (2 * count(agreed)) as f64;
        let most = [squared.min(noise * WIDTH_SQUARED).max(*least); LANES];
        residuals.iter().map(|residuals| f64::within(simd, residuals, &[0.0; LANES], &most)).collect()
    }
}

/// The squared residuals of a block of matches.
#[inline(always)]
fn each_match<T: Real>([x0, y0, x1, y1]: &Block<T>, residual: &impl Residual) -> Lanes<f64> {
    lanes(|lane| residual([x0[lane].to_f64(), y0[lane].to_f64()], [x1[lane].to_f64(), y1[lane].to_f64()]))
}

/// Whether positions are rounded to the pixels of a picture or of a smaller copy of it. Then many do not change at all,
/// and the others change by too much: errors are as large as such a step, and only their mean says how far the body
/// moved.
fn is_rounded<T: Real>(all: Selection<'_, T>) -> bool {
    let unchanged =
        all.sums(|p, c| [[0, 1].map(|axis: usize| if p[axis] == c[axis] { 1.0 } else { 0.0 }).iter().sum()]);
    unchanged[0] > UNCHANGED * (2 * all.len()) as f64
}

/// The generator `SplitMix64` [Steele, Lea and Flood 2014].
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Two numbers below two limits of at most 32 bits, from the upper and the lower half of one random number.
    fn below(&mut self, first: usize, second: usize) -> (usize, usize) {
        let bits = self.next();
        let scaled = |half: u64, limit: usize| {
            #[allow(clippy::cast_possible_truncation, reason = "it is below the limit")]
            let below = ((half * limit as u64) >> 32) as usize;
            below
        };
        (scaled(bits >> 32, first), scaled(bits & 0xffff_ffff, second))
    }
}

#[cfg(test)]
mod tests {
    use super::SplitMix64;

    #[test]
    fn the_generator_is_the_published_one() {
        let mut random = SplitMix64(1_234_567);
        assert_eq!([random.next(), random.next()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }
}
