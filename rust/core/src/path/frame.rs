//! Where points come from: the rows of a cloud, or what else gives points in the vehicle frame.

use super::sweep::Sweep;
use crate::column::{Column, Dense, Source};
use crate::hit::Counts;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::status::Status;
use crate::vehicle::Outline;

/// Points in the vehicle frame, several at a time or one by one.
pub(crate) trait Frame<T: Real>: Copy {
    /// How many there are.
    fn len(&self) -> usize;
    /// Approximate x and y of the points `at .. at + LANES`; x is NaN where there is no valid one.
    fn lanes(&self, at: usize) -> [Lanes<T>; 2];
    /// How far those may be off for points up to `reach` away, m.
    fn error(&self, reach: f64) -> f64;
    /// Exact x and y of one point; NaN if it is not valid.
    fn point(&self, index: usize) -> [f64; 2];
    /// Whether a point is known to be in contact, even where rounding puts it outside the outline.
    fn touches(&self, index: usize) -> bool;
    /// A place at which points may touch the vehicle outside the outline: the sensor's. Without one, the origin.
    fn origin(&self) -> [f64; 2] {
        [0.0; 2]
    }
    /// What a point means if it is not going to be hit.
    fn status(&self, index: usize, sweep: &Sweep) -> Status;
}

/// Points as columns x, y and z. Where points have no z, x takes its place, which makes none of them less valid.
#[derive(Clone, Copy)]
pub(super) struct Planar<S>(pub [S; 3]);

impl<'a, T: Real> Planar<Column<'a, T>> {
    /// The same points, if no column has gaps.
    pub(super) fn dense(self) -> Option<Planar<Dense<'a, T>>> {
        let [x, y, z] = self.0;
        Some(Planar([x.dense()?, y.dense()?, z.dense()?]))
    }

    /// Whether there is a valid point. Usually one of the first is.
    pub(super) fn any_valid(&self) -> bool {
        (0..self.len()).any(|index| !self.point(index)[0].is_nan())
    }

    /// The first point in the outline, if there is one.
    pub(super) fn first_inside(&self, sweep: &Sweep) -> Option<usize> {
        (0..self.len()).find(|index| sweep.is_inside(self.point(*index)))
    }
}

impl<S> Planar<S> {
    /// Counts how many points are valid, invalid and in contact.
    pub(super) fn count<T: Real>(self, level: Level, outline: Outline) -> Counts
    where
        S: Source<T>,
    {
        level.run(CountPoints { points: self, outline: edges(outline) })
    }
}

/// Returns the x of a valid point, else NaN. A point is valid if it is finite, and not the (0, 0, 0) that drivers store
/// where nothing came back.
#[inline(always)]
fn valid_x<T: Real>(x: T, y: T, z: T) -> T {
    let zero_if_finite = x * T::ZERO + y * T::ZERO + z * T::ZERO;
    let nothing = (x == T::ZERO) & (y == T::ZERO) & (z == T::ZERO);
    if (zero_if_finite == T::ZERO) & !nothing { x } else { T::NAN }
}

impl<T: Real, S: Source<T>> Frame<T> for Planar<S> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.0[0].len()
    }

    #[inline(always)]
    fn lanes(&self, at: usize) -> [Lanes<T>; 2] {
        let [x, y, z]: [Lanes<T>; 3] = if at + LANES <= self.len() {
            [self.0[0].lanes(at), self.0[1].lanes(at), self.0[2].lanes(at)]
        } else {
            [self.0[0].lanes_or(at, T::NAN), self.0[1].lanes_or(at, T::NAN), self.0[2].lanes_or(at, T::NAN)]
        };
        [std::array::from_fn(|lane| valid_x(x[lane], y[lane], z[lane])), y]
    }

    #[inline(always)]
    fn error(&self, _: f64) -> f64 {
        0.0
    }

    #[inline(always)]
    fn point(&self, index: usize) -> [f64; 2] {
        let [x, y, z] = [0, 1, 2].map(|column: usize| self.0[column].lanes::<1>(index)[0]);
        if valid_x(x, y, z).is_nan() { [f64::NAN; 2] } else { [x.to_f64(), y.to_f64()] }
    }

    #[inline(always)]
    fn touches(&self, _: usize) -> bool {
        false
    }

    #[inline(always)]
    fn status(&self, index: usize, sweep: &Sweep) -> Status {
        let point = self.point(index);
        if point[0].is_nan() {
            Status::Invalid
        } else if sweep.is_inside(point) {
            Status::Contact
        } else {
            Status::NotClosing
        }
    }
}

/// Returns the edges of the outline, moved inwards to numbers of type `T`.
fn edges<T: Real>(outline: Outline) -> [T; 4] {
    let Outline { x_rear, x_front, y_right, y_left } = outline;
    [T::not_below(x_rear), T::not_above(x_front), T::not_below(y_right), T::not_above(y_left)]
}

/// Counts points that are valid, invalid and in contact.
struct CountPoints<T, S> {
    points: Planar<S>,
    outline: [T; 4],
}

impl<T: Real, S: Source<T>> Kernel for CountPoints<T, S> {
    type Output = Counts;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Counts {
        let n = self.points.len();
        let [x_rear, x_front, y_right, y_left] = self.outline;
        let (mut valid, mut contact) = (0, 0);
        for at in (0..n).step_by(LANES) {
            let [x, y] = self.points.lanes(at);
            valid += T::within(simd, &x, &[T::ZERO - T::MAX; LANES], &[T::MAX; LANES]).count_ones();
            let inside = T::within(simd, &x, &[x_rear; LANES], &[x_front; LANES])
                & T::within(simd, &y, &[y_right; LANES], &[y_left; LANES]);
            contact += inside.count_ones();
        }
        let points = u32::try_from(n).expect("Points::new admits fewer than 2^32 points");
        Counts { valid, invalid: points - valid, contact, ..Counts::default() }
    }
}
