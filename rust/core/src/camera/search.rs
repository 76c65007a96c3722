//! What a search for the median is about.

use super::matches::Matches;
use super::pairs::Rule;
use super::tiles::Places;
use crate::simd::Level;

/// Matches, which of their pairs count, and how to work.
pub(super) struct Search<'m, T> {
    /// In an order that samples may be taken from.
    pub sampled: &'m Matches<T>,
    /// In an order that lets blocks be left out, if `places` says where they are.
    pub matches: &'m Matches<T>,
    pub places: &'m [Places<T>],
    pub rule: Rule,
    pub level: Level,
    pub threads: usize,
}
