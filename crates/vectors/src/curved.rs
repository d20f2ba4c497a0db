//! Sphere and hyperbolic space as spaces: the formulas of `constant_curvature` for κ = 1 and −1.

use crate::constant_curvature as cc;
use crate::{hyperbolic, sphere};
use symspline_core::scalar::{Lane, Scalar, max_or_nan};
use symspline_core::space::{Ambient, Frame, Origin, Space, far_out};

/// The sphere (K = 1) or hyperbolic space (K = −1) of dimension n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Curved<const K: i32> {
    pub(crate) n: usize,
}

impl<const K: i32> Ambient for Curved<K> {
    fn point_len(&self) -> usize {
        self.n + 1
    }
    fn cut_angle(&self) -> f64 {
        if K > 0 { std::f64::consts::PI } else { f64::INFINITY }
    }
    fn longest_ray(&self) -> f64 {
        if K > 0 { f64::INFINITY } else { hyperbolic::LONGEST_RAY }
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        cc::ray::<K, S>(p, v, t, out);
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        cc::log::<K>(p, q, out)
    }
    fn distance(&self, _p: &[Lane], _q: &[Lane], _log: &[Lane], angle: Lane) -> Lane {
        angle
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        cc::geodesic::<K, S>(p, q, t, out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        cc::transvect::<K>(p, v, x, out);
    }
    #[inline(always)]
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        cc::tangential::<K>(gamma, d);
    }
    #[inline(always)]
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        cc::tangential::<K>(gamma, dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        cc::product::<K, Lane>(u, v)
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        if K > 0 { sphere::project(x) } else { hyperbolic::project(x) }
    }
    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane {
        if K > 0 { sphere::project_tangent(p, v) } else { hyperbolic::project_tangent(p, v) }
    }
    fn scatter(&self, noise: &mut [Lane]) {
        self.project(noise);
    }
    fn complaint(&self, x: &[f64]) -> String {
        if K > 0 { sphere::complaint(x) } else { hyperbolic::complaint(x) }
    }
    fn beyond_doubles(&self, points: &[f64]) -> Option<(usize, String)> {
        if K > 0 { None } else { far_out(points, self.point_len()) }
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        if K > 0 { Lane::ONE } else { hyperbolic::rounding(p) }
    }
}

impl<const K: i32> Frame for Curved<K> {
    fn frame_len(&self) -> usize {
        self.n * (self.n + 1)
    }
    #[inline(always)]
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        cc::lift::<K>(p, frame);
    }
    #[inline(always)]
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        cc::step::<K>(frame, p, q, chord)
    }
    #[inline(always)]
    fn tidy(&self, frame: &mut [Lane], p: &[Lane]) {
        cc::tidy::<K>(frame, p);
    }
    #[inline(always)]
    fn coordinates(&self, frame: &[Lane], _p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        cc::coordinates::<K>(frame, v, x);
    }
    #[inline(always)]
    fn tangent(&self, frame: &[Lane], _p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        cc::tangent(frame, x, v);
    }
}

impl<const K: i32> Origin for Curved<K> {
    fn dim(&self) -> usize {
        self.n
    }
    fn chord_len(&self) -> usize {
        cc::CHORD_LEN
    }
    fn curvature(&self) -> f64 {
        // One dimension is flat.
        if self.n == 1 { 0.0 } else { 1.0 }
    }
    #[inline(always)]
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        cc::prepare::<K>(chord, prepared);
    }
    #[inline(always)]
    fn legs<S: Scalar>(
        &self,
        d: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        cc::legs::<K, false, S>(d, prepared, a, b, w_plus, w_minus);
    }
    #[inline(always)]
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        cc::triple::<K, S>(a, b, c, out);
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        cc::stretch::<K, S>(v, x);
    }
    #[inline(always)]
    fn condition(&self, chord: &[Lane]) -> Lane {
        if K > 0 { Lane::ONE } else { hyperbolic::condition(chord) }
    }
}

impl<const K: i32> Space for Curved<K> {
    const HOT: bool = true;
    const VECTORS: bool = true;

    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        max_or_nan(self.inner(p, v, v), Lane::ZERO).sqrt()
    }
}
