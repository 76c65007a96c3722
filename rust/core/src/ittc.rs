//! The bare formula over arrays: range over closing speed, element by element, in the type of the ranges.

use crate::column::{Column, ColumnMut, Source};
use crate::error::Error;
use crate::formula::ttc;
use crate::lanes::{LANES, Lanes, each, lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::status::Status;

/// A rate along each beam, with one of the two signs that are in use.
#[derive(Clone, Copy, Debug)]
pub enum Rate<V> {
    /// The closing speed: positive when approaching.
    ClosingSpeed(V),
    /// The range rate dr/dt: positive when opening.
    RangeRate(V),
}

/// One number for every beam, or one each.
#[derive(Clone, Copy, Debug)]
pub enum Speeds<'a, T> {
    /// All beams have this number.
    Same(T),
    /// Each beam has its own.
    Each(Column<'a, T>),
}

/// Writes the iTTC of each range into `out`, and what it means into `status_out`.
///
/// A range of +inf is free space, -inf a contact; NaN and negative ranges, and non-finite speeds, are invalid.
///
/// # Errors
/// When lengths differ.
pub fn ittc<'o, T: Real>(
    level: Level,
    ranges: Column<'_, T>,
    rate: Rate<Speeds<'_, T>>,
    min_closing_speed: T,
    out: &mut ColumnMut<'o, T>,
    status_out: Option<&mut ColumnMut<'o, u8>>,
) -> Result<(), Error> {
    let (argument, speeds, sign) = match rate {
        Rate::ClosingSpeed(speeds) => ("closing_speed", speeds, T::from_f64(1.0)),
        Rate::RangeRate(speeds) => ("range_rate", speeds, T::from_f64(-1.0)),
    };
    let expect = |argument, got: usize| {
        let n = ranges.len();
        if got == n { Ok(()) } else { Err(Error::new(argument, format!("must have {n} entries, got {got}"))) }
    };
    expect("out", out.len())?;
    status_out.as_ref().map_or(Ok(()), |status_out| expect("status_out", status_out.len()))?;
    match speeds {
        Speeds::Same(speed) => {
            let speeds = Repeat { value: speed, len: ranges.len() };
            each_beam(level, ranges, speeds, sign, min_closing_speed, out, status_out);
        }
        Speeds::Each(speeds) => {
            expect(argument, speeds.len())?;
            each_beam(level, ranges, speeds, sign, min_closing_speed, out, status_out);
        }
    }
    Ok(())
}

fn each_beam<'o, T: Real, V: Source<T>>(
    level: Level,
    ranges: Column<'_, T>,
    speeds: V,
    sign: T,
    min_closing_speed: T,
    out: &mut ColumnMut<'o, T>,
    status_out: Option<&mut ColumnMut<'o, u8>>,
) {
    match ranges.dense() {
        Some(ranges) => level.run(EachBeam { ranges, speeds, sign, min_closing_speed, out, status_out }),
        None => Level::BASELINE.run(EachBeam { ranges, speeds, sign, min_closing_speed, out, status_out }),
    }
}

/// The same number, `len` times.
#[derive(Clone, Copy)]
struct Repeat<T> {
    value: T,
    len: usize,
}

impl<T: Copy> Source<T> for Repeat<T> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    fn lanes<const N: usize>(&self, _: usize) -> [T; N] {
        [self.value; N]
    }

    #[inline(always)]
    fn lanes_or<const N: usize>(&self, _: usize, _: T) -> [T; N] {
        [self.value; N]
    }
}

struct EachBeam<'a, 'o, T, S, V> {
    ranges: S,
    speeds: V,
    sign: T,
    min_closing_speed: T,
    out: &'a mut ColumnMut<'o, T>,
    status_out: Option<&'a mut ColumnMut<'o, u8>>,
}

impl<T: Real, S: Source<T>, V: Source<T>> Kernel for EachBeam<'_, '_, T, S, V> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(mut self, _: I) {
        let whole = self.ranges.len() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            self.group(at, self.ranges.lanes(at), self.speeds.lanes(at));
        }
        if whole < self.ranges.len() {
            self.group(whole, self.ranges.lanes_or(whole, T::NAN), self.speeds.lanes_or(whole, T::NAN));
        }
    }
}

impl<T: Real, S, V> EachBeam<'_, '_, T, S, V> {
    #[inline(always)]
    fn group(&mut self, at: usize, ranges: Lanes<T>, speeds: Lanes<T>) {
        let ranges = each(ranges, sensible);
        let closing = each(speeds, |v| finite(v * self.sign));
        let least = self.min_closing_speed;
        let times: Lanes<T> = lanes(|lane| ttc(ranges[lane], closing[lane], least));
        self.out.set_lanes(at, times);
        if let Some(status_out) = self.status_out.as_mut() {
            let status: Lanes<u8> = lanes(|lane| status(ranges[lane], closing[lane], self.min_closing_speed) as u8);
            status_out.set_lanes(at, status);
        }
    }
}

/// Returns a range to compute with: 0 for -inf, which is a contact, and NaN for negative numbers.
#[inline(always)]
fn sensible<T: Real>(r: T) -> T {
    let r = if r == T::ZERO - T::INFINITY { T::ZERO } else { r };
    if r >= T::ZERO { r } else { T::NAN }
}

/// Returns a speed to compute with: NaN for infinities.
#[inline(always)]
fn finite<T: Real>(v: T) -> T {
    if (v < T::INFINITY) & (v > T::ZERO - T::INFINITY) { v } else { T::NAN }
}

#[inline(always)]
fn status<T: Real>(range: T, closing: T, min_closing_speed: T) -> Status {
    if range.is_nan() || closing.is_nan() {
        Status::Invalid
    } else if range <= T::ZERO {
        Status::Contact
    } else if range == T::INFINITY {
        Status::Clear
    } else if closing > min_closing_speed {
        Status::Closing
    } else {
        Status::NotClosing
    }
}
