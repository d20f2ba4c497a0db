//! From one axis to the next.

use crate::axis::Axis;
use crate::grid::Derivative;
use crate::rows::{Along, evaluate_rows, fit_rows, is_complete, push_rows};
use crate::summary::Summary;
use symspline_core::curve::Quantity;
use symspline_core::derivative::Of;
use symspline_core::monitor::Monitor;
use symspline_core::space::{Ambient, Erased};

/// Points, and tangent vectors there if a derivative was requested and has begun.
#[derive(Default)]
pub struct Arrays {
    pub points: Vec<f64>,
    pub tangents: Vec<f64>,
}

/// Rows of nodes along an axis, with their splines.
#[derive(Clone, Copy)]
pub struct Nodes<'a> {
    pub points: &'a [f64],
    pub velocities: &'a [f64],
    /// Tangent vectors to carry along; empty without any.
    pub tangents: &'a [f64],
    pub complete: bool,
}

/// The axes of an evaluation, and the derivative.
#[derive(Clone, Copy)]
pub struct Route<'a> {
    pub space: Erased<'a>,
    pub axes: &'a [Axis<'a>],
    pub derivative: Derivative,
}

impl Route<'_> {
    /// Evaluates rows along axis k: points, and the vectors that the derivative requires.
    pub fn evaluate(&self, k: usize, nodes: Nodes, x: Along, monitor: &Monitor) -> Arrays {
        let Route { space, axes, derivative } = self;
        let (axis, last) = (&axes[k], k + 1 == axes.len());
        let size = nodes.points.len() / axis.nodes() * x.per_row();
        let sampled = |quantity| {
            let mut out = vec![0.0; size];
            let Nodes { points, velocities, complete, .. } = nodes;
            evaluate_rows(space, axis, points, velocities, complete, x, quantity, monitor, &mut out);
            out
        };
        let tangents = if derivative.begins_at(k, axes.len()) {
            let second = last && derivative.last == 2;
            sampled(if second { Quantity::Acceleration } else { Quantity::Velocity })
        } else if !nodes.tangents.is_empty() {
            let of = if last && derivative.last == 1 { Of::Velocity } else { Of::Point };
            let mut out = vec![0.0; size];
            let Nodes { points, velocities, tangents, .. } = nodes;
            push_rows(space, axis, points, velocities, tangents, x, of, monitor, &mut out);
            out
        } else {
            Vec::new()
        };
        Arrays { points: sampled(Quantity::Point), tangents }
    }

    /// Continues from the values of axis 0 through the other axes, whose coordinates are `x[1..]`. Each array has the
    /// nodes of the next axis first, and those of the last axis before the coordinates that are done. `advance` is called
    /// after each axis.
    pub fn go_on(
        &self,
        mut arrays: Arrays,
        x: &[Along],
        monitor: &Monitor,
        advance: impl Fn(),
    ) -> (Arrays, Summary) {
        let len = self.space.point_len();
        let mut summary = Summary::default();
        for (k, axis) in self.axes.iter().enumerate().skip(1) {
            let points = first_axis_last(arrays.points, axis.nodes(), len);
            let tangents = first_axis_last(arrays.tangents, axis.nodes(), len);
            let mut velocities = vec![0.0; points.len()];
            // Points at nodes need no spline.
            let needed = |row| self.derivative.is_vector() || !x[k].are_nodes(axis, row);
            summary.merge(&fit_rows(&self.space, axis, k, &points, needed, monitor, &mut velocities));
            let complete = is_complete(&points, len);
            let nodes = Nodes { points: &points, velocities: &velocities, tangents: &tangents, complete };
            arrays = self.evaluate(k, nodes, x[k], monitor);
            advance();
        }
        (arrays, summary)
    }
}

/// Moves the first axis of an array of points behind the others.
fn first_axis_last(array: Vec<f64>, first: usize, len: usize) -> Vec<f64> {
    let rest = array.len() / (first * len);
    if first == 1 || rest <= 1 {
        return array;
    }
    let mut out = vec![0.0; array.len()];
    // Tiles, so that both arrays stay in the cache.
    const TILE: usize = 16;
    for from in (0..first).step_by(TILE) {
        for start in (0..rest).step_by(TILE) {
            for r in start..rest.min(start + TILE) {
                for f in from..first.min(from + TILE) {
                    out[(r * first + f) * len..][..len]
                        .copy_from_slice(&array[(f * rest + r) * len..][..len]);
                }
            }
        }
    }
    out
}
