//! Hyperbolic space Hⁿ = {x ∈ Rⁿ⁺¹ : −x₀² + Σ xᵢ² = −1, x₀ > 0}, G = O(n,1), κ = −1.
//!
//! Rounding errors of a point p at distance r from the apex are ε|p|² ≈ ε e²ʳ/4: that is how far
//! apart neighbouring floating-point points are.

use super::{ROUNDING_SIZE, Space, constant_curvature as cc};
use crate::scalar::{Lane, Scalar, dot, lane, max_or_nan};

const K: i32 = -1;

/// Hyperbolic space of dimension n, as the hyperboloid with its time-like coordinate first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hyperbolic {
    n: usize,
}

impl Hyperbolic {
    /// The hyperboloid in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Hyperbolic(n) needs n >= 1".into()) } else { Ok(Hyperbolic { n }) }
    }

    /// n
    pub fn parameters(&self) -> [usize; 1] {
        [self.n]
    }
}

impl Space for Hyperbolic {
    cc::curved_methods!();

    fn cut_angle(&self) -> f64 {
        f64::INFINITY
    }

    fn longest_leg(&self) -> f64 {
        // ε cosh²(18) ≈ 1: of points this far apart rounding leaves nothing.
        18.0
    }

    fn project(&self, x: &mut [Lane]) -> Lane {
        // The point with the same space-like coordinates.
        let height = (Lane::ONE + dot(&x[1..], &x[1..])).sqrt();
        let off = (x[0] - height).abs() / height;
        x[0] = height;
        off
    }

    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane {
        // Relative to |p||v|, which is what rounding of v amounts to in ⟨p,v⟩.
        let size = (dot(v, v) * dot(p, p)).sqrt();
        let off = cc::tangential::<K>(p, v).abs();
        off / (size + ROUNDING_SIZE)
    }

    fn complaint(&self, x: &[f64]) -> String {
        let square = x[1..].iter().map(|x| x * x).sum::<f64>() - x[0] * x[0];
        if x[0] <= 0.0 {
            format!("its time-like coordinate, the first, is {}, not positive", x[0])
        } else {
            format!("its Minkowski square is {square}, not -1 (off by {:.3e})", (square + 1.0).abs())
        }
    }

    fn condition(&self, chord: &[Lane]) -> Lane {
        // E(−a) E(d) E(−b) with |a| ≈ |b| ≈ |d|/3 grows to e^{5|d|/3} and ends at e^{|d|/3}.
        (dot(chord, chord).sqrt() * lane(4.0 / 3.0)).exp()
    }
}
