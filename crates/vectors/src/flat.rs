//! Flat spaces: Rⁿ, where the spline is the classical cubic spline, and the torus Tⁿ = (R/2πZ)ⁿ, whose points are n
//! angles and whose differences are wrapped.

use std::f64::consts::PI;
use symspline_core::scalar::{Lane, Scalar, dot, lane, max_or_nan};
use symspline_core::space::{Ambient, Frame, Origin, Space};

/// Rⁿ with its usual inner product or, if wrapped, Tⁿ as n angles in radians in (−π, π], with the metric of their rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flat<const WRAPPED: bool> {
    n: usize,
}

/// Rⁿ
pub type Euclidean = Flat<false>;
/// Tⁿ
pub type Torus = Flat<true>;

/// Angles beyond this size have rounding errors of a radian or more.
const LARGEST: Lane = lane((1_u64 << 52) as f64);

impl<const WRAPPED: bool> Flat<WRAPPED> {
    /// The space of n numbers.
    pub fn new(n: usize) -> Result<Self, String> {
        let name = if WRAPPED { "Torus" } else { "Euclidean" };
        if n == 0 { Err(format!("{name}(n) needs n >= 1")) } else { Ok(Flat { n }) }
    }

    /// The angle in (−π, π]; a number that is no angle stays as it is.
    #[inline(always)]
    fn wrapped<S: Scalar>(x: S) -> S {
        if WRAPPED { x - turns(x.value()) } else { x }
    }

    /// The deciding angle of a tangent vector: the largest one, as each angle has its own cut locus.
    #[inline(always)]
    fn deciding(v: &[Lane]) -> Lane {
        if WRAPPED {
            v.iter().fold(Lane::ZERO, |most, v| max_or_nan(most, v.abs()))
        } else {
            dot(v, v).sqrt()
        }
    }
}

/// The multiple of 2π to subtract from an angle in order to bring it to (−π, π].
#[inline(always)]
fn turns(x: Lane) -> Lane {
    // Angles in the interval stay as they are: no rounding of the quotient counts.
    let outside = x.simd_gt(lane(PI)) | x.simd_le(lane(-PI));
    if !outside.any() {
        return Lane::ZERO;
    }
    let turns = (x * lane(0.5 / PI) - lane(0.5)).ceil() * lane(2.0 * PI);
    let known = x.abs().simd_le(LARGEST);
    outside.select(known.select(turns, lane(f64::NAN)), Lane::ZERO)
}

impl<const WRAPPED: bool> Ambient for Flat<WRAPPED> {
    fn point_len(&self) -> usize {
        self.n
    }
    fn scales(&self) -> bool {
        !WRAPPED
    }
    fn cut_angle(&self) -> f64 {
        if WRAPPED { PI } else { f64::INFINITY }
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        for i in 0..self.n {
            out[i] = Self::wrapped(t * v[i] + p[i]);
        }
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        for i in 0..self.n {
            out[i] = Self::wrapped(q[i] - p[i]);
        }
        Self::deciding(out)
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        for i in 0..self.n {
            out[i] = Self::wrapped(t.fma(Self::wrapped(q[i] - p[i]), p[i]));
        }
    }
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
        for i in 0..self.n {
            let (x, part) = (cotangent[i], t * cotangent[i]);
            to_p[i] = to_p[i] + (x - part);
            to_q[i] = to_q[i] + part;
            rate = x.fma(Self::wrapped(q[i] - p[i]), rate);
        }
        rate
    }
    #[inline(always)]
    fn push_along<S: Scalar>(&self, pq: [&[S]; 2], t: S, changes: [&[S]; 2], dt: S, out: &mut [S]) {
        let ([p, q], [dp, dq]) = (pq, changes);
        for i in 0..self.n {
            let moved = t.fma(dq[i] - dp[i], dp[i]);
            out[i] = dt.fma(Self::wrapped(q[i] - p[i]), moved);
        }
    }
    fn bend(&self, _v: &[Lane], _cotangent: &[Lane], out: &mut [Lane]) {
        out.fill(Lane::ZERO);
    }
    fn transvect(&self, _p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        for i in 0..self.n {
            out[i] = Self::wrapped(x[i] + v[i]);
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
        // NaN and infinity result in NaN, as 0·∞.
        let finite = x.iter().fold(Lane::ZERO, |sum, x| sum + *x * Lane::ZERO);
        if !WRAPPED {
            return finite;
        }
        // Whole turns are not a distance, but the rounding error of an angle with many turns is.
        let error = Self::deciding(x) * lane(f64::EPSILON);
        x.iter_mut().for_each(|x| *x = Self::wrapped(*x));
        finite + error
    }
    fn project_tangent(&self, _p: &[Lane], v: &mut [Lane]) -> Lane {
        v.iter().fold(Lane::ZERO, |sum, v| sum + *v * Lane::ZERO)
    }
    fn random_point(&self, noise: &mut [Lane]) {
        if WRAPPED {
            // The distribution function of normal numbers would be needed for uniform angles; differences of ten
            // standard deviations are uniform up to rounding: the k-th Fourier coefficient of the wrapped normal
            // distribution of standard deviation σ is exp(−k²σ²/2).
            noise.iter_mut().for_each(|x| *x = Self::wrapped(*x * lane(10.0)));
        }
    }
    fn violation(&self, x: &[f64]) -> String {
        if !WRAPPED {
            return "any finite numbers are a point".into();
        }
        let largest = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        format!("the rounding error of its angle {largest:.3e} is too large; subtract whole turns")
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        dot(p, p).sqrt().max(Lane::ONE)
    }
}

impl<const WRAPPED: bool> Frame for Flat<WRAPPED> {
    fn frame_len(&self) -> usize {
        0
    }
    // Frames of a flat space are all equal and contain no numbers.
    fn lift(&self, _p: &[Lane], _frame: &mut [Lane]) {}
    #[inline(always)]
    fn step(&self, _frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        for i in 0..self.n {
            chord[i] = Self::wrapped(q[i] - p[i]);
        }
        // Rⁿ does not have a cut locus.
        if WRAPPED { Self::deciding(chord) } else { Lane::ZERO }
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

impl<const WRAPPED: bool> Origin for Flat<WRAPPED> {
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
            // On the torus, longer vectors than the cut angle are refused afterwards.
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
        Self::deciding(v)
    }
}

impl<const WRAPPED: bool> Space for Flat<WRAPPED> {
    const HOT: bool = !WRAPPED;
    const VECTORS: bool = !WRAPPED;
}
