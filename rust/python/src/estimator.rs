//! The estimators as Python objects, each with its own settings.

use crate::errors::value_error;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use ttc_fast_core::cloud;

/// What an estimator of a given name looks like from Python: checked settings, their getters, `repr`, equality and pickling.
macro_rules! estimator {
    ($(#[$doc:meta])* $name:ident($($setting:ident: $type:ty $(= $default:expr)?),*), $signature:literal => $core:expr) => {
        $(#[$doc])*
        #[pyclass(frozen, eq, module = "ttc_fast")]
        #[derive(Clone, Copy, PartialEq)]
        pub struct $name {
            $(#[pyo3(get)] $setting: $type,)*
        }

        #[pymethods]
        #[allow(clippy::trivially_copy_pass_by_ref, reason = "Python hands methods a reference")]
        impl $name {
            #[new]
            #[pyo3(signature = ($($setting $(= $default)?),*), text_signature = $signature)]
            fn new($($setting: <$type as Setting>::Argument),*) -> PyResult<Self> {
                let estimator = $name { $($setting: <$type as Setting>::checked(stringify!($setting), $setting)?),* };
                estimator.core().checked().map_err(value_error)?;
                Ok(estimator)
            }

            fn __repr__(&self) -> String {
                let settings: Vec<String> = vec![$(format!(concat!(stringify!($setting), "={:?}"), self.$setting)),*];
                format!(concat!(stringify!($name), "({})"), settings.join(", "))
            }

            fn __hash__(&self) -> u64 {
                crate::hash(&self.__repr__())
            }

            fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
                let settings: Vec<Bound<'py, PyAny>> = vec![$(self.$setting.into_bound_py_any(py)?),*];
                PyTuple::new(py, settings)
            }
        }

        impl $name {
            pub fn core(&self) -> cloud::Estimator {
                let $name { $($setting),* } = *self;
                $core
            }
        }
    };
}

/// A setting as Python gives it, and as it is kept.
trait Setting: Sized {
    type Argument;
    fn checked(name: &str, argument: Self::Argument) -> PyResult<Self>;
}

impl Setting for f64 {
    type Argument = f64;
    fn checked(_: &str, argument: f64) -> PyResult<Self> {
        Ok(argument)
    }
}

impl Setting for usize {
    type Argument = i64;
    fn checked(name: &str, argument: i64) -> PyResult<Self> {
        usize::try_from(argument)
            .map_err(|_| PyValueError::new_err(format!("{name} must be at least 1, got {argument}")))
    }
}

estimator! {
    /// The nearest candidate. Survives no outlier.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> points = np.array([[4.0, 0.0, 0.0], [5.0, 0.1, 0.2]])
    /// >>> ttc_fast.robust_min_x(points, estimator=ttc_fast.Minimum()).x
    /// 4.0
    Minimum(), "()" => cloud::Estimator::Minimum
}

estimator! {
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
    KthSmallest(k: usize), "(k)" => cloud::Estimator::KthSmallest(k)
}

estimator! {
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
    Quantile(q: f64), "(q)" => cloud::Estimator::Quantile(q)
}

estimator! {
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
    MeanOfLowest(k: usize), "(k)" => cloud::Estimator::MeanOfLowest(k)
}

estimator! {
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
    InterquartileFence(factor: f64), "(factor)" => cloud::Estimator::InterquartileFence(factor)
}

estimator! {
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
    Supported(points: usize, gap: f64), "(points, gap)" => cloud::Estimator::Supported { points, gap }
}

estimator! {
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
        cloud::Estimator::Cluster { tolerance, min_points }
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
