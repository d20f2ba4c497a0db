//! A section of a long curve, or a whole curve.

use super::chain::Run;
use super::problem::{Problem, Report};
use std::ops::Range;

/// A section of a curve: nodes `first..first + nodes`. Its result is used for the nodes `core`, counted from `first`.
pub struct Section<'a> {
    /// The index of the curve.
    pub curve: usize,
    /// The first node.
    pub first: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// The nodes without the overlap.
    pub core: Range<usize>,
    /// The output: velocities of the core.
    pub velocities: &'a mut [f64],
    /// The report of the section.
    pub report: Report,
    /// The velocity just after the core, which belongs to the next section: both values must agree.
    pub next_velocity: Vec<f64>,
    /// The largest number in the velocities of the core.
    pub largest: f64,
    /// The longer of the handles h|u|/3 at ends with a given velocity.
    pub end_handle: f64,
}

impl Section<'_> {
    /// The nodes of the section, for points of `len` numbers.
    pub fn run<'a>(&self, problem: &Problem<'a>, len: usize) -> Run<'a> {
        let (from, to) = (problem.offsets[self.curve], problem.offsets[self.curve + 1]);
        Run { t: problem.knots(self.curve), points: &problem.points[from * len..to * len], first: self.first }
    }
}
