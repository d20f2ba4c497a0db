//! Information matrices as weights: some directions of a datum are more accurate than others.
//!
//! With e the coordinates of `log_y γ(t)` in a frame at the datum y, the datum adds `eᵀWe = |Re|²` to the sum of
//! squares. Transported along the geodesic to γ(t), e is −r, the coordinates of `log_γ y` there. If the curve moves
//! by ξ, e changes by `S(r)⁻¹ξ`: ξ is the value of a Jacobi field that vanishes at y (Lemma A.2).

use crate::frames::lanes_of;
use symspline_core::derivative::{Matrix, Vector};
use symspline_core::scalar::{LANES, Lane, few, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// Eigenvalues below this fraction of the largest are rounding errors.
const SINGULAR: f64 = 1e-10;

/// The matrix W of a datum.
pub struct Root {
    /// R with W = RᵀR.
    pub matrix: Matrix,
    /// The number of directions with information.
    pub rank: usize,
    /// One over the mean variance in these directions.
    pub weight: f64,
}

/// Roots of matrices, one after another.
pub fn roots(information: &[f64], m: usize) -> Vec<Root> {
    let root = |w: &[f64]| {
        let parts = Matrix::from_row_slice(m, m, w).symmetric_eigen();
        let least = SINGULAR * parts.eigenvalues.max();
        let known = parts.eigenvalues.map(|x| if x > least { x } else { 0.0 });
        let rank = known.iter().filter(|x| **x > 0.0).count();
        let variances: f64 = known.iter().filter(|x| **x > 0.0).map(|x| 1.0 / x).sum();
        Root {
            matrix: Matrix::from_diagonal(&known.map(f64::sqrt)) * parts.eigenvectors.transpose(),
            rank,
            weight: rank as f64 / variances,
        }
    };
    information.chunks_exact(m * m).map(root).collect()
}

/// The frames at data, transported along the geodesics to points of a curve: m vectors each.
pub fn transported_frames(space: &Erased, gammas: &[f64], data: &[f64]) -> Vec<f64> {
    let (len, m) = (space.point_len(), space.dim());
    let count = gammas.len() / len;
    let mut out = vec![0.0; count * m * len];
    let [mut p, mut y, mut way, mut v, mut there] = [(); 5].map(|_| vec![Lane::ZERO; len]);
    let (mut frame, mut x) = (vec![Lane::ZERO; space.frame_len()], vec![Lane::ZERO; m]);
    let mut rows = vec![0.0; LANES * len];
    for group in 0..count.div_ceil(LANES) {
        let at = lanes_of(group, count);
        gather(at.map(|i| &gammas[i * len..][..len]), &mut p);
        gather(at.map(|i| &data[i * len..][..len]), &mut y);
        space.log(&y, &p, &mut way);
        space.lift(&y, &mut frame);
        for j in 0..m {
            x.fill(Lane::ZERO);
            x[j] = Lane::ONE;
            space.tangent(&frame, &y, &x, &mut v);
            space.parallel_transport(&y, &p, &way, &v, &mut there);
            scatter(&there, &mut rows);
            for (i, row) in at.iter().zip(rows.chunks_exact(len)) {
                out[(i * m + j) * len..][..len].copy_from_slice(row);
            }
        }
    }
    out
}

/// The j-th vectors of frames of m.
pub fn members(frames: &[f64], j: usize, m: usize, len: usize) -> Vec<f64> {
    frames.chunks_exact(len).skip(j).step_by(m).flatten().copied().collect()
}

/// Data with information matrices, linearised at a curve, one after another.
#[derive(Clone)]
pub struct Seen {
    /// N, m × m numbers row by row: s changes by about −Nξ if the curve moves by ξ.
    pub rows: Vec<f64>,
    /// s, whose squares are the contribution of a datum.
    pub residuals: Vec<f64>,
    /// Minus half of the gradient of |s|².
    pub pulls: Vec<f64>,
    /// The number of observed coordinates of each datum.
    pub ranks: Vec<usize>,
}

/// For all data with residuals, given the j-th frame vectors of all data in `columns[j]`.
pub fn at_data(space: &Erased, roots: &[Root], columns: &[Vec<f64>], residuals: &[f64]) -> Seen {
    let m = columns.len();
    let ranks = roots.iter().map(|root| root.rank).collect();
    let mut all = Seen { rows: Vec::new(), residuals: Vec::new(), pulls: Vec::new(), ranks };
    for (k, (root, r)) in roots.iter().zip(residuals.chunks_exact(m)).enumerate() {
        let frame = Matrix::from_fn(m, m, |row, j| columns[j][k * m + row]);
        let (n, s, pull) = at(space, &root.matrix, &frame, &Vector::from_column_slice(r));
        all.rows.extend(n.transpose().iter());
        all.residuals.extend(s.iter());
        all.pulls.extend(pull.iter());
    }
    all
}

/// For a datum with residual r: `N = R`, `s = R r` and the cotangent `S(r)⁻ᵀRᵀRr`, in the coordinates of its frame. N
/// omits S, so that weights that are multiples of the identity have the same effect as scalars: S is the identity
/// along r.
///
/// The columns of `frame` are the vectors of that frame, in the coordinates of r and ξ.
pub fn at(space: &Erased, root: &Matrix, frame: &Matrix, r: &Vector) -> (Matrix, Vector, Vector) {
    let m = space.dim();
    let Some(back) = frame.clone().try_inverse() else {
        return (
            Matrix::from_element(m, m, f64::NAN),
            Vector::from_element(m, f64::NAN),
            Vector::from_element(m, f64::NAN),
        );
    };
    let rows = root * back;
    let residual = &rows * r;
    let pull = rows.tr_mul(&residual);
    // S is singular at the first conjugate point; data must be closer.
    let pull = stretch(space, r).transpose().lu().solve(&pull).unwrap_or(pull);
    (rows, residual, pull)
}

/// S(r) of Lemma A.2.
fn stretch(space: &Erased, r: &Vector) -> Matrix {
    let m = space.dim();
    let mut out = Matrix::zeros(m, m);
    let r: Vec<Lane> = r.iter().map(|&x| lane(x)).collect();
    for first in (0..m).step_by(LANES) {
        let mut x: Vec<Lane> =
            (0..m).map(|row| Lane::new(few(|l| if first + l == row { 1.0 } else { 0.0 }))).collect();
        space.stretch(&r, &mut x);
        for l in 0..LANES.min(m - first) {
            (0..m).for_each(|row| out[(row, first + l)] = x[row].as_array()[l]);
        }
    }
    out
}
