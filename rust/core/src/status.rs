//! The status that stands beside every time-to-collision.

/// What a time-to-collision means. The values are fixed. Of several that hold, the largest wins, except that `Contact`
/// outranks `TooFew`, and, where one body is tracked, also the statuses which say that too little is known of its
/// motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Status {
    /// The sensor looked, and there is nothing to hit.
    Clear = 0,
    /// Something is there and does not come closer; the TTC is infinite.
    NotClosing = 1,
    /// Something comes closer.
    Closing = 2,
    /// Something touches the outline or is inside; the TTC is 0 while it closes and infinite while it opens.
    Contact = 3,
    /// There are fewer points than the estimator needs, or fewer beams than the vote.
    TooFew = 4,
    /// There were too few frames so far, or the first ones contradict each other.
    WarmingUp = 5,
    /// The target was there, and is not seen any more.
    Lost = 6,
    /// The newest data are too old.
    Stale = 7,
    /// Nothing valid was seen.
    NoData = 8,
    /// The input makes no sense.
    Invalid = 9,
}

impl Status {
    /// All statuses, by value.
    pub const ALL: [Status; 10] = [
        Status::Clear,
        Status::NotClosing,
        Status::Closing,
        Status::Contact,
        Status::TooFew,
        Status::WarmingUp,
        Status::Lost,
        Status::Stale,
        Status::NoData,
        Status::Invalid,
    ];
}
