//! The time-to-collision of every beam, in the type of the ranges.

use super::reading::Rules;
use super::tables::Tables;
use crate::column::{ColumnMut, Source};
use crate::lanes::{LANES, Lanes, each};
use crate::real::Real;
use crate::simd::Kernel;
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
    fn run(mut self) {
        for group in 0..self.ranges.len().div_ceil(LANES) {
            let ranges: Lanes<T> = self.ranges.lanes(group * LANES, T::NAN);
            let readings = each(ranges, |r| self.rules.usable(r));
            let (cos, sin) = (&self.tables.cos[group], &self.tables.sin[group]);
            let offset = &self.tables.offset[group];
            let closing: Lanes<T> =
                std::array::from_fn(|lane| self.velocity.0 * cos[lane] + self.velocity.1 * sin[lane]);
            let clearance: Lanes<T> = std::array::from_fn(|lane| readings[lane] - offset[lane]);
            self.out.set_lanes(group * LANES, ttc(clearance, closing, self.min_closing_speed));
            if let Some(status_out) = self.status_out.as_mut() {
                let seen = each(ranges, |r| self.rules.observed(r));
                let status: Lanes<u8> = std::array::from_fn(|lane| {
                    let looked = !offset[lane].is_nan();
                    let closes = closing[lane] > self.min_closing_speed;
                    status(clearance[lane], closes, looked, seen[lane]) as u8
                });
                status_out.set_lanes(group * LANES, status);
            }
        }
    }
}

/// Clearance over closing speed: 0 in contact, infinite where the beam does not close or has no reading.
#[inline(always)]
pub(crate) fn ttc<T: Real>(clearance: Lanes<T>, closing: Lanes<T>, min_closing_speed: T) -> Lanes<T> {
    std::array::from_fn(|lane| {
        let ttc = clearance[lane] / closing[lane];
        let ttc = if clearance[lane] <= T::ZERO { T::ZERO } else { ttc };
        if (closing[lane] > min_closing_speed) & (ttc >= T::ZERO) { ttc } else { T::INFINITY }
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
