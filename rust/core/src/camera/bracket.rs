//! Two values that what is looked for should lie between.

/// The order statistics that the median is the mean of: one for an odd count, two for an even one. Ranks count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Middle {
    pub low: usize,
    pub high: usize,
}

impl Middle {
    /// Of so many values, at least one.
    pub(super) fn of(count: usize) -> Self {
        Middle { low: (count - 1) / 2, high: count / 2 }
    }
}

/// What quotients, which are at least 0, can be put in order by: their bits, which is quicker than by value.
#[inline(always)]
#[allow(clippy::trivially_copy_pass_by_ref, reason = "a key function gets a reference")]
pub(super) fn in_order(quotient: &f64) -> u64 {
    quotient.to_bits()
}

/// Two values, either of which may be among those looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bracket {
    pub low: f64,
    pub high: f64,
}

impl Bracket {
    /// What any quotient lies between.
    pub(super) const ALL: Bracket = Bracket { low: 0.0, high: f64::INFINITY };

    /// Around where the middle of all should be, by a sample of which so many lie below and above the `inside` ones.
    ///
    /// `deviations` is how wide, in standard deviations of the rank of a sample's median. Ends that the sample says nothing
    /// about stay as they are.
    pub(super) fn around(self, inside: &mut [f64], below: usize, above: usize, deviations: f64) -> Self {
        let count = below + inside.len() + above;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number above 0")]
        let margin = (deviations * 0.5 * (count as f64).sqrt()).ceil() as usize;
        let low = (count / 2).checked_sub(margin + below);
        let high = (count / 2 + margin).checked_sub(below).filter(|high| *high < inside.len());
        let mut narrow = self;
        if let Some(high) = high {
            narrow.high = *inside.select_nth_unstable_by_key(high, in_order).1;
        }
        if let Some(low) = low.filter(|low| *low < inside.len()) {
            // Those up to `high` are in front now.
            let front = high.map_or(inside.len(), |high| high + 1);
            narrow.low = *inside[..front.max(low + 1)].select_nth_unstable_by_key(low, in_order).1;
        }
        narrow
    }

    /// Whether a value is inside, ends included.
    pub(super) fn holds(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}
