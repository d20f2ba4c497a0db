//! Values at scattered coordinates.
//!
//! The value at one coordinate depends on the nodes near it only, up to rounding ([`Window`]).

use crate::axis::{Axis, Window};
use crate::batch::Batch;
use crate::grid::{Derivative, Grid, is_valid};
use crate::rows::{push_curve, sample};
use crate::samples::Samples;
use crate::summary::Summary;
use std::sync::Mutex;
use symspline_core::curve::Quantity;
use symspline_core::derivative::Of;
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::scalar::LANES;

/// The number of nodes of all windows together that a thread processes at a time.
const BLOCK: usize = 1 << 13;

/// Evaluates the grid at coordinates given row by row. `points` receives the points, and `tangents` the derivative if
/// one is requested. The monitor counts the coordinates.
pub fn scattered(
    grid: &Grid,
    x: &[f64],
    derivative: Derivative,
    monitor: &Monitor,
    points: &mut [f64],
    tangents: &mut [f64],
) -> Summary {
    let (dims, len) = (grid.axes.len(), grid.len());
    // Coordinates with the same windows are neighbours, whose nodes stay in the cache.
    let mut order: Vec<(Vec<usize>, usize)> = x
        .chunks_exact(dims)
        .enumerate()
        .map(|(query, x)| {
            let segments = (1..dims).rev().chain([0]).map(|d| grid.axes[d].locate(x[d]).0);
            (segments.collect(), query)
        })
        .collect();
    order.sort();
    let windows: usize = grid.axes[1..].iter().map(|axis| Window::around(axis, axis.knots[0]).nodes.len()).product();
    let size = (BLOCK / windows.max(1)).max(1).next_multiple_of(LANES);
    let vectors = if derivative.is_vector() { len } else { 0 };
    let mut found = vec![0.0; order.len() * (len + vectors)];
    let blocks: Vec<_> = order.chunks(size).zip(found.chunks_mut(size * (len + vectors))).collect();
    let summary = Mutex::new(Summary::default());
    parallel::for_each(blocks, false, monitor, |(queries, out)| {
        let go_on = |_| !monitor.poll();
        let inner = Monitor::new(&go_on);
        let x: Vec<&[f64]> = queries.iter().map(|(_, query)| &x[query * dims..(query + 1) * dims]).collect();
        let own = block(grid, &x, derivative, &inner, out);
        if let Ok(mut all) = summary.lock() {
            all.merge(&own);
        }
        monitor.advance(queries.len());
    });
    for (queries, found) in order.chunks(size).zip(found.chunks(size * (len + vectors))) {
        let (p, v) = found.split_at(queries.len() * len);
        for (k, (_, query)) in queries.iter().enumerate() {
            points[query * len..][..len].copy_from_slice(&p[k * len..][..len]);
            if vectors > 0 {
                tangents[query * len..][..len].copy_from_slice(&v[k * len..][..len]);
            }
        }
    }
    summary.into_inner().unwrap_or_default()
}

/// Evaluates a few coordinates. `out` receives all points, and then all tangent vectors.
fn block(grid: &Grid, x: &[&[f64]], derivative: Derivative, monitor: &Monitor, out: &mut [f64]) -> Summary {
    let (space, len, dims) = (&grid.space, grid.len(), grid.axes.len());
    let windows: Vec<Vec<Window>> = x
        .iter()
        .map(|x| (1..dims).map(|d| Window::around(&grid.axes[d], x[d])).collect())
        .collect();
    let mut summary = Summary::default();
    let (mut nodes, mut tangents) = first_axis(grid, x, &windows, derivative, monitor);
    for k in 1..dims {
        let axis = &grid.axes[k];
        // Nodes of each query over the axes that are left: those along this axis are `rest` apart.
        let rests: Vec<usize> =
            windows.iter().map(|own| own[k..].iter().map(|window| window.nodes.len()).product()).collect();
        let total: usize = rests.iter().sum();
        let (mut batch, mut samples) = (Batch::default(), Samples::default());
        let last = k + 1 == dims;
        let begins = derivative.begins_at(k, dims);
        let carries = !begins && !tangents.is_empty();
        let of = if last && derivative.last == 1 { Of::Velocity } else { Of::Point };
        let mut moved = vec![f64::NAN; if begins || carries { total * len } else { 0 }];
        // The row of each owner, and its coordinate in the numbering of the run.
        let mut owners = Vec::with_capacity(total);
        let mut start = 0;
        for (query, &rest) in rests.iter().enumerate() {
            let window = &windows[query][k - 1];
            for first in start..start + rest {
                let row = Row { axis, window, first, stride: rest, len };
                let found = axis.run_at(window, |node| is_valid(&nodes, row.place(node), len), x[query][k]);
                if let Some((run, _)) = found {
                    if run.nodes > 1 {
                        batch.push(axis, owners.len(), run, |node| row.of(&nodes, node));
                    } else {
                        let node = axis.index(run.first);
                        samples.push_node(owners.len(), row.of(&nodes, node));
                        if carries && of == Of::Point {
                            moved[owners.len() * len..][..len].copy_from_slice(row.of(&tangents, node));
                        }
                    }
                }
                owners.push((row, found.map_or(f64::NAN, |(_, x)| x)));
            }
            start += window.nodes.len() * rest;
        }
        summary.merge(&batch.fit(space, axis, k, monitor));
        for curve in batch.curves(len) {
            let (row, x) = &owners[curve.owner];
            let inner = 1..curve.t.len() - 1;
            let i = curve.t[inner].partition_point(|t| t <= x);
            let pair = |array: &'_ [f64]| -> [Vec<f64>; 2] { [0, 1].map(|e| array[(i + e) * len..][..len].to_vec()) };
            let (p, u) = (pair(curve.points), pair(curve.velocities));
            samples.push(curve.owner, [curve.t[i], curve.t[i + 1]], [&p[0], &p[1]], [&u[0], &u[1]], *x);
            if carries {
                let run = curve.run.first..curve.run.first + curve.run.nodes;
                let own: Vec<f64> =
                    run.flat_map(|node| row.of(&tangents, axis.index(node))).copied().collect();
                let arrays = [curve.t, curve.points, curve.velocities, &own];
                push_curve(space, axis, curve.run, arrays, &[*x], of, &mut moved[curve.owner * len..][..len]);
            }
        }
        let mut found = vec![f64::NAN; total * len];
        let outside = axis.outside_segment();
        samples.evaluate(space, Quantity::Point, outside, monitor, len, &mut found);
        if begins {
            let second = last && derivative.last == 2;
            let quantity = if second { Quantity::Acceleration } else { Quantity::Velocity };
            samples.evaluate(space, quantity, outside, monitor, len, &mut moved);
        }
        (nodes, tangents) = (found, moved);
    }
    out[..nodes.len()].copy_from_slice(&nodes);
    out[nodes.len()..].copy_from_slice(&tangents);
    summary
}

/// The nodes of one window along an axis, in an array over the windows of several axes.
struct Row<'a> {
    axis: &'a Axis<'a>,
    window: &'a Window,
    /// The place of the first node, and the distance between neighbours.
    first: usize,
    stride: usize,
    len: usize,
}

impl Row<'_> {
    fn place(&self, node: usize) -> usize {
        let start = self.window.nodes.start;
        let number = if node >= start { node } else { node + self.axis.different() };
        self.first + (number - start) * self.stride
    }

    /// The point or vector of a node.
    fn of<'b>(&self, array: &'b [f64], node: usize) -> &'b [f64] {
        &array[self.place(node) * self.len..][..self.len]
    }
}

/// Evaluates the splines along axis 0 at the nodes of all windows. Returns points, and their velocities if these are
/// requested.
fn first_axis(
    grid: &Grid,
    x: &[&[f64]],
    windows: &[Vec<Window>],
    derivative: Derivative,
    monitor: &Monitor,
) -> (Vec<f64>, Vec<f64>) {
    let (space, len, dims, axis) = (&grid.space, grid.len(), grid.axes.len(), &grid.axes[0]);
    let row_len = axis.nodes() * len;
    let mut samples = Samples::default();
    let mut owner = 0;
    for (x, own) in x.iter().zip(windows) {
        // All nodes of the windows, the last axis fastest.
        let count: usize = own.iter().map(|window| window.nodes.len()).product();
        for number in 0..count {
            let (mut rest, mut row, mut stride) = (number, 0, 1);
            for (d, window) in own.iter().enumerate().rev() {
                let axis = &grid.axes[d + 1];
                row += stride * axis.index(window.nodes.start + rest % window.nodes.len());
                rest /= window.nodes.len();
                stride *= axis.nodes();
            }
            let at = row * row_len..(row + 1) * row_len;
            sample(axis, &mut samples, owner, &grid.points[at.clone()], &grid.velocities[at], x[0], len);
            owner += 1;
        }
    }
    let outside = axis.outside_segment();
    let mut points = vec![f64::NAN; owner * len];
    samples.evaluate(space, Quantity::Point, outside, monitor, len, &mut points);
    let mut tangents = Vec::new();
    if derivative.begins_at(0, dims) {
        tangents = vec![f64::NAN; owner * len];
        let second = dims == 1 && derivative.last == 2;
        let quantity = if second { Quantity::Acceleration } else { Quantity::Velocity };
        samples.evaluate(space, quantity, outside, monitor, len, &mut tangents);
    }
    (points, tangents)
}
