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

use crate::scalar::{Lane, Scalar, lane};

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

/// The polynomial `Σ cᵢ xⁱ` with as many derivatives as S has.
#[inline(always)]
fn polynomial<S: Scalar>(c: &[f64], x: Lane) -> [Lane; 3] {
    let mut p = [lane(c[c.len() - 1]), Lane::ZERO, Lane::ZERO];
    for &coefficient in c[..c.len() - 1].iter().rev() {
        if S::ORDER > 1 {
            p[2] = p[2].mul_add(x, p[1] + p[1]);
        }
        if S::ORDER > 0 {
            p[1] = p[1].mul_add(x, p[0]);
        }
        p[0] = p[0].mul_add(x, lane(coefficient));
    }
    p
}

#[inline(always)]
fn select<S: Scalar>(mask: Lane, a: [Lane; 3], b: [Lane; 3]) -> [Lane; 3] {
    // Derivatives that S does not have are never read.
    [
        mask.select(a[0], b[0]),
        if S::ORDER > 0 { mask.select(a[1], b[1]) } else { Lane::ZERO },
        if S::ORDER > 1 { mask.select(a[2], b[2]) } else { Lane::ZERO },
    ]
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
        let xv = x.value();
        let ax = xv.abs();
        let series = ax.simd_le(lane(TRIG_SERIES));
        let (versine, defect) = if ax.simd_le(lane(TRIG_SHORT)).all() {
            // On this range the two tiers agree up to rounding but are not bit-identical. Every short lane uses the
            // short tier in mixed cases, too (see `taylor`).
            (polynomial::<S>(&VERSINE[..6 + S::ORDER], xv), polynomial::<S>(&SINC_DEFECT[..6 + S::ORDER], xv))
        } else if series.all() {
            taylor::<S>(xv)
        } else {
            let (a, b) = taylor::<S>(xv);
            let (c, d) = full_range(xv);
            (select::<S>(series, a, c), select::<S>(series, b, d))
        };
        let k = -x.compose(versine);
        let j = x.compose(defect);
        Trig { c: k.fma(x, S::constant(Lane::ONE)), s: (-j).fma(x, S::constant(Lane::ONE)), k, j }
    }
}

#[inline(always)]
fn taylor<S: Scalar>(x: Lane) -> ([Lane; 3], [Lane; 3]) {
    let short = x.abs().simd_le(lane(TRIG_SHORT));
    let n = 6 + S::ORDER;
    let long = (polynomial::<S>(&VERSINE, x), polynomial::<S>(&SINC_DEFECT, x));
    if short.none() {
        return long;
    }
    (
        select::<S>(short, polynomial::<S>(&VERSINE[..n], x), long.0),
        select::<S>(short, polynomial::<S>(&SINC_DEFECT[..n], x), long.1),
    )
}

/// (1 − cos√x)/x and (1 − sin√x/√x)/x away from 0, with derivatives in x.
#[inline(never)]
fn full_range(x: Lane) -> ([Lane; 3], [Lane; 3]) {
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
    let v1 = (half * s - v) / x;
    let v2 = (half * s1 - lane(2.0) * v1) / x;
    let d1 = (-s1 - d) / x;
    let d2 = (-s2 - lane(2.0) * d1) / x;
    ([v, v1, v2], [d, d1, d2])
}

/// θ/sin θ as a function of y = 1 − cos θ; at y < 0 it is d/sinh d with y = 1 − cosh d.
///
/// `rest` gives 2 − y = 1 + cos θ: near the cut locus, θ = π, the caller may know it more accurately than y
/// represents it. It is called only where it matters.
#[inline(always)]
pub fn theta_over_sin<S: Scalar>(y: S, rest: impl FnOnce() -> Lane) -> S {
    let yv = y.value();
    let ay = yv.abs();
    let within = ARC_TIERS.map(|(limit, _)| ay.simd_le(lane(limit)));
    let series = |tier: usize| polynomial::<S>(&ARC[..ARC_TIERS[tier].1 + S::ORDER], yv);
    let f = if within[0].all() {
        series(0)
    } else {
        // From the widest range to the narrowest, so that each lane finally has its own tier.
        let mut f = series(1);
        if !within[1].all() {
            f = select::<S>(within[1], f, series(2));
            if !within[2].all() {
                f = select::<S>(within[2], f, arc_full_range(yv, rest()));
            }
        }
        if within[0].any() {
            f = select::<S>(within[0], series(0), f);
        }
        f
    };
    y.compose(f)
}

/// (θ/sin θ − 1)/y as a function of y = 1 − cos θ ≤ 1.
#[inline(always)]
pub fn arc_defect<S: Scalar>(y: S) -> S {
    let yv = y.value();
    let limits = [0.0075, 0.09, 0.3];
    let terms = [7, 14, 22];
    let series = |tier: usize| polynomial::<S>(&ARC[1..1 + terms[tier] + S::ORDER], yv);
    let within = limits.map(|limit| yv.abs().simd_le(lane(limit)));
    let top = (0..3).find(|&i| within[i].all()).unwrap_or(3);
    let mut e = if top < 3 {
        series(top)
    } else {
        let [f, f1, f2] = arc_full_range(yv, lane(2.0) - yv);
        let e = (f - Lane::ONE) / yv;
        let e1 = (f1 - e) / yv;
        [e, e1, (f2 - lane(2.0) * e1) / yv]
    };
    for i in (0..top).rev() {
        if within[i].any() {
            e = select::<S>(within[i], series(i), e);
        }
    }
    y.compose(e)
}

#[inline(never)]
pub(crate) fn arc_full_range(y: Lane, rest: Lane) -> [Lane; 3] {
    let cos = y.simd_lt(Lane::ONE).select(Lane::ONE - y, rest - Lane::ONE);
    let sin2 = y * rest;
    let sin = sin2.abs().sqrt();
    let theta = y.simd_gt(Lane::ZERO).select(sin.atan2(cos), (cos + sin).ln());
    let f = theta / sin;
    // f sin θ = θ with dy = sin θ dθ gives f' sin²θ = 1 − f cos θ, and once more for f''.
    let f1 = (Lane::ONE - f * cos) / sin2;
    let f2 = (f - lane(3.0) * cos * f1) / sin2;
    [f, f1, f2]
}

/// sin((1−t)θ)/sin θ and sin(tθ)/sin θ, the weights of a geodesic between two points whose
/// y = 1 − cos θ; at y < 0 the hyperbolic ones, at y = 0 the weights 1 − t and t of a line.
#[inline(always)]
pub fn slerp<S: Scalar>(t: S, y: S, rest: impl Fn() -> Lane) -> [S; 2] {
    let f = theta_over_sin(y, &rest);
    let yv = y.value();
    let far = yv.simd_gt(Lane::ONE);
    let two = lane(2.0);
    let rest = if far.any() { far.select(rest(), two - yv) } else { two - yv };
    // θ² = f² sin²θ
    let theta2 = f * f * y * (S::constant(rest) - (y - yv));
    [slerp_weight(-t + Lane::ONE, theta2, f), slerp_weight(t, theta2, f)]
}

/// sin(tθ)/sin θ = t · sin(tθ)/(tθ) · θ/sin θ
#[inline(always)]
fn slerp_weight<S: Scalar>(t: S, theta2: S, f: S) -> S {
    f * t * Trig::new(t * t * theta2).s
}
