//! Splines over grids, called from Python.

use crate::arrays::{count, in_order, unwritten, zeros};
use crate::errors::invalid;
use crate::evaluate::policy_named;
use crate::space::Handle;
use crate::watch::{Progress, is_heavy, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::fit::Status;
use symspline_engine::grid::{self, Axis, Condition, Derivative, Grid, Summary};
use symspline_engine::monitor::Monitor;
use symspline_engine::space::{Ambient, Erased};

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type Result<'py> = Bound<'py, PyArrayDyn<f64>>;
/// Knots, the conditions at both ends or None for a periodic axis, and the extrapolation policy.
type AxisOf<'py> = (Array<'py>, Option<[String; 2]>, String);
/// The number of failed rows; the first one: its axis, kind, node, value, limit and residual; the largest residual, step
/// and number of iterations.
type Found = (usize, Option<(usize, &'static str, Option<usize>, f64, f64, f64)>, f64, f64, usize);

/// A grid whose arrays belong to Python.
#[derive(FromPyObject)]
pub struct Arrays<'py> {
    axes: Vec<AxisOf<'py>>,
    points: Array<'py>,
    velocities: Array<'py>,
}

fn axis_of<'a>((knots, ends, outside): &'a AxisOf<'_>) -> PyResult<Axis<'a>> {
    let condition = |name: &String| match name.as_str() {
        "natural" => Ok(Condition::Natural),
        "not-a-knot" => Ok(Condition::NotAKnot),
        "clamped" => Ok(Condition::Clamped),
        _ => Err(invalid(format!("unknown end condition {name:?}"))),
    };
    let ends = match ends {
        None => None,
        Some([a, b]) => Some([condition(a)?, condition(b)?]),
    };
    Ok(Axis { knots: in_order(knots)?, ends, outside: policy_named(outside)?.0 })
}

fn found(space: &Erased, summary: &Summary) -> Found {
    let first = summary.first.map(|fault| {
        let (kind, node, value) = match fault.status {
            Status::CutLocus { index, angle } => ("cut-locus", Some(index), angle),
            Status::LongHandle { index, angle } => ("outer-handle", Some(index), angle),
            Status::InnerHandle { index, angle } => ("inner-handles", Some(index), angle),
            Status::Imprecise => ("imprecise", None, fault.residual),
            _ => ("unconverged", None, fault.residual),
        };
        (fault.axis, kind, node, value, space.cut_angle(), fault.residual)
    });
    (summary.failed, first, summary.residual, summary.max_step, summary.iterations)
}

/// Computes velocities along one axis of nodes of shape (..., nodes, numbers of a point).
#[pyfunction]
pub fn grid_rows<'py>(
    py: Python<'py>,
    handle: &Handle,
    axis: AxisOf<'py>,
    rows: Array<'py>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Result<'py>, Found)> {
    let space = handle.space.get();
    let axis = axis_of(&axis)?;
    let out = zeros(py, rows.shape())?;
    let mut write = out.readwrite();
    let (points, result) = (in_order(&rows)?, write.as_slice_mut()?);
    let nodes = points.len() / space.point_len();
    let summary = watched(py, Progress::whole(progress), nodes, is_heavy(&space), |monitor| {
        grid::fit_rows(&space, &axis, 0, points, |_| true, monitor, result)
    })?;
    drop(write);
    Ok((out, found(&space, &summary)))
}

type Evaluated<'py> = (Result<'py>, Option<Result<'py>>, Found);

/// Evaluates a grid on the outer product of coordinates: points, and the derivative along axis `along` and of order `last`
/// along the last axis if one is requested.
#[pyfunction]
#[pyo3(signature = (handle, arrays, x, along, last, progress=None))]
pub fn grid_product<'py>(
    py: Python<'py>,
    handle: &Handle,
    arrays: Arrays<'py>,
    x: Vec<Array<'py>>,
    along: Option<usize>,
    last: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Evaluated<'py>> {
    let rows: Vec<&[f64]> = x.iter().map(in_order).collect::<PyResult<_>>()?;
    let lead: Vec<usize> = rows.iter().map(|x| x.len()).collect();
    // Points are counted once per axis.
    let units = count(&lead).saturating_mul(lead.len());
    evaluated(
        py,
        handle,
        &arrays,
        &lead,
        Derivative { along, last },
        units,
        progress,
        |grid, derivative, monitor, out| grid::product(grid, &rows, derivative, monitor, out.0, out.1),
    )
}

/// Evaluates a grid at scattered coordinates, shape (n, axes), like [`grid_product`].
#[pyfunction]
#[pyo3(signature = (handle, arrays, x, along, last, progress=None))]
pub fn grid_scattered<'py>(
    py: Python<'py>,
    handle: &Handle,
    arrays: Arrays<'py>,
    x: Array<'py>,
    along: Option<usize>,
    last: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Evaluated<'py>> {
    let count = x.shape()[0];
    let x = in_order(&x)?;
    evaluated(
        py,
        handle,
        &arrays,
        &[count],
        Derivative { along, last },
        count,
        progress,
        |grid, derivative, monitor, out| grid::scattered(grid, x, derivative, monitor, out.0, out.1),
    )
}

/// The common part of both: new arrays with the leading axes `lead`, and the numbers of one point behind.
fn evaluated<'py>(
    py: Python<'py>,
    handle: &Handle,
    arrays: &Arrays<'py>,
    lead: &[usize],
    derivative: Derivative,
    units: usize,
    progress: Option<Py<PyAny>>,
    run: impl FnOnce(&Grid, Derivative, &Monitor, (&mut [f64], &mut [f64])) -> Summary + Send,
) -> PyResult<Evaluated<'py>> {
    let space = handle.space.get();
    let axes: Vec<Axis> = arrays.axes.iter().map(axis_of).collect::<PyResult<_>>()?;
    let grid = Grid {
        space,
        axes: &axes,
        points: in_order(&arrays.points)?,
        velocities: in_order(&arrays.velocities)?,
    };
    let shape = [lead, &arrays.points.shape()[axes.len()..]].concat();
    let points = unwritten(py, &shape)?;
    let tangents = derivative.is_vector().then(|| unwritten(py, &shape)).transpose()?;
    let mut write = points.readwrite();
    let mut write_tangents = tangents.as_ref().map(|array| array.readwrite());
    let own: &mut [f64] = match &mut write_tangents {
        Some(array) => array.as_slice_mut()?,
        None => &mut [],
    };
    let out = (write.as_slice_mut()?, own);
    let summary = watched(py, Progress::whole(progress), units, is_heavy(&space), |monitor| {
        run(&grid, derivative, monitor, out)
    })?;
    drop((write, write_tangents));
    Ok((points, tangents, found(&space, &summary)))
}

/// Computes the midpoint of every pair of points, and its derivative for tangent vectors at both.
#[pyfunction]
pub fn grid_midpoint<'py>(
    py: Python<'py>,
    handle: &Handle,
    points: [Array<'py>; 2],
    vectors: Option<[Array<'py>; 2]>,
) -> PyResult<(Result<'py>, Option<Result<'py>>)> {
    let space = handle.space.get();
    let out = unwritten(py, points[0].shape())?;
    let moved = vectors.is_some().then(|| unwritten(py, points[0].shape())).transpose()?;
    let mut write = out.readwrite();
    let mut write_moved = moved.as_ref().map(|array| array.readwrite());
    let own: &mut [f64] = match &mut write_moved {
        Some(array) => array.as_slice_mut()?,
        None => &mut [],
    };
    let points = [in_order(&points[0])?, in_order(&points[1])?];
    let vectors = match &vectors {
        Some([a, b]) => [in_order(a)?, in_order(b)?],
        None => [&[][..]; 2],
    };
    let result = write.as_slice_mut()?;
    watched(py, None, result.len(), is_heavy(&space), |monitor| {
        grid::midpoint(&space, points, vectors, monitor, result, own);
    })?;
    drop((write, write_moved));
    Ok((out, moved))
}
