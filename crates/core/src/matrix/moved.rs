//! A point that moves on a curve of matrices.

use super::base::{Matrix, Storage};
use crate::scalar::{Lane, Scalar};

/// A point on a curve of matrices, and, if required, its first and second derivative.
pub struct Moved<const D: usize, A: Storage>(pub Matrix<Lane, D, A>, pub Option<[Matrix<Lane, D, A>; 2]>);

impl<const D: usize, A: Storage> Moved<D, A> {
    /// The point x = p e^{tΩ} of a curve with x' = xΩ, with the required number of derivatives.
    pub fn by_generator(x: Matrix<Lane, D, A>, omega: &Matrix<Lane, D, A>, order: usize) -> Self {
        if order == 0 {
            return Moved(x, None);
        }
        let d = x.times(omega);
        let dd = if order > 1 { d.times(omega) } else { d.clone() };
        Moved(x, Some([d, dd]))
    }

    /// Writes the curve at the parameter t, with the derivatives that t has.
    pub fn write<S: Scalar>(&self, t: S, out: &mut [S]) {
        let Moved(x, rates) = self;
        let Some([d, dd]) = rates else {
            let entries = x.entries().as_flattened();
            return out.iter_mut().zip(entries).for_each(|(out, &x)| *out = S::constant(x));
        };
        for (i, out) in out.iter_mut().enumerate() {
            *out = t.compose([x, d, dd].map(|m| m.entries()[i / D][i % D]));
        }
    }
}
