//! `Road`, and `fit_road`, which finds it.

use crate::errors::value_error;
use crate::gil::release;
use crate::points::{AnyPoints, Cloud};
use crate::{axes, enums};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use ttc_fast_core::cloud::{self, Interval};
use ttc_fast_core::road::{self, RoadSearch};

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
#[pyclass(frozen, eq, module = "ttc_fast")]
#[derive(Clone, Copy, PartialEq)]
pub struct Road(pub cloud::Road);

#[pymethods]
impl Road {
    #[new]
    fn new(slope_x: f64, slope_y: f64, offset: f64) -> PyResult<Self> {
        let road = cloud::Road { slope_x, slope_y, offset };
        road.checked().map(Road).map_err(value_error)
    }

    #[getter]
    fn slope_x(&self) -> f64 {
        self.0.slope_x
    }

    #[getter]
    fn slope_y(&self) -> f64 {
        self.0.slope_y
    }

    #[getter]
    fn offset(&self) -> f64 {
        self.0.offset
    }

    /// Height of a point above the road, m.
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

    fn __getnewargs__(&self) -> (f64, f64, f64) {
        (self.0.slope_x, self.0.slope_y, self.0.offset)
    }

    pub fn __repr__(&self) -> String {
        let cloud::Road { slope_x, slope_y, offset } = self.0;
        format!("Road(slope_x={slope_x:?}, slope_y={slope_y:?}, offset={offset:?})")
    }
}

/// The road of a cloud, or why there is none, and what that rests on.
///
/// The numbers are those of the best plane, also when it was refused: compared with what was asked for they say how far off
/// it was.
///
/// Attributes
/// ----------
/// road : Road or None
///     The road; None unless found. Its numbers are finite.
/// status : RoadStatus
///     FOUND, NOT_FOUND, or NO_DATA when the cloud holds no valid point.
/// reason : str
///     Why there is none; empty when found.
/// inliers : int
///     Points of the road: those near it, in patches that agree.
/// patches : int
///     Square metres of ground that agree with it.
/// share : float
///     How many of all square metres with a point that is, in [0, 1].
/// width : float
///     How wide the road that is seen is in its narrowest direction, m: of an even strip with the same spread.
/// rms : float
///     Root mean square of the heights of patches above it, m: how rough or bent it is. NaN when no plane was fitted.
#[pyclass(frozen, module = "ttc_fast")]
pub struct RoadFit(road::RoadFit);

#[pymethods]
impl RoadFit {
    #[getter]
    fn road(&self) -> Option<Road> {
        self.0.road.ok().map(Road)
    }

    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        enums::road_status(py, self.0.status())
    }

    #[getter]
    fn reason(&self) -> &'static str {
        self.0.road.err().map_or("", road::Refusal::reason)
    }

    #[getter]
    fn inliers(&self) -> usize {
        self.0.inliers
    }

    #[getter]
    fn patches(&self) -> usize {
        self.0.patches
    }

    #[getter]
    fn share(&self) -> f64 {
        self.0.share
    }

    #[getter]
    fn width(&self) -> f64 {
        self.0.width
    }

    #[getter]
    fn rms(&self) -> f64 {
        self.0.rms
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let road::RoadFit { road, inliers, patches, share, width, rms } = self.0;
        let status = self.status(py)?.getattr("name")?;
        let found = match road {
            Ok(cloud::Road { slope_x, slope_y, offset }) => {
                format!("road=Road(slope_x={slope_x:.4}, slope_y={slope_y:.4}, offset={offset:.4})")
            }
            Err(refusal) => format!("reason='{}'", refusal.reason()),
        };
        Ok(format!(
            "RoadFit(status={status}, {found}, inliers={inliers}, patches={patches}, share={share:.2}, \
             width={width:.1}, rms={rms:.4})"
        ))
    }
}

/// Find the road in a cloud, as a plane that a ``Gate`` can stand on.
///
/// The ground is cut into patches of a square metre, so that the road far away counts as much as the thousands of points in
/// front of the bumper. The plane that most patches agree with is fitted to them. Cars, walls and kerbs do not lift it, nor do
/// reflections below it pull it down, as long as it is the largest flat thing that could be the road. Nothing is random: the
/// same cloud gives the same road, whatever its layout.
///
/// Parameters
/// ----------
/// points : ndarray or tuple of ndarray
///     As for ``robust_min_x``. Intensity is not looked at.
/// sensor_height : float
///     Of the sensor, or whatever the origin of the points is, above the road, m.
/// x, y : (float, float)
///     Where to look, forward and left, m.
/// axes : (str, str, str)
///     Which stored coordinate is forward, left and up, as for ``Gate``.
/// height_tolerance : float
///     How wrong ``sensor_height`` may be, m. The smaller the safer: where the road itself is hardly seen, a large flat thing
///     this little above it (the deck of a trailer) is taken for the road, and a gate above that misses it.
/// max_slope : float
///     The steepest road, as rise per metre, forward and to the left each. Pitch and roll of the sensor are part of it.
/// tolerance : float
///     A patch higher above the road than this, m, is no part of it, as a kerb is not; nor is one twice as far below. Nearer
///     ones count the less the farther they are.
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
/// The ground of a patch is the lowest of its voxels, 0.2 m high, but for a tenth of its points. Planes on a grid of slopes
/// and heights are voted on by the patches, each with the part of its points that is near its ground, and the winner is
/// refined by iteratively reweighted least squares with Tukey's biweight [Beaton and Tukey 1974], twice as wide below the
/// plane as above it. Sums are in float64; the reference agrees to 1e-9.
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
    let axes = axes::parse(axes)?;
    let min_patches = usize::try_from(min_patches)
        .map_err(|_| PyValueError::new_err(format!("min_patches must be at least 1, got {min_patches}")))?;
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
    let fit = release(py, 3 * points.len(), || match points {
        AnyPoints::Single(points) => road::fit_road(&points, &search),
        AnyPoints::Double(points) => road::fit_road(&points, &search),
    });
    fit.map(RoadFit).map_err(value_error)
}
