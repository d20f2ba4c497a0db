//! The logarithm of subspaces, accurate up to the cut locus.

use symspline_core::matrix::{Matrix, Storage, arc, by_size, orthogonalize, orthonormalize, sort_columns};
use symspline_core::scalar::{Each, Lane, Scalar, few, lane, max_or_nan};
use symspline_core::special::theta_over_sin;

/// 1 − cos 2θ up to which the logarithm is a power series.
const SERIES: f64 = 0.8;

/// The logarithm at X of a subspace Y, given its part `top = X*Y` and the rest, in any coordinates.
///
/// With M = X*Y and Z = (1 − XX*)Y it is `Z M* f`, f = θ/(sin θ cos θ) of the principal angles, which is a function
/// of `1 − MM* = sin²θ` and does not depend on the representative Y. Returns the deciding angle, or an upper bound of
/// it below the cut locus.
pub fn log_from<S: Scalar, const D: usize, A: Storage>(
    top: &Matrix<S, D, A>,
    rest: &Matrix<S, D, A>,
) -> (Matrix<S, D, A>, Lane) {
    let square = top.times_adjoint_hermitian(top);
    // 2 sin²θ = 1 − cos 2θ
    let versine = (-square.clone()).plus_identity(Lane::ONE).scaled(lane(2.0));
    if top.rows() == 1 {
        let cos2 = square[(0, 0)][0];
        let twice = lane(2.0) * cos2.value();
        let f = theta_over_sin(versine[(0, 0)][0], || twice);
        let log = rest.times_adjoint(top).times_scalar(f);
        let angle = rest.value().size().atan2(cos2.value().sqrt());
        return (log, angle);
    }
    let size = versine.size();
    let mut angle = lane(0.7);
    let log = by_size(size, &[SERIES], |tier| {
        if tier == 0 {
            return rest.times(&top.adjoint_times(&arc(&versine)));
        }
        let (value, exact) = principal(&top.value(), &rest.value());
        angle = size.simd_le(lane(SERIES)).select(angle, exact);
        if S::ORDER == 0 {
            return value.map(S::constant);
        }
        let with_derivatives = rest.times(&top.adjoint_times(&arc(&versine)));
        // If the subspaces do not move, derivatives are zero at the cut locus, too, where those of the function are
        // not finite.
        let moves = |m: &Matrix<S, D, A>| {
            m.entries().as_flattened().iter().fold(Lane::ZERO, |any, x| {
                let [_, d, dd] = x.parts();
                any | d.simd_ne(Lane::ZERO) | dd.simd_ne(Lane::ZERO)
            })
        };
        let moving = moves(top) | moves(rest);
        Matrix::from_fn(value.rows(), value.cols(), |i, j| {
            few(|c| {
                let [_, d, dd] = with_derivatives[(i, j)][c].parts().each(|x| moving.select(x, Lane::ZERO));
                S::from_parts([value[(i, j)][c], d, dd])
            })
        })
    });
    let bound = size.simd_le(lane(SERIES)).select(log.size(), angle);
    (log, angle.min(bound))
}

/// The logarithm by principal vectors, Σ z_i (θ_i/sin θ_i) u_i* with M = U cos θ V* and Z V = (z_i): accurate
/// to the cut locus, θ = π/2.
#[inline(never)]
fn principal<const D: usize, A: Storage>(
    top: &Matrix<Lane, D, A>,
    rest: &Matrix<Lane, D, A>,
) -> (Matrix<Lane, D, A>, Lane) {
    let k = top.rows();
    let mut v = top.adjoint();
    let mut u = Matrix::identity(k);
    orthogonalize(&mut v, Some(&mut u));
    let length = |m: &Matrix<Lane, D, A>, j: usize| {
        (0..m.rows()).flat_map(|i| m[(i, j)]).fold(Lane::ZERO, |sum, x| x.mul_add(x, sum)).sqrt()
    };
    let mut cosines: Vec<Lane> = (0..k).map(|j| length(&v, j)).collect();
    sort_columns(&mut cosines, &mut [&mut v, &mut u]);
    // The directions of the smallest cosines are the least accurate; they come last.
    orthonormalize(&mut v);
    let mut z = rest.times(&v);
    let mut angle = Lane::ZERO;
    for j in 0..k {
        let sine = length(&z, j);
        // At the cut locus the logarithm has no direction.
        let sine_or_one = sine.is_nan().select(Lane::ONE, sine);
        let theta = sine_or_one.atan2(cosines[j]);
        angle = max_or_nan(angle, theta);
        let factor = sine.simd_eq(Lane::ZERO).select(Lane::ONE, theta / sine);
        for i in 0..z.rows() {
            z[(i, j)] = z[(i, j)].each(|x| x * factor);
        }
    }
    (z.times_adjoint(&u), angle)
}
