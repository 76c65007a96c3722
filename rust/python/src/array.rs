//! NumPy arrays as views of the core: any stride, alignment and byte step, nothing copied.
//!
//! rust-numpy's safe accessors refuse unaligned arrays, or divide byte strides by the item size and walk packed
//! records wrongly. So the array header is read here, and nowhere else. The only file of the binding with `unsafe`.

use numpy::npyffi::{NPY_ARRAY_WRITEABLE, NPY_TYPES};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyMemoryView;
use ttc_fast_core::column::{Column, Table, TableMut};

/// A header of a 1-D or 2-D array, its rows and columns; a 1-D array is one row.
struct Header {
    start: *mut u8,
    rows: usize,
    columns: usize,
    row_stride: isize,
    stride: isize,
}

/// A 1-D or 2-D array of floats, kept alive.
pub struct Floats<'py> {
    array: Bound<'py, PyUntypedArray>,
    /// One scan (1-D), or a batch of scans (2-D)?
    pub batch: bool,
    numbers: Numbers<'py>,
}

/// The numbers, by type.
#[derive(Clone, Copy)]
pub enum Numbers<'py> {
    /// float32
    Single(Table<'py, f32>),
    /// float64
    Double(Table<'py, f64>),
}

/// A type that a NumPy array can have, and what NumPy calls it.
pub trait Element: Copy {
    /// Its type number.
    const NUMBER: NPY_TYPES;
    /// Its name.
    const NAME: &'static str;
}

impl Element for f32 {
    const NUMBER: NPY_TYPES = NPY_TYPES::NPY_FLOAT;
    const NAME: &'static str = "float32";
}

impl Element for f64 {
    const NUMBER: NPY_TYPES = NPY_TYPES::NPY_DOUBLE;
    const NAME: &'static str = "float64";
}

impl Element for u16 {
    const NUMBER: NPY_TYPES = NPY_TYPES::NPY_USHORT;
    const NAME: &'static str = "uint16";
}

impl Element for u8 {
    const NUMBER: NPY_TYPES = NPY_TYPES::NPY_UBYTE;
    const NAME: &'static str = "uint8";
}

impl<'py> Floats<'py> {
    /// Look at `object` as an array of floats, without copying.
    pub fn view(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = as_array(argument, object)?;
        let header = header(argument, &array)?;
        // SAFETY: the header describes the array's own memory, whose element type is checked; the array stays
        // alive in `self`, and with it the memory, for as long as a view can be borrowed.
        let numbers = unsafe {
            if holds::<f32>(&array) {
                Numbers::Single(header.table())
            } else if holds::<f64>(&array) {
                Numbers::Double(header.table())
            } else {
                return Err(wrong_dtype(argument, &array));
            }
        };
        Ok(Floats { batch: array.ndim() == 2, numbers, array })
    }

    /// Its numbers, for as long as the array is kept.
    pub fn numbers(&self) -> Numbers<'_> {
        self.numbers
    }

    /// How many scans there are.
    pub fn rows(&self) -> usize {
        match &self.numbers {
            Numbers::Single(table) => table.rows(),
            Numbers::Double(table) => table.rows(),
        }
    }

    /// Its shape.
    pub fn shape(&self) -> &[usize] {
        self.array.shape()
    }

    /// The name of its type.
    pub fn dtype(&self) -> &'static str {
        match &self.numbers {
            Numbers::Single(_) => f32::NAME,
            Numbers::Double(_) => f64::NAME,
        }
    }

    /// A new array of the same shape, to be filled at once.
    pub fn empty_like(&self, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
        let py = self.array.py();
        py.import(intern!(py, "numpy"))?.call_method1(intern!(py, "empty"), (self.array.shape().to_vec(), dtype))
    }

    /// `object` as an array of `T` to write to, of the same shape as this one and apart from it in memory.
    pub fn output<T: Element>(&self, argument: &str, object: &Bound<'py, PyAny>) -> PyResult<TableMut<'py, T>> {
        let array = object.cast::<PyUntypedArray>().map_err(|_| {
            PyTypeError::new_err(format!("{argument} must be a numpy array to write to, got {}", type_name(object)))
        })?;
        if !holds::<T>(array) {
            let dtype = array.dtype();
            return Err(PyTypeError::new_err(format!("{argument} must have dtype {}, got {dtype}", T::NAME)));
        }
        if array.shape() != self.array.shape() {
            let (expected, got) = (self.array.shape(), array.shape());
            return Err(PyValueError::new_err(format!("{argument} must have the shape {expected:?}, got {got:?}")));
        }
        if !is_writeable(array) {
            return Err(PyValueError::new_err(format!("{argument} is read-only")));
        }
        self.refuse_overlap(argument, array)?;
        let Header { start, rows, columns, row_stride, stride } = header(argument, array)?;
        // SAFETY: the header describes the array's own memory; its type and that it may be written are checked.
        // The caller's argument keeps the array alive for the call.
        Ok(unsafe { TableMut::from_raw(start, (rows, columns), (row_stride, stride)) })
    }

    /// An output may be the input itself, element for element, but not a shifted part of it.
    fn refuse_overlap(&self, argument: &str, output: &Bound<'py, PyUntypedArray>) -> PyResult<()> {
        let py = output.py();
        let same = data(output) == data(&self.array)
            && output.strides() == self.array.strides()
            && output.dtype().is(self.array.dtype());
        let share = || {
            py.import(intern!(py, "numpy"))?
                .call_method1(intern!(py, "may_share_memory"), (&self.array, output))?
                .extract::<bool>()
        };
        if !same && share()? {
            return Err(PyValueError::new_err(format!(
                "{argument} overlaps the input in memory; pass a separate array, or the input itself"
            )));
        }
        Ok(())
    }
}

/// One column of points: an array of 1 dimension, or of 2 for an organised cloud.
///
/// # Safety
/// The view must not outlive the array.
pub unsafe fn grid<'a, T: Element>(array: &Bound<'_, PyUntypedArray>) -> Option<Table<'a, T>> {
    let header = header("points", array).ok()?;
    // SAFETY: the type is checked; the header describes the array's own memory, which the caller outlives.
    holds::<T>(array).then(|| unsafe { header.table() })
}

/// The first `C` columns of points: an array of 2 dimensions (points, columns), or of 3 for an organised cloud.
///
/// # Safety
/// The view must not outlive the array.
pub unsafe fn columns<'a, T: Element, const C: usize>(array: &Bound<'_, PyUntypedArray>) -> Option<[Table<'a, T>; C]> {
    let (rows, row_stride, points, stride, width, step) = match (array.shape(), array.strides()) {
        (&[points, width], &[stride, step]) => (1, 0, points, stride, width, step),
        (&[rows, points, width], &[row_stride, stride, step]) => (rows, row_stride, points, stride, width, step),
        _ => return None,
    };
    (holds::<T>(array) && width >= C).then(|| {
        std::array::from_fn(|column| {
            let start = data(array).wrapping_offset(column.cast_signed() * step);
            // SAFETY: the type is checked, and column < C <= width: these are elements of the array, which the caller
            // outlives.
            unsafe { Header { start, rows, columns: points, row_stride, stride }.table() }
        })
    })
}

impl Header {
    /// # Safety
    /// The memory must hold numbers of type `T` and outlive `'py`.
    unsafe fn table<'py, T: Copy>(&self) -> Table<'py, T> {
        // SAFETY: NumPy promises that each element of an array lies where its shape and strides say.
        unsafe {
            let first = Column::from_raw(self.start, self.columns, self.stride);
            Table::from_raw(first, self.rows, self.row_stride)
        }
    }
}

/// `object` itself if it is an array, or an array over the same memory if it offers a buffer.
fn as_array<'py>(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = object.cast::<PyUntypedArray>() {
        return Ok(array.clone());
    }
    let py = object.py();
    let Ok(buffer) = PyMemoryView::from(object) else {
        let fix = if object.hasattr(intern!(py, "__dlpack__"))? {
            format!("numpy.from_dlpack({argument}) makes one without copying")
        } else {
            format!("numpy.asarray({argument}, dtype=numpy.float32) makes one")
        };
        return Err(PyTypeError::new_err(format!(
            "{argument} must be a numpy array or a buffer of float32 or float64, got {}; {fix}",
            type_name(object)
        )));
    };
    Ok(py.import(intern!(py, "numpy"))?.call_method1(intern!(py, "asarray"), (buffer,))?.cast_into()?)
}

fn header(argument: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<Header> {
    let start = data(array);
    match (array.shape(), array.strides()) {
        (&[columns], &[stride]) => Ok(Header { start, rows: 1, columns, row_stride: 0, stride }),
        (&[rows, columns], &[row_stride, stride]) => Ok(Header { start, rows, columns, row_stride, stride }),
        (shape, _) => Err(PyValueError::new_err(format!(
            "{argument} must have 1 dimension (one scan) or 2 (a batch of scans), got shape {shape:?}"
        ))),
    }
}

fn data(array: &Bound<'_, PyUntypedArray>) -> *mut u8 {
    // SAFETY: the pointer comes from a live array object, whose header never moves.
    unsafe { (*array.as_array_ptr()).fields.data.cast() }
}

fn is_writeable(array: &Bound<'_, PyUntypedArray>) -> bool {
    // SAFETY: as in `data`.
    unsafe { (*array.as_array_ptr()).fields.flags & NPY_ARRAY_WRITEABLE != 0 }
}

/// Whether the array holds `T` in this machine's byte order.
fn holds<T: Element>(array: &Bound<'_, PyUntypedArray>) -> bool {
    // SAFETY: a live array has a live dtype, and every dtype starts with these fields.
    let (number, order) = unsafe {
        let dtype = (*array.as_array_ptr()).fields.descr;
        ((*dtype).fields.type_num, (*dtype).fields.byteorder.cast_unsigned())
    };
    let foreign = if cfg!(target_endian = "little") { b'>' } else { b'<' };
    number == T::NUMBER as i32 && order != foreign
}

pub fn type_name(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| String::from("an object"), |name| name.to_string())
}

/// Says which dtype was met, and how to get one that works.
pub fn wrong_dtype(argument: &str, array: &Bound<'_, PyUntypedArray>) -> PyErr {
    let dtype = array.dtype();
    let kind = dtype.getattr("kind").and_then(|kind| kind.extract::<char>()).unwrap_or('?');
    let size = dtype.getattr("itemsize").and_then(|size| size.extract::<usize>()).unwrap_or(0);
    let fix = match (kind, size) {
        ('i' | 'u', _) => {
            format!("integers are often millimetres: convert with ({argument} * 0.001).astype(numpy.float32)")
        }
        ('f', 4 | 8) => format!("it is in foreign byte order: convert with {argument}.astype('=f{size}')"),
        ('V', _) => format!("pick one field of the records, as in {argument}['range']"),
        _ => format!("convert with {argument}.astype(numpy.float32)"),
    };
    PyTypeError::new_err(format!("{argument} must have dtype float32 or float64, got {dtype}; {fix}"))
}
