//! The flat torus Tⁿ = (R/2πZ)ⁿ, whose points are n angles: flat space in which differences are wrapped.

use std::f64::consts::PI;
use symspline_core::scalar::{Lane, Scalar, dot, lane, max_or_nan};
use symspline_core::space::{Ambient, Frame, Origin, Space};

/// Tⁿ as n angles in radians in (−π, π], with the metric of their rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Torus {
    n: usize,
}

impl Torus {
    /// The torus of n circles.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Torus(n) needs n >= 1".into()) } else { Ok(Torus { n }) }
    }
}

/// The multiple of 2π to subtract from an angle in order to bring it to (−π, π].
#[inline(always)]
fn turns(x: Lane) -> Lane {
    // Angles in the interval stay as they are: no rounding of the quotient counts.
    let outside = x.simd_gt(lane(PI)) | x.simd_le(lane(-PI));
    outside.select((x * lane(0.5 / PI) - lane(0.5)).ceil() * lane(2.0 * PI), Lane::ZERO)
}

/// The angle in (−π, π].
#[inline(always)]
fn wrapped<S: Scalar>(x: S) -> S {
    x - turns(x.value())
}

/// The largest absolute value.
#[inline(always)]
fn largest(v: &[Lane]) -> Lane {
    v.iter().fold(Lane::ZERO, |most, v| max_or_nan(most, v.abs()))
}

impl Ambient for Torus {
    fn point_len(&self) -> usize {
        self.n
    }
    fn cut_angle(&self) -> f64 {
        PI
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        for i in 0..self.n {
            out[i] = wrapped(t * v[i] + p[i]);
        }
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        for i in 0..self.n {
            out[i] = wrapped(q[i] - p[i]);
        }
        largest(out)
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        for i in 0..self.n {
            out[i] = wrapped(t.fma(wrapped(q[i] - p[i]), p[i]));
        }
    }
    fn transvect(&self, _p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        for i in 0..self.n {
            out[i] = wrapped(x[i] + v[i]);
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
        // Whole turns are not a distance. NaN and infinity result in NaN.
        x.iter_mut().fold(Lane::ZERO, |sum, x| {
            *x = wrapped(*x);
            sum + *x * Lane::ZERO
        })
    }
    fn project_tangent(&self, _p: &[Lane], v: &mut [Lane]) -> Lane {
        v.iter().fold(Lane::ZERO, |sum, v| sum + *v * Lane::ZERO)
    }
    fn random_point(&self, noise: &mut [Lane]) {
        // The distribution function of normal numbers would be needed for uniform angles; differences of ten standard
        // deviations are uniform up to rounding: the k-th Fourier coefficient of the wrapped normal distribution of
        // standard deviation σ is exp(−k²σ²/2).
        for x in noise {
            *x = wrapped(*x * lane(10.0));
        }
    }
    fn violation(&self, _x: &[f64]) -> String {
        "any finite numbers are a point".into()
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        dot(p, p).sqrt().max(Lane::ONE)
    }
}

impl Frame for Torus {
    fn frame_len(&self) -> usize {
        0
    }
    // Frames of a flat space are all equal and contain no numbers.
    fn lift(&self, _p: &[Lane], _frame: &mut [Lane]) {}
    #[inline(always)]
    fn step(&self, _frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        self.log(p, q, chord)
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

impl Origin for Torus {
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
            // Without wrapping, the C² condition is that of flat space. Longer vectors are refused afterwards.
            w_plus[i] = -(a[i] + b[i]) + d[i];
            w_minus[i] = -w_plus[i];
        }
    }
    fn triple<S: Scalar>(&self, _a: &[S], _b: &[S], _c: &[S], out: &mut [S]) {
        out.fill(S::constant(Lane::ZERO));
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, _v: &[S], _x: &mut [S]) {}
    fn angle(&self, v: &[Lane]) -> Lane {
        largest(v)
    }
}

impl Space for Torus {}
