//! What a filter cannot know by itself: how noisy distances are, and whether its model follows them.

use super::settings::Noise;

/// A surprise as it counts, in standard deviations: an outlier is a sign of noise, but no measure of it.
pub(super) fn clipped(surprise: f64) -> f64 {
    surprise.clamp(-2.5, 2.5)
}

/// What the first estimate weighs, frames.
const PRIOR: f64 = 3.0;
/// An estimate never falls below this part of its start: perfect distances are simulated ones.
const FLOOR: f64 = 1.0 / 30.0;

/// The variance of one distance, given or learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoiseLevel {
    noise: Noise,
    pub(super) sum: f64,
    pub(super) weight: f64,
}

impl NoiseLevel {
    pub(super) fn new(noise: Noise) -> Self {
        match noise {
            Noise::Given(_) => NoiseLevel { noise, sum: 0.0, weight: 0.0 },
            Noise::Estimated { start, .. } => NoiseLevel { noise, sum: PRIOR * start * start, weight: PRIOR },
        }
    }

    pub(super) fn variance(&self) -> f64 {
        match self.noise {
            Noise::Given(noise) => noise * noise,
            Noise::Estimated { start, .. } => (self.sum / self.weight).max((FLOOR * start) * (FLOOR * start)),
        }
    }

    /// Half the width of a 90 % interval, in standard deviations: Student's where the noise is learnt.
    pub(super) fn quantile(&self) -> f64 {
        match self.noise {
            Noise::Given(_) => NORMAL,
            Noise::Estimated { .. } => student(self.weight),
        }
    }

    /// Learn from a distance that surprised by `surprise` standard deviations.
    ///
    /// The square of the surprise times the variance of a distance is, on average, that variance, if the filter is right
    /// about all else.
    pub(super) fn learn(&mut self, surprise: f64) {
        if let Noise::Estimated { frames, .. } = self.noise {
            let kept = 1.0 - 1.0 / frames;
            self.sum = self.sum * kept + clipped(surprise).powi(2) * self.variance();
            self.weight = self.weight * kept + 1.0;
        }
    }
}

/// Whether surprises are alike from frame to frame, as they are when the model lags behind or noise wanders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Whiteness {
    pub(super) last: f64,
    pub(super) products: f64,
    pub(super) squares: f64,
}

impl Whiteness {
    /// Frames that it is remembered for.
    const FRAMES: f64 = 30.0;
    /// What white noise weighs at first, frames.
    const PRIOR: f64 = 10.0;
    /// No surprises are taken to be more alike than this.
    const MOST: f64 = 0.9;

    pub(super) fn new() -> Self {
        Whiteness { last: 0.0, products: 0.0, squares: Self::PRIOR }
    }

    pub(super) fn learn(&mut self, surprise: f64) {
        let kept = 1.0 - 1.0 / Self::FRAMES;
        let clipped = clipped(surprise);
        self.products = self.products * kept + clipped * self.last;
        self.squares = self.squares * kept + clipped * clipped;
        self.last = clipped;
    }

    /// By how much errors that resemble each other with correlation r spoil a mean of many: (1 + r) / (1 - r) as much
    /// variance as independent ones.
    pub(super) fn factor(&self) -> f64 {
        let alike = (self.products / self.squares).clamp(0.0, Self::MOST);
        (1.0 + alike) / (1.0 - alike)
    }
}

/// The 95 % quantile of a normal distribution.
pub(super) const NORMAL: f64 = 1.644_853_626_951_472_2;

/// The 95 % quantile of Student's distribution, from 3 degrees of freedom to within 0.3 % (Abramowitz and Stegun 26.7.5).
fn student(freedom: f64) -> f64 {
    let (z, n) = (NORMAL, freedom);
    let z3 = z * z * z;
    let (z5, z7) = (z3 * z * z, z3 * z3 * z);
    z + (z3 + z) / (4.0 * n)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n)
}

#[cfg(test)]
mod tests {
    use super::{NoiseLevel, Whiteness, student};
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
            level.learn(0.3 / level.variance().sqrt());
        }
        assert!((level.variance().sqrt() / 0.3 - 1.0).abs() < 1e-6);
        let mut given = NoiseLevel::new(Noise::Given(0.02));
        given.learn(3.0);
        assert_eq!(given, NoiseLevel::new(Noise::Given(0.02)));
    }

    #[test]
    fn surprises_that_are_alike_widen() {
        let mut same = Whiteness::new();
        let mut turning = Whiteness::new();
        for frame in 0..100 {
            same.learn(1.0);
            turning.learn(if frame % 2 == 0 { 1.0 } else { -1.0 });
        }
        assert!(same.factor() > 15.0);
        assert_eq!(turning.factor(), 1.0);
    }
}
