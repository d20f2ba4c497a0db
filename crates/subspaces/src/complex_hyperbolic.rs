//! Complex hyperbolic space CHⁿ: the lines of negative square in Cⁿ⁺¹ with ⟨z,w⟩ = −z̄₀w₀ + Σ z̄ᵢwᵢ, G = U(n,1).
//!
//! A point is any z with ⟨z,z⟩ = −1 of its line, a tangent vector at that representative is *horizontal*,
//! ⟨z,v⟩ = 0, and its squared length is ⟨v,v⟩ (Goldman, Complex Hyperbolic Geometry, 1999). All formulas are those
//! of complex projective space with cosh for cos.

use symspline_core::matrix::Matrix;
use symspline_core::scalar::{Each, Lane, Scalar, dot, lane};
use symspline_core::space::{Model, far_out};
use symspline_core::special::{Trig, theta_over_sin};

/// Complex hyperbolic space of n complex dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComplexHyperbolic {
    n: usize,
}

impl ComplexHyperbolic {
    /// Lines in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        (1..usize::MAX).contains(&n).then_some(Self { n }).ok_or("ComplexHyperbolic(n) needs n >= 1".into())
    }
}

/// A vector of Cⁿ⁺¹, or a number as a matrix of one entry.
type Vector<S> = Matrix<S, 2>;

fn read<S: Scalar>(x: &[S]) -> Vector<S> {
    Matrix::read(x.len() / 2, 1, x)
}

/// ⟨z,w⟩
fn form<S: Scalar>(z: &Vector<S>, w: &Vector<S>) -> Vector<S> {
    let mut flipped = z.clone();
    flipped[(0, 0)] = z[(0, 0)].each(|x| -x);
    flipped.adjoint_times(w)
}

/// The component orthogonal to p.
fn horizontal<S: Scalar>(p: &Vector<S>, x: &Vector<S>) -> Vector<S> {
    // Twice, because the first projection leaves rounding errors of the removed component.
    let once = x + &p.times(&form(p, x));
    &once + &p.times(&form(p, &once))
}

impl Model for ComplexHyperbolic {
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n + 1]
    }
    fn is_complex(&self) -> bool {
        true
    }
    fn fiber_rank(&self) -> usize {
        1
    }
    fn cut_angle(&self) -> f64 {
        f64::INFINITY
    }
    fn longest_handle(&self) -> f64 {
        18.0 // ε cosh²(18) ≈ 1: results for points this far apart are rounding errors.
    }
    fn dim(&self) -> usize {
        2 * self.n
    }
    fn curvature(&self) -> f64 {
        2.0
    }
    fn origin(&self, o: &mut [Lane]) {
        o[0] = Lane::ONE;
    }
    fn vector<S: Scalar>(&self, x: &[S], v: &mut [S]) {
        v[2..].copy_from_slice(x);
    }
    fn coordinates<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        x.copy_from_slice(&v[2..]);
    }
    /// `a (b*c − c*b) + c b*a − b c*a`
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let [a, b, c] = [a, b, c].map(read);
        let bc = b.adjoint_times(&c);
        let turn = a.times(&(&bc - &bc.adjoint()));
        let rest = &c.times(&b.adjoint_times(&a)) - &b.times(&c.adjoint_times(&a));
        (&turn + &rest).write(out);
    }
    /// E(−a) E(d) E(−b) with |a| ≈ |b| ≈ |d|/3 grows to e^{5|d|/3} and ends at e^{|d|/3}.
    fn condition(&self, chord: &[Lane]) -> Lane {
        (dot(chord, chord).sqrt() * lane(4.0 / 3.0)).exp()
    }
    fn exp<S: Scalar>(&self, p: &[S], v: &[S], q: &mut [S]) {
        let (p, v) = (read(p), read(v));
        let Trig { c, s, .. } = Trig::new(-form(&v, &v)[(0, 0)][0]); // cosh θ and sinh θ/θ, θ = |v|
        (&p.times_scalar(c) + &v.times_scalar(s)).write(q);
    }
    fn log<S: Scalar>(&self, p: &[S], q: &[S], v: &mut [S]) -> Lane {
        let (p, q) = (read(p), read(q));
        // q = p e^{iφ} cosh θ + rest, |rest| = sinh θ; q − p is exact for near arrays.
        let (top, rest) = (-form(&p, &q), horizontal(&p, &(&q - &p)));
        // θ/(sinh θ cosh θ), a function of 1 − cosh 2θ = −2 sinh²θ.
        let versine = form(&rest, &rest)[(0, 0)][0] * lane(-2.0);
        let f = theta_over_sin(versine, || lane(2.0) - versine.value());
        let log = rest.times_adjoint(&top).times_scalar(f);
        log.write(v);
        log.size() // Any number is valid, because there is no cut locus.
    }
    fn transvect<S: Scalar>(&self, p: &[S], v: &[S], x: &mut [S]) {
        let (p, v) = (read(p), read(v));
        let Trig { c, s, k, .. } = Trig::new(-form(&v, &v)[(0, 0)][0]);
        for x in x.chunks_exact_mut(2 * self.n + 2) {
            let z = read(x);
            let (to_p, to_v) = (-form(&p, &z), form(&v, &z));
            let on_p = &to_p.times_scalar(c - Lane::ONE) + &to_v.times_scalar(s);
            let on_v = &to_p.times_scalar(s) - &to_v.times_scalar(k);
            (&(&z + &p.times(&on_p)) + &v.times(&on_v)).write(x);
        }
    }
    fn turn(&self, p: &[Lane], q: &[Lane], x: &mut [Lane]) {
        let phase = -form(&read(p), &read(q));
        x.chunks_exact_mut(2 * self.n + 2).for_each(|x| read(x).times(&phase).write(x));
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        horizontal(&read(gamma), &read(d)).write(d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        let (p, d) = (read(gamma), read(d));
        let turn = d.times(&form(&p, &d)).scaled(lane(2.0)); // The effect of the phase of the array.
        horizontal(&p, &(&read(dd) + &turn)).write(dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        form(&read(u), &read(v))[(0, 0)][0]
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        // In a point |x₀| is √(1 + Σ|xᵢ|²).
        let [size, height] = [dot(&x[..2], &x[..2]), dot(&x[2..], &x[2..]) + Lane::ONE].each(|x| x.sqrt());
        let off = (size - height).abs() / height;
        // Points that are accurate to rounding do not change.
        let scale = off.simd_le(lane(4.0 * f64::EPSILON)).select(Lane::ONE, height / size);
        x[..2].iter_mut().for_each(|x| *x *= scale);
        off
    }
    fn violation(&self, x: &[f64]) -> String {
        let square = x[2..].iter().map(|x| x * x).sum::<f64>() - x[0].hypot(x[1]).powi(2);
        format!("its square -|x0|^2 + |x1|^2 + ... is {square}, not -1 (off by {:.3e})", (square + 1.0).abs())
    }
    fn imprecise_point(&self, points: &[f64]) -> Option<(usize, String)> {
        far_out(points, 2 * self.n + 2)
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        dot(p, p) // ≈ e²ʳ/2 at distance r from the origin
    }
}
