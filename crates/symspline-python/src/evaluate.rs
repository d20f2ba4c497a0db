//! Evaluation, called from Python.

use crate::arrays::{in_order, zeros};
use crate::errors::{CutLocusError, format_index, invalid, number};
use crate::space::Handle;
use crate::validate::of_curve;
use crate::watch::{is_heavy, is_long, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::curve::{
    BSpline, Curves, Outside, Quantity, Times, cumulative_steps as run_steps, evaluate_bspline as run_bspline,
};
use symspline_engine::space::Ambient;

/// The degree from which one sample of a B-spline may take long.
const LONG_DEGREE: usize = 100;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

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

pub fn quantity_named(name: &str) -> PyResult<Quantity> {
    Ok(match name {
        "point" => Quantity::Point,
        "velocity" => Quantity::Velocity,
        "acceleration" => Quantity::Acceleration,
        "jerk" => Quantity::Jerk,
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
pub fn check_times(
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
