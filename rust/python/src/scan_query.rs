//! Scans and motions from Python, for one scan and for a batch: what `ScanTTC` and `ScanSweptPath` do alike, and how
//! the own vehicle's motion is read.

use crate::array::{Floats, as_array, outputs, refuse_masked};
use crate::macros::for_each_type;
use crate::nearest::{Nearest, NearestBatch};
use crate::util::run::{interruptible, release};
use crate::util::{Given, describe, no_data, number, value_error, value_error_in_row};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use ttc_fast_core::Error;
use ttc_fast_core::column::{Column, ColumnMut, Table, TableMut};
use ttc_fast_core::interrupt::worked;
use ttc_fast_core::path::{Course, PlannedPath};
use ttc_fast_core::scan::{self, Range, ScanSweptPath, ScanTtc};
use ttc_fast_core::threads::pieces;
use ttc_fast_core::vehicle::Motion;

/// Fewer beams than this are not worth a thread of their own.
const LEAST_PIECE: usize = 1 << 16;

/// What gives the beams of a scanner a time.
pub trait Criterion: Sync {
    /// The scanner.
    fn scan(&self) -> &ScanTtc;
    /// Whether a motion makes sense.
    fn check_motion(&self, motion: Motion) -> Result<(), Error>;
    /// The least time, s; `None` when nothing valid was observed.
    fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error>;
    /// The beam that decides, and why.
    fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<scan::Nearest, Error>;
    /// The time and status of each beam.
    fn per_beam<'o, T: Range>(
        &self,
        ranges: Column<'_, T>,
        motion: Motion,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error>;
}

impl Criterion for ScanTtc {
    fn scan(&self) -> &ScanTtc {
        self
    }

    fn check_motion(&self, motion: Motion) -> Result<(), Error> {
        self.check_motion(motion)
    }

    #[inline(always)]
    fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error> {
        self.min(ranges, motion)
    }

    fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<scan::Nearest, Error> {
        self.nearest(ranges, motion)
    }

    fn per_beam<'o, T: Range>(
        &self,
        ranges: Column<'_, T>,
        motion: Motion,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error> {
        self.per_beam(ranges, motion, out, status_out)
    }
}

/// The swept path along a plan, if there is one.
pub struct Swept<'a> {
    pub path: &'a ScanSweptPath,
    pub plan: Plan,
}

impl Criterion for Swept<'_> {
    fn scan(&self) -> &ScanTtc {
        self.path.scan()
    }

    fn check_motion(&self, motion: Motion) -> Result<(), Error> {
        self.path.check(self.plan.course(motion))
    }

    fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error> {
        self.path.min(ranges, self.plan.course(motion))
    }

    fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<scan::Nearest, Error> {
        self.path.nearest(ranges, self.plan.course(motion))
    }

    fn per_beam<'o, T: Range>(
        &self,
        ranges: Column<'_, T>,
        motion: Motion,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error> {
        self.path.per_beam(ranges, self.plan.course(motion), out, status_out)
    }
}

/// The argument `path`: what is followed instead of the motion, if it was given.
pub struct Plan(Option<PlannedPath>);

impl Plan {
    /// The path that `plan` makes of the points, if there are any. Of the motion only the speed counts then.
    pub fn of(
        path: Option<&Bound<'_, PyAny>>,
        motion: &MotionArguments<'_, '_>,
        plan: impl FnOnce(&[[f64; 2]]) -> Result<PlannedPath, Error>,
    ) -> PyResult<Self> {
        let Some(path) = path else { return Ok(Plan(None)) };
        motion.only_speed()?;
        plan(&path_points(path)?).map(|plan| Plan(Some(plan))).map_err(value_error)
    }

    /// The course at a motion.
    pub fn course(&self, motion: Motion) -> Course<'_> {
        self.0.as_ref().map_or(motion.into(), |plan| Course::Planned(plan, motion.speed))
    }
}

/// The points of the argument `path`, float64 of shape (N, 2).
fn path_points(path: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 2]>> {
    let py = path.py();
    let wrong = || PyTypeError::new_err(format!("path must be points, of shape (N, 2), got {}", describe(path)));
    let array = match path.cast_exact::<PyArrayDyn<f64>>() {
        Ok(array) if array.is_c_contiguous() => array.clone(),
        _ => {
            refuse_masked("path", path)?;
            let numpy = py.import(intern!(py, "numpy"))?;
            let array = numpy.call_method1(intern!(py, "asarray"), (path,)).map_err(|_| wrong())?;
            let kind: char = array.getattr(intern!(py, "dtype"))?.getattr(intern!(py, "kind"))?.extract()?;
            if !matches!(kind, 'f' | 'i' | 'u') {
                return Err(wrong());
            }
            let array = numpy.call_method1(intern!(py, "ascontiguousarray"), (array, intern!(py, "float64")))?;
            array.cast_into::<PyArrayDyn<f64>>().map_err(|_| wrong())?
        }
    };
    if !matches!(array.shape(), [_, 2]) {
        return Err(PyValueError::new_err(format!("path must have shape (N, 2), got {:?}", array.shape())));
    }
    Ok(array.to_vec()?.chunks_exact(2).map(|point| [point[0], point[1]]).collect())
}

/// A question about the beams of a scan: who answers it, what a blind scan means, and how many threads share a batch.
pub struct BeamQuery<'a, C> {
    pub criterion: &'a C,
    pub no_data: Option<f64>,
    pub threads: usize,
}

impl<C: Criterion> BeamQuery<'_, C> {
    /// The answer of `.min`.
    #[inline(always)]
    pub fn min<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        motion: MotionArguments<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = as_array("ranges", ranges)?;
        if array.ndim() == 2 {
            let motions = motion.each(array.shape()[0])?;
            let ranges = self.batch(array, &motions)?;
            return for_each_type!(ranges.numbers(), table => self.min_each(py, &table, &motions));
        }
        let motion = motion.one()?;
        let ranges = Floats::view("ranges", array)?;
        let ttc = for_each_type!(ranges.numbers(), table => self.min_one(py, table.row(0), motion))?;
        Ok(PyFloat::new(py, ttc).into_any())
    }

    /// The answer of `.nearest`.
    pub fn nearest<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        motion: MotionArguments<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = as_array("ranges", ranges)?;
        if array.ndim() == 2 {
            let motions = motion.each(array.shape()[0])?;
            let ranges = self.batch(array, &motions)?;
            let each = for_each_type!(ranges.numbers(), table => self.nearest_each(py, &table, &motions)?);
            return Ok(Bound::new(py, NearestBatch(each))?.into_any());
        }
        let motion = motion.one()?;
        let ranges = Floats::view("ranges", array)?;
        let nearest = for_each_type!(ranges.numbers(), table => self.nearest_one(py, table.row(0), motion))?;
        Ok(Bound::new(py, Nearest(nearest))?.into_any())
    }

    /// The answer of `.per_beam`.
    pub fn per_beam<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        motion: MotionArguments<'_, 'py>,
        out: Option<&Bound<'py, PyAny>>,
        status_out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = as_array("ranges", ranges)?;
        let motions = if array.ndim() == 2 { motion.each(array.shape()[0])? } else { Motions::from(motion.one()?) };
        let ranges = self.batch(array, &motions)?;
        // All motions are checked before anything is written: `out` may be `ranges` itself.
        for row in 0..ranges.rows() {
            self.criterion.check_motion(motions.row(row)).map_err(value_error_in_row(row))?;
        }
        let (out, status) = outputs(&ranges, out, status_out)?;
        for_each_type!(ranges.numbers(), table => {
            let out = ranges.output("out", &out)?;
            self.per_beam_each(py, &table, &motions, out, status)?;
        });
        Ok(out)
    }

    /// A view of a batch (or of one scan as one row) for which there is a motion for each row.
    fn batch<'py>(&self, array: Bound<'py, PyUntypedArray>, motions: &Motions) -> PyResult<Floats<'py>> {
        let ranges = Floats::view("ranges", array)?;
        self.criterion.scan().check_beams("ranges", ranges.columns()).map_err(value_error)?;
        if motions.serve(ranges.rows()) {
            return Ok(ranges);
        }
        Err(PyValueError::new_err("ranges changed its shape while the motions were read"))
    }

    #[inline(always)]
    fn min_one<T: Range>(&self, py: Python<'_>, ranges: Column<'_, T>, motion: Motion) -> PyResult<f64> {
        let least = release(py, ranges.len(), || self.criterion.min(ranges, motion)).map_err(value_error)?;
        least.or(self.no_data).ok_or_else(|| no_data("ScanTTC", "scan", None))
    }

    fn min_each<'py, T: Range>(
        &self,
        py: Python<'py>,
        ranges: &Table<'_, T>,
        motions: &Motions,
    ) -> PyResult<Bound<'py, PyAny>> {
        let each: Vec<f64> = interruptible(py, ranges.rows() * ranges.columns(), || {
            self.rows(ranges, |row| {
                let least = self.criterion.min(ranges.row(row), motions.row(row)).map_err(value_error_in_row(row))?;
                least.or(self.no_data).ok_or_else(|| no_data("ScanTTC", "scan", Some(row)))
            })
        })??;
        Ok(PyArray1::from_vec(py, each).into_any())
    }

    fn nearest_one<T: Range>(&self, py: Python<'_>, ranges: Column<'_, T>, motion: Motion) -> PyResult<scan::Nearest> {
        release(py, ranges.len(), || self.criterion.nearest(ranges, motion)).map_err(value_error)
    }

    fn nearest_each<T: Range>(
        &self,
        py: Python<'_>,
        ranges: &Table<'_, T>,
        motions: &Motions,
    ) -> PyResult<Vec<scan::Nearest>> {
        interruptible(py, ranges.rows() * ranges.columns(), || {
            self.rows(ranges, |row| {
                self.criterion.nearest(ranges.row(row), motions.row(row)).map_err(value_error_in_row(row))
            })
        })?
    }

    fn per_beam_each<T: Range>(
        &self,
        py: Python<'_>,
        ranges: &Table<'_, T>,
        motions: &Motions,
        mut out: TableMut<'_, T>,
        mut status: Option<TableMut<'_, u8>>,
    ) -> PyResult<()> {
        interruptible(py, ranges.rows() * ranges.columns(), || {
            for row in 0..ranges.rows() {
                worked(ranges.columns().max(1));
                let mut status = status.as_mut().map(|status| status.row(row));
                self.criterion
                    .per_beam(ranges.row(row), motions.row(row), &mut out.row(row), status.as_mut())
                    .map_err(value_error_in_row(row))?;
            }
            Ok(())
        })?
    }

    /// Do `work` on each row of a batch, by at most `self.threads` threads. The first error wins.
    fn rows<T: Range, R: Send>(
        &self,
        ranges: &Table<'_, T>,
        work: impl Fn(usize) -> PyResult<R> + Sync,
    ) -> PyResult<Vec<R>> {
        let least = LEAST_PIECE.div_ceil(ranges.columns().max(1));
        let work = |row| {
            worked(ranges.columns().max(1));
            work(row)
        };
        let rows = pieces(self.threads, ranges.rows(), least, |rows| rows.map(work).collect::<PyResult<Vec<R>>>());
        Ok(rows.into_iter().collect::<PyResult<Vec<_>>>()?.into_iter().flatten().collect())
    }
}

/// The three arguments of a motion as Python gave them. A missing one is 0.
#[derive(Clone, Copy)]
pub struct MotionArguments<'a, 'py> {
    pub speed: &'a Bound<'py, PyAny>,
    pub yaw_rate: Option<&'a Bound<'py, PyAny>>,
    pub lateral_speed: Option<&'a Bound<'py, PyAny>>,
}

impl<'a, 'py> MotionArguments<'a, 'py> {
    /// The arguments of a call, in which a number may have been left out.
    #[inline(always)]
    pub fn of(speed: &'a Bound<'py, PyAny>, yaw_rate: &'a Given<'_, 'py>, lateral_speed: &'a Given<'_, 'py>) -> Self {
        MotionArguments { speed, yaw_rate: yaw_rate.given(), lateral_speed: lateral_speed.given() }
    }
}

/// One number for all rows, or one for each.
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

    /// Refuse what a path says already.
    pub fn only_speed(&self) -> PyResult<()> {
        let is_zero =
            |value: Option<&Bound<'_, PyAny>>| value.is_none_or(|value| number("", value).is_ok_and(|n| n == 0.0));
        if is_zero(self.yaw_rate) && is_zero(self.lateral_speed) {
            return Ok(());
        }
        Err(PyValueError::new_err("path says where the vehicle goes: leave yaw_rate and lateral_speed out with it"))
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
