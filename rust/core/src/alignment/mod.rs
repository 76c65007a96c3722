//! The motion of a body, from all of its profile.
//!
//! A cell of the profile sees the body at distances `x = h + p(t)`: the surface of the body there, and the position of
//! the body, which is the same for all cells. [`profile`] sums up a frame cell by cell. [`weights`] puts the frames of
//! a window side by side and finds which cells of which frames to believe. [`fit`] solves for the position of the
//! body in each frame.

mod fit;
mod profile;
mod weights;

pub(crate) use profile::FARTHEST;
pub use {
    fit::{Trend, trend},
    profile::{Alignment, Cell, Profile, Sighting},
};
