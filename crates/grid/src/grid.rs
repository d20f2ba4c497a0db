//! Points on a grid.

use crate::axis::Axis;
use symspline_core::fit::{Method, Options};
use symspline_core::space::{Ambient, Erased};

/// The options of all fits.
pub const OPTIONS: Options = Options { method: Method::Auto, tol: 1e-12, max_iter: None, certify: None };

/// Nodes of a grid, and the splines along its first axis.
pub struct Grid<'a> {
    /// The space of the points.
    pub space: Erased<'a>,
    /// The axes.
    pub axes: &'a [Axis<'a>],
    /// Points as rows along the first axis: the order of axes is 1, 2, …, D − 1, 0. NaN for missing nodes.
    pub points: &'a [f64],
    /// Velocities along the first axis in the same layout, from [`fit_rows`](crate::fit_rows).
    pub velocities: &'a [f64],
}

/// A derivative: none along any axis by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Derivative {
    /// The axis, other than the last one, along which the first derivative is taken.
    pub along: Option<usize>,
    /// The order along the last axis: up to 2 alone, and up to 1 together with another axis.
    pub last: usize,
}

impl Derivative {
    /// Whether the result contains a tangent vector beside every point.
    pub fn is_vector(self) -> bool {
        self.along.is_some() || self.last > 0
    }

    /// Whether a tangent vector is computed by the splines along an axis, and not only carried through them.
    pub fn begins_at(self, axis: usize, axes: usize) -> bool {
        self.along == Some(axis) || (self.along.is_none() && self.last > 0 && axis + 1 == axes)
    }
}

impl Grid<'_> {
    /// The number of numbers of a point.
    pub fn point_len(&self) -> usize {
        self.space.point_len()
    }

    /// Whether no node is missing.
    pub fn is_complete(&self) -> bool {
        (0..self.points.len() / self.point_len()).all(|node| is_valid(self.points, node, self.point_len()))
    }
}

/// Whether a node has a point.
pub fn is_valid(points: &[f64], node: usize, len: usize) -> bool {
    !points[node * len].is_nan()
}
