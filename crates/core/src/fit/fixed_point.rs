//! Algorithm 1 of the paper, on any knots.
//!
//! The paper's update (17) is `vᵢ ← vᵢ + δᵢ/4` with `δᵢ = w⁺ − w⁻ − 2vᵢ` on unit knots. With the C² defect r of
//! `condition.rs` and `vᵢ = hᵢuᵢ/3` that is one step of Jacobi's iteration on the matrix T,
//! `uᵢ ← uᵢ + 3rᵢ/(2/hᵢ₋₁ + 2/hᵢ)`, which is a contraction of about ½ on any knots; at natural ends it
//! is (20).

use super::chain::Chain;
use super::tridiagonal::Tridiagonal;
use crate::scalar::{Lane, lane};

/// Turns the defect in `chain.r` into the update of the velocities.
pub fn update(chain: &Chain, t: &Tridiagonal, step: &mut [Lane]) {
    let m = chain.m;
    for (i, (step, r)) in step.chunks_exact_mut(m).zip(chain.r.chunks_exact(m)).enumerate() {
        let factor = lane(3.0) / t.diagonal[i];
        for c in 0..m {
            step[c] = factor * r[c];
        }
    }
}
