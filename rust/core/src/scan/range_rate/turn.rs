//! Old scans in the directions in which the beams point now.

use super::history::{GROUP, Group};
use crate::simd::{Instructions, Kernel};

/// How far the beams have turned since a scan: so many whole beams, and part of one.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    whole: isize,
    part: f64,
}

impl Turn {
    /// `None` when none of the directions of then is left among those of now.
    pub(super) fn new(turned: f64, increment: f64, beams: usize) -> Option<Self> {
        let shift = turned / increment;
        let whole = shift.floor();
        #[allow(clippy::cast_possible_truncation, reason = "a whole number, not above the number of beams")]
        (shift.abs() <= beams as f64).then_some(Turn { whole: whole as isize, part: shift - whole })
    }
}

/// Writes what a scan measured where the beams point now. Between two beams on one surface, on the line between them; where
/// they are farther apart than `edge`, at the nearer of the two; NaN where it did not look.
pub(super) struct Turned<'a> {
    pub readings: &'a [f64],
    pub turn: Turn,
    pub edge: f64,
    pub out: &'a mut [f64],
}

impl Kernel for Turned<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        let Turn { whole, part } = self.turn;
        for (at, out) in self.out.chunks_exact_mut(GROUP).enumerate() {
            let at = (at * GROUP).cast_signed() + whole;
            let (first, second) = (anywhere(self.readings, at), anywhere(self.readings, at + 1));
            let between: Group = std::array::from_fn(|lane| {
                let apart = second[lane] - first[lane];
                let nearer = if part < 0.5 { first[lane] } else { second[lane] };
                if apart.abs() <= self.edge { first[lane] + part * apart } else { nearer }
            });
            out.copy_from_slice(&between);
        }
    }
}

/// Readings from `at`, which may be outside the scan: NaN there.
#[inline(always)]
fn anywhere(readings: &[f64], at: isize) -> Group {
    let reading = |at: isize| usize::try_from(at).ok().and_then(|at| readings.get(at).copied()).unwrap_or(f64::NAN);
    let inside = usize::try_from(at).ok().and_then(|at| readings.get(at..)?.first_chunk());
    inside.copied().unwrap_or_else(|| std::array::from_fn(|lane| reading(at + lane.cast_signed())))
}
