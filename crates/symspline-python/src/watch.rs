//! Ctrl-C and progress while compiled code runs without the GIL.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use symspline::monitor::Monitor;

/// How often Python gets a look.
const INTERVAL: Duration = Duration::from_millis(50);

/// Runs `work` without the GIL. From time to time signals are checked and `progress` is called with
/// the finished and the total number of units; an exception in either stops the work. A panic is a RuntimeError.
pub fn watched<T: Send>(
    py: Python,
    progress: Option<Py<PyAny>>,
    total: usize,
    work: impl FnOnce(&Monitor) -> T + Send,
) -> PyResult<T> {
    let state = Mutex::new((Instant::now(), None::<PyErr>));
    let go_on = |finished: usize| {
        let Ok(mut state) = state.lock() else { return false };
        if state.1.is_some() || state.0.elapsed() < INTERVAL {
            return state.1.is_none();
        }
        let seen = Python::attach(|py| {
            py.check_signals()?;
            progress.as_ref().map_or(Ok(()), |p| p.call1(py, (finished, total)).map(|_| ()))
        });
        *state = (Instant::now(), seen.err());
        state.1.is_none()
    };
    let monitor = Monitor::new(&go_on);
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(|| work(&monitor))));
    if let Ok(Some(error)) = state.into_inner().map(|s| s.1) {
        return Err(error);
    }
    let result = result.map_err(|panic| {
        let what = panic.downcast_ref::<String>().map(String::as_str);
        let what = what.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason was given");
        PyRuntimeError::new_err(format!("this is an error in symspline, please report it: {what}"))
    })?;
    if let Some(progress) = progress {
        progress.call1(py, (total, total))?;
    }
    Ok(result)
}
