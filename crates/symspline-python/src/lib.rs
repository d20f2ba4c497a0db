//! The compiled module `symspline._core`: arrays in, arrays out, validation; no mathematics.

mod arrays;
mod conversions;
mod curves;
mod derivative;
mod errors;
mod estimation;
mod evaluate;
mod fit;
mod grid;
mod hermite;
mod search;
mod smoothing;
mod space;
mod stiefel;
mod tridiagonal;
mod validate;
mod watch;

use pyo3::prelude::*;

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

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<space::Handle>()?;
    m.add_function(wrap_pyfunction!(fit::fit, m)?)?;
    m.add_function(wrap_pyfunction!(curves::check, m)?)?;
    m.add_function(wrap_pyfunction!(hermite::hermite, m)?)?;
    m.add_function(wrap_pyfunction!(derivative::push, m)?)?;
    m.add_function(wrap_pyfunction!(derivative::pull, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::evaluate, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::evaluate_bspline, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::cumulative_steps, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::lift, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::transport, m)?)?;
    m.add_function(wrap_pyfunction!(evaluate::lift_knots, m)?)?;
    m.add_function(wrap_pyfunction!(smoothing::smooth, m)?)?;
    m.add_function(wrap_pyfunction!(smoothing::fit_cumulative, m)?)?;
    m.add_function(wrap_pyfunction!(smoothing::smoothing_variance, m)?)?;
    m.add_function(wrap_pyfunction!(smoothing::chi_squared, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::frames_along, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::curvature_along, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::bending, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::estimate, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::posterior_covariance, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::posterior_freedom, m)?)?;
    m.add_function(wrap_pyfunction!(estimation::posterior_samples, m)?)?;
    m.add_function(wrap_pyfunction!(grid::grid_rows, m)?)?;
    m.add_function(wrap_pyfunction!(grid::grid_product, m)?)?;
    m.add_function(wrap_pyfunction!(grid::grid_scattered, m)?)?;
    m.add_function(wrap_pyfunction!(grid::grid_midpoint, m)?)?;
    m.add_function(wrap_pyfunction!(stiefel::stiefel, m)?)?;
    m.add_function(wrap_pyfunction!(search::closest, m)?)?;
    m.add_function(wrap_pyfunction!(search::closest_on_curves, m)?)?;
    m.add_function(wrap_pyfunction!(search::roots, m)?)?;
    m.add_function(wrap_pyfunction!(search::time_law, m)?)?;
    m.add_function(wrap_pyfunction!(tridiagonal::solve_tridiagonal, m)?)?;
    m.add_function(wrap_pyfunction!(conversions::convert_rotations, m)?)?;
    m.add_function(wrap_pyfunction!(conversions::number_lines, m)?)?;
    m.add_function(wrap_pyfunction!(set_num_threads, m)?)?;
    m.add_function(wrap_pyfunction!(num_threads, m)?)?;
    errors::register(m)
}
