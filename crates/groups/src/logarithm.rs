//! The logarithm of unitary matrices by eigenvectors, accurate up to the cut locus.

use std::f64::consts::PI;
use symspline_core::matrix::{Matrix, Unary, diagonalize, multiply_add, sort_columns};
use symspline_core::scalar::{Each, Lane, lane, max_or_nan};

/// 1 − cos θ up to which the logarithm is a power series; θ is 1.37 there.
pub const SERIES: f64 = 0.8;

/// Where a sum of angles can be 2π, the principal logarithm of SU(n) may have a nonzero trace.
pub fn su_limit(n: f64) -> f64 {
    SERIES.min(n.sqrt() * (1.0 - (6.0 / n).min(PI).cos()))
}

/// Converts a matrix to a complex one.
pub fn complex<const D: usize>(n: usize, numbers: &[Lane]) -> Matrix<Lane, 2> {
    Matrix::from_fn(n, n, |i, j| {
        let x = &numbers[(i * n + j) * D..][..D];
        [x[0], if D == 1 { Lane::ZERO } else { x[D - 1] }]
    })
}

/// The numbers of a complex matrix that exist for D = 1 (the real ones) or D = 2.
fn numbers<const D: usize>(m: &Matrix<Lane, 2>) -> Vec<Lane> {
    m.entries().iter().flat_map(|x| x[..D].iter().copied()).collect()
}

/// The angles θ of the eigenvalues e^{iθ} of Q = 1 + E, and the eigenvectors.
fn eigen(e: &Matrix<Lane, 2>) -> (Vec<Lane>, Matrix<Lane, 2>) {
    let q = e.clone().plus_identity(Lane::ONE);
    let mut both = [q.hermitian_part(), times_minus_i(q.skew_part())];
    let v = diagonalize(&mut both);
    let [cosine, sine] = &both;
    ((0..q.rows()).map(|i| sine[(i, i)][0].atan2(cosine[(i, i)][0])).collect(), v)
}

/// The angles of 1 + E, at the cut locus too.
pub fn angles(e: &Matrix<Lane, 2>) -> Vec<Lane> {
    eigen(e).0
}

/// The principal logarithm of a matrix from the numbers of its value and its derivatives, likewise, and its angle, see
/// [`principal`].
pub fn log_of_parts<const D: usize>(n: usize, parts: &[Vec<Lane>], su: bool) -> (Vec<Vec<Lane>>, Lane) {
    let parts: Vec<_> = parts.iter().map(|part| complex::<D>(n, part)).collect();
    let (log, angle) = principal(&parts, su, D == 1);
    (log.iter().map(numbers::<D>).collect(), angle)
}

/// The logarithm of Q = 1 + E by eigenvectors, with its derivatives, and its deciding angle: every angle is known
/// to rounding, also near π. For SU(n) the angles add up to zero.
///
/// Derivatives of T with Q = e^{iT} solve `Q' = e^{iT}'`, with the divided differences of `e^{iθ}`.
fn principal(parts: &[Matrix<Lane, 2>], su: bool, real: bool) -> (Vec<Matrix<Lane, 2>>, Lane) {
    let n = parts[0].rows();
    let (mut theta, mut v) = eigen(&parts[0]);
    let angle = if su {
        sort_columns(&mut theta, &mut [&mut v]);
        spread_phases(&mut theta)
    } else {
        theta.iter().fold(Lane::ZERO, |m, x| max_or_nan(m, x.abs()))
    };
    let mut t = vec![Matrix::diagonal(&theta)];
    if parts.len() > 1 {
        let basis = |m: &Matrix<Lane, 2>| v.adjoint_times(m).times(&v);
        let over = |m: &Matrix<Lane, 2>| {
            Matrix::from_fn(n, n, |i, j| divide(m[(i, j)], turning(&[theta[i], theta[j]])))
        };
        let d = over(&basis(&parts[1]));
        if parts.len() > 2 {
            let mut dd = basis(&parts[2]);
            for (i, j, k) in (0..n * n * n).map(|c| (c / n / n, c / n % n, c % n)) {
                let twice = turning(&[theta[i], theta[k], theta[j]]).each(|x| x * lane(-2.0));
                dd[(i, j)] =
                    multiply_add(multiply_add(twice, d[(i, k)], [Lane::ZERO; 2]), d[(k, j)], dd[(i, j)]);
            }
            t.extend([d, over(&dd)]);
        } else {
            t.push(d);
        }
    }
    // log Q = iT
    let mut log: Vec<_> =
        t.iter().map(|t| times_minus_i(-v.times(t).times_adjoint(&v)).skew_part()).collect();
    if real {
        log[0] = rotation_planes(&theta, &v);
    }
    (log, angle)
}

/// The real logarithm Σ θ (x yᵀ − y xᵀ) by eigenvectors x + iy of angles θ > 0.
///
/// Near π rounding errors mix eigenvectors of ±θ, but do not change the plane of x and y.
fn rotation_planes(theta: &[Lane], v: &Matrix<Lane, 2>) -> Matrix<Lane, 2> {
    let n = theta.len();
    let mut log = Matrix::zeros(n, n);
    for (k, &angle) in theta.iter().enumerate() {
        let product =
            |c: usize, d: usize| (0..n).fold(Lane::ZERO, |s, i| v[(i, k)][c].mul_add(v[(i, k)][d], s));
        let area2 = product(0, 0) * product(1, 1) - product(0, 1) * product(0, 1);
        let positive = angle.simd_gt(Lane::ZERO) & area2.simd_gt(Lane::ZERO);
        let factor = positive.select(angle / area2.sqrt(), Lane::ZERO);
        for i in 0..n {
            for j in 0..n {
                let (a, b): ([Lane; 2], [Lane; 2]) = (v[(i, k)], v[(j, k)]);
                log[(i, j)][0] += factor * (a[0] * b[1] - a[1] * b[0]);
            }
        }
    }
    log
}

/// −i M: Hermitian for a skew-Hermitian M.
pub fn times_minus_i(m: Matrix<Lane, 2>) -> Matrix<Lane, 2> {
    m.map_entries(|[re, im]| [im, -re])
}

fn divide([a, b]: [Lane; 2], [c, d]: [Lane; 2]) -> [Lane; 2] {
    let inverse = Lane::ONE / (c * c + d * d);
    [(a * c + b * d) * inverse, (b * c - a * d) * inverse]
}

/// Divided difference of e^{iθ} over two or three angles.
fn turning(angles: &[Lane]) -> [Lane; 2] {
    let pole_distance = |_: Lane| lane(3.0);
    let cos = Unary {
        f: |x: Lane| {
            let (sin, cos) = x.sin_cos();
            [cos, -sin, -cos]
        },
        pole_distance,
    };
    let sin = Unary {
        f: |x: Lane| {
            let (sin, cos) = x.sin_cos();
            [sin, cos, -sin]
        },
        pole_distance,
    };
    match *angles {
        [a, b] => [cos.first(a, b), sin.first(a, b)],
        [a, b, c] => [cos.second(a, b, c), sin.second(a, b, c)],
        _ => unreachable!("two or three angles"),
    }
}

/// Shifts decreasing angles by multiples of 2π so that they add up to zero; returns their spread.
fn spread_phases(theta: &mut [Lane]) -> Lane {
    let n = theta.len();
    let turns = (theta.iter().fold(Lane::ZERO, |sum, x| sum + *x) / lane(2.0 * PI)).round();
    for (j, x) in theta.iter_mut().enumerate() {
        let down = turns.simd_gt(lane(j as f64));
        let up = turns.simd_lt(lane(-((n - 1 - j) as f64)));
        *x += up.select(lane(2.0 * PI), down.select(lane(-2.0 * PI), Lane::ZERO));
    }
    let (most, least) = theta.iter().fold((theta[0], theta[0]), |(a, b), x| (a.max(*x), b.min(*x)));
    most - least
}
