//! Rigid motions as a unit quaternion and a translation: the double cover of SE(3), in which curves are evaluated.

use crate::rigid::{Motion, Quaternion, Twist, conjugate, cross, multiply, rotate};
use crate::rotations::{angular, times_pure};
use symspline_core::scalar::{Dual, Each, Lane, Scalar, dot, few, lane};
use symspline_core::space::Ambient;
use symspline_vectors::constant_curvature as cc;

/// The group of unit quaternions q and translations t; a point is (q, t), seven numbers.
#[derive(Clone, Copy, Debug)]
pub struct Motions;

/// Reads a point.
#[inline(always)]
pub fn read<S: Scalar>(y: &[S]) -> Motion<S> {
    Motion { q: few(|i| y[i]), t: few(|i| y[4 + i]) }
}

/// Writes a point.
#[inline(always)]
pub fn write<S: Scalar>(g: &Motion<S>, y: &mut [S]) {
    y[..4].copy_from_slice(&g.q);
    y[4..7].copy_from_slice(&g.t);
}

/// Writes the tangent vector gξ: q' = q ω/2 and t' = R v.
#[inline(always)]
pub fn write_vector(g: &Motion<Lane>, [omega, v]: Twist<Lane>, w: &mut [Lane]) {
    w[..4].copy_from_slice(&times_pure(g.q, omega.each(|x| x * lane(0.5))));
    w[4..7].copy_from_slice(&rotate(g.q, v));
}

/// ξ of a tangent vector gξ.
#[inline(always)]
pub fn twist(g: &Motion<Lane>, w: &[Lane]) -> Twist<Lane> {
    [angular(g.q, w), rotate(conjugate(g.q), [w[4], w[5], w[6]])]
}

/// g⁻¹h, with the translation from the difference of theirs.
#[inline(always)]
fn between<S: Scalar>(g: &Motion<S>, h: &Motion<S>) -> Motion<S> {
    let back = conjugate(g.q);
    Motion { q: multiply(back, h.q), t: rotate(back, few(|i| h.t[i] - g.t[i])) }
}

/// The dual quaternion of a motion.
#[inline(always)]
fn dual(y: &[Lane]) -> Quaternion<Dual> {
    let g = read(y);
    let d = multiply([Lane::ZERO, g.t[0], g.t[1], g.t[2]], g.q);
    few(|i| Dual { v: g.q[i], d: d[i] * lane(0.5) })
}

impl Ambient for Motions {
    fn point_len(&self) -> usize {
        7
    }
    fn cut_angle(&self) -> f64 {
        std::f64::consts::PI
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        let g = read(p);
        let [omega, v] = twist(&g, v);
        let h = g.times(&Motion::exp([omega, v].each(|x| x.each(|x| x * t.value()))));
        // q' = q ω/2, q'' = −|ω|²/4 q, t' = R v and t'' = R (ω × v)
        let (mut x, mut d) = ([Lane::ZERO; 7], [Lane::ZERO; 7]);
        write(&h, &mut x);
        write_vector(&h, [omega, v], &mut d);
        let (square, bend) = (dot(&omega, &omega) * lane(-0.25), rotate(h.q, cross(omega, v)));
        for i in 0..7 {
            let dd = if i < 4 { square * x[i] } else { bend[i - 4] };
            out[i] = t.compose([x[i], d[i], dd]);
        }
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let g = read(p);
        let (xi, angle) = between(&g, &read(q)).log();
        write_vector(&g, xi, out);
        angle
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let g = read(p);
        let (xi, _) = between(&g, &read(q)).log();
        write(&g.times(&Motion::exp(xi.each(|x| x.each(|x| x * t)))), out);
    }
    /// Cotangent vectors are gradients with respect to the array.
    fn pairing(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        dot(u, v)
    }
    #[inline(always)]
    fn raise(&self, _p: &[Lane], _gradient: &mut [Lane]) {}
    /// With ε² = 0, rigid motions are the dual quaternions q + ε t q/2 of length one, and their geodesics are those of the
    /// sphere over dual numbers (Clifford 1873; Kavan et al., *Geometric skinning with approximate dual quaternion
    /// blending*, 2008). A cotangent vector (λ, μ) of a dual number is the number μ + ελ: the ε part of its product is the
    /// pairing.
    #[inline(always)]
    fn pull_back(
        &self,
        p: &[Lane],
        q: &[Lane],
        t: Lane,
        cotangent: &[Lane],
        to_p: &mut [Lane],
        to_q: &mut [Lane],
    ) -> Lane {
        let [x, y] = [dual(p), dual(q)];
        let mut here = [Dual::constant(Lane::ZERO); 4];
        let at = Dual::constant(t);
        cc::geodesic::<1, false, Dual>(&x, &y, at, &mut here);
        // With t = 2 d q̄: gradients 2μq with respect to d, and λ − 2μd with respect to q.
        let mu = [Lane::ZERO, cotangent[4], cotangent[5], cotangent[6]].each(|x| x + x);
        let [by_d, turn] = [here.each(|x| x.v), here.each(|x| x.d)].each(|x| multiply(mu, x));
        let lifted: Quaternion<Dual> = few(|i| Dual { v: by_d[i], d: cotangent[i] - turn[i] });
        let [mut to_x, mut to_y] = [[Dual::constant(Lane::ZERO); 4]; 2];
        let rate = cc::pull_back::<1, false, Dual>(&x, &y, at, &lifted, &mut to_x, &mut to_y);
        for (y, gradient, sum) in [(p, to_x, to_p), (q, to_y, to_q)] {
            // With d = t q/2.
            let (g, by_d) = (read(y), gradient.each(|x| x.v * lane(0.5)));
            let turn = multiply([Lane::ZERO, g.t[0], g.t[1], g.t[2]], by_d);
            let by_t = multiply(by_d, conjugate(g.q));
            for i in 0..4 {
                sum[i] += gradient[i].d - turn[i];
            }
            for i in 0..3 {
                sum[4 + i] += by_t[1 + i];
            }
        }
        rate.d
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let g = read(p);
        let half = Motion::exp(twist(&g, v).each(|x| x.each(|x| x * lane(0.5))));
        write(&g.times(&half).times(&between(&g, &read(x))).times(&half), out);
    }
    /// With p' = pξ, the vector q Ad(e^{−Ω/2}) ξ.
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let g = read(p);
        let back = Motion::exp(twist(&g, v).each(|x| x.each(|x| x * lane(-0.5))));
        write_vector(&read(q), back.adjoint(twist(&g, x)), out);
    }
    #[inline(always)]
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let g = read(gamma);
        let xi = twist(&g, d);
        write_vector(&g, xi, d);
    }
    #[inline(always)]
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        // See `SpecialEuclidean`.
        let g = read(gamma);
        let ([omega, v], [alpha, a]) = (twist(&g, d), twist(&g, dd));
        let turn = cross(omega, v);
        write_vector(&g, [alpha, few(|i| a[i] - turn[i])], dd);
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        let g = read(p);
        let ([a, b], [c, d]) = (twist(&g, u), twist(&g, v));
        dot(&a, &c) + dot(&b, &d)
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let norm = dot(&x[..4], &x[..4]).sqrt();
        x[..4].iter_mut().for_each(|x| *x /= norm);
        (norm - Lane::ONE).abs()
    }
    fn random_point(&self, noise: &mut [Lane]) {
        self.project(noise);
    }
    fn violation(&self, _x: &[f64]) -> String {
        "its quaternion is not of length one".into()
    }
}
