//! The spaces of constant curvature κ = 1 and −1: the formulas of `constant_curvature`.

use crate::constant_curvature as cc;
use crate::{hyperbolic, lorentzian, sphere};
use symspline_core::scalar::{Lane, Scalar, dot, lane, max_or_nan};
use symspline_core::space::{Ambient, Frame, Origin, Space, far_out};

/// The sphere (K = 1) or hyperbolic space (K = −1) of dimension n; with `L`, de Sitter (K = 1) or anti-de Sitter space
/// (K = −1), whose metric has one negative square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Curved<const K: i32, const L: bool> {
    n: usize,
}

/// The unit sphere of dimension n.
pub type Sphere = Curved<1, false>;

impl Sphere {
    /// The sphere in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Sphere(n) needs n >= 1".into()) } else { Ok(Sphere { n }) }
    }
}

/// Hyperbolic space of dimension n, as the hyperboloid with its time-like coordinate first.
pub type Hyperbolic = Curved<-1, false>;

impl Hyperbolic {
    /// The hyperboloid in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Hyperbolic(n) needs n >= 1".into()) } else { Ok(Hyperbolic { n }) }
    }
}

/// De Sitter space of dimension n, with its time-like coordinate first.
pub type DeSitter = Curved<1, true>;
/// Anti-de Sitter space of dimension n, with its two time-like coordinates first.
pub type AntiDeSitter = Curved<-1, true>;

impl DeSitter {
    /// The one-sheeted hyperboloid in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        at_least_two("DeSitter", n)
    }
}

impl AntiDeSitter {
    /// The quadric in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        at_least_two("AntiDeSitter", n)
    }
}

/// In one dimension there is no indefinite metric, and de Sitter space has two components.
fn at_least_two<const K: i32>(name: &str, n: usize) -> Result<Curved<K, true>, String> {
    if n < 2 { Err(format!("{name}(n) needs n >= 2, not {n}")) } else { Ok(Curved { n }) }
}

impl<const K: i32, const L: bool> Curved<K, L> {
    /// Whether geodesics of some direction return: those with κ⟨v,v⟩ > 0.
    const ROUND: bool = K > 0 || L;
    /// Whether geodesics in some directions diverge exponentially: those with κ⟨v,v⟩ < 0.
    const OPEN: bool = K < 0 || L;
}

impl<const K: i32, const L: bool> Ambient for Curved<K, L> {
    fn point_len(&self) -> usize {
        self.n + 1
    }
    fn cut_angle(&self) -> f64 {
        if Self::ROUND { std::f64::consts::PI } else { f64::INFINITY }
    }
    fn longest_ray(&self) -> f64 {
        if Self::OPEN { hyperbolic::LONGEST_RAY } else { f64::INFINITY }
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        cc::ray::<K, L, S>(p, v, t, out);
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        cc::log::<K, L>(p, q, out)
    }
    fn distance(&self, _p: &[Lane], _q: &[Lane], log: &[Lane], angle: Lane) -> Lane {
        // An indefinite metric has no distance; this is the size of the array, for reporting.
        if L { dot(log, log).sqrt() } else { angle }
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        cc::geodesic::<K, L, S>(p, q, t, out);
    }
    fn pairing(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        cc::product::<K, L, Lane>(u, v)
    }
    #[inline(always)]
    fn raise(&self, _p: &[Lane], gradient: &mut [Lane]) {
        cc::raise::<K, L>(gradient);
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
        cc::pull_back::<K, L, Lane>(p, q, t, cotangent, to_p, to_q)
    }
    const SMOOTH: bool = !L;
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
        cc::pull_back::<K, L, S>(p, q, t, cotangent, to_p, to_q)
    }
    #[inline(always)]
    fn push_along<S: Scalar>(&self, pq: [&[S]; 2], t: S, changes: [&[S]; 2], dt: S, out: &mut [S]) {
        cc::push::<K, L, S>(pq, t, changes, dt, out);
    }
    fn bend(&self, v: &[Lane], cotangent: &[Lane], out: &mut [Lane]) {
        let square = cc::product::<K, L, Lane>(v, v) * lane(K.into());
        out.iter_mut().zip(cotangent).for_each(|(out, x)| *out = *x * square);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        cc::transvect::<K, L>(p, v, x, out);
    }
    #[inline(always)]
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        cc::tangential::<K, L>(gamma, d);
    }
    #[inline(always)]
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        cc::tangential::<K, L>(gamma, dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        // An indefinite inner product does not measure size; see `distance`.
        if L { dot(u, v) } else { cc::product::<K, L, Lane>(u, v) }
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        if L {
            lorentzian::project::<K>(x)
        } else if K > 0 {
            sphere::project(x)
        } else {
            hyperbolic::project(x)
        }
    }
    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane {
        if Self::OPEN { hyperbolic::project_tangent::<K, L>(p, v) } else { sphere::project_tangent(p, v) }
    }
    fn random_point(&self, noise: &mut [Lane]) {
        self.project(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        if L {
            lorentzian::violation::<K>(x)
        } else if K > 0 {
            sphere::violation(x)
        } else {
            hyperbolic::violation(x)
        }
    }
    fn imprecise_point(&self, points: &[f64]) -> Option<(usize, String)> {
        if L {
            lorentzian::imprecise_point(points, self.point_len())
        } else if K > 0 {
            None
        } else {
            far_out(points, self.point_len())
        }
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        if Self::OPEN { hyperbolic::rounding(p) } else { Lane::ONE }
    }
}

impl<const K: i32, const L: bool> Frame for Curved<K, L> {
    fn frame_len(&self) -> usize {
        self.n * (self.n + 1)
    }
    #[inline(always)]
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        cc::lift::<K, L>(p, frame);
    }
    #[inline(always)]
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        cc::step::<K, L>(frame, p, q, chord)
    }
    #[inline(always)]
    fn reorthonormalize(&self, frame: &mut [Lane], p: &[Lane]) {
        cc::reorthonormalize::<K, L>(frame, p);
    }
    #[inline(always)]
    fn coordinates(&self, frame: &[Lane], _p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        cc::coordinates::<K, L>(frame, v, x);
    }
    #[inline(always)]
    fn products(&self, frame: &[Lane], _p: &[Lane], cotangent: &[Lane], x: &mut [Lane]) {
        cc::coordinates::<K, L>(frame, cotangent, x);
        if L {
            x[0] = -x[0];
        }
    }
    #[inline(always)]
    fn tangent(&self, frame: &[Lane], _p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        cc::tangent(frame, x, v);
    }
}

impl<const K: i32, const L: bool> Origin for Curved<K, L> {
    fn dim(&self) -> usize {
        self.n
    }
    fn chord_len(&self) -> usize {
        cc::CHORD_LEN
    }
    fn curvature(&self) -> f64 {
        // With an indefinite metric, brackets are unbounded; one dimension is flat.
        if L {
            f64::NAN
        } else if self.n == 1 {
            0.0
        } else {
            1.0
        }
    }
    #[inline(always)]
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        cc::prepare::<K, L>(chord, prepared);
    }
    #[inline(always)]
    fn inner_handles<S: Scalar>(
        &self,
        d: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        cc::inner_handles::<K, L, S>(d, prepared, a, b, w_plus, w_minus);
    }
    #[inline(always)]
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        cc::triple::<K, L, S>(a, b, c, out);
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        cc::stretch::<K, L, S>(v, x);
    }
    #[inline(always)]
    fn condition(&self, chord: &[Lane]) -> Lane {
        if L {
            lorentzian::condition::<K>(chord)
        } else if K > 0 {
            Lane::ONE
        } else {
            hyperbolic::condition(chord)
        }
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        if L {
            max_or_nan(cc::at_origin::<L, _>(v, v) * lane(K.into()), Lane::ZERO).sqrt()
        } else {
            dot(v, v).sqrt()
        }
    }
}

impl<const K: i32, const L: bool> Space for Curved<K, L> {
    const HOT: bool = !L;
    const VECTORS: bool = true;

    fn angle_at(&self, _p: &[Lane], v: &[Lane]) -> Lane {
        let square = cc::product::<K, L, Lane>(v, v);
        max_or_nan(if L { square * lane(K.into()) } else { square }, Lane::ZERO).sqrt()
    }
}
