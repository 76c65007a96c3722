//! NumPy arrays as views of the core: any stride, alignment and byte step, nothing copied.
//!
//! rust-numpy's safe accessors refuse unaligned arrays, or divide byte strides by the item size and walk packed records
//! wrongly. So the array header is read here, and nowhere else. Beside `points`, this is the only file of the binding
//! with `unsafe`.

use crate::macros::{ByType, for_each_type};
use crate::util::type_name;
use numpy::npyffi::{NPY_ARRAY_WRITEABLE, NPY_TYPES};
use numpy::{PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyMemoryView, PyTuple};
use ttc_fast_core::column::{Column, Table, TableMut};

type Array<'py> = Bound<'py, PyUntypedArray>;

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
    array: Array<'py>,
    numbers: Numbers<'py>,
}

/// The numbers of an array, by type.
pub type Numbers<'py> = ByType<Table<'py, f32>, Table<'py, f64>>;

impl<'py> Numbers<'py> {
    /// The numbers, if they are float32.
    pub fn single(self) -> Option<Table<'py, f32>> {
        if let Numbers::Single(table) = self { Some(table) } else { None }
    }

    /// The numbers, if they are float64.
    pub fn double(self) -> Option<Table<'py, f64>> {
        if let Numbers::Double(table) = self { Some(table) } else { None }
    }
}

/// A type that a NumPy array can have, and what NumPy calls it.
pub trait Element: Copy {
    /// The number of the type.
    const NUMBER: NPY_TYPES;
    /// The name of the type.
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

/// Where a C long has 32 bits, as on Windows, int32 and uint32 of NumPy are longs.
const LONG_HAS_32_BITS: bool = size_of::<std::ffi::c_long>() == 4;

impl Element for i8 {
    const NUMBER: NPY_TYPES = NPY_TYPES::NPY_BYTE;
    const NAME: &'static str = "int8";
}

impl Element for i16 {
    const NUMBER: NPY_TYPES = NPY_TYPES::NPY_SHORT;
    const NAME: &'static str = "int16";
}

impl Element for i32 {
    const NUMBER: NPY_TYPES = if LONG_HAS_32_BITS { NPY_TYPES::NPY_LONG } else { NPY_TYPES::NPY_INT };
    const NAME: &'static str = "int32";
}

impl Element for u32 {
    const NUMBER: NPY_TYPES = if LONG_HAS_32_BITS { NPY_TYPES::NPY_ULONG } else { NPY_TYPES::NPY_UINT };
    const NAME: &'static str = "uint32";
}

impl<'py> Floats<'py> {
    /// Look at an array as floats, without copying.
    ///
    /// To be called last: whatever runs Python code, such as converting a number, might move the array's memory.
    #[inline(always)]
    pub fn view(argument: &str, array: Array<'py>) -> PyResult<Self> {
        let header = header(argument, &array)?;
        // SAFETY: the header describes the array's own memory, whose element type is checked. The array stays alive in
        // `self` for as long as a view can be borrowed, and its memory stays where it is: NumPy refuses to resize an
        // array that others refer to, as `self` does, and no Python code of the caller's runs between here and the kernel.
        let numbers = unsafe {
            if holds::<f32>(&array) {
                Numbers::Single(header.table())
            } else if holds::<f64>(&array) {
                Numbers::Double(header.table())
            } else {
                return Err(wrong_dtype(argument, &array));
            }
        };
        Ok(Floats { array, numbers })
    }

    /// The numbers, for as long as the array is kept.
    pub fn numbers(&self) -> Numbers<'_> {
        self.numbers
    }

    /// The number of columns, which is that of readings in each scan.
    pub fn columns(&self) -> usize {
        for_each_type!(&self.numbers, table => table.columns())
    }

    /// The number of rows, which is that of scans.
    pub fn rows(&self) -> usize {
        for_each_type!(&self.numbers, table => table.rows())
    }

    /// The array itself.
    pub fn array(&self) -> &Array<'py> {
        &self.array
    }

    /// The name of the array's dtype.
    pub fn dtype(&self) -> &'static str {
        match &self.numbers {
            Numbers::Single(_) => f32::NAME,
            Numbers::Double(_) => f64::NAME,
        }
    }

    /// A new array of the same shape, to be filled at once.
    pub fn empty_like(&self, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
        empty(self.array.py(), self.array.shape(), dtype)
    }

    /// `object` as an array of `T` to write to, of the same shape as this one and apart from it in memory.
    pub fn output<T: Element>(&self, argument: &str, object: &Bound<'py, PyAny>) -> PyResult<TableMut<'py, T>> {
        let array = target::<T>(argument, object, self.array.shape())?;
        self.refuse_shifted(argument, array)?;
        written(argument, array)
    }

    /// `object`, if there is one, as such an array that is apart in memory from `others` and from this array itself.
    pub fn separate_output<T: Element>(
        &self,
        argument: &str,
        object: Option<&Bound<'py, PyAny>>,
        others: &[Option<&Bound<'py, PyAny>>],
    ) -> PyResult<Option<TableMut<'py, T>>> {
        let Some(object) = object else { return Ok(None) };
        let table = self.output(argument, object)?;
        let array = object.cast::<PyUntypedArray>()?;
        refuse_shared(argument, array, "the input", &self.array)?;
        for other in others.iter().flatten() {
            refuse_shared(argument, array, "another output", other.cast()?)?;
        }
        Ok(Some(table))
    }

    /// An output may be an input itself, element for element, but not a shifted part of it.
    pub fn refuse_shifted(&self, argument: &str, output: &Array<'py>) -> PyResult<()> {
        let itself = data(output) == data(&self.array)
            && output.strides() == self.array.strides()
            && output.dtype().is(self.array.dtype());
        if itself { Ok(()) } else { refuse_shared(argument, output, "an input", &self.array) }
    }
}

/// A new array, to be filled at once.
pub fn empty<'py>(py: Python<'py>, shape: &[usize], dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import(intern!(py, "numpy"))?.call_method1(intern!(py, "empty"), (shape.to_vec(), dtype))
}

/// `object` as an array of `T` to write to, of this shape and apart from all `inputs` in memory.
pub fn output_apart<'py, T: Element>(
    argument: &str,
    object: &Bound<'py, PyAny>,
    shape: &[usize],
    inputs: &[Array<'py>],
) -> PyResult<TableMut<'py, T>> {
    let array = target::<T>(argument, object, shape)?;
    for input in inputs {
        refuse_shared(argument, array, "an input", input)?;
    }
    written(argument, array)
}

/// `object` itself, if it is an ordinary array of `T` of this shape that may be written to.
fn target<'a, 'py, T: Element>(
    argument: &str,
    object: &'a Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<&'a Array<'py>> {
    let array = object.cast::<PyUntypedArray>().map_err(|_| {
        PyTypeError::new_err(format!("{argument} must be a numpy array to write to, got {}", type_name(object)))
    })?;
    if !holds::<T>(array) {
        let dtype = array.dtype();
        return Err(PyTypeError::new_err(format!("{argument} must have dtype {}, got {dtype}", T::NAME)));
    }
    if array.shape() != shape {
        let got = array.shape();
        return Err(PyValueError::new_err(format!("{argument} must have the shape {shape:?}, got {got:?}")));
    }
    if !is_writeable(array) {
        return Err(PyValueError::new_err(format!("{argument} is read-only")));
    }
    if !is_injective(array) {
        return Err(PyValueError::new_err(format!(
            "{argument} overlaps itself: some of its elements share memory; pass an ordinary array"
        )));
    }
    Ok(array)
}

/// A view to write through of an array that `target` let pass.
fn written<'py, T: Element>(argument: &str, array: &Array<'py>) -> PyResult<TableMut<'py, T>> {
    let Header { start, rows, columns, row_stride, stride } = header(argument, array)?;
    // SAFETY: the header describes the array's own memory; `target` checked its type and that it may be written. The
    // caller's argument keeps the array alive for the call.
    Ok(unsafe { TableMut::from_raw(start, (rows, columns), (row_stride, stride)) })
}

/// The arrays to write to: `out`, made if it is missing, and `status_out`. They must not share memory.
pub fn outputs<'py>(
    ranges: &Floats<'py>,
    out: Option<&Bound<'py, PyAny>>,
    status_out: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Option<TableMut<'py, u8>>)> {
    let status = status_out.map(|array| ranges.output::<u8>("status_out", array)).transpose()?;
    refuse_same_memory(out, status_out)?;
    let out = out.map_or_else(|| ranges.empty_like(ranges.dtype()), |out| Ok(out.clone()))?;
    Ok((out, status))
}

/// Refuse two outputs that share memory, if both are arrays.
pub fn refuse_same_memory(out: Option<&Bound<'_, PyAny>>, status_out: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    if let (Some(out), Some(status_out)) = (out, status_out)
        && let Ok(out) = out.cast::<PyUntypedArray>()
    {
        refuse_shared("status_out", status_out.cast()?, "out", out)?;
    }
    Ok(())
}

/// Refuse an output that shares memory with something else that is read or written.
pub fn refuse_shared(argument: &str, output: &Array<'_>, name: &str, other: &Array<'_>) -> PyResult<()> {
    let (from, to) = extent(output);
    let (begin, end) = extent(other);
    if to <= begin || end <= from {
        return Ok(());
    }
    // They interleave, as fields of one record array do, or they overlap: NumPy can tell.
    let py = output.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    if numpy.call_method1(intern!(py, "shares_memory"), (output, other))?.extract()? {
        return Err(PyValueError::new_err(format!("{argument} overlaps {name} in memory; pass a separate array")));
    }
    Ok(())
}

/// First and last byte (exclusive) of an array.
fn extent(array: &Array<'_>) -> (usize, usize) {
    let start = data(array).addr();
    if array.shape().contains(&0) {
        return (start, start);
    }
    let steps = array.shape().iter().zip(array.strides());
    steps.fold((start, start + array.dtype().itemsize()), |(from, to), (n, stride)| {
        let reach = (n - 1).cast_signed() * stride;
        (from.wrapping_add_signed(reach.min(0)), to.wrapping_add_signed(reach.max(0)))
    })
}

/// Whether no two elements share memory. Says no to some strange arrays whose elements do not.
fn is_injective(array: &Array<'_>) -> bool {
    if array.shape().contains(&0) {
        return true;
    }
    let mut axes: Vec<_> = array.shape().iter().zip(array.strides()).filter(|(n, _)| **n > 1).collect();
    axes.sort_unstable_by_key(|(_, stride)| stride.unsigned_abs());
    let mut reach = array.dtype().itemsize();
    axes.into_iter().all(|(n, stride)| {
        let apart = stride.unsigned_abs() >= reach;
        reach += stride.unsigned_abs() * (n - 1);
        apart
    })
}

/// One column of points: an array of 1 dimension, or of 2 for an organised cloud.
///
/// # Safety
/// The view must not outlive the array.
pub unsafe fn grid<'a, T: Element>(array: &Array<'_>) -> Option<Table<'a, T>> {
    let header = header("points", array).ok()?;
    // SAFETY: the type is checked; the header describes the array's own memory, which the caller outlives.
    holds::<T>(array).then(|| unsafe { header.table() })
}

/// The first `C` columns of points: an array of 2 dimensions (points, columns), or of 3 for an organised cloud.
///
/// # Safety
/// The view must not outlive the array.
pub unsafe fn columns<'a, T: Element, const C: usize>(array: &Array<'_>) -> Option<[Table<'a, T>; C]> {
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

/// `object` itself if it is an array, or an array of what it holds.
#[inline(always)]
pub fn as_array<'py>(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    if let Ok(array) = object.cast_exact::<PyUntypedArray>() { Ok(array.clone()) } else { made_array(argument, object) }
}

/// `object` as an array, where it is not one itself: a subclass, a buffer, a tensor on the CPU, a list or a tuple.
///
/// Numbers in lists and tuples are copied, ints as floats. Everything else keeps its memory and its dtype.
#[cold]
fn made_array<'py>(argument: &str, object: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    if let Ok(array) = object.cast::<PyUntypedArray>() {
        return refuse_masked(argument, object).map(|()| array.clone());
    }
    let py = object.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    let made = if let Ok(buffer) = PyMemoryView::from(object) {
        numpy.call_method1(intern!(py, "asarray"), (buffer,))
    } else if object.hasattr(intern!(py, "__dlpack__"))? {
        numpy.call_method1(intern!(py, "from_dlpack"), (object,))
    } else if is_array_like(object)? {
        numpy.call_method1(intern!(py, "asarray"), (object,))
    } else {
        let got = type_name(object);
        let problem =
            format!("{argument} must be a numpy array of float32 or float64, or a list of numbers, got {got}");
        return Err(PyTypeError::new_err(problem));
    };
    let array: Array<'py> = made
        .map_err(|error| {
            let (got, problem) = (type_name(object), error.value(py));
            PyTypeError::new_err(format!("{argument} of type {got} cannot be read as a numpy array: {problem}"))
        })?
        .cast_into()?;
    let typed = object.cast::<PyList>().is_ok() || object.cast::<PyTuple>().is_ok();
    let ints = typed && array.dtype().getattr(intern!(py, "kind"))?.eq("i")?;
    if ints { as_doubles(&array) } else { Ok(array) }
}

/// Whether NumPy makes an array of it: a list, a tuple, or what says so itself.
pub fn is_array_like(object: &Bound<'_, PyAny>) -> PyResult<bool> {
    let py = object.py();
    Ok(object.cast::<PyList>().is_ok()
        || object.cast::<PyTuple>().is_ok()
        || object.hasattr(intern!(py, "__dlpack__"))?
        || object.hasattr(intern!(py, "__array_interface__"))?
        || object.hasattr(intern!(py, "__array__"))?)
}

/// A copy in float64.
fn as_doubles<'py>(array: &Array<'py>) -> PyResult<Array<'py>> {
    Ok(array.call_method1(intern!(array.py(), "astype"), ("float64",))?.cast_into()?)
}

/// The arrays in one dtype: where float32 and float64 meet, copies in float64, as NumPy promotes.
pub fn promote<const N: usize>(arrays: &mut [Option<Array<'_>>; N]) -> PyResult<()> {
    let meets = |holds: fn(&Array<'_>) -> bool| arrays.iter().flatten().any(holds);
    if meets(holds::<f32>) && meets(holds::<f64>) {
        for array in arrays.iter_mut().flatten().filter(|array| holds::<f32>(array)) {
            *array = as_doubles(array)?;
        }
    }
    Ok(())
}

/// Refuse a masked array: what lies under its mask is exactly what is not to be read.
pub fn refuse_masked(argument: &str, object: &Bound<'_, PyAny>) -> PyResult<()> {
    let py = object.py();
    let masked = py.import(intern!(py, "numpy.ma"))?.getattr(intern!(py, "MaskedArray"))?;
    if object.is_instance(&masked)? {
        return Err(PyTypeError::new_err(format!(
            "{argument} must not be a masked array, got {}; {argument}.filled(numpy.nan) makes masked elements invalid",
            type_name(object)
        )));
    }
    Ok(())
}

#[inline(always)]
fn header(argument: &str, array: &Array<'_>) -> PyResult<Header> {
    let start = data(array);
    match (array.shape(), array.strides()) {
        (&[columns], &[stride]) => Ok(Header { start, rows: 1, columns, row_stride: 0, stride }),
        (&[rows, columns], &[row_stride, stride]) => Ok(Header { start, rows, columns, row_stride, stride }),
        (shape, _) => Err(wrong_shape(argument, shape)),
    }
}

#[cold]
fn wrong_shape(argument: &str, shape: &[usize]) -> PyErr {
    let fix = shape.last().map_or_else(String::new, |last| format!("; {argument}.reshape(-1, {last}) is a batch"));
    PyValueError::new_err(format!(
        "{argument} must have 1 dimension (one scan) or 2 (a batch of scans), got shape {shape:?}{fix}"
    ))
}

#[inline(always)]
fn data(array: &Array<'_>) -> *mut u8 {
    // SAFETY: the pointer comes from a live array object, whose header never moves.
    unsafe { (*array.as_array_ptr()).fields.data.cast() }
}

fn is_writeable(array: &Array<'_>) -> bool {
    // SAFETY: as in `data`.
    unsafe { (*array.as_array_ptr()).fields.flags & NPY_ARRAY_WRITEABLE != 0 }
}

/// Whether the array is one of records with named fields.
pub fn is_records(array: &Array<'_>) -> PyResult<bool> {
    // SAFETY: a live array has a live dtype, and every dtype starts with these fields.
    let number = unsafe { (*(*array.as_array_ptr()).fields.descr).fields.type_num };
    if number != NPY_TYPES::NPY_VOID as i32 {
        return Ok(false);
    }
    Ok(!array.dtype().getattr(intern!(array.py(), "names"))?.is_none())
}

/// Whether the array holds `T` in this machine's byte order.
#[inline(always)]
fn holds<T: Element>(array: &Array<'_>) -> bool {
    // SAFETY: a live array has a live dtype, and every dtype starts with these fields.
    let (number, order) = unsafe {
        let dtype = (*array.as_array_ptr()).fields.descr;
        ((*dtype).fields.type_num, (*dtype).fields.byteorder)
    };
    let foreign = if cfg!(target_endian = "little") { b'>' } else { b'<' };
    // A C char is signed on some processors and not on others.
    number == T::NUMBER as i32 && order.to_ne_bytes() != [foreign]
}

/// The exception for a dtype that is not read: which one was met, and how to get one that works.
#[cold]
pub fn wrong_dtype(argument: &str, array: &Array<'_>) -> PyErr {
    let dtype = array.dtype();
    let kind = dtype.getattr("kind").and_then(|kind| kind.extract::<char>()).unwrap_or('?');
    let size = dtype.getattr("itemsize").and_then(|size| size.extract::<usize>()).unwrap_or(0);
    let is_distance = !["speed", "rate", "acceleration"].iter().any(|word| argument.contains(word));
    let fix = match (kind, size) {
        ('i' | 'u', _) if is_distance => {
            format!("integers are often millimetres: convert with ({argument} * 0.001).astype(numpy.float32)")
        }
        ('f', 4 | 8) => format!("it is in foreign byte order: convert with {argument}.astype('=f{size}')"),
        ('V', _) => format!("pick one field of the records, as in {argument}['range']"),
        _ => format!("convert with {argument}.astype(numpy.float32)"),
    };
    PyTypeError::new_err(format!("{argument} must have dtype float32 or float64, got {dtype}; {fix}"))
}
