//! Rows of nodes along one axis: their splines, values, and derivatives with respect to the nodes.

use crate::axis::{Axis, Run};
use crate::batch::{Batch, ends_of};
use crate::grid::{OPTIONS, is_valid};
use crate::samples::GridSamples;
use crate::summary::Summary;
use symspline_core::curve::{Curves, Quantity, Times, evaluate};
use symspline_core::derivative::{Data, Derivative, Of};
use symspline_core::fit::{Problem, Status, fit};
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::space::{Ambient, Erased};

/// Coordinates along one axis.
#[derive(Clone, Copy)]
pub enum Along<'a> {
    /// The same coordinates for all rows.
    Shared(&'a [f64]),
    /// One coordinate per row; rows take them in turn.
    Own(&'a [f64]),
}

impl<'a> Along<'a> {
    /// The number of coordinates of each row.
    pub fn per_row(self) -> usize {
        match self {
            Along::Shared(x) => x.len(),
            Along::Own(_) => 1,
        }
    }

    /// The coordinates of a row.
    fn of(self, row: usize) -> &'a [f64] {
        match self {
            Along::Shared(x) => x,
            Along::Own(x) => &x[row % x.len()..][..1],
        }
    }

    /// Whether all coordinates of a row are those of nodes, whose points do not depend on its spline.
    pub fn are_nodes(self, axis: &Axis, row: usize) -> bool {
        self.of(row).iter().all(|&x| axis.node_at(x).is_some())
    }
}

/// The number of rows with missing nodes that are processed at a time.
const BLOCK: usize = 256;

/// Computes velocities at the nodes of all rows along an axis. They are NaN at missing nodes, at isolated nodes, and in
/// runs that cannot be fitted. `number` is that of the axis in the summary, which omits failures of rows that are not
/// `needed`.
pub fn fit_rows(
    space: &Erased,
    axis: &Axis,
    number: usize,
    rows: &[f64],
    needed: impl Fn(usize) -> bool,
    monitor: &Monitor,
    velocities: &mut [f64],
) -> Summary {
    let (n, len) = (axis.nodes(), space.point_len());
    let count = rows.len() / (n * len);
    let mut summary = Summary::default();
    if is_complete(rows, len) {
        let offsets: Vec<usize> = (0..=count).map(|row| row * n).collect();
        let rest = vec![0.0; count * len];
        let conditions = axis.ends;
        let problem = Problem {
            t: axis.knots,
            shared: true,
            points: rows,
            offsets: &offsets,
            ends: ends_of(conditions, &rest),
        };
        for (row, report) in fit(space, &problem, &OPTIONS, monitor, velocities).iter().enumerate() {
            if report.status == Status::Converged || needed(row) {
                summary.add(number, report, |node| node);
            }
        }
        return summary;
    }
    velocities.fill(f64::NAN);
    let size = BLOCK * n * len;
    for (k, (rows, velocities)) in rows.chunks(size).zip(velocities.chunks_mut(size)).enumerate() {
        let mut batch = Batch::default();
        for (row, points) in rows.chunks_exact(n * len).enumerate() {
            for run in axis.runs(|node| is_valid(points, node, len)) {
                if run.nodes > 1 {
                    batch.push(axis, row, run, |node| &points[node * len..(node + 1) * len]);
                }
            }
        }
        summary.merge(&batch.fit(space, axis, number, |row| needed(k * BLOCK + row), monitor));
        for curve in batch.curves(len) {
            let row = &mut velocities[curve.owner * n * len..][..n * len];
            for (k, u) in curve.velocities.chunks_exact(len).enumerate() {
                let mut put = |node: usize| row[node * len..(node + 1) * len].copy_from_slice(u);
                let node = axis.index(curve.run.first + k);
                put(node);
                // The first and the last node of a periodic row are one.
                if axis.ends.is_none() && node == 0 {
                    put(n - 1);
                } else if axis.ends.is_none() && node == n - 1 {
                    put(0);
                }
            }
        }
    }
    summary
}

/// Whether all nodes have points.
pub fn is_complete(rows: &[f64], len: usize) -> bool {
    rows.chunks_exact(len).all(|point| !point[0].is_nan())
}

/// Evaluates a quantity of all rows, row after row; NaN outside the runs of a row. Points at nodes need no spline.
/// `complete` states that no node is missing.
pub fn evaluate_rows(
    space: &Erased,
    axis: &Axis,
    rows: &[f64],
    velocities: &[f64],
    complete: bool,
    x: Along,
    quantity: Quantity,
    monitor: &Monitor,
    out: &mut [f64],
) {
    evaluate_segments(space, axis, rows, velocities, complete, x, quantity, monitor, out);
    if quantity != Quantity::Point {
        return;
    }
    // Nodes of rows without a spline.
    let (len, size) = (space.point_len(), axis.nodes() * space.point_len());
    for (row, (points, out)) in
        rows.chunks_exact(size).zip(out.chunks_exact_mut(x.per_row() * len)).enumerate()
    {
        for (out, &x) in out.chunks_exact_mut(len).zip(x.of(row)) {
            if out[0].is_nan()
                && let Some(node) = axis.node_at(x)
            {
                out.copy_from_slice(&points[node * len..(node + 1) * len]);
            }
        }
    }
}

fn evaluate_segments(
    space: &Erased,
    axis: &Axis,
    rows: &[f64],
    velocities: &[f64],
    complete: bool,
    x: Along,
    quantity: Quantity,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let (n, len, per_row) = (axis.nodes(), space.point_len(), x.per_row());
    if complete {
        let curves = Curves { t: axis.knots, nodes: n, points: rows, velocities, before: &[] };
        let own: Vec<f64> = match x {
            Along::Shared(x) => x.to_vec(),
            Along::Own(x) => x.iter().copied().cycle().take(rows.len() / (n * len)).collect(),
        };
        let times = Times { x: &own, count: per_row };
        return evaluate(space, &curves, &times, quantity, axis.outside, monitor, out);
    }
    out.fill(f64::NAN);
    let per_block = (BLOCK * 16 / per_row.max(1)).max(1);
    let blocks = rows.chunks(per_block * n * len).zip(velocities.chunks(per_block * n * len));
    for (k, ((rows, velocities), out)) in blocks.zip(out.chunks_mut(per_block * per_row * len)).enumerate() {
        let mut samples = GridSamples::default();
        let each = rows.chunks_exact(n * len).zip(velocities.chunks_exact(n * len)).enumerate();
        for (row, (points, velocities)) in each {
            for (i, &x) in x.of(k * per_block + row).iter().enumerate() {
                sample(axis, &mut samples, row * per_row + i, points, velocities, x, len);
            }
        }
        samples.evaluate(space, quantity, axis.outside_segment(), monitor, len, out);
    }
}

/// Adds a sample of one row, unless the row has no nodes there.
fn sample(
    axis: &Axis,
    samples: &mut GridSamples,
    owner: usize,
    points: &[f64],
    velocities: &[f64],
    x: f64,
    len: usize,
) {
    let Some(segment) = axis.segment_at(|node| is_valid(points, node, len), x) else { return };
    if segment.left == segment.right {
        return samples.push_node(owner, &points[segment.left * len..segment.right * len + len]);
    }
    let both = segment.left * len..(segment.right + 1) * len;
    let (p, u) = (&points[both.clone()], &velocities[both]);
    let t = [axis.knots[segment.left], axis.knots[segment.right]];
    samples.push(owner, t, [&p[..len], &p[len..]], [&u[..len], &u[len..]], segment.x);
}

/// Carries tangent vectors at the nodes of all rows to the coordinates: the derivative of the points there if `of` is
/// [`Of::Point`], and of the velocities along this axis if it is [`Of::Velocity`].
pub fn push_rows(
    space: &Erased,
    axis: &Axis,
    rows: &[f64],
    velocities: &[f64],
    tangents: &[f64],
    x: Along,
    of: Of,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let (n, len) = (axis.nodes(), space.point_len());
    let row_len = n * len;
    let items: Vec<_> = rows
        .chunks_exact(row_len)
        .zip(velocities.chunks_exact(row_len))
        .zip(tangents.chunks_exact(row_len))
        .zip(out.chunks_exact_mut(x.per_row() * len))
        .enumerate()
        .collect();
    parallel::for_each(items, false, monitor, |(row, (((points, velocities), tangents), out))| {
        out.fill(f64::NAN);
        for run in axis.runs(|i| is_valid(points, i, len)) {
            // The coordinates in this run, and their numbers.
            let inside: Vec<(usize, f64)> = x
                .of(row)
                .iter()
                .enumerate()
                .filter_map(|(k, &x)| {
                    let (segment, x) = axis.locate(x);
                    Some((k, axis.coordinate_in(run, segment, x)?))
                })
                .collect();
            if inside.is_empty() {
                continue;
            }
            let nodes = run.first..run.first + run.nodes;
            let gather = |array: &[f64]| -> Vec<f64> {
                nodes.clone().flat_map(|i| &array[axis.index(i) * len..][..len]).copied().collect()
            };
            let tangents = gather(tangents);
            if run.nodes == 1 {
                if of == Of::Point {
                    inside.iter().for_each(|(k, _)| out[k * len..][..len].copy_from_slice(&tangents));
                }
                continue;
            }
            let t: Vec<f64> = nodes.clone().map(|i| axis.knot(i)).collect();
            let (points, velocities) = (gather(points), gather(velocities));
            let times: Vec<f64> = inside.iter().map(|(_, x)| *x).collect();
            let mut found = vec![0.0; times.len() * len];
            push_curve(space, axis, run, [&t, &points, &velocities, &tangents], &times, of, &mut found);
            for ((k, _), v) in inside.iter().zip(found.chunks_exact(len)) {
                out[k * len..][..len].copy_from_slice(v);
            }
        }
    });
}

/// Carries tangent vectors at the nodes of one curve to the coordinates x. `curve` contains knots, points, velocities and
/// tangent vectors.
fn push_curve(space: &Erased, axis: &Axis, run: Run, curve: [&[f64]; 4], x: &[f64], of: Of, out: &mut [f64]) {
    let [t, points, velocities, tangents] = curve;
    if velocities.iter().chain(tangents).any(|v| !v.is_finite()) {
        return out.fill(f64::NAN);
    }
    let rest = vec![0.0; space.point_len()];
    let ends = ends_of(axis.conditions(run), &rest);
    let change =
        Data { points: tangents.to_vec(), knots: vec![0.0; t.len()], ends: [Vec::new(), Vec::new()] };
    Derivative::new(space, t, points, velocities, &ends).push(x, &[of], &change, out);
}
