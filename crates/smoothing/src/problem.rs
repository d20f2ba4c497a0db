//! What is smoothed, how, and what is known afterwards.

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
    /// Velocities at the ends that have [`EndCondition::Velocity`]: tangent at the first and the last of the points, from where
    /// they are transported in parallel to the ends of the curve.
    pub ends: [&'a [f64]; 2],
}

/// The solver that finds the minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// The linearised solver, and full Gauss–Newton where that converges slowly.
    Auto,
    /// The linearised solver only.
    Linearized,
    /// Full Gauss–Newton only.
    Newton,
}

/// What happens at an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndCondition {
    /// The second derivative vanishes.
    Natural,
    /// The first derivative is given.
    Velocity,
}

/// What happens at the ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// A condition at either end.
    Open([EndCondition; 2]),
    /// The last knot is the first again.
    Periodic,
}

impl Ends {
    /// The same for the fit of a spline, with the velocities at its ends.
    pub(crate) fn of_fit(self, velocities: &[Vec<f64>; 2]) -> FitEnds<'_> {
        match self {
            Ends::Periodic => FitEnds::Periodic,
            Ends::Open(kinds) => FitEnds::Open(few(|e| match kinds[e] {
                EndCondition::Velocity => End::Velocity(&velocities[e]),
                _ => End::Natural,
            })),
        }
    }
}

/// How λ is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Criterion {
    /// Generalised cross-validation (Craven & Wahba 1979); degrees of freedom count `gamma` times.
    Gcv {
        /// 1, or 1.4 against too rough curves (Gu 2013, §3.2).
        gamma: f64,
    },
    /// Restricted maximum likelihood (Wahba 1985).
    Reml,
    /// Mallows' C_p (1973), for noise of known size.
    Cp,
}

/// A loss ρ with ρ(r) ≈ |r|² for small residuals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// |r|².
    Linear,
    /// |r|² up to c, and linear beyond.
    Huber,
    /// c² ln(1 + |r|²/c²).
    Cauchy,
}

/// How to smooth.
#[derive(Clone, Copy)]
pub struct Options {
    /// How λ is chosen where it is not given.
    pub criterion: Criterion,
    /// How much residuals count.
    pub loss: Loss,
    /// The solver.
    pub tier: Tier,
    /// What happens at the ends.
    pub ends: Ends,
    /// The step that ends the search, in standard deviations of the points.
    pub tol: f64,
    /// Iterations at most.
    pub max_iter: usize,
    /// Whether a larger λ than the criterion asks for is tried where no spline joins the points that were reached.
    pub raise_lam: bool,
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
    /// The expected contraction of the linearised solver.
    pub kappa: f64,
    /// Whether full Gauss–Newton was used.
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
    /// The band of A⁻¹, see [`variance`](crate::variance): four numbers a coefficient. Open curves have as many as knots, closed ones two
    /// more.
    pub inverse: Vec<f64>,
    /// How it went.
    pub report: Report,
}
