//! The time-to-collision of every beam, in the type of the ranges.

use super::reading::Rules;
use super::tables::Tables;
use crate::column::{ColumnMut, Source};
use crate::lanes::{LANES, Lanes, each, window};
use crate::real::Real;
use crate::simd::{Instructions, Kernel};
use crate::status::Status;

/// Writes one time-to-collision, and optionally one status, for each beam.
pub(super) struct PerBeam<'a, 'o, T, S> {
    pub ranges: S,
    pub rules: Rules<T>,
    pub tables: &'a Tables<T>,
    pub velocity: (T, T),
    pub min_closing_speed: T,
    pub out: &'a mut ColumnMut<'o, T>,
    pub status_out: Option<&'a mut ColumnMut<'o, u8>>,
}

impl<T: Real, S: Source<T>> Kernel for PerBeam<'_, '_, T, S> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(mut self, _: I) {
        let whole = self.ranges.len() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            self.group(at, self.ranges.lanes(at));
        }
        if whole < self.ranges.len() {
            self.group(whole, self.ranges.lanes_or(whole, T::NAN));
        }
    }
}

impl<T: Real, S> PerBeam<'_, '_, T, S> {
    #[inline(always)]
    fn group(&mut self, at: usize, ranges: Lanes<T>) {
        let readings = each(ranges, |r| self.rules.usable(r));
        let (cos, sin) = (window(&self.tables.cos, at), window(&self.tables.sin, at));
        let offset = window(&self.tables.offset, at);
        let closing: Lanes<T> = std::array::from_fn(|lane| self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane]);
        let clearance: Lanes<T> = std::array::from_fn(|lane| readings[lane] - offset[lane]);
        self.out.set_lanes(at, ttc(clearance, closing, self.min_closing_speed));
        if let Some(status_out) = self.status_out.as_mut() {
            let seen = each(ranges, |r| self.rules.observed(r));
            let status: Lanes<u8> = std::array::from_fn(|lane| {
                let looked = !offset[lane].is_nan();
                let closes = closing[lane] > self.min_closing_speed;
                status(clearance[lane], closes, looked, seen[lane]) as u8
            });
            status_out.set_lanes(at, status);
        }
    }
}

/// Clearance over closing speed: 0 in contact, infinite where the beam does not close or has no reading.
#[inline(always)]
pub(crate) fn ttc<T: Real>(clearance: Lanes<T>, closing: Lanes<T>, min_closing_speed: T) -> Lanes<T> {
    std::array::from_fn(|lane| {
        let ttc = clearance[lane] / closing[lane];
        let ttc = if clearance[lane] <= T::ZERO { T::ZERO } else { ttc };
        let ttc = if closing[lane] > min_closing_speed { ttc } else { T::INFINITY };
        if ttc >= T::ZERO { ttc } else { T::INFINITY }
    })
}

#[inline(always)]
fn status<T: Real>(clearance: T, closes: bool, looked: bool, seen: bool) -> Status {
    if !looked {
        Status::NoData
    } else if clearance <= T::ZERO {
        Status::Contact
    } else if clearance > T::ZERO {
        if closes { Status::Closing } else { Status::NotClosing }
    } else if seen {
        Status::Clear
    } else {
        Status::Invalid
    }
}
