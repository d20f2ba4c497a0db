//! The result of a sweep over the nodes, and its working vectors.

use crate::scalar::{Lane, Scalar};

/// How far a lane is from C²: the largest residual, and the largest speed to measure it by.
#[derive(Clone, Copy)]
pub struct C2Residual {
    /// Largest residual, divided by 1/hᵢ₋₁ + 1/hᵢ: a velocity. At an end with not-a-knot it is that of the
    /// velocity there, divided by 1 + h₀/h₁: so much its formula makes of rounding in the other velocities.
    pub residual: Lane,
    /// Largest |uᵢ|.
    pub speed: Lane,
    /// Largest |h uᵢ/3|, the longest outer handle.
    pub handle: Lane,
}

/// Vectors of one node, kept between residuals.
pub struct NodeVectors<S> {
    pub(super) a: Vec<S>,
    pub(super) b: Vec<S>,
    pub(super) left: Vec<S>,
    pub(super) right: Vec<S>,
    pub(super) next_left: Vec<S>,
}

impl<S> Default for NodeVectors<S> {
    fn default() -> Self {
        NodeVectors { a: vec![], b: vec![], left: vec![], right: vec![], next_left: vec![] }
    }
}

impl<S: Scalar> NodeVectors<S> {
    pub(super) fn resize(&mut self, m: usize) {
        for vector in [&mut self.a, &mut self.b, &mut self.left, &mut self.right, &mut self.next_left] {
            vector.resize(m, S::constant(Lane::ZERO));
        }
    }
}
