//! Curves of different lengths and end conditions, fitted in as few calls as possible.

use crate::axis::{Axis, Condition, Run};
use crate::grid::OPTIONS;
use crate::summary::Summary;
use symspline_core::fit::{End, Ends, Problem, Status, fit};
use symspline_core::monitor::Monitor;
use symspline_core::space::{Ambient, Erased};

/// Curves through runs of nodes.
#[derive(Default)]
pub struct Batch {
    groups: Vec<Group>,
}

/// Curves with the same end conditions.
struct Group {
    conditions: Option<[Condition; 2]>,
    curves: Vec<(usize, Run)>,
    offsets: Vec<usize>,
    t: Vec<f64>,
    points: Vec<f64>,
    velocities: Vec<f64>,
}

/// A fitted curve: its owner, its run and its velocities.
pub struct Fitted<'a> {
    pub owner: usize,
    pub run: Run,
    pub velocities: &'a [f64],
}

impl Batch {
    /// Adds a curve through a run of at least two nodes; `point` returns the point of a node of the row.
    pub fn push<'p>(&mut self, axis: &Axis, owner: usize, run: Run, point: impl Fn(usize) -> &'p [f64]) {
        let conditions = axis.conditions(run);
        let known = self.groups.iter().position(|group| group.conditions == conditions);
        let number = known.unwrap_or_else(|| {
            self.groups.push(Group {
                conditions,
                curves: Vec::new(),
                offsets: vec![0],
                t: Vec::new(),
                points: Vec::new(),
                velocities: Vec::new(),
            });
            self.groups.len() - 1
        });
        let group = &mut self.groups[number];
        for i in run.first..run.first + run.nodes {
            group.t.push(axis.knot(i));
            group.points.extend_from_slice(point(axis.index(i)));
        }
        group.offsets.push(group.t.len());
        group.curves.push((owner, run));
    }

    /// Fits all curves. The summary omits failures of rows that are not `needed`.
    pub fn fit(
        &mut self,
        space: &Erased,
        axis: &Axis,
        number: usize,
        needed: impl Fn(usize) -> bool,
        monitor: &Monitor,
    ) -> Summary {
        let mut summary = Summary::default();
        for group in &mut self.groups {
            group.velocities.resize(group.points.len(), 0.0);
            let rest = vec![0.0; group.curves.len() * space.point_len()];
            let problem = Problem {
                t: &group.t,
                shared: false,
                points: &group.points,
                offsets: &group.offsets,
                ends: ends_of(group.conditions, &rest),
            };
            let reports = fit(space, &problem, &OPTIONS, monitor, &mut group.velocities);
            for (report, (owner, run)) in reports.iter().zip(&group.curves) {
                if report.status == Status::Converged || needed(*owner) {
                    summary.add(number, report, |node| axis.index(run.first + node));
                }
            }
        }
        summary
    }

    /// The fitted curves.
    pub fn curves(&self, len: usize) -> impl Iterator<Item = Fitted<'_>> {
        self.groups.iter().flat_map(move |group| {
            group.curves.iter().zip(group.offsets.windows(2)).map(move |(&(owner, run), offsets)| Fitted {
                owner,
                run,
                velocities: &group.velocities[offsets[0] * len..offsets[1] * len],
            })
        })
    }
}

/// End conditions in the form of the solvers; `rest` contains one zero vector per curve.
pub fn ends_of(conditions: Option<[Condition; 2]>, rest: &[f64]) -> Ends<'_> {
    match conditions {
        None => Ends::Periodic,
        Some(conditions) => Ends::Open(conditions.map(|condition| match condition {
            Condition::Natural => End::Natural,
            Condition::NotAKnot => End::NotAKnot,
            Condition::Clamped => End::Velocity(rest),
        })),
    }
}
