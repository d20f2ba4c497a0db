//! Coordinate vectors of any kind of number.

use crate::scalar::{Lane, Scalar};
use crate::space::Space;

/// Squared length of the value of a coordinate vector.
#[inline(always)]
pub fn length2<S: Scalar>(x: &[S]) -> Lane {
    x.iter().fold(Lane::ZERO, |sum, x| x.value().mul_add(x.value(), sum))
}

/// `S(factor · u) x`.
#[inline(always)]
pub fn stretch_by<S: Scalar, M: Space>(space: &M, factor: Lane, u: &[S], x: &mut [S]) {
    const SMALL: usize = 16;
    if u.len() <= SMALL {
        let mut v = [S::constant(Lane::ZERO); SMALL];
        for c in 0..u.len() {
            v[c] = u[c] * factor;
        }
        space.stretch(&v[..u.len()], x);
    } else {
        space.stretch(&u.iter().map(|&u| u * factor).collect::<Vec<_>>(), x);
    }
}
