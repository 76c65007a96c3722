//! `ScanSweptPath`.

use crate::array::type_name;
use crate::beams::Asked;
use crate::ego_motion::MotionArguments;
use crate::errors::value_error;
use crate::scan::ScanTTC;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use ttc_fast_core::scan;

/// Time until what a laser scanner sees enters the vehicle's outline, if it goes on moving as it does.
///
/// ``SweptPath`` over the beams of a ``ScanTTC``. It is asked as that is, and answers in the same terms: only the time is
/// another, that of contact instead of iTTC. Directions, mount, outline, mask, the meaning of readings, ``limits``,
/// ``no_data``, ``minimum`` and ``threads`` are the scanner's; its ``min_closing_speed`` does not matter here.
///
/// Parameters
/// ----------
/// scan : ScanTTC
///     The scanner. It must have an ``outline``, which is what sweeps.
/// horizon : float
///     How far ahead to look, s, at most 1e6. What enters later does not count.
///
/// Raises
/// ------
/// ValueError
///     If the scanner has no outline, or ``horizon`` is no time.
/// TypeError
///     If ``scan`` is no ``ScanTTC``.
///
/// Notes
/// -----
/// The formula, what touching means, and when a point in contact has time 0 are described at ``SweptPath``. A reading is in
/// contact here exactly when it is for the scanner.
///
/// Examples
/// --------
/// A car 0.3 m wide in a corridor 2 m wide, at 5 m/s: iTTC sees the walls come near, but nothing is in the way.
///
/// >>> import numpy as np, ttc_fast
/// >>> scan = ttc_fast.ScanTTC(-1.5, 0.01, 301, mount=(0.3, 0.0, 0.0), outline=(-0.1, 0.4, -0.15, 0.15))
/// >>> ranges = 1.0 / np.maximum(np.abs(np.sin(scan.angles)), 0.05)
/// >>> round(scan.min(ranges, 5.0), 2)
/// 0.36
/// >>> path = ttc_fast.ScanSweptPath(scan, horizon=3.0)
/// >>> path.min(ranges, 5.0)
/// inf
/// >>> ranges[150] = 5.1
/// >>> round(path.min(ranges, 5.0), 3), path.nearest(ranges, 5.0).beam
/// (1.0, 150)
#[pyclass(frozen, module = "ttc_fast")]
pub struct ScanSweptPath {
    scan: Py<ScanTTC>,
    path: scan::ScanSweptPath,
}

#[pymethods]
impl ScanSweptPath {
    #[new]
    #[pyo3(signature = (scan, *, horizon=5.0))]
    fn new(scan: &Bound<'_, PyAny>, horizon: f64) -> PyResult<Self> {
        let scan = scan
            .cast::<ScanTTC>()
            .map_err(|_| PyTypeError::new_err(format!("scan must be a ScanTTC, got {}", type_name(scan))))?;
        let path = scan::ScanSweptPath::new(scan.get().core().clone(), horizon).map_err(value_error)?;
        Ok(ScanSweptPath { scan: scan.clone().unbind(), path })
    }

    /// Least time until the point of a beam enters the outline, s.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     As in ``ScanTTC.min``.
    ///
    /// Returns
    /// -------
    /// float, or float64 ndarray of shape (B,)
    ///     In [0, inf]; infinite when nothing enters within the horizon. With ``minimum=``, what the vote says, or the plain
    ///     least where too few beams are hit for a vote.
    ///
    /// Raises
    /// ------
    /// NoDataError
    ///     If nothing valid was observed in a scan, unless the scanner's ``no_data=`` says what that means.
    /// TypeError, ValueError
    ///     As ``ScanTTC.min``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> ttc_fast.ScanSweptPath(scan).min(np.array([1.0, 2.4, 1.0]), 2.0)
    /// 1.0
    #[pyo3(signature = (ranges, speed, yaw_rate=None, lateral_speed=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0)")]
    fn min<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Option<&Bound<'py, PyAny>>,
        lateral_speed: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.asked().min(py, ranges, MotionArguments { speed, yaw_rate, lateral_speed })
    }

    /// The beam whose point is hit first, and everything that says why.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     As in ``ScanTTC.min``.
    ///
    /// Returns
    /// -------
    /// Nearest, or NearestBatch for a batch
    ///     As of ``ScanTTC.nearest``; ``clearance`` and ``closing_speed`` are those along the beam.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As ``ScanTTC.min``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> ttc_fast.ScanSweptPath(scan).nearest(np.array([1.0, 2.4, 1.0]), 2.0).beam
    /// 1
    #[pyo3(signature = (ranges, speed, yaw_rate=None, lateral_speed=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0)")]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Option<&Bound<'py, PyAny>>,
        lateral_speed: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.asked().nearest(py, ranges, MotionArguments { speed, yaw_rate, lateral_speed })
    }

    /// Time until the point of each beam enters the outline, s.
    ///
    /// Computed in float64 as in ``min``, then rounded to the dtype of ``ranges``.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     As in ``ScanTTC.min``.
    /// out, status_out
    ///     As in ``ScanTTC.per_beam``. CLOSING is a beam whose point enters within the horizon.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     In [0, inf], of the dtype and shape of ``ranges``; ``out`` if given. Infinite where a beam is invalid.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As ``ScanTTC.per_beam``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> ttc_fast.ScanSweptPath(scan).per_beam(np.array([1.0, 2.4, 1.0]), 2.0)
    /// array([inf,  1., inf])
    #[pyo3(signature = (ranges, speed, yaw_rate=None, lateral_speed=None, *, out=None, status_out=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0, *, out=None, status_out=None)")]
    #[allow(clippy::too_many_arguments, reason = "arguments of a Python method")]
    fn per_beam<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Option<&Bound<'py, PyAny>>,
        lateral_speed: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        status_out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.asked().per_beam(py, ranges, MotionArguments { speed, yaw_rate, lateral_speed }, out, status_out)
    }

    /// The scanner it was made of.
    #[getter]
    fn scan(&self, py: Python<'_>) -> Py<ScanTTC> {
        self.scan.clone_ref(py)
    }

    /// How far ahead it looks, s.
    #[getter]
    fn horizon(&self) -> f64 {
        self.path.horizon()
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((Py<ScanTTC>,), Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("horizon", self.horizon())?;
        Ok(((self.scan(py),), keywords))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("ScanSweptPath({}, horizon={:?})", self.scan.bind(py).repr()?, self.horizon()))
    }
}

impl ScanSweptPath {
    fn asked(&self) -> Asked<'_, scan::ScanSweptPath> {
        self.scan.get().asked_about(&self.path)
    }
}
