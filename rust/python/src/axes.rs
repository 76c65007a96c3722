//! Which stored coordinate is forward, left and up, as Python names it.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use ttc_fast_core::cloud::{self, Axis};

const COLUMNS: [&str; 3] = ["x", "y", "z"];

/// `axes=...`.
pub fn parse(names: Option<[String; 3]>) -> PyResult<[Axis; 3]> {
    names.map_or(Ok(cloud::REP_103), |[forward, left, up]| Ok([axis(&forward)?, axis(&left)?, axis(&up)?]))
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

/// Its name.
pub fn name(axis: Axis) -> String {
    format!("{}{}", if axis.flipped { "-" } else { "" }, COLUMNS[axis.column])
}
