//! Exponential and logarithm of Stiefel manifolds.

use crate::arrays::{in_order, zeros};
use crate::errors::invalid;
use crate::watch::watched;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use symspline_engine::rows::map;

/// Rows of exp_p(v) for "exp" and p, v; of log_p(q), NaN where there is none, for "log" and p, q; of the derivative of
/// log_p at exp_p(v) in the direction w for "dlog" and p, v, w.
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
    let len = manifold.point_len();
    let out = zeros(py, &[slices[0].len()])?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    watched(py, None, slices[0].len() / len, false, |monitor| match operation {
        "exp" => map(len, &slices, monitor, result, |x, out| manifold.exp(&x[0], &x[1], out)),
        "log" => map(len, &slices, monitor, result, |x, out| manifold.log(&x[0], &x[1], out)),
        _ => map(len, &slices, monitor, result, |x, out| manifold.dlog(&x[0], &x[1], &x[2], out)),
    })?;
    drop(write);
    Ok(out)
}
