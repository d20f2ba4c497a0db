//! End conditions: the row of an end of the flat-space matrix T, and its residual.

use super::chain::Chain;
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::node::NodeVectors;
use super::vector::{length2, stretch_by};
use crate::scalar::{LANES, Lane, Scalar, lane};
use crate::space::{Erased, Origin};

const ONE: Lane = Lane::ONE;
const TWO: Lane = lane(2.0);
const THIRD: Lane = lane(1.0 / 3.0);

/// One of the ends of a chain of n segments: its node and the neighbour, the segment between them, and the next one.
pub(super) struct ChainEnd {
    pub node: usize,
    pub next: usize,
    pub near: usize,
    pub far: usize,
}

impl ChainEnd {
    pub fn of(which: usize, n: usize) -> Self {
        if which == 0 {
            ChainEnd { node: 0, next: 1, near: 0, far: 1.min(n - 1) }
        } else {
            ChainEnd { node: n, next: n - 1, near: n - 1, far: n.max(2) - 2 }
        }
    }
}

/// Diagonal and off-diagonal of an end row of T, lane by lane.
pub fn row(chain: &Chain, which: usize, kinds: &[EndKind; LANES]) -> (Lane, Lane) {
    let ChainEnd { near, far, .. } = ChainEnd::of(which, chain.n);
    let (h0, h1) = (chain.h[near], chain.h[far]);
    let velocity = of_kind(kinds, EndKind::Velocity);
    let knot = of_kind(kinds, EndKind::NotAKnot);
    let inverse = ONE / h0;
    let free = match &chain.joints[which] {
        Some(joint) => of_kind(kinds, EndKind::Both).select(joint.diagonal(h0), TWO * inverse),
        None => TWO * inverse,
    };
    ((velocity | knot).select(ONE, free), velocity.select(Lane::ZERO, knot.select(ONE + h0 / h1, inverse)))
}

/// The residual at an open end; `all_r` holds the side of its only segment. Returns its squared size.
pub fn residual<S: Scalar>(
    space: &Erased,
    chain: &Chain,
    all_u: &[S],
    all_r: &mut [S],
    work: &mut NodeVectors<S>,
    which: usize,
    kinds: &[EndKind; LANES],
) -> Lane {
    let (n, m) = (chain.n, chain.m);
    let ChainEnd { node, next, near, far } = ChainEnd::of(which, n);
    let (h0, h1) = (chain.h[near], chain.h[far]);
    let sign = if which == 0 { ONE } else { -ONE };
    let joined = chain.joints[which].as_ref().map(|joint| {
        let (u, beside) = (&all_u[node * m..(node + 1) * m], &all_u[next * m..(next + 1) * m]);
        let mut found = vec![S::constant(Lane::ZERO); m];
        joint.residual(space, h0, sign, u, beside, work, &mut found);
        found
    });
    let NodeVectors { a, b, .. } = work;
    let u = &all_u[node * m..(node + 1) * m];
    let value = &chain.end_values[which];
    let r = &mut all_r[node * m..(node + 1) * m];

    // Acceleration A: w − v = (h²/6) S(v) A.
    for c in 0..m {
        a[c] = S::constant(value[c]);
    }
    if value.iter().any(|x| x.simd_ne(Lane::ZERO).any()) {
        stretch_by(space, h0 * THIRD, u, a);
    }
    for c in 0..m {
        a[c] = (r[c] - a[c] * lane(1.0 / 6.0)) * sign;
    }
    let mut size = length2(a) * (h0 * h0);
    let velocity = of_kind(kinds, EndKind::Velocity);
    if velocity.any() {
        for c in 0..m {
            b[c] = -u[c] + value[c];
        }
        size = velocity.select(length2(b), size);
        for c in 0..m {
            a[c] = S::select(velocity, b[c] * THIRD, a[c]);
        }
    }
    let knot = of_kind(kinds, EndKind::NotAKnot);
    if knot.any() {
        let weights = NotAKnot::of(h0, h1, n, false);
        let chord = |i: usize| &chain.chord[i * m..(i + 1) * m];
        weights.velocity(space, chord(near), chord(far), &all_u[next * m..(next + 1) * m], b);
        for c in 0..m {
            b[c] = b[c] - u[c];
        }
        let weight = h1 / (h0 + h1);
        size = knot.select(length2(b) * (weight * weight), size);
        for c in 0..m {
            a[c] = S::select(knot, b[c] * THIRD, a[c]);
        }
    }
    if let Some(joined) = joined {
        let both = of_kind(kinds, EndKind::Both);
        size = both.select(length2(&joined) * (h0 * h0), size);
        for c in 0..m {
            a[c] = S::select(both, joined[c], a[c]);
        }
    }
    r.copy_from_slice(a);
    size
}

/// The end velocity of the not-a-knot condition. With c the cubic in `T_{p₁}M` through `x₀ = log_{p₁}(p₀)`, 0 and `x₂
/// = log_{p₁}(p₂)` with `c'(t₁) = u₁`, it is `D exp_{p₁}(x₀)[c'(t₀)]`, or `S(x₀) c'(t₀)` in the frame at p₀.
///
/// These are the weights of u₁, of the chord at the end and of the next chord in c'(t₀). They are the same at the
/// right end, where all vectors change sign.
pub struct NotAKnot<S> {
    /// Of u₁.
    pub u: S,
    /// Of the chord at the end.
    pub near: S,
    /// Of the next chord.
    pub far: S,
}

impl<S: Scalar> NotAKnot<S> {
    /// For a curve of n segments, the first two of lengths h₀ and h₁. Few points follow the rules of SciPy: two
    /// points give the geodesic, and three points with not-a-knot at `both` ends give one parabola.
    pub fn of(h0: S, h1: S, n: usize, both: bool) -> Self {
        let (i0, i1, i01) = (reciprocal(h0), reciprocal(h1), reciprocal(h0 + h1));
        let zero = S::constant(Lane::ZERO);
        if n == 1 {
            NotAKnot { u: zero, near: i0, far: zero }
        } else if n == 2 && both {
            NotAKnot { u: zero, near: i0 * TWO - h1 * i0 * i01, far: -(h0 * i1 * i01) }
        } else {
            let q = h0 * i1;
            NotAKnot { u: -(q + ONE), near: i0 * TWO + i01, far: q * q * i01 }
        }
    }
}

impl NotAKnot<Lane> {
    /// `S(d₀) c'(t₀)`
    pub fn velocity<S: Scalar>(&self, space: &Erased, d0: &[Lane], d1: &[Lane], u1: &[S], out: &mut [S]) {
        for c in 0..u1.len() {
            out[c] = u1[c] * self.u + (self.near * d0[c] + self.far * d1[c]);
        }
        let d0: Vec<S> = d0.iter().map(|&d| S::constant(d)).collect();
        space.stretch(&d0, out);
    }
}

fn reciprocal<S: Scalar>(x: S) -> S {
    let i = ONE / x.value();
    x.compose([i, -(i * i), TWO * i * i * i])
}

/// Not-a-knot ends of curves with so few points that the condition determines the velocity.
pub fn few_points(space: &Erased, chain: &mut Chain, ends: ChainEnds) -> ChainEnds {
    let ChainEnds::Open(mut kinds) = ends else { return ends };
    let (n, m) = (chain.n, chain.m);
    let knots = kinds.map(|k| k[0] == EndKind::NotAKnot);
    if n > 2 || (n == 2 && knots != [true, true]) {
        return ends;
    }
    for which in (0..2).filter(|&e| knots[e]) {
        let ChainEnd { near, far, .. } = ChainEnd::of(which, n);
        let weights = NotAKnot::of(chain.h[near], chain.h[far], n, true);
        let chord = |i: usize| &chain.chord[i * m..(i + 1) * m];
        let mut value = vec![Lane::ZERO; m];
        weights.velocity(space, chord(near), chord(far), &vec![Lane::ZERO; m], &mut value);
        chain.end_values[which] = value;
        kinds[which] = [EndKind::Velocity; LANES];
    }
    ChainEnds::Open(kinds)
}
