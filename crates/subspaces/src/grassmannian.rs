//! Grassmannians: k-dimensional subspaces of Rⁿ or Cⁿ, G = U(n).
//!
//! A point is any matrix Y with orthonormal columns that span the subspace, a tangent vector at that
//! representative is *horizontal*, Y*Δ = 0. All formulas are functions of the k × k matrix Δ*Δ, whose
//! eigenvalues are the squares of the principal angles (Edelman, Arias & Smith 1998; the transvection
//! from the product of two symmetries). Projective spaces are in `lines`.

use crate::logarithm::log_from;
use std::f64::consts::{FRAC_PI_2, SQRT_2};
use std::marker::PhantomData;
use symspline_core::matrix::{
    Dynamic, Matrix, Moved, Storage, diagonalize, orthogonalize, orthonormalize, polar, reorthonormalize,
    trig,
};
use symspline_core::scalar::{Each, Lane, Scalar, lane, max_or_nan};
use symspline_core::space::{Ambient, Frame, Origin, Space, stretch_series};

/// Subspaces of dimension k, real for D = 1, complex for D = 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subspaces<const D: usize, A = Dynamic> {
    k: usize,
    n: usize,
    storage: PhantomData<A>,
}

impl<const D: usize> Subspaces<D> {
    /// k-dimensional subspaces of an n-dimensional space: a Grassmannian.
    pub fn new(k: usize, n: usize) -> Result<Self, String> {
        let name = if D == 1 { "Grassmannian" } else { "ComplexGrassmannian" };
        if k > n {
            return Err(format!(
                "{name}({k}, {n}) asks for subspaces larger than the space; did you mean {name}({n}, {k})?"
            ));
        }
        if k == 0 || k == n {
            return Err(format!("{name}(k, n) needs 1 <= k < n; {name}({k}, {n}) is a single point"));
        }
        Ok(Subspaces { k, n, storage: PhantomData })
    }

    /// Entries of a point's matrix.
    pub fn count(&self) -> usize {
        self.k.saturating_mul(self.n)
    }

    /// The same with matrices in another storage.
    pub fn stored<A: Storage>(self) -> Subspaces<D, A> {
        Subspaces { k: self.k, n: self.n, storage: PhantomData }
    }
}

/// Up to this n, frames are orthonormalised at every step; larger ones after several steps.
const SMALL: usize = 16;

/// s and k of [`trig`], and c − 1, for a tangent vector.
struct Rotation<S: Scalar, const D: usize, A: Storage> {
    s: Matrix<S, D, A>,
    k: Matrix<S, D, A>,
    versed: Matrix<S, D, A>,
}

impl<S: Scalar, const D: usize, A: Storage> Rotation<S, D, A> {
    fn of(g: &Matrix<S, D, A>) -> Self {
        let [s, k] = trig(g);
        let versed = g.times(&k);
        Rotation { s, k, versed }
    }

    /// E(±Δ) of a point or vector, from its components along X and along Δ.
    ///
    /// `E_X(Δ)Z = Z + X((c−1)X*Z − sΔ*Z) + Δ(sX*Z + kΔ*Z)`: the two factors behind X and Δ.
    fn act(&self, along_x: &Matrix<S, D, A>, along_delta: &Matrix<S, D, A>) -> [Matrix<S, D, A>; 2] {
        [
            &self.versed.times(along_x) - &self.s.times(along_delta),
            &self.s.times(along_x) + &self.k.times(along_delta),
        ]
    }
}

/// The component orthogonal to the columns of Y.
fn horizontal<S: Scalar, const D: usize, A: Storage>(
    y: &Matrix<S, D, A>,
    x: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    // Twice, because the first projection leaves rounding errors of the removed component.
    let once = x - &y.times(&y.adjoint_times(x));
    &once - &y.times(&y.adjoint_times(&once))
}

impl<const D: usize, A: Storage> Subspaces<D, A> {
    fn read<S: Scalar>(&self, x: &[S]) -> Matrix<S, D, A> {
        Matrix::read(self.n, self.k, x)
    }

    fn coordinate_matrix<S: Scalar>(&self, x: &[S]) -> Matrix<S, D, A> {
        Matrix::read(self.n - self.k, self.k, x)
    }

    /// X c(t²G) + Δ t s(t²G) with G = Δ*Δ, with the derivatives in t that t has.
    fn moved(&self, p: &[Lane], v: &[Lane], t: Lane, order: usize) -> Moved<D, A> {
        let (x, delta) = (self.read(p), self.read(v));
        let g = delta.adjoint_times(&delta);
        let Rotation { s, versed, .. } = Rotation::of(&g.scaled(t * t));
        let c = versed.clone().plus_identity(Lane::ONE);
        let ts = s.scaled(t);
        let gamma = &(&x + &x.times(&versed)) + &delta.times(&ts);
        if order == 0 {
            return Moved(gamma, None);
        }
        let minus_x = -x;
        let d = &minus_x.times(&g.times(&ts)) + &delta.times(&c);
        let dd =
            if order > 1 { &minus_x.times(&g.times(&c)) - &delta.times(&g.times(&ts)) } else { d.clone() };
        Moved(gamma, Some([d, dd]))
    }

    /// `log_X(Y)` in the ambient space.
    fn log_between<S: Scalar>(&self, x: &Matrix<S, D, A>, y: &Matrix<S, D, A>) -> (Matrix<S, D, A>, Lane) {
        log_from(&x.adjoint_times(y), &horizontal(x, &(y - x)))
    }

    /// The columns of a frame: the subspace and its complement.
    fn columns(&self, frame: &[Lane]) -> (Matrix<Lane, D, A>, Matrix<Lane, D>) {
        let q = Matrix::<Lane, D>::read(self.n, self.n, frame);
        (q.some_cols(0, self.k).stored(), q.some_cols(self.k, self.n))
    }

    fn write_frame(&self, x: &Matrix<Lane, D, A>, rest: &Matrix<Lane, D>, frame: &mut [Lane]) {
        let k = self.k;
        Matrix::<Lane, D>::from_fn(self.n, self.n, |i, j| if j < k { x[(i, j)] } else { rest[(i, j - k)] })
            .write(frame);
    }
}

impl<const D: usize, A: Storage> Ambient for Subspaces<D, A> {
    fn point_len(&self) -> usize {
        self.n * self.k * D
    }
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n, self.k]
    }
    fn is_complex(&self) -> bool {
        D == 2
    }
    fn fiber_rank(&self) -> usize {
        self.k
    }
    fn cut_angle(&self) -> f64 {
        FRAC_PI_2
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        self.moved(p, v, t.value(), S::ORDER).write(t, out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let (log, angle) = self.log_between(&self.read(p), &self.read(q));
        log.write(out);
        angle
    }
    fn distance(&self, p: &[Lane], q: &[Lane], log: &[Lane], _angle: Lane) -> Lane {
        let length = max_or_nan(self.inner(p, log, log), Lane::ZERO).sqrt();
        if !length.is_nan().any() {
            return length;
        }
        // At the cut locus the logarithm has no direction, but angles exist. Beside a right angle, small angles need
        // not be accurate.
        let mut cosines = self.read::<Lane>(q).adjoint_times(&self.read(p));
        orthogonalize(&mut cosines, None);
        let squares = (0..self.k).fold(Lane::ZERO, |sum, j| {
            let square =
                (0..self.k).flat_map(|i| cosines[(i, j)]).fold(Lane::ZERO, |sum, x| x.mul_add(x, sum));
            let angle = max_or_nan(Lane::ONE - square, Lane::ZERO).sqrt().atan2(square.sqrt());
            angle.mul_add(angle, sum)
        });
        length.is_nan().select(squares.sqrt(), length)
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let (x, y) = (self.read(p), self.read(q));
        let (delta, _) = self.log_between(&x, &y);
        let g = delta.adjoint_times(&delta);
        let Rotation { s, versed, .. } = Rotation::of(&g.times_scalar(t * t));
        (&(&x + &x.times(&versed)) + &delta.times(&s.times_scalar(t))).write(out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let (p, delta, z) = (self.read(p), self.read(v), self.read(x));
        let turn = Rotation::of(&delta.adjoint_times(&delta));
        let [to_p, to_delta] = turn.act(&p.adjoint_times(&z), &delta.adjoint_times(&z));
        (&(&z + &p.times(&to_p)) + &delta.times(&to_delta)).write(out);
    }
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        self.transvect(p, v, x, out);
        // The result of E_p(v) is at the representative E p; at q it is E(v)x (E p)*q.
        let (p, delta) = (self.read(p), self.read(v));
        let Rotation { s, versed, .. } = Rotation::of(&delta.adjoint_times(&delta));
        let there = &(&p + &p.times(&versed)) + &delta.times(&s);
        self.read(out).times(&there.adjoint_times(&self.read(q))).write(out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        horizontal(&self.read(gamma), &self.read(d)).write(d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        // (1 − YY*)(Y'' − 2Y'(Y*Y')), where d is Y' itself; for its horizontal component Y*d is zero.
        let (y, d) = (self.read(gamma), self.read(d));
        let turn = d.times(&y.adjoint_times(&d)).scaled(lane(2.0));
        horizontal(&y, &(&self.read(dd) - &turn)).write(dd);
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        self.read(u).inner(&self.read(v))
    }
    /// The momentum of a horizontal v at Y is vY* − Yv*.
    fn conserve(&self, p: &[Lane], c: [&[Lane]; 2], q: [&[Lane]; 2], to_p: &mut [Lane]) -> bool {
        let p = self.read(p);
        let [at_c, at_q] = [c, q].map(|pair| {
            let [x, v] = pair.map(|x| self.read(x));
            &v.times(&x.adjoint_times(&p)) - &x.times(&v.adjoint_times(&p))
        });
        (&self.read(to_p) + &(&at_c - &at_q)).write(to_p);
        true
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let y = self.read(x);
        let off = y.adjoint_times(&y).plus_identity(lane(-1.0)).size() * lane(0.5);
        let rounding = off.simd_le(lane((self.k + self.n / 8 + 1) as f64 * 2.0 * f64::EPSILON));
        if rounding.all() {
            return off;
        }
        // The nearest orthonormal columns have the same span.
        let nearest = polar(&y, off);
        symspline_core::matrix::Select::select(rounding, y, nearest).write(x);
        off
    }
    fn random_point(&self, noise: &mut [Lane]) {
        let mut y = self.read(noise);
        orthonormalize(&mut y);
        y.write(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        let lanes: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
        let y = self.read(&lanes);
        let off = y.adjoint_times(&y).plus_identity(lane(-1.0)).size().to_array()[0];
        format!(
            "its columns are not orthonormal: |{} - 1| = {off:.3e} (np.linalg.qr gives an orthonormal basis)",
            if D == 1 { "xᵀx" } else { "x*x" }
        )
    }
}

impl<const D: usize, A: Storage> Frame for Subspaces<D, A> {
    fn frame_len(&self) -> usize {
        self.n * self.n * D
    }
    // A frame at p is a unitary matrix whose first k columns span p. They may be another representative than p; W =
    // X*p converts one to the other.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        complete(&Matrix::<Lane, D>::read(self.n, self.k, p)).write(frame);
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (x, rest) = self.columns(frame);
        let (p, q) = (self.read(p), self.read(q));
        // The complement is orthogonal to p, too: q − p is exact for near representatives.
        let way = rest.adjoint_times(&(&q - &p).stored()).stored();
        let (b, angle) = log_from(&x.adjoint_times(&q), &way);
        b.write(chord);
        let Rotation { s, k, versed } = Rotation::of(&b.adjoint_times(&b));
        let x_next = &(&x + &x.times(&versed)) + &rest.times(&b.times(&s).stored()).stored();
        let turn = &rest.times(&b.times(&k).stored()) - &x.times(&s).stored();
        let mut rest = &rest + &turn.times_adjoint(&b.stored());
        // The first columns span q, and the others are orthogonal to it.
        let mut x = q.times(&q.adjoint_times(&x_next));
        reorthonormalize(&mut x);
        let along: Matrix<Lane, D> = x.stored();
        rest = &rest - &along.times(&along.adjoint_times(&rest));
        if self.n <= SMALL {
            reorthonormalize(&mut rest);
        }
        self.write_frame(&x, &rest, frame);
        angle
    }
    fn reorthonormalize(&self, frame: &mut [Lane], _p: &[Lane]) {
        if self.n > SMALL {
            let mut q = Matrix::<Lane, D>::read(self.n, self.n, frame);
            reorthonormalize(&mut q);
            q.write(frame);
        }
    }
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let (subspace, rest) = self.columns(frame);
        let w = subspace.adjoint_times(&self.read(p));
        rest.adjoint_times(&self.read(v).stored()).times_adjoint(&w.stored()).write(x);
    }
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let (subspace, rest) = self.columns(frame);
        let w = subspace.adjoint_times(&self.read(p));
        rest.times(&self.coordinate_matrix(x).times(&w).stored()).write(v);
    }
}

impl<const D: usize, A: Storage> Origin for Subspaces<D, A> {
    fn dim(&self) -> usize {
        self.k * (self.n - self.k) * D
    }
    fn chord_len(&self) -> usize {
        3 * self.k * self.k * D
    }
    fn curvature(&self) -> f64 {
        match (D, self.k.min(self.n - self.k)) {
            // One dimension is flat.
            (1, 1) if self.n == 2 => 0.0,
            (1, 1) => 1.0,
            (1, _) => SQRT_2,
            _ => 2.0,
        }
    }
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        let b = self.coordinate_matrix(chord);
        let Rotation { s, k, versed } = Rotation::of(&b.adjoint_times(&b));
        for (part, out) in [s, k, versed].iter().zip(prepared.chunks_exact_mut(self.k * self.k * D)) {
            part.write(out);
        }
    }
    /// The points E(−a) E(d) E(−b)·o and E(b) E(−d) E(a)·o as (k × k, (n−k) × k) blocks.
    fn inner_handles<S: Scalar>(
        &self,
        d: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        let (n, k) = (self.n, self.k);
        let chord = Matrix::<S, D, A>::constant(n - k, k, d);
        let part = |i: usize| Matrix::constant(k, k, &prepared[i * k * k * D..][..k * k * D]);
        let over = Rotation { s: part(0), k: part(1), versed: part(2) };
        let [a, b] = [a, b].map(|x| {
            let x = self.coordinate_matrix(x);
            let turn = Rotation::of(&x.adjoint_times(&x));
            (x, turn)
        });
        let walk = |first: &(Matrix<S, D, A>, Rotation<S, D, A>),
                    last: &(Matrix<S, D, A>, Rotation<S, D, A>),
                    sign: f64| {
            let sign = lane(sign);
            // E(−first)·o is (c, −first s), then the chord, then E(−last); all mirrored for the other way.
            let mut top = first.1.versed.clone().plus_identity(Lane::ONE);
            let mut rest = first.0.times(&first.1.s).scaled(-sign);
            for (delta, turn, sign) in [(&chord, &over, sign), (&last.0, &last.1, -sign)] {
                let [to_top, to_delta] = turn.act(&top, &delta.adjoint_times(&rest).scaled(sign));
                top = &top + &to_top;
                rest = &rest + &delta.times(&to_delta).scaled(sign);
            }
            log_from(&top, &rest).0
        };
        walk(&b, &a, 1.0).write(w_plus);
        walk(&a, &b, -1.0).write(w_minus);
    }
    /// `a (c*b − b*c) − c b*a + b c*a`
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let [a, b, c] = [a, b, c].map(|x| self.coordinate_matrix(x));
        let cb = c.adjoint_times(&b);
        let turn = a.times(&(&cb - &cb.adjoint()));
        let rest = &b.times(&c.adjoint_times(&a)) - &c.times(&b.adjoint_times(&a));
        (&turn + &rest).write(out);
    }
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let (b, start) = (self.coordinate_matrix(v), self.coordinate_matrix(x));
        let g = b.adjoint_times(&b);
        let size = if self.k == 1 && D == 1 { b.size() } else { b.size() * lane(2.0) };
        // [v,[v,x]] = 2 v x* v − v v* x − x v* v
        let twice = |x: &Matrix<S, D, A>| {
            let vx = b.adjoint_times(x);
            let inner = &vx.adjoint().scaled(lane(2.0)) - &vx;
            &b.times(&inner) - &x.times(&g)
        };
        stretch_series(size, &start, twice).write(x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        largest_singular_value(&self.coordinate_matrix(v))
    }
}

impl<const D: usize, A: Storage> Space for Subspaces<D, A> {
    fn angle_at(&self, _p: &[Lane], v: &[Lane]) -> Lane {
        largest_singular_value(&self.read(v))
    }
}

fn largest_singular_value<const D: usize, A: Storage>(b: &Matrix<Lane, D, A>) -> Lane {
    let mut g = [b.adjoint_times(b)];
    diagonalize(&mut g);
    (0..b.cols()).fold(Lane::ZERO, |m, i| max_or_nan(m, g[0][(i, i)][0])).sqrt()
}

/// A unitary matrix whose first columns span those of Y: the product of Householder's reflections.
fn complete<const D: usize, A: Storage>(y: &Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
    let (n, k) = (y.rows(), y.cols());
    let mut r = y.clone();
    let mut q = Matrix::<Lane, D, A>::identity(n);
    for j in 0..k {
        let square = (j..n).flat_map(|i| r[(i, j)]).fold(Lane::ZERO, |sum, x| x.mul_add(x, sum));
        let head = r[(j, j)];
        let size = head.iter().fold(Lane::ZERO, |sum, x| x.mul_add(*x, sum)).sqrt();
        // x − α e with α = −phase(x₀)|x|, which avoids cancellation.
        let none = size.simd_eq(Lane::ZERO);
        let factor = none.select(Lane::ZERO, square.sqrt() / size);
        let mut v = Matrix::<Lane, D, A>::zeros(n, 1);
        for i in j..n {
            v[(i, 0)] = r[(i, j)];
        }
        v[(j, 0)] = head.each(|x| x.mul_add(factor, x));
        v[(j, 0)][0] += none.select(square.sqrt(), Lane::ZERO);
        let beta = lane(-2.0) / v.inner(&v);
        let scaled = v.scaled(beta);
        r = &r + &scaled.times(&v.adjoint_times(&r));
        q = &q + &q.times(&scaled).times_adjoint(&v);
    }
    q
}
