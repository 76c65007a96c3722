#![doc = include_str!("../README.md")]

pub mod alignment;
pub mod camera;
pub mod cloud;
pub mod column;
mod error;
mod formula;
mod hit;
pub mod interrupt;
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
