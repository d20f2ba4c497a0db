//! The derivative of a geodesic, transposed.
//!
//! On a symmetric space, Jacobi fields along the geodesic c = [p, q]_t solve J'' = ad_v² J in parallel frames (do Carmo,
//! *Riemannian Geometry*, 1992, chapter 5), so that with v = log_p q
//!
//! ```text
//! δc = P_{p→c}(A(1−t) δp + A(t) P_{q→p} δq + v δt),   A(s) = sinh(s ad_v)/sinh(ad_v).
//! ```
//!
//! A(s) is self-adjoint and P orthogonal in every form that ad leaves invariant. The transpose is therefore the derivative
//! itself between two transports: λ ↦ P_{c→q} D_q[p, q]_t P_{c→q} λ for q, and the same for p.

use super::traits::{Ambient, Frame};
use crate::scalar::{Dual, Lane, Scalar, dot};
use smallvec::{SmallVec, smallvec};

/// A few numbers on the stack: allocating aligned lanes on the heap would cost more than the computation.
type Few<S> = SmallVec<[S; 16]>;

/// [`Ambient::pull_back`] by transports and derivatives in one direction.
#[inline(never)]
pub fn pull_back_by_transport<M: Ambient>(
    space: &M,
    p: &[Lane],
    q: &[Lane],
    t: Lane,
    cotangent: &[Lane],
    to_p: &mut [Lane],
    to_q: &mut [Lane],
) -> Lane {
    let len = p.len();
    let constant = |x: &[Lane]| -> Few<Dual> { x.iter().map(|&x| Dual::constant(x)).collect() };
    let [fixed_p, fixed_q] = [constant(p), constant(q)];
    let mut out = fixed_p.clone();
    space.geodesic(&fixed_p, &fixed_q, Dual { v: t, d: Lane::ONE }, &mut out);
    let (c, mut velocity): (Few<Lane>, Few<Lane>) = out.iter().map(|x| (x.v, x.d)).unzip();
    space.velocity(&c, &mut velocity);
    let mut way: Few<Lane> = smallvec![Lane::ZERO; len];
    let (mut there, mut moved) = (way.clone(), way.clone());
    let mut moving = fixed_p.clone();
    for (end, to_end, part) in [(p, to_p, -t), (q, to_q, Lane::ONE - t)] {
        way.iter_mut().zip(&velocity).for_each(|(way, v)| *way = *v * part);
        space.parallel_transport(&c, end, &way, cotangent, &mut there);
        moving.iter_mut().zip(end.iter().zip(&there)).for_each(|(x, (&v, &d))| *x = Dual { v, d });
        let (from, to) = if std::ptr::eq(end, p) { (&moving, &fixed_q) } else { (&fixed_p, &moving) };
        space.geodesic(from, to, Dual::constant(t), &mut out);
        moved.iter_mut().zip(&out).for_each(|(moved, x)| *moved = x.d);
        space.velocity(&c, &mut moved);
        space.parallel_transport(&c, end, &way, &moved, &mut there);
        to_end.iter_mut().zip(&there).for_each(|(sum, x)| *sum += *x);
    }
    space.pairing(&c, &velocity, cotangent)
}

/// [`Ambient::raise`] by an orthonormal frame.
pub fn raise_by_frame<M: Frame>(space: &M, p: &[Lane], gradient: &mut [Lane]) {
    let (m, len) = (space.dim(), p.len());
    let mut frame = vec![Lane::ZERO; space.frame_len()];
    space.lift(p, &mut frame);
    let (mut x, mut e, mut sum) = (vec![Lane::ZERO; m], vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
    for k in 0..m {
        x[k] = Lane::ONE;
        space.tangent(&frame, p, &x, &mut e);
        x[k] = Lane::ZERO;
        let product = dot(&e, gradient);
        sum.iter_mut().zip(&e).for_each(|(sum, e)| *sum = product.mul_add(*e, *sum));
    }
    gradient.copy_from_slice(&sum);
}
