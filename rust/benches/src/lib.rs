//! Inputs that several benchmarks and the counted calls use, the same in every run.

#![allow(clippy::missing_panics_doc, clippy::must_use_candidate, reason = "only the benchmarks of this crate use it")]

use std::f64::consts::PI;
use ttc_fast_core::column::{Column, Table};
use ttc_fast_core::points::Points;
use ttc_fast_core::real::Real;
use ttc_fast_core::scan::Settings;
use ttc_fast_core::vehicle::{Motion, Mount, Outline};

/// A small car.
pub const CAR: Outline = Outline { x_rear: -0.1, x_front: 0.45, y_right: -0.15, y_left: 0.15 };
/// Where its scanner sits.
pub const MOUNT: Mount = Mount { x: 0.27, y: 0.0, yaw: 0.0 };
/// It drives straight ahead.
pub const STRAIGHT: Motion = Motion { speed: 5.0, yaw_rate: 0.0, lateral_speed: 0.0 };
/// It drives to the left.
pub const TURNING: Motion = Motion { speed: 5.0, yaw_rate: 0.8, lateral_speed: 0.0 };

/// Pseudo-random numbers in [0, 1).
pub struct Random(pub u64);

impl Random {
    /// Returns the next number.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / f64::from(1_u32 << 24)
    }

    /// Returns the next number, moved into an interval.
    pub fn between(&mut self, low: f64, high: f64) -> f32 {
        f32::from_f64(low + (high - low) * self.uniform())
    }
}

/// Settings of the car's scanner, which looks 240 degrees around.
pub fn scanner(beams: usize) -> Settings {
    Settings {
        range_min: 0.06,
        range_max: 30.0,
        mount: MOUNT,
        outline: Some(CAR),
        ..Settings::new(-2.0 * PI / 3.0, 4.0 * PI / 3.0 / (beams - 1) as f64, beams)
    }
}

/// Returns `N` scans of a room, with noise on its walls, and NaN, +inf and error codes in between.
pub fn rooms<T: Real, const N: usize>(scanner: &Settings) -> [Vec<T>; N] {
    let mut random = Random(2026);
    let mut reading = |angle: f64| {
        let wall = wall(angle) + 0.02 * random.uniform();
        match random.uniform() {
            chance if chance < 0.02 => f64::NAN,
            chance if chance < 0.04 => f64::INFINITY,
            chance if chance < 0.05 => 0.005,
            _ => wall,
        }
    };
    std::array::from_fn(|_| scanner.angles().map(|angle| T::from_f64(reading(angle))).collect())
}

/// How far the walls of the room are in one direction, m.
pub fn wall(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let along = if cos > 0.0 { 9.0 } else { 3.0 } / cos.abs();
    along.min(2.5 / sin.abs())
}

/// Points in a plane, of columns x and y.
pub fn plane([x, y]: &[Vec<f32>; 2]) -> Points<'_, f32> {
    let table = |column| Table::new(Column::new(column));
    Points::batch([table(x), table(y), table(x)]).expect("columns are as long")
}
