//! The filters that remember the frames of the newest seconds, and fit them anew each time.
//!
//! A line or a parabola of weighted least squares, or the Theil-Sen line: the median slope of all pairs of frames, and
//! the median of what it leaves. Each fit counts time from the stamp it is asked about, so that its first two
//! coefficients are the distance and minus the closing speed there.

use super::filter::{Measurement, Posterior};
use crate::real::median;
use std::f64::consts::{FRAC_PI_2, PI};

/// The curve that is fitted to the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    Line,
    Parabola,
    TheilSen,
}

/// The most frames that a window remembers, however long it is.
pub(super) const MOST: usize = 512;
/// The most frames for a Theil-Sen line, because its time grows with the square of them.
const MOST_OF_PAIRS: usize = 64;
/// Variance of the median of normal numbers, over the variance of their mean.
const MEDIAN: f64 = FRAC_PI_2;
/// Variance of the median of pairwise slopes, over the variance of a least-squares slope, for normal noise.
const PAIRS: f64 = PI / 3.0;

/// The frames of the newest seconds, and the curve to fit to them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Window {
    seconds: f64,
    fit: Fit,
    /// Standard deviation of the derivative that the fit does not model: acceleration for a line, jerk for a parabola.
    unmodelled: f64,
    /// The frames, oldest first.
    pub(super) frames: Vec<Measurement>,
}

impl Window {
    pub(super) fn new(seconds: f64, fit: Fit, unmodelled: f64) -> Self {
        Window { seconds, fit, unmodelled, frames: Vec::new() }
    }

    /// The frames that an answer needs: one more than determine the fit.
    pub(super) fn frames_needed(&self) -> usize {
        if self.fit == Fit::Parabola { 4 } else { 3 }
    }

    /// Takes a frame, and drops those older than the window, as long as enough stay for the fit: a sensor with few
    /// frames a second still gets an answer.
    pub(super) fn update(&mut self, new: Measurement) {
        self.frames.push(new);
        let most = if self.fit == Fit::TheilSen { MOST_OF_PAIRS } else { MOST };
        let (oldest, n) = (new.stamp - self.seconds, self.frames.len());
        let old = self.frames.iter().take_while(|frame| frame.stamp < oldest).count();
        let gone = old.min(n.saturating_sub(self.frames_needed())).max(n.saturating_sub(most));
        self.frames.drain(..gone);
    }

    /// What the fit says of `stamp`, from two frames on. `variance` is that of every frame without its own.
    pub(super) fn posterior(&self, stamp: f64, variance: f64) -> Option<Posterior> {
        let parabola = self.fit == Fit::Parabola && self.frames.len() >= 3;
        match self.frames.len() {
            0 | 1 => None,
            _ if parabola => Some(self.least_squares::<3>(stamp, variance)),
            _ if self.fit == Fit::TheilSen => Some(self.theil_sen(stamp, variance)),
            _ => Some(self.least_squares::<2>(stamp, variance)),
        }
    }

    /// Weighted least squares of `C` coefficients in the time from `stamp`.
    ///
    /// The polynomial cannot follow the next power of time, whose coefficient is known by its standard deviation only.
    /// That power moves the first two coefficients by a known vector, whose square joins the covariance as the model's
    /// bias.
    fn least_squares<const C: usize>(&self, stamp: f64, variance: f64) -> Posterior {
        let newest = self.frames[self.frames.len() - 1].distance;
        let scale = stamp - self.frames[0].stamp; // times are divided by it, for a well-conditioned fit
        let mut normal = [[0.0; C]; C];
        let (mut fitted, mut bias) = ([0.0; C], [0.0; C]);
        for frame in &self.frames {
            let x = (frame.stamp - stamp) / scale;
            let weight = 1.0 / if frame.has_own_variance { frame.variance } else { variance };
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
                bias[row] += powers[row] * next;
                basis *= x;
            }
        }
        let inverse = inverted(normal);
        let of = |right: [f64; C], row: usize| (0..C).map(|column| inverse[row][column] * right[column]).sum::<f64>();
        // The coefficient of the next power is its derivative over C!, in scaled time.
        let factorial = if C == 2 { 2.0 } else { 6.0 };
        let unmodelled = self.unmodelled * (0..C).fold(1.0, |power, _| power * scale) / factorial;
        let (bias_d, bias_v) = (unmodelled * of(bias, 0), -unmodelled * of(bias, 1) / scale);
        Posterior {
            distance: newest + of(fitted, 0),
            closing_speed: -of(fitted, 1) / scale,
            dd: inverse[0][0] + bias_d * bias_d,
            dv: -inverse[0][1] / scale + bias_d * bias_v,
            vv: inverse[1][1] / (scale * scale) + bias_v * bias_v,
            model_bias: bias_d * bias_d,
        }
    }

    /// The Theil-Sen line. `bias` is what half an acceleration times the square of time does to it: the projection of
    /// least squares.
    fn theil_sen(&self, stamp: f64, variance: f64) -> Posterior {
        let (frames, acceleration) = (&self.frames, self.unmodelled);
        let n = frames.len() as f64;
        let mean = |f: &dyn Fn(&Measurement) -> f64| frames.iter().map(f).sum::<f64>() / n;
        let pairs = frames
            .iter()
            .enumerate()
            .flat_map(|(i, a)| frames[..i].iter().map(move |b| (a.distance - b.distance) / (a.stamp - b.stamp)));
        let slope = median(&mut pairs.collect::<Vec<f64>>());
        let mut left: Vec<f64> = frames.iter().map(|frame| frame.distance - slope * (frame.stamp - stamp)).collect();
        let distance = median(&mut left);
        let noise = mean(&|frame| if frame.has_own_variance { frame.variance } else { variance });
        let centre = mean(&|frame| frame.stamp - stamp);
        let spread = mean(&|frame| (frame.stamp - stamp - centre).powi(2));
        let (of_centre, of_slope) = (MEDIAN * noise / n, PAIRS * noise / (n * spread));
        let square = |frame: &Measurement| (frame.stamp - stamp).powi(2);
        let level = mean(&square);
        let tilt = mean(&|frame| (frame.stamp - stamp - centre) * (square(frame) - level)) / spread;
        let (bias_d, bias_v) = (0.5 * acceleration * (level - tilt * centre), -0.5 * acceleration * tilt);
        Posterior {
            distance,
            closing_speed: -slope,
            dd: of_centre + centre * centre * of_slope + bias_d * bias_d,
            dv: centre * of_slope + bias_d * bias_v,
            vv: of_slope + bias_v * bias_v,
            model_bias: bias_d * bias_d,
        }
    }
}

/// The inverse of a positive definite matrix, by Gauss and Jordan; such a matrix needs no pivoting.
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
