//! Quaternionic projective space HPⁿ: the lines of n + 1 quaternions as planes of C²ⁿ⁺². A quaternion corresponds to
//! (a + bi, c + di; −c + di, a − bi), and the lines to the planes that j maps to themselves, the fixed points of the
//! isometry Y ↦ jY (Besse, Manifolds all of whose geodesics are closed, 1978, §3).

use crate::grassmannian::Subspaces;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, SQRT_2};
use symspline_core::matrix::Matrix;
use symspline_core::scalar::{Each, Lane, Scalar, lane};
use symspline_core::space::Part;

/// Quaternionic projective space of n quaternionic dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QuaternionicProjective {
    n: usize,
    whole: Subspaces<2>,
}

type Plane = Matrix<Lane, 2>;

impl QuaternionicProjective {
    /// Lines of n + 1 quaternions.
    pub fn new(n: usize) -> Result<Self, String> {
        let rows = n.checked_mul(2).and_then(|rows| rows.checked_add(2));
        match rows {
            Some(rows) if n > 0 => Ok(Self { n, whole: Subspaces::new(2, rows)? }),
            _ => Err("QuaternionicProjective(n) needs n >= 1".into()),
        }
    }

    fn read(&self, x: &[Lane]) -> Plane {
        Matrix::read(2 * self.n + 2, 2, x)
    }
}

/// j times every column: (z, w) ↦ (−w̄, z̄).
fn j_times(y: &Plane) -> Plane {
    Matrix::from_fn(y.rows(), y.cols(), |i, j| {
        let [re, im] = y[(i ^ 1, j)];
        if i % 2 == 0 { [-re, im] } else { [re, -im] }
    })
}

impl Part for QuaternionicProjective {
    type Whole = Subspaces<2>;
    fn whole(&self) -> Subspaces<2> {
        self.whole
    }
    fn dim(&self) -> usize {
        4 * self.n
    }
    fn curvature(&self) -> f64 {
        SQRT_2
    }
    fn injectivity_radius(&self) -> f64 {
        // Both principal angles are equal.
        SQRT_2 * FRAC_PI_2
    }
    fn widen<S: Scalar>(&self, x: &[S], wide: &mut [S]) {
        for (x, wide) in x.as_chunks::<4>().0.iter().zip(wide.as_chunks_mut::<8>().0) {
            let [a, b, c, d] = x.each(|x| x * lane(FRAC_1_SQRT_2));
            *wide = [a, b, c, d, -c, d, a, -b];
        }
    }
    fn narrow<S: Scalar>(&self, wide: &[S], x: &mut [S]) {
        for (wide, x) in wide.as_chunks::<8>().0.iter().zip(x.as_chunks_mut::<4>().0) {
            let [a, b, c, d, minus_c, other_d, other_a, minus_b] = *wide;
            *x = [a + other_a, b - minus_b, c - minus_c, d + other_d].each(|x| x * lane(FRAC_1_SQRT_2));
        }
    }
    fn mirror(&self, p: &[Lane], image: &mut [Lane]) {
        j_times(&self.read(p)).write(image);
    }
    fn mirror_vector(&self, p: &[Lane], v: &[Lane], image: &mut [Lane]) {
        let y = self.read(p);
        // jY is Yc, another basis of the plane.
        let c = y.adjoint_times(&j_times(&y));
        j_times(&self.read(v)).times_adjoint(&c).write(image);
    }
    /// The Householder reflection of quaternions that maps the first axis to the line.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        let z = self.read(p).some_cols(0, 1);
        let jz = j_times(&z);
        let mut v = Plane::from_fn(z.rows(), 2, |i, j| if j == 0 { z[(i, 0)] } else { jz[(i, 0)] });
        let head = v.some_rows(0, 2);
        let size = head.size() * lane(FRAC_1_SQRT_2);
        let none = size.simd_eq(Lane::ZERO);
        let factor = none.select(Lane::ZERO, Lane::ONE / size);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            // x + |x|·x₀/|x₀|, which avoids cancellation.
            v[(i, j)] = head[(i, j)].each(|x| x.mul_add(factor, x));
            if i == j {
                v[(i, j)][0] += none.select(Lane::ONE, Lane::ZERO);
            }
        }
        let beta = lane(-4.0) / v.inner(&v);
        v.scaled(beta).times_adjoint(&v).plus_identity(Lane::ONE).write(frame);
    }
    fn violation(&self, p: &[Lane]) -> String {
        let y = self.read(p);
        let image = j_times(&y);
        let off = (&image - &y.times(&y.adjoint_times(&image))).size().to_array()[0];
        format!(
            "it is no quaternionic line: j times it is {off:.3e} off it (symspline.convert.quaternions_to_subspace makes \
             points of unit vectors of quaternions)"
        )
    }
}
