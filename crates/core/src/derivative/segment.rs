//! The two sides of a segment in the C² condition, linearised.
//!
//! Let p₀ and p₁ move by ξ and η in frames that follow them: g₀ becomes g₀E(εξ), g₁ becomes g₁E(εη). With
//!
//! ```text
//! E(εξ)E(a) = E(a + ε ad_a coth(ad_a) ξ)(1 − ε tanh(ad_a/2) ξ)     to first order
//! ```
//!
//! (the components in 𝔪 and 𝔥 of E(−a)ξE(a) = e^{−ad_a} ξ) the handles `w⁺ = log_o(E(−a)E(−εξ)E(d)E(εη)E(−b)·o)` are
//! those of changed a and b, rotated by an element of the isotropy group.

use super::operators::{Few, Functions, Matrix, Vector, columns, curvature, splat, unit};
use crate::scalar::{Dual, Lane, Scalar, lane};
use crate::space::{Erased, Origin};
use smallvec::smallvec;

/// One side, `(w⁺ − a)/h²` at the first knot of a segment or `(w⁻ + b)/h²` at the last, and its derivatives.
pub struct Side {
    pub value: Vector,
    /// With respect to the velocities at the two knots.
    pub u: [Matrix; 2],
    /// With respect to the points.
    pub points: [Matrix; 2],
    /// With respect to h.
    pub length: Vector,
}

/// A segment of a curve.
pub struct LinearisedSegment {
    pub h: f64,
    /// h u/3 at the two knots.
    pub handles: [Vector; 2],
    /// Functions of ad of the handles.
    pub functions: [Functions; 2],
    /// Expressed at the two knots.
    pub sides: [Side; 2],
}

impl LinearisedSegment {
    pub fn new(space: &Erased, h: f64, chord: &Vector, u: [&Vector; 2]) -> Self {
        let m = chord.len();
        let [a, b] = u.map(|u| u * (h / 3.0));
        let functions = [Functions::of(space, &a), Functions::of(space, &b)];
        let (w, slopes) = logarithms(space, chord, &a, &b);
        let block = |row: usize, col: usize| slopes.view((row * m, col * m), (m, m)).into_owned();
        let square = 1.0 / (h * h);
        let side = |which: usize| {
            let own = [&a, &b][which];
            let w = w.rows(which * m, m).into_owned();
            let (at_a, at_b) = (block(which, 0), block(which, 1));
            // A motion of p₀ changes a by ad coth ξ, a motion of p₁ changes b by −ad coth η; the nearer one rotates
            // the handle.
            let mut points = [&at_a * &functions[0].coth, -&at_b * &functions[1].coth];
            let turn = curvature(space, own, &w) * &functions[which].tanh;
            let sign = if which == 0 { 1.0 } else { -1.0 };
            points[which] += turn * sign;
            let mut slopes = [at_a, at_b];
            slopes[which] -= Matrix::identity(m, m) * sign;
            let value = (w - own * sign) * square;
            let length = (&slopes[0] * u[0] + &slopes[1] * u[1]) * (square / 3.0) - &value * (2.0 / h);
            Side {
                value,
                u: slopes.map(|x| x * (square * h / 3.0)),
                points: points.map(|x| x * square),
                length,
            }
        };
        let sides = [side(0), side(1)];
        LinearisedSegment { h, handles: [a, b], functions, sides }
    }
}

/// w⁺ and w⁻ in one vector, and their derivatives in a and b.
fn logarithms(space: &Erased, chord: &Vector, a: &Vector, b: &Vector) -> (Vector, Matrix) {
    let m = chord.len();
    let d = splat(chord);
    let mut prepared: Few<Lane> = smallvec![Lane::ZERO; space.chord_len()];
    space.prepare(&d, &mut prepared);
    let mut w = Vector::zeros(2 * m);
    let slopes = columns(2 * m, 2 * m, |first, out| {
        let seeded = |x: &Vector, from: usize| -> Few<Dual> {
            (0..m).map(|r| Dual { v: lane(x[r]), d: unit(from + r, first) }).collect()
        };
        let zero: Few<Dual> = smallvec![Dual::constant(Lane::ZERO); m];
        let (mut plus, mut minus) = (zero.clone(), zero);
        space.inner_handles(&d, &prepared, &seeded(a, 0), &seeded(b, m), &mut plus, &mut minus);
        for (r, x) in plus.iter().chain(&minus).enumerate() {
            (w[r], out[r]) = (x.v.as_array()[0], x.d);
        }
    });
    (w, slopes)
}
