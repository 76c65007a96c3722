//! What stands beside every time-to-collision.

/// What a time-to-collision means. The values are fixed; the largest that holds wins, except that
/// `Contact` outranks `TooFew`, and where one body is followed also what says that too little is known of its motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Status {
    /// Looked, and there is nothing to hit.
    Clear = 0,
    /// Something is there and does not come closer; the TTC is infinite.
    NotClosing = 1,
    /// Something comes closer.
    Closing = 2,
    /// Touching or inside the outline: 0 while closing, infinite while opening.
    Contact = 3,
    /// Fewer points than the estimator needs.
    TooFew = 4,
    /// Too few frames so far.
    WarmingUp = 5,
    /// The target was there and is not any more.
    Lost = 6,
    /// The newest data are too old.
    Stale = 7,
    /// Nothing valid was seen.
    NoData = 8,
    /// The input makes no sense.
    Invalid = 9,
}

impl Status {
    /// All of them, by value.
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
