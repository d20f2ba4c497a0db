//! The C² condition (13) of Theorem 2.2, on any knots.
//!
//! The unknowns are velocities uᵢ instead of control points, so that (12), the C¹ condition, holds automatically.
//! With `v⁺ = hᵢuᵢ/3`, `v⁻ = −hᵢ₋₁uᵢ/3`, `w⁺ = log_{pᵢ}(E(−v⁺)·q⁻ᵢ₊₁)`, `w⁻ = log_{pᵢ}(E(−v⁻)·q⁺ᵢ₋₁)`, the curve is
//! C² at knot i iff
//!
//! ```text
//! S(v⁻)(w⁺ − v⁺)/hᵢ² = S(v⁺)(w⁻ − v⁻)/hᵢ₋₁²,    S(v) = sinh(ad_v)/ad_v,
//! ```
//!
//! because the covariant acceleration at the knot is `(6/h²) S(v)⁻¹(w − v)` (Popiel & Noakes 2007 with Lemmas
//! A.1–A.3), and S of multiples of one vector commute. On equal spacing S cancels and this is (13). Its logarithms
//! are the w of (16) and, at all knots together, of (18).

use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::ends;
use super::node::{C2Residual, NodeVectors};
use super::vector::{length2, stretch_by};
use crate::scalar::{Lane, Scalar, lane, max_or_nan};
use crate::space::{Erased, Space};
use crate::with_size;

const THIRD: Lane = lane(1.0 / 3.0);

/// Fills `chain.r` with the right-hand side minus the left-hand side of the C² condition at every node.
pub fn residual(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    work: &mut NodeVectors<Lane>,
) -> C2Residual {
    chain.with_velocities(|chain, u| {
        let mut r = std::mem::take(&mut chain.r);
        let mut at_rest = Lane::ZERO.simd_eq(Lane::ZERO);
        for u in u {
            at_rest &= u.simd_eq(Lane::ZERO);
            if at_rest.none() {
                break;
            }
        }
        let residual = space.0.sweep(chain, ends, u, &mut r, work, at_rest);
        chain.r = r;
        residual
    })
}

/// The same for velocities u that may have derivatives. On lanes with zero velocities the logarithms are
/// bit-identical to the chords.
pub fn sweep<S: Scalar, M: Space>(
    space: &M,
    chain: &mut Chain,
    ends: &ChainEnds,
    u: &[S],
    r: &mut [S],
    work: &mut NodeVectors<S>,
    at_rest: Lane,
) -> C2Residual {
    work.resize(chain.m);
    with_size!(M::VECTORS, chain.m, m => inside(space, chain, ends, u, r, work, at_rest, m))
}

/// The same for plain numbers, compiled once.
pub fn sweep_by_table(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    u: &[Lane],
    r: &mut [Lane],
    work: &mut NodeVectors<Lane>,
    at_rest: Lane,
) -> C2Residual {
    sweep(space, chain, ends, u, r, work, at_rest)
}

#[inline(always)]
fn inside<S: Scalar, M: Space>(
    space: &M,
    chain: &mut Chain,
    ends: &ChainEnds,
    all_u: &[S],
    all_r: &mut [S],
    work: &mut NodeVectors<S>,
    at_rest: Lane,
    m: usize,
) -> C2Residual {
    let (n, keep) = (chain.n, space.chord_len());
    let NodeVectors { a, b, left, right, next_left } = work;
    let (a, b) = (&mut a[..m], &mut b[..m]);
    let (mut left, right, mut next_left) = (&mut left[..m], &mut right[..m], &mut next_left[..m]);
    let mut result = C2Residual { residual: Lane::ZERO, speed: Lane::ZERO, handle: Lane::ZERO };
    let mut first_right = Lane::ZERO;
    let (mut scaled, mut scale) = (Lane::ZERO, Lane::ZERO);
    for i in 0..=n {
        let (h_left, h_right) = (chain.h[i.max(1) - 1], chain.h[i.min(n - 1)]);
        let u = &all_u[i * m..][..if i < n { 2 * m } else { m }];
        if i < n {
            let third = h_right * THIRD;
            for c in 0..m {
                a[c] = u[c] * third;
                b[c] = u[m + c] * third;
            }
            let (chord, prepared) = (&chain.chord[i * m..][..m], &chain.prepared[i * keep..][..keep]);
            if !at_rest.all() {
                space.inner_handles(chord, prepared, a, b, right, next_left);
            }
            if at_rest.any() {
                for c in 0..m {
                    right[c] = S::select(at_rest, S::constant(chord[c]), right[c]);
                    next_left[c] = S::select(at_rest, S::constant(-chord[c]), next_left[c]);
                }
            }
            // Divisions are slow, and segments are often of equal length.
            if !h_right.simd_eq(scaled).all() {
                (scaled, scale) = (h_right, Lane::ONE / (h_right * h_right));
            }
            for c in 0..m {
                right[c] = (right[c] - a[c]) * scale;
                next_left[c] = (next_left[c] + b[c]) * scale;
            }
        }
        let speed2 = length2(&u[..m]);
        result.speed = max_or_nan(result.speed, speed2);
        let h = h_left.max(h_right) * THIRD;
        result.handle = max_or_nan(result.handle, h * h * speed2);

        let r = &mut all_r[i * m..][..m];
        if i > 0 && i < n {
            let weight = join(space, h_left, h_right, &u[..m], left, right, r);
            result.residual = max_or_nan(result.residual, length2(r) * (weight * weight));
        } else {
            // An open end: keep the side of its only segment. The end condition is applied below.
            r.copy_from_slice(if i == 0 { &*right } else { &*left });
            if i == 0 {
                first_right = h_right;
            }
        }
        std::mem::swap(&mut left, &mut next_left);
    }
    let at_ends = match ends {
        ChainEnds::Periodic => close(&Erased(space), chain, all_u, all_r, work, first_right),
        ChainEnds::Open(kinds) => {
            let first = ends::residual(&Erased(space), chain, all_u, all_r, work, 0, &kinds[0]);
            max_or_nan(first, ends::residual(&Erased(space), chain, all_u, all_r, work, 1, &kinds[1]))
        }
    };
    result.residual = max_or_nan(result.residual, at_ends).sqrt();
    (result.speed, result.handle) = (result.speed.sqrt(), result.handle.sqrt());
    result
}

/// The residual at a knot, `S(v⁻) right − S(v⁺) left`; `left` and `right` are overwritten. Returns the factor that makes
/// it a velocity, 1/(1/h + 1/h) of the two segments.
#[inline(always)]
fn join<S: Scalar, M: Space>(
    space: &M,
    h_left: Lane,
    h_right: Lane,
    u: &[S],
    left: &mut [S],
    right: &mut [S],
    r: &mut [S],
) -> Lane {
    let m = u.len();
    // Spacing that is equal up to the rounding of the knots needs no S, which would change the residual by less than
    // rounding.
    let equal = (h_left - h_right).abs().simd_le(h_right * lane(4.0 * f64::EPSILON));
    for c in 0..m {
        r[c] = right[c] - left[c];
    }
    if equal.all() {
        return h_right * lane(0.5);
    }
    stretch_by(space, h_left * THIRD, u, right);
    stretch_by(space, h_right * THIRD, u, left);
    for c in 0..m {
        r[c] = S::select(equal, r[c], right[c] - left[c]);
    }
    h_left * h_right / (h_left + h_right)
}

/// The residual at the first node of a closed curve: the left-hand side comes from the last node.
fn close<S: Scalar>(
    space: &Erased,
    chain: &mut Chain,
    all_u: &[S],
    all_r: &mut [S],
    work: &mut NodeVectors<S>,
    h_right: Lane,
) -> Lane {
    let (n, m) = (chain.n, chain.m);
    let NodeVectors { left, right, b: r, .. } = work;
    left.copy_from_slice(&all_r[n * m..]);
    right.copy_from_slice(&all_r[..m]);
    chain.across_closure(space, false, left);
    let h_left = chain.h[n - 1];
    let weight = join(space, h_left, h_right, &all_u[..m], left, right, r);
    all_r[..m].copy_from_slice(r);
    all_r[n * m..].fill(S::constant(Lane::ZERO));
    length2(r) * (weight * weight)
}
