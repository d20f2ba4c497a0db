//! Values at scattered coordinates.
//!
//! The value at one coordinate depends on the nodes near it only, up to rounding ([`Window`]). Coordinates with the same
//! windows are evaluated together.

use crate::axis::Axis;
use crate::grid::{Derivative, Grid};
use crate::rows::Along;
use crate::stages::{Arrays, Nodes, Route};
use crate::summary::Summary;
use crate::window::Window;
use std::sync::Mutex;
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::scalar::LANES;

/// The number of nodes of all windows together that a thread processes at a time.
const BLOCK: usize = 1 << 13;

/// A query: the number of its windows along the axes after the first, its segment along the first axis, and its number.
type Query = (usize, usize, usize);

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
    let (dims, len) = (grid.axes.len(), grid.point_len());
    let mut queries: Vec<Query> = x
        .chunks_exact(dims)
        .enumerate()
        .map(|(number, x)| {
            let windows = (1..dims)
                .fold(0, |windows, k| windows * grid.axes[k].nodes() + Window::extent(&grid.axes[k], x[k]).0);
            (windows, grid.axes[0].locate(x[0]).0, number)
        })
        .collect();
    queries.sort_unstable();
    let vectors = if derivative.is_vector() { len } else { 0 };
    let mut found = vec![0.0; queries.len() * (len + vectors)];
    let nodes: usize = grid.axes[1..].iter().map(|axis| Window::extent(axis, axis.knots[0]).1).product();
    let size = (BLOCK / nodes).max(1).next_multiple_of(LANES);
    let groups: Vec<&[Query]> =
        queries.chunk_by(|a, b| a.0 == b.0).flat_map(|same| same.chunks(size)).collect();
    let (mut blocks, mut rest) = (Vec::new(), &mut found[..]);
    for &own in &groups {
        let (out, others) = std::mem::take(&mut rest).split_at_mut(own.len() * (len + vectors));
        blocks.push((own, out));
        rest = others;
    }
    let complete = grid.is_complete();
    let summary = Mutex::new(Summary::default());
    parallel::for_each(blocks, false, monitor, |(queries, out)| {
        let go_on = |_| !monitor.poll();
        let inner = Monitor::new(&go_on);
        let (arrays, own) = block(grid, x, queries, complete, derivative, &inner);
        out[..arrays.points.len()].copy_from_slice(&arrays.points);
        out[arrays.points.len()..].copy_from_slice(&arrays.tangents);
        if let Ok(mut all) = summary.lock() {
            all.merge(&own);
        }
        monitor.advance(queries.len());
    });
    let mut rest = &found[..];
    for own in groups {
        let (p, others) = rest.split_at(own.len() * len);
        let (v, others) = others.split_at(own.len() * vectors);
        rest = others;
        for (k, (.., number)) in own.iter().enumerate() {
            points[number * len..][..len].copy_from_slice(&p[k * len..][..len]);
            if vectors > 0 {
                tangents[number * len..][..len].copy_from_slice(&v[k * len..][..len]);
            }
        }
    }
    summary.into_inner().unwrap_or_default()
}

/// Evaluates coordinates with the same windows.
fn block(
    grid: &Grid,
    x: &[f64],
    queries: &[Query],
    complete: bool,
    derivative: Derivative,
    monitor: &Monitor,
) -> (Arrays, Summary) {
    let dims = grid.axes.len();
    let first = queries[0].2 * dims;
    let windows: Vec<Window> =
        (1..dims).map(|k| Window::new(&grid.axes[k], Window::extent(&grid.axes[k], x[first + k]))).collect();
    let axes: Vec<Axis> =
        std::iter::once(grid.axes[0]).chain(windows.iter().map(|window| window.axis())).collect();
    let along = |k: usize| queries.iter().map(move |(.., number)| x[number * dims + k]);
    let own: Vec<Vec<f64>> = (0..dims)
        .map(|k| match k {
            0 => along(0).collect(),
            _ => along(k).map(|x| windows[k - 1].coordinate(&grid.axes[k], x)).collect(),
        })
        .collect();
    let coordinates: Vec<Along> =
        own.iter().enumerate().map(|(k, x)| if k == 0 { Along::Shared(x) } else { Along::Own(x) }).collect();
    let route = Route { space: grid.space, axes: &axes, derivative };
    let mut first = Arrays::default();
    for (start, count) in row_ranges(grid, &windows) {
        let numbers = axes[0].nodes() * grid.point_len();
        let range = start * numbers..(start + count) * numbers;
        let nodes = Nodes {
            points: &grid.points[range.clone()],
            velocities: &grid.velocities[range],
            tangents: &[],
            complete,
        };
        let Arrays { points, tangents } = route.evaluate(0, nodes, coordinates[0], monitor);
        if first.points.is_empty() {
            first = Arrays { points, tangents };
        } else {
            first.points.extend(points);
            first.tangents.extend(tangents);
        }
    }
    route.go_on(first, &coordinates, monitor, || {})
}

/// The rows along axis 0 at the nodes of all windows, the last axis fastest, as ranges: first row and number of rows.
fn row_ranges(grid: &Grid, windows: &[Window]) -> Vec<(usize, usize)> {
    let mut ranges = vec![(0, 1)];
    for (window, axis) in windows.iter().zip(&grid.axes[1..]) {
        let n = axis.nodes();
        let mut next: Vec<(usize, usize)> = Vec::new();
        for row in ranges.iter().flat_map(|&(start, count)| start..start + count) {
            for node in window.first..window.first + window.axis().nodes() {
                let at = row * n + axis.index(node);
                match next.last_mut() {
                    Some((start, count)) if *start + *count == at => *count += 1,
                    _ => next.push((at, 1)),
                }
            }
        }
        ranges = next;
    }
    ranges
}
