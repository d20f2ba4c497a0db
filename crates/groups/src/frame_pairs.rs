//! Frames of two vectors in R⁴ by pairs of unit quaternions, without iterations on matrices.
//!
//! The pair (a, b) is the rotation x ↦ a x b̄, and its frame has the columns a b̄ and a i b̄. The pairs
//! (a e^{iψ}, b e^{iψ}) have the same frame: they rotate the other two columns. A tangent vector corresponds to two
//! imaginary quaternions (α, β), with a' = aα, b' = bβ, that do not rotate these columns, α₁ + β₁ = 0.
//!
//! Nothing here depends on a basis that must be chosen anew at every point, so that curves have derivatives by jets.

use crate::pair_forms::Pair;
use crate::pairs::{arc, exp, exp_minus_one};
use crate::rigid::{Quaternion, Vector, conjugate, cross, inverse_sqrt, multiply};
use crate::stiefel::Stiefel;
use std::f64::consts::PI;
use symspline_core::scalar::{Dual, Each, Jet, Lane, Scalar, dot, few, lane};
use symspline_core::space::below;
use symspline_core::special::Trig;

const HALF: Lane = lane(0.5);
/// α₁ + β₁ of a logarithm is a rounding error below this size.
const TOLERANCE: Lane = lane(1e-14);
/// The largest number of steps of Newton's method.
const MOST: usize = 30;

/// (α, β)
type Vectors<S> = [Vector<S>; 2];

/// The Stiefel manifold of frames of two vectors in R⁴.
pub struct FramePairs;

#[inline(always)]
fn columns<S: Scalar>(x: &[S]) -> [Quaternion<S>; 2] {
    few(|j| few(|i| x[2 * i + j]))
}

#[inline(always)]
fn write<S: Scalar>([first, second]: [Quaternion<S>; 2], out: &mut [S]) {
    for i in 0..4 {
        (out[2 * i], out[2 * i + 1]) = (first[i], second[i]);
    }
}

/// One of the pairs of a frame (1 + x, i + y).
#[inline(always)]
fn pair<S: Scalar>([x, y]: [Quaternion<S>; 2]) -> Pair<S> {
    let first = [x[0] + Lane::ONE, x[1], x[2], x[3]];
    // b rotates i to the quotient n of the columns. 1 − n i does, and j + n k, each far from zero on one half of the
    // sphere. For a frame close to (1, i) the differences n − i are accurate.
    let back = conjugate(x);
    let (product, rest) = (multiply(back, y), times_i(back));
    let [_, u, v, w] = few::<S, 4>(|c| product[c] + y[c] + rest[c]);
    let zero = S::constant(Lane::ZERO);
    let behind = u.value().simd_lt(lane(-1.0));
    let (near, far) = ([u + lane(2.0), zero, -w, v], [-w, v, -u, zero]);
    let b: Quaternion<S> = few(|c| S::select(behind, far[c], near[c]));
    let scale = inverse_sqrt(dot(&b, &b));
    let b = b.each(|x| x * scale);
    [multiply(first, b), b]
}

/// One of the pairs of a point.
#[inline(always)]
fn lifted(p: &[Lane]) -> Pair<Lane> {
    let [mut first, mut second] = columns(p);
    first[0] -= Lane::ONE;
    second[1] -= Lane::ONE;
    pair([first, second])
}

/// a i
#[inline(always)]
fn times_i<S: Scalar>([w, x, y, z]: Quaternion<S>) -> Quaternion<S> {
    [-x, w, z, -y]
}

#[inline(always)]
fn frame<S: Scalar>([a, b]: Pair<S>) -> [Quaternion<S>; 2] {
    let back = conjugate(b);
    [multiply(a, back), multiply(times_i(a), back)]
}

/// The four columns of the rotation of a pair, of which p has the first two.
#[inline(always)]
fn rotation(p: &[Lane], [a, b]: Pair<Lane>) -> [Quaternion<Lane>; 4] {
    let ([first, second], back, [w, x, y, z]) = (columns(p), conjugate(b), a);
    [first, second, multiply([-y, -z, w, x], back), multiply([-z, y, -x, w], back)]
}

/// The columns of x in terms of those of a rotation.
#[inline(always)]
fn inside(basis: &[Quaternion<Lane>; 4], x: &[Lane]) -> [Quaternion<Lane>; 2] {
    columns(x).each(|x| basis.each(|e| dot(&e, &x)))
}

#[inline(always)]
fn outside(basis: &[Quaternion<Lane>; 4], x: [Quaternion<Lane>; 2]) -> [Quaternion<Lane>; 2] {
    x.each(|x| few(|c| dot(&basis.each(|e| e[c]), &x)))
}

/// The vectors of a tangent vector at the first columns of a rotation.
#[inline(always)]
fn vectors(basis: &[Quaternion<Lane>; 4], v: &[Lane]) -> Vectors<Lane> {
    // α − β and αi − iβ
    let [s, t] = inside(basis, v);
    let first = (s[1] - t[0]) * lane(0.25);
    [
        [first, (s[2] - t[3]) * HALF, (s[3] + t[2]) * HALF],
        [-first, -(s[2] + t[3]) * HALF, (t[2] - s[3]) * HALF],
    ]
}

/// The tangent vector of vectors.
#[inline(always)]
fn tangent(basis: &[Quaternion<Lane>; 4], [alpha, beta]: Vectors<Lane>, out: &mut [Lane]) {
    let [x, y, z]: Vector<Lane> = few(|c| alpha[c] - beta[c]);
    let both = [[Lane::ZERO, x, y, z], [-x, Lane::ZERO, alpha[2] + beta[2], -(alpha[1] + beta[1])]];
    write(outside(basis, both), out);
}

/// The pair at the end of the geodesic with initial velocity v.
#[inline(always)]
fn moved<S: Scalar>([a, b]: Pair<S>, v: Vectors<S>) -> Pair<S> {
    let [da, db] = v.each(exp);
    [multiply(a, da), multiply(b, db)]
}

/// (a e^{iψ}, b e^{iψ}), with cos ψ and sin ψ.
#[inline(always)]
fn turned<S: Scalar>(pair: Pair<S>, [c, s]: [S; 2]) -> Pair<S> {
    pair.each(|[w, x, y, z]| [w * c - x * s, x.fma(c, w * s), y.fma(c, z * s), z * c - y * s])
}

#[inline(always)]
fn turn<S: Scalar>(angle: S) -> [S; 2] {
    let Trig { c, s, .. } = Trig::new(angle * angle);
    [c, s * angle]
}

/// θ/sin θ of both quaternions, and α₁ + β₁ of their logarithms.
#[inline(always)]
fn vertical<S: Scalar>(pair: Pair<S>) -> ([S; 2], S) {
    let f = pair.each(arc);
    (f, f[0].fma(pair[0][1], f[1] * pair[1][1]))
}

/// The derivative of α₁ + β₁ with respect to ψ.
#[inline(always)]
fn slope(pair: Pair<Lane>, f: [Lane; 2]) -> Lane {
    // y f with y = sin θ u₁, where dθ/dψ = u₁ and dy/dψ = cos θ.
    let one = |[c, v @ ..]: Quaternion<Lane>, f: Lane| {
        let sine2 = dot(&v, &v);
        let part = sine2.simd_gt(Lane::ZERO).select(v[0] * v[0] / sine2, Lane::ZERO);
        c.mul_add(f, part * (Lane::ONE - f * c))
    };
    one(pair[0], f[0]) + one(pair[1], f[1])
}

/// The turn e^{iψ} behind which a pair has a logarithm with α₁ + β₁ = 0, and the slope of that sum there; NaN where
/// there is none. This is the problem of Zimmermann & Hüper (see `Frames::log`) for a block of one number, which
/// Newton's method solves.
#[inline(always)]
fn level(pair: Pair<Lane>) -> ([Lane; 2], Lane) {
    // For small vectors the sum is Im (z e^{iψ}) with the components along 1 and i of both quaternions.
    let (c, s) = (pair[0][0] + pair[1][0], -(pair[0][1] + pair[1][1]));
    let scale = Lane::ONE / c.mul_add(c, s * s).sqrt();
    let mut total = [c * scale, s * scale];
    for _ in 0..MOST {
        let now = turned(pair, total);
        let (f, off) = vertical(now);
        let slope = slope(now, f);
        let open = off.abs().simd_gt(TOLERANCE);
        let (last, step) = (open.none(), -off / slope);
        // The last step takes what was left to below rounding, for all lanes.
        let [dc, ds] = turn(if last { step } else { open.select(step, Lane::ZERO) });
        let [c, s] = total;
        total = [c * dc - s * ds, s.mul_add(dc, c * ds)];
        if last {
            let angles: [Lane; 2] = few(|i| f[i] * dot(&now[i][1..], &now[i][1..]).sqrt());
            let inside = (angles[0] + angles[1]).simd_lt(below(PI));
            return (total.each(|x| inside.select(x, lane(f64::NAN))), slope);
        }
    }
    ([lane(f64::NAN); 2], lane(f64::NAN))
}

/// The logarithm of a pair that is known to be behind its turn up to derivatives.
#[inline(always)]
fn leveled<S: Scalar>(mut pair: Pair<S>, slope: Lane) -> Vectors<S> {
    let (mut f, mut off) = vertical(pair);
    // Each step makes one more derivative of α₁ + β₁ zero.
    for _ in 0..S::ORDER {
        pair = turned(pair, turn(off * (-Lane::ONE / slope)));
        (f, off) = vertical(pair);
    }
    let [mut alpha, mut beta]: Vectors<S> = few(|i| few(|c| pair[i][1 + c] * f[i]));
    let first = (alpha[0] - beta[0]) * HALF;
    (alpha[0], beta[0]) = (first, -first);
    [alpha, beta]
}

#[inline(always)]
fn relative<S: Scalar>([a, b]: Pair<S>, [c, d]: Pair<S>) -> Pair<S> {
    [multiply(conjugate(a), c), multiply(conjugate(b), d)]
}

/// The vectors at p of the geodesic to the frame of q.
#[inline(always)]
fn log<S: Scalar>(p: Pair<S>, q: Pair<S>) -> Vectors<S> {
    log_of(relative(p, q))
}

/// The vectors at the frame (1, i) of the geodesic to the frame of a pair.
#[inline(always)]
fn log_of<S: Scalar>(pair: Pair<S>) -> Vectors<S> {
    let (total, slope) = level(pair.each(|q| q.each(|x| x.value())));
    leveled(turned(pair, total.each(S::constant)), slope)
}

/// D(v)⁻¹w for the vectors w of a tangent vector at the frame of e^v, where D(v) = π ∘ dexp₋ᵥ: with the inverse C of
/// dexp₋ᵥ and the vertical direction e, the horizontal one of the vectors C(w + γe).
#[inline(always)]
fn dlog(v: Vectors<Lane>, w: Vectors<Lane>) -> Vectors<Lane> {
    let axis = [Lane::ONE, Lane::ZERO, Lane::ZERO];
    let back: [[Vector<Lane>; 2]; 2] = few(|i| [w[i], axis].each(|w| inverse_of_dexp(v[i], w)));
    let [of_w, of_axis]: [Lane; 2] = few(|j| back[0][j][0] + back[1][j][0]);
    let gamma = -of_w / of_axis;
    few(|i| few(|c| back[i][1][c].mul_add(gamma, back[i][0][c])))
}

/// `ad/(1 − e^{−ad})` of w, where `ad` is twice the cross product with v: w + v × w + (1 − θ cot θ) v × (v × w)/θ².
#[inline(always)]
fn inverse_of_dexp(v: Vector<Lane>, w: Vector<Lane>) -> Vector<Lane> {
    let square = dot(&v, &v);
    let Trig { c, s, .. } = Trig::new(square);
    let cot = c / s;
    let along = square.simd_gt(Lane::ZERO).select((Lane::ONE - cot) * dot(&v, &w) / square, Lane::ZERO);
    let cross = cross(v, w);
    few(|i| cot.mul_add(w[i], along.mul_add(v[i], cross[i])))
}

/// The frame at the end of a geodesic minus the frame (1, i) at its start, without cancellation.
#[inline(always)]
fn step(v: Vectors<Lane>) -> [Quaternion<Lane>; 2] {
    let [a, back] = [exp_minus_one(v[0]), conjugate(exp_minus_one(v[1]))];
    // (1 + a)(1 + b̄) − 1 and (1 + a) i (1 + b̄) − i
    let turn = times_i(a);
    let (first, second) = (multiply(a, back), multiply(turn, back));
    let [w, x, y, z] = back;
    let left = [-x, w, -z, y];
    [few(|c| first[c] + a[c] + back[c]), few(|c| second[c] + turn[c] + left[c])]
}

/// De Casteljau's algorithm for a segment with the points p, the handles v, and the vector w between the inner control
/// points at the first of them, q, at p, v, q, w, p, v.
#[inline(always)]
fn curve<S: Scalar>(x: &[Vec<Lane>], t: S) -> [Quaternion<S>; 2] {
    let constant = |p: Pair<Lane>| p.each(|q| q.each(S::constant));
    let times = |v: Vectors<S>, t: S| v.each(|v| v.each(|x| x * t));
    let [a, b, c] = few(|i| {
        let (p, t) = (lifted(&x[2 * i]), if i == 2 { -t + Lane::ONE } else { t });
        let v = vectors(&rotation(&x[2 * i], p), &x[2 * i + 1]);
        moved(constant(p), v.each(|v| v.each(|x| t * x)))
    });
    let between = |p: Pair<S>, q: Pair<S>| moved(p, times(log(p, q), t));
    frame(between(between(a, b), between(b, c)))
}

/// The covariant acceleration of a moving point Y, Y″ + Y′Y′ᵀY + Y((YᵀY′)² + Y′ᵀY′): it is zero for geodesics (Edelman,
/// Arias & Smith, 1998, equation 2.41).
#[inline(always)]
fn acceleration([y, d, dd]: [[Quaternion<Lane>; 2]; 3]) -> [Quaternion<Lane>; 2] {
    let inside: [[Lane; 2]; 2] = few(|i| few(|j| dot(&y[i], &d[j])));
    few(|j| {
        let by: [Lane; 2] =
            few(|i| dot(&d[i], &d[j]) + inside[i][0] * inside[0][j] + inside[i][1] * inside[1][j]);
        few(|c| {
            dd[j][c] + d[0][c] * inside[j][0] + d[1][c] * inside[j][1] + y[0][c] * by[0] + y[1][c] * by[1]
        })
    })
}

impl Stiefel for FramePairs {
    fn size(&self) -> (usize, usize) {
        (4, 2)
    }

    fn exp(&self, p: &[Lane], v: &[Lane], out: &mut [Lane]) {
        let basis = rotation(p, lifted(p));
        write(outside(&basis, step(vectors(&basis, v))), out);
        out.iter_mut().zip(p).for_each(|(x, p)| *x += *p);
    }

    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) {
        let basis = rotation(p, lifted(p));
        let difference: [Lane; 8] = few(|i| q[i] - p[i]);
        tangent(&basis, log_of(pair(inside(&basis, &difference))), out);
    }

    fn dlog(&self, p: &[Lane], v: &[Lane], w: &[Lane], out: &mut [Lane]) {
        let start = lifted(p);
        let basis = rotation(p, start);
        let v = vectors(&basis, v);
        let stop = moved(start, v);
        let mut q = [Lane::ZERO; 8];
        write(frame(stop), &mut q);
        tangent(&basis, dlog(v, vectors(&rotation(&q, stop), w)), out);
    }

    fn bends(&self, x: &[Vec<Lane>], out: &mut [Lane]) {
        let [p, q] = [0, 2].each(|i| lifted(&x[i]));
        let (here, there) = (rotation(&x[0], p), rotation(&x[2], q));
        let (v, w) = (vectors(&here, &x[1]), vectors(&there, &x[3]));
        let between = relative(moved(p, v), moved(q, w));
        let ([c, s], slope) = level(between);
        let ahead = leveled(turned(between, [c, s]), slope);
        // The geodesic back, at the pair before the turn.
        let (cos, sin) = (c.mul_add(c, -s * s), lane(2.0) * c * s);
        let back = ahead.each(|[x, y, z]| [-x, sin.mul_add(z, -cos * y), -sin.mul_add(y, cos * z)]);
        let both = [(here, v, ahead), (there, w, back)];
        for ((basis, v, along), out) in both.into_iter().zip(out.chunks_exact_mut(8)) {
            let found = dlog(v, along);
            tangent(&basis, few(|i| few(|c| found[i][c] - v[i][c])), out);
        }
    }

    fn transvect(&self, p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let start = lifted(p);
        let basis = rotation(p, start);
        let stop = moved(start, vectors(&basis, v));
        let mut q = [Lane::ZERO; 8];
        write(frame(stop), &mut q);
        let moved = rotation(&q, stop);
        x.chunks_exact_mut(8).for_each(|x| write(outside(&moved, inside(&basis, x)), x));
    }

    fn curve(&self, order: usize, x: &[Vec<Lane>], out: &mut [Lane]) {
        let t = x[6][0];
        if order == 0 {
            return write(curve(x, t), out);
        }
        let parts: [[Quaternion<Lane>; 2]; 3] = if order == 1 {
            let moving: [Quaternion<Dual>; 2] = curve(x, Dual::from_parts([t, Lane::ONE, Lane::ZERO]));
            few(|k| moving.each(|x| x.each(|x| x.parts()[k])))
        } else {
            let moving: [Quaternion<Jet>; 2] = curve(x, Jet::from_parts([t, Lane::ONE, Lane::ZERO]));
            few(|k| moving.each(|x| x.each(|x| x.parts()[k])))
        };
        let (point, vector) = out.split_at_mut(8);
        write(parts[0], point);
        write(if order == 1 { parts[1] } else { acceleration(parts) }, vector);
    }
}
