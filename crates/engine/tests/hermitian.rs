//! Functions of Hermitian matrices: exponential and logarithm are inverse over decades of size, and series and
//! eigenvectors agree where eigenvalues coincide or nearly do, derivatives included.

use symspline_engine::matrix::{
    Matrix, Unary, arc, diagonalize, exp_minus_one, exp_skew_minus_one, function_of, log_one_plus,
    orthogonalize, orthonormalize, reorthonormalize, trig,
};
use symspline_engine::scalar::{Dual, Jet, Lane, Scalar, lane};

/// Pseudo-random numbers, equal in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64) / (1_u64 << 52) as f64 - 1.0
    }

    fn matrix<const D: usize>(&mut self, n: usize) -> Matrix<Lane, D> {
        Matrix::from_fn(n, n, |_, _| std::array::from_fn(|_| Lane::new(std::array::from_fn(|_| self.next()))))
    }

    /// A Hermitian matrix with given eigenvalues.
    fn with_eigenvalues<const D: usize>(&mut self, values: &[f64]) -> Matrix<Lane, D> {
        let mut q = self.matrix::<D>(values.len());
        orthonormalize(&mut q);
        let diagonal: Vec<Lane> = values.iter().map(|&x| lane(x)).collect();
        q.times(&Matrix::diagonal(&diagonal)).times_adjoint(&q).hermitian_part()
    }

    /// A matrix with random Hermitian derivatives.
    fn with_derivatives<S: Scalar, const D: usize>(&mut self, value: &Matrix<Lane, D>) -> Matrix<S, D> {
        let n = value.rows();
        let (d, dd) = (self.matrix::<D>(n).hermitian_part(), self.matrix::<D>(n).hermitian_part());
        Matrix::from_fn(n, n, |i, j| {
            std::array::from_fn(|c| S::from_parts([value[(i, j)][c], d[(i, j)][c], dd[(i, j)][c]]))
        })
    }
}

/// The largest difference of values, first and second derivatives.
fn difference<S: Scalar, const D: usize>(a: &Matrix<S, D>, b: &Matrix<S, D>) -> [f64; 3] {
    let d = a - b;
    std::array::from_fn(|k| {
        let numbers = d.entries().iter().flatten().flat_map(|x| x.parts()[k].to_array());
        numbers.fold(0.0, |m: f64, x| if x.is_nan() { f64::NAN } else { m.max(x.abs()) })
    })
}

fn log_by_eigenvectors<S: Scalar, const D: usize>(b: &Matrix<S, D>) -> Matrix<S, D> {
    let log = |x: Lane| {
        let y = x + Lane::ONE;
        [y.ln(), Lane::ONE / y, lane(-1.0) / (y * y)]
    };
    function_of(b, &Unary { f: log, pole_distance: |x: Lane| (x + Lane::ONE).abs() })
}

fn series_and_eigenvectors_agree<S: Scalar, const D: usize>() {
    let mut noise = Noise(1);
    for gap in std::iter::once(0.0).chain((1..=17).map(|e| 10_f64.powi(-e))) {
        for values in [
            vec![0.1, 0.1 + gap],
            vec![-0.05, 0.1, 0.1 + gap],
            vec![0.1, 0.1 + gap, 0.1 - 2.0 * gap],
            vec![0.02, -0.03, -0.03 + gap, 0.05, -0.03 - gap],
        ] {
            let b = noise.with_eigenvalues::<D>(&values);
            let b = noise.with_derivatives::<S, D>(&b);
            let d = difference(&log_one_plus(&b), &log_by_eigenvectors(&b));
            // Values of ln(1 + x) for the argument 1 + x have an error of ε; derivatives have ten times that where
            // quotients replace the quadratures.
            for (d, allowed) in d.iter().zip([2e-15, 2e-14, 4e-13]) {
                assert!(*d <= allowed, "gap {gap}, {values:?}: {d}");
            }
        }
    }
}

#[test]
fn divided_differences_are_smooth_where_eigenvalues_meet() {
    series_and_eigenvectors_agree::<Lane, 1>();
    series_and_eigenvectors_agree::<Dual, 2>();
    series_and_eigenvectors_agree::<Jet, 1>();
    series_and_eigenvectors_agree::<Jet, 2>();
}

fn log_undoes_exp<S: Scalar, const D: usize>() {
    let mut noise = Noise(2);
    for n in [1, 2, 3, 4, 5, 8] {
        for size in (-12..=0).map(|e| 10_f64.powi(e)).chain([0.049, 0.051, 0.34, 0.36, 2.0, 4.0]) {
            let a = noise.matrix::<D>(n).hermitian_part();
            let a = noise.with_derivatives::<S, D>(&a.scaled(lane(size / n as f64)));
            let d = difference(&log_one_plus(&exp_minus_one(&a)), &a);
            // Eigenvalues of e^A are accurate to ε times the largest.
            let condition = (2.0 * size).exp();
            assert!(d[0] <= 4e-15 * condition * size.max(1e-30), "n = {n}, size {size}: {d:?}");
            assert!(d[1] <= 4e-14 * condition && d[2] <= 1e-12 * condition, "n = {n}, size {size}: {d:?}");
        }
    }
}

#[test]
fn logarithm_undoes_exponential_over_decades() {
    log_undoes_exp::<Lane, 1>();
    log_undoes_exp::<Lane, 2>();
    log_undoes_exp::<Jet, 1>();
    log_undoes_exp::<Jet, 2>();
}

#[test]
fn skew_exponentials_are_unitary_and_double() {
    let mut noise = Noise(3);
    for n in [1, 2, 3, 4, 8] {
        for size in [1e-9, 1e-3, 0.2, 1.0, 1.6, 3.0, 30.0] {
            let omega = noise.matrix::<2>(n).skew_part().scaled(lane(size / n as f64));
            let e = exp_skew_minus_one(&omega);
            let q = e.clone().plus_identity(Lane::ONE);
            let defect = q.adjoint_times(&q).plus_identity(lane(-1.0)).size().to_array()[0];
            assert!(defect <= 1e-14 * size.max(1.0), "n = {n}, size {size}: {defect}");
            let twice = exp_skew_minus_one(&omega.scaled(lane(2.0)));
            let d = difference(&twice, &e.compose(&e))[0];
            assert!(d <= 4e-14 * size.max(1.0) * size.min(1.0), "n = {n}, size {size}: {d}");
        }
    }
}

#[test]
fn trig_matches_the_eigenvalues() {
    let mut noise = Noise(4);
    for values in [vec![0.0, 1e-12], vec![0.05, 0.09, 2.4], vec![2.6, 9.0, 0.1, 1e-3], vec![400.0]] {
        let g = noise.with_eigenvalues::<1>(&values);
        let [s, k] = trig(&g);
        let (mut s, mut k) = ([s], [k]);
        diagonalize(&mut s);
        diagonalize(&mut k);
        let sorted = |m: &Matrix<Lane, 1>| {
            let mut x: Vec<f64> = (0..values.len()).map(|i| m[(i, i)][0].to_array()[0]).collect();
            x.sort_by(f64::total_cmp);
            x
        };
        let expected = |f: fn(f64) -> f64| {
            let mut x: Vec<f64> = values.iter().map(|&x| f(x)).collect();
            x.sort_by(f64::total_cmp);
            x
        };
        let sine = expected(|x| if x < 1e-6 { 1.0 - x / 6.0 } else { x.sqrt().sin() / x.sqrt() });
        let versine =
            expected(|x| if x < 1e-6 { -0.5 + x / 24.0 } else { -2.0 * (0.5 * x.sqrt()).sin().powi(2) / x });
        for (found, expected) in [(sorted(&s[0]), sine), (sorted(&k[0]), versine)] {
            for (a, b) in found.iter().zip(&expected) {
                assert!((a - b).abs() <= 1e-14, "{values:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn arc_matches_the_eigenvalues() {
    let mut noise = Noise(5);
    for values in [
        vec![0.0, 1e-15],
        vec![0.007, 0.0076],
        vec![0.2, 0.29, 0.31],
        vec![0.5, 0.79, 0.2, 0.1],
        vec![1.2, 1.99],
        vec![0.7, 0.1, 0.3],
    ] {
        let mut f = [arc(&noise.with_eigenvalues::<2>(&values))];
        diagonalize(&mut f);
        let mut found: Vec<f64> = (0..values.len()).map(|i| f[0][(i, i)][0].to_array()[0]).collect();
        let mut expected: Vec<f64> = values
            .iter()
            .map(|&y: &f64| if y < 1e-6 { 1.0 + y / 3.0 } else { (1.0 - y).acos() / (y * (2.0 - y)).sqrt() })
            .collect();
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        for (a, b) in found.iter().zip(&expected) {
            assert!((a / b - 1.0).abs() <= 3e-14, "{values:?}: {a} {b}");
        }
    }
}

#[test]
fn derivatives_of_arc_are_divided_differences() {
    // In the basis of eigenvectors; beyond 0.8 there is no power series.
    for (x, y) in
        [(0.1, 0.2), (0.5, 0.7), (0.9, 1.0), (0.9, 1.2), (1.2, 1.5), (1.5, 1.8), (1.9, 1.95), (0.1, 1.9)]
    {
        let off = Dual { v: lane(0.0), d: lane(1.0) };
        let h = Matrix::<Dual, 1>::from_fn(2, 2, |i, j| {
            [if i == j { Dual::constant(lane([x, y][i])) } else { off }]
        });
        let found = arc(&h)[(0, 1)][0].d.to_array()[0];
        let f = |y: f64| (1.0 - y).acos() / (y * (2.0 - y)).sqrt();
        let expected = (f(y) - f(x)) / (y - x);
        assert!((found / expected - 1.0).abs() <= 1e-12, "{x}, {y}: {found}, not {expected}");
    }
}

/// The distance of columns from orthonormal ones.
fn defect<const D: usize>(q: &Matrix<Lane, D>) -> Lane {
    q.adjoint_times(q).plus_identity(lane(-1.0)).size()
}

#[test]
fn columns_that_are_nearly_parallel_become_orthonormal_to_rounding() {
    let mut noise = Noise(7);
    for apart in [1.0, 1e-3, 1e-7, 1e-11] {
        let x = noise.matrix::<2>(4);
        let mut q = Matrix::<Lane, 2>::from_fn(4, 4, |i, j| {
            std::array::from_fn(|c| x[(i, 0)][c] + x[(i, j)][c] * lane(if j > 0 { apart } else { 0.0 }))
        });
        orthonormalize(&mut q);
        for off in defect(&q).to_array() {
            assert!(off <= 2e-15, "{apart} apart: {off}");
        }
    }
}

#[test]
fn a_step_squares_the_distance_to_orthonormal_columns() {
    let mut noise = Noise(8);
    for size in [1e-2, 1e-4, 1e-6] {
        let mut q = noise.matrix::<2>(4);
        orthonormalize(&mut q);
        q = &q + &noise.matrix::<2>(4).scaled(lane(size));
        let before = defect(&q);
        reorthonormalize(&mut q);
        // Q*Q = 1 + D becomes (1 + D)(1 − D/2)² = 1 − ¾ D² + ¼ D³.
        for (off, before) in defect(&q).to_array().into_iter().zip(before.to_array()) {
            assert!(off <= 0.8 * before * before + 2e-15, "{before} off becomes {off}");
        }
    }
}

#[test]
fn singular_values_are_accurate_in_graded_matrices() {
    let mut noise = Noise(6);
    for n in [2, 3, 6] {
        let mut q = noise.matrix::<1>(n);
        orthonormalize(&mut q);
        // Columns with lengths 1, 1e-4, 1e-8, …
        let mut a =
            Matrix::<Lane, 1>::from_fn(n, n, |i, j| [q[(i, j)][0] * lane(10_f64.powi(-4 * j as i32))]);
        orthogonalize(&mut a, None);
        for j in 0..n {
            let length = (0..n).fold(Lane::ZERO, |s, i| s + a[(i, j)][0] * a[(i, j)][0]).sqrt().to_array();
            for x in length {
                let expected = 10_f64.powi(-4 * j as i32);
                assert!((x / expected - 1.0).abs() <= 1e-14, "n = {n}, column {j}: {x}");
            }
        }
    }
}
