//! The traits of a symmetric space.

use super::algebra::stretch_series;
use crate::matrix::Matrix;
use crate::scalar::{Dual, Lane, Scalar, dot, lane, max_or_nan};
use smallvec::{SmallVec, smallvec};

/// The directions of vectors up to this size, at points of size one, may be rounding errors. Residuals of smaller
/// vectors are relative to this size.
pub const ROUNDING_SIZE: Lane = Lane::splat(1e-7);

/// Points and tangent vectors as ambient arrays of [`point_len`](Ambient::point_len) numbers (a complex number
/// is two).
///
/// The *deciding angle* of two points determines whether the geodesic between them is unique: it must be below
/// [`cut_angle`](Ambient::cut_angle). It must be exact only near that angle; below it, any upper bound is sufficient.
/// NaN in points must result in NaN. The result of a lane must not depend on its neighbours.
pub trait Ambient: Copy + Send + Sync {
    /// The number of entries in the array of a point.
    fn point_len(&self) -> usize;
    /// Shape of the array of a point.
    fn point_shape(&self) -> Vec<usize> {
        vec![self.point_len()]
    }
    /// Whether the numbers of a point are complex, stored as pairs of real and imaginary part.
    fn is_complex(&self) -> bool {
        false
    }
    /// The rank k of the fibre of arrays that represent the same point: X and Xg are one point for every k × k matrix
    /// g, unitary on complex spaces and orthogonal on real ones. 0 where a point has one array only.
    fn fiber_rank(&self) -> usize {
        0
    }
    /// Whether any two points are joined by a curve.
    fn is_connected(&self) -> bool {
        true
    }
    /// The component of a disconnected space that contains a point.
    fn component(&self, _p: &[f64]) -> bool {
        true
    }
    /// Whether scaling all points scales the curve. Data of any size are then scaled to size one first, so that
    /// squares neither overflow nor underflow.
    fn scales(&self) -> bool {
        false
    }
    /// The deciding angle of the cut locus; infinite without a cut locus.
    fn cut_angle(&self) -> f64;
    /// The deciding angle that a handle must not reach.
    fn longest_handle(&self) -> f64 {
        self.cut_angle()
    }
    /// The distance below which the logarithm exists in every direction. It differs from the cut angle if length and
    /// angle differ.
    fn injectivity_radius(&self) -> f64 {
        self.cut_angle()
    }

    /// The length from which a [`ray`](Ambient::ray) amplifies rounding errors at its start so much that a geodesic
    /// between its end points is more accurate.
    fn longest_ray(&self) -> f64 {
        f64::INFINITY
    }

    /// `exp_p(t v)`: the geodesic from p with velocity v.
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]);
    /// The number of entries that [`prepare_ray`](Ambient::prepare_ray) computes.
    fn ray_len(&self) -> usize {
        0
    }
    /// Precomputes, once per ray, what every call of [`prepared_ray`](Ambient::prepared_ray) requires of it.
    fn prepare_ray(&self, _p: &[Lane], _v: &[Lane], _prepared: &mut [Lane]) {}
    /// [`ray`](Ambient::ray) of the p and v that were prepared.
    #[inline(always)]
    fn prepared_ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], _prepared: &[Lane], t: S, out: &mut [S]) {
        self.ray(p, v, t, out);
    }
    /// `log_p(q)`, (11); returns the deciding angle.
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane;
    /// Distance, given `log_p(q)` and the deciding angle; also defined beyond the cut locus.
    fn distance(&self, p: &[Lane], _q: &[Lane], log: &[Lane], _angle: Lane) -> Lane {
        max_or_nan(self.inner(p, log, log), Lane::ZERO).sqrt()
    }
    /// `[p, q]_t`, (7), between points that may move with t.
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]);
    /// The form in which cotangent vectors are represented by tangent vectors: that of [`inner`](Ambient::inner), or where
    /// this is not invariant under the group, one that is.
    fn pairing(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        self.inner(p, u, v)
    }
    /// Turns the gradient with respect to an array at p into the vector λ that represents it: [`pairing`](Ambient::pairing)
    /// with λ is the derivative. By default, for spaces whose arrays are isometric.
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        self.velocity(p, gradient);
    }
    /// The derivative of `[p, q]_t`, transposed: adds the cotangent vectors at p and q for one at the point of the geodesic;
    /// returns the derivative in t. Components of a representing vector that are normal to the space do not matter.
    fn pull_back(
        &self,
        p: &[Lane],
        q: &[Lane],
        t: Lane,
        cotangent: &[Lane],
        to_p: &mut [Lane],
        to_q: &mut [Lane],
    ) -> Lane {
        pull_back_by_transport(self, p, q, t, cotangent, to_p, to_q)
    }
    /// Adds to `to_p` the cotangent vector at p whose momentum is that of a vector at c less that of one at q, where a formula
    /// gives it: returns whether. Both are pairs of a point and a tangent vector.
    fn conserve(&self, _p: &[Lane], _c: [&[Lane]; 2], _q: [&[Lane]; 2], _to_p: &mut [Lane]) -> bool {
        false
    }
    /// Whether [`pull_back_along`](Ambient::pull_back_along) exists: where a cotangent vector that is constant as an array moves
    /// in parallel, up to components normal to the space.
    const SMOOTH: bool = false;
    /// [`pull_back`](Ambient::pull_back) for points that move with t.
    fn pull_back_along<S: Scalar>(
        &self,
        _p: &[S],
        _q: &[S],
        _t: S,
        _cotangent: &[S],
        _to_p: &mut [S],
        _to_q: &mut [S],
    ) -> S {
        unreachable!("the space is not smooth in this sense")
    }
    /// For these spaces, the derivative of `[p, q]_t` for changes of p, q and t that may move with t.
    fn push_along<S: Scalar>(&self, _pq: [&[S]; 2], _t: S, _changes: [&[S]; 2], _dt: S, _out: &mut [S]) {
        unreachable!("the space is not smooth in this sense")
    }
    /// For these spaces, R(λ, v)v without the component that a constant array gains by projection.
    fn bend(&self, _v: &[Lane], _cotangent: &[Lane], _out: &mut [Lane]) {
        unreachable!("the space is not smooth in this sense")
    }
    /// The transvection `E_p(v)` of (10) applied to a point x.
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]);
    /// Parallel transport of a tangent vector x from p to q = `exp_p(v)`: `E_p(v)` applied to it, at the
    /// representative q.
    fn parallel_transport(&self, p: &[Lane], _q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        self.transvect(p, v, x, out);
    }
    /// Turns the derivative of the ambient array at γ into the velocity γ', in place.
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]);
    /// Turns the second derivative of the ambient array into the covariant acceleration ∇γ', in place;
    /// `d` is the first derivative, as it comes from differentiating the array.
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]);
    /// Inner product of two tangent vectors at p.
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane;
    /// Replaces x by a point of the space close to it; returns the distance, relative to its size.
    fn project(&self, x: &mut [Lane]) -> Lane;
    /// Replaces v by its tangential component at p; returns the size of the normal component, relative to v (or to
    /// [`ROUNDING_SIZE`]).
    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane {
        let [off, size] = make_tangent(self, p, v);
        off / (size + ROUNDING_SIZE)
    }
    /// Maps independent standard normal numbers to a random point.
    fn random_point(&self, noise: &mut [Lane]);
    /// Describes why x, which is finite, is not a point.
    fn violation(&self, x: &[f64]) -> String;
    /// The first point that floating-point numbers represent with too few significant digits, and a description of it.
    fn imprecise_point(&self, _points: &[f64]) -> Option<(usize, String)> {
        None
    }
    /// The spacing of neighbouring floating-point points at p, in units of a rounding error; 1 or more.
    fn rounding(&self, _p: &[Lane]) -> Lane {
        Lane::ONE
    }
}

/// A moving frame: an element of the group that maps the origin to a point.
pub trait Frame: Ambient + Origin {
    /// Numbers in a frame.
    fn frame_len(&self) -> usize;
    /// A frame at p.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]);
    /// Moves a frame at p along the geodesic to q, in parallel; `chord` becomes the coordinates of
    /// `log_p(q)`. Returns the deciding angle.
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane;
    /// Removes the accumulated rounding errors of a frame at p, if `step` leaves any.
    fn reorthonormalize(&self, _frame: &mut [Lane], _p: &[Lane]) {}
    /// Coordinates of a tangent vector at p.
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]);
    /// The products of a cotangent vector λ at p with the vectors of a frame.
    fn products(&self, frame: &[Lane], p: &[Lane], cotangent: &[Lane], x: &mut [Lane]) {
        self.coordinates(frame, p, cotangent, x);
    }
    /// The tangent vector at p with given coordinates.
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]);
}

/// The origin o: tangent vectors there are [`dim`](Origin::dim) coordinates, whose sum of squares is the squared
/// length of the vector.
pub trait Origin {
    /// Dimension of the space.
    fn dim(&self) -> usize;
    /// The number of entries that [`prepare`](Origin::prepare) computes for a chord.
    fn chord_len(&self) -> usize {
        0
    }
    /// K of (22).
    fn curvature(&self) -> f64;

    /// Precomputes, once per chord, what every call of [`inner_handles`](Origin::inner_handles) requires of it.
    fn prepare(&self, _chord: &[Lane], _prepared: &mut [Lane]) {}
    /// With `M = E(−a) E(d) E(−b)` for the chord d: `w⁺ = log_o(M·o)` and `w⁻ = log_o(M⁻¹·o)`.
    ///
    /// These are the two logarithms of the C² condition (13), w of (16), at either end of a segment whose end
    /// velocities are `3a` and `3b`.
    fn inner_handles<S: Scalar>(
        &self,
        chord: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    );
    /// `[a, [b, c]]`, the triple product of 𝔪 (brackets of two elements lie outside 𝔪). `ad_v²x` is `[v, [v, x]]`,
    /// and the curvature R(a, b)c is `[c, [a, b]]`.
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]);
    /// `S(v) x` with `S(v) = sinh(ad_v)/ad_v` of Lemma A.2; by default from its series.
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let values: Vec<Lane> = v.iter().map(|v| v.value()).collect();
        // By (22) ad_v is at most K|v|.
        let size = dot(&values, &values).sqrt() * lane(self.curvature());
        let start = Matrix::<S, 1>::read(x.len(), 1, x);
        stretch_series(size, &start, |term| {
            let mut twice = vec![S::constant(Lane::ZERO); v.len()];
            self.triple(v, v, term.entries().as_flattened(), &mut twice);
            Matrix::read(v.len(), 1, &twice)
        })
        .write(x);
    }
    /// The deciding angle of `exp_o(v)`; grows in proportion to v.
    fn angle(&self, v: &[Lane]) -> Lane {
        dot(v, v).sqrt()
    }
    /// The growth of rounding errors in [`inner_handles`](Origin::inner_handles) over a chord.
    fn condition(&self, _chord: &[Lane]) -> Lane {
        Lane::ONE
    }
}

/// A symmetric space.
pub trait Space: Frame {
    /// Whether operations are so cheap that the cost of a call through a table would matter. The loops over knots and
    /// samples are then compiled for this space alone.
    const HOT: bool = false;
    /// Whether points are vectors of a few numbers, for which code of constant size is faster.
    const VECTORS: bool = false;

    /// The deciding angle of `exp_p(v)`.
    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        let (mut frame, mut x) = (vec![Lane::ZERO; self.frame_len()], vec![Lane::ZERO; self.dim()]);
        self.lift(p, &mut frame);
        self.coordinates(&frame, p, v, &mut x);
        self.angle(&x)
    }
    /// Passes the space to the evaluation of curves, either directly or as covered by another space.
    fn evaluate_with<E: Evaluation>(&self, evaluation: E) {
        evaluation.direct(self);
    }
}

/// The evaluation of curves on a space, either in the space itself or in a space that covers it.
pub trait Evaluation {
    /// Evaluates in the space itself.
    fn direct<M: Space>(self, space: &M);
    /// Evaluates in the covering space.
    fn covered<C: Covered>(self, space: &C);
}

/// A space whose curves are evaluated in another space that covers it locally.
pub trait Covered: Space {
    /// The covering space.
    type Cover: Ambient;
    /// The number of entries of its points.
    const LEN: usize;
    /// The covering space.
    fn cover(&self) -> Self::Cover;
    /// Lifts a segment of a curve to the cover: its end points and tangent vectors there.
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]);
    /// Selects, of the points of the cover over a control point q, the one nearest to the other control point, and
    /// with it the end point y of the segment and the tangent vector w there.
    fn choose(&self, from: &[Lane], qyw: [&mut [Lane]; 3]);
    /// A tangent vector w at y of the cover in the body frame, in the first numbers of `out`: the element ω of the
    /// Lie algebra with p' = pω. Only rotations of three dimensions and rigid motions have it.
    fn body<'o>(&self, _y: &[Lane], _w: &[Lane], _out: &'o mut [Lane]) -> &'o [Lane] {
        unreachable!("body frames are those of rotations of three dimensions and of rigid motions")
    }
    /// The component of a disconnected space that contains a point: 1 or −1 in each lane. One cover serves both.
    fn side(&self, _p: &[Lane]) -> Lane {
        Lane::ONE
    }
    /// Projects a point of the cover and, if given, a tangent vector there to a component of the space: writes the
    /// point or the vector.
    fn leave(&self, side: Lane, y: &[Lane], w: Option<&[Lane]>, out: &mut [Lane]);
    /// The transpose of [`leave`](Covered::leave) for vectors w; `image` is memory for one.
    #[inline(always)]
    fn lower(&self, side: Lane, y: &[Lane], gradient: &[Lane], image: &mut [Lane], out: &mut [Lane]) {
        let mut unit: Few<Lane> = smallvec![Lane::ZERO; out.len()];
        for (k, out) in out.iter_mut().enumerate() {
            unit[k] = Lane::ONE;
            self.leave(side, y, Some(&unit), image);
            unit[k] = Lane::ZERO;
            *out = dot(image, gradient);
        }
    }
}

/// Replaces v by its tangential component at p; returns the size of the normal component, and of v, as arrays.
pub(super) fn make_tangent<M: Ambient>(space: &M, p: &[Lane], v: &mut [Lane]) -> [Lane; 2] {
    let before = v.to_vec();
    space.velocity(p, v);
    let off2 = v.iter().zip(&before).fold(Lane::ZERO, |sum, (v, b)| (*v - *b).mul_add(*v - *b, sum));
    [off2.sqrt(), dot(&before, &before).sqrt()]
}

/// `angle` less the rounding error of angles: angles within that of the cut locus count as on it.
pub fn below(angle: f64) -> Lane {
    lane(angle * (1.0 - 4.0 * f64::EPSILON))
}

/// A few numbers on the stack: allocating aligned lanes on the heap would cost more than the computation.
type Few<S> = SmallVec<[S; 16]>;

/// [`Ambient::pull_back`] by transports and derivatives in one direction.
///
/// On a symmetric space, Jacobi fields along the geodesic c = [p, q]_t solve J'' = ad_v² J in parallel frames (do Carmo,
/// *Riemannian Geometry*, 1992, chapter 5), so that with v = log_p q
///
/// ```text
/// δc = P_{p→c}(A(1−t) δp + A(t) P_{q→p} δq + v δt),   A(s) = sinh(s ad_v)/sinh(ad_v).
/// ```
///
/// A(s) is self-adjoint and P orthogonal in every form that ad leaves invariant. The transpose is therefore the derivative
/// itself between two transports: λ ↦ P_{c→q} D_q[p, q]_t P_{c→q} λ for q, and the same for p. Since [gp, gq]_t = g[p, q]_t, the
/// momentum of λ is the sum of those at p and q (Noether), which gives the vector at p where the group moves it in all
/// directions and [`Ambient::conserve`] knows how.
#[inline(never)]
pub fn pull_back_by_transport<M: Ambient>(
    space: &M,
    p: &[Lane],
    q: &[Lane],
    t: Lane,
    cotangent: &[Lane],
    to_p: &mut [Lane],
    to_q: &mut [Lane],
) -> Lane {
    let len = p.len();
    let constant = |x: &[Lane]| -> Few<Dual> { x.iter().map(|&x| Dual::constant(x)).collect() };
    let [fixed_p, fixed_q] = [constant(p), constant(q)];
    let mut out = fixed_p.clone();
    space.geodesic(&fixed_p, &fixed_q, Dual { v: t, d: Lane::ONE }, &mut out);
    let (c, mut velocity): (Few<Lane>, Few<Lane>) = out.iter().map(|x| (x.v, x.d)).unzip();
    space.velocity(&c, &mut velocity);
    let mut tangent: Few<Lane> = cotangent.iter().copied().collect();
    space.velocity(&c, &mut tangent);
    let mut way: Few<Lane> = smallvec![Lane::ZERO; len];
    let (mut there, mut moved) = (way.clone(), way.clone());
    let mut moving = fixed_p.clone();
    for (end, to_end, part) in [(q, to_q, Lane::ONE - t), (p, to_p, -t)] {
        if std::ptr::eq(end, p) && space.conserve(p, [&c, &tangent], [q, &there], to_end) {
            break;
        }
        way.iter_mut().zip(&velocity).for_each(|(way, v)| *way = *v * part);
        space.parallel_transport(&c, end, &way, &tangent, &mut there);
        moving.iter_mut().zip(end.iter().zip(&there)).for_each(|(x, (&v, &d))| *x = Dual { v, d });
        let (from, to) = if std::ptr::eq(end, p) { (&moving, &fixed_q) } else { (&fixed_p, &moving) };
        space.geodesic(from, to, Dual::constant(t), &mut out);
        moved.iter_mut().zip(&out).for_each(|(moved, x)| *moved = x.d);
        space.velocity(&c, &mut moved);
        space.parallel_transport(&c, end, &way, &moved, &mut there);
        to_end.iter_mut().zip(&there).for_each(|(sum, x)| *sum += *x);
    }
    space.pairing(&c, &velocity, cotangent)
}
