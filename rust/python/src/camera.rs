//! The camera functions, their estimators and their result.

use crate::macros::{choices, results, settings_class};
use crate::points::{AnyPixels, Pixels};
use crate::util::run::{interruptible, level};
use crate::util::{number, value_error};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use ttc_fast_core::camera::{self, Estimator, Keypoints};

settings_class! {
    /// The median of all pairs' ratios of distances, exactly.
    ///
    /// This is the plain published method. It survives mismatches in up to a quarter or so of the matches, as each
    /// spoils all pairs that it is in. Positions that are rounded to pixels (ORB, FAST, BRISK) pull it towards 1: of a
    /// thing that moved by less than a pixel, most points did not move at all.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> corners = np.array([[500.0, 150.0], [700.0, 150.0], [700.0, 300.0], [500.0, 300.0]])
    /// >>> round(ttc_fast.ttc_from_keypoints(corners, 1.05 * corners, 0.1, estimator=ttc_fast.MedianRatio()).scale, 6)
    /// 1.05
    MedianRatio(), "()" => Estimator: Estimator::MedianRatio
}

settings_class! {
    /// The mean of all pairs' ratios of distances, without the lowest and the highest share.
    ///
    /// A share of 0 is the plain mean, and one near 0.5 is nearly the median. Of more than 129 matches, an even sample of
    /// the pairs takes the place of all: 64 for each match.
    ///
    /// Parameters
    /// ----------
    /// share : float
    ///     Share that is left out at each end, in [0, 0.5).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``share`` is out of its range or NaN.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> corners = np.array([[500.0, 150.0], [700.0, 150.0], [700.0, 300.0], [500.0, 300.0]])
    /// >>> trimmed = ttc_fast.TrimmedMeanRatio(0.25)
    /// >>> round(ttc_fast.ttc_from_keypoints(corners, 1.05 * corners, 0.1, estimator=trimmed).scale, 6)
    /// 1.05
    TrimmedMeanRatio(share: f64 = 0.25), "(share=0.25)" => Estimator: Estimator::TrimmedMeanRatio(share)
}

settings_class! {
    /// The scale of the similarity (scale, turn and shift) that fits all matches best by least squares.
    ///
    /// It takes time linear in the number of matches and survives no outlier: use it for matches that are known to be
    /// clean. It looks at positions, not at pairs: ``min_distance`` does not matter to it.
    ///
    /// Notes
    /// -----
    /// The absolute value of sum((now - mean) conj(before - mean)) / sum(abs(before - mean)^2), positions being complex
    /// [Umeyama 1991].
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> corners = np.array([[500.0, 150.0], [700.0, 150.0], [700.0, 300.0], [500.0, 300.0]])
    /// >>> round(ttc_fast.ttc_from_keypoints(corners, 1.05 * corners, 0.1, estimator=ttc_fast.LeastSquares()).scale, 6)
    /// 1.05
    LeastSquares(), "()" => Estimator: Estimator::LeastSquares
}

settings_class! {
    /// The least-squares scale of the matches that move as one body. The default.
    ///
    /// Background and mismatches do not move with the body ahead. The similarity (scale, turn and shift) that most
    /// matches agree with is looked for by two matches at a time, and refined by least squares until its matches are
    /// those that agree with it. What is left has no outliers.
    ///
    /// Parameters
    /// ----------
    /// tolerance : float
    ///     A match farther than this from where it should be, px, never belongs to the body. The default is what
    ///     rounding to pixels can do at the coarsest of eight pyramid levels 1.2 apart, as ORB has them: 1.2^7 px in x
    ///     and in y, 5.1 px.
    /// trials : int
    ///     How many pairs of matches are tried, at most 1,000,000. 200 find a body that has 3 of 10 matches in all but
    ///     one of 10^8 cases.
    /// seed : int
    ///     Seed of the choice of those pairs, at least 0: one seed gives one answer for the same matches.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a setting is out of its range.
    ///
    /// Notes
    /// -----
    /// Agreement is first within ``tolerance``, then within the circle that 95 % of normal errors of the matches so far
    /// are in (2.45 standard deviations of a coordinate; at least 0.1 px), and no match belongs for being one of two.
    /// Where more than a tenth of all coordinates do not change at all, positions are rounded to pixels. Errors are
    /// then as large as the step between two pixels, so the tolerance stays what it is, and the scale takes in all that
    /// stayed and all that jumped: only together they say how far the body moved.
    ///
    /// The scale is that of least squares over the matches that belong, with stretch and shear fitted beside it as far as
    /// independent errors do not explain them. So the matches far out along one axis do not outweigh the others.
    /// ``min_distance`` does not change it: it only asks that some pair of the body is as far apart.
    ///
    /// Pairs are drawn by the generator SplitMix64 [Steele, Lea and Flood 2014]. Random sample consensus is of
    /// [Fischler and Bolles 1981].
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> before = np.random.default_rng(0).uniform(500.0, 700.0, (60, 2))
    /// >>> now = 1.05 * before
    /// >>> now[:20] += 40.0                                   # a third belongs to something else
    /// >>> seen = ttc_fast.ttc_from_keypoints(before, now, 0.1, estimator=ttc_fast.Consensus())
    /// >>> round(seen.ttc, 6), seen.matches, seen.support
    /// (2.0, 60, 40)
    Consensus(tolerance: f64 = 5.0, trials: usize = 200, seed: u64 = 0), "(tolerance=5.0, trials=200, seed=0)" =>
        Estimator: Estimator::Consensus { tolerance, trials, seed }
}

/// Time-to-collision from matched keypoints, and what it rests on.
///
/// Attributes
/// ----------
/// ttc : float
///     Time-to-collision, s, in [0, inf]; inf where nothing closes or too little is known.
/// status : Status
///     CLOSING: the scale is above 1. NOT_CLOSING: it is not. TOO_FEW: there are matches, and too few of them, or no
///     pair of them that counts, for a scale. NO_DATA: there is no match that counts.
/// scale : float
///     Size of the thing now over its size before: distance before over distance now. NaN with TOO_FEW and NO_DATA.
/// spread : float
///     Standard error of the scale. It starts from that of a least-squares fit, the root mean square distance of a match
///     in support from where the scale puts it, per coordinate, over the root of the sum of squared distances from their
///     centre. It is larger where the matches show stretch and shear, because then their errors are not independent.
///     Mismatches count in full, unless the estimator leaves them out. NaN with fewer than three matches in support.
/// ttc_interval : tuple of float or None
///     Lower and upper end of the 90 % interval of ``ttc``, s, in [0, inf]: the times of scales ``1.645 spread`` above
///     and below. The upper end is inf where the thing may not grow. None where ``spread`` is NaN.
/// pairs : int
///     Pairs of matches in support that count, or those of the sample that are left with ``TrimmedMeanRatio``; 0 for
///     ``LeastSquares``, which asks for none.
/// matches : int
///     Matches that count.
/// support : int
///     Matches that the scale rests on; all, unless the estimator leaves some out.
#[pyclass(frozen, module = "ttc_fast")]
pub struct KeypointTTC(camera::KeypointTtc);

results! {
    KeypointTTC: camera::KeypointTtc {
        ttc "s", status "", scale "", spread "", ttc_interval "s", pairs "", matches "", support ""
    }
}

/// Time-to-collision by how many times as large a thing looks as ``dt`` seconds before.
///
/// Parameters
/// ----------
/// scale : float
///     Size now over size before, of anything that keeps its size and is seen from the same side: above 1 when it comes
///     closer.
/// dt : float
///     Time between the two, s, from their stamps.
///
/// Returns
/// -------
/// float
///     ``dt / (scale - 1)``, s, from the later one on; inf when it does not grow.
///
/// Raises
/// ------
/// ValueError
///     If ``scale`` is not above 0 and finite, or ``dt`` is not above 0 and finite.
///
/// Notes
/// -----
/// Sizes in a picture go with 1 / distance, so that the scale is d0 / d1, and the speed stays what it was:
/// TTC = d1 dt / (d0 - d1) = dt / (scale - 1).
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> round(ttc_fast.ttc_from_scale(1.05, 0.1), 6)
/// 2.0
#[pyfunction]
pub fn ttc_from_scale(scale: &Bound<'_, PyAny>, dt: &Bound<'_, PyAny>) -> PyResult<f64> {
    camera::ttc_from_scale(number("scale", scale)?, number("dt", dt)?).map_err(value_error)
}

/// Time-to-collision by two heights of one thing in the picture, ``dt`` seconds apart.
///
/// Parameters
/// ----------
/// previous, current : float
///     Height of a box around the thing, px, or any one size of it that is measured in one way in both pictures.
/// dt : float
///     Time between the two, s, from their stamps.
///
/// Returns
/// -------
/// float
///     ``previous dt / (current - previous)``, s, from the later picture on; inf when it does not grow.
///
/// Raises
/// ------
/// ValueError
///     If a height is not above 0 and finite, or ``dt`` is not above 0 and finite.
///
/// Notes
/// -----
/// This is ``ttc_from_scale`` with scale = current / previous. A detector's box is off by pixels, and at 0.1 s a pixel
/// is about what a car grows by: heights want frames farther apart.
///
/// Examples
/// --------
/// >>> import ttc_fast
/// >>> round(ttc_fast.ttc_from_heights(100.0, 105.0, 0.1), 6)
/// 2.0
#[pyfunction]
pub fn ttc_from_heights(
    previous: &Bound<'_, PyAny>,
    current: &Bound<'_, PyAny>,
    dt: &Bound<'_, PyAny>,
) -> PyResult<f64> {
    let [previous, current] = [number("previous", previous)?, number("current", current)?];
    camera::ttc_from_heights(previous, current, number("dt", dt)?).map_err(value_error)
}

/// Time-to-collision by keypoints matched between two pictures taken ``dt`` seconds apart, with no distance at all.
///
/// Parameters
/// ----------
/// previous, current : ndarray
///     x and y of each match in the earlier and in the later picture, px: shape (N, 2), or (N, 1, 2) as OpenCV has
///     them; float32 or float64, the same in both, read in place whatever the stride and alignment. Row i of one is
///     matched to row i of the other. They should be of one thing, such as those in a detector's box: what else is
///     among them has to be outvoted. A match with a NaN, an inf or a coordinate beyond 1e9 px never counts.
/// dt : float
///     Time between the two, s, from their stamps: 1/30 at 30 pictures a second.
/// min_distance : float
///     Pairs of matches count only if they are at least so far apart in the later picture, px: an error of a pixel
///     weighs the less the farther they are. A thing smaller than this in the picture has no pair that counts, which is
///     TOO_FEW: give a third of its width then.
/// estimator : estimator object, optional
///     How mismatches and background are survived: ``Consensus``, ``MedianRatio``, ``TrimmedMeanRatio`` or
///     ``LeastSquares``; by default ``Consensus()``.
/// threads : int
///     How many threads may share the work of ``MedianRatio``; worth it from about 2000 matches. The answer does not
///     depend on it.
///
/// Returns
/// -------
/// KeypointTTC
///     ``ttc``, ``status``, ``scale``, ``spread``, ``ttc_interval``, ``pairs``, ``matches`` and ``support``.
///
/// Raises
/// ------
/// TypeError
///     If the positions have another dtype, or the estimator is of the wrong kind.
/// ValueError
///     If the positions have another shape, differ in number or are 2^20 or more, ``dt`` is not above 0 and finite,
///     ``min_distance`` is negative or not finite, or ``threads`` is below 1.
///
/// Notes
/// -----
/// A pair i < j counts if it was apart (by more than 2^-52 px) and is at least ``min_distance`` apart now, and its
/// ratio is the root of the quotient of the squared distances, in float64. TTC = dt / (scale - 1) [Udacity's sensor
/// fusion course].
///
/// The scale is that of the points themselves: the far end of a long body grows less than the near one. It is the mean
/// over ``dt``, and neither ``ttc`` nor its interval allows for a closing speed that changes meanwhile.
///
/// ``spread`` and its constants are explained in docs/camera.md, with how often the truth was inside.
///
/// Examples
/// --------
/// >>> import numpy as np, ttc_fast
/// >>> corners = np.array([[500.0, 150.0], [700.0, 150.0], [700.0, 300.0], [500.0, 300.0]])
/// >>> seen = ttc_fast.ttc_from_keypoints(corners, 1.05 * corners, 0.1)
/// >>> round(seen.ttc, 6), seen.status.name, seen.pairs
/// (2.0, 'CLOSING', 6)
#[pyfunction]
#[pyo3(signature = (previous, current, dt, *, min_distance=100.0, estimator=None, threads=1))]
pub fn ttc_from_keypoints(
    py: Python<'_>,
    previous: &Bound<'_, PyAny>,
    current: &Bound<'_, PyAny>,
    dt: &Bound<'_, PyAny>,
    min_distance: f64,
    estimator: Option<&Bound<'_, PyAny>>,
    threads: i64,
) -> PyResult<KeypointTTC> {
    let threads = crate::util::threads(threads)?;
    let dt = number("dt", dt)?;
    let estimator = estimator.map_or(Ok(Estimator::default()), self::estimator)?;
    let (previous, current) = (Pixels::view("previous", previous)?, Pixels::view("current", current)?);
    let (previous, current) = (previous.positions(), current.positions());
    let level = level();
    let found = interruptible(py, 2 * previous.len() * previous.len(), || match (previous, current) {
        (AnyPixels::Single(previous), AnyPixels::Single(current)) => {
            let keypoints = Keypoints { previous, current };
            Some(camera::ttc_from_keypoints(keypoints, dt, min_distance, estimator, level, threads))
        }
        (AnyPixels::Double(previous), AnyPixels::Double(current)) => {
            let keypoints = Keypoints { previous, current };
            Some(camera::ttc_from_keypoints(keypoints, dt, min_distance, estimator, level, threads))
        }
        _ => None,
    })?;
    let found = found.ok_or_else(|| {
        let dtypes = [previous.dtype(), current.dtype()].join(" and ");
        PyTypeError::new_err(format!("previous and current must have the same dtype, got {dtypes}"))
    })?;
    found.map(KeypointTTC).map_err(value_error)
}

choices! {
    estimator, estimator_object: Estimator, "an estimator object such as Consensus() or MedianRatio()"
    { Consensus, MedianRatio, TrimmedMeanRatio, LeastSquares }
}
