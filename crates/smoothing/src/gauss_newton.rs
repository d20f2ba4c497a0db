//! Full Gauss–Newton: a step for points and velocities together, under the linearised C² condition.
//!
//! With ξ, υ the changes of point and velocity at the knots, N and A those of the curve at the data and of its
//! acceleration at quadrature points, and C the condition: `min Σ w|r − N(ξ, υ)|² + λ Σ ω|a + A(ξ, υ)|²` subject to
//! `C(ξ, υ) = 0`. Each term depends on one segment only, so the unknowns of the knots, with the multipliers of their
//! conditions, form a block tridiagonal system.

use crate::information::{self, Root};
use crate::path::{Path, Position};
use symspline_core::derivative::{Derivative, Matrix, Of, Vector};
use symspline_core::fit::Ends;
use symspline_core::memory;
use symspline_core::monitor::{Monitor, checkpoint};
use symspline_core::parallel;
use symspline_core::scalar::{LANES, Lane, few, lane};
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// Two Gauss points per segment: exact where the acceleration is linear, as in flat space.
pub const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// The data relative to the curve: positions and residuals, which are tangent vectors there.
pub struct Pull<'a> {
    /// The positions of the data.
    pub positions: &'a [Position],
    /// The points of the curve there.
    pub points: &'a [f64],
    /// `log_γ y`.
    pub vectors: &'a [f64],
    /// Weights.
    pub weights: &'a [f64],
    /// The factors of the weights due to a robust loss; None for one.
    pub factors: Option<&'a [f64]>,
    /// Roots of weight matrices, and the frames of the data transported to the curve.
    pub information: Option<(&'a [Root], &'a [f64])>,
}

/// ∫ |∇γ'|² dt, with two points per segment, and a factor of each segment.
pub fn energy(space: &Erased, path: &Path, profile: &[f64]) -> f64 {
    let len = space.point_len();
    let positions = quadrature(path.t.len() - 1);
    let (points, accelerations) = (path.at(space, &positions), path.accelerations(space, &positions));
    let square = |i: usize| {
        let [p, a] = [&points, &accelerations].map(|x| lanes(&x[i * len..][..len]));
        space.inner(&p, &a, &a).as_array()[0]
    };
    let h = |i: usize| path.t[i + 1] - path.t[i];
    let weight = |i: usize| 0.5 * profile[positions[i].0] * h(positions[i].0);
    (0..positions.len()).map(|i| weight(i) * square(i)).sum()
}

fn quadrature(segments: usize) -> Vec<Position> {
    (0..segments).flat_map(|i| GAUSS.map(|tau| (i, tau))).collect()
}

fn lanes(row: &[f64]) -> Vec<Lane> {
    row.iter().map(|&x| lane(x)).collect()
}

/// The step of the points as tangent vectors. λ is in the units of the knots, with a factor of each segment.
pub fn step(
    space: &Erased,
    path: &Path,
    ends: Ends,
    pull: &Pull,
    (lam, profile): (f64, &[f64]),
    monitor: &Monitor,
    threads: bool,
) -> Vec<f64> {
    let (m, len, n) = (space.dim(), space.point_len(), path.t.len() - 1);
    // Derivatives of all segments, a square matrix and its factor per segment, and the tridiagonal system.
    memory::require(
        (n + 1) as f64 * (m * m + 16) as f64 * 140.0,
        "smoothing by full Gauss–Newton",
        "Pass method='linearized', use fewer knots, or smooth the data in parts",
    );
    let derivative = Derivative::new(space, path.t, path.points, path.velocities, &ends, 1);
    // Velocities in units of the mean knot spacing, so that all unknowns have a similar size.
    let unit = (path.t[n] - path.t[0]) / n as f64;
    // The last knot of a closed curve equals the first.
    let closed = matches!(ends, Ends::Periodic);
    let nodes = if closed { n } else { n + 1 };
    let mut system = Tridiagonal::new(nodes, 3 * m);

    let positions = quadrature(n);
    let between = path.at(space, &positions);
    let samples = [(pull.positions, pull.points), (&positions, &between)];
    let accelerations = path.accelerations(space, &positions);
    // Derivatives by reverse mode where it has those of accelerations, otherwise segment by segment.
    let rows = [
        rows(&derivative, pull.positions, Of::Point, monitor, threads),
        rows(&derivative, &positions, Of::Acceleration, monitor, threads),
    ];
    let rows = match rows {
        [Some(points), Some(bends)] => Some([points, bends]),
        _ => None,
    };
    let mut parts: Vec<(usize, Matrix, Vector)> =
        (0..n).map(|i| (i, Matrix::zeros(4 * m, 4 * m), Vector::zeros(4 * m))).collect();
    parallel::for_each(parts.iter_mut().collect(), threads, monitor, |(segment, square, right)| {
        checkpoint();
        let motion = rows.is_none().then(|| derivative.motion(*segment));
        // The data are points, the samples between them accelerations.
        let at = |kind: usize, k: usize, vectors: &[f64]| {
            let ((_, tau), p) = (samples[kind].0[k], &samples[kind].1[k * len..][..len]);
            if let (Some(rows), None) = (&rows, &motion) {
                let (matrices, points) = &rows[kind][k / BLOCK];
                let (at, none) = (k % BLOCK, Matrix::zeros(len, 0));
                let (_, vectors) = in_coordinates(space, &points[at * len..][..len], &none, p, vectors);
                return (matrices[at].clone(), vectors);
            }
            let Some(motion) = &motion else { unreachable!("either of them exists") };
            let columns = if kind == 0 { motion.point(tau) } else { motion.acceleration(tau) };
            in_coordinates(space, &motion.gamma(tau), &columns, p, vectors)
        };
        // With rows N of a weight: |N x|² and its cotangent with respect to x.
        let mut add = |mut matrix: Matrix, rows: Option<&Matrix>, pull: Vector, weight: f64| {
            for e in 0..2 {
                matrix.columns_mut((2 * e + 1) * m, m).scale_mut(1.0 / unit);
            }
            *right += matrix.tr_mul(&pull) * weight;
            let weighed = rows.map_or(matrix.clone(), |rows| rows * &matrix);
            *square += weighed.tr_mul(&weighed) * weight;
        };
        let first = pull.positions.partition_point(|position| position.0 < *segment);
        let here = pull.positions[first..].iter().take_while(|position| position.0 == *segment).count();
        for k in first..first + here {
            let r = &pull.vectors[k * len..][..len];
            let factor = pull.factors.map_or(1.0, |factors| factors[k]);
            if let Some((roots, frames)) = pull.information {
                let frame = &frames[k * m * len..][..m * len];
                let (matrix, all) = at(0, k, &[r, frame].concat());
                let (r, frame) = (all.column(0).into_owned(), all.columns(1, m).into_owned());
                let (rows, _, own) = information::at(space, &roots[k].matrix, &frame, &r);
                add(matrix, Some(&rows), own, factor);
            } else {
                let (matrix, r) = at(0, k, r);
                add(matrix, None, r.column(0).into_owned(), pull.weights[k] * factor);
            }
        }
        let h = path.t[*segment + 1] - path.t[*segment];
        for k in 2 * *segment..2 * *segment + 2 {
            let (matrix, bend) = at(1, k, &accelerations[k * len..][..len]);
            add(matrix, None, -bend.column(0), lam * profile[*segment] * h / 2.0);
        }
    });
    for (segment, square, right) in &parts {
        for a in 0..2 {
            for b in 0..2 {
                let block = square.view((2 * a * m, 2 * b * m), (2 * m, 2 * m));
                let (row, column) = ((segment + a) % nodes, (segment + b) % nodes);
                let mut position = system.block(row, column).view_mut((0, 0), (2 * m, 2 * m));
                position += block;
            }
            let mut rows = system.right[(segment + a) % nodes].rows_mut(0, 2 * m);
            rows += right.rows(2 * a * m, 2 * m);
        }
    }
    for i in 0..nodes {
        let row = derivative.condition(i);
        for (from, list, scale) in [(0, &row.points, unit * unit), (m, &row.u, unit)] {
            for (node, matrix) in list {
                let block = matrix * scale;
                let mut position = system.block(i, *node).view_mut((2 * m, from), (m, m));
                position += &block;
                let mut position = system.block(*node, i).view_mut((from, 2 * m), (m, m));
                position += block.transpose();
            }
        }
    }
    let mut out = vec![0.0; (n + 1) * len];
    let found = if closed { system.solve_cyclic() } else { system.solve() };
    let coordinates: Vec<f64> = found.iter().flat_map(|x| &x.as_slice()[..m]).copied().collect();
    out[..nodes * len].copy_from_slice(&derivative.tangents(&coordinates));
    if closed {
        let (first, last) = out.split_at_mut(n * len);
        last.copy_from_slice(&first[..len]);
    }
    out
}

/// Samples of one task.
const BLOCK: usize = 512;

/// Matrices and points of [`Derivative::rows`], block by block.
type Rows = Vec<(Vec<Matrix>, Vec<f64>)>;

fn rows(
    derivative: &Derivative,
    positions: &[Position],
    of: Of,
    monitor: &Monitor,
    threads: bool,
) -> Option<Rows> {
    let mut blocks: Vec<(&[Position], Option<_>)> =
        positions.chunks(BLOCK).map(|block| (block, None)).collect();
    parallel::for_each(blocks.iter_mut().collect(), threads, monitor, |(block, rows)| {
        *rows = derivative.rows(block, of);
    });
    blocks.into_iter().map(|(_, rows)| rows).collect()
}

/// The columns of a matrix, tangent at q, and vectors at p in coordinates of one frame. The arrays p and q represent
/// the same point.
fn in_coordinates(
    space: &Erased,
    q: &[f64],
    columns: &Matrix,
    p: &[f64],
    vectors: &[f64],
) -> (Matrix, Matrix) {
    let (m, len, p, q) = (space.dim(), p.len(), lanes(p), lanes(q));
    let mut frame = vec![Lane::ZERO; space.frame_len()];
    space.lift(&q, &mut frame);
    let [still, mut v, mut there] = [(); 3].map(|_| vec![Lane::ZERO; len]);
    let mut x = vec![Lane::ZERO; m];
    let mut coordinates = |count: usize, number: &dyn Fn(usize, usize) -> f64, transported: bool| {
        let mut all = Matrix::zeros(m, count);
        for first in (0..count).step_by(LANES) {
            for (row, v) in v.iter_mut().enumerate() {
                *v = Lane::new(few(|l| number(row, (first + l).min(count - 1))));
            }
            if transported {
                space.parallel_transport(&p, &q, &still, &v, &mut there);
                v.copy_from_slice(&there);
            }
            space.coordinates(&frame, &q, &v, &mut x);
            for l in 0..LANES.min(count - first) {
                (0..m).for_each(|row| all[(row, first + l)] = x[row].as_array()[l]);
            }
        }
        all
    };
    (
        coordinates(columns.ncols(), &|row, c| columns[(row, c)], false),
        coordinates(vectors.len() / len, &|row, c| vectors[c * len + row], true),
    )
}

/// A block tridiagonal system; cyclic where the last node is a neighbour of the first.
struct Tridiagonal {
    /// Blocks left of, on and right of the diagonal.
    sides: [Vec<Matrix>; 3],
    right: Vec<Vector>,
}

impl Tridiagonal {
    fn new(nodes: usize, size: usize) -> Self {
        let zeros = || vec![Matrix::zeros(size, size); nodes];
        Tridiagonal { sides: [zeros(), zeros(), zeros()], right: vec![Vector::zeros(size); nodes] }
    }

    fn block(&mut self, row: usize, column: usize) -> &mut Matrix {
        let side = match (row, column) {
            (0, column) if column > 1 => 0,
            (row, 0) if row > 1 => 2,
            _ => 1 + column - row,
        };
        &mut self.sides[side][row]
    }

    /// Elimination with pivoting inside the blocks.
    fn solve(self) -> Vec<Vector> {
        let Tridiagonal { sides: [lower, diagonal, upper], right } = self;
        let right = right.into_iter().map(|x| Matrix::from_columns(&[x])).collect();
        let found = eliminated(&lower, diagonal, upper, right);
        found.iter().map(|x| x.column(0).into_owned()).collect()
    }

    /// The same for a closed curve: the last node is eliminated last.
    fn solve_cyclic(mut self) -> Vec<Vector> {
        let last = self.right.len() - 1;
        let size = self.right[last].len();
        let take = |x: &mut Matrix| std::mem::replace(x, Matrix::zeros(size, size));
        let [lower, diagonal, upper] = &mut self.sides;
        // The coupling of the other nodes to the last one, and of the last one to them.
        let (first_sees, before_sees) = (take(&mut lower[0]), take(&mut upper[last - 1]));
        let (sees_before, sees_first, own) =
            (take(&mut lower[last]), take(&mut upper[last]), take(&mut diagonal[last]));
        let mut right: Vec<Matrix> = self.right[..last]
            .iter()
            .map(|x| {
                let mut columns = Matrix::zeros(size, size + 1);
                columns.set_column(size, x);
                columns
            })
            .collect();
        right[0].columns_mut(0, size).copy_from(&first_sees);
        let mut before = right[last - 1].columns_mut(0, size);
        before += &before_sees;
        let [lower, mut diagonal, mut upper] = self.sides;
        diagonal.truncate(last);
        upper.truncate(last);
        let found = eliminated(&lower, diagonal, upper, right);
        let seen = &sees_before * &found[last - 1] + &sees_first * &found[0];
        let rest = &self.right[last] - seen.column(size);
        let x = (own - seen.columns(0, size)).lu().solve(&rest);
        let x = x.unwrap_or_else(|| Vector::from_element(size, f64::NAN));
        let mut out: Vec<Vector> =
            found.iter().map(|found| found.column(size) - found.columns(0, size) * &x).collect();
        out.push(x);
        out
    }
}

/// The solutions of a block tridiagonal system for some right sides.
fn eliminated(
    lower: &[Matrix],
    mut diagonal: Vec<Matrix>,
    mut upper: Vec<Matrix>,
    mut right: Vec<Matrix>,
) -> Vec<Matrix> {
    for i in 0..right.len() {
        if i > 0 {
            let (above, from_above) = (&lower[i] * &upper[i - 1], &lower[i] * &right[i - 1]);
            diagonal[i] -= above;
            right[i] -= from_above;
        }
        let factors = std::mem::replace(&mut diagonal[i], Matrix::zeros(0, 0)).lu();
        let whole = factors.solve_mut(&mut upper[i]) && factors.solve_mut(&mut right[i]);
        if !whole {
            right[i].fill(f64::NAN);
        }
    }
    for i in (0..right.len() - 1).rev() {
        let behind = &upper[i] * &right[i + 1];
        right[i] -= behind;
    }
    right
}
