//! The inverse of a matrix, with its derivatives.

use super::base::{Matrix, Storage};
#[cfg(feature = "dense")]
use super::dense::determinant;
use super::entry::{inner_add, mul_add};
use crate::scalar::{Each, Lane, Scalar, few, lane};

/// `A⁻¹`; not finite on lanes where A is singular.
pub fn inverse<S: Scalar, const D: usize, A: Storage>(a: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    let x = of_values(&a.value());
    if S::ORDER == 0 {
        return x.map(S::constant);
    }
    // X' = −XA'X and X'' = −XA''X − 2XA'X'
    let part = |order: usize| a.map(|x| x.parts()[order]);
    let turned = x.times(&part(1));
    let first = -turned.times(&x);
    let second = if S::ORDER > 1 {
        -(&x.times(&part(2)).times(&x) + &turned.times(&first).scaled(lane(2.0)))
    } else {
        first.clone()
    };
    let of = |m: &Matrix<Lane, D, A>, i: usize, c: usize| m.entries()[i][c];
    Matrix::collected(x.shape, |i| {
        few(|c| S::from_parts([of(&x, i, c), of(&first, i, c), of(&second, i, c)]))
    })
}

/// Gauss and Jordan, with row exchanges lane by lane.
fn of_values<const D: usize, A: Storage>(a: &Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
    let n = a.rows();
    let (mut a, mut x) = (a.clone(), Matrix::identity(n));
    for k in 0..n {
        for i in k + 1..n {
            let [best, other] = [k, i].each(|i| inner_add(a[(i, k)], a[(i, k)], Lane::ZERO));
            let larger = other.simd_gt(best);
            if larger.any() {
                exchange(&mut a, (k, i), larger);
                exchange(&mut x, (k, i), larger);
            }
        }
        let pivot = a[(k, k)];
        let square = inner_add(pivot, pivot, Lane::ZERO);
        let mut inverse = pivot.each(|x| x / square);
        if D > 1 {
            inverse[D - 1] = -inverse[D - 1];
        }
        for m in [&mut a, &mut x] {
            for j in 0..n {
                m[(k, j)] = mul_add::<Lane, D, false>(m[(k, j)], inverse, [Lane::ZERO; D]);
            }
        }
        for i in (0..n).filter(|&i| i != k) {
            let factor = a[(i, k)].each(|x| -x);
            for m in [&mut a, &mut x] {
                for j in 0..n {
                    m[(i, j)] = mul_add::<Lane, D, false>(factor, m[(k, j)], m[(i, j)]);
                }
            }
        }
    }
    x
}

/// Exchanges two rows on the lanes of a mask.
fn exchange<const D: usize, A: Storage>(m: &mut Matrix<Lane, D, A>, (p, q): (usize, usize), mask: Lane) {
    for j in 0..m.cols() {
        let (a, b) = (m[(p, j)], m[(q, j)]);
        m[(p, j)] = few(|c| mask.select(b[c], a[c]));
        m[(q, j)] = few(|c| mask.select(a[c], b[c]));
    }
}

/// `|det A|` to the power −1/n: the factor that scales the determinant to size one. One if that is not finite.
#[cfg(feature = "dense")]
pub(super) fn balance<const D: usize, A: Storage>(a: &Matrix<Lane, D, A>) -> Lane {
    let det = determinant(a);
    let size = inner_add(det, det, Lane::ZERO).sqrt();
    let factor = (size.ln() * lane(-1.0 / a.rows() as f64)).exp();
    let good = factor.simd_gt(Lane::ZERO) & factor.simd_lt(lane(f64::INFINITY));
    good.select(factor, Lane::ONE)
}
