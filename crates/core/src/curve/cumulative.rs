//! Cumulative B-spline curves on Lie groups (Kim, Kim & Shin 1995)
//!
//! ```text
//! γ(t) = p₀ exp(λ₁(t) ω₁) ⋯ exp(λ_d(t) ω_d),   ω_j = log(p_{j−1}⁻¹ p_j),   λ_j = Σ_{m ≥ j} B_m,
//! ```
//!
//! where p₀, …, p_d are the control points whose basis functions B_m of degree d are not zero at t. Points are square
//! matrices, or vectors, which are added.

use super::data::BSpline;
use crate::matrix::{Matrix, inverse};
use crate::monitor::checkpoint;
use crate::scalar::{LANES, Lane, Scalar, few, gather, lane, scatter};
use crate::space::{Ambient, Erased, Frame, below};

/// How two elements of a group are multiplied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplication {
    /// Vectors are added.
    Sum,
    /// Real square matrices, of this number of rows.
    Real(usize),
    /// Complex square matrices.
    Complex(usize),
}

impl Multiplication {
    /// The multiplication of a space that is a group.
    pub fn of(space: &Erased) -> Self {
        match (space.point_shape()[..].len(), space.is_complex()) {
            (1, false) => Multiplication::Sum,
            (_, false) => Multiplication::Real(space.point_shape()[0]),
            (_, true) => Multiplication::Complex(space.point_shape()[0]),
        }
    }

    /// The identity, as an array of `len` numbers.
    pub fn identity(self, len: usize) -> Vec<Lane> {
        let mut one = vec![Lane::ZERO; len];
        match self {
            Multiplication::Sum => {}
            Multiplication::Real(n) => Matrix::<Lane, 1>::identity(n).write(&mut one),
            Multiplication::Complex(n) => Matrix::<Lane, 2>::identity(n).write(&mut one),
        }
        one
    }

    /// x ← x a; `work` has the length of x.
    #[inline]
    pub fn multiply<S: Scalar>(self, x: &mut [S], a: &[S], work: &mut [S]) {
        match self {
            Multiplication::Sum => x.iter_mut().zip(a).for_each(|(x, a)| *x = *x + *a),
            Multiplication::Real(2) => times_real(2, x, a, work),
            Multiplication::Real(3) => times_real(3, x, a, work),
            Multiplication::Real(4) => times_real(4, x, a, work),
            Multiplication::Real(n) => times_real(n, x, a, work),
            Multiplication::Complex(2) => times_complex(2, x, a, work),
            Multiplication::Complex(n) => times_complex(n, x, a, work),
        }
    }

    /// p⁻¹v, for a point or tangent vector v.
    pub fn left_quotient(self, p: &[Lane], v: &mut [Lane]) {
        match self {
            Multiplication::Sum => {}
            Multiplication::Real(n) => {
                inverse(&Matrix::<Lane, 1>::read(n, n, p)).times(&Matrix::read(n, n, v)).write(v);
            }
            Multiplication::Complex(n) => {
                inverse(&Matrix::<Lane, 2>::read(n, n, p)).times(&Matrix::read(n, n, v)).write(v);
            }
        }
    }
}

#[inline(always)]
fn times_real<S: Scalar>(n: usize, x: &mut [S], a: &[S], work: &mut [S]) {
    for i in 0..n {
        for j in 0..n {
            let mut sum = x[i * n] * a[j];
            for k in 1..n {
                sum = x[i * n + k].fma(a[k * n + j], sum);
            }
            work[i * n + j] = sum;
        }
    }
    x[..n * n].copy_from_slice(&work[..n * n]);
}

#[inline(always)]
fn times_complex<S: Scalar>(n: usize, x: &mut [S], a: &[S], work: &mut [S]) {
    for i in 0..n {
        for j in 0..n {
            let mut sum = [S::constant(Lane::ZERO); 2];
            for k in 0..n {
                let ([xr, xi], [ar, ai]) = (few(|c| x[2 * (i * n + k) + c]), few(|c| a[2 * (k * n + j) + c]));
                sum = [xr.fma(ar, (-xi).fma(ai, sum[0])), xr.fma(ai, xi.fma(ar, sum[1]))];
            }
            work[2 * (i * n + j)..][..2].copy_from_slice(&sum);
        }
    }
    x[..2 * n * n].copy_from_slice(&work[..2 * n * n]);
}

/// The ω of every pair of neighbouring control points, as an array of the size of a point: `count − 1` per curve, curve
/// after curve. An error is the row of the first pair beyond the cut locus, and its deciding angle.
pub fn cumulative_steps(
    space: &Erased,
    control: &[f64],
    count: usize,
    out: &mut [f64],
) -> Result<(), (usize, f64)> {
    let (len, group) = (space.point_len(), Multiplication::of(space));
    let limit = below(space.cut_angle());
    let rows = out.len() / len;
    let mut arrays = [(); 3].map(|()| vec![Lane::ZERO; len]);
    for (first, out) in out.chunks_mut(LANES * len).enumerate() {
        checkpoint();
        let [p, q, omega] = &mut arrays;
        let at: [usize; LANES] = few(|l| (first * LANES + l).min(rows - 1));
        let point = |row: usize| (row / (count - 1) * count + row % (count - 1)) * len;
        gather(few(|l| &control[point(at[l])..][..len]), p);
        gather(few(|l| &control[point(at[l]) + len..][..len]), q);
        let angle = space.log(p, q, omega);
        if !angle.simd_lt(limit).all() {
            let (angle, limit) = (angle.to_array(), limit.to_array());
            if let Some(l) = (0..LANES).find(|&l| !(angle[l] < limit[l])) {
                return Err((at[l], angle[l]));
            }
        }
        group.left_quotient(p, omega);
        scatter(omega, out);
    }
    Ok(())
}

/// The basis functions of the intervals of a time per lane that are not zero there, by the recursion of Cox and de Boor
/// (Piegl & Tiller, The NURBS Book, algorithm A2.2), and sums of them: entry j ≥ 1 becomes `λ_j`, entry 0 one.
pub fn cumulative_basis<S: Scalar>(
    curve: &BSpline,
    interval: [usize; LANES],
    times: [f64; LANES],
    basis: &mut [S],
) {
    let (t, degree) = (curve.knots, curve.degree);
    basis[0] = S::constant(Lane::ONE);
    for r in 1..=degree {
        let mut saved = S::constant(Lane::ZERO);
        for j in 0..r {
            let from = Lane::new(few(|l| t[interval[l] + 1 + j - r]));
            let to = Lane::new(few(|l| t[interval[l] + 1 + j]));
            let (x, rate) = (Lane::new(times), Lane::ONE / (to - from));
            let left = S::from_parts([(x - from) * rate, rate, Lane::ZERO]);
            let right = S::from_parts([(to - x) * rate, -rate, Lane::ZERO]);
            let old = basis[j];
            basis[j] = right.fma(old, saved);
            saved = left * old;
        }
        basis[r] = saved;
    }
    for j in (1..degree).rev() {
        basis[j] = basis[j] + basis[j + 1];
    }
    basis[0] = S::constant(Lane::ONE);
}

/// Memory for the evaluation of a sample per lane.
pub(super) struct Factors<S> {
    group: Multiplication,
    one: Vec<Lane>,
    omega: Vec<Lane>,
    basis: Vec<S>,
    factor: Vec<S>,
    work: Vec<S>,
}

impl<S: Scalar> Factors<S> {
    pub fn new(space: &Erased, degree: usize) -> Self {
        let (len, group) = (space.point_len(), Multiplication::of(space));
        let zeros = |n: usize| vec![S::constant(Lane::ZERO); n];
        let (one, omega) = (group.identity(len), vec![Lane::ZERO; len]);
        Factors { group, one, omega, basis: zeros(degree + 1), factor: zeros(len), work: zeros(len) }
    }

    /// γ at a time per lane, of an interval of a curve each, from their first control points p in `gamma`.
    pub fn evaluate(
        &mut self,
        space: &Erased,
        curve: &BSpline,
        curves: [usize; LANES],
        interval: [usize; LANES],
        times: [f64; LANES],
        gamma: &mut [S],
    ) {
        let len = space.point_len();
        cumulative_basis(curve, interval, times, &mut self.basis);
        for j in 1..=curve.degree {
            let row = |l: usize| curves[l] * (curve.count() - 1) + interval[l] - curve.degree + j - 1;
            gather(few(|l| &curve.steps[row(l) * len..][..len]), &mut self.omega);
            if self.group == Multiplication::Sum {
                for (x, omega) in gamma.iter_mut().zip(&self.omega) {
                    *x = self.basis[j].fma_lane(*omega, *x);
                }
            } else {
                space.ray(&self.one, &self.omega, self.basis[j], &mut self.factor);
                self.group.multiply(gamma, &self.factor, &mut self.work);
            }
        }
    }
}

/// Coordinates of an element of the Lie algebra, given as a tangent vector at the identity; the sum of their squares is
/// its squared length.
pub struct Coordinates {
    one: Vec<Lane>,
    frame: Vec<Lane>,
}

impl Coordinates {
    /// Coordinates in the algebra of a group.
    pub fn new(space: &Erased) -> Self {
        let one = Multiplication::of(space).identity(space.point_len());
        let mut frame = vec![Lane::ZERO; space.frame_len()];
        space.lift(&one, &mut frame);
        Coordinates { one, frame }
    }

    /// The coordinates of an element.
    pub fn of(&self, space: &Erased, omega: &[Lane], x: &mut [Lane]) {
        space.coordinates(&self.frame, &self.one, omega, x);
    }

    /// The element with given coordinates.
    pub fn element(&self, space: &Erased, x: &[Lane], omega: &mut [Lane]) {
        space.tangent(&self.frame, &self.one, x, omega);
    }

    /// exp of the element with given coordinates.
    pub fn exp(&self, space: &Erased, x: &[Lane], out: &mut [Lane]) {
        let mut omega = vec![Lane::ZERO; self.one.len()];
        self.element(space, x, &mut omega);
        space.ray(&self.one, &omega, lane(1.0), out);
    }
}
