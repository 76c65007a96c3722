//! Pairs that a pass leaves to be decided one by one.

use super::matches::Matches;
use super::pairs::{Group, Rule};
use super::strips::Part;
use crate::real::Real;
use std::cell::Cell;

/// Pairs to be decided, by groups of lanes.
///
/// Memory is there from the beginning: a call in the loop that might ask for more would cost it all its registers.
pub(super) struct Undecided {
    /// The first `used` of these are groups.
    words: Vec<u64>,
    used: usize,
    room: usize,
    overflown: bool,
}

thread_local! {
    /// The memory of the last time: to get new pages from the system takes as long as a pass over a thousand matches.
    static KEPT: Cell<Vec<u64>> = const { Cell::new(Vec::new()) };
}

/// More memory than this is not kept, in words.
const MOST_KEPT: usize = 1 << 16;

impl Drop for Undecided {
    fn drop(&mut self) {
        if self.words.len() <= MOST_KEPT {
            KEPT.set(std::mem::take(&mut self.words));
        }
    }
}

impl Undecided {
    /// For the groups of a part, or for so many of them and those of one strip.
    pub(super) fn new(part: &Part, matches: usize, room: usize) -> Self {
        let (all, of_strip) = part.most_groups(matches);
        let least = all.min(room.saturating_add(of_strip)) + 1;
        let mut words = KEPT.take();
        if words.len() < least {
            words.resize(least, 0);
        }
        Undecided { words, used: 0, room, overflown: false }
    }

    /// Note some of the lanes from match `j` on beside match `i`.
    #[inline(always)]
    pub(super) fn note(&mut self, i: usize, j: usize, bits: u16) {
        self.words[self.used] = Group::new(i, j, bits).0;
        self.used += usize::from(bits != 0);
    }

    /// At the end of a strip: whether there were too many. They are all forgotten then.
    #[inline(always)]
    pub(super) fn is_overflown(&mut self) -> bool {
        if self.used > self.room {
            (self.used, self.overflown) = (0, true);
        }
        self.overflown
    }

    /// The quotients of those that count, in float64.
    pub(super) fn decided<T: Real>(&self, matches: &Matches<T>, rule: Rule) -> Vec<f64> {
        let groups = &self.words[..self.used];
        let pairs: usize = groups.iter().map(|word| Group(*word).len()).sum();
        let mut quotients = vec![0.0; pairs + 1];
        let mut used = 0;
        for word in groups {
            Group(*word).for_each(|i, j| {
                // Written whether it counts or not: which do is not to be guessed.
                let (quotient, counts) = rule.quotient(matches, i, j);
                quotients[used] = quotient;
                used += usize::from(counts);
            });
        }
        quotients.truncate(used);
        quotients
    }
}
