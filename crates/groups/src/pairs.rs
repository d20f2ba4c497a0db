//! SO(4) and U(2) by pairs of unit quaternions (a, b), where (−a, −b) is the same element: x ↦ a x b̄ is a rotation of
//! four dimensions, and a phase a = e^{iψ} times a quaternion b of SU(2) is a unitary matrix. The angles of the matrix
//! are θₐ ± θᵦ for the lengths of log a and log b (Conway & Smith, On quaternions and octonions, 2003, chapter 4).
//!
//! A tangent vector pΩ corresponds to two vectors (α, β), the imaginary quaternions with a' = aα, b' = bβ. Curves are
//! evaluated on the product of two spheres.

use crate::pair_forms::{Form, FourDimensional, Pair, TwoDimensional};
use crate::rigid::{Quaternion, Vector, conjugate, multiply, rotate};
use crate::two_spheres::TwoSpheres;
use crate::unitary::UnitaryGroup;
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};
use symspline_core::delegate;
use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane};
use symspline_core::space::{Ambient, Covered, Evaluation, Frame, Origin, Space};
use symspline_core::special::{Trig, theta_over_sin};
use symspline_vectors::{Sphere, constant_curvature as cc};

/// The length of a tangent vector divided by that of (α, β).
const SCALE: f64 = SQRT_2;

/// A group of pairs of unit quaternions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pairs<F: Form> {
    general: F::General,
    cover: TwoSpheres,
}

impl Pairs<FourDimensional> {
    /// SO(4)
    pub fn rotations() -> Result<Self, String> {
        Ok(Pairs { general: UnitaryGroup::new(4, true)?, cover: TwoSpheres(Sphere::new(3)?) })
    }
}

impl Pairs<TwoDimensional> {
    /// U(2)
    pub fn unitary() -> Result<Self, String> {
        Ok(Pairs { general: UnitaryGroup::new(2, false)?, cover: TwoSpheres(Sphere::new(3)?) })
    }
}

/// e^v − 1 as a quaternion, without cancellation.
#[inline(always)]
pub fn exp_minus_one<S: Scalar>(v: Vector<S>) -> Quaternion<S> {
    let square = dot(&v, &v);
    let Trig { s, k, .. } = Trig::new(square);
    [square * k, v[0] * s, v[1] * s, v[2] * s]
}

/// e^v as a quaternion.
#[inline(always)]
pub fn exp<S: Scalar>(v: Vector<S>) -> Quaternion<S> {
    let [w, x, y, z] = exp_minus_one(v);
    [w + Lane::ONE, x, y, z]
}

/// θ/sin θ of a quaternion e^v with |v| = θ.
#[inline(always)]
pub fn arc<S: Scalar>([w, v @ ..]: Quaternion<S>) -> S {
    // 1 − |cos θ| = sin²θ/(1 + |cos θ|), without cancellation.
    let behind = w.value().simd_lt(Lane::ZERO);
    let (size, sine2) = (S::select(behind, -w, w), dot(&v, &v));
    let c = size.value() + Lane::ONE;
    let inverse = size.compose([Lane::ONE / c, -(Lane::ONE / (c * c)), lane(2.0) / (c * c * c)]);
    let small = sine2 * inverse;
    theta_over_sin(S::select(behind, -w + Lane::ONE, small), || behind.select(small.value(), c))
}

/// The vector v with e^v = q, and its length.
#[inline(always)]
fn log<S: Scalar>(q: Quaternion<S>) -> (Vector<S>, Lane) {
    let ([w, v @ ..], f) = (q, arc(q));
    (v.each(|x| x * f), dot(&v, &v).value().sqrt().atan2(w.value()))
}

/// The vectors of the nearer one of (a, b) and (−a, −b), and their lengths. Their sum is below π inside the cut locus.
#[inline(always)]
fn nearest<S: Scalar>(pair: Pair<S>) -> ([Vector<S>; 2], [Lane; 2]) {
    let far = (pair[0][0].value() + pair[1][0].value()).simd_lt(Lane::ZERO);
    let [(alpha, first), (beta, second)] = pair.each(|q| log(q.each(|x| S::select(far, -x, x))));
    ([alpha, beta], [first, second])
}

/// a · (0, v)
#[inline(always)]
fn times_pure<S: Scalar>(a: Quaternion<S>, [x, y, z]: Vector<S>) -> Quaternion<S> {
    multiply(a, [S::constant(Lane::ZERO), x, y, z])
}

impl<F: Form> Pairs<F> {
    /// The pair of a point.
    #[inline(always)]
    fn of(p: &[Lane]) -> Pair<Lane> {
        let (zero, one) = (Lane::ZERO, Lane::ONE);
        let unit = [one, zero, zero, zero];
        let identity = F::matrix(unit, unit);
        F::pair(&few(|i| if i < p.len() { p[i] - identity[i] } else { zero }))
    }

    /// The pair of p⁻¹q, accurate for near points.
    #[inline(always)]
    fn between<S: Scalar>(p: &[S], q: &[S]) -> Pair<S> {
        let mut difference = [S::constant(Lane::ZERO); 16];
        difference.iter_mut().zip(q.iter().zip(p)).for_each(|(d, (q, p))| *d = *q - *p);
        F::pair(&F::relative(p, &difference))
    }

    #[inline(always)]
    fn vectors(p: &[Lane], v: &[Lane]) -> [Vector<Lane>; 2] {
        F::vectors(&F::relative(p, v))
    }

    /// p e^Ω for the Ω of two vectors.
    #[inline(always)]
    fn turned<S: Scalar>(p: &[S], vectors: [Vector<S>; 2], out: &mut [S]) {
        let [da, db] = vectors.each(exp_minus_one);
        let (zero, one) = (S::constant(Lane::ZERO), S::constant(Lane::ONE));
        let [w, x, y, z] = db;
        // e^Ω − 1 without cancellation
        let (first, second) =
            (F::matrix(da, [w + Lane::ONE, x, y, z]), F::matrix([one, zero, zero, zero], db));
        let step = F::times(p, &few(|i| first[i] + second[i]));
        out.iter_mut().zip(p.iter().zip(step)).for_each(|(out, (p, step))| *out = *p + step);
    }

    /// The derivative of the matrix of a pair that moves.
    #[inline(always)]
    fn moved([a, b]: Pair<Lane>, [da, db]: Pair<Lane>) -> [Lane; 16] {
        let (first, second) = (F::matrix(da, b), F::matrix(a, db));
        few(|i| first[i] + second[i])
    }

    /// The tangent vector at p of two vectors.
    #[inline(always)]
    fn tangent(p: &[Lane], [alpha, beta]: [Vector<Lane>; 2], out: &mut [Lane]) {
        let [a, b] = Self::of(p);
        let v = Self::moved([a, b], [times_pure(a, alpha), times_pure(b, beta)]);
        out.copy_from_slice(&v[..out.len()]);
    }

    /// The two vectors of coordinates.
    #[inline(always)]
    fn split<S: Scalar>(x: &[S]) -> [Vector<S>; 2] {
        let zero = S::constant(Lane::ZERO);
        let down = lane(1.0 / SCALE);
        [few(|i| if i < F::FIRST { x[i] * down } else { zero }), few(|i| x[F::FIRST + i] * down)]
    }

    #[inline(always)]
    fn join<S: Scalar>([alpha, beta]: [Vector<S>; 2], x: &mut [S]) {
        let all = [alpha[0], alpha[1], alpha[2]];
        for (x, v) in x.iter_mut().zip(all[..F::FIRST].iter().chain(&beta)) {
            *x = *v * lane(SCALE);
        }
    }

    #[inline(always)]
    fn frame(frame: &[Lane]) -> Pair<Lane> {
        [few(|i| frame[i]), few(|i| frame[4 + i])]
    }
}

impl<F: Form> Ambient for Pairs<F> {
    delegate!(pairs => pairs.general;
        point_len, point_shape, is_complex, transvect, inner, project, project_tangent, random_point,
        violation);

    fn cut_angle(&self) -> f64 {
        PI
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        let start: [S; 16] = few(|i| S::constant(if i < p.len() { p[i] } else { Lane::ZERO }));
        Self::turned(&start[..p.len()], Self::vectors(p, v).each(|v| v.each(|x| t * x)), out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let (vectors, [first, second]) = nearest(Self::between(p, q));
        Self::tangent(p, vectors, out);
        first + second
    }
    fn distance(&self, p: &[Lane], q: &[Lane], _log: &[Lane], _angle: Lane) -> Lane {
        let (_, [first, second]) = nearest(Self::between(p, q));
        first.mul_add(first, second * second).sqrt() * lane(SCALE)
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let (vectors, _) = nearest(Self::between(p, q));
        Self::turned(p, vectors.each(|v| v.each(|x| x * t)), out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let vectors = Self::vectors(gamma, d);
        Self::tangent(gamma, vectors, d);
    }
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        self.velocity(gamma, dd);
    }
}

impl<F: Form> Frame for Pairs<F> {
    fn frame_len(&self) -> usize {
        8
    }
    // A frame is the pair of g_R, as for the other groups.
    fn lift(&self, _p: &[Lane], frame: &mut [Lane]) {
        for q in frame.chunks_exact_mut(4) {
            q.copy_from_slice(&[Lane::ONE, Lane::ZERO, Lane::ZERO, Lane::ZERO]);
        }
    }
    #[inline(always)]
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (vectors, [first, second]) = nearest(Self::between(p, q));
        let r = Self::frame(frame);
        let delta: [Vector<Lane>; 2] = few(|k| rotate(conjugate(r[k]), vectors[k]));
        Self::join(delta, chord);
        for (k, out) in frame.chunks_exact_mut(4).enumerate() {
            let next = multiply(r[k], exp(delta[k].each(|d| d * lane(-0.5))));
            // One step of Newton's method for 1/|q|.
            let shorten = lane(-0.5).mul_add(dot(&next, &next), lane(1.5));
            out.copy_from_slice(&next.each(|x| x * shorten));
        }
        first + second
    }
    #[inline(always)]
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let (r, vectors) = (Self::frame(frame), Self::vectors(p, v));
        Self::join(few(|k| rotate(conjugate(r[k]), vectors[k])), x);
    }
    #[inline(always)]
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let (r, vectors) = (Self::frame(frame), Self::split(x));
        Self::tangent(p, few(|k| rotate(r[k], vectors[k])), v);
    }
}

impl<F: Form> Origin for Pairs<F> {
    fn dim(&self) -> usize {
        F::FIRST + 3
    }
    fn chord_len(&self) -> usize {
        2 * cc::CHORD_LEN
    }
    fn curvature(&self) -> f64 {
        FRAC_1_SQRT_2
    }
    #[inline(always)]
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        for (d, prepared) in Self::split(chord).iter().zip(prepared.chunks_exact_mut(cc::CHORD_LEN)) {
            cc::prepare::<1, false>(d, prepared);
        }
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
        let (d, a, b) = (Self::split(d), Self::split(a), Self::split(b));
        let handles = [0, 1].map(|k| {
            cc::Handles::new::<1, false>(&d[k], &prepared[cc::CHORD_LEN * k..][..cc::CHORD_LEN], &a[k], &b[k])
        });
        let far = (handles[0].height() + handles[1].height()).simd_lt(Lane::ZERO);
        let mut w = [[[S::constant(Lane::ZERO); 3]; 2]; 2];
        let [plus, minus] = &mut w;
        for (k, handles) in handles.into_iter().enumerate() {
            handles.opposite(far).write(&d[k], &a[k], &b[k], &mut plus[k], &mut minus[k]);
        }
        Self::join(*plus, w_plus);
        Self::join(*minus, w_minus);
    }
    #[inline(always)]
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let (a, b, c) = (Self::split(a), Self::split(b), Self::split(c));
        let mut triple = [[S::constant(Lane::ZERO); 3]; 2];
        for k in 0..2 {
            cc::triple::<1, false, S>(&a[k], &b[k], &c[k], &mut triple[k]);
        }
        Self::join(triple, out);
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let (v, mut y) = (Self::split(v), Self::split(x));
        for k in 0..2 {
            cc::stretch::<1, false, S>(&v[k], &mut y[k]);
        }
        Self::join(y, x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        let [alpha, beta] = Self::split(v).each(|v| dot(&v, &v).sqrt());
        alpha + beta
    }
}

impl<F: Form> Space for Pairs<F> {
    const HOT: bool = F::HOT;

    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        let [alpha, beta] = Self::vectors(p, v).each(|v| dot(&v, &v).sqrt());
        alpha + beta
    }
    fn evaluate_with<E: Evaluation>(&self, evaluation: E) {
        evaluation.covered(self);
    }
}

impl<F: Form> Covered for Pairs<F> {
    type Cover = TwoSpheres;
    const LEN: usize = 8;

    fn cover(&self) -> TwoSpheres {
        self.cover
    }
    #[inline(always)]
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]) {
        for e in 0..2 {
            let ([a, b], [alpha, beta]) = (Self::of(p[e]), Self::vectors(p[e], v[e]));
            y[e].copy_from_slice([a, b].as_flattened());
            w[e].copy_from_slice([times_pure(a, alpha), times_pure(b, beta)].as_flattened());
        }
    }
    #[inline(always)]
    fn choose(&self, from: &[Lane], [q, y, w]: [&mut [Lane]; 3]) {
        let flip = dot(from, q).simd_lt(Lane::ZERO);
        if flip.any() {
            q.iter_mut().chain(y).chain(w).for_each(|x| *x = flip.select(-*x, *x));
        }
    }
    #[inline(always)]
    fn leave(&self, _side: Lane, y: &[Lane], w: Option<&[Lane]>, out: &mut [Lane]) {
        let pair = Self::frame(y);
        let x = match w {
            Some(w) => Self::moved(pair, Self::frame(w)),
            None => F::matrix(pair[0], pair[1]),
        };
        out.copy_from_slice(&x[..out.len()]);
    }
    #[inline(always)]
    fn lower(&self, _side: Lane, y: &[Lane], gradient: &[Lane], _image: &mut [Lane], out: &mut [Lane]) {
        let [a, b] = Self::frame(y);
        let all = few(|i| if i < gradient.len() { gradient[i] } else { Lane::ZERO });
        let by_products = F::by_products(&all);
        for k in 0..4 {
            out[k] = dot(&by_products[k], &b);
            out[4 + k] = dot(&by_products.each(|row| row[k]), &a);
        }
    }
}
