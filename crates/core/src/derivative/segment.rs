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

use super::operators::{Few, Functions, Square};
use crate::scalar::{Dual, LANES, Lane, Scalar, lane};
use crate::space::{Erased, Origin};
use smallvec::smallvec;

/// One side, `(w⁺ − a)/h²` at the first knot of a segment or `(w⁻ + b)/h²` at the last, and its derivatives.
#[derive(Clone)]
pub struct Side {
    pub value: Vec<Lane>,
    /// With respect to the velocities at the two knots.
    pub u: [Square; 2],
    /// With respect to the points.
    pub points: [Square; 2],
    /// With respect to h.
    pub length: Vec<Lane>,
}

/// One end of a segment on each lane.
#[derive(Clone)]
pub struct SegmentEnd {
    pub h: Lane,
    /// h u/3
    pub handle: Vec<Lane>,
    /// Functions of ad of the handle.
    pub functions: Functions,
    /// Expressed here.
    pub side: Side,
    work: Square,
}

impl SegmentEnd {
    pub fn new(m: usize) -> Self {
        let (square, vector) = (|| Square::zeros(m), || vec![Lane::ZERO; m]);
        SegmentEnd {
            h: Lane::ONE,
            handle: vector(),
            functions: Functions::new(m),
            side: Side {
                value: vector(),
                u: [square(), square()],
                points: [square(), square()],
                length: vector(),
            },
            work: square(),
        }
    }

    /// Applies a function to the numbers of two ends and keeps the results here.
    fn zip(&mut self, other: &Self, f: impl Fn(Lane, Lane) -> Lane) {
        let apply = |a: &mut [Lane], b: &[Lane]| a.iter_mut().zip(b).for_each(|(a, b)| *a = f(*a, *b));
        self.h = f(self.h, other.h);
        apply(&mut self.handle, &other.handle);
        apply(self.functions.stretch.numbers_mut(), other.functions.stretch.numbers());
        let (side, other) = (&mut self.side, &other.side);
        apply(&mut side.value, &other.value);
        apply(&mut side.length, &other.length);
        let squares = side.u.iter_mut().chain(&mut side.points).zip(other.u.iter().chain(&other.points));
        squares.for_each(|(a, b)| apply(a.numbers_mut(), b.numbers()));
    }

    /// Replaces the lanes of a mask by those of another end, except for functions that are not needed further.
    pub fn replace(&mut self, mask: Lane, other: &Self) {
        self.zip(other, |a, b| mask.select(b, a));
    }

    /// The same with other lanes.
    pub fn permuted(&self, from: [usize; LANES]) -> Self {
        let mut out = self.clone();
        out.zip(self, |_, b| Lane::new(from.map(|l| b.as_array()[l])));
        out
    }
}

/// Computes both ends of a segment from its length, its chord and its velocities.
pub fn linearise(space: &Erased, h: Lane, chord: &[Lane], u: [&[Lane]; 2], ends: &mut [SegmentEnd; 2]) {
    let third = h * lane(1.0 / 3.0);
    let square = Lane::ONE / (h * h);
    for (end, u) in ends.iter_mut().zip(u) {
        end.h = h;
        end.handle.iter_mut().zip(u).for_each(|(handle, u)| *handle = *u * third);
        end.functions.set(space, &end.handle);
    }
    logarithms(space, chord, ends);
    let [start, end] = ends;
    start.finish(space, 0, &end.functions.coth, u, (square, third));
    end.finish(space, 1, &start.functions.coth, u, (square, third));
}

impl SegmentEnd {
    /// From the logarithm in `side.value` and its derivatives in `side.u` to the side of the condition. `coth` is that of the
    /// handle at the other end.
    fn finish(
        &mut self,
        space: &Erased,
        which: usize,
        coth: &Square,
        u: [&[Lane]; 2],
        (square, third): (Lane, Lane),
    ) {
        let SegmentEnd { h, handle, functions, side, work } = self;
        let sign = lane(if which == 0 { 1.0 } else { -1.0 });
        // A motion of p₀ changes a by ad coth ξ, a motion of p₁ changes b by −ad coth η; the nearer one rotates the
        // handle.
        let other = 1 - which;
        side.points[which].set_product(&side.u[which], &functions.coth);
        side.points[other].set_product(&side.u[other], coth);
        side.points[1].scale(-Lane::ONE);
        work.set_curvature(space, handle, &side.value);
        side.points[which].add_product(sign, work, &functions.tanh);
        side.u[which].add_identity(-sign);
        for (value, handle) in side.value.iter_mut().zip(&*handle) {
            *value = (*value - *handle * sign) * square;
        }
        for (length, value) in side.length.iter_mut().zip(&side.value) {
            *length = *value * (lane(-2.0) / *h);
        }
        for k in 0..2 {
            side.u[k].act(square * lane(1.0 / 3.0), u[k], &mut side.length);
            side.u[k].scale(square * third);
            side.points[k].scale(square);
        }
    }
}

/// Expresses the last end of segments in other frames, on the lanes of a mask: `turn` maps coordinates in these frames to
/// those of the segments, and `back` is its inverse.
pub fn turn_last([start, end]: &mut [SegmentEnd; 2], mask: Lane, turn: &Square, back: &Square) {
    let mut turned = Square::zeros(end.handle.len());
    let replace = |old: &mut [Lane], new: &[Lane]| {
        old.iter_mut().zip(new).for_each(|(old, new)| *old = mask.select(*new, *old));
    };
    for side in [&mut start.side, &mut end.side] {
        for block in [&mut side.u[1], &mut side.points[1]] {
            turned.set_product(block, turn);
            replace(block.numbers_mut(), turned.numbers());
        }
    }
    let side = &mut end.side;
    for block in side.u.iter_mut().chain(&mut side.points) {
        turned.set_product(back, block);
        replace(block.numbers_mut(), turned.numbers());
    }
    for vector in [&mut side.value, &mut side.length] {
        let mut turned = vec![Lane::ZERO; vector.len()];
        back.act(Lane::ONE, vector, &mut turned);
        replace(vector, &turned);
    }
}

/// w⁺ and w⁻, and their derivatives in a and b, which are written to the sides.
fn logarithms(space: &Erased, chord: &[Lane], ends: &mut [SegmentEnd; 2]) {
    let m = chord.len();
    let mut prepared: Few<Lane> = smallvec![Lane::ZERO; space.chord_len()];
    space.prepare(chord, &mut prepared);
    let [start, end] = ends;
    let constant = |x: &[Lane]| -> Few<Dual> { x.iter().map(|&x| Dual::constant(x)).collect() };
    let (mut a, mut b) = (constant(&start.handle), constant(&end.handle));
    let (mut plus, mut minus) = (a.clone(), a.clone());
    for k in 0..2 * m {
        let seed = |a: &mut [Dual], b: &mut [Dual], d: Lane| if k < m { a[k].d = d } else { b[k - m].d = d };
        seed(&mut a, &mut b, Lane::ONE);
        space.inner_handles(chord, &prepared, &a, &b, &mut plus, &mut minus);
        seed(&mut a, &mut b, Lane::ZERO);
        for (side, w) in [(&mut start.side, &plus), (&mut end.side, &minus)] {
            let column = side.u[k / m].numbers_mut()[k % m..].iter_mut().step_by(m);
            column.zip(w).for_each(|(out, w)| *out = w.d);
        }
    }
    for (side, w) in [(&mut start.side, &plus), (&mut end.side, &minus)] {
        side.value.iter_mut().zip(w).for_each(|(value, w)| *value = w.v);
    }
}
