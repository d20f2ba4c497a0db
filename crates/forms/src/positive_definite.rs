//! Positive definite matrices with the affine-invariant metric tr p⁻¹u p⁻¹v: GL(n) acts by
//! g·p = g p g*, geodesics are p^½ exp(t p^−½ v p^−½) p^½.
//!
//! Points are whitened by a factor L with p = L L*, never by a square root, which is inaccurate if p is
//! ill-conditioned: errors are ε times the condition number of p.

use std::marker::PhantomData;
use symspline_core::matrix::{
    Dynamic, Matrix, Moved, Storage, by_size, cholesky, diagonalize, exp_minus_one, log_one_plus,
    log_one_plus_alike, orthogonalize, solve_lower,
};
use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane, max_or_nan};
use symspline_core::space::{Algebra, Ambient, Frame, Origin, Space};

/// Hermitian positive definite n × n matrices, real for D = 1, complex for D = 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PositiveDefinite<const D: usize, A = Dynamic> {
    n: usize,
    /// Of determinant one: a totally geodesic subspace, SL(n)/SO(n).
    special: bool,
    storage: PhantomData<A>,
}

/// The size of L⁻¹(q − p)L⁻* up to which the logarithm uses the difference; beyond it, it uses factors.
const NEAR: f64 = 0.35;
/// The smallest eigenvalue, divided by n, below which a matrix scaled to a unit diagonal is not a point.
const SINGULAR: f64 = 1e-13;

impl<const D: usize, A: Storage> PositiveDefinite<D, A> {
    /// The n × n matrices, or those of determinant one.
    pub fn new(n: usize, special: bool) -> Result<Self, String> {
        let (name, least) = match (D, special) {
            (_, true) => ("SpecialPositiveDefinite", 2),
            (1, false) => ("SymmetricPositiveDefinite", 1),
            _ => ("HermitianPositiveDefinite", 1),
        };
        if n < least {
            Err(format!("{name}(n) needs n >= {least}"))
        } else {
            Ok(PositiveDefinite { n, special, storage: PhantomData })
        }
    }

    /// The logarithm of the determinant.
    fn log_det(&self, p: &Matrix<Lane, D, A>) -> Lane {
        let l = cholesky(p);
        (0..self.n).fold(Lane::ZERO, |sum, j| sum + l[(j, j)][0].ln()) * lane(2.0)
    }

    /// Removes the component of a tangent vector at p that changes the determinant, if that must be one.
    fn tangential(&self, p: &[Lane], v: Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
        if !self.special {
            return v;
        }
        let p = self.read(p);
        let mean = whiten(&cholesky(&p), &v).trace() * lane(1.0 / self.n as f64);
        &v - &p.scaled(mean)
    }

    pub(crate) fn algebra(&self) -> Algebra<D, A> {
        Algebra { n: self.n, skew: false, traceless: self.special, storage: PhantomData }
    }

    /// The L and w of a ray with p = L L* and v = L w L*.
    fn aimed(&self, p: &[Lane], v: &[Lane]) -> [Matrix<Lane, D, A>; 2] {
        let l = cholesky(&self.read(p));
        let w = whiten(&l, &self.read(v));
        [l, w]
    }

    /// L e^{tw} L* with p = L L*, with the derivatives in t that t has.
    fn moved(&self, p: &[Lane], [l, w]: &[Matrix<Lane, D, A>; 2], t: Lane, order: usize) -> Moved<D, A> {
        let e = exp_minus_one(&w.scaled(t));
        let x = &e.congruent_by(l) + &self.read(p);
        if order == 0 {
            return Moved(x, None);
        }
        let d = &w.times(&e) + w;
        let dd = if order > 1 { w.times(&d).congruent_by(l) } else { d.clone() };
        Moved(x, Some([d.congruent_by(l), dd]))
    }

    fn read<S: Scalar>(&self, x: &[S]) -> Matrix<S, D, A> {
        Matrix::read(self.n, self.n, x)
    }
}

/// `L⁻¹ x L⁻*` for a Hermitian x.
fn whiten<const D: usize, A: Storage>(l: &Matrix<Lane, D, A>, x: &Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
    solve_lower(l, &solve_lower(l, x).adjoint()).hermitian_part()
}

/// The lanes on which p is numerically positive definite, independently of the units of rows and columns: after
/// scaling to a unit diagonal, the smallest eigenvalue is well above rounding. Results lose as many significant
/// digits as that eigenvalue has leading zeros.
fn positive_definite<const D: usize, A: Storage>(p: &Matrix<Lane, D, A>) -> Lane {
    let (l, n) = (cholesky(p), p.rows());
    // Pivots that are not small relative to the diagonal decide this without eigenvalues.
    let pivots_above = |part: f64| {
        (0..n).fold(Lane::ZERO.simd_eq(Lane::ZERO), |good, j| {
            let root = l[(j, j)][0];
            good & (root * root).simd_gt(lane(part) * p[(j, j)][0])
        })
    };
    let sure = pivots_above(1e-6);
    let doubtful = pivots_above(0.0) & !sure;
    if doubtful.none() {
        return sure;
    }
    let units: Vec<Lane> = (0..n).map(|i| Lane::ONE / p[(i, i)][0].sqrt()).collect();
    let mut scaled: [Matrix<Lane, D, A>; 1] = [Matrix::from_fn(n, n, |i, j| {
        p[(i, j)].each(|x| doubtful.select(x * units[i] * units[j], Lane::ZERO))
    })];
    diagonalize(&mut scaled);
    let least = (0..n).map(|i| scaled[0][(i, i)][0]).fold(lane(f64::INFINITY), |m, x| m.min(x));
    sure | (doubtful & least.simd_gt(lane(n as f64 * SINGULAR)))
}

/// `g x g*` for a Hermitian x.
fn congruent<S: Scalar, const D: usize, A: Storage>(
    g: &Matrix<S, D, A>,
    x: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    g.times(x).times_adjoint_hermitian(g)
}

/// (1 + r) x (1 + r) of a Hermitian x, for a Hermitian r with the value 0 and these derivatives.
fn turned<S: Scalar, const D: usize, A: Storage>(
    [r, rr]: &[Matrix<Lane, D, A>; 2],
    x: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    let value = x.value();
    let rx = r.times(&value);
    let (first, both) = if S::ORDER > 1 {
        let first = &r.times(&x.part(1)).scaled(lane(2.0)) + &rr.times(&value);
        (first, rx.times_adjoint_hermitian(r))
    } else {
        (rx.clone(), rx.clone())
    };
    Matrix::from_fn(x.rows(), x.cols(), |i, j| {
        few(|c| {
            // Twice the Hermitian parts.
            let sign = lane(if c == 0 { 1.0 } else { -1.0 });
            let [v, d, dd] = x[(i, j)][c].parts();
            let d = d + rx[(i, j)][c] + rx[(j, i)][c] * sign;
            let dd = dd + first[(i, j)][c] + first[(j, i)][c] * sign + both[(i, j)][c] * lane(2.0);
            S::from_parts([v, d, dd])
        })
    })
}

/// `log(L⁻¹ q L⁻*)` for the factor L of p.
fn log_whitened<const D: usize, A: Storage>(
    l: &Matrix<Lane, D, A>,
    p: &Matrix<Lane, D, A>,
    q: &Matrix<Lane, D, A>,
) -> Matrix<Lane, D, A> {
    let b = whiten(l, &(q - p));
    by_size(b.size(), &[NEAR], |tier| if tier == 0 { log_one_plus(&b) } else { log_of_factors(l, q) })
}

/// The same by the singular values of `L⁻¹ L_q = U σ V*`: log is U 2 ln σ U*.
#[inline(never)]
fn log_of_factors<const D: usize, A: Storage>(
    l: &Matrix<Lane, D, A>,
    q: &Matrix<Lane, D, A>,
) -> Matrix<Lane, D, A> {
    let n = q.rows();
    let mut u = solve_lower(l, &cholesky(q));
    orthogonalize(&mut u, None);
    let square: Vec<Lane> =
        (0..n).map(|j| (0..n).flat_map(|i| u[(i, j)]).fold(Lane::ZERO, |sum, x| x.mul_add(x, sum))).collect();
    // u has columns of length σ.
    let scaled = Matrix::from_fn(n, n, |i, j| u[(i, j)].each(|x| x * (square[j].ln() / square[j])));
    scaled.times_adjoint_hermitian(&u)
}

impl<const D: usize, A: Storage> Ambient for PositiveDefinite<D, A> {
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
        f64::INFINITY
    }
    fn longest_handle(&self) -> f64 {
        // ε e^{2·17} is 1: results beyond this distance are rounding errors.
        17.0
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        self.moved(p, &self.aimed(p, v), t.value(), S::ORDER).write(t, out);
    }
    fn ray_len(&self) -> usize {
        2 * self.point_len()
    }
    fn prepare_ray(&self, p: &[Lane], v: &[Lane], prepared: &mut [Lane]) {
        for (m, out) in self.aimed(p, v).iter().zip(prepared.chunks_exact_mut(self.point_len())) {
            m.write(out);
        }
    }
    fn prepared_ray<S: Scalar>(&self, p: &[Lane], _v: &[Lane], prepared: &[Lane], t: S, out: &mut [S]) {
        let (l, w) = prepared.split_at(self.point_len());
        self.moved(p, &[self.read(l), self.read(w)], t.value(), S::ORDER).write(t, out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let (p, q) = (self.read(p), self.read(q));
        let l = cholesky(&p);
        let w = log_whitened(&l, &p, &q);
        w.congruent_by(&l).write(out);
        w.size()
    }
    fn distance(&self, _p: &[Lane], _q: &[Lane], _log: &[Lane], angle: Lane) -> Lane {
        angle
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let (p, q) = (self.read(p), self.read(q));
        let l = cholesky(&p.value());
        let inverse = solve_lower(&l, &Matrix::identity(self.n));
        let b = (&q - &p).congruent_by(&inverse);
        let power = |b: &Matrix<S, D, A>| exp_minus_one(&log_one_plus(b).times_scalar(t));
        let e = if S::ORDER == 0 {
            power(&b)
        } else {
            // Whitened by the value of p, p is 1 + δ where δ has derivatives only, so that its square root is
            // 1 + δ/2 − δ²/8 exactly, where (δ²)'' = 2δ'². Factors without derivatives are not multiplied as if they
            // had some.
            let delta = p.congruent_by(&inverse);
            let (d, dd) = (delta.part(1), delta.part(2));
            let square = d.times_adjoint_hermitian(&d);
            let half = |x: &Matrix<Lane, D, A>, sign: f64| x.scaled(lane(0.5 * sign));
            let root = [half(&d, 1.0), &half(&dd, 1.0) - &square.scaled(lane(0.25))];
            let inverse_root = [half(&d, -1.0), &half(&dd, -1.0) + &square.scaled(lane(0.75))];
            turned(&root, &power(&turned(&inverse_root, &b)))
        };
        (&e.congruent_by(&l) + &p).write(out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        // g = exp(½ v p⁻¹) = L exp(½ L⁻¹vL⁻*) L⁻¹
        let l = cholesky(&self.read(p));
        let half = whiten(&l, &self.read(v)).scaled(lane(0.5));
        let g = l.times(&exp_minus_one(&half).plus_identity(Lane::ONE));
        congruent(&g, &whiten(&l, &self.read(x))).write(out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        self.tangential(gamma, self.read(d).hermitian_part()).write(d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        // γ'' − γ'γ⁻¹γ'
        let x = solve_lower(&cholesky(&self.read(gamma)), &self.read(d));
        let rest = (&self.read(dd).hermitian_part() - &x.adjoint_times(&x)).hermitian_part();
        self.tangential(gamma, rest).write(dd);
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        let l = cholesky(&self.read(p));
        whiten(&l, &self.read(u)).inner(&whiten(&l, &self.read(v)))
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        // p λ p
        let x = self.read(p);
        let v = x.times(&self.read(gradient).hermitian_part()).times(&x).hermitian_part();
        self.tangential(p, v).write(gradient);
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let before = self.read(x);
        let p = before.hermitian_part();
        // Squares of very large or small entries would overflow or underflow.
        let largest = x.iter().fold(Lane::ZERO, |m, x| max_or_nan(m, x.abs()));
        let unit = Lane::ONE / largest.simd_gt(Lane::ZERO).select(largest, Lane::ONE);
        let mut off = (&p - &before).scaled(unit).size() / p.scaled(unit).size();
        let good = positive_definite(&p) & largest.is_finite();
        let mut p = p;
        if self.special {
            let wrong = self.log_det(&p);
            off = max_or_nan(off, wrong.abs());
            p.write(x);
            let rounding = lane(4.0 * self.n as f64 * f64::EPSILON) * self.rounding(x);
            let scale = (wrong * lane(-1.0 / self.n as f64)).exp();
            p = p.scaled(wrong.abs().simd_le(rounding).select(Lane::ONE, scale));
        }
        p.map(|x| good.select(x, lane(f64::NAN))).write(x);
        good.select(off, lane(f64::INFINITY))
    }
    fn random_point(&self, noise: &mut [Lane]) {
        let mut h = self.read(noise).hermitian_part();
        if self.special {
            let mean = h.trace() * lane(1.0 / self.n as f64);
            h = h.plus_identity(-mean);
        }
        exp_minus_one(&h).plus_identity(Lane::ONE).write(noise);
        if self.special {
            self.project(noise);
        }
    }
    fn violation(&self, x: &[f64]) -> String {
        let lanes: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
        let before = self.read(&lanes);
        let p = before.hermitian_part();
        let unit = lane(1.0 / x.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs())));
        let off = ((&p - &before).scaled(unit).size() / p.scaled(unit).size()).to_array()[0];
        let what = if D == 1 { "symmetric" } else { "Hermitian" };
        if off > 1e-4 {
            return format!("it is not {what}: the skew part is {off:.3e} of it");
        }
        let mut values = [p.clone()];
        diagonalize(&mut values);
        let eigenvalues = || (0..self.n).map(|i| values[0][(i, i)][0].to_array()[0]);
        let (least, largest) =
            (eigenvalues().fold(f64::INFINITY, f64::min), eigenvalues().fold(0.0, f64::max));
        // Covariances of fewer samples than variables, or after an average reference.
        let rounding = if least > -1e-10 * largest {
            ", which is rounding beside the others: its rank is too low. Drop a variable, or add a small multiple of the \
             identity"
        } else {
            ""
        };
        if self.special && positive_definite(&p).all() && off < 1e-8 {
            let det = self.log_det(&p).to_array()[0].exp();
            format!("its determinant is {det:.9e}, not 1 (SymmetricPositiveDefinite({}) takes it)", self.n)
        } else if positive_definite(&p).all() {
            format!("it is not {what}: the skew part is {off:.3e} of it")
        } else {
            format!("it is not positive definite: its smallest eigenvalue is {least:.6e}{rounding}")
        }
    }
    /// The condition number of p: rounding of p changes it by this factor more, relative to p.
    fn rounding(&self, p: &[Lane]) -> Lane {
        let l = cholesky(&self.read(p));
        let inverse = solve_lower(&l, &Matrix::identity(self.n));
        let (size, inverse) = (l.size(), inverse.size());
        size * size * (inverse * inverse)
    }
}

impl<const D: usize, A: Storage> Frame for PositiveDefinite<D, A> {
    fn frame_len(&self) -> usize {
        2 * self.point_len()
    }
    // A frame at p is a g with p = g g*, and its inverse: coordinates of v are those of g⁻¹ v g⁻*.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        let l = cholesky(&self.read(p));
        let (g, inverse) = frame.split_at_mut(self.point_len());
        l.write(g);
        solve_lower(&l, &Matrix::identity(self.n)).write(inverse);
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (frame_g, frame_inverse) = frame.split_at_mut(self.point_len());
        let (g, inverse) = (self.read(frame_g), self.read(frame_inverse));
        let (p, q) = (self.read(p), self.read(q));
        let b = congruent(&inverse, &(&q - &p));
        let delta = by_size(b.size(), &[NEAR], |tier| {
            if tier == 0 {
                return log_one_plus(&b);
            }
            // g = L·(L⁻¹g), and L⁻¹g is unitary.
            let l = cholesky(&p);
            let turn = solve_lower(&l, &g);
            congruent(&turn.adjoint(), &log_of_factors(&l, &q))
        });
        self.algebra().coordinates(&delta, chord);
        let half = delta.scaled(lane(0.5));
        let g = &g.times(&exp_minus_one(&half)) + &g;
        let inverse = &exp_minus_one(&-half).times(&inverse) + &inverse;
        // Both are corrected at q: one step of Newton's method for g⁻¹, and for g g* = q.
        let defect = g.times(&inverse).plus_identity(lane(-1.0));
        let inverse = &inverse - &inverse.times(&defect);
        let off = congruent(&inverse, &q).plus_identity(lane(-1.0)).scaled(lane(0.5));
        (&g + &g.times(&off)).write(frame_g);
        (&inverse - &off.times(&inverse)).write(frame_inverse);
        delta.size()
    }
    fn coordinates(&self, frame: &[Lane], _p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let inverse = self.read(&frame[self.point_len()..]);
        self.algebra().coordinates(&congruent(&inverse, &self.read(v)), x);
    }
    fn tangent(&self, frame: &[Lane], _p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let g = self.read(&frame[..self.point_len()]);
        congruent(&g, &self.algebra().matrix(x)).write(v);
    }
}

impl<const D: usize, A: Storage> Origin for PositiveDefinite<D, A> {
    fn dim(&self) -> usize {
        self.algebra().dim()
    }
    fn chord_len(&self) -> usize {
        self.point_len()
    }
    fn curvature(&self) -> f64 {
        // One dimension is flat.
        if self.n == 1 { 0.0 } else { std::f64::consts::FRAC_1_SQRT_2 }
    }
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        exp_minus_one(&self.algebra().multiple(0.5, chord)).write(prepared);
    }
    /// With m = e^{−a/2}e^{d/2}e^{−b/2}: w⁺ = log(m m*) and w⁻ = −log(m* m).
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
        let ea = exp_minus_one(&algebra.multiple(-0.5, a));
        let eb = exp_minus_one(&algebra.multiple(-0.5, b));
        let ed = Matrix::<S, D, A>::constant(self.n, self.n, prepared);
        let m = ea.compose(&ed).compose(&eb);
        let [plus, minus] = log_one_plus_alike([&m.gram(), &m.adjoint().gram()]);
        algebra.coordinates(&plus, w_plus);
        algebra.coordinates(&-minus, w_minus);
    }
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        self.algebra().triple(a, b, c, out);
    }
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        self.algebra().stretch(v, x);
    }
    fn condition(&self, chord: &[Lane]) -> Lane {
        dot(chord, chord).sqrt().exp()
    }
}

impl<const D: usize, A: Storage> Space for PositiveDefinite<D, A> {
    const HOT: bool = A::TINY && D == 1;
}
