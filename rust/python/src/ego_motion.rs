//! Motions of the own vehicle from Python: numbers for one scan, numbers or one per scan for a batch.

use crate::array::refuse_masked;
use crate::number::{describe, number};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use ttc_fast_core::vehicle::Motion;

/// The three arguments as they came; a missing one is 0.
#[derive(Clone, Copy)]
pub struct MotionArguments<'a, 'py> {
    pub speed: &'a Bound<'py, PyAny>,
    pub yaw_rate: Option<&'a Bound<'py, PyAny>>,
    pub lateral_speed: Option<&'a Bound<'py, PyAny>>,
}

/// One number for all rows, or one each.
enum Quantity {
    Same(f64),
    Each(Vec<f64>),
}

/// A motion for each row of a batch.
pub struct Motions {
    speed: Quantity,
    yaw_rate: Quantity,
    lateral_speed: Quantity,
}

impl MotionArguments<'_, '_> {
    /// The motion of one scan.
    #[inline(always)]
    pub fn one(&self) -> PyResult<Motion> {
        Ok(Motion {
            speed: number("speed", self.speed)?,
            yaw_rate: self.yaw_rate.map_or(Ok(0.0), |value| number("yaw_rate", value))?,
            lateral_speed: self.lateral_speed.map_or(Ok(0.0), |value| number("lateral_speed", value))?,
        })
    }

    /// The motions of `rows` scans.
    pub fn each(&self, rows: usize) -> PyResult<Motions> {
        let optional = |argument, value: Option<&Bound<'_, PyAny>>| {
            value.map_or(Ok(Quantity::Same(0.0)), |value| quantity(argument, value, rows))
        };
        Ok(Motions {
            speed: quantity("speed", self.speed, rows)?,
            yaw_rate: optional("yaw_rate", self.yaw_rate)?,
            lateral_speed: optional("lateral_speed", self.lateral_speed)?,
        })
    }
}

impl Motions {
    /// Whether there is a motion for each of `rows` rows.
    pub fn serve(&self, rows: usize) -> bool {
        [&self.speed, &self.yaw_rate, &self.lateral_speed].into_iter().all(|quantity| match quantity {
            Quantity::Same(_) => true,
            Quantity::Each(values) => values.len() == rows,
        })
    }

    /// The motion of one row.
    pub fn row(&self, row: usize) -> Motion {
        Motion {
            speed: self.speed.row(row),
            yaw_rate: self.yaw_rate.row(row),
            lateral_speed: self.lateral_speed.row(row),
        }
    }
}

impl From<Motion> for Motions {
    fn from(motion: Motion) -> Self {
        Motions {
            speed: Quantity::Same(motion.speed),
            yaw_rate: Quantity::Same(motion.yaw_rate),
            lateral_speed: Quantity::Same(motion.lateral_speed),
        }
    }
}

impl Quantity {
    fn row(&self, row: usize) -> f64 {
        match self {
            Quantity::Same(value) => *value,
            Quantity::Each(values) => values[row],
        }
    }
}

fn quantity(argument: &str, value: &Bound<'_, PyAny>, rows: usize) -> PyResult<Quantity> {
    if let Ok(number) = number(argument, value) {
        return Ok(Quantity::Same(number));
    }
    let py = value.py();
    let wrong = || {
        let got = describe(value);
        PyValueError::new_err(format!(
            "{argument} must be a number or have shape ({rows},), one for each scan, got {got}"
        ))
    };
    refuse_masked(argument, value)?;
    // Motions are few: unlike ranges they may be converted, if they are numbers.
    let numpy = py.import(intern!(py, "numpy"))?;
    let array = numpy.call_method1(intern!(py, "asarray"), (value,)).map_err(|_| wrong())?;
    let kind: char = array.getattr(intern!(py, "dtype"))?.getattr(intern!(py, "kind"))?.extract()?;
    if !matches!(kind, 'f' | 'i' | 'u') {
        return Err(wrong());
    }
    let array = numpy.call_method1(intern!(py, "ascontiguousarray"), (array, intern!(py, "float64")))?;
    let array = array.cast_into::<PyArray1<f64>>().map_err(|_| wrong())?;
    if array.shape() != [rows] {
        return Err(wrong());
    }
    Ok(Quantity::Each(array.to_vec()?))
}
