//! Exponential, logarithm and curves of Stiefel manifolds.

use crate::arrays::{in_order, zeros};
use crate::errors::invalid;
use crate::watch::watched;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use symspline_engine::rows::map;

/// Rows of an operation on rows of points p, q and vectors:
/// - "exp" of p, v: exp_p(v);
/// - "log" of p, q: log_p(q), NaN where there is none;
/// - "dlog" of p, v, w: the derivative of log_p at exp_p(v) in the direction w;
/// - "inner" of p, u, v: inner products;
/// - "basis" of p: an orthonormal basis, and "turn" of p, q: see the methods of these names of the core;
/// - "bends" of p, v, q, w and "point", "velocity" and "acceleration" of p, v, q, w, p, v, t: see the methods `bends` and
///   `curve` of the core; where these give two vectors, a row has both.
#[pyfunction]
pub fn stiefel<'py>(
    py: Python<'py>,
    k: usize,
    n: usize,
    operation: &str,
    inputs: Vec<PyReadonlyArrayDyn<'py, f64>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let manifold = symspline_engine::spaces::stiefel(k, n).map_err(invalid)?;
    let slices = inputs.iter().map(in_order).collect::<PyResult<Vec<_>>>()?;
    let rows = slices[0].len() / (n * k);
    let dim = n * k - k * (k + 1) / 2;
    let len = match operation {
        "inner" => 1,
        "basis" => dim * n * k,
        "turn" => dim * dim,
        "bends" | "velocity" | "acceleration" => 2 * n * k,
        _ => n * k,
    };
    let out = zeros(py, &[rows, len])?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    watched(py, None, rows, false, |monitor| match operation {
        "exp" => map(len, &slices, monitor, result, |x, out| manifold.exp(&x[0], &x[1], out)),
        "log" => map(len, &slices, monitor, result, |x, out| manifold.log(&x[0], &x[1], out)),
        "dlog" => map(len, &slices, monitor, result, |x, out| manifold.dlog(&x[0], &x[1], &x[2], out)),
        "inner" => map(len, &slices, monitor, result, |x, out| out[0] = manifold.inner(&x[0], &x[1], &x[2])),
        "basis" => map(len, &slices, monitor, result, |x, out| manifold.basis(&x[0], out)),
        "turn" => map(len, &slices, monitor, result, |x, out| manifold.turn(&x[0], &x[1], out)),
        "bends" => map(len, &slices, monitor, result, |x, out| manifold.bends(x, out)),
        "point" => map(len, &slices, monitor, result, |x, out| manifold.curve(0, x, out)),
        "velocity" => map(len, &slices, monitor, result, |x, out| manifold.curve(1, x, out)),
        _ => map(len, &slices, monitor, result, |x, out| manifold.curve(2, x, out)),
    })?;
    drop(write);
    Ok(out)
}
