//! Evaluation, called from Python.

use crate::arrays::zeros;
use crate::errors::{invalid, number, place};
use crate::space::Handle;
use crate::validate::of_curve;
use crate::watch::watched;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline::curve::{
    BSpline, Curves, Outside, Quantity, Times, evaluate as run, evaluate_bspline as run_bspline,
};

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Evaluates curves: the result is batch axes + axes of one curve's times + axes of a point (or none).
#[pyfunction]
#[pyo3(signature = (handle, t, points, velocities, x, quantity, outside, per_curve, progress=None))]
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
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let quantity = quantity_named(quantity)?;
    let (policy, strict) = match outside {
        "raise" => (Outside::Continue, true),
        "continue" => (Outside::Continue, false),
        "geodesic" => (Outside::Geodesic, false),
        "periodic" => (Outside::Wrap, false),
        _ => return Err(invalid(format!("unknown extrapolation {outside:?}"))),
    };
    let point_axes = handle.point_axes();
    let nodes = t.shape()[t.ndim() - 1];
    let batch = &points.shape()[..points.ndim() - point_axes - 1];
    let count_axes = if per_curve { &x.shape()[batch.len()..] } else { x.shape() };
    let curves =
        Curves { t: t.as_slice()?, nodes, points: points.as_slice()?, velocities: velocities.as_slice()? };
    let count = count_axes.iter().product();
    let times = Times { x: x.as_slice()?, count };
    check_times(&curves, &times, batch, x.shape(), strict)?;

    let mut shape = [batch, count_axes].concat();
    let samples = shape.iter().product();
    if !matches!(quantity, Quantity::Speed | Quantity::Bend) {
        shape.extend_from_slice(&points.shape()[points.ndim() - point_axes..]);
    }
    let out = zeros(py, &shape)?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    watched(py, progress, samples, |monitor| {
        run(&handle.space.get(), &curves, &times, quantity, policy, monitor, result);
    })?;
    drop(write);
    Ok(out)
}

fn quantity_named(name: &str) -> PyResult<Quantity> {
    Ok(match name {
        "point" => Quantity::Point,
        "velocity" => Quantity::Velocity,
        "acceleration" => Quantity::Acceleration,
        "speed" => Quantity::Speed,
        "bend" => Quantity::Bend,
        _ => return Err(invalid(format!("unknown quantity {name:?}"))),
    })
}

/// Evaluates B-spline curves at times inside their domain: the result is batch axes + x.shape + axes of a
/// point (or none).
#[pyfunction]
pub fn evaluate_bspline<'py>(
    py: Python<'py>,
    handle: &Handle,
    knots: Array<'py>,
    control: Array<'py>,
    degree: usize,
    x: Array<'py>,
    quantity: &str,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let quantity = quantity_named(quantity)?;
    let axes = control.ndim() - handle.point_axes();
    let mut shape = [&control.shape()[..axes - 1], x.shape()].concat();
    if !matches!(quantity, Quantity::Speed | Quantity::Bend) {
        shape.extend_from_slice(&control.shape()[axes..]);
    }
    let curve = BSpline { knots: knots.as_slice()?, control: control.as_slice()?, degree };
    let out = zeros(py, &shape)?;
    let mut write = out.readwrite();
    let (x, result) = (x.as_slice()?, write.as_slice_mut()?);
    watched(py, None, result.len(), |monitor| {
        run_bspline(&handle.space.get(), &curve, x, quantity, monitor, result);
    })?;
    drop(write);
    Ok(out)
}

/// Times must be numbers, and inside the knots if `strict`.
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
        let Some(i) = row.iter().position(|&x| !good(x)) else { continue };
        let name = if shape.is_empty() {
            "x".to_string()
        } else {
            format!("x[{}]", place(if own_times { c * count + i } else { i }, shape))
        };
        let found = number(row[i]);
        if !row[i].is_finite() {
            return Err(invalid(format!("{name} is {found}; times must be finite")));
        }
        let of = if own_times || shared { String::new() } else { of_curve(c, batch) };
        return Err(invalid(format!(
            "{name} = {found} is outside the knots [{}, {}]{of}; pass extrapolate=True, 'geodesic' or \
             'periodic' to say what is meant there",
            number(start),
            number(end),
        )));
    }
    Ok(())
}
