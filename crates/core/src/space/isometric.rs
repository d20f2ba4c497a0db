//! A space whose formulas are those of another one, of which its arrays are linear images: small groups of matrices are
//! spheres.

use super::traits::{Ambient, Covered, Evaluation, Frame, Origin, Space};
use crate::delegate;
use crate::scalar::{Each, Lane, Scalar, dot, few, lane};

/// An isometry up to scale, linear in the arrays of points and vectors.
///
/// Vectors have [`SCALE`](Isometry::SCALE) times the length of their images, and the deciding angles are
/// [`ANGLE`](Isometry::ANGLE) times those of the images.
pub trait Isometry: Copy + Send + Sync {
    /// The space with the fast formulas. Its points have at most `MOST` numbers.
    type Image: Space;
    /// The space itself by general formulas, which recognise, project and describe its points.
    type General: Ambient;
    /// Whether loops over knots and samples are compiled for this space alone.
    const HOT: bool = true;
    /// The number of entries of an image.
    const LEN: usize;
    /// The length of a vector divided by that of its image.
    const SCALE: f64;
    /// The deciding angle divided by that of the images.
    const ANGLE: f64;
    /// The space with the fast formulas.
    fn image(&self) -> Self::Image;
    /// The space by general formulas.
    fn general(&self) -> &Self::General;
    /// The image of an array; for one that is not of the space, that of its projection.
    fn enter<S: Scalar>(x: &[S], y: &mut [S]);
    /// The array of an image.
    fn leave<S: Scalar>(y: &[S], x: &mut [S]);
}

/// The largest number of entries of an image.
const MOST: usize = 4;

/// A space by an isometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Isometric<I>(pub I);

type Image<S> = [S; MOST];

/// Scales coordinates; no image has more coordinates than entries.
#[inline(always)]
fn scaled<S: Scalar>(x: &[S], by: f64) -> Image<S> {
    few(|i| if i < x.len() { x[i] * lane(by) } else { S::constant(Lane::ZERO) })
}

impl<I: Isometry> Isometric<I> {
    #[inline(always)]
    fn enter<S: Scalar>(x: &[S]) -> Image<S> {
        let mut y = [S::constant(Lane::ZERO); MOST];
        I::enter(x, &mut y[..I::LEN]);
        y
    }

    /// Calls a function that writes an image, and writes the array of it.
    #[inline(always)]
    fn leave<S: Scalar, R>(x: &mut [S], compute: impl FnOnce(&mut [S]) -> R) -> R {
        let mut y = [S::constant(Lane::ZERO); MOST];
        let result = compute(&mut y[..I::LEN]);
        I::leave(&y[..I::LEN], x);
        result
    }

    /// Scales the coordinates that a function of images writes.
    #[inline(always)]
    fn coordinates<S: Scalar, R>(x: &mut [S], compute: impl FnOnce(&mut [S]) -> R) -> R {
        let result = compute(x);
        x.iter_mut().for_each(|x| *x = *x * lane(I::SCALE));
        result
    }
}

impl<I: Isometry> Ambient for Isometric<I> {
    delegate!(space => space.0.general();
        point_len, point_shape, is_complex, cut_angle, injectivity_radius, project, project_tangent,
        random_point, violation, imprecise_point, rounding);

    fn longest_ray(&self) -> f64 {
        self.0.image().longest_ray() * I::ANGLE
    }
    #[inline(always)]
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
        let [p, v] = [p, v].each(Self::enter);
        Self::leave(out, |out| self.0.image().ray(&p[..I::LEN], &v[..I::LEN], t, out));
    }
    #[inline(always)]
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
        let [p, q] = [p, q].each(Self::enter);
        Self::leave(out, |out| self.0.image().log(&p[..I::LEN], &q[..I::LEN], out)) * lane(I::ANGLE)
    }
    fn distance(&self, p: &[Lane], q: &[Lane], log: &[Lane], angle: Lane) -> Lane {
        let [p, q, log] = [p, q, log].each(Self::enter);
        let angle = angle * lane(1.0 / I::ANGLE);
        self.0.image().distance(&p[..I::LEN], &q[..I::LEN], &log[..I::LEN], angle) * lane(I::SCALE)
    }
    #[inline(always)]
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
        let [p, q] = [p, q].each(Self::enter);
        Self::leave(out, |out| self.0.image().geodesic(&p[..I::LEN], &q[..I::LEN], t, out));
    }
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        let [p, v, x] = [p, v, x].each(Self::enter);
        Self::leave(out, |out| self.0.image().transvect(&p[..I::LEN], &v[..I::LEN], &x[..I::LEN], out));
    }
    #[inline(always)]
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let [gamma, mut image] = [gamma, &*d].each(Self::enter);
        self.0.image().velocity(&gamma[..I::LEN], &mut image[..I::LEN]);
        I::leave(&image[..I::LEN], d);
    }
    #[inline(always)]
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]) {
        let [gamma, d, mut image] = [gamma, d, &*dd].each(Self::enter);
        self.0.image().acceleration(&gamma[..I::LEN], &d[..I::LEN], &mut image[..I::LEN]);
        I::leave(&image[..I::LEN], dd);
    }
    fn raise(&self, p: &[Lane], gradient: &mut [Lane]) {
        // The transpose of `leave`, entry by entry.
        let mut image: Image<Lane> = few(|k| {
            let mut column = gradient.to_vec();
            I::leave(&few::<_, MOST>(|i| if i == k { Lane::ONE } else { Lane::ZERO })[..I::LEN], &mut column);
            dot(&column, gradient)
        });
        self.0.image().raise(&Self::enter(p)[..I::LEN], &mut image[..I::LEN]);
        I::leave(&scaled(&image[..I::LEN], 1.0 / (I::SCALE * I::SCALE))[..I::LEN], gradient);
    }
    #[inline(always)]
    fn pull_back(
        &self,
        p: &[Lane],
        q: &[Lane],
        t: Lane,
        cotangent: &[Lane],
        to_p: &mut [Lane],
        to_q: &mut [Lane],
    ) -> Lane {
        let [p, q, cotangent] = [p, q, cotangent].each(Self::enter);
        let [mut by_p, mut by_q] = [[Lane::ZERO; MOST]; 2];
        let (x, y) = (&mut by_p[..I::LEN], &mut by_q[..I::LEN]);
        let rate = self.0.image().pull_back(&p[..I::LEN], &q[..I::LEN], t, &cotangent[..I::LEN], x, y);
        let sum = |x: &[Lane], to: &mut [Lane]| {
            let mut out = to.to_vec();
            I::leave(&x[..I::LEN], &mut out);
            to.iter_mut().zip(&out).for_each(|(to, x)| *to += *x);
        };
        sum(&by_p, to_p);
        sum(&by_q, to_q);
        rate * lane(I::SCALE * I::SCALE)
    }
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        let [p, u, v] = [p, u, v].each(Self::enter);
        self.0.image().inner(&p[..I::LEN], &u[..I::LEN], &v[..I::LEN]) * lane(I::SCALE * I::SCALE)
    }
}

impl<I: Isometry> Frame for Isometric<I> {
    fn frame_len(&self) -> usize {
        self.0.image().frame_len()
    }
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        self.0.image().lift(&Self::enter(p)[..I::LEN], frame);
    }
    #[inline(always)]
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
        let [p, q] = [p, q].each(Self::enter);
        let step = |chord: &mut [Lane]| self.0.image().step(frame, &p[..I::LEN], &q[..I::LEN], chord);
        Self::coordinates(chord, step) * lane(I::ANGLE)
    }
    fn reorthonormalize(&self, frame: &mut [Lane], p: &[Lane]) {
        self.0.image().reorthonormalize(frame, &Self::enter(p)[..I::LEN]);
    }
    #[inline(always)]
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let [p, v] = [p, v].each(Self::enter);
        Self::coordinates(x, |x| self.0.image().coordinates(frame, &p[..I::LEN], &v[..I::LEN], x));
    }
    #[inline(always)]
    fn products(&self, frame: &[Lane], p: &[Lane], cotangent: &[Lane], x: &mut [Lane]) {
        let [p, v] = [p, cotangent].each(Self::enter);
        Self::coordinates(x, |x| self.0.image().products(frame, &p[..I::LEN], &v[..I::LEN], x));
    }
    #[inline(always)]
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]) {
        let (p, scaled) = (Self::enter(p), scaled(x, 1.0 / I::SCALE));
        Self::leave(v, |v| self.0.image().tangent(frame, &p[..I::LEN], &scaled[..x.len()], v));
    }
}

impl<I: Isometry> Origin for Isometric<I> {
    fn dim(&self) -> usize {
        self.0.image().dim()
    }
    fn chord_len(&self) -> usize {
        self.0.image().chord_len()
    }
    fn curvature(&self) -> f64 {
        self.0.image().curvature() / I::SCALE
    }
    #[inline(always)]
    fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]) {
        self.0.image().prepare(&scaled(chord, 1.0 / I::SCALE)[..chord.len()], prepared);
    }
    #[inline(always)]
    fn inner_handles<S: Scalar>(
        &self,
        chord: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    ) {
        let (n, down) = (chord.len(), 1.0 / I::SCALE);
        let (d, a, b) = (scaled(chord, down), scaled(a, down), scaled(b, down));
        self.0.image().inner_handles(&d[..n], prepared, &a[..n], &b[..n], w_plus, w_minus);
        w_plus.iter_mut().chain(w_minus).for_each(|w| *w = *w * lane(I::SCALE));
    }
    #[inline(always)]
    fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let (n, down) = (a.len(), 1.0 / I::SCALE);
        self.0.image().triple(&scaled(a, down)[..n], &scaled(b, down)[..n], c, out);
    }
    #[inline(always)]
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        self.0.image().stretch(&scaled(v, 1.0 / I::SCALE)[..v.len()], x);
    }
    fn angle(&self, v: &[Lane]) -> Lane {
        self.0.image().angle(v) * lane(I::ANGLE / I::SCALE)
    }
    fn condition(&self, chord: &[Lane]) -> Lane {
        self.0.image().condition(&scaled(chord, 1.0 / I::SCALE)[..chord.len()])
    }
}

impl<I: Isometry> Space for Isometric<I> {
    const HOT: bool = I::HOT;

    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        let [p, v] = [p, v].each(Self::enter);
        self.0.image().angle_at(&p[..I::LEN], &v[..I::LEN]) * lane(I::ANGLE)
    }
    fn evaluate_with<E: Evaluation>(&self, evaluation: E) {
        if I::HOT { evaluation.covered(self) } else { evaluation.direct(self) }
    }
}

impl<I: Isometry> Covered for Isometric<I> {
    type Cover = I::Image;
    const LEN: usize = I::LEN;

    fn cover(&self) -> I::Image {
        self.0.image()
    }
    #[inline(always)]
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]) {
        for (x, y) in p.into_iter().zip(y).chain(v.into_iter().zip(w)) {
            I::enter(x, y);
        }
    }
    fn choose(&self, _from: &[Lane], _qyw: [&mut [Lane]; 3]) {}
    #[inline(always)]
    fn leave(&self, _side: Lane, y: &[Lane], w: Option<&[Lane]>, out: &mut [Lane]) {
        I::leave(w.unwrap_or(y), out);
    }
}
