//! Questions about scans, whoever answers them: one scan or a batch, of either type of number.

use crate::array::{Floats, Numbers, as_array, outputs};
use crate::ego_motion::{MotionArguments, Motions};
use crate::errors::{no_data, value_error, value_error_in_row};
use crate::gil::release;
use crate::nearest::{Nearest, NearestBatch};
use numpy::{PyArray1, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use std::sync::Arc;
use ttc_fast_core::Error;
use ttc_fast_core::column::{Column, ColumnMut, Table, TableMut};
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
    /// Least time, s; `None` when nothing valid was observed.
    fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error>;
    /// The beam that decides, and why.
    fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<scan::Nearest, Error>;
    /// Time and status of each beam.
    fn per_beam<'o, T: Range>(
        &self,
        ranges: Column<'_, T>,
        motion: Motion,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) -> Result<(), Error>;
}

macro_rules! criterion {
    ($kind:ident, $scan:expr) => {
        impl Criterion for $kind {
            fn scan(&self) -> &ScanTtc {
                let scan: fn(&$kind) -> &ScanTtc = $scan;
                scan(self)
            }

            fn check_motion(&self, motion: Motion) -> Result<(), Error> {
                $kind::check_motion(self, motion)
            }

            #[inline(always)]
            fn min<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<Option<f64>, Error> {
                $kind::min(self, ranges, motion)
            }

            fn nearest<T: Range>(&self, ranges: Column<'_, T>, motion: Motion) -> Result<scan::Nearest, Error> {
                $kind::nearest(self, ranges, motion)
            }

            fn per_beam<'o, T: Range>(
                &self,
                ranges: Column<'_, T>,
                motion: Motion,
                out: &mut ColumnMut<'o, T>,
                status_out: Option<&mut ColumnMut<'o, u8>>,
            ) -> Result<(), Error> {
                $kind::per_beam(self, ranges, motion, out, status_out)
            }
        }
    };
}

criterion!(ScanTtc, |scan| scan);
criterion!(ScanSweptPath, |path| path.scan());

/// Somebody to ask, and what a blind scan means.
pub struct Asked<'a, C> {
    pub criterion: &'a C,
    pub no_data: Option<f64>,
    pub threads: usize,
}

impl<C: Criterion> Asked<'_, C> {
    /// `.min`
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
            return match ranges.numbers() {
                Numbers::Single(table) => self.min_each(py, &table, &motions),
                Numbers::Double(table) => self.min_each(py, &table, &motions),
            };
        }
        let motion = motion.one()?;
        let ranges = Floats::view("ranges", array)?;
        let ttc = match ranges.numbers() {
            Numbers::Single(table) => self.min_one(py, table.row(0), motion),
            Numbers::Double(table) => self.min_one(py, table.row(0), motion),
        }?;
        Ok(PyFloat::new(py, ttc).into_any())
    }

    /// `.nearest`
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
            let each = match ranges.numbers() {
                Numbers::Single(table) => self.nearest_each(py, &table, &motions)?,
                Numbers::Double(table) => self.nearest_each(py, &table, &motions)?,
            };
            return Ok(Bound::new(py, NearestBatch(each))?.into_any());
        }
        let motion = motion.one()?;
        let ranges = Floats::view("ranges", array)?;
        let nearest = match ranges.numbers() {
            Numbers::Single(table) => self.nearest_one(py, table.row(0), motion),
            Numbers::Double(table) => self.nearest_one(py, table.row(0), motion),
        }?;
        Ok(Bound::new(py, Nearest(nearest))?.into_any())
    }

    /// `.per_beam`
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
        match ranges.numbers() {
            Numbers::Single(table) => self.per_beam_each(py, &table, &motions, ranges.output("out", &out)?, status)?,
            Numbers::Double(table) => self.per_beam_each(py, &table, &motions, ranges.output("out", &out)?, status)?,
        }
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
        let each: Vec<f64> = release(py, ranges.rows() * ranges.columns(), || {
            self.rows(ranges, |row| {
                let least = self.criterion.min(ranges.row(row), motions.row(row)).map_err(value_error_in_row(row))?;
                least.or(self.no_data).ok_or_else(|| no_data("ScanTTC", "scan", Some(row)))
            })
        })?;
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
    ) -> PyResult<Arc<[scan::Nearest]>> {
        let each = release(py, ranges.rows() * ranges.columns(), || {
            self.rows(ranges, |row| {
                self.criterion.nearest(ranges.row(row), motions.row(row)).map_err(value_error_in_row(row))
            })
        })?;
        Ok(each.into())
    }

    fn per_beam_each<T: Range>(
        &self,
        py: Python<'_>,
        ranges: &Table<'_, T>,
        motions: &Motions,
        mut out: TableMut<'_, T>,
        mut status: Option<TableMut<'_, u8>>,
    ) -> PyResult<()> {
        release(py, ranges.rows() * ranges.columns(), || {
            for row in 0..ranges.rows() {
                let mut status = status.as_mut().map(|status| status.row(row));
                self.criterion
                    .per_beam(ranges.row(row), motions.row(row), &mut out.row(row), status.as_mut())
                    .map_err(value_error_in_row(row))?;
            }
            Ok(())
        })
    }

    /// `work` on each row of a batch, by as many threads as were asked for; the first error wins.
    fn rows<T: Range, R: Send>(
        &self,
        ranges: &Table<'_, T>,
        work: impl Fn(usize) -> PyResult<R> + Sync,
    ) -> PyResult<Vec<R>> {
        let least = LEAST_PIECE.div_ceil(ranges.columns().max(1));
        let rows = pieces(self.threads, ranges.rows(), least, |rows| rows.map(&work).collect::<PyResult<Vec<R>>>());
        Ok(rows.into_iter().collect::<PyResult<Vec<_>>>()?.into_iter().flatten().collect())
    }
}
