//! Values on the outer product of coordinates.

use crate::grid::{Derivative, Grid};
use crate::rows::Along;
use crate::stages::{Nodes, Route};
use crate::summary::Summary;
use std::sync::Mutex;
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
    let len = grid.point_len();
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
    let route = Route { space: grid.space, axes: grid.axes, derivative };
    let nodes = Nodes {
        points: grid.points,
        velocities: grid.velocities,
        tangents: &[],
        complete: grid.is_complete(),
    };
    parallel::for_each(blocks, false, monitor, |(x0, points, tangents)| {
        let go_on = |_| !monitor.poll();
        let inner = Monitor::new(&go_on);
        let advance = || monitor.advance(points.len() / len);
        let coordinates: Vec<Along> =
            std::iter::once(x0).chain(x[1..].iter().copied()).map(Along::Shared).collect();
        let first = route.evaluate(0, nodes, coordinates[0], &inner);
        advance();
        let (found, own) = route.go_on(first, &coordinates, &inner, advance);
        points.copy_from_slice(&found.points);
        tangents.copy_from_slice(&found.tangents);
        if let Ok(mut all) = summary.lock() {
            all.merge(&own);
        }
    });
    summary.into_inner().unwrap_or_default()
}
