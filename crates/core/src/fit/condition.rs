//! The C² condition (13) of Theorem 2.2, on any knots.
//!
//! Velocities uᵢ rather than control points are the unknowns, so that (12), the C¹ condition, holds by itself. With `v⁺ = hᵢuᵢ/3`, `v⁻ = −hᵢ₋₁uᵢ/3`, `w⁺ = log_{pᵢ}(E(−v⁺)·q⁻ᵢ₊₁)`, `w⁻ = log_{pᵢ}(E(−v⁻)·q⁺ᵢ₋₁)`, the curve is C² at
//! knot i iff
//!
//! ```text
//! S(v⁻)(w⁺ − v⁺)/hᵢ² = S(v⁺)(w⁻ − v⁻)/hᵢ₋₁²,    S(v) = sinh(ad_v)/ad_v,
//! ```
//!
//! because the covariant acceleration beside the knot is `(6/h²) S(v)⁻¹(w − v)` (Popiel & Noakes 2007
//! with Lemmas A.1–A.3), and S of multiples of one vector commute. On equal spacing S cancels and
//! this is (13), whose logarithms are the w of (16) and, at all knots together, of (18).

use super::chain::Chain;
use super::ends::{self, ChainEnds};
use crate::scalar::{Lane, Scalar, lane, max_or_nan};
use crate::space::{Erased, Space};
use crate::with_size;

/// How far a lane is from C²: the largest defect, and the largest speed to measure it by.
#[derive(Clone, Copy)]
pub struct Defect {
    /// Largest defect, divided by 1/hᵢ₋₁ + 1/hᵢ: a velocity. At an end with not-a-knot it is that of the
    /// velocity there, divided by 1 + h₀/h₁: so much its formula makes of rounding in the other velocities.
    pub defect: Lane,
    /// Largest |uᵢ|.
    pub speed: Lane,
    /// Largest |h uᵢ/3|, the longest outer leg.
    pub leg: Lane,
}

/// Vectors of one node, kept between residuals.
pub struct NodeVectors<S> {
    pub(super) a: Vec<S>,
    pub(super) b: Vec<S>,
    pub(super) left: Vec<S>,
    pub(super) right: Vec<S>,
    next_left: Vec<S>,
}

impl<S> Default for NodeVectors<S> {
    fn default() -> Self {
        NodeVectors { a: vec![], b: vec![], left: vec![], right: vec![], next_left: vec![] }
    }
}

impl<S: Scalar> NodeVectors<S> {
    pub(super) fn resize(&mut self, m: usize) {
        for vector in [&mut self.a, &mut self.b, &mut self.left, &mut self.right, &mut self.next_left] {
            vector.resize(m, S::constant(Lane::ZERO));
        }
    }
}

const THIRD: Lane = lane(1.0 / 3.0);

/// Fills `chain.r` with right side minus left side of the C² condition at every node.
pub fn residual(space: &Erased, chain: &mut Chain, ends: &ChainEnds, work: &mut NodeVectors<Lane>) -> Defect {
    chain.with_velocities(|chain, u| {
        let mut r = std::mem::take(&mut chain.r);
        let at_rest = u.iter().fold(Lane::ZERO.simd_eq(Lane::ZERO), |rest, u| rest & u.simd_eq(Lane::ZERO));
        let defect = space.0.sweep(chain, ends, u, &mut r, work, at_rest);
        chain.r = r;
        defect
    })
}

/// The same for velocities u that may carry derivatives. On lanes whose velocities are zero the logarithms are
/// the chords, to the last bit.
pub fn sweep<S: Scalar, M: Space>(
    space: &M,
    chain: &mut Chain,
    ends: &ChainEnds,
    u: &[S],
    r: &mut [S],
    work: &mut NodeVectors<S>,
    at_rest: Lane,
) -> Defect {
    work.resize(chain.m);
    with_size!(M::VECTORS, chain.m, m => inside(space, chain, ends, u, r, work, at_rest, m))
}

/// The same of plain numbers, compiled once.
pub fn sweep_by_table(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    u: &[Lane],
    r: &mut [Lane],
    work: &mut NodeVectors<Lane>,
    at_rest: Lane,
) -> Defect {
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
) -> Defect {
    let (n, keep) = (chain.n, space.chord_len());
    let NodeVectors { a, b, left, right, next_left } = work;
    let (a, b) = (&mut a[..m], &mut b[..m]);
    let (mut left, right, mut next_left) = (&mut left[..m], &mut right[..m], &mut next_left[..m]);
    let mut result = Defect { defect: Lane::ZERO, speed: Lane::ZERO, leg: Lane::ZERO };
    let mut first_right = Lane::ZERO;
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
                space.legs(chord, prepared, a, b, right, next_left);
            }
            if at_rest.any() {
                for c in 0..m {
                    right[c] = S::select(at_rest, S::constant(chord[c]), right[c]);
                    next_left[c] = S::select(at_rest, S::constant(-chord[c]), next_left[c]);
                }
            }
            let scale = Lane::ONE / (h_right * h_right);
            for c in 0..m {
                right[c] = (right[c] - a[c]) * scale;
                next_left[c] = (next_left[c] + b[c]) * scale;
            }
        }
        let speed2 = length2(&u[..m]);
        result.speed = max_or_nan(result.speed, speed2);
        let h = h_left.max(h_right) * THIRD;
        result.leg = max_or_nan(result.leg, h * h * speed2);

        let r = &mut all_r[i * m..][..m];
        if i > 0 && i < n {
            join(space, h_left, h_right, &u[..m], left, right, r);
            let weight = h_left * h_right / (h_left + h_right);
            result.defect = max_or_nan(result.defect, length2(r) * (weight * weight));
        } else {
            // An end: keep the side that is there, the end condition comes below.
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
            let first = ends::defect(&Erased(space), chain, all_u, all_r, work, 0, &kinds[0]);
            max_or_nan(first, ends::defect(&Erased(space), chain, all_u, all_r, work, 1, &kinds[1]))
        }
    };
    result.defect = max_or_nan(result.defect, at_ends).sqrt();
    (result.speed, result.leg) = (result.speed.sqrt(), result.leg.sqrt());
    result
}

/// Squared length of the value of a coordinate vector.
#[inline(always)]
pub fn length2<S: Scalar>(x: &[S]) -> Lane {
    x.iter().fold(Lane::ZERO, |sum, x| x.value().mul_add(x.value(), sum))
}

/// The defect at a knot, `S(v⁻) right − S(v⁺) left`; `left` and `right` are overwritten.
#[inline(always)]
fn join<S: Scalar, M: Space>(
    space: &M,
    h_left: Lane,
    h_right: Lane,
    u: &[S],
    left: &mut [S],
    right: &mut [S],
    r: &mut [S],
) {
    let m = u.len();
    // Spacing that is equal up to the rounding of the knots needs no S: it would change the
    // defect by less than rounding.
    let equal = (h_left - h_right).abs().simd_le(h_right * lane(4.0 * f64::EPSILON));
    for c in 0..m {
        r[c] = right[c] - left[c];
    }
    if equal.all() {
        return;
    }
    stretch_by(space, h_left * THIRD, u, right);
    stretch_by(space, h_right * THIRD, u, left);
    for c in 0..m {
        r[c] = S::select(equal, r[c], right[c] - left[c]);
    }
}

/// `S(factor · u) x`.
#[inline(always)]
pub fn stretch_by<S: Scalar, M: Space>(space: &M, factor: Lane, u: &[S], x: &mut [S]) {
    const SMALL: usize = 16;
    if u.len() <= SMALL {
        let mut v = [S::constant(Lane::ZERO); SMALL];
        for c in 0..u.len() {
            v[c] = u[c] * factor;
        }
        space.stretch(&v[..u.len()], x);
    } else {
        space.stretch(&u.iter().map(|&u| u * factor).collect::<Vec<_>>(), x);
    }
}

/// The defect at the seam of a closed curve: the left side comes from the last node.
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
    chain.across_seam(space, false, left);
    let h_left = chain.h[n - 1];
    join(space, h_left, h_right, &all_u[..m], left, right, r);
    all_r[..m].copy_from_slice(r);
    all_r[n * m..].fill(S::constant(Lane::ZERO));
    let weight = h_left * h_right / (h_left + h_right);
    length2(r) * (weight * weight)
}
