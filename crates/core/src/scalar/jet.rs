//! Second-order jets: a value with its first and second derivative in t.

use super::base::Scalar;
use super::types::{Jet, Lane, Row, RowMut};
use std::ops::{Add, Mul, Neg, Sub};

impl Scalar for Jet {
    const ORDER: usize = 2;

    #[inline(always)]
    fn constant(x: Lane) -> Self {
        Jet { v: x, d: Lane::ZERO, dd: Lane::ZERO }
    }

    #[inline(always)]
    fn value(self) -> Lane {
        self.v
    }

    #[inline(always)]
    fn parts(self) -> [Lane; 3] {
        [self.v, self.d, self.dd]
    }

    #[inline(always)]
    fn from_parts([v, d, dd]: [Lane; 3]) -> Self {
        Jet { v, d, dd }
    }

    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        // Of a vector times a number, the number comes first, and this is computed once.
        let twice = self.d + self.d;
        Jet {
            v: self.v.mul_add(b.v, c.v),
            d: self.v.mul_add(b.d, self.d.mul_add(b.v, c.d)),
            dd: self.v.mul_add(b.dd, self.dd.mul_add(b.v, twice.mul_add(b.d, c.dd))),
        }
    }

    #[inline(always)]
    fn fma_lane(self, b: Lane, c: Self) -> Self {
        Jet { v: self.v.mul_add(b, c.v), d: self.d.mul_add(b, c.d), dd: self.dd.mul_add(b, c.dd) }
    }

    /// Faà di Bruno's formula to second order.
    #[inline(always)]
    fn compose(self, f: [Lane; 3]) -> Self {
        Jet { v: f[0], d: f[1] * self.d, dd: f[1].mul_add(self.dd, f[2] * (self.d * self.d)) }
    }

    #[inline(always)]
    fn select(mask: Lane, a: Self, b: Self) -> Self {
        Jet { v: mask.select(a.v, b.v), d: mask.select(a.d, b.d), dd: mask.select(a.dd, b.dd) }
    }

    #[inline(always)]
    fn row(x: &[Self]) -> Row<'_> {
        Row::Jet(x)
    }

    #[inline(always)]
    fn row_mut(x: &mut [Self]) -> RowMut<'_> {
        RowMut::Jet(x)
    }
}

impl Add for Jet {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Jet { v: self.v + o.v, d: self.d + o.d, dd: self.dd + o.dd }
    }
}

impl Sub for Jet {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Jet { v: self.v - o.v, d: self.d - o.d, dd: self.dd - o.dd }
    }
}

impl Mul for Jet {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let twice = self.d + self.d;
        Jet {
            v: self.v * o.v,
            d: self.v.mul_add(o.d, self.d * o.v),
            dd: self.v.mul_add(o.dd, self.dd.mul_add(o.v, twice * o.d)),
        }
    }
}

impl Neg for Jet {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Jet { v: -self.v, d: -self.d, dd: -self.dd }
    }
}

impl Add<Lane> for Jet {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Lane) -> Self {
        Jet { v: self.v + o, ..self }
    }
}

impl Sub<Lane> for Jet {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Lane) -> Self {
        Jet { v: self.v - o, ..self }
    }
}

impl Mul<Lane> for Jet {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Lane) -> Self {
        Jet { v: self.v * o, d: self.d * o, dd: self.dd * o }
    }
}
