//! Lines over R, C and H: real, complex and quaternionic projective space, and complex hyperbolic space.
//!
//! A point is a matrix p with ⟨p,p⟩ = κ for ⟨p,q⟩ = κ p₀*q₀ + Σ pᵢ*qᵢ; it represents the line {pc}. κ = −1 is hyperbolic.
//! Over R and C, p is a vector (k = 1) and its products are numbers. A line of quaternions is a plane of C²ⁿ⁺² that j
//! maps to itself, p has two columns (k = 2), and its products are 2 × 2 matrices: all principal angles of two lines are
//! equal, so that each product is a number times a unitary matrix (Besse, Manifolds all of whose geodesics are closed,
//! 1978, chapter 3). In each case these products are the *factors*, which act from the right. A tangent vector at p is
//! *horizontal*, ⟨p,v⟩ = 0, and ⟨v,v⟩ = θ² for the angle θ that it covers.
//!
//! All formulas are those of the sphere and of hyperbolic space with factors for numbers; ⟨p,q⟩ = κ cos θ · u with a
//! unitary factor u, the phase of the two representatives.

use smallvec::{SmallVec, smallvec};
use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane};
use symspline_core::special::{Trig, theta_over_sin};
use symspline_vectors::constant_curvature as cc;

/// A k × k matrix.
pub type Factor<S, const C: usize> = [S; C];

/// k, the number of columns.
pub const fn columns<const E: usize, const C: usize>() -> usize {
    C / E
}

/// Numbers per entry of a matrix: two for complex numbers, four for quaternions.
const fn numbers<const E: usize, const C: usize>() -> usize {
    E / columns::<E, C>()
}

/// 1/k
const fn mean<const E: usize, const C: usize>() -> Lane {
    lane(1.0 / columns::<E, C>() as f64)
}

const fn kappa<const K: i32>() -> Lane {
    lane(K as f64)
}

fn zero<S: Scalar, const C: usize>() -> Factor<S, C> {
    [S::constant(Lane::ZERO); C]
}

/// A number times the identity.
fn number<S: Scalar, const E: usize, const C: usize>(x: S) -> Factor<S, C> {
    few(|i| if i % (E + numbers::<E, C>()) == 0 { x } else { S::constant(Lane::ZERO) })
}

/// x y + z, for quaternions.
#[inline(always)]
fn quaternion<S: Scalar>([a, b, c, d]: [S; 4], y: [S; 4], z: [S; 4]) -> [S; 4] {
    let add = |sum: S, [s, t, u, v]: [S; 4]| d.fma(v, c.fma(u, b.fma(t, a.fma(s, sum))));
    [
        add(z[0], [y[0], -y[1], -y[2], -y[3]]),
        add(z[1], [y[1], y[0], y[3], -y[2]]),
        add(z[2], [y[2], -y[3], y[0], y[1]]),
        add(z[3], [y[3], y[2], -y[1], y[0]]),
    ]
}

/// Adds x*y to a sum, for one row of each.
#[inline(always)]
fn add_product<S: Scalar, const E: usize, const C: usize>(x: &[S], y: &[S], sum: &mut Factor<S, C>) {
    if E == 1 {
        sum[0] = x[0].fma(y[0], sum[0]);
        return;
    }
    if numbers::<E, C>() == 4 {
        let found = quaternion([x[0], -x[1], -x[2], -x[3]], few(|i| y[i]), few(|i| sum[i]));
        *sum = few(|i| found[i]);
        return;
    }
    for i in (0..E).step_by(2) {
        for j in (0..E).step_by(2) {
            let at = i / 2 * E + j;
            sum[at] = x[i + 1].fma(y[j + 1], x[i].fma(y[j], sum[at]));
            sum[at + 1] = (-x[i + 1]).fma(y[j], x[i].fma(y[j + 1], sum[at + 1]));
        }
    }
}

/// x f, for one row x.
#[inline(always)]
fn times_row<S: Scalar, const E: usize, const C: usize>(
    x: &[S],
    f: &Factor<S, C>,
    mut sum: [S; E],
) -> [S; E] {
    if E == 1 {
        sum[0] = x[0].fma(f[0], sum[0]);
        return sum;
    }
    if numbers::<E, C>() == 4 {
        let found = quaternion(few(|i| x[i]), few(|i| f[i]), few(|i| sum[i]));
        return few(|i| found[i]);
    }
    for j in (0..E).step_by(2) {
        for l in (0..E).step_by(2) {
            let at = l / 2 * E + j;
            sum[j] = (-x[l + 1]).fma(f[at + 1], x[l].fma(f[at], sum[j]));
            sum[j + 1] = x[l + 1].fma(f[at], x[l].fma(f[at + 1], sum[j + 1]));
        }
    }
    sum
}

/// Σ xᵢ*yᵢ over all rows.
#[inline(always)]
fn definite<S: Scalar, const E: usize, const C: usize>(x: &[S], y: &[S]) -> Factor<S, C> {
    let mut sum = zero();
    for (x, y) in x.chunks_exact(E).zip(y.chunks_exact(E)) {
        add_product::<S, E, C>(x, y, &mut sum);
    }
    sum
}

/// ⟨x,y⟩
#[inline(always)]
pub fn product<S: Scalar, const E: usize, const C: usize, const K: i32>(x: &[S], y: &[S]) -> Factor<S, C> {
    if K > 0 {
        return definite::<S, E, C>(x, y);
    }
    let ((x0, x), (y0, y)) = (x.split_at(C), y.split_at(C));
    let (first, rest) = (definite::<S, E, C>(x0, y0), definite::<S, E, C>(x, y));
    few(|i| rest[i] - first[i])
}

/// The mean of the diagonal of ⟨x,y⟩, its real part.
#[inline(always)]
pub fn real_product<S: Scalar, const E: usize, const C: usize, const K: i32>(x: &[S], y: &[S]) -> S {
    let sum = if K > 0 {
        dot(x, y)
    } else {
        let ((x0, x), (y0, y)) = (x.split_at(C), y.split_at(C));
        dot(x, y) - dot(x0, y0)
    };
    if columns::<E, C>() == 1 { sum } else { sum * mean::<E, C>() }
}

/// x += v f
#[inline(always)]
fn add_times<S: Scalar, const E: usize, const C: usize>(x: &mut [S], v: &[S], f: &Factor<S, C>) {
    for (x, v) in x.chunks_exact_mut(E).zip(v.chunks_exact(E)) {
        x.copy_from_slice(&times_row::<S, E, C>(v, f, few(|i| x[i])));
    }
}

/// v f
#[inline(always)]
pub fn times<S: Scalar, const E: usize, const C: usize>(v: &[S], f: &Factor<S, C>, out: &mut [S]) {
    for (x, v) in out.chunks_exact_mut(E).zip(v.chunks_exact(E)) {
        x.copy_from_slice(&times_row::<S, E, C>(v, f, [S::constant(Lane::ZERO); E]));
    }
}

/// f g
#[inline(always)]
fn compose<S: Scalar, const E: usize, const C: usize>(f: &Factor<S, C>, g: &Factor<S, C>) -> Factor<S, C> {
    let mut out = zero();
    times::<S, E, C>(f, g, &mut out);
    out
}

/// f*
#[inline(always)]
pub fn adjoint<S: Scalar, const E: usize, const C: usize>(f: &Factor<S, C>) -> Factor<S, C> {
    let d = numbers::<E, C>();
    few(|at| {
        let (i, j, c) = (at / E, at % E / d, at % d);
        let x = f[j * E + i * d + c];
        if c == 0 { x } else { -x }
    })
}

#[inline(always)]
fn scaled<S: Scalar, const C: usize>(f: &Factor<S, C>, x: S) -> Factor<S, C> {
    few(|i| f[i] * x)
}

#[inline(always)]
fn sum<S: Scalar, const C: usize>(f: &Factor<S, C>, g: &Factor<S, C>) -> Factor<S, C> {
    few(|i| f[i] + g[i])
}

/// r² of a factor r u with unitary u, from its first row.
#[inline(always)]
fn square<S: Scalar, const E: usize, const C: usize>(f: &Factor<S, C>) -> S {
    dot(&f[..E], &f[..E])
}

/// u of a factor r u, and 1 for the factor 0.
fn phase<const E: usize, const C: usize>(f: &Factor<Lane, C>) -> Factor<Lane, C> {
    let size = square::<Lane, E, C>(f).sqrt();
    let (none, one) = (size.simd_eq(Lane::ZERO), number::<Lane, E, C>(Lane::ONE));
    few(|i| none.select(one[i], f[i] / size))
}

// A representative of a line of quaternions is a column of quaternions times a number e^{iψ}. Its second column is
// therefore determined by the first one and by η = e^{2iψ}: each quaternion is (u, −ηw̄; w, ηū).

/// η of a point, the sum of the determinants of its quaternions, after one step of Newton's method for |η| = 1.
#[inline(always)]
fn twist<S: Scalar>(p: &[S]) -> [Lane; 2] {
    let mut sum = [Lane::ZERO; 2];
    for p in p.as_chunks::<8>().0 {
        let [a, b, c, d, e, f, g, h] = p.each(|x| x.value());
        sum[0] += a * g - b * h - (c * e - d * f);
        sum[1] += a * h + b * g - (c * f + d * e);
    }
    let scale = lane(-0.5).mul_add(dot(&sum, &sum), lane(1.5));
    sum.each(|x| x * scale)
}

/// η z̄
#[inline(always)]
fn twisted<S: Scalar>([a, b]: [Lane; 2], [re, im]: [S; 2]) -> [S; 2] {
    [re * a + im * b, re * b - im * a]
}

/// p*q for lines of quaternions. Its second column is computed from the first one, so that it remains a number times a
/// unitary matrix where all of it is rounding errors, near the cut locus.
#[inline(always)]
fn quaternionic_product<S: Scalar, const C: usize>(p: &[S], q: &[S]) -> Factor<S, C> {
    let zero = S::constant(Lane::ZERO);
    let ([mut a, mut b], [mut c, mut d]) = ([zero; 2], [zero; 2]);
    for (p, q) in p.as_chunks::<4>().0.iter().zip(q.as_chunks::<4>().0) {
        a = p[1].fma(q[1], p[0].fma(q[0], a));
        b = (-p[1]).fma(q[0], p[0].fma(q[1], b));
        c = p[3].fma(q[1], p[2].fma(q[0], c));
        d = (-p[3]).fma(q[0], p[2].fma(q[1], d));
    }
    let ([x, y], [z, w]) = (twist(p), twist(q));
    let eta = [x * z + y * w, x * w - y * z];
    let ([e, f], [g, h]) = (twisted(eta, [c, d]), twisted(eta, [a, b]));
    let product = [a, b, -e, -f, c, d, g, h];
    few(|i| product[i])
}

/// p x + q f for lines of quaternions.
#[inline(always)]
fn quaternionic_sum<S: Scalar, const C: usize>(p: &[S], x: S, q: &[S], f: &Factor<S, C>, out: &mut [S]) {
    let eta = twist(p);
    let column = |p: &[S; 8], q: &[S; 8], i: usize| {
        let re = (-q[i + 3]).fma(f[5], q[i + 2].fma(f[4], (-q[i + 1]).fma(f[1], q[i].fma(f[0], p[i] * x))));
        let im = q[i + 3].fma(f[4], q[i + 2].fma(f[5], q[i + 1].fma(f[0], q[i].fma(f[1], p[i + 1] * x))));
        [re, im]
    };
    let rows = p.as_chunks::<8>().0.iter().zip(q.as_chunks::<8>().0);
    for ((p, q), out) in rows.zip(out.as_chunks_mut::<8>().0) {
        let (u, w) = (column(p, q, 0), column(p, q, 4));
        let (x, y) = (twisted(eta, w), twisted(eta, u));
        *out = [u[0], u[1], -x[0], -x[1], w[0], w[1], y[0], y[1]];
    }
}

/// Replaces vectors by the nearest ones of the form (u, −ηw̄; w, ηū).
#[inline(always)]
fn make_quaternionic(eta: [Lane; 2], v: &mut [Lane]) {
    for v in v.as_chunks_mut::<8>().0 {
        let ([x, y], [z, w]) = (twisted(eta, [v[6], v[7]]), twisted(eta, [v[2], v[3]]));
        let u = [v[0] + x, v[1] + y].each(|x| x * lane(0.5));
        let w = [v[4] - z, v[5] - w].each(|x| x * lane(0.5));
        let (x, y) = (twisted(eta, w), twisted(eta, u));
        *v = [u[0], u[1], -x[0], -x[1], w[0], w[1], y[0], y[1]];
    }
}

/// What two points determine.
struct Pair<S, const C: usize> {
    /// κ⟨p,q⟩ = cos θ · u
    c: Factor<S, C>,
    /// sin²θ and cos²θ
    sin2: S,
    cos2: S,
    /// θ/(sin θ cos θ)
    f: S,
}

impl<S: Scalar, const C: usize> Pair<S, C> {
    #[inline(always)]
    fn new<const E: usize, const K: i32>(p: &[S], q: &[S]) -> Self {
        let one = S::constant(Lane::ONE);
        let (c, cos2, sin2);
        if K > 0 {
            c = if E < 4 { product::<S, E, C, K>(p, q) } else { quaternionic_product::<S, C>(p, q) };
            cos2 = square::<S, E, C>(&c);
            sin2 = one - cos2;
        } else {
            // Far from the origin both ⟨p,q⟩ and its rounding errors are large. The differences of near points are
            // exact, and with them e = κ⟨p,q−p⟩ = c − 1 and sin²θ = κ⟨q−p,q−p⟩ − |e|².
            let (mut e, mut dd) = (zero(), S::constant(Lane::ZERO));
            for (i, (p, q)) in p.chunks_exact(E).zip(q.chunks_exact(E)).enumerate() {
                let d: [S; E] = few(|i| q[i] - p[i]);
                let signed = if i == 0 { d } else { d.each(|d| -d) };
                add_product::<S, E, C>(p, &signed, &mut e);
                dd = dot(&d, &signed) + dd;
            }
            c = sum(&e, &number::<S, E, C>(one));
            cos2 = square::<S, E, C>(&c);
            sin2 = dd - square::<S, E, C>(&e);
        }
        // θ/sin θ at the angle 2θ, a function of 1 − cos 2θ = 2 sin²θ.
        let f = theta_over_sin(sin2 * lane(2.0), || cos2.value() * lane(2.0));
        Pair { c, sin2, cos2, f }
    }
}

/// The angle of two points.
#[inline(always)]
fn angle<const C: usize, const K: i32>(pair: &Pair<Lane, C>, rest2: Lane) -> Lane {
    if K > 0 { rest2.sqrt().atan2(pair.cos2.sqrt()) } else { pair.f * (pair.sin2 * pair.cos2).abs().sqrt() }
}

/// The tangent vector at p that is nearest to x.
#[inline(always)]
pub fn tangential<const E: usize, const C: usize, const K: i32>(p: &[Lane], x: &mut [Lane]) {
    horizontal::<E, C, K>(p, x);
    if E == 4 {
        make_quaternionic(twist(p), x);
    }
}

/// The component of x orthogonal to p.
#[inline(always)]
fn horizontal<const E: usize, const C: usize, const K: i32>(p: &[Lane], x: &mut [Lane]) {
    let along = product::<Lane, E, C, K>(p, x);
    add_times::<Lane, E, C>(x, p, &scaled(&along, -kappa::<K>()));
}

/// cos(tθ) p + t sin(tθ)/(tθ) v.
#[inline(always)]
pub fn ray<S: Scalar, const E: usize, const C: usize, const K: i32>(
    p: &[Lane],
    v: &[Lane],
    t: S,
    out: &mut [S],
) {
    let theta2 = real_product::<Lane, E, C, K>(v, v) * kappa::<K>();
    let tv = t.value();
    let Trig { c, s, .. } = Trig::new(tv * tv * theta2);
    // With α = cos(tθ) and β = t sin(tθ)/(tθ): α' = −θ²β, β' = α.
    let beta = tv * s;
    let (to_p, to_v) = (-(theta2 * beta), -(theta2 * c));
    let (alpha, beta) = (t.compose([c, to_p, to_v]), t.compose([beta, c, to_p]));
    for i in 0..p.len() {
        out[i] = beta.fma_lane(v[i], alpha * p[i]);
    }
}

/// `log_p(q)` = (q − p c) c* θ/(sin θ cos θ); returns the angle.
#[inline(always)]
pub fn log<const E: usize, const C: usize, const K: i32>(p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane {
    let pair = Pair::<Lane, C>::new::<E, K>(p, q);
    // The difference of near representatives is exact. A second projection, because the first one leaves rounding
    // errors of the component that it removes.
    let mut rest: Vec<Lane> = q.iter().zip(p).map(|(q, p)| *q - *p).collect();
    horizontal::<E, C, K>(p, &mut rest);
    horizontal::<E, C, K>(p, &mut rest);
    times::<Lane, E, C>(&rest, &scaled(&adjoint::<Lane, E, C>(&pair.c), pair.f), out);
    if E == 4 {
        make_quaternionic(twist(p), out);
    }
    angle::<C, K>(&pair, dot(&rest, &rest) * mean::<E, C>())
}

/// `[p, q]_t` = cos(tθ) p + t sin(tθ)/(tθ) `log_p(q)`.
#[inline(always)]
pub fn geodesic<S: Scalar, const E: usize, const C: usize, const K: i32>(
    p: &[S],
    q: &[S],
    t: S,
    out: &mut [S],
) {
    let Pair { c, sin2, cos2, f, .. } = Pair::<S, C>::new::<E, K>(p, q);
    // θ² κ, of either sign like sin²θ
    let theta2 = f * f * sin2 * cos2;
    let Trig { c: cos, s, .. } = Trig::new(t * t * theta2);
    let to_q = f * t * s;
    let (to_p, to_q) = (cos - to_q * cos2, scaled(&adjoint::<S, E, C>(&c), to_q));
    if E == 4 {
        return quaternionic_sum(p, to_p, q, &to_q, out);
    }
    for ((out, p), q) in out.chunks_exact_mut(E).zip(p.chunks_exact(E)).zip(q.chunks_exact(E)) {
        out.copy_from_slice(&times_row::<S, E, C>(q, &to_q, few(|i| p[i] * to_p)));
    }
}

/// The derivative of `[p, q]_t`, transposed, over R and C: that of the sphere between p and q' = q ū, for ⟨p,q⟩ = cos θ · u,
/// whose phase moves by δφ cos θ = ⟨ip, δq ū⟩ − ⟨iq', δp⟩.
#[inline(always)]
pub fn pull_back<const E: usize, const C: usize>(
    p: &[Lane],
    q: &[Lane],
    t: Lane,
    cotangent: &[Lane],
    to_p: &mut [Lane],
    to_q: &mut [Lane],
) -> Lane {
    let c = product::<Lane, E, C, 1>(p, q);
    let u = phase::<E, C>(&c);
    let zeros = |len: usize| -> SmallVec<[Lane; 12]> { smallvec![Lane::ZERO; len] };
    let (mut aligned, mut by_q) = (zeros(q.len()), zeros(q.len()));
    times::<Lane, E, C>(q, &adjoint::<Lane, E, C>(&u), &mut aligned);
    let rate = cc::pull_back::<1, false, Lane>(p, &aligned, t, cotangent, to_p, &mut by_q);
    if E == 2 {
        let turned = |[a, b]: [Lane; 2]| [-b, a];
        let along = |x: &[Lane], y: &[Lane]| {
            let rows = x.as_chunks::<2>().0.iter().zip(y.as_chunks::<2>().0);
            rows.fold(Lane::ZERO, |sum, (x, y)| sum + dot(x, &turned(*y)))
        };
        let factor = along(&by_q, &aligned) / square::<Lane, E, C>(&c).sqrt();
        for (k, (p, q)) in p.as_chunks::<2>().0.iter().zip(aligned.as_chunks::<2>().0).enumerate() {
            let (p, q) = (turned(*p), turned(*q));
            for i in 0..2 {
                by_q[2 * k + i] -= factor * p[i];
                to_p[2 * k + i] += factor * q[i];
            }
        }
    }
    add_times::<Lane, E, C>(to_q, &by_q, &u);
    rate
}

/// Adds a multiple of (vx* − xv*)p.
pub fn add_momentum<const E: usize, const C: usize>(
    p: &[Lane],
    x: &[Lane],
    v: &[Lane],
    factor: Lane,
    out: &mut [Lane],
) {
    add_times::<Lane, E, C>(out, v, &scaled(&product::<Lane, E, C, 1>(x, p), factor));
    add_times::<Lane, E, C>(out, x, &scaled(&product::<Lane, E, C, 1>(v, p), -factor));
}

/// `E_p(v)` x.
#[inline(always)]
pub fn transvect<const E: usize, const C: usize, const K: i32>(p: &[Lane], v: &[Lane], x: &mut [Lane]) {
    let k = kappa::<K>();
    let theta2 = real_product::<Lane, E, C, K>(v, v) * k;
    let trig = Trig::new(theta2);
    let along_p = scaled(&product::<Lane, E, C, K>(p, x), k);
    let along_v = product::<Lane, E, C, K>(v, x);
    let to_p = sum(&scaled(&along_p, theta2 * trig.k), &scaled(&along_v, -k * trig.s));
    let to_v = sum(&scaled(&along_p, trig.s), &scaled(&along_v, k * trig.k));
    add_times::<Lane, E, C>(x, p, &to_p);
    add_times::<Lane, E, C>(x, v, &to_v);
}

/// Converts a tangent vector at a point p, in place, to that at another representative q.
#[inline(always)]
pub fn turn<const E: usize, const C: usize, const K: i32>(p: &[Lane], q: &[Lane], x: &mut [Lane]) {
    let phase = scaled(&product::<Lane, E, C, K>(p, q), kappa::<K>());
    let before = x.to_vec();
    times::<Lane, E, C>(&before, &phase, x);
}

/// The projection of γ'' − 2γ'⟨γ,γ'⟩κ, where γ' is the derivative of the array: for its horizontal component the
/// second term is zero.
#[inline(always)]
pub fn acceleration<const E: usize, const C: usize, const K: i32>(
    gamma: &[Lane],
    d: &[Lane],
    dd: &mut [Lane],
) {
    let turn = scaled(&product::<Lane, E, C, K>(gamma, d), lane(-2.0) * kappa::<K>());
    add_times::<Lane, E, C>(dd, d, &turn);
    horizontal::<E, C, K>(gamma, dd);
}

// A frame at p consists of the orthonormal tangent vectors e₁, …, eₙ, multiplied from the right by factors, and of the
// unitary factor w: the tangent vector with coordinates x, as factors, is Σ eᵢ xᵢ w.

/// The frame of the transvection from the first axis o to p w*, where w is the phase of p₀.
pub fn lift<const E: usize, const C: usize, const K: i32>(p: &[Lane], frame: &mut [Lane]) {
    let len = p.len();
    let (vectors, w) = frame.split_at_mut(frame.len() - C);
    let unit = phase::<E, C>(&few(|i| p[i]));
    w.copy_from_slice(&unit);
    let mut q = vec![Lane::ZERO; len];
    times::<Lane, E, C>(p, &adjoint::<Lane, E, C>(&unit), &mut q);
    let one = number::<Lane, E, C>(Lane::ONE);
    let scale = -kappa::<K>() / (Lane::ONE + real_product::<Lane, E, C, 1>(&q[..C], &one));
    for (e, own) in vectors.chunks_exact_mut(len).zip((C..).step_by(C)) {
        // e − (o + q) ⟨q,e⟩/(κ + ⟨o,q⟩)
        let along = scaled(&adjoint::<Lane, E, C>(&few(|i| q[own + i])), scale);
        times::<Lane, E, C>(&q, &along, e);
        for i in 0..C {
            e[i] += along[i];
            e[own + i] += one[i];
        }
    }
}

/// Coordinates of `log_p(q)`, as factors, and the frame transported to q; returns the angle.
#[inline(always)]
pub fn step<const E: usize, const C: usize, const K: i32>(
    frame: &mut [Lane],
    p: &[Lane],
    q: &[Lane],
    chord: &mut [Lane],
) -> Lane {
    let pair = Pair::<Lane, C>::new::<E, K>(p, q);
    let (vectors, w) = frame.split_at_mut(frame.len() - C);
    let (k, cos) = (kappa::<K>(), pair.cos2.sqrt());
    // q u* is the representative with ⟨p, q u*⟩ = κ cos θ.
    let back = scaled(&adjoint::<Lane, E, C>(&pair.c), Lane::ONE / cos);
    let before: Factor<Lane, C> = few(|i| w[i]);
    let inverse = adjoint::<Lane, E, C>(&before);
    let to_chord = compose::<Lane, E, C>(&scaled(&back, pair.f * cos), &inverse);
    let scale = -k / (Lane::ONE + cos);
    let mut middle = p.to_vec();
    add_times::<Lane, E, C>(&mut middle, q, &back);
    let mut rest2 = Lane::ZERO;
    for (e, x) in vectors.chunks_exact_mut(p.len()).zip(chord.chunks_exact_mut(C)) {
        // ⟨e, q − p⟩ is exact for near points. The frame moves by ⟨q, e⟩, the same number for e orthogonal to p,
        // because that makes the new e orthogonal to q whatever e was.
        let (mut along, mut reach) = (zero::<Lane, C>(), zero::<Lane, C>());
        for (i, ((e, p), q)) in e.chunks_exact(E).zip(p.chunks_exact(E)).zip(q.chunks_exact(E)).enumerate() {
            let e: [Lane; E] = if K < 0 && i < columns::<E, C>() { few(|i| -e[i]) } else { few(|i| e[i]) };
            let d: [Lane; E] = few(|i| q[i] - p[i]);
            add_product::<Lane, E, C>(&e, &d, &mut along);
            add_product::<Lane, E, C>(q, &e, &mut reach);
        }
        rest2 += square::<Lane, E, C>(&along);
        x.copy_from_slice(&compose::<Lane, E, C>(&along, &to_chord));
        let reach = compose::<Lane, E, C>(&adjoint::<Lane, E, C>(&back), &reach);
        add_times::<Lane, E, C>(e, &middle, &scaled(&reach, scale));
        // One step of Newton's method for 1/|e|: an error of the norm would enter the velocity, and be amplified
        // eightfold in the jump of the acceleration.
        let shorten = lane(-0.5).mul_add(real_product::<Lane, E, C, K>(e, e), lane(1.5));
        e.iter_mut().for_each(|x| *x *= shorten);
        if E == 4 {
            // With w removed, η is 1.
            make_quaternionic([Lane::ONE, Lane::ZERO], e);
        }
    }
    let mut next = compose::<Lane, E, C>(&before, &adjoint::<Lane, E, C>(&back));
    if E == 4 {
        make_quaternionic(twist(&next), &mut next);
    }
    let shorten = lane(-0.5).mul_add(square::<Lane, E, C>(&next), lane(1.5));
    w.copy_from_slice(&scaled(&next, shorten));
    angle::<C, K>(&pair, rest2)
}

/// Gram–Schmidt against p and the vectors before.
pub fn reorthonormalize<const E: usize, const C: usize, const K: i32>(frame: &mut [Lane], p: &[Lane]) {
    let len = p.len();
    for j in 0..frame.len() / len {
        let (before, e) = frame.split_at_mut(j * len);
        let e = &mut e[..len];
        horizontal::<E, C, K>(p, e);
        for other in before.chunks_exact(len) {
            let along = product::<Lane, E, C, K>(other, e);
            add_times::<Lane, E, C>(e, other, &scaled(&along, lane(-1.0)));
        }
        let scale = Lane::ONE / real_product::<Lane, E, C, K>(e, e).sqrt();
        e.iter_mut().for_each(|x| *x *= scale);
    }
}

/// Coordinates of a tangent vector, as factors.
#[inline(always)]
pub fn coordinates<const E: usize, const C: usize, const K: i32>(frame: &[Lane], v: &[Lane], x: &mut [Lane]) {
    let (vectors, w) = frame.split_at(frame.len() - C);
    let inverse = adjoint::<Lane, E, C>(&few(|i| w[i]));
    for (x, e) in x.chunks_exact_mut(C).zip(vectors.chunks_exact(v.len())) {
        x.copy_from_slice(&compose::<Lane, E, C>(&product::<Lane, E, C, K>(e, v), &inverse));
    }
}

/// The tangent vector with given coordinates.
#[inline(always)]
pub fn tangent<const E: usize, const C: usize>(frame: &[Lane], x: &[Lane], v: &mut [Lane]) {
    let (vectors, w) = frame.split_at(frame.len() - C);
    let w: Factor<Lane, C> = few(|i| w[i]);
    v.fill(Lane::ZERO);
    for (x, e) in x.chunks_exact(C).zip(vectors.chunks_exact(v.len())) {
        add_times::<Lane, E, C>(v, e, &compose::<Lane, E, C>(&few(|i| x[i]), &w));
    }
}

// At the origin a tangent vector x is the column of its coordinates, and a point (h, x). Coordinates over H are
// quaternions (E = C = 4), and their length is √2 times the angle.

/// θ²/|x|² for coordinates x.
pub const fn weight<const E: usize>() -> Lane {
    lane(if E == 4 { 0.5 } else { 1.0 })
}

/// x*y for coordinates of vectors.
#[inline(always)]
fn at_origin<S: Scalar, const E: usize>(x: &[S], y: &[S]) -> Factor<S, E> {
    weighted::<S, E>(definite::<S, E, E>(x, y))
}

/// The same with constant y.
#[inline(always)]
fn with_constant<S: Scalar, const E: usize>(x: &[S], y: &[Lane]) -> Factor<S, E> {
    let mut sum = zero();
    for (x, y) in x.chunks_exact(E).zip(y.chunks_exact(E)) {
        let y: [S; E] = few(|i| S::constant(y[i]));
        add_product::<S, E, E>(x, &y, &mut sum);
    }
    weighted::<S, E>(sum)
}

#[inline(always)]
fn weighted<S: Scalar, const E: usize>(f: Factor<S, E>) -> Factor<S, E> {
    if E == 4 { f.each(|x| x * weight::<E>()) } else { f }
}

/// w⁺ and w⁻ of a segment: combinations of d, a, b with factors that depend on their products only. `prepared` is that
/// of [`constant_curvature`](symspline_vectors::constant_curvature).
#[inline(always)]
pub fn inner_handles<S: Scalar, const E: usize, const K: i32>(
    d: &[Lane],
    prepared: &[Lane],
    a: &[S],
    b: &[S],
    w_plus: &mut [S],
    w_minus: &mut [S],
) {
    let ab = at_origin::<S, E>(a, b);
    let [ad, bd] = [a, b].each(|x| with_constant::<S, E>(x, d));
    let [ta, tb] = [a, b].each(|x| Trig::new((dot(x, x) * weight::<E>()) * kappa::<K>()));
    let &[sd, kd, dd] = prepared else { unreachable!("a chord is prepared as three numbers") };
    // cos θ_d = 1 + κ (cos θ_d − 1)/θ_d² · |d|²
    let chord = [sd, kd, kd.mul_add(dd, Lane::ONE)];
    let (plus, h) = handle::<S, E, K>(chord, ta, tb, &ab, &ad, &adjoint::<S, E, E>(&bd));
    // M⁻¹ = E(b) E(−d) E(a) is M with d, a, b replaced by −d, −b, −a.
    let (minus, g) =
        handle::<S, E, K>(chord, tb, ta, &adjoint::<S, E, E>(&ab), &bd, &adjoint::<S, E, E>(&ad));
    let cos2 = square::<S, E, E>(&h);
    let f = theta_over_sin((-cos2 + Lane::ONE) * lane(2.0), || cos2.value() * lane(2.0));
    let [plus_back, minus_back] = [(h, f), (g, -f)].each(|(h, f)| scaled(&adjoint::<S, E, E>(&h), f));
    let plus = plus.each(|x| compose::<S, E, E>(&x, &plus_back));
    let minus = minus.each(|x| compose::<S, E, E>(&x, &minus_back));
    let rows = d.chunks_exact(E).zip(a.chunks_exact(E)).zip(b.chunks_exact(E));
    for (((d, a), b), (wp, wm)) in rows.zip(w_plus.chunks_exact_mut(E).zip(w_minus.chunks_exact_mut(E))) {
        for (w, [to_d, to_first, to_last], first, last) in [(wp, &plus, a, b), (wm, &minus, b, a)] {
            let d: [S; E] = few(|i| S::constant(d[i]));
            let out = times_row::<S, E, E>(&d, to_d, [S::constant(Lane::ZERO); E]);
            let out = times_row::<S, E, E>(first, to_first, out);
            w.copy_from_slice(&times_row::<S, E, E>(last, to_last, out));
        }
    }
}

/// The point E(−a) E(d) E(−b)·o = (h, d f + a g + b l): the factors f, g, l, and h. The products are a*b, a*d and d*b.
#[inline(always)]
fn handle<S: Scalar, const E: usize, const K: i32>(
    [sd, kd, cd]: [Lane; 3],
    ta: Trig<S>,
    tb: Trig<S>,
    ab: &Factor<S, E>,
    ad: &Factor<S, E>,
    db: &Factor<S, E>,
) -> ([Factor<S, E>; 3], Factor<S, E>) {
    let k = kappa::<K>();
    // E(v) maps (h, x) to (h cos θ − κ s⟨v,x⟩, x + v(s h + κk⟨v,x⟩)).
    let (to_b, height) = (-tb.s, number::<S, E, E>(tb.c));
    let along = scaled(db, to_b);
    let to_d: Factor<S, E> = few(|i| along[i].fma_lane(kd, height[i] * sd));
    let height: Factor<S, E> = few(|i| along[i].fma_lane(-(sd * k), height[i] * cd));
    let along = sum(&compose::<S, E, E>(ad, &to_d), &scaled(ab, to_b));
    let to_a = few(|i| along[i].fma(ta.k * k, -(height[i] * ta.s)));
    let height = few(|i| along[i].fma(ta.s * k, height[i] * ta.c));
    ([to_d, to_a, number::<S, E, E>(to_b)], height)
}

/// S(v) x. The component of x along v u with real u does not change, that with imaginary u is multiplied by
/// sin 2θ/2θ, and the component orthogonal to all of these by sin θ/θ: the curvatures are 4κ and κ.
#[inline(always)]
pub fn stretch<S: Scalar, const E: usize, const K: i32>(v: &[S], x: &mut [S]) {
    let k = kappa::<K>();
    let vv = dot(v, v) * weight::<E>();
    let along = at_origin::<S, E>(v, x);
    let j = Trig::new(vv * k).j * k;
    let real = number::<S, E, E>(dot(v, x) * weight::<E>());
    let mut to_v = scaled(&along, j);
    if E > 1 {
        let twice = Trig::new(vv * (k * lane(4.0))).j * (k * lane(4.0));
        to_v = few(|i| to_v[i] - (along[i] - real[i]) * twice);
    }
    let to_x = -(j * vv) + Lane::ONE;
    for (x, v) in x.chunks_exact_mut(E).zip(v.chunks_exact(E)) {
        x.copy_from_slice(&times_row::<S, E, E>(v, &to_v, few(|i| x[i] * to_x)));
    }
}

/// `[a, [b, c]]` = κ(a (c*b − b*c) + b c*a − c b*a)
#[inline(always)]
pub fn triple<S: Scalar, const E: usize, const K: i32>(a: &[S], b: &[S], c: &[S], out: &mut [S]) {
    let k = S::constant(kappa::<K>());
    let bc = at_origin::<S, E>(b, c);
    let cb = adjoint::<S, E, E>(&bc);
    let to_a = few(|i| (cb[i] - bc[i]) * k);
    let to_b = scaled(&at_origin::<S, E>(c, a), k);
    let to_c = scaled(&at_origin::<S, E>(b, a), -k);
    times::<S, E, E>(a, &to_a, out);
    add_times::<S, E, E>(out, b, &to_b);
    add_times::<S, E, E>(out, c, &to_c);
}
