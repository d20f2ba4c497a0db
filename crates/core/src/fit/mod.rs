//! From points to velocities: the spline through given points.
//!
//! A fit runs through the modules in this order:
//!
//! 1. `fit`, in `curves`, calls `sections`, which cuts long curves and distributes the work over threads.
//! 2. `lanes` fits several curves, or parts of curves, of equal length, one in each lane of a SIMD register.
//! 3. `unroll` transports a frame along their polygons and writes their chords into a `chain`.
//! 4. `auto` dispatches to the solver of the requested method, or runs several solvers in turn.
//! 5. `minimum_energy` runs further solvers if points are far apart, and keeps the curve with the lowest `energy`.
//!
//! The solvers:
//! - `solve` is the loop that quasi-Newton and Newton share; `line_search` and `convergence` limit its steps.
//! - `quasi_newton` and `tridiagonal`: steps with the flat-space matrix; `newton` and `blocks`: with the Jacobian.
//! - `fixed_point` is Algorithm 1, `homotopy` continues from flat space, and `trust_region` minimises the residual.
//!
//! All of them evaluate the C² condition (13) in `condition`, whose end rows are in `ends`. `handles` keeps control
//! handles inside the cut locus; `rounded`, `theorem` and `certificate` examine the result. `conditions` treats ends with two
//! conditions, whose equation is in `joint`, and prescribed velocities at inner points.

mod auto;
mod blocks;
mod budget;
mod certificate;
pub(crate) mod chain;
mod condition;
mod conditions;
mod convergence;
mod curves;
pub(crate) mod end_kind;
mod ends;
mod energy;
mod fixed_point;
mod handles;
mod homotopy;
mod joint;
mod lanes;
mod line_search;
mod minimum_energy;
mod newton;
pub(crate) mod node;
mod problem;
mod quasi_newton;
mod rounded;
mod section;
mod sections;
mod solve;
mod theorem;
mod tridiagonal;
mod trust_region;
mod unroll;
mod vector;

pub use blocks::{Blocks, eliminate};
pub use chain::{Chain, Run, Visit};
pub use condition::{sweep, sweep_by_table};
pub use conditions::{FittedCurves, InnerVelocities, fit_with_conditions};
pub use curves::{fit, memory};
pub use end_kind::{ChainEnds, EndKind};
pub use ends::NotAKnot;
pub use node::{C2Residual, NodeVectors};
pub use problem::{Both, End, Ends, Method, Options, Problem, Report, Solver, SolverSet, Status};

/// What the tests of this crate need.
#[doc(hidden)]
pub mod private {
    pub use crate::fit::homotopy::predict;
    pub use crate::fit::theorem::{contraction_bound, guaranteed_sweeps, invariant_radius};
}
