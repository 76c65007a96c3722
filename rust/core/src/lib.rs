//! Time-to-collision kernels. No Python here: see the `ttc-fast-python` crate for the binding.
//!
//! Data flow one way: memory of the caller → [`column::Column`] → kernel → plain result.

pub mod camera;
pub mod cloud;
pub mod column;
mod error;
pub mod ittc;
pub mod lanes;
pub mod motion;
pub mod path;
pub mod points;
pub mod real;
pub mod scan;
pub mod simd;
mod status;
pub mod threads;
pub mod tracker;

pub use error::Error;
pub use status::Status;
