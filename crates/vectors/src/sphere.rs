//! The sphere Sⁿ = {x ∈ Rⁿ⁺¹ : |x| = 1}, G = O(n+1), κ = 1.

use crate::constant_curvature as cc;
use symspline_core::scalar::{Lane, dot, lane};
use symspline_core::space::ROUNDING_SIZE;

pub fn project(x: &mut [Lane]) -> Lane {
    let norm = dot(x, x).sqrt();
    let off = (norm - Lane::ONE).abs();
    // Vectors whose norm is one up to rounding do not change.
    let rounding = lane((1.5 + (x.len() - 1) as f64 / 8.0) * f64::EPSILON);
    let scale = off.simd_le(rounding).select(Lane::ONE, Lane::ONE / norm);
    x.iter_mut().for_each(|x| *x *= scale);
    off
}

pub fn project_tangent(p: &[Lane], v: &mut [Lane]) -> Lane {
    let size = dot(v, v).sqrt();
    let off = cc::tangential::<1, false>(p, v).abs();
    off / (size + ROUNDING_SIZE)
}

pub fn violation(x: &[f64]) -> String {
    let norm = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    if norm == 0.0 {
        "it is the zero vector, which has no direction".into()
    } else {
        format!("its norm is {norm}, not 1 (off by {:.3e})", (norm - 1.0).abs())
    }
}
