//! The threads of [`for_each`](super::for_each).

use crate::memory;
use crate::monitor::Monitor;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicPtr, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// The pool of a process, with its number of threads. A pool with another number of threads replaces it; the threads of
/// the old one end when no work uses them any more.
struct Owner {
    process: u32,
    pool: Mutex<Option<(usize, Arc<ThreadPool>)>>,
}

/// After a fork, the threads of the pool do not exist in the child, and its mutex may be locked forever. The child
/// therefore leaks its parent's owner and creates another one.
static OWNER: AtomicPtr<Owner> = AtomicPtr::new(std::ptr::null_mut());

fn owner() -> &'static Owner {
    // Stored owners are leaked and therefore remain valid.
    #[allow(unsafe_code)]
    let found: Option<&'static Owner> = unsafe { OWNER.load(Ordering::Acquire).as_ref() };
    let process = std::process::id();
    if let Some(found) = found.filter(|found| found.process == process) {
        return found;
    }
    let made = Box::leak(Box::new(Owner { process, pool: Mutex::default() }));
    OWNER.store(made, Ordering::Release);
    made
}

/// The pool with this many threads; None if memory is too scarce for them.
pub fn pool(threads: usize) -> Option<Arc<ThreadPool>> {
    let mut current = owner().pool.lock().unwrap_or_else(|e| e.into_inner());
    if let Some((_, pool)) = current.as_ref().filter(|(count, _)| *count == threads) {
        return Some(pool.clone());
    }
    if !memory::is_free(memory::OF_THREAD) {
        return None;
    }
    let made = Arc::new(ThreadPoolBuilder::new().num_threads(threads).build().ok()?);
    let old = current.replace((threads, made.clone()));
    drop(current);
    drop(old);
    Some(made)
}

/// Whether this is a thread of a pool.
pub fn is_member() -> bool {
    rayon::current_thread_index().is_some()
}

/// Calls `work` on every item, on the threads of a pool. Stops early if the monitor is cancelled.
pub fn for_each<T: Send>(
    pool: &ThreadPool,
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
