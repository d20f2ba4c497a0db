//! Symmetric positive definite matrices with the log-Euclidean metric (Arsigny, Fillard, Pennec & Ayache, Geometric means
//! in a novel vector space structure on symmetric positive-definite matrices, SIAM J. Matrix Anal. Appl. 29, 2007): the
//! matrix logarithm is an isometry to the flat space of symmetric matrices. exp_P(V) = exp(log P + D log_P V) is their
//! equation (3.4), and the metric at P is that of D log_P V.

use crate::positive_definite::PositiveDefinite;
use std::marker::PhantomData;
use symspline_core::delegate;
use symspline_core::matrix::{Dynamic, Matrix, Unary, function_of};
use symspline_core::scalar::{Dual, Jet, Lane, Scalar, few};
use symspline_core::space::{Algebra, Ambient, Frame, Origin, Space};

/// Symmetric positive definite n × n matrices, flat by their logarithms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogEuclidean {
    n: usize,
    /// The same matrices with the affine-invariant metric.
    points: PositiveDefinite<1>,
}

type Square<S> = Matrix<S, 1>;

const EXP: Unary = Unary {
    f: |x| {
        let e = x.exp();
        [e, e, e]
    },
    pole_distance: |_| Lane::ONE,
};

const LOG: Unary = Unary {
    f: |x| {
        let r = Lane::ONE / x;
        [x.ln(), r, -(r * r)]
    },
    pole_distance: |x| x,
};

impl LogEuclidean {
    /// The n × n matrices.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 {
            return Err("LogEuclidean(n) needs n >= 1".into());
        }
        Ok(LogEuclidean { n, points: PositiveDefinite::new(n, false)? })
    }

    fn algebra(&self) -> Algebra<1, Dynamic> {
        Algebra { n: self.n, skew: false, traceless: false, storage: PhantomData }
    }

    fn read<S: Scalar>(&self, x: &[S]) -> Square<S> {
        Matrix::read(self.n, self.n, x)
    }

    fn log_of<S: Scalar>(&self, p: &[S]) -> Square<S> {
        function_of(&self.read(p), &LOG)
    }

    /// D f_x v, the derivative of a function of matrices in the direction v.
    fn derivative(&self, f: &Unary, x: &Square<Lane>, v: &Square<Lane>) -> Square<Lane> {
        let moving =
            Square::from_fn(self.n, self.n, |i, j| few(|c| Dual { v: x[(i, j)][c], d: v[(i, j)][c] }));
        function_of(&moving, f).part(1)
    }

    /// The image of a tangent vector in flat space.
    fn enter(&self, p: &[Lane], v: &[Lane]) -> Square<Lane> {
        self.derivative(&LOG, &self.read(p), &self.read(v).hermitian_part())
    }

    /// The tangent vector at exp(y) with an image in flat space.
    fn leave(&self, y: &Square<Lane>, w: &Square<Lane>, v: &mut [Lane]) {
        self.derivative(&EXP, y, w).write(v);
    }
}

impl Ambient for LogEuclidean {
    delegate!(space => space.points;
        longest_handle, project, random_point, violation, rounding);

    fn point_len(&self) -> usize {
        self.n * self.n
    }
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n, self.n]
    }
    fn cut_angle(&self) -> f64 {
        f64::INFINITY
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        let (y, w) = (self.log_of(p), self.enter(p, v));
        let at = Square::from_fn(self.n, self.n, |i, j| few(|c| t * w[(i, j)][c] + y[(i, j)][c]));
        function_of(&at, &EXP).write(out);
    }
    fn ray_len(&self) -> usize {
        2 * self.point_len()
    }
    fn prepare_ray(&self, p: &[Lane], v: &[Lane], prepared: &mut [Lane]) {
        let (y, w) = prepared.split_at_mut(self.point_len());
        self.log_of(p).write(y);
        self.enter(p, v).write(w);
    }
    fn prepared_ray<S: Scalar>(&self, _p: &[Lane], _v: &[Lane], prepared: &[Lane], t: S, out: &mut [S]) {
        let (y, w) = prepared.split_at(self.point_len());
        let at: Vec<S> = y.iter().zip(w).map(|(y, w)| t * *w + *y).collect();
        function_of(&self.read(&at), &EXP).write(out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let y = self.log_of(p);
        let w = &self.log_of(q) - &y;
        self.leave(&y, &w, out);
        w.size()
    }
    fn distance(&self, _p: &[Lane], _q: &[Lane], _log: &[Lane], angle: Lane) -> Lane {
        angle
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let y = self.log_of(p);
        let w = &self.log_of(q) - &y;
        function_of(&(&w.times_scalar(t) + &y), &EXP).write(out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        function_of(&(&self.log_of(x) + &self.enter(p, v)), &EXP).write(out);
    }
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], _v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        self.leave(&self.log_of(q), &self.enter(p, x), out);
    }
    fn velocity(&self, _gamma: &[Lane], d: &mut [Lane]) {
        self.read(d).hermitian_part().write(d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        // The second derivative of log γ, back at γ.
        let [p, d, second] = [gamma, d, &*dd].map(|x| self.read(x));
        let moving = Square::from_fn(self.n, self.n, |i, j| {
            few(|c| Jet { v: p[(i, j)][c], d: d[(i, j)][c], dd: second[(i, j)][c] })
        });
        let y = function_of(&moving, &LOG);
        self.leave(&y.value(), &y.part(2), dd);
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        self.enter(p, u).inner(&self.enter(p, v))
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        // The derivative of the exponential is symmetric.
        let y = self.log_of(p);
        let by_log = self.derivative(&EXP, &y, &self.read(gradient).hermitian_part());
        self.leave(&y, &by_log, gradient);
    }
}

impl Frame for LogEuclidean {
    fn frame_len(&self) -> usize {
        self.point_len()
    }
    // A frame at p is log p, by which vectors are mapped to flat space and back.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        self.log_of(p).write(frame);
    }
    fn step(&self, frame: &mut [Lane], _p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let y = self.log_of(q);
        let w = &y - &self.read(frame);
        self.algebra().coordinates(&w, chord);
        y.write(frame);
        w.size()
    }
    fn coordinates(&self, _frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        self.algebra().coordinates(&self.enter(p, v), x);
    }
    fn tangent(&self, frame: &[Lane], _p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        self.leave(&self.read(frame), &self.algebra().matrix(x), v);
    }
}

impl Origin for LogEuclidean {
    fn dim(&self) -> usize {
        self.algebra().dim()
    }
    fn curvature(&self) -> f64 {
        0.0
    }
    fn inner_handles<S: Scalar>(
        &self,
        d: &[Lane],
        _: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        for i in 0..d.len() {
            w_plus[i] = -(a[i] + b[i]) + d[i];
            w_minus[i] = -w_plus[i];
        }
    }
    fn triple<S: Scalar>(&self, _a: &[S], _b: &[S], _c: &[S], out: &mut [S]) {
        out.fill(S::constant(Lane::ZERO));
    }
    fn stretch<S: Scalar>(&self, _v: &[S], _x: &mut [S]) {}
    fn condition(&self, chord: &[Lane]) -> Lane {
        self.points.condition(chord)
    }
}

impl Space for LogEuclidean {}
