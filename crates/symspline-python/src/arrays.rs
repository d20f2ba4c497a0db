//! New arrays, and MemoryError in place of an abort if memory is exhausted.

use numpy::{PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyTypeError};
use pyo3::prelude::*;

/// Memory for this many numbers is assumed to be available.
const SMALL: usize = 1 << 16;

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

/// The array that a function of NumPy makes; small arrays are always zeros.
fn array<'py>(py: Python<'py>, shape: &[usize], function: &str) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    if shape.iter().product::<usize>() <= SMALL {
        return Ok(PyArrayDyn::zeros(py, shape, false));
    }
    // NumPy raises MemoryError; its Rust bindings panic.
    Ok(py.import("numpy")?.getattr(function)?.call1((shape.to_vec(),))?.cast_into()?)
}

/// Raises MemoryError unless memory for about this many numbers is available. `work` describes the computation and a
/// remedy. Rust would abort the process if memory were exhausted.
pub fn require_memory(numbers: f64, work: impl FnOnce() -> (String, &'static str)) -> PyResult<()> {
    if numbers <= SMALL as f64 {
        return Ok(());
    }
    let bytes = numbers * size_of::<f64>() as f64;
    let free = bytes < isize::MAX as f64 && Vec::<f64>::new().try_reserve_exact(numbers as usize).is_ok();
    if free {
        return Ok(());
    }
    let gigabytes = bytes / 1e9;
    let (work, remedy) = work();
    Err(PyMemoryError::new_err(format!(
        "{work} needs about {gigabytes:.3} GB of memory, more than is free{remedy}"
    )))
}

/// Reserves memory for this many numbers, or raises MemoryError where Rust would abort the process.
pub fn reserve<T>(count: usize) -> PyResult<Vec<T>> {
    let mut vector = Vec::new();
    vector.try_reserve_exact(count).map_err(|_| {
        let size = count.saturating_mul(size_of::<T>());
        PyMemoryError::new_err(format!("{size} bytes of memory are needed, more than is free"))
    })?;
    Ok(vector)
}
