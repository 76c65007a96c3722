//! One target: its filter, how noisy its distances are, whether the model follows them, and whether the gap is
//! stationary.
//!
//! A new distance is compared with what the filter predicts: the difference is the innovation. Divided by its standard
//! deviation it teaches three things. Its size tells the [`NoiseLevel`]. Its likeness from frame to frame tells whether
//! the model lags behind, the [`InnovationCorrelation`]. The [`StationaryTest`] asks a filter of its own whether a gap
//! shrinks at all.

use super::bank::FilterBank;
use super::filter::{KalmanFilter, Measurement, Model, Posterior};
use super::settings::{Method, Noise, Settings};
use super::window::{Fit, Window};

/// A target that is followed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Track {
    pub(super) filter: Filter,
    pub(super) stationary: StationaryTest,
    pub(super) correlation: InnovationCorrelation,
    pub(super) last: Measurement,
    /// The frames in a row that belonged to this track.
    pub(super) consecutive_hits: u32,
}

/// How a distance compares with what a track predicts.
pub(super) struct Innovation {
    /// The measured less the predicted distance, m.
    pub value: f64,
    /// The innovation in standard deviations of the noise alone, so that a bias of the model shows in it. `None` after
    /// a single frame.
    pub normalized: Option<f64>,
    /// Whether the distance is near enough to belong to the track.
    pub in_gate: bool,
}

impl Track {
    pub(super) fn empty(method: Method) -> Self {
        Track {
            filter: Filter::new(method),
            stationary: StationaryTest::new(),
            correlation: InnovationCorrelation::new(),
            last: Measurement { stamp: 0.0, distance: 0.0, variance: 1.0, has_own_variance: false },
            consecutive_hits: 0,
        }
    }

    pub(super) fn new(method: Method, first: Measurement) -> Self {
        let mut track = Track::empty(method);
        track.push(first);
        track
    }

    /// Whether the track has seen too few frames to say anything.
    pub(super) fn is_warming_up(&self) -> bool {
        self.filter.frames() < self.filter.frames_needed()
    }

    /// The innovation of a distance, and whether the gate admits it.
    pub(super) fn innovation(&self, new: Measurement, settings: &Settings, noise: &NoiseLevel) -> Innovation {
        let Some(predicted) = self.filter.posterior(new.stamp, noise.variance()) else {
            let value = new.distance - self.last.distance;
            let farthest = settings.max_speed * (new.stamp - self.last.stamp);
            return Innovation { value, normalized: None, in_gate: value.abs() <= farthest };
        };
        let value = new.distance - predicted.distance;
        let normalized = value / (predicted.dd - predicted.model_bias + new.variance).sqrt();
        let deviation = (predicted.dd * self.correlation.variance_factor() + new.variance).sqrt();
        Innovation { value, normalized: Some(normalized), in_gate: value.abs() <= settings.innovation_gate * deviation }
    }

    /// Takes a distance that belongs to the track.
    pub(super) fn update(&mut self, new: Measurement, innovation: &Innovation) {
        if let Some(normalized) = innovation.normalized {
            self.correlation.learn(normalized);
        }
        self.push(new);
    }

    fn push(&mut self, new: Measurement) {
        self.filter.update(new);
        self.stationary.update(new);
        self.last = new;
        self.consecutive_hits = self.consecutive_hits.saturating_add(1);
    }

    /// Distance and closing speed at `stamp`, once the track has warmed up.
    pub(super) fn posterior(&self, stamp: f64, noise: &NoiseLevel) -> Option<Posterior> {
        if self.is_warming_up() {
            return None;
        }
        Some(self.filter.posterior(stamp, noise.variance())?.widened(self.correlation.variance_factor()))
    }
}

/// The filter of one target, by any method: it takes distances, and gives a posterior at any later time.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Filter {
    Recursive(KalmanFilter),
    Bank(Box<FilterBank>),
    Window(Window),
}

impl Filter {
    pub(super) fn new(method: Method) -> Self {
        let recursive = |acceleration_noise: f64, jerk_noise: f64, acceleration, memory| {
            Filter::Recursive(KalmanFilter::new(Model {
                acceleration_process_noise: acceleration_noise * acceleration_noise,
                jerk_process_noise: jerk_noise * jerk_noise,
                acceleration,
                memory,
            }))
        };
        match method {
            Method::MotionMixture { memory, scale } => Filter::Bank(Box::new(FilterBank::new(memory, scale))),
            Method::SlidingLine { window, acceleration } => {
                Filter::Window(Window::new(window, Fit::Line, acceleration))
            }
            Method::SlidingParabola { window, jerk } => Filter::Window(Window::new(window, Fit::Parabola, jerk)),
            Method::TheilSen { window, acceleration } => {
                Filter::Window(Window::new(window, Fit::TheilSen, acceleration))
            }
            Method::AlphaBeta { memory, acceleration } => recursive(0.0, 0.0, acceleration, Some(memory)),
            Method::KalmanCv { acceleration } => recursive(acceleration, 0.0, 0.0, None),
            Method::KalmanCa { jerk, acceleration } => recursive(0.0, jerk, acceleration, None),
        }
    }

    /// The frames that the filter has seen, as far as it remembers them.
    pub(super) fn frames(&self) -> usize {
        match self {
            Filter::Recursive(filter) => filter.frames as usize,
            Filter::Bank(bank) => bank.frames() as usize,
            Filter::Window(filter) => filter.frames.len(),
        }
    }

    /// The frames that an answer needs.
    fn frames_needed(&self) -> usize {
        match self {
            Filter::Recursive(_) | Filter::Bank(_) => 3,
            Filter::Window(filter) => filter.frames_needed(),
        }
    }

    /// Prepares for questions about `stamp`, which is as late as the newest distance or later.
    pub(super) fn predict(&mut self, stamp: f64) {
        if let Filter::Bank(bank) = self {
            bank.predict(stamp);
        }
    }

    fn update(&mut self, new: Measurement) {
        match self {
            Filter::Recursive(filter) => filter.update(new),
            Filter::Bank(bank) => bank.update(new),
            Filter::Window(filter) => filter.update(new),
        }
    }

    /// What the filter says of `stamp`, from two frames on. `variance` is that of every distance without its own.
    fn posterior(&self, stamp: f64, variance: f64) -> Option<Posterior> {
        match self {
            Filter::Recursive(filter) => (filter.frames >= 2).then(|| filter.posterior(stamp)),
            Filter::Bank(bank) => (bank.frames() >= 2).then(|| bank.posterior(stamp)),
            Filter::Window(filter) => filter.posterior(stamp, variance),
        }
    }
}

/// A normalized innovation as it counts for a variance: an outlier is a sign of noise, but no measure of it.
fn clipped(normalized: f64) -> f64 {
    normalized.clamp(-2.5, 2.5)
}

/// The variance of one distance, given or learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoiseLevel {
    noise: Noise,
    pub(super) sum: f64,
    pub(super) weight: f64,
}

impl NoiseLevel {
    /// The frames that the first estimate weighs as much as.
    const PRIOR: f64 = 3.0;
    /// An estimate never falls below this part of its start, because perfect distances are simulated ones.
    const FLOOR: f64 = 1.0 / 30.0;

    pub(super) fn new(noise: Noise) -> Self {
        match noise {
            Noise::Given(_) => NoiseLevel { noise, sum: 0.0, weight: 0.0 },
            Noise::Estimated { start, .. } => {
                NoiseLevel { noise, sum: Self::PRIOR * start * start, weight: Self::PRIOR }
            }
        }
    }

    pub(super) fn variance(&self) -> f64 {
        match self.noise {
            Noise::Given(noise) => noise * noise,
            Noise::Estimated { start, .. } => {
                (self.sum / self.weight).max((Self::FLOOR * start) * (Self::FLOOR * start))
            }
        }
    }

    /// Half the width of a 90 % interval in standard deviations: Student's where the noise is learnt.
    pub(super) fn quantile(&self) -> f64 {
        match self.noise {
            Noise::Given(_) => NORMAL,
            Noise::Estimated { .. } => student(self.weight),
        }
    }

    /// Learns from the normalized innovation of a distance that was taken to have `variance`.
    ///
    /// Its square times that variance is, on average, the variance that the distance has, if the filter is right
    /// about all else.
    pub(super) fn learn(&mut self, normalized: f64, variance: f64) {
        if let Noise::Estimated { frames, .. } = self.noise {
            let kept = 1.0 - 1.0 / frames;
            self.sum = self.sum * kept + clipped(normalized).powi(2) * variance;
            self.weight = self.weight * kept + 1.0;
        }
    }
}

/// The 95 % quantile of a normal distribution.
pub(super) const NORMAL: f64 = 1.644_853_626_951_472_2;

/// The 95 % quantile of Student's distribution, from 3 degrees of freedom to within 0.3 % (Abramowitz and Stegun
/// 26.7.5).
fn student(freedom: f64) -> f64 {
    let (z, n) = (NORMAL, freedom);
    let z3 = z * z * z;
    let (z5, z7) = (z3 * z * z, z3 * z3 * z);
    z + (z3 + z) / (4.0 * n)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n)
}

/// How alike normalized innovations are from frame to frame. They are alike where the model lags behind or the noise
/// drifts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InnovationCorrelation {
    pub(super) last: f64,
    pub(super) products: f64,
    pub(super) squares: f64,
}

impl InnovationCorrelation {
    /// The frames that the correlation remembers.
    const FRAMES: f64 = 30.0;
    /// The frames that white noise weighs as much as at first.
    const PRIOR: f64 = 10.0;
    /// The largest correlation that an estimate may reach.
    const MOST: f64 = 0.9;

    pub(super) fn new() -> Self {
        InnovationCorrelation { last: 0.0, products: 0.0, squares: Self::PRIOR }
    }

    pub(super) fn learn(&mut self, normalized: f64) {
        let kept = 1.0 - 1.0 / Self::FRAMES;
        let clipped = clipped(normalized);
        self.products = self.products * kept + clipped * self.last;
        self.squares = self.squares * kept + clipped * clipped;
        self.last = clipped;
    }

    /// The factor on the variance of a mean of errors that correlate by r from one to the next: (1 + r) / (1 - r).
    pub(super) fn variance_factor(&self) -> f64 {
        let correlation = (self.products / self.squares).clamp(0.0, Self::MOST);
        (1.0 + correlation) / (1.0 - correlation)
    }
}

/// Tests whether a gap is stationary.
///
/// A standing car is in front for hours, and of any filter's noise a time-to-collision could be made. So a line with
/// fading memory is asked first: it has fewer freedoms than most filters, and tells earlier whether a gap shrinks at
/// all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StationaryTest {
    pub(super) line: KalmanFilter,
    /// The last normalized innovation.
    pub(super) last: f64,
    /// The mean square of normalized innovations. Were the gap stationary, the line would be the right model, and this
    /// would tell the noise of its distances.
    pub(super) spread: f64,
}

impl StationaryTest {
    /// Memory of the line, s.
    const MEMORY: f64 = 0.4;
    /// The slope of the line is significant from this many standard deviations on.
    const SIGNIFICANT: f64 = 6.0;
    /// Distances within this time count as one, s: the noise of a front edge that drifts does not average out in less.
    const TOGETHER: f64 = 0.1;
    /// The frames that the mean square of innovations remembers.
    const FRAMES: f64 = 30.0;
    /// The largest factor on the variance of the slope: the line is no model of a car that brakes.
    const MOST_SPREAD: f64 = 4.0;
    /// From this number of frames on a level line proves that the gap is stationary, against any filter.
    const PROOF: u32 = 10;
    /// An outlier pulls at the line as if it were at most this many standard deviations away.
    const PULL: f64 = 3.0;

    pub(super) fn new() -> Self {
        let line = Model {
            acceleration_process_noise: 0.0,
            jerk_process_noise: 0.0,
            acceleration: 0.0,
            memory: Some(Self::MEMORY),
        };
        StationaryTest { line: KalmanFilter::new(line), last: 0.0, spread: 1.0 }
    }

    /// Takes a distance; a single outlier may not tilt the line.
    fn update(&mut self, new: Measurement) {
        if self.line.frames == 0 {
            return self.line.update(new);
        }
        let variance = new.variance * (Self::TOGETHER / (new.stamp - self.line.stamp)).max(1.0);
        let new = Measurement { variance, ..new };
        if self.line.frames == 1 {
            return self.line.update(new);
        }
        let predicted = self.line.posterior(new.stamp);
        let deviation = (predicted.dd + new.variance).sqrt();
        let normalized = (new.distance - predicted.distance) / deviation;
        let is_single = normalized.signum() * self.last < Self::PULL;
        let pull = if is_single { normalized.clamp(-Self::PULL, Self::PULL) } else { normalized };
        self.last = normalized;
        self.spread += (clipped(normalized).powi(2) - self.spread) / Self::FRAMES;
        self.line.update(Measurement { distance: predicted.distance + pull * deviation, ..new });
    }

    /// Whether a level line proves nothing yet.
    pub(super) fn is_young(&self) -> bool {
        self.line.frames < Self::PROOF
    }

    /// Whether the gap closes, by the posterior of a filter. `quantile` is half an interval in standard deviations, and
    /// `variance_factor` is that of the innovations' correlation.
    ///
    /// While the line may be level, the gap is stationary, whatever the filter makes of its noise. Once the line is not
    /// level, the filter decides; against the line, which is late, only if it is certain.
    pub(super) fn closes(&self, posterior: &Posterior, quantile: f64, variance_factor: f64) -> bool {
        let line = self.line.posterior(self.line.stamp);
        let spread = self.spread.clamp(1.0, Self::MOST_SPREAD);
        let deviations = line.closing_speed / (line.vv * spread * variance_factor).sqrt();
        // A line through few frames proves less.
        let significant = Self::SIGNIFICANT * (1.0 + 4.0 / (f64::from(self.line.frames) - 2.0));
        let speed = posterior.closing_speed / posterior.vv.sqrt();
        deviations > significant || (deviations < -significant && speed > quantile)
    }
}

#[cfg(test)]
mod tests {
    use super::{InnovationCorrelation, NoiseLevel, student};
    use crate::tracker::Noise;

    #[test]
    fn students_quantile() {
        for (freedom, table) in [(3.0, 2.353), (5.0, 2.015), (10.0, 1.812), (30.0, 1.697), (1e9, 1.645)] {
            assert!((student(freedom) / table - 1.0).abs() < 3e-3, "{freedom}: {}", student(freedom));
        }
    }

    #[test]
    fn noise_is_learnt_and_given_noise_is_not() {
        let mut level = NoiseLevel::new(Noise::Estimated { start: 0.03, frames: 30.0 });
        for _ in 0..2000 {
            level.learn(0.3 / level.variance().sqrt(), level.variance());
        }
        assert!((level.variance().sqrt() / 0.3 - 1.0).abs() < 1e-6);
        let mut given = NoiseLevel::new(Noise::Given(0.02));
        given.learn(3.0, 4e-4);
        assert_eq!(given, NoiseLevel::new(Noise::Given(0.02)));
    }

    #[test]
    fn innovations_that_are_alike_widen() {
        let mut same = InnovationCorrelation::new();
        let mut turning = InnovationCorrelation::new();
        for frame in 0..100 {
            same.learn(1.0);
            turning.learn(if frame % 2 == 0 { 1.0 } else { -1.0 });
        }
        assert!(same.variance_factor() > 15.0);
        assert_eq!(turning.variance_factor(), 1.0);
    }
}
