//! The stages of a fit with a robust loss.
//!
//! Choosing λ by cross-validation while outliers still influence the curve and the noise level often fails: the level
//! and λ decrease to zero together. Therefore λ is chosen from data without outliers, and the M-estimator is computed
//! with that λ:
//!
//! 1. *Rough*: iteratively reweighted least squares (Holland & Welsch 1977), the noise level from the median
//!    deviation of data from their neighbours, λ by cross-validation of the weighted data in the first rounds only.
//! 2. *Trimmed*: least squares without the data beyond the 99 % quantile of the noise, with λ by the requested
//!    criterion; repeated with the resulting noise level until the selection of data does not change.
//! 3. *Final*: reweighted least squares with that λ, times the mean weight, and that noise level.
//!
//! If λ is given, the second stage only estimates the noise from the rough curve.

use crate::chi;
use crate::loss;
use crate::problem::{Criterion, Loss};

/// The number of rounds that choose λ in the first stage.
pub const ROUGH_ROUNDS: usize = 6;
/// The maximum number of iterations of the first stage, which need not converge.
const ROUGH_STEPS: usize = 20;
/// The maximum number of iterations of the last stage, as a multiple of the requested limit: reweighted least squares
/// converge linearly, and slowly if a datum is near the corner of Huber's loss.
const FINAL_STEPS: usize = 20;
/// The steps, in standard deviations, that end the stages before the last.
const ROUGH_TOL: f64 = 0.03;
/// The maximum number of times that data are selected again.
const TRIMS: usize = 4;
/// Data beyond this quantile of the noise are excluded.
const KEPT: f64 = 0.99;

/// The stage of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Least squares, the only stage of a fit that is not robust.
    Plain,
    /// The first stage of a robust fit.
    Rough,
    /// The second stage, for the n-th time.
    Trimmed(usize),
    /// The last stage.
    Final,
}

/// A loss function with its noise level.
pub struct Robust {
    loss: Loss,
    m: usize,
    /// The present stage.
    pub stage: Stage,
    /// The standard deviation of the noise in a coordinate.
    sigma: f64,
    /// Whether the noise level was given.
    known: bool,
    /// Whether λ is to be chosen.
    chooses: bool,
    /// The data of the second stage: one if included, otherwise zero.
    kept: Vec<f64>,
}

/// How the next stage obtains λ.
pub enum Lam {
    /// λ does not change.
    Same,
    /// λ is chosen from its whole range.
    Anew,
    /// λ is chosen near its present value.
    Near,
    /// λ is multiplied by a number.
    Times(f64),
}

impl Robust {
    /// For noise of about the standard deviation `sigma`.
    pub fn new(loss: Loss, m: usize, sigma: f64, known: bool, chooses: bool) -> Self {
        // Without deviations there are no outliers.
        let stage = match loss {
            Loss::Linear => Stage::Plain,
            _ if !(sigma > 0.0) => Stage::Plain,
            _ if known && !chooses => Stage::Final,
            _ => Stage::Rough,
        };
        Robust { loss, m, stage, sigma, known, chooses, kept: Vec::new() }
    }

    /// The residual beyond which the loss grows more slowly.
    fn corner(&self) -> f64 {
        self.sigma * self.loss.corner(self.m)
    }

    /// The factors of the weights of the data, given their weighted squared distances; None for one.
    pub fn factors(&self, squares: &[f64]) -> Option<Vec<f64>> {
        match self.stage {
            Stage::Plain => None,
            Stage::Trimmed(_) => Some(self.kept.clone()),
            Stage::Rough | Stage::Final => Some(self.weights(squares)),
        }
    }

    fn weights(&self, squares: &[f64]) -> Vec<f64> {
        let corner = self.corner();
        squares.iter().map(|square| self.loss.weight(square / (corner * corner))).collect()
    }

    /// The contribution of a datum to the objective.
    pub fn value(&self, square: f64, datum: usize) -> f64 {
        match self.stage {
            Stage::Plain => square,
            Stage::Trimmed(_) => self.kept[datum] * square,
            Stage::Rough | Stage::Final => self.loss.value(square, self.corner()),
        }
    }

    /// The pseudo-data of the M-estimator: see [`Loss::pseudo`].
    pub fn pseudo(&self, squares: &[f64]) -> (Vec<f64>, f64) {
        self.loss.pseudo(self.corner(), squares, self.m)
    }

    /// How λ is chosen in this stage.
    pub fn criterion(&self, asked: Criterion) -> Criterion {
        if self.stage == Stage::Rough { Criterion::Gcv { gamma: 1.4 } } else { asked }
    }

    /// The step that ends the stage.
    pub fn tol(&self, asked: f64) -> f64 {
        match self.stage {
            Stage::Plain | Stage::Final => asked,
            Stage::Rough | Stage::Trimmed(_) => asked.max(ROUGH_TOL),
        }
    }

    /// The maximum number of iterations of the stage.
    pub fn most(&self, asked: usize) -> usize {
        match self.stage {
            Stage::Rough => asked.min(ROUGH_STEPS),
            Stage::Final => asked.saturating_mul(FINAL_STEPS),
            Stage::Plain | Stage::Trimmed(_) => asked,
        }
    }

    /// Whether the rate of the steps is that of the weights, not of the solver.
    pub fn reweighs(&self) -> bool {
        matches!(self.stage, Stage::Rough | Stage::Final)
    }

    /// Whether this is the last stage.
    pub fn last(&self) -> bool {
        matches!(self.stage, Stage::Plain | Stage::Final)
    }

    /// Starts the next stage from a curve with given degrees of freedom and weighted squared distances of the data.
    pub fn next(&mut self, squares: &[f64], freedom: f64) -> Lam {
        match self.stage {
            Stage::Plain | Stage::Final => Lam::Same,
            Stage::Rough if !self.chooses => {
                let beside = loss::noise_beside(squares, freedom, self.m);
                self.sigma = beside.clamp(0.5 * self.sigma, self.sigma);
                self.stage = Stage::Final;
                Lam::Same
            }
            Stage::Rough => {
                if !self.known {
                    let beside = loss::noise_beside(squares, freedom, self.m);
                    self.sigma = beside.clamp(0.2 * self.sigma, self.sigma);
                }
                self.kept = self.within(squares);
                self.stage = Stage::Trimmed(1);
                Lam::Anew
            }
            Stage::Trimmed(times) => {
                if !self.known {
                    self.sigma = self.beside_kept(squares, freedom);
                }
                let within = self.within(squares);
                if times < TRIMS && within != self.kept {
                    self.kept = within;
                    self.stage = Stage::Trimmed(times + 1);
                    return Lam::Near;
                }
                self.stage = Stage::Final;
                let (weights, kept) = (self.weights(squares), &self.kept);
                let sum: f64 = weights.iter().zip(kept).map(|(weight, kept)| weight * kept).sum();
                Lam::Times(sum / kept.iter().sum::<f64>())
            }
        }
    }

    /// Ones for the data within the quantile.
    fn within(&self, squares: &[f64]) -> Vec<f64> {
        let limit = self.sigma * self.sigma * chi::quantile(self.m, KEPT);
        squares.iter().map(|square| f64::from(*square <= limit)).collect()
    }

    /// The standard deviation of the noise from the residuals of the included data: normal noise within a quantile q
    /// has the variance `P(χ²_{m+2} < q)/P(χ²_m < q)`.
    fn beside_kept(&self, squares: &[f64], freedom: f64) -> f64 {
        let kept = &self.kept;
        let sum: f64 = squares.iter().zip(kept).map(|(square, kept)| square * kept).sum();
        let left = self.m as f64 * (kept.iter().sum::<f64>() - freedom);
        let cut = chi::distribution(self.m + 2, chi::quantile(self.m, KEPT)) / KEPT;
        let found = (sum / left / cut).sqrt();
        if found > 0.0 && left > 0.0 { found } else { self.sigma }
    }
}
