//! The input of an evaluation: curves, times, quantities, and a block of samples.

use super::locate::Locator;
use std::any::Any;
use std::cell::Cell;

/// Spline curves with equally many knots: the triple (t, p, u).
#[derive(Clone, Copy)]
pub struct Curves<'a> {
    /// Knots, one row per curve or one row for all curves.
    pub t: &'a [f64],
    /// Number of knots per curve.
    pub nodes: usize,
    /// Points, curve after curve.
    pub points: &'a [f64],
    /// Velocities in the same layout; at knots where the curve has a corner, those after it.
    pub velocities: &'a [f64],
    /// Velocities before the knots, for curves with corners; otherwise empty.
    pub before: &'a [f64],
}

/// The last segment in which the points of one curve were evaluated.
#[derive(Default)]
pub struct LastSegment(pub(super) Cell<Option<Box<dyn Any + Send>>>);

/// Times to evaluate at.
#[derive(Clone, Copy)]
pub struct Times<'a> {
    /// The times, one row per curve or one row for all curves.
    pub x: &'a [f64],
    /// Number of times per curve.
    pub count: usize,
}

/// The quantity to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// γ
    Point,
    /// γ'
    Velocity,
    /// ∇γ'
    Acceleration,
    /// ∇∇γ'
    Jerk,
    /// |γ'|
    Speed,
    /// |∇γ'|
    AccelerationNorm,
    /// γ' in the body frame, for spaces that define it (`Covered::body`): angular velocity.
    BodyVelocity,
    /// ∇γ' in the body frame: angular acceleration.
    BodyAcceleration,
    /// γ' and ∇γ' in the body frame, and γ, one after the other.
    Motion,
    /// γ and γ', one after the other.
    State,
    /// γ, the derivative of its array, and ∇γ', one after the other.
    Jet,
}

/// The extrapolation policy for times outside the knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The last Bézier segment continues.
    Continue,
    /// The curve continues with constant velocity.
    Geodesic,
    /// The curve is periodic.
    Wrap,
}

impl Curves<'_> {
    /// Velocities at the starts and at the ends of segments, each with an entry for every knot.
    pub(super) fn one_sided(&self) -> [&[f64]; 2] {
        [self.velocities, if self.before.is_empty() { self.velocities } else { self.before }]
    }

    pub(super) fn knots(&self, curve: usize) -> &[f64] {
        if self.t.len() == self.nodes {
            self.t
        } else {
            &self.t[curve * self.nodes..(curve + 1) * self.nodes]
        }
    }

    /// First and last knot of a curve.
    pub fn domain(&self, curve: usize) -> (f64, f64) {
        let t = self.knots(curve);
        (t[0], t[self.nodes - 1])
    }
}

impl Quantity {
    /// Whether the result is a length.
    pub fn is_length(self) -> bool {
        matches!(self, Quantity::Speed | Quantity::AccelerationNorm)
    }

    /// Whether the result is a vector in the body frame.
    pub fn is_of_body(self) -> bool {
        matches!(self, Quantity::BodyVelocity | Quantity::BodyAcceleration | Quantity::Motion)
    }

    /// The number of derivatives of the curve that the quantity requires.
    pub fn order(self) -> usize {
        match self {
            Quantity::Point => 0,
            Quantity::Velocity | Quantity::Speed | Quantity::BodyVelocity | Quantity::State => 1,
            // The jerk is the derivative of accelerations.
            Quantity::Acceleration
            | Quantity::Jerk
            | Quantity::AccelerationNorm
            | Quantity::BodyAcceleration
            | Quantity::Motion
            | Quantity::Jet => 2,
        }
    }
}

/// A block of samples.
pub struct Job<'a> {
    /// The quantity to compute.
    pub quantity: Quantity,
    pub(super) curves: &'a Curves<'a>,
    pub(super) times: &'a Times<'a>,
    pub(super) outside: Outside,
    pub(super) locator: Option<&'a Locator<'a>>,
    /// The first sample of the block.
    pub(super) first: usize,
    /// The step in samples from one lane to the next: 1, or the samples of a curve.
    pub(super) apart: usize,
    /// Numbers in a row of the result, and of a point.
    pub(super) size: usize,
    pub(super) len: usize,
    /// The segment of the job before, where it is kept.
    pub(super) last: Option<&'a LastSegment>,
}

/// The numbers of a motion: four coordinate vectors, and the changes of the first knot and of the length of the segment.
pub const fn motion_len(dim: usize) -> usize {
    4 * dim + 2
}

/// Curves, the frames of their knots, and the times of samples. Motions of a segment stand in the row of the knot where it
/// begins.
pub struct Moving<'a> {
    /// The curves.
    pub curve: Curves<'a>,
    /// The times.
    pub times: Times<'a>,
    /// The frames of the knots. Where a run of segments ends, the knot has two: that of the run comes first.
    pub frames: &'a [f64],
    /// The number of runs of a curve, of almost equal length; frames are transported in parallel within a run.
    pub runs: usize,
    /// The order ν of the derivative in time that is differentiated.
    pub nu: usize,
    /// Whether reverse mode keeps samples apart: its result then has a row per sample in place of one per segment.
    pub apart: bool,
    /// The dimension of the space.
    pub dim: usize,
    /// The numbers of a point.
    pub len: usize,
}

/// A B-spline curve: `knots.len() = control points + degree + 1`, as in SciPy.
pub struct BSpline<'a> {
    /// Non-decreasing knots, possibly repeated.
    pub knots: &'a [f64],
    /// Control points, one after another, curve after curve.
    pub control: &'a [f64],
    /// The degree.
    pub degree: usize,
    /// For cumulative B-splines on groups, their [steps](super::cumulative_steps); empty for de Boor's algorithm.
    pub steps: &'a [f64],
}

impl BSpline<'_> {
    /// Control points of one curve.
    pub fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// The knot interval that contains a time; the last one at the end of the domain.
    pub fn interval(&self, x: f64) -> usize {
        let last = self.count() - 1;
        let k = self.knots.partition_point(|&t| t <= x).saturating_sub(1).clamp(self.degree, last);
        // Skip empty intervals at the end.
        (self.degree..=k).rev().find(|&k| self.knots[k] < self.knots[k + 1]).unwrap_or(k)
    }

    /// The same, at once if it is `hint`, an earlier result.
    pub fn interval_near(&self, x: f64, hint: usize) -> usize {
        if self.knots[hint] <= x && x < self.knots[hint + 1] { hint } else { self.interval(x) }
    }
}
