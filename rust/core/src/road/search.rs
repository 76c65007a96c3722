//! The settings of the search for a road: the region to look in, and what to accept.

use crate::cloud::{Axis, CheckedGate, Gate, Interval, REP_103};
use crate::error::{Error, at_least_one, finite, positive, share};

/// Voxels are a metre long and wide, and there are this many in a metre of height.
pub(super) const LAYERS_PER_METRE: f64 = 5.0;
/// The most voxels of a region: more take more memory than a road is worth.
const MOST_VOXELS: f64 = (1 << 22) as f64;

/// The least width of a strip that has a plane, m. Points on a narrower one lie on a line.
const LEAST_WIDTH: f64 = 0.01;

/// The steepest road. A steeper plane is none, and takes long to look for.
const STEEPEST: f64 = 1.0;

/// The settings of the search for a road: the region to look in, and what to accept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadSearch {
    /// Height of the sensor above the road, m, as far as it is known.
    pub sensor_height: f64,
    /// Bounds of the region forward, m.
    pub x: Interval,
    /// Bounds of the region to the left, m.
    pub y: Interval,
    /// Where forward, left and up are stored.
    pub axes: [Axis; 3],
    /// The largest error of the height of the sensor, m.
    pub height_tolerance: f64,
    /// The steepest road, as rise per metre forward or left.
    pub max_slope: f64,
    /// Ground higher above the road than this, m, is no part of it. Ground below it may be twice as far.
    pub tolerance: f64,
    /// The square metres of road that must be seen.
    pub min_patches: usize,
    /// The width that must be seen in the narrowest direction, m.
    pub min_width: f64,
    /// The share of all patches that must agree.
    pub min_share: f64,
}

impl Default for RoadSearch {
    fn default() -> Self {
        RoadSearch {
            sensor_height: 1.73,
            x: (0.0, 30.0),
            y: (-6.0, 6.0),
            axes: REP_103,
            height_tolerance: 0.5,
            max_slope: 0.2,
            tolerance: 0.1,
            min_patches: 25,
            min_width: 2.0,
            min_share: 0.25,
        }
    }
}

impl RoadSearch {
    /// Returns the settings if they make sense.
    ///
    /// # Errors
    /// When a number is out of its range, the region is not finite or too large, or two axes use the same column.
    pub fn checked(self) -> Result<Self, Error> {
        finite("sensor_height", self.sensor_height)?;
        positive("height_tolerance", self.height_tolerance)?;
        positive("max_slope", self.max_slope)?;
        if self.max_slope > STEEPEST {
            let problem =
                format!("must be at most {STEEPEST}, got {:?}; it is rise per metre, not degrees", self.max_slope);
            return Err(Error::new("max_slope", problem));
        }
        self.region()?;
        for (argument, (low, high)) in [("x", self.x), ("y", self.y)] {
            finite(argument, low)?;
            finite(argument, high)?;
        }
        positive("tolerance", self.tolerance)?;
        if !(self.min_width >= LEAST_WIDTH && self.min_width.is_finite()) {
            let problem = format!("must be finite and at least {LEAST_WIDTH}, got {:?}", self.min_width);
            return Err(Error::new("min_width", problem));
        }
        at_least_one("min_patches", self.min_patches)?;
        share("min_share", self.min_share)?;
        if self.shape().iter().product::<f64>() > MOST_VOXELS {
            return Err(Error::new("x, y", "span too large a region for max_slope and height_tolerance: narrow one"));
        }
        Ok(self)
    }

    /// The box that the road could be in, if it makes sense.
    pub(super) fn region(&self) -> Result<CheckedGate, Error> {
        let (middle, reach) = (-self.sensor_height, self.reach());
        let z = Some((middle - reach, middle + reach));
        Gate { x: self.x, y: self.y, z, axes: self.axes, ..Gate::default() }.checked()
    }

    /// The number of voxels of the region forward, to the left and up.
    pub(super) fn shape(&self) -> [f64; 3] {
        let [rows, columns] = [self.x, self.y].map(|(low, high)| (high - low).ceil().max(1.0));
        [rows, columns, (2.0 * self.reach() * LAYERS_PER_METRE).ceil()]
    }

    /// The farthest that the road could be from minus the height of the sensor in the whole region, m.
    pub(super) fn reach(&self) -> f64 {
        let [x, y] = [self.x, self.y].map(|(low, high)| low.abs().max(high.abs()));
        self.reach_at(x, y)
    }

    /// The farthest that the road could be from minus the height of the sensor at a place, m.
    #[inline(always)]
    pub(super) fn reach_at(&self, x: f64, y: f64) -> f64 {
        self.height_tolerance + self.max_slope * (x.abs() + y.abs())
    }
}
