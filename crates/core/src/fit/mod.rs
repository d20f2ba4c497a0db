//! From points to velocities: the spline through given points.
//!
//! A fit runs through the modules in this order:
//!
//! 1. `fit`, in this file, calls `sections`, which cuts long curves and distributes the work over threads.
//! 2. `lanes` fits up to eight curves, or parts of curves, of equal length, one in each lane of a SIMD register.
//! 3. `unroll` transports a frame along the eight polygons and writes their chords into a `chain`.
//! 4. `auto` dispatches to the solver of the requested method, or runs several solvers in turn.
//! 5. `minimum_energy` runs further solvers if points are far apart, and keeps the curve with the lowest `energy`.
//!
//! The solvers:
//! - `solve` is the loop that quasi-Newton and Newton share; `line_search` and `convergence` limit its steps.
//! - `quasi_newton` and `tridiagonal`: steps with the flat-space matrix; `newton` and `blocks`: with the Jacobian.
//! - `fixed_point` is Algorithm 1, `homotopy` continues from flat space, and `trust_region` minimises the residual.
//!
//! All of them evaluate the C² condition (13) in `condition`, whose end rows are in `ends`. `handles` keeps control
//! handles inside the cut locus; `rounded` and `certificate` examine the result. `conditions` treats ends with two
//! conditions, whose equation is in `joint`, and prescribed velocities at inner points.

mod auto;
mod blocks;
mod budget;
mod certificate;
pub(crate) mod chain;
mod condition;
mod conditions;
mod convergence;
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
mod tridiagonal;
mod trust_region;
mod unroll;
mod vector;

pub use blocks::Blocks;
pub use chain::{Chain, Run, Visit};
pub use condition::{sweep, sweep_by_table};
pub use conditions::{FittedCurves, InnerVelocities, fit_with_conditions};
pub use end_kind::{ChainEnds, EndKind};
pub use ends::NotAKnot;
pub use node::{C2Residual, NodeVectors};
pub use problem::{Both, End, Ends, Method, Options, Problem, Report, Solver, SolverSet, Status};

/// What the tests of this crate need.
#[doc(hidden)]
pub mod private {
    pub use crate::fit::certificate::{contraction_bound, guaranteed_sweeps, invariant_radius};
    pub use crate::fit::homotopy::predict;
}

use crate::monitor::Monitor;
use crate::scalar::LANES;
use crate::space::{Ambient, Erased, Frame, Origin};
use sections::{OVERLAP, fit_cut};

/// Curves with more segments than this are divided into sections.
const LONG: usize = 512;

/// The approximate number of eight-byte numbers that the fit of eight curves occupies at a time.
pub fn memory(space: &Erased, nodes: usize, method: Method) -> f64 {
    let (nodes, m) = (nodes.min(LONG) as f64, space.dim() as f64);
    // Chords, velocities, residuals and steps at every node, and the history of Anderson mixing.
    let chain = LANES as f64 * (nodes * (20.0 * m + space.chord_len() as f64) + space.frame_len() as f64);
    let jacobian = match method {
        // `auto` skips solvers whose memory is not available.
        Method::Auto | Method::FixedPoint | Method::QuasiNewton => 0.0,
        Method::Newton | Method::Homotopy => LANES as f64 * (3.0 * nodes + 4.0) * m * m,
    };
    chain + jacobian + crate::rows::memory(space, None)
}

/// Fits all curves of a problem. Velocities have the layout of the points; curves that cannot be fitted are NaN.
pub fn fit(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    velocities: &mut [f64],
) -> Vec<Report> {
    let curves = problem.offsets.len() - 1;
    let mut reports = vec![Report::default(); curves];
    let whole: Vec<usize> = (0..curves).filter(|&c| problem.segments(c) <= LONG).collect();
    let mut rest: Vec<usize> = (0..curves).filter(|&c| problem.segments(c) > LONG).collect();
    fit_cut(space, problem, options, monitor, velocities, &whole, None, &mut reports);
    let mut overlap = OVERLAP;
    while !rest.is_empty() && !monitor.cancelled() {
        rest = fit_cut(space, problem, options, monitor, velocities, &rest, Some(overlap), &mut reports);
        overlap *= 2;
    }
    let len = space.point_len();
    for (curve, report) in reports.iter_mut().enumerate() {
        let own = &mut velocities[problem.offsets[curve] * len..problem.offsets[curve + 1] * len];
        if rounded::make_geodesic(space, problem, curve, report, own) && report.status == Status::Unconverged
        {
            (report.status, report.residual) = (Status::Converged, 0.0);
        }
        if report.status.is_fault() {
            own.fill(f64::NAN);
        } else if matches!(problem.ends, Ends::Periodic) && problem.segments(curve) > LONG {
            // Sections agree up to the tolerance; the first and the last velocity are equal.
            let transported = problem.across_closure(space, curve, &own[..len]);
            own[problem.segments(curve) * len..].copy_from_slice(&transported);
        }
        // Without an early end, the loop is compiled to SIMD instructions.
        let finite = own.iter().fold(true, |finite, u| finite & u.is_finite());
        if report.status == Status::Converged && !finite {
            // Points whose differences per unit of time exceed the largest floating-point number.
            (report.status, report.residual) = (Status::Unconverged, f64::INFINITY);
        }
        // A solver that stops close to a solution may have been stopped by rounding errors.
        let close = report.status == Status::Unconverged && report.residual <= rounded::MOST;
        if (report.status == Status::Converged || close)
            && let Some(missed) = rounded::missed(space, problem, curve, own, report.condition, options.tol)
        {
            if !(missed <= rounded::MOST.max(options.tol)) {
                (report.status, report.residual) = (Status::Imprecise, missed);
            } else if !close {
                report.residual = missed;
            }
        }
    }
    reports
}
