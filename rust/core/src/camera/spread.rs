//! The standard error of a scale, by how far the matches are from a similarity.
//!
//! If their errors were independent, they would average out. But neighbours in the picture err alike: parts of a body
//! are not equally far away, its surface turns, background remains among the matches, and detectors draw positions
//! towards pixels. Such an error is a smooth strain of the picture, and a strain of equal size may be in the scale,
//! where nobody sees it. What is seen are stretch and shear: a plane that comes nearer has none of them, and what the
//! matches show of them more than independent errors would is strain. Its size is not known from two numbers. So there
//! are a few sizes, each weighed by how likely stretch and shear are under it, and the variance of the scale is the
//! average.

use super::matches::Matches;
use super::similarity::{Centred, Similarity, minus, plus};
use crate::real::Real;

/// Prior probability and size of each strain: that of its error at the mean distance from the centre over that of one
/// match.
const STRAINS: [(f64, f64); 4] = [(0.6, 0.0), (0.2, 0.15), (0.13, 0.3), (0.07, 0.6)];
/// The variance of the strain in the scale over that in stretch and in shear; parts farther away change the scale.
const IN_SCALE: f64 = 1.5;
/// Matches whose extent across is less than this share of that along are on one line, and show no stretch.
const THIN: f64 = 1e-9;

/// The standard error of a scale of matches, whose centre is known; NaN with fewer than three matches.
pub(super) fn spread<T: Real>(matches: &Matches<T>, centred: Option<Centred>, scale: f64) -> f64 {
    let Some(Centred { before, now, size, product }) = centred.filter(|_| matches.len() > 2) else {
        return f64::NAN;
    };
    let count = matches.len() as f64;
    let length = product[0].hypot(product[1]);
    let turn = if length > 0.0 { product.map(|part| part / length * scale) } else { [scale, 0.0] };
    let similarity = Similarity::about(turn, before, now);
    // The residuals are fitted by a similarity and a strain, residual = a p + b conj(p), and b is stretch and shear.
    let (mut squared, mut own, mut along) = (0.0, [0.0; 2], [0.0; 2]);
    for i in 0..matches.len() {
        let (p, c) = matches.get(i);
        let ([x, y], p) = (similarity.residual(p, c), minus(p, before));
        squared += x * x + y * y;
        own = plus(own, times(p, p));
        along = plus(along, times(p, [x, y]));
    }
    let variance = squared / (2.0 * count - 4.0);
    if variance == 0.0 {
        return 0.0;
    }
    let turned = minus(turn.map(|part| part * size), product).map(|part| part / size);
    let along = minus(along, times(own, turned));
    let across = size - (own[0] * own[0] + own[1] * own[1]) / size;
    let distortion = (along[0] * along[0] + along[1] * along[1]) / (across * across) * size / variance;
    let parts = STRAINS.map(|(share, strain)| {
        let of_strain = strain * strain * count;
        let (both, distortion) =
            if across > THIN * size { (of_strain + size / across, distortion) } else { (1.0, 0.0) };
        ((share / both).ln() - distortion / (2.0 * both), of_strain)
    });
    let most = parts.iter().map(|(evidence, _)| *evidence).fold(f64::NEG_INFINITY, f64::max);
    let (mut weights, mut strain) = (0.0, 0.0);
    for (evidence, of_strain) in parts {
        let weight = (evidence - most).exp();
        (weights, strain) = (weights + weight, strain + weight * of_strain);
    }
    (variance / size * (1.0 + IN_SCALE * strain / weights)).sqrt()
}

/// The product of complex numbers.
fn times(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}
