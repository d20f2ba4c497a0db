//! Membership of matrices in a group: the distance, the nearest member, and the condition that is violated.

use symspline_core::matrix::{Matrix, Select, Storage, determinant, inverse};
use symspline_core::scalar::{Lane, Scalar, lane, max_or_nan};

/// Closed subgroups of GL(n), and GL(n) itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Members {
    /// Every invertible matrix.
    All,
    /// x ↦ Ax + b as (A, b; 0, 1).
    Affine,
    /// x ↦ sRx + b with a rotation R and s > 0.
    Similarity,
    /// Determinant one.
    Special,
    /// XᵀJX = J with J = (0, 1; −1, 0).
    Symplectic,
    /// XᵀηX = η with η = diag(−1, 1, …, 1), of determinant one and keeping the direction of time.
    Lorentz,
    /// O(p, q): XᵀηX = η with η = diag(−1, …, −1, 1, …, 1), which has this number of negative entries.
    PseudoOrthogonal(usize),
}

/// The condition number from which a matrix is numerically singular.
const SINGULAR: f64 = 1e14;

type Point<const D: usize> = Matrix<Lane, D>;

impl Members {
    /// The number of rows of the matrices for the n of the name, or why n is invalid.
    pub fn rows(self, n: usize) -> Result<usize, String> {
        let (name, least) = match self {
            Members::All => ("GeneralLinear", 1),
            Members::Affine => ("Affine", 1),
            Members::Similarity => ("Similarity", 2),
            Members::Special => ("SpecialLinear", 2),
            Members::Symplectic => ("Symplectic", 2),
            Members::Lorentz => ("Lorentz", 1),
            Members::PseudoOrthogonal(_) => ("PseudoOrthogonal", 1),
        };
        if n < least {
            return Err(format!("{name}(n) needs n >= {least}, not {n}"));
        }
        match self {
            Members::Symplectic if n % 2 == 1 => Err(format!("Symplectic(n) needs an even n, not {n}")),
            Members::Affine | Members::Similarity | Members::Lorentz => Ok(n + 1),
            _ => Ok(n),
        }
    }

    /// Whether the last row is (0, …, 0, 1).
    fn maps(self) -> bool {
        matches!(self, Members::Affine | Members::Similarity)
    }

    /// Whether matrices of negative determinant form a second component.
    pub fn two_parts(self) -> bool {
        matches!(self, Members::All | Members::Affine)
    }

    /// The number of negative entries of η.
    pub fn negative(self) -> usize {
        match self {
            Members::Lorentz => 1,
            Members::PseudoOrthogonal(p) => p,
            _ => 0,
        }
    }

    /// The adjoint X* of a form, for which X*X = 1 on its group.
    #[inline(always)]
    pub fn adjoint<S: Scalar, const D: usize, A: Storage>(
        self,
        x: &Matrix<S, D, A>,
    ) -> Option<Matrix<S, D, A>> {
        let n = x.rows();
        let entry = |i: usize, j: usize, minus: bool| {
            let x = x[(i, j)];
            if minus { x.map(|x| -x) } else { x }
        };
        match self {
            Members::Symplectic => {
                let m = n / 2;
                let other = |i: usize| (i + m) % n;
                Some(Matrix::from_fn(n, n, |i, j| entry(other(j), other(i), (i < m) != (j < m))))
            }
            Members::Lorentz | Members::PseudoOrthogonal(_) => {
                let p = self.negative();
                Some(Matrix::from_fn(n, n, |i, j| entry(j, i, (i < p) != (j < p))))
            }
            _ => None,
        }
    }

    /// X*X − 1; for similarities that of their linear part, with the mean of the diagonal as the unit.
    fn defect<const D: usize>(self, x: &Point<D>) -> Option<Point<D>> {
        let (product, unit) = if self == Members::Similarity {
            let part = linear(x, x.rows() - 1);
            let product = part.adjoint_times(&part);
            let unit = product.trace() / lane(part.rows() as f64);
            (product, unit)
        } else {
            (self.adjoint(x)?.times(x), Lane::ONE)
        };
        Some(product.scaled(Lane::ONE / unit).plus_identity(lane(-1.0)))
    }

    /// Replaces a matrix by one of the group close to it; returns the distance.
    pub fn project<const D: usize>(self, p: &mut Point<D>) -> Lane {
        let n = p.rows();
        let mut off = Lane::ZERO;
        if self.maps() {
            for j in 0..n {
                let expected = if j + 1 == n { Lane::ONE } else { Lane::ZERO };
                // Translations that are not finite are far off, too: 0·∞ is NaN.
                off = max_or_nan(off, (p[(n - 1, j)][0] - expected).abs() + p[(j, n - 1)][0] * Lane::ZERO);
                p[(n - 1, j)][0] = expected;
            }
        }
        // A numerically singular matrix is not close to any member.
        let condition = condition(p);
        off = condition.simd_lt(lane(SINGULAR)).select(off, lane(f64::NAN));
        let rounding = lane(4.0 * n as f64 * f64::EPSILON) * condition.max(Lane::ONE);
        if self == Members::Special {
            let det = determinant(p)[0];
            let wrong = (det - Lane::ONE).abs();
            off = max_or_nan(off, det.simd_gt(Lane::ZERO).select(wrong, lane(f64::NAN)));
            let scale = (det.ln() * lane(-1.0 / n as f64)).exp();
            let scaled = p.scaled(scale);
            *p = Select::select(wrong.simd_le(rounding), p.clone(), scaled);
        }
        if let Some(mut defect) = self.defect(p) {
            let wrong = defect.size() * lane(0.5);
            off = max_or_nan(off, wrong);
            let start = p.clone();
            let m = defect.rows();
            for _ in 0..4 {
                // Newton's method for the factor of a polar decomposition.
                let part = linear(p, m);
                put(p, &(&part - &part.times(&defect.scaled(lane(0.5)))));
                defect = self.defect(p).unwrap_or(defect);
            }
            *p = Select::select(wrong.simd_le(rounding), start, p.clone());
        }
        if matches!(self, Members::Similarity | Members::Lorentz) {
            let mut good = determinant(p)[0].simd_gt(Lane::ZERO);
            if self == Members::Lorentz {
                good &= p[(0, 0)][0].simd_gt(Lane::ZERO);
            }
            off = good.select(off, lane(f64::NAN));
        }
        off
    }

    /// Describes why x, which is finite, is not a point.
    pub fn violation<const D: usize>(self, p: &Point<D>) -> String {
        let n = p.rows();
        let number = |x: Lane| x.to_array()[0];
        if self.maps() {
            let last: Vec<f64> = (0..n).map(|j| number(p[(n - 1, j)][0])).collect();
            if last.iter().enumerate().any(|(j, x)| (x - if j + 1 == n { 1.0 } else { 0.0 }).abs() > 1e-8) {
                return format!("its last row is {last:?}, not (0, …, 0, 1)");
            }
        }
        let (condition, size) = (number(condition(p)), number(p.size()));
        if !(size > 0.0 && size.is_finite()) {
            return "it is zero, or the squares of its entries overflow or underflow".into();
        }
        if !(condition < SINGULAR) {
            return format!("it is singular: its condition number is {condition:.1e}");
        }
        let det = number(determinant(p)[0]);
        let off = self.defect(p).map_or(0.0, |defect| number(defect.size()));
        match self {
            Members::Special => format!("its determinant is {det:.9e}, not 1"),
            Members::Symplectic => format!("it is not symplectic: |J⁻¹xᵀJx - 1| = {off:.3e}"),
            Members::Lorentz if off > 1e-8 => {
                format!("it does not preserve -t² + x²: |ηxᵀηx - 1| = {off:.3e}")
            }
            Members::Lorentz if det < 0.0 => "its determinant is -1: it is a reflection".into(),
            Members::Lorentz => "it turns time round: its first number is negative".into(),
            Members::Similarity if off > 1e-8 => {
                format!("its linear part is not a multiple of a rotation: |rᵀr/s² - 1| = {off:.3e}")
            }
            Members::PseudoOrthogonal(p) => {
                format!(
                    "it does not preserve the form with {p} negative squares first: |ηxᵀηx - 1| = {off:.3e}"
                )
            }
            Members::Similarity => "its linear part is a reflection, not a rotation".into(),
            Members::All | Members::Affine => String::new(),
        }
    }
}

/// The first m rows and columns.
fn linear<const D: usize>(x: &Point<D>, m: usize) -> Point<D> {
    Matrix::from_fn(m, m, |i, j| x[(i, j)])
}

/// Replaces the first rows and columns.
fn put<const D: usize>(x: &mut Point<D>, part: &Point<D>) {
    for i in 0..part.rows() {
        for j in 0..part.cols() {
            x[(i, j)] = part[(i, j)];
        }
    }
}

/// |p| |p⁻¹|/n: one for a multiple of a rotation.
pub fn condition<const D: usize, A: Storage>(p: &Matrix<Lane, D, A>) -> Lane {
    p.size() * inverse(p).size() / lane(p.rows() as f64)
}
