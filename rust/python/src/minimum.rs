//! How a speckle is outvoted, as Python objects.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use ttc_fast_core::scan::{Minimum, Neighbours};

/// The ``k``-th smallest value: up to ``k - 1`` outliers cannot decide.
///
/// As ``ScanTTC(minimum=...)``, the ``k``-th smallest time-to-collision of a scan.
///
/// Parameters
/// ----------
/// k : int
///     From 1, which is the plain minimum.
///
/// Raises
/// ------
/// ValueError
///     If ``k`` is below 1.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> ranges = np.array([9.0, 0.5, 8.0, 10.0])          # 0.5 is a speckle
/// >>> scan = ttc_fast.ScanTTC(0.0, 1e-3, 4, minimum=ttc_fast.KthSmallest(2))
/// >>> round(scan.min(ranges, 4.0), 3)
/// 2.0
#[pyclass(frozen, eq, hash, module = "ttc_fast")]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct KthSmallest {
    #[pyo3(get)]
    k: usize,
}

#[pymethods]
#[allow(clippy::trivially_copy_pass_by_ref, reason = "Python hands methods a reference")]
impl KthSmallest {
    #[new]
    fn new(k: i64) -> PyResult<Self> {
        match usize::try_from(k) {
            Ok(k) if k >= 1 => Ok(KthSmallest { k }),
            _ => Err(PyValueError::new_err(format!("k must be at least 1, got {k}"))),
        }
    }

    fn __repr__(&self) -> String {
        format!("KthSmallest(k={})", self.k)
    }

    fn __getnewargs__(&self) -> (usize,) {
        (self.k,)
    }
}

/// The least time-to-collision among beams that their neighbours support.
///
/// A beam is supported when at least ``count`` of the ``window`` beams on each side have a valid reading within
/// ``gap`` metres of its own. A lone speckle, in the open or in front of a wall, has no such neighbours.
///
/// Parameters
/// ----------
/// count : int
///     How many neighbours must agree, from 1.
/// window : int
///     How many beams to look at on each side.
/// gap : float
///     How far their ranges may differ, m.
///
/// Raises
/// ------
/// ValueError
///     If ``count`` is below 1 or above ``2 * window``, or ``gap`` is negative or not finite.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> ranges = np.array([np.inf, 0.5, np.inf, 8.0, 8.1])    # 0.5 is a speckle
/// >>> scan = ttc_fast.ScanTTC(0.0, 1e-3, 5, minimum=ttc_fast.NeighbourSupport())
/// >>> round(scan.min(ranges, 4.0), 3)
/// 2.0
#[pyclass(frozen, eq, module = "ttc_fast")]
#[derive(Clone, Copy, PartialEq)]
pub struct NeighbourSupport {
    #[pyo3(get)]
    count: usize,
    #[pyo3(get)]
    window: usize,
    #[pyo3(get)]
    gap: f64,
}

#[pymethods]
impl NeighbourSupport {
    #[new]
    #[pyo3(signature = (count=1, window=2, gap=0.2))]
    fn new(count: i64, window: i64, gap: f64) -> PyResult<Self> {
        let natural = |argument: &str, value: i64| {
            usize::try_from(value)
                .map_err(|_| PyValueError::new_err(format!("{argument} must not be negative, got {value}")))
        };
        let (count, window) = (natural("count", count)?, natural("window", window)?);
        Neighbours { count, window, gap }.checked().map_err(crate::errors::value_error)?;
        Ok(NeighbourSupport { count, window, gap })
    }

    fn __repr__(&self) -> String {
        format!("NeighbourSupport(count={}, window={}, gap={})", self.count, self.window, self.gap)
    }

    fn __getnewargs__(&self) -> (usize, usize, f64) {
        (self.count, self.window, self.gap)
    }
}

/// `ScanTTC(minimum=...)`.
pub fn minimum(object: &Bound<'_, PyAny>) -> PyResult<Minimum> {
    if let Ok(kth) = object.cast::<KthSmallest>() {
        Ok(Minimum::KthSmallest(kth.get().k))
    } else if let Ok(support) = object.cast::<NeighbourSupport>() {
        let NeighbourSupport { count, window, gap } = *support.get();
        Ok(Minimum::Neighbours(Neighbours { count, window, gap }))
    } else {
        Err(PyTypeError::new_err(format!("minimum must be KthSmallest(k) or NeighbourSupport(...), got {object}")))
    }
}
