//! Point clouds in any layout: rows, records or columns, float32 or float64, organised or not, without a copy.
//!
//! A [`Points`] is a view of the memory of the caller. Kernels read it through a [`Layout`], sixteen points at a time
//! as lanes.

use crate::column::{Column, Fours, Records, Source, Table};
use crate::error::Error;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Prefilter, bit_of_each_point};
use std::ops::Range;

/// Points in the memory of the caller. An organised cloud has its own rows; any other cloud has one row.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a, T> {
    xyz: [Table<'a, T>; 3],
    intensity: Option<Intensity<'a>>,
}

/// Intensities in the type they are stored in.
#[derive(Clone, Copy, Debug)]
pub enum Intensity<'a> {
    /// Intensities in int8.
    I8(Table<'a, i8>),
    /// Intensities in uint8, as most drivers store them.
    U8(Table<'a, u8>),
    /// Intensities in int16.
    I16(Table<'a, i16>),
    /// Intensities in uint16, as for reflectivity.
    U16(Table<'a, u16>),
    /// Intensities in int32.
    I32(Table<'a, i32>),
    /// Intensities in uint32.
    U32(Table<'a, u32>),
    /// Intensities in float32.
    F32(Table<'a, f32>),
    /// Intensities in float64.
    F64(Table<'a, f64>),
}

/// Evaluates one expression with what an `Intensity` or an `IntensityRow` holds, whichever type that is. With
/// `=> Name: expression`, the result is that of the same type in the enum `Name`.
macro_rules! each_type {
    ($value:expr, $from:ident($inner:ident) => $result:expr) => {
        match $value {
            $from::I8($inner) => $result,
            $from::U8($inner) => $result,
            $from::I16($inner) => $result,
            $from::U16($inner) => $result,
            $from::I32($inner) => $result,
            $from::U32($inner) => $result,
            $from::F32($inner) => $result,
            $from::F64($inner) => $result,
        }
    };
    ($value:expr, $from:ident($inner:ident) => $into:ident: $result:expr) => {
        match $value {
            $from::I8($inner) => $into::I8($result),
            $from::U8($inner) => $into::U8($result),
            $from::I16($inner) => $into::I16($result),
            $from::U16($inner) => $into::U16($result),
            $from::I32($inner) => $into::I32($result),
            $from::U32($inner) => $into::U32($result),
            $from::F32($inner) => $into::F32($result),
            $from::F64($inner) => $into::F64($result),
        }
    };
}

impl<'a, T: Real> Points<'a, T> {
    /// A cloud from its stored columns, along whatever axes.
    ///
    /// # Errors
    /// When the columns differ in shape, or there are more points than 32 bits can number.
    #[inline(always)]
    pub fn new(xyz: [Table<'a, T>; 3], intensity: Option<Intensity<'a>>) -> Result<Self, Error> {
        let shape = |table: &Table<'_, T>| (table.rows(), table.columns());
        let [x, y, z] = &xyz;
        let alike = intensity.as_ref().is_none_or(|intensity| intensity.shape() == shape(x));
        if shape(x) != shape(y) || shape(y) != shape(z) || !alike {
            return Err(Error::new("points", "must have columns of equal shape"));
        }
        if u32::try_from(x.rows() * x.columns()).is_err() {
            return Err(Error::new("points", format!("must be fewer than 2^32, got {}", x.rows() * x.columns())));
        }
        let points = Points { xyz, intensity };
        Ok(if points.count() == 1 { points } else { points.flat() })
    }

    /// The same points in one row, if the memory of all rows is one piece.
    fn flat(self) -> Self {
        let flat = Points { xyz: self.xyz.map(Table::flat), intensity: self.intensity.map(Intensity::flat) };
        let is_one = flat.xyz.iter().all(|table| table.rows() == 1)
            && flat.intensity.as_ref().is_none_or(|intensity| intensity.shape().0 == 1);
        if is_one { flat } else { self }
    }

    /// A batch of clouds, one in each row, which stay apart.
    ///
    /// # Errors
    /// When the columns differ in shape, or there are more points than 32 bits can number.
    pub fn batch(xyz: [Table<'a, T>; 3]) -> Result<Self, Error> {
        Points::new(xyz, None).map(|points| Points { xyz, ..points })
    }

    /// The number of rows.
    #[must_use]
    pub fn count(&self) -> usize {
        self.xyz[0].rows()
    }

    /// The columns x, y and z of row `row`, as stored.
    #[inline(always)]
    pub(crate) fn xyz(&self, row: usize) -> [Column<'a, T>; 3] {
        let [x, y, z] = &self.xyz;
        [x.row(row), y.row(row), z.row(row)]
    }

    /// The number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.xyz[0].rows() * self.xyz[0].columns()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether points have an intensity.
    #[must_use]
    pub fn has_intensity(&self) -> bool {
        self.intensity.is_some()
    }

    /// Takes the rows of the points in `range`, cut where the range begins and ends, each with the index of its first
    /// point; with their intensities only if those are asked for.
    #[inline(always)]
    pub(crate) fn each_row(&self, range: Range<usize>, intensity: bool, mut take: impl FnMut(usize, &Row<'a, T>)) {
        let columns = self.xyz[0].columns();
        let stored = if intensity { self.intensity.as_ref() } else { None };
        let whole = |row| Row { xyz: self.xyz(row), intensity: stored.map(|intensity| intensity.row(row)) };
        if self.xyz[0].rows() == 1 && range.len() == columns {
            return take(0, &whole(0));
        }
        for row in range.start / columns.max(1)..range.end.div_ceil(columns.max(1)) {
            let first = row * columns;
            let (from, to) = (range.start.max(first) - first, range.end.min(first + columns) - first);
            take(first + from, &whole(row).slice(from, to));
        }
    }

    /// Whether any point is valid: finite, and not the (0, 0, 0) that drivers store where nothing came back.
    pub(crate) fn any_valid(&self) -> bool {
        let finite = |value: T| value.to_f64().is_finite();
        (0..self.len()).map(|i| self.get(i)).any(|point| point.into_iter().all(finite) && point != [T::ZERO; 3])
    }

    /// Point `i`, as stored.
    pub(crate) fn get(&self, i: usize) -> [T; 3] {
        let columns = self.xyz[0].columns();
        let (row, column) = if i < columns { (0, i) } else { (i / columns, i % columns) };
        self.xyz(row).map(|stored| stored.get(column))
    }
}

impl<'a, T: Real> Row<'a, T> {
    /// The points `from .. to` of the row.
    fn slice(self, from: usize, to: usize) -> Row<'a, T> {
        let intensity = self
            .intensity
            .map(|intensity| each_type!(intensity, IntensityRow(column) => IntensityRow: column.slice(from, to)));
        Row { xyz: self.xyz.map(|column| column.slice(from, to)), intensity }
    }

    /// Does the work on the layout of the row, of which column `ahead` is forward.
    #[inline(always)]
    pub(crate) fn in_layout(&self, ahead: usize, work: impl OnLayout<T>) {
        if let Some(records) = Records::new(self.xyz) {
            let fourth = self.intensity.is_some_and(|it| it.is_fourth(&records));
            let forward = records.starting_at(ahead);
            if let (Some(records), Some(forward)) = (records.back_to_back(), forward.back_to_back()) {
                work.run(Packed { records, forward, fourth });
            } else {
                work.run(Packed { records, forward, fourth });
            }
        } else if let [Some(x), Some(y), Some(z)] = self.xyz.map(Column::dense) {
            let xyz = [x, y, z];
            work.run(Columns { xyz, forward: xyz[ahead] });
        } else {
            work.run(Columns { xyz: self.xyz, forward: self.xyz[ahead] });
        }
    }
}

impl<'a> Intensity<'a> {
    #[inline(always)]
    fn shape(&self) -> (usize, usize) {
        each_type!(self, Intensity(table) => (table.rows(), table.columns()))
    }

    fn flat(self) -> Self {
        each_type!(self, Intensity(table) => Intensity: table.flat())
    }

    #[inline(always)]
    fn row(&self, row: usize) -> IntensityRow<'a> {
        each_type!(self, Intensity(table) => IntensityRow: table.row(row))
    }
}

/// One row of a cloud.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a, T> {
    pub xyz: [Column<'a, T>; 3],
    pub intensity: Option<IntensityRow<'a>>,
}

/// Intensities of one row.
#[derive(Clone, Copy)]
pub(crate) enum IntensityRow<'a> {
    I8(Column<'a, i8>),
    U8(Column<'a, u8>),
    I16(Column<'a, i16>),
    U16(Column<'a, u16>),
    I32(Column<'a, i32>),
    U32(Column<'a, u32>),
    F32(Column<'a, f32>),
    F64(Column<'a, f64>),
}

impl<'a> IntensityRow<'a> {
    /// Whether the intensity is the fourth number of each record, in the type of the first three.
    pub(crate) fn is_fourth<T: Real>(&self, records: &Records<'a, T>) -> bool {
        match self {
            IntensityRow::F32(column) => records.continues_with(column),
            IntensityRow::F64(column) => records.continues_with(column),
            _ => false,
        }
    }

    /// Whether the intensity of point `i` lies in `[low, high]`, with bounds rounded to its own type if that is a
    /// float.
    #[inline(always)]
    pub(crate) fn within(&self, i: usize, (low, high): (f64, f64)) -> bool {
        let inside = |value: f64, low: f64, high: f64| low <= value && value <= high;
        match self {
            IntensityRow::I8(column) => inside(f64::from(column.get(i)), low, high),
            IntensityRow::U8(column) => inside(f64::from(column.get(i)), low, high),
            IntensityRow::I16(column) => inside(f64::from(column.get(i)), low, high),
            IntensityRow::U16(column) => inside(f64::from(column.get(i)), low, high),
            IntensityRow::I32(column) => inside(f64::from(column.get(i)), low, high),
            IntensityRow::U32(column) => inside(f64::from(column.get(i)), low, high),
            IntensityRow::F32(column) => {
                inside(column.get(i).to_f64(), f32::from_f64(low).to_f64(), f32::from_f64(high).to_f64())
            }
            IntensityRow::F64(column) => inside(column.get(i), low, high),
        }
    }
}

/// A layout of points, which a kernel reads several at a time, as lanes to compare with bounds.
pub(crate) trait Layout<T>: Copy {
    /// The bounds in the arrangement of the lanes.
    type Bounds: Copy;
    /// Arranges the bounds on each stored column: x, y, z, and the fourth number of a record.
    fn bounds(low: [T; 4], high: [T; 4]) -> Self::Bounds;
    /// The number of points, from the first on, that can be read as lanes.
    fn readable(&self) -> usize;
    /// The readable points that are read fastest, in whole groups of lanes.
    fn whole(&self) -> Range<usize>;
    /// Whether the fourth number of each record is compared with its bounds too.
    fn compares_fourth(&self) -> bool {
        false
    }
    /// Arranges the bounds for `may_hold`.
    fn prefilter(&self, low: [T; 4], high: [T; 4]) -> Prefilter<T>;
    /// Whether any of the points `at .. at + LANES` may be inside. A no is certain, and quicker to find out than a yes.
    fn may_hold<I: Instructions>(&self, simd: I, at: usize, prefilter: &Prefilter<T>) -> bool;
    /// A bit for each of the points `at .. at + LANES` inside the bounds.
    fn inside<I: Instructions>(&self, simd: I, at: usize, bounds: &Self::Bounds) -> u16;
    /// The forward coordinates of the points `at .. at + LANES`.
    fn forward(&self, at: usize) -> Lanes<T>;
    /// The coordinates of the points `at .. at + LANES`, as stored.
    fn xyz(&self, at: usize) -> [Lanes<T>; 3];
}

/// Work on the points of a row in their layout.
pub(crate) trait OnLayout<T> {
    /// Does the work.
    fn run<L: Layout<T>>(self, layout: L);
}

/// Points whose columns lie anywhere.
#[derive(Clone, Copy)]
pub(crate) struct Columns<S> {
    pub xyz: [S; 3],
    pub forward: S,
}

impl<T: Real, S: Source<T>> Layout<T> for Columns<S> {
    type Bounds = [[[T; LANES]; 2]; 3];

    fn bounds(low: [T; 4], high: [T; 4]) -> Self::Bounds {
        std::array::from_fn(|column| [[low[column]; LANES], [high[column]; LANES]])
    }

    #[inline(always)]
    fn readable(&self) -> usize {
        self.xyz[0].len()
    }

    #[inline(always)]
    fn whole(&self) -> Range<usize> {
        0..self.readable() / LANES * LANES
    }

    fn prefilter(&self, _: [T; 4], _: [T; 4]) -> Prefilter<T> {
        Prefilter { shift: [T::ZERO; LANES], width: [T::ALL_BITS; LANES] }
    }

    #[inline(always)]
    fn may_hold<I: Instructions>(&self, _: I, _: usize, _: &Prefilter<T>) -> bool {
        true
    }

    #[inline(always)]
    fn inside<I: Instructions>(&self, simd: I, at: usize, bounds: &Self::Bounds) -> u16 {
        let [x, y, z] = &self.xyz;
        let [[x_low, x_high], [y_low, y_high], [z_low, z_high]] = bounds;
        T::within(simd, &x.lanes(at), x_low, x_high)
            & T::within(simd, &y.lanes(at), y_low, y_high)
            & T::within(simd, &z.lanes(at), z_low, z_high)
    }

    #[inline(always)]
    fn forward(&self, at: usize) -> Lanes<T> {
        self.forward.lanes(at)
    }

    #[inline(always)]
    fn xyz(&self, at: usize) -> [Lanes<T>; 3] {
        let [x, y, z] = &self.xyz;
        [x.lanes(at), y.lanes(at), z.lanes(at)]
    }
}

/// Points that are records: x, y and z side by side, then perhaps an intensity of the same type.
///
/// Sixteen numbers are four points. All are compared at once, each with the bounds of its column; then the four bits of
/// each of sixteen points are folded into one.
#[derive(Clone, Copy)]
pub(crate) struct Packed<F> {
    pub records: F,
    /// The records from their forward number on.
    pub forward: F,
    /// Whether the fourth number of each record is compared as well.
    pub fourth: bool,
}

impl<T: Real, F: Fours<T>> Layout<T> for Packed<F> {
    type Bounds = [[T; LANES]; 2];

    fn bounds(low: [T; 4], high: [T; 4]) -> Self::Bounds {
        [std::array::from_fn(|lane| low[lane % 4]), std::array::from_fn(|lane| high[lane % 4])]
    }

    #[inline(always)]
    fn readable(&self) -> usize {
        // The last record may end before its fourth number would.
        self.records.records().saturating_sub(1)
    }

    #[inline(always)]
    fn whole(&self) -> Range<usize> {
        let readable = self.readable();
        let first = self.records.unaligned().min(readable);
        first..first + (readable - first) / LANES * LANES
    }

    #[inline(always)]
    fn compares_fourth(&self) -> bool {
        self.fourth
    }

    #[inline(always)]
    fn prefilter(&self, low: [T; 4], high: [T; 4]) -> Prefilter<T> {
        let columns: [(T, T); 4] = std::array::from_fn(|column| {
            let (shift, width) = (T::ZERO - low[column], high[column] - low[column]);
            let is_bound = (self.fourth || column < 3) && low[column].to_f64().is_finite();
            if is_bound { (shift, width) } else { (T::ZERO, T::ALL_BITS) }
        });
        Prefilter {
            shift: std::array::from_fn(|lane| columns[lane % 4].0),
            width: std::array::from_fn(|lane| columns[lane % 4].1),
        }
    }

    #[inline(always)]
    fn may_hold<I: Instructions>(&self, simd: I, at: usize, prefilter: &Prefilter<T>) -> bool {
        T::may_pass(simd, &self.records.fours(at), prefilter)
    }

    #[inline(always)]
    fn inside<I: Instructions>(&self, simd: I, at: usize, [low, high]: &Self::Bounds) -> u16 {
        // Spelled out: through a closure the instructions behind `simd` would not be inlined.
        let [a, b, c, d] = self.records.fours(at);
        let mut bits = u64::from(T::within(simd, &d, low, high));
        bits = bits << 16 | u64::from(T::within(simd, &c, low, high));
        bits = bits << 16 | u64::from(T::within(simd, &b, low, high));
        bits = bits << 16 | u64::from(T::within(simd, &a, low, high));
        bit_of_each_point(if self.fourth { bits } else { bits | 0x8888_8888_8888_8888 })
    }

    #[inline(always)]
    fn forward(&self, at: usize) -> Lanes<T> {
        let fours: [Lanes<T>; 4] = self.forward.fours(at);
        let mut first = [T::ZERO; LANES];
        for i in 0..LANES {
            first[i] = fours[i / 4][i % 4 * 4];
        }
        first
    }

    #[inline(always)]
    fn xyz(&self, at: usize) -> [Lanes<T>; 3] {
        let fours: [Lanes<T>; 4] = self.records.fours(at);
        let mut xyz = [[T::ZERO; LANES]; 3];
        for column in 0..3 {
            for i in 0..LANES {
                xyz[column][i] = fours[i / 4][i % 4 * 4 + column];
            }
        }
        xyz
    }
}
