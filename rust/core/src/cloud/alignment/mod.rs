//! How a body moves, from all of its profile.
//!
//! A cell of the profile sees the body at distances `x = h + p(t)`: what the body looks like there, and how it moves,
//! which is the same for all cells. [`profile`] sums up a frame, cell by cell; [`witnesses`] puts the frames of a window
//! side by side; [`weights`] finds which of them to believe, [`scatter`] how far whole frames are off; [`fit`] regresses within
//! cells.

mod fit;
mod lean;
mod profile;
mod scatter;
mod weights;
mod witnesses;

use crate::error::{Error, finite};
use fit::Fit;
pub(super) use profile::FARTHEST;
pub use profile::{Cell, Profile};
use weights::Weighed;
use witnesses::Witnesses;

/// Settings of the alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Width and height of a cell, m.
    pub cell: [f64; 2],
    /// How far behind its nearest point a body counts, m.
    pub depth: f64,
    /// How long frames count, s.
    pub window: f64,
    /// Standard deviation of a range, m.
    pub range_noise: f64,
}

impl Default for Alignment {
    fn default() -> Self {
        Alignment { cell: [0.2, 0.05], depth: 0.8, window: 1.0, range_noise: 0.02 }
    }
}

impl Alignment {
    /// The settings, if they make sense.
    ///
    /// # Errors
    /// When one is not above 0 and finite.
    pub fn checked(self) -> Result<Self, Error> {
        let [width, height] = self.cell;
        let settings = [("cell", width), ("cell", height), ("depth", self.depth), ("window", self.window)];
        for (name, value) in settings.into_iter().chain([("range_noise", self.range_noise)]) {
            if finite(name, value)? <= 0.0 {
                return Err(Error::new(name, format!("must be above 0, got {value:?}")));
            }
        }
        Ok(self)
    }
}

/// A body in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// s
    pub stamp: f64,
    /// The robust nearest distance, m.
    pub edge: f64,
    /// What of it faces the sensor.
    pub profile: Profile,
}

/// How a body moves at the last of its sightings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trend {
    /// Of its edge, m.
    pub distance: f64,
    /// m/s
    pub closing_speed: f64,
    /// Of the closing speed, m^2/s^2.
    pub variance: f64,
}

/// Frames that differ by so many times what they scatter, as a ratio of variances, do not move by one acceleration.
const MISFIT: f64 = 2.0;
/// Frames that a window is not shortened below.
const FEWEST: usize = 3;

/// How the body moves; `None` where nothing tells.
#[must_use]
pub fn trend(sightings: &[Sighting], range_noise: f64) -> Option<Trend> {
    let last = sightings.last()?.stamp;
    let time: Vec<f64> = sightings.iter().map(|sighting| sighting.stamp - last).collect();
    let seen = Witnesses::new(sightings);
    let found = weights::weigh(&seen, range_noise);
    let scatter = scatter::scatter(&seen, &time, &found);
    let Weighed { mut weight, x, noise, .. } = found;
    let mut frames = sightings.len();
    let fit = loop {
        let fit = Fit::new(&seen, &time, &weight, &x, [noise, scatter], frames)?;
        if fit.misfit <= MISFIT * scatter || frames <= FEWEST {
            break fit;
        }
        frames -= 1;
        weight[..seen.starts[sightings.len() - frames]].fill(0.0);
    };
    let mut edges: Vec<f64> =
        sightings.iter().zip(&time).map(|(sighting, t)| sighting.edge - (fit.speed + fit.bend * t) * t).collect();
    Some(Trend { distance: median(&mut edges), closing_speed: -fit.speed, variance: fit.variance })
}

/// The median of some numbers; their order is lost.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    let odd = values.len() % 2 == 1;
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    if odd { upper } else { f64::midpoint(below.iter().copied().fold(f64::NEG_INFINITY, f64::max), upper) }
}

#[cfg(test)]
mod tests {
    use super::{Alignment, Cell, Profile, Sighting, median, trend};

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
    fn medians() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
    }
}
