//! Larger matrices: products in blocks that fit the cache, and eigenvectors one lane after the other by
//! a library.

use super::{Entry, Matrix, Storage, mul_add, reorthonormalise};
use crate::monitor::checkpoint;
use crate::scalar::{LANES, Lane, Scalar, few};
use nalgebra::{Complex, ComplexField, DMatrix, SymmetricEigen};

/// From this size on one matrix at a time is faster than Jacobi's method with eight side by side, and
/// products gain from blocks.
pub(super) const LARGE: usize = 11;
/// Bytes of the first cache that a block of columns may fill.
const BLOCK: usize = 24 << 10;

/// `A B` by blocks of columns that are copied to lie side by side.
pub(super) fn times<S: Scalar, const D: usize, A: Storage>(
    a: &Matrix<S, D, A>,
    b: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    // So many sums as the registers hold.
    if size_of::<Entry<S, D>>() <= size_of::<Lane>() {
        times_in::<S, D, A, 3, 2>(a, b)
    } else {
        times_in::<S, D, A, 2, 1>(a, b)
    }
}

fn times_in<S: Scalar, const D: usize, A: Storage, const R: usize, const C: usize>(
    a: &Matrix<S, D, A>,
    b: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    let (rows, inner, cols) = (a.rows(), a.cols(), b.cols());
    let zero = [S::constant(Lane::ZERO); D];
    let mut out = Matrix::zeros(rows, cols);
    let panels = cols.div_ceil(C);
    let at_once = (BLOCK / (inner * C * size_of::<Entry<S, D>>())).clamp(1, panels);
    // One panel is C columns, row by row.
    let mut block = vec![[zero; C]; at_once * inner];
    for first in (0..panels).step_by(at_once) {
        checkpoint();
        let here = at_once.min(panels - first);
        for p in 0..here {
            for k in 0..inner {
                for c in 0..C {
                    let j = (first + p) * C + c;
                    block[p * inner + k][c] = if j < cols { b[(k, j)] } else { zero };
                }
            }
        }
        let mut i = 0;
        while i < rows {
            let tall = i + R <= rows;
            for p in 0..here {
                let (panel, j) = (&block[p * inner..][..inner], (first + p) * C);
                if tall {
                    tile::<S, D, A, R, C>(a, panel, &mut out, (i, j));
                } else {
                    tile::<S, D, A, 1, C>(a, panel, &mut out, (i, j));
                }
            }
            i += if tall { R } else { 1 };
        }
    }
    out
}

/// R × C entries of a product, from (i, j) on.
#[inline]
fn tile<S: Scalar, const D: usize, A: Storage, const R: usize, const C: usize>(
    a: &Matrix<S, D, A>,
    panel: &[[Entry<S, D>; C]],
    out: &mut Matrix<S, D, A>,
    (i, j): (usize, usize),
) {
    let rows: [&[Entry<S, D>]; R] = few(|r| &a.data[(i + r) * panel.len()..][..panel.len()]);
    let mut sum = [[[S::constant(Lane::ZERO); D]; C]; R];
    for (k, b) in panel.iter().enumerate() {
        for r in 0..R {
            for c in 0..C {
                sum[r][c] = mul_add::<S, D, false>(rows[r][k], b[c], sum[r][c]);
            }
        }
    }
    let cols = out.cols();
    for r in 0..R {
        for c in 0..C.min(cols - j) {
            out[(i + r, j + c)] = sum[r][c];
        }
    }
}

/// Unitary V with `V* H V` diagonal but for rounding errors. Lanes that are not finite get the identity.
pub(super) fn eigenvectors<const D: usize>(h: &Matrix<Lane, D>) -> Matrix<Lane, D> {
    let mut v = Matrix::identity(h.rows());
    let numbers = h.entries().as_flattened();
    for l in 0..LANES {
        checkpoint();
        // Lanes that are left over repeat another one.
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
    reorthonormalise(&mut v);
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
    // Without a limit the library would loop for ever where rounding keeps it from its aim.
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
