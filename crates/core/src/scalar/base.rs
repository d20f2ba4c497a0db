//! The operations of formulas, for any kind of number.

use super::few::few;
use super::types::{LANES, Lane, Row, RowMut};
use std::ops::{Add, Mul, Neg, Sub};

/// A number, or a number with derivatives, on all lanes.
pub trait Scalar:
    Copy
    + Send
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Add<Lane, Output = Self>
    + Sub<Lane, Output = Self>
    + Mul<Lane, Output = Self>
{
    /// The number of derivatives: 0, 1 or 2.
    const ORDER: usize;

    /// A constant, whose derivatives are zero.
    fn constant(x: Lane) -> Self;

    /// The number without its derivatives.
    fn value(self) -> Lane;

    /// Value, first and second derivative; those that the type does not have are zero.
    fn parts(self) -> [Lane; 3];

    /// From value and derivatives; those that the type does not have are dropped.
    fn from_parts(parts: [Lane; 3]) -> Self;

    /// `self · b + c`, rounded once if the processor supports it.
    fn fma(self, b: Self, c: Self) -> Self;

    /// `self · b + c` with a constant factor `b`.
    fn fma_lane(self, b: Lane, c: Self) -> Self;

    /// `f(self)`, given f, f' and f'' at `self.value()`. Only the first `ORDER + 1` are used.
    ///
    /// One composition is faster than propagating derivatives through every step of f, and stays finite where a step
    /// (a square root, an arctangent) is not differentiable.
    fn compose(self, f: [Lane; 3]) -> Self;

    /// `a` on the lanes of a mask, `b` on the others.
    fn select(mask: Lane, a: Self, b: Self) -> Self;

    /// Numbers of this kind as numbers of any kind.
    fn row(x: &[Self]) -> Row<'_>;

    /// The same for a mutable slice.
    fn row_mut(x: &mut [Self]) -> RowMut<'_>;
}

impl Scalar for Lane {
    const ORDER: usize = 0;

    #[inline(always)]
    fn constant(x: Lane) -> Self {
        x
    }

    #[inline(always)]
    fn value(self) -> Lane {
        self
    }

    #[inline(always)]
    fn parts(self) -> [Lane; 3] {
        [self, Lane::ZERO, Lane::ZERO]
    }

    #[inline(always)]
    fn from_parts([v, ..]: [Lane; 3]) -> Self {
        v
    }

    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }

    #[inline(always)]
    fn fma_lane(self, b: Lane, c: Self) -> Self {
        self.mul_add(b, c)
    }

    #[inline(always)]
    fn compose(self, f: [Lane; 3]) -> Self {
        f[0]
    }

    #[inline(always)]
    fn select(mask: Lane, a: Self, b: Self) -> Self {
        mask.select(a, b)
    }

    #[inline(always)]
    fn row(x: &[Self]) -> Row<'_> {
        Row::Lane(x)
    }

    #[inline(always)]
    fn row_mut(x: &mut [Self]) -> RowMut<'_> {
        RowMut::Lane(x)
    }
}

/// A constant on every lane.
#[inline(always)]
pub const fn lane(x: f64) -> Lane {
    Lane::splat(x)
}

/// `Σ aᵢ bᵢ`.
#[inline(always)]
pub fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    let mut sum = S::constant(Lane::ZERO);
    for (x, y) in a.iter().zip(b) {
        sum = x.fma(*y, sum);
    }
    sum
}

/// The larger of the two in each lane, and NaN where either is NaN (`max` would ignore it).
#[inline(always)]
pub fn max_or_nan(a: Lane, b: Lane) -> Lane {
    // `!(b <= a)` is true for b > a and for NaN. A NaN in `a` remains, since comparisons with it are false.
    let keep = b.simd_le(a) | a.is_nan();
    keep.select(a, b)
}

/// The lanes whose bit is set in a mask, as booleans.
#[inline]
pub fn mask_bits(mask: Lane) -> [bool; LANES] {
    let bits = mask.to_bitmask();
    few(|i| bits >> i & 1 == 1)
}

/// A mask that is set on the lanes where `f` is true.
#[inline]
pub fn mask_from(f: impl Fn(usize) -> bool) -> Lane {
    let array: [f64; LANES] = few(|i| if f(i) { 1.0 } else { 0.0 });
    Lane::new(array).simd_gt(Lane::ZERO)
}
