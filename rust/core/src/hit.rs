//! Which beam or point is hit first, and how many of each kind a scan or a cloud has.

/// A beam or a point, and its time-to-collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Time-to-collision, s; infinite without one.
    pub ttc: f64,
    /// The place of the beam in its scan, or of the point in its cloud.
    pub index: usize,
}

impl Hit {
    /// No hit at all.
    pub(crate) const NONE: Hit = Hit { ttc: f64::INFINITY, index: usize::MAX };

    /// Whether it ever comes.
    #[inline(always)]
    pub(crate) fn closes(&self) -> bool {
        self.ttc < f64::INFINITY
    }

    /// Whether it is earlier than the other, or as early at a lower index.
    #[inline(always)]
    pub(crate) fn precedes(&self, other: &Hit) -> bool {
        self.ttc < other.ttc || (self.ttc == other.ttc && self.index < other.index)
    }

    /// This one if it comes at all and precedes the other, else the other.
    #[inline(always)]
    pub(crate) fn or(self, other: Hit) -> Hit {
        if self.closes() && self.precedes(&other) { self } else { other }
    }

    /// The order of `precedes`, for sorting.
    pub(crate) fn order(&self, other: &Hit) -> std::cmp::Ordering {
        self.ttc.total_cmp(&other.ttc).then(self.index.cmp(&other.index))
    }
}

/// How often each case of a reading occurred in one scan. The first seven count every beam once; `contact` is apart.
///
/// The points of a cloud have only `valid`, `invalid` and `contact`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Valid readings within the user's limits.
    pub valid: u32,
    /// Readings that are NaN.
    pub invalid: u32,
    /// Readings of -inf: an object is nearer than `range_min`.
    pub too_close: u32,
    /// Readings of +inf: free space was observed.
    pub no_return: u32,
    /// Finite readings outside the sensor's `[range_min, range_max]`, which are discarded.
    pub out_of_range: u32,
    /// Valid readings beyond the user's far limit.
    pub beyond_limits: u32,
    /// Beams ignored because of `mask`, or because they look at the vehicle itself.
    pub masked: u32,
    /// Readings inside the outline.
    pub contact: u32,
}
