//! The standard error of a scale, by how far the matches are from a similarity, and a map that allows for strain.
//!
//! If their errors were independent, they would average out. But neighbours in the picture err alike: parts of a body
//! are not equally far away, its surface turns, background remains among the matches, and detectors draw positions
//! towards pixels. Such an error is a smooth strain of the picture, and a strain of equal size may be in the scale,
//! where nobody sees it. What is seen are stretch and shear: a plane that comes nearer has none of them, and what the
//! matches show of them more than independent errors would is strain. Its size is not known from two numbers. So there
//! are a few sizes, each weighed by how likely stretch and shear are under it, and the variance of the scale is the
//! average.

use super::similarity::{Centred, Selection, Similarity, minus, plus, squared, times};
use crate::real::Real;

/// Prior probability and size of each strain: that of its error at the mean distance from the centre over that of one
/// match.
const STRAINS: [(f64, f64); 4] = [(0.6, 0.0), (0.2, 0.15), (0.13, 0.3), (0.07, 0.6)];
/// The variance of the strain in the scale over that in stretch and in shear; parts farther away change the scale.
const IN_SCALE: f64 = 1.5;
/// Matches whose extent across is less than this share of that along are on one line, and show no stretch.
const THIN: f64 = 1e-9;

/// The map of matches about their centres that allows for strain: `now = turn before + strain conj(before)`.
pub(super) struct Strained {
    before: [f64; 2],
    now: [f64; 2],
    turn: [f64; 2],
    strain: [f64; 2],
    seen: Seen,
}

impl Strained {
    /// The map of the least squared distances in the later picture, where stretch and shear are as likely as strain of
    /// each size makes them. `None` if there are no matches, or all are on one spot.
    ///
    /// Independent errors leave the similarity as it is. The larger the strain, the less do matches far out along one
    /// axis outweigh those along the other.
    pub(super) fn fitted<T: Real>(selected: Selection<'_, T>) -> Option<Self> {
        let centred = Centred::of(selected)?;
        let seen = Seen::of(selected, &centred, centred.turn());
        let Centred { before, now, size, product } = centred;
        let strain = seen.strain();
        let shared = times([seen.own[0], -seen.own[1]], strain);
        let turn = minus(product, shared).map(|part| part / size);
        Some(Strained { before, now, turn, strain, seen })
    }

    /// The factor by which it enlarges.
    pub(super) fn scale(&self) -> f64 {
        squared(self.turn).sqrt()
    }

    /// The standard error of the scale; NaN with fewer than three matches.
    pub(super) fn spread(&self) -> f64 {
        self.seen.spread(true)
    }

    /// The squared distance of a match from where the map puts it now.
    #[inline(always)]
    pub(super) fn squared_residual(&self, p: [f64; 2], c: [f64; 2]) -> f64 {
        let p = minus(p, self.before);
        let mapped = plus(times(self.turn, p), times(self.strain, [p[0], -p[1]]));
        squared(minus(plus(mapped, self.now), c))
    }
}

/// The standard error of a scale of matches, whose centre is known; NaN with fewer than three matches.
pub(super) fn spread<T: Real>(selected: Selection<'_, T>, centred: Option<Centred>, scale: f64) -> f64 {
    centred.map_or(f64::NAN, |centred| {
        let length = centred.product[0].hypot(centred.product[1]);
        let turn = if length > 0.0 { centred.product.map(|part| part / length * scale) } else { [scale, 0.0] };
        Seen::of(selected, &centred, turn).spread(false)
    })
}

/// What matches show of stretch and shear.
struct Seen {
    count: f64,
    /// Sum of squared distances from the centre, before.
    size: f64,
    /// Sum of the squares of the points before.
    own: [f64; 2],
    /// Stretch and shear, times `across`.
    along: [f64; 2],
    /// The part of `size` that tells stretch and shear from scale and turn.
    across: f64,
    /// The variance of a coordinate of one match, px^2.
    variance: f64,
}

impl Seen {
    fn of<T: Real>(selected: Selection<'_, T>, centred: &Centred, turn: [f64; 2]) -> Self {
        let Centred { before, now, size, product } = *centred;
        let count = selected.len() as f64;
        let similarity = Similarity::about(turn, before, now);
        // The residuals are fitted by a similarity and a strain, residual = a p + b conj(p), and b is stretch and shear.
        let sums = selected.sums(|p, c| {
            let (residual, p) = (similarity.residual(p, c), minus(p, before));
            let (own, along) = (times(p, p), times(p, residual));
            [squared(residual), own[0], own[1], along[0], along[1]]
        });
        let (own, along) = ([sums[1], sums[2]], [sums[3], sums[4]]);
        let turned = minus(turn.map(|part| part * size), product).map(|part| part / size);
        let along = minus(along, times(own, turned));
        let across = size - (own[0] * own[0] + own[1] * own[1]) / size;
        let variance = if count > 2.0 { sums[0] / (2.0 * count - 4.0) } else { f64::NAN };
        Seen { count, size, own, along, across, variance }
    }

    fn is_thin(&self) -> bool {
        self.across <= THIN * self.size
    }

    /// The mean over the sizes of strain, weighed by how likely stretch and shear are under each. `value` has the
    /// variance of that strain and the variance of stretch and shear with it, both over that of the scale by
    /// independent errors.
    fn mean(&self, value: impl Fn(f64, f64) -> f64) -> f64 {
        let Seen { count, size, along, across, variance, .. } = *self;
        let distortion = (along[0] * along[0] + along[1] * along[1]) / (across * across) * size / variance;
        let parts = STRAINS.map(|(share, strain)| {
            let of_strain = strain * strain * count;
            let (both, distortion) = if self.is_thin() { (1.0, 0.0) } else { (of_strain + size / across, distortion) };
            ((share / both).ln() - distortion / (2.0 * both), value(of_strain, both))
        });
        let most = parts.iter().map(|(evidence, _)| *evidence).fold(f64::NEG_INFINITY, f64::max);
        let (mut weights, mut sum) = (0.0, 0.0);
        for (evidence, value) in parts {
            let weight = (evidence - most).exp();
            (weights, sum) = (weights + weight, sum + weight * value);
        }
        sum / weights
    }

    /// The part of stretch and shear that is strain rather than independent errors.
    fn part(&self) -> f64 {
        let tells = !self.is_thin() && self.variance > 0.0;
        if tells { self.mean(|of_strain, both| of_strain / both) } else { 0.0 }
    }

    /// Stretch and shear, without what independent errors make of them. Residuals point from the match to the map.
    fn strain(&self) -> [f64; 2] {
        let part = self.part();
        if part > 0.0 { self.along.map(|along| -along / self.across * part) } else { [0.0; 2] }
    }

    /// The standard error of the scale; larger if the strain was fitted with it.
    fn spread(&self, is_fitted: bool) -> f64 {
        let Seen { size, own, across, variance, .. } = *self;
        if variance == 0.0 || variance.is_nan() {
            return variance;
        }
        let part = if is_fitted { self.part() } else { 0.0 };
        let shared = if part > 0.0 { (own[0] * own[0] + own[1] * own[1]) / (size * across) * part } else { 0.0 };
        (variance / size * (1.0 + IN_SCALE * self.mean(|of_strain, _| of_strain) + shared)).sqrt()
    }
}
