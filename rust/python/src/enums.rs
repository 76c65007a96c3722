//! Members of the package's enums for values of the core.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use ttc_fast_core::Status;
use ttc_fast_core::cloud::Detection;
use ttc_fast_core::road::RoadStatus;

type Members = PyOnceLock<Vec<Py<PyAny>>>;

/// The Python `Status`.
pub fn status(py: Python<'_>, status: Status) -> PyResult<Bound<'_, PyAny>> {
    static MEMBERS: Members = Members::new();
    member(py, &MEMBERS, "Status", status as usize)
}

/// The Python `Detection`.
pub fn detection(py: Python<'_>, detection: Detection) -> PyResult<Bound<'_, PyAny>> {
    static MEMBERS: Members = Members::new();
    member(py, &MEMBERS, "Detection", detection as usize)
}

/// The Python `RoadStatus`.
pub fn road_status(py: Python<'_>, status: RoadStatus) -> PyResult<Bound<'_, PyAny>> {
    static MEMBERS: Members = Members::new();
    member(py, &MEMBERS, "RoadStatus", status as usize)
}

/// Member `value` of an enum whose values count from 0.
fn member<'py>(py: Python<'py>, members: &'static Members, name: &str, value: usize) -> PyResult<Bound<'py, PyAny>> {
    let members = members.get_or_try_init(py, || {
        let kind = py.import("ttc_fast.status")?.getattr(name)?;
        kind.try_iter()?.map(|member| Ok(member?.unbind())).collect::<PyResult<_>>()
    })?;
    Ok(members[value].bind(py).clone())
}
