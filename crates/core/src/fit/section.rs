//! Part of a long curve, or a whole curve.

use super::chain::Run;
use super::problem::{Problem, Report};
use std::ops::Range;

/// Part of a curve: nodes `first..first + nodes`, of which `core` (counted from `first`) are its own.
pub struct Section<'a> {
    /// Which curve.
    pub curve: usize,
    /// The first node.
    pub first: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// The nodes of its own.
    pub core: Range<usize>,
    /// Where the velocities of the core go.
    pub velocities: &'a mut [f64],
    /// How it went.
    pub report: Report,
    /// The velocity just behind the core, which belongs to the next section: they must agree.
    pub next_velocity: Vec<f64>,
    /// The largest number in the velocities of the core.
    pub largest: f64,
    /// The longer of the handles h|u|/3 at ends with a given velocity.
    pub end_handle: f64,
}

impl Section<'_> {
    /// Its nodes, for points of `len` numbers.
    pub fn run<'a>(&self, problem: &Problem<'a>, len: usize) -> Run<'a> {
        let (from, to) = (problem.offsets[self.curve], problem.offsets[self.curve + 1]);
        Run { t: problem.knots(self.curve), points: &problem.points[from * len..to * len], first: self.first }
    }
}
