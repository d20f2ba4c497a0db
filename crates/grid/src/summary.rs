//! What the fits of many rows report together.

use symspline_core::fit::{Report, Status};

/// The first failed row of an axis.
#[derive(Clone, Copy, Debug)]
pub struct AxisFault {
    /// The axis along which the row runs.
    pub axis: usize,
    /// Why it failed; nodes are counted along the axis.
    pub status: Status,
    /// Its relative C² residual.
    pub residual: f64,
}

/// The reports of many rows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Summary {
    /// The number of rows that failed.
    pub failed: usize,
    /// The failed row of the lowest axis that was found first.
    pub first: Option<AxisFault>,
    /// The largest residual of rows that did not fail.
    pub residual: f64,
    /// The longest step between neighbouring nodes.
    pub max_step: f64,
    /// The largest number of iterations.
    pub iterations: usize,
}

impl Summary {
    /// Adds the report of a row; `node` converts numbers of nodes to those along the axis.
    pub fn add(&mut self, axis: usize, report: &Report, node: impl Fn(usize) -> usize) {
        self.max_step = self.max_step.max(report.max_step);
        self.iterations = self.iterations.max(report.iterations);
        let status = match report.status {
            Status::Converged | Status::Stopped => {
                self.residual = self.residual.max(report.residual);
                return;
            }
            Status::Unconverged | Status::Imprecise | Status::Unattained => report.status,
            Status::CutLocus { index, angle } => Status::CutLocus { index: node(index), angle },
            Status::LongHandle { index, angle } => Status::LongHandle { index: node(index), angle },
            Status::InnerHandle { index, angle } => Status::InnerHandle { index: node(index), angle },
        };
        self.failed += 1;
        self.first = self.first.or(Some(AxisFault { axis, status, residual: report.residual }));
    }

    /// The reports of both.
    pub fn merge(&mut self, other: &Summary) {
        self.failed += other.failed;
        self.first = match (self.first, other.first) {
            (Some(a), Some(b)) if b.axis < a.axis => Some(b),
            (a, b) => a.or(b),
        };
        self.residual = self.residual.max(other.residual);
        self.max_step = self.max_step.max(other.max_step);
        self.iterations = self.iterations.max(other.iterations);
    }
}
