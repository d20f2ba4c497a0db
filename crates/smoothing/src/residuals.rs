//! Residuals of the data at a curve.

use crate::frames::Frames;
use crate::information::{self, Root};
use crate::linearized::LinearProblem;
use crate::misfit::Misfit;
use crate::path::{Path, Position, pulls};
use crate::problem::Data;
use std::borrow::Cow;
use symspline_core::space::{Ambient, Erased, Origin};

/// The data relative to the curve.
pub struct Residuals<'a> {
    /// Points of the curve at the times of the data.
    pub gammas: Vec<f64>,
    /// `log_γ y`.
    pub vectors: Vec<f64>,
    /// Squared distances.
    pub distances: Vec<f64>,
    /// The frames of the data, transported to the curve, for information matrices.
    pub transported: Option<Vec<f64>>,
    /// Weighted squared distances.
    pub squares: Vec<f64>,
    /// Residuals in the frames of the knots.
    pub misfit: Misfit<'a>,
}

impl<'a> Residuals<'a> {
    /// Computes the residuals at a curve.
    pub fn new(
        space: &Erased,
        path: &Path,
        frames: &Frames,
        positions: &[Position],
        linearized: &'a LinearProblem,
        data: &Data<'a>,
        roots: &[Root],
    ) -> Self {
        let (m, len) = (space.dim(), space.point_len());
        let gammas = path.at(space, positions);
        let (vectors, distances) = pulls(space, &gammas, data.points);
        let at_knots = |vectors: &[f64]| path.at_knots(space, frames, positions, &gammas, vectors);
        let residuals = at_knots(&vectors);
        if roots.is_empty() {
            let squares = distances.iter().zip(data.weights).map(|(square, w)| square * w).collect();
            let misfit = Misfit::Numbers {
                weights: Cow::Borrowed(data.weights),
                residuals,
                gram: Cow::Borrowed(&linearized.gram),
            };
            return Residuals { gammas, vectors, distances, transported: None, squares, misfit };
        }
        let transported = information::transported_frames(space, &gammas, data.points);
        let columns: Vec<Vec<f64>> =
            (0..m).map(|j| at_knots(&information::members(&transported, j, m, len))).collect();
        let seen = information::at_data(space, roots, &columns, &residuals);
        let square = |s: &[f64]| s.iter().map(|x| x * x).sum();
        let squares = seen.residuals.chunks_exact(m).map(square).collect();
        let misfit = Misfit::matrices(linearized, m, seen);
        Residuals { gammas, vectors, distances, transported: Some(transported), squares, misfit }
    }
}
