//! The threads of [`for_each`](super::for_each).

use crate::monitor::Monitor;
use std::sync::atomic::{AtomicPtr, Ordering};
use std::sync::{Condvar, Mutex};
use std::time::Duration;

/// A pool belongs to one process: after a fork its threads do not exist, and the child creates its own pool. Pools
/// are never freed, since other threads may be using them; there is one for every requested number of threads.
struct Pool {
    process: u32,
    threads: usize,
    pool: rayon::ThreadPool,
    older: Option<&'static Pool>,
}

static POOL: AtomicPtr<Pool> = AtomicPtr::new(std::ptr::null_mut());

/// The pool with this many threads.
pub fn pool(threads: usize) -> Option<&'static rayon::ThreadPool> {
    // Stored pools are leaked and therefore remain valid.
    #[allow(unsafe_code)]
    let newest: Option<&'static Pool> = unsafe { POOL.load(Ordering::Acquire).as_ref() };
    let mut next = newest;
    while let Some(found) = next {
        if found.process == std::process::id() && found.threads == threads {
            return Some(&found.pool);
        }
        next = found.older;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()?;
    let made = Box::leak(Box::new(Pool { process: std::process::id(), threads, pool, older: newest }));
    POOL.store(made, Ordering::Release);
    Some(&made.pool)
}

/// Whether this is a thread of a pool.
pub fn is_member() -> bool {
    rayon::current_thread_index().is_some()
}

/// Calls `work` on every item, on the threads of a pool. Stops early if the monitor is cancelled.
pub fn for_each<T: Send>(
    pool: &rayon::ThreadPool,
    threads: usize,
    items: Vec<T>,
    monitor: &Monitor,
    work: impl Fn(T) + Sync,
) {
    let queue = Mutex::new(items.into_iter());
    let (busy, wake) = (Mutex::new(threads), Condvar::new());
    pool.in_place_scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|_| {
                let _done = Done { queue: &queue, busy: &busy, wake: &wake };
                let _listening = monitor.listen();
                while !monitor.cancelled()
                    && let Some(item) = take(&queue)
                {
                    work(item);
                }
            });
        }
        // When a thread panics the scope passes it on, once all have stopped.
        // The caller's thread only monitors, because only this thread may call `go_on`. It does so without the lock,
        // because the answer may have to wait for threads that wait for the workers.
        let working = || {
            let left = busy.lock().unwrap_or_else(|e| e.into_inner());
            if *left == 0 {
                return false;
            }
            let (left, _) =
                wake.wait_timeout(left, Duration::from_millis(20)).unwrap_or_else(|e| e.into_inner());
            *left > 0
        };
        while working() {
            monitor.poll();
        }
    });
}

fn take<T>(queue: &Mutex<std::vec::IntoIter<T>>) -> Option<T> {
    queue.lock().unwrap_or_else(|e| e.into_inner()).next()
}

/// Signals that a thread has stopped, including by a panic: then no further item is started.
struct Done<'a, T> {
    queue: &'a Mutex<std::vec::IntoIter<T>>,
    busy: &'a Mutex<usize>,
    wake: &'a Condvar,
}

impl<T> Drop for Done<'_, T> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            *self.queue.lock().unwrap_or_else(|e| e.into_inner()) = Vec::new().into_iter();
        }
        *self.busy.lock().unwrap_or_else(|e| e.into_inner()) -= 1;
        self.wake.notify_one();
    }
}
