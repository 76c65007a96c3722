//! How outliers in a cloud and speckles in a scan are survived: objects, each with its own settings.

use crate::macros::{choices, settings_class};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use ttc_fast_core::cloud;
use ttc_fast_core::scan::{BeamVote, Neighbours};

settings_class! {
    /// The nearest candidate. It survives no outlier.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.array([[4.0, 0.0, 0.0], [5.0, 0.1, 0.2]])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Minimum()).x
    /// 4.0
    Minimum(), "()" => cloud::Estimator: cloud::Estimator::Minimum
}

settings_class! {
    /// The ``k``-th smallest value: up to ``k - 1`` outliers cannot decide.
    ///
    /// For a cloud this is the distance of the ``k``-th nearest candidate. For ``ScanTTC(minimum=...)`` it is the
    /// ``k``-th smallest time-to-collision of a scan.
    ///
    /// Parameters
    /// ----------
    /// k : int
    ///     Rank of the value, from 1, which is the plain minimum.
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
    KthSmallest(k: usize), "(k)" => cloud::Estimator: cloud::Estimator::KthSmallest(k)
}

settings_class! {
    /// A quantile of the candidates' distances, by NumPy's linear rule; 0.5 is the median.
    ///
    /// Parameters
    /// ----------
    /// q : float
    ///     The quantile, in [0, 1].
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``q`` is outside [0, 1] or NaN.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.array([[4.0, 0.0, 0.0], [5.0, 0.1, 0.2], [9.0, 0.0, 0.1]])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Quantile(0.5)).x
    /// 5.0
    Quantile(q: f64), "(q)" => cloud::Estimator: cloud::Estimator::Quantile(q)
}

settings_class! {
    /// The mean distance of the ``k`` nearest candidates.
    ///
    /// Parameters
    /// ----------
    /// k : int
    ///     Number of candidates, from 1.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``k`` is below 1.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.array([[4.0, 0.0, 0.0], [5.0, 0.1, 0.2], [9.0, 0.0, 0.1]])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.MeanOfLowest(2)).x
    /// 4.5
    MeanOfLowest(k: usize), "(k)" => cloud::Estimator: cloud::Estimator::MeanOfLowest(k)
}

settings_class! {
    /// The nearest candidate not below Tukey's fence, Q1 - factor (Q3 - Q1), of all candidates' distances.
    ///
    /// Parameters
    /// ----------
    /// factor : float
    ///     Factor of the interquartile range, usually 1.5.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``factor`` is negative or not finite.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.column_stack([[1.0, 5.0, 5.1, 5.2, 5.3, 5.4], np.zeros(6), np.ones(6)])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.InterquartileFence(1.5)).x
    /// 5.0
    InterquartileFence(factor: f64), "(factor)" => cloud::Estimator: cloud::Estimator::InterquartileFence(factor)
}

settings_class! {
    /// The nearest candidate that is not alone: at least ``points`` candidates, itself included, in ``[x, x + gap]``.
    ///
    /// Parameters
    /// ----------
    /// points : int
    ///     Number of candidates, from 1.
    /// gap : float
    ///     Length of the interval, m.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``points`` is below 1, or ``gap`` negative or not finite.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.column_stack([[1.0, 5.0, 5.1, 5.2], np.zeros(4), np.ones(4)])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Supported(3, 0.5)).x
    /// 5.0
    Supported(points: usize, gap: f64), "(points, gap)" => cloud::Estimator: cloud::Estimator::Supported { points, gap }
}

settings_class! {
    /// The nearest point of the nearest cluster that is large enough.
    ///
    /// Points belong together if a chain of points links them, each step at most ``tolerance`` long in three
    /// dimensions.
    ///
    /// Parameters
    /// ----------
    /// tolerance : float
    ///     Longest step, m.
    /// min_points : int
    ///     Points of a cluster that is large enough, from 1.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``tolerance`` is not above 0 and finite, or ``min_points`` is below 1.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.column_stack([[1.0, 5.0, 5.1, 5.2], np.zeros(4), np.ones(4)])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Cluster(0.15, 3)).x
    /// 5.0
    Cluster(tolerance: f64, min_points: usize), "(tolerance, min_points)" => cloud::Estimator:
        cloud::Estimator::Cluster { tolerance, min_points }
}

choices! {
    estimator, estimator_object: cloud::Estimator, "an estimator object such as KthSmallest(10) or Cluster(0.15, 10)"
    { KthSmallest, Minimum, Quantile, MeanOfLowest, InterquartileFence, Supported, Cluster }
}

settings_class! {
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
    ///     How many beams to look at on each side, up to 128. Where the beams go all around, the first is a neighbour of
    ///     the last.
    /// gap : float
    ///     How far their ranges may differ, m.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If ``count`` is below 1 or above ``2 * window``, ``window`` is above 128, or ``gap`` is negative or not
    ///     finite.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> ranges = np.array([np.inf, 0.5, np.inf, 8.0, 8.1])    # 0.5 is a speckle
    /// >>> scan = ttc_fast.ScanTTC(0.0, 1e-3, 5, minimum=ttc_fast.NeighbourSupport())
    /// >>> round(scan.min(ranges, 4.0), 3)
    /// 2.0
    NeighbourSupport(count: usize = 1, window: usize = 2, gap: f64 = 0.2), "(count=1, window=2, gap=0.2)" => Neighbours:
        Neighbours { count, window, gap }
}

/// How a speckle in a scan is outvoted, from an object.
pub fn beam_vote(object: &Bound<'_, PyAny>) -> PyResult<BeamVote> {
    if let Ok(kth) = object.cast::<KthSmallest>() {
        Ok(BeamVote::KthSmallest(kth.get().k))
    } else if let Ok(support) = object.cast::<NeighbourSupport>() {
        Ok(BeamVote::Neighbours(support.get().core()))
    } else {
        Err(PyTypeError::new_err(format!("minimum must be KthSmallest(k) or NeighbourSupport(...), got {object}")))
    }
}

/// The object that says how a speckle is outvoted.
pub fn beam_vote_object(py: Python<'_>, vote: BeamVote) -> PyResult<Bound<'_, PyAny>> {
    match vote {
        BeamVote::KthSmallest(k) => KthSmallest { k }.into_bound_py_any(py),
        BeamVote::Neighbours(Neighbours { count, window, gap }) => {
            NeighbourSupport { count, window, gap }.into_bound_py_any(py)
        }
    }
}
