//! Speed now from positions of the newest second, averaged over models of motion by their evidence.
//!
//! A car does not move along a line or a parabola: its acceleration changes by 1 m/s^2 within half a second, or not at
//! all. So there are several models: a line, and on it an acceleration that begins with a given standard deviation and
//! changes as the integral of white jerk. What is common to all of a frame is off by one of several noises. Under each
//! of these pairs the positions are jointly normal, so that their marginal likelihood and the motion now are in closed
//! form: one Cholesky factor each. The average, weighed by the likelihoods, is the estimate; its variance is that of
//! the mixture.

use crate::lanes::{LANES, Lanes, lanes};
use crate::simd::{Instructions, Kernel, Level};

/// A model of how a body accelerates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Model {
    /// Prior probability.
    pub share: f64,
    /// Standard deviation of the acceleration at first, m/s^2.
    pub acceleration: f64,
    /// Spectral density of the jerk, m^2/s^5.
    pub jerk: f64,
}

/// A line, a steady foot, traffic, and an emergency.
pub(crate) const MODELS: [Model; 4] = [
    Model { share: 0.3, acceleration: 0.0, jerk: 0.0 },
    Model { share: 0.3, acceleration: 0.5, jerk: 0.3 },
    Model { share: 0.3, acceleration: 0.7, jerk: 3.0 },
    Model { share: 0.1, acceleration: 3.0, jerk: 100.0 },
];
/// Prior probability and standard deviation (m) of the errors that are common to all of a frame.
const FRAME_NOISES: [(f64, f64); 3] = [(0.4, 0.3e-3), (0.4, 2e-3), (0.2, 6e-3)];
/// A variance that keeps matrices regular, m^2.
const ROUNDING: f64 = 1e-9;
/// The error of a speed as a share of it, which no number of frames averages out.
pub(crate) const SYSTEMATIC: f64 = 0.015;

/// Position and speed at the newest frame, and the covariance of their errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kinematics {
    /// Mean position.
    pub position: f64,
    /// Mean speed.
    pub speed: f64,
    /// Variance of the position.
    pub pp: f64,
    /// Covariance of position and speed.
    pub ps: f64,
    /// Variance of the speed.
    pub ss: f64,
}

/// The motion now, averaged over all models. It is not finite where the frames do not tell it.
///
/// Times are counted from now (s), so the last is 0. `covariance` is that of the positions by rows, up to a common
/// shift. `metre` is the length of a metre in the unit of the positions. There may be up to 32 positions.
#[must_use]
pub fn estimate(time: &[f64], position: &[f64], covariance: &[f64], metre: f64, level: Level) -> Kinematics {
    // Less the line through the ends, so that no digits are lost where the body is fast.
    let (first, last) = (position[0], position[position.len() - 1]);
    let slope = (first - last) / time[0];
    let bent: Vec<f64> = position.iter().zip(time).map(|(p, t)| p - last - slope * t).collect();
    let found = mean(&level.run(Posteriors { time, bent: &bent, covariance, unit: metre * metre }));
    let speed = found.speed + slope;
    Kinematics { position: found.position + last, speed, ss: found.ss + (SYSTEMATIC * speed).powi(2), ..found }
}

/// The columns that are whitened together: the level and slope of the line, the positions, and the covariances of the
/// positions with position and speed now.
const COLUMNS: usize = 5;
const POSITIONS: usize = 2;
const NOW: [usize; 2] = [3, 4];

/// The inner products of whitened columns.
type Gram<T> = [[T; COLUMNS]; COLUMNS];

/// The number of pairs of a model and a noise.
const PARTS: usize = MODELS.len() * FRAME_NOISES.len();

/// Finds the log evidence and the motion now of each pair of a model and a noise. Each has a lane; the last lanes are
/// not used.
struct Posteriors<'a> {
    time: &'a [f64],
    bent: &'a [f64],
    covariance: &'a [f64],
    unit: f64,
}

impl Kernel for Posteriors<'_> {
    type Output = [(f64, Kinematics); PARTS];

    #[inline(always)]
    fn run<I: Instructions>(self, _simd: I) -> Self::Output {
        let Posteriors { time, bent, covariance, unit } = self;
        let (n, now) = (time.len(), -time[0]);
        let pair = |lane: usize| (MODELS[lane % PARTS / FRAME_NOISES.len()], FRAME_NOISES[lane % FRAME_NOISES.len()]);
        let jerk: Lanes<f64> = lanes(|lane| unit * pair(lane).0.jerk);
        let acceleration: Lanes<f64> = lanes(|lane| unit * pair(lane).0.acceleration * pair(lane).0.acceleration);
        let noise: Lanes<f64> = lanes(|lane| unit * (pair(lane).1.1 * pair(lane).1.1 + ROUNDING));
        // Prior covariances of all that a model says, less the line. With white jerk the position is its threefold
        // integral since the first time.
        let prior = |[of_jerk, of_acceleration]: [f64; 2]| -> Lanes<f64> {
            lanes(|lane| jerk[lane] * of_jerk + acceleration[lane] * of_acceleration)
        };
        let with_speed = |u: f64| prior([u * u * u * (u / 8.0 + (now - u) / 6.0), u * u * now / 2.0]);
        let with_position = |i: usize, j: usize| {
            let (u, apart) = (time[j] - time[0], time[i] - time[j]);
            let since = time[i] - time[0];
            prior([u * u * u * (u * u / 20.0 + apart * u / 8.0 + apart * apart / 12.0), since * since * u * u / 4.0])
        };
        let mut factor = vec![[0.0; LANES]; n * n];
        let mut inverse_pivots = vec![[0.0; LANES]; n];
        let mut white = vec![[[0.0; LANES]; COLUMNS]; n];
        let (mut determinant, mut products) = ([1.0; LANES], [[[0.0; LANES]; COLUMNS]; COLUMNS]);
        for i in 0..n {
            // A row of the Cholesky factor of the covariance, and of all columns multiplied by its inverse.
            let (above, row) = factor.split_at_mut(i * n);
            for j in 0..=i {
                let mut left = with_position(i, j);
                let earlier = if j < i { &above[j * n..][..j] } else { &[] };
                for (a, b) in earlier.iter().zip(&*row) {
                    for lane in 0..LANES {
                        left[lane] -= a[lane] * b[lane];
                    }
                }
                row[j] = lanes(|lane| left[lane] + covariance[i * n + j]);
                if j < i {
                    row[j] = lanes(|lane| row[j][lane] * inverse_pivots[j][lane]);
                }
            }
            let mut pivot: Lanes<f64> = lanes(|lane| row[i][lane] + noise[lane]);
            let position_now = with_position(n - 1, i);
            let speed_now = with_speed(time[i] - time[0]);
            let mut columns = [[1.0; LANES], [time[i]; LANES], [bent[i]; LANES], position_now, speed_now];
            for (factor, before) in row[..i].iter().zip(&white) {
                for lane in 0..LANES {
                    pivot[lane] -= factor[lane] * factor[lane];
                }
                for (column, before) in columns.iter_mut().zip(before) {
                    for lane in 0..LANES {
                        column[lane] -= factor[lane] * before[lane];
                    }
                }
            }
            let pivot: Lanes<f64> = lanes(|lane| pivot[lane].sqrt());
            inverse_pivots[i] = lanes(|lane| 1.0 / pivot[lane]);
            for lane in 0..LANES {
                determinant[lane] *= pivot[lane];
            }
            for column in &mut columns {
                for lane in 0..LANES {
                    column[lane] *= inverse_pivots[i][lane];
                }
            }
            for a in 0..COLUMNS {
                for b in a..COLUMNS {
                    for lane in 0..LANES {
                        products[a][b][lane] += columns[a][lane] * columns[b][lane];
                    }
                }
            }
            white[i] = columns;
        }
        let now = [with_position(n - 1, n - 1), with_speed(now), prior([now * now * now / 3.0, now * now])];
        std::array::from_fn(|part| {
            let gram = products.map(|row| row.map(|lanes| lanes[part]));
            let (likelihood, motion) = posterior(&gram, now.map(|lanes| lanes[part]));
            let (model, (share, _)) = pair(part);
            (likelihood + (model.share * share / determinant[part]).ln(), motion)
        })
    }
}

/// The log evidence of a model, less that of the determinant, and the motion now; from the upper triangle of the inner
/// products, and the prior covariance of position and speed now. The line has a flat prior, and is eliminated by
/// generalized least squares.
#[inline(always)]
#[allow(clippy::many_single_char_names, reason = "the entries of a matrix of two by two, and their indices")]
fn posterior(gram: &Gram<f64>, prior: [f64; 3]) -> (f64, Kinematics) {
    let [a, b, c] = [gram[0][0], gram[0][1], gram[1][1]];
    let determinant = a * c - b * b;
    let inverse = |[x, y]: [f64; 2]| [(c * x - b * y) / determinant, (a * y - b * x) / determinant];
    let level = inverse([gram[0][POSITIONS], gram[1][POSITIONS]]);
    let left = |column: usize| gram[POSITIONS][column] - gram[0][column] * level[0] - gram[1][column] * level[1];
    let evidence = -0.5 * left(POSITIONS).max(0.0) - 0.5 * determinant.ln();
    // What the line says of position and speed now that the prior does not.
    let line = [[1.0 - gram[0][3], -gram[1][3]], [-gram[0][4], 1.0 - gram[1][4]]];
    let spread = |i: usize, j: usize| {
        let [x, y] = inverse(line[j]);
        prior[i + j] - gram[NOW[i]][NOW[j]] + line[i][0] * x + line[i][1] * y
    };
    let now = Kinematics {
        position: level[0] + left(NOW[0]),
        speed: level[1] + left(NOW[1]),
        pp: spread(0, 0),
        ps: spread(0, 1),
        ss: spread(1, 1),
    };
    (evidence, now)
}

/// The mean and covariance of a mixture, from the log evidence and the motion of each part.
fn mean(parts: &[(f64, Kinematics)]) -> Kinematics {
    let best = parts.iter().map(|(evidence, _)| *evidence).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = parts.iter().map(|(evidence, _)| (evidence - best).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let shares = || weights.iter().map(|weight| weight / sum).zip(parts);
    let mut out = Kinematics::default();
    for (share, (_, part)) in shares() {
        out.position += share * part.position;
        out.speed += share * part.speed;
    }
    for (share, (_, part)) in shares() {
        let (position, speed) = (part.position - out.position, part.speed - out.speed);
        out.pp += share * (part.pp + position * position);
        out.ps += share * (part.ps + position * speed);
        out.ss += share * (part.ss + speed * speed);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::estimate;
    use crate::simd::Level;

    /// Positions at ten frames a second, each with the variance `noise`.
    fn seen(noise: f64, position: impl Fn(f64) -> f64) -> super::Kinematics {
        let time: Vec<f64> = (0..11).map(|i| f64::from(i - 10) / 10.0).collect();
        let positions: Vec<f64> = time.iter().map(|t| position(*t)).collect();
        let covariance: Vec<f64> = (0..121).map(|i| if i % 12 == 0 { noise } else { 0.0 }).collect();
        estimate(&time, &positions, &covariance, 1.0, Level::best())
    }

    #[test]
    fn a_line_is_followed_exactly_however_fast() {
        for speed in [0.0, -5.0, 60.0] {
            let found = seen(1e-6, |t| 20.0 + speed * t);
            assert!((found.speed - speed).abs() < 1e-9 && (found.position - 20.0).abs() < 1e-9, "{found:?}");
            assert!(found.ss > 0.0 && found.pp > 0.0 && found.ps * found.ps < found.pp * found.ss);
        }
    }

    #[test]
    fn a_car_that_begins_to_brake_is_followed_and_the_variance_allows_for_it() {
        let braking = |t: f64| -10.0 * t + 3.0 * (t + 0.3).max(0.0).powi(2);
        let found = seen(1e-6, braking);
        let error = found.speed - (-10.0 + 6.0 * 0.3);
        assert!(error.abs() < 3.0 * found.ss.sqrt() && error.abs() < 0.3, "{found:?}");
        assert!(found.ss.sqrt() < 0.4);
    }

    #[test]
    fn the_unit_of_positions_does_not_matter() {
        let (time, position) = ([-0.3, -0.2, -0.1, 0.0], [1.0, 0.8, 0.59, 0.4]);
        let covariance = |unit: f64| [1.0; 16].map(|_| 0.0 * unit);
        let metres = estimate(&time, &position, &covariance(1.0), 1.0, Level::best());
        let halves = estimate(&time, &position.map(|p| 2.0 * p), &covariance(4.0), 2.0, Level::best());
        assert!((halves.speed / metres.speed - 2.0).abs() < 1e-9 && (halves.ss / metres.ss - 4.0).abs() < 1e-6);
    }

    #[test]
    fn equal_stamps_tell_nothing() {
        assert!(!estimate(&[0.0; 3], &[1.0, 2.0, 3.0], &[0.0; 9], 1.0, Level::best()).speed.is_finite());
    }
}
