//! The answers of trackers, and how distances become a closing speed: each way with its own settings.

pub mod cloud;
pub mod distance;
pub mod scale;

use crate::macros::{choices, results, settings_class};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use ttc_fast_core::tracker::{Method, Noise, TrackedTtc};

/// Time-to-collision over several frames, and what it rests on.
///
/// Attributes
/// ----------
/// ttc : float
///     ``distance / closing_speed``, s, in [0, inf]; inf where nothing closes or too little is known.
/// status : Status
///     What ``ttc`` means. ``update`` of each tracker says when it gives which status.
/// distance : float
///     Distance to contact, m. inf when clear, NaN where nothing is known.
/// closing_speed : float
///     m/s, positive when approaching; NaN where it is not known.
/// ttc_interval : tuple of float or None
///     The truth lies in it nine times of ten, s. Its upper end is inf where the gap may not be closing. None while
///     warming up, and where there is no target.
/// closing_speed_interval : tuple of float or None
///     The truth lies in it nine times of ten, m/s. None where ``ttc_interval`` is None, and where a camera alone
///     tells the time and not the speed.
/// age : float
///     The time since the newest measurement that was not the one before handed over again, s; inf before the first.
///     Above 0 the answer is predicted, unless the target stands and is seen without noise.
#[pyclass(frozen, module = "ttc_fast")]
pub struct TrackedTTC(pub TrackedTtc);

results! {
    TrackedTTC: TrackedTtc {
        ttc "s", status "", distance "m", closing_speed "m/s", ttc_interval "s", closing_speed_interval "m/s",
        age "s"
    }
}

settings_class! {
    /// A bank of Kalman filters, from a steady gap to hard braking, averaged by how well each predicts the distances.
    ///
    /// Four models of motion by three sizes of the noise see each distance. The answer is their average, weighed by the
    /// evidence of the newest seconds, and its variance is that of the mixture. So the intervals are narrow while a gap
    /// closes steadily, and wide while it does not.
    ///
    /// Parameters
    /// ----------
    /// memory : float
    ///     Time in which the evidence of a frame falls to 1/e, s, up to 60.
    /// scale : float
    ///     Accelerations and jerks of the models over those of cars on a road.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``memory`` is not above 0 and at most 60 s, or ``scale`` is not above 0 and finite.
    ///
    /// Notes
    /// -----
    /// Dynamic model averaging: A. E. Raftery, M. Karny, P. Ettler, Technometrics 52 (2010). The models are a speed
    /// that drifts by 0.03 m/s within one second, and accelerations that begin with a standard deviation of 0.5, 0.7
    /// and 3 m/s^2 and change with white jerk of 0.3, 3 and 100 m^2/s^5.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.MotionMixture(), noise=0.02)
    /// >>> for frame in range(6):
    /// ...     result = tracker.update(20.0 - 0.5 * frame, 0.1 * frame)
    /// >>> round(result.closing_speed, 6)
    /// 5.0
    MotionMixture(memory: f64 = 2.0, scale: f64 = 1.0), "(memory=2.0, scale=1.0)" =>
        Method: Method::MotionMixture { memory, scale }
}

settings_class! {
    /// The least-squares line through the distances of the newest seconds.
    ///
    /// Smooth, and late: while the closing speed changes it gives the one of half a window ago. The interval allows for
    /// that by ``acceleration``.
    ///
    /// Parameters
    /// ----------
    /// window : float
    ///     How far back it looks, s, up to 60. At least the 3 newest frames count, however old, and at most 512.
    /// acceleration : float
    ///     Standard deviation of the acceleration that a line cannot follow, m/s^2.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``window`` is not above 0 and at most 60 s, or ``acceleration`` is negative or not finite.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.SlidingLine(window=0.4), noise=0.02)
    /// >>> for frame in range(6):
    /// ...     result = tracker.update(20.0 - 0.5 * frame, 0.1 * frame)
    /// >>> round(result.closing_speed, 6), round(result.ttc, 6)
    /// (5.0, 3.5)
    SlidingLine(window: f64 = 0.5, acceleration: f64 = 1.0), "(window=0.5, acceleration=1.0)" =>
        Method: Method::SlidingLine { window, acceleration }
}

settings_class! {
    /// The least-squares parabola through the distances of the newest seconds.
    ///
    /// Follows a constant acceleration without lag, and takes a longer window than a line to be as certain.
    ///
    /// Parameters
    /// ----------
    /// window : float
    ///     How far back it looks, s, up to 60. At least the 4 newest frames count, however old, and at most 512.
    /// jerk : float
    ///     Standard deviation of the jerk that a parabola cannot follow, m/s^3.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``window`` is not above 0 and at most 60 s, or ``jerk`` is negative or not finite.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.SlidingParabola(), noise=0.02)
    /// >>> for frame in range(11):  # braking: 10 m/s less 2 m/s each second
    /// ...     time = 0.1 * frame
    /// ...     result = tracker.update(20.0 - 10.0 * time + time**2, time)
    /// >>> round(result.closing_speed, 6)
    /// 8.0
    SlidingParabola(window: f64 = 1.0, jerk: f64 = 1.0), "(window=1.0, jerk=1.0)" =>
        Method: Method::SlidingParabola { window, jerk }
}

settings_class! {
    /// The median slope of all pairs of distances of the newest seconds.
    ///
    /// A quarter of the frames may be arbitrarily wrong. Time grows with the square of the frames in the window.
    ///
    /// Parameters
    /// ----------
    /// window : float
    ///     How far back it looks, s, up to 60. At least the 3 newest frames count, however old, and at most 64.
    /// acceleration : float
    ///     Standard deviation of the acceleration that a line cannot follow, m/s^2.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``window`` is not above 0 and at most 60 s, or ``acceleration`` is negative or not finite.
    ///
    /// Notes
    /// -----
    /// H. Theil (1950); P. K. Sen, Journal of the American Statistical Association 63 (1968).
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.TheilSen(), noise=0.02)
    /// >>> for frame, distance in enumerate([20.0, 19.5, 19.0, 18.57, 18.0, 17.5]):
    /// ...     result = tracker.update(distance, 0.1 * frame)
    /// >>> round(result.closing_speed, 6)
    /// 5.0
    TheilSen(window: f64 = 0.5, acceleration: f64 = 1.0), "(window=0.5, acceleration=1.0)" =>
        Method: Method::TheilSen { window, acceleration }
}

settings_class! {
    /// A line whose memory fades exponentially, as an alpha-beta filter.
    ///
    /// The gains follow from the memory and the time between frames, theta = exp(-dt / memory): alpha = 1 - theta^2 and
    /// beta = (1 - theta)^2, or those of an ordinary line while fewer frames have been seen than that remembers.
    ///
    /// Parameters
    /// ----------
    /// memory : float
    ///     Time in which the weight of a frame falls to 1/e, s, up to 60.
    /// acceleration : float
    ///     Standard deviation of the acceleration that a line cannot follow, m/s^2.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``memory`` is not above 0 and at most 60 s, or ``acceleration`` is negative or not finite.
    ///
    /// Notes
    /// -----
    /// The critically damped, fading-memory filter of first degree: E. Brookner, Tracking and Kalman Filtering Made
    /// Easy (1998), chapter 1.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.AlphaBeta(), noise=0.02)
    /// >>> for frame in range(6):
    /// ...     result = tracker.update(20.0 - 0.5 * frame, 0.1 * frame)
    /// >>> round(result.closing_speed, 6)
    /// 5.0
    AlphaBeta(memory: f64 = 0.2, acceleration: f64 = 1.0), "(memory=0.2, acceleration=1.0)" =>
        Method: Method::AlphaBeta { memory, acceleration }
}

settings_class! {
    /// A Kalman filter of constant velocity: the closing speed wanders as a random walk.
    ///
    /// Parameters
    /// ----------
    /// acceleration : float
    ///     How far the closing speed wanders within one second, standard deviation, m/s.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``acceleration`` is not above 0 and finite.
    ///
    /// Notes
    /// -----
    /// Continuous white noise acceleration: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to
    /// Tracking and Navigation (2001), section 6.2. It begins with the line through the first two distances, so that no
    /// speed is assumed beforehand.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.KalmanCV(), noise=0.02)
    /// >>> for frame in range(6):
    /// ...     result = tracker.update(20.0 - 0.5 * frame, 0.1 * frame)
    /// >>> round(result.closing_speed, 6)
    /// 5.0
    KalmanCV(acceleration: f64 = 0.7), "(acceleration=0.7)" => Method: Method::KalmanCv { acceleration }
}

settings_class! {
    /// A Kalman filter of constant acceleration: the closing acceleration wanders as a random walk.
    ///
    /// Parameters
    /// ----------
    /// jerk : float
    ///     How far the closing acceleration wanders within one second, standard deviation, m/s^2.
    /// acceleration : float
    ///     Standard deviation of the closing acceleration when a target is first seen, m/s^2.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If one of them is not above 0 and finite.
    ///
    /// Notes
    /// -----
    /// Continuous white noise jerk (Wiener process acceleration): Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation
    /// with Applications to Tracking and Navigation (2001), section 6.2. It begins with the line through the first two
    /// distances, so that no speed is assumed beforehand.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(ttc_fast.KalmanCA(), noise=0.02)
    /// >>> for frame in range(6):
    /// ...     result = tracker.update(20.0 - 0.5 * frame, 0.1 * frame)
    /// >>> round(result.closing_speed, 6)
    /// 5.0
    KalmanCA(jerk: f64 = 1.5, acceleration: f64 = 3.0), "(jerk=1.5, acceleration=3.0)" =>
        Method: Method::KalmanCa { jerk, acceleration }
}

settings_class! {
    /// The noise of distances, learnt from how they differ from what was expected.
    ///
    /// Parameters
    /// ----------
    /// start : float
    ///     Standard deviation of one distance that is assumed at first, m. The estimate never falls below a thirtieth
    ///     of it.
    /// frames : float
    ///     How many frames the estimate remembers, from 5.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``start`` is not above 0, ``frames`` is below 5, or one of them is not finite.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> tracker = ttc_fast.DistanceTracker(noise=ttc_fast.EstimatedNoise(start=0.1))
    /// >>> tracker.update(12.0, 0.0).status.name
    /// 'WARMING_UP'
    EstimatedNoise(start: f64 = 0.03, frames: f64 = 30.0), "(start=0.03, frames=30.0)" =>
        Noise: Noise::Estimated { start, frames }
}

choices! {
    method, method_object: Method, "a method object such as MotionMixture() or KalmanCA()"
    { MotionMixture, KalmanCA, KalmanCV, SlidingLine, SlidingParabola, TheilSen, AlphaBeta }
}

/// The noise of distances, from an object or a number.
pub fn noise(object: &Bound<'_, PyAny>) -> PyResult<Noise> {
    if let Ok(estimated) = object.cast::<EstimatedNoise>() {
        return Ok(estimated.get().core());
    }
    object
        .extract::<f64>()
        .map(Noise::Given)
        .map_err(|_| PyTypeError::new_err(format!("noise must be a number or EstimatedNoise(...), got {object}")))
}

/// The object or number that says the noise of distances.
pub fn noise_object(py: Python<'_>, noise: Noise) -> PyResult<Bound<'_, PyAny>> {
    match noise {
        Noise::Given(noise) => noise.into_bound_py_any(py),
        Noise::Estimated { start, frames } => EstimatedNoise { start, frames }.into_bound_py_any(py),
    }
}
