//! The motion that the cells agree upon: where the body was in each frame, and how fast it is now.

use super::profile::Sighting;
use super::weights::{CellObservations, IrlsWeights, Weights};
use crate::lanes::{LANES, groups, sum};
use crate::mixture::estimate;
use crate::real::median;
use crate::simd::{Instructions, Kernel, Level};

/// The motion of a body at the last of its sightings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trend {
    /// Distance of its edge, m.
    pub distance: f64,
    /// Closing speed, m/s.
    pub closing_speed: f64,
    /// Variance of the closing speed, m^2/s^2.
    pub variance: f64,
}

/// The motion of a body, from its sightings; `None` of fewer than two. It is not finite where nothing tells it.
#[must_use]
pub fn trend(sightings: &[Sighting], range_noise: f64, level: Level) -> Option<Trend> {
    let [.., _, Sighting { stamp: last, .. }] = sightings else { return None };
    let time: Vec<f64> = sightings.iter().map(|sighting| sighting.stamp - last).collect();
    let observed = CellObservations::new(sightings);
    let weights = level.run(IrlsWeights { observed: &observed, range_noise });
    let (positions, covariance) = level.run(Positions(weights));
    let now = estimate(&time, &positions, &covariance, 1.0, level);
    let mut edges: Vec<f64> =
        sightings.iter().zip(&positions).map(|(sighting, position)| sighting.edge - position).collect();
    Some(Trend { distance: median(&mut edges) + now.position, closing_speed: -now.speed, variance: now.ss })
}

/// The weight of a frame whose cells say nothing, in points: its position is unknown, but not infinitely so.
const LEAST_WEIGHT: f64 = 1e-6;

/// Finds the position of the body in each frame, m, and the covariance of all by rows, m^2.
///
/// It is the two-way least squares of frames and cells, with the cells eliminated: what is left are as many equations
/// as there are frames. They say nothing about a common shift, so the weighted mean of the positions is taken to be 0.
struct Positions(Weights);

impl Kernel for Positions {
    type Output = (Vec<f64>, Vec<f64>);

    #[inline(always)]
    fn run<I: Instructions>(self, _simd: I) -> Self::Output {
        let Positions(Weights { weight_x, mut positions, mut surface_total, noise, doubt }) = self;
        let ([weight, x], [surface, total, share, ..]) = (weight_x.read(), surface_total.write::<3>());
        let n = positions.len();
        let width = total.len();
        let rows = || weight.chunks_exact(width);
        for total in total.iter_mut() {
            *total = 1.0 / *total;
        }
        let (mut right, mut of_frame) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let mut normal = vec![0.0; n * n];
        for (frame, ((weight, x), position)) in rows().zip(x.chunks_exact(width)).zip(&positions).enumerate() {
            share.iter_mut().zip(weight).zip(&*total).for_each(|((share, weight), by)| *share = weight * by);
            let (mut apart, mut all) = ([0.0; LANES], [0.0; LANES]);
            for ((weight, x), surface) in groups(weight).iter().zip(groups(x)).zip(groups(surface)) {
                for lane in 0..LANES {
                    apart[lane] += weight[lane] * (x[lane] - surface[lane] - position);
                    all[lane] += weight[lane];
                }
            }
            right.push(sum(apart));
            of_frame.push(LEAST_WEIGHT + sum(all));
            for (other, weight) in rows().take(frame + 1).enumerate() {
                let mut both = [0.0; LANES];
                for (share, weight) in groups(share).iter().zip(groups(weight)) {
                    for lane in 0..LANES {
                        both[lane] += share[lane] * weight[lane];
                    }
                }
                let both = sum(both);
                (normal[frame * n + other], normal[other * n + frame]) = (-both, -both);
            }
        }
        let all: f64 = of_frame.iter().sum();
        let mean = positions.iter().zip(&of_frame).map(|(position, weight)| position * weight).sum::<f64>() / all;
        for (position, right) in positions.iter_mut().zip(&mut right) {
            *position -= mean;
            *right -= LEAST_WEIGHT * *position;
        }
        for (frame, row) in normal.chunks_exact_mut(n).enumerate() {
            row.iter_mut().zip(&of_frame).for_each(|(entry, weight)| *entry += of_frame[frame] * weight / all);
            row[frame] += of_frame[frame];
        }
        invert(&mut normal, n);
        for (position, row) in positions.iter_mut().zip(normal.chunks_exact(n)) {
            *position += row.iter().zip(&right).map(|(a, b)| a * b).sum::<f64>();
        }
        for entry in &mut normal {
            *entry *= noise;
        }
        for (frame, doubt) in doubt.iter().enumerate() {
            normal[frame * n + frame] += doubt;
        }
        (positions, normal)
    }
}

/// Inverts a positive definite matrix of `n` rows in place, by Gauss and Jordan; such a matrix needs no pivoting.
#[inline(always)]
fn invert(matrix: &mut [f64], n: usize) {
    for pivot in 0..n {
        let (before, rest) = matrix.split_at_mut(pivot * n);
        let (row, after) = rest.split_at_mut(n);
        let by = 1.0 / row[pivot];
        row[pivot] = 1.0;
        for entry in &mut *row {
            *entry *= by;
        }
        for entries in before.chunks_exact_mut(n).chain(after.chunks_exact_mut(n)) {
            let factor = std::mem::take(&mut entries[pivot]);
            entries.iter_mut().zip(&*row).for_each(|(entry, by)| *entry -= factor * by);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::trend;
    use crate::alignment::{Alignment, Cell, Profile, Sighting};
    use crate::simd::Level;

    /// A wall of cells, each at its own distance, that comes closer.
    fn approach(speed: f64, acceleration: f64) -> Vec<Sighting> {
        (0..11)
            .map(|frame| {
                let t = f64::from(frame) / 10.0;
                let edge = 20.0 - speed * t - acceleration * t * t / 2.0;
                let cell =
                    |i: i32| Cell { column: i / 8, level: i % 8, count: 4.0, x: edge + f64::from(i % 3), z: 0.0 };
                Sighting { stamp: t, edge, profile: Profile { cells: (0..40).map(cell).collect() } }
            })
            .collect()
    }

    #[test]
    fn a_body_without_noise_is_followed_exactly() {
        for (speed, acceleration) in [(0.0, 0.0), (5.0, 0.0), (2.0, 6.0), (-3.0, 0.0)] {
            let found = trend(&approach(speed, acceleration), Alignment::default().range_noise, Level::best()).unwrap();
            // A braking car may as well have a jerk, which costs a little.
            let near = if acceleration == 0.0 { 1e-6 } else { 0.05 };
            assert!((found.closing_speed - speed - acceleration).abs() < near, "{found:?}");
            assert!((found.distance - 20.0 + speed + acceleration / 2.0).abs() < 2e-3, "{found:?}");
            assert!(found.variance > 0.0 && found.variance < 0.05);
        }
    }

    #[test]
    fn one_frame_tells_nothing() {
        assert_eq!(trend(&approach(1.0, 0.0)[..1], 0.02, Level::best()), None);
        assert_eq!(trend(&[], 0.02, Level::best()), None);
    }
}
