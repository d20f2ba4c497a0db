//! New arrays, and MemoryError in place of an abort if memory is exhausted.

use numpy::{PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyTypeError};
use pyo3::prelude::*;
use symspline_engine::memory;

/// Arrays of up to this many numbers are made here, larger ones by NumPy.
const SMALL: usize = 1 << 16;
/// The remedy for most computations that need too much memory.
const PARTS: &str = "Process fewer curves or times in one call";

/// The numbers of a C-contiguous array. Other arrays would be read in the order of memory.
pub fn in_order<'a>(array: &'a PyReadonlyArrayDyn<f64>) -> PyResult<&'a [f64]> {
    if array.is_c_contiguous() {
        Ok(array.as_slice()?)
    } else {
        Err(PyTypeError::new_err("the array must be C-contiguous; pass np.ascontiguousarray(array)"))
    }
}

/// A result array of zeros.
pub fn zeros<'py>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    array(py, shape, "zeros")
}

/// A result array of any numbers, all of which will be replaced. To clear large arrays takes a twentieth of an evaluation.
pub fn unwritten<'py>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    array(py, shape, "empty")
}

/// The product of sizes, or the largest number if it exceeds that.
pub fn count(sizes: &[usize]) -> usize {
    sizes.iter().fold(1, |product: usize, &size| product.saturating_mul(size))
}

/// The array that a function of NumPy makes; small arrays are always zeros.
fn array<'py>(py: Python<'py>, shape: &[usize], function: &str) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    // Arrays without elements have limits as well: those of the other axes.
    let nonzero: Vec<usize> = shape.iter().copied().filter(|&size| size > 0).collect();
    if count(&nonzero) <= SMALL {
        return Ok(PyArrayDyn::zeros(py, shape, false));
    }
    let too_large = || {
        let axes = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let numbers = nonzero.iter().map(|&size| size as f64).product();
        out_of_memory(&format!("a result of shape ({axes})"), memory::bytes(numbers), PARTS)
    };
    if count(&nonzero) > isize::MAX as usize / size_of::<f64>() {
        return Err(too_large());
    }
    // NumPy raises MemoryError; its Rust bindings panic.
    let made = py.import("numpy")?.getattr(function)?.call1((shape.to_vec(),));
    let made =
        made.map_err(|error| if error.is_instance_of::<PyMemoryError>(py) { too_large() } else { error })?;
    Ok(made.cast_into()?)
}

/// Raises MemoryError unless memory for about this many numbers is available. `work` describes the computation and a
/// remedy. Rust would abort the process if memory were exhausted.
pub fn require_memory(numbers: f64, work: impl FnOnce() -> (String, &'static str)) -> PyResult<()> {
    if memory::is_free(numbers) {
        return Ok(());
    }
    let (work, remedy) = work();
    Err(out_of_memory(&work, memory::bytes(numbers), remedy))
}

/// The exception for a computation that needs more memory than is available.
pub fn out_of_memory(work: &str, bytes: f64, remedy: &str) -> PyErr {
    let gigabytes = bytes / 1e9;
    let remedy = if remedy.is_empty() { PARTS } else { remedy };
    PyMemoryError::new_err(format!(
        "{work} needs about {gigabytes:.3} GB of memory, more than is free. {remedy}"
    ))
}

/// Reserves memory for this many numbers, or raises MemoryError where Rust would abort the process.
pub fn reserve<T>(count: usize) -> PyResult<Vec<T>> {
    let mut vector = Vec::new();
    vector
        .try_reserve_exact(count)
        .map_err(|_| out_of_memory("a copy of the input", count as f64 * size_of::<T>() as f64, PARTS))?;
    Ok(vector)
}
