//! The motion that cells agree upon.

use super::witnesses::Witnesses;

/// m/s^2, standard deviation of an acceleration where there is one: hard braking is 2 of them.
const ACCELERATION: f64 = 5.0;
/// How often there is one.
const ACCELERATES: f64 = 0.1;
/// How many frames the belief is worth that frames differ by no more than their points do.
const KNOWN_FIT: f64 = 2.0;
/// Share of a closing speed that it may be off by, because rings pass from cell to cell.
const SYSTEMATIC: f64 = 0.003;
/// Less than any weight that matters.
const NOTHING: f64 = 1e-12;

/// A motion `speed t + bend t^2`, and what is not known about its speed.
pub(super) struct Fit {
    pub speed: f64,
    pub bend: f64,
    pub variance: f64,
    /// By how much more frames differ than their points do, as a ratio of variances.
    pub misfit: f64,
}

/// Weighted sums of products.
#[derive(Default)]
struct Sums {
    tt: f64,
    tq: f64,
    qq: f64,
    ty: f64,
    qy: f64,
}

impl Fit {
    /// Regress within cells, over the last `frames` frames: a line and a parabola, averaged by how likely they are.
    ///
    /// `weight` is 0 in the frames before those. `noise` is the variance of a point, and by how much more frames scatter.
    pub fn new(
        seen: &Witnesses,
        time: &[f64],
        weight: &[f64],
        x: &[f64],
        [noise, scatter]: [f64; 2],
        frames: usize,
    ) -> Option<Self> {
        let means = Means::new(seen, time, weight, x);
        let mut sums = Sums::default();
        each(seen, time, |i, _, t| {
            let [dt, dq, dy] = means.within(seen.cell[i], t, x[i]);
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
        // What is known of the bend once the line is taken out.
        let (known, told) = ((qq - tq * tq / tt).max(0.0) / noise, (qy - tq * ty / tt) / noise);
        let mut misfit = 1.0;
        if frames > 3 && known > 0.0 {
            let bend = told / known;
            let slope = (ty - tq * bend) / tt;
            misfit = excess(seen, time, weight, noise, frames - 3, |i, t| {
                let [dt, dq, dy] = means.within(seen.cell[i], t, x[i]);
                dy - slope * dt - bend * dq
            });
        }
        let scale = misfit.max(scatter);
        let (known, told) = (known / scale, told / scale);
        // x bends by half the acceleration.
        let expected = 4.0 / (ACCELERATION * ACCELERATION);
        let sure = known + expected;
        let bend = told / sure;
        let (line, parabola) = (ty / tt, (ty - tq * bend) / tt);
        let evidence = (expected / sure).sqrt() * (told * told / sure / 2.0).min(300.0).exp();
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

/// Weighted means over each cell of time, its square, and distance.
struct Means(Vec<[f64; 3]>);

impl Means {
    fn new(seen: &Witnesses, time: &[f64], weight: &[f64], x: &[f64]) -> Self {
        let mut sums = vec![[0.0; 3]; seen.cells()];
        let mut total = vec![NOTHING; seen.cells()];
        each(seen, time, |i, _, t| {
            let (w, [at, aq, ay]) = (weight[i], &mut sums[seen.cell[i]]);
            *at += w * t;
            *aq += w * t * t;
            *ay += w * x[i];
            total[seen.cell[i]] += w;
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

/// Call with each entry, its frame and its time.
fn each(seen: &Witnesses, time: &[f64], mut call: impl FnMut(usize, usize, f64)) {
    for (frame, (range, t)) in seen.by_frame().zip(time).enumerate() {
        for i in range {
            call(i, frame, *t);
        }
    }
}

/// By how much more frames differ than their points do, with so many frames free to.
fn excess(
    seen: &Witnesses,
    time: &[f64],
    weight: &[f64],
    noise: f64,
    free: usize,
    residual: impl Fn(usize, f64) -> f64,
) -> f64 {
    let mut frames = vec![(0.0, NOTHING); time.len()];
    each(seen, time, |i, frame, t| {
        let (sum, total) = &mut frames[frame];
        *sum += weight[i] * residual(i, t);
        *total += weight[i];
    });
    let differ: f64 = frames.iter().map(|(sum, total)| sum * sum / total).sum();
    (KNOWN_FIT + differ / noise) / (KNOWN_FIT + free as f64)
}
