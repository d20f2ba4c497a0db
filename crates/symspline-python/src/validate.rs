//! What every call checks before any work is done.

use crate::errors::{invalid, number, place};
use crate::space::off_space;
use pyo3::prelude::*;
use symspline::fit::{End, Ends, Problem};
use symspline::monitor::Monitor;
use symspline::rows::{Operation, apply, leg_angle, project_points, tangent_defects};
use symspline::space::{Ambient, Erased};

/// Where a curve stands in a batch, for messages; nothing for a single curve.
pub fn of_curve(curve: usize, batch: &[usize]) -> String {
    if batch.is_empty() { String::new() } else { format!(" of curve {}", place(curve, batch)) }
}

/// Knots must be finite and increasing.
pub fn knots(t: &[f64], curve: usize, batch: &[usize]) -> PyResult<()> {
    let of = if batch.is_empty() { String::new() } else { format!("[{}]", place(curve, batch)) };
    if let Some(i) = t.iter().position(|x| !x.is_finite()) {
        return Err(invalid(format!("t{of}[{i}] is {}; times must be finite", number(t[i]))));
    }
    if let Some(i) = (1..t.len()).find(|&i| t[i] <= t[i - 1]) {
        let (a, b) = (t[i - 1], t[i]);
        let hint = if a == b {
            "remove one of two points with the same time, or give them different times"
        } else {
            "sort times and points together, e.g. order = np.argsort(t)"
        };
        let what = if a == b { "repeats" } else { "is before" };
        return Err(invalid(format!(
            "t{of}[{i}] = {} {what} t{of}[{}] = {}; times must increase: {hint}",
            number(b),
            i - 1,
            number(a)
        )));
    }
    if !(t[t.len() - 1] - t[0]).is_finite() {
        return Err(invalid(format!("t{of} spans more than a double can hold")));
    }
    Ok(())
}

/// Points are projected in place, or the first that is off the space is named.
pub fn points(
    space: &Erased,
    points: &mut [f64],
    offsets: &[usize],
    batch: &[usize],
    tol: f64,
) -> PyResult<()> {
    let which = |row: usize| {
        let curve = offsets.partition_point(|&o| o <= row) - 1;
        format!("points[{}]{}", row - offsets[curve], of_curve(curve, batch))
    };
    project_points(space, points, tol).map_err(|(row, off, why)| off_space(&which(row), off, tol, &why))?;
    if let Some((row, why)) = space.beyond_doubles(points) {
        return Err(invalid(format!("{} {why}", which(row))));
    }
    if !space.is_connected() {
        one_component(space, points, offsets, batch)?;
    }
    Ok(())
}

/// Neighbours must lie in the same part of a space that has two.
fn one_component(space: &Erased, points: &[f64], offsets: &[usize], batch: &[usize]) -> PyResult<()> {
    let len = space.point_len();
    for (curve, ends) in offsets.windows(2).enumerate() {
        let part = |i: usize| space.component(&points[i * len..(i + 1) * len]);
        if let Some(i) = (ends[0] + 1..ends[1]).find(|&i| part(i) != part(i - 1)) {
            let i = i - ends[0];
            return Err(invalid(format!(
                "points[{}] and points[{i}]{} have opposite determinants: no curve joins them",
                i - 1,
                of_curve(curve, batch)
            )));
        }
    }
    Ok(())
}

/// Closed curves must be closed. What is left between last and first point goes: the last array becomes one of
/// the first point.
pub fn closed(
    space: &Erased,
    points: &mut [f64],
    offsets: &[usize],
    batch: &[usize],
    tol: f64,
) -> PyResult<()> {
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
            return Err(invalid(format!(
                "bc_type='periodic' needs a closed curve, but first and last point{} are {:.3e} apart \
                 (allowed: {tol:.0e}); repeat the first point at the end",
                of_curve(c, batch),
                distance[0]
            )));
        }
        let _ = apply(space, Operation::Log, &[last, &first], &[], &monitor, &mut way);
        let from = last.to_vec();
        let _ = apply(space, Operation::Exp, &[&from, &way], &[], &monitor, last);
    }
    Ok(())
}

/// End vectors must be tangent and velocities not too fast.
pub fn ends(space: &Erased, problem: &Problem, batch: &[usize], tol: f64) -> PyResult<()> {
    let len = space.point_len();
    let curves = problem.offsets.len() - 1;
    let mut first = Vec::with_capacity(curves * len);
    let mut last = Vec::with_capacity(curves * len);
    for c in 0..curves {
        let (from, to) = (problem.offsets[c] * len, problem.offsets[c + 1] * len);
        first.extend_from_slice(&problem.points[from..from + len]);
        last.extend_from_slice(&problem.points[to - len..to]);
    }
    let quiet = |_| true;
    let monitor = Monitor::new(&quiet);
    let Ends::Open(ends) = problem.ends else { return Ok(()) };
    for (e, end) in ends.iter().enumerate() {
        let (name, p) = if e == 0 { ("start", &first) } else { ("end", &last) };
        let (order, v) = match end {
            End::Velocity(v) => ("velocity", v),
            End::Acceleration(v) => ("acceleration", v),
            End::Natural | End::NotAKnot => continue,
        };
        if let Some(i) = v.iter().position(|x| !x.is_finite()) {
            let of = of_curve(i / len, batch);
            return Err(invalid(format!("the {name} {order}{of} holds {}; it must be finite", number(v[i]))));
        }
        // In units of the segment, so that a vector as small as the rounding of the points passes.
        let mut scaled = v.to_vec();
        for (c, v) in scaled.chunks_exact_mut(len).enumerate() {
            let h = end_segment(problem, c, e);
            let scale = if order == "velocity" { 1.0 } else { h };
            v.iter_mut().for_each(|x| *x = *x * h * scale);
        }
        let defects = tangent_defects(space, p, &scaled);
        if let Some(c) = defects.iter().position(|d| !(*d <= tol)) {
            return Err(invalid(format!(
                "the {name} {order}{} is not tangent at its point: a part of {:.3e} of it points off the space \
                 (allowed: {tol:.0e}); use space.project_tangent(p, v)",
                of_curve(c, batch),
                defects[c]
            )));
        }
        if order == "velocity" && space.cut_angle().is_finite() {
            // The control leg h u/3, by its deciding angle.
            for (c, v) in scaled.chunks_exact_mut(len).enumerate() {
                v.iter_mut().for_each(|x| *x /= 3.0);
                let angle = leg_angle(space, &p[c * len..(c + 1) * len], v);
                if angle >= space.longest_leg() {
                    let mut square = [0.0];
                    let (p, v) = (&p[c * len..(c + 1) * len], &*v);
                    let _ = apply(space, Operation::Inner, &[p, v, v], &[], &monitor, &mut square);
                    let h = end_segment(problem, c, e);
                    let speed = 3.0 * square[0].sqrt() / h;
                    return Err(invalid(format!(
                        "the {name} velocity{} has speed {speed:.6}, too fast for its segment of length {}: its \
                         control leg would pass the cut locus, angle {angle:.6} of {:.6}; in this direction the \
                         speed must stay below {:.6}",
                        of_curve(c, batch),
                        number(h),
                        space.longest_leg(),
                        speed * space.longest_leg() / angle,
                    )));
                }
            }
        }
    }
    Ok(())
}

/// Length of the first or last segment.
fn end_segment(problem: &Problem, curve: usize, end: usize) -> f64 {
    let t = problem.knots(curve);
    if end == 0 { t[1] - t[0] } else { t[t.len() - 1] - t[t.len() - 2] }
}
