//! De Sitter space {x ∈ Rⁿ⁺¹ : −x₀² + x₁² + … + xₙ² = 1}, G = O(1,n), κ = 1, and anti-de Sitter space
//! {x ∈ Rⁿ⁺¹ : −x₀² − x₁² + x₂² + … + xₙ² = −1}, G = O(2,n−1), κ = −1: the formulas of `constant_curvature` with an
//! indefinite metric.
//!
//! With c = κ⟨p,q⟩ the logarithm is f(c)(q − cp), f = θ/sin θ with cos θ = c, which is analytic across c = 1: there the
//! geodesic is null, at c > 1 it is open. Points with c ≤ −1 are joined by no geodesic, or by many.

use symspline_core::scalar::{Lane, dot, lane};

/// The numbers of a point whose squares have the sign of κ.
fn round<const K: i32, T>(x: &mut [T]) -> (&mut [T], &mut [T]) {
    let (head, tail) = x.split_at_mut(if K > 0 { 1 } else { 2 });
    if K > 0 { (tail, head) } else { (head, tail) }
}

/// The point with the same numbers whose squares have the other sign than κ.
pub fn project<const K: i32>(x: &mut [Lane]) -> Lane {
    let count = x.len();
    let (round, open) = round::<K, _>(x);
    let height2 = Lane::ONE + dot(open, open);
    let (norm, height) = (dot(round, round).sqrt(), height2.sqrt());
    let off = (norm - height).abs() / height;
    // Points whose squares are accurate to rounding do not change.
    let rounding = lane((2.0 + count as f64 / 8.0) * f64::EPSILON);
    let scale = off.simd_le(rounding).select(Lane::ONE, height / norm);
    round.iter_mut().for_each(|x| *x *= scale);
    off
}

pub fn violation<const K: i32>(x: &[f64]) -> String {
    let mut x = x.to_vec();
    let (round, open) = round::<K, _>(&mut x);
    let [round, open] = [round, open].map(|x| x.iter().map(|x| x * x).sum::<f64>());
    let square = f64::from(K) * (round - open);
    let signs = if K > 0 { "-x0² + x1² + …" } else { "-x0² - x1² + x2² + …" };
    format!("its square {signs} is {square}, not {K} (off by {:.3e})", (square - f64::from(K)).abs())
}

/// The largest |p|² of a point, at which rounding errors ε|p|² are 0.2 %.
const FARTHEST: f64 = (1_u64 << 43) as f64;

/// The first point that is too far out to be accurate, and a description of it.
pub fn imprecise_point(points: &[f64], len: usize) -> Option<(usize, String)> {
    let square = |p: &[f64]| p.iter().map(|x| x * x).sum::<f64>();
    let row = points.chunks_exact(len).position(|p| !(square(p) <= FARTHEST))?;
    let why = format!(
        "has the sum of squares {:.1e}, and rounding errors, 2.2e-16 times that, leave too few significant digits (largest: \
         {FARTHEST:.1e}); move all points by one isometry, space.transvection, to where their numbers are small",
        square(&points[row * len..(row + 1) * len])
    );
    Some((row, why))
}

/// As in hyperbolic space, for the part of a chord that is a boost: E(v) grows by its length at most.
pub fn condition<const K: i32>(chord: &[Lane]) -> Lane {
    let (time, rest) = chord.split_at(chord.len().min(1));
    let boost = if K > 0 { time } else { rest };
    (dot(boost, boost).sqrt() * lane(4.0 / 3.0)).exp()
}
