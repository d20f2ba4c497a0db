//! Fits of all curves of a problem, long ones in sections, and what counts as converged after rounding.

use super::minimum_energy::HALF_WAY;
use super::problem::{Ends, Method, Options, Problem, Report, Status};
use super::rounded;
use super::sections::{OVERLAP, fit_cut};
use crate::monitor::Monitor;
use crate::scalar::LANES;
use crate::space::{Ambient, Erased, Frame, Origin};

/// Curves with more segments than this are divided into sections.
const LONG: usize = 512;
/// A single curve with more segments than this is divided, too, if its points are near each other. In a batch, other
/// curves occupy the lanes, and the overlap of sections would cost more than the division gains.
const ALONE: usize = 128;

/// The approximate number of eight-byte numbers that the fit of a curve per lane occupies at a time.
pub fn memory(space: &Erased, nodes: usize, method: Method) -> f64 {
    let (nodes, m) = (nodes.min(LONG) as f64, space.dim() as f64);
    // Chords, velocities, residuals and steps at every node, and the history of Anderson mixing.
    let chain = LANES as f64 * (nodes * (20.0 * m + space.chord_len() as f64) + space.frame_len() as f64);
    let jacobian = match method {
        // `auto` skips solvers whose memory is not available.
        Method::Auto | Method::FixedPoint | Method::QuasiNewton => 0.0,
        Method::Newton | Method::Homotopy => LANES as f64 * (3.0 * nodes + 4.0) * m * m,
    };
    chain + jacobian + crate::rows::memory(space, None)
}

/// Whether the sections of a curve have been solved, and its points are so near each other that it is the only curve.
fn is_easy(space: &Erased, report: &Report) -> bool {
    report.status == Status::Converged && report.widest <= HALF_WAY * space.cut_angle()
}

/// Fits all curves of a problem. Velocities have the layout of the points; curves that cannot be fitted are NaN.
pub fn fit(
    space: &Erased,
    problem: &Problem,
    options: &Options,
    monitor: &Monitor,
    velocities: &mut [f64],
) -> Vec<Report> {
    let curves = problem.offsets.len() - 1;
    let mut reports = vec![Report::default(); curves];
    let mut longest_whole = if curves == 1 { ALONE } else { LONG };
    let (whole, mut rest): (Vec<usize>, Vec<usize>) =
        (0..curves).partition(|&c| problem.segments(c) <= longest_whole);
    fit_cut(space, problem, options, monitor, velocities, &whole, None, &mut reports);
    let mut overlap = OVERLAP;
    while !rest.is_empty() && !monitor.cancelled() {
        let cut = std::mem::take(&mut rest);
        rest = fit_cut(space, problem, options, monitor, velocities, &cut, Some(overlap), &mut reports);
        overlap *= 2;
        let longest = problem.segments(cut[0]);
        if longest_whole < longest
            && longest <= LONG
            && !(rest.is_empty() && is_easy(space, &reports[cut[0]]))
        {
            // No section is shorter than the curve. Only for a whole one, `auto` searches for further solutions.
            (longest_whole, overlap, rest) = (LONG, longest, cut);
        }
    }
    let len = space.point_len();
    for (curve, report) in reports.iter_mut().enumerate() {
        let own = &mut velocities[problem.offsets[curve] * len..problem.offsets[curve + 1] * len];
        if rounded::make_geodesic(space, problem, curve, report, own) && report.status == Status::Unconverged
        {
            (report.status, report.residual) = (Status::Converged, 0.0);
        }
        if report.status.is_fault() {
            own.fill(f64::NAN);
        } else if matches!(problem.ends, Ends::Periodic) && problem.segments(curve) > longest_whole {
            // Sections agree up to the tolerance; the first and the last velocity are equal.
            let transported = problem.across_closure(space, curve, &own[..len]);
            own[problem.segments(curve) * len..].copy_from_slice(&transported);
        }
        // Without an early end, the loop is compiled to SIMD instructions.
        let finite = own.iter().fold(true, |finite, u| finite & u.is_finite());
        if report.status == Status::Converged && !finite {
            // Points whose differences per unit of time exceed the largest floating-point number.
            (report.status, report.residual) = (Status::Unconverged, f64::INFINITY);
        }
        // A solver that stops close to a solution may have been stopped by rounding errors.
        let close = report.status == Status::Unconverged && report.residual <= rounded::MOST;
        if (report.status == Status::Converged || close)
            && let Some(missed) = rounded::missed(space, problem, curve, own, report.condition, options.tol)
        {
            if !(missed <= rounded::MOST.max(options.tol)) {
                (report.status, report.residual) = (Status::Imprecise, missed);
            } else if !close {
                report.residual = missed;
            }
        }
        if let (Some(injectivity), Status::Converged) = (options.certify, report.status) {
            let rounding = rounded::of_points(space, problem, curve);
            let found = report.bounds.certify(space.curvature(), injectivity, report.residual, rounding);
            [report.existence_radius, report.uniqueness_radius] = found.unwrap_or([f64::NAN; 2]);
        }
    }
    reports
}
