//! Validation of curves before a fit: knots, points, closure and end vectors.

use crate::fit::{Ends, Problem};
use crate::monitor::Monitor;
use crate::rows::{Operation, apply, handle_angle, project_points, tangent_defects};
use crate::space::{Ambient, Erased};
use std::fmt;

/// Input that does not meet the requirements of [`fit`](crate::fit::fit).
#[derive(Clone, Debug, PartialEq)]
pub struct Invalid {
    /// The curve, counted from 0.
    pub curve: usize,
    /// The node of the curve; `None` if the problem is not at one node.
    pub node: Option<usize>,
    /// What the problem is.
    pub reason: Reason,
}

/// Why input is invalid.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// Knots, points, offsets or end vectors have inconsistent lengths.
    Lengths(&'static str),
    /// A time is not finite.
    TimeNotFinite(f64),
    /// A time is not after the one before it.
    TimesNotIncreasing {
        /// The time of the node before.
        before: f64,
        /// The time of the node.
        time: f64,
    },
    /// The difference of the last and the first time overflows.
    TimesTooFarApart,
    /// A point is off the space.
    OffSpace {
        /// The distance, relative to the size of the point; not finite if no point of the space is close to it.
        distance: f64,
        /// The condition that the point violates.
        condition: String,
    },
    /// Floating-point numbers represent the point with too few significant digits.
    TooFewDigits(String),
    /// The node and the next one lie in different components of the space.
    Disconnected,
    /// A closed curve does not end at its first point.
    NotClosed {
        /// The distance of the two points.
        distance: f64,
    },
    /// A prescribed end vector is not finite.
    EndNotFinite(Which, f64),
    /// A prescribed end vector is not tangent at its point.
    EndNotTangent {
        /// Which vector.
        which: Which,
        /// Its normal component, relative to its length.
        normal: f64,
    },
    /// A prescribed velocity is too fast for its segment: the control handle would pass the cut locus.
    EndTooFast {
        /// Which vector.
        which: Which,
        /// Its length.
        speed: f64,
        /// The length of the segment.
        segment: f64,
        /// The deciding angle of the control handle.
        angle: f64,
        /// The angle that it must not reach.
        limit: f64,
    },
}

/// A vector that is prescribed at an end of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Which {
    /// Whether it belongs to the first point.
    pub start: bool,
    /// Whether it is a velocity; otherwise it is a covariant acceleration.
    pub velocity: bool,
}

impl fmt::Display for Which {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let end = if self.start { "start" } else { "end" };
        write!(f, "the {end} {}", if self.velocity { "velocity" } else { "acceleration" })
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Reason::Lengths(what) => write!(f, "{what}"),
            Reason::TimeNotFinite(time) => write!(f, "its time is {time}, but times must be finite"),
            Reason::TimesNotIncreasing { before, time } => {
                write!(f, "its time {time} is not after the time {before} of the node before")
            }
            Reason::TimesTooFarApart => {
                write!(f, "its times span more than the largest floating-point number")
            }
            Reason::OffSpace { distance, condition } => {
                write!(f, "the point is off the space by {distance:.3e}: {condition}")
            }
            Reason::TooFewDigits(why) => write!(f, "the point {why}"),
            Reason::Disconnected => {
                write!(f, "this point and the next one lie in different components of the space")
            }
            Reason::NotClosed { distance } => {
                write!(f, "first and last point of a closed curve are {distance:.3e} apart")
            }
            Reason::EndNotFinite(which, value) => write!(f, "{which} contains {value}; it must be finite"),
            Reason::EndNotTangent { which, normal } => {
                write!(f, "{which} is not tangent at its point: its normal component is {normal:.3e}")
            }
            Reason::EndTooFast { which, speed, segment, angle, limit } => write!(
                f,
                "{which} has speed {speed:.6}, too fast for its segment of length {segment}: its control handle \
                 would pass the cut locus, angle {angle:.6} of {limit:.6}"
            ),
        }
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "curve {}", self.curve)?;
        if let Some(node) = self.node {
            write!(f, ", node {node}")?;
        }
        write!(f, ": {}", self.reason)
    }
}

impl std::error::Error for Invalid {}

fn fault<T>(curve: usize, node: impl Into<Option<usize>>, reason: Reason) -> Result<T, Invalid> {
    Err(Invalid { curve, node: node.into(), reason })
}

/// Validates a problem and returns its points, projected onto the space. The last point of a closed curve is replaced
/// by another array of the first.
///
/// The distance of points from the space, relative to their size, and the normal component of end vectors may be at
/// most `tol`.
///
/// # Errors
/// The first fault that is found, in the order of knots, points, closure, ends.
pub fn validate(space: &Erased, problem: &Problem, tol: f64) -> Result<Vec<f64>, Invalid> {
    lengths(space, problem)?;
    let mut own = problem.points.to_vec();
    let curves = problem.offsets.len() - 1;
    (0..if problem.shared { curves.min(1) } else { curves }).try_for_each(|c| knots(problem.knots(c), c))?;
    points(space, &mut own, problem.offsets, tol)?;
    if matches!(problem.ends, Ends::Periodic) {
        closed(space, &mut own, problem.offsets, tol)?;
    }
    ends(space, &Problem { points: &own, ..*problem }, tol)?;
    Ok(own)
}

/// Knots, points, offsets and end vectors must have consistent lengths.
fn lengths(space: &Erased, problem: &Problem) -> Result<(), Invalid> {
    let (len, offsets) = (space.point_len(), problem.offsets);
    let wrong = |curve, what| fault(curve, None, Reason::Lengths(what));
    let (Some(&first), Some(&nodes)) = (offsets.first(), offsets.last()) else {
        return wrong(0, "offsets are empty; they begin with 0 and end with the number of nodes");
    };
    if first != 0 || nodes.checked_mul(len) != Some(problem.points.len()) {
        return wrong(0, "offsets must begin with 0 and end with the number of points");
    }
    if let Some(c) = offsets.windows(2).position(|pair| pair[1] < pair[0].saturating_add(2)) {
        return wrong(c, "a curve needs at least two points");
    }
    if problem.shared {
        if let Some(c) = offsets.windows(2).position(|pair| pair[1] - pair[0] != problem.t.len()) {
            return wrong(c, "the curve does not have as many points as there are shared knots");
        }
    } else if problem.t.len() != nodes {
        return wrong(0, "there must be one knot per point");
    }
    if let Ends::Open(ends) = problem.ends
        && ends.iter().any(|end| end.vectors(len).iter().any(|(_, v)| v.len() != (offsets.len() - 1) * len))
    {
        return wrong(0, "end vectors must have one row per curve");
    }
    Ok(())
}

/// Validates the knots of a curve: they must be finite and increase.
///
/// # Errors
/// The first fault.
pub fn knots(t: &[f64], curve: usize) -> Result<(), Invalid> {
    if let Some(i) = t.iter().position(|x| !x.is_finite()) {
        return fault(curve, i, Reason::TimeNotFinite(t[i]));
    }
    if let Some(i) = (1..t.len()).find(|&i| t[i] <= t[i - 1]) {
        return fault(curve, i, Reason::TimesNotIncreasing { before: t[i - 1], time: t[i] });
    }
    if !(t[t.len() - 1] - t[0]).is_finite() {
        return fault(curve, None, Reason::TimesTooFarApart);
    }
    Ok(())
}

/// Validates the points of curves and projects them onto the space.
///
/// # Errors
/// The first point that is off the space, in another component than the one before it, or that floating-point numbers
/// represent too coarsely.
pub fn points(space: &Erased, points: &mut [f64], offsets: &[usize], tol: f64) -> Result<(), Invalid> {
    let at = |row: usize, reason| {
        let curve = offsets.partition_point(|&o| o <= row) - 1;
        fault(curve, row - offsets[curve], reason)
    };
    if let Err((row, distance, condition)) = project_points(space, points, tol) {
        return at(row, Reason::OffSpace { distance, condition });
    }
    if let Some((row, why)) = space.imprecise_point(points) {
        return at(row, Reason::TooFewDigits(why));
    }
    if space.is_connected() {
        return Ok(());
    }
    let len = space.point_len();
    let component = |i: usize| space.component(&points[i * len..(i + 1) * len]);
    offsets.windows(2).try_for_each(|ends| {
        (ends[0] + 1..ends[1])
            .find(|&i| component(i) != component(i - 1))
            .map_or(Ok(()), |i| at(i - 1, Reason::Disconnected))
    })
}

/// Validates that curves are closed. The last array of each curve is replaced by one of its first point, without the
/// distance between them.
///
/// # Errors
/// The first curve whose ends are more than `tol` apart.
pub fn closed(space: &Erased, points: &mut [f64], offsets: &[usize], tol: f64) -> Result<(), Invalid> {
    let len = space.point_len();
    let quiet = |_| true;
    let monitor = Monitor::new(&quiet);
    for (c, ends) in offsets.windows(2).enumerate() {
        let first = points[ends[0] * len..(ends[0] + 1) * len].to_vec();
        let last = &mut points[(ends[1] - 1) * len..ends[1] * len];
        if first == *last {
            continue;
        }
        let (mut distance, mut way) = ([0.0], vec![0.0; len]);
        let _ = apply(space, Operation::Distance, &[&first, last], &[], &monitor, &mut distance);
        if !(distance[0] <= tol) {
            return fault(c, ends[1] - ends[0] - 1, Reason::NotClosed { distance: distance[0] });
        }
        let _ = apply(space, Operation::Log, &[last, &first], &[], &monitor, &mut way);
        let from = last.to_vec();
        let _ = apply(space, Operation::Exp, &[&from, &way], &[], &monitor, last);
    }
    Ok(())
}

/// Validates that end vectors are finite and tangent, and velocities not too fast.
///
/// # Errors
/// The first fault.
pub fn ends(space: &Erased, problem: &Problem, tol: f64) -> Result<(), Invalid> {
    let Ends::Open(ends) = problem.ends else { return Ok(()) };
    let len = space.point_len();
    let quiet = |_| true;
    let monitor = Monitor::new(&quiet);
    for (e, end) in ends.iter().enumerate() {
        for (velocity, v) in end.vectors(len) {
            let which = Which { start: e == 0, velocity };
            if let Some(i) = v.iter().position(|x| !x.is_finite()) {
                return fault(i / len, None, Reason::EndNotFinite(which, v[i]));
            }
            let node = |pair: &[usize]| if which.start { pair[0] } else { pair[1] - 1 };
            let p: Vec<f64> = problem
                .offsets
                .windows(2)
                .flat_map(|pair| &problem.points[node(pair) * len..(node(pair) + 1) * len])
                .copied()
                .collect();
            // In units of the segment, so that a vector as small as the rounding of the points passes.
            let mut scaled = v.to_vec();
            for (c, v) in scaled.chunks_exact_mut(len).enumerate() {
                let h = end_segment(problem, c, which);
                let scale = if which.velocity { 1.0 } else { h };
                v.iter_mut().for_each(|x| *x = *x * h * scale);
            }
            let defects = tangent_defects(space, &p, &scaled);
            if let Some(c) = defects.iter().position(|d| !(*d <= tol)) {
                return fault(c, None, Reason::EndNotTangent { which, normal: defects[c] });
            }
            if !which.velocity || !space.cut_angle().is_finite() {
                continue;
            }
            // The control handle h u/3, by its deciding angle.
            for (c, v) in scaled.chunks_exact_mut(len).enumerate() {
                v.iter_mut().for_each(|x| *x /= 3.0);
                let (p, limit) = (&p[c * len..(c + 1) * len], space.longest_handle());
                let angle = handle_angle(space, p, v);
                if angle >= limit {
                    let mut square = [0.0];
                    let _ = apply(space, Operation::Inner, &[p, &*v, &*v], &[], &monitor, &mut square);
                    let segment = end_segment(problem, c, which);
                    let speed = 3.0 * square[0].sqrt() / segment;
                    return fault(c, None, Reason::EndTooFast { which, speed, segment, angle, limit });
                }
            }
        }
    }
    Ok(())
}

/// Length of the first or last segment.
fn end_segment(problem: &Problem, curve: usize, which: Which) -> f64 {
    let t = problem.knots(curve);
    if which.start { t[1] - t[0] } else { t[t.len() - 1] - t[t.len() - 2] }
}
