//! From points to velocities: the spline through given points.

mod auto;
mod blocks;
mod budget;
mod calm;
mod certificate;
mod chain;
mod condition;
mod convergence;
mod ends;
mod energy;
mod fixed_point;
mod homotopy;
mod lanes;
mod legs;
mod line_search;
mod newton;
mod pieces;
mod quasi_newton;
mod rounded;
mod solve;
mod tridiagonal;
mod trust_region;

pub use blocks::Blocks;
pub use chain::{Chain, Run, Visit};
pub use condition::{Defect, NodeVectors, sweep, sweep_by_table};
pub use ends::{ChainEnds, EndKind, NotAKnot};
pub use solve::SolverSet;

use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, lane};
use crate::space::{Ambient, Erased, Frame, Origin};
use pieces::{OVERLAP, Piece, fit_cut};

/// Curves with more segments than this are cut into pieces.
const LONG: usize = 512;

/// Points to interpolate: curves one after another.
pub struct Problem<'a> {
    /// Knots, increasing: of every curve, or of one for all (see `shared`).
    pub t: &'a [f64],
    /// Whether all curves have the same knots.
    pub shared: bool,
    /// Points, on the space.
    pub points: &'a [f64],
    /// Nodes before each curve, and in the end the number of all.
    pub offsets: &'a [usize],
    /// What happens at the ends.
    pub ends: Ends<'a>,
}

/// End conditions.
#[derive(Clone, Copy)]
pub enum Ends<'a> {
    /// Last and first point are the same, and so are velocity and acceleration there.
    Periodic,
    /// A condition at either end.
    Open([End<'a>; 2]),
}

/// A condition at one end; vectors are ambient, one a curve.
#[derive(Clone, Copy)]
pub enum End<'a> {
    /// Zero covariant acceleration, (20).
    Natural,
    /// Given velocity, (19).
    Velocity(&'a [f64]),
    /// Given covariant acceleration.
    Acceleration(&'a [f64]),
    /// The first two segments are one cubic in normal coordinates.
    NotAKnot,
}

/// How to solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The best available.
    Auto,
    /// Algorithm 1 of the paper.
    FixedPoint,
    /// Transported tridiagonal solves with Anderson mixing.
    QuasiNewton,
    /// Newton's method with the block-tridiagonal Jacobian.
    Newton,
    /// Newton's method along a homotopy from flat space.
    Homotopy,
}

/// The solver that a curve ended with, in the order in which they are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Solver {
    /// Algorithm 1 of the paper.
    FixedPoint,
    /// Transported tridiagonal solves.
    QuasiNewton,
    /// Newton's method.
    Newton,
    /// Newton's method along a homotopy from flat space.
    Homotopy,
    /// Least squares in a trust region.
    TrustRegion,
}

/// Solver options.
#[derive(Clone, Copy)]
pub struct Options {
    /// The method.
    pub method: Method,
    /// Largest residual that counts as converged.
    pub tol: f64,
    /// Largest number of residual evaluations; `None` for the method's own.
    pub max_iter: Option<usize>,
}

/// Why a curve could not be made, or whether it is good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Status {
    /// The residual is below the tolerance or at the rounding floor.
    Converged,
    /// It is not.
    Unconverged,
    /// Points `index` and `index + 1` lie at or past each other's cut locus.
    CutLocus {
        /// Index of the first of the two points.
        index: usize,
        /// Deciding angle between them.
        angle: f64,
    },
    /// A control leg at a point reaches the cut locus, or is too long for doubles.
    LongLeg {
        /// Index of the point.
        index: usize,
        /// Deciding angle of the leg.
        angle: f64,
    },
    /// The two control points between points `index` and `index + 1` lie at each other's cut locus.
    MiddleLeg {
        /// Index of the first of the two points.
        index: usize,
        /// Deciding angle between the control points.
        angle: f64,
    },
    /// The work was stopped before this curve was done.
    Stopped,
}

impl Status {
    /// Whether there is no curve at all.
    pub fn is_fault(self) -> bool {
        matches!(self, Status::CutLocus { .. } | Status::LongLeg { .. } | Status::MiddleLeg { .. })
    }

    /// The same with the point at fault counted otherwise.
    fn counted(mut self, count: impl Fn(usize) -> usize) -> Self {
        if let Status::CutLocus { index, .. }
        | Status::LongLeg { index, .. }
        | Status::MiddleLeg { index, .. } = &mut self
        {
            *index = count(*index);
        }
        self
    }
}

/// What is known about a fitted curve.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// How it ended.
    pub status: Status,
    /// Residual evaluations.
    pub iterations: usize,
    /// C² defect divided by (1/hᵢ₋₁ + 1/hᵢ), relative to the largest speed.
    pub residual: f64,
    /// D of (21): the longest step between neighbours.
    pub max_step: f64,
    /// Mean contraction per iteration.
    pub rate: f64,
    /// The solver that it ended with.
    pub solver: Solver,
    /// The smallest V of (38), NaN where Theorem 3.1 says nothing.
    pub invariant_radius: f64,
    /// A bound of the contraction of Algorithm 1 per sweep on that region, NaN where there is none.
    pub contraction_bound: f64,
    /// After so many sweeps Algorithm 1 is within the tolerance, NaN where there is no bound.
    pub guaranteed_sweeps: f64,
    /// The least energy ∫ |∇γ'|² dt of other C² curves through the points that were found, NaN where none was.
    pub alternative: f64,
    /// The first point from which the next one lies almost at the cut locus, within 1e-5 of the limit, and the deciding
    /// angle.
    pub almost_cut: Option<(usize, f64)>,
    /// Solvers that `auto` left out because they would have cost too much.
    pub skipped: SolverSet,
    /// By how much rounding errors may grow over its chords.
    condition: f64,
}

impl Default for Report {
    fn default() -> Self {
        Report {
            status: Status::Stopped,
            iterations: 0,
            residual: f64::NAN,
            max_step: 0.0,
            rate: 0.0,
            solver: Solver::FixedPoint,
            invariant_radius: f64::NAN,
            contraction_bound: f64::NAN,
            guaranteed_sweeps: f64::NAN,
            alternative: f64::NAN,
            almost_cut: None,
            skipped: SolverSet::default(),
            condition: 1.0,
        }
    }
}

/// About how many numbers of eight bytes the fit of eight curves takes at a time.
pub fn memory(space: &Erased, nodes: usize, method: Method) -> f64 {
    let (nodes, m) = (nodes.min(LONG) as f64, space.dim() as f64);
    // Chords, velocities, residuals and steps at every node, and the history of Anderson's mixing.
    let chain = LANES as f64 * (nodes * (20.0 * m + space.chord_len() as f64) + space.frame_len() as f64);
    let jacobian = match method {
        // Auto leaves out what does not fit.
        Method::Auto | Method::FixedPoint | Method::QuasiNewton => 0.0,
        Method::Newton | Method::Homotopy => LANES as f64 * (3.0 * nodes + 4.0) * m * m,
    };
    chain + jacobian + crate::rows::memory(space, None)
}

/// Fits all curves of a problem; velocities get the layout of the points. Curves at fault are NaN.
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
        if report.status.is_fault() {
            own.fill(f64::NAN);
        } else if matches!(problem.ends, Ends::Periodic) && problem.segments(curve) > LONG {
            // Pieces agree to the tolerance; first and last velocity are one.
            let carried = problem.across_seam(space, curve, &own[..len]);
            own[problem.segments(curve) * len..].copy_from_slice(&carried);
        }
        if report.status == Status::Converged
            && let Some(missed) = rounded::missed(space, problem, curve, own, report.condition)
        {
            (report.status, report.residual) = (Status::Unconverged, missed);
        }
    }
    reports
}

impl<'a> Problem<'a> {
    /// Number of segments of a curve.
    fn segments(&self, curve: usize) -> usize {
        self.offsets[curve + 1] - self.offsets[curve] - 1
    }

    /// The knots of a curve.
    pub fn knots(&self, curve: usize) -> &'a [f64] {
        if self.shared { self.t } else { &self.t[self.offsets[curve]..self.offsets[curve + 1]] }
    }

    /// A velocity at the first point of a closed curve as one at its last, which may be another array.
    fn across_seam(&self, space: &Erased, curve: usize, velocity: &[f64]) -> Vec<f64> {
        let len = velocity.len();
        let lanes = |row: &[f64]| -> Vec<Lane> { row.iter().map(|&x| lane(x)).collect() };
        let point = |node: usize| lanes(&self.points[node * len..(node + 1) * len]);
        let (first, last) = (point(self.offsets[curve]), point(self.offsets[curve + 1] - 1));
        let (still, mut carried) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
        space.carry(&first, &last, &still, &lanes(velocity), &mut carried);
        carried.iter().map(|x| x.as_array()[0]).collect()
    }

    fn run(&self, piece: &Piece, len: usize) -> Run<'a> {
        let (from, to) = (self.offsets[piece.curve], self.offsets[piece.curve + 1]);
        Run { t: self.knots(piece.curve), points: &self.points[from * len..to * len], first: piece.first }
    }
}
