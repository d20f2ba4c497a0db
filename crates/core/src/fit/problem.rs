//! What is fitted, how, and what is known afterwards.

use super::end_kind::EndKind;
use crate::scalar::{Lane, lane};
use crate::space::{Ambient, Erased};

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
    /// The end conditions.
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

/// A condition at one end; vectors are ambient, one per curve.
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

impl<'a> End<'a> {
    /// Whether Theorem 3.1 is about such ends.
    pub fn is_of_the_theorem(&self) -> bool {
        matches!(self, End::Natural | End::Velocity(_))
    }

    /// As it is solved.
    pub fn kind(&self) -> EndKind {
        match self {
            End::Natural | End::Acceleration(_) => EndKind::Acceleration,
            End::Velocity(_) => EndKind::Velocity,
            End::NotAKnot => EndKind::NotAKnot,
        }
    }

    /// The vectors that it prescribes.
    pub fn values(&self) -> Option<&'a [f64]> {
        match self {
            End::Velocity(v) | End::Acceleration(v) => Some(v),
            End::Natural | End::NotAKnot => None,
        }
    }
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

/// The solvers, in the order of their numbers in `SOLVERS` of `_report.py`. The report of a long curve names the one
/// with the largest number among those of its parts.
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

/// A set of solvers, one bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SolverSet(pub u8);

impl SolverSet {
    /// The solvers of either set.
    pub fn union(self, other: Self) -> Self {
        SolverSet(self.0 | other.0)
    }
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

/// Whether a fit converged, or why there is no curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Status {
    /// The residual is below the tolerance or at the rounding floor.
    Converged,
    /// The residual is above the tolerance.
    Unconverged,
    /// Points `index` and `index + 1` lie at or past each other's cut locus.
    CutLocus {
        /// Index of the first of the two points.
        index: usize,
        /// Deciding angle between them.
        angle: f64,
    },
    /// A handle at a point reaches the cut locus, or is too long for doubles.
    LongHandle {
        /// Index of the point.
        index: usize,
        /// Deciding angle of the handle.
        angle: f64,
    },
    /// The two control points between points `index` and `index + 1` lie at each other's cut locus.
    InnerHandle {
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
        matches!(self, Status::CutLocus { .. } | Status::LongHandle { .. } | Status::InnerHandle { .. })
    }

    /// The same with the point at fault counted otherwise.
    pub(super) fn counted(mut self, count: impl Fn(usize) -> usize) -> Self {
        if let Status::CutLocus { index, .. }
        | Status::LongHandle { index, .. }
        | Status::InnerHandle { index, .. } = &mut self
        {
            *index = count(*index);
        }
        self
    }
}

/// What is known about a fitted curve.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// The status.
    pub status: Status,
    /// Residual evaluations.
    pub iterations: usize,
    /// C² residual divided by (1/hᵢ₋₁ + 1/hᵢ), relative to the largest speed.
    pub residual: f64,
    /// D of (21): the longest step between neighbours.
    pub max_step: f64,
    /// Mean contraction per iteration.
    pub rate: f64,
    /// The solver that found the curve.
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
    pub(super) condition: f64,
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

impl<'a> Problem<'a> {
    /// Number of segments of a curve.
    pub(super) fn segments(&self, curve: usize) -> usize {
        self.offsets[curve + 1] - self.offsets[curve] - 1
    }

    /// The knots of a curve.
    pub fn knots(&self, curve: usize) -> &'a [f64] {
        if self.shared { self.t } else { &self.t[self.offsets[curve]..self.offsets[curve + 1]] }
    }

    /// A velocity at the first point of a closed curve as one at its last, which may be another array.
    pub(super) fn across_closure(&self, space: &Erased, curve: usize, velocity: &[f64]) -> Vec<f64> {
        let len = velocity.len();
        let lanes = |row: &[f64]| -> Vec<Lane> { row.iter().map(|&x| lane(x)).collect() };
        let point = |node: usize| lanes(&self.points[node * len..(node + 1) * len]);
        let (first, last) = (point(self.offsets[curve]), point(self.offsets[curve + 1] - 1));
        let (still, mut transported) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
        space.parallel_transport(&first, &last, &still, &lanes(velocity), &mut transported);
        transported.iter().map(|x| x.as_array()[0]).collect()
    }
}
