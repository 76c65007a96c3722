//! What `ScanTTC.nearest` gives, for one scan and for a batch.

use crate::enums;
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;
use ttc_fast_core::scan;

/// The index of what decided, -1 where nothing did.
pub fn index(decided: Option<usize>) -> i64 {
    decided.map_or(-1, |index| i64::try_from(index).unwrap_or(-1))
}

/// How often each case of a reading occurred in one scan.
///
/// Every beam is counted once in the first seven; ``contact`` is apart.
///
/// Attributes
/// ----------
/// valid : int
///     Valid readings within the user's limits.
/// invalid : int
///     NaN.
/// too_close : int
///     -inf: an object nearer than ``range_min``.
/// no_return : int
///     +inf: observed free space.
/// out_of_range : int
///     Finite and outside the sensor's ``[range_min, range_max]``: discarded.
/// beyond_limits : int
///     Valid readings beyond the user's far limit.
/// masked : int
///     Ignored because of ``mask``, or because the beam looks at the vehicle itself.
/// contact : int
///     Readings inside the outline.
#[pyclass(frozen, module = "ttc_fast")]
pub struct Counts(pub ttc_fast_core::Counts);

/// ``Counts`` of a batch: the same names, each a uint32 array of shape (B,).
#[pyclass(frozen, module = "ttc_fast")]
pub struct CountsBatch(pub Vec<ttc_fast_core::Counts>);

macro_rules! counts {
    ($($name:ident),*) => {
        #[pymethods]
        impl Counts {
            $(#[getter] fn $name(&self) -> u32 { self.0.$name })*

            pub fn __repr__(&self) -> String {
                let fields = [$(format!(concat!(stringify!($name), "={}"), self.0.$name)),*];
                format!("Counts({})", fields.join(", "))
            }
        }

        #[pymethods]
        impl CountsBatch {
            $(#[getter] fn $name<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
                PyArray1::from_iter(py, self.0.iter().map(|counts| counts.$name))
            })*

            fn __len__(&self) -> usize {
                self.0.len()
            }

            fn __repr__(&self) -> String {
                format!("CountsBatch({} scans)", self.0.len())
            }
        }
    };
}

counts!(valid, invalid, too_close, no_return, out_of_range, beyond_limits, masked, contact);

/// The nearest beam in time of one scan, and everything that says why.
///
/// Attributes
/// ----------
/// ttc : float
///     Least time-to-collision, s, in [0, inf].
/// status : Status
///     What it means.
/// beam : int
///     The beam that decided: the one of ``ttc``, else the first in contact, else -1.
/// angle : float
///     Direction of that beam in the sensor frame, rad. NaN without a beam, as all that follows.
/// range : float
///     Its reading, m.
/// clearance : float
///     What is left of it outside the outline, m.
/// closing_speed : float
///     Speed of the sensor along the beam, m/s.
/// counts : Counts
///     How often each case of a reading occurred.
#[pyclass(frozen, module = "ttc_fast")]
pub struct Nearest(pub scan::Nearest);

#[pymethods]
impl Nearest {
    #[getter]
    fn ttc(&self) -> f64 {
        self.0.ttc
    }

    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        enums::status(py, self.0.status)
    }

    #[getter]
    fn beam(&self) -> i64 {
        index(self.0.beam)
    }

    #[getter]
    fn angle(&self) -> f64 {
        self.0.angle
    }

    #[getter]
    fn range(&self) -> f64 {
        self.0.range
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
        let scan::Nearest { ttc, beam, angle, range, clearance, closing_speed, .. } = self.0;
        let status = self.status(py)?.getattr("name")?;
        let beam = index(beam);
        Ok(format!(
            "Nearest(ttc={ttc:.4}, status={status}, beam={beam}, angle={angle:.4}, range={range:.4}, \
             clearance={clearance:.4}, closing_speed={closing_speed:.4}, counts={})",
            self.counts().__repr__()
        ))
    }
}

/// ``Nearest`` of a batch: the same names, each an array of shape (B,). ``batch[i]`` is the ``Nearest`` of one scan.
#[pyclass(frozen, sequence, module = "ttc_fast")]
pub struct NearestBatch(pub Arc<[scan::Nearest]>);

impl NearestBatch {
    fn array<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        f: impl Fn(&scan::Nearest) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.0.iter().map(f))
    }
}

#[pymethods]
impl NearestBatch {
    /// Least time-to-collision of each scan, s.
    #[getter]
    fn ttc<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.ttc)
    }

    /// ``Status`` of each scan, uint8.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        self.array(py, |nearest| nearest.status as u8)
    }

    /// Deciding beam of each scan, -1 where there is none.
    #[getter]
    fn beam<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.array(py, |nearest| index(nearest.beam))
    }

    /// Direction of that beam in the sensor frame, rad.
    #[getter]
    fn angle<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.angle)
    }

    /// Its reading, m.
    #[getter]
    fn range<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.range)
    }

    /// What is left of it outside the outline, m.
    #[getter]
    fn clearance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.clearance)
    }

    /// Speed of the sensor along the beam, m/s.
    #[getter]
    fn closing_speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.array(py, |nearest| nearest.closing_speed)
    }

    /// How often each case of a reading occurred.
    #[getter]
    fn counts(&self) -> CountsBatch {
        CountsBatch(self.0.iter().map(|nearest| nearest.counts).collect())
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __getitem__(&self, index: isize) -> PyResult<Nearest> {
        let from_end = if index < 0 { index + self.0.len().cast_signed() } else { index };
        usize::try_from(from_end).ok().and_then(|i| self.0.get(i)).map(|nearest| Nearest(*nearest)).ok_or_else(|| {
            pyo3::exceptions::PyIndexError::new_err(format!("scan {index} of a batch of {}", self.0.len()))
        })
    }

    fn __repr__(&self) -> String {
        format!("NearestBatch({} scans)", self.0.len())
    }
}
