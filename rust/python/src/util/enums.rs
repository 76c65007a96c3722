//! The package's enums and axes: what Python calls values of the core.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use ttc_fast_core::Status;
use ttc_fast_core::cloud::{Axis, Detection, REP_103};
use ttc_fast_core::road::RoadStatus;

/// An enum of the core that has a twin in `ttc_fast.status`.
pub trait Member: Copy + 'static {
    /// The name of the twin.
    const NAME: &'static str;
    /// All values, which are numbered from 0.
    const ALL: &'static [Self];
    /// The number of this value.
    fn number(self) -> usize;
    /// The members of the twin, looked up once.
    fn members() -> &'static PyOnceLock<Vec<Py<PyAny>>>;
}

macro_rules! member {
    ($kind:ident: $all:expr) => {
        impl Member for $kind {
            const NAME: &'static str = stringify!($kind);
            const ALL: &'static [Self] = &$all;

            fn number(self) -> usize {
                self as usize
            }

            fn members() -> &'static PyOnceLock<Vec<Py<PyAny>>> {
                static MEMBERS: PyOnceLock<Vec<Py<PyAny>>> = PyOnceLock::new();
                &MEMBERS
            }
        }
    };
}
member!(Status: Status::ALL);
member!(Detection: [Detection::Found, Detection::Clear, Detection::TooFew, Detection::NoData]);
member!(RoadStatus: [RoadStatus::Found, RoadStatus::NotFound, RoadStatus::NoData]);

/// The member of the twin.
pub fn member<T: Member>(py: Python<'_>, value: T) -> PyResult<Bound<'_, PyAny>> {
    let members = T::members().get_or_try_init(py, || {
        let twin = py.import("ttc_fast.status")?.getattr(T::NAME)?;
        twin.try_iter()?.map(|member| Ok(member?.unbind())).collect::<PyResult<_>>()
    })?;
    Ok(members[value.number()].bind(py).clone())
}

/// The value of a number.
pub fn numbered<T: Member>(number: usize) -> PyResult<T> {
    T::ALL.get(number).copied().ok_or_else(|| PyValueError::new_err(format!("{number} is no {}", T::NAME)))
}

const COLUMNS: [&str; 3] = ["x", "y", "z"];

/// The axes of a cloud from their names.
pub fn axes(names: Option<[String; 3]>) -> PyResult<[Axis; 3]> {
    names.map_or(Ok(REP_103), |[forward, left, up]| Ok([axis(&forward)?, axis(&left)?, axis(&up)?]))
}

fn axis(name: &str) -> PyResult<Axis> {
    let bare = name.strip_prefix('-').unwrap_or(name);
    let column = COLUMNS.iter().position(|column| *column == bare).ok_or_else(|| {
        PyValueError::new_err(format!(
            "axes must be \"x\", \"y\" or \"z\", with \"-\" before it if flipped, got {name:?}"
        ))
    })?;
    Ok(Axis { column, flipped: bare.len() != name.len() })
}

/// The names of axes.
pub fn axis_names(axes: [Axis; 3]) -> (String, String, String) {
    let [forward, left, up] =
        axes.map(|axis| format!("{}{}", if axis.flipped { "-" } else { "" }, COLUMNS[axis.column]));
    (forward, left, up)
}
