//! Projective spaces and complex hyperbolic space, by the formulas of `lines`.

use crate::{lines, quaternionic};
use std::f64::consts::{FRAC_PI_2, SQRT_2};
use symspline_core::scalar::{Lane, Scalar, dot, lane};
use symspline_core::space::{Ambient, Frame, Origin, Space, far_out, pull_back_by_transport};
use symspline_core::special::Trig;

/// Lines over R (E = C = 1), C (E = C = 2) or H (E = 4, C = 8), where E and C count the numbers of a row and of a
/// factor; projective for K = 1 and hyperbolic for K = −1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lines<const E: usize, const C: usize, const K: i32> {
    n: usize,
    /// Points are matrices of one column, as those of Grassmannians, instead of vectors.
    column: bool,
}

/// Lines of Rⁿ⁺¹.
pub type RealProjective = Lines<1, 1, 1>;
/// Lines of Cⁿ⁺¹: pure quantum states.
pub type ComplexProjective = Lines<2, 2, 1>;
/// Lines of n + 1 quaternions, as planes of C²ⁿ⁺².
pub type QuaternionicProjective = Lines<4, 8, 1>;
/// The lines of negative square in Cⁿ⁺¹ with ⟨z,w⟩ = −z̄₀w₀ + Σ z̄ᵢwᵢ (Goldman, Complex Hyperbolic Geometry, 1999).
pub type ComplexHyperbolic = Lines<2, 2, -1>;

impl<const E: usize, const C: usize, const K: i32> Lines<E, C, K> {
    /// k, the number of columns of a point.
    const COLUMNS: usize = lines::columns::<E, C>();

    /// The space of n dimensions over R, C or H.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 || n > usize::MAX / 16 {
            let name = match (E, K) {
                (1, _) => "RealProjective",
                (2, 1) => "ComplexProjective",
                (2, _) => "ComplexHyperbolic",
                _ => "QuaternionicProjective",
            };
            return Err(format!("{name}(n) needs n >= 1"));
        }
        Ok(Lines { n, column: false })
    }

    /// The same with points that are matrices of one column.
    pub fn columns(self) -> Self {
        Lines { column: true, ..self }
    }

    /// The length of a vector that covers the angle 1.
    fn unit_length() -> f64 {
        (Self::COLUMNS as f64).sqrt()
    }
}

/// Calls a function that writes factors, and writes their coordinates: the same numbers over R and C.
#[inline(always)]
fn narrow<R, const E: usize>(x: &mut [Lane], compute: impl FnOnce(&mut [Lane]) -> R) -> R {
    if E < 4 {
        return compute(x);
    }
    let mut factors = vec![Lane::ZERO; 2 * x.len()];
    let result = compute(&mut factors);
    quaternionic::narrow(&factors, x);
    result
}

impl<const E: usize, const C: usize, const K: i32> Ambient for Lines<E, C, K> {
    fn point_len(&self) -> usize {
        C * (self.n + 1)
    }
    fn point_shape(&self) -> Vec<usize> {
        let rows = Self::COLUMNS * (self.n + 1);
        if self.column || Self::COLUMNS > 1 { vec![rows, Self::COLUMNS] } else { vec![rows] }
    }
    fn is_complex(&self) -> bool {
        E > 1
    }
    fn fiber_rank(&self) -> usize {
        Self::COLUMNS
    }
    fn cut_angle(&self) -> f64 {
        if K > 0 { FRAC_PI_2 } else { f64::INFINITY }
    }
    fn longest_handle(&self) -> f64 {
        if K > 0 { self.cut_angle() } else { 18.0 } // ε cosh²(18) ≈ 1: results for points this far apart are rounding errors.
    }
    fn injectivity_radius(&self) -> f64 {
        self.cut_angle() * Self::unit_length()
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        lines::ray::<S, E, C, K>(p, v, t, out);
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        lines::log::<E, C, K>(p, q, out)
    }
    fn distance(&self, _p: &[Lane], _q: &[Lane], log: &[Lane], angle: Lane) -> Lane {
        // At the cut locus the logarithm has no direction, but the angle exists.
        let square = lines::real_product::<Lane, E, C, K>(log, log);
        square.is_nan().select(angle, square.abs().sqrt()) * lane(Self::unit_length())
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        lines::geodesic::<S, E, C, K>(p, q, t, out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        out.copy_from_slice(x);
        lines::transvect::<E, C, K>(p, v, out);
    }
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        self.transvect(p, v, x, out);
        let mut there = p.to_vec();
        self.ray(p, v, Lane::ONE, &mut there);
        lines::turn::<E, C, K>(&there, q, out);
    }
    #[inline(always)]
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        lines::tangential::<E, C, K>(gamma, d);
    }
    #[inline(always)]
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        lines::acceleration::<E, C, K>(gamma, d, dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        lines::real_product::<Lane, E, C, K>(u, v) * lane(Self::COLUMNS as f64)
    }
    fn pull_back(
        &self,
        p: &[Lane],
        q: &[Lane],
        t: Lane,
        cotangent: &[Lane],
        to_p: &mut [Lane],
        to_q: &mut [Lane],
    ) -> Lane {
        if K > 0 && E < 4 {
            lines::pull_back::<E, C>(p, q, t, cotangent, to_p, to_q)
        } else {
            pull_back_by_transport(self, p, q, t, cotangent, to_p, to_q)
        }
    }
    /// The momentum of a horizontal v at p is vp* − pv*.
    fn conserve(&self, p: &[Lane], c: [&[Lane]; 2], q: [&[Lane]; 2], to_p: &mut [Lane]) -> bool {
        if K > 0 {
            for ([x, v], sign) in [(c, Lane::ONE), (q, -Lane::ONE)] {
                lines::add_momentum::<E, C>(p, x, v, sign, to_p);
            }
        }
        K > 0
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        if K < 0 {
            gradient[..C].iter_mut().for_each(|x| *x = -*x);
        }
        self.velocity(p, gradient);
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        if Self::COLUMNS > 1 {
            return quaternionic::project(x);
        }
        let (off, scaled, scale, rounding);
        if K > 0 {
            let norm = dot(x, x).sqrt();
            off = (norm - Lane::ONE).abs();
            (scaled, scale) = (x.len(), Lane::ONE / norm);
            rounding = 1.5 + (x.len() - 1) as f64 / 8.0;
        } else {
            // In a point |x₀| is √(1 + Σ|xᵢ|²).
            let (size, height) = (dot(&x[..C], &x[..C]).sqrt(), (dot(&x[C..], &x[C..]) + Lane::ONE).sqrt());
            off = (size - height).abs() / height;
            (scaled, scale) = (C, height / size);
            rounding = 4.0;
        }
        // Points that are accurate to rounding do not change.
        let scale = off.simd_le(lane(rounding * f64::EPSILON)).select(Lane::ONE, scale);
        x[..scaled].iter_mut().for_each(|x| *x *= scale);
        off
    }
    fn random_point(&self, noise: &mut [Lane]) {
        if Self::COLUMNS > 1 {
            quaternionic::complete(noise);
        }
        self.project(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        if Self::COLUMNS > 1 {
            return quaternionic::violation(x);
        }
        let [first, rest] = [&x[..C], &x[C..]].map(|x| x.iter().map(|x| x * x).sum::<f64>());
        if K < 0 {
            let square = rest - first;
            return format!(
                "its square -|x0|^2 + |x1|^2 + ... is {square}, not -1 (off by {:.3e})",
                (square + 1.0).abs()
            );
        }
        let norm = (first + rest).sqrt();
        if norm == 0.0 {
            "it is the zero vector, which spans no line".into()
        } else {
            format!("its norm is {norm}, not 1 (off by {:.3e})", (norm - 1.0).abs())
        }
    }
    fn imprecise_point(&self, points: &[f64]) -> Option<(usize, String)> {
        if K > 0 { None } else { far_out(points, self.point_len()) }
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        if K > 0 { Lane::ONE } else { dot(p, p) } // ≈ e²ʳ/2 at distance r from the origin
    }
}

impl<const E: usize, const C: usize, const K: i32> Frame for Lines<E, C, K> {
    fn frame_len(&self) -> usize {
        self.n * self.point_len() + C
    }
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        lines::lift::<E, C, K>(p, frame);
    }
    #[inline(always)]
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        narrow::<_, E>(chord, |chord| lines::step::<E, C, K>(frame, p, q, chord))
    }
    fn reorthonormalize(&self, frame: &mut [Lane], p: &[Lane]) {
        lines::reorthonormalize::<E, C, K>(frame, p);
    }
    #[inline(always)]
    fn coordinates(&self, frame: &[Lane], _p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        narrow::<_, E>(x, |x| lines::coordinates::<E, C, K>(frame, v, x));
    }
    #[inline(always)]
    fn tangent(&self, frame: &[Lane], _p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let mut wide = Vec::new();
        let factors = if E < 4 {
            x
        } else {
            wide.resize(2 * x.len(), Lane::ZERO);
            quaternionic::widen(x, &mut wide);
            &wide
        };
        lines::tangent::<E, C>(frame, factors, v);
    }
}

impl<const E: usize, const C: usize, const K: i32> Origin for Lines<E, C, K> {
    fn dim(&self) -> usize {
        self.n * C / Self::COLUMNS
    }
    fn chord_len(&self) -> usize {
        3
    }
    fn curvature(&self) -> f64 {
        match (E, self.n) {
            // One dimension is flat.
            (1, 1) => 0.0,
            (1, _) => 1.0,
            (2, _) => 2.0,
            _ => SQRT_2,
        }
    }
    #[inline(always)]
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        let (k, square) = (lane(K as f64), dot(chord, chord) * lines::weight::<E>());
        let trig = Trig::new(square * k);
        prepared.copy_from_slice(&[trig.s, trig.k * k, square]);
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
        lines::inner_handles::<S, E, K>(d, prepared, a, b, w_plus, w_minus);
    }
    #[inline(always)]
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        lines::triple::<S, E, K>(a, b, c, out);
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        lines::stretch::<S, E, K>(v, x);
    }
    /// E(−a) E(d) E(−b) with |a| ≈ |b| ≈ |d|/3 grows to e^{5|d|/3} and ends at e^{|d|/3}.
    fn condition(&self, chord: &[Lane]) -> Lane {
        if K > 0 { Lane::ONE } else { (dot(chord, chord).sqrt() * lane(4.0 / 3.0)).exp() }
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        dot(v, v).sqrt() * lane(1.0 / Self::unit_length())
    }
}

impl<const E: usize, const C: usize, const K: i32> Space for Lines<E, C, K> {
    fn angle_at(&self, _p: &[Lane], v: &[Lane]) -> Lane {
        lines::real_product::<Lane, E, C, K>(v, v).abs().sqrt()
    }
}
