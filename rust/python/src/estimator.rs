//! The estimators as Python objects, each with its own settings.

use crate::settings::{Setting, settings};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use ttc_fast_core::cloud;

settings! {
    /// The nearest candidate. Survives no outlier.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.array([[4.0, 0.0, 0.0], [5.0, 0.1, 0.2]])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Minimum()).x
    /// 4.0
    Minimum(), "()" => cloud::Estimator: cloud::Estimator::Minimum
}

settings! {
    /// The ``k``-th smallest value: up to ``k - 1`` outliers cannot decide.
    ///
    /// For a cloud, the distance of the ``k``-th nearest candidate. For ``ScanTTC(minimum=...)``, the ``k``-th smallest
    /// time-to-collision of a scan.
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
    KthSmallest(k: usize), "(k)" => cloud::Estimator: cloud::Estimator::KthSmallest(k)
}

settings! {
    /// A quantile of the candidates' distances, by NumPy's linear rule; 0.5 is the median.
    ///
    /// Parameters
    /// ----------
    /// q : float
    ///     In [0, 1].
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

settings! {
    /// The mean distance of the ``k`` nearest candidates.
    ///
    /// Parameters
    /// ----------
    /// k : int
    ///     From 1.
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

settings! {
    /// The nearest candidate not below Tukey's fence, Q1 - factor (Q3 - Q1), of all candidates' distances.
    ///
    /// Parameters
    /// ----------
    /// factor : float
    ///     Usually 1.5.
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

settings! {
    /// The nearest candidate that is not alone: at least ``points`` candidates, itself included, in ``[x, x + gap]``.
    ///
    /// Parameters
    /// ----------
    /// points : int
    ///     From 1.
    /// gap : float
    ///     m.
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

settings! {
    /// The nearest point of the nearest cluster that is large enough.
    ///
    /// Points belong together if a chain of points links them, each step at most ``tolerance`` long in three dimensions.
    ///
    /// Parameters
    /// ----------
    /// tolerance : float
    ///     m.
    /// min_points : int
    ///     From 1.
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
    Cluster(tolerance: f64, min_points: usize), "(tolerance, min_points)" =>
        cloud::Estimator: cloud::Estimator::Cluster { tolerance, min_points }
}

impl KthSmallest {
    /// Which one.
    pub fn k(self) -> usize {
        self.k
    }
}

/// `estimator=...`.
pub fn estimator(object: &Bound<'_, PyAny>) -> PyResult<cloud::Estimator> {
    macro_rules! one_of {
        ($($name:ident),*) => {
            $(if let Ok(estimator) = object.cast::<$name>() {
                return Ok(estimator.get().core());
            })*
        };
    }
    one_of!(KthSmallest, Minimum, Quantile, MeanOfLowest, InterquartileFence, Supported, Cluster);
    Err(PyTypeError::new_err(format!(
        "estimator must be an estimator object such as KthSmallest(10) or Cluster(0.15, 10), got {object}"
    )))
}
