//! Small helpers over arrays of lanes. All are inlined into the kernel that calls them.

/// How many numbers a kernel works on at once: one AVX-512 register of `f32`.
pub const LANES: usize = 16;

/// One group of lanes.
pub type Lanes<T> = [T; LANES];

/// Returns `f` of the number of each lane. `std::array::from_fn` is not inlined into large kernels.
#[inline(always)]
pub(crate) fn lanes<T: Copy + Default>(f: impl Fn(usize) -> T) -> Lanes<T> {
    let mut lanes = [T::default(); LANES];
    for lane in 0..LANES {
        lanes[lane] = f(lane);
    }
    lanes
}

/// Returns `f` of each lane.
#[inline(always)]
pub(crate) fn each<T: Copy, U: Copy + Default>(x: Lanes<T>, f: impl Fn(T) -> U) -> Lanes<U> {
    lanes(|lane| f(x[lane]))
}

/// Returns the smallest lane, compared in a fixed tree; no lane may be NaN.
#[inline(always)]
pub(crate) fn least<T: Copy + PartialOrd>(mut x: Lanes<T>) -> T {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            x[lane] = if x[lane + half] < x[lane] { x[lane + half] } else { x[lane] };
        }
        half /= 2;
    }
    x[0]
}

/// Returns the sum of all lanes, added in a fixed tree.
#[inline(always)]
pub(crate) fn sum(mut x: Lanes<f64>) -> f64 {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            x[lane] += x[lane + half];
        }
        half /= 2;
    }
    x[0]
}

/// Returns entries `at .. at + LANES` of a table.
///
/// # Panics
/// When they are past the end. Tables are [`padded`].
#[inline(always)]
pub(crate) fn window<T>(table: &[T], at: usize) -> &Lanes<T> {
    table[at..].first_chunk().expect("tables are padded to whole groups of lanes")
}

/// Returns a padded table as groups of lanes.
#[inline(always)]
pub(crate) fn groups<T>(table: &[T]) -> &[Lanes<T>] {
    table.as_chunks().0
}

/// Returns `table` with `fill` behind it, up to a whole number of groups of lanes.
pub(crate) fn padded<T: Copy>(table: impl ExactSizeIterator<Item = T>, fill: T) -> Vec<T> {
    let padding = table.len().next_multiple_of(LANES) - table.len();
    table.chain(std::iter::repeat_n(fill, padding)).collect()
}

/// Tables of one length, all 0 at first, that begin where cache lines do: where lanes cross lines, stores take twice as
/// long.
pub(crate) struct AlignedTables {
    numbers: Vec<f64>,
    /// The first number that counts.
    start: usize,
    len: usize,
}

impl AlignedTables {
    /// Makes `count` tables of `len` numbers, a whole number of groups of lanes.
    pub(crate) fn new(count: usize, len: usize) -> Self {
        const LINE: usize = 64;
        let numbers = vec![0.0; count * len + LINE / size_of::<f64>()];
        let start = numbers.as_ptr().align_offset(LINE);
        AlignedTables { numbers, start, len }
    }

    /// The tables, to be read.
    #[inline(always)]
    pub(crate) fn read<const N: usize>(&self) -> [&[f64]; N] {
        let mut tables = self.numbers[self.start..].chunks_exact(self.len);
        std::array::from_fn(|_| tables.next().expect("as many were made"))
    }

    /// The tables, to be written.
    #[inline(always)]
    pub(crate) fn write<const N: usize>(&mut self) -> [&mut [f64]; N] {
        let mut tables = self.numbers[self.start..].chunks_exact_mut(self.len);
        std::array::from_fn(|_| tables.next().expect("as many were made"))
    }
}
