//! Exponential and logarithm of a matrix that need not be normal.
//!
//! The exponential is computed by scaling, series and squaring. The logarithm takes square roots (Higham 2008,
//! chapters 6 and 11) until the series of `2 artanh(E(2 + E)⁻¹) = log(1 + E)` is short.

use super::base::{Matrix, Storage};
use super::function::{from_parts, parts_of};
use super::inverse::{balance, inverse};
use super::schur::{largest_argument, root};
use super::select::{Select, by_size};
use super::series::{EXP, LOG_LIMITS, Powers, exp_by, log_terms, terms};
use crate::scalar::{Lane, Scalar, lane, mask_bits};

/// `exp(A) − 1`.
pub fn exp_any_minus_one<S: Scalar, const D: usize, A: Storage>(a: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    exp_by(a, |a, n| Powers::of_any(a, n).sum(terms::<S>(&EXP, n)))
}

/// The sizes of Z up to which these numbers of terms of the series of artanh are accurate to rounding, derivatives
/// included.
const LIMITS: [f64; 4] = [0.05, 0.21, 0.42, 0.6];
const TERMS: [usize; 4] = [7, 13, 24, 39];
/// `artanh √x/√x`
const ARTANH: [f64; 42] = {
    let mut c = [0.0; 42];
    let mut j = 0;
    while j < 42 {
        c[j] = 1.0 / (2 * j + 1) as f64;
        j += 1;
    }
    c
};
/// Square roots halve a logarithm, whose size is below 2000 for finite numbers.
const ROOTS: usize = 16;
/// Below this angle an upper bound is returned.
const BOUND: f64 = 1.5;

/// The principal logarithm of 1 + E, and the largest |arg λ| of the eigenvalues of 1 + E, or an upper bound of it if
/// it is less than 1.5.
pub fn log_any_one_plus<S: Scalar, const D: usize, A: Storage>(
    e: &Matrix<S, D, A>,
) -> (Matrix<S, D, A>, Lane) {
    // The series in E is cheap where powers reduce to few coefficients; otherwise that of artanh has fewer products.
    let limits = if D == 1 && e.rows() < 5 { &LOG_LIMITS[..] } else { &[] };
    let log = by_size(e.size(), limits, |tier| {
        if tier == limits.len() {
            return by_artanh(e);
        }
        let c = log_terms::<S>(tier);
        Powers::of_any(e, c.len()).sum(c)
    });
    // By Bendixson's theorem; eigenvalues of real matrices come in pairs.
    let bound =
        log.value().skew_part().size() * lane(if D == 1 { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 });
    let sure = bound.simd_le(lane(BOUND));
    if sure.all() {
        return (log, bound);
    }
    (log, sure.select(bound, largest_argument(&e.value().plus_identity(Lane::ONE))))
}

/// The logarithm of 1 + E of any size.
fn by_artanh<S: Scalar, const D: usize, A: Storage>(e: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    let (mut near, mut factor) = (e.clone(), lane(2.0));
    let mut z = half_angle(&near);
    for _ in 0..ROOTS {
        let on = z.size().simd_gt(lane(LIMITS[3]));
        if on.none() {
            break;
        }
        near = Select::select(on, root_minus_one(&near, on), near);
        z = Select::select(on, half_angle(&near), z);
        factor = on.select(factor + factor, factor);
    }
    let square = z.times(&z);
    by_size(z.size(), &LIMITS[..3], |tier| {
        let n = TERMS[tier];
        z.times(&Powers::of_any(&square, n).sum(terms::<S>(&ARTANH, n)))
    })
    .scaled(factor)
}

/// `E (2 + E)⁻¹`: for a rotation by θ, i tan(θ/2).
fn half_angle<S: Scalar, const D: usize, A: Storage>(e: &Matrix<S, D, A>) -> Matrix<S, D, A> {
    e.times(&inverse(&e.clone().plus_identity(lane(2.0))))
}

/// `√(1 + E) − 1` on the lanes of a mask, by the iteration of Denman and Beavers in the form of Cheng, Higham, Kenney
/// and Laub, (6.29) of Higham (2008); where it is slow, near the negative numbers, by Schur's form.
fn root_minus_one<S: Scalar, const D: usize, A: Storage>(
    e: &Matrix<S, D, A>,
    mut on: Lane,
) -> Matrix<S, D, A> {
    const STEPS: usize = 9;
    // After a step the eigenvalues are (1 + λ)²/4λ: at least 1 for positive λ. Small eigenvalues have lost
    // significant digits.
    const SMALL: f64 = 0.1;
    let n = e.rows();
    let a = e.clone().plus_identity(Lane::ONE);
    let (mut m, mut x) = (a.clone(), a.clone());
    let tolerance = lane(4.0 * f64::EPSILON * n as f64);
    let half = lane(0.5);
    // Derivatives converge a step later.
    let mut late = lane(S::ORDER as f64);
    let mut lost = !on & on;
    for step in 0..STEPS + S::ORDER {
        let off = m.value().plus_identity(lane(-1.0)).size();
        let rough = on & !off.simd_le(tolerance);
        let moving = (rough | (on & late.simd_gt(Lane::ZERO))) & !lost;
        if moving.none() {
            break;
        }
        late = rough.select(late, late - Lane::ONE);
        let scale = off.simd_gt(half).select(balance(&m.value()), Lane::ONE);
        let back = inverse(&m);
        if step > 0 {
            lost |= moving & !back.value().size().simd_le(lane((n as f64).sqrt() / SMALL));
        }
        let (forth, back) = (m.scaled(scale), back.scaled(Lane::ONE / scale));
        let next_m = (&forth + &back).scaled(lane(0.25)).plus_identity(half);
        let next_x = x.times(&back.plus_identity(Lane::ONE)).scaled(half * scale.sqrt());
        (m, x) = (Select::select(moving, next_m, m), Select::select(moving, next_x, x));
    }
    on = lost | (on & !m.value().plus_identity(lane(-1.0)).size().simd_le(lane(4.0) * tolerance));
    if on.any() {
        let found = from_parts(n, n, &root::<D>(n, &parts_of(&a), mask_bits(on)));
        x = Select::select(on, found, x);
    }
    x.plus_identity(lane(-1.0))
}
