//! Closing speed and time-to-collision from distances over several frames, with their uncertainty.
//!
//! [`settings`] says what a user can choose. [`filter`], [`bank`] and [`window`] turn the distances of one
//! target into a posterior of distance and closing speed, under the motion model of a [`Method`]. A [`track`] gates each innovation,
//! and adds what no filter knows: the noise, where it is not given, whether the model fits, and whether the gap is
//! stationary. [`repeats`] tells a new measurement from the last one handed over again. [`association`] decides which
//! target a distance belongs to, and is the [`DistanceTracker`]. [`scale`] is the [`ScaleTracker`] of a camera. [`answer`] makes a time-to-collision of a posterior,
//! and [`state`] writes down and reads what a tracker remembers.
//!
//! There is no clock and no I/O: time is what the stamps say.

mod answer;
mod association;
mod bank;
mod filter;
mod repeats;
mod scale;
mod settings;
mod state;
mod track;
mod window;

pub use answer::TrackedTtc;
pub(crate) use answer::bounded;
pub use association::{DistanceTracker, Prediction};
pub use scale::{Reading, Readings, ScaleSettings, ScaleTracker};
pub use settings::{Method, Noise, Settings};
