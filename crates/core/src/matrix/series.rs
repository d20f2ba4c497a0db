//! Power series in a matrix, and the functions of Hermitian ones made of them.
//!
//! For a matrix of size four or less, the theorem of Cayley and Hamilton reduces powers to I, H, H², H³, so that a
//! series costs a few multiplications per term. Larger matrices use the scheme of Paterson & Stockmeyer (1973). Both
//! compute derivatives and are smooth where eigenvalues coincide. Beyond the radius of a series its argument is
//! halved, or eigenvectors are used.

use super::base::{Matrix, Storage};
use super::entry::{inner_add, mul_add};
use super::function::{Unary, function_of};
use super::select::{Select, by_size};
use crate::scalar::{LANES, Lane, Scalar, few, lane};
use crate::special::{ARC, SINC, VERSINE, arc_full_range, two};

/// The common data of the series in one matrix.
pub(super) struct Powers<'a, S: Scalar, const D: usize, A: Storage> {
    h: &'a Matrix<S, D, A>,
    known: Known<S, D, A>,
}

enum Known<S: Scalar, const D: usize, A: Storage> {
    Itself,
    /// H² = −e₂ + e₁H
    Two([S; 2]),
    /// H³ = e₃ − e₂H + e₁H²
    Three {
        square: Matrix<S, D, A>,
        e: [S; 3],
    },
    /// H⁴ = −e₄ + e₃H − e₂H² + e₁H³
    Four {
        square: Matrix<S, D, A>,
        cube: Matrix<S, D, A>,
        e: [S; 4],
    },
    /// H, H², …
    Many(Vec<Matrix<S, D, A>>),
}

impl<S: Scalar, const D: usize, A: Storage> Known<S, D, A> {
    /// Requires the product of the off-diagonal entries.
    #[inline(always)]
    fn two(h: &Matrix<S, D, A>, beside: S) -> Self {
        let (a, d) = (h[(0, 0)][0], h[(1, 1)][0]);
        Known::Two([beside - a * d, a + d])
    }

    #[inline(always)]
    fn three(h: &Matrix<S, D, A>, square: Matrix<S, D, A>) -> Self {
        let e = invariants(h, &square);
        Known::Three { square, e }
    }

    /// Requires the square, and the trace of its square.
    #[inline(always)]
    fn four(h: &Matrix<S, D, A>, square: Matrix<S, D, A>, fourth: S) -> Self {
        let cube = square.times(h);
        // Newton's identities. The rounding errors are those of products of norms, as in the powers themselves.
        let (p1, p2, p3) = (h.trace(), square.trace(), cube.trace());
        let minus_e2 = (p2 - p1 * p1) * lane(0.5);
        let e3 = (p3 - minus_e2 * p1 - p1 * p2) * lane(1.0 / 3.0);
        let minus_e4 = (fourth - e3 * p1 - minus_e2 * p2 - p1 * p3) * lane(0.25);
        Known::Four { square, cube, e: [minus_e4, e3, minus_e2, p1] }
    }

    #[inline(always)]
    fn many(h: &Matrix<S, D, A>, terms: usize) -> Self {
        // The best number of powers for Paterson & Stockmeyer.
        let block = (terms as f64).sqrt().round() as usize;
        let mut powers = vec![h.clone()];
        while powers.len() < block {
            powers.push(powers[powers.len() - 1].times(h));
        }
        Known::Many(powers)
    }
}

impl<'a, S: Scalar, const D: usize, A: Storage> Powers<'a, S, D, A> {
    /// For a Hermitian matrix, and several series with this number of terms in total.
    #[inline(always)]
    fn of(h: &'a Matrix<S, D, A>, terms: usize) -> Self {
        let known = match h.rows() {
            1 => Known::Itself,
            2 => {
                let off = h[(0, 1)];
                Known::two(h, inner_add(off, off, S::constant(Lane::ZERO)))
            }
            3 => Known::three(h, h.times_adjoint_hermitian(h)),
            4 => {
                let square = h.times_adjoint_hermitian(h);
                let fourth = square.inner(&square);
                Known::four(h, square, fourth)
            }
            _ => Known::many(h, terms),
        };
        Powers { h, known }
    }

    /// For any matrix. The theorem requires complex numbers if the entries are complex.
    #[cfg(feature = "dense")]
    pub(super) fn of_any(h: &'a Matrix<S, D, A>, terms: usize) -> Self {
        let known = match h.rows() {
            1 if D == 1 => Known::Itself,
            2 if D == 1 => Known::two(h, h[(0, 1)][0] * h[(1, 0)][0]),
            3 if D == 1 => Known::three(h, h.times(h)),
            4 if D == 1 => {
                let square = h.times(h);
                let transposed = square.adjoint();
                let fourth = square.inner(&transposed);
                Known::four(h, square, fourth)
            }
            _ => Known::many(h, terms),
        };
        Powers { h, known }
    }

    /// Σ cⱼ Hʲ
    #[inline(always)]
    pub(super) fn sum(&self, c: &[f64]) -> Matrix<S, D, A> {
        match &self.known {
            Known::Itself => {
                let x = self.h[(0, 0)][0];
                let mut out = Matrix::zeros(1, 1);
                out[(0, 0)][0] = c.iter().rev().fold(S::constant(Lane::ZERO), |sum, &c| sum * x + lane(c));
                out
            }
            Known::Two(e) => {
                let [x0, x1] = reduce(e, c);
                let mut out = self.h.times_scalar(x1);
                for i in 0..2 {
                    out[(i, i)][0] = out[(i, i)][0] + x0;
                }
                out
            }
            Known::Three { square, e } => combine(self.h, square, reduce(e, c)),
            Known::Four { square, cube, e } => {
                let [x0, x1, x2, x3] = reduce(e, c);
                let mut out = self.h.zip(square, |h, s| x2.fma(s, x1 * h)).zip(cube, |sum, q| x3.fma(q, sum));
                for i in 0..4 {
                    out[(i, i)][0] = out[(i, i)][0] + x0;
                }
                out
            }
            Known::Many(powers) => paterson_stockmeyer(powers, c),
        }
    }
}

/// e₃, −e₂ and e₁ of a 3 × 3 matrix.
fn invariants<S: Scalar, const D: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    square: &Matrix<S, D, A>,
) -> [S; 3] {
    let zero = S::constant(Lane::ZERO);
    let e1 = h.trace();
    let minus_e2 = (square.trace() - e1 * e1) * lane(0.5);
    // e₃ = det H by the first row.
    let minor = |j: usize, k: usize| {
        let product = mul_add::<S, D, false>(h[(1, j)], h[(2, k)], [zero; D]);
        let other = mul_add::<S, D, false>(h[(1, k)], h[(2, j)], [zero; D]);
        few::<S, D>(|c| product[c] - other[c])
    };
    let mut det = [zero; D];
    det = mul_add::<S, D, false>(h[(0, 0)], minor(1, 2), det);
    det = mul_add::<S, D, false>(h[(0, 1)], minor(2, 0), det);
    det = mul_add::<S, D, false>(h[(0, 2)], minor(0, 1), det);
    [det[0], minus_e2, e1]
}

/// The coefficients of 1, H, … to which a series f reduces, with their derivatives, if Hᴺ = e₀ + e₁H + ….
///
/// They are the remainder r of f by χ(z) = zᴺ − e₀ − e₁z − …. With f = r + χg and g = s + χh, where f is fixed and
/// χ' = −e', the derivative is r' = e'g − χg', so that e's = r' + χq for the quotient q, g' = q + e'h up to multiples
/// of χ, and r'' is the remainder of e''s + 2e'g'. Horner's scheme yields r, s and the remainder of h at once, which
/// costs half as much as the same scheme with derivatives.
fn reduce<S: Scalar, const N: usize>(e: &[S; N], c: &[f64]) -> [S; N] {
    let [e, d, dd] = few(|order| few(|k| e[k].parts()[order]));
    // The remainders of f, g and h.
    let mut rest = [[Lane::ZERO; N]; 3];
    for &c in c.iter().rev() {
        let mut next = lane(c);
        for rest in &mut rest[..=S::ORDER] {
            let top = rest[N - 1];
            *rest = few(|k| top.mul_add(e[k], if k == 0 { next } else { rest[k - 1] }));
            next = top;
        }
    }
    let [r, s, h] = rest;
    let (mut first, mut second) = (r, r);
    if S::ORDER > 0 {
        let [rest, quotient] = divided_product(&d, &s, &e);
        first = rest;
        if S::ORDER > 1 {
            let [change, _] = divided_product(&d, &h, &e);
            let [of_change, _] = divided_product(&d, &few(|k| quotient[k] + change[k]), &e);
            let [of_second, _] = divided_product(&dd, &s, &e);
            second = few(|k| of_change[k] + of_change[k] + of_second[k]);
        }
    }
    few(|k| S::from_parts([r[k], first[k], second[k]]))
}

/// Remainder and quotient of the product of two polynomials by χ of [`reduce`].
fn divided_product<const N: usize>(a: &[Lane; N], b: &[Lane; N], e: &[Lane; N]) -> [[Lane; N]; 2] {
    let (mut rest, mut quotient): ([Lane; N], _) = (few(|k| a[N - 1] * b[k]), [Lane::ZERO; N]);
    for &a in a[..N - 1].iter().rev() {
        let top = rest[N - 1];
        rest = few(|k| {
            let product = a.mul_add(b[k], if k == 0 { Lane::ZERO } else { rest[k - 1] });
            top.mul_add(e[k], product)
        });
        quotient = few(|k| if k == 0 { top } else { quotient[k - 1] });
    }
    [rest, quotient]
}

fn combine<S: Scalar, const D: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    square: &Matrix<S, D, A>,
    [x0, x1, x2]: [S; 3],
) -> Matrix<S, D, A> {
    let mut out = h.zip(square, |h, s| x2.fma(s, x1 * h));
    for i in 0..3 {
        out[(i, i)][0] = out[(i, i)][0] + x0;
    }
    out
}

fn paterson_stockmeyer<S: Scalar, const D: usize, A: Storage>(
    powers: &[Matrix<S, D, A>],
    c: &[f64],
) -> Matrix<S, D, A> {
    let (n, top) = (powers[0].rows(), &powers[powers.len() - 1]);
    let mut sum = Matrix::zeros(n, n);
    for (b, c) in c.chunks(powers.len()).rev().enumerate() {
        if b > 0 {
            sum = sum.times(top);
        }
        sum = sum.plus_identity(lane(c[0]));
        for (c, power) in c[1..].iter().zip(powers) {
            for (s, p) in sum.data.iter_mut().flatten().zip(power.data.iter().flatten()) {
                *s = p.fma_lane(lane(*c), *s);
            }
        }
    }
    sum
}

/// The numbers of terms with errors below rounding, and one more for every derivative.
pub(super) fn terms<S: Scalar>(c: &[f64], n: usize) -> &[f64] {
    &c[..(n + S::ORDER).min(c.len())]
}

/// How often sizes must be divided by `base` to fall below a limit, lane by lane, and the total divisor.
#[cold]
pub(super) fn reductions(size: Lane, limit: f64, base: f64) -> (Lane, Lane) {
    let (mut times, mut divisor) = ([0.0; LANES], [1.0; LANES]);
    for (l, size) in size.to_array().into_iter().enumerate() {
        // Infinity and NaN do not change; lengths of geodesics are below 2⁶⁴.
        while size / divisor[l] > limit && divisor[l] < 1e19 {
            (times[l], divisor[l]) = (times[l] + 1.0, divisor[l] * base);
        }
    }
    (Lane::new(times), Lane::new(divisor))
}

/// Applies `step` this many times, lane by lane.
pub(super) fn repeat<R: Select + Clone>(mut x: R, times: Lane, step: impl Fn(&R) -> R) -> R {
    let mut done = Lane::ZERO;
    loop {
        let on = times.simd_gt(done);
        if on.none() {
            return x;
        }
        let next = step(&x);
        x = R::select(on, next, x);
        done += Lane::ONE;
    }
}

/// Largest argument of the series of [`trig`].
const TRIG: [f64; 2] = [0.1, 2.5];

/// `s(G) = sin√G/√G` and `k(G) = (cos√G − 1)/G` of a Hermitian G ≥ 0. The cosine is `1 + G k(G)`.
#[inline(always)]
pub fn trig<S: Scalar, const D: usize, A: Storage>(g: &Matrix<S, D, A>) -> [Matrix<S, D, A>; 2] {
    if A::ANY { (A::compiled().trig)(g) } else { trig_here(g) }
}

pub(super) fn trig_here<S: Scalar, const D: usize, A: Storage>(g: &Matrix<S, D, A>) -> [Matrix<S, D, A>; 2] {
    let inside = |g: &Matrix<S, D, A>, n: usize| {
        let powers = Powers::of(g, 2 * n);
        [powers.sum(terms::<S>(&SINC, n)), -powers.sum(terms::<S>(&VERSINE, n))]
    };
    let size = g.size();
    by_size(size, &TRIG, |tier| match tier {
        0 => inside(g, 7),
        1 => inside(g, VERSINE.len()),
        _ => {
            // s(4x) = s(x) c(x), k(4x) = −s(x)²/2
            let (times, divisor) = reductions(size, TRIG[1], 4.0);
            let small = g.scaled(Lane::ONE / divisor);
            let [s, k] = inside(&small, VERSINE.len());
            let [_, s, k] = repeat([small, s, k], times, |[x, s, k]| {
                let c = x.times(k).plus_identity(Lane::ONE);
                [x.scaled(lane(4.0)), s.times(&c), s.times(s).scaled(lane(-0.5))]
            });
            [s, k]
        }
    })
}

/// eˣ − 1 = Σ xʲ/j!, from j = 1
pub(super) const EXP: [f64; 25] = {
    let mut c = [0.0; 25];
    let (mut j, mut inverse) = (1, 1.0);
    while j < 25 {
        inverse /= j as f64;
        c[j] = inverse;
        j += 1;
    }
    c
};

/// `exp(A) − 1` of a Hermitian matrix.
#[inline(always)]
pub fn exp_minus_one<S: Scalar, const D: usize, A: Storage>(a: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    if A::ANY { (A::compiled().exp_minus_one)(a) } else { exp_minus_one_here(a) }
}

pub(super) fn exp_minus_one_here<S: Scalar, const D: usize, A: Storage>(
    a: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    exp_by(a, |a, n| Powers::of(a, n).sum(terms::<S>(&EXP, n)))
}

/// `exp(A) − 1`, given the series of a number of terms.
pub(super) fn exp_by<S: Scalar, const D: usize, A: Storage>(
    a: &Matrix<S, D, A>,
    inside: impl Fn(&Matrix<S, D, A>, usize) -> Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    const LIMITS: [f64; 3] = [0.1, 0.4, 1.5];
    let size = a.size();
    by_size(size, &LIMITS, |tier| match tier {
        0 => inside(a, 11),
        1 => inside(a, 15),
        2 => inside(a, EXP.len()),
        _ => {
            let (times, divisor) = reductions(size, LIMITS[2], 2.0);
            let small = inside(&a.scaled(Lane::ONE / divisor), EXP.len());
            repeat(small, times, |e| e.compose(e))
        }
    })
}

/// sin x and cos x − 1.
const WAVES: [[f64; 25]; 2] = {
    let mut c = [[0.0; 25]; 2];
    let mut j = 1;
    while j < 25 {
        c[(j + 1) % 2][j] = if j / 2 % 2 == 0 { EXP[j] } else { -EXP[j] };
        j += 1;
    }
    c
};

/// arcsin x = Σ (2j)!/(4ʲ j!² (2j + 1)) x²ʲ⁺¹
const ARCSINE: [f64; 44] = {
    let mut c = [0.0; 44];
    let (mut j, mut factor) = (0, 1.0);
    while j < 22 {
        c[2 * j + 1] = factor / (2 * j + 1) as f64;
        factor *= (2 * j + 1) as f64 / (2 * j + 2) as f64;
        j += 1;
    }
    c
};
/// Up to these sizes of 1 − cos θ, these numbers of terms of arcsin(sin θ), and one more for every derivative, are
/// accurate to rounding.
const ARCSINE_TIERS: [(f64, usize); 3] = [(0.0075, 8), (0.03, 12), (0.09, 20)];
/// The size of 1 − cos θ up to which [`log_by_sine`] is accurate.
pub const SINE_LIMIT: f64 = ARCSINE_TIERS[2].0;

/// Whether functions of a skew-Hermitian Ω are polynomials in the Hermitian −iΩ of few coefficients. They cost no
/// products, which functions of Ω*Ω do.
pub const fn has_angles<const D: usize, A: Storage>(n: usize) -> bool {
    D == 2 && !A::ANY && n < 5
}

/// iA, and its inverse −iA for `sign` −1.
fn times_i<S: Scalar, const D: usize, A: Storage>(a: &Matrix<S, D, A>, sign: f64) -> Matrix<S, D, A> {
    a.map_entries(|x| {
        let mut y = x;
        y[0] = x[D - 1] * lane(-sign);
        y[D - 1] = x[0] * lane(sign);
        y
    })
}

/// The principal logarithm of a unitary matrix with this skew-Hermitian part, and this size of 1 − cos θ, at most
/// [`SINE_LIMIT`]; see [`has_angles`].
pub fn log_by_sine<S: Scalar, const D: usize, A: Storage>(
    sine: &Matrix<S, D, A>,
    versine: Lane,
) -> Matrix<S, D, A> {
    let h = times_i(sine, -1.0);
    let limits = [ARCSINE_TIERS[0].0, ARCSINE_TIERS[1].0];
    by_size(versine, &limits, |tier| {
        let c = &ARCSINE[..2 * (ARCSINE_TIERS[tier].1 + S::ORDER)];
        times_i(&Powers::of(&h, c.len()).sum(c), 1.0)
    })
}

/// `exp(Ω) − 1` of a skew-Hermitian matrix: by [angles](has_angles), or `Ω s(G) + G k(G)` with G = Ω*Ω.
pub fn exp_skew_minus_one<S: Scalar, const D: usize, A: Storage>(omega: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    if has_angles::<D, A>(omega.rows()) {
        return exp_by(omega, |omega, n| {
            let h = times_i(omega, -1.0);
            let powers = Powers::of(&h, 2 * n);
            &times_i(&powers.sum(terms::<S>(&WAVES[0], n)), 1.0) + &powers.sum(terms::<S>(&WAVES[1], n))
        });
    }
    let g = omega.adjoint_times(omega);
    let [s, k] = trig(&g);
    &omega.times(&s) + &g.times(&k)
}

/// log(1 + x) as a polynomial: log(1 + x)/x interpolated at the 28 Chebyshev nodes of |x| ≤ 0.35, which needs
/// fewer terms than Taylor's 36. Relative error 3e-18, of the derivatives 1e-17 and 2e-16 (at 50 digits).
#[allow(clippy::excessive_precision)]
#[rustfmt::skip]
const LOG: [f64; 29] = [
    0.0,
    1.0,
    -0.5,
    0.3333333333333333,
    -0.25,
    0.19999999999999982,
    -0.1666666666666665,
    0.1428571428571789,
    -0.12500000000003492,
    0.11111111110719639,
    -0.09999999999620904,
    0.09090909116328116,
    -0.08333333357948537,
    0.07692306625384897,
    -0.07142856109689075,
    0.06666696977197657,
    -0.06250029350992092,
    0.05881755151277276,
    -0.05554976705481403,
    0.05271417811194528,
    -0.05007997921669766,
    0.046824891336396626,
    -0.04468561912329216,
    0.04864738059111636,
    -0.0466711711744112,
    0.01861061849824667,
    -0.017756056095513957,
    0.08551686068864925,
    -0.08263118345564845,
];

/// Up to these sizes of x, [`log_terms`] are accurate to rounding.
pub(super) const LOG_LIMITS: [f64; 2] = [0.1, 0.35];
/// log(1 + x) = Σ −(−x)ʲ/j. Up to the smaller limit 16 terms are accurate to rounding, and one more for every
/// derivative.
const LOG_SHORT: [f64; 19] = {
    let mut c = [0.0; 19];
    let mut j = 1;
    while j < 19 {
        c[j] = if j % 2 == 1 { 1.0 } else { -1.0 } / j as f64;
        j += 1;
    }
    c
};

/// The polynomial for log(1 + x) within a tier of [`LOG_LIMITS`].
pub(super) fn log_terms<S: Scalar>(tier: usize) -> &'static [f64] {
    if tier == 0 { &LOG_SHORT[..17 + S::ORDER] } else { &LOG }
}

/// `log(1 + B)` of a Hermitian B with 1 + B positive definite.
#[inline(always)]
pub fn log_one_plus<S: Scalar, const D: usize, A: Storage>(b: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    if A::ANY { (A::compiled().log_one_plus)(b) } else { log_one_plus_here(b) }
}

pub(super) fn log_one_plus_here<S: Scalar, const D: usize, A: Storage>(
    b: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    by_size(b.size(), &LOG_LIMITS, |tier| {
        if tier == LOG_LIMITS.len() {
            return log_full_range(b);
        }
        let c = log_terms::<S>(tier);
        Powers::of(b, c.len()).sum(c)
    })
}

/// The same of two matrices with the same eigenvalues.
pub fn log_one_plus_alike<S: Scalar, const D: usize, A: Storage>(
    b: [&Matrix<S, D, A>; 2],
) -> [Matrix<S, D, A>; 2] {
    if b[0].rows() != 3 {
        return b.map(log_one_plus);
    }
    by_size(b[0].size(), &LOG_LIMITS, |tier| {
        if tier == LOG_LIMITS.len() {
            return b.map(log_full_range);
        }
        // The coefficients of 1, B and B² are symmetric functions of the eigenvalues.
        let squares = b.map(|b| b.times_adjoint_hermitian(b));
        let x = reduce(&invariants(b[0], &squares[0]), log_terms::<S>(tier));
        [0, 1].map(|i| combine(b[i], &squares[i], x))
    })
}

fn log_full_range<S: Scalar, const D: usize, A: Storage>(b: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    let f = |x: Lane| {
        let y = x + Lane::ONE;
        let inverse = Lane::ONE / y;
        [y.ln(), inverse, -(inverse * inverse)]
    };
    // The function is singular at x = −1.
    function_of(b, &Unary { f, pole_distance: |x: Lane| (x + Lane::ONE).abs() })
}

/// `θ/sin θ` as a function of the Hermitian `Y = 1 − cos θ`; `rest` is `2 − Y`, more accurately.
#[inline(always)]
pub fn arc<S: Scalar, const D: usize, A: Storage>(y: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    if A::ANY { (A::compiled().arc)(y) } else { arc_here(y) }
}

pub(super) fn arc_here<S: Scalar, const D: usize, A: Storage>(y: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    const LIMITS: [f64; 4] = [0.0075, 0.09, 0.3, 0.8];
    by_size(y.size(), &LIMITS, |tier| {
        let n = match tier {
            0 => 7,
            1 => 14,
            2 => 22,
            3 => 43,
            _ => {
                return function_of(
                    y,
                    &Unary {
                        f: |y: Lane| two(arc_full_range(y, lane(2.0) - y)),
                        pole_distance: |y: Lane| (lane(2.0) - y).abs().min(Lane::ONE),
                    },
                );
            }
        };
        Powers::of(y, n).sum(terms::<S>(&ARC, n))
    })
}
