//! Point clouds and positions in a picture from Python, in place, whatever their layout.

use crate::array::{Element, as_array, columns, grid, refuse_masked, type_name, wrong_dtype};
use crate::errors::value_error;
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyTuple};
use ttc_fast_core::cloud::{Intensity, Points};
use ttc_fast_core::column::{Column, Table};
use ttc_fast_core::real::Real;

/// Points have fewer numbers than this; an array of points as columns has more.
const WIDEST_POINT: usize = 64;

type Array<'py> = Bound<'py, PyUntypedArray>;

/// A cloud, and the arrays that it lies in.
pub struct Cloud<'py> {
    points: AnyPoints<'py>,
    _arrays: Vec<Array<'py>>,
}

/// Points, by the type of their coordinates.
#[derive(Clone, Copy)]
pub enum AnyPoints<'a> {
    /// float32
    Single(Points<'a, f32>),
    /// float64
    Double(Points<'a, f64>),
}

impl AnyPoints<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            AnyPoints::Single(points) => points.len(),
            AnyPoints::Double(points) => points.len(),
        }
    }
}

impl<'py> Cloud<'py> {
    /// Look at `object` as a cloud, without copying.
    pub fn view(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(separate) = object.cast::<PyTuple>() {
            let arrays = separate.iter().map(|column| array(argument, &column)).collect::<PyResult<Vec<_>>>()?;
            return Cloud::of_columns(argument, arrays);
        }
        let array = array(argument, object)?;
        if array.dtype().getattr(intern!(object.py(), "names"))?.is_none() {
            Cloud::of_rows(argument, array)
        } else {
            Cloud::of_records(argument, &array)
        }
    }

    /// The points, for as long as the arrays are kept.
    pub fn points(&self) -> AnyPoints<'_> {
        self.points
    }

    /// Plain rows: (N, 3) or wider, the fourth column being the intensity, or (H, W, 3) or wider.
    fn of_rows(argument: &str, array: Array<'py>) -> PyResult<Self> {
        if array.shape().last().is_some_and(|width| *width > WIDEST_POINT) {
            return Err(PyValueError::new_err(format!(
                "{argument} has shape {:?}, which looks transposed: the last axis is x, y, z and what else a point has; \
                 {argument}.T turns (4, N) into (N, 4)",
                array.shape()
            )));
        }
        let points = match (rows::<f32>(&array), rows::<f64>(&array)) {
            (Some((xyz, intensity)), _) => AnyPoints::Single(points(xyz, intensity.map(Intensity::F32))?),
            (_, Some((xyz, intensity))) => AnyPoints::Double(points(xyz, intensity.map(Intensity::F64))?),
            _ if !(2..=3).contains(&array.ndim()) || array.shape()[array.ndim() - 1] < 3 => {
                return Err(PyValueError::new_err(format!(
                    "{argument} must have shape (N, 3), (N, 4) or wider, or (H, W, 3) or wider for an organised cloud, \
                     got {:?}",
                    array.shape()
                )));
            }
            _ => return Err(wrong_dtype(argument, &array)),
        };
        Ok(Cloud { points, _arrays: vec![array] })
    }

    /// Records with fields x, y, z, and perhaps intensity.
    fn of_records(argument: &str, array: &Array<'py>) -> PyResult<Self> {
        let names: Vec<String> = array.dtype().getattr("names")?.extract()?;
        let mut fields = vec!["x", "y", "z"];
        if names.iter().any(|name| name == "intensity") {
            fields.push("intensity");
        }
        let missing = |_| {
            PyValueError::new_err(format!(
                "{argument} must be records with fields x, y and z, got {names:?}; \
                 pass a tuple of columns to use other fields"
            ))
        };
        let columns = fields
            .into_iter()
            .map(|name| Ok(array.get_item(name).map_err(missing)?.cast_into::<PyUntypedArray>()?))
            .collect::<PyResult<Vec<_>>>()?;
        Cloud::of_columns(argument, columns)
    }

    /// One array per column: x, y, z and perhaps intensity.
    fn of_columns(argument: &str, arrays: Vec<Array<'py>>) -> PyResult<Self> {
        let (xyz, intensity) = match arrays.as_slice() {
            [x, y, z] => ([x, y, z], None),
            [x, y, z, intensity] => ([x, y, z], Some(intensity)),
            _ => {
                let got = arrays.len();
                return Err(PyValueError::new_err(format!(
                    "{argument} as a tuple must be (x, y, z) or (x, y, z, intensity), got {got} arrays"
                )));
            }
        };
        let ndim = xyz[0].ndim();
        if let Some(odd) = arrays.iter().find(|array| array.shape() != xyz[0].shape() || !(1..=2).contains(&ndim)) {
            return Err(PyValueError::new_err(format!(
                "{argument} must have columns of one shape, (N,) or (H, W), got {:?} and {:?}",
                xyz[0].shape(),
                odd.shape()
            )));
        }
        let intensity = intensity.map(|array| self::intensity(argument, array)).transpose()?;
        let points = match (separate::<f32>(xyz), separate::<f64>(xyz)) {
            (Some(xyz), _) => AnyPoints::Single(points(xyz, intensity)?),
            (_, Some(xyz)) => AnyPoints::Double(points(xyz, intensity)?),
            _ => {
                let dtypes = xyz.map(|array| array.dtype().to_string());
                let known = |name: &String| name == "float32" || name == "float64";
                if dtypes.iter().all(known) {
                    let [x, y, z] = dtypes;
                    return Err(PyTypeError::new_err(format!(
                        "{argument} must have x, y and z of the same dtype, float32 or float64, got {x}, {y} and {z}"
                    )));
                }
                let odd = dtypes.iter().position(|name| !known(name)).unwrap_or(0);
                return Err(wrong_dtype(argument, xyz[odd]));
            }
        };
        Ok(Cloud { points, _arrays: arrays })
    }
}

fn array<'py>(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    if object.cast_exact::<PyUntypedArray>().is_err() && object.cast::<PyUntypedArray>().is_ok() {
        refuse_masked(argument, object)?;
    }
    object.cast::<PyUntypedArray>().cloned().map_err(|_| {
        PyTypeError::new_err(format!(
            "{argument} must be a numpy array of points, or a tuple of arrays (x, y, z[, intensity]), got {}; \
             from_pointcloud2 reads a ROS message",
            type_name(object)
        ))
    })
}

fn points<'a, T: Real>(xyz: [Table<'a, T>; 3], intensity: Option<Intensity<'a>>) -> PyResult<Points<'a, T>> {
    Points::new(xyz, intensity).map_err(value_error)
}

/// Coordinates, and the intensity if there is a fourth column.
type Rows<'a, T> = ([Table<'a, T>; 3], Option<Table<'a, T>>);

/// Coordinates and intensity of plain rows, if they are of type `T`.
fn rows<'a, T: Element>(array: &Array<'_>) -> Option<Rows<'a, T>> {
    // SAFETY: `Cloud` keeps the array for as long as it hands out views.
    unsafe {
        let intensity = columns::<T, 4>(array).map(|[_, _, _, intensity]| intensity);
        Some((columns::<T, 3>(array)?, intensity))
    }
}

/// Coordinates from separate columns, if all are of type `T`.
fn separate<'a, T: Element>([x, y, z]: [&Array<'_>; 3]) -> Option<[Table<'a, T>; 3]> {
    // SAFETY: as in `rows`.
    unsafe { Some([grid(x)?, grid(y)?, grid(z)?]) }
}

fn intensity<'a>(argument: &str, array: &Array<'_>) -> PyResult<Intensity<'a>> {
    // SAFETY: as in `rows`.
    let found = unsafe {
        grid(array)
            .map(Intensity::F32)
            .or_else(|| grid(array).map(Intensity::F64))
            .or_else(|| grid(array).map(Intensity::U8))
            .or_else(|| grid(array).map(Intensity::U16))
    };
    found.ok_or_else(|| {
        let dtype = array.dtype();
        PyTypeError::new_err(format!(
            "intensity of {argument} must have dtype uint8, uint16, float32 or float64, got {dtype}"
        ))
    })
}

/// Positions in a picture, and the array that they lie in.
pub struct Pixels<'py> {
    positions: AnyPixels<'py>,
    _array: Array<'py>,
}

/// x and y of positions, by their type.
#[derive(Clone, Copy)]
pub enum AnyPixels<'a> {
    /// float32
    Single([Column<'a, f32>; 2]),
    /// float64
    Double([Column<'a, f64>; 2]),
}

impl AnyPixels<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            AnyPixels::Single([x, _]) => x.len(),
            AnyPixels::Double([x, _]) => x.len(),
        }
    }

    /// The name of their type.
    pub fn dtype(&self) -> &'static str {
        match self {
            AnyPixels::Single(_) => f32::NAME,
            AnyPixels::Double(_) => f64::NAME,
        }
    }
}

impl<'py> Pixels<'py> {
    /// Look at `object` as positions, without copying: (N, 2), or (N, 1, 2) as OpenCV has them.
    pub fn view(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let mut array = as_array(argument, object)?;
        if let &[_, 1, _] = array.shape() {
            array = array.get_item((PySlice::full(object.py()), 0))?.cast_into::<PyUntypedArray>()?;
        }
        let &[_, 2] = array.shape() else {
            return Err(PyValueError::new_err(format!(
                "{argument} must have shape (N, 2), one x and y in pixels for each match, got {:?}",
                array.shape()
            )));
        };
        // SAFETY: the array is kept for as long as views are handed out.
        let positions = unsafe {
            match (columns::<f32, 2>(&array), columns::<f64, 2>(&array)) {
                (Some(xy), _) => AnyPixels::Single(xy.map(|column| column.row(0))),
                (_, Some(xy)) => AnyPixels::Double(xy.map(|column| column.row(0))),
                _ => {
                    let dtype = array.dtype();
                    return Err(PyTypeError::new_err(format!(
                        "{argument} must have dtype float32 or float64, got {dtype}; \
                         convert with {argument}.astype(numpy.float32)"
                    )));
                }
            }
        };
        Ok(Pixels { positions, _array: array })
    }

    /// The positions, for as long as the array is kept.
    pub fn positions(&self) -> AnyPixels<'_> {
        self.positions
    }
}
