//! Time-to-collision kernels. No Python here: see the `ttc-fast-python` crate for the binding.
//!
//! Data flow one way: from memory of the caller through a [`column::Column`] into a kernel, and out as a plain result.

pub mod alignment;
pub mod camera;
pub mod cloud;
pub mod column;
mod error;
mod formula;
mod hit;
pub mod ittc;
pub mod lanes;
pub mod mixture;
pub mod motion;
pub mod path;
pub mod points;
pub mod range_rate;
pub mod real;
pub mod road;
pub mod scan;
pub mod simd;
mod status;
pub mod threads;
pub mod tracker;
pub mod vehicle;

pub use error::Error;
pub use hit::Counts;
pub use status::Status;
