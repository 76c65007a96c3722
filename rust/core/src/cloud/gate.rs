//! The gate: which points count. It is a corridor ahead, straight or curved, above the road, of points bright enough.
//!
//! Most of a gate is a box in the stored columns, with which the pass compares sixteen points at a time. A curved
//! path and a height above a fitted road are no box: [`NonBoxGate`] checks one point at a time.

use crate::error::{Error, finite, non_negative};
use crate::points::Points;
use crate::real::Real;
use std::ops::Deref;

/// An interval with its bounds included.
pub type Interval = (f64, f64);

/// Where one of the axes forward, left and up is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis {
    /// The stored column: 0, 1 or 2 for x, y or z.
    pub column: usize,
    /// Whether the stored axis points the other way.
    pub flipped: bool,
}

/// Where it is not known where the vehicle ends, a gate above the road begins this many heights of the sensor ahead. A
/// lidar on the roof of a car sees the bonnet no farther: up to 1.47 heights on the car of KITTI, 1.1 on that of
/// nuScenes.
pub const REACH_BY_HEIGHT: f64 = 1.5;

/// The axes of REP 103: forward, left and up are the stored x, y and z.
pub const REP_103: [Axis; 3] =
    [Axis { column: 0, flipped: false }, Axis { column: 1, flipped: false }, Axis { column: 2, flipped: false }];

/// A plane `z = slope_x x + slope_y y + offset` in the vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Road {
    /// Rise per metre forward.
    pub slope_x: f64,
    /// Rise per metre to the left.
    pub slope_y: f64,
    /// Height of the road at the origin, m; about minus the height of the sensor.
    pub offset: f64,
}

impl Road {
    /// Returns the road if its numbers are finite.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn checked(self) -> Result<Self, Error> {
        finite("slope_x", self.slope_x)?;
        finite("slope_y", self.slope_y)?;
        finite("offset", self.offset)?;
        Ok(self)
    }

    /// The height of a point above the road, m.
    #[inline(always)]
    #[must_use]
    pub fn height(&self, x: f64, y: f64, z: f64) -> f64 {
        z - (self.slope_x * x + self.slope_y * y + self.offset)
    }
}

/// A box, or a box bent along a curved path, with its bounds included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Bounds on the distance ahead, m; along the path if that is curved.
    pub x: Interval,
    /// Bounds on the offset to the left, m; from the path if that is curved.
    pub y: Interval,
    /// Bounds on the height, m; open if `None`.
    pub z: Option<Interval>,
    /// Bounds on the intensity in the units stored; open if `None`.
    pub intensity: Option<Interval>,
    /// Where forward, left and up are stored.
    pub axes: [Axis; 3],
    /// Curvature of the path, 1/m; positive bends to the left.
    pub curvature: f64,
    /// Bounds on the height above a fitted road, m; open if `None`.
    pub above: Option<(Road, Interval)>,
}

impl Default for Gate {
    fn default() -> Self {
        Gate {
            x: (0.0, f64::INFINITY),
            y: (-2.0, 2.0),
            z: None,
            intensity: None,
            axes: REP_103,
            curvature: 0.0,
            above: None,
        }
    }
}

impl Gate {
    /// Returns the gate with its box, if it makes sense.
    ///
    /// # Errors
    /// When bounds are swapped or NaN, the curvature is not finite, or two axes use the same column.
    pub fn checked(self) -> Result<CheckedGate, Error> {
        interval("x", self.x)?;
        interval("y", self.y)?;
        self.z.map_or(Ok(()), |z| interval("z", z))?;
        self.intensity.map_or(Ok(()), |intensity| interval("intensity", intensity))?;
        self.above.map_or(Ok(()), |(_, height)| interval("height", height))?;
        finite("curvature", self.curvature)?;
        let mut columns = self.axes.map(|axis| axis.column);
        columns.sort_unstable();
        if columns != [0, 1, 2] {
            return Err(Error::new("axes", "must name each of the stored x, y and z once"));
        }
        let open = (f64::NEG_INFINITY, f64::INFINITY);
        let [x, y] = if self.is_straight() { [self.x, self.y] } else { [open, open] };
        let (mut low, mut high) = ([open.0; 4], [open.1; 4]);
        for (axis, (from, to)) in self.axes.iter().zip([x, y, self.z.unwrap_or(open)]) {
            (low[axis.column], high[axis.column]) = if axis.flipped { (-to, -from) } else { (from, to) };
        }
        (low[3], high[3]) = self.intensity.unwrap_or(open);
        Ok(CheckedGate { gate: self, low, high })
    }

    /// Bounds on z that are heights above a flat road, for a sensor `sensor_height` above it.
    ///
    /// # Errors
    /// When the sensor's height is negative or not finite, or the band is empty.
    pub fn height_band(sensor_height: f64, clearance: f64, headroom: f64) -> Result<Interval, Error> {
        non_negative("sensor_height", sensor_height)?;
        if clearance.is_nan() || clearance == f64::INFINITY {
            return Err(Error::new("clearance", format!("must be a height or -inf, got {clearance:?}")));
        }
        if headroom.is_nan() || headroom < clearance || headroom == f64::NEG_INFINITY {
            return Err(Error::new(
                "headroom",
                format!("must be at least clearance = {clearance:?}, got {headroom:?}"),
            ));
        }
        Ok((clearance - sensor_height, headroom - sensor_height))
    }

    /// The part of the gate beyond the vehicle, whose front is `front` ahead of the sensor; without it, beyond
    /// [`REACH_BY_HEIGHT`] times the sensor's height.
    ///
    /// # Errors
    /// When `front` is negative or not finite, or the gate ends before it.
    pub fn beyond_vehicle(self, front: Option<f64>, sensor_height: f64) -> Result<Self, Error> {
        let front = front.unwrap_or(REACH_BY_HEIGHT * sensor_height);
        non_negative("front", front)?;
        let (from, to) = self.x;
        if front > to {
            return Err(Error::new("front", format!("must be before the end of x = {to:?}, got {front:?}")));
        }
        Ok(Gate { x: (from.max(front), to), ..self })
    }

    /// Whether the path runs straight ahead. A curvature below the normal numbers would lose its digits, so it counts
    /// as 0.
    #[inline(always)]
    fn is_straight(&self) -> bool {
        self.curvature.abs() < f64::MIN_POSITIVE
    }

    /// A stored point as (forward, left, up).
    #[inline(always)]
    pub(super) fn oriented<T: Real>(&self, stored: [T; 3]) -> [T; 3] {
        self.axes.map(|axis| {
            let value = stored[axis.column];
            if axis.flipped { T::ZERO - value } else { value }
        })
    }

    /// The distance ahead of a stored point on a straight path.
    #[inline(always)]
    pub(super) fn ahead<T: Real>(&self, stored: &[T; 3]) -> T {
        let Axis { column, flipped } = self.axes[0];
        if flipped { T::ZERO - stored[column] } else { stored[column] }
    }

    /// The distance of a point along the path, and its offset to the left of the path.
    ///
    /// The path is a circle about (0, 1 / curvature). The formula is smooth as the curvature goes to 0.
    #[inline(always)]
    pub(super) fn along_path(&self, x: f64, y: f64) -> (f64, f64) {
        let k = self.curvature;
        // Behind the circle's centre the sign of a zero decides half a turn, so it is the path's, not the stored
        // number's.
        let forward = if x == 0.0 { 0.0_f64.copysign(k) } else { k * x };
        let across = 1.0 - k * y;
        let along = forward.atan2(across) / k;
        let offset = (2.0 * y - k * (x * x + y * y)) / (1.0 + (forward * forward + across * across).sqrt());
        (along, offset)
    }
}

/// A gate that makes sense, and the part of it that is a box in the stored columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckedGate {
    gate: Gate,
    /// Bounds on the stored x, y and z and on the intensity. A curved path leaves x and y open.
    low: [f64; 4],
    high: [f64; 4],
}

impl Default for CheckedGate {
    fn default() -> Self {
        Gate::default().checked().expect("the defaults make sense")
    }
}

impl Deref for CheckedGate {
    type Target = Gate;

    fn deref(&self) -> &Gate {
        &self.gate
    }
}

impl CheckedGate {
    /// The box in the type of the points, as bounds (low, high) on x, y, z and intensity. Only finite coordinates are
    /// inside, and bounds that round to infinity at the wrong end leave nothing.
    #[inline(always)]
    pub(crate) fn as_box<T: Real>(&self) -> ([T; 4], [T; 4]) {
        let (mut low, mut high) = (self.low.map(T::from_f64), self.high.map(T::from_f64));
        for column in 0..3 {
            let least = T::ZERO - T::MAX;
            low[column] = if low[column] < least { least } else { low[column] };
            high[column] = if high[column] > T::MAX { T::MAX } else { high[column] };
        }
        (low, high)
    }
}

fn interval(argument: &'static str, (low, high): Interval) -> Result<(), Error> {
    if low <= high {
        return Ok(());
    }
    Err(Error::new(argument, format!("must be (low, high) with low <= high, got ({low:?}, {high:?})")))
}

/// The part of a gate that is no box in the stored columns: a curved path, or a height above a road.
#[derive(Clone, Copy)]
pub(super) struct NonBoxGate<'a>(&'a Gate);

impl<'a> NonBoxGate<'a> {
    /// That part of a gate, if the gate has one.
    pub(super) fn new(gate: &'a Gate) -> Option<Self> {
        (!gate.is_straight() || gate.above.is_some()).then_some(NonBoxGate(gate))
    }

    /// The distance ahead of a stored point that is in the box, if it is in the gate.
    #[inline(always)]
    pub(super) fn admit<T: Real>(self, stored: [T; 3]) -> Option<T> {
        let NonBoxGate(gate) = self;
        let [x, y, z] = gate.oriented(stored);
        if let Some((road, height)) = &gate.above
            && !inside(road.height(x.to_f64(), y.to_f64(), z.to_f64()), *height)
        {
            return None;
        }
        if gate.is_straight() {
            return Some(x);
        }
        let (along, offset) = gate.along_path(x.to_f64(), y.to_f64());
        (inside(along, gate.x) && inside(offset, gate.y)).then(|| T::from_f64(along))
    }
}

fn inside(value: f64, (low, high): Interval) -> bool {
    low <= value && value <= high
}

/// Refuses a gate on an intensity that the cloud lacks.
pub(super) fn check_intensity<T: Real>(gate: &Gate, points: &Points<'_, T>) -> Result<(), Error> {
    if gate.intensity.is_some() && !points.has_intensity() {
        return Err(Error::new("gate", "has bounds on intensity, but the points have no intensity"));
    }
    Ok(())
}
