//! The motion that the cells agree upon.
//!
//! All cells share one motion, so the regression is within cells: time and distance less their means in each cell. A
//! line and a parabola are fitted and averaged by their probabilities, because most bodies do not accelerate. Frames
//! that scatter more than their points explain count for less.

use super::profile::Sighting;
use super::weights::{CellObservations, Weights, irls_weights};
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

/// Frames whose residuals are larger than this times their scatter, as a ratio of variances, do not move by one
/// acceleration.
const MISFIT: f64 = 2.0;
/// The fewest frames that a window is shortened to.
const FEWEST: usize = 3;

/// The motion of a body, from its sightings; `None` where nothing tells it.
///
/// Where the frames do not move by one acceleration, the oldest are left out.
#[must_use]
pub fn trend(sightings: &[Sighting], range_noise: f64) -> Option<Trend> {
    let last = sightings.last()?.stamp;
    let time: Vec<f64> = sightings.iter().map(|sighting| sighting.stamp - last).collect();
    let observed = CellObservations::new(sightings);
    let found = irls_weights(&observed, range_noise);
    let scatter = scatter(&observed, &time, &found);
    let Weights { mut weight, x, noise, .. } = found;
    let mut frames = sightings.len();
    let fit = loop {
        let fit = Fit::new(&observed, &time, &weight, &x, [noise, scatter], frames)?;
        if fit.misfit <= MISFIT * scatter || frames <= FEWEST {
            break fit;
        }
        frames -= 1;
        weight[..observed.starts[sightings.len() - frames]].fill(0.0);
    };
    let mut edges: Vec<f64> =
        sightings.iter().zip(&time).map(|(sighting, t)| sighting.edge - (fit.speed + fit.bend * t) * t).collect();
    Some(Trend { distance: median(&mut edges), closing_speed: -fit.speed, variance: fit.variance })
}

/// The frames of a third difference.
const RUN: usize = 4;
/// The median of the square of a normal number.
const MEDIAN_SQUARE: f64 = 0.4549;
/// The prior weight, in differences, of the belief that frames scatter no more than their points.
const KNOWN_SCATTER: f64 = 2.0;
/// A frame of less weight than this says nothing.
const LEAST_FRAME_WEIGHT: f64 = 1e-9;

/// The scatter of whole frames over that of their points, as a ratio of variances; at least 1.
///
/// A car that nods sees the body at other heights in each frame, and all cells are off together: more points do not
/// average that out. It shows in the positions themselves. Of four frames in a row, the part of the motion that no
/// parabola has, their third difference, should be no more than their points make it. Where a driver begins to brake
/// only the few differences across that moment are larger, so the median of all is that of the scatter.
fn scatter(observed: &CellObservations, time: &[f64], found: &Weights) -> f64 {
    let totals: Vec<f64> = observed.by_frame().map(|range| found.weight[range].iter().sum()).collect();
    let runs = time.windows(RUN).zip(found.position.windows(RUN)).zip(totals.windows(RUN));
    let mut ratios: Vec<f64> =
        runs.filter_map(|((time, position), total)| ratio(time, position, total, found.noise)).collect();
    if ratios.is_empty() {
        return 1.0;
    }
    let differences = ratios.len() as f64;
    let typical = median(&mut ratios) / MEDIAN_SQUARE;
    ((KNOWN_SCATTER + differences * typical) / (KNOWN_SCATTER + differences)).max(1.0)
}

/// The square of a third difference over its expected value; `None` where a frame says nothing.
fn ratio(time: &[f64], position: &[f64], total: &[f64], noise: f64) -> Option<f64> {
    if total.iter().any(|total| *total <= LEAST_FRAME_WEIGHT) {
        return None;
    }
    let (mut difference, mut variance) = (0.0, 0.0);
    for i in 0..RUN {
        let apart: f64 = (0..RUN).filter(|j| *j != i).map(|j| time[i] - time[j]).product();
        difference += position[i] / apart;
        variance += noise / (apart * apart * total[i]);
    }
    let ratio = difference * difference / variance;
    ratio.is_finite().then_some(ratio) // stamps may be too near each other
}

/// Standard deviation of an acceleration where there is one, m/s^2; hard braking is 2 of them.
const ACCELERATION: f64 = 5.0;
/// The prior probability that there is an acceleration.
const ACCELERATES: f64 = 0.1;
/// The prior weight, in frames, of the belief that frames differ no more than their points.
const KNOWN_FIT: f64 = 2.0;
/// The error of a closing speed as a share of it, because rings pass from cell to cell.
const SYSTEMATIC: f64 = 0.003;
/// A weight below any that matters, against division by 0.
const NOTHING: f64 = 1e-12;

/// A motion `speed t + bend t^2`, and the variance of its speed.
struct Fit {
    speed: f64,
    bend: f64,
    variance: f64,
    /// The residuals of frames over what their points explain, as a ratio of variances.
    misfit: f64,
}

/// Weighted sums of products of the time `t`, its square `q` and the distance `y`, each less its mean in a cell.
#[derive(Default)]
struct Sums {
    tt: f64,
    tq: f64,
    qq: f64,
    ty: f64,
    qy: f64,
}

impl Fit {
    /// Regresses within cells over the last `frames` frames: a line and a parabola, averaged by their probabilities.
    ///
    /// `weight` is 0 in the frames before those. `noise` is the variance of a point, and `scatter` the ratio of
    /// [`scatter()`].
    fn new(
        observed: &CellObservations,
        time: &[f64],
        weight: &[f64],
        x: &[f64],
        [noise, scatter]: [f64; 2],
        frames: usize,
    ) -> Option<Self> {
        let means = Means::new(observed, time, weight, x);
        let mut sums = Sums::default();
        each(observed, time, |i, _, t| {
            let [dt, dq, dy] = means.within(observed.cell[i], t, x[i]);
            let w = weight[i];
            sums.tt += w * dt * dt;
            sums.tq += w * dt * dq;
            sums.qq += w * dq * dq;
            sums.ty += w * dt * dy;
            sums.qy += w * dq * dy;
        });
        let Sums { tt, tq, qq, ty, qy } = sums;
        if tt <= NOTHING {
            return None;
        }
        // The precision of the bend once the line is taken out, and that precision times the bend.
        let (known, weighted) = ((qq - tq * tq / tt).max(0.0) / noise, (qy - tq * ty / tt) / noise);
        let mut misfit = 1.0;
        if frames > 3 && known > 0.0 {
            let bend = weighted / known;
            let slope = (ty - tq * bend) / tt;
            misfit = excess(observed, time, weight, noise, frames - 3, |i, t| {
                let [dt, dq, dy] = means.within(observed.cell[i], t, x[i]);
                dy - slope * dt - bend * dq
            });
        }
        let scale = misfit.max(scatter);
        let (known, weighted) = (known / scale, weighted / scale);
        // x bends by half the acceleration.
        let expected = 4.0 / (ACCELERATION * ACCELERATION);
        let sure = known + expected;
        let bend = weighted / sure;
        let (line, parabola) = (ty / tt, (ty - tq * bend) / tt);
        let evidence = (expected / sure).sqrt() * (weighted * weighted / sure / 2.0).min(300.0).exp();
        let odds = ACCELERATES / (1.0 - ACCELERATES) * evidence;
        let share = odds / (1.0 + odds);
        let apart = parabola - line;
        let variance = scale * noise / tt
            + (SYSTEMATIC * line).powi(2)
            + share * (tq / tt).powi(2) / sure
            + share * (1.0 - share) * apart * apart;
        Some(Fit { speed: line + share * apart, bend: share * bend, variance, misfit })
    }
}

/// The weighted means of time, its square and distance in each cell.
struct Means(Vec<[f64; 3]>);

impl Means {
    fn new(observed: &CellObservations, time: &[f64], weight: &[f64], x: &[f64]) -> Self {
        let mut sums = vec![[0.0; 3]; observed.cells()];
        let mut total = vec![NOTHING; observed.cells()];
        each(observed, time, |i, _, t| {
            let (w, [at, aq, ay]) = (weight[i], &mut sums[observed.cell[i]]);
            *at += w * t;
            *aq += w * t * t;
            *ay += w * x[i];
            total[observed.cell[i]] += w;
        });
        for (sum, total) in sums.iter_mut().zip(&total) {
            *sum = sum.map(|sum| sum / total);
        }
        Means(sums)
    }

    fn within(&self, cell: usize, t: f64, x: f64) -> [f64; 3] {
        let [mean_t, mean_q, mean_x] = self.0[cell];
        [t - mean_t, t * t - mean_q, x - mean_x]
    }
}

/// Calls with each entry, its frame and its time.
fn each(observed: &CellObservations, time: &[f64], mut call: impl FnMut(usize, usize, f64)) {
    for (frame, (range, t)) in observed.by_frame().zip(time).enumerate() {
        for i in range {
            call(i, frame, *t);
        }
    }
}

/// The residuals of frames over what their points explain, as a ratio of variances with `free` degrees of freedom.
fn excess(
    observed: &CellObservations,
    time: &[f64],
    weight: &[f64],
    noise: f64,
    free: usize,
    residual: impl Fn(usize, f64) -> f64,
) -> f64 {
    let mut frames = vec![(0.0, NOTHING); time.len()];
    each(observed, time, |i, frame, t| {
        let (sum, total) = &mut frames[frame];
        *sum += weight[i] * residual(i, t);
        *total += weight[i];
    });
    let differ: f64 = frames.iter().map(|(sum, total)| sum * sum / total).sum();
    (KNOWN_FIT + differ / noise) / (KNOWN_FIT + free as f64)
}

#[cfg(test)]
mod tests {
    use super::{ratio, trend};
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
            assert!((found.closing_speed - speed - acceleration).abs() < 2e-3, "{found:?}");
            assert!((found.distance - 20.0 + speed + acceleration / 2.0).abs() < 2e-3, "{found:?}");
            assert!(found.variance > 0.0 && found.variance < 1e-2);
        }
    }

    #[test]
    fn one_frame_tells_nothing() {
        assert_eq!(trend(&approach(1.0, 0.0)[..1], 0.02), None);
        assert_eq!(trend(&[], 0.02), None);
    }

    #[test]
    fn a_parabola_does_not_scatter_and_what_no_parabola_has_does() {
        let (time, total) = ([-0.4, -0.3, -0.1, 0.0], [50.0; 4]);
        let parabola = time.map(|t: f64| 3.0 - 2.0 * t + 4.0 * t * t);
        assert!(ratio(&time, &parabola, &total, 4e-4).unwrap() < 1e-9);
        // One frame of equal ones that is off by as much as its points make it: its share of the variance.
        let even = [0.0, 0.1, 0.2, 0.3];
        let off = [0.0, (4e-4_f64 / 50.0).sqrt(), 0.0, 0.0];
        assert!((ratio(&even, &off, &total, 4e-4).unwrap() - 9.0 / 20.0).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_said_is_not() {
        assert_eq!(ratio(&[0.0, 0.1, 0.2, 0.3], &[0.0; 4], &[50.0, 50.0, 0.0, 50.0], 4e-4), None);
        assert_eq!(ratio(&[0.0, 1e-300, 2e-300, 3e-300], &[0.0, 1.0, 0.0, 0.0], &[50.0; 4], 4e-4), None);
    }
}
