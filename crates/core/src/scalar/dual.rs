//! First-order duals: a value with its derivative in one direction.

use super::base::Scalar;
use super::types::{Dual, Lane, Row, RowMut};
use std::ops::{Add, Mul, Neg, Sub};

impl Scalar for Dual {
    const ORDER: usize = 1;

    #[inline(always)]
    fn constant(x: Lane) -> Self {
        Dual { v: x, d: Lane::ZERO }
    }

    #[inline(always)]
    fn value(self) -> Lane {
        self.v
    }

    #[inline(always)]
    fn parts(self) -> [Lane; 3] {
        [self.v, self.d, Lane::ZERO]
    }

    #[inline(always)]
    fn from_parts([v, d, _]: [Lane; 3]) -> Self {
        Dual { v, d }
    }

    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Dual { v: self.v.mul_add(b.v, c.v), d: self.v.mul_add(b.d, self.d.mul_add(b.v, c.d)) }
    }

    #[inline(always)]
    fn fma_lane(self, b: Lane, c: Self) -> Self {
        Dual { v: self.v.mul_add(b, c.v), d: self.d.mul_add(b, c.d) }
    }

    #[inline(always)]
    fn compose(self, f: [Lane; 3]) -> Self {
        Dual { v: f[0], d: f[1] * self.d }
    }

    #[inline(always)]
    fn select(mask: Lane, a: Self, b: Self) -> Self {
        Dual { v: mask.select(a.v, b.v), d: mask.select(a.d, b.d) }
    }

    #[inline(always)]
    fn row(x: &[Self]) -> Row<'_> {
        Row::Dual(x)
    }

    #[inline(always)]
    fn row_mut(x: &mut [Self]) -> RowMut<'_> {
        RowMut::Dual(x)
    }
}

impl Add for Dual {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Dual { v: self.v + o.v, d: self.d + o.d }
    }
}

impl Sub for Dual {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Dual { v: self.v - o.v, d: self.d - o.d }
    }
}

impl Mul for Dual {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Dual { v: self.v * o.v, d: self.v.mul_add(o.d, self.d * o.v) }
    }
}

impl Neg for Dual {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual { v: -self.v, d: -self.d }
    }
}

impl Add<Lane> for Dual {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Lane) -> Self {
        Dual { v: self.v + o, ..self }
    }
}

impl Sub<Lane> for Dual {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Lane) -> Self {
        Dual { v: self.v - o, ..self }
    }
}

impl Mul<Lane> for Dual {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Lane) -> Self {
        Dual { v: self.v * o, d: self.d * o }
    }
}
