//! The compiled module `symspline._core`: arrays in, arrays out, validation; no mathematics.

mod arrays;
mod conversions;
mod curve;
mod curves;
mod derivative;
mod errors;
mod estimation;
mod evaluate;
mod fit;
mod gaps;
mod grid;
mod hermite;
mod length;
mod riemannian;
mod search;
mod smoothing;
mod space;
mod stiefel;
mod tridiagonal;
mod validate;
mod watch;

use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict, PyTuple};
use std::ffi::{CStr, CString};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Found in the compiled file by `symspline/_cpu.py`, without running any of its code.
#[used]
static BUILT_FOR: &[u8] = if cfg!(all(target_arch = "x86_64", target_feature = "avx512f")) {
    b"symspline built for x86-64-v4"
} else if cfg!(all(target_arch = "x86_64", target_feature = "avx2")) {
    b"symspline built for x86-64-v3"
} else {
    b"symspline built for any processor"
};

/// The best of the three that the processor can run: 2 for x86-64-v4, 1 for x86-64-v3. `symspline/_cpu.py` asks the
/// module for any processor, before any is imported.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "the name must be unique in the process, and is")]
#[unsafe(no_mangle)]
pub extern "C" fn symspline_cpu_level() -> std::ffi::c_int {
    use std::arch::is_x86_feature_detected as has;
    let v3 = has!("avx2")
        && has!("fma")
        && has!("bmi1")
        && has!("bmi2")
        && has!("f16c")
        && has!("lzcnt")
        && has!("movbe");
    let v4 = has!("avx512f") && has!("avx512bw") && has!("avx512cd") && has!("avx512dq") && has!("avx512vl");
    if v3 { 1 + std::ffi::c_int::from(v4) } else { 0 }
}

/// Limits the number of threads; 0 means all cores.
#[pyfunction]
fn set_num_threads(n: usize) {
    symspline_engine::parallel::set_num_threads(n);
}

/// The number of threads that parallel work uses.
#[pyfunction]
fn num_threads() -> usize {
    symspline_engine::parallel::num_threads()
}

/// Adds a function whose panics become a RuntimeError: `except Exception` does not catch the exception that PyO3 raises
/// otherwise.
fn guarded(m: &Bound<'_, PyModule>, function: Bound<'_, PyCFunction>) -> PyResult<()> {
    let py = m.py();
    let name: String = function.getattr("__name__")?.extract()?;
    let function = function.unbind();
    let call = move |args: &Bound<'_, PyTuple>, kwargs: Option<&Bound<'_, PyDict>>| {
        let py = args.py();
        // PyO3 resumes the panic when the exception returns to Rust.
        catch_unwind(AssertUnwindSafe(|| function.call(py, args, kwargs)))
            .unwrap_or_else(|panic| Err(watch::exception(panic)))
    };
    // Functions of a module live as long as the process.
    let leaked: &'static CStr = Box::leak(CString::new(name.as_str())?.into_boxed_c_str());
    m.add(name.as_str(), PyCFunction::new_closure(py, Some(leaked), None, call)?)
}

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<space::Handle>()?;
    m.add_class::<curve::Curve>()?;
    m.add_class::<length::ArcLength>()?;
    m.add_class::<riemannian::CurvatureTensor>()?;
    guarded(m, wrap_pyfunction!(length::integrals, m)?)?;
    guarded(m, wrap_pyfunction!(fit::fit, m)?)?;
    guarded(m, wrap_pyfunction!(curves::check, m)?)?;
    guarded(m, wrap_pyfunction!(hermite::hermite, m)?)?;
    guarded(m, wrap_pyfunction!(derivative::push, m)?)?;
    guarded(m, wrap_pyfunction!(derivative::pull, m)?)?;
    guarded(m, wrap_pyfunction!(evaluate::evaluate_bspline, m)?)?;
    guarded(m, wrap_pyfunction!(evaluate::cumulative_steps, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::smooth, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::fit_cumulative, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::smoothing_variance, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::process_variance, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::smoothing_inverse, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::chi_squared, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::residuals_at, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::examine, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::examine_curves, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::are_constant, m)?)?;
    guarded(m, wrap_pyfunction!(smoothing::usual_turns, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::frames_along, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::estimate, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::linearise, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::varying_lams, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::distance_from_minimum, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::posterior_covariance, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::posterior_freedom, m)?)?;
    guarded(m, wrap_pyfunction!(estimation::posterior_samples, m)?)?;
    guarded(m, wrap_pyfunction!(gaps::coefficient_factors, m)?)?;
    guarded(m, wrap_pyfunction!(gaps::predictions_without, m)?)?;
    guarded(m, wrap_pyfunction!(gaps::gap_factors, m)?)?;
    guarded(m, wrap_pyfunction!(gaps::end_factors, m)?)?;
    guarded(m, wrap_pyfunction!(gaps::chi_squared_ratio, m)?)?;
    guarded(m, wrap_pyfunction!(grid::grid_rows, m)?)?;
    guarded(m, wrap_pyfunction!(grid::grid_product, m)?)?;
    guarded(m, wrap_pyfunction!(grid::grid_scattered, m)?)?;
    guarded(m, wrap_pyfunction!(grid::grid_midpoint, m)?)?;
    guarded(m, wrap_pyfunction!(stiefel::stiefel, m)?)?;
    guarded(m, wrap_pyfunction!(search::closest, m)?)?;
    guarded(m, wrap_pyfunction!(search::roots, m)?)?;
    guarded(m, wrap_pyfunction!(search::time_law, m)?)?;
    guarded(m, wrap_pyfunction!(tridiagonal::solve_tridiagonal, m)?)?;
    guarded(m, wrap_pyfunction!(conversions::convert_rotations, m)?)?;
    guarded(m, wrap_pyfunction!(conversions::quaternion_products, m)?)?;
    guarded(m, wrap_pyfunction!(conversions::number_lines, m)?)?;
    // Public functions, with their signatures.
    m.add_function(wrap_pyfunction!(set_num_threads, m)?)?;
    m.add_function(wrap_pyfunction!(num_threads, m)?)?;
    errors::register(m)
}
