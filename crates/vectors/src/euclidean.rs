//! Flat space Rⁿ, κ = 0: there the spline is the classical cubic spline.

use symspline_core::scalar::{Lane, Scalar, dot};
use symspline_core::space::{Ambient, Frame, Origin, Space};

/// Rⁿ with its usual inner product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Euclidean {
    n: usize,
}

impl Euclidean {
    /// Rⁿ
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Euclidean(n) needs n >= 1".into()) } else { Ok(Euclidean { n }) }
    }
}

impl Ambient for Euclidean {
    fn point_len(&self) -> usize {
        self.n
    }
    fn scales(&self) -> bool {
        true
    }
    fn cut_angle(&self) -> f64 {
        f64::INFINITY
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        for i in 0..self.n {
            out[i] = t * v[i] + p[i];
        }
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        for i in 0..self.n {
            out[i] = q[i] - p[i];
        }
        dot(out, out).sqrt()
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        for i in 0..self.n {
            out[i] = t.fma(q[i] - p[i], p[i]);
        }
    }
    fn transvect(&self, _p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        for i in 0..self.n {
            out[i] = x[i] + v[i];
        }
    }
    fn parallel_transport(&self, _p: &[Lane], _q: &[Lane], _v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        out.copy_from_slice(x);
    }
    #[inline(always)]
    fn velocity(&self, _gamma: &[Lane], _d: &mut [Lane]) {}
    #[inline(always)]
    fn acceleration(&self, _gamma: &[Lane], _d: &[Lane], _dd: &mut [Lane]) {}
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        dot(u, v)
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        // NaN and infinity do not change: 0·∞ would be NaN.
        x.iter().fold(Lane::ZERO, |sum, x| sum + *x * Lane::ZERO)
    }
    fn project_tangent(&self, _p: &[Lane], v: &mut [Lane]) -> Lane {
        self.project(v)
    }
    fn random_point(&self, _noise: &mut [Lane]) {}
    fn violation(&self, _x: &[f64]) -> String {
        "any finite numbers are a point".into()
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        dot(p, p).sqrt().max(Lane::ONE)
    }
}

impl Frame for Euclidean {
    fn frame_len(&self) -> usize {
        0
    }
    // Frames of flat space are all equal and contain no numbers.
    fn lift(&self, _p: &[Lane], _frame: &mut [Lane]) {}
    #[inline(always)]
    fn step(&self, _frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        for i in 0..self.n {
            chord[i] = q[i] - p[i];
        }
        // There is no cut locus.
        Lane::ZERO
    }
    #[inline(always)]
    fn coordinates(&self, _frame: &[Lane], _p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        x.copy_from_slice(v);
    }
    #[inline(always)]
    fn tangent(&self, _frame: &[Lane], _p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        v.copy_from_slice(x);
    }
}

impl Origin for Euclidean {
    fn dim(&self) -> usize {
        self.n
    }
    fn curvature(&self) -> f64 {
        0.0
    }
    #[inline(always)]
    fn inner_handles<S: Scalar>(
        &self,
        d: &[Lane],
        _: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        for i in 0..self.n {
            w_plus[i] = -(a[i] + b[i]) + d[i];
            w_minus[i] = -w_plus[i];
        }
    }
    fn triple<S: Scalar>(&self, _a: &[S], _b: &[S], _c: &[S], out: &mut [S]) {
        out.fill(S::constant(Lane::ZERO));
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, _v: &[S], _x: &mut [S]) {}
}

impl Space for Euclidean {
    const HOT: bool = true;
    const VECTORS: bool = true;
}
