//! The stages of a fit with a robust loss.
//!
//! Choosing λ by cross-validation while outliers still shape the curve and the noise level often fails: the level and λ
//! collapse together. So λ is chosen on data without outliers, and the M-estimator is solved with that λ:
//!
//! 1. *Rough*: iteratively reweighted least squares (Holland & Welsch 1977), the noise level from the median
//!    deviation of data from their neighbours, λ by cross-validation of the weighted data in the first rounds only.
//! 2. *Trimmed*: least squares without the data beyond the 99 % quantile of the noise, with λ by the criterion that
//!    was asked for; repeated with the noise level that results until the same data are left out.
//! 3. *Final*: reweighted least squares with that λ, times the mean weight, and that noise level.
//!
//! With a given λ the second stage is only the noise beside the rough curve.

use crate::chi;
use crate::loss;
use crate::problem::{Criterion, Loss};

/// Rounds in which λ is chosen in the first stage.
pub const ROUGH_ROUNDS: usize = 6;
/// Iterations of the first stage, at most: it need not converge.
const ROUGH_STEPS: usize = 20;
/// Iterations of the last stage, in multiples of those that were asked for: reweighted least squares converge linearly,
/// and slowly where a datum is near the corner of Huber's loss.
const FINAL_STEPS: usize = 20;
/// Steps, in standard deviations, that end the stages before the last.
const ROUGH_TOL: f64 = 0.03;
/// Times that data are left out anew, at most.
const TRIMS: usize = 4;
/// Data beyond this quantile of the noise are left out.
const KEPT: f64 = 0.99;

/// How far a fit has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Least squares: all that there is to do.
    Plain,
    /// The first of a robust fit.
    Rough,
    /// The second, for the n-th time.
    Trimmed(usize),
    /// The last.
    Final,
}

/// A loss and the noise level that goes with it.
pub struct Robust {
    loss: Loss,
    m: usize,
    /// Where the fit is.
    pub stage: Stage,
    /// The standard deviation of the noise in a coordinate.
    sigma: f64,
    /// Whether it was given.
    known: bool,
    /// Whether λ is chosen, not given.
    chooses: bool,
    /// Which data the second stage keeps: ones and zeros.
    kept: Vec<f64>,
}

/// What the next stage does with λ.
pub enum Lam {
    /// It stays.
    Same,
    /// It is chosen, from everywhere.
    Anew,
    /// It is chosen near the one that there is.
    Near,
    /// It is multiplied by a number.
    Times(f64),
}

impl Robust {
    /// For noise of about the standard deviation `sigma`.
    pub fn new(loss: Loss, m: usize, sigma: f64, known: bool, chooses: bool) -> Self {
        // Where nothing deviates nothing is an outlier.
        let stage = match loss {
            Loss::Linear => Stage::Plain,
            _ if !(sigma > 0.0) => Stage::Plain,
            _ if known && !chooses => Stage::Final,
            _ => Stage::Rough,
        };
        Robust { loss, m, stage, sigma, known, chooses, kept: Vec::new() }
    }

    /// The residual from which the loss counts less.
    fn corner(&self) -> f64 {
        self.sigma * self.loss.corner(self.m)
    }

    /// By what the weights of data are multiplied, given their weighed squared distances; None for one.
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

    /// What a datum adds to the objective.
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

    /// How λ is chosen now.
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

    /// Iterations of the stage, at most.
    pub fn most(&self, asked: usize) -> usize {
        match self.stage {
            Stage::Rough => asked.min(ROUGH_STEPS),
            Stage::Final => asked.saturating_mul(FINAL_STEPS),
            Stage::Plain | Stage::Trimmed(_) => asked,
        }
    }

    /// Whether steps shrink at a rate that says nothing of the solver, but of the weights.
    pub fn reweighs(&self) -> bool {
        matches!(self.stage, Stage::Rough | Stage::Final)
    }

    /// Whether there is no other stage.
    pub fn last(&self) -> bool {
        matches!(self.stage, Stage::Plain | Stage::Final)
    }

    /// Goes on from a curve with so many degrees of freedom, given the weighed squared distances of the data.
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

    /// The standard deviation of the noise from the residuals of the data that were kept: normal noise within a
    /// quantile q has the variance `P(χ²_{m+2} < q)/P(χ²_m < q)`.
    fn beside_kept(&self, squares: &[f64], freedom: f64) -> f64 {
        let kept = &self.kept;
        let sum: f64 = squares.iter().zip(kept).map(|(square, kept)| square * kept).sum();
        let left = self.m as f64 * (kept.iter().sum::<f64>() - freedom);
        let cut = chi::distribution(self.m + 2, chi::quantile(self.m, KEPT)) / KEPT;
        let found = (sum / left / cut).sqrt();
        if found > 0.0 && left > 0.0 { found } else { self.sigma }
    }
}
