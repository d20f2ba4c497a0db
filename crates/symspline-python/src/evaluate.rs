//! Evaluation, called from Python.

use crate::arrays::{count, in_order, unwritten, zeros};
use crate::errors::{CutLocusError, format_index, invalid, number};
use crate::space::Handle;
use crate::validate::of_curve;
use crate::watch::{Progress, is_heavy, is_long, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::curve::{
    BSpline, Curves, Outside, Quantity, Times, cumulative_steps as run_steps, evaluate as run,
    evaluate_bspline as run_bspline, lift as run_lift, lift_knots as find_knots, transport as run_transport,
};
use symspline_engine::monitor::Monitor;
use symspline_engine::space::{Ambient, Erased};

/// The degree from which one sample of a B-spline may take long.
const LONG_DEGREE: usize = 100;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Evaluates curves. The result has the batch axes, the axes of the times of one curve and the axes of a point (or
/// none), and is written to `out` if that is given.
#[pyfunction]
#[pyo3(signature = (handle, t, points, velocities, x, quantity, outside, per_curve, progress=None, out=None))]
pub fn evaluate<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
    x: Array<'py>,
    quantity: &str,
    outside: &str,
    per_curve: bool,
    progress: Option<Py<PyAny>>,
    out: Option<Bound<'py, PyArrayDyn<f64>>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let at = (x, outside, per_curve);
    sampled(
        py,
        handle,
        [&t, &points, &velocities],
        at,
        quantity,
        progress,
        out,
        |space, job, monitor, out| {
            run(space, job.curves, job.times, job.quantity, job.outside, monitor, out);
        },
    )
}

/// Evaluates the horizontal lift of curves on a quotient space, and its derivatives, like [`evaluate`]. `knots`
/// contains the factors from [`lift_knots`], and `start` those of the initial representatives, (curves, k, k, 2).
#[pyfunction]
#[pyo3(signature = (handle, t, points, velocities, x, quantity, outside, per_curve, knots, start, progress=None))]
pub fn lift<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
    x: Array<'py>,
    quantity: &str,
    outside: &str,
    per_curve: bool,
    knots: Array<'py>,
    start: Array<'py>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let at = (x, outside, per_curve);
    let factors = [in_order(&knots)?, in_order(&start)?];
    sampled(
        py,
        handle,
        [&t, &points, &velocities],
        at,
        quantity,
        progress,
        None,
        |space, job, monitor, out| {
            run_lift(space, job.curves, job.times, job.quantity, job.outside, factors, monitor, out);
        },
    )
}

/// The factors of the horizontal lift at the knots, (curves, knots, k, k, 2).
#[pyfunction]
pub fn lift_knots<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let space = handle.space.get();
    let curves = curves_of([&t, &points, &velocities])?;
    let (nodes, k) = (curves.nodes, space.fiber_rank());
    let count = curves.points.len() / (nodes * space.point_len()).max(1);
    let out = zeros(py, &[count, nodes, k, k, 2])?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    let heavy = is_heavy(&space) || is_long(count * nodes);
    watched(py, None, count * nodes, heavy, |monitor| find_knots(&space, &curves, monitor, result))?;
    drop(write);
    Ok(out)
}

/// Transports one tangent vector of every curve in parallel along the curve, from its point at one time to that at
/// another.
#[pyfunction]
pub fn transport<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
    times: [f64; 2],
    outside: &str,
    vectors: Array<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let curves = curves_of([&t, &points, &velocities])?;
    let (policy, _) = policy_named(outside)?;
    let out = zeros(py, vectors.shape())?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    result.copy_from_slice(in_order(&vectors)?);
    let count = result.len() / handle.space.get().point_len().max(1);
    let heavy = is_heavy(&handle.space.get()) || is_long(points.len());
    watched(py, None, count, heavy, |monitor| {
        run_transport(&handle.space.get(), &curves, times, policy, monitor, result);
    })?;
    drop(write);
    Ok(out)
}

/// The arguments of an evaluation.
struct Evaluation<'a> {
    curves: &'a Curves<'a>,
    times: &'a Times<'a>,
    quantity: Quantity,
    outside: Outside,
}

pub fn curves_of<'a>([t, points, velocities]: [&'a Array; 3]) -> PyResult<Curves<'a>> {
    Ok(Curves {
        t: in_order(t)?,
        nodes: t.shape()[t.ndim() - 1],
        points: in_order(points)?,
        velocities: in_order(velocities)?,
    })
}

/// Reads curves and times, and computes a quantity for every sample.
fn sampled<'py>(
    py: Python<'py>,
    handle: &Handle,
    curve: [&Array<'py>; 3],
    (x, outside, per_curve): (Array<'py>, &str, bool),
    quantity: &str,
    progress: Option<Py<PyAny>>,
    out: Option<Bound<'py, PyArrayDyn<f64>>>,
    compute: impl FnOnce(&Erased, &Evaluation, &Monitor, &mut [f64]) + Send,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let quantity = quantity_named(quantity)?;
    let (policy, strict) = policy_named(outside)?;
    let (point_axes, points) = (handle.point_axes(), curve[1]);
    let batch = &points.shape()[..points.ndim() - point_axes - 1];
    let count_axes = if per_curve { &x.shape()[batch.len()..] } else { x.shape() };
    let curves = curves_of(curve)?;
    let times = Times { x: in_order(&x)?, count: count(count_axes) };
    check_times(&curves, &times, batch, x.shape(), strict)?;

    let space = handle.space.get();
    let mut shape = [batch, count_axes].concat();
    let samples = count(&shape);
    if quantity.is_of_body() {
        shape.push(quantity.len(&space));
    } else if !quantity.is_length() {
        shape.extend_from_slice(&points.shape()[points.ndim() - point_axes..]);
    }
    let out = match out {
        Some(out) => out,
        None => unwritten(py, &shape)?,
    };
    let mut write = out.readwrite();
    if write.shape() != shape {
        return Err(invalid(format!("out has shape {:?}, but the result has {shape:?}", write.shape())));
    }
    let result = write.as_slice_mut()?;
    let evaluation = Evaluation { curves: &curves, times: &times, quantity, outside: policy };
    watched(py, Progress::whole(progress), samples, is_heavy(&space), |monitor| {
        compute(&space, &evaluation, monitor, result)
    })?;
    drop(write);
    Ok(out)
}

/// The extrapolation policy, and whether times outside the knots are an error.
pub fn policy_named(name: &str) -> PyResult<(Outside, bool)> {
    Ok(match name {
        "raise" => (Outside::Continue, true),
        "continue" => (Outside::Continue, false),
        "geodesic" => (Outside::Geodesic, false),
        "periodic" => (Outside::Wrap, false),
        _ => return Err(invalid(format!("unknown extrapolation {name:?}"))),
    })
}

fn quantity_named(name: &str) -> PyResult<Quantity> {
    Ok(match name {
        "point" => Quantity::Point,
        "velocity" => Quantity::Velocity,
        "acceleration" => Quantity::Acceleration,
        "speed" => Quantity::Speed,
        "bend" => Quantity::AccelerationNorm,
        "body velocity" => Quantity::BodyVelocity,
        "body acceleration" => Quantity::BodyAcceleration,
        "motion" => Quantity::Motion,
        _ => return Err(invalid(format!("unknown quantity {name:?}"))),
    })
}

/// Evaluates B-spline curves at times inside their domain; with `steps`, cumulative B-splines. The result has the batch
/// axes, x.shape and the axes of a point (or none).
#[pyfunction]
#[pyo3(signature = (handle, knots, control, degree, x, quantity, steps=None))]
pub fn evaluate_bspline<'py>(
    py: Python<'py>,
    handle: &Handle,
    knots: Array<'py>,
    control: Array<'py>,
    degree: usize,
    x: Array<'py>,
    quantity: &str,
    steps: Option<Array<'py>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let quantity = quantity_named(quantity)?;
    let axes = control.ndim() - handle.point_axes();
    let mut shape = [&control.shape()[..axes - 1], x.shape()].concat();
    if quantity.is_of_body() {
        shape.push(quantity.len(&handle.space.get()));
    } else if !quantity.is_length() {
        shape.extend_from_slice(&control.shape()[axes..]);
    }
    let steps = steps.as_ref().map_or(Ok(&[][..]), in_order)?;
    let curve = BSpline { knots: in_order(&knots)?, control: in_order(&control)?, degree, steps };
    let out = zeros(py, &shape)?;
    let mut write = out.readwrite();
    let (x, result) = (in_order(&x)?, write.as_slice_mut()?);
    let heavy = is_heavy(&handle.space.get()) || degree > LONG_DEGREE;
    watched(py, None, result.len(), heavy, |monitor| {
        run_bspline(&handle.space.get(), &curve, x, quantity, monitor, result);
    })?;
    drop(write);
    Ok(out)
}

/// The steps of cumulative B-splines, for control points of shape (..., n, point).
#[pyfunction]
pub fn cumulative_steps<'py>(
    py: Python<'py>,
    handle: &Handle,
    control: Array<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let axes = control.ndim() - handle.point_axes();
    let mut shape = control.shape().to_vec();
    let count = shape[axes - 1];
    shape[axes - 1] = count - 1;
    let out = zeros(py, &shape)?;
    let mut write = out.readwrite();
    let (control, result) = (in_order(&control)?, write.as_slice_mut()?);
    let heavy = is_heavy(&handle.space.get()) || is_long(result.len());
    let done =
        watched(py, None, result.len(), heavy, |_| run_steps(&handle.space.get(), control, count, result))?;
    drop(write);
    done.map_err(|(row, angle)| {
        let limit = handle.space.get().cut_angle();
        CutLocusError::new_err(format!(
            "pair {row}: the points lie at or past each other's cut locus: angle {angle}, limit {limit}; \
             the geodesic between them is not unique"
        ))
    })?;
    Ok(out)
}

/// Times must be finite, and inside the knots if `strict`.
fn check_times(
    curves: &Curves,
    times: &Times,
    batch: &[usize],
    shape: &[usize],
    strict: bool,
) -> PyResult<()> {
    let Times { x, count } = *times;
    let number_of_curves: usize = batch.iter().product();
    let own_times = x.len() != count;
    let shared = curves.t.len() == curves.nodes;
    let rounds = if own_times || (!shared && strict) { number_of_curves } else { number_of_curves.min(1) };
    for c in 0..rounds {
        let row = if own_times { &x[c * count..(c + 1) * count] } else { x };
        let (start, end) = curves.domain(if shared { 0 } else { c });
        let good = |x: f64| if strict { start <= x && x <= end } else { x.is_finite() };
        // Without an early end, the loop is compiled to SIMD instructions.
        if row.iter().fold(true, |all, &x| all & good(x)) {
            continue;
        }
        let Some(i) = row.iter().position(|&x| !good(x)) else { continue };
        let name = if shape.is_empty() {
            "x".to_string()
        } else {
            format!("x[{}]", format_index(if own_times { c * count + i } else { i }, shape))
        };
        let found = number(row[i]);
        if !row[i].is_finite() {
            return Err(invalid(format!("{name} is {found}; times must be finite")));
        }
        let of = if own_times || shared { String::new() } else { of_curve(c, batch) };
        return Err(invalid(format!(
            "{name} = {found} is outside the knots [{}, {}]{of}; pass extrapolate=True, 'geodesic' or \
             'periodic' to continue the curve there, or False for NaN",
            number(start),
            number(end),
        )));
    }
    Ok(())
}
