//! Formulae of motion along a line, for numbers and for arrays of them.
//!
//! Each formula is one plain function of `f64`. [`each`] applies it to arrays of either type, element by element: it
//! computes in `f64` and rounds once.

mod constant;
mod each;
mod safety;
mod two_distances;

pub use constant::{status, ttc_constant_acceleration, ttc_constant_velocity};
pub use each::{Operand, each, each_status};
pub use safety::{Rss, deceleration_to_avoid_crash, rss_longitudinal_distance, stopping_distance, time_headway};
pub(crate) use two_distances::checked_dt;
pub use two_distances::ttc_from_distances;
