//! Hyperbolic space Hⁿ = {x ∈ Rⁿ⁺¹ : −x₀² + Σ xᵢ² = −1, x₀ > 0}, G = O(n,1), κ = −1.

use crate::constant_curvature as cc;
use symspline_core::scalar::{Lane, dot, lane};
use symspline_core::space::ROUNDING_SIZE;

/// A ray's ambient vectors grow like e^d, and so do errors at its start.
pub const LONGEST_RAY: f64 = 2.0;

/// The point with the same space-like coordinates.
pub fn project(x: &mut [Lane]) -> Lane {
    let height = (Lane::ONE + dot(&x[1..], &x[1..])).sqrt();
    let off = (x[0] - height).abs() / height;
    x[0] = height;
    off
}

pub fn project_tangent<const K: i32, const L: bool>(p: &[Lane], v: &mut [Lane]) -> Lane {
    // Relative to |p||v|, which is what rounding of v amounts to in ⟨p,v⟩.
    let size = (dot(v, v) * dot(p, p)).sqrt();
    let off = cc::tangential::<K, L>(p, v).abs();
    off / (size + ROUNDING_SIZE)
}

pub fn violation(x: &[f64]) -> String {
    let square = x[1..].iter().map(|x| x * x).sum::<f64>() - x[0] * x[0];
    if x[0] <= 0.0 {
        format!("its time-like coordinate, the first, is {}, not positive", x[0])
    } else {
        format!("its Minkowski square is {square}, not -1 (off by {:.3e})", (square + 1.0).abs())
    }
}

/// Rounding errors of a point p at distance r from the apex are ε|p|² ≈ ε e²ʳ/4.
pub fn rounding(p: &[Lane]) -> Lane {
    dot(p, p)
}

/// E(−a) E(d) E(−b) with |a| ≈ |b| ≈ |d|/3 grows to e^{5|d|/3} and ends at e^{|d|/3}.
pub fn condition(chord: &[Lane]) -> Lane {
    (dot(chord, chord).sqrt() * lane(4.0 / 3.0)).exp()
}
