//! A space from few formulas: the simplest implementation of a new space.

use super::traits::{Ambient, Frame, Origin, ROUNDING_SIZE, Space, make_tangent};
use crate::scalar::{Lane, Scalar, dot, lane, max_or_nan};

/// A space whose exponential, logarithm and transvection are implemented at any point and for any numbers. All three
/// traits follow: geodesics are exponentials of logarithms, a frame is a basis moved by transvections, and
/// [`inner_handles`](Origin::inner_handles) is computed by its definition, in arrays at the origin.
///
/// The results are correct, but several times slower than with specific formulas for each operation. For speed,
/// implement the traits instead; the laws compare their formulas with the definitions used here.
pub trait Model: Copy + Send + Sync {
    /// See [`Ambient::point_shape`]; a complex number counts as one entry.
    fn point_shape(&self) -> Vec<usize>;
    /// See [`Ambient::is_complex`].
    fn is_complex(&self) -> bool {
        false
    }
    /// See [`Ambient::fiber_rank`].
    fn fiber_rank(&self) -> usize {
        0
    }
    /// See [`Ambient::cut_angle`].
    fn cut_angle(&self) -> f64;
    /// See [`Ambient::longest_handle`].
    fn longest_handle(&self) -> f64 {
        self.cut_angle()
    }
    /// See [`Ambient::injectivity_radius`]; by default the cut angle, which is right if the deciding angle of a vector
    /// is at most its length and equals it in some direction.
    fn injectivity_radius(&self) -> f64 {
        self.cut_angle()
    }
    /// See [`Origin::dim`].
    fn dim(&self) -> usize;
    /// See [`Origin::curvature`].
    fn curvature(&self) -> f64;

    /// The array of the origin.
    fn origin(&self, o: &mut [Lane]);
    /// The tangent vector at the origin with given coordinates. The other entries of its array are already zero.
    fn vector<S: Scalar>(&self, x: &[S], v: &mut [S]);
    /// Coordinates of a tangent vector at the origin.
    fn coordinates<S: Scalar>(&self, v: &[S], x: &mut [S]);
    /// See [`Origin::triple`].
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]);
    /// See [`Origin::condition`].
    fn condition(&self, _chord: &[Lane]) -> Lane {
        Lane::ONE
    }

    /// `exp_p(v)`.
    fn exp<S: Scalar>(&self, p: &[S], v: &[S], q: &mut [S]);
    /// `log_p(q)`, (11); returns the deciding angle.
    fn log<S: Scalar>(&self, p: &[S], q: &[S], v: &mut [S]) -> Lane;
    /// The transvection `E_p(v)` of (10) applied to points or tangent vectors, one array after the other, in place.
    fn transvect<S: Scalar>(&self, p: &[S], v: &[S], x: &mut [S]);
    /// Maps tangent vectors at the origin to p by any isometry that maps the origin to p, in place. By default it is
    /// the transvection along the geodesic from the origin, which exists everywhere in a space without cut locus.
    fn section(&self, p: &[Lane], x: &mut [Lane]) {
        assert!(self.cut_angle().is_infinite(), "a space with a cut locus needs a section of its own");
        let (mut o, mut v) = (vec![Lane::ZERO; p.len()], vec![Lane::ZERO; p.len()]);
        self.origin(&mut o);
        self.log(&o, p, &mut v);
        parallel_transport(self, &o, p, &v, x);
    }
    /// Converts tangent vectors at a point, in place, to those at another array q of the same point.
    fn turn(&self, _p: &[Lane], _q: &[Lane], _x: &mut [Lane]) {}
    /// See [`Ambient::velocity`].
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]);
    /// See [`Ambient::acceleration`]; by default that of a surface with the metric of its array.
    fn acceleration(&self, gamma: &[Lane], _d: &[Lane], dd: &mut [Lane]) {
        self.velocity(gamma, dd);
    }
    /// See [`Ambient::inner`].
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane;
    /// The deciding angle of `exp_p(v)`; grows in proportion to v.
    fn angle(&self, p: &[Lane], v: &[Lane]) -> Lane {
        max_or_nan(self.inner(p, v, v), Lane::ZERO).sqrt()
    }
    /// See [`Ambient::project`].
    fn project(&self, x: &mut [Lane]) -> Lane;
    /// See [`Ambient::random_point`].
    fn random_point(&self, noise: &mut [Lane]) {
        self.project(noise);
    }
    /// See [`Ambient::violation`].
    fn violation(&self, x: &[f64]) -> String;
    /// See [`Ambient::imprecise_point`].
    fn imprecise_point(&self, _points: &[f64]) -> Option<(usize, String)> {
        None
    }
    /// See [`Ambient::rounding`].
    fn rounding(&self, _p: &[Lane]) -> Lane {
        Lane::ONE
    }
}

/// Numbers without derivatives.
fn constant<S: Scalar>(x: &[Lane]) -> Vec<S> {
    x.iter().map(|x| S::constant(*x)).collect()
}

fn zeros<S: Scalar>(len: usize) -> Vec<S> {
    vec![S::constant(Lane::ZERO); len]
}

/// Multiplies every number by a factor.
fn scaled<S: Scalar>(x: &[S], scale: S) -> Vec<S> {
    x.iter().map(|x| *x * scale).collect()
}

/// Parallel transport of vectors from p to the array q of `exp_p(v)`.
fn parallel_transport<M: Model>(space: &M, p: &[Lane], q: &[Lane], v: &[Lane], x: &mut [Lane]) {
    let mut there = zeros(p.len());
    space.transvect(p, v, x);
    space.exp(p, v, &mut there);
    space.turn(&there, q, x);
}

/// [`Ambient::raise`] by an orthonormal frame.
fn raise_by_frame<M: Frame>(space: &M, p: &[Lane], gradient: &mut [Lane]) {
    let (m, len) = (space.dim(), p.len());
    let mut frame = vec![Lane::ZERO; space.frame_len()];
    space.lift(p, &mut frame);
    let (mut x, mut e, mut sum) = (vec![Lane::ZERO; m], vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
    for k in 0..m {
        x[k] = Lane::ONE;
        space.tangent(&frame, p, &x, &mut e);
        x[k] = Lane::ZERO;
        let product = dot(&e, gradient);
        sum.iter_mut().zip(&e).for_each(|(sum, e)| *sum = product.mul_add(*e, *sum));
    }
    gradient.copy_from_slice(&sum);
}

impl<M: Model> Ambient for M {
    fn point_len(&self) -> usize {
        Model::point_shape(self).iter().product::<usize>() * if Model::is_complex(self) { 2 } else { 1 }
    }
    fn point_shape(&self) -> Vec<usize> {
        Model::point_shape(self)
    }
    fn is_complex(&self) -> bool {
        Model::is_complex(self)
    }
    fn fiber_rank(&self) -> usize {
        Model::fiber_rank(self)
    }
    fn cut_angle(&self) -> f64 {
        Model::cut_angle(self)
    }
    fn longest_handle(&self) -> f64 {
        Model::longest_handle(self)
    }
    fn injectivity_radius(&self) -> f64 {
        Model::injectivity_radius(self)
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        self.exp(&constant(p), &scaled(&constant(v), t), out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        Model::log(self, p, q, out)
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let mut v = zeros(p.len());
        Model::log(self, p, q, &mut v);
        self.exp(p, &scaled(&v, t), out);
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        out.copy_from_slice(x);
        Model::transvect(self, p, v, out);
    }
    fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        out.copy_from_slice(x);
        parallel_transport(self, p, q, v, out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        Model::velocity(self, gamma, d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        Model::acceleration(self, gamma, d, dd);
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        Model::inner(self, p, u, v)
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        raise_by_frame(self, p, gradient);
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        Model::project(self, x)
    }
    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane {
        let [off, size] = make_tangent(self, p, v);
        // The rounding error of v may be as large.
        off / (size * Model::rounding(self, p) + ROUNDING_SIZE)
    }
    fn random_point(&self, noise: &mut [Lane]) {
        Model::random_point(self, noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        Model::violation(self, x)
    }
    fn imprecise_point(&self, points: &[f64]) -> Option<(usize, String)> {
        Model::imprecise_point(self, points)
    }
    fn rounding(&self, p: &[Lane]) -> Lane {
        Model::rounding(self, p)
    }
}

// A frame consists of the images of the basis vectors at the origin, one array after the other.
impl<M: Model> Frame for M {
    fn frame_len(&self) -> usize {
        Model::dim(self) * self.point_len()
    }
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        frame.fill(Lane::ZERO);
        let mut x = zeros(Model::dim(self));
        for (i, e) in frame.chunks_exact_mut(p.len()).enumerate() {
            x[i] = Lane::ONE;
            self.vector(&x, e);
            x[i] = Lane::ZERO;
        }
        self.section(p, frame);
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let mut v = zeros(p.len());
        let angle = Model::log(self, p, q, &mut v);
        Frame::coordinates(self, frame, p, &v, chord);
        parallel_transport(self, p, q, &v, frame);
        for e in frame.chunks_exact_mut(p.len()) {
            Model::velocity(self, q, e);
        }
        // One step of Newton's method for orthonormal vectors: an error of their lengths would enter the velocity,
        // and be amplified eightfold in the jump of the acceleration.
        let before = frame.to_vec();
        for (i, e) in frame.chunks_exact_mut(p.len()).enumerate() {
            for (j, f) in before.chunks_exact(p.len()).enumerate() {
                let same = if i == j { Lane::ONE } else { Lane::ZERO };
                let wrong = (Model::inner(self, q, &before[i * p.len()..][..p.len()], f) - same) * lane(-0.5);
                e.iter_mut().zip(f).for_each(|(e, f)| *e = wrong.mul_add(*f, *e));
            }
        }
        angle
    }
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        for (x, e) in x.iter_mut().zip(frame.chunks_exact(p.len())) {
            *x = Model::inner(self, p, e, v);
        }
    }
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        v.fill(Lane::ZERO);
        for (x, e) in x.iter().zip(frame.chunks_exact(p.len())) {
            v.iter_mut().zip(e).for_each(|(v, e)| *v = x.mul_add(*e, *v));
        }
    }
}

impl<M: Model> Origin for M {
    fn dim(&self) -> usize {
        Model::dim(self)
    }
    fn curvature(&self) -> f64 {
        Model::curvature(self)
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
        let mut o = zeros(self.point_len());
        self.origin(&mut o);
        let o: Vec<S> = constant(&o);
        let at = |x: &[S], sign: f64| {
            let mut v = zeros(o.len());
            self.vector(&scaled(x, S::constant(lane(sign))), &mut v);
            v
        };
        // E(−last) E(d) E(−first)·o and its logarithm.
        let d: Vec<S> = constant(d);
        let handle = |first: &[S], last: &[S], sign: f64, w: &mut [S]| {
            let (mut x, mut log) = (zeros(o.len()), zeros(o.len()));
            self.exp(&o, &at(first, -sign), &mut x);
            Model::transvect(self, &o, &at(&d, sign), &mut x);
            Model::transvect(self, &o, &at(last, -sign), &mut x);
            Model::log(self, &o, &x, &mut log);
            Model::coordinates(self, &log, w);
        };
        handle(b, a, 1.0, w_plus);
        handle(a, b, -1.0, w_minus);
    }
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        Model::triple(self, a, b, c, out);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        let (mut o, mut at) = (zeros(self.point_len()), zeros(self.point_len()));
        self.origin(&mut o);
        self.vector(v, &mut at);
        Model::angle(self, &o, &at)
    }
    fn condition(&self, chord: &[Lane]) -> Lane {
        Model::condition(self, chord)
    }
}

impl<M: Model> Space for M {
    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        Model::angle(self, p, v)
    }
}
