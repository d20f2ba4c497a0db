//! Rotations of three dimensions, SO(3), by unit quaternions: S³ covers SO(3) twice, and a rotation vector ω is twice
//! a tangent vector of S³. Curves are solved and evaluated on the sphere, where q and −q represent the same point.
//!
//! A reflection p of O(3) is a rotation times −1. Formulas with p⁻¹q and p⁻¹v are the same for both.

use crate::rigid::{Quaternion, Vector, conjugate, cross, multiply, of_matrix, rotate, to_matrix};
use crate::unitary::UnitaryGroup;
use std::f64::consts::PI;
use symspline_core::delegate;
use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane};
use symspline_core::space::{Ambient, Covered, Evaluation, Frame, Origin, Space};
use symspline_core::special::{Trig, theta_over_sin};
use symspline_vectors::{Sphere, constant_curvature as cc};

/// SO(3) and O(3), with their own implementation for speed; it agrees with SO(n) and O(n).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rotations {
    general: UnitaryGroup<1>,
    cover: Sphere,
}

impl Rotations {
    /// Rotations of three dimensions.
    pub fn new() -> Result<Self, String> {
        Ok(Rotations { general: UnitaryGroup::new(3, true)?, cover: Sphere::new(3)? })
    }

    /// Rotations and reflections of three dimensions.
    pub fn with_reflections() -> Result<Self, String> {
        Ok(Rotations { general: UnitaryGroup::new(3, false)?, cover: Sphere::new(3)? })
    }

    /// The angle of two points, or `apart` for a rotation and a reflection, which no curve joins.
    #[inline(always)]
    fn joined(&self, p: &[Lane], q: &[Lane], angle: Lane, apart: Lane) -> Lane {
        if self.is_connected() {
            return angle;
        }
        (determinant(p) * determinant(q)).simd_lt(Lane::ZERO).select(apart, angle)
    }
}

/// The determinant of an orthogonal matrix.
#[inline(always)]
fn determinant(p: &[Lane]) -> Lane {
    dot(&p[..3], &cross([p[3], p[4], p[5]], [p[6], p[7], p[8]]))
}

const HALF: Lane = lane(0.5);
const TWO: Lane = lane(2.0);

#[inline(always)]
fn matrix<S: Scalar>(x: &[S]) -> [S; 9] {
    few(|i| x[i])
}

/// pᵀ x
#[inline(always)]
fn transposed_times<S: Scalar>(p: &[S; 9], x: &[S; 9]) -> [S; 9] {
    let column = |m: &[S; 9], j: usize| [m[j], m[3 + j], m[6 + j]];
    few(|c| dot(&column(p, c / 3), &column(x, c % 3)))
}

/// p x
#[inline(always)]
fn times<S: Scalar>(p: &[S; 9], x: &[S; 9]) -> [S; 9] {
    few(|c| {
        let (i, j) = (3 * (c / 3), c % 3);
        dot(&p[i..i + 3], &[x[j], x[3 + j], x[6 + j]])
    })
}

/// ω with Ω = (x − xᵀ)/2.
#[inline(always)]
fn axial(x: &[Lane; 9]) -> Vector<Lane> {
    [HALF * (x[7] - x[5]), HALF * (x[2] - x[6]), HALF * (x[3] - x[1])]
}

#[inline(always)]
fn skew([x, y, z]: Vector<Lane>) -> [Lane; 9] {
    [Lane::ZERO, -z, y, z, Lane::ZERO, -x, -y, x, Lane::ZERO]
}

/// The rotation vector of v = pΩ.
#[inline(always)]
fn vector(p: &[Lane], v: &[Lane]) -> Vector<Lane> {
    axial(&transposed_times(&matrix(p), &matrix(v)))
}

/// e^Ω as a quaternion.
#[inline(always)]
pub fn exp<S: Scalar>(omega: Vector<S>) -> Quaternion<S> {
    let half = Trig::new(dot(&omega, &omega) * lane(0.25));
    let [x, y, z] = omega.each(|o| o * (half.s * HALF));
    [half.c, x, y, z]
}

/// The rotation vector of a quaternion, and its angle.
#[inline(always)]
pub fn log<S: Scalar>(q: Quaternion<S>) -> (Vector<S>, Lane) {
    let flip = q[0].value().simd_lt(Lane::ZERO);
    let [w, v @ ..] = q.each(|x| S::select(flip, -x, x));
    // y = 1 − cos(θ/2) = sin²/(1 + cos), and θ = 2 (θ/2)/sin(θ/2) sin(θ/2).
    let sine2 = dot(&v, &v);
    let c = w.value() + Lane::ONE;
    let inverse = w.compose([Lane::ONE / c, -(Lane::ONE / (c * c)), TWO / (c * c * c)]);
    let f = theta_over_sin(sine2 * inverse, || c) * TWO;
    (v.each(|x| x * f), TWO * sine2.value().sqrt().atan2(w.value()))
}

/// The quaternion of p⁻¹q, exact for near points.
#[inline(always)]
fn between<S: Scalar>(p: &[S], q: &[S]) -> Quaternion<S> {
    let difference: [S; 9] = few(|i| q[i] - p[i]);
    of_matrix(transposed_times(&matrix(p), &difference))
}

/// The quaternion of a matrix.
#[inline(always)]
fn quaternion(p: &[Lane]) -> Quaternion<Lane> {
    let unit = |i: usize| if i.is_multiple_of(4) { Lane::ONE } else { Lane::ZERO };
    of_matrix(few(|i| p[i] - unit(i)))
}

/// q · (0, v)
#[inline(always)]
pub fn times_pure(q: Quaternion<Lane>, [x, y, z]: Vector<Lane>) -> Quaternion<Lane> {
    multiply(q, [Lane::ZERO, x, y, z])
}

/// pᵀp − 1
fn defect(p: &[Lane; 9]) -> [Lane; 9] {
    let square = transposed_times(p, p);
    few(|i| if i.is_multiple_of(4) { square[i] - Lane::ONE } else { square[i] })
}

/// Replaces a matrix by the nearest one of the group; returns the distance. Matrices close to it use the Newton steps
/// of [`polar`](symspline_core::matrix::polar), others the general implementation.
pub fn nearest(general: &UnitaryGroup<1>, x: &mut [Lane]) -> Lane {
    /// Up to this distance three steps are sufficient.
    const NEAR: Lane = lane(1e-3);
    let p: [Lane; 9] = matrix(x);
    let d = defect(&p);
    let mut off = dot(&d, &d).sqrt() * HALF;
    let near = off.simd_le(NEAR);
    let exact = off.simd_le(lane(6.0 * f64::EPSILON));
    let mut q = p;
    if !exact.all() {
        for _ in 0..3 {
            let step = times(&q, &defect(&q).each(|x| x * -HALF));
            q = few(|i| q[i] + step[i]);
        }
    }
    // A reflection is far from every rotation.
    let reflection = if general.is_connected() { determinant(&p).simd_lt(Lane::ZERO) } else { Lane::ZERO };
    q = few(|i| reflection.select(lane(f64::NAN), exact.select(p[i], q[i])));
    off = reflection.select(lane(f64::INFINITY), off);
    if !near.all() {
        let far = general.project(x);
        q = few(|i| near.select(q[i], x[i]));
        off = near.select(off, far);
    }
    x.copy_from_slice(&q);
    off
}

impl Ambient for Rotations {
    delegate!(rotations => rotations.general;
        transvect, inner, project_tangent, random_point, violation);

    fn point_len(&self) -> usize {
        9
    }
    fn point_shape(&self) -> Vec<usize> {
        vec![3, 3]
    }
    fn cut_angle(&self) -> f64 {
        PI
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        let omega = vector(p, v);
        let x = times(&matrix(p), &to_matrix(exp(omega.each(|o| o * t.value()))));
        let turn = skew(omega);
        let d = times(&x, &turn);
        let dd = times(&d, &turn);
        for i in 0..9 {
            out[i] = t.compose([x[i], d[i], dd[i]]);
        }
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let (omega, angle) = log(between(p, q));
        out.copy_from_slice(&times(&matrix(p), &skew(omega)));
        self.joined(p, q, angle, Lane::PI)
    }
    fn distance(&self, p: &[Lane], q: &[Lane], _log: &[Lane], angle: Lane) -> Lane {
        self.joined(p, q, angle, lane(f64::INFINITY))
    }
    fn is_connected(&self) -> bool {
        self.general.is_connected()
    }
    fn component(&self, p: &[f64]) -> bool {
        self.general.component(p)
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let (omega, _) = log(between(p, q));
        out.copy_from_slice(&times(&matrix(p), &to_matrix(exp(omega.each(|o| o * t)))));
    }
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        // With v = pΩ and x = pX, p e^{Ω/2} X e^{Ω/2} = q e^{−Ω/2} X e^{Ω/2}.
        let half = exp(vector(p, v).each(|o| o * HALF));
        out.copy_from_slice(&times(&matrix(q), &skew(rotate(conjugate(half), vector(p, x)))));
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let omega = vector(gamma, d);
        d.copy_from_slice(&times(&matrix(gamma), &skew(omega)));
    }
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        self.velocity(gamma, dd);
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        nearest(&self.general, x)
    }
}

impl Frame for Rotations {
    fn frame_len(&self) -> usize {
        4
    }
    // A frame is the quaternion of g_R, as for the other groups.
    fn lift(&self, _p: &[Lane], frame: &mut [Lane]) {
        frame.copy_from_slice(&[Lane::ONE, Lane::ZERO, Lane::ZERO, Lane::ZERO]);
    }
    #[inline(always)]
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (omega, angle) = log(between(p, q));
        let r = frame_of(frame);
        let delta = rotate(conjugate(r), omega);
        chord.copy_from_slice(&delta);
        let next = multiply(r, exp(delta.each(|d| d * lane(-0.5))));
        // One step of Newton's method for 1/|q|.
        let shorten = lane(-0.5).mul_add(dot(&next, &next), lane(1.5));
        frame.copy_from_slice(&next.each(|x| x * shorten));
        self.joined(p, q, angle, Lane::PI)
    }
    #[inline(always)]
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        x.copy_from_slice(&rotate(conjugate(frame_of(frame)), vector(p, v)));
    }
    #[inline(always)]
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let omega = rotate(frame_of(frame), [x[0], x[1], x[2]]);
        v.copy_from_slice(&times(&matrix(p), &skew(omega)));
    }
}

impl Origin for Rotations {
    fn dim(&self) -> usize {
        3
    }
    fn chord_len(&self) -> usize {
        cc::CHORD_LEN
    }
    fn curvature(&self) -> f64 {
        self.general.curvature()
    }
    #[inline(always)]
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        cc::prepare::<1, false>(&[chord[0], chord[1], chord[2]].each(|x| x * HALF), prepared);
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
        let half = |x: &[S]| [x[0], x[1], x[2]].each(|x| x * HALF);
        let (d, a, b) = ([d[0], d[1], d[2]].each(|x| x * HALF), half(a), half(b));
        let handles = cc::Handles::new::<1, false>(&d, prepared, &a, &b);
        let away = handles.height().simd_lt(Lane::ZERO);
        handles.opposite(away).write(&d, &a, &b, w_plus, w_minus);
        w_plus.iter_mut().chain(w_minus).for_each(|w| *w = *w * TWO);
    }
    #[inline(always)]
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let half = |x: &[S]| [x[0], x[1], x[2]].each(|x| x * HALF);
        cc::triple::<1, false, S>(&half(a), &half(b), c, out);
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        cc::stretch::<1, false, S>(&[v[0], v[1], v[2]].each(|x| x * HALF), x);
    }
}

impl Space for Rotations {
    const HOT: bool = true;

    fn evaluate_with<E: Evaluation>(&self, evaluation: E) {
        evaluation.covered(self);
    }
}

impl Covered for Rotations {
    type Cover = Sphere;
    const LEN: usize = 4;

    fn cover(&self) -> Sphere {
        self.cover
    }
    #[inline(always)]
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]) {
        for e in 0..2 {
            let q = if self.is_connected() {
                quaternion(p[e])
            } else {
                let side = self.side(p[0]);
                quaternion(&matrix(p[e]).each(|x| x * side))
            };
            y[e].copy_from_slice(&q);
            w[e].copy_from_slice(&times_pure(q, vector(p[e], v[e]).each(|x| x * HALF)));
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
    fn side(&self, p: &[Lane]) -> Lane {
        if self.is_connected() { Lane::ONE } else { determinant(p).signum() }
    }
    #[inline(always)]
    fn leave(&self, side: Lane, y: &[Lane], w: Option<&[Lane]>, out: &mut [Lane]) {
        let q: Quaternion<Lane> = few(|i| y[i]);
        let mut p = to_matrix(q);
        if !self.is_connected() {
            p = p.each(|x| x * side);
        }
        let Some(w) = w else {
            out.copy_from_slice(&p);
            return;
        };
        out.copy_from_slice(&times(&p, &skew(angular(q, w))));
    }
    #[inline(always)]
    fn body<'o>(&self, y: &[Lane], w: &[Lane], out: &'o mut [Lane]) -> &'o [Lane] {
        out[..3].copy_from_slice(&angular(few(|i| y[i]), w));
        &out[..3]
    }
}

/// The angular velocity ω of a quaternion q that moves with w: ω/2 is the vector part of q⁻¹w.
#[inline(always)]
pub fn angular([qw, qv @ ..]: Quaternion<Lane>, w: &[Lane]) -> [Lane; 3] {
    let wv = [w[1], w[2], w[3]];
    let turn = cross(qv, wv);
    few(|i| TWO * (qw * wv[i] - w[0] * qv[i] - turn[i]))
}

#[inline(always)]
fn frame_of(frame: &[Lane]) -> Quaternion<Lane> {
    few(|i| frame[i])
}
