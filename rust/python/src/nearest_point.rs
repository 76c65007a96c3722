//! What `SweptPath.nearest` gives, for one cloud and for a batch.

use crate::enums;
use crate::nearest::{Counts, CountsBatch, index};
use numpy::PyArray1;
use pyo3::prelude::*;
use ttc_fast_core::path;

/// The point that is hit first, and everything that says why.
///
/// Attributes
/// ----------
/// ttc : float
///     Least time until a point enters the outline, s, in [0, inf].
/// status : Status
///     What it means: NO_DATA without a valid point, NOT_CLOSING where none enters within the horizon, CLOSING, CONTACT.
/// index : int
///     The point that decided: the one of ``ttc``, else the first in contact, else -1.
/// x, y : float
///     Where it is now in the vehicle frame, m. NaN without a point, as all that follows.
/// clearance : float
///     From the outline to the point now, m, in a straight line; negative inside, where it is to the nearest edge.
/// closing_speed : float
///     How fast the clearance shrinks now, m/s.
/// counts : Counts
///     How many points are ``valid``, ``invalid`` and in ``contact``; the rest, which only a scanner tells, is 0.
#[pyclass(frozen, module = "ttc_fast")]
pub struct NearestPoint(pub path::NearestPoint);

#[pymethods]
impl NearestPoint {
    #[getter]
    fn ttc(&self) -> f64 {
        self.0.ttc
    }

    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        enums::status(py, self.0.status)
    }

    #[getter]
    fn index(&self) -> i64 {
        index(self.0.index)
    }

    #[getter]
    fn x(&self) -> f64 {
        self.0.x
    }

    #[getter]
    fn y(&self) -> f64 {
        self.0.y
    }

    #[getter]
    fn clearance(&self) -> f64 {
        self.0.clearance
    }

    #[getter]
    fn closing_speed(&self) -> f64 {
        self.0.closing_speed
    }

    #[getter]
    fn counts(&self) -> Counts {
        Counts(self.0.counts)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let path::NearestPoint { ttc, x, y, clearance, closing_speed, counts, .. } = self.0;
        let (status, index) = (self.status(py)?.getattr("name")?, self.index());
        Ok(format!(
            "NearestPoint(ttc={ttc:.4}, status={status}, index={index}, x={x:.4}, y={y:.4}, clearance={clearance:.4}, \
             closing_speed={closing_speed:.4}, valid={}, invalid={}, contact={})",
            counts.valid, counts.invalid, counts.contact
        ))
    }
}

/// ``NearestPoint`` of a batch: the same names, each an array of shape (B,). ``batch[i]`` is that of one cloud.
#[pyclass(frozen, sequence, module = "ttc_fast")]
pub struct NearestPointBatch(pub Vec<path::NearestPoint>);

impl NearestPointBatch {
    fn array<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        f: impl Fn(&path::NearestPoint) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.0.iter().map(f))
    }
}

#[pymethods]
impl NearestPointBatch {
    /// Least time until a point enters the outline, s.
    #[getter]
    fn ttc<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.ttc)
    }

    /// ``Status`` of each cloud, uint8.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        self.array(py, |nearest| nearest.status as u8)
    }

    /// Deciding point of each cloud, -1 where there is none.
    #[getter]
    fn index<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.array(py, |nearest| index(nearest.index))
    }

    /// Where it is, m.
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.x)
    }

    /// Where it is, m.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.y)
    }

    /// From the outline to it, m.
    #[getter]
    fn clearance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.clearance)
    }

    /// How fast the clearance shrinks, m/s.
    #[getter]
    fn closing_speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.closing_speed)
    }

    /// How many points are valid, invalid and in contact.
    #[getter]
    fn counts(&self) -> CountsBatch {
        CountsBatch(self.0.iter().map(|nearest| nearest.counts).collect())
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __getitem__(&self, index: isize) -> PyResult<NearestPoint> {
        let from_end = if index < 0 { index + self.0.len().cast_signed() } else { index };
        let found = usize::try_from(from_end).ok().and_then(|i| self.0.get(i));
        found.map(|nearest| NearestPoint(*nearest)).ok_or_else(|| {
            pyo3::exceptions::PyIndexError::new_err(format!("cloud {index} of a batch of {}", self.0.len()))
        })
    }

    fn __repr__(&self) -> String {
        format!("NearestPointBatch({} clouds)", self.0.len())
    }
}
