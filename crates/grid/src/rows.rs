//! Rows of nodes along one axis: their splines, values, and derivatives with respect to the nodes.

use crate::axis::{Axis, Run};
use crate::batch::{Batch, ends_of};
use crate::grid::{OPTIONS, is_valid};
use crate::samples::GridSamples;
use crate::summary::Summary;
use symspline_core::curve::{Curves, Quantity, Times, evaluate};
use symspline_core::derivative::{Data, Derivative, MOST_CURVES, Of};
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
    let len = space.point_len();
    let row_len = axis.nodes() * len;
    out.fill(f64::NAN);
    let mut curves = Vec::new();
    for (k, out) in out.chunks_exact_mut(x.per_row() * len).enumerate() {
        let [points, velocities, tangents] =
            [rows, velocities, tangents].map(|x| &x[k * row_len..][..row_len]);
        let is_finite = |run: Run| {
            let mut nodes = (run.first..run.first + run.nodes).map(|i| axis.index(i) * len);
            nodes.all(|at| {
                velocities[at..at + len].iter().chain(&tangents[at..at + len]).all(|v| v.is_finite())
            })
        };
        for run in axis.runs(|i| is_valid(points, i, len)) {
            // The coordinates in this run, and their numbers.
            let located = x.of(k).iter().enumerate().filter_map(|(i, &x)| {
                let (segment, x) = axis.locate(x);
                Some((i, axis.coordinate_in(run, segment, x)?))
            });
            let (numbers, x): (Vec<usize>, Vec<f64>) = located.unzip();
            if run.nodes == 1 {
                if of == Of::Point {
                    let tangent = &tangents[axis.index(run.first) * len..][..len];
                    numbers.iter().for_each(|i| out[i * len..][..len].copy_from_slice(tangent));
                }
            } else if !numbers.is_empty() && is_finite(run) {
                curves.push(Pushed { row: k, run, numbers, x });
            }
        }
    }
    // Curves that are alike are computed together.
    let kind = |curve: &Pushed| (curve.run.first, curve.run.nodes, curve.run.closed, curve.x.len());
    curves.sort_by_key(kind);
    let mut groups: Vec<(&[Pushed], Vec<f64>)> = curves
        .chunk_by(|a, b| kind(a) == kind(b))
        .flat_map(|alike| alike.chunks(MOST_CURVES))
        .map(|group| (group, Vec::new()))
        .collect();
    parallel::for_each(groups.iter_mut().collect(), false, monitor, |(group, moved)| {
        let run = group[0].run;
        let gather = |array: &[f64]| -> Vec<f64> {
            let of_curve = |curve: &Pushed| {
                let nodes = curve.row * row_len;
                (run.first..run.first + run.nodes).flat_map(move |i| {
                    let at = nodes + axis.index(i) * len;
                    at..at + len
                })
            };
            group.iter().flat_map(of_curve).map(|i| array[i]).collect()
        };
        let t: Vec<f64> = (run.first..run.first + run.nodes).map(|i| axis.knot(i)).collect();
        let t = t.repeat(group.len());
        let x: Vec<f64> = group.iter().flat_map(|curve| &curve.x).copied().collect();
        let [points, velocities, tangents] = [rows, velocities, tangents].map(gather);
        let rest = vec![0.0; group.len() * len];
        let ends = ends_of(axis.conditions(run), &rest);
        let change = Data { points: tangents, knots: vec![0.0; t.len()], ends: [Vec::new(), Vec::new()] };
        moved.resize(x.len() * len, 0.0);
        Derivative::new(space, &t, &points, &velocities, &ends, group.len()).push(&x, &[of], &change, moved);
    });
    for (group, moved) in &groups {
        let size = moved.len() / group.len();
        for (curve, moved) in group.iter().zip(moved.chunks_exact(size)) {
            let out = &mut out[curve.row * x.per_row() * len..][..x.per_row() * len];
            for (i, v) in curve.numbers.iter().zip(moved.chunks_exact(len)) {
                out[i * len..][..len].copy_from_slice(v);
            }
        }
    }
}

/// A run of a row, and the coordinates there at which it is differentiated.
struct Pushed {
    row: usize,
    run: Run,
    numbers: Vec<usize>,
    x: Vec<f64>,
}
