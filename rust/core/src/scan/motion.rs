//! The motion of the vehicle, and of the sensor on it.

use super::geometry::Mount;
use crate::error::{Error, finite};

/// No vehicle is faster than light, m/s. Keeps every product far from overflow.
const FASTEST: f64 = 299_792_458.0;

/// Motion of the vehicle's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Forward, m/s; negative when reversing.
    pub speed: f64,
    /// Counter-clockwise, rad/s.
    pub yaw_rate: f64,
    /// To the left, m/s.
    pub lateral_speed: f64,
}

impl Motion {
    /// Velocity of the sensor in the vehicle frame: v + omega x p.
    #[inline(always)]
    pub(crate) fn of_sensor(self, mount: Mount) -> Result<(f64, f64), Error> {
        finite("speed", self.speed)?;
        finite("yaw_rate", self.yaw_rate)?;
        finite("lateral_speed", self.lateral_speed)?;
        let velocity = (self.speed - self.yaw_rate * mount.y, self.lateral_speed + self.yaw_rate * mount.x);
        if velocity.0.abs() < FASTEST && velocity.1.abs() < FASTEST {
            Ok(velocity)
        } else {
            Err(self.too_fast(velocity))
        }
    }

    #[cold]
    fn too_fast(self, (vx, vy): (f64, f64)) -> Error {
        let argument = if self.speed.abs() >= FASTEST {
            "speed"
        } else if self.lateral_speed.abs() >= FASTEST {
            "lateral_speed"
        } else {
            "yaw_rate"
        };
        Error::new(argument, format!("moves the sensor faster than light, at ({vx:?}, {vy:?}) m/s"))
    }
}
