//! Entries of a matrix, real or complex, and their products.

use crate::scalar::{Lane, Scalar};

/// A real number (D = 1), or real and imaginary part of a complex one (D = 2).
pub type Entry<S, const D: usize> = [S; D];

#[inline(always)]
pub(super) fn conjugate<S: Scalar, const D: usize>(mut a: Entry<S, D>) -> Entry<S, D> {
    if D > 1 {
        a[D - 1] = -a[D - 1];
    }
    a
}

/// `a b + c`, or `a b* + c` with `CONJUGATE`.
#[inline(always)]
pub(super) fn mul_add<S: Scalar, const D: usize, const CONJUGATE: bool>(
    a: Entry<S, D>,
    b: Entry<S, D>,
    c: Entry<S, D>,
) -> Entry<S, D> {
    let mut out = c;
    if D == 1 {
        out[0] = a[0].fma(b[0], c[0]);
    } else {
        let (ai, bi) = (a[D - 1], if CONJUGATE { -b[D - 1] } else { b[D - 1] });
        out[0] = a[0].fma(b[0], (-ai).fma(bi, c[0]));
        out[D - 1] = a[0].fma(bi, ai.fma(b[0], c[D - 1]));
    }
    out
}

/// The same with a factor b without derivatives.
#[inline(always)]
pub(super) fn mul_add_lane<S: Scalar, const D: usize, const CONJUGATE: bool>(
    a: Entry<S, D>,
    b: Entry<Lane, D>,
    c: Entry<S, D>,
) -> Entry<S, D> {
    let mut out = c;
    if D == 1 {
        out[0] = a[0].fma_lane(b[0], c[0]);
    } else {
        let (ai, bi) = (a[D - 1], if CONJUGATE { -b[D - 1] } else { b[D - 1] });
        out[0] = a[0].fma_lane(b[0], (-ai).fma_lane(bi, c[0]));
        out[D - 1] = a[0].fma_lane(bi, ai.fma_lane(b[0], c[D - 1]));
    }
    out
}

/// `a b + c`.
pub fn multiply_add<const D: usize>(
    a: Entry<Lane, D>,
    b: Entry<Lane, D>,
    c: Entry<Lane, D>,
) -> Entry<Lane, D> {
    mul_add::<Lane, D, false>(a, b, c)
}

/// `Re a*b + c`.
#[inline(always)]
pub(super) fn inner_add<S: Scalar, const D: usize>(a: Entry<S, D>, b: Entry<S, D>, c: S) -> S {
    let c = a[0].fma(b[0], c);
    if D == 1 { c } else { a[D - 1].fma(b[D - 1], c) }
}
