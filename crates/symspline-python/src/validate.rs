//! What every call checks before any work is done.

use crate::errors::{Invalid, number, place};
use crate::space::off_space;
use symspline::fit::{End, Ends, Problem};
use symspline::monitor::Monitor;
use symspline::rows::{Operation, apply, handle_angle, project_points, tangent_defects};
use symspline::space::{Ambient, Erased};

/// Names of curves in messages: their indices in the batch of the user, of which they may be a part.
pub struct Names<'a> {
    pub batch: &'a [usize],
    /// Their numbers; None for the whole batch.
    pub chosen: Option<&'a [usize]>,
}

impl Names<'_> {
    /// The number of a curve in the batch.
    pub fn number(&self, curve: usize) -> usize {
        self.chosen.map_or(curve, |chosen| chosen[curve])
    }

    /// Words for a curve; empty for a single curve.
    pub fn of(&self, curve: usize) -> String {
        of_curve(self.number(curve), self.batch)
    }

    fn fault(&self, curve: usize, node: impl Into<Option<usize>>, message: String) -> Invalid {
        Invalid::new(self.number(curve), node.into(), message)
    }
}

/// Where a curve stands in a batch, for messages; nothing for a single curve.
pub fn of_curve(curve: usize, batch: &[usize]) -> String {
    if batch.is_empty() { String::new() } else { format!(" of curve {}", place(curve, batch)) }
}

type Checked = Result<(), Invalid>;

/// Knots must be finite and increasing; they are those of one curve, or, if `shared`, of all.
pub fn knots(t: &[f64], curve: usize, names: &Names, shared: bool) -> Checked {
    let of = if shared || names.batch.is_empty() {
        String::new()
    } else {
        format!("[{}]", place(names.number(curve), names.batch))
    };
    let fault = |node, message| Err(names.fault(curve, node, message));
    if let Some(i) = t.iter().position(|x| !x.is_finite()) {
        return fault(Some(i), format!("t{of}[{i}] is {}; times must be finite", number(t[i])));
    }
    if let Some(i) = (1..t.len()).find(|&i| t[i] <= t[i - 1]) {
        let (a, b) = (t[i - 1], t[i]);
        let hint = if a == b {
            "remove one of two points with the same time, or give them different times"
        } else {
            "sort times and points together, e.g. order = np.argsort(t)"
        };
        let what = if a == b { "repeats" } else { "is before" };
        let (earlier, later) = (number(a), number(b));
        let before = i - 1;
        return fault(
            Some(i),
            format!("t{of}[{i}] = {later} {what} t{of}[{before}] = {earlier}; times must increase: {hint}"),
        );
    }
    if !(t[t.len() - 1] - t[0]).is_finite() {
        return fault(None, format!("t{of} spans more than a double can hold"));
    }
    Ok(())
}

/// Points are projected in place, or the first that is off the space is named.
pub fn points(space: &Erased, points: &mut [f64], offsets: &[usize], names: &Names, tol: f64) -> Checked {
    let fault = |row: usize, message: &dyn Fn(&str) -> String| {
        let curve = offsets.partition_point(|&o| o <= row) - 1;
        let node = row - offsets[curve];
        names.fault(curve, node, message(&format!("points[{node}]{}", names.of(curve))))
    };
    project_points(space, points, tol)
        .map_err(|(row, off, why)| fault(row, &|which| off_space(which, off, tol, &why)))?;
    if let Some((row, why)) = space.beyond_doubles(points) {
        return Err(fault(row, &|which| format!("{which} {why}")));
    }
    if !space.is_connected() {
        one_component(space, points, offsets, names)?;
    }
    Ok(())
}

/// Neighbours must lie in the same part of a space that has two.
fn one_component(space: &Erased, points: &[f64], offsets: &[usize], names: &Names) -> Checked {
    let len = space.point_len();
    for (curve, ends) in offsets.windows(2).enumerate() {
        let part = |i: usize| space.component(&points[i * len..(i + 1) * len]);
        if let Some(i) = (ends[0] + 1..ends[1]).find(|&i| part(i) != part(i - 1)) {
            let i = i - ends[0];
            let (before, of) = (i - 1, names.of(curve));
            let message = format!(
                "points[{before}] and points[{i}]{of} have opposite determinants: no curve joins them"
            );
            return Err(names.fault(curve, before, message));
        }
    }
    Ok(())
}

/// Closed curves must be closed. What is left between last and first point goes: the last array becomes one of
/// the first point.
pub fn closed(space: &Erased, points: &mut [f64], offsets: &[usize], names: &Names, tol: f64) -> Checked {
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
            let message = format!(
                "bc_type='periodic' needs a closed curve, but first and last point{} are {:.3e} apart \
                 (allowed: {tol:.0e}); repeat the first point at the end",
                names.of(c),
                distance[0]
            );
            return Err(names.fault(c, ends[1] - ends[0] - 1, message));
        }
        let _ = apply(space, Operation::Log, &[last, &first], &[], &monitor, &mut way);
        let from = last.to_vec();
        let _ = apply(space, Operation::Exp, &[&from, &way], &[], &monitor, last);
    }
    Ok(())
}

/// End vectors must be tangent and velocities not too fast.
pub fn ends(space: &Erased, problem: &Problem, names: &Names, tol: f64) -> Checked {
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
            let (of, value) = (names.of(i / len), number(v[i]));
            let message = format!("the {name} {order}{of} holds {value}; it must be finite");
            return Err(names.fault(i / len, None, message));
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
            let message = format!(
                "the {name} {order}{} is not tangent at its point: a part of {:.3e} of it points off the space \
                 (allowed: {tol:.0e}); use space.project_tangent(p, v)",
                names.of(c),
                defects[c]
            );
            return Err(names.fault(c, None, message));
        }
        if order == "velocity" && space.cut_angle().is_finite() {
            // The control leg h u/3, by its deciding angle.
            for (c, v) in scaled.chunks_exact_mut(len).enumerate() {
                v.iter_mut().for_each(|x| *x /= 3.0);
                let angle = handle_angle(space, &p[c * len..(c + 1) * len], v);
                if angle >= space.longest_handle() {
                    let mut square = [0.0];
                    let (p, v) = (&p[c * len..(c + 1) * len], &*v);
                    let _ = apply(space, Operation::Inner, &[p, v, v], &[], &monitor, &mut square);
                    let h = end_segment(problem, c, e);
                    let speed = 3.0 * square[0].sqrt() / h;
                    let message = format!(
                        "the {name} velocity{} has speed {speed:.6}, too fast for its segment of length {}: its \
                         control leg would pass the cut locus, angle {angle:.6} of {:.6}; in this direction the \
                         speed must stay below {:.6}",
                        names.of(c),
                        number(h),
                        space.longest_handle(),
                        speed * space.longest_handle() / angle,
                    );
                    return Err(names.fault(c, None, message));
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
