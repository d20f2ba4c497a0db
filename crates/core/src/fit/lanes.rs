//! Curves, or sections of curves, in SIMD lanes.

use super::auto;
use super::certificate::{Bounds, bounds};
use super::chain::{Chain, Run};
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::ends::few_points;
use super::handles::noisy_handles;
use super::problem::{End, Ends, Options, Problem, Report, Status};
use super::section::Section;
use super::solve::{Lanes, Workspace};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, dot, few, lane, mask_from, scatter};
use crate::space::{Ambient, Erased};
use std::cell::Cell;

#[derive(Default)]
struct Thread {
    chain: Chain,
    work: Workspace,
}

thread_local! {
    static THREAD: Cell<Option<Box<Thread>>> = const { Cell::new(None) };
}

/// Fits sections of equal length, at most one per lane.
pub fn fit_lanes(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    group: &mut [Section],
) {
    // The memory is taken out and put back, because Python may start another fit when it is asked whether to
    // continue.
    let mut memory = THREAD.take().unwrap_or_default();
    fit_in(space, problem, options, monitor, group, &mut memory);
    THREAD.set(Some(memory));
}

fn fit_in(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    group: &mut [Section],
    Thread { chain, work }: &mut Thread,
) {
    let nodes = group[0].nodes;
    // Unused lanes repeat the first section.
    let section = |l: usize| &group[if l < group.len() { l } else { 0 }];
    let runs: [Run; LANES] = few(|l| section(l).run(problem, space.point_len()));
    let is_end = |l: usize| {
        let (p, last) = (section(l), problem.segments(section(l).curve));
        [p.first == 0, p.first + nodes == last + 1]
    };
    let whole = |l: usize| is_end(l) == [true, true];
    let (ends, values) = match problem.ends {
        Ends::Periodic if whole(0) => (ChainEnds::Periodic, [None, None]),
        // Sections of a closed curve, all of whose ends are artificial.
        Ends::Periodic => (ChainEnds::Open([[EndKind::Acceleration; LANES]; 2]), [None, None]),
        Ends::Open(ends) => {
            let mut kinds = [[EndKind::Acceleration; LANES]; 2];
            let mut values = [None, None];
            for (e, end) in ends.iter().enumerate() {
                kinds[e] = few(|l| if is_end(l)[e] { end.kind() } else { EndKind::Acceleration });
                values[e] = end.values().map(|v| (v, space.point_len()));
            }
            (ChainEnds::Open(kinds), values)
        }
    };
    let zeros = vec![0.0; space.point_len()];
    let rows: [Option<[&[f64]; LANES]>; 2] = few(|e| {
        values[e].map(|(v, len)| {
            few(|l| {
                let c = section(l).curve;
                if is_end(l)[e] { &v[c * len..(c + 1) * len] } else { &zeros[..] }
            })
        })
    });
    let both = few(|e| match problem.ends {
        // In lanes of sections that do not reach the end, they are not used.
        Ends::Open(ends) => match ends[e] {
            End::Both(both) => Some(both.rows(space.point_len(), few(|l| section(l).curve))),
            _ => None,
        },
        Ends::Periodic => None,
    });
    chain.unroll(space, &runs, nodes - 1, &ends, rows, both);
    let ends = few_points(space, chain, ends);
    let (cut, almost_cut) = (chain.cut, chain.almost_cut);
    let idle = mask_from(|l| cut[l].is_some()) | ends.lost(chain);
    let sections_tol = if whole(0) { options.tol } else { options.tol / 4.0 };
    let options = Options { tol: sections_tol, ..*options };
    let mut lanes = Lanes { space, chain, ends: &ends, work, monitor };
    let mut outcome = auto::run(&mut lanes, &options, idle, whole(0));
    outcome.judge(&mut lanes, options.tol, idle);
    let alternative = (outcome.alternative * chain.unit_of_energy()).to_array();
    let (residual, rate) = (outcome.residual.to_array(), outcome.rate.to_array());
    let noisy = noisy_handles(space, chain, &runs, outcome.handle);
    let steps = chain.max_step.to_array();
    let given = given_handles(chain, &ends);
    let bounds = match options.certify {
        Some(injectivity) => {
            let cores = std::array::from_fn(|l| section(l).core.clone());
            bounds(space, chain, &ends, (injectivity, outcome.handle), &mut work.vectors, cores)
        }
        None => [Bounds::default(); LANES],
    };
    let (condition, widest) = (chain.condition.to_array(), chain.widest.to_array());
    for (l, p) in group.iter_mut().enumerate() {
        let status = if let Some((index, angle)) = cut[l] {
            Status::CutLocus { index, angle }
        } else if monitor.cancelled() {
            Status::Stopped
        } else if let Some(fault) = outcome.fault[l] {
            fault
        } else if !outcome.converged[l] {
            Status::Unconverged
        } else {
            noisy[l].unwrap_or(Status::Converged)
        };
        let status = status.counted(|index| p.first + index);
        p.report = Report {
            status,
            iterations: outcome.iterations[l],
            residual: residual[l],
            max_step: steps[l],
            rate: rate[l],
            solver: outcome.solver[l],
            alternative: alternative[l],
            almost_cut: almost_cut[l].map(|(index, angle)| (p.first + index, angle)),
            skipped: outcome.skipped[l],
            bounds: bounds[l],
            condition: condition[l],
            widest: widest[l],
            ..Report::default()
        };
        p.end_handle = given[l];
    }
    let runs: [Run; LANES] =
        few(|l| group[if l < group.len() { l } else { 0 }].run(problem, space.point_len()));
    write_velocities(space, chain, &runs, group);
}

fn write_velocities(space: &Erased, chain: &mut Chain, runs: &[Run; LANES], group: &mut [Section]) {
    let len = space.point_len();
    let mut rows = vec![0.0; LANES * len];
    chain.roll_up(space, runs, |i, u| {
        scatter(u, &mut rows);
        for (p, row) in group.iter_mut().zip(rows.chunks_exact(len)) {
            if p.core.contains(&i) {
                let at = (i - p.core.start) * len;
                p.velocities[at..at + len].copy_from_slice(row);
                p.largest = row.iter().fold(p.largest, |x, u| x.max(u.abs()));
            } else if i == p.core.end {
                p.next_velocity.extend_from_slice(row);
            }
        }
    });
}

/// The longer of the handles h|u|/3 at ends with a given velocity, lane by lane.
fn given_handles(chain: &Chain, ends: &ChainEnds) -> [f64; LANES] {
    let ChainEnds::Open(kinds) = ends else { return [0.0; LANES] };
    let (n, m) = (chain.n, chain.m);
    let mut longest = Lane::ZERO;
    for (node, segment, kinds) in [(0, 0, &kinds[0]), (n, n - 1, &kinds[1])] {
        let u = &chain.velocities()[node * m..(node + 1) * m];
        let handle = dot(u, u).sqrt() * chain.h[segment] * lane(1.0 / 3.0);
        longest = of_kind(kinds, EndKind::Velocity).select(longest.max(handle), longest);
    }
    longest.to_array()
}
