//! Tridiagonal equations.

use crate::arrays::{in_order, zeros};
use crate::watch::{is_long, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::tridiagonal::solve;

/// Solutions of diagonally dominant equations, one set per curve: `matrix` of shape (curves, n, 3) has the entries before,
/// on and behind the diagonal, and `right` the shape (curves, n, right-hand sides).
#[pyfunction]
pub fn solve_tridiagonal<'py>(
    py: Python<'py>,
    matrix: PyReadonlyArrayDyn<'py, f64>,
    right: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let out = zeros(py, right.shape())?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    result.copy_from_slice(in_order(&right)?);
    let (n, width) = (matrix.shape()[1], right.shape()[2]);
    let rows = in_order(&matrix)?.as_chunks::<3>().0;
    if n * width > 0 {
        let heavy = is_long(result.len());
        watched(py, None, 1, heavy, |_| {
            rows.chunks_exact(n).zip(result.chunks_exact_mut(n * width)).for_each(|(rows, x)| solve(rows, x));
        })?;
    }
    drop(write);
    Ok(out)
}
