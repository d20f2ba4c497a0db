//! Functions of a squared argument.
//!
//! On every constant-curvature space, and through the eigenvalues of a Hermitian matrix on every
//! other, exponential, logarithm and transvection need cos√x, sin√x/√x and their relatives: entire
//! functions of x, whose values at x < 0 are the hyperbolic functions. Written in x (and the
//! logarithm in y = 1 − cos θ) nothing is singular at 0 and flat, spherical and hyperbolic space
//! are one formula.
//!
//! Small arguments use the Taylor series, others the library functions. The choice for a lane depends on its own
//! argument only, so that a result never depends on its neighbours.

use crate::scalar::{Lane, Scalar, few, lane};

/// Largest |x| for which [`Trig`] uses its Taylor series: 12 terms leave less than 1e-19 there.
const TRIG_SERIES: f64 = 2.5;
/// Below this |x| six terms suffice.
const TRIG_SHORT: f64 = 0.1;
/// The limits of |y| up to which [`theta_over_sin`] uses these numbers of terms of its series, and one more for every
/// derivative. Beyond the last limit, derivatives lose at most one significant digit in the quotients by sin²θ.
const ARC_TIERS: [(f64, usize); 3] = [(0.0075, 7), (0.09, 14), (0.3, 22)];

const fn factorial(n: usize) -> f64 {
    let mut product = 1.0;
    let mut i = 2;
    while i <= n {
        product *= i as f64;
        i += 1;
    }
    product
}

/// (−1)ʲ / (2j + `shift`)!
const fn alternating<const N: usize>(shift: usize) -> [f64; N] {
    let mut c = [0.0; N];
    let mut j = 0;
    while j < N {
        c[j] = if j % 2 == 0 { 1.0 } else { -1.0 } / factorial(2 * j + shift);
        j += 1;
    }
    c
}

/// sin√x/√x = Σ (−x)ʲ/(2j+1)!
pub(crate) const SINC: [f64; 12] = alternating(1);
/// (1 − cos√x)/x = Σ (−x)ʲ/(2j+2)!
pub(crate) const VERSINE: [f64; 12] = alternating(2);
/// (1 − sin√x/√x)/x = Σ (−x)ʲ/(2j+3)!
const SINC_DEFECT: [f64; 12] = alternating(3);
/// θ/sin θ = Σ yʲ Πᵢ i/(2i+1) with y = 1 − cos θ, the series of asin(z)/(z√(1−z²)) at z² = y/2.
pub(crate) const ARC: [f64; 46] = {
    let mut c = [1.0; 46];
    let mut j = 1;
    while j < 46 {
        c[j] = c[j - 1] * j as f64 / (2 * j + 1) as f64;
        j += 1;
    }
    c
};

/// A function at x with its derivatives, of which only those up to a given order are computed.
type Derivatives = [Lane; 4];

/// The polynomial `Σ cᵢ xⁱ` with its derivatives.
#[inline(always)]
fn polynomial(order: usize, c: &[f64], x: Lane) -> Derivatives {
    let (others, last) = c.split_at(c.len() - 1);
    horner(order, [lane(last[0]), Lane::ZERO, Lane::ZERO, Lane::ZERO], others, x)
}

/// `p xⁿ + Σ cᵢ xⁱ` with n coefficients, where p is a number with its derivatives.
#[inline(always)]
fn horner(order: usize, mut p: Derivatives, c: &[f64], x: Lane) -> Derivatives {
    for &coefficient in c.iter().rev() {
        if order > 2 {
            p[3] = p[3].mul_add(x, lane(3.0) * p[2]);
        }
        if order > 1 {
            p[2] = p[2].mul_add(x, p[1] + p[1]);
        }
        if order > 0 {
            p[1] = p[1].mul_add(x, p[0]);
        }
        p[0] = p[0].mul_add(x, lane(coefficient));
    }
    p
}

/// The same with the first `few` terms on the lanes of a mask, and with all terms on the others. The higher terms are
/// dropped before the lower ones are added, so that a result is bit-identical to that of a shorter polynomial.
#[inline(always)]
fn graded(order: usize, c: &[f64], few: usize, mask: Lane, x: Lane) -> Derivatives {
    let higher = polynomial(order, &c[few..], x);
    horner(order, select(order, mask, [Lane::ZERO; 4], higher), &c[..few], x)
}

#[inline(always)]
fn select(order: usize, mask: Lane, a: Derivatives, b: Derivatives) -> Derivatives {
    // Derivatives of higher order are never read.
    few(|k| if k <= order { mask.select(a[k], b[k]) } else { Lane::ZERO })
}

/// The first three, for numbers with at most two derivatives.
#[inline(always)]
pub(crate) fn two([a, b, c, _]: Derivatives) -> [Lane; 3] {
    [a, b, c]
}

/// The entire functions of x = θ² that occur in exponential and transvection.
#[derive(Clone, Copy, Debug)]
pub struct Trig<S> {
    /// cos√x
    pub c: S,
    /// sin√x / √x
    pub s: S,
    /// (cos√x − 1)/x
    pub k: S,
    /// (1 − sin√x/√x)/x
    pub j: S,
}

impl<S: Scalar> Trig<S> {
    /// All four at x, which may have either sign: at x < 0 they are cosh√−x, sinh√−x/√−x, …
    #[inline(always)]
    pub fn new(x: S) -> Self {
        let (versine, defect) = defects(S::ORDER, x.value());
        let k = -x.compose(two(versine));
        let j = x.compose(two(defect));
        Trig { c: k.fma(x, S::constant(Lane::ONE)), s: (-j).fma(x, S::constant(Lane::ONE)), k, j }
    }
}

/// (1 − cos√x)/x and (1 − sin√x/√x)/x, with derivatives in x.
#[inline(always)]
fn defects(order: usize, x: Lane) -> (Derivatives, Derivatives) {
    let n = 6 + order;
    let ax = x.abs();
    let (short, series) = (ax.simd_le(lane(TRIG_SHORT)), ax.simd_le(lane(TRIG_SERIES)));
    if short.all() {
        return (polynomial(order, &VERSINE[..n], x), polynomial(order, &SINC_DEFECT[..n], x));
    }
    let near = (graded(order, &VERSINE, n, short, x), graded(order, &SINC_DEFECT, n, short, x));
    if series.all() {
        return near;
    }
    let far = full_range(x);
    (select(order, series, near.0, far.0), select(order, series, near.1, far.1))
}

/// The same away from 0.
#[inline(never)]
fn full_range(x: Lane) -> (Derivatives, Derivatives) {
    let r = x.abs().sqrt();
    let (sin, cos) = r.sin_cos();
    let (e, positive) = (r.exp(), x.simd_gt(Lane::ZERO));
    let inverse = Lane::ONE / e;
    let half = lane(0.5);
    let c = positive.select(cos, half * (e + inverse));
    let s = positive.select(sin, half * (e - inverse)) / r;
    let (v, d) = ((Lane::ONE - c) / x, (Lane::ONE - s) / x);
    // c' = −s/2, s' = (c − s)/(2x); the quotient rule gives the rest.
    let s1 = half * (c - s) / x;
    let s2 = (-half * s - lane(3.0) * s1) * half / x;
    let s3 = (lane(-0.25) * s1 - lane(2.5) * s2) / x;
    let v1 = (half * s - v) / x;
    let v2 = (half * s1 - lane(2.0) * v1) / x;
    let v3 = (half * s2 - lane(3.0) * v2) / x;
    let d1 = (-s1 - d) / x;
    let d2 = (-s2 - lane(2.0) * d1) / x;
    let d3 = (-s3 - lane(3.0) * d2) / x;
    ([v, v1, v2, v3], [d, d1, d2, d3])
}

/// θ/sin θ as a function of y = 1 − cos θ; at y < 0 it is d/sinh d with y = 1 − cosh d.
///
/// `rest` gives 2 − y = 1 + cos θ: near the cut locus, θ = π, the caller may know it more accurately than y
/// represents it. It is called only where it matters.
#[inline(always)]
pub fn theta_over_sin<S: Scalar>(y: S, rest: impl FnOnce() -> Lane) -> S {
    y.compose(two(arc(S::ORDER, y.value(), rest)))
}

/// The same with its derivatives in y.
#[inline(always)]
fn arc(order: usize, y: Lane, rest: impl FnOnce() -> Lane) -> Derivatives {
    let ay = y.abs();
    let within: [Lane; ARC_TIERS.len()] = few(|i| ay.simd_le(lane(ARC_TIERS[i].0)));
    let terms: [usize; ARC_TIERS.len()] = few(|i| ARC_TIERS[i].1 + order);
    if within[0].all() {
        return polynomial(order, &ARC[..terms[0]], y);
    }
    let mut f = graded(order, &ARC[..terms[1]], terms[0], within[0], y);
    if !within[1].all() {
        f = select(order, within[1], f, polynomial(order, &ARC[..terms[2]], y));
        if !within[2].all() {
            f = select(order, within[2], f, arc_full_range(y, rest()));
        }
    }
    f
}

/// (θ/sin θ − 1)/y as a function of y = 1 − cos θ ≤ 1.
#[inline(always)]
pub fn arc_defect<S: Scalar>(y: S) -> S {
    let yv = y.value();
    let limits = [0.0075, 0.09, 0.3];
    let terms = [7, 14, 22];
    let order = S::ORDER;
    let series = |tier: usize| polynomial(order, &ARC[1..1 + terms[tier] + order], yv);
    let within: [Lane; 3] = few(|i| yv.abs().simd_le(lane(limits[i])));
    let top = (0..3).find(|&i| within[i].all()).unwrap_or(3);
    let mut e = if top < 3 {
        series(top)
    } else {
        let [f, f1, f2, _] = arc_full_range(yv, lane(2.0) - yv);
        let e = (f - Lane::ONE) / yv;
        let e1 = (f1 - e) / yv;
        [e, e1, (f2 - lane(2.0) * e1) / yv, Lane::ZERO]
    };
    for i in (0..top).rev() {
        if within[i].any() {
            e = select(order, within[i], series(i), e);
        }
    }
    y.compose(two(e))
}

#[inline(never)]
pub(crate) fn arc_full_range(y: Lane, rest: Lane) -> [Lane; 4] {
    let cos = y.simd_lt(Lane::ONE).select(Lane::ONE - y, rest - Lane::ONE);
    let sin2 = y * rest;
    let sin = sin2.abs().sqrt();
    let theta = y.simd_gt(Lane::ZERO).select(sin.atan2(cos), (cos + sin).ln());
    let f = theta / sin;
    // f sin θ = θ with dy = sin θ dθ gives f' sin²θ = 1 − f cos θ, and so on for f'' and f'''.
    let f1 = (Lane::ONE - f * cos) / sin2;
    let f2 = (f - lane(3.0) * cos * f1) / sin2;
    let f3 = (lane(4.0) * f1 - lane(5.0) * cos * f2) / sin2;
    [f, f1, f2, f3]
}

/// sin((1−t)θ)/sin θ and sin(tθ)/sin θ, the weights of a geodesic between two points whose
/// y = 1 − cos θ; at y < 0 the hyperbolic ones, at y = 0 the weights 1 − t and t of a line.
#[inline(always)]
pub fn slerp<S: Scalar>(t: S, y: S, rest: impl Fn() -> Lane) -> [S; 2] {
    let yv = y.value();
    let f = two(arc(S::ORDER, yv, &rest));
    let far = yv.simd_gt(Lane::ONE);
    let two = lane(2.0);
    let rest = if far.any() { far.select(rest(), two - yv) } else { two - yv };
    // θ² = f² sin²θ, whose derivative in y is 2f.
    let theta2 = y.compose([f[0] * f[0] * yv * rest, two * f[0], two * f[1]]);
    let f = y.compose(f);
    [f * sine(-t + Lane::ONE, theta2), f * sine(t, theta2)]
}

/// The weights of a geodesic between two points, and their partial derivatives.
pub struct Weights<S> {
    /// sin((1−t)θ)/sin θ and sin(tθ)/sin θ
    pub at: [S; 2],
    /// ∂/∂y
    pub by_y: [S; 2],
    /// ∂/∂t
    pub by_t: [S; 2],
}

impl<S: Scalar> Weights<S> {
    /// The same as [`slerp`], with derivatives.
    #[inline(always)]
    pub fn new(t: S, y: S, rest: impl Fn() -> Lane) -> Self {
        let yv = y.value();
        // F = θ/sin θ with one derivative more than S has.
        let f = arc(S::ORDER + 1, yv, &rest);
        let far = yv.simd_gt(Lane::ONE);
        let double = lane(2.0);
        let rest = if far.any() { far.select(rest(), double - yv) } else { double - yv };
        let theta2 = y.compose([f[0] * f[0] * yv * rest, double * f[0], double * f[1]]);
        let (factor, slope) = (y.compose(two(f)), y.compose([f[1], f[2], f[3]]));
        let weight = |t: S| {
            let square = t * t;
            let z = square * theta2;
            let zv = z.value();
            let (_, [j, j1, j2, j3]) = defects(S::ORDER + 1, zv);
            // s = sin√z/√z = 1 − z j
            let (s, s1) = (j.mul_neg_add(zv, Lane::ONE), -zv.mul_add(j1, j));
            let (s2, s3) = (-zv.mul_add(j2, double * j1), -zv.mul_add(j3, lane(3.0) * j2));
            let (s, s1) = (z.compose([s, s1, s2]), z.compose([s1, s2, s3]));
            let h = t * s;
            // θ² has the derivative 2F.
            let by_y = slope * h + (factor * factor) * (square * t) * s1 * double;
            [factor * h, by_y, factor * (z * s1 * double + s)]
        };
        let [from, to] = [weight(-t + Lane::ONE), weight(t)];
        Weights { at: [from[0], to[0]], by_y: [from[1], to[1]], by_t: [-from[2], to[2]] }
    }
}

/// h = sin(tθ)/θ as a function of t and θ² = x. With s(z) = sin√z/√z at z = t²x it is t s, and its derivatives are
///
/// ```text
/// h_t = cos(tθ) = s + 2z s',  h_x = t³ s',  h_tt = −x h,  h_tx = −t h/2,  h_xx = t⁵ s''.
/// ```
///
/// They take far fewer operations than derivatives of every product and of s.
#[inline(always)]
fn sine<S: Scalar>(t: S, x: S) -> S {
    let ([t, t1, t2], [x, x1, x2]) = (t.parts(), x.parts());
    let square = t * t;
    let z = square * x;
    let (_, [j, j1, j2, _]) = defects(S::ORDER, z);
    // s = 1 − z j
    let s = j.mul_neg_add(z, Lane::ONE);
    let h = t * s;
    if S::ORDER == 0 {
        return S::constant(h);
    }
    let s1 = -z.mul_add(j1, j);
    let by_t = (z + z).mul_add(s1, s);
    let cube = square * t;
    let by_x = cube * s1;
    let first = by_t.mul_add(t1, by_x * x1);
    if S::ORDER == 1 {
        return S::from_parts([h, first, Lane::ZERO]);
    }
    let s2 = -z.mul_add(j2, j1 + j1);
    // h_tt t'² + 2 h_tx t'x' + h_xx x'²
    let turn = -h * t1 * x.mul_add(t1, t * x1);
    let bend = (cube * square * s2).mul_add(x1 * x1, turn);
    S::from_parts([h, first, by_t.mul_add(t2, by_x.mul_add(x2, bend))])
}
