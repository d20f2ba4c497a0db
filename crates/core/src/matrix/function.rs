//! Analytic functions of a Hermitian matrix by its eigenvectors, with derivatives.
//!
//! Eigenvectors are never differentiated. With `H = V Λ V*` and derivatives `H̃ = V* H' V` in the basis
//! of eigenvectors, `f(H)'` has entries `f[λᵢ,λⱼ] H̃ᵢⱼ` (Daleckii & Krein 1965), and the second derivative
//! adds `2 Σₖ f[λᵢ,λₖ,λⱼ] H̃ᵢₖ H̃ₖⱼ`. Divided differences are integrals of derivatives over segment and
//! triangle (Hermite & Genocchi), which is how they are computed where their arguments are close.

use super::base::{Matrix, Storage};
use super::dense::reorthonormalize;
use super::eigen::diagonalize;
use super::entry::mul_add;
use super::select::by_size;
use crate::scalar::{Each, Lane, Scalar, few, lane};

/// A function of a real variable for [`function_of`].
pub struct Unary {
    /// f, f', f''
    pub f: fn(Lane) -> [Lane; 3],
    /// Distance from x to the nearest singularity of f, up to a constant factor.
    pub pole_distance: fn(Lane) -> Lane,
}

/// Arguments closer than this fraction of their distance from a pole count as close: the quadratures below are
/// accurate to rounding for them, and quotients of other arguments lose little more than one significant digit.
const CLOSE: f64 = 0.1;

/// Nodes and weights of Gauss and Legendre on [0, 1].
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

impl Unary {
    /// The divided difference f[x, y].
    pub fn first(&self, x: Lane, y: Lane) -> Lane {
        let gap = y - x;
        let close = gap.abs().simd_le(lane(CLOSE) * (self.pole_distance)(x).min((self.pole_distance)(y)));
        let mut result = ((self.f)(y)[0] - (self.f)(x)[0]) / gap;
        if close.any() {
            let mut mean = Lane::ZERO;
            for (s, w) in GAUSS {
                mean = lane(w).mul_add((self.f)(lane(s).mul_add(gap, x))[1], mean);
            }
            result = close.select(mean, result);
        }
        result
    }

    /// The divided difference f[x, y, z].
    pub fn second(&self, x: Lane, y: Lane, z: Lane) -> Lane {
        // The two arguments that are farthest apart become the first and the last.
        let (xy, yz, zx) = ((y - x).abs(), (z - y).abs(), (x - z).abs());
        let to_xy = xy.simd_gt(zx) & xy.simd_ge(yz);
        let to_yz = yz.simd_gt(zx) & yz.simd_gt(xy);
        let (x, y, z) = (to_yz.select(y, x), to_xy.select(z, to_yz.select(x, y)), to_xy.select(y, z));
        let gap = z - x;
        let pole_distance = (self.pole_distance)(x).min((self.pole_distance)(y)).min((self.pole_distance)(z));
        let close = gap.abs().simd_le(lane(CLOSE) * pole_distance);
        let mut result = if close.all() { Lane::ZERO } else { (self.first(y, z) - self.first(x, y)) / gap };
        if close.any() {
            let mut mean = Lane::ZERO;
            for (s, ws) in GAUSS {
                for (r, wr) in GAUSS {
                    let at = lane(s).mul_add(lane(r).mul_add(z - y, y - x), x);
                    mean = lane(s * ws * wr).mul_add((self.f)(at)[2], mean);
                }
            }
            result = close.select(mean, result);
        }
        result
    }
}

/// `f(H)` of a Hermitian matrix.
pub fn function_of<S: Scalar, const D: usize, A: Storage>(h: &Matrix<S, D, A>, f: &Unary) -> Matrix<S, D, A> {
    let parts = parts_of(h);
    from_parts(h.rows(), h.cols(), &of_parts(D, h.rows(), &parts, f))
}

/// Value and derivatives of a matrix, each as plain numbers.
pub fn parts_of<S: Scalar, const D: usize, A: Storage>(m: &Matrix<S, D, A>) -> Vec<Vec<Lane>> {
    let numbers = m.entries().as_flattened();
    let mut parts = vec![vec![Lane::ZERO; numbers.len()]; 1 + S::ORDER];
    for (i, x) in numbers.iter().enumerate() {
        let x = x.parts();
        for (k, part) in parts.iter_mut().enumerate() {
            part[i] = x[k];
        }
    }
    parts
}

/// A matrix of value and derivatives.
pub fn from_parts<S: Scalar, const D: usize, A: Storage>(
    rows: usize,
    cols: usize,
    parts: &[Vec<Lane>],
) -> Matrix<S, D, A> {
    let number = |at: usize| S::from_parts(few(|k| parts.get(k).map_or(Lane::ZERO, |part| part[at])));
    Matrix::from_fn(rows, cols, |i, j| few(|c| number((i * cols + j) * D + c)))
}

/// Compiled once: it is called with numbers of any kind.
fn of_parts(d: usize, n: usize, parts: &[Vec<Lane>], f: &Unary) -> Vec<Vec<Lane>> {
    if d == 1 { parts_in::<1>(n, parts, f) } else { parts_in::<2>(n, parts, f) }
}

fn parts_in<const D: usize>(n: usize, parts: &[Vec<Lane>], f: &Unary) -> Vec<Vec<Lane>> {
    let part = |k: usize| Matrix::<Lane, D>::read(n, n, &parts[k]);
    let mut values = [part(0)];
    let v = diagonalize(&mut values);
    let eigenvalues: Vec<Lane> = (0..n).map(|i| values[0][(i, i)][0]).collect();
    let back = |m: &Matrix<Lane, D>| v.times(m).times_adjoint(&v).entries().as_flattened().to_vec();
    let diagonal: Vec<Lane> = eigenvalues.iter().map(|&x| (f.f)(x)[0]).collect();
    let mut found = vec![back(&Matrix::diagonal(&diagonal))];
    if parts.len() > 1 {
        let turned = |k: usize| v.adjoint_times(&part(k)).times(&v);
        let mut quotients = vec![Lane::ZERO; n * n];
        for i in 0..n {
            for j in i..n {
                quotients[i * n + j] = f.first(eigenvalues[i], eigenvalues[j]);
                quotients[j * n + i] = quotients[i * n + j];
            }
        }
        let scaled =
            |m: &Matrix<Lane, D>| Matrix::from_fn(n, n, |i, j| m[(i, j)].each(|x| x * quotients[i * n + j]));
        let d = turned(1);
        found.push(back(&scaled(&d)));
        if parts.len() > 2 {
            let mut dd: Matrix<Lane, D> = scaled(&turned(2));
            for i in 0..n {
                for j in 0..n {
                    for k in 0..n {
                        let q = f.second(eigenvalues[i], eigenvalues[k], eigenvalues[j]);
                        let twice = d[(i, k)].each(|x| x * (q + q));
                        dd[(i, j)] = mul_add::<Lane, D, false>(twice, d[(k, j)], dd[(i, j)]);
                    }
                }
            }
            found.push(back(&dd));
        }
    }
    found
}

/// The polar factor of a matrix whose columns are orthonormal up to `off`: the nearest matrix with orthonormal
/// columns.
pub fn polar<const D: usize, A: Storage>(a: &Matrix<Lane, D, A>, off: Lane) -> Matrix<Lane, D, A> {
    by_size(off, &[1e-3], |tier| {
        let mut u = if tier == 0 {
            a.clone()
        } else {
            let inverse_root = Unary {
                f: |x: Lane| [Lane::ONE / x.sqrt(), Lane::ZERO, Lane::ZERO],
                pole_distance: |x: Lane| x,
            };
            a.times(&function_of(&a.adjoint_times(a), &inverse_root))
        };
        (0..3).for_each(|_| reorthonormalize(&mut u));
        u
    })
}
