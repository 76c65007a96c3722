//! How a speckle in a scan is outvoted, as Python objects.

use crate::estimator::KthSmallest;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use ttc_fast_core::scan::{BeamVote, Neighbours};

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
///     How many beams to look at on each side, up to 128.
/// gap : float
///     How far their ranges may differ, m.
///
/// Raises
/// ------
/// ValueError
///     If ``count`` is below 1 or above ``2 * window``, ``window`` is above 128, or ``gap`` is negative or not finite.
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

    fn __hash__(&self) -> u64 {
        crate::hash(&self.__repr__())
    }

    fn __getnewargs__(&self) -> (usize, usize, f64) {
        (self.count, self.window, self.gap)
    }
}

/// `ScanTTC(minimum=...)`.
pub fn minimum(object: &Bound<'_, PyAny>) -> PyResult<BeamVote> {
    if let Ok(kth) = object.cast::<KthSmallest>() {
        Ok(BeamVote::KthSmallest(kth.get().k()))
    } else if let Ok(support) = object.cast::<NeighbourSupport>() {
        let NeighbourSupport { count, window, gap } = *support.get();
        Ok(BeamVote::Neighbours(Neighbours { count, window, gap }))
    } else {
        Err(PyTypeError::new_err(format!("minimum must be KthSmallest(k) or NeighbourSupport(...), got {object}")))
    }
}
