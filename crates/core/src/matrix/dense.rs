//! Operations that a point may require once: orthonormal columns, determinants, triangular factors.

use super::base::{Matrix, Storage};
use super::entry::{Entry, inner_add, mul_add};
use crate::scalar::{Each, LANES, Lane, few, lane};

/// Orthonormalises the columns by Gram–Schmidt, twice, to reach rounding accuracy.
pub fn orthonormalize<const D: usize, A: Storage>(a: &mut Matrix<Lane, D, A>) {
    let (rows, cols) = (a.rows(), a.cols());
    for j in 0..cols {
        for _ in 0..2 {
            for k in 0..j {
                let mut along = [Lane::ZERO; D];
                for i in 0..rows {
                    along = mul_add::<Lane, D, true>(a[(i, j)], a[(i, k)], along);
                }
                let minus = along.each(|x| -x);
                for i in 0..rows {
                    a[(i, j)] = mul_add::<Lane, D, false>(a[(i, k)], minus, a[(i, j)]);
                }
            }
            let mut square = Lane::ZERO;
            for i in 0..rows {
                square = inner_add(a[(i, j)], a[(i, j)], square);
            }
            let inverse = Lane::ONE / square.sqrt();
            for i in 0..rows {
                a[(i, j)] = a[(i, j)].each(|x| x * inverse);
            }
        }
    }
}

/// One step of Newton's method (Schulz 1933) for the unitary factor of a nearly unitary matrix, or of one with nearly
/// orthonormal columns: an error e becomes about e².
pub fn reorthonormalize<const D: usize, A: Storage>(a: &mut Matrix<Lane, D, A>) {
    let correction = a.adjoint_times(a).plus_identity(lane(-1.0)).scaled(lane(-0.5));
    *a = &a.times(&correction) + a;
}

/// The determinant.
pub fn determinant<const D: usize, A: Storage>(a: &Matrix<Lane, D, A>) -> Entry<Lane, D> {
    let n = a.rows();
    let mut out = [[0.0; D]; LANES];
    for (l, out) in out.iter_mut().enumerate() {
        let numbers: Vec<[f64; D]> =
            a.entries().iter().map(|x| std::array::from_fn(|c| x[c].as_array()[l])).collect();
        *out = determinant_of(numbers, n);
    }
    few(|c| Lane::new(out.each(|x| x[c])))
}

/// Elimination with row exchanges.
fn determinant_of<const D: usize>(mut a: Vec<[f64; D]>, n: usize) -> [f64; D] {
    let product = |x: [f64; D], y: [f64; D]| -> [f64; D] {
        let mut out = x;
        if D == 1 {
            out[0] = x[0] * y[0];
        } else {
            out[0] = x[0] * y[0] - x[D - 1] * y[D - 1];
            out[D - 1] = x[0] * y[D - 1] + x[D - 1] * y[0];
        }
        out
    };
    let size = |x: [f64; D]| x.iter().map(|x| x * x).sum::<f64>();
    let mut det = [0.0; D];
    det[0] = 1.0;
    for k in 0..n {
        let best = (k..n).max_by(|&i, &j| size(a[i * n + k]).total_cmp(&size(a[j * n + k]))).unwrap_or(k);
        if best != k {
            (0..n).for_each(|j| a.swap(k * n + j, best * n + j));
            det = det.each(|x| -x);
        }
        let pivot = a[k * n + k];
        det = product(det, pivot);
        let square = size(pivot);
        if square == 0.0 {
            return det;
        }
        let mut inverse = pivot.each(|x| x / square);
        if D > 1 {
            inverse[D - 1] = -inverse[D - 1];
        }
        for i in k + 1..n {
            let factor = product(a[i * n + k], inverse);
            for j in k + 1..n {
                let x = product(factor, a[k * n + j]);
                a[i * n + j] = few(|c| a[i * n + j][c] - x[c]);
            }
        }
    }
    det
}

/// The lower triangular L with `A = L L*`; NaN on lanes where A is not positive definite.
pub fn cholesky<const D: usize, A: Storage>(a: &Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
    let n = a.rows();
    let mut l = Matrix::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let mut sum = [Lane::ZERO; D];
            for k in 0..j {
                sum = mul_add::<Lane, D, true>(l[(i, k)], l[(j, k)], sum);
            }
            let rest: Entry<Lane, D> = few(|c| a[(i, j)][c] - sum[c]);
            if i == j {
                let pivot = rest[0];
                let root = pivot.simd_gt(Lane::ZERO).select(pivot.sqrt(), lane(f64::NAN));
                l[(j, j)] = [Lane::ZERO; D];
                l[(j, j)][0] = root;
            } else {
                let inverse = Lane::ONE / l[(j, j)][0];
                l[(i, j)] = rest.each(|x| x * inverse);
            }
        }
    }
    l
}

/// `L⁻¹ B` for a lower triangular L with real diagonal.
pub fn solve_lower<const D: usize, A: Storage>(
    l: &Matrix<Lane, D, A>,
    b: &Matrix<Lane, D, A>,
) -> Matrix<Lane, D, A> {
    let mut x = b.clone();
    for i in 0..l.rows() {
        let inverse = Lane::ONE / l[(i, i)][0];
        for j in 0..b.cols() {
            let mut sum = x[(i, j)];
            for k in 0..i {
                sum = mul_add::<Lane, D, false>(l[(i, k)].each(|x| -x), x[(k, j)], sum);
            }
            x[(i, j)] = sum.each(|x| x * inverse);
        }
    }
    x
}
