//! The problem of a fit, its options and its report.

use super::certificate::Bounds;
use super::end_kind::EndKind;
use crate::scalar::{Lane, lane};
use crate::space::{Ambient, Erased};
use std::borrow::Cow;

/// Points to interpolate, curve after curve.
pub struct Problem<'a> {
    /// Increasing knots: one row per curve, or one row for all curves (see `shared`).
    pub t: &'a [f64],
    /// Whether all curves have the same knots.
    pub shared: bool,
    /// Points, on the space.
    pub points: &'a [f64],
    /// The number of nodes before each curve, and finally the number of all nodes.
    pub offsets: &'a [usize],
    /// The end conditions.
    pub ends: Ends<'a>,
}

/// End conditions.
#[derive(Clone, Copy)]
pub enum Ends<'a> {
    /// The last point equals the first, and so do velocity and acceleration there.
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
    /// Given velocity and covariant acceleration, by an additional knot in the outer segment. Such curves are fitted by
    /// [`fit_with_conditions`](super::fit_with_conditions).
    Both(Both<'a>),
}

/// A velocity and a covariant acceleration at one end.
#[derive(Clone, Copy)]
pub struct Both<'a> {
    /// The velocity and the acceleration of each curve, one after the other.
    pub vectors: &'a [f64],
    /// The distance in time of the additional knot, one per curve.
    /// [`fit_with_conditions`](super::fit_with_conditions) sets it.
    pub apart: &'a [f64],
}

impl<'a> End<'a> {
    /// Whether Theorem 3.1 covers such ends.
    pub fn is_covered_by_the_theorem(&self) -> bool {
        matches!(self, End::Natural | End::Velocity(_))
    }

    /// The end condition in the form that the solvers use.
    pub fn kind(&self) -> EndKind {
        match self {
            End::Natural | End::Acceleration(_) => EndKind::Acceleration,
            End::Velocity(_) => EndKind::Velocity,
            End::NotAKnot => EndKind::NotAKnot,
            End::Both(_) => EndKind::Both,
        }
    }

    /// The prescribed vectors, one per curve, and whether they are velocities.
    pub fn vectors(&self, len: usize) -> Vec<(bool, Cow<'a, [f64]>)> {
        let every_other = |which: usize, all: &[f64]| {
            all.chunks(len).skip(which).step_by(2).flatten().copied().collect::<Vec<f64>>()
        };
        match *self {
            End::Natural | End::NotAKnot => vec![],
            End::Velocity(v) => vec![(true, v.into())],
            End::Acceleration(v) => vec![(false, v.into())],
            End::Both(both) => {
                let row = |which| every_other(which, both.vectors).into();
                vec![(true, row(0)), (false, row(1))]
            }
        }
    }

    /// The prescribed vectors, if they are of one kind.
    pub fn values(&self) -> Option<&'a [f64]> {
        match self {
            End::Velocity(v) | End::Acceleration(v) => Some(v),
            End::Natural | End::NotAKnot | End::Both(_) => None,
        }
    }
}

/// How to solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Several solvers; the solution with the lowest bending energy is kept.
    Auto,
    /// Algorithm 1 of the paper.
    FixedPoint,
    /// Tridiagonal solves on transported vectors, with Anderson mixing.
    QuasiNewton,
    /// Newton's method with the block-tridiagonal Jacobian.
    Newton,
    /// Newton's method along a homotopy from flat space.
    Homotopy,
}

/// The solvers, in the order of their numbers in `SOLVERS` of `_base/report.py`. The report of a long curve names the one
/// with the largest number among those of its parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Solver {
    /// Algorithm 1 of the paper.
    FixedPoint,
    /// Tridiagonal solves on transported vectors.
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
    /// The union of two sets.
    pub fn union(self, other: Self) -> Self {
        SolverSet(self.0 | other.0)
    }
}

/// Solver options.
#[derive(Clone, Copy)]
pub struct Options {
    /// The method.
    pub method: Method,
    /// The largest residual of a converged fit.
    pub tol: f64,
    /// Largest number of residual evaluations; `None` for the default of the method.
    pub max_iter: Option<usize>,
    /// The distance below which geodesics are unique, if converged curves shall be certified.
    pub certify: Option<f64>,
}

/// Whether a fit converged, or why it failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Status {
    /// The residual is below the tolerance or at the rounding floor.
    Converged,
    /// The residual is above the tolerance.
    Unconverged,
    /// Velocities are accurate, but rounding errors of the curve exceed the tolerance; the residual is their size.
    Imprecise,
    /// Points `index` and `index + 1` lie at or beyond each other's cut locus.
    CutLocus {
        /// Index of the first of the two points.
        index: usize,
        /// Deciding angle between them.
        angle: f64,
    },
    /// A handle at a point reaches the cut locus, or is too long for floating-point numbers.
    LongHandle {
        /// Index of the point.
        index: usize,
        /// Deciding angle of the handle.
        angle: f64,
    },
    /// The two control points between points `index` and `index + 1` lie at or beyond each other's cut locus.
    InnerHandle {
        /// Index of the first of the two points.
        index: usize,
        /// Deciding angle between the control points.
        angle: f64,
    },
    /// The velocities are accurate, but a prescribed acceleration is not attained.
    Unattained,
    /// The work was stopped before this curve was finished.
    Stopped,
}

impl Status {
    /// Whether there is no curve at all.
    pub fn is_fault(self) -> bool {
        matches!(self, Status::CutLocus { .. } | Status::LongHandle { .. } | Status::InnerHandle { .. })
    }

    /// The same with another number for the point at fault.
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

/// The report of a fitted curve.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// The status.
    pub status: Status,
    /// Residual evaluations.
    pub iterations: usize,
    /// C² residual divided by (1/hᵢ₋₁ + 1/hᵢ), relative to the largest speed; or the rounding error of the curve at
    /// its knots if that is larger than both the tolerance and 1e-8.
    pub residual: f64,
    /// D of (21): the longest step between neighbours.
    pub max_step: f64,
    /// Mean contraction per iteration.
    pub rate: f64,
    /// The solver that found the curve.
    pub solver: Solver,
    /// The smallest V of (38), NaN where Theorem 3.1 does not apply.
    pub invariant_radius: f64,
    /// A bound of the contraction of Algorithm 1 per sweep on that region, NaN where no bound is known.
    pub contraction_bound: f64,
    /// The number of sweeps after which Algorithm 1 is within the tolerance, NaN without a bound.
    pub guaranteed_sweeps: f64,
    /// The lowest energy ∫ |∇γ'|² dt of other C² curves found through the points, NaN if none was found.
    pub alternative: f64,
    /// The first point whose successor lies almost at the cut locus, within 1e-5 of the limit, and the deciding
    /// angle.
    pub almost_cut: Option<(usize, f64)>,
    /// Solvers that `auto` skipped because they would have cost too much.
    pub skipped: SolverSet,
    /// A C² spline exists within this distance of the velocities, NaN without a certificate.
    pub existence_radius: f64,
    /// It is the only one within this distance, NaN without a certificate.
    pub uniqueness_radius: f64,
    /// What the certificate needs.
    pub(super) bounds: Bounds,
    /// The growth of rounding errors over the chords of the curve.
    pub(super) condition: f64,
    /// The largest deciding angle of a step, or an upper bound.
    pub(super) widest: f64,
}

impl Report {
    /// The report of a curve that consists of two sections: the worst values.
    pub(super) fn joined(self, other: Self) -> Self {
        let most = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
        Report {
            status: if self.status == Status::Converged { other.status } else { self.status },
            iterations: self.iterations.max(other.iterations),
            residual: most(self.residual, other.residual),
            max_step: most(self.max_step, other.max_step),
            rate: most(self.rate, other.rate),
            solver: self.solver.max(other.solver),
            invariant_radius: most(self.invariant_radius, other.invariant_radius),
            contraction_bound: most(self.contraction_bound, other.contraction_bound),
            guaranteed_sweeps: most(self.guaranteed_sweeps, other.guaranteed_sweeps),
            alternative: f64::NAN,
            almost_cut: self.almost_cut.or(other.almost_cut),
            skipped: self.skipped.union(other.skipped),
            existence_radius: f64::NAN,
            uniqueness_radius: f64::NAN,
            bounds: self.bounds.joined(other.bounds),
            condition: most(self.condition, other.condition),
            widest: most(self.widest, other.widest),
        }
    }
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
            existence_radius: f64::NAN,
            uniqueness_radius: f64::NAN,
            bounds: Bounds::default(),
            condition: 1.0,
            widest: 0.0,
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

    /// Transports a velocity at the first array of a closed curve to its last array, which may be another
    /// representative.
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
