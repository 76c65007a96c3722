//! The matches that move as one body: random sample consensus (RANSAC) over similarities.
//!
//! A match that does not belong to the body ahead, be it background or a mismatch, moves in another way. So the
//! similarity that most matches agree with is looked for, by two matches at a time. It is refined
//! until it is fitted to the matches that agree with it, with the strain that they show: once from there, and once from
//! the matches that a fit without strain settles on. Strain may take background for a part of the body, and then fewer
//! matches agree in the end; so the larger consensus counts.

use super::matches::{Block, Matches};
use super::similarity::Similarity;
use super::spread::Strained;
use crate::interrupt::worked;
use crate::lanes::{LANES, Lanes, lanes};
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
    /// The matches that agree; `None` if there are fewer than two, or if no two agree.
    pub(super) fn inliers<T: Real>(self, matches: &Matches<T>, level: Level) -> Option<Matches<T>> {
        let squared = self.tolerance * self.tolerance;
        let best = self.best_of_pairs(matches, squared, level)?;
        let least = if is_rounded(matches) { squared } else { squared.min(LEAST_TOLERANCE * LEAST_TOLERANCE) };
        let refinement = Refinement { matches, squared, least, level };
        let first = agreeing(&refinement.residuals(|p, c| best.squared_residual(p, c)), squared);
        let unstrained = refinement.settled(first.clone(), |those| {
            Similarity::fitted(those).map(|fitted| move |p, c| fitted.squared_residual(p, c))
        });
        let [direct, by_similarity] = [first, unstrained].map(|those| {
            refinement
                .settled(those, |those| Strained::fitted(those).map(|fitted| move |p, c| fitted.squared_residual(p, c)))
        });
        Some(matches.select(if by_similarity.len() > direct.len() { &by_similarity } else { &direct }))
    }

    /// The similarity through two matches that most matches agree with; of several the first.
    fn best_of_pairs<T: Real>(self, matches: &Matches<T>, squared: f64, level: Level) -> Option<Similarity> {
        let others = matches.len().checked_sub(1).filter(|others| *others > 0)?;
        let mut random = SplitMix64(self.seed);
        let mut best = None;
        let mut most = 1;
        for _ in 0..self.trials {
            worked(matches.len());
            let (first, second) = random.below(matches.len(), others);
            let second = second + usize::from(second >= first);
            if let Some(similarity) = Similarity::through(matches, first, second) {
                let votes = level.run(Votes { matches, similarity, squared, most });
                if votes > most {
                    (best, most) = (Some(similarity), votes);
                }
            }
        }
        best
    }
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
    fn settled<R: Residual>(&self, mut agreed: Vec<usize>, fit: impl Fn(&Matches<T>) -> Option<R>) -> Vec<usize> {
        for _ in 0..MOST_ROUNDS {
            let Some(residual) = fit(&self.matches.select(&agreed)) else { break };
            let residuals = self.residuals(residual);
            // The variance of a coordinate of those that agreed, px^2.
            let noise = agreed.iter().map(|i| residuals[*i]).sum::<f64>() / (2 * agreed.len()) as f64;
            let next = agreeing(&residuals, self.squared.min(noise * WIDTH_SQUARED).max(self.least));
            if next.len() < 3 || next == agreed {
                break;
            }
            agreed = next;
        }
        agreed
    }

    /// The squared residual of every match, px^2.
    fn residuals(&self, residual: impl Residual) -> Vec<f64> {
        let mut residuals = self.level.run(Residuals { matches: self.matches, residual });
        residuals.truncate(self.matches.len());
        residuals
    }
}

/// The numbers of the matches whose squared residual is at most `squared`.
fn agreeing(residuals: &[f64], squared: f64) -> Vec<usize> {
    (0..residuals.len()).filter(|i| residuals[*i] <= squared).collect()
}

/// The squared residual of a match under a map, from where it was and where it is.
trait Residual: Fn([f64; 2], [f64; 2]) -> f64 {}

impl<R: Fn([f64; 2], [f64; 2]) -> f64> Residual for R {}

/// Computes the residuals of all matches, and of the lanes behind the last.
struct Residuals<'m, T, R> {
    matches: &'m Matches<T>,
    residual: R,
}

impl<T: Real, R: Residual> Kernel for Residuals<'_, T, R> {
    type Output = Vec<f64>;
    const AVX512: bool = false;

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) -> Vec<f64> {
        let blocks = self.matches.blocks();
        let mut residuals = vec![0.0; LANES * blocks.len()];
        for (block, out) in blocks.iter().zip(residuals.as_chunks_mut::<LANES>().0) {
            *out = each_match(block, &self.residual);
        }
        residuals
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
fn is_rounded<T: Real>(matches: &Matches<T>) -> bool {
    let same = |i: usize| {
        let (p, c) = matches.get(i);
        usize::from(p[0] == c[0]) + usize::from(p[1] == c[1])
    };
    let unchanged: usize = (0..matches.len()).map(same).sum();
    unchanged as f64 > UNCHANGED * (2 * matches.len()) as f64
}

/// Counts the matches that agree, or fewer of them once there cannot be more than `most`: of matches that nearly all move
/// as one body, most similarities are given up after a few that do not agree.
struct Votes<'m, T> {
    matches: &'m Matches<T>,
    similarity: Similarity,
    squared: f64,
    most: usize,
}

impl<T: Real> Kernel for Votes<'_, T> {
    type Output = usize;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> usize {
        let Votes { matches, similarity, squared, most } = self;
        let (mut votes, mut left) = (0, matches.len());
        for block in matches.blocks() {
            let residual = each_match(block, &|p, c| similarity.squared_residual(p, c));
            votes += f64::within(simd, &residual, &[0.0; LANES], &[squared; LANES]).count_ones() as usize;
            left = left.saturating_sub(LANES);
            if votes + left <= most {
                break;
            }
        }
        votes
    }
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
