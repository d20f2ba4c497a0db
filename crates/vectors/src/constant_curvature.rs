//! Sphere, flat and hyperbolic space are one formula with κ = 1, 0, −1.
//!
//! Sphere and hyperboloid are {x : ⟨x,x⟩ = κ} for ⟨x,y⟩ = κ x₀y₀ + Σ xᵢyᵢ, and in both
//! ⟨p,q⟩ = κ cos θ with cos θ read as cosh d at κ = −1. At κ = 0 they become the flat formulas,
//! which `euclidean.rs` spells out.

use symspline_core::scalar::{Lane, Scalar, dot, lane};
use symspline_core::special::{Trig, slerp, theta_over_sin};

/// κ as a lane.
const fn kappa<const K: i32>() -> Lane {
    lane(K as f64)
}

/// ⟨a, b⟩, Minkowski's for κ = −1.
#[inline(always)]
pub fn product<const K: i32, S: Scalar>(a: &[S], b: &[S]) -> S {
    let rest = dot(&a[1..], &b[1..]);
    if K < 0 { (-a[0]).fma(b[0], rest) } else { a[0].fma(b[0], rest) }
}

/// y = 1 − cos θ = κ ⟨q−p, q−p⟩/2: no cancellation for near points.
#[inline(always)]
fn versine<const K: i32, S: Scalar>(p: &[S], q: &[S]) -> S {
    let d = q[0] - p[0];
    let mut sum = if K < 0 { -(d * d) } else { d * d };
    for i in 1..p.len() {
        let d = q[i] - p[i];
        sum = d.fma(d, sum);
    }
    sum * lane(0.5 * K as f64)
}

/// 2 − y = 1 + cos θ = κ ⟨q+p, q+p⟩/2: no cancellation near the antipode.
#[inline(always)]
fn versine_rest<const K: i32, S: Scalar>(p: &[S], q: &[S]) -> Lane {
    let s = q[0].value() + p[0].value();
    let mut sum = if K < 0 { -(s * s) } else { s * s };
    for i in 1..p.len() {
        let s = q[i].value() + p[i].value();
        sum = s.mul_add(s, sum);
    }
    sum * lane(0.5 * K as f64)
}

/// cos(tθ) p + t sin(tθ)/(tθ) v.
#[inline(always)]
pub fn ray<const K: i32, S: Scalar>(p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
    let square = product::<K, _>(v, v) * kappa::<K>();
    let tv = t.value();
    let Trig { c, s, .. } = Trig::new(tv * tv * square);
    // With α = cos(tθ) and β = t sin(tθ)/(tθ): α' = −θ²β, β' = α.
    let beta = tv * s;
    let (to_p, to_v) = (-(square * beta), -(square * c));
    let (alpha, beta) = (t.compose([c, to_p, to_v]), t.compose([beta, c, to_p]));
    for i in 0..p.len() {
        out[i] = beta.fma_lane(v[i], alpha * p[i]);
    }
}

/// [p, q]_t by the slerp weights.
#[inline(always)]
pub fn geodesic<const K: i32, S: Scalar>(p: &[S], q: &[S], t: S, out: &mut [S]) {
    let [from, to] = slerp(t, versine::<K, S>(p, q), || versine_rest::<K, S>(p, q));
    for i in 0..p.len() {
        out[i] = to.fma(q[i], from * p[i]);
    }
}

/// θ from y = 1 − cos θ and 2 − y; also where sin θ = 0.
#[inline(always)]
fn angle(y: Lane, rest: Lane, f: Lane) -> Lane {
    let theta = f * (y * rest).abs().sqrt();
    // At the antipode itself f is infinite and sin θ zero.
    let antipode = rest.simd_le(Lane::ZERO) & y.simd_gt(Lane::ONE);
    antipode.select(Lane::PI, theta)
}

/// (θ/sin θ)(q − cos θ p); returns θ.
#[inline(always)]
pub fn log<const K: i32>(p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
    let (y, rest) = (versine::<K, Lane>(p, q), versine_rest::<K, Lane>(p, q));
    let f = theta_over_sin(y, || rest);
    let near = y.simd_le(Lane::ONE);
    for i in 0..p.len() {
        // Both are q − cos θ p; each is a sum of small terms on its own side.
        let v = near.select(y.mul_add(p[i], q[i] - p[i]), (q[i] + p[i]) - rest * p[i]);
        out[i] = f * v;
    }
    let theta = angle(y, rest, f);
    if K > 0 && near_antipode(rest).any() {
        refine(p, theta, near_antipode(rest), out);
    }
    theta
}

/// Where sin θ is so small that θ/sin θ makes much of rounding errors.
#[inline(always)]
fn near_antipode(rest: Lane) -> Lane {
    rest.simd_lt(lane(0.1))
}

/// Makes a logarithm near the antipode tangent again, and of length θ.
#[cold]
#[inline(never)]
fn refine(p: &[Lane], theta: Lane, lanes: Lane, v: &mut [Lane]) {
    for _ in 0..2 {
        let along = dot(p, v);
        let length2 = v.iter().zip(p).fold(Lane::ZERO, |sum, (v, p)| {
            let x = along.mul_neg_add(*p, *v);
            x.mul_add(x, sum)
        });
        // At the antipode itself there is no direction.
        let scale = length2.simd_gt(Lane::ZERO).select(theta / length2.sqrt(), Lane::ONE);
        for (v, p) in v.iter_mut().zip(p) {
            *v = lanes.select(along.mul_neg_add(*p, *v) * scale, *v);
        }
    }
}

/// E_p(v) x for any x of the ambient space.
#[inline(always)]
pub fn transvect<const K: i32>(p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
    let k = kappa::<K>();
    let theta2 = product::<K, _>(v, v) * k;
    let trig = Trig::new(theta2);
    let along_p = product::<K, _>(p, x) * k;
    let along_v = product::<K, _>(v, x);
    let to_p = theta2 * trig.k * along_p - k * trig.s * along_v;
    let to_v = trig.s * along_p + k * trig.k * along_v;
    for i in 0..p.len() {
        out[i] = to_v.mul_add(v[i], to_p.mul_add(p[i], x[i]));
    }
}

/// Removes from v its part along p; returns the coefficient of that part.
#[inline(always)]
pub fn tangential<const K: i32>(p: &[Lane], v: &mut [Lane]) -> Lane {
    let along = product::<K, Lane>(p, v) * kappa::<K>();
    for i in 0..v.len() {
        v[i] = along.mul_neg_add(p[i], v[i]);
    }
    along
}

// A frame at p is an orthonormal basis of T_pM, one row a vector.

/// The basis that a rotation (boost) from the first axis, or its opposite, carries to p.
#[inline(always)]
pub fn lift<const K: i32>(p: &[Lane], frame: &mut [Lane]) {
    let n = p.len();
    let sign = p[0].simd_lt(Lane::ZERO).select(lane(-1.0), Lane::ONE);
    // E x = x − ⟨q,x⟩ (o+q)/(κ + ⟨o,q⟩), the transvection from o to q, for x at o.
    let denominator = kappa::<K>() * (Lane::ONE + sign * p[0]);
    for (j, row) in frame.chunks_exact_mut(n).enumerate() {
        let factor = -p[j + 1] / denominator;
        for i in 0..n {
            row[i] = factor * p[i];
        }
        row[0] += factor * sign;
        row[j + 1] += Lane::ONE;
    }
}

/// Coordinates of log_p(q), and the frame carried to q.
#[inline(always)]
pub fn step<const K: i32>(frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane {
    let n = p.len();
    let (y, rest) = (versine::<K, Lane>(p, q), versine_rest::<K, Lane>(p, q));
    let f = theta_over_sin(y, || rest);
    let scale = kappa::<K>() / rest;
    let theta = angle(y, rest, f);
    let far = near_antipode(rest);
    let before = if K > 0 && far.any() { frame.to_vec() } else { Vec::new() };
    for (j, row) in frame.chunks_exact_mut(n).enumerate() {
        // ⟨e, q − p⟩ is exact for near points. The frame moves by ⟨e, q⟩, the same number for e
        // orthogonal to p, because that makes the new e orthogonal to q whatever e was.
        let d = q[0] - p[0];
        let mut along = if K < 0 { -row[0] * d } else { row[0] * d };
        let mut reach = if K < 0 { -row[0] * q[0] } else { row[0] * q[0] };
        for i in 1..n {
            along = row[i].mul_add(q[i] - p[i], along);
            reach = row[i].mul_add(q[i], reach);
        }
        chord[j] = f * along;
        let factor = reach * scale;
        for i in 0..n {
            row[i] -= factor * (p[i] + q[i]);
        }
        // One step of Newton's method for 1/|e|: an error of the norm would go into the velocity,
        // and from there eightfold into a jump of the acceleration.
        let shorten = lane(-0.5).mul_add(product::<K, Lane>(row, row), lane(1.5));
        row.iter_mut().for_each(|x| *x *= shorten);
    }
    if !before.is_empty() {
        step_far(&before, frame, p, q, theta, far, chord);
    }
    theta
}

/// The same near the antipode, by the direction of the geodesic: a basis is moved in the plane of p and the
/// direction only.
#[cold]
#[inline(never)]
fn step_far(
    before: &[Lane],
    frame: &mut [Lane],
    p: &[Lane],
    q: &[Lane],
    theta: Lane,
    lanes: Lane,
    chord: &mut [Lane],
) {
    let n = p.len();
    let mut v = vec![Lane::ZERO; n];
    log::<1>(p, q, &mut v);
    let inverse = Lane::ONE / theta;
    v.iter_mut().for_each(|v| *v *= inverse);
    let (sin, cos) = theta.sin_cos();
    for (j, (row, old)) in frame.chunks_exact_mut(n).zip(before.chunks_exact(n)).enumerate() {
        let along = dot(old, &v);
        chord[j] = lanes.select(along * theta, chord[j]);
        for i in 0..n {
            let moved = old[i] + along * ((cos - Lane::ONE) * v[i] - sin * p[i]);
            row[i] = lanes.select(moved, row[i]);
        }
    }
}

/// Gram–Schmidt against p and the rows before.
#[inline(always)]
pub fn tidy<const K: i32>(frame: &mut [Lane], p: &[Lane]) {
    let n = p.len();
    for j in 0..n - 1 {
        let (before, row) = frame.split_at_mut(j * n);
        let row = &mut row[..n];
        tangential::<K>(p, row);
        for other in before.chunks_exact(n) {
            let along = product::<K, _>(other, row);
            for i in 0..n {
                row[i] -= along * other[i];
            }
        }
        let scale = Lane::ONE / product::<K, Lane>(row, row).sqrt();
        row.iter_mut().for_each(|x| *x *= scale);
    }
}

/// Coordinates of a tangent vector in the basis.
#[inline(always)]
pub fn coordinates<const K: i32>(frame: &[Lane], v: &[Lane], x: &mut [Lane]) {
    for (x, row) in x.iter_mut().zip(frame.chunks_exact(v.len())) {
        *x = product::<K, Lane>(row, v);
    }
}

/// The tangent vector with given coordinates.
#[inline(always)]
pub fn tangent(frame: &[Lane], x: &[Lane], v: &mut [Lane]) {
    v.fill(Lane::ZERO);
    for (x, row) in x.iter().zip(frame.chunks_exact(v.len())) {
        for i in 0..v.len() {
            v[i] = x.mul_add(row[i], v[i]);
        }
    }
}

// At the origin o = (1, 0), a point is (cos θ, sin θ · unit vector).

/// What the transvection along a chord needs: sin θ/θ and κ(cos θ − 1)/θ², and |d|².
pub const CHORD_LEN: usize = 3;

/// Computes those for a chord.
#[inline(always)]
pub fn prepare<const K: i32>(chord: &[Lane], prepared: &mut [Lane]) {
    let square = dot(chord, chord);
    let trig = Trig::new(square * kappa::<K>());
    prepared.copy_from_slice(&[trig.s, trig.k * kappa::<K>(), square]);
}

/// w⁺ and w⁻ of a segment: combinations of d, a, b whose coefficients depend on inner products only. With `PAIRS`
/// x and −x are one point, and the nearer one is meant.
#[inline(always)]
pub fn legs<const K: i32, const PAIRS: bool, S: Scalar>(
    d: &[Lane],
    prepared: &[Lane],
    a: &[S],
    b: &[S],
    w_plus: &mut [S],
    w_minus: &mut [S],
) {
    let zero = S::constant(Lane::ZERO);
    let (mut aa, mut bb, mut ab, mut ad, mut bd) = (zero, zero, zero, zero, zero);
    for i in 0..d.len() {
        aa = a[i].fma(a[i], aa);
        bb = b[i].fma(b[i], bb);
        ab = a[i].fma(b[i], ab);
        ad = a[i].fma_lane(d[i], ad);
        bd = b[i].fma_lane(d[i], bd);
    }
    let (ta, tb) = (Trig::new(aa * kappa::<K>()), Trig::new(bb * kappa::<K>()));
    let &[sd, kd, dd] = prepared else { unreachable!("prepared has CHORD_LEN numbers") };
    // cos θ_d = 1 + κ (cos θ_d − 1)/θ_d² · |d|²
    let chord = [sd, kd, kd.mul_add(dd, Lane::ONE)];
    let (plus, height) = leg::<K, S>(chord, ta, tb, ab, ad, bd);
    // M⁻¹ = E(b) E(−d) E(a) is M with d, a, b replaced by −d, −b, −a.
    let (minus, _) = leg::<K, S>(chord, tb, ta, ab, bd, ad);
    let away = if PAIRS { height.value().simd_lt(Lane::ZERO) } else { Lane::ZERO };
    let height = if PAIRS { S::select(away, -height, height) } else { height };
    let f = theta_over_sin(-height + Lane::ONE, || height.value() + Lane::ONE);
    let f = if PAIRS { S::select(away, -f, f) } else { f };
    let (plus, minus) = (plus.map(|x| f * x), minus.map(|x| -(f * x)));
    for i in 0..d.len() {
        w_plus[i] = plus[0].fma_lane(d[i], plus[1].fma(a[i], plus[2] * b[i]));
        w_minus[i] = minus[0].fma_lane(d[i], minus[1].fma(b[i], minus[2] * a[i]));
    }
}

/// The point E(−a) E(d) E(−b)·o: its coefficients of d, a, b and its height cos θ.
#[inline(always)]
fn leg<const K: i32, S: Scalar>(
    [sd, kd, cd]: [Lane; 3],
    ta: Trig<S>,
    tb: Trig<S>,
    ab: S,
    ad: S,
    bd: S,
) -> ([S; 3], S) {
    let k = kappa::<K>();
    // E(v) takes (h, x) to (h cos θ − κ s⟨v,x⟩, x + (s h + κk⟨v,x⟩) v).
    let (to_b, height) = (-tb.s, tb.c);
    let along = to_b * bd;
    let (to_d, height) = (height * sd + along * kd, height * cd - along * (sd * k));
    let along = to_d.fma(ad, to_b * ab);
    let (to_a, height) = (ta.k * along * k - ta.s * height, ta.c * height + ta.s * along * k);
    ([to_d, to_a, to_b], height)
}

/// S(v) x: x shrinks by sin θ/θ across v and stays along it.
#[inline(always)]
pub fn stretch<const K: i32, S: Scalar>(v: &[S], x: &mut [S]) {
    let vv = dot(v, v);
    let vx = dot(v, x);
    let j = Trig::new(vv * kappa::<K>()).j * kappa::<K>();
    let (to_x, to_v) = (-(j * vv) + Lane::ONE, j * vx);
    for i in 0..v.len() {
        x[i] = to_v.fma(v[i], to_x * x[i]);
    }
}

/// `[a, [b, c]] = κ (⟨a,c⟩ b − ⟨a,b⟩ c)`.
#[inline(always)]
pub fn triple<const K: i32, S: Scalar>(a: &[S], b: &[S], c: &[S], out: &mut [S]) {
    let (ab, ac) = (dot(a, b) * kappa::<K>(), dot(a, c) * kappa::<K>());
    for i in 0..a.len() {
        out[i] = ac.fma(b[i], -(ab * c[i]));
    }
}
