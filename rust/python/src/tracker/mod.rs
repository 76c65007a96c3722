//! Trackers of distances, their methods and their results, as Python objects.

mod distance;
mod method;

pub use distance::DistanceTracker;
pub use method::{AlphaBeta, EstimatedNoise, KalmanCA, KalmanCV, SlidingLine, SlidingParabola, TheilSen};
