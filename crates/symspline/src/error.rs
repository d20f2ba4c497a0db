//! Errors, with the numbers that they are about.

use std::fmt;
use symspline_engine::fit::{Report, Solver, Status};
use symspline_engine::space::{Ambient, Erased};
use symspline_engine::validate::{Invalid, Reason};

/// The reason why a curve was not fitted or evaluated.
///
/// `curve` and `node` count from 0. `curve` is 0 for the fit of a single curve.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The name or the size of a space is invalid, or the feature of its family is off.
    InvalidSpace {
        /// The reason.
        reason: String,
    },
    /// The curve has fewer than two points.
    TooFewPoints {
        /// The curve.
        curve: usize,
        /// The number of its points.
        points: usize,
    },
    /// The number of times or weights differs from the number of points, or a batch is empty.
    LengthMismatch {
        /// The curve.
        curve: usize,
        /// The kind of values that were counted, such as times.
        what: &'static str,
        /// The required number.
        expected: usize,
        /// The given number.
        found: usize,
    },
    /// The array of a point has another length than the points of the space.
    PointLength {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The length of points of the space.
        expected: usize,
        /// The length of the given array.
        found: usize,
    },
    /// A point or a vector has another number of factors than the product.
    FactorCount {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The number of factors of the space.
        expected: usize,
        /// The number of factors of the point.
        found: usize,
    },
    /// An error in one factor of a product.
    InFactor {
        /// The factor, counted from 0.
        factor: usize,
        /// The space of this factor.
        space: String,
        /// The error.
        error: Box<Error>,
    },
    /// A time is NaN or infinite.
    TimeNotFinite {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The time.
        time: f64,
    },
    /// A time is not after the one before it.
    UnsortedTimes {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The time of the node before.
        before: f64,
        /// The time of the node.
        time: f64,
    },
    /// The difference of the last and the first time overflows; for smoothing, its cube.
    TimesTooFarApart {
        /// The curve.
        curve: usize,
    },
    /// A point does not belong to the space.
    OffSpace {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The distance from the space, relative to the size of the point; not finite if no point of the space is near.
        distance: f64,
        /// The condition that the point violates.
        condition: String,
    },
    /// Floating-point numbers represent a point with too few significant digits.
    TooFewDigits {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The reason.
        reason: String,
    },
    /// A node and the next one lie in different components of the space.
    Disconnected {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
    },
    /// The last point of a periodic curve is not its first.
    NotClosed {
        /// The curve.
        curve: usize,
        /// The distance of the two points.
        distance: f64,
    },
    /// A vector that is prescribed at an end is NaN, infinite, not tangent, or too long.
    InvalidEnd {
        /// The curve.
        curve: usize,
        /// Whether it is the first point, otherwise it is the last.
        start: bool,
        /// The reason.
        reason: String,
    },
    /// An option has a value that is not allowed.
    InvalidOption {
        /// The option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The requirement.
        requirement: &'static str,
    },
    /// A weight of noisy data is negative or not finite.
    InvalidWeight {
        /// The index of the data.
        index: usize,
        /// The weight.
        weight: f64,
    },
    /// Points `node` and `node + 1` lie at or beyond each other's cut locus: the geodesic between them is not unique.
    /// Add a point between them.
    CutLocus {
        /// The curve.
        curve: usize,
        /// The first of the two points.
        node: usize,
        /// The angle between them.
        angle: f64,
        /// The angle that it must not reach.
        limit: f64,
    },
    /// The curve turns so fast at a node that a control handle reaches the cut locus. Add points near the node.
    HandleTooLong {
        /// The curve.
        curve: usize,
        /// The node.
        node: usize,
        /// The angle of the handle.
        angle: f64,
        /// The angle that it must not reach.
        limit: f64,
    },
    /// The solver did not reach the tolerance. If points are far apart, more points or other end conditions help, such as
    /// [`End::Natural`](crate::End::Natural). If the residual is infinite, numbers exceeded the floating-point range.
    Unconverged {
        /// The curve.
        curve: usize,
        /// The C² residual that it reached.
        residual: f64,
        /// The tolerance.
        tol: f64,
    },
    /// Noisy data could not be smoothed.
    NotSmoothed {
        /// The reason, and what to do.
        reason: &'static str,
    },
    /// A time is NaN or infinite, or it is outside the knots of the curve, and extrapolation was not requested.
    OutsideDomain {
        /// The time.
        time: f64,
        /// The first knot.
        start: f64,
        /// The last knot.
        end: f64,
    },
}

impl Error {
    /// The error in one factor of a space. Factors have common times, so that errors of times remain as they are.
    pub(crate) fn in_factor(self, factors: &[impl fmt::Debug], factor: usize) -> Self {
        let of_times = matches!(
            self,
            Error::TimeNotFinite { .. } | Error::UnsortedTimes { .. } | Error::TimesTooFarApart { .. }
        );
        if factors.len() == 1 || of_times {
            return self;
        }
        Error::InFactor { factor, space: format!("{:?}", factors[factor]), error: Box::new(self) }
    }

    /// The error of validation.
    pub(crate) fn of_input(invalid: Invalid) -> Self {
        let Invalid { curve, node, reason } = invalid;
        let node = node.unwrap_or(0);
        let text = reason.to_string();
        match reason {
            Reason::TimeNotFinite(time) => Error::TimeNotFinite { curve, node, time },
            Reason::TimesNotIncreasing { before, time } => Error::UnsortedTimes { curve, node, before, time },
            Reason::TimesTooFarApart => Error::TimesTooFarApart { curve },
            Reason::OffSpace { distance, condition } => Error::OffSpace { curve, node, distance, condition },
            Reason::TooFewDigits(reason) => Error::TooFewDigits { curve, node, reason },
            Reason::Disconnected => Error::Disconnected { curve, node },
            Reason::NotClosed { distance } => Error::NotClosed { curve, distance },
            Reason::EndNotFinite(which, _) => Error::InvalidEnd { curve, start: which.start, reason: text },
            Reason::EndNotTangent { which, .. } | Reason::EndTooFast { which, .. } => {
                Error::InvalidEnd { curve, start: which.start, reason: text }
            }
            // Lengths are compared before this validation.
            _ => Error::InvalidSpace { reason: text },
        }
    }

    /// The error of a curve that was solved, if there is one.
    pub(crate) fn of_fit(curve: usize, report: &Report, space: &Erased, tol: f64) -> Option<Self> {
        let limit = space.cut_angle();
        match report.status {
            Status::Converged => None,
            Status::CutLocus { index, angle } => Some(Error::CutLocus { curve, node: index, angle, limit }),
            Status::LongHandle { index, angle } => {
                Some(Error::HandleTooLong { curve, node: index, angle, limit: space.longest_handle() })
            }
            Status::InnerHandle { index, angle } => {
                Some(Error::HandleTooLong { curve, node: index, angle, limit })
            }
            Status::Unconverged | Status::Imprecise | Status::Unattained | Status::Stopped => {
                Some(Error::Unconverged { curve, residual: report.residual, tol })
            }
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Error::InvalidSpace { reason } => write!(f, "{reason}"),
            Error::TooFewPoints { curve, points } => {
                write!(f, "curve {curve} has {points} point(s), but a curve needs two or more")
            }
            Error::LengthMismatch { curve, what, expected, found } => {
                write!(f, "curve {curve}: {found} {what} were given, but there must be {expected}")
            }
            Error::PointLength { curve, node, expected, found } => write!(
                f,
                "curve {curve}, node {node}: the point has {found} numbers, but points of this space have {expected}"
            ),
            Error::FactorCount { curve, node, expected, found } => write!(
                f,
                "curve {curve}, node {node}: {found} factor(s) were given, but the space has {expected}. Pass one point or \
                 vector per factor"
            ),
            Error::InFactor { factor, space, error } => write!(f, "factor {factor}, {space}: {error}"),
            Error::TimeNotFinite { curve, node, time } => {
                write!(f, "curve {curve}, node {node}: the time is {time}, but times must be finite")
            }
            Error::UnsortedTimes { curve, node, before, time } => write!(
                f,
                "curve {curve}, node {node}: the time {time} is not after the time {before} of the node before. Sort \
                 times and points together"
            ),
            Error::TimesTooFarApart { curve } => {
                write!(
                    f,
                    "curve {curve}: the times span more than floating-point numbers can represent. Choose another unit of time"
                )
            }
            Error::OffSpace { curve, node, distance, condition } => {
                write!(
                    f,
                    "curve {curve}, node {node}: the point is off the space by {distance:.3e}: {condition}"
                )
            }
            Error::TooFewDigits { curve, node, reason } => {
                write!(f, "curve {curve}, node {node}: the point {reason}")
            }
            Error::Disconnected { curve, node } => write!(
                f,
                "curve {curve}, node {node}: this point and the next one lie in different components of the space"
            ),
            Error::NotClosed { curve, distance } => write!(
                f,
                "curve {curve}: the last point of a periodic curve must be its first, but they are {distance:.3e} apart"
            ),
            Error::InvalidEnd { curve, reason, .. } => write!(f, "curve {curve}: {reason}"),
            Error::InvalidOption { name, value, requirement } => {
                write!(f, "{name} must be {requirement}, not {value}")
            }
            Error::InvalidWeight { index, weight } => {
                write!(f, "weight {index} is {weight}, but weights must be finite and not negative")
            }
            Error::CutLocus { curve, node, angle, limit } => write!(
                f,
                "curve {curve}: points {node} and {} lie at or beyond each other's cut locus, angle {angle:.6} of \
                 {limit:.6}. Add a point between them",
                node + 1
            ),
            Error::HandleTooLong { curve, node, angle, limit } => write!(
                f,
                "curve {curve}: a control handle near point {node} would pass the cut locus, angle {angle:.6} of \
                 {limit:.6}. Add points near it"
            ),
            Error::Unconverged { curve, residual, tol } => {
                write!(
                    f,
                    "curve {curve}: the C² residual is {residual:.1e}, above the tolerance {tol:.1e}. Try \
                     other end conditions, such as `End::Natural`, or add points where they are far apart"
                )
            }
            Error::NotSmoothed { reason } => write!(f, "{reason}"),
            Error::OutsideDomain { time, .. } if !time.is_finite() => {
                write!(f, "the time is {time}, but times must be finite")
            }
            Error::OutsideDomain { time, start, end } => write!(
                f,
                "the time {time} is outside the knots [{start}, {end}]. To continue the curve there, call `extrapolate`"
            ),
        }
    }
}

impl std::error::Error for Error {}

/// The name of a solver.
pub(crate) fn name_of(solver: Solver) -> &'static str {
    match solver {
        Solver::FixedPoint => "fixed-point",
        Solver::QuasiNewton => "quasi-Newton",
        Solver::Newton => "Newton",
        Solver::Homotopy => "homotopy",
        Solver::TrustRegion => "trust region",
    }
}
