//! Eigenvectors of larger matrices, computed by a library one lane after the other.

use super::base::Matrix;
use super::dense::reorthonormalize;
use crate::monitor::checkpoint;
use crate::scalar::{LANES, Lane};
use nalgebra::{Complex, ComplexField, DMatrix, SymmetricEigen};

/// Unitary V with `V* H V` diagonal up to rounding. Lanes that are not finite receive the identity.
pub(super) fn eigenvectors<const D: usize>(h: &Matrix<Lane, D>) -> Matrix<Lane, D> {
    let mut v = Matrix::identity(h.rows());
    let numbers = h.entries().as_flattened();
    for l in 0..LANES {
        checkpoint();
        // Unused lanes repeat another one.
        let same =
            |other: usize| numbers.iter().all(|x| x.as_array()[l].to_bits() == x.as_array()[other].to_bits());
        if let Some(other) = l.checked_sub(1).filter(|&other| same(other)) {
            for (i, j) in (0..h.rows()).flat_map(|i| (0..h.rows()).map(move |j| (i, j))) {
                v[(i, j)].iter_mut().for_each(|x: &mut Lane| x.as_mut_array()[l] = x.as_array()[other]);
            }
            continue;
        }
        let number = |i: usize, j: usize, c: usize| h[(i, j)][c].as_array()[l];
        if D == 1 {
            one(&mut v, l, |i, j| number(i, j, 0), |x| [x, 0.0]);
        } else {
            one(&mut v, l, |i, j| Complex::new(number(i, j, 0), number(i, j, D - 1)), |x| [x.re, x.im]);
        }
    }
    reorthonormalize(&mut v);
    v
}

/// Fills lane l of V.
fn one<T: ComplexField<RealField = f64>, const D: usize>(
    v: &mut Matrix<Lane, D>,
    l: usize,
    h: impl Fn(usize, usize) -> T,
    parts: impl Fn(T) -> [f64; 2],
) {
    let n = v.rows();
    let h = DMatrix::from_fn(n, n, h);
    if !h.iter().all(|x| x.clone().is_finite()) {
        return;
    }
    // Without a limit the library would not terminate if rounding prevents convergence.
    if let Some(e) = SymmetricEigen::try_new(h, f64::EPSILON, 100 * n) {
        for i in 0..n {
            for j in 0..n {
                let x = parts(e.eigenvectors[(i, j)].clone());
                v[(i, j)].iter_mut().zip(x).for_each(|(v, x)| v.as_mut_array()[l] = x);
            }
        }
    }
}

/// `V* A V` for a Hermitian A.
pub(super) fn in_basis<const D: usize>(a: &Matrix<Lane, D>, v: &Matrix<Lane, D>) -> Matrix<Lane, D> {
    v.adjoint_times(a).times_adjoint_hermitian(&v.adjoint())
}
