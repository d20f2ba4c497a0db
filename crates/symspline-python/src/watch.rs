//! Ctrl-C and progress while compiled code runs without the GIL.

use crate::arrays::{out_of_memory, require_memory};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use symspline_engine::memory::{HEADROOM, OF_THREAD, OutOfMemory, is_free};
use symspline_engine::monitor::Monitor;
use symspline_engine::space::{Ambient, Erased, Origin};

/// The interval at which Python handles signals.
const INTERVAL: Duration = Duration::from_millis(50);

/// The size of the stack of a thread, in bytes.
const STACK: f64 = (2 << 20) as f64;

/// Numbers of a point, and dimensions, from which one step of the work may take long.
const HEAVY_POINT: usize = 900;
const HEAVY_DIM: usize = 48;

/// Whether work on a space may need to be stopped within one step.
pub fn is_heavy(space: &Erased) -> bool {
    (space.point_len() >= HEAVY_POINT || space.dim() >= HEAVY_DIM) && space.point_shape().len() > 1
}

/// Whether sequential work on this many numbers may take so long that signals must be handled meanwhile.
pub fn is_long(numbers: usize) -> bool {
    numbers > 1 << 14
}

/// The exception for the payload of a panic: a MemoryError if memory is exhausted, and a RuntimeError for any other
/// panic.
pub fn exception(panic: Box<dyn Any + Send>) -> PyErr {
    let panic = match panic.downcast::<OutOfMemory>() {
        Ok(found) => return out_of_memory(found.work, found.bytes, found.remedy),
        Err(other) => other,
    };
    let what = panic.downcast_ref::<String>().map(String::as_str);
    let what = what.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    PyRuntimeError::new_err(format!("this is an error in symspline; please report it: {what}"))
}

/// A user's function that is called with the finished and the total amount of work, of which this is one of several
/// equal parts.
pub struct Progress {
    pub call: Py<PyAny>,
    pub part: usize,
    pub parts: usize,
}

impl Progress {
    pub fn whole(call: Option<Py<PyAny>>) -> Option<Self> {
        call.map(|call| Progress { call, part: 0, parts: 1 })
    }

    fn report(&self, py: Python, finished: usize, total: usize) -> PyResult<()> {
        self.call.call1(py, (self.part * total + finished.min(total), self.parts * total)).map(drop)
    }
}

/// Runs `work` without the GIL. From time to time signals are checked and `progress` is called with
/// the finished and the total number of units; an exception in either stops the work. A panic is a RuntimeError.
/// Raises MemoryError if memory is nearly exhausted.
pub fn watched<T: Send>(
    py: Python,
    progress: Option<Progress>,
    total: usize,
    heavy: bool,
    work: impl FnOnce(&Monitor) -> T + Send,
) -> PyResult<T> {
    watched_serving(py, progress, total, heavy, &|| (), work)
}

/// The same. While heavy work runs in another thread, which may wake this one, this thread also calls `serve`.
pub fn watched_serving<T: Send>(
    py: Python,
    progress: Option<Progress>,
    total: usize,
    heavy: bool,
    serve: &(dyn Fn() + Sync),
    work: impl FnOnce(&Monitor) -> T + Send,
) -> PyResult<T> {
    require_memory(HEADROOM, || ("this computation".into(), "Free some memory"))?;
    let state = Mutex::new((Instant::now(), None::<PyErr>));
    let go_on = |finished: usize| {
        let Ok(mut state) = state.lock() else { return false };
        if state.1.is_some() || state.0.elapsed() < INTERVAL {
            return state.1.is_none();
        }
        let seen = Python::attach(|py| {
            py.check_signals()?;
            progress.as_ref().map_or(Ok(()), |p| p.report(py, finished, total))
        });
        *state = (Instant::now(), seen.err());
        state.1.is_none()
    };
    let monitor = Monitor::new(&go_on);
    let result = py.detach(|| {
        // If address space is scarce, a call that can be interrupted late is better than one that fails.
        if !heavy || !is_free(OF_THREAD) {
            return catch_unwind(AssertUnwindSafe(|| work(&monitor)));
        }
        // One step of this work may take minutes. It runs in another thread, and this thread handles signals.
        let owner = thread::current();
        let finished = AtomicBool::new(false);
        thread::scope(|scope| {
            let worker = thread::Builder::new().spawn_scoped(scope, || {
                let _listening = monitor.listen();
                let result = catch_unwind(AssertUnwindSafe(|| work(&monitor)));
                finished.store(true, Ordering::Release);
                owner.unpark();
                result
            });
            let worker = worker.map_err(|_| -> Box<dyn Any + Send> {
                let remedy = "Free some memory, or end other threads";
                Box::new(OutOfMemory { work: "a thread for the computation", bytes: STACK, remedy })
            })?;
            while !finished.load(Ordering::Acquire) {
                thread::park_timeout(INTERVAL / 5);
                serve();
                monitor.poll();
            }
            worker.join().and_then(|result| result)
        })
    });
    if let Ok(Some(error)) = state.into_inner().map(|s| s.1) {
        return Err(error);
    }
    let result = result.map_err(exception)?;
    if let Some(progress) = progress {
        progress.report(py, total, total)?;
    }
    Ok(result)
}
