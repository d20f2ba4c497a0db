//! Rotations and rigid motions of three dimensions by unit quaternions, scalar first.

use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane};
use symspline_core::special::{Trig, arc_defect};

pub type Vector<S> = [S; 3];
pub type Quaternion<S> = [S; 4];

/// x ↦ R x + t, with R given by a unit quaternion.
#[derive(Clone, Copy)]
pub struct Motion<S> {
    pub q: Quaternion<S>,
    pub t: Vector<S>,
}

/// An element (ω, v) of se(3).
pub type Twist<S> = [Vector<S>; 2];

#[inline(always)]
pub fn cross<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    let minor = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

#[inline(always)]
pub fn add<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    few(|i| a[i] + b[i])
}

#[inline(always)]
pub fn scale<S: Scalar>(a: Vector<S>, x: S) -> Vector<S> {
    a.each(|a| a * x)
}

/// The product of two quaternions.
#[inline(always)]
pub fn multiply<S: Scalar>(a: Quaternion<S>, b: Quaternion<S>) -> Quaternion<S> {
    let ([aw, av @ ..], [bw, bv @ ..]) = (a, b);
    let v = add(add(scale(bv, aw), scale(av, bw)), cross(av, bv));
    [aw * bw - dot(&av, &bv), v[0], v[1], v[2]]
}

#[inline(always)]
pub fn conjugate<S: Scalar>([w, x, y, z]: Quaternion<S>) -> Quaternion<S> {
    [w, -x, -y, -z]
}

/// R x, for the rotation R of a unit quaternion: `x + 2w (v × x) + 2 v × (v × x)`.
#[inline(always)]
pub fn rotate<S: Scalar>([w, v @ ..]: Quaternion<S>, x: Vector<S>) -> Vector<S> {
    let twice = cross(v, x).each(|c| c + c);
    add(add(x, scale(twice, w)), cross(v, twice))
}

/// The quaternion of a rotation matrix minus the identity, given row by row, which is accurate for small rotations.
/// Of the four rows of 4qqᵀ, all linear in R, the longest is used (Shepperd 1978).
#[inline(always)]
pub fn of_matrix<S: Scalar>(r: [S; 9]) -> Quaternion<S> {
    let trace = r[0] + r[4] + r[8];
    let twice = |i: usize| r[i] + r[i];
    let four = lane(4.0);
    let rows = [
        [trace + four, r[7] - r[5], r[2] - r[6], r[3] - r[1]],
        [r[7] - r[5], twice(0) - trace, r[1] + r[3], r[2] + r[6]],
        [r[2] - r[6], r[1] + r[3], twice(4) - trace, r[5] + r[7]],
        [r[3] - r[1], r[2] + r[6], r[5] + r[7], twice(8) - trace],
    ];
    let mut best = rows[0];
    let mut most = rows[0][0].value();
    for i in 1..4 {
        let better = rows[i][i].value().simd_gt(most);
        most = better.select(rows[i][i].value(), most);
        best = few(|c| S::select(better, rows[i][c], best[c]));
    }
    let scale = inverse_sqrt(dot(&best, &best));
    best.each(|x| x * scale)
}

/// 1/√x
#[inline(always)]
pub fn inverse_sqrt<S: Scalar>(x: S) -> S {
    let v = x.value();
    let root = Lane::ONE / v.sqrt();
    let first = lane(-0.5) * root / v;
    x.compose([root, first, lane(-1.5) * first / v])
}

/// The rotation matrix, row by row.
#[inline(always)]
pub fn to_matrix<S: Scalar>([w, x, y, z]: Quaternion<S>) -> [S; 9] {
    let two = |a: S, b: S| (a * b) * lane(2.0);
    let one = |a: S, b: S| -(two(a, a) + two(b, b)) + Lane::ONE;
    [
        one(y, z),
        two(x, y) - two(w, z),
        two(x, z) + two(w, y),
        two(x, y) + two(w, z),
        one(x, z),
        two(y, z) - two(w, x),
        two(x, z) - two(w, y),
        two(y, z) + two(w, x),
        one(x, y),
    ]
}

impl<S: Scalar> Motion<S> {
    /// The product: first `b`, then `self`.
    #[inline(always)]
    pub fn times(&self, b: &Self) -> Self {
        Motion { q: multiply(self.q, b.q), t: add(rotate(self.q, b.t), self.t) }
    }

    #[inline(always)]
    pub fn inverse(&self) -> Self {
        let q = conjugate(self.q);
        Motion { q, t: rotate(q, self.t).each(|x| -x) }
    }

    /// `Ad(g) ξ = g ξ g⁻¹`.
    #[inline(always)]
    pub fn adjoint(&self, [omega, v]: Twist<S>) -> Twist<S> {
        let omega = rotate(self.q, omega);
        [omega, add(rotate(self.q, v), cross(self.t, omega))]
    }

    /// The exponential (ω, v) ↦ (e^Ω, V v) with `V = 1 + (1−cos θ)/θ² Ω + (1−sin θ/θ)/θ² Ω²`.
    #[inline(always)]
    pub fn exp([omega, v]: Twist<S>) -> Self {
        let square = dot(&omega, &omega);
        let half = Trig::new(square * lane(0.25));
        let full = Trig::new(square);
        let axis = scale(omega, half.s * lane(0.5));
        let once = cross(omega, v);
        let t = add(add(v, scale(once, -full.k)), scale(cross(omega, once), full.j));
        Motion { q: [half.c, axis[0], axis[1], axis[2]], t }
    }

    /// The logarithm, and the angle θ ≤ π: `ω = 2f q⃗` with f = φ/sin φ, φ = θ/2, and
    /// `V⁻¹ = 1 − Ω/2 + β Ω²` with `β = (1 − φ cot φ)/θ²`.
    #[inline(always)]
    pub fn log(&self) -> (Twist<S>, Lane) {
        // q and −q are the same rotation.
        let flip = self.q[0].value().simd_lt(Lane::ZERO);
        let [w, axis @ ..] = self.q.each(|x| S::select(flip, -x, x));
        // 1 − cos φ = sin²φ/(1 + cos φ), without cancellation.
        let sine2 = dot(&axis, &axis);
        let y = sine2 * inverse(w + Lane::ONE);
        let e = arc_defect(y);
        let f = e * y + Lane::ONE;
        let omega = scale(axis, f + f);
        // With e = (f − 1)/y: β = (f − e)/(4 f² (1 + cos φ)).
        let beta = (f - e) * inverse((f * f) * (w + Lane::ONE) * lane(4.0));
        let once = cross(omega, self.t);
        let v = add(add(self.t, once.each(|x| x * lane(-0.5))), scale(cross(omega, once), beta));
        let angle = lane(2.0) * sine2.value().sqrt().atan2(w.value());
        ([omega, v], angle)
    }
}

#[inline(always)]
fn inverse<S: Scalar>(x: S) -> S {
    let i = Lane::ONE / x.value();
    let square = i * i;
    x.compose([i, -square, lane(2.0) * square * i])
}

/// `[(ω, v), (ω', v')] = (ω × ω', ω × v' + v × ω')`
#[inline(always)]
pub fn bracket<S: Scalar>(a: Twist<S>, b: Twist<S>) -> Twist<S> {
    [cross(a[0], b[0]), add(cross(a[0], b[1]), cross(a[1], b[0]))]
}
