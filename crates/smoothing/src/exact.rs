//! The exact way: Gauss–Newton for points and velocities together, under the linearised C² condition.
//!
//! With ξ, υ the moves of point and velocity at the knots, N and A those of the curve at the data and of its
//! acceleration at quadrature points, and C the condition: `min Σ w|r − N(ξ, υ)|² + λ Σ ω|a + A(ξ, υ)|²` subject to
//! `C(ξ, υ) = 0`. Everything is local to a segment: the unknowns of a knot, with the multiplier of its condition, make
//! a block tridiagonal system.

use crate::path::{Path, Place};
use symspline_core::derivative::{Derivative, Matrix, Of, Vector};
use symspline_core::fit::Ends;
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::scalar::{LANES, Lane, few, lane};
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// Two Gauss points a segment: exact where the acceleration is linear, as in flat space.
pub const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// What is known at the data: places and residuals, which are tangent vectors there.
pub struct Pull<'a> {
    /// Where they are.
    pub places: &'a [Place],
    /// `log_γ y`, or what a robust loss makes of it.
    pub vectors: &'a [f64],
    /// Weights.
    pub weights: &'a [f64],
}

/// ∫ |∇γ'|² dt, by two points a segment.
pub fn energy(space: &Erased, path: &Path) -> f64 {
    let len = space.point_len();
    let places = quadrature(path.t.len() - 1);
    let (points, bends) = (path.at(space, &places), path.bends(space, &places));
    let square = |i: usize| {
        let [p, a] = [&points, &bends].map(|x| lanes(&x[i * len..][..len]));
        space.inner(&p, &a, &a).as_array()[0]
    };
    let h = |i: usize| path.t[places[i].0 + 1] - path.t[places[i].0];
    (0..places.len()).map(|i| 0.5 * h(i) * square(i)).sum()
}

fn quadrature(segments: usize) -> Vec<Place> {
    (0..segments).flat_map(|i| GAUSS.map(|tau| (i, tau))).collect()
}

fn lanes(row: &[f64]) -> Vec<Lane> {
    row.iter().map(|&x| lane(x)).collect()
}

/// The step of the points as tangent vectors. λ is in the units of the knots.
pub fn step(
    space: &Erased,
    path: &Path,
    ends: Ends,
    pull: &Pull,
    lam: f64,
    monitor: &Monitor,
    threads: bool,
) -> Vec<f64> {
    let (m, len, n) = (space.dim(), space.point_len(), path.t.len() - 1);
    let derivative = Derivative::new(space, path.t, path.points, path.velocities, &ends);
    // Velocities in units of the mean knot spacing, so that all unknowns are of one size.
    let unit = (path.t[n] - path.t[0]) / n as f64;
    let mut system = Tridiagonal::new(n + 1, 3 * m);

    let places = quadrature(n);
    let samples = [(pull.places, path.at(space, pull.places)), (&places, path.at(space, &places))];
    let bends = path.bends(space, &places);
    let mut parts: Vec<(usize, Matrix, Vector)> =
        (0..n).map(|i| (i, Matrix::zeros(4 * m, 4 * m), Vector::zeros(4 * m))).collect();
    parallel::for_each(parts.iter_mut().collect(), threads, monitor, |(segment, square, right)| {
        let motion = derivative.motion(*segment);
        let mut add = |kind: usize, k: usize, of: Of, vector: &[f64], weight: f64| {
            let ((_, tau), p) = (samples[kind].0[k], &samples[kind].1[k * len..][..len]);
            let (mut matrix, value) =
                in_coordinates(space, &motion.point(tau), &motion.at(tau, of), p, vector);
            for e in 0..2 {
                matrix.columns_mut((2 * e + 1) * m, m).scale_mut(1.0 / unit);
            }
            *square += matrix.tr_mul(&matrix) * weight;
            *right += matrix.tr_mul(&value) * weight;
        };
        let first = pull.places.partition_point(|place| place.0 < *segment);
        let here = pull.places[first..].iter().take_while(|place| place.0 == *segment).count();
        for k in first..first + here {
            add(0, k, Of::Point, &pull.vectors[k * len..][..len], pull.weights[k]);
        }
        let h = path.t[*segment + 1] - path.t[*segment];
        for k in 2 * *segment..2 * *segment + 2 {
            let against: Vec<f64> = bends[k * len..][..len].iter().map(|x| -x).collect();
            add(1, k, Of::Acceleration, &against, lam * h / 2.0);
        }
    });
    for (segment, square, right) in &parts {
        for a in 0..2 {
            for b in 0..2 {
                let block = square.view((2 * a * m, 2 * b * m), (2 * m, 2 * m));
                let mut place = system.block(segment + a, segment + b).view_mut((0, 0), (2 * m, 2 * m));
                place += block;
            }
            let mut rows = system.right[segment + a].rows_mut(0, 2 * m);
            rows += right.rows(2 * a * m, 2 * m);
        }
    }
    for i in 0..=n {
        let row = derivative.condition(i);
        for (from, list, scale) in [(0, &row.points, unit * unit), (m, &row.u, unit)] {
            for (node, matrix) in list {
                let block = matrix * scale;
                let mut place = system.block(i, *node).view_mut((2 * m, from), (m, m));
                place += &block;
                let mut place = system.block(*node, i).view_mut((from, 2 * m), (m, m));
                place += block.transpose();
            }
        }
    }
    let mut out = vec![0.0; (n + 1) * len];
    for (i, x) in system.solve().iter().enumerate() {
        derivative.tangent(i, &x.as_slice()[..m], &mut out[i * len..][..len]);
    }
    out
}

/// The columns of a matrix, tangent at q, and a vector at p in coordinates of one frame: p is the same point, but maybe
/// another array.
fn in_coordinates(
    space: &Erased,
    q: &[f64],
    columns: &Matrix,
    p: &[f64],
    vector: &[f64],
) -> (Matrix, Vector) {
    let (m, p, q) = (space.dim(), lanes(p), lanes(q));
    let mut there = vec![Lane::ZERO; p.len()];
    space.carry(&p, &q, &vec![Lane::ZERO; p.len()], &lanes(vector), &mut there);
    let (p, vector) = (q, there);
    let mut frame = vec![Lane::ZERO; space.frame_len()];
    space.lift(&p, &mut frame);
    let count = columns.ncols();
    let mut all = Matrix::zeros(m, count + 1);
    let (mut v, mut x) = (vec![Lane::ZERO; p.len()], vec![Lane::ZERO; m]);
    for first in (0..=count).step_by(LANES) {
        for (row, v) in v.iter_mut().enumerate() {
            let number = |c: usize| if c < count { columns[(row, c)] } else { vector[row].as_array()[0] };
            *v = Lane::new(few(|l| number((first + l).min(count))));
        }
        space.coordinates(&frame, &p, &v, &mut x);
        for l in 0..LANES.min(count + 1 - first) {
            (0..m).for_each(|row| all[(row, first + l)] = x[row].as_array()[l]);
        }
    }
    let value = all.column(count).into_owned();
    (all.columns(0, count).into_owned(), value)
}

/// A block tridiagonal system.
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
        &mut self.sides[1 + column - row][row]
    }

    /// By elimination with exchanges inside the blocks.
    fn solve(self) -> Vec<Vector> {
        let Tridiagonal { sides: [lower, mut diagonal, mut upper], mut right } = self;
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
}
