//! Smoothing splines: the C² curve γ, natural at its ends, with the least
//!
//! ```text
//! J = Σ w_k d(y_k, γ(t_k))² + λ ∫ |∇γ'|² dt
//! ```
//!
//! for noisy data y, and the choice of λ. In flat space it is the smoothing spline of Reinsch (1967). The unknowns
//! are the points of the curve at its knots; every iteration fits the spline through them.
//!
//! Two solvers compute the minimum. The *linearised* solver treats the curve as one in flat space, in frames along
//! it. Its contraction is `K²|γ'|²√(λ/w)`. If that is small, curvature enters the gradient only, and an iteration
//! costs little more than the fit; otherwise curvature enters the matrix, too. The other solver is *full
//! Gauss–Newton*.

mod adaptive;
pub mod along;
pub mod audit;
mod banded;
pub mod body;
mod bordered;
pub mod calibrate;
mod chain;
pub mod chi;
mod choice;
mod cumulative;
mod curve_fit;
mod cyclic;
mod elimination;
pub mod estimation;
pub mod examine;
mod frames;
pub mod gaps;
mod gauss_newton;
mod information;
mod integrated_wiener;
pub mod iteration;
mod jacobi_operator;
mod linearized;
mod local;
mod loss;
mod misfit;
pub mod motion;
mod observations;
mod path;
pub mod posterior;
mod problem;
mod progress;
mod residuals;
mod robust;
mod smooth;
mod start;
pub mod terms;
pub mod turns;
mod variance;

/// What the tests of this crate need.
#[doc(hidden)]
pub mod private {
    pub use crate::banded::{Banded, WIDTH};
    pub use crate::cyclic::{Factored, PeriodicCorrection};
    pub use crate::elimination::eliminate;
    pub use crate::linearized::{Basis, LinearProblem, OVERLAP, Stencil};
}

pub use cumulative::{CumulativeData, Outcome, fit_cumulative};
pub use integrated_wiener::process_variance;
pub use observations::Observations;
pub use path::{Position, positions};
pub use problem::{
    Adapt, Criterion, Data, EndCondition, EndConditions, Known, Loss, Options, Penalty, Profile, Selection,
    Smooth, SmoothReport, State, Tier,
};
pub use smooth::smooth;
pub use variance::{functional_at, inverse_of_weights, variance};
