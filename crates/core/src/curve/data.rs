//! What is evaluated: curves, times, quantities, and a block of samples.

use super::locate::Locator;

/// Spline curves with equally many knots: the triple (t, p, u).
pub struct Curves<'a> {
    /// Knots of each curve, or of one for all.
    pub t: &'a [f64],
    /// Number of knots of a curve.
    pub nodes: usize,
    /// Points, curve after curve.
    pub points: &'a [f64],
    /// Velocities in the same layout.
    pub velocities: &'a [f64],
}

/// Times to evaluate at.
pub struct Times<'a> {
    /// The times, of each curve or of all.
    pub x: &'a [f64],
    /// Times of one curve.
    pub count: usize,
}

/// What to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// γ
    Point,
    /// γ'
    Velocity,
    /// ∇γ'
    Acceleration,
    /// |γ'|
    Speed,
    /// |∇γ'|
    Bend,
    /// γ' in the frame of the moving body, for spaces that define it (`Covered::body`): angular velocity.
    BodyVelocity,
    /// ∇γ' in the frame of the moving body: angular acceleration.
    BodyAcceleration,
}

/// The extrapolation policy for times outside the knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The last Bézier segment goes on.
    Continue,
    /// The curve goes on with constant velocity.
    Geodesic,
    /// Time wraps around.
    Wrap,
}

impl Curves<'_> {
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
    /// Whether the result is one number, the length of a vector.
    pub fn is_length(self) -> bool {
        matches!(self, Quantity::Speed | Quantity::Bend)
    }

    /// Whether the result is a vector in the frame of the moving body.
    pub fn is_of_body(self) -> bool {
        matches!(self, Quantity::BodyVelocity | Quantity::BodyAcceleration)
    }

    /// The number of derivatives of the curve that are needed.
    pub fn order(self) -> usize {
        match self {
            Quantity::Point => 0,
            Quantity::Velocity | Quantity::Speed | Quantity::BodyVelocity => 1,
            Quantity::Acceleration | Quantity::Bend | Quantity::BodyAcceleration => 2,
        }
    }
}

/// A block of samples.
pub struct Job<'a> {
    /// What is computed.
    pub quantity: Quantity,
    pub(super) curves: &'a Curves<'a>,
    pub(super) times: &'a Times<'a>,
    pub(super) outside: Outside,
    pub(super) locator: Option<&'a Locator<'a>>,
    /// The first sample of the block.
    pub(super) first: usize,
    /// Samples from one lane to the next: 1, or those of a curve.
    pub(super) apart: usize,
    /// Numbers in a row of the result, and of a point.
    pub(super) size: usize,
    pub(super) len: usize,
}
