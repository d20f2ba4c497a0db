//! Selection lane by lane.

use super::base::{Matrix, Storage};
use crate::scalar::{Lane, Scalar, lane};

/// Values that can be selected lane by lane.
pub trait Select {
    /// `a` on the lanes of a mask, `b` on the others.
    fn select(mask: Lane, a: Self, b: Self) -> Self;
}

impl<S: Scalar, const D: usize, A: Storage> Select for Matrix<S, D, A> {
    fn select(mask: Lane, a: Self, b: Self) -> Self {
        if A::ANY { (A::compiled().select)(mask, &a, &b) } else { Self::select_here(mask, &a, &b) }
    }
}

impl<T: Select, const F: usize> Select for [T; F] {
    fn select(mask: Lane, a: Self, b: Self) -> Self {
        let mut pairs = a.into_iter().zip(b);
        std::array::from_fn(|_| {
            let (a, b) = pairs.next().expect("arrays are of one length");
            T::select(mask, a, b)
        })
    }
}

/// Selects by size: lanes up to `limits[i]` receive `f(i)`, larger ones `f(limits.len())`.
///
/// The result of a lane depends on its own size only, never on its neighbours.
pub fn by_size<R: Select>(size: Lane, limits: &[f64], mut f: impl FnMut(usize) -> R) -> R {
    let top = limit_of_all(size, limits);
    let mut result = f(top);
    for i in (0..top).rev() {
        let within = size.simd_le(lane(limits[i]));
        if within.any() {
            result = R::select(within, f(i), result);
        }
    }
    result
}

/// The first limit that no lane exceeds.
#[inline(never)]
fn limit_of_all(size: Lane, limits: &[f64]) -> usize {
    limits.iter().position(|&x| size.simd_le(lane(x)).all()).unwrap_or(limits.len())
}
