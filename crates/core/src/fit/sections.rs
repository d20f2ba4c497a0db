//! Long curves in sections, in SIMD lanes and on all cores.
//!
//! A long curve is divided into overlapping sections with artificial natural ends. The influence of a knot decays by
//! a factor of 0.27 per node on equal knots, and of ½ in the worst case, so that a section is accurate to rounding a
//! few dozen nodes from its ends. Neighbouring sections are compared; if they do not agree, the overlap grows.

use super::lanes::fit_lanes;
use super::problem::{End, Ends, Options, Problem, Report, Status};
use super::section::Section;
use super::theorem::{contraction_bound, equally_spaced, guaranteed_sweeps, invariant_radius};
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::LANES;
use crate::space::{Ambient, Erased, Origin};

/// Maximum number of nodes of a section without its overlap.
const CORE: usize = 480;
/// Initial number of nodes of overlap on either side.
pub const OVERLAP: usize = 32;
/// Nodes times dimensions from which several threads are certainly faster: milliseconds of work.
const LONG: usize = 8192;

/// Fits some curves, whole or in sections with a given overlap. Returns the curves whose sections do not agree.
pub fn fit_cut(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    velocities: &mut [f64],
    curves: &[usize],
    overlap: Option<usize>,
    reports: &mut [Report],
) -> Vec<usize> {
    let len = space.point_len();
    let mut sections = Vec::with_capacity(curves.len());
    let mut rest = velocities;
    let mut taken = 0;
    for &curve in curves {
        let (from, to) = (problem.offsets[curve], problem.offsets[curve + 1]);
        let (mut mine, behind) = rest.split_at_mut((to - taken) * len);
        mine = &mut mine[(from - taken) * len..];
        (rest, taken) = (behind, to);
        cut(problem, curve, overlap, len, mine, &mut sections);
    }
    // Lanes contain chains of equal length. Sorting is stable, so that the sections of a curve stay in order.
    sections.sort_by_key(|p| p.nodes);
    let mut groups: Vec<&mut [Section]> = Vec::with_capacity(sections.len() / LANES + 1);
    for same in sections.chunk_by_mut(|a, b| a.nodes == b.nodes) {
        groups.extend(same.chunks_mut(LANES));
    }
    let work: usize = groups.iter().map(|g| g[0].nodes * space.dim()).sum();
    parallel::for_each(groups, work > LONG, monitor, |group| {
        fit_lanes(space, problem, options, monitor, group);
        // Curves that are repeated with more overlap were counted before.
        if overlap.is_none_or(|nodes| nodes == OVERLAP) {
            monitor.advance(group.iter().map(|p| p.core.len()).sum());
        }
    });
    merge(space, problem, options, len, &sections, reports)
}

/// Divides a curve into sections of equal length with this many nodes of overlap on either side, or takes it whole.
fn cut<'a>(
    problem: &Problem,
    curve: usize,
    overlap: Option<usize>,
    len: usize,
    mut velocities: &'a mut [f64],
    sections: &mut Vec<Section<'a>>,
) {
    let nodes = problem.segments(curve) + 1;
    let count = LANES * nodes.div_ceil(LANES * CORE);
    let core = nodes.div_ceil(count);
    let closed = matches!(problem.ends, Ends::Periodic);
    // Sections that are not shorter than the curve are replaced by the curve.
    let overlap = overlap.filter(|overlap| core + 2 * overlap < nodes);
    let (core, length) = overlap.map_or((nodes, nodes), |overlap| (core, core + 2 * overlap));
    let mut from = 0;
    while from < nodes {
        let to = (from + core).min(nodes);
        let (mine, behind) = velocities.split_at_mut((to - from) * len);
        velocities = behind;
        // A section of an open curve is shifted inside it; a section of a closed curve continues around it.
        let (first, start) = match overlap {
            None => (0, 0),
            Some(overlap) if closed => ((from + nodes - 1 - overlap) % (nodes - 1), overlap),
            Some(overlap) => {
                let first = from.saturating_sub(overlap).min(nodes - length);
                (first, from - first)
            }
        };
        sections.push(Section {
            curve,
            first,
            nodes: length,
            core: start..start + to - from,
            velocities: mine,
            report: Report::default(),
            next_velocity: Vec::new(),
            largest: 0.0,
            end_handle: 0.0,
        });
        from = to;
    }
}

/// Combines the reports of the sections of each curve. Returns the curves whose sections differ.
fn merge(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    len: usize,
    sections: &[Section],
    reports: &mut [Report],
) -> Vec<usize> {
    let mut differing = Vec::new();
    for same in sections.chunk_by(|a, b| a.curve == b.curve) {
        let curve = same[0].curve;
        let mut largest = 0.0_f64;
        let mut mismatch = 0.0_f64;
        for (p, next) in same.iter().zip(same[1..].iter().map(Some).chain([None])) {
            largest = largest.max(p.largest);
            if let Some(next) = next {
                for (a, b) in p.next_velocity.iter().zip(&next.velocities[..len]) {
                    mismatch = mismatch.max((a - b).abs());
                }
            }
        }
        let mut report = same[1..].iter().fold(same[0].report, |report, p| report.joined(p.report));
        if let ([first, .., last], Ends::Periodic) = (same, problem.ends) {
            // The last knot equals the first.
            let transported = problem.across_closure(space, curve, &first.velocities[..len]);
            for (a, b) in transported.iter().zip(&last.velocities[last.velocities.len() - len..]) {
                mismatch = mismatch.max((a - b).abs());
            }
        }
        if report.status == Status::Converged && mismatch > 0.0 {
            report.residual = report.residual.max(mismatch / largest / 3.0);
            if mismatch > options.tol * largest {
                differing.push(curve);
            }
        }
        let around = |index| index % problem.segments(curve);
        report.status = report.status.counted(around);
        report.almost_cut = report.almost_cut.map(|(index, angle)| (around(index), angle));
        let known =
            matches!(&problem.ends, Ends::Open(ends) if ends.iter().all(End::is_covered_by_the_theorem));
        if known && equally_spaced(problem.knots(curve)) {
            let handle = same.iter().map(|p| p.end_handle).fold(0.0, f64::max);
            let curvature = space.curvature();
            if let Some(radius) = invariant_radius(report.max_step, curvature, handle) {
                report.invariant_radius = radius;
                if let Some(alpha) = contraction_bound(report.max_step, curvature, radius) {
                    report.contraction_bound = alpha;
                    report.guaranteed_sweeps = guaranteed_sweeps(alpha, options.tol);
                }
            }
        }
        reports[curve] = report;
    }
    differing
}
