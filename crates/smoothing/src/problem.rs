//! The smoothing problem, its options and its report.

use crate::banded::stride;
use crate::cyclic::PeriodicCorrection;
use std::f64::consts::PI;
use symspline_core::fit::{End, Ends};
use symspline_core::scalar::few;

/// Noisy data of one curve.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// Increasing times, possibly with repetitions.
    pub times: &'a [f64],
    /// One point per time.
    pub points: &'a [f64],
    /// One weight per time: one over the variance of its noise, up to a factor.
    pub weights: &'a [f64],
    /// Information matrices, m × m numbers per time in coordinates of the frame at the point: the inverse covariance
    /// of the noise. The weight is then the mean of the diagonal. Empty for scalar weights.
    pub information: &'a [f64],
    /// The increasing knots of the curve, from the first to the last time.
    pub knots: &'a [f64],
    /// λ, or None to choose it from the data.
    pub lam: Option<f64>,
    /// λ of every segment divided by λ; empty for one λ.
    pub profile: &'a [f64],
    /// The standard deviation of the noise in a coordinate at weight one, if it is known.
    pub sigma: Option<f64>,
    /// Velocities at the ends that have [`EndCondition::Velocity`]: tangent at the first and at the last data point,
    /// from where they are transported in parallel to the ends of the curve.
    pub ends: [&'a [f64]; 2],
    /// Points of the initial curve at the knots; empty for means of the data.
    pub start: &'a [f64],
}

/// The solver that computes the minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// The linearised solver, or full Gauss–Newton if the linearised solver converges slowly.
    Auto,
    /// The linearised solver only.
    Linearized,
    /// Full Gauss–Newton only.
    Newton,
}

/// An end condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndCondition {
    /// The second derivative vanishes.
    Natural,
    /// The first derivative is given.
    Velocity,
    /// The third derivative is the same on the last two segments.
    NotAKnot,
}

/// The derivative whose square the smoothing penalises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Penalty {
    /// The acceleration ∇γ'.
    Acceleration,
    /// Its derivative ∇²γ', which is constant on every segment of a cubic spline in flat space. The ends are free.
    Jerk,
}

impl Penalty {
    /// The unit of λ for times in multiples of `spacing`.
    pub fn unit(self, spacing: f64) -> f64 {
        spacing.powi(self.power())
    }

    /// The power of time in the unit of λ.
    pub fn power(self) -> i32 {
        match self {
            Penalty::Acceleration => 3,
            Penalty::Jerk => 5,
        }
    }

    /// The λ from which on curves have hardly any energy, in multiples of the λ at which data and energy have about the
    /// same weight. For larger λ the data would vanish in rounding errors of A.
    pub fn stiffest(self, knots: usize) -> f64 {
        let power = self.power();
        (10f64.powi(9 - power) * (knots as f64 / PI).powi(power + 1)).max(1e8)
    }

    /// The entries of Ω on the diagonal for equal knots: the energy of a cubic B-spline.
    pub fn stiffness(self) -> f64 {
        match self {
            Penalty::Acceleration => 8.0 / 3.0,
            Penalty::Jerk => 20.0,
        }
    }
}

/// The end conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndConditions {
    /// A condition at either end.
    Open([EndCondition; 2]),
    /// The last knot equals the first.
    Periodic,
}

impl EndConditions {
    /// The same conditions for the fit of a spline, with the velocities at its ends.
    pub(crate) fn of_fit(self, velocities: &[Vec<f64>; 2]) -> Ends<'_> {
        match self {
            EndConditions::Periodic => Ends::Periodic,
            EndConditions::Open(kinds) => Ends::Open(few(|e| match kinds[e] {
                EndCondition::Velocity => End::Velocity(&velocities[e]),
                EndCondition::NotAKnot => End::NotAKnot,
                EndCondition::Natural => End::Natural,
            })),
        }
    }
}

/// The criterion that chooses λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Criterion {
    /// Generalised cross-validation (Craven & Wahba 1979); degrees of freedom are multiplied by `gamma`.
    Gcv {
        /// 1, or 1.4 for smoother curves (Gu 2013, §3.2).
        gamma: f64,
    },
    /// Restricted maximum likelihood (Wahba 1985).
    Reml,
    /// Mallows' C_p (1973), for a known noise level.
    Cp,
}

/// A loss ρ with ρ(r) ≈ |r|² for small residuals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// |r|².
    Linear,
    /// |r|² up to c, and linear beyond it.
    Huber,
    /// c² ln(1 + |r|²/c²).
    Cauchy,
}

/// Which functions vary along the curve if the data require it: λ(t) and σ(t).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Adapt {
    /// λ.
    pub lam: bool,
    /// The standard deviation σ of the noise.
    pub noise: bool,
}

/// The options of smoothing.
#[derive(Clone, Copy)]
pub struct Options {
    /// The criterion that chooses λ if it is not given.
    pub criterion: Criterion,
    /// The derivative whose square is penalised.
    pub penalty: Penalty,
    /// The loss function.
    pub loss: Loss,
    /// The solver.
    pub tier: Tier,
    /// The end conditions.
    pub ends: EndConditions,
    /// The iteration ends when a step is below this number of standard deviations of the points.
    pub tol: f64,
    /// Maximum number of iterations.
    pub max_iter: usize,
    /// Whether a larger λ than the criterion chooses is tried if no spline joins the smoothed points.
    pub raise_lam: bool,
    /// What varies along the curve.
    pub adapt: Adapt,
}

/// The final state of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// The iteration has not ended.
    #[default]
    Running,
    /// The last step is small compared with the standard deviations.
    Converged,
    /// The last step is not small.
    Unconverged,
    /// λ did not converge.
    Unsettled,
    /// No spline joins the smoothed points.
    NoCurve,
    /// The data do not determine the curve: without a given λ every knot needs data near it.
    Undetermined,
}

/// Whether the data that a robust loss rejected can be trusted to be the outliers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// The selection is final, or there is none.
    #[default]
    Sound,
    /// The curve follows nearly all data, so that only gross outliers were found.
    Interpolated,
    /// Two selections alternate.
    Unsettled,
    /// Fewer than 60 % of the data are near the curve.
    Few,
    /// An outlier moves the curve, because there are no other data nearby.
    Pulled,
}

/// The report of a smoothed curve.
#[derive(Clone, Copy, Debug, Default)]
pub struct SmoothReport {
    /// The final state.
    pub state: State,
    /// The number of spline fits.
    pub iterations: usize,
    /// The number of rounds in which λ was chosen.
    pub rounds: usize,
    /// λ.
    pub lam: f64,
    /// λ of the linearised problem of the pseudo-data, see [`Loss`]; the same as `lam` for least squares.
    pub band_lam: f64,
    /// Whether λ lies at a bound of its range: the curve is a geodesic, or interpolates the data.
    pub at_bound: bool,
    /// Degrees of freedom per coordinate.
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
    /// J for times in units of the mean distance of the knots.
    pub objective: f64,
    /// Whether the data that a robust loss rejected can be trusted to be the outliers.
    pub selection: Selection,
    /// The number of rejected data.
    pub rejected: usize,
}

/// How λ and σ vary.
#[derive(Clone, Debug)]
pub struct Profile {
    /// The increase of twice the logarithm of the likelihood by the functions that vary, or that by the best functions if
    /// none of them was accepted.
    pub gain: f64,
    /// λ of every segment divided by their geometric mean; empty for one λ.
    pub lam: Vec<f64>,
    /// ln σ² at every knot, with the mean zero over the data; empty for one σ.
    pub noise: Vec<f64>,
    /// Whether the other function varies as well, although it was not asked for: one takes the other for itself.
    pub other: bool,
    /// Whether both may vary, and the data hardly decide which of them does.
    pub tie: bool,
    /// The time of an isolated outlier, which λ of its own would follow; NaN without one.
    pub outlier: f64,
}

impl Profile {
    /// Whether λ or σ varies.
    pub fn varies(&self) -> bool {
        !(self.lam.is_empty() && self.noise.is_empty())
    }
}

/// A smoothed curve.
pub struct Smooth {
    /// Its knots.
    pub knots: Vec<f64>,
    /// Points at the knots.
    pub points: Vec<f64>,
    /// Velocities at the knots.
    pub velocities: Vec<f64>,
    /// The band of A⁻¹, see [`variance`](crate::variance): four numbers per coefficient. Open curves have as many
    /// coefficients as knots, closed curves two more.
    pub inverse: Vec<f64>,
    /// The posterior of the coefficients; none if the iteration failed.
    pub known: Option<Known>,
    /// How λ and σ vary, if that was asked for.
    pub profile: Option<Profile>,
    /// The report.
    pub report: SmoothReport,
}

/// The matrix A of the linearised problem at the end of the iteration, see [`Posterior`](crate::posterior::Posterior).
#[derive(Clone)]
pub struct Known {
    /// The number of coordinates that A couples: one if it is the same for all of them.
    pub coupled: usize,
    /// Its band, the entries (i, i − d) at i · 4 · coupled + d.
    pub matrix: Vec<f64>,
    /// The holonomy of a closed curve, coupled × coupled numbers; empty for an open curve.
    pub turn: Vec<f64>,
}

impl Known {
    /// The same for m coupled coordinates.
    pub fn of_all(&self, m: usize) -> Known {
        if self.coupled == m {
            return self.clone();
        }
        let (own, wide) = (stride(1), stride(m));
        let mut matrix = vec![0.0; self.matrix.len() * m * m];
        for (i, row) in self.matrix.chunks_exact(own).enumerate() {
            for c in 0..m {
                row.iter().enumerate().for_each(|(d, x)| matrix[(i * m + c) * wide + d * m] = *x);
            }
        }
        let turn = if self.turn.is_empty() { Vec::new() } else { PeriodicCorrection::plain(1, m).turn };
        Known { coupled: m, matrix, turn }
    }
}
