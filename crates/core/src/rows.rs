//! Operations of a space on arrays of points and tangent vectors, one row per SIMD lane.

use crate::monitor::{Monitor, checkpoint};
use crate::parallel;
use crate::scalar::{LANES, Lane, few, gather, lane, scatter};
use crate::space::{Ambient, Erased, Frame, Origin, Space, below};

/// Maximum number of rows that one thread processes at a time.
const BLOCK: usize = 1024;
/// Number of entries from which several threads are certainly faster.
const PARALLEL: usize = 1 << 16;

/// An operation on rows, with its inputs after the colon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// exp_p(v): p, v
    Exp,
    /// log_p(q): p, q
    Log,
    /// [p, q]_t: p, q, t
    Geodesic,
    /// distance: p, q
    Distance,
    /// the deciding angle divided by the cut angle: p, q
    CutFraction,
    /// E_p(v)·x: p, v, x
    Transvection,
    /// parallel transport of v from p to q: p, q, v
    Transport,
    /// inner product: p, u, v
    Inner,
    /// the spacing of neighbouring floating-point points, in rounding errors: p
    Rounding,
    /// the projection of x onto the space: x
    Project,
    /// the tangential part of v at p: p, v
    ProjectTangent,
    /// a random point from standard normal numbers: x
    RandomPoint,
    /// a random tangent vector at p from standard normal numbers: p, x
    RandomTangent,
}

impl Operation {
    /// Numbers in a row of the result, for points of `len` numbers.
    pub fn row_len(self, len: usize) -> usize {
        match self {
            Operation::Distance | Operation::CutFraction | Operation::Inner | Operation::Rounding => 1,
            _ => len,
        }
    }

    /// Whether points at or past each other's cut locus are an error.
    fn needs_log(self) -> bool {
        matches!(self, Operation::Log | Operation::Geodesic | Operation::Transport)
    }
}

/// A row on which the operation failed: its index and the deciding angle.
pub type RowFault = (usize, f64);

/// Applies an operation to every row. All inputs have as many rows as the result.
pub fn apply(
    space: &Erased,
    operation: Operation,
    inputs: &[&[f64]],
    t: &[f64],
    monitor: &Monitor,
    out: &mut [f64],
) -> Result<(), RowFault> {
    let len = space.point_len();
    let size = operation.row_len(len);
    let limit = below(space.cut_angle());
    let parallel = out.len() > PARALLEL;
    let faults = std::sync::Mutex::new(None::<RowFault>);
    let length = parallel::block(BLOCK, len);
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(length * size).enumerate().collect();
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let mut x: [Vec<Lane>; 3] = std::array::from_fn(|_| vec![Lane::ZERO; len]);
        let (mut result, mut log) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
        let mut frame = Vec::new();
        let rows = out.len() / size;
        for (group, out) in out.chunks_mut(LANES * size).enumerate() {
            let at: [usize; LANES] = few(|l| block * length + (group * LANES + l).min(rows - 1));
            for (x, input) in x.iter_mut().zip(inputs) {
                gather(at.map(|i| &input[i * len..(i + 1) * len]), x);
            }
            let [a, b, c] = &mut x;
            let measures = matches!(operation, Operation::Distance | Operation::CutFraction);
            let angle =
                if operation.needs_log() || measures { space.log(a, b, &mut log) } else { Lane::ZERO };
            match operation {
                Operation::Exp => space.ray(a, b, Lane::ONE, &mut result),
                Operation::Log => result.copy_from_slice(&log),
                Operation::Geodesic => {
                    let t = Lane::new(at.map(|i| t[i]));
                    space.geodesic(a, b, t, &mut result);
                    // The weights of the end points cancel near the cut locus; a direction does not.
                    let far = angle.simd_gt(lane(0.9 * space.cut_angle()));
                    if far.any() {
                        space.ray(a, &log, t, c);
                        result.iter_mut().zip(&*c).for_each(|(x, y)| *x = far.select(*y, *x));
                    }
                }
                Operation::Distance => result[0] = space.distance(a, b, &log, angle),
                Operation::CutFraction => {
                    // The angle returned by a logarithm is exact only near the cut locus.
                    let exact = angle.simd_lt(limit).select(space.angle_at(a, &log), angle);
                    result[0] = exact / lane(space.cut_angle());
                }
                Operation::Transvection => space.transvect(a, b, c, &mut result),
                Operation::Transport => space.parallel_transport(a, b, &log, c, &mut result),
                Operation::Inner => result[0] = space.inner(a, b, c),
                Operation::Rounding => result[0] = space.rounding(a),
                Operation::Project => {
                    space.project(a);
                    result.copy_from_slice(a);
                }
                Operation::RandomPoint => {
                    space.random_point(a);
                    result.copy_from_slice(a);
                }
                Operation::RandomTangent => {
                    frame.resize(space.frame_len(), Lane::ZERO);
                    space.lift(a, &mut frame);
                    space.tangent(&frame, a, &b[..space.dim()], &mut result);
                }
                Operation::ProjectTangent => {
                    space.project_tangent(a, b);
                    result.copy_from_slice(b);
                }
            }
            if operation.needs_log() && !angle.simd_lt(limit).all() {
                let angle = angle.to_array();
                let bad = (0..LANES).find(|&l| !(angle[l] < limit.to_array()[l]));
                if let (Some(l), Ok(mut first)) = (bad, faults.lock())
                    && first.is_none_or(|(i, _)| at[l] < i)
                {
                    *first = Some((at[l], angle[l]));
                }
            }
            scatter(&result[..size], out);
        }
    });
    faults.into_inner().ok().flatten().map_or(Ok(()), Err)
}

/// Applies a function of a row per lane to arrays with the same number of rows each, for a result with rows of `len` numbers.
pub fn map(
    len: usize,
    inputs: &[&[f64]],
    monitor: &Monitor,
    out: &mut [f64],
    f: impl Fn(&[Vec<Lane>], &mut [Lane]) + Sync,
) {
    let length = parallel::block(BLOCK, len);
    let parallel = out.len() > PARALLEL;
    let total = (out.len() / len).max(1);
    let widths: Vec<usize> = inputs.iter().map(|x| x.len() / total).collect();
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(length * len).enumerate().collect();
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let mut x: Vec<Vec<Lane>> = widths.iter().map(|&width| vec![Lane::ZERO; width]).collect();
        let mut result = vec![Lane::ZERO; len];
        let rows = out.len() / len;
        for (group, out) in out.chunks_mut(LANES * len).enumerate() {
            let at: [usize; LANES] = few(|l| block * length + (group * LANES + l).min(rows - 1));
            for ((x, input), &width) in x.iter_mut().zip(inputs).zip(&widths) {
                gather(at.map(|i| &input[i * width..(i + 1) * width]), x);
            }
            f(&x, &mut result);
            scatter(&result, out);
        }
    });
}

/// The approximate number of eight-byte numbers that one group of rows occupies in an operation on a space.
pub fn memory(space: &Erased, operation: Option<Operation>) -> f64 {
    // Functions of a matrix occupy some dozens of its size, with one number for every lane.
    let matrices = if space.point_shape().len() > 1 { 40.0 } else { 8.0 };
    let frame = if operation == Some(Operation::RandomTangent) { space.frame_len() as f64 } else { 0.0 };
    // Bases of algebras contain a position, a number and a list for each dimension.
    LANES as f64 * (matrices * space.point_len() as f64 + frame) + 5.0 * space.dim() as f64
}

/// Projects points in place. The first point that is farther away than `tol`, or not finite, is an error: its row,
/// its distance, and the condition that it violates.
pub fn project_points(space: &Erased, points: &mut [f64], tol: f64) -> Result<(), (usize, f64, String)> {
    let len = space.point_len();
    let first = std::sync::Mutex::new(None);
    let parallel = points.len() > PARALLEL;
    let length = parallel::block(BLOCK, len);
    let blocks: Vec<(usize, &mut [f64])> = points.chunks_mut(length * len).enumerate().collect();
    let quiet = |_| true;
    parallel::for_each(blocks, parallel, &Monitor::new(&quiet), |(block, rows)| {
        if let Err((row, off)) = project_block(space, rows, tol)
            && let Ok(mut first) = first.lock()
        {
            let row = block * length + row;
            if first.is_none_or(|(earlier, _)| row < earlier) {
                *first = Some((row, off));
            }
        }
    });
    match first.into_inner() {
        Ok(Some((row, off))) => {
            let x = &points[row * len..(row + 1) * len];
            let finite = x.iter().all(|x| x.is_finite());
            Err((row, off, if finite { space.violation(x) } else { "it is not finite".into() }))
        }
        _ => Ok(()),
    }
}

/// Projects some points; stops at the first one that is too far away.
fn project_block(space: &Erased, points: &mut [f64], tol: f64) -> Result<(), (usize, f64)> {
    let len = space.point_len();
    let mut x = vec![Lane::ZERO; len];
    for (group, rows) in points.chunks_mut(LANES * len).enumerate() {
        checkpoint();
        let last = rows.len() / len - 1;
        let at: [usize; LANES] = few(|l| l.min(last) * len);
        gather(at.map(|i| &rows[i..i + len]), &mut x);
        let off = space.project(&mut x);
        if !off.simd_le(lane(tol)).all() {
            let off = off.to_array();
            if let Some(l) = (0..=last).find(|&l| !(off[l] <= tol)) {
                return Err((group * LANES + l, off[l]));
            }
        }
        scatter(&x, rows);
    }
    Ok(())
}

/// The normal components of vectors at their points, row by row: relative to their length, or to the rounding of the
/// point for vectors of that size.
pub fn tangent_defects(space: &Erased, points: &[f64], vectors: &[f64]) -> Vec<f64> {
    let len = space.point_len();
    let rows = points.len() / len;
    let (mut p, mut v) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
    let mut defects = Vec::with_capacity(rows + LANES);
    for group in 0..rows.div_ceil(LANES) {
        checkpoint();
        let at: [usize; LANES] = few(|l| (group * LANES + l).min(rows - 1) * len);
        gather(at.map(|i| &points[i..i + len]), &mut p);
        gather(at.map(|i| &vectors[i..i + len]), &mut v);
        defects.extend(space.project_tangent(&p, &mut v).to_array());
    }
    defects.truncate(rows);
    defects
}

/// The deciding angle of a tangent vector at a point.
pub fn handle_angle(space: &Erased, point: &[f64], vector: &[f64]) -> f64 {
    let p: Vec<Lane> = point.iter().map(|&x| lane(x)).collect();
    let v: Vec<Lane> = vector.iter().map(|&x| lane(x)).collect();
    space.angle_at(&p, &v).to_array()[0]
}
