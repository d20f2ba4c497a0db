//! The groups O(n), SO(n), U(n) and SU(n) as symmetric spaces: G × G acts by g·p = g_L p g_R⁻¹, the
//! symmetry at p is x ↦ p x⁻¹ p, geodesics are p exp(tΩ).
//!
//! A tangent vector at p is v = pΩ with skew-Hermitian Ω; its transvection is
//! `E_p(v)x = p e^{Ω/2} p⁻¹ x e^{Ω/2}`. Angles are the arguments of eigenvalues.

use crate::logarithm::{SERIES, angles, complex, log_of_parts, su_limit, times_minus_i};
use std::f64::consts::{PI, SQRT_2};
use std::marker::PhantomData;
use symspline_core::matrix::{
    Dynamic, Matrix, Moved, SINE_LIMIT, Storage, arc, by_size, determinant, diagonalize, exp_skew_minus_one,
    from_parts, has_angles, log_by_sine, orthonormalize, parts_of, polar, reorthonormalize,
};
use symspline_core::scalar::{Each, Lane, Scalar, lane, max_or_nan};
use symspline_core::space::{Algebra, Ambient, Frame, Origin, Space, below};

/// Matrices with p*p = 1: real for D = 1, complex for D = 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitaryGroup<const D: usize, A = Dynamic> {
    n: usize,
    /// Of determinant one.
    special: bool,
    storage: PhantomData<A>,
}

/// Rotations and reflections of n dimensions.
#[cfg(feature = "unitary")]
pub fn orthogonal(n: usize) -> Result<UnitaryGroup<1>, String> {
    UnitaryGroup::new(n, false)
}

/// Rotations of n dimensions.
pub fn special_orthogonal(n: usize) -> Result<UnitaryGroup<1>, String> {
    UnitaryGroup::new(n, true)
}

impl<const D: usize, A: Storage> UnitaryGroup<D, A> {
    /// The group of n × n matrices, or those of determinant one.
    pub fn new(n: usize, special: bool) -> Result<Self, String> {
        // O(1) consists of two points.
        let least = if special || D == 1 { 2 } else { 1 };
        let name = match (D, special) {
            (1, true) => "SpecialOrthogonal",
            (1, false) => "Orthogonal",
            (_, true) => "SpecialUnitary",
            (_, false) => "Unitary",
        };
        if n < least {
            Err(format!("{name}(n) needs n >= {least}"))
        } else {
            Ok(UnitaryGroup { n, special, storage: PhantomData })
        }
    }

    /// Whether this is SU(n), whose logarithms have trace zero.
    fn is_su(&self) -> bool {
        D == 2 && self.special
    }

    fn algebra(&self) -> Algebra<D, A> {
        Algebra { n: self.n, skew: true, traceless: self.is_su(), storage: PhantomData }
    }

    fn read<S: Scalar>(&self, x: &[S]) -> Matrix<S, D, A> {
        Matrix::read(self.n, self.n, x)
    }

    /// The skew-Hermitian Ω with v = pΩ.
    fn generator(&self, p: &Matrix<Lane, D, A>, v: &[Lane]) -> Matrix<Lane, D, A> {
        let omega = p.adjoint_times(&self.read(v)).skew_part();
        if self.is_su() { traceless(omega) } else { omega }
    }

    /// The principal logarithm of 1 + E, and the deciding angle or an upper bound of it below the cut locus.
    fn log_one_plus<S: Scalar>(&self, e: &Matrix<S, D, A>) -> (Matrix<S, D, A>, Lane) {
        let (sine, versine) = (e.skew_part(), -e.hermitian_part());
        // Where a sum of angles can be 2π, the principal logarithm may have a nonzero trace.
        let n = self.n;
        let limit = if self.is_su() { su_limit(n as f64) } else { SERIES };
        let size = versine.size();
        let mut angle = lane(1.37 * if self.is_su() { 2.0 } else { 1.0 });
        let near = if has_angles::<D, A>(n) { SINE_LIMIT } else { -1.0 };
        let log = by_size(size, &[near, limit], |tier| {
            match tier {
                0 => return log_by_sine(&sine, size),
                1 => return sine.times(&arc(&versine)),
                _ => {}
            }
            let (log, exact) = log_of_parts::<D>(n, &parts_of(e), self.is_su());
            angle = size.simd_le(lane(limit)).select(angle, exact);
            from_parts(n, n, &log)
        });
        // Small steps have small angles.
        let bound = size.simd_le(lane(limit)).select(log.size(), angle);
        (log, angle.min(bound))
    }

    /// p e^{tΩ}, with the derivatives in t that t has.
    fn moved(&self, p: &[Lane], omega: &Matrix<Lane, D, A>, t: Lane, order: usize) -> Moved<D, A> {
        let p = self.read(p);
        let x = &p.times(&exp_skew_minus_one(&omega.scaled(t))) + &p;
        Moved::by_generator(x, omega, order)
    }

    /// `log(p⁻¹q)` and its deciding angle.
    fn log_between(&self, p: &Matrix<Lane, D, A>, q: &Matrix<Lane, D, A>) -> (Matrix<Lane, D, A>, Lane) {
        // p*q − 1 without cancellation for near points.
        self.log_one_plus(&p.adjoint_times(&(q - p)))
    }

    fn metric() -> Lane {
        lane(if D == 1 { 0.5 } else { 1.0 })
    }
}

/// Removes the component along the identity.
fn traceless<const D: usize, A: Storage>(mut m: Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
    let n = m.rows();
    let mean = (0..n).fold(Lane::ZERO, |sum, i| sum + m[(i, i)][D - 1]) / lane(n as f64);
    (0..n).for_each(|i| m[(i, i)][D - 1] -= mean);
    m
}

impl<const D: usize, A: Storage> Ambient for UnitaryGroup<D, A> {
    fn point_len(&self) -> usize {
        self.n * self.n * D
    }
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n, self.n]
    }
    fn is_complex(&self) -> bool {
        D == 2
    }
    fn cut_angle(&self) -> f64 {
        if self.is_su() { 2.0 * PI } else { PI }
    }
    fn injectivity_radius(&self) -> f64 {
        if self.is_su() { SQRT_2 * PI } else { PI }
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        self.moved(p, &self.generator(&self.read(p), v), t.value(), S::ORDER).write(t, out);
    }
    fn ray_len(&self) -> usize {
        self.point_len()
    }
    fn prepare_ray(&self, p: &[Lane], v: &[Lane], prepared: &mut [Lane]) {
        self.generator(&self.read(p), v).write(prepared);
    }
    fn prepared_ray<S: Scalar>(&self, p: &[Lane], _v: &[Lane], prepared: &[Lane], t: S, out: &mut [S]) {
        self.moved(p, &self.read(prepared), t.value(), S::ORDER).write(t, out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let p = self.read(p);
        let (omega, angle) = self.log_between(&p, &self.read(q));
        p.times(&omega).write(out);
        angle
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let (p, q) = (self.read(p), self.read(q));
        let (omega, _) = self.log_one_plus(&p.adjoint_times(&(&q - &p)));
        (&p.times(&exp_skew_minus_one(&omega.times_scalar(t))) + &p).write(out);
    }
    fn distance(&self, p: &[Lane], q: &[Lane], log: &[Lane], angle: Lane) -> Lane {
        let mut length = max_or_nan(self.inner(p, log, log), Lane::ZERO).sqrt();
        let half_turn = !angle.simd_lt(below(PI));
        if D == 1 && half_turn.any() {
            // A real logarithm uses pairs of eigenvectors, which are determined only up to the cut locus.
            let e = self.read(p).adjoint_times(&(&self.read(q) - &self.read(p)));
            let angles = angles(&complex::<D>(self.n, e.entries().as_flattened()));
            let squares = angles.iter().fold(Lane::ZERO, |sum, x| x.mul_add(*x, sum));
            length = half_turn.select((squares * Self::metric()).sqrt(), length);
        }
        if self.is_connected() {
            return length;
        }
        // No curve joins a rotation and a reflection.
        let [p, q] = [p, q].each(|x| determinant(&self.read(x))[0]);
        (p * q).simd_lt(Lane::ZERO).select(lane(f64::INFINITY), length)
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let p = self.read(p);
        let half = exp_skew_minus_one(&self.generator(&p, v).scaled(lane(0.5))).plus_identity(Lane::ONE);
        p.times(&half).times_adjoint(&p).times(&self.read(x)).times(&half).write(out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let p = self.read(gamma);
        p.times(&self.generator(&p, d)).write(d);
    }
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        // γ d/dt(γ⁻¹γ') = γ(γ*γ'' + γ'*γ'), and γ'*γ' is Hermitian.
        self.velocity(gamma, dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        self.read(u).inner(&self.read(v)) * Self::metric()
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        self.velocity(p, gradient);
        gradient.iter_mut().for_each(|x| *x *= lane(1.0) / Self::metric());
    }
    /// The momentum of v at p is vp*.
    fn conserve(&self, p: &[Lane], c: [&[Lane]; 2], q: [&[Lane]; 2], to_p: &mut [Lane]) -> bool {
        let p = self.read(p);
        let [at_c, at_q] = [c, q].map(|[x, v]| self.read(v).times(&self.read(x).adjoint_times(&p)));
        (&self.read(to_p) + &(&at_c - &at_q)).write(to_p);
        true
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let mut p = self.read(x);
        let defect = p.adjoint_times(&p).plus_identity(lane(-1.0));
        let mut off = defect.size() * lane(0.5);
        let n = lane(self.n as f64);
        let rounding = off.simd_le(n * lane(2.0 * f64::EPSILON));
        if !rounding.all() {
            let nearest = polar(&p, off);
            p = symspline_core::matrix::Select::select(rounding, p, nearest);
        }
        if self.special {
            let det = determinant(&p);
            if D == 1 {
                // A reflection is far from every rotation.
                let reflection = det[0].simd_lt(Lane::ZERO);
                off = reflection.select(lane(f64::INFINITY), off);
                p = symspline_core::matrix::Select::select(reflection, p.scaled(lane(f64::NAN)), p);
            } else {
                let phase = det[D - 1].atan2(det[0]);
                off = max_or_nan(off, phase.abs());
                let turn = phase.abs().simd_gt(lane(4.0 * f64::EPSILON) * n).select(phase / n, Lane::ZERO);
                let (sin, cos) = turn.sin_cos();
                p = p.map_entries(|x| {
                    let mut y = x;
                    y[0] = x[0] * cos + x[D - 1] * sin;
                    y[D - 1] = x[D - 1] * cos - x[0] * sin;
                    y
                });
            }
        }
        p.write(x);
        off
    }
    fn random_point(&self, noise: &mut [Lane]) {
        let mut p = self.read(noise);
        // The factor Q of a Gaussian matrix, with R positive on its diagonal, is uniform.
        orthonormalize(&mut p);
        if self.special {
            let det = determinant(&p);
            for i in 0..self.n {
                // The first column times the inverse of the determinant.
                let x = p[(i, 0)];
                let mut y = x.each(|x| x * det[0]);
                if D == 2 {
                    y[0] = x[0] * det[0] + x[D - 1] * det[D - 1];
                    y[D - 1] = x[D - 1] * det[0] - x[0] * det[D - 1];
                }
                p[(i, 0)] = y;
            }
        }
        p.write(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        let lanes: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
        let p = self.read(&lanes);
        let off = p.adjoint_times(&p).plus_identity(lane(-1.0)).size().to_array()[0];
        let (columns, what) = if D == 1 { ("orthonormal", "xᵀx") } else { ("orthonormal", "x*x") };
        if off > 1e-4 || !self.special {
            return format!("its columns are not {columns}: |{what} - 1| = {off:.3e}");
        }
        let det = determinant(&p).each(|x| x.to_array()[0]);
        if D == 1 && det[0] < 0.0 {
            "its determinant is -1: it is a reflection, not a rotation (swap two columns, or change the sign of one)"
                .into()
        } else if D == 2 && off < 1e-6 {
            let phase = det[D - 1].atan2(det[0]);
            format!("its determinant is not 1 but has the phase {phase:.3e} (Unitary({}) takes it)", self.n)
        } else {
            format!("its columns are not {columns}: |{what} - 1| = {off:.3e}")
        }
    }
    fn is_connected(&self) -> bool {
        D == 2 || self.special
    }
    fn component(&self, p: &[f64]) -> bool {
        let lanes: Vec<Lane> = p.iter().map(|&x| lane(x)).collect();
        determinant(&self.read(&lanes))[0].to_array()[0] > 0.0
    }
}

impl<const D: usize, A: Storage> Frame for UnitaryGroup<D, A> {
    fn frame_len(&self) -> usize {
        self.point_len()
    }
    // A frame at p is g_R of a pair (g_L, g_R) with p = g_L g_R⁻¹: coordinates of pΩ are those of
    // g_R⁻¹ Ω g_R.
    fn lift(&self, _p: &[Lane], frame: &mut [Lane]) {
        Matrix::<Lane, D, A>::identity(self.n).write(frame);
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (omega, angle) = self.log_between(&self.read(p), &self.read(q));
        let mut r = self.read(frame);
        let delta = r.adjoint_times(&omega).times(&r).skew_part();
        self.algebra().coordinates(&delta, chord);
        r = &r.times(&exp_skew_minus_one(&delta.scaled(lane(-0.5)))) + &r;
        reorthonormalize(&mut r);
        r.write(frame);
        angle
    }
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let (r, p) = (self.read(frame), self.read(p));
        let omega = self.generator(&p, v);
        self.algebra().coordinates(&r.adjoint_times(&omega).times(&r), x);
    }
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let (r, p) = (self.read(frame), self.read(p));
        let omega = r.times(&self.algebra().matrix(x)).times_adjoint(&r);
        p.times(&omega).write(v);
    }
}

impl<const D: usize, A: Storage> Origin for UnitaryGroup<D, A> {
    fn dim(&self) -> usize {
        self.algebra().dim()
    }
    fn chord_len(&self) -> usize {
        self.point_len()
    }
    fn curvature(&self) -> f64 {
        // ½ by [[a,b],c] with a, b, c in so(3) = R³ and ½tr; commutative groups are flat.
        match (D, self.n) {
            (1, 1 | 2) | (2, 1) => 0.0,
            (1, 3) => 0.5,
            _ => 1.0 / SQRT_2,
        }
    }
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        exp_skew_minus_one(&self.algebra().multiple(0.5, chord)).write(prepared);
    }
    /// M = (m, m'⁻¹) with m = e^{−a/2}e^{d/2}e^{−b/2} and m' the same in reverse order: w⁺ = log(m m'), and
    /// w⁻ = log(m⁻¹m'⁻¹) is its image under conjugation by m.
    fn inner_handles<S: Scalar>(
        &self,
        _d: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        let algebra = self.algebra();
        let ea = exp_skew_minus_one(&algebra.multiple(-0.5, a));
        let eb = exp_skew_minus_one(&algebra.multiple(-0.5, b));
        let ed = Matrix::<S, D, A>::constant(self.n, self.n, prepared);
        let m = ea.compose(&ed).compose(&eb);
        let reverse = eb.compose(&ed).compose(&ea);
        let (plus, _) = self.log_one_plus(&m.compose(&reverse));
        // −m* w⁺ m
        let right = &plus.times(&m) + &plus;
        let minus = -(&m.adjoint_times(&right) + &right);
        algebra.coordinates(&plus, w_plus);
        algebra.coordinates(&minus, w_minus);
    }
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        self.algebra().triple(a, b, c, out);
    }
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        self.algebra().stretch(v, x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        let omega = self.algebra().matrix(v);
        let mut angles = [times_minus_i(complex::<D>(self.n, omega.entries().as_flattened()))];
        diagonalize(&mut angles);
        let theta = (0..self.n).map(|i| angles[0][(i, i)][0]);
        if self.is_su() {
            let (most, least) =
                theta.fold((lane(-f64::INFINITY), lane(f64::INFINITY)), |(a, b), x| (a.max(x), b.min(x)));
            most - least
        } else {
            theta.fold(Lane::ZERO, |m, x| max_or_nan(m, x.abs()))
        }
    }
}

impl<const D: usize, A: Storage> Space for UnitaryGroup<D, A> {}
