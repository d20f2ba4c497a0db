//! Jacobi's method: eigenvalues and singular values of small matrices in SIMD lanes.
//!
//! Every lane rotates until it has converged and then does not change, whatever its neighbours require. Larger
//! matrices are diagonalised by a library up to rounding, and completed here, with the feature `dense`.

use super::base::{Matrix, Storage};
#[cfg(feature = "dense")]
use super::blocked::LARGE;
use super::entry::{Entry, conjugate, inner_add, mul_add};
#[cfg(feature = "dense")]
use super::large::{eigenvectors, in_basis};
use crate::scalar::{Each, Lane, few, lane, max_or_nan};

/// Jacobi's method needs five to eight sweeps; lanes that have not converged after this many are not finite.
const MAX_SWEEPS: usize = 30;
/// Off-diagonal entries below this fraction of the norm are rounding errors.
const NEGLIGIBLE: f64 = 1e-17;
/// Commuting matrices do not commute after rounding: pairs below this limit are as diagonal as possible.
const NEGLIGIBLE_PAIR: f64 = 2.0 * f64::EPSILON;
/// A sum of the cosine and this multiple of the sine coincides for two angles only by chance.
#[cfg(feature = "dense")]
const GENERIC: f64 = 0.414_213_562_373_095;

/// The rotation `[[c, −s̄], [s, c]]` whose first column is the eigenvector of `[[α, β], [β̄, −α]]` that
/// lies nearer to the first axis.
#[inline]
fn rotation<const D: usize>(alpha: Lane, beta: Entry<Lane, D>) -> (Lane, Entry<Lane, D>) {
    let size = inner_add(beta, beta, alpha * alpha).sqrt();
    // A zero matrix needs no rotation.
    let size = size.simd_eq(Lane::ZERO).select(Lane::ONE, size);
    let c = (lane(0.5) * (alpha.abs() / size + Lane::ONE)).sqrt();
    let factor = lane(0.5) / (size * c);
    let factor = alpha.simd_lt(Lane::ZERO).select(-factor, factor);
    (c, conjugate(beta.each(|b| b * factor)))
}

/// Columns p and q of a matrix become `c a_p + s a_q` and `c a_q − s̄ a_p`.
#[inline]
fn rotate_columns<const D: usize>(
    a: &mut Matrix<Lane, D>,
    (p, q): (usize, usize),
    c: Lane,
    s: Entry<Lane, D>,
) {
    let minus = conjugate(s).each(|x| -x);
    for i in 0..a.rows() {
        let (x, y) = (a[(i, p)], a[(i, q)]);
        a[(i, p)] = mul_add::<Lane, D, false>(y, s, x.each(|x| x * c));
        a[(i, q)] = mul_add::<Lane, D, false>(x, minus, y.each(|y| y * c));
    }
}

/// Rows p and q become `c a_p + s̄ a_q` and `c a_q − s a_p`.
#[inline]
fn rotate_rows<const D: usize>(a: &mut Matrix<Lane, D>, (p, q): (usize, usize), c: Lane, s: Entry<Lane, D>) {
    let (conjugated, minus) = (conjugate(s), s.each(|x| -x));
    for i in 0..a.cols() {
        let (x, y) = (a[(p, i)], a[(q, i)]);
        a[(p, i)] = mul_add::<Lane, D, false>(y, conjugated, x.each(|x| x * c));
        a[(q, i)] = mul_add::<Lane, D, false>(x, minus, y.each(|y| y * c));
    }
}

/// Diagonalises one or two commuting Hermitian matrices in place, by one unitary V: `A = V Λ V*`.
///
/// With two matrices, the real and imaginary part of a normal one, every rotation is that of the combination which is
/// farthest from diagonal (Bunse-Gerstner, Byers & Mehrmann 1993): eigenvalues that coincide in one matrix are
/// separated by the other.
pub fn diagonalize<const D: usize, const M: usize, A: Storage>(
    a: &mut [Matrix<Lane, D, A>; M],
) -> Matrix<Lane, D, A> {
    let n = a[0].rows();
    let mut numbers = a.each_ref().map(|a| a.entries().as_flattened().to_vec());
    let v = diagonalize_numbers(D, n, &mut numbers);
    for (a, x) in a.iter_mut().zip(&numbers) {
        *a = Matrix::read(n, n, x);
    }
    Matrix::read(n, n, &v)
}

/// Compiled once for all kinds of storage.
fn diagonalize_numbers(d: usize, n: usize, a: &mut [Vec<Lane>]) -> Vec<Lane> {
    if d == 1 { diagonalize_in::<1>(n, a) } else { diagonalize_in::<2>(n, a) }
}

fn diagonalize_in<const D: usize>(n: usize, numbers: &mut [Vec<Lane>]) -> Vec<Lane> {
    let mut all: Vec<Matrix<Lane, D>> = numbers.iter().map(|x| Matrix::read(n, n, x)).collect();
    let a = &mut all[..];
    let pair = a.len() > 1;
    #[cfg_attr(not(feature = "dense"), expect(unused_mut))]
    let (mut v, mut nearly_diagonal) = (Matrix::identity(n), false);
    #[cfg(feature = "dense")]
    if n >= LARGE {
        // Eigenvalues that coincide in both matrices, or by chance in this sum, are separated below.
        v = eigenvectors(&if pair { &a[0] + &a[1].scaled(lane(GENERIC)) } else { a[0].clone() });
        a.iter_mut().for_each(|a| *a = in_basis(a, &v));
        nearly_diagonal = true;
    }
    let size = a.iter().fold(Lane::ZERO, |m, a| max_or_nan(m, a.size()));
    let negligible = size * lane(if pair || nearly_diagonal { NEGLIGIBLE_PAIR } else { NEGLIGIBLE });
    let square = negligible * negligible;
    for _ in 0..MAX_SWEEPS {
        let mut moved = false;
        for p in 0..n {
            for q in p + 1..n {
                let large =
                    a.iter().fold(Lane::ZERO, |m, a| m.max(inner_add(a[(p, q)], a[(p, q)], Lane::ZERO)));
                let on = large.simd_gt(square);
                if on.none() {
                    continue;
                }
                moved = true;
                let (alpha, beta) = combination(a, p, q);
                let (c, s) = rotation(alpha, beta);
                let (c, s) = (on.select(c, Lane::ONE), s.each(|s| on.select(s, Lane::ZERO)));
                for a in a.iter_mut() {
                    rotate_columns(a, (p, q), c, s);
                    rotate_rows(a, (p, q), c, s);
                    if !pair {
                        for at in [(p, q), (q, p)] {
                            a[at] = a[at].each(|x| on.select(Lane::ZERO, x));
                        }
                    }
                }
                rotate_columns(&mut v, (p, q), c, s);
            }
        }
        if !moved {
            break;
        }
    }
    for (x, a) in numbers.iter_mut().zip(&all) {
        a.write(x.as_mut_slice());
    }
    v.entries().as_flattened().to_vec()
}

/// Half the difference of the diagonal, and the off-diagonal entry, of the matrix to diagonalise in
/// the plane (p, q).
fn combination<const D: usize>(a: &[Matrix<Lane, D>], p: usize, q: usize) -> (Lane, Entry<Lane, D>) {
    let half = lane(0.5);
    let plane = |a: &Matrix<Lane, D>| (half * (a[(p, p)][0] - a[(q, q)][0]), a[(p, q)]);
    let (a1, b1) = plane(&a[0]);
    if a.len() == 1 {
        return (a1, b1);
    }
    let (a2, b2) = plane(&a[1]);
    let product = |(x, b): (Lane, Entry<Lane, D>), (y, d): (Lane, Entry<Lane, D>)| inner_add(b, d, x * y);
    let (g11, g12, g22) =
        (product((a1, b1), (a1, b1)), product((a1, b1), (a2, b2)), product((a2, b2), (a2, b2)));
    // The leading eigenvector of [[g11, g12], [g12, g22]].
    let d = half * (g11 - g22);
    let r = (d * d + g12 * g12).sqrt();
    let first = d.simd_ge(Lane::ZERO);
    let x = first.select(d + r, g12);
    let y = first.select(g12, r - d);
    let round = r.simd_eq(Lane::ZERO);
    let (x, y) = (round.select(Lane::ONE, x), round.select(Lane::ZERO, y));
    (x * a1 + y * a2, few(|c| x * b1[c] + y * b2[c]))
}

/// Makes the columns of A orthogonal by rotating pairs of them (Hestenes 1958): A becomes `A V` with unitary V, and
/// its columns have the singular values of A as lengths. Small singular values have full relative accuracy if columns
/// are badly scaled.
///
/// `v`, if given, is multiplied by V.
pub fn orthogonalize<const D: usize, A: Storage>(
    a: &mut Matrix<Lane, D, A>,
    v: Option<&mut Matrix<Lane, D, A>>,
) {
    let (rows, cols) = (a.rows(), a.cols());
    let mut numbers = a.entries().as_flattened().to_vec();
    let mut turn = v.as_ref().map(|v| (v.rows(), v.entries().as_flattened().to_vec()));
    orthogonalise_numbers(D, [rows, cols], &mut numbers, turn.as_mut());
    *a = Matrix::read(rows, cols, &numbers);
    if let (Some(v), Some((rows, x))) = (v, turn) {
        *v = Matrix::read(rows, cols, &x);
    }
}

/// Compiled once for all kinds of storage.
fn orthogonalise_numbers(d: usize, size: [usize; 2], a: &mut [Lane], v: Option<&mut (usize, Vec<Lane>)>) {
    if d == 1 { orthogonalise_in::<1>(size, a, v) } else { orthogonalise_in::<2>(size, a, v) }
}

fn orthogonalise_in<const D: usize>(
    [rows, n]: [usize; 2],
    numbers: &mut [Lane],
    turn: Option<&mut (usize, Vec<Lane>)>,
) {
    let mut matrix = Matrix::<Lane, D>::read(rows, n, numbers);
    let a = &mut matrix;
    let mut v = turn.as_ref().map(|(rows, x)| Matrix::<Lane, D>::read(*rows, n, x));
    for _ in 0..MAX_SWEEPS {
        let mut moved = false;
        for p in 0..n {
            for q in p + 1..n {
                let (mut pp, mut qq, mut pq) = (Lane::ZERO, Lane::ZERO, [Lane::ZERO; D]);
                for i in 0..a.rows() {
                    let (x, y) = (a[(i, p)], a[(i, q)]);
                    pp = inner_add(x, x, pp);
                    qq = inner_add(y, y, qq);
                    pq = mul_add::<Lane, D, true>(y, x, pq);
                }
                let on = inner_add(pq, pq, Lane::ZERO)
                    .simd_gt(lane(NEGLIGIBLE_PAIR * NEGLIGIBLE_PAIR) * (pp * qq));
                if on.none() {
                    continue;
                }
                moved = true;
                let (c, s) = rotation(lane(0.5) * (pp - qq), pq);
                let (c, s) = (on.select(c, Lane::ONE), s.each(|s| on.select(s, Lane::ZERO)));
                rotate_columns(a, (p, q), c, s);
                if let Some(v) = &mut v {
                    rotate_columns(v, (p, q), c, s);
                }
            }
        }
        if !moved {
            break;
        }
    }
    matrix.write(numbers);
    if let (Some(v), Some((_, x))) = (v, turn) {
        v.write(x.as_mut_slice());
    }
}

/// Sorts the columns of several matrices in the same order by decreasing keys, lane by lane.
pub fn sort_columns<const D: usize, A: Storage>(keys: &mut [Lane], matrices: &mut [&mut Matrix<Lane, D, A>]) {
    let n = keys.len();
    for pass in 0..n {
        for j in 0..n - 1 - pass {
            let swap = keys[j].simd_lt(keys[j + 1]);
            if swap.none() {
                continue;
            }
            let (a, b) = (keys[j], keys[j + 1]);
            (keys[j], keys[j + 1]) = (swap.select(b, a), swap.select(a, b));
            for m in matrices.iter_mut() {
                for i in 0..m.rows() {
                    for c in 0..D {
                        let (a, b) = (m[(i, j)][c], m[(i, j + 1)][c]);
                        (m[(i, j)][c], m[(i, j + 1)][c]) = (swap.select(b, a), swap.select(a, b));
                    }
                }
            }
        }
    }
}
