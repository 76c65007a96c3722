//! Euclidean clustering, as far as the nearest cluster that is large enough.
//!
//! Candidates are taken nearest first. Each that no cluster has yet is the nearest point of a new one, which is grown by
//! asking a tree of boxes, point after point, for all that is near and in no cluster yet, until nothing is left. The first
//! cluster with enough points is the answer, so on most frames one cluster is grown. What is taken leaves the tree: however
//! many points lie on one spot, each is found once.

use super::candidates::{Candidate, Estimate};
use super::tree::{Point, Tree};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use std::iter;

/// The cluster looked for mostly has one of so many nearest points; the others are put in order when it has not.
const LIKELY_SEEDS: usize = 32;

/// The nearest point of the nearest cluster of at least `min_points`.
pub(super) fn nearest<T: Real>(
    mut candidates: Vec<Candidate<T>>,
    tolerance: f64,
    min_points: usize,
    level: Level,
    position: impl Fn(&Candidate<T>) -> Point,
) -> Option<Estimate> {
    let few = candidates.len().min(LIKELY_SEEDS);
    if few < candidates.len() {
        candidates.select_nth_unstable_by(few, Candidate::order);
    }
    candidates[..few].sort_unstable_by(Candidate::order);
    let tree = Tree::new(candidates.iter().map(position));
    let others = || {
        let mut others: Vec<usize> = (few..candidates.len()).collect();
        others.sort_unstable_by(|a, b| candidates[*a].order(&candidates[*b]));
        others
    };
    let seeds = (0..few).chain(iter::once_with(others).flatten());
    let (seed, support) = level.run(Search { tree, seeds, limit: tolerance * tolerance, min_points })?;
    let Candidate { x, index } = candidates[seed];
    Some(Estimate { x: x.to_f64(), index: Some(index), support })
}

/// Looks for the first cluster with enough points; gives its first point and how many it has.
struct Search<S> {
    tree: Tree,
    /// All points, nearest first.
    seeds: S,
    /// Longest link, squared.
    limit: f64,
    min_points: usize,
}

impl<S: Iterator<Item = usize>> Kernel for Search<S> {
    type Output = Option<(usize, usize)>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Self::Output {
        let Search { mut tree, seeds, limit, min_points } = self;
        let (mut taken, mut to_grow) = (0, Vec::with_capacity(tree.len()));
        for seed in seeds {
            if !tree.is_free(seed) {
                continue;
            }
            let others = taken;
            tree.take(seed, &mut to_grow);
            taken += 1;
            // From the point found last, which lies at the rim: few points find all the others, and with none left to find
            // the rest need not be asked.
            while taken < tree.len()
                && let Some(place) = to_grow.pop()
            {
                let (point, known) = (tree.point(place), to_grow.len());
                tree.take_near(simd, &point, limit, &mut to_grow);
                taken += to_grow.len() - known;
            }
            if taken - others >= min_points {
                return Some((seed, taken - others));
            }
        }
        None
    }
}
