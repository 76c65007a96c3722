//! The motion that the cells agree upon: where the body was in each frame, and how fast it is now.

use super::profile::Sighting;
use super::weights::{CellObservations, Weights, irls_weights};
use crate::mixture::estimate;
use crate::real::median;

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
pub fn trend(sightings: &[Sighting], range_noise: f64) -> Option<Trend> {
    let [.., _, Sighting { stamp: last, .. }] = sightings else { return None };
    let time: Vec<f64> = sightings.iter().map(|sighting| sighting.stamp - last).collect();
    let observed = CellObservations::new(sightings);
    let found = irls_weights(&observed, range_noise);
    let (positions, mut covariance) = positions(&observed, &found);
    for entry in &mut covariance {
        *entry *= found.noise;
    }
    let now = estimate(&time, &positions, &covariance, 1.0);
    let mut edges: Vec<f64> =
        sightings.iter().zip(&positions).map(|(sighting, position)| sighting.edge - position).collect();
    Some(Trend { distance: median(&mut edges) + now.position, closing_speed: -now.speed, variance: now.ss })
}

/// The weight of a frame whose cells say nothing, in points: its position is unknown, but not infinitely so.
const LEAST_WEIGHT: f64 = 1e-6;
/// A weight below any that matters, against division by 0.
const NOTHING: f64 = 1e-12;

/// The position of the body in each frame, m, and the covariance of all by rows, for a point's variance of 1.
///
/// It is the two-way least squares of frames and cells, with the cells eliminated: what is left are as many equations
/// as there are frames. They say nothing about a common shift, so the weighted mean of the positions is taken to be 0.
fn positions(observed: &CellObservations, Weights { weight, x, .. }: &Weights) -> (Vec<f64>, Vec<f64>) {
    let (n, cells) = (observed.frames(), observed.cells());
    let mut weights = vec![0.0; cells * n];
    let (mut total, mut mean, mut of_frame) = (vec![NOTHING; cells], vec![0.0; cells], vec![LEAST_WEIGHT; n]);
    for (frame, range) in observed.by_frame().enumerate() {
        for i in range {
            let cell = observed.cell[i];
            weights[cell * n + frame] += weight[i];
            total[cell] += weight[i];
            mean[cell] += weight[i] * x[i];
            of_frame[frame] += weight[i];
        }
    }
    mean.iter_mut().zip(&total).for_each(|(sum, total)| *sum /= total);
    let mut right = vec![0.0; n];
    for (range, right) in observed.by_frame().zip(&mut right) {
        *right = range.map(|i| weight[i] * (x[i] - mean[observed.cell[i]])).sum();
    }
    let all: f64 = of_frame.iter().sum();
    let mut normal: Vec<f64> = (0..n * n).map(|i| of_frame[i / n] * of_frame[i % n] / all).collect();
    for (frame, weight) in of_frame.iter().enumerate() {
        normal[frame * n + frame] += weight;
    }
    for (of_cell, total) in weights.chunks_exact(n).zip(&total) {
        for (row, weight) in normal.chunks_exact_mut(n).zip(of_cell) {
            let share = weight / total;
            row.iter_mut().zip(of_cell).for_each(|(entry, other)| *entry -= share * other);
        }
    }
    invert(&mut normal, n);
    let position = |row: &[f64]| row.iter().zip(&right).map(|(a, b)| a * b).sum();
    (normal.chunks_exact(n).map(position).collect(), normal)
}

/// Inverts a positive definite matrix of `n` rows in place, by Gauss and Jordan; such a matrix needs no pivoting.
fn invert(matrix: &mut [f64], n: usize) {
    let mut row = vec![0.0; n];
    for pivot in 0..n {
        let by = 1.0 / matrix[pivot * n + pivot];
        matrix[pivot * n + pivot] = 1.0;
        matrix[pivot * n..][..n].iter_mut().for_each(|entry| *entry *= by);
        row.copy_from_slice(&matrix[pivot * n..][..n]);
        for (_, entries) in matrix.chunks_exact_mut(n).enumerate().filter(|(place, _)| *place != pivot) {
            let factor = std::mem::take(&mut entries[pivot]);
            entries.iter_mut().zip(&row).for_each(|(entry, by)| *entry -= factor * by);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::trend;
    use crate::alignment::{Alignment, Cell, Profile, Sighting};

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
            let found = trend(&approach(speed, acceleration), Alignment::default().range_noise).unwrap();
            // A braking car may as well have a jerk, which costs a little.
            let near = if acceleration == 0.0 { 1e-6 } else { 0.05 };
            assert!((found.closing_speed - speed - acceleration).abs() < near, "{found:?}");
            assert!((found.distance - 20.0 + speed + acceleration / 2.0).abs() < 2e-3, "{found:?}");
            assert!(found.variance > 0.0 && found.variance < 0.05);
        }
    }

    #[test]
    fn one_frame_tells_nothing() {
        assert_eq!(trend(&approach(1.0, 0.0)[..1], 0.02), None);
        assert_eq!(trend(&[], 0.02), None);
    }
}
