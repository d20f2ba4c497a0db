//! Many curves, and long ones: eight lanes at a time, on all cores.
//!
//! Curves of one length go into the lanes side by side. A long curve is cut into overlapping pieces
//! with artificial natural ends: what happens at a knot fades like 0.27 a node on equal knots, and ½ at
//! worst on any, so that a piece is exact to rounding a few dozen nodes from its ends. That neighbouring
//! pieces agree is checked; where they do not, the overlap grows.

use super::auto;
use super::certificate::{equally_spaced, invariant_radius};
use super::chain::{Chain, Run};
use super::condition::{ChainEnds, EndKind, of_kind};
use super::legs::noisy_legs;
use super::solve::Workspace;
use super::{End, Ends, Options, Problem, Report, Status};
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{LANES, Lane, dot, lane, mask_from, scatter};
use crate::space::{Ambient, Erased, Origin};
use std::cell::RefCell;
use std::ops::Range;

/// Curves with more segments than this are cut into pieces.
const LONG: usize = 512;
/// Nodes of a piece without its overlap, at most.
const CORE: usize = 480;
/// Nodes of overlap on either side, at first.
const OVERLAP: usize = 32;
/// Nodes times dimensions from which threads pay: about a fifth of a millisecond's work.
const PARALLEL: usize = 8192;

/// Part of a curve: nodes `first..first + nodes`, of which `core` (counted from `first`) are its own.
struct Piece<'a> {
    curve: usize,
    first: usize,
    nodes: usize,
    core: Range<usize>,
    /// Where the velocities of the core go.
    velocities: &'a mut [f64],
    report: Report,
    /// The velocity just behind the core, which belongs to the next piece: they must agree.
    next_velocity: Vec<f64>,
    /// The largest number in the velocities of the core.
    largest: f64,
    /// The longer of the legs h|u|/3 at ends with a given velocity.
    end_leg: f64,
}

/// Fits all curves of a problem; velocities get the layout of the points. Curves at fault are NaN.
pub fn fit(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    velocities: &mut [f64],
) -> Vec<Report> {
    let curves = problem.offsets.len() - 1;
    let mut reports = vec![Report::default(); curves];
    let whole: Vec<usize> = (0..curves).filter(|&c| problem.segments(c) <= LONG).collect();
    let mut rest: Vec<usize> = (0..curves).filter(|&c| problem.segments(c) > LONG).collect();
    fit_cut(space, problem, options, monitor, velocities, &whole, usize::MAX, &mut reports);
    let mut overlap = OVERLAP;
    while !rest.is_empty() && !monitor.cancelled() {
        rest = fit_cut(space, problem, options, monitor, velocities, &rest, overlap, &mut reports);
        overlap *= 2;
    }
    let len = space.point_len();
    for (curve, report) in reports.iter().enumerate() {
        let own = &mut velocities[problem.offsets[curve] * len..problem.offsets[curve + 1] * len];
        if report.status.is_fault() {
            own.fill(f64::NAN);
        } else if matches!(problem.ends, Ends::Periodic) && problem.segments(curve) > LONG {
            // Pieces agree to the tolerance; first and last velocity are one.
            let carried = problem.across_seam(space, curve, &own[..len]);
            own[problem.segments(curve) * len..].copy_from_slice(&carried);
        }
    }
    reports
}

/// Fits some curves in pieces with a given overlap; returns those whose pieces do not agree.
fn fit_cut(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    velocities: &mut [f64],
    curves: &[usize],
    overlap: usize,
    reports: &mut [Report],
) -> Vec<usize> {
    let len = space.point_len();
    let mut pieces = Vec::with_capacity(curves.len());
    let mut rest = velocities;
    let mut taken = 0;
    for &curve in curves {
        let (from, to) = (problem.offsets[curve], problem.offsets[curve + 1]);
        let (mut mine, behind) = rest.split_at_mut((to - taken) * len);
        mine = &mut mine[(from - taken) * len..];
        (rest, taken) = (behind, to);
        cut(problem, curve, overlap, len, mine, &mut pieces);
    }
    // Lanes hold chains of one length; sorting is stable, so that pieces of a curve stay in order.
    pieces.sort_by_key(|p| p.nodes);
    let mut groups: Vec<&mut [Piece]> = Vec::with_capacity(pieces.len() / LANES + 1);
    for same in pieces.chunk_by_mut(|a, b| a.nodes == b.nodes) {
        groups.extend(same.chunks_mut(LANES));
    }
    let work: usize = groups.iter().map(|g| g[0].nodes * space.dim()).sum();
    parallel::for_each(groups, work > PARALLEL, monitor, |group| {
        fit_lanes(space, problem, options, monitor, group);
        // Curves that are done again with more overlap were counted before.
        if overlap == OVERLAP || overlap == usize::MAX {
            monitor.advance(group.iter().map(|p| p.core.len()).sum());
        }
    });
    merge(space, problem, options, len, &pieces, reports)
}

/// Cuts a curve into pieces of one length, which may be the whole curve.
fn cut<'a>(
    problem: &Problem,
    curve: usize,
    overlap: usize,
    len: usize,
    mut velocities: &'a mut [f64],
    pieces: &mut Vec<Piece<'a>>,
) {
    let nodes = problem.segments(curve) + 1;
    let count = LANES * nodes.div_ceil(LANES * CORE);
    let core = nodes.div_ceil(count);
    let closed = matches!(problem.ends, Ends::Periodic);
    // Without this the pieces would be no shorter than the curve.
    let whole = core.saturating_add(overlap.saturating_mul(2)) >= nodes;
    let core = if whole { nodes } else { core };
    let length = if whole { nodes } else { core + 2 * overlap };
    let mut from = 0;
    while from < nodes {
        let to = (from + core).min(nodes);
        let (mine, behind) = velocities.split_at_mut((to - from) * len);
        velocities = behind;
        // A piece of an open curve is moved inside it, one of a closed curve goes round.
        let first = if whole {
            0
        } else if closed {
            (from + nodes - 1 - overlap) % (nodes - 1)
        } else {
            from.saturating_sub(overlap).min(nodes - length)
        };
        let start = if whole || !closed { from - first } else { overlap };
        pieces.push(Piece {
            curve,
            first,
            nodes: length,
            core: start..start + to - from,
            velocities: mine,
            report: Report::default(),
            next_velocity: Vec::new(),
            largest: 0.0,
            end_leg: 0.0,
        });
        from = to;
    }
}

#[derive(Default)]
struct Thread {
    chain: Chain,
    work: Workspace,
}

thread_local! {
    static THREAD: RefCell<Thread> = RefCell::default();
}

/// Fits up to eight pieces of one length.
fn fit_lanes(space: &Erased, problem: &Problem, options: &Options, monitor: &Monitor, group: &mut [Piece]) {
    // Taken out and put back, because Python may call in again while we ask it whether to go on.
    let mut memory = THREAD.take();
    fit_in(space, problem, options, monitor, group, &mut memory);
    THREAD.set(memory);
}

fn fit_in(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    group: &mut [Piece],
    Thread { chain, work }: &mut Thread,
) {
    let nodes = group[0].nodes;
    // Lanes that are left over repeat the first piece.
    let piece = |l: usize| &group[if l < group.len() { l } else { 0 }];
    let runs: [Run; LANES] = std::array::from_fn(|l| problem.run(piece(l), space.point_len()));
    let is_end = |l: usize| {
        let (p, last) = (piece(l), problem.segments(piece(l).curve));
        [p.first == 0, p.first + nodes == last + 1]
    };
    let whole = |l: usize| is_end(l) == [true, true];
    let (ends, values) = match problem.ends {
        Ends::Periodic if whole(0) => (ChainEnds::Periodic, [None, None]),
        // Pieces of a closed curve, all of whose ends are artificial.
        Ends::Periodic => (ChainEnds::Open([[EndKind::Acceleration; LANES]; 2]), [None, None]),
        Ends::Open(ends) => {
            let mut kinds = [[EndKind::Acceleration; LANES]; 2];
            let mut values = [None, None];
            for (e, end) in ends.iter().enumerate() {
                kinds[e] =
                    std::array::from_fn(|l| if is_end(l)[e] { end.kind() } else { EndKind::Acceleration });
                values[e] = end.values().map(|v| (v, space.point_len()));
            }
            (ChainEnds::Open(kinds), values)
        }
    };
    let zeros = vec![0.0; space.point_len()];
    let rows: [Option<[&[f64]; LANES]>; 2] = std::array::from_fn(|e| {
        values[e].map(|(v, len)| {
            std::array::from_fn(|l| {
                let c = piece(l).curve;
                if is_end(l)[e] { &v[c * len..(c + 1) * len] } else { &zeros[..] }
            })
        })
    });
    chain.unroll(space, &runs, nodes - 1, &ends, rows);
    let ends = few_points(space, chain, ends);
    let cut = chain.cut;
    let idle = mask_from(|l| cut[l].is_some());
    let pieces_tol = if whole(0) { options.tol } else { options.tol / 4.0 };
    let options = Options { tol: pieces_tol, ..*options };
    let outcome = auto::run(space, chain, &ends, &options, idle, work, monitor);
    let (residual, rate) = (outcome.residual.to_array(), outcome.rate.to_array());
    let noisy = noisy_legs(space, chain, &runs, outcome.leg);
    let steps = chain.max_step.to_array();
    let given = given_legs(chain, &ends);
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
            invariant_radius: f64::NAN,
        };
        p.end_leg = given[l];
    }
    let runs: [Run; LANES] =
        std::array::from_fn(|l| problem.run(&group[if l < group.len() { l } else { 0 }], space.point_len()));
    write_velocities(space, chain, &runs, group);
}

/// Not-a-knot ends of two and of three points need a rule of their own; it is SciPy's.
fn few_points(space: &Erased, chain: &mut Chain, ends: ChainEnds) -> ChainEnds {
    let ChainEnds::Open(mut kinds) = ends else { return ends };
    let (n, m) = (chain.n, chain.m);
    let both = kinds.map(|k| k[0] == EndKind::NotAKnot);
    if n == 1 {
        // The geodesic.
        for e in 0..2 {
            if both[e] {
                chain.end_values[e].clear();
                let inverse = Lane::ONE / chain.h[0];
                chain.end_values[e].extend(chain.chord.iter().map(|d| *d * inverse));
                kinds[e] = [EndKind::Velocity; LANES];
            }
        }
    } else if n == 2 && both == [true, true] {
        // The parabola through the three points, in normal coordinates at the middle one.
        let (h0, h1) = (chain.h[0], chain.h[1]);
        let (d0, d1) = chain.chord.split_at(m);
        let middle: Vec<Lane> = (0..m).map(|c| (d0[c] * h1 / h0 + d1[c] * h0 / h1) / (h0 + h1)).collect();
        for (e, (d, h)) in [(d0, h0), (d1, h1)].into_iter().enumerate() {
            let value = &mut chain.end_values[e];
            for c in 0..m {
                value[c] = lane(2.0) * d[c] / h - middle[c];
            }
            space.stretch(d, value);
            kinds[e] = [EndKind::Velocity; LANES];
        }
    }
    ChainEnds::Open(kinds)
}

fn write_velocities(space: &Erased, chain: &mut Chain, runs: &[Run; LANES], group: &mut [Piece]) {
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

/// Puts the reports of the pieces of each curve together; returns the curves whose pieces differ.
fn merge(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    len: usize,
    pieces: &[Piece],
    reports: &mut [Report],
) -> Vec<usize> {
    let mut differing = Vec::new();
    for same in pieces.chunk_by(|a, b| a.curve == b.curve) {
        let curve = same[0].curve;
        let mut report = same[0].report;
        let mut largest = 0.0_f64;
        let mut mismatch = 0.0_f64;
        for (p, next) in same.iter().zip(same[1..].iter().map(Some).chain([None])) {
            let r = &p.report;
            report.iterations = report.iterations.max(r.iterations);
            report.residual = report.residual.max(r.residual);
            report.max_step = report.max_step.max(r.max_step);
            report.rate = report.rate.max(r.rate);
            report.solver = report.solver.max(r.solver);
            if report.status == Status::Converged {
                report.status = r.status;
            }
            largest = largest.max(p.largest);
            if let Some(next) = next {
                for (a, b) in p.next_velocity.iter().zip(&next.velocities[..len]) {
                    mismatch = mismatch.max((a - b).abs());
                }
            }
        }
        if let ([first, .., last], Ends::Periodic) = (same, problem.ends) {
            // The last knot is the first again.
            let carried = problem.across_seam(space, curve, &first.velocities[..len]);
            for (a, b) in carried.iter().zip(&last.velocities[last.velocities.len() - len..]) {
                mismatch = mismatch.max((a - b).abs());
            }
        }
        if report.status == Status::Converged && mismatch > 0.0 {
            report.residual = report.residual.max(mismatch / largest / 3.0);
            if mismatch > options.tol * largest {
                differing.push(curve);
            }
        }
        report.status = report.status.counted(|index| index % problem.segments(curve));
        let known = matches!(&problem.ends, Ends::Open(ends) if ends.iter().all(End::is_of_the_theorem));
        if known && equally_spaced(problem.knots(curve)) {
            let leg = same.iter().map(|p| p.end_leg).fold(0.0, f64::max);
            let radius = invariant_radius(report.max_step, space.curvature(), leg);
            report.invariant_radius = radius.unwrap_or(f64::NAN);
        }
        reports[curve] = report;
    }
    differing
}

impl<'a> Problem<'a> {
    /// Number of segments of a curve.
    fn segments(&self, curve: usize) -> usize {
        self.offsets[curve + 1] - self.offsets[curve] - 1
    }

    /// The knots of a curve.
    pub fn knots(&self, curve: usize) -> &'a [f64] {
        if self.shared { self.t } else { &self.t[self.offsets[curve]..self.offsets[curve + 1]] }
    }

    /// A velocity at the first point of a closed curve as one at its last, which may be another array.
    fn across_seam(&self, space: &Erased, curve: usize, velocity: &[f64]) -> Vec<f64> {
        let len = velocity.len();
        let lanes = |row: &[f64]| -> Vec<Lane> { row.iter().map(|&x| lane(x)).collect() };
        let point = |node: usize| lanes(&self.points[node * len..(node + 1) * len]);
        let (first, last) = (point(self.offsets[curve]), point(self.offsets[curve + 1] - 1));
        let (still, mut carried) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
        space.carry(&first, &last, &still, &lanes(velocity), &mut carried);
        carried.iter().map(|x| x.as_array()[0]).collect()
    }

    fn run(&self, piece: &Piece, len: usize) -> Run<'a> {
        let (from, to) = (self.offsets[piece.curve], self.offsets[piece.curve + 1]);
        Run { t: self.knots(piece.curve), points: &self.points[from * len..to * len], first: piece.first }
    }
}

/// The longer of the legs h|u|/3 at ends with a given velocity, lane by lane.
fn given_legs(chain: &Chain, ends: &ChainEnds) -> [f64; LANES] {
    let ChainEnds::Open(kinds) = ends else { return [0.0; LANES] };
    let (n, m) = (chain.n, chain.m);
    let mut longest = Lane::ZERO;
    for (node, segment, kinds) in [(0, 0, &kinds[0]), (n, n - 1, &kinds[1])] {
        let u = &chain.velocities()[node * m..(node + 1) * m];
        let leg = dot(u, u).sqrt() * chain.h[segment] * lane(1.0 / 3.0);
        longest = of_kind(kinds, EndKind::Velocity).select(longest.max(leg), longest);
    }
    longest.to_array()
}

impl<'a> End<'a> {
    /// Whether Theorem 3.1 is about such ends.
    fn is_of_the_theorem(&self) -> bool {
        matches!(self, End::Natural | End::Velocity(_))
    }

    fn kind(&self) -> EndKind {
        match self {
            End::Natural | End::Acceleration(_) => EndKind::Acceleration,
            End::Velocity(_) => EndKind::Velocity,
            End::NotAKnot => EndKind::NotAKnot,
        }
    }

    fn values(&self) -> Option<&'a [f64]> {
        match self {
            End::Velocity(v) | End::Acceleration(v) => Some(v),
            End::Natural | End::NotAKnot => None,
        }
    }
}
