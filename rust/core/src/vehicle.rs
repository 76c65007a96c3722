//! The vehicle: where its sensor sits, how far it reaches, and how it moves.
//!
//! A beam is measured from the sensor, and a collision happens at the outline: [`Outline::offset`] is what lies between
//! the two along the beam. [`Motion::sensor_velocity`] is how the sensor moves as its vehicle drives and turns.

use crate::error::{Error, finite};

/// No vehicle is faster than light, m/s. This keeps every product far from overflow.
pub(crate) const LIGHT_SPEED: f64 = 299_792_458.0;

/// No plan of a vehicle reaches farther from its origin, m. This keeps every product far from overflow.
pub(crate) const LARGEST: f64 = 1e6;

/// An outline that reaches farther from the vehicle's origin is more likely in millimetres, m.
const LONGEST: f64 = 100.0;

/// Directions this close to the direction of an edge run along it: the cosine of a right angle is not exactly 0.
const PARALLEL: f64 = 1e-12;

/// Where the sensor sits on the vehicle: position (m) and yaw (rad) in the vehicle frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mount {
    /// Forward of the vehicle's origin, m.
    pub x: f64,
    /// Left of the vehicle's origin, m.
    pub y: f64,
    /// Counter-clockwise from the vehicle's x axis, rad.
    pub yaw: f64,
}

/// The vehicle as a rectangle in its own frame, m. Rear and right are usually negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Rear edge.
    pub x_rear: f64,
    /// Front edge.
    pub x_front: f64,
    /// Right edge.
    pub y_right: f64,
    /// Left edge.
    pub y_left: f64,
}

impl Mount {
    pub(crate) fn checked(self) -> Result<Self, Error> {
        finite("mount", self.x)?;
        finite("mount", self.y)?;
        finite("mount", self.yaw)?;
        Ok(self)
    }
}

impl Outline {
    pub(crate) fn checked(self) -> Result<Self, Error> {
        for edge in [self.x_rear, self.x_front, self.y_right, self.y_left] {
            finite("outline", edge)?;
            if edge.abs() > LONGEST {
                let problem = format!("must lie within {LONGEST} m of the vehicle's origin, got an edge at {edge:?} m");
                return Err(Error::new("outline", problem).hint("lengths are in metres, not millimetres"));
            }
        }
        if self.x_rear < self.x_front && self.y_right < self.y_left {
            return Ok(self);
        }
        Err(Error::new(
            "outline",
            format!(
                "must be (x_rear, x_front, y_right, y_left) with x_rear < x_front and y_right < y_left, \
                 got ({:?}, {:?}, {:?}, {:?})",
                self.x_rear, self.x_front, self.y_right, self.y_left
            ),
        ))
    }

    /// How much of a beam's range lies inside the vehicle, for a sensor at (`x`, `y`) and a unit direction.
    ///
    /// A sensor strictly inside: the way to the edge. On the edge or outside: 0 where the ray never enters the
    /// rectangle, NaN where it does, because that beam looks at the vehicle itself.
    pub(crate) fn offset(&self, (x, y): (f64, f64), (dx, dy): (f64, f64)) -> f64 {
        let (enter_x, exit_x) = slab(x, dx, self.x_rear, self.x_front);
        let (enter_y, exit_y) = slab(y, dy, self.y_right, self.y_left);
        let enter = enter_x.max(enter_y);
        let exit = exit_x.min(exit_y);
        if enter < 0.0 && exit > 0.0 {
            exit
        } else if enter < exit && exit > 0.0 {
            f64::NAN
        } else {
            0.0
        }
    }
}

/// When a point moving from `p` at rate `d` is between `low` and `high`; never is (inf, -inf), always (-inf, inf).
fn slab(p: f64, d: f64, low: f64, high: f64) -> (f64, f64) {
    if d.abs() < PARALLEL {
        return if low < p && p < high {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            (f64::INFINITY, f64::NEG_INFINITY)
        };
    }
    let to_low = (low - p) / d;
    let to_high = (high - p) / d;
    if d > 0.0 { (to_low, to_high) } else { (to_high, to_low) }
}

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
    pub(crate) fn sensor_velocity(self, mount: Mount) -> Result<(f64, f64), Error> {
        finite("speed", self.speed)?;
        finite("yaw_rate", self.yaw_rate)?;
        finite("lateral_speed", self.lateral_speed)?;
        let velocity = (self.speed - self.yaw_rate * mount.y, self.lateral_speed + self.yaw_rate * mount.x);
        if velocity.0.abs() < LIGHT_SPEED && velocity.1.abs() < LIGHT_SPEED {
            Ok(velocity)
        } else {
            Err(self.too_fast(velocity))
        }
    }

    #[cold]
    fn too_fast(self, (vx, vy): (f64, f64)) -> Error {
        let argument = if self.speed.abs() >= LIGHT_SPEED {
            "speed"
        } else if self.lateral_speed.abs() >= LIGHT_SPEED {
            "lateral_speed"
        } else {
            "yaw_rate"
        };
        Error::new(argument, format!("moves the sensor faster than light, at ({vx:?}, {vy:?}) m/s"))
    }
}

#[cfg(test)]
mod tests {
    use super::Outline;

    const CAR: Outline = Outline { x_rear: -0.1, x_front: 0.4, y_right: -0.15, y_left: 0.15 };

    #[test]
    fn from_inside_the_way_to_the_edge() {
        assert!((CAR.offset((0.25, 0.0), (1.0, 0.0)) - 0.15).abs() < 1e-12);
        assert!((CAR.offset((0.25, 0.0), (-1.0, 0.0)) - 0.35).abs() < 1e-12);
        assert!((CAR.offset((0.25, 0.0), (0.0, -1.0)) - 0.15).abs() < 1e-12);
    }

    #[test]
    fn from_outside_or_the_edge() {
        assert_eq!(CAR.offset((0.5, 0.0), (1.0, 0.0)), 0.0);
        assert!(CAR.offset((0.5, 0.0), (-1.0, 0.0)).is_nan());
        assert_eq!(CAR.offset((0.4, 0.0), (1.0, 0.0)), 0.0);
        assert!(CAR.offset((0.4, 0.0), (-1.0, 0.0)).is_nan());
        assert_eq!(CAR.offset((0.4, 0.0), (0.0, 1.0)), 0.0, "along the front edge");
        assert_eq!(CAR.offset((0.5, 0.3), (-1.0, 0.0)), 0.0, "past the side");
    }
}
