//! Samples of single segments, whose curves need not have anything in common.

use symspline_core::curve::{Curves, Outside, Quantity, Times, evaluate};
use symspline_core::monitor::Monitor;
use symspline_core::space::Erased;

/// Segments of curves, each with one sample, and where its result goes.
#[derive(Default)]
pub struct GridSamples {
    t: Vec<f64>,
    points: Vec<f64>,
    velocities: Vec<f64>,
    x: Vec<f64>,
    owners: Vec<usize>,
    /// Isolated nodes, and where their points go.
    isolated: Vec<(usize, Vec<f64>)>,
}

impl GridSamples {
    /// Adds a sample of the segment between two nodes with these points and velocities.
    pub fn push(&mut self, owner: usize, t: [f64; 2], points: [&[f64]; 2], velocities: [&[f64]; 2], x: f64) {
        self.owners.push(owner);
        self.t.extend(t);
        self.x.push(x);
        for e in 0..2 {
            self.points.extend_from_slice(points[e]);
            self.velocities.extend_from_slice(velocities[e]);
        }
    }

    /// Adds a node without neighbours, which has a point but no derivatives.
    pub fn push_node(&mut self, owner: usize, point: &[f64]) {
        self.isolated.push((owner, point.to_vec()));
    }

    /// Evaluates all samples into the rows of their owners; other rows do not change.
    pub fn evaluate(
        &self,
        space: &Erased,
        quantity: Quantity,
        outside: Outside,
        monitor: &Monitor,
        len: usize,
        out: &mut [f64],
    ) {
        let curves =
            Curves { t: &self.t, nodes: 2, points: &self.points, velocities: &self.velocities, before: &[] };
        let times = Times { x: &self.x, count: 1 };
        let mut found = vec![0.0; self.owners.len() * len];
        evaluate(space, &curves, &times, quantity, outside, monitor, &mut found);
        for (owner, row) in self.owners.iter().zip(found.chunks_exact(len)) {
            out[owner * len..(owner + 1) * len].copy_from_slice(row);
        }
        if quantity == Quantity::Point {
            for (owner, row) in &self.isolated {
                out[owner * len..(owner + 1) * len].copy_from_slice(row);
            }
        }
    }
}
