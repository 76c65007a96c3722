//! `ScanSweptPath`.

use crate::macros::settings;
use crate::scan::ScanTTC;
use crate::scan_query::{MotionArguments, Plan, Swept};
use crate::util::{Given, number, type_name, value_error};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use ttc_fast_core::scan;

/// Time until what a laser scanner sees enters the vehicle's outline, if it goes on moving as it does.
///
/// This is ``SweptPath`` for the beams of a ``ScanTTC``. It has the methods and results of ``ScanTTC``, with the time
/// of contact in the place of iTTC. Directions, mount, outline, mask, the meaning of readings, ``limits``, ``no_data``,
/// ``minimum`` and ``threads`` are the scanner's. The scanner's ``min_closing_speed`` does not matter here.
///
/// Parameters
/// ----------
/// scan : ScanTTC
///     The scanner. It must have an ``outline``.
/// horizon : float
///     How far ahead to look, s, at most 1e6. What enters later does not count.
///
/// Raises
/// ------
/// ValueError
///     If the scanner has no outline, or ``horizon`` is not above 0 and at most 1e6.
/// TypeError
///     If ``scan`` is no ``ScanTTC``.
///
/// Notes
/// -----
/// The formula, what touching means, and when a point in contact has time 0 are described at ``SweptPath``. A reading
/// is in contact here exactly when it is for the scanner.
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

    /// Return the least time until the point of a beam enters the outline, s.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     These are as in ``ScanTTC.min``.
    /// path : array_like, shape (N, 2), optional
    ///     The points that the vehicle will follow, m, as in ``SweptPath.min``.
    ///
    /// Returns
    /// -------
    /// float, or float64 ndarray of shape (B,)
    ///     A time in [0, inf]; infinite when nothing enters within the horizon. With ``minimum=``, the result of the
    ///     vote, or the plain least where too few beams are hit for a vote.
    ///
    /// Raises
    /// ------
    /// NoDataError
    ///     If nothing valid was observed in a scan, unless the scanner's ``no_data=`` says what that means.
    /// TypeError, ValueError
    ///     As in ``ScanTTC.min``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> ttc_fast.ScanSweptPath(scan).min(np.array([1.0, 2.4, 1.0]), 2.0)
    /// 1.0
    #[pyo3(signature = (ranges, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, path=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0, *, path=None)")]
    fn min<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        path: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed);
        self.scan.get().query_of(&self.swept(path, &motion)?).min(py, ranges, motion)
    }

    /// Return the beam whose point is hit first, and everything that says why.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     These are as in ``ScanTTC.min``.
    /// path : array_like, shape (N, 2), optional
    ///     The points that the vehicle will follow, m, as in ``SweptPath.min``.
    ///
    /// Returns
    /// -------
    /// Nearest, or NearestBatch for a batch
    ///     The fields are those of ``ScanTTC.nearest``; ``clearance`` and ``closing_speed`` are those along the beam.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``ScanTTC.min``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> ttc_fast.ScanSweptPath(scan).nearest(np.array([1.0, 2.4, 1.0]), 2.0).beam
    /// 1
    #[pyo3(signature = (ranges, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, path=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0, *, path=None)")]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        path: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed);
        self.scan.get().query_of(&self.swept(path, &motion)?).nearest(py, ranges, motion)
    }

    /// Return the time until the point of each beam enters the outline, s.
    ///
    /// Computed in float64 as in ``min``, then rounded to the dtype of ``ranges``.
    ///
    /// Parameters
    /// ----------
    /// ranges, speed, yaw_rate, lateral_speed
    ///     These are as in ``ScanTTC.min``.
    /// path : array_like, shape (N, 2), optional
    ///     The points that the vehicle will follow, m, as in ``SweptPath.min``.
    /// out, status_out
    ///     These are as in ``ScanTTC.per_beam``. A beam is CLOSING if its point enters within the horizon.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Times in [0, inf], of the dtype and shape of ``ranges``; ``out`` if given. Infinite where a beam is invalid.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``ScanTTC.per_beam``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> ttc_fast.ScanSweptPath(scan).per_beam(np.array([1.0, 2.4, 1.0]), 2.0)
    /// array([inf,  1., inf])
    #[pyo3(signature = (ranges, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, path=None, out=None, status_out=None),
           text_signature = "($self, ranges, speed, yaw_rate=0.0, lateral_speed=0.0, *, path=None, out=None, \
                             status_out=None)")]
    #[allow(clippy::too_many_arguments, reason = "arguments of a Python method")]
    fn per_beam<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        path: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        status_out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed);
        self.scan.get().query_of(&self.swept(path, &motion)?).per_beam(py, ranges, motion, out, status_out)
    }

    /// Return how wide the widest part of the path is at which no beam looks, m.
    ///
    /// It follows from mount, outline, angles and mask, and from the motion. The edge of the outline that leads is
    /// divided into 32 strips. A strip is seen if a beam looks at the place on the vehicle's arc where the strip will
    /// be at the time ``ahead``, or one or two lengths of the edge from here if that is farther, but no farther than a
    /// quarter of a turn. A beam looks at its own direction and one increment to either side. Strips that move
    /// backwards are not on the path.
    ///
    /// Parameters
    /// ----------
    /// speed, yaw_rate, lateral_speed : float
    ///     The motion, as in ``ScanTTC.min``. The front leads when driving forward, the rear when reversing, and a side
    ///     when ``lateral_speed`` is larger.
    /// ahead : float
    ///     How long before the vehicle gets there a place has to be seen, s, at least 0.
    /// others : sequence of ScanSweptPath
    ///     Other scanners of the vehicle: what one of them sees is seen.
    ///
    /// Returns
    /// -------
    /// float
    ///     A width from 0 to the length of the edge that leads. It is 0 for a vehicle that stands or turns on the spot.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the motion is not finite or too fast, or ``ahead`` is not finite and at least 0.
    /// TypeError
    ///     If an argument is of the wrong type.
    ///
    /// Examples
    /// --------
    /// A scanner at the front sees nothing of the way back:
    ///
    /// >>> import ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(-2.35, 0.01, 471, mount=(0.25, 0.0, 0.0), outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> path = ttc_fast.ScanSweptPath(scan)
    /// >>> path.unseen(2.0, ahead=0.3), round(path.unseen(-2.0, ahead=0.3), 2)
    /// (0.0, 0.3)
    /// >>> rear = ttc_fast.ScanTTC(-0.5, 0.1, 11, mount=(-0.1, 0.0, 3.14), outline=(-0.1, 0.4, -0.15, 0.15))
    /// >>> path.unseen(-2.0, ahead=0.3, others=[ttc_fast.ScanSweptPath(rear)])
    /// 0.0
    #[pyo3(signature = (speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, ahead, others=vec![]),
           text_signature = "($self, speed, yaw_rate=0.0, lateral_speed=0.0, *, ahead, others=())")]
    #[allow(clippy::needless_pass_by_value, reason = "a list from Python arrives as a value")]
    fn unseen(
        &self,
        speed: &Bound<'_, PyAny>,
        yaw_rate: Given<'_, '_>,
        lateral_speed: Given<'_, '_>,
        ahead: &Bound<'_, PyAny>,
        others: Vec<Bound<'_, ScanSweptPath>>,
    ) -> PyResult<f64> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed).one()?;
        let others = others.iter().map(|other| &other.get().path);
        self.path.unseen(motion, number("ahead", ahead)?, others).map_err(value_error)
    }
}

settings! {
    value ScanSweptPath |it, py| {
        scan: &it.scan,
        horizon: it.path.horizon(),
    }
}

impl ScanSweptPath {
    /// What is asked: the path that was given, if there is one, else the motion.
    fn swept(&self, path: Option<&Bound<'_, PyAny>>, motion: &MotionArguments<'_, '_>) -> PyResult<Swept<'_>> {
        Ok(Swept { path: &self.path, plan: Plan::of(path, motion, |points| self.path.plan(points))? })
    }
}
