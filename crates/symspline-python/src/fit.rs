//! Fitting, called from Python.

use crate::arrays::{in_order, require_room, room, zeros};
use crate::errors::invalid;
use crate::space::Handle;
use crate::validate;
use crate::watch::{is_heavy, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline::fit::{End, Ends, Method, Options, Problem, Report, Solver, Status, fit as solve, memory};
use symspline::space::Ambient;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
/// A kind, and the vectors that it prescribes: one a curve.
pub type EndOf<'py> = (String, Option<Array<'py>>);

/// What a fit gives back: points on the space, velocities, the columns of the report, and per failed
/// curve (index, kind, message).
type Fitted<'py> = (
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Columns<'py>,
    Vec<(usize, &'static str, String)>,
);

/// Fits curves. `points` are contiguous with the point's numbers last; `offsets` are the nodes before
/// each curve when they differ in length (then `points` is one long list of points). A dry run only
/// validates.
#[pyfunction]
#[pyo3(signature = (handle, t, points, ends, method, tol, max_iter, check, point_tol, offsets=None, progress=None, dry=false))]
pub fn fit<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    ends: Option<[EndOf<'py>; 2]>,
    method: &str,
    tol: f64,
    max_iter: Option<usize>,
    check: bool,
    point_tol: f64,
    offsets: Option<Vec<usize>>,
    progress: Option<Py<PyAny>>,
    dry: bool,
) -> PyResult<Fitted<'py>> {
    let name = method;
    let method = match method {
        "auto" => Method::Auto,
        "fixed-point" => Method::FixedPoint,
        "quasi-newton" => Method::QuasiNewton,
        "newton" => Method::Newton,
        "homotopy" => Method::Homotopy,
        _ => {
            return Err(invalid(format!(
                "method must be 'auto', 'fixed-point', 'quasi-newton', 'newton' or 'homotopy', not {method:?}"
            )));
        }
    };
    if !(tol >= 0.0 && tol.is_finite()) {
        return Err(invalid(format!("tol must be a number >= 0, not {tol}")));
    }
    if max_iter == Some(0) {
        return Err(invalid("max_iter must be at least 1"));
    }
    let options = Options { method, tol, max_iter };
    let len = handle.space.get().point_len();
    let nodes = points.len() / len;
    let t_slice = in_order(&t)?;
    let different = offsets.is_some();
    let (offsets, shared) = match offsets {
        Some(offsets) => (offsets, false),
        None => {
            let n = t.shape()[t.ndim() - 1];
            ((0..=nodes / n).map(|c| c * n).collect(), t.ndim() == 1)
        }
    };
    let curves = offsets.len() - 1;
    let lead = points.ndim() - handle.point_axes() - 1;
    let batch = if different { vec![curves] } else { points.shape()[..lead].to_vec() };

    // What the work itself needs, with some to spare: copies of ends, and the pieces and reports of curves.
    drop(room::<f64>(nodes + curves * (64 + 4 * len))?);
    let longest = offsets.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
    if !dry {
        require_room(memory(&handle.space.get(), longest, method), || {
            let least = match method {
                Method::Newton | Method::Homotopy => "; method='quasi-newton' needs far less",
                _ => "",
            };
            (format!("fitting {longest} points on {} with method='{name}'", handle.described()), least)
        })?;
    }
    let out = zeros(py, points.shape())?;
    let velocities = zeros(py, points.shape())?;
    let (mut out_write, mut velocities_write) = (out.readwrite(), velocities.readwrite());
    let (p, u) = (out_write.as_slice_mut()?, velocities_write.as_slice_mut()?);
    p.copy_from_slice(in_order(&points)?);

    if check {
        let count = if shared { 1 } else { curves };
        for c in 0..count {
            let t = if shared { t_slice } else { &t_slice[offsets[c]..offsets[c + 1]] };
            validate::knots(t, c, if shared { &[] } else { &batch })?;
        }
        py.detach(|| validate::points(&handle.space.get(), p, &offsets, &batch, point_tol))?;
        if ends.is_none() {
            py.detach(|| validate::closed(&handle.space.get(), p, &offsets, &batch, point_tol))?;
        }
    }
    let ends_now = match &ends {
        None => Ends::Periodic,
        Some([a, b]) => Ends::Open([end(a)?, end(b)?]),
    };
    let problem = Problem { t: t_slice, shared, points: p, offsets: &offsets, ends: ends_now };
    if check {
        py.detach(|| validate::ends(&handle.space.get(), &problem, &batch, point_tol))?;
    }
    if dry {
        drop((out_write, velocities_write));
        return Ok((out, velocities, columns(py, &[])?, Vec::new()));
    }
    let reports = watched(py, progress, nodes, is_heavy(&handle.space.get()), |monitor| {
        solve(&handle.space.get(), &problem, &options, monitor, u)
    })?;
    let faults = faults(handle, &options, &reports, &batch);
    drop((out_write, velocities_write));
    Ok((out, velocities, columns(py, &reports)?, faults))
}

pub fn end<'a>((kind, value): &'a EndOf<'a>) -> PyResult<End<'a>> {
    Ok(match (kind.as_str(), value) {
        ("natural", _) => End::Natural,
        ("not-a-knot", _) => End::NotAKnot,
        ("velocity", Some(v)) => End::Velocity(in_order(v)?),
        ("acceleration", Some(v)) => End::Acceleration(in_order(v)?),
        _ => return Err(invalid(format!("unknown end condition {kind:?}"))),
    })
}

/// A length in a message, of so many digits that it is read.
fn length(x: f64) -> String {
    if x < 1e6 { format!("{x:.3}") } else { format!("{x:.3e}") }
}

/// The report as two tables with a row for each field, in the order of `INTEGERS` and `NUMBERS` in report.py, and a column
/// for each curve.
type Columns<'py> = (Bound<'py, PyArrayDyn<i64>>, Bound<'py, PyArrayDyn<f64>>);

fn columns<'py>(py: Python<'py>, reports: &[Report]) -> PyResult<Columns<'py>> {
    const INTEGERS: [fn(&Report) -> i64; 4] = [
        |r| i64::from(r.status == Status::Converged),
        |r| r.iterations as i64,
        |r| r.solver as i64,
        |r| i64::from(r.skipped.0),
    ];
    // The error of velocities is known on manifolds made of functions only.
    const NUMBERS: [fn(&Report) -> f64; 8] = [
        |r| r.residual,
        |r| r.max_step,
        |r| r.rate,
        |r| r.invariant_radius,
        |r| r.contraction_bound,
        |r| r.guaranteed_sweeps,
        |r| r.alternative,
        |_| f64::NAN,
    ];
    let integers = PyArray1::from_iter(py, INTEGERS.iter().flat_map(|f| reports.iter().map(f)));
    let numbers = PyArray1::from_iter(py, NUMBERS.iter().flat_map(|f| reports.iter().map(f)));
    Ok((
        integers.reshape([INTEGERS.len(), reports.len()])?.to_dyn().clone(),
        numbers.reshape([NUMBERS.len(), reports.len()])?.to_dyn().clone(),
    ))
}

fn faults(
    handle: &Handle,
    options: &Options,
    reports: &[Report],
    batch: &[usize],
) -> Vec<(usize, &'static str, String)> {
    let limit = handle.space.get().cut_angle();
    // Unit quaternions are the usual reason for antipodes.
    let sign = if handle.space.name().0 == "sphere" { ", or check their sign" } else { "" };
    let describe = |(c, r): (usize, &Report)| {
        let of = validate::of_curve(c, batch);
        let (kind, message) = match r.status {
            Status::Stopped => return None,
            Status::Converged => {
                let (index, angle) = r.almost_cut?;
                (
                    "almost-cut",
                    format!(
                        "neighbours almost at the cut locus: between points[{index}] and points[{}]{of} the angle is \
                         {angle}, limit {limit}; had it been a little more, the curve would go the other way round: put \
                         a point between them",
                        index + 1
                    ),
                )
            }
            Status::CutLocus { index, angle } => (
                "cut-locus",
                format!(
                    "points[{index}] and points[{}]{of} lie at or past each other's cut locus: angle {angle}, \
                     limit {limit}; put a point between them{sign}",
                    index + 1
                ),
            ),
            Status::LongLeg { index, angle } if limit.is_infinite() => (
                "unconverged",
                format!(
                    "the control leg at points[{index}]{of} has length {angle:.1}, which rounding errors outgrow; \
                     give times that suit the distances: the segments beside it differ too much in length"
                ),
            ),
            Status::LongLeg { index, angle } => (
                "cut-locus",
                format!(
                    "the control leg at points[{index}]{of} passes the cut locus: angle {angle}, limit {limit}; \
                     put more points there, or give times that suit the distances"
                ),
            ),
            Status::MiddleLeg { index, angle } => (
                "cut-locus",
                format!(
                    "the control points between points[{index}] and points[{}]{of} lie at or past each other's cut \
                     locus: angle {angle}, limit {limit}; put a point between them, or give times that suit the \
                     distances",
                    index + 1
                ),
            ),
            Status::Unconverged if r.residual.is_infinite() && r.solver == Solver::Homotopy => (
                "unconverged",
                format!(
                    "no convergence{of}: after {} iterations the homotopy had not come to these points (longest step \
                     {}); try another method, put more points where steps are long, or choose times that suit the \
                     distances",
                    r.iterations,
                    length(r.max_step)
                ),
            ),
            Status::Unconverged if !r.residual.is_finite() => (
                "unconverged",
                format!(
                    "no convergence{of}: after {} iterations the numbers were too large for doubles (longest step \
                     {}); put more points where steps are long, or choose times that suit the distances",
                    r.iterations,
                    length(r.max_step)
                ),
            ),
            Status::Unconverged => (
                "unconverged",
                format!(
                    "no convergence{of}: residual {:.3e} after {} iterations (tol {:.1e}, longest step {}); \
                     put more points where steps are long, choose times that suit the distances, or raise max_iter",
                    r.residual,
                    r.iterations,
                    options.tol,
                    length(r.max_step)
                ),
            ),
        };
        Some((c, kind, message))
    };
    reports.iter().enumerate().filter_map(describe).collect()
}
