//! Smoothing splines: the C² curve γ, natural at its ends, with the least
//!
//! ```text
//! J = Σ w_k d(y_k, γ(t_k))² + λ ∫ |∇γ'|² dt
//! ```
//!
//! for noisy data y, and how smooth it should be. In flat space it is the smoothing spline of Reinsch (1967). The
//! points of the curve at its knots are the unknowns; every iteration fits the spline through them.
//!
//! Two ways lead to the minimum. The *flat* one solves the problem of numbers in frames that go along the curve, where
//! curvature is in the gradient only, as long as `K²|γ'|²√(λ/w)`, the contraction, is small: an iteration costs little
//! more than the fit. Where it is not curvature is in the matrix, too. The *exact* one is the Gauss–Newton method.

mod banded;
pub mod chi;
mod choice;
mod curved;
mod cyclic;
mod exact;
mod flat;
mod frames;
mod information;
mod loss;
mod misfit;
mod path;
mod progress;
mod robust;
mod sight;
mod smooth;
mod start;
mod track;
mod variance;

pub use choice::Criterion;
pub use flat::FlatEnd;
pub use loss::Loss;
pub use smooth::smooth;
pub use variance::variance;

use symspline_core::fit::{End, Ends as FitEnds};
use symspline_core::scalar::few;

/// Noisy data of one curve.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// Times, in order; some may be equal.
    pub times: &'a [f64],
    /// A point a time.
    pub points: &'a [f64],
    /// A weight a time: one over the variance of its noise, up to a factor.
    pub weights: &'a [f64],
    /// Weights that are matrices, m × m numbers a time in coordinates of the frame at its point: one over the covariance
    /// of its noise. The weight is then the mean of the diagonal. Empty where weights are numbers.
    pub information: &'a [f64],
    /// Knots of the curve, increasing, from the first to the last time.
    pub knots: &'a [f64],
    /// λ, or none if it is to be chosen.
    pub lam: Option<f64>,
    /// The standard deviation of the noise in a coordinate at weight one, if that is known.
    pub sigma: Option<f64>,
    /// Velocities at the ends that have [`FlatEnd::Velocity`]: tangent at the first and the last of the points, from where
    /// they are carried in parallel to the ends of the curve.
    pub ends: [&'a [f64]; 2],
}

/// Which way to the minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// The flat one, and the exact one where that converges slowly.
    Auto,
    /// The flat one only.
    Flat,
    /// The exact one only.
    Newton,
}

/// What happens at the ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// A condition at either end.
    Open([FlatEnd; 2]),
    /// The last knot is the first again.
    Periodic,
}

impl Ends {
    /// The same for the fit of a spline, with the velocities at its ends.
    fn of_fit(self, velocities: &[Vec<f64>; 2]) -> FitEnds<'_> {
        match self {
            Ends::Periodic => FitEnds::Periodic,
            Ends::Open(kinds) => FitEnds::Open(few(|e| match kinds[e] {
                FlatEnd::Velocity => End::Velocity(&velocities[e]),
                _ => End::Natural,
            })),
        }
    }
}

/// How to smooth.
#[derive(Clone, Copy)]
pub struct Options {
    /// How λ is chosen where it is not given.
    pub criterion: Criterion,
    /// How much residuals count.
    pub loss: Loss,
    /// Which way.
    pub tier: Tier,
    /// What happens at the ends.
    pub ends: Ends,
    /// The step that ends the search, in standard deviations of the points.
    pub tol: f64,
    /// Iterations at most.
    pub max_iter: usize,
}

/// How a curve ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Not yet.
    #[default]
    Running,
    /// The step is small beside the standard deviations.
    Converged,
    /// It is not.
    Unconverged,
    /// λ went on moving.
    Unsettled,
    /// No spline goes through the points that were reached.
    NoCurve,
    /// The data do not determine the curve: without λ every knot needs some beside it.
    Undetermined,
}

/// What is known about a smoothed curve.
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    /// How it ended.
    pub state: State,
    /// Fits of a spline.
    pub iterations: usize,
    /// Rounds in which λ was chosen.
    pub rounds: usize,
    /// λ.
    pub lam: f64,
    /// λ of the flat problem of the pseudo-data, see [`Loss`]; the same for least squares.
    pub band_lam: f64,
    /// Whether λ lies at the bound of what is sensible: a geodesic, or the data themselves.
    pub at_bound: bool,
    /// Degrees of freedom of a coordinate.
    pub freedom: f64,
    /// Estimated standard deviation of the noise in a coordinate, at weight one.
    pub sigma: f64,
    /// The last step, in standard deviations of the points.
    pub step: f64,
    /// Contraction in the last iteration.
    pub rate: f64,
    /// The contraction expected of the flat way.
    pub kappa: f64,
    /// Whether the exact way was taken.
    pub exact: bool,
}

/// A smoothed curve.
pub struct Smooth {
    /// Its knots.
    pub knots: Vec<f64>,
    /// Points at the knots.
    pub points: Vec<f64>,
    /// Velocities at the knots.
    pub velocities: Vec<f64>,
    /// The band of A⁻¹, see [`variance`]: four numbers a coefficient. Open curves have as many as knots, closed ones two
    /// more.
    pub inverse: Vec<f64>,
    /// How it went.
    pub report: Report,
}
