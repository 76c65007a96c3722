//! Speed now from positions of the newest second, averaged over models of motion by their evidence.
//!
//! A car does not move along a line or a parabola: its acceleration changes by 1 m/s^2 within half a second, or not at
//! all. So there are several models: a line, and on it an acceleration that begins with a given standard deviation and
//! changes as the integral of white jerk. What is common to all of a frame is off by one of several noises. Under each
//! of these pairs the positions are jointly normal, so that their marginal likelihood and the motion now are in closed
//! form: one Cholesky factor each. The average, weighed by the likelihoods, is the estimate; its variance is that of
//! the mixture.

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
pub fn estimate(time: &[f64], position: &[f64], covariance: &[f64], metre: f64) -> Kinematics {
    let (n, unit) = (time.len(), metre * metre);
    // Less the line through the ends, so that no digits are lost where the body is fast.
    let (first, last) = (position[0], position[n - 1]);
    let slope = (first - last) / time[0];
    let bent: Vec<f64> = position.iter().zip(time).map(|(p, t)| p - last - slope * t).collect();
    let mut parts = Vec::with_capacity(MODELS.len() * FRAME_NOISES.len());
    let (mut total, mut white) = (vec![0.0; n * n], vec![[0.0; COLUMNS]; n]);
    for model in MODELS {
        let kernel = Kernel::new(time, model, unit);
        for (share, noise) in FRAME_NOISES {
            for i in 0..n {
                for j in 0..=i {
                    total[i * n + j] = covariance[i * n + j] + kernel.positions[i * n + j];
                }
                total[i * n + i] += unit * (noise * noise + ROUNDING);
                white[i] = [1.0, time[i], bent[i], kernel.positions[(n - 1) * n + i], kernel.speed[i]];
            }
            let determinant = whiten(&mut total, &mut white);
            let (evidence, part) = kernel.posterior(&gram(&white));
            parts.push((evidence + (model.share * share / determinant).ln(), part));
        }
    }
    let found = mean(&parts);
    let speed = found.speed + slope;
    Kinematics { position: found.position + last, speed, ss: found.ss + (SYSTEMATIC * speed).powi(2), ..found }
}

/// The columns that are whitened together: the level and slope of the line, the positions, and the covariances of the
/// positions with position and speed now.
const COLUMNS: usize = 5;
const POSITIONS: usize = 2;
const NOW: [usize; 2] = [3, 4];

/// The prior covariance of all that a model says, less the line.
struct Kernel {
    /// That of the positions, by rows; the lower triangle.
    positions: Vec<f64>,
    /// Covariance of each position with the speed now.
    speed: Vec<f64>,
    /// Variance of the speed now.
    variance: f64,
}

impl Kernel {
    /// With white jerk the position is its threefold integral since the first time.
    fn new(time: &[f64], model: Model, unit: f64) -> Self {
        let n = time.len();
        let (jerk, acceleration) = (unit * model.jerk, unit * model.acceleration * model.acceleration);
        let now = -time[0];
        let since = |i: usize| time[i] - time[0];
        let mut positions = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let (u, apart) = (since(j), time[i] - time[j]);
                let integral = u * u * u * (u * u / 20.0 + apart * u / 8.0 + apart * apart / 12.0);
                let bend = since(i) * since(i) * u * u / 4.0;
                positions[i * n + j] = jerk * integral + acceleration * bend;
            }
        }
        let speed = |i: usize| {
            let u = since(i);
            jerk * u * u * u * (u / 8.0 + (now - u) / 6.0) + acceleration * u * u * now / 2.0
        };
        let variance = now * now * (jerk * now / 3.0 + acceleration);
        Kernel { positions, speed: (0..n).map(speed).collect(), variance }
    }

    /// The log evidence of the model, less that of the determinant, and the motion now; from the inner products of the
    /// whitened columns. The line has a flat prior, and is eliminated by generalized least squares.
    #[allow(clippy::many_single_char_names, reason = "the entries of a matrix of two by two, and their indices")]
    fn posterior(&self, gram: &[[f64; COLUMNS]; COLUMNS]) -> (f64, Kinematics) {
        let [[a, b], [_, c]] = [[gram[0][0], gram[0][1]], [0.0, gram[1][1]]];
        let determinant = a * c - b * b;
        let inverse = |[x, y]: [f64; 2]| [(c * x - b * y) / determinant, (a * y - b * x) / determinant];
        let level = inverse([gram[0][POSITIONS], gram[1][POSITIONS]]);
        let left = |column: usize| gram[column][POSITIONS] - gram[0][column] * level[0] - gram[1][column] * level[1];
        let evidence = -0.5 * left(POSITIONS).max(0.0) - 0.5 * determinant.ln();
        // What the line says of position and speed now that the kernel does not.
        let line = [[1.0 - gram[0][3], -gram[1][3]], [-gram[0][4], 1.0 - gram[1][4]]];
        let prior = [self.positions[self.positions.len() - 1], self.speed[self.speed.len() - 1], self.variance];
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
}

/// Multiplies all columns by the inverse of the Cholesky factor of `total`, whose lower triangle it replaces. Returns
/// the product of the factor's diagonal.
fn whiten(total: &mut [f64], columns: &mut [[f64; COLUMNS]]) -> f64 {
    let n = columns.len();
    let mut determinant = 1.0;
    for i in 0..n {
        let (above, row) = total.split_at_mut(i * n);
        for j in 0..i {
            let earlier = &above[j * n..=j * n + j];
            let known: f64 = earlier[..j].iter().zip(&*row).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - known) / earlier[j];
        }
        let (done, rest) = columns.split_at_mut(i);
        let mut pivot = row[i];
        for (factor, before) in row.iter().zip(done) {
            pivot -= factor * factor;
            rest[0].iter_mut().zip(*before).for_each(|(value, before)| *value -= factor * before);
        }
        row[i] = pivot.sqrt();
        rest[0].iter_mut().for_each(|value| *value /= row[i]);
        determinant *= row[i];
    }
    determinant
}

/// The inner products of all columns; the upper triangle is mirrored.
fn gram(columns: &[[f64; COLUMNS]]) -> [[f64; COLUMNS]; COLUMNS] {
    let mut out = [[0.0; COLUMNS]; COLUMNS];
    for row in columns {
        for i in 0..COLUMNS {
            for j in 0..COLUMNS {
                out[i][j] += row[i] * row[j];
            }
        }
    }
    out
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

    /// Positions at ten frames a second, each with the variance `noise`.
    fn seen(noise: f64, position: impl Fn(f64) -> f64) -> super::Kinematics {
        let time: Vec<f64> = (0..11).map(|i| f64::from(i - 10) / 10.0).collect();
        let positions: Vec<f64> = time.iter().map(|t| position(*t)).collect();
        let covariance: Vec<f64> = (0..121).map(|i| if i % 12 == 0 { noise } else { 0.0 }).collect();
        estimate(&time, &positions, &covariance, 1.0)
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
        let metres = estimate(&time, &position, &covariance(1.0), 1.0);
        let halves = estimate(&time, &position.map(|p| 2.0 * p), &covariance(4.0), 2.0);
        assert!((halves.speed / metres.speed - 2.0).abs() < 1e-9 && (halves.ss / metres.ss - 4.0).abs() < 1e-6);
    }

    #[test]
    fn equal_stamps_tell_nothing() {
        assert!(!estimate(&[0.0; 3], &[1.0, 2.0, 3.0], &[0.0; 9], 1.0).speed.is_finite());
    }
}
