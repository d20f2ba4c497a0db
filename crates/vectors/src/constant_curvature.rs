//! Spheres, flat and hyperbolic space in one formula with κ = 1, 0, −1.
//!
//! Sphere and hyperboloid are {x : ⟨x,x⟩ = κ} for ⟨x,y⟩ = κ x₀y₀ + Σ xᵢyᵢ, and in both
//! ⟨p,q⟩ = κ cos θ with cos θ read as cosh d at κ = −1. At κ = 0 they become the flat formulas,
//! which `euclidean.rs` spells out.
//!
//! With one more negative square, ⟨x,y⟩ = −x₀y₀ + κ x₁y₁ + Σ xᵢyᵢ, {x : ⟨x,x⟩ = κ} is de Sitter space for κ = 1 and
//! anti-de Sitter space for κ = −1 (O'Neill, Semi-Riemannian Geometry, 1983, chapter 4). The origin is then the second
//! axis, the inner product of coordinates is −x₀y₀ + Σ xᵢyᵢ, and the formulas are the same. The parameter `L` selects
//! them; without it nothing is added to the loops of the sphere and of hyperbolic space.

use symspline_core::scalar::{Lane, Scalar, dot, lane};
use symspline_core::special::{Trig, Weights, slerp, theta_over_sin};

/// κ as a lane.
const fn kappa<const K: i32>() -> Lane {
    lane(K as f64)
}

/// Whether the square of the i-th number of a point is negative in ⟨x,x⟩.
const fn negative<const K: i32, const L: bool>(i: usize) -> bool {
    if L { i == 0 || (K < 0 && i == 1) } else { K < 0 && i == 0 }
}

/// How many numbers at the start of a point may have negative squares.
const fn heads<const L: bool>() -> usize {
    if L { 2 } else { 1 }
}

/// ⟨a, b⟩, Minkowski's for κ = −1.
#[inline(always)]
pub fn product<const K: i32, const L: bool, S: Scalar>(a: &[S], b: &[S]) -> S {
    let mut sum = dot(&a[heads::<L>()..], &b[heads::<L>()..]);
    for i in (0..heads::<L>()).rev() {
        sum = if negative::<K, L>(i) { (-a[i]).fma(b[i], sum) } else { a[i].fma(b[i], sum) };
    }
    sum
}

/// The inner product of coordinates.
#[inline(always)]
pub fn at_origin<const L: bool, S: Scalar>(x: &[S], y: &[S]) -> S {
    if L { (-x[0]).fma(y[0], dot(&x[1..], &y[1..])) } else { dot(x, y) }
}

/// ⟨e, e⟩ of the i-th vector of a frame.
const fn sign<const L: bool>(i: usize) -> f64 {
    if L && i == 0 { -1.0 } else { 1.0 }
}

/// The index of the i-th coordinate at the origin in a point.
const fn position<const L: bool>(i: usize) -> usize {
    if L && i == 0 { 0 } else { i + 1 }
}

/// y = 1 − cos θ = κ ⟨q−p, q−p⟩/2: no cancellation for near points.
#[inline(always)]
fn versine<const K: i32, const L: bool, S: Scalar>(p: &[S], q: &[S]) -> S {
    // Half the squares of d = q − p and, with each product of derivatives once, its derivatives ⟨d,d'⟩ and
    // ⟨d,d''⟩ + ⟨d',d'⟩.
    let [mut value, mut first, mut second] = [Lane::ZERO; 3];
    for i in 0..p.len() {
        let [d, d1, d2] = (q[i] - p[i]).parts();
        let (e, e1) = if negative::<K, L>(i) { (-d, -d1) } else { (d, d1) };
        value = e.mul_add(d, value);
        first = e.mul_add(d1, first);
        second = e.mul_add(d2, e1.mul_add(d1, second));
    }
    let k = kappa::<K>();
    S::from_parts([value * lane(0.5 * K as f64), first * k, second * k])
}

/// 2 − y = 1 + cos θ = κ ⟨q+p, q+p⟩/2: no cancellation near the antipode.
#[inline(always)]
fn versine_rest<const K: i32, const L: bool, S: Scalar>(p: &[S], q: &[S]) -> Lane {
    let s = q[0].value() + p[0].value();
    let mut sum = if negative::<K, L>(0) { -(s * s) } else { s * s };
    for i in 1..p.len() {
        let s = q[i].value() + p[i].value();
        sum = if negative::<K, L>(i) { s.mul_neg_add(s, sum) } else { s.mul_add(s, sum) };
    }
    sum * lane(0.5 * K as f64)
}

/// cos(tθ) p + t sin(tθ)/(tθ) v.
#[inline(always)]
pub fn ray<const K: i32, const L: bool, S: Scalar>(p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
    let square = product::<K, L, _>(v, v) * kappa::<K>();
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
pub fn geodesic<const K: i32, const L: bool, S: Scalar>(p: &[S], q: &[S], t: S, out: &mut [S]) {
    let [from, to] = slerp(t, versine::<K, L, S>(p, q), || versine_rest::<K, L, S>(p, q));
    for i in 0..p.len() {
        out[i] = to.fma(q[i], from * p[i]);
    }
}

/// Vectors that represent cotangent vectors by ⟨λ, ·⟩, from gradients with respect to arrays.
#[inline(always)]
pub fn raise<const K: i32, const L: bool>(gradient: &mut [Lane]) {
    for i in 0..heads::<L>() {
        if negative::<K, L>(i) {
            gradient[i] = -gradient[i];
        }
    }
}

/// The derivative of [p, q]_t for changes δp, δq and δt: with the weights f₀, f₁ as functions of y = κ⟨q−p, q−p⟩/2,
/// f₀δp + f₁δq + (p ∂f₀/∂y + q ∂f₁/∂y) κ⟨q−p, δq−δp⟩ + (p ∂f₀/∂t + q ∂f₁/∂t) δt.
#[inline(always)]
pub fn push<const K: i32, const L: bool, S: Scalar>(
    [p, q]: [&[S]; 2],
    t: S,
    [dp, dq]: [&[S]; 2],
    dt: S,
    out: &mut [S],
) {
    let weights = Weights::new(t, versine::<K, L, S>(p, q), || versine_rest::<K, L, S>(p, q));
    let mut dy = S::constant(Lane::ZERO);
    for i in 0..p.len() {
        let product = (q[i] - p[i]) * (dq[i] - dp[i]);
        dy = if negative::<K, L>(i) { dy - product } else { dy + product };
    }
    let dy = dy * kappa::<K>();
    let [by_p, by_q] = [0, 1].map(|k| weights.by_y[k].fma(dy, weights.by_t[k] * dt));
    for i in 0..p.len() {
        let moved = weights.at[0].fma(dp[i], weights.at[1] * dq[i]);
        out[i] = by_p.fma(p[i], by_q.fma(q[i], moved));
    }
}

/// The derivative of [p, q]_t, transposed: with the weights f₀, f₁ as functions of y = κ⟨q−p, q−p⟩/2 and
/// s = κ(⟨λ,p⟩ ∂f₀/∂y + ⟨λ,q⟩ ∂f₁/∂y), λ ↦ f₀λ − s(q−p) at p and f₁λ + s(q−p) at q. This is exact in the ambient space.
#[inline(always)]
pub fn pull_back<const K: i32, const L: bool, S: Scalar>(
    p: &[S],
    q: &[S],
    t: S,
    cotangent: &[S],
    to_p: &mut [S],
    to_q: &mut [S],
) -> S {
    let weights = Weights::new(t, versine::<K, L, S>(p, q), || versine_rest::<K, L, S>(p, q));
    let at_p = product::<K, L, S>(cotangent, p);
    let at_q = product::<K, L, S>(cotangent, q);
    let slope = at_p.fma(weights.by_y[0], at_q * weights.by_y[1]) * kappa::<K>();
    for i in 0..p.len() {
        let along = slope * (q[i] - p[i]);
        to_p[i] = weights.at[0].fma(cotangent[i], to_p[i] - along);
        to_q[i] = weights.at[1].fma(cotangent[i], to_q[i] + along);
    }
    at_p.fma(weights.by_t[0], at_q * weights.by_t[1])
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
pub fn log<const K: i32, const L: bool>(p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
    let (y, rest) = (versine::<K, L, Lane>(p, q), versine_rest::<K, L, Lane>(p, q));
    let f = theta_over_sin(y, || rest);
    let near = y.simd_le(Lane::ONE);
    for i in 0..p.len() {
        // Both are q − cos θ p; each is a sum of small terms on its own side.
        let v = near.select(y.mul_add(p[i], q[i] - p[i]), (q[i] + p[i]) - rest * p[i]);
        out[i] = f * v;
    }
    let theta = angle(y, rest, f);
    if (K > 0 || L) && near_antipode(rest).any() {
        refine::<K, L>(p, theta, near_antipode(rest), out);
    }
    deciding::<L>(y, theta)
}

/// The deciding angle: a geodesic of an indefinite metric along which y is negative meets no cut locus.
#[inline(always)]
fn deciding<const L: bool>(y: Lane, theta: Lane) -> Lane {
    if L { y.simd_lt(Lane::ZERO).select(Lane::ZERO, theta) } else { theta }
}

/// κ⟨a, b⟩ where κ is 1 or the metric indefinite.
#[inline(always)]
fn round<const K: i32, const L: bool>(a: &[Lane], b: &[Lane]) -> Lane {
    if L { product::<K, L, Lane>(a, b) * kappa::<K>() } else { dot(a, b) }
}

/// The limit of sin θ below which θ/sin θ amplifies rounding errors.
#[inline(always)]
fn near_antipode(rest: Lane) -> Lane {
    rest.simd_lt(lane(0.1))
}

/// Makes a logarithm near the antipode tangent, and of length θ.
#[cold]
#[inline(never)]
fn refine<const K: i32, const L: bool>(p: &[Lane], theta: Lane, lanes: Lane, v: &mut [Lane]) {
    for _ in 0..2 {
        let along = round::<K, L>(p, v);
        let length2 = if L {
            round::<K, L>(v, v) - along * along
        } else {
            v.iter().zip(p).fold(Lane::ZERO, |sum, (v, p)| {
                let x = along.mul_neg_add(*p, *v);
                x.mul_add(x, sum)
            })
        };
        // At the antipode itself there is no direction.
        let scale = length2.simd_gt(Lane::ZERO).select(theta / length2.sqrt(), Lane::ONE);
        for (v, p) in v.iter_mut().zip(p) {
            *v = lanes.select(along.mul_neg_add(*p, *v) * scale, *v);
        }
    }
}

/// E_p(v) x for any x of the ambient space.
#[inline(always)]
pub fn transvect<const K: i32, const L: bool>(p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
    let k = kappa::<K>();
    let theta2 = product::<K, L, _>(v, v) * k;
    let trig = Trig::new(theta2);
    let along_p = product::<K, L, _>(p, x) * k;
    let along_v = product::<K, L, _>(v, x);
    let to_p = theta2 * trig.k * along_p - k * trig.s * along_v;
    let to_v = trig.s * along_p + k * trig.k * along_v;
    for i in 0..p.len() {
        out[i] = to_v.mul_add(v[i], to_p.mul_add(p[i], x[i]));
    }
}

/// Removes the component of v along p; returns the coefficient of that component.
#[inline(always)]
pub fn tangential<const K: i32, const L: bool>(p: &[Lane], v: &mut [Lane]) -> Lane {
    let along = product::<K, L, Lane>(p, v) * kappa::<K>();
    for i in 0..v.len() {
        v[i] = along.mul_neg_add(p[i], v[i]);
    }
    along
}

// A frame at p is an orthonormal basis of T_pM, one vector per row.

/// The basis that a rotation (boost) from the first axis, or its opposite, maps to p.
#[inline(always)]
pub fn lift<const K: i32, const L: bool>(p: &[Lane], frame: &mut [Lane]) {
    let n = p.len();
    let o = usize::from(L);
    let side = p[o].simd_lt(Lane::ZERO).select(lane(-1.0), Lane::ONE);
    // E x = x − ⟨q,x⟩ (o+q)/(κ + ⟨o,q⟩), the transvection from o to q, for x at o.
    let denominator = kappa::<K>() * (Lane::ONE + side * p[o]);
    for (j, row) in frame.chunks_exact_mut(n).enumerate() {
        let axis = position::<L>(j);
        let factor = if negative::<K, L>(axis) { p[axis] } else { -p[axis] } / denominator;
        for i in 0..n {
            row[i] = factor * p[i];
        }
        row[o] += factor * side;
        row[axis] += Lane::ONE;
    }
}

/// Coordinates of log_p(q), and the frame transported to q.
#[inline(always)]
pub fn step<const K: i32, const L: bool>(
    frame: &mut [Lane],
    p: &[Lane],
    q: &[Lane],
    chord: &mut [Lane],
) -> Lane {
    let n = p.len();
    let (y, rest) = (versine::<K, L, Lane>(p, q), versine_rest::<K, L, Lane>(p, q));
    let f = theta_over_sin(y, || rest);
    let scale = kappa::<K>() / rest;
    let theta = angle(y, rest, f);
    let far = near_antipode(rest);
    let before = if (K > 0 || L) && far.any() { frame.to_vec() } else { Vec::new() };
    for (j, row) in frame.chunks_exact_mut(n).enumerate() {
        // ⟨e, q − p⟩ is exact for near points. The frame moves by ⟨e, q⟩, the same number for e
        // orthogonal to p, because that makes the new e orthogonal to q whatever e was.
        let d = q[0] - p[0];
        let mut along = if negative::<K, L>(0) { -row[0] * d } else { row[0] * d };
        let mut reach = if negative::<K, L>(0) { -row[0] * q[0] } else { row[0] * q[0] };
        for i in 1..n {
            let e = if negative::<K, L>(i) { -row[i] } else { row[i] };
            along = e.mul_add(q[i] - p[i], along);
            reach = e.mul_add(q[i], reach);
        }
        chord[j] = if sign::<L>(j) < 0.0 { -f * along } else { f * along };
        let factor = reach * scale;
        for i in 0..n {
            row[i] -= factor * (p[i] + q[i]);
        }
        // One step of Newton's method for 1/|e|: an error of the norm would enter the velocity, and be amplified
        // eightfold in the jump of the acceleration.
        let shorten = lane(-0.5 * sign::<L>(j)).mul_add(product::<K, L, Lane>(row, row), lane(1.5));
        row.iter_mut().for_each(|x| *x *= shorten);
    }
    if !before.is_empty() {
        step_far::<K, L>(&before, frame, p, q, theta, far, chord);
    }
    deciding::<L>(y, theta)
}

/// The same near the antipode, by the direction of the geodesic: a basis is moved in the plane of p and the
/// direction only.
#[cold]
#[inline(never)]
fn step_far<const K: i32, const L: bool>(
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
    log::<K, L>(p, q, &mut v);
    let inverse = Lane::ONE / theta;
    v.iter_mut().for_each(|v| *v *= inverse);
    let (sin, cos) = theta.sin_cos();
    for (j, (row, old)) in frame.chunks_exact_mut(n).zip(before.chunks_exact(n)).enumerate() {
        let along = round::<K, L>(old, &v);
        let factor = if L { lane(sign::<L>(j)) * kappa::<K>() } else { Lane::ONE };
        chord[j] = lanes.select(along * theta * factor, chord[j]);
        for i in 0..n {
            let moved = old[i] + along * ((cos - Lane::ONE) * v[i] - sin * p[i]);
            row[i] = lanes.select(moved, row[i]);
        }
    }
}

/// Gram–Schmidt against p and the rows before.
#[inline(always)]
pub fn reorthonormalize<const K: i32, const L: bool>(frame: &mut [Lane], p: &[Lane]) {
    let n = p.len();
    for j in 0..n - 1 {
        let (before, row) = frame.split_at_mut(j * n);
        let row = &mut row[..n];
        tangential::<K, L>(p, row);
        for (k, other) in before.chunks_exact(n).enumerate() {
            let along = product::<K, L, _>(other, row) * lane(sign::<L>(k));
            for i in 0..n {
                row[i] -= along * other[i];
            }
        }
        let scale = Lane::ONE / (product::<K, L, Lane>(row, row) * lane(sign::<L>(j))).sqrt();
        row.iter_mut().for_each(|x| *x *= scale);
    }
}

/// Coordinates of a tangent vector in the basis.
#[inline(always)]
pub fn coordinates<const K: i32, const L: bool>(frame: &[Lane], v: &[Lane], x: &mut [Lane]) {
    for (j, (x, row)) in x.iter_mut().zip(frame.chunks_exact(v.len())).enumerate() {
        let along = product::<K, L, Lane>(row, v);
        *x = if sign::<L>(j) < 0.0 { -along } else { along };
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

// At the origin, o = (1, 0) or with `L` (0, 1, 0), a point is (cos θ, sin θ · unit vector).

/// What the transvection along a chord needs: sin θ/θ and κ(cos θ − 1)/θ², and |d|².
pub const CHORD_LEN: usize = 3;

/// Computes those for a chord.
#[inline(always)]
pub fn prepare<const K: i32, const L: bool>(chord: &[Lane], prepared: &mut [Lane]) {
    let square = at_origin::<L, _>(chord, chord);
    let trig = Trig::new(square * kappa::<K>());
    prepared.copy_from_slice(&[trig.s, trig.k * kappa::<K>(), square]);
}

/// w⁺ and w⁻ of a segment: combinations of d, a, b whose coefficients depend on inner products only.
#[inline(always)]
pub fn inner_handles<const K: i32, const L: bool, S: Scalar>(
    d: &[Lane],
    prepared: &[Lane],
    a: &[S],
    b: &[S],
    w_plus: &mut [S],
    w_minus: &mut [S],
) {
    Handles::new::<K, L>(d, prepared, a, b).write(d, a, b, w_plus, w_minus);
}

/// The points E(−a) E(d) E(−b)·o and E(b) E(−d) E(a)·o as combinations of d, a, b, and their height cos θ.
pub struct Handles<S> {
    plus: [S; 3],
    minus: [S; 3],
    height: S,
    opposite: Option<Lane>,
}

impl<S: Scalar> Handles<S> {
    /// See [`inner_handles`].
    #[inline(always)]
    pub fn new<const K: i32, const L: bool>(d: &[Lane], prepared: &[Lane], a: &[S], b: &[S]) -> Self {
        let zero = S::constant(Lane::ZERO);
        let (mut aa, mut bb, mut ab, mut ad, mut bd) = (zero, zero, zero, zero, zero);
        for i in 0..d.len() {
            let (ai, bi) = if sign::<L>(i) < 0.0 { (-a[i], -b[i]) } else { (a[i], b[i]) };
            aa = ai.fma(a[i], aa);
            bb = bi.fma(b[i], bb);
            ab = ai.fma(b[i], ab);
            ad = ai.fma_lane(d[i], ad);
            bd = bi.fma_lane(d[i], bd);
        }
        let (ta, tb) = (Trig::new(aa * kappa::<K>()), Trig::new(bb * kappa::<K>()));
        let &[sd, kd, dd] = prepared else { unreachable!("prepared has CHORD_LEN numbers") };
        // cos θ_d = 1 + κ (cos θ_d − 1)/θ_d² · |d|²
        let chord = [sd, kd, kd.mul_add(dd, Lane::ONE)];
        let (plus, height) = handle::<K, S>(chord, ta, tb, ab, ad, bd);
        // M⁻¹ = E(b) E(−d) E(a) is M with d, a, b replaced by −d, −b, −a.
        let (minus, _) = handle::<K, S>(chord, tb, ta, ab, bd, ad);
        Handles { plus, minus, height, opposite: None }
    }

    /// cos θ
    #[inline(always)]
    pub fn height(&self) -> Lane {
        self.height.value()
    }

    /// The opposite points on the lanes of a mask: where x and −x represent the same point, and the other is nearer.
    #[inline(always)]
    pub fn opposite(self, lanes: Lane) -> Self {
        Handles { opposite: Some(lanes), height: S::select(lanes, -self.height, self.height), ..self }
    }

    /// Writes the logarithms.
    #[inline(always)]
    pub fn write(self, d: &[Lane], a: &[S], b: &[S], w_plus: &mut [S], w_minus: &mut [S]) {
        let Handles { plus, minus, height, opposite } = self;
        let f = theta_over_sin(-height + Lane::ONE, || height.value() + Lane::ONE);
        let f = opposite.map_or(f, |lanes| S::select(lanes, -f, f));
        let (plus, minus) = (plus.map(|x| f * x), minus.map(|x| -(f * x)));
        for i in 0..d.len() {
            w_plus[i] = plus[0].fma_lane(d[i], plus[1].fma(a[i], plus[2] * b[i]));
            w_minus[i] = minus[0].fma_lane(d[i], minus[1].fma(b[i], minus[2] * a[i]));
        }
    }
}

/// The point E(−a) E(d) E(−b)·o: its coefficients of d, a, b and its height cos θ.
#[inline(always)]
fn handle<const K: i32, S: Scalar>(
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

/// S(v) x: the component of x orthogonal to v is multiplied by sin θ/θ; the component along v does not change.
#[inline(always)]
pub fn stretch<const K: i32, const L: bool, S: Scalar>(v: &[S], x: &mut [S]) {
    let vv = at_origin::<L, _>(v, v);
    let vx = at_origin::<L, _>(v, x);
    let j = Trig::new(vv * kappa::<K>()).j * kappa::<K>();
    let (to_x, to_v) = (-(j * vv) + Lane::ONE, j * vx);
    for i in 0..v.len() {
        x[i] = to_v.fma(v[i], to_x * x[i]);
    }
}

/// `[a, [b, c]] = κ (⟨a,c⟩ b − ⟨a,b⟩ c)`.
#[inline(always)]
pub fn triple<const K: i32, const L: bool, S: Scalar>(a: &[S], b: &[S], c: &[S], out: &mut [S]) {
    let (ab, ac) = (at_origin::<L, _>(a, b) * kappa::<K>(), at_origin::<L, _>(a, c) * kappa::<K>());
    for i in 0..a.len() {
        out[i] = ac.fma(b[i], -(ab * c[i]));
    }
}
