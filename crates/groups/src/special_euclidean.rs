//! Rigid motions of the plane and of space, SE(2) and SE(3), as homogeneous matrices.
//!
//! The group with the connection of Cartan and Schouten: geodesics are g exp(tξ), screw motions, and the transvection
//! is `E_g(gξ)x = g e^{ξ/2} g⁻¹ x e^{ξ/2}`. The group has no invariant metric: lengths are those of (ω, v) = g⁻¹u and
//! depend on the reference frame. The implementation represents motions by a quaternion and a translation; the plane
//! is that of x and y.

use crate::motions::{self, Motions};
use crate::rigid::{Motion, Twist, bracket, of_matrix, to_matrix};
use crate::rotations;
use crate::unitary::special_orthogonal;
use std::f64::consts::PI;
use symspline_core::matrix::Matrix;
use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane};
use symspline_core::space::{Ambient, Covered, Evaluation, Frame, Origin, Space, stretch_series};

/// Rigid motions of n = 2 or 3 dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpecialEuclidean {
    n: usize,
}

impl SpecialEuclidean {
    /// Motions of n dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 2 || n == 3 {
            Ok(SpecialEuclidean { n })
        } else {
            Err(format!("SpecialEuclidean(n) needs n = 2 or 3, not {n}"))
        }
    }

    /// Entry (i, j) of a homogeneous matrix; for planar motions that of the corresponding motion of space.
    fn entry<S: Scalar>(&self, x: &[S], i: usize, j: usize) -> S {
        let n = self.n;
        if n == 3 || (i < 2 && (j < 2 || j == 3)) {
            x[i * (n + 1) + j.min(n)]
        } else {
            S::constant(if i == j { Lane::ONE } else { Lane::ZERO })
        }
    }

    /// The part R of a matrix, row by row.
    fn rotation<S: Scalar>(&self, x: &[S]) -> [S; 9] {
        few(|c| self.entry(x, c / 3, c % 3))
    }

    fn translation<S: Scalar>(&self, x: &[S]) -> [S; 3] {
        few(|i| self.entry(x, i, 3))
    }

    /// p⁻¹q, exact for near points.
    fn between<S: Scalar>(&self, p: &[S], q: &[S]) -> Motion<S> {
        let (r, s) = (self.rotation(p), self.rotation(q));
        let column = |m: &[S; 9], j: usize| [m[j], m[3 + j], m[6 + j]];
        let difference: [S; 9] = few(|c| s[c] - r[c]);
        let turn: [S; 9] = few(|c| dot(&column(&r, c / 3), &column(&difference, c % 3)));
        let (x, y) = (self.translation(p), self.translation(q));
        let way: [S; 3] = few(|i| y[i] - x[i]);
        Motion { q: of_matrix(turn), t: few(|i| dot(&column(&r, i), &way)) }
    }

    /// The matrix p·g.
    fn moved<S: Scalar>(&self, p: &[S], g: &Motion<S>, out: &mut [S]) {
        let (r, x) = (self.rotation(p), self.translation(p));
        let turn = to_matrix(g.q);
        let n = self.n;
        for i in 0..n {
            let row = [r[3 * i], r[3 * i + 1], r[3 * i + 2]];
            for j in 0..n {
                out[i * (n + 1) + j] = dot(&row, &[turn[j], turn[3 + j], turn[6 + j]]);
            }
            out[i * (n + 1) + n] = dot(&row, &g.t) + x[i];
        }
        self.last_row(Lane::ONE, out);
    }

    fn last_row<S: Scalar>(&self, corner: Lane, out: &mut [S]) {
        let n = self.n;
        for j in 0..=n {
            out[n * (n + 1) + j] = S::constant(if j == n { corner } else { Lane::ZERO });
        }
    }

    /// ξ = p⁻¹v of a tangent vector, skew part.
    fn twist(&self, p: &[Lane], v: &[Lane]) -> Twist<Lane> {
        let r = self.rotation(p);
        let n = self.n;
        let column = |m: &dyn Fn(usize) -> Lane| -> Lane { (0..n).fold(Lane::ZERO, |s, i| s + m(i)) };
        let w = |i: usize, j: usize| column(&|k| r[3 * k + i] * v[k * (n + 1) + j]);
        let half = lane(0.5);
        let skew = |i: usize, j: usize| half * (w(i, j) - w(j, i));
        let omega =
            if n == 3 { [skew(2, 1), skew(0, 2), skew(1, 0)] } else { [Lane::ZERO, Lane::ZERO, skew(1, 0)] };
        let along =
            |i: usize| if i < n { column(&|k| r[3 * k + i] * v[k * (n + 1) + n]) } else { Lane::ZERO };
        [omega, few(along)]
    }

    /// The tangent vector pξ.
    fn vector(&self, p: &[Lane], [omega, v]: Twist<Lane>, out: &mut [Lane]) {
        let (r, n) = (self.rotation(p), self.n);
        let [x, y, z] = omega;
        let skew = [Lane::ZERO, -z, y, z, Lane::ZERO, -x, -y, x, Lane::ZERO];
        for i in 0..n {
            let row = [r[3 * i], r[3 * i + 1], r[3 * i + 2]];
            for j in 0..n {
                out[i * (n + 1) + j] = dot(&row, &[skew[j], skew[3 + j], skew[6 + j]]);
            }
            out[i * (n + 1) + n] = dot(&row, &v);
        }
        self.last_row(Lane::ZERO, out);
    }

    /// Coordinates are (ω, v); in the plane (ω_z, v_x, v_y).
    fn unpack<S: Scalar>(&self, x: &[S]) -> Twist<S> {
        let zero = S::constant(Lane::ZERO);
        if self.n == 3 {
            [[x[0], x[1], x[2]], [x[3], x[4], x[5]]]
        } else {
            [[zero, zero, x[0]], [x[1], x[2], zero]]
        }
    }

    fn pack<S: Scalar>(&self, [omega, v]: Twist<S>, x: &mut [S]) {
        if self.n == 3 {
            x[..3].copy_from_slice(&omega);
            x[3..].copy_from_slice(&v);
        } else {
            (x[0], x[1], x[2]) = (omega[2], v[0], v[1]);
        }
    }

    fn frame(&self, frame: &[Lane]) -> Motion<Lane> {
        Motion { q: few(|i| frame[i]), t: few(|i| frame[4 + i]) }
    }
}

fn times<S: Scalar>([omega, v]: Twist<S>, x: S) -> Twist<S> {
    [omega.each(|o| o * x), v.each(|v| v * x)]
}

impl Ambient for SpecialEuclidean {
    fn point_len(&self) -> usize {
        (self.n + 1) * (self.n + 1)
    }
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n + 1, self.n + 1]
    }
    fn cut_angle(&self) -> f64 {
        PI
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        let p: [S; 16] = few(|i| S::constant(if i < p.len() { p[i] } else { Lane::ZERO }));
        let xi = {
            let lanes: [Lane; 16] = p.each(|x| x.value());
            self.twist(&lanes[..self.point_len()], v).each(|x| x.each(S::constant))
        };
        self.moved(&p[..self.point_len()], &Motion::exp(times(xi, t)), out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let (xi, angle) = self.between(p, q).log();
        self.vector(p, xi, out);
        angle
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let (xi, _) = self.between(p, q).log();
        self.moved(p, &Motion::exp(times(xi, t)), out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let half = Motion::exp(times(self.twist(p, v), lane(0.5)));
        let way = self.between(p, x);
        self.moved(p, &half.times(&way).times(&half), out);
    }
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        // p e^{ξ/2} ζ e^{ξ/2} = q e^{−ξ/2} ζ e^{ξ/2}
        let half = Motion::exp(times(self.twist(p, v), lane(-0.5)));
        self.vector(q, half.adjoint(self.twist(p, x)), out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let xi = self.twist(gamma, d);
        self.vector(gamma, xi, d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        // γ d/dt(γ⁻¹γ') = γ'' − γ'γ⁻¹γ': the component of −ξ² that is not symmetric is −ω × v.
        let [omega, v] = self.twist(gamma, d);
        let [alpha, a] = self.twist(gamma, dd);
        let turn = crate::rigid::cross(omega, v);
        self.vector(gamma, [alpha, few(|i| a[i] - turn[i])], dd);
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        let ([a, b], [c, d]) = (self.twist(p, u), self.twist(p, v));
        dot(&a, &c) + dot(&b, &d)
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let n = self.n;
        let mut r: Vec<Lane> = (0..n * n).map(|c| x[c / n * (n + 1) + c % n]).collect();
        let mut off = special_orthogonal(n).map_or(Lane::ZERO, |group| {
            if n == 3 { rotations::nearest(&group, &mut r) } else { group.project(&mut r) }
        });
        for (c, r) in r.iter().enumerate() {
            x[c / n * (n + 1) + c % n] = *r;
        }
        for j in 0..=n {
            // Translations that are not finite are far off, too: 0·∞ is NaN.
            if j < n {
                off += x[j * (n + 1) + n] * Lane::ZERO;
            }
            let expected = if j == n { Lane::ONE } else { Lane::ZERO };
            off = symspline_core::scalar::max_or_nan(off, (x[n * (n + 1) + j] - expected).abs());
        }
        self.last_row(Lane::ONE, x);
        off
    }
    fn random_point(&self, noise: &mut [Lane]) {
        let n = self.n;
        let mut r: Vec<Lane> = (0..n * n).map(|c| noise[c / n * (n + 1) + c % n]).collect();
        if let Ok(group) = special_orthogonal(n) {
            group.random_point(&mut r);
        }
        for (c, r) in r.iter().enumerate() {
            noise[c / n * (n + 1) + c % n] = *r;
        }
        self.last_row(Lane::ONE, noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        let n = self.n;
        let last = &x[n * (n + 1)..];
        if last.iter().enumerate().any(|(j, x)| (x - if j == n { 1.0 } else { 0.0 }).abs() > 1e-8) {
            return format!("its last row is {last:?}, not (0, …, 0, 1)");
        }
        let r: Vec<f64> = (0..n * n).map(|c| x[c / n * (n + 1) + c % n]).collect();
        let why = special_orthogonal(n).map_or(String::new(), |group| group.violation(&r));
        format!("in its rotation, {why}")
    }
    /// The rounding error of the translation, in its units.
    fn rounding(&self, p: &[Lane]) -> Lane {
        let t = self.translation(p);
        dot(&t, &t).sqrt().max(Lane::ONE)
    }
}

impl Frame for SpecialEuclidean {
    fn frame_len(&self) -> usize {
        7
    }
    // A frame at p is g_R of a pair with p = g_L g_R⁻¹, as for the other groups.
    fn lift(&self, _p: &[Lane], frame: &mut [Lane]) {
        frame.fill(Lane::ZERO);
        frame[0] = Lane::ONE;
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let (xi, angle) = self.between(p, q).log();
        let r = self.frame(frame);
        let delta = r.inverse().adjoint(xi);
        self.pack(delta, chord);
        let Motion { q, t } = r.times(&Motion::exp(times(delta, lane(-0.5))));
        // One step of Newton's method for 1/|q|.
        let shorten = lane(-0.5).mul_add(dot(&q, &q), lane(1.5));
        frame[..4].copy_from_slice(&q.each(|x| x * shorten));
        frame[4..].copy_from_slice(&t);
        angle
    }
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        self.pack(self.frame(frame).inverse().adjoint(self.twist(p, v)), x);
    }
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        self.vector(p, self.frame(frame).adjoint(self.unpack(x)), v);
    }
}

impl Origin for SpecialEuclidean {
    fn dim(&self) -> usize {
        self.n * (self.n + 1) / 2
    }
    fn chord_len(&self) -> usize {
        7
    }
    fn curvature(&self) -> f64 {
        // There is no invariant metric.
        f64::NAN
    }
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        let Motion { q, t } = Motion::exp(times(self.unpack(chord), lane(0.5)));
        prepared[..4].copy_from_slice(&q);
        prepared[4..].copy_from_slice(&t);
    }
    /// With m = e^{−a/2}e^{d/2}e^{−b/2} and m' the same in reverse order: w⁺ = log(m m'), w⁻ = −Ad(m⁻¹)w⁺.
    fn inner_handles<S: Scalar>(
        &self,
        _d: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        let half = |x: &[S]| Motion::exp(times(self.unpack(x), S::constant(lane(-0.5))));
        let (ea, eb, ed) = (half(a), half(b), self.frame(prepared));
        let ed = Motion { q: ed.q.each(S::constant), t: ed.t.each(S::constant) };
        let m = ea.times(&ed).times(&eb);
        let (plus, _) = m.times(&eb.times(&ed).times(&ea)).log();
        self.pack(plus, w_plus);
        self.pack(m.inverse().adjoint(plus).each(|x| x.each(|x| -x)), w_minus);
    }
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let half = S::constant(lane(0.5));
        let (a, b) = (times(self.unpack(a), half), times(self.unpack(b), half));
        self.pack(bracket(a, bracket(b, self.unpack(c))), out);
    }
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let half = times(self.unpack(v), S::constant(lane(0.5)));
        let [omega, velocity] = self.unpack(x);
        let start = Matrix::<S, 1>::from_fn(6, 1, |i, _| [if i < 3 { omega[i] } else { velocity[i - 3] }]);
        let read = |m: &Matrix<S, 1>| -> Twist<S> { [0, 3].each(|at| few(|i| m[(at + i, 0)][0])) };
        // The norm of ad is |ω|/2, except for its nilpotent part, which the factor covers.
        let angle = dot(&half[0], &half[0]).value().sqrt();
        let sum = stretch_series(angle * lane(1.5), &start, |m| {
            let twist = bracket(half, bracket(half, read(m)));
            Matrix::from_fn(6, 1, |i, _| [twist[i / 3][i % 3]])
        });
        self.pack(read(&sum), x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        let [omega, _] = self.unpack(v);
        dot(&omega, &omega).sqrt()
    }
}

impl Space for SpecialEuclidean {
    fn evaluate_with<E: Evaluation>(&self, evaluation: E) {
        evaluation.covered(self);
    }
}

impl Covered for SpecialEuclidean {
    type Cover = Motions;
    const LEN: usize = 7;

    fn cover(&self) -> Motions {
        Motions
    }
    #[inline(always)]
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]) {
        for e in 0..2 {
            let r = self.rotation(p[e]);
            let q = of_matrix(few(|c| if c % 4 == 0 { r[c] - Lane::ONE } else { r[c] }));
            motions::write(&Motion { q, t: self.translation(p[e]) }, y[e]);
            motions::write_vector(&Motion { q, t: [Lane::ZERO; 3] }, self.twist(p[e], v[e]), w[e]);
        }
    }
    #[inline(always)]
    fn choose(&self, from: &[Lane], [q, y, w]: [&mut [Lane]; 3]) {
        let flip = dot(&from[..4], &q[..4]).simd_lt(Lane::ZERO);
        if flip.any() {
            for x in [q, y, w] {
                x[..4].iter_mut().for_each(|x| *x = flip.select(-*x, *x));
            }
        }
    }
    #[inline(always)]
    fn leave(&self, _side: Lane, y: &[Lane], w: Option<&[Lane]>, out: &mut [Lane]) {
        let (n, Motion { q, t }) = (self.n, motions::read(y));
        let (r, t) = match w {
            None => (to_matrix(q), t),
            // R' = R[ω]
            Some(w) => {
                let (r, [x, y, z]) = (to_matrix(q), rotations::angular(q, w));
                let column = |c: usize| [r[c], r[3 + c], r[6 + c]];
                let [a, b, c] = [0, 1, 2].each(column);
                let rate: [[Lane; 3]; 3] =
                    few(|i| [b[i] * z - c[i] * y, c[i] * x - a[i] * z, a[i] * y - b[i] * x]);
                (few(|c| rate[c / 3][c % 3]), [w[4], w[5], w[6]])
            }
        };
        for i in 0..n {
            out[i * (n + 1)..i * (n + 1) + n].copy_from_slice(&r[3 * i..3 * i + n]);
            out[i * (n + 1) + n] = t[i];
        }
        self.last_row(if w.is_none() { Lane::ONE } else { Lane::ZERO }, out);
    }
    #[inline(always)]
    fn body<'o>(&self, y: &[Lane], w: &[Lane], out: &'o mut [Lane]) -> &'o [Lane] {
        let dim = 3 * (self.n - 1);
        self.pack(motions::twist(&motions::read(y), w), &mut out[..dim]);
        &out[..dim]
    }
}
