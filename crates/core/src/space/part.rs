//! A totally geodesic subspace: the fixed points of an isometry of order two, or a component of them.
//!
//! Geodesics between points of the subspace stay in it, so that all formulas are those of the whole space. An
//! implementation provides the points and coordinates of the subspace.

use super::traits::{Ambient, Frame, Origin, Space};
use crate::delegate;
use crate::scalar::{Lane, Scalar, dot, lane, max_or_nan};

/// The fixed points of an isometry of order two, the mirror.
pub trait Part: Copy + Send + Sync {
    /// The whole space.
    type Whole: Space;
    /// The whole space.
    fn whole(&self) -> Self::Whole;
    /// See [`Origin::dim`].
    fn dim(&self) -> usize;
    /// See [`Origin::curvature`].
    fn curvature(&self) -> f64;
    /// See [`Ambient::injectivity_radius`].
    fn injectivity_radius(&self) -> f64;
    /// Coordinates in the whole space of a vector with coordinates x in the subspace; preserves lengths.
    fn widen<S: Scalar>(&self, x: &[S], wide: &mut [S]);
    /// Coordinates of the projection of a vector onto the subspace.
    fn narrow<S: Scalar>(&self, wide: &[S], x: &mut [S]);
    /// The image of a point.
    fn mirror(&self, p: &[Lane], image: &mut [Lane]);
    /// The image of a tangent vector at a point of the subspace, at the same representative.
    fn mirror_vector(&self, p: &[Lane], v: &[Lane], image: &mut [Lane]);
    /// A frame of the whole space at a point of the subspace that maps the subspace at the origin to the subspace.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]);
    /// The lanes in which a fixed point of the isometry belongs to the subspace. If there are several components, it
    /// may belong to another one.
    fn contains(&self, _p: &[Lane]) -> Lane {
        Lane::ZERO.simd_eq(Lane::ZERO)
    }
    /// See [`Ambient::random_point`].
    fn random_point(&self, noise: &mut [Lane]) {
        self.whole().random_point(noise);
    }
    /// Describes why a point of the whole space is not in the subspace.
    fn violation(&self, p: &[Lane]) -> String;
}

/// A totally geodesic subspace as a space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Within<P>(pub P);

/// The distance from the whole space that a point off the subspace may have.
const OFF: Lane = lane(1e-8);

impl<P: Part> Within<P> {
    fn zeros<S: Scalar>(&self) -> Vec<S> {
        vec![S::constant(Lane::ZERO); self.0.whole().dim()]
    }

    fn wide<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let mut wide = self.zeros();
        self.0.widen(x, &mut wide);
        wide
    }

    /// The size of rounding errors of an array of size one at p.
    fn rounding_at(&self, p: &[Lane]) -> Lane {
        lane(4.0 * p.len() as f64 * f64::EPSILON) * self.0.whole().rounding(p)
    }

    /// Replaces a vector by the mean of itself and its image, its projection onto the subspace. Vectors that equal it
    /// up to rounding do not change.
    fn along(&self, p: &[Lane], v: &mut [Lane]) {
        let mut image = v.to_vec();
        self.0.mirror_vector(p, v, &mut image);
        let size = dot(v, v).sqrt();
        let off =
            image.iter().zip(&*v).fold(Lane::ZERO, |sum, (i, v)| (*i - *v).mul_add(*i - *v, sum)).sqrt();
        let keep = off.simd_le(size * self.rounding_at(p));
        v.iter_mut().zip(&image).for_each(|(v, image)| *v = keep.select(*v, lane(0.5) * (*v + *image)));
    }

    /// Replaces a point of the whole space by the nearest one of the subspace, half way to its image; returns the
    /// distance.
    fn nearest(&self, x: &mut [Lane]) -> Lane {
        let whole = self.0.whole();
        let (mut image, mut way, mut middle) = (x.to_vec(), x.to_vec(), x.to_vec());
        self.0.mirror(x, &mut image);
        let off = whole.log(x, &image, &mut way) * lane(0.5);
        whole.ray(x, &way, lane(0.5), &mut middle);
        // Points that equal their projection up to rounding do not change.
        let keep = off.simd_le(self.rounding_at(x));
        x.iter_mut().zip(&middle).for_each(|(x, middle)| *x = keep.select(*x, *middle));
        off
    }
}

impl<P: Part> Ambient for Within<P> {
    delegate!(part => part.0.whole();
        point_len, point_shape, is_complex, fiber_rank, cut_angle, longest_handle, ray_len, prepare_ray,
        distance, pairing, raise, pull_back, transvect, parallel_transport, inner, rounding);

    fn injectivity_radius(&self) -> f64 {
        self.0.injectivity_radius()
    }
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        self.0.whole().ray(p, v, t, out);
    }
    fn prepared_ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], prepared: &[Lane], t: S, out: &mut [S]) {
        self.0.whole().prepared_ray(p, v, prepared, t, out);
    }
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let whole = self.0.whole();
        let angle = whole.log(p, q, out);
        let square = whole.inner(p, out, out);
        // Points are off the subspace by rounding errors, which are large compared with a short step.
        self.along(p, out);
        if self.cut_angle().is_finite() {
            // Almost at the cut locus rounding errors rotate the vector, but its length is accurate.
            let grown = square / whole.inner(p, out, out);
            let factor = grown.simd_lt(lane(1.01)).select(grown.sqrt(), Lane::ONE);
            out.iter_mut().for_each(|x| *x *= factor);
        }
        angle
    }
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        self.0.whole().geodesic(p, q, t, out);
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        self.0.whole().velocity(gamma, d);
        self.along(gamma, d);
    }
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        self.0.whole().acceleration(gamma, d, dd);
        self.along(gamma, dd);
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let off = self.0.whole().project(x);
        let off = max_or_nan(off, self.nearest(x));
        self.0.contains(x).select(off, lane(f64::NAN))
    }
    fn random_point(&self, noise: &mut [Lane]) {
        self.0.random_point(noise);
        self.nearest(noise);
    }
    fn violation(&self, x: &[f64]) -> String {
        let mut p: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
        if self.0.whole().project(&mut p).simd_le(OFF).all() {
            self.0.violation(&p)
        } else {
            self.0.whole().violation(x)
        }
    }
}

impl<P: Part> Frame for Within<P> {
    fn frame_len(&self) -> usize {
        self.0.whole().frame_len()
    }
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        self.0.lift(p, frame);
    }
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let mut wide = self.zeros();
        let angle = self.0.whole().step(frame, p, q, &mut wide);
        self.0.narrow(&wide, chord);
        angle
    }
    fn reorthonormalize(&self, frame: &mut [Lane], p: &[Lane]) {
        self.0.whole().reorthonormalize(frame, p);
    }
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let mut wide = self.zeros();
        self.0.whole().coordinates(frame, p, v, &mut wide);
        self.0.narrow(&wide, x);
    }
    fn products(&self, frame: &[Lane], p: &[Lane], cotangent: &[Lane], x: &mut [Lane]) {
        let mut wide = self.zeros();
        self.0.whole().products(frame, p, cotangent, &mut wide);
        self.0.narrow(&wide, x);
    }
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        self.0.whole().tangent(frame, p, &self.wide(x), v);
        self.along(p, v);
    }
}

impl<P: Part> Origin for Within<P> {
    fn dim(&self) -> usize {
        self.0.dim()
    }
    fn chord_len(&self) -> usize {
        self.0.whole().chord_len()
    }
    fn curvature(&self) -> f64 {
        self.0.curvature()
    }
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        self.0.whole().prepare(&self.wide(chord), prepared);
    }
    fn inner_handles<S: Scalar>(
        &self,
        chord: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        let (mut plus, mut minus) = (self.zeros(), self.zeros());
        let whole = self.0.whole();
        whole.inner_handles(&self.wide(chord), prepared, &self.wide(a), &self.wide(b), &mut plus, &mut minus);
        self.0.narrow(&plus, w_plus);
        self.0.narrow(&minus, w_minus);
    }
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let mut wide = self.zeros();
        self.0.whole().triple(&self.wide(a), &self.wide(b), &self.wide(c), &mut wide);
        self.0.narrow(&wide, out);
    }
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let mut wide = self.wide(x);
        self.0.whole().stretch(&self.wide(v), &mut wide);
        self.0.narrow(&wide, x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        self.0.whole().angle(&self.wide(v))
    }
    fn condition(&self, chord: &[Lane]) -> Lane {
        self.0.whole().condition(&self.wide(chord))
    }
}

impl<P: Part> Space for Within<P> {
    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        self.0.whole().angle_at(p, v)
    }
}
