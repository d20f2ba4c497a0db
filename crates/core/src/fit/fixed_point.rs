//! Algorithm 1 of the paper, on any knots.
//!
//! The paper's update is `vᵢ ← vᵢ + δᵢ/4` with `δᵢ = w⁺ − w⁻ − 2vᵢ` on unit knots. With the C² defect r of
//! `condition.rs` and `vᵢ = hᵢuᵢ/3` that is one step of Jacobi's iteration on the matrix T,
//! `uᵢ ← uᵢ + 3rᵢ/(2/hᵢ₋₁ + 2/hᵢ)`, which is a contraction of about ½ on any knots; at natural ends it
//! is (20).

use super::chain::Chain;
use super::condition::ChainEnds;
use super::tridiagonal::Tridiagonal;
use crate::scalar::{Lane, lane};
use crate::space::Erased;

/// Turns the defect in `chain.r` into the update of the velocities.
pub fn update(space: &Erased, chain: &mut Chain, ends: &ChainEnds, t: &Tridiagonal, step: &mut [Lane]) {
    let (n, m) = (chain.n, chain.m);
    for i in 0..=n {
        let factor = lane(3.0) / t.diagonal[i];
        for c in i * m..(i + 1) * m {
            step[c] = factor * chain.r[c];
        }
    }
    if let ChainEnds::Periodic = ends {
        let (first, last) = step.split_at_mut(n * m);
        last.copy_from_slice(&first[..m]);
        chain.across_seam(space, true, last);
    }
}
