//! The result of a sweep over the nodes, and its working vectors.

use crate::scalar::{Lane, Scalar};

/// The C² residual of a lane and its scale.
#[derive(Clone, Copy)]
pub struct C2Residual {
    /// Largest residual, divided by 1/hᵢ₋₁ + 1/hᵢ, which makes it a velocity. At a not-a-knot end it is the residual
    /// of the velocity there, divided by 1 + h₀/h₁, the factor by which its formula amplifies rounding errors of
    /// other velocities.
    pub residual: Lane,
    /// Largest |uᵢ|.
    pub speed: Lane,
    /// Largest |h uᵢ/3|, the longest outer handle.
    pub handle: Lane,
}

/// Vectors of one node, reused between residuals.
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
