//! The product of two spheres of three dimensions, in which curves of pairs of unit quaternions are evaluated.

use symspline_core::scalar::{Each, Lane, Scalar, dot, few, max_or_nan};
use symspline_core::space::Ambient;
use symspline_vectors::{Sphere, constant_curvature as cc};

/// Two points of a sphere of three dimensions, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TwoSpheres(pub Sphere);

impl Ambient for TwoSpheres {
    fn point_len(&self) -> usize {
        8
    }
    fn cut_angle(&self) -> f64 {
        self.0.cut_angle()
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        for k in [0, 4] {
            cc::ray::<1, false, S>(&p[k..k + 4], &v[k..k + 4], t, &mut out[k..k + 4]);
        }
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let [first, second] =
            [0, 4].each(|k| cc::log::<1, false>(&p[k..k + 4], &q[k..k + 4], &mut out[k..k + 4]));
        max_or_nan(first, second)
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        for k in [0, 4] {
            cc::geodesic::<1, false, S>(&p[k..k + 4], &q[k..k + 4], t, &mut out[k..k + 4]);
        }
    }
    #[inline(always)]
    fn raise(&self, _p: &[Lane], _gradient: &mut [Lane]) {}
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
        self.pull_back_along(p, q, t, cotangent, to_p, to_q)
    }
    const SMOOTH: bool = true;
    #[inline(always)]
    fn pull_back_along<S: Scalar>(
        &self,
        p: &[S],
        q: &[S],
        t: S,
        cotangent: &[S],
        to_p: &mut [S],
        to_q: &mut [S],
    ) -> S {
        let mut rate = S::constant(Lane::ZERO);
        for (((p, q), x), (to_p, to_q)) in
            (p.chunks_exact(4).zip(q.chunks_exact(4)).zip(cotangent.chunks_exact(4)))
                .zip(to_p.chunks_exact_mut(4).zip(to_q.chunks_exact_mut(4)))
        {
            rate = rate + cc::pull_back::<1, false, S>(p, q, t, x, to_p, to_q);
        }
        rate
    }
    #[inline(always)]
    fn push_along<S: Scalar>(&self, pq: [&[S]; 2], t: S, changes: [&[S]; 2], dt: S, out: &mut [S]) {
        for k in [0, 4] {
            let of = |x: [&[S]; 2]| -> [[S; 4]; 2] { x.map(|x| few(|i| x[k + i])) };
            let ([p, q], [dp, dq]) = (of(pq), of(changes));
            cc::push::<1, false, S>([&p, &q], t, [&dp, &dq], dt, &mut out[k..k + 4]);
        }
    }
    fn bend(&self, v: &[Lane], cotangent: &[Lane], out: &mut [Lane]) {
        for k in [0, 4] {
            let square = dot(&v[k..k + 4], &v[k..k + 4]);
            (k..k + 4).for_each(|i| out[i] = cotangent[i] * square);
        }
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        for k in [0, 4] {
            cc::transvect::<1, false>(&p[k..k + 4], &v[k..k + 4], &x[k..k + 4], &mut out[k..k + 4]);
        }
    }
    #[inline(always)]
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        for k in [0, 4] {
            cc::tangential::<1, false>(&gamma[k..k + 4], &mut d[k..k + 4]);
        }
    }
    #[inline(always)]
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        self.velocity(gamma, dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        dot(u, v)
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        x.chunks_exact_mut(4).fold(Lane::ZERO, |off, x| max_or_nan(off, self.0.project(x)))
    }
    fn random_point(&self, noise: &mut [Lane]) {
        self.project(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        self.0.violation(&x[..4])
    }
}
