//! The exceptions a user can catch.

use pyo3::import_exception;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

// The classes are written in Python, where their fields have types and descriptions.
import_exception!(symspline._base.exceptions, ValidationError);
import_exception!(symspline._base.exceptions, CutLocusError);
import_exception!(symspline._base.exceptions, ConvergenceError);

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = m.py();
    m.add("ValidationError", py.get_type::<ValidationError>())?;
    m.add("CutLocusError", py.get_type::<CutLocusError>())?;
    m.add("ConvergenceError", py.get_type::<ConvergenceError>())
}

/// An invalid input of a fit, with the curve and the node.
pub struct Invalid {
    /// The numbers of the curve and of its node.
    pub curve: Option<usize>,
    pub node: Option<usize>,
    pub message: String,
}

impl Invalid {
    pub fn new(curve: usize, node: Option<usize>, message: String) -> Self {
        Invalid { curve: Some(curve), node, message }
    }

    /// The exception, whose `curve` is an index of the batch.
    pub fn raise(self, py: Python, batch: &[usize]) -> PyErr {
        let error = invalid(self.message);
        let fields = error.value(py);
        // An empty batch has knots, but no curves.
        let curve = self.curve.filter(|_| !batch.contains(&0));
        let index = curve.map(|curve| PyTuple::new(py, index_of(curve, batch)));
        let set = index
            .transpose()
            .and_then(|index| fields.setattr("curve", index))
            .and_then(|()| fields.setattr("node", self.node));
        set.err().unwrap_or(error)
    }
}

/// The same error, with the number of the factor. `_curves/fit.py` names the factor.
pub fn in_factor(py: Python, error: PyErr, factor: usize, factors: usize) -> PyErr {
    if factors == 1 {
        return error;
    }
    let set = error.value(py).setattr("_factor", factor);
    set.err().unwrap_or(error)
}

/// The index of an element in an array of a shape.
fn index_of(mut element: usize, shape: &[usize]) -> Vec<usize> {
    let mut index = Vec::with_capacity(shape.len());
    for &size in shape.iter().rev() {
        let size = size.max(1);
        index.push(element % size);
        element /= size;
    }
    index.reverse();
    index
}

/// A number for a message, never with hundreds of digits.
pub fn number(x: f64) -> String {
    if x == 0.0 || (1e-5..1e16).contains(&x.abs()) || !x.is_finite() {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

/// The index of an element in an array with a shape, in Python's notation.
pub fn format_index(element: usize, shape: &[usize]) -> String {
    let index: Vec<String> = index_of(element, shape).iter().map(usize::to_string).collect();
    index.join(",")
}

/// A [`ValidationError`] with a message.
pub fn invalid(message: impl Into<String>) -> PyErr {
    ValidationError::new_err(message.into())
}
