//! Filters that remember the frames of the newest seconds, and fit them anew each time.

use super::posterior::{Measured, Posterior};
use super::theil_sen::median_line;

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    Line,
    Parabola,
    MedianLine,
}

/// No more frames than this are remembered, however long the window.
pub(super) const MOST: usize = 512;
/// A median of all pairs takes time quadratic in the frames.
const MOST_OF_PAIRS: usize = 64;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Window {
    seconds: f64,
    fit: Fit,
    /// Std of the derivative that the fit knows nothing of: acceleration for a line, jerk for a parabola.
    unmodelled: f64,
    /// The oldest first.
    pub(super) frames: Vec<Measured>,
}

impl Window {
    pub(super) fn new(seconds: f64, fit: Fit, unmodelled: f64) -> Self {
        Window { seconds, fit, unmodelled, frames: Vec::new() }
    }

    /// One more than determine the fit.
    pub(super) fn frames_needed(&self) -> usize {
        if self.fit == Fit::Parabola { 4 } else { 3 }
    }

    /// Frames older than the window go, as long as enough stay for the fit: few frames a second are better than none.
    pub(super) fn push(&mut self, new: Measured) {
        self.frames.push(new);
        let most = if self.fit == Fit::MedianLine { MOST_OF_PAIRS } else { MOST };
        let (oldest, n) = (new.stamp - self.seconds, self.frames.len());
        let old = self.frames.iter().take_while(|frame| frame.stamp < oldest).count();
        let gone = old.min(n.saturating_sub(self.frames_needed())).max(n.saturating_sub(most));
        self.frames.drain(..gone);
    }

    pub(super) fn at(&self, stamp: f64, variance: f64) -> Option<Posterior> {
        let parabola = self.fit == Fit::Parabola && self.frames.len() >= 3;
        match self.frames.len() {
            0 | 1 => None,
            _ if parabola => Some(self.polynomial::<3>(stamp, variance)),
            _ if self.fit == Fit::MedianLine => Some(median_line(&self.frames, stamp, variance, self.unmodelled)),
            _ => Some(self.polynomial::<2>(stamp, variance)),
        }
    }

    /// Weighted least squares of `C` coefficients in the time from `stamp`, so that the first two are the answer.
    ///
    /// What the polynomial cannot follow, the next power of time with a coefficient of which only the std is known,
    /// moves the first two by a known vector, whose square joins the covariance.
    fn polynomial<const C: usize>(&self, stamp: f64, variance: f64) -> Posterior {
        let newest = self.frames[self.frames.len() - 1].distance;
        let scale = stamp - self.frames[0].stamp; // times are divided by it, for a well-conditioned fit
        let mut normal = [[0.0; C]; C];
        let (mut fitted, mut missed) = ([0.0; C], [0.0; C]);
        for frame in &self.frames {
            let x = (frame.stamp - stamp) / scale;
            let weight = 1.0 / if frame.own { frame.variance } else { variance };
            let mut power = weight;
            let mut powers = [0.0; C];
            for value in &mut powers {
                *value = power;
                power *= x;
            }
            let mut basis = 1.0;
            let next: f64 = (0..C).fold(1.0, |next, _| next * x);
            for row in 0..C {
                for column in 0..C {
                    normal[row][column] += basis * powers[column];
                }
                fitted[row] += powers[row] * (frame.distance - newest);
                missed[row] += powers[row] * next;
                basis *= x;
            }
        }
        let inverse = inverted(normal);
        let of = |right: [f64; C], row: usize| (0..C).map(|column| inverse[row][column] * right[column]).sum::<f64>();
        // The coefficient of the next power is its derivative over C!, in scaled time.
        let factorial = if C == 2 { 2.0 } else { 6.0 };
        let unmodelled = self.unmodelled * (0..C).fold(1.0, |power, _| power * scale) / factorial;
        let (missed_d, missed_v) = (unmodelled * of(missed, 0), -unmodelled * of(missed, 1) / scale);
        Posterior {
            distance: newest + of(fitted, 0),
            closing_speed: -of(fitted, 1) / scale,
            dd: inverse[0][0] + missed_d * missed_d,
            dv: -inverse[0][1] / scale + missed_d * missed_v,
            vv: inverse[1][1] / (scale * scale) + missed_v * missed_v,
            lag: missed_d * missed_d,
        }
    }
}

/// The inverse of a positive definite matrix, by Gauss and Jordan: no pivots are needed for such.
fn inverted<const C: usize>(mut matrix: [[f64; C]; C]) -> [[f64; C]; C] {
    let mut inverse: [[f64; C]; C] = std::array::from_fn(|row| std::array::from_fn(|column| f64::from(row == column)));
    for pivot in 0..C {
        let by = 1.0 / matrix[pivot][pivot];
        for column in 0..C {
            matrix[pivot][column] *= by;
            inverse[pivot][column] *= by;
        }
        for row in (0..C).filter(|row| *row != pivot) {
            let factor = matrix[row][pivot];
            for column in 0..C {
                matrix[row][column] -= factor * matrix[pivot][column];
                inverse[row][column] -= factor * inverse[pivot][column];
            }
        }
    }
    inverse
}
