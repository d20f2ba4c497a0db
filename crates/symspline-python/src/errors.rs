//! The exceptions a user can catch.

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    symspline,
    ValidationError,
    PyValueError,
    "The input is not what the call needs. The message names the index, the value and what to do."
);
create_exception!(
    symspline,
    CutLocusError,
    PyValueError,
    "Neighbouring points lie at or past each other's cut locus, where the geodesic between them is \
     not unique. When raised by a fit of many curves, `spline` carries all the good ones."
);
create_exception!(
    symspline,
    ConvergenceError,
    PyRuntimeError,
    "The solver did not reach the tolerance. `spline` carries the best curve found."
);

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = m.py();
    m.add("ValidationError", py.get_type::<ValidationError>())?;
    m.add("CutLocusError", py.get_type::<CutLocusError>())?;
    m.add("ConvergenceError", py.get_type::<ConvergenceError>())
}

/// A number for a message: never hundreds of digits.
pub fn number(x: f64) -> String {
    if x == 0.0 || (1e-5..1e16).contains(&x.abs()) || !x.is_finite() {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

/// The index of an element of an array with a shape, as it is written in Python.
pub fn place(mut index: usize, shape: &[usize]) -> String {
    let mut axes: Vec<String> = Vec::with_capacity(shape.len());
    for &size in shape.iter().rev() {
        axes.push((index % size).to_string());
        index /= size;
    }
    axes.reverse();
    axes.join(",")
}

/// A [`ValidationError`] with a message.
pub fn invalid(message: impl Into<String>) -> PyErr {
    ValidationError::new_err(message.into())
}
