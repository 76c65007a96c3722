//! Closing speed and time-to-collision from distances over several frames, with their uncertainty.
//!
//! A [`Filter`](filter::Filter) turns distances of one target into a posterior of distance and closing speed, under the
//! motion model of a [`Method`]. A [`Track`](track::Track) adds what the filter cannot know: the noise, when it is not
//! given, and whether the model fits. [`DistanceTracker`] decides which target a distance belongs to, and the
//! [`answer`] says what it means. No clock and no I/O: time is what the stamps say.

mod answer;
mod filter;
mod noise;
mod posterior;
mod recursive;
mod settings;
mod standing;
mod state;
mod targets;
mod theil_sen;
mod track;
mod window;

pub use answer::TrackedTtc;
pub use settings::{Method, Noise, Settings};
pub use targets::{DistanceTracker, Prediction};
