//! The scans that a rate is fitted to.

use std::collections::VecDeque;

/// How many beams are worked on at once. So many that compilers make loops over them, which they turn into lanes better than
/// straight code of this length, and so few that everything that is summed up for them stays near the processor.
pub(super) const GROUP: usize = 64;

/// One group of beams.
pub(super) type Group = [f64; GROUP];

/// A scan that is remembered.
#[derive(Clone, Debug)]
pub(super) struct Remembered {
    /// When it was taken, s.
    pub stamp: f64,
    /// How far the vehicle had turned since the first scan of the history, rad.
    pub heading: f64,
    /// What was measured, m; NaN where nothing was, and in the padding.
    pub readings: Vec<f64>,
}

/// A scan as it looks in the directions in which the beams point now.
#[derive(Clone, Copy)]
pub(super) struct Past<'a> {
    /// How long ago it was, s.
    pub age: f64,
    /// In whole groups.
    pub readings: &'a [f64],
}

/// The last scans, the newest first.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    scans: VecDeque<Remembered>,
    spare: Option<Vec<f64>>,
}

impl History {
    pub(super) fn newest(&self) -> Option<&Remembered> {
        self.scans.front()
    }

    /// From the newest to the oldest.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &Remembered> + ExactSizeIterator {
        self.scans.iter()
    }

    /// Forget what is older than `window` at `stamp`, and enough to leave room for one of at most `most` scans.
    pub(super) fn forget(&mut self, stamp: f64, window: f64, most: usize) {
        while self.scans.back().is_some_and(|scan| stamp - scan.stamp > window || self.scans.len() >= most) {
            self.spare = self.scans.pop_back().map(|scan| scan.readings);
        }
    }

    /// Memory for the readings of the next scan, empty.
    pub(super) fn memory(&mut self) -> Vec<f64> {
        let mut readings = self.spare.take().unwrap_or_default();
        readings.clear();
        readings
    }

    pub(super) fn remember(&mut self, scan: Remembered) {
        self.scans.push_front(scan);
    }

    pub(super) fn clear(&mut self) {
        self.scans.clear();
    }
}

/// Readings `at ..` of a padded scan.
#[inline(always)]
pub(super) fn group(readings: &[f64], at: usize) -> &Group {
    readings[at..].first_chunk().expect("readings are padded to whole groups")
}
