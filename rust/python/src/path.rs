//! `SweptPath`.

use crate::array::{empty, output_apart, refuse_same_memory};
use crate::macros::{for_each_type, results, settings};
use crate::points::Frames;
use crate::scan_query::{MotionArguments, Motions, Plan};
use crate::util::run::{interruptible, level};
use crate::util::{Given, check_no_data, no_data, value_error, value_error_in_row};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use ttc_fast_core::column::TableMut;
use ttc_fast_core::interrupt::worked;
use ttc_fast_core::path;
use ttc_fast_core::points::Points;
use ttc_fast_core::real::Real;
use ttc_fast_core::vehicle::{Motion, Outline};

/// Time until points enter the vehicle's outline, if it goes on moving as it does.
///
/// Unlike iTTC, which is the time in which a beam would shrink to nothing, this is the time to contact: walls beside
/// the car do not count, and a point off its axis counts when the outline gets there. Made once for a vehicle, then
/// called for every frame. Immutable, and usable from many threads.
///
/// Parameters
/// ----------
/// outline : (float, float, float, float)
///     (x_rear, x_front, y_right, y_left) of the vehicle in its own frame, m; rear and right usually negative. Widen it
///     for a margin.
/// horizon : float
///     How far ahead to look, s, at most 1e6. What enters later does not count.
/// no_data : float, optional
///     The time that ``min`` gives for a cloud without a valid point. Without it, ``min`` raises ``NoDataError``.
///
/// Raises
/// ------
/// ValueError
///     If a setting makes no sense; the message names it and says what would be right.
/// TypeError
///     If a setting is of the wrong type.
///
/// Notes
/// -----
/// With speed and yaw rate constant, rigid-body kinematics say that a static point moves by dp/dt = -(v + omega x p) in
/// the vehicle frame: on a circle about the instantaneous centre of rotation, on a line when driving straight. The line
/// of each edge is crossed at the roots of a quadratic in tan(omega t / 2) / omega, which is exact, takes no time
/// steps, and is smooth as omega goes to 0. A static world is assumed, and that speed and yaw rate stay as they are.
///
/// The edges belong to the outline, and so does what passes them closer than 1e-11 of the way that points may come from
/// (about a nanometre on the road): touching is entering. A point that is inside now is in contact. In its present
/// direction it moves along a chord of the outline. It has time inf if the end that it goes to is nearer than the one
/// that it comes from, which is the way out, or if it stands; else 0, however deep inside it is. Its clearance is that
/// to the nearest edge, negative, and its closing speed says how fast that shrinks; of edges equally near, the one that
/// it gets away from fastest decides.
///
/// Points are what is to be avoided: the road is to be cut from a lidar cloud first. A z is only read to see which
/// points are valid: rows with a non-finite x, y or z never count, nor do rows that are 0 in each of them, which
/// drivers write where nothing came back. Of points with x and y alone that is one at exactly (0, 0), the vehicle's
/// origin, which no sensor measures. Where points are moved into the vehicle frame, such rows have to be left out
/// before: moved, they are returns inside the outline.
///
/// Arrays are read in place. Another thread that writes to one meanwhile may give a mix of two frames, never a read out
/// of bounds.
///
/// Examples
/// --------
/// Walls at 1 m on either side do not matter to a car 0.3 m wide, and a post 5 m in front of its bumper does:
///
/// >>> import numpy as np, ttc_fast
/// >>> path = ttc_fast.SweptPath((-0.1, 0.4, -0.15, 0.15))
/// >>> x = np.arange(0.0, 9.0, 0.1)
/// >>> walls = np.concatenate([np.column_stack([x, np.full_like(x, y)]) for y in (-1.0, 1.0)])
/// >>> path.min(walls, 5.0)
/// inf
/// >>> nearest = path.nearest(np.vstack([walls, [5.4, 0.1]]), 5.0)
/// >>> nearest.ttc, nearest.status.name, nearest.index
/// (1.0, 'CLOSING', 180)
///
/// Turning left, it would hit the wall:
///
/// >>> round(path.min(walls, 5.0, yaw_rate=2.0), 3)
/// 0.368
#[pyclass(frozen, module = "ttc_fast")]
pub struct SweptPath {
    path: path::SweptPath,
    no_data: Option<f64>,
}

#[pymethods]
impl SweptPath {
    #[new]
    #[pyo3(signature = (outline, *, horizon=5.0, no_data=None))]
    fn new(outline: [f64; 4], horizon: f64, no_data: Option<f64>) -> PyResult<Self> {
        check_no_data(no_data)?;
        let [x_rear, x_front, y_right, y_left] = outline;
        let outline = Outline { x_rear, x_front, y_right, y_left };
        let path = path::SweptPath::new(outline, horizon, level()).map_err(value_error)?;
        Ok(SweptPath { path, no_data })
    }

    /// Return the least time until a point enters the outline, s.
    ///
    /// Parameters
    /// ----------
    /// points : ndarray, record array or tuple of arrays, float32 or float64
    ///     Points in the vehicle frame (x forward, y left), m: rows of shape (N, 2) or wider, records with fields x and
    ///     y, or a tuple of columns (x, y) or (x, y, z); read in place, whatever the stride and alignment. One
    ///     dimension more is a batch of B clouds.
    /// speed : float, or (B,) for a batch
    ///     Forward speed of the vehicle's origin, m/s; negative when reversing. Odometry without a sign would take
    ///     reversing for driving forward.
    /// yaw_rate : float, or (B,) for a batch
    ///     Yaw rate, counter-clockwise, rad/s.
    /// lateral_speed : float, or (B,) for a batch
    ///     Speed of the vehicle's origin to the left, m/s.
    /// path : array_like, shape (N, 2), optional
    ///     Points that the vehicle's origin will follow, m, in its present frame, instead of a motion that stays as it
    ///     is; for a batch, one path for all rows. Then only ``speed`` says how the vehicle moves. See the notes.
    ///
    /// Returns
    /// -------
    /// float, or float64 ndarray of shape (B,)
    ///     A time in [0, inf]; infinite when no point enters within the horizon.
    ///
    /// Raises
    /// ------
    /// NoDataError
    ///     If a cloud has no valid point, unless ``no_data=`` says what that means.
    /// TypeError
    ///     If ``points`` has another dtype, or a motion is not a number.
    /// ValueError
    ///     If ``points`` has another shape, or a motion is not finite. If ``path`` is not of shape (N, 2), has fewer than
    ///     two places or one that is not finite, starts farther from the origin than the vehicle is long, turns by 90
    ///     degrees or more at a point, leads forward while ``speed`` is negative or the other way round, or comes with a
    ///     yaw rate or a lateral speed.
    ///
    /// Notes
    /// -----
    /// Along a ``path`` the time is the way along its points over the speed. The vehicle points along the path: from
    /// point to point it moves by a constant twist, as on a circle, so that the outline turns steadily. A path that
    /// leads backwards at first is driven in reverse. What the first point is off the vehicle's origin fades over
    /// two lengths of the vehicle, so that a planner's line may run beside it. On pieces longer than three lengths the
    /// vehicle turns near their ends and is straight between. Beyond its end it goes straight on along its last heading.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> path = ttc_fast.SweptPath((-0.1, 0.4, -0.15, 0.15))
    /// >>> path.min(np.array([[2.4, 0.1], [1.4, 0.2]]), 2.0)
    /// 1.0
    /// >>> path.min(np.array([[2.4, 0.1]]), -2.0)
    /// inf
    /// >>> path.min(np.array([[2.4, 0.1]]), 2.0, path=[[0.0, 0.0], [0.5, 0.1], [1.0, 0.3], [1.5, 0.7]])  # it turns away
    /// inf
    #[pyo3(signature = (points, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, path=None),
           text_signature = "($self, points, speed, yaw_rate=0.0, lateral_speed=0.0, *, path=None)")]
    fn min<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        path: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed);
        let plan = Plan::of(path, &motion, |points| self.path.plan(points))?;
        let (frames, motions) = self.look(points, motion, &plan)?;
        let each =
            for_each_type!(frames.points(), points => self.min_each(py, &points, &motions, &plan, frames.is_batch()))?;
        Ok(if frames.is_batch() {
            PyArray1::from_vec(py, each).into_any()
        } else {
            PyFloat::new(py, each[0]).into_any()
        })
    }

    /// Return the point that is hit first, and everything that says why.
    ///
    /// Parameters
    /// ----------
    /// points, speed, yaw_rate, lateral_speed, path
    ///     These are as in ``min``.
    ///
    /// Returns
    /// -------
    /// NearestPoint, or NearestPointBatch for a batch
    ///     ``ttc``, ``status``, ``index``, ``x``, ``y``, ``clearance``, ``closing_speed`` and ``counts``. A cloud
    ///     without a valid point has status NO_DATA (and ttc inf); nothing is raised for it.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``min``.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> path = ttc_fast.SweptPath((-0.1, 0.4, -0.15, 0.15))
    /// >>> nearest = path.nearest(np.array([[2.4, 0.1], [1.4, 0.2]]), 2.0)
    /// >>> nearest.index, nearest.x, round(nearest.clearance, 3), nearest.closing_speed
    /// (0, 2.4, 2.0, 2.0)
    #[pyo3(signature = (points, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, path=None),
           text_signature = "($self, points, speed, yaw_rate=0.0, lateral_speed=0.0, *, path=None)")]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        path: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed);
        let plan = Plan::of(path, &motion, |points| self.path.plan(points))?;
        let (frames, motions) = self.look(points, motion, &plan)?;
        let each = for_each_type!(frames.points(), points => self.nearest_each(py, &points, &motions, &plan))?;
        Ok(if frames.is_batch() {
            Bound::new(py, NearestPointBatch(each))?.into_any()
        } else {
            Bound::new(py, NearestPoint(each[0]))?.into_any()
        })
    }

    /// Return the time until each point enters the outline, s.
    ///
    /// Computed in float64 as in ``min``, then rounded to the dtype of ``points``.
    ///
    /// Parameters
    /// ----------
    /// points, speed, yaw_rate, lateral_speed, path
    ///     These are as in ``min``.
    /// out : ndarray of the dtype of ``points`` and shape (N,) or (B, N), optional
    ///     Where to write the result.
    /// status_out : uint8 ndarray of that shape, optional
    ///     Where to write the ``Status`` of each point: NOT_CLOSING where it does not enter within the horizon, CLOSING
    ///     where it does, CONTACT inside the outline, INVALID where it is none.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Times in [0, inf], of the dtype of ``points`` and shape (N,) or (B, N); ``out`` if given. Infinite where a
    ///     point is invalid.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As in ``min``; also for an ``out`` or ``status_out`` of another dtype or shape, read-only or overlapping.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> path = ttc_fast.SweptPath((-0.1, 0.4, -0.15, 0.15))
    /// >>> path.per_point(np.array([[2.4, 0.1], [1.4, 0.2], [0.3, 0.0]]), 2.0)
    /// array([ 1., inf,  0.])
    #[pyo3(signature = (points, speed, yaw_rate=Given::NOTHING, lateral_speed=Given::NOTHING, *, path=None, out=None, status_out=None),
           text_signature = "($self, points, speed, yaw_rate=0.0, lateral_speed=0.0, *, path=None, out=None, \
                             status_out=None)")]
    #[allow(clippy::too_many_arguments, reason = "arguments of a Python method")]
    fn per_point<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        speed: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        lateral_speed: Given<'_, 'py>,
        path: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        status_out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let motion = MotionArguments::of(speed, &yaw_rate, &lateral_speed);
        let plan = Plan::of(path, &motion, |points| self.path.plan(points))?;
        let (frames, motions) = self.look(points, motion, &plan)?;
        let (shape, inputs) = (frames.shape(), frames.arrays());
        let status = status_out.map(|array| output_apart::<u8>("status_out", array, shape, inputs)).transpose()?;
        refuse_same_memory(out, status_out)?;
        let made = out.map_or_else(|| empty(py, shape, frames.points().dtype()), |out| Ok(out.clone()))?;
        for_each_type!(frames.points(), points => {
            let out = output_apart("out", &made, shape, inputs)?;
            self.per_point_each(py, &points, &motions, &plan, out, status)?;
        });
        Ok(made)
    }
}

settings! {
    value SweptPath |it, py| {
        outline: {
            let Outline { x_rear, x_front, y_right, y_left } = it.path.outline();
            (x_rear, x_front, y_right, y_left)
        },
        horizon: it.path.horizon(),
        no_data: it.no_data,
    }
}

impl SweptPath {
    /// The points, and a motion for each cloud. All of Python's code runs before the points are looked at.
    fn look<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        motion: MotionArguments<'_, 'py>,
        plan: &Plan,
    ) -> PyResult<(Frames<'py>, Motions)> {
        let rows = Frames::view("points", points)?.batch();
        let motions = rows.map_or_else(|| motion.one().map(Motions::from), |rows| motion.each(rows))?;
        let frames = Frames::view("points", points)?;
        if frames.batch() != rows {
            return Err(PyValueError::new_err("points changed their shape while the motions were read"));
        }
        for row in 0..rows.unwrap_or(1) {
            if row % (1 << 20) == (1 << 20) - 1 {
                points.py().check_signals()?;
            }
            self.path
                .check(plan.course(motions.row(row)))
                .map_err(|error| if rows.is_some() { value_error_in_row(row)(error) } else { value_error(error) })?;
        }
        Ok((frames, motions))
    }

    fn min_each<T: Real>(
        &self,
        py: Python<'_>,
        points: &Points<'_, T>,
        motions: &Motions,
        plan: &Plan,
        is_batch: bool,
    ) -> PyResult<Vec<f64>> {
        each(py, points, motions, |row, motion| {
            let least = self.path.min(points, row, plan.course(motion)).map_err(value_error)?;
            least.or(self.no_data).ok_or_else(|| no_data("SweptPath", "cloud", is_batch.then_some(row)))
        })
    }

    fn nearest_each<T: Real>(
        &self,
        py: Python<'_>,
        points: &Points<'_, T>,
        motions: &Motions,
        plan: &Plan,
    ) -> PyResult<Vec<path::NearestPoint>> {
        each(py, points, motions, |row, motion| {
            self.path.nearest(points, row, plan.course(motion)).map_err(value_error)
        })
    }

    fn per_point_each<T: Real>(
        &self,
        py: Python<'_>,
        points: &Points<'_, T>,
        motions: &Motions,
        plan: &Plan,
        mut out: TableMut<'_, T>,
        mut status: Option<TableMut<'_, u8>>,
    ) -> PyResult<()> {
        let done = each(py, points, motions, |row, motion| {
            let mut status = status.as_mut().map(|status| status.row(row));
            let (out, status) = (&mut out.row(row), status.as_mut());
            self.path.per_point(points, row, plan.course(motion), out, status).map_err(value_error)
        });
        done.map(|_| ())
    }
}

/// `work` on each cloud.
fn each<T: Real, R: Send>(
    py: Python<'_>,
    points: &Points<'_, T>,
    motions: &Motions,
    mut work: impl FnMut(usize, Motion) -> PyResult<R> + Send,
) -> PyResult<Vec<R>> {
    let one = |row| {
        worked((points.len() / points.count()).max(1));
        work(row, motions.row(row))
    };
    interruptible(py, points.len().max(points.count()), || (0..points.count()).map(one).collect())?
}

/// The point that is hit first, and everything that says why.
///
/// Attributes
/// ----------
/// ttc : float
///     The least time until a point enters the outline, s, in [0, inf].
/// status : Status
///     What ``ttc`` means: NO_DATA without a valid point, NOT_CLOSING where none enters within the horizon, CLOSING,
///     CONTACT.
/// index : int
///     The point that decided: the one of ``ttc``, else the first in contact, else -1.
/// x, y : float
///     The place of that point now, in the vehicle frame, m. This and the next two are NaN without a point.
/// clearance : float
///     The distance from the outline to the point now, m, in a straight line. It is negative inside, where it is that
///     to the nearest edge.
/// closing_speed : float
///     How fast the clearance shrinks now, m/s.
/// counts : Counts
///     How many points are ``valid``, ``invalid`` and in ``contact``. The other counts belong to scanners, and are 0.
#[pyclass(frozen, module = "ttc_fast")]
pub struct NearestPoint(pub path::NearestPoint);

/// ``NearestPoint`` of a batch: each field is an array of shape (B,), and ``batch[i]`` is that of one cloud.
#[pyclass(frozen, sequence, module = "ttc_fast")]
pub struct NearestPointBatch(pub Vec<path::NearestPoint>);

results! {
    NearestPoint, NearestPointBatch of "cloud": path::NearestPoint {
        ttc "s", status "", index "", x "m", y "m", clearance "m", closing_speed "m/s", counts ""
    }
}
