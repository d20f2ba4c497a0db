//! Lines of n + 1 quaternions as planes of C²ⁿ⁺². A quaternion corresponds to (a + bi, c + di; −c + di, a − bi), and the
//! lines to the planes that j maps to themselves, the fixed points of the isometry Y ↦ jY (Besse, Manifolds all of whose
//! geodesics are closed, 1978, chapter 3).

use crate::grassmannian::Subspaces;
use std::f64::consts::FRAC_1_SQRT_2;
use symspline_core::matrix::{Matrix, Select, orthonormalize, polar};
use symspline_core::scalar::{Each, Lane, lane, max_or_nan};
use symspline_core::space::Ambient;

type Plane = Matrix<Lane, 2>;

fn read(x: &[Lane]) -> Plane {
    Matrix::read(x.len() / 4, 2, x)
}

/// Quaternions, as four coordinates each, as 2 × 2 matrices of the same length.
#[inline(always)]
pub fn widen(x: &[Lane], factors: &mut [Lane]) {
    for (x, factor) in x.as_chunks::<4>().0.iter().zip(factors.as_chunks_mut::<8>().0) {
        let [a, b, c, d] = x.each(|x| x * lane(FRAC_1_SQRT_2));
        *factor = [a, b, c, d, -c, d, a, -b];
    }
}

/// The quaternions of 2 × 2 matrices.
#[inline(always)]
pub fn narrow(factors: &[Lane], x: &mut [Lane]) {
    for (factor, x) in factors.as_chunks::<8>().0.iter().zip(x.as_chunks_mut::<4>().0) {
        let [a, b, c, d, minus_c, other_d, other_a, minus_b] = *factor;
        *x = [a + other_a, b - minus_b, c - minus_c, d + other_d].each(|x| x * lane(FRAC_1_SQRT_2));
    }
}

/// j times every column: (z, w) ↦ (−w̄, z̄).
fn j_times(y: &Plane) -> Plane {
    Matrix::from_fn(y.rows(), y.cols(), |i, j| {
        let [re, im] = y[(i ^ 1, j)];
        if i % 2 == 0 { [-re, im] } else { [re, -im] }
    })
}

/// The space of all planes.
fn planes(len: usize) -> Subspaces<2> {
    Subspaces::new(2, len / 4).expect("a line of at least two quaternions is a plane of C⁴ or larger")
}

/// Replaces a plane by the nearest quaternionic line, half way to its image under j; returns the distance.
pub fn project(x: &mut [Lane]) -> Lane {
    let space = planes(x.len());
    let off = space.project(x);
    let y = read(x);
    let image = j_times(&y);
    let common = image.adjoint_times(&y);
    let apart = &y - &image.times(&common);
    let distance = apart.size() * lane(0.5);
    // Planes that equal their image up to rounding do not change.
    let rounding = distance.simd_le(lane(4.0 * x.len() as f64 * f64::EPSILON));
    if !rounding.all() {
        // The basis of the image that is nearest to that of the plane; half way is the direction of their sum.
        let turn = polar(&common, common.adjoint_times(&common).plus_identity(lane(-1.0)).size() * lane(0.5));
        let sum = (&y + &image.times(&turn)).scaled(lane(0.5));
        let middle = polar(&sum, sum.adjoint_times(&sum).plus_identity(lane(-1.0)).size() * lane(0.5));
        Select::select(rounding, y, middle).write(x);
    }
    max_or_nan(off, distance)
}

/// Replaces the second column by that of the quaternionic line of the first one.
pub fn complete(x: &mut [Lane]) {
    let mut y = read(x);
    for i in 0..y.rows() {
        let [re, im] = y[(i ^ 1, 0)];
        y[(i, 1)] = if i % 2 == 0 { [-re, im] } else { [re, -im] };
    }
    orthonormalize(&mut y);
    y.write(x);
}

/// Describes why a plane is no quaternionic line.
pub fn violation(x: &[f64]) -> String {
    /// The distance from planes with orthonormal columns that may remain.
    const OFF: Lane = lane(1e-8);
    let mut p: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
    let space = planes(x.len());
    if !space.project(&mut p).simd_le(OFF).all() {
        return space.violation(x);
    }
    let y = read(&p);
    let image = j_times(&y);
    let off = (&image - &y.times(&y.adjoint_times(&image))).size().to_array()[0];
    format!(
        "it is no quaternionic line: j times it is {off:.3e} off it (symspline.convert.quaternions_to_subspace makes \
         points of unit vectors of quaternions)"
    )
}
