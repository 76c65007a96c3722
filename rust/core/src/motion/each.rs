//! A formula of motion over arrays, element by element.

use crate::column::{Column, ColumnMut, Source};
use crate::error::Error;
use crate::lanes::LANES;
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::status::Status;

/// One number for every element, or one each.
#[derive(Clone, Copy, Debug)]
pub enum Operand<'a, T> {
    /// All elements have this number.
    Same(f64),
    /// Each element has its own.
    Each(Column<'a, T>),
}

impl<T: Real> Operand<'_, T> {
    #[inline(always)]
    fn lanes(&self, at: usize, whole: bool) -> [f64; LANES] {
        match self {
            Operand::Same(value) => [*value; LANES],
            Operand::Each(column) if whole => column.lanes(at).map(T::to_f64),
            Operand::Each(column) => column.lanes_or(at, T::NAN).map(T::to_f64),
        }
    }
}

/// Writes `formula` of each element into `out`, rounded to its type.
///
/// # Errors
/// When lengths differ.
pub fn each<T: Real, const N: usize>(
    level: Level,
    operands: [Operand<'_, T>; N],
    formula: impl Fn([f64; N]) -> f64 + Copy,
    out: &mut ColumnMut<'_, T>,
) -> Result<(), Error> {
    same_lengths(&operands, "out", out.len())?;
    level.run(Each { operands, formula: |x| T::from_f64(formula(x)), out });
    Ok(())
}

/// Writes the `status` of each element into `out`.
///
/// # Errors
/// When lengths differ.
pub fn each_status<T: Real, const N: usize>(
    level: Level,
    operands: [Operand<'_, T>; N],
    status: impl Fn([f64; N]) -> Status + Copy,
    out: &mut ColumnMut<'_, u8>,
) -> Result<(), Error> {
    same_lengths(&operands, "status_out", out.len())?;
    level.run(Each { operands, formula: |x| status(x) as u8, out });
    Ok(())
}

fn same_lengths<T: Real>(operands: &[Operand<'_, T>], argument: &'static str, len: usize) -> Result<(), Error> {
    let differs = |operand: &&Operand<'_, T>| matches!(operand, Operand::Each(column) if column.len() != len);
    operands
        .iter()
        .find(differs)
        .map_or(Ok(()), |_| Err(Error::new(argument, format!("must have as many entries as the arrays, got {len}"))))
}

struct Each<'a, 'b, 'o, T, U, F, const N: usize> {
    operands: [Operand<'a, T>; N],
    formula: F,
    out: &'b mut ColumnMut<'o, U>,
}

impl<T: Real, U: Copy, F: Fn([f64; N]) -> U + Copy, const N: usize> Kernel for Each<'_, '_, '_, T, U, F, N> {
    type Output = ();
    const AVX512: bool = false;

    #[inline(always)]
    fn run<I: Instructions>(self, _: I) {
        let len = self.out.len();
        for at in (0..len).step_by(LANES) {
            let operands = self.operands.each_ref().map(|operand| operand.lanes(at, at + LANES <= len));
            let element = |lane: usize| std::array::from_fn(|operand| operands[operand][lane]);
            self.out.set_lanes::<LANES>(at, std::array::from_fn(|lane| (self.formula)(element(lane))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Operand, each};
    use crate::column::{Column, ColumnMut};
    use crate::simd::Level;

    #[test]
    fn each_is_the_formula_at_every_level() {
        let values: Vec<f32> = (0..37_u8).map(f32::from).collect();
        for level in Level::all() {
            let mut out = vec![0.0_f32; 37];
            let operands = [Operand::Each(Column::new(&values)), Operand::Same(0.5)];
            each(level, operands, |[x, y]| x * y + 1.0, &mut ColumnMut::new(&mut out)).unwrap();
            assert!(out.iter().zip(&values).all(|(out, x)| *out == x * 0.5 + 1.0), "{level}");
        }
        let operands = [Operand::Each(Column::new(&values))];
        assert!(each(Level::BASELINE, operands, |[x]| x, &mut ColumnMut::new(&mut [0.0; 3])).is_err());
    }
}
