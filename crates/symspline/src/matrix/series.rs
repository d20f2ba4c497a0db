//! Power series in a Hermitian matrix, and the functions made of them.
//!
//! Of a matrix of size three or less the powers reduce to I, H, H² by the theorem of Cayley and
//! Hamilton, so that a series costs a few multiplications a term; larger ones use the scheme of
//! Paterson & Stockmeyer (1973). Both carry derivatives along and are smooth where eigenvalues
//! coincide. Beyond the radius of a series its argument is halved, or eigenvectors are used.

use super::function::{Unary, function_of};
use super::{Matrix, Select, Storage, by_size, inner_add, mul_add};
use crate::scalar::{LANES, Lane, Scalar, lane};
use crate::special::{ARC, SINC_DEFECT, VERSINE, arc_full_range};

/// Σ cⱼ Hʲ for several lists of coefficients of one length.
fn series<S: Scalar, const D: usize, const F: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    c: [&[f64]; F],
) -> [Matrix<S, D, A>; F] {
    match h.rows() {
        1 => {
            let x = h[(0, 0)][0];
            c.map(|c| {
                let mut out = Matrix::zeros(1, 1);
                out[(0, 0)][0] = horner(c, |sum, c| sum * x + lane(c));
                out
            })
        }
        2 => two(h, c),
        3 => three(h, c),
        _ => paterson_stockmeyer(h, c),
    }
}

fn horner<S: Scalar>(c: &[f64], mut step: impl FnMut(S, f64) -> S) -> S {
    c.iter().rev().fold(S::constant(Lane::ZERO), |sum, &c| step(sum, c))
}

/// With H² = e₁H − e₂.
fn two<S: Scalar, const D: usize, const F: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    c: [&[f64]; F],
) -> [Matrix<S, D, A>; F] {
    let (a, d) = (h[(0, 0)][0], h[(1, 1)][0]);
    let off = h[(0, 1)];
    let zero = S::constant(Lane::ZERO);
    let (e1, e2) = (a + d, a * d - inner_add(off, off, zero));
    c.map(|c| {
        let (mut x0, mut x1) = (zero, zero);
        for &c in c.iter().rev() {
            (x0, x1) = (-(x1 * e2) + lane(c), x1.fma(e1, x0));
        }
        let mut out = h.clone().times_scalar(x1);
        for i in 0..2 {
            out[(i, i)][0] = out[(i, i)][0] + x0;
        }
        out
    })
}

/// With H³ = e₁H² − e₂H + e₃.
fn three<S: Scalar, const D: usize, const F: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    c: [&[f64]; F],
) -> [Matrix<S, D, A>; F] {
    let square = hermitian_square(h);
    let e = invariants(h, &square);
    c.map(|c| combine(h, &square, reduce(e, c)))
}

/// e₁, −e₂ and e₃ of a 3 × 3 matrix.
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
        std::array::from_fn::<S, D, _>(|c| product[c] - other[c])
    };
    let mut det = [zero; D];
    det = mul_add::<S, D, false>(h[(0, 0)], minor(1, 2), det);
    det = mul_add::<S, D, false>(h[(0, 1)], minor(2, 0), det);
    det = mul_add::<S, D, false>(h[(0, 2)], minor(0, 1), det);
    [e1, minus_e2, det[0]]
}

/// The coefficients of 1, H and H² that a series comes down to.
fn reduce<S: Scalar>([e1, minus_e2, e3]: [S; 3], c: &[f64]) -> [S; 3] {
    let zero = S::constant(Lane::ZERO);
    c.iter()
        .rev()
        .fold([zero; 3], |[x0, x1, x2], &c| [x2 * e3 + lane(c), x2.fma(minus_e2, x0), x2.fma(e1, x1)])
}

fn combine<S: Scalar, const D: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    square: &Matrix<S, D, A>,
    [x0, x1, x2]: [S; 3],
) -> Matrix<S, D, A> {
    let mut out = Matrix::<S, D, A>::zeros(3, 3);
    for ((out, h), s) in out.data.iter_mut().zip(h.data.iter()).zip(square.data.iter()) {
        *out = std::array::from_fn(|c| x2.fma(s[c], x1 * h[c]));
    }
    for i in 0..3 {
        out[(i, i)][0] = out[(i, i)][0] + x0;
    }
    out
}

/// H², whose lower half is not computed twice.
fn hermitian_square<S: Scalar, const D: usize, A: Storage>(h: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    let n = h.rows();
    let mut out = Matrix::zeros(n, n);
    for i in 0..n {
        for j in i..n {
            let mut sum = [S::constant(Lane::ZERO); D];
            for k in 0..n {
                sum = mul_add::<S, D, true>(h[(i, k)], h[(j, k)], sum);
            }
            out[(i, j)] = sum;
            out[(j, i)] = super::conjugate(sum);
        }
    }
    out
}

fn paterson_stockmeyer<S: Scalar, const D: usize, const F: usize, A: Storage>(
    h: &Matrix<S, D, A>,
    c: [&[f64]; F],
) -> [Matrix<S, D, A>; F] {
    let n = h.rows();
    let block = ((c[0].len() as f64 * F as f64).sqrt().round() as usize).clamp(1, c[0].len());
    let mut powers = vec![h.clone()];
    while powers.len() < block {
        powers.push(powers[powers.len() - 1].times(h));
    }
    let top = &powers[block - 1];
    c.map(|c| {
        let mut sum = Matrix::zeros(n, n);
        for (b, c) in c.chunks(block).rev().enumerate() {
            if b > 0 {
                sum = sum.times(top);
            }
            sum = sum.plus_identity(lane(c[0]));
            for (c, power) in c[1..].iter().zip(&powers) {
                for (s, p) in sum.data.iter_mut().flatten().zip(power.data.iter().flatten()) {
                    *s = p.fma_lane(lane(*c), *s);
                }
            }
        }
        sum
    })
}

/// Terms that leave less than a rounding error, one more for every derivative.
fn terms<S: Scalar>(c: &[f64], n: usize) -> &[f64] {
    &c[..(n + S::ORDER).min(c.len())]
}

/// How often sizes must be divided by `base` to come below a limit, lane by lane, and by what in all.
#[cold]
fn reductions(size: Lane, limit: f64, base: f64) -> (Lane, Lane) {
    let (mut times, mut divisor) = ([0.0; LANES], [1.0; LANES]);
    for (l, size) in size.to_array().into_iter().enumerate() {
        // Infinity and NaN stay what they are; more than 2⁶⁴ is no length of a geodesic.
        while size / divisor[l] > limit && divisor[l] < 1e19 {
            (times[l], divisor[l]) = (times[l] + 1.0, divisor[l] * base);
        }
    }
    (Lane::new(times), Lane::new(divisor))
}

/// Applies `step` so many times, lane by lane.
fn repeat<R: Select + Clone>(mut x: R, times: Lane, step: impl Fn(&R) -> R) -> R {
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
pub fn trig<S: Scalar, const D: usize, A: Storage>(g: &Matrix<S, D, A>) -> [Matrix<S, D, A>; 2] {
    let inside = |g: &Matrix<S, D, A>, n: usize| {
        let [v, d] = series(g, [terms::<S>(&VERSINE, n), terms::<S>(&SINC_DEFECT, n)]);
        [(-g.times(&d)).plus_identity(Lane::ONE), -v]
    };
    let size = g.size();
    by_size(size, &TRIG, |tier| match tier {
        0 => inside(g, 6),
        1 => inside(g, VERSINE.len()),
        _ => {
            // s(4x) = s(x) c(x), k(4x) = −s(x)²/2
            let (times, divisor) = reductions(size, TRIG[1], 4.0);
            let small = g.clone().scaled(Lane::ONE / divisor);
            let [s, k] = inside(&small, VERSINE.len());
            let [_, s, k] = repeat([small, s, k], times, |[x, s, k]| {
                let c = x.times(k).plus_identity(Lane::ONE);
                [x.clone().scaled(lane(4.0)), s.times(&c), s.times(s).scaled(lane(-0.5))]
            });
            [s, k]
        }
    })
}

/// (eˣ − 1)/x = Σ xʲ/(j+1)!
const EXP: [f64; 24] = {
    let mut c = [1.0; 24];
    let mut j = 1;
    while j < 24 {
        c[j] = c[j - 1] / (j + 1) as f64;
        j += 1;
    }
    c
};

/// `exp(A) − 1` of a Hermitian matrix.
pub fn exp_minus_one<S: Scalar, const D: usize, A: Storage>(a: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    const LIMITS: [f64; 3] = [0.1, 0.4, 1.5];
    let inside = |a: &Matrix<S, D, A>, n: usize| {
        let [phi] = series(a, [terms::<S>(&EXP, n)]);
        a.times(&phi)
    };
    let size = a.size();
    by_size(size, &LIMITS, |tier| match tier {
        0 => inside(a, 10),
        1 => inside(a, 14),
        2 => inside(a, EXP.len()),
        _ => {
            let (times, divisor) = reductions(size, LIMITS[2], 2.0);
            let small = inside(&a.clone().scaled(Lane::ONE / divisor), EXP.len());
            repeat(small, times, |e| e.compose(e))
        }
    })
}

/// `exp(Ω) − 1` of a skew-Hermitian matrix: `Ω s(G) + G k(G)` with G = Ω*Ω.
pub fn exp_skew_minus_one<S: Scalar, const D: usize, A: Storage>(omega: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    let g = omega.adjoint_times(omega);
    let [s, k] = trig(&g);
    &omega.times(&s) + &g.times(&k)
}

/// (log(1 + x))/x = Σ (−x)ʲ/(j+1)
const LOG: [f64; 40] = {
    let mut c = [1.0; 40];
    let mut j = 0;
    while j < 40 {
        c[j] = if j % 2 == 0 { 1.0 } else { -1.0 } / (j + 1) as f64;
        j += 1;
    }
    c
};

/// Largest arguments of so many terms of the series of [`log_one_plus`].
const LOG_LIMITS: [f64; 3] = [0.05, 0.15, 0.35];
const LOG_TERMS: [usize; 3] = [12, 19, 36];

/// `log(1 + B)` of a Hermitian B with 1 + B positive definite.
pub fn log_one_plus<S: Scalar, const D: usize, A: Storage>(b: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    by_size(b.size(), &LOG_LIMITS, |tier| {
        if tier == LOG_LIMITS.len() {
            return log_full_range(b);
        }
        let [phi] = series(b, [terms::<S>(&LOG, LOG_TERMS[tier])]);
        b.times(&phi)
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
        // log(1 + B) = x₀B + x₁B² + x₂B³, whose coefficients are symmetric functions of eigenvalues.
        let squares = b.map(hermitian_square);
        let x = reduce(invariants(b[0], &squares[0]), terms::<S>(&LOG, LOG_TERMS[tier]));
        [0, 1].map(|i| b[i].times(&combine(b[i], &squares[i], x)))
    })
}

fn log_full_range<S: Scalar, const D: usize, A: Storage>(b: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    let log = |x: Lane| {
        let y = x + Lane::ONE;
        let inverse = Lane::ONE / y;
        [y.ln(), inverse, -(inverse * inverse)]
    };
    // The function is singular at x = −1.
    function_of(b, &Unary { f: log, room: |x: Lane| (x + Lane::ONE).abs() })
}

/// `θ/sin θ` as a function of the Hermitian `Y = 1 − cos θ`; `rest` is `2 − Y`, known to more digits.
pub fn arc<S: Scalar, const D: usize, A: Storage>(y: &Matrix<S, D, A>) -> Matrix<S, D, A> {
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
                        f: |y: Lane| arc_full_range(y, lane(2.0) - y),
                        room: |y: Lane| (lane(2.0) - y).abs().min(Lane::ONE),
                    },
                );
            }
        };
        let [f] = series(y, [terms::<S>(&ARC, n)]);
        f
    })
}
