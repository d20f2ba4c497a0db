//! Rotations as matrices, quaternions and vectors, and numbers as text.

use crate::arrays::{in_order, unwritten, zeros};
use crate::errors::invalid;
use crate::watch::{is_long, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::fmt::Write;
use symspline_engine::monitor::Monitor;
use symspline_engine::parallel;
use symspline_engine::spaces::conversions::{Form, accumulate, convert};

/// Rotations in another form, with the shape of the leading axes, and whether all were finite and within `tol` of
/// rotations. The forms are "matrix", "scalar first", "scalar last" and "vector".
#[pyfunction]
pub fn convert_rotations<'py>(
    py: Python<'py>,
    rotations: PyReadonlyArrayDyn<'py, f64>,
    form: &str,
    wanted: &str,
    tol: f64,
) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, bool)> {
    let named = |name: &str| Form::named(name).ok_or_else(|| invalid(format!("unknown form {name:?}")));
    let (from, to) = (named(form)?, named(wanted)?);
    let own = if from == Form::Matrix { 2 } else { 1 };
    let mut shape = rotations.shape()[..rotations.ndim() - own].to_vec();
    if to == Form::Matrix {
        shape.extend([3, 3]);
    } else {
        shape.push(to.count());
    }
    let out = unwritten(py, &shape)?;
    let mut write = out.readwrite();
    let (input, result) = (in_order(&rotations)?, write.as_slice_mut()?);
    let valid = watched(py, None, 1, false, |monitor| convert(from, to, tol, input, monitor, result))?;
    drop(write);
    Ok((out, valid))
}

/// Products q₀, q₀q₁, q₀q₁q₂, … of unit quaternions, scalar first, along the last axis but one.
#[pyfunction]
pub fn quaternion_products<'py>(
    py: Python<'py>,
    quaternions: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let out = zeros(py, quaternions.shape())?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    result.copy_from_slice(in_order(&quaternions)?);
    let n = quaternions.shape()[quaternions.ndim() - 2];
    if !result.is_empty() {
        let heavy = is_long(result.len());
        watched(py, None, 1, heavy, |_| {
            result.as_chunks_mut::<4>().0.chunks_exact_mut(n).for_each(accumulate)
        })?;
    }
    drop(write);
    Ok(out)
}

/// Rows that one thread writes at a time.
const ROWS: usize = 512;

/// Rows of numbers as lines of text, each number with the fewest digits from which it is restored, in the format of
/// Python's `repr`.
#[pyfunction]
pub fn number_lines(py: Python, rows: PyReadonlyArrayDyn<f64>, separator: &str) -> PyResult<String> {
    let columns = rows.shape()[rows.ndim() - 1];
    let input = in_order(&rows)?;
    let blocks: Vec<_> = input.chunks((ROWS * columns).max(1)).collect();
    let mut texts = vec![String::new(); blocks.len()];
    watched(py, None, 1, false, |monitor: &Monitor| {
        let work: Vec<_> = blocks.into_iter().zip(&mut texts).collect();
        parallel::for_each(work, false, monitor, |(block, text)| {
            text.reserve(20 * block.len());
            for row in block.chunks(columns) {
                for (i, &x) in row.iter().enumerate() {
                    if i > 0 {
                        text.push_str(separator);
                    }
                    push_number(text, x);
                }
                text.push('\n');
            }
        });
    })?;
    Ok(texts.concat())
}

/// Both languages use an exponent below 1e-4 and from 1e16 on, but Python writes its sign and at least two digits.
fn push_number(text: &mut String, x: f64) {
    if x.is_nan() {
        return text.push_str("nan");
    }
    let start = text.len();
    // Writing to a string does not fail.
    let _ = write!(text, "{x:?}");
    if let Some(e) = text[start..].find('e') {
        let exponent = text.split_off(start + e + 1);
        let (sign, digits) =
            exponent.strip_prefix('-').map_or(('+', exponent.as_str()), |digits| ('-', digits));
        let _ = write!(text, "{sign}{digits:0>2}");
    }
}
