//! Curves with more conditions than one at either end: two conditions at an end, and velocities at inner points.
//!
//! An end with two conditions has an additional knot; see `joint`. A prescribed velocity at an inner point replaces the C²
//! condition there. The equations on both sides are then independent, so that each section between two such points is a
//! fit with prescribed end velocities. A closed curve is rotated to begin at the first of these points.

use super::curves::fit;
use super::joint::{BothRows, control_points};
use super::problem::{Both, End, Ends, Options, Problem, Report, Status};
use crate::curve::{Curves, Integrand, Outside, Quantity, Times, energies, evaluate};
use crate::monitor::Monitor;
use crate::scalar::{Lane, dot, lane};
use crate::space::{Ambient, Erased, Frame};

const THIRD: Lane = lane(1.0 / 3.0);
/// The relative error of the additional point up to which the acceleration counts as attained.
const ATTAINED: f64 = 1e-7;
/// The maximum number of rounds of [`EqualCurves::alternate`].
const MOST: usize = 60;
/// The relative tolerance of energies.
const ENERGY: f64 = 1e-13;

/// Prescribed velocities at an inner node, one per curve.
#[derive(Clone, Copy)]
pub struct InnerVelocities<'a> {
    /// The node.
    pub node: usize,
    /// The velocities.
    pub velocities: &'a [f64],
}

/// Curves with their additional points.
pub struct FittedCurves {
    /// All points of every curve.
    pub points: Vec<f64>,
    /// The velocities there.
    pub velocities: Vec<f64>,
    /// The reports, which count points with the additional ones.
    pub reports: Vec<Report>,
}

/// Fits curves of equal numbers of points with velocities at inner nodes, in their order. `knots` are those of the problem
/// with the additional ones.
pub fn fit_with_conditions(
    space: &Erased,
    problem: &Problem,
    knots: &[f64],
    inner: &[InnerVelocities],
    options: &Options,
    monitor: &Monitor,
) -> FittedCurves {
    if problem.offsets.len() < 2 {
        return FittedCurves { points: Vec::new(), velocities: Vec::new(), reports: Vec::new() };
    }
    let curves = EqualCurves { space, problem, knots, options, monitor };
    if inner.is_empty() { curves.fit() } else { curves.fit_sections(inner) }
}

/// Curves of equal numbers of points.
struct EqualCurves<'a> {
    space: &'a Erased<'a>,
    problem: &'a Problem<'a>,
    knots: &'a [f64],
    options: &'a Options,
    monitor: &'a Monitor<'a>,
}

impl EqualCurves<'_> {
    fn count(&self) -> usize {
        self.problem.offsets.len() - 1
    }

    /// The numbers of rows of knots.
    fn rows(&self) -> usize {
        if self.problem.shared { 1 } else { self.count() }
    }

    /// Nodes of a curve with the additional ones.
    fn nodes(&self) -> usize {
        self.knots.len() / self.rows()
    }

    /// The knots of a curve with the additional ones.
    fn knots(&self, curve: usize) -> &[f64] {
        if self.problem.shared { self.knots } else { &self.knots[curve * self.nodes()..][..self.nodes()] }
    }

    /// The number of additional nodes at either end: 0 or 1.
    fn added(&self) -> [usize; 2] {
        match &self.problem.ends {
            Ends::Open(ends) => [0, 1].map(|e| usize::from(matches!(ends[e], End::Both(_)))),
            Ends::Periodic => [0, 0],
        }
    }

    fn fit(&self) -> FittedCurves {
        match self.problem.ends {
            Ends::Open(ends) if self.added() != [0, 0] => {
                let other = (0..2).find(|&e| matches!(ends[e], End::NotAKnot));
                match other.filter(|_| self.problem.segments(0) <= 2) {
                    Some(other) => self.alternate(&ends, other),
                    None => {
                        let (points, first) = self.additional_points(&ends);
                        self.fit_all(&ends, points, &first)
                    }
                }
            }
            _ => {
                let points = self.problem.points.to_vec();
                let mut velocities = vec![0.0; points.len()];
                let reports = fit(self.space, self.problem, self.options, self.monitor, &mut velocities);
                FittedCurves { points, velocities, reports }
            }
        }
    }

    // ---- two conditions at an end ----

    /// The distance in time of the additional knot from an end.
    fn apart(&self, which: usize, curve: usize) -> f64 {
        let t = self.knots(curve);
        let last = t.len() - 1;
        if which == 0 { t[1] - t[0] } else { t[last] - t[last - 1] }
    }

    /// Fits the curves from one additional point to the other. Returns all points, and the reports of these fits.
    fn additional_points(&self, ends: &[End; 2]) -> (Vec<f64>, Vec<Report>) {
        let (problem, len) = (self.problem, self.space.point_len());
        let [start, end] = self.added();
        let t: Vec<f64> =
            (0..self.rows()).flat_map(|c| &self.knots(c)[start..self.nodes() - end]).copied().collect();
        let apart = [0, 1].map(|e| (0..self.count()).map(|c| self.apart(e, c)).collect::<Vec<f64>>());
        let ends = [0, 1].map(|e| match ends[e] {
            End::Both(both) => End::Both(Both { apart: &apart[e], ..both }),
            end => end,
        });
        let inner = Problem { t: &t, ends: Ends::Open(ends), ..*problem };
        let mut unknowns = vec![0.0; problem.points.len()];
        let reports = fit(self.space, &inner, self.options, self.monitor, &mut unknowns);
        let mut points = Vec::with_capacity(self.count() * self.nodes() * len);
        let lost = vec![f64::NAN; problem.points.len() / self.count()];
        for c in 0..self.count() {
            let all = problem.offsets[c] * len..problem.offsets[c + 1] * len;
            let (own, u, t) = (&problem.points[all.clone()], &unknowns[all], inner.knots(c));
            let last = own.len() - len;
            let u = if determines(&reports[c]) { u } else { &lost[..] };
            points.extend_from_slice(&own[..len]);
            if let End::Both(both) = ends[0] {
                let (p, next) = (&own[..len], &own[len..2 * len]);
                points.extend(self.additional_point(&both, c, 1.0, [p, next, &u[..len]], t[1] - t[0]));
            }
            points.extend_from_slice(&own[len..last]);
            if let End::Both(both) = ends[1] {
                let (p, next) = (&own[last..], &own[last - len..last]);
                let h = t[t.len() - 1] - t[t.len() - 2];
                points.extend(self.additional_point(&both, c, -1.0, [p, next, &u[last..]], h));
            }
            points.extend_from_slice(&own[last..]);
        }
        (points, reports)
    }

    /// The additional point beside the end p, for the unknown u there. Without a curve it is half way to the next point.
    fn additional_point(
        &self,
        both: &Both,
        curve: usize,
        sign: f64,
        [p, next, u]: [&[f64]; 3],
        h: f64,
    ) -> Vec<f64> {
        let (space, len) = (self.space, p.len());
        let (p, mut to, mut out) = (lanes(p), lanes(next), vec![Lane::ZERO; len]);
        let (from, share) = if u.iter().all(|x| x.is_finite()) {
            let handle: Vec<Lane> = u.iter().map(|u| lane(u * sign * h) * THIRD).collect();
            space.ray(&p, &handle, Lane::ONE, &mut to);
            let apart = both.apart[curve];
            (self.second_control_point(both, curve, apart, sign, &p), apart / (apart + h))
        } else {
            (p, 0.5)
        };
        space.geodesic(&from, &to, lane(share), &mut out);
        out.iter().map(|x| x.as_array()[0]).collect()
    }

    fn second_control_point(
        &self,
        both: &Both,
        curve: usize,
        apart: f64,
        sign: f64,
        p: &[Lane],
    ) -> Vec<Lane> {
        let vectors = &both.vectors[2 * curve * p.len()..][..2 * p.len()];
        let mut frame = vec![Lane::ZERO; self.space.frame_len()];
        self.space.lift(p, &mut frame);
        let ends = BothRows::of_one(vectors, apart);
        let [_, second] = control_points(self.space, (&frame, p), &ends, lane(sign));
        second
    }

    /// Fits the curves through all points with the prescribed velocities. `first` are the reports of the fits that
    /// determined the additional points.
    fn fit_all(&self, ends: &[End; 2], points: Vec<f64>, first: &[Report]) -> FittedCurves {
        let (len, start) = (self.space.point_len(), self.added()[0]);
        let offsets: Vec<usize> = (0..=self.count()).map(|c| c * self.nodes()).collect();
        let given = ends.map(|end| match end {
            End::Both(both) => both.vectors.chunks(2 * len).flat_map(|row| &row[..len]).copied().collect(),
            _ => Vec::new(),
        });
        let with_velocities = [0, 1].map(|e| match ends[e] {
            End::Both(_) => End::Velocity(&given[e]),
            end => end,
        });
        let shared = self.problem.shared;
        let ends_of_all = Ends::Open(with_velocities);
        let all = Problem { t: self.knots, shared, points: &points, offsets: &offsets, ends: ends_of_all };
        let mut velocities = vec![0.0; points.len()];
        let mut reports = fit(self.space, &all, self.options, self.monitor, &mut velocities);
        for (c, (report, first)) in reports.iter_mut().zip(first).enumerate() {
            report.iterations += first.iterations;
            if let Status::CutLocus { .. } = first.status {
                let row = offsets[c] * len..offsets[c + 1] * len;
                velocities[row].fill(f64::NAN);
                report.status = first.status.counted(|index| if index == 0 { 0 } else { index + start });
            } else if report.status == Status::Converged {
                let attained = determines(first) && self.attained(ends, c, &points, &velocities);
                report.status = if attained { Status::Converged } else { Status::Unattained };
            }
        }
        FittedCurves { points, velocities, reports }
    }

    /// Whether a curve has the accelerations, as a condition on the second control point.
    fn attained(&self, ends: &[End; 2], curve: usize, points: &[f64], velocities: &[f64]) -> bool {
        let (space, len, nodes) = (self.space, self.space.point_len(), self.nodes());
        let row = |all: &[f64], node: usize| lanes(&all[(curve * nodes + node) * len..][..len]);
        let distance = |p: &[Lane], q: &[Lane]| {
            let mut log = vec![Lane::ZERO; len];
            space.log(p, q, &mut log);
            dot(&log, &log).sqrt().as_array()[0]
        };
        (0..2).all(|e| {
            let End::Both(both) = ends[e] else { return true };
            let (node, next, sign) = if e == 0 { (0, 1, 1.0) } else { (nodes - 1, nodes - 2, -1.0) };
            let apart = self.apart(e, curve);
            let (p, q, third) = (row(points, node), row(points, next), lane(-sign * apart / 3.0));
            let wanted = self.second_control_point(&both, curve, apart, sign, &p);
            let mut found = vec![Lane::ZERO; len];
            space.ray(&q, &row(velocities, next), third, &mut found);
            let rounding = 1e-14 * dot(&p, &p).sqrt().as_array()[0];
            distance(&wanted, &found) <= ATTAINED * (distance(&p, &q) + rounding)
        })
    }

    /// Fits few points of which the other end is not-a-knot. That condition depends on the additional point, too. Fits with
    /// a prescribed velocity at the other end, which determine the additional point, and fits of all points, which determine
    /// that velocity, alternate; the steps are relaxed by Aitken's method (Irons & Tuck 1969).
    fn alternate(&self, ends: &[End; 2], other: usize) -> FittedCurves {
        let (len, nodes, count) = (self.space.point_len(), self.nodes(), self.count());
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut given = vec![0.0; count * len];
        let (mut before, mut factors) = (vec![0.0; count * len], vec![1.0; count]);
        let mut best = vec![f64::INFINITY; count];
        let mut round = 0;
        loop {
            let mut inner = *ends;
            inner[other] = if round == 0 { End::Natural } else { End::Velocity(&given) };
            let (points, first) = self.additional_points(&inner);
            let fitted = self.fit_all(ends, points, &first);
            let mut done = round > 0;
            for c in 0..count {
                let node = c * nodes + if other == 0 { 0 } else { nodes - 1 };
                let new = &fitted.velocities[node * len..(node + 1) * len];
                let own = c * len..(c + 1) * len;
                let step: Vec<f64> =
                    new.iter().zip(&given[own.clone()]).map(|(new, old)| new - old).collect();
                if round > 0 {
                    let size = product(&step, &step).sqrt();
                    done &= !(size > 1e-15 * product(new, new).sqrt() && size < best[c]);
                    best[c] = best[c].min(size);
                }
                if round > 1 {
                    let change: Vec<f64> =
                        step.iter().zip(&before[own.clone()]).map(|(s, b)| s - b).collect();
                    let factor = -product(&before[own.clone()], &change) / product(&change, &change);
                    factors[c] *= if factor.is_finite() { factor } else { 1.0 };
                }
                given[own.clone()].iter_mut().zip(&step).for_each(|(given, s)| *given += factors[c] * s);
                before[own].copy_from_slice(&step);
            }
            round += 1;
            if done || round == MOST || self.monitor.cancelled() {
                return fitted;
            }
        }
    }

    // ---- velocities at inner points ----

    fn fit_sections(&self, inner: &[InnerVelocities]) -> FittedCurves {
        let (problem, len, count) = (self.problem, self.space.point_len(), self.count());
        let (n, nodes, [start, end]) = (problem.offsets[1] - 1, self.nodes(), self.added());
        let closed = matches!(problem.ends, Ends::Periodic);
        let bounds: Vec<usize> = if closed {
            inner.iter().map(|i| i.node).chain([inner[0].node + n]).collect()
        } else {
            [0].into_iter().chain(inner.iter().map(|i| i.node)).chain([n]).collect()
        };
        // The node of the whole curve, with the additional ones.
        let node = |i: usize| if closed { i % n } else { i + if i == 0 { 0 } else { start } };
        let time = |t: &[f64], i: usize| if i > n { t[i - n] + (t[n] - t[0]) } else { t[i] };
        let mut out = FittedCurves {
            points: vec![0.0; count * nodes * len],
            velocities: vec![0.0; count * nodes * len],
            reports: Vec::new(),
        };
        let mut sections = Vec::new();
        for pair in bounds.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let given =
                |bound: usize, which: usize| match (problem.ends, inner.iter().find(|i| i.node == bound % n))
                {
                    (_, Some(inner)) => End::Velocity(inner.velocities),
                    (Ends::Open(ends), None) => ends[which],
                    (Ends::Periodic, None) => {
                        unreachable!("sections of a closed curve end at prescribed velocities")
                    }
                };
            let t: Vec<f64> =
                (0..self.rows()).flat_map(|c| (a..=b).map(move |i| time(problem.knots(c), i))).collect();
            let (from, to) = (node(a), if b == n { nodes - 1 } else { node(b) });
            let knots: Vec<f64> = if closed {
                t.clone()
            } else {
                (0..self.rows()).flat_map(|c| &self.knots(c)[from..=to]).copied().collect()
            };
            let points: Vec<f64> = (0..count)
                .flat_map(|c| (a..=b).map(move |i| problem.offsets[c] + if closed { i % n } else { i }))
                .flat_map(|row| &problem.points[row * len..(row + 1) * len])
                .copied()
                .collect();
            let offsets: Vec<usize> = (0..=count).map(|c| c * (b - a + 1)).collect();
            let ends = Ends::Open([given(a, 0), given(b, 1)]);
            let part = Problem { t: &t, shared: problem.shared, points: &points, offsets: &offsets, ends };
            let found = EqualCurves { problem: &part, knots: &knots, ..*self }.fit();
            let size = knots.len() / self.rows();
            for c in 0..count {
                for i in 0..size {
                    let to = c * nodes + if closed { (from + i) % n } else { from + i };
                    for (out, found) in
                        [(&mut out.points, &found.points), (&mut out.velocities, &found.velocities)]
                    {
                        out[to * len..(to + 1) * len]
                            .copy_from_slice(&found[(c * size + i) * len..(c * size + i + 1) * len]);
                    }
                }
            }
            sections.push((found, knots, from));
        }
        for c in 0..count {
            let row = c * nodes * len..(c + 1) * nodes * len;
            for all in [&mut out.points[row.clone()], &mut out.velocities[row]] {
                if closed {
                    all.copy_within(..len, n * len);
                }
                if all.iter().any(|x| x.is_nan()) {
                    all.fill(f64::NAN);
                }
            }
            let counted = |index: usize, from: usize| if closed { (from + index) % n } else { from + index };
            let reports = sections.iter().map(|(found, _, from)| {
                let report = found.reports[c];
                Report {
                    status: report.status.counted(|index| counted(index, *from)),
                    almost_cut: report.almost_cut.map(|(index, angle)| (counted(index, *from), angle)),
                    ..report
                }
            });
            let mut report = reports.reduce(Report::joined).expect("there are at least two sections");
            report.alternative = self.alternative(&sections, c);
            out.reports.push(report);
        }
        debug_assert_eq!(end + start + n + 1, nodes);
        out
    }

    /// The lowest energy of a curve of which one section is replaced by its alternative; NaN without one.
    fn alternative(&self, sections: &[(FittedCurves, Vec<f64>, usize)], curve: usize) -> f64 {
        let alternative = |(found, ..): &(FittedCurves, Vec<f64>, usize)| found.reports[curve].alternative;
        if sections.iter().all(|section| alternative(section).is_nan()) {
            return f64::NAN;
        }
        let bends: Vec<f64> = sections
            .iter()
            .map(|(found, knots, _)| {
                let nodes = knots.len() / self.rows();
                let row =
                    curve * nodes * self.space.point_len()..(curve + 1) * nodes * self.space.point_len();
                let t = if self.problem.shared { knots } else { &knots[curve * nodes..(curve + 1) * nodes] };
                let (points, velocities) = (&found.points[row.clone()], &found.velocities[row]);
                let curves = Curves { t, nodes, points, velocities, before: &[] };
                let mut bend = Bend { space: self.space, curves, monitor: self.monitor };
                energies(t, 1, ENERGY, &mut bend).map_or(f64::NAN, |energy| energy[0])
            })
            .collect();
        let whole: f64 = bends.iter().sum();
        sections
            .iter()
            .zip(&bends)
            .fold(f64::NAN, |least, (section, bend)| least.min(whole - bend + alternative(section)))
    }
}

/// Whether a fit determines the additional points accurately enough.
fn determines(report: &Report) -> bool {
    match report.status {
        Status::Converged => true,
        Status::Unconverged | Status::Imprecise => report.residual <= ATTAINED,
        _ => false,
    }
}

/// The same numbers in all lanes.
fn lanes(row: &[f64]) -> Vec<Lane> {
    row.iter().map(|x| lane(*x)).collect()
}

/// The norm of the acceleration of a curve.
struct Bend<'a> {
    space: &'a Erased<'a>,
    curves: Curves<'a>,
    monitor: &'a Monitor<'a>,
}

impl Integrand for Bend<'_> {
    type Error = ();

    fn at(&mut self, times: Times, values: &mut [f64]) -> Result<(), ()> {
        let (quantity, outside) = (Quantity::AccelerationNorm, Outside::Continue);
        evaluate(self.space, &self.curves, &times, quantity, outside, self.monitor, values);
        if self.monitor.poll() { Err(()) } else { Ok(()) }
    }
}
