//! `Road`, and `fit_road`, which finds it.

use crate::macros::{Value, for_each_type, results, settings};
use crate::points::Cloud;
use crate::util::enums::axes as axes_named;
use crate::util::run::{level, release};
use crate::util::{count, value_error};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::hash::Hash;
use ttc_fast_core::cloud::{self, Interval};
use ttc_fast_core::road::{self, Refusal, RoadSearch, RoadStatus};

/// The road as a plane, ``z = slope_x x + slope_y y + offset``.
///
/// Parameters
/// ----------
/// slope_x : float
///     Rise per metre forward.
/// slope_y : float
///     Rise per metre to the left.
/// offset : float
///     Height at the origin, m: about minus the height of the sensor.
///
/// Raises
/// ------
/// ValueError
///     If a number is not finite.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> road = ttc_fast.Road(0.02, 0.0, -1.73)
/// >>> round(road.height(10.0, 0.0, -1.03), 3)
/// 0.5
#[pyclass(frozen, module = "ttc_fast")]
pub struct Road(pub cloud::Road);

#[pymethods]
impl Road {
    #[new]
    fn new(slope_x: f64, slope_y: f64, offset: f64) -> PyResult<Self> {
        let road = cloud::Road { slope_x, slope_y, offset };
        road.checked().map(Road).map_err(value_error)
    }

    /// Return the height of a point above the road, m.
    ///
    /// Parameters
    /// ----------
    /// x, y, z : float
    ///     Forward, left and up, m.
    ///
    /// Returns
    /// -------
    /// float
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If one is not a number.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> ttc_fast.Road(0.0, 0.0, -1.5).height(10.0, 0.0, -1.0)
    /// 0.5
    fn height(&self, x: f64, y: f64, z: f64) -> f64 {
        self.0.height(x, y, z)
    }
}

settings! {
    value Road |it, py| { slope_x: it.0.slope_x, slope_y: it.0.slope_y, offset: it.0.offset }
}

/// The road of a cloud, or why there is none, and what that rests on.
///
/// The numbers are those of the best plane, also when it was refused: compared with what was asked for they say how far
/// off it was.
///
/// Attributes
/// ----------
/// road : Road or None
///     The road; None unless found. Its numbers are finite.
/// status : RoadStatus
///     FOUND, NOT_FOUND, or NO_DATA when the cloud holds no valid point.
/// reason : str
///     Why there is no road; empty when one was found.
/// inliers : int
///     Points of the road: those near it, in patches that agree.
/// patches : int
///     Square metres of ground that agree with it.
/// share : float
///     The part of all square metres with a point that agrees with it, in [0, 1].
/// width : float
///     Width of the road that is seen in its narrowest direction, m: that of an even strip with this spread.
/// rms : float
///     Root mean square of the heights of patches above it, m: how rough or bent it is. NaN when no plane was fitted.
#[pyclass(frozen, module = "ttc_fast")]
pub struct RoadFit(Fit);

results! {
    RoadFit: Fit { road "", status "", reason "", inliers "", patches "", share "", width "m", rms "m" }
}

/// A fit as Python sees it: the road or why there is none in fields of their own.
#[derive(Clone, Copy)]
struct Fit {
    road: Option<cloud::Road>,
    status: RoadStatus,
    reason: Option<Refusal>,
    inliers: usize,
    patches: usize,
    share: f64,
    width: f64,
    rms: f64,
}

impl From<road::RoadFit> for Fit {
    fn from(fit: road::RoadFit) -> Self {
        let (status, reason) = (fit.status(), fit.road.err());
        let road::RoadFit { road, inliers, patches, share, width, rms } = fit;
        Fit { road: road.ok(), status, reason, inliers, patches, share, width, rms }
    }
}

impl Value for Option<cloud::Road> {
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.map(Road).into_bound_py_any(py)
    }

    fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(object.extract::<Option<PyRef<'_, Road>>>()?.map(|road| road.0))
    }

    fn key(&self) -> impl PartialEq + Hash + use<> {
        self.map(|road| (road.slope_x.key(), road.slope_y.key(), road.offset.key()))
    }
}

/// A reason in words, which are none where there is a road.
impl Value for Option<Refusal> {
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.map_or("", Refusal::reason).into_bound_py_any(py)
    }

    fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let words: String = object.extract()?;
        let found = Refusal::ALL.into_iter().find(|refusal| refusal.reason() == words);
        if found.is_some() || words.is_empty() { Ok(found) } else { Err(PyValueError::new_err("reason is not known")) }
    }

    fn key(&self) -> impl PartialEq + Hash + use<> {
        self.map(Refusal::reason)
    }
}

/// Find the road in a cloud, as a plane that a ``Gate`` can stand on.
///
/// The ground is cut into patches of a square metre, so that the road far away counts as much as the thousands of
/// points in front of the bumper. The plane that most patches agree with is fitted to them. Cars, walls and kerbs do
/// not lift it, nor do reflections below it pull it down, as long as it is the largest flat thing that could be the
/// road. Nothing is random: a cloud gives one road, whatever its layout.
///
/// Parameters
/// ----------
/// points : ndarray or tuple of ndarray
///     Points as for ``robust_min_x``. Their intensity does not matter.
/// sensor_height : float
///     Height of the sensor, or of any other origin of the points, above the road, m.
/// x, y : (float, float)
///     The region to look at, forward and left, m.
/// axes : (str, str, str)
///     Which stored coordinate is forward, left and up, as for ``Gate``.
/// height_tolerance : float
///     How wrong ``sensor_height`` may be, m. The smaller the safer: where the road itself is hardly seen, a large flat
///     thing this little above it (the deck of a trailer) is taken for the road, and a gate above that misses it.
/// max_slope : float
///     The steepest road, as rise per metre, forward and to the left each. Pitch and roll of the sensor are part of it.
/// tolerance : float
///     A patch higher above the road than this, m, is no part of it, as a kerb is not; nor is one twice as far below.
///     Nearer ones count the less the farther they are.
/// min_patches : int
///     How many square metres of road must be seen.
/// min_width : float
///     How wide they must be in their narrowest direction, m, at least 0.01: points on one line have no plane.
/// min_share : float
///     How many of all square metres with a point must agree, in [0, 1].
///
/// Returns
/// -------
/// RoadFit
///     ``road``, ``status``, ``reason``, ``inliers``, ``patches``, ``share``, ``width`` and ``rms``.
///
/// Raises
/// ------
/// TypeError
///     If the points have another dtype.
/// ValueError
///     If the points have another shape, or a setting is out of its range.
///
/// Notes
/// -----
/// The ground of a patch is the lowest of its voxels, 0.2 m high, but for a tenth of its points. Planes on a grid of
/// slopes and heights are voted on by the patches, each with the part of its points that is near its ground, and the
/// winner is refined by iteratively reweighted least squares with Tukey's biweight [Beaton and Tukey 1974], twice as
/// wide below the plane as above it. Sums are in float64; the reference agrees to 1e-9.
///
/// A road that bends upwards or downwards within the region is no plane: narrow ``x`` then, and look at ``rms``.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> x, y = np.meshgrid(np.arange(4.0, 30.0, 0.5), np.arange(-6.0, 6.0, 0.5))
/// >>> road = np.stack([x, y, 0.02 * x - 1.7], axis=-1)           # uphill, 1.7 m below the sensor
/// >>> car = road[(x > 12) & (x < 16) & (abs(y) < 1)] + [0, 0, 0.5]
/// >>> points = np.concatenate([road.reshape(-1, 3), car])
/// >>> fit = ttc_fast.fit_road(points)
/// >>> fit.status.name, round(fit.road.slope_x, 4), round(fit.road.offset, 4)
/// ('FOUND', 0.02, -1.7)
/// >>> gate = ttc_fast.Gate(road=fit.road, height=(0.2, 2.0))
/// >>> ttc_fast.robust_min_x(points, gate=gate).nearest_x
/// 12.5
#[pyfunction]
#[pyo3(
    signature = (points, *, sensor_height=1.73, x=(0.0, 30.0), y=(-6.0, 6.0), axes=None, height_tolerance=0.5,
        max_slope=0.2, tolerance=0.1, min_patches=25, min_width=2.0, min_share=0.25),
    text_signature = "(points, *, sensor_height=1.73, x=(0.0, 30.0), y=(-6.0, 6.0), axes=('x', 'y', 'z'), \
        height_tolerance=0.5, max_slope=0.2, tolerance=0.1, min_patches=25, min_width=2.0, min_share=0.25)"
)]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of a Python function")]
pub fn fit_road(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    sensor_height: f64,
    x: Interval,
    y: Interval,
    axes: Option<[String; 3]>,
    height_tolerance: f64,
    max_slope: f64,
    tolerance: f64,
    min_patches: i64,
    min_width: f64,
    min_share: f64,
) -> PyResult<RoadFit> {
    let (axes, min_patches) = (axes_named(axes)?, count("min_patches", min_patches, 1)?);
    let search = RoadSearch {
        sensor_height,
        x,
        y,
        axes,
        height_tolerance,
        max_slope,
        tolerance,
        min_patches,
        min_width,
        min_share,
    };
    let cloud = Cloud::view("points", points)?;
    let points = cloud.points();
    let fit =
        release(py, 3 * points.len(), || for_each_type!(points, points => road::fit_road(points, &search, level())));
    fit.map(|fit| RoadFit(fit.into())).map_err(value_error)
}
