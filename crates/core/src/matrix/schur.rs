//! Functions of the eigenvalues of a general matrix, computed by a library one lane after the other.

use super::base::{Matrix, Storage};
use crate::scalar::{LANES, Lane, few};
use nalgebra::{Complex, DMatrix, Schur};

type Dense = DMatrix<Complex<f64>>;

/// Unitary Q and upper triangular T with A = QTQ*, or None if the method does not converge (or A is not finite).
fn schur(a: Dense) -> Option<(Dense, Dense)> {
    if !a.iter().all(|x| x.re.is_finite() && x.im.is_finite()) {
        return None;
    }
    let rounds = 100 * a.nrows();
    Schur::try_new(a, f64::EPSILON, rounds).map(Schur::unpack)
}

/// One lane of numbers in the order of [`Matrix::read`].
fn dense<const D: usize>(n: usize, numbers: &[Lane], l: usize) -> Dense {
    DMatrix::from_fn(n, n, |i, j| {
        let x = &numbers[(i * n + j) * D..][..D];
        Complex::new(x[0].as_array()[l], if D == 1 { 0.0 } else { x[D - 1].as_array()[l] })
    })
}

/// The largest value of a function on the eigenvalues; NaN without eigenvalues.
fn largest<const D: usize, A: Storage>(m: &Matrix<Lane, D, A>, f: impl Fn(Complex<f64>) -> f64) -> Lane {
    let numbers = m.entries().as_flattened();
    let of = |l: usize| {
        schur(dense::<D>(m.rows(), numbers, l))
            .map_or(f64::NAN, |(_, t)| t.diagonal().iter().map(|&x| f(x)).fold(0.0, f64::max))
    };
    Lane::new(few(of))
}

/// The largest |arg λ| of the eigenvalues.
pub fn largest_argument<const D: usize, A: Storage>(m: &Matrix<Lane, D, A>) -> Lane {
    largest(m, |x| x.im.abs().atan2(x.re))
}

/// The largest |Im λ| of the eigenvalues.
pub fn largest_imaginary<const D: usize, A: Storage>(m: &Matrix<Lane, D, A>) -> Lane {
    largest(m, |x| x.im.abs())
}

/// The principal square root of a matrix and its derivatives, each as plain numbers, on the requested lanes (Björck &
/// Hammarling 1983). It is accurate if eigenvalues are close to the negative numbers.
pub(super) fn root<const D: usize>(n: usize, parts: &[Vec<Lane>], lanes: [bool; LANES]) -> Vec<Vec<Lane>> {
    let mut found = vec![vec![Lane::splat(f64::NAN); n * n * D]; parts.len()];
    for l in (0..LANES).filter(|&l| lanes[l]) {
        let of = |k: usize| dense::<D>(n, &parts[k], l);
        let Some((q, t)) = schur(of(0)) else { continue };
        let r = triangular_root(&t);
        let turned = |a: Dense| q.adjoint() * a * &q;
        let mut all = vec![r.clone()];
        if parts.len() > 1 {
            // X² = A, XX' + X'X = A', XX'' + X''X = A'' − 2X'²
            let d = sylvester(&r, turned(of(1)));
            if parts.len() > 2 {
                let rest = turned(of(2)) - &d * &d * Complex::from(2.0);
                all.extend([d, sylvester(&r, rest)]);
            } else {
                all.push(d);
            }
        }
        for (found, x) in found.iter_mut().zip(all) {
            let x = &q * x * q.adjoint();
            for (at, out) in found.chunks_exact_mut(D).enumerate() {
                let z = x[(at / n, at % n)];
                out.iter_mut().zip([z.re, z.im]).for_each(|(out, x)| out.as_mut_array()[l] = x);
            }
        }
    }
    found
}

fn triangular_root(t: &Dense) -> Dense {
    let n = t.nrows();
    let mut r = Dense::zeros(n, n);
    for j in 0..n {
        r[(j, j)] = t[(j, j)].sqrt();
        for i in (0..j).rev() {
            let sum: Complex<f64> = (i + 1..j).map(|k| r[(i, k)] * r[(k, j)]).sum();
            r[(i, j)] = (t[(i, j)] - sum) / (r[(i, i)] + r[(j, j)]);
        }
    }
    r
}

/// The Y with RY + YR = B for an upper triangular R.
fn sylvester(r: &Dense, b: Dense) -> Dense {
    let n = r.nrows();
    let mut y = b;
    for j in 0..n {
        for i in (0..n).rev() {
            let left: Complex<f64> = (i + 1..n).map(|k| r[(i, k)] * y[(k, j)]).sum();
            let right: Complex<f64> = (0..j).map(|k| y[(i, k)] * r[(k, j)]).sum();
            y[(i, j)] = (y[(i, j)] - left - right) / (r[(i, i)] + r[(j, j)]);
        }
    }
    y
}
