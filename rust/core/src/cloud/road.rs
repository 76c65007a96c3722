//! The road as a plane.

use crate::error::{Error, finite};

/// A plane `z = slope_x x + slope_y y + offset` in the vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Road {
    /// Rise per metre forward.
    pub slope_x: f64,
    /// Rise per metre to the left.
    pub slope_y: f64,
    /// Height at the origin, m; about minus the height of the sensor.
    pub offset: f64,
}

impl Road {
    /// The road, if its numbers are finite.
    ///
    /// # Errors
    /// When one is not.
    pub fn checked(self) -> Result<Self, Error> {
        finite("slope_x", self.slope_x)?;
        finite("slope_y", self.slope_y)?;
        finite("offset", self.offset)?;
        Ok(self)
    }

    /// Height of a point above the road, m.
    #[inline(always)]
    #[must_use]
    pub fn height(&self, x: f64, y: f64, z: f64) -> f64 {
        z - (self.slope_x * x + self.slope_y * y + self.offset)
    }
}
