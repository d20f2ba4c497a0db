//! Groups of invertible matrices as symmetric spaces with the connection of Cartan and Schouten: G × G acts by
//! g·p = g_L p g_R⁻¹, the symmetry at p is x ↦ p x⁻¹ p, geodesics are p exp(tΩ).
//!
//! A tangent vector at p is v = pΩ; its transvection is `E_p(v)x = p e^{Ω/2} p⁻¹ x e^{Ω/2}`. The logarithm `log_p(q)
//! = p log(p⁻¹q)` is the principal one: it exists if no eigenvalue of p⁻¹q is a negative number, and the deciding
//! angle is the largest |arg| of an eigenvalue. The group has no invariant metric: lengths are those of Ω, for
//! reporting only. Curves through points of a closed subgroup stay in it, so that this implementation also serves
//! subgroups, with [`Members`] to define them.

use crate::algebra::Algebra;
use crate::members::{Members, condition};
use std::f64::consts::{PI, SQRT_2};
use symspline_core::matrix::{
    Dynamic, Matrix, Moved, Storage, determinant, exp_any_minus_one, inverse, largest_imaginary,
    log_any_one_plus,
};
use symspline_core::scalar::{Lane, Scalar, lane, max_or_nan};
use symspline_core::space::{Ambient, Frame, Origin, Space, pull_back_by_transport};

/// Invertible matrices: real for D = 1, complex for D = 2.
#[derive(Clone, Copy)]
pub struct GeneralLinear<const D: usize, A = Dynamic> {
    n: usize,
    members: Members,
    algebra: Algebra<D, A>,
}

impl<const D: usize, A: Storage> GeneralLinear<D, A> {
    /// The group, or a closed subgroup of it, for the n of its name.
    pub fn new(n: usize, members: Members) -> Result<Self, String> {
        let n = members.rows(n)?;
        Ok(GeneralLinear { n, members, algebra: Algebra::new(n, members) })
    }

    fn read<S: Scalar>(&self, x: &[S]) -> Matrix<S, D, A> {
        Matrix::read(self.n, self.n, x)
    }

    /// p⁻¹
    fn inverse<S: Scalar>(&self, p: &Matrix<S, D, A>) -> Matrix<S, D, A> {
        self.members.adjoint(p).unwrap_or_else(|| inverse(p))
    }

    /// The Ω with v = pΩ.
    fn generator(&self, p: &[Lane], v: &[Lane]) -> Matrix<Lane, D, A> {
        self.algebra.part(self.inverse(&self.read(p)).times(&self.read(v)))
    }

    /// `log(p⁻¹q)` and its deciding angle; `p⁻¹q − 1` without cancellation for near points.
    fn log_between<S: Scalar>(&self, p: &Matrix<S, D, A>, q: &Matrix<S, D, A>) -> (Matrix<S, D, A>, Lane) {
        log_any_one_plus(&self.inverse(p).times(&(q - p)))
    }

    /// p e^{tΩ}, with the derivatives in t that t has.
    fn moved(&self, p: &[Lane], omega: &Matrix<Lane, D, A>, t: Lane, order: usize) -> Moved<D, A> {
        let p = self.read(p);
        let x = &p.times(&exp_any_minus_one(&omega.scaled(t))) + &p;
        Moved::by_generator(x, omega, order)
    }

    /// g_R of a frame, and its inverse.
    fn frame(&self, frame: &[Lane]) -> [Matrix<Lane, D, A>; 2] {
        let (r, back) = frame.split_at(self.point_len());
        [self.read(r), self.read(back)]
    }
}

impl<const D: usize, A: Storage> Ambient for GeneralLinear<D, A> {
    fn point_len(&self) -> usize {
        self.n * self.n * D
    }
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n, self.n]
    }
    fn is_complex(&self) -> bool {
        D == 2
    }
    fn is_connected(&self) -> bool {
        D == 2 || !self.members.two_parts()
    }
    fn component(&self, p: &[f64]) -> bool {
        let lanes: Vec<Lane> = p.iter().map(|&x| lane(x)).collect();
        determinant(&self.read(&lanes))[0].to_array()[0] > 0.0
    }
    fn cut_angle(&self) -> f64 {
        PI
    }
    fn injectivity_radius(&self) -> f64 {
        // Eigenvalues are bounded by the norm of the matrix; those of real matrices come in pairs.
        if D == 1 { SQRT_2 * PI } else { PI }
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        self.moved(p, &self.generator(p, v), t.value(), S::ORDER).write(t, out);
    }
    fn ray_len(&self) -> usize {
        self.point_len()
    }
    fn prepare_ray(&self, p: &[Lane], v: &[Lane], prepared: &mut [Lane]) {
        self.generator(p, v).write(prepared);
    }
    fn prepared_ray<S: Scalar>(&self, p: &[Lane], _v: &[Lane], prepared: &[Lane], t: S, out: &mut [S]) {
        self.moved(p, &self.read(prepared), t.value(), S::ORDER).write(t, out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let p = self.read(p);
        let (omega, angle) = self.log_between(&p, &self.read(q));
        p.times(&self.algebra.part(omega)).write(out);
        angle
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let p = self.read(p);
        let (omega, _) = self.log_between(&p, &self.read(q));
        (&p.times(&exp_any_minus_one(&omega.times_scalar(t))) + &p).write(out);
    }
    fn distance(&self, p: &[Lane], q: &[Lane], log: &[Lane], _angle: Lane) -> Lane {
        let length = max_or_nan(self.inner(p, log, log), Lane::ZERO).sqrt();
        if self.is_connected() {
            return length;
        }
        // Matrices whose determinants have different signs are not joined by a curve.
        let [p, q] = [p, q].map(|x| determinant(&self.read(x))[0].signum());
        (p * q).simd_lt(Lane::ZERO).select(lane(f64::INFINITY), length)
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let p = self.read(p);
        let back = self.inverse(&p);
        let omega = self.algebra.part(back.times(&self.read(v)));
        let half = exp_any_minus_one(&omega.scaled(lane(0.5))).plus_identity(Lane::ONE);
        p.times(&half).times(&back).times(&self.read(x)).times(&half).write(out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let omega = self.generator(gamma, d);
        self.read(gamma).times(&omega).write(d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        // γ d/dt(γ⁻¹γ') = γ(γ⁻¹γ'' − (γ⁻¹γ')²)
        let p = self.read(gamma);
        let back = self.inverse(&p);
        let omega = back.times(&self.read(d));
        let rest = &back.times(&self.read(dd)) - &omega.times(&omega);
        p.times(&self.algebra.part(rest)).write(dd);
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        self.generator(p, u).inner(&self.generator(p, v))
    }
    /// Re tr p⁻¹u p⁻¹v, which is invariant under the group.
    fn pairing(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        let back = self.inverse(&self.read(p));
        back.times(&self.read(u)).adjoint().inner(&back.times(&self.read(v)))
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        // p λ* p, which is not in the algebra of a subgroup.
        let p = self.read(p);
        p.times(&self.read(gradient).adjoint()).times(&p).write(gradient);
    }
    /// Subgroups use the whole group, since the form may be degenerate on their algebras.
    fn pull_back(
        &self,
        p: &[Lane],
        q: &[Lane],
        t: Lane,
        cotangent: &[Lane],
        to_p: &mut [Lane],
        to_q: &mut [Lane],
    ) -> Lane {
        let algebra =
            if self.members == Members::All { self.algebra } else { Algebra::new(self.n, Members::All) };
        let whole = GeneralLinear { n: self.n, members: Members::All, algebra };
        pull_back_by_transport(&whole, p, q, t, cotangent, to_p, to_q)
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let mut p = self.read(x).stored();
        let off = self.members.project(&mut p);
        p.write(x);
        off
    }
    fn random_point(&self, noise: &mut [Lane]) {
        let omega = self.algebra.part(self.read(noise)).scaled(lane(0.4 / (self.n as f64).sqrt()));
        exp_any_minus_one(&omega).plus_identity(Lane::ONE).write(noise);
        self.project(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        let lanes: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
        self.members.violation(&self.read(&lanes).stored())
    }
    /// The condition number of p: rounding of p changes it by this factor more, relative to p.
    fn rounding(&self, p: &[Lane]) -> Lane {
        condition(&self.read(p)).max(Lane::ONE)
    }
}

impl<const D: usize, A: Storage> Frame for GeneralLinear<D, A> {
    fn frame_len(&self) -> usize {
        2 * self.point_len()
    }
    // A frame at p is g_R of a pair (g_L, g_R) with p = g_L g_R⁻¹, and its inverse: coordinates of pΩ are those of
    // g_R⁻¹ Ω g_R.
    fn lift(&self, _p: &[Lane], frame: &mut [Lane]) {
        for half in frame.chunks_exact_mut(self.point_len()) {
            Matrix::<Lane, D, A>::identity(self.n).write(half);
        }
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (omega, angle) = self.log_between(&self.read(p), &self.read(q));
        let [r, back] = self.frame(frame);
        self.algebra.coordinates(&back.times(&omega).times(&r), chord);
        // The frame is moved by its coordinates, so that it stays in the group.
        let r = &r.times(&exp_any_minus_one(&self.algebra.multiple(-0.5, chord))) + &r;
        let (first, second) = frame.split_at_mut(self.point_len());
        r.write(first);
        inverse(&r).write(second);
        angle
    }
    fn reorthonormalize(&self, frame: &mut [Lane], _p: &[Lane]) {
        let (r, back) = frame.split_at_mut(self.point_len());
        self.project(r);
        inverse(&self.read(r)).write(back);
    }
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let [r, back] = self.frame(frame);
        self.algebra.coordinates(&back.times(&self.generator(p, v)).times(&r), x);
    }
    fn products(&self, frame: &[Lane], p: &[Lane], cotangent: &[Lane], x: &mut [Lane]) {
        let [r, back] = self.frame(frame);
        let omega = self.inverse(&self.read(p)).times(&self.read(cotangent));
        self.algebra.coordinates(&back.times(&omega).times(&r).adjoint(), x);
    }
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let [r, back] = self.frame(frame);
        let omega = r.times(&self.algebra.multiple(1.0, x)).times(&back);
        self.read(p).times(&omega).write(v);
    }
}

impl<const D: usize, A: Storage> Origin for GeneralLinear<D, A> {
    fn dim(&self) -> usize {
        self.algebra.dim()
    }
    fn chord_len(&self) -> usize {
        self.point_len()
    }
    fn curvature(&self) -> f64 {
        // There is no invariant metric.
        f64::NAN
    }
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        exp_any_minus_one(&self.algebra.multiple(0.5, chord)).write(prepared);
    }
    /// With m = e^{−a/2}e^{d/2}e^{−b/2} and m' the same in reverse order: w⁺ = log(m m'), w⁻ = −m⁻¹ w⁺ m.
    fn inner_handles<S: Scalar>(
        &self,
        _d: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        let ea = exp_any_minus_one(&self.algebra.multiple(-0.5, a));
        let eb = exp_any_minus_one(&self.algebra.multiple(-0.5, b));
        let ed = Matrix::constant(self.n, self.n, prepared);
        let m = ea.compose(&ed).compose(&eb);
        let (plus, _) = log_any_one_plus(&m.compose(&eb.compose(&ed).compose(&ea)));
        let m = m.plus_identity(Lane::ONE);
        let minus = -inverse(&m).times(&plus).times(&m);
        self.algebra.coordinates(&plus, w_plus);
        self.algebra.coordinates(&minus, w_minus);
    }
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        self.algebra.triple(a, b, c, out);
    }
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        self.algebra.stretch(v, x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        largest_imaginary(&self.algebra.multiple(1.0, v))
    }
    /// The square of the condition number of e^{d/2}, times the growth of errors in the logarithm near the cut locus.
    fn condition(&self, chord: &[Lane]) -> Lane {
        let half = exp_any_minus_one(&self.algebra.multiple(0.5, chord)).plus_identity(Lane::ONE);
        // Angles are bounded by the skew-symmetric part.
        let turn = self.algebra.multiple(1.0, chord).skew_part().size();
        let angle = if turn.simd_le(Lane::ONE).all() { turn } else { self.angle(chord) };
        let near = angle.simd_gt(lane(1.0)).select(angle / angle.sin().abs(), Lane::ONE);
        let grown = condition(&half).max(Lane::ONE);
        grown * grown * near
    }
}

impl<const D: usize, A: Storage> Space for GeneralLinear<D, A> {
    const HOT: bool = A::TINY && D == 1;
}
