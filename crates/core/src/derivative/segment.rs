//! The two sides of a segment in the C² condition, linearised, with one segment per lane.
//!
//! Let p₀ and p₁ move by ξ and η in frames that follow them: g₀ becomes g₀E(εξ), g₁ becomes g₁E(εη). With
//!
//! ```text
//! E(εξ)E(a) = E(a + ε ad_a coth(ad_a) ξ)(1 − ε tanh(ad_a/2) ξ)     to first order
//! ```
//!
//! (the components in 𝔪 and 𝔥 of E(−a)ξE(a) = e^{−ad_a} ξ) the handles `w⁺ = log_o(E(−a)E(−εξ)E(d)E(εη)E(−b)·o)` are
//! those of changed a and b, rotated by an element of the isotropy group.

use super::operators::{Few, Functions, Square, act, axis, curvature};
use crate::matrix::Select;
use crate::scalar::{Dual, LANES, Lane, Scalar, lane};
use crate::space::{Erased, Origin};
use smallvec::smallvec;

/// One side, `(w⁺ − a)/h²` at the first knot of a segment or `(w⁻ + b)/h²` at the last, and its derivatives.
#[derive(Clone)]
pub struct Side {
    pub value: Few<Lane>,
    /// With respect to the velocities at the two knots.
    pub u: [Square; 2],
    /// With respect to the points.
    pub points: [Square; 2],
    /// With respect to h.
    pub length: Few<Lane>,
}

/// One end of a segment on each lane.
#[derive(Clone)]
pub struct SegmentEnd {
    pub h: Lane,
    /// h u/3
    pub handle: Few<Lane>,
    /// S and cosh of ad of the handle.
    pub stretch: Square,
    pub cosh: Square,
    /// Expressed here.
    pub side: Side,
}

/// Both ends of a segment from its length, its chord and its velocities.
pub fn linearised(space: &Erased, h: Lane, chord: &[Lane], u: [&[Lane]; 2]) -> [SegmentEnd; 2] {
    let third = h * lane(1.0 / 3.0);
    let handles = u.map(|u| -> Few<Lane> { u.iter().map(|u| *u * third).collect() });
    let functions = [Functions::of(space, &handles[0]), Functions::of(space, &handles[1])];
    let (w, slopes) = logarithms(space, chord, &handles);
    let square = Lane::ONE / (h * h);
    [0, 1].map(|which| {
        let (handle, w) = (&handles[which], &w[which]);
        let [at_a, at_b] = &slopes[which];
        // A motion of p₀ changes a by ad coth ξ, a motion of p₁ changes b by −ad coth η; the nearer one rotates the
        // handle.
        let mut points = [at_a.times(&functions[0].coth), -at_b.times(&functions[1].coth)];
        let turn = curvature(space, handle, w).times(&functions[which].tanh);
        let sign = lane(if which == 0 { 1.0 } else { -1.0 });
        points[which] = &points[which] + &turn.scaled(sign);
        let mut slopes = [at_a.clone(), at_b.clone()];
        slopes[which] = slopes[which].clone().plus_identity(-sign);
        let value: Few<Lane> = w.iter().zip(handle).map(|(w, x)| (*w - *x * sign) * square).collect();
        let [by_a, by_b] = [act(&slopes[0], u[0]), act(&slopes[1], u[1])];
        let length = (0..value.len())
            .map(|i| (by_a[i] + by_b[i]) * (square * lane(1.0 / 3.0)) - value[i] * (lane(2.0) / h))
            .collect();
        let side = Side {
            value,
            u: slopes.map(|x| x.scaled(square * third)),
            points: points.map(|x| x.scaled(square)),
            length,
        };
        let Functions { stretch, cosh, .. } = &functions[which];
        SegmentEnd { h, handle: handle.clone(), stretch: stretch.clone(), cosh: cosh.clone(), side }
    })
}

/// Expresses the last end of segments in other frames, on the lanes of a mask: `turn` maps coordinates in these frames to
/// those of the segments, and `back` is its inverse.
pub fn turn_last([start, end]: &mut [SegmentEnd; 2], mask: Lane, turn: &Square, back: &Square) {
    let replace = |old: &mut Square, new: Square| *old = Select::select(mask, new, old.clone());
    for side in [&mut start.side, &mut end.side] {
        for block in [&mut side.u[1], &mut side.points[1]] {
            let turned = block.times(turn);
            replace(block, turned);
        }
    }
    let side = &mut end.side;
    for block in side.u.iter_mut().chain(&mut side.points) {
        let turned = back.times(block);
        replace(block, turned);
    }
    for vector in [&mut side.value, &mut side.length] {
        let turned = act(back, vector);
        vector.iter_mut().zip(turned).for_each(|(x, turned)| *x = mask.select(turned, *x));
    }
}

impl SegmentEnd {
    /// Applies a function to the numbers of two ends.
    fn zip(&self, other: &Self, f: impl Fn(Lane, Lane) -> Lane) -> Self {
        let vector =
            |a: &[Lane], b: &[Lane]| -> Few<Lane> { a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect() };
        let square =
            |a: &Square, b: &Square| Square::from_fn(a.rows(), a.cols(), |r, c| [f(a[(r, c)][0], b[(r, c)][0])]);
        let pair = |a: &[Square; 2], b: &[Square; 2]| [square(&a[0], &b[0]), square(&a[1], &b[1])];
        SegmentEnd {
            h: f(self.h, other.h),
            handle: vector(&self.handle, &other.handle),
            stretch: square(&self.stretch, &other.stretch),
            cosh: square(&self.cosh, &other.cosh),
            side: Side {
                value: vector(&self.side.value, &other.side.value),
                u: pair(&self.side.u, &other.side.u),
                points: pair(&self.side.points, &other.side.points),
                length: vector(&self.side.length, &other.side.length),
            },
        }
    }

    /// This end on the lanes of a mask, the other one elsewhere.
    pub fn select(&self, mask: Lane, other: &Self) -> Self {
        self.zip(other, |a, b| mask.select(a, b))
    }

    /// The ends of other lanes.
    pub fn permuted(&self, from: [usize; LANES]) -> Self {
        self.zip(self, |a, _| Lane::new(from.map(|l| a.as_array()[l])))
    }
}

/// w⁺ and w⁻, and their derivatives in a and b.
fn logarithms(
    space: &Erased,
    chord: &[Lane],
    [a, b]: &[Few<Lane>; 2],
) -> ([Few<Lane>; 2], [[Square; 2]; 2]) {
    let m = chord.len();
    let mut prepared: Few<Lane> = smallvec![Lane::ZERO; space.chord_len()];
    space.prepare(chord, &mut prepared);
    let zero: Few<Dual> = smallvec![Dual::constant(Lane::ZERO); m];
    let mut w = [zero.clone(), zero];
    let square = || Square::zeros(m, m);
    let mut slopes = [[square(), square()], [square(), square()]];
    for k in 0..2 * m {
        let seeded = |x: &[Lane], from: usize| -> Few<Dual> {
            x.iter().enumerate().map(|(r, &v)| Dual { v, d: axis(from + r, k) }).collect()
        };
        let [plus, minus] = &mut w;
        space.inner_handles(chord, &prepared, &seeded(a, 0), &seeded(b, m), plus, minus);
        for (w, slopes) in w.iter().zip(&mut slopes) {
            w.iter().enumerate().for_each(|(r, w)| slopes[k / m][(r, k % m)] = [w.d]);
        }
    }
    (w.map(|w| w.iter().map(|w| w.v).collect()), slopes)
}
