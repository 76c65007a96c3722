//! Views of numbers in memory of the caller: any stride, either direction, any alignment, nothing copied.
//!
//! NumPy hands out arrays whose elements are any number of bytes apart (fields of packed records, every
//! second beam, reversed rows) and at any address (messages sliced out of a bag file). A [`Column`] is such
//! an array: a start, a length and a stride in bytes. Kernels read it through [`Source::lanes`], which checks
//! the bounds and then reads raw memory without assuming alignment. Nothing here ever makes a reference into
//! the memory, because another thread may write to it meanwhile; the reader then sees a mix of old and new
//! numbers, never memory outside the array.
//!
//! With `simd`, one of the crate's two files with `unsafe`.

use std::marker::PhantomData;
use std::mem::size_of;

/// Numbers that a kernel reads several at a time.
pub trait Source<T>: Copy {
    /// How many there are.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Returns numbers `at .. at + N`.
    ///
    /// # Panics
    /// When they are not all inside.
    fn lanes<const N: usize>(&self, at: usize) -> [T; N];
    /// Returns numbers `at .. at + N`, with `fill` for those past the end. It serves for the last few, where `lanes`
    /// would panic.
    fn lanes_or<const N: usize>(&self, at: usize, fill: T) -> [T; N];
    /// Returns numbers `at .. at + 4 * N`.
    ///
    /// # Panics
    /// When they are not all inside.
    #[inline(always)]
    fn four_lanes<const N: usize>(&self, at: usize) -> [[T; N]; 4] {
        [self.lanes(at), self.lanes(at + N), self.lanes(at + 2 * N), self.lanes(at + 3 * N)]
    }
}

/// Does the same with a column, or points, whether there are gaps or not. It is compiled once for each: without gaps,
/// lanes are one load.
macro_rules! by_layout {
    ($column:expr, |$numbers:ident| $work:expr) => {
        match ($column, $column.dense()) {
            (_, Some($numbers)) => $work,
            ($numbers, None) => $work,
        }
    };
}
pub(crate) use by_layout;

/// A view of `len` numbers, `stride` bytes apart, at any alignment.
#[derive(Clone, Copy, Debug)]
pub struct Column<'a, T> {
    start: *const u8,
    len: usize,
    stride: isize,
    memory: PhantomData<&'a [T]>,
}

/// A [`Column`] without gaps, from which lanes are one load.
#[derive(Clone, Copy, Debug)]
pub struct Dense<'a, T>(Column<'a, T>);

// SAFETY: a column only reads, and `from_raw` asks for memory that stays readable from any thread.
unsafe impl<T: Sync> Send for Column<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Column<'_, T> {}

impl<'a, T: Copy> Column<'a, T> {
    /// Makes a column over a slice.
    #[must_use]
    pub fn new(values: &'a [T]) -> Self {
        // SAFETY: a slice is `len` readable values, `size_of::<T>()` apart, for its lifetime.
        unsafe { Self::from_raw(values.as_ptr().cast(), values.len(), step::<T>()) }
    }

    /// Makes a column over raw memory.
    ///
    /// # Safety
    /// For every `i < len`, `start + i * stride` must be the address of `size_of::<T>()` readable bytes that hold a
    /// value of `T` (aligned or not), and stay so for `'a`. All bytes from the first number to the last must be
    /// readable, those between the numbers too, as they are in any array that lies in one buffer.
    #[must_use]
    pub unsafe fn from_raw(start: *const u8, len: usize, stride: isize) -> Self {
        Column { start, len, stride, memory: PhantomData }
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns number `i`.
    ///
    /// # Panics
    /// When `i` is not below `len`.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, i: usize) -> T {
        let len = self.len; // a copy: a message that borrows from `self` would keep all of it in memory
        assert!(i < len, "index {i} of {len}");
        // SAFETY: i < len was just checked; `from_raw` vouches for the rest.
        unsafe { self.read(i) }
    }

    /// Returns the column of numbers `from .. to`.
    ///
    /// # Panics
    /// When they are not all inside, or `from` is beyond `to`.
    #[must_use]
    pub fn slice(self, from: usize, to: usize) -> Self {
        assert!(from <= to && to <= self.len, "numbers {from} .. {to} of {}", self.len);
        // Wrapping arithmetic needs no proof; the column is only read after its own checks.
        let start = self.start.wrapping_offset(from.cast_signed() * self.stride);
        Column { start, len: to - from, ..self }
    }

    /// Returns the same numbers as one piece of memory, if they are one. Of numbers that lie apart, which no level reads
    /// several at a time, most kernels have a copy for the baseline alone.
    #[inline(always)]
    #[must_use]
    pub fn dense(self) -> Option<Dense<'a, T>> {
        (self.stride == step::<T>() || self.len <= 1).then_some(Dense(self))
    }

    /// # Safety
    /// `i` must be below `len`.
    #[inline(always)]
    unsafe fn read(&self, i: usize) -> T {
        // SAFETY: the caller checked i < len, so by `from_raw` this is a readable T; alignment is not assumed.
        // The product cannot overflow: it is an offset inside one allocation.
        unsafe { self.start.offset(i.cast_signed() * self.stride).cast::<T>().read_unaligned() }
    }

    /// # Panics
    /// When numbers `at .. at + n` are not all inside.
    #[inline(always)]
    fn check(&self, at: usize, n: usize) {
        assert!(n <= self.len && at <= self.len - n, "lanes past the end");
    }
}

impl<T: Copy> Source<T> for Column<'_, T> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    fn lanes<const N: usize>(&self, at: usize) -> [T; N] {
        self.check(at, N);
        // SAFETY: at + lane < at + N <= len, just checked.
        std::array::from_fn(|lane| unsafe { self.read(at + lane) })
    }

    #[inline(always)]
    fn lanes_or<const N: usize>(&self, at: usize, fill: T) -> [T; N] {
        let mut numbers = [fill; N];
        for lane in 0..N {
            if at + lane < self.len {
                // SAFETY: at + lane < len, just checked.
                numbers[lane] = unsafe { self.read(at + lane) };
            }
        }
        numbers
    }
}

impl<T: Copy> Source<T> for Dense<'_, T> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len
    }

    #[inline(always)]
    fn lanes<const N: usize>(&self, at: usize) -> [T; N] {
        self.0.check(at, N);
        // SAFETY: at + N <= len was just checked, and `dense` checked that the numbers are one piece of memory.
        unsafe { self.0.start.add(at * size_of::<T>()).cast::<[T; N]>().read_unaligned() }
    }

    #[inline(always)]
    fn four_lanes<const N: usize>(&self, at: usize) -> [[T; N]; 4] {
        self.0.check(at, 4 * N);
        // SAFETY: at + 4 * N <= len was just checked, and `dense` checked that the numbers are one piece of memory.
        unsafe { self.0.start.add(at * size_of::<T>()).cast::<[[T; N]; 4]>().read_unaligned() }
    }

    #[inline(always)]
    fn lanes_or<const N: usize>(&self, at: usize, fill: T) -> [T; N] {
        self.0.lanes_or(at, fill)
    }
}

/// Records that begin with three numbers side by side, such as x, y and z. The fourth number is whatever follows.
#[derive(Clone, Copy, Debug)]
pub struct Records<'a, T>(Column<'a, T>);

impl<'a, T: Copy> Records<'a, T> {
    /// Returns three columns as records, if they lie like that.
    #[must_use]
    pub fn new([first, second, third]: [Column<'a, T>; 3]) -> Option<Self> {
        let side_by_side = |a: Column<'a, T>, b: Column<'a, T>| {
            b.start == a.start.wrapping_add(size_of::<T>()) && b.stride == a.stride && b.len == a.len
        };
        let forward = first.stride >= 3 * step::<T>();
        (side_by_side(first, second) && side_by_side(second, third) && forward).then_some(Records(first))
    }

    /// Whether `column` is the fourth number of each record, and as wide as the first three.
    #[must_use]
    pub fn continues_with<U>(&self, column: &Column<'a, U>) -> bool {
        size_of::<U>() == size_of::<T>()
            && column.start == self.0.start.wrapping_add(3 * size_of::<T>())
            && column.stride == self.0.stride
    }

    /// Returns the same records, read from the first, second or third number on.
    ///
    /// # Panics
    /// When `number` is not 0, 1 or 2.
    #[must_use]
    pub fn starting_at(self, number: usize) -> Self {
        assert!(number < 3, "records begin with three numbers");
        // One of the three columns that `new` found side by side; what is read of it rests on its own stride and
        // length.
        Records(Column { start: self.0.start.wrapping_add(number * size_of::<T>()), ..self.0 })
    }

    /// Returns the same records, if each begins where the fourth number of the one before ends.
    #[must_use]
    pub fn back_to_back(self) -> Option<BackToBack<'a, T>> {
        (self.0.stride == 4 * step::<T>()).then_some(BackToBack(self))
    }
}

/// [`Records`] of exactly four numbers without gaps, several of which are one load.
#[derive(Clone, Copy, Debug)]
pub struct BackToBack<'a, T>(Records<'a, T>);

/// Records read several at a time, by their first four numbers.
pub trait Fours<T>: Copy {
    /// How many records there are.
    fn records(&self) -> usize;
    /// How many records lie before the first one that starts a cache line; 0 if none does.
    fn unaligned(&self) -> usize {
        0
    }
    /// Returns the first four numbers of each of `M` times `N / 4` records from `at`. The last record of all must not
    /// be among them: there may be no memory behind its third number.
    ///
    /// # Panics
    /// When the records are not all before the last.
    fn fours<const N: usize, const M: usize>(&self, at: usize) -> [[T; N]; M];
}

impl<T: Copy> Fours<T> for BackToBack<'_, T> {
    #[inline(always)]
    fn records(&self) -> usize {
        self.0.0.len
    }

    fn unaligned(&self) -> usize {
        const LINE: usize = 64;
        let (record, short) = (4 * size_of::<T>(), self.0.0.start.addr().wrapping_neg() % LINE);
        if short.is_multiple_of(record) { short / record } else { 0 }
    }

    #[inline(always)]
    fn fours<const N: usize, const M: usize>(&self, at: usize) -> [[T; N]; M] {
        self.0.0.check(at, M * N / 4 + 1);
        // SAFETY: records at .. at + M * N / 4 are before the last, just checked, and lie back to back, four numbers
        // each (checked in `back_to_back`).
        unsafe { self.0.0.start.add(at * size_of::<T>() * 4).cast::<[[T; N]; M]>().read_unaligned() }
    }
}

impl<T: Copy> Fours<T> for Records<'_, T> {
    #[inline(always)]
    fn records(&self) -> usize {
        self.0.len
    }

    #[inline(always)]
    fn fours<const N: usize, const M: usize>(&self, at: usize) -> [[T; N]; M] {
        self.0.check(at, M * N / 4 + 1);
        let mut numbers = std::mem::MaybeUninit::<[[T; N]; M]>::uninit();
        for i in 0..M * N / 4 {
            // SAFETY: record at + i is not the last, and the stride is at least three numbers (checked in `new`): its
            // fourth number ends no later than the first number of the record after it, and `from_raw` vouches for all
            // bytes up to that. Four numbers fit at 4 * i in `numbers`, as i < M * N / 4.
            unsafe {
                let record = self.0.start.offset((at + i).cast_signed() * self.0.stride).cast::<[T; 4]>();
                numbers.as_mut_ptr().cast::<T>().add(4 * i).cast::<[T; 4]>().write_unaligned(record.read_unaligned());
            }
        }
        // SAFETY: N is a multiple of 4 (asserted at compile time), so every number has been written.
        unsafe {
            const { assert!(N.is_multiple_of(4)) };
            numbers.assume_init()
        }
    }
}

/// A view of `len` numbers to be written, `stride` bytes apart, at any alignment.
#[derive(Debug)]
pub struct ColumnMut<'a, T> {
    start: *mut u8,
    len: usize,
    stride: isize,
    memory: PhantomData<&'a mut [T]>,
}

// SAFETY: `from_raw` asks that nothing else writes the memory while the column lives.
unsafe impl<T: Send> Send for ColumnMut<'_, T> {}

impl<'a, T: Copy> ColumnMut<'a, T> {
    /// Makes a column over a slice.
    #[must_use]
    pub fn new(values: &'a mut [T]) -> Self {
        // SAFETY: a mutable slice is `len` writable values, `size_of::<T>()` apart, for its lifetime.
        unsafe { Self::from_raw(values.as_mut_ptr().cast(), values.len(), step::<T>()) }
    }

    /// Makes a column over raw memory.
    ///
    /// # Safety
    /// For every `i < len`, `start + i * stride` must be the address of `size_of::<T>()` writable bytes, and stay so
    /// for `'a`.
    #[must_use]
    pub unsafe fn from_raw(start: *mut u8, len: usize, stride: isize) -> Self {
        ColumnMut { start, len, stride, memory: PhantomData }
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the same column for a shorter time.
    #[must_use]
    pub fn reborrow(&mut self) -> ColumnMut<'_, T> {
        ColumnMut { memory: PhantomData, ..*self }
    }

    /// Returns the same numbers as one piece of memory, if they are one.
    #[must_use]
    pub fn dense(&mut self) -> Option<DenseMut<'_, T>> {
        (self.stride == step::<T>()).then_some(DenseMut(self.reborrow()))
    }

    /// Writes numbers `at .. at + N`, and drops those past the end.
    #[inline(always)]
    pub fn set_lanes<const N: usize>(&mut self, at: usize, values: [T; N]) {
        if at + N <= self.len && self.stride == step::<T>() {
            // SAFETY: at + N <= len and the numbers are one piece of memory, both checked just above.
            unsafe { self.start.add(at * size_of::<T>()).cast::<[T; N]>().write_unaligned(values) }
        } else {
            for (lane, value) in values.into_iter().enumerate().take(self.len.saturating_sub(at)) {
                let offset = (at + lane).cast_signed() * self.stride;
                // SAFETY: `take` keeps at + lane < len; `from_raw` vouches for the rest.
                unsafe { self.start.offset(offset).cast::<T>().write_unaligned(value) }
            }
        }
    }
}

/// A [`ColumnMut`] without gaps, to which lanes are one store.
#[derive(Debug)]
pub struct DenseMut<'a, T>(ColumnMut<'a, T>);

/// Numbers that a kernel writes several at a time.
pub trait Sink<T> {
    /// Writes numbers `at .. at + N`.
    ///
    /// # Panics
    /// When the output is dense and they are not all inside.
    fn put<const N: usize>(&mut self, at: usize, values: [T; N]);
    /// Writes numbers `at .. at + N`, and drops those past the end. It serves for the last few.
    fn put_last<const N: usize>(&mut self, at: usize, values: [T; N]);
}

impl<T: Copy> Sink<T> for ColumnMut<'_, T> {
    #[inline(always)]
    fn put<const N: usize>(&mut self, at: usize, values: [T; N]) {
        self.set_lanes(at, values);
    }

    #[inline(always)]
    fn put_last<const N: usize>(&mut self, at: usize, values: [T; N]) {
        self.set_lanes(at, values);
    }
}

impl<T: Copy> Sink<T> for DenseMut<'_, T> {
    #[inline(always)]
    fn put<const N: usize>(&mut self, at: usize, values: [T; N]) {
        assert!(N <= self.0.len && at <= self.0.len - N, "lanes past the end");
        // SAFETY: at + N <= len was just checked, and `dense` checked that the numbers are one piece of memory.
        unsafe { self.0.start.add(at * size_of::<T>()).cast::<[T; N]>().write_unaligned(values) }
    }

    #[inline(always)]
    fn put_last<const N: usize>(&mut self, at: usize, values: [T; N]) {
        self.0.set_lanes(at, values);
    }
}

/// Rows of numbers: a [`Column`] of columns. One scan is a table of one row.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a, T> {
    first: Column<'a, T>,
    rows: usize,
    row_stride: isize,
}

impl<'a, T: Copy> Table<'a, T> {
    /// Makes a table of one column.
    #[must_use]
    pub fn new(column: Column<'a, T>) -> Self {
        Table { first: column, rows: 1, row_stride: 0 }
    }

    /// Makes a table of `rows` columns like `first`, `row_stride` bytes apart.
    ///
    /// # Safety
    /// For every `row < rows`, `first` moved by `row * row_stride` bytes must be a column by the rules of
    /// [`Column::from_raw`].
    #[must_use]
    pub unsafe fn from_raw(first: Column<'a, T>, rows: usize, row_stride: isize) -> Self {
        Table { first, rows, row_stride }
    }

    /// Returns the same numbers in one row, if each row begins where the one before ends, else in the rows they have.
    #[must_use]
    pub fn flat(self) -> Self {
        let row = self.first.len.cast_signed() * self.first.stride;
        if self.rows > 1 && self.first.len > 0 && self.row_stride == row {
            Table { first: Column { len: self.first.len * self.rows, ..self.first }, rows: 1, row_stride: 0 }
        } else {
            self
        }
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// How many numbers there are in each row.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.first.len
    }

    /// Returns row `row`.
    ///
    /// # Panics
    /// When `row` is not below `rows`.
    #[inline(always)]
    #[must_use]
    pub fn row(&self, row: usize) -> Column<'a, T> {
        assert!(row < self.rows, "row {row} of {}", self.rows);
        // Wrapping arithmetic needs no proof; the column is only read after its own checks.
        Column { start: self.first.start.wrapping_offset(row.cast_signed() * self.row_stride), ..self.first }
    }
}

/// Rows of numbers to be written.
#[derive(Debug)]
pub struct TableMut<'a, T> {
    start: *mut u8,
    len: usize,
    stride: isize,
    rows: usize,
    row_stride: isize,
    memory: PhantomData<&'a mut [T]>,
}

// SAFETY: as for `ColumnMut`.
unsafe impl<T: Send> Send for TableMut<'_, T> {}

impl<T: Copy> TableMut<'_, T> {
    /// Makes a table of `rows` columns of `len` numbers, `stride` and `row_stride` bytes apart.
    ///
    /// # Safety
    /// Each row must be a column by the rules of [`ColumnMut::from_raw`].
    #[must_use]
    pub unsafe fn from_raw(start: *mut u8, (rows, len): (usize, usize), (row_stride, stride): (isize, isize)) -> Self {
        TableMut { start, len, stride, rows, row_stride, memory: PhantomData }
    }

    /// Returns row `row`.
    ///
    /// # Panics
    /// When `row` is not below the number of rows.
    #[must_use]
    pub fn row(&mut self, row: usize) -> ColumnMut<'_, T> {
        assert!(row < self.rows, "row {row} of {}", self.rows);
        let start = self.start.wrapping_offset(row.cast_signed() * self.row_stride);
        ColumnMut { start, len: self.len, stride: self.stride, memory: PhantomData }
    }
}

/// The stride of a slice.
const fn step<T>() -> isize {
    size_of::<T>().cast_signed()
}

#[cfg(test)]
mod tests {
    use super::{Column, ColumnMut, Sink, Source};

    #[test]
    fn packed_records_reversed_and_unaligned() {
        // Records of 5 bytes: a tag, then a float at an odd address.
        let bytes: Vec<u8> = (0..7u8).flat_map(|i| std::iter::once(0xff).chain(f32::from(i).to_ne_bytes())).collect();
        // SAFETY: seven floats, each inside `bytes`.
        let forward = unsafe { Column::<f32>::from_raw(bytes[1..].as_ptr(), 7, 5) };
        assert!(forward.dense().is_none());
        assert_eq!(forward.lanes_or::<4>(5, -1.0), [5.0, 6.0, -1.0, -1.0]);
        // SAFETY: the same floats, last first.
        let backward = unsafe { Column::<f32>::from_raw(bytes[31..].as_ptr(), 7, -5) };
        assert_eq!(backward.lanes::<4>(0), [6.0, 5.0, 4.0, 3.0]);
        assert_eq!(backward.get(6), 0.0);
    }

    #[test]
    fn writing_stops_at_the_end() {
        let mut out = [0.0_f64; 5];
        ColumnMut::new(&mut out).set_lanes(3, [1.0; 4]);
        assert_eq!(out, [0.0, 0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn a_dense_output_is_written_like_any_other() {
        let (mut out, mut packed) = ([0.0_f64; 6], [0.0_f64; 11]);
        let mut column = ColumnMut::new(&mut out);
        let mut dense = column.dense().unwrap();
        dense.put(0, [1.0, 2.0, 3.0, 4.0]);
        dense.put_last(4, [5.0, 6.0, 7.0, 8.0]);
        assert_eq!(out, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        // SAFETY: six floats, every second one of eleven.
        let mut apart = unsafe { ColumnMut::<f64>::from_raw(packed.as_mut_ptr().cast(), 6, 16) };
        assert!(apart.dense().is_none());
        apart.put_last(4, [5.0, 6.0, 7.0, 8.0]);
        assert_eq!(packed[8..], [5.0, 0.0, 6.0]);
    }

    #[test]
    #[should_panic = "lanes past the end"]
    fn a_dense_output_has_an_end() {
        ColumnMut::new(&mut [0.0_f32; 7]).dense().unwrap().put(4, [1.0; 4]);
    }

    #[test]
    fn a_slice_is_dense() {
        let values = [1.0_f32, 2.0, 3.0];
        let column = Column::new(&values);
        assert_eq!(column.dense().unwrap().lanes_or::<4>(0, 9.0), [1.0, 2.0, 3.0, 9.0]);
        assert_eq!(column.lanes::<2>(1), [2.0, 3.0]);
    }
}
