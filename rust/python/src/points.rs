//! Point clouds and positions in a picture from Python, in place, whatever their layout.

use crate::array::{Element, as_array, columns, grid, is_array_like, is_records, wrong_dtype};
use crate::macros::{ByType, for_each_type};
use crate::util::{type_name, value_error};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyTuple};
use ttc_fast_core::column::{Column, Table};
use ttc_fast_core::points::{Intensity, Points};
use ttc_fast_core::real::Real;

/// A point has at most this many numbers. An array whose last axis is longer is taken for one that is transposed.
const WIDEST_POINT: usize = 64;

type Array<'py> = Bound<'py, PyUntypedArray>;

/// A cloud, and the arrays that it lies in.
pub struct Cloud<'py> {
    points: AnyPoints<'py>,
    _arrays: Arrays<'py>,
}

/// What keeps the points alive.
enum Arrays<'py> {
    One { _array: Array<'py> },
    Several { _arrays: Vec<Array<'py>> },
}

/// Points, by the type of their coordinates.
pub type AnyPoints<'a> = ByType<Points<'a, f32>, Points<'a, f64>>;

impl AnyPoints<'_> {
    /// The name of the type of their coordinates.
    pub fn dtype(&self) -> &'static str {
        match self {
            AnyPoints::Single(_) => f32::NAME,
            AnyPoints::Double(_) => f64::NAME,
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        for_each_type!(self, points => points.len())
    }
}

impl<'py> Cloud<'py> {
    /// Look at `object` as a cloud, without copying.
    #[inline(always)]
    pub fn view(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        match object.cast_exact::<PyUntypedArray>() {
            Ok(array) if !is_records(array)? => Cloud::of_rows(argument, array.clone()),
            _ => Cloud::made(argument, object),
        }
    }

    /// The points, for as long as the arrays are kept.
    #[inline(always)]
    pub fn points(&self) -> &AnyPoints<'_> {
        &self.points
    }

    /// Whatever is not an array of plain rows already.
    #[inline(never)]
    fn made(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(separate) = object.cast::<PyTuple>() {
            let arrays = separate.iter().map(|column| array(argument, &column)).collect::<PyResult<Vec<_>>>()?;
            return Cloud::of_columns(argument, arrays);
        }
        let array = array(argument, object)?;
        if is_records(&array)? { Cloud::of_records(argument, &array) } else { Cloud::of_rows(argument, array) }
    }

    /// Plain rows: (N, 3) or wider, the fourth column being the intensity, or (H, W, 3) or wider.
    #[inline(always)]
    fn of_rows(argument: &str, array: Array<'py>) -> PyResult<Self> {
        let points = if array.shape().last().is_some_and(|width| *width > WIDEST_POINT) {
            return Err(wrong_rows(argument, &array));
        } else if let Some((xyz, intensity)) = rows::<f32>(&array) {
            AnyPoints::Single(points(xyz, intensity.map(Intensity::F32))?)
        } else if let Some((xyz, intensity)) = rows::<f64>(&array) {
            AnyPoints::Double(points(xyz, intensity.map(Intensity::F64))?)
        } else {
            return Err(wrong_rows(argument, &array));
        };
        Ok(Cloud { points, _arrays: Arrays::One { _array: array } })
    }

    /// Records with fields x, y, z, and perhaps intensity.
    fn of_records(argument: &str, array: &Array<'py>) -> PyResult<Self> {
        let names = array.dtype().getattr("names")?;
        let mut fields = vec!["x", "y", "z"];
        if names.contains("intensity")? {
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
            _ => return Err(unlike_columns(argument, xyz)),
        };
        Ok(Cloud { points, _arrays: Arrays::Several { _arrays: arrays } })
    }
}

/// Points in a plane: one cloud or, with a dimension more, a batch of them. A z that there is only says which are
/// valid.
pub struct Frames<'py> {
    points: AnyPoints<'py>,
    shape: Vec<usize>,
    arrays: Vec<Array<'py>>,
}

impl<'py> Frames<'py> {
    /// Look at `object` as clouds, without copying.
    pub fn view(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(separate) = object.cast::<PyTuple>() {
            if !(2..=4).contains(&separate.len()) {
                let got = separate.len();
                let problem = format!("{argument} as a tuple must be (x, y) or (x, y, z), got {got} arrays");
                return Err(PyValueError::new_err(problem));
            }
            let arrays =
                separate.iter().take(3).map(|column| array(argument, &column)).collect::<PyResult<Vec<_>>>()?;
            return Frames::of_columns(argument, arrays);
        }
        let array = array(argument, object)?;
        if is_records(&array)? { Frames::of_records(argument, &array) } else { Frames::of_rows(argument, array) }
    }

    /// The points, for as long as the arrays are kept: a cloud in each row.
    pub fn points(&self) -> AnyPoints<'_> {
        self.points
    }

    /// How many clouds there are, if this is a batch.
    pub fn batch(&self) -> Option<usize> {
        if let [rows, _] = self.shape[..] { Some(rows) } else { None }
    }

    /// Whether this is a batch.
    pub fn is_batch(&self) -> bool {
        self.batch().is_some()
    }

    /// The shape of an array with one number for each point.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The arrays that they lie in.
    pub fn arrays(&self) -> &[Array<'py>] {
        &self.arrays
    }

    /// Plain rows: (N, 2) or wider, or (B, N, 2) or wider.
    fn of_rows(argument: &str, array: Array<'py>) -> PyResult<Self> {
        let shape = array.shape();
        let problem = match shape {
            [.., width] if *width > WIDEST_POINT => {
                "looks transposed: the last axis is x, y and what else a point has".to_owned()
            }
            [_, width] | [_, _, width] if *width >= 2 => String::new(),
            _ => "must be (N, 2) or wider, or (B, N, 2) or wider for a batch".to_owned(),
        };
        if !problem.is_empty() {
            return Err(PyValueError::new_err(format!("{argument} has shape {shape:?}, which {problem}")));
        }
        let points = match (planar_rows::<f32>(&array), planar_rows::<f64>(&array)) {
            (Some(xyz), _) => AnyPoints::Single(Points::batch(xyz).map_err(value_error)?),
            (_, Some(xyz)) => AnyPoints::Double(Points::batch(xyz).map_err(value_error)?),
            _ => return Err(wrong_dtype(argument, &array)),
        };
        Ok(Frames { points, shape: shape[..shape.len() - 1].to_vec(), arrays: vec![array] })
    }

    /// Records with fields x and y, and perhaps z.
    fn of_records(argument: &str, array: &Array<'py>) -> PyResult<Self> {
        let names = array.dtype().getattr("names")?;
        let mut fields = Vec::with_capacity(3);
        for field in ["x", "y", "z"] {
            if names.contains(field)? {
                fields.push(field);
            }
        }
        if !fields.starts_with(&["x", "y"]) {
            return Err(PyValueError::new_err(format!(
                "{argument} must be records with fields x and y, got {names:?}; pass a tuple of columns to use other fields"
            )));
        }
        let columns = fields
            .into_iter()
            .map(|name| Ok(array.get_item(name)?.cast_into::<PyUntypedArray>()?))
            .collect::<PyResult<Vec<_>>>()?;
        Frames::of_columns(argument, columns)
    }

    /// One array per column: x, y and perhaps z.
    fn of_columns(argument: &str, arrays: Vec<Array<'py>>) -> PyResult<Self> {
        let xyz = [&arrays[0], &arrays[1], arrays.get(2).unwrap_or(&arrays[0])];
        let shape = xyz[0].shape().to_vec();
        if let Some(odd) = arrays.iter().find(|array| array.shape() != shape || !(1..=2).contains(&shape.len())) {
            let (one, other) = (&shape, odd.shape());
            return Err(PyValueError::new_err(format!(
                "{argument} must have columns of one shape, (N,) or (B, N) for a batch, got {one:?} and {other:?}"
            )));
        }
        let points = match (separate::<f32>(xyz), separate::<f64>(xyz)) {
            (Some(xyz), _) => AnyPoints::Single(Points::batch(xyz).map_err(value_error)?),
            (_, Some(xyz)) => AnyPoints::Double(Points::batch(xyz).map_err(value_error)?),
            _ => return Err(unlike_columns(argument, xyz)),
        };
        Ok(Frames { points, shape, arrays })
    }
}

/// What is wrong with an array that is not plain rows.
#[cold]
fn wrong_rows(argument: &str, array: &Array<'_>) -> PyErr {
    match array.shape() {
        shape @ [.., width] if *width > WIDEST_POINT => PyValueError::new_err(format!(
            "{argument} has shape {shape:?}, which looks transposed: the last axis is x, y, z and what else a point has; \
             {argument}.T turns (4, N) into (N, 4)"
        )),
        [_, width] | [_, _, width] if *width >= 3 => wrong_dtype(argument, array),
        shape => PyValueError::new_err(format!(
            "{argument} must have shape (N, 3), (N, 4) or wider, or (H, W, 3) or wider for an organised cloud, got {shape:?}"
        )),
    }
}

/// What is wrong with columns that are neither all float32 nor all float64.
fn unlike_columns(argument: &str, xyz: [&Array<'_>; 3]) -> PyErr {
    let dtypes = xyz.map(|array| array.dtype().to_string());
    let known = |name: &String| name == "float32" || name == "float64";
    if dtypes.iter().all(known) {
        let [x, y, z] = dtypes;
        return PyTypeError::new_err(format!(
            "{argument} must have x, y and z of the same dtype, float32 or float64, got {x}, {y} and {z}"
        ));
    }
    let odd = dtypes.iter().position(|name| !known(name)).unwrap_or(0);
    wrong_dtype(argument, xyz[odd])
}

fn array<'py>(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    if object.cast::<PyUntypedArray>().is_ok() || is_array_like(object)? {
        return as_array(argument, object);
    }
    Err(PyTypeError::new_err(format!(
        "{argument} must be a numpy array of points, or a tuple of arrays (x, y, z[, intensity]), got {}; \
         from_pointcloud2 reads a ROS message",
        type_name(object)
    )))
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
        match columns::<T, 4>(array) {
            Some([x, y, z, intensity]) => Some(([x, y, z], Some(intensity))),
            None => columns::<T, 3>(array).map(|xyz| (xyz, None)),
        }
    }
}

/// x, y and z of plain rows, if they are of type `T`; x again where there is no z.
fn planar_rows<'a, T: Element>(array: &Array<'_>) -> Option<[Table<'a, T>; 3]> {
    // SAFETY: `Frames` keeps the array for as long as it hands out views.
    unsafe { columns::<T, 3>(array).or_else(|| columns::<T, 2>(array).map(|[x, y]| [x, y, x])) }
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
            .or_else(|| grid(array).map(Intensity::I8))
            .or_else(|| grid(array).map(Intensity::I16))
            .or_else(|| grid(array).map(Intensity::I32))
            .or_else(|| grid(array).map(Intensity::U32))
    };
    found.ok_or_else(|| {
        let dtype = array.dtype();
        PyTypeError::new_err(format!(
            "intensity of {argument} must have an integer dtype of up to 32 bits, float32 or float64, got {dtype}"
        ))
    })
}

/// Positions in a picture, and the array that they lie in.
pub struct Pixels<'py> {
    positions: AnyPixels<'py>,
    _array: Array<'py>,
}

/// x and y of positions, by their type.
pub type AnyPixels<'a> = ByType<[Column<'a, f32>; 2], [Column<'a, f64>; 2]>;

impl AnyPixels<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        for_each_type!(self, positions => positions[0].len())
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
