//! Which cells of which frames to believe.

use super::lean::lean;
use super::median;
use super::witnesses::Witnesses;

/// How often weights are found anew.
const ROUNDS: usize = 3;
/// Where Tukey's biweight ends, in standard deviations: 95 % efficient where all is normal.
const BIWEIGHT: f64 = 4.7;
/// Standard deviation of normal numbers, from the median of their sizes.
const NORMAL: f64 = 1.4826;
/// How many residuals the range noise that was given is worth.
const KNOWN_NOISE: f64 = 8.0;
/// Cells in common that make a median.
const ENOUGH: usize = 3;
/// Less than any weight that matters.
const NOTHING: f64 = 1e-12;

/// What to believe of the witnesses.
pub(super) struct Weighed {
    /// Of each entry.
    pub weight: Vec<f64>,
    /// Of each entry, with the lean of the surface taken out, m.
    pub x: Vec<f64>,
    /// Of the body in each frame, m, from any origin.
    pub position: Vec<f64>,
    /// Variance of a point, m^2.
    pub noise: f64,
}

/// Surface, positions and weights in turns.
pub(super) fn weigh(seen: &Witnesses, range_noise: f64) -> Weighed {
    let (entries, cells) = (seen.x.len(), seen.cells());
    let mut leans = vec![0.0; cells];
    let mut found = Weighed {
        weight: seen.count.clone(),
        x: seen.x.clone(),
        position: start(seen),
        noise: range_noise * range_noise,
    };
    let free = entries.saturating_sub(cells + seen.frames() - 1).max(1) as f64;
    let mut residual = vec![0.0; entries];
    for _ in 0..ROUNDS {
        let (mut surface, mut total) = (vec![0.0; cells], vec![NOTHING; cells]);
        for (range, position) in seen.by_frame().zip(&found.position) {
            for i in range {
                let (cell, weight) = (seen.cell[i], found.weight[i]);
                surface[cell] += weight * (found.x[i] - position);
                total[cell] += weight;
            }
        }
        surface.iter_mut().zip(&total).for_each(|(sum, total)| *sum /= total);
        leans.clone_from(&lean(seen, &surface, &total));
        for i in 0..entries {
            found.x[i] = seen.x[i] - leans[seen.cell[i]] * seen.rise[i];
        }
        for (range, position) in seen.by_frame().zip(&mut found.position) {
            let (mut sum, mut total) = (0.0, NOTHING);
            for i in range.clone() {
                sum += found.weight[i] * (found.x[i] - surface[seen.cell[i]]);
                total += found.weight[i];
            }
            *position = sum / total;
            for i in range {
                let apart = found.x[i] - surface[seen.cell[i]] - *position;
                residual[i] = apart * apart * seen.count[i];
            }
        }
        let spread = NORMAL * NORMAL * median(&mut residual.clone()) * entries as f64 / free;
        found.noise = (KNOWN_NOISE * range_noise * range_noise + free * spread) / (KNOWN_NOISE + free);
        let end = BIWEIGHT * BIWEIGHT * found.noise;
        for i in 0..entries {
            let inside = (1.0 - residual[i] / end).max(0.0);
            found.weight[i] = seen.count[i] * inside * inside;
        }
    }
    found
}

/// Each frame where it agrees best with those before it: the median of what its cells say.
fn start(seen: &Witnesses) -> Vec<f64> {
    let edge = seen.cells() - 1;
    let mut sums = vec![(0.0, 0.0); seen.cells()];
    let mut said = Vec::new();
    let mut positions = Vec::with_capacity(seen.frames());
    for range in seen.by_frame() {
        let moved = |i: usize| {
            let (count, sum) = sums[seen.cell[i]];
            (count > 0.0).then(|| seen.x[i] - sum / count)
        };
        said.clear();
        said.extend(range.clone().filter(|i| seen.cell[*i] != edge).filter_map(moved));
        if said.len() < ENOUGH {
            said.extend(range.clone().filter(|i| seen.cell[*i] == edge).filter_map(moved));
        }
        let position = if said.is_empty() { 0.0 } else { median(&mut said) };
        for i in range {
            let (count, sum) = &mut sums[seen.cell[i]];
            *count += seen.count[i];
            *sum += seen.count[i] * (seen.x[i] - position);
        }
        positions.push(position);
    }
    positions
}
