//! The sphere Sⁿ = {x ∈ Rⁿ⁺¹ : |x| = 1}, G = O(n+1), κ = 1.

use super::{ROUNDING_SIZE, Space, constant_curvature as cc};
use crate::scalar::{Lane, Scalar, dot, lane, max_or_nan};

const K: i32 = 1;

/// The unit sphere of dimension n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sphere {
    n: usize,
}

impl Sphere {
    /// The sphere in n + 1 dimensions.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Sphere(n) needs n >= 1".into()) } else { Ok(Sphere { n }) }
    }

    /// n
    pub fn parameters(&self) -> [usize; 1] {
        [self.n]
    }
}

impl Space for Sphere {
    cc::curved_methods!();

    fn cut_angle(&self) -> f64 {
        std::f64::consts::PI
    }

    fn project(&self, x: &mut [Lane]) -> Lane {
        let norm = dot(x, x).sqrt();
        let off = (norm - Lane::ONE).abs();
        // What is a unit vector up to the rounding of its norm stays as it is.
        let rounding = lane((1.5 + self.n as f64 / 8.0) * f64::EPSILON);
        let scale = off.simd_le(rounding).select(Lane::ONE, Lane::ONE / norm);
        x.iter_mut().for_each(|x| *x *= scale);
        off
    }

    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane {
        let size = dot(v, v).sqrt();
        let off = cc::tangential::<K>(p, v).abs();
        off / (size + ROUNDING_SIZE)
    }

    fn complaint(&self, x: &[f64]) -> String {
        let norm = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm == 0.0 {
            "it is the zero vector, which has no direction".into()
        } else {
            format!("its norm is {norm}, not 1 (off by {:.3e})", (norm - 1.0).abs())
        }
    }
}
