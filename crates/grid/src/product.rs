//! Values on the outer product of coordinates.

use crate::grid::{Derivative, Grid};
use crate::rows::{evaluate_rows, fit_rows, push_rows};
use crate::summary::Summary;
use std::sync::Mutex;
use symspline_core::curve::Quantity;
use symspline_core::derivative::Of;
use symspline_core::monitor::Monitor;
use symspline_core::parallel;

/// The most numbers of an array between two axes, for all threads together: 16 MB.
const MOST: usize = 1 << 21;
/// Blocks per thread, so that no thread waits long for the others.
const BLOCKS: usize = 4;

/// Evaluates the grid at all combinations of coordinates. `points` receives the points in the order of the axes, and
/// `tangents` the derivative if one is requested. Memory is bounded: the coordinates of axis 0 are divided into blocks.
///
/// The monitor counts each point of the result once per axis.
pub fn product(
    grid: &Grid,
    x: &[&[f64]],
    derivative: Derivative,
    monitor: &Monitor,
    points: &mut [f64],
    tangents: &mut [f64],
) -> Summary {
    let len = grid.len();
    let behind: usize = x[1..].iter().map(|x| x.len()).product();
    if x[0].is_empty() || behind == 0 {
        return Summary::default();
    }
    // The largest array between two axes, per coordinate of axis 0.
    let largest = (0..x.len())
        .map(|k| {
            let done: usize = x[1..=k].iter().map(|x| x.len()).product();
            let left: usize = grid.axes[k + 1..].iter().map(|axis| axis.nodes()).product();
            done * left * len
        })
        .fold(1, usize::max);
    let threads = parallel::num_threads();
    let fair = x[0].len().div_ceil(threads * BLOCKS);
    let size = (MOST / threads / largest).clamp(1, fair.max(1));
    let summary = Mutex::new(Summary::default());
    let mut rest = tangents;
    let blocks: Vec<_> = x[0]
        .chunks(size)
        .zip(points.chunks_mut(size * behind * len))
        .map(|(x0, points)| {
            let own = if derivative.is_vector() { points.len() } else { 0 };
            let (tangents, others) = std::mem::take(&mut rest).split_at_mut(own);
            rest = others;
            (x0, points, tangents)
        })
        .collect();
    parallel::for_each(blocks, false, monitor, |(x0, points, tangents)| {
        let go_on = |_| !monitor.poll();
        let inner = Monitor::new(&go_on);
        let mut coordinates = x.to_vec();
        coordinates[0] = x0;
        let found = block(grid, &coordinates, derivative, &inner, || monitor.advance(points.len() / len));
        let (found_points, found_tangents, own) = found;
        points.copy_from_slice(&found_points);
        tangents.copy_from_slice(&found_tangents);
        if let Ok(mut all) = summary.lock() {
            all.merge(&own);
        }
    });
    summary.into_inner().unwrap_or_default()
}

/// The same for a few coordinates of axis 0. Returns points, and tangent vectors if a derivative is requested.
fn block(
    grid: &Grid,
    x: &[&[f64]],
    derivative: Derivative,
    monitor: &Monitor,
    advance: impl Fn(),
) -> (Vec<f64>, Vec<f64>, Summary) {
    let (space, len, dims) = (&grid.space, grid.len(), x.len());
    let mut summary = Summary::default();
    let (mut rows, mut tangents): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for (k, axis) in grid.axes.iter().enumerate() {
        let mut fitted = Vec::new();
        let (nodes, velocities) = if k == 0 {
            (grid.points, grid.velocities)
        } else {
            fitted.resize(rows.len(), 0.0);
            summary.merge(&fit_rows(space, axis, k, &rows, monitor, &mut fitted));
            (&rows[..], &fitted[..])
        };
        let size = nodes.len() / axis.nodes() * x[k].len();
        let evaluate = |quantity| {
            let mut out = vec![0.0; size];
            evaluate_rows(space, axis, nodes, velocities, x[k], quantity, monitor, &mut out);
            out
        };
        let last = k + 1 == dims;
        let found = evaluate(Quantity::Point);
        let moved = if derivative.begins_at(k, dims) {
            let second = last && derivative.last == 2;
            evaluate(if second { Quantity::Acceleration } else { Quantity::Velocity })
        } else if !tangents.is_empty() {
            let of = if last && derivative.last == 1 { Of::Velocity } else { Of::Point };
            let mut out = vec![0.0; size];
            push_rows(space, axis, nodes, velocities, &tangents, x[k], of, monitor, &mut out);
            out
        } else {
            Vec::new()
        };
        // The next axis comes last.
        let next = grid.axes.get(k + 1).map_or(1, |axis| axis.nodes());
        (rows, tangents) = (first_axis_last(found, next, len), first_axis_last(moved, next, len));
        advance();
    }
    (rows, tangents, summary)
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
                    out[(r * first + f) * len..][..len].copy_from_slice(&array[(f * rest + r) * len..][..len]);
                }
            }
        }
    }
    out
}
