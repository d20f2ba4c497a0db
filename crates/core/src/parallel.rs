//! Independent items of work on all cores.

use crate::monitor::Monitor;
use crate::scalar::LANES;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering};
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
static THREADS: AtomicUsize = AtomicUsize::new(0);

/// Limits the number of threads; 0 means all cores.
pub fn set_num_threads(n: usize) {
    THREADS.store(n, Ordering::Relaxed);
}

/// The number of threads that parallel work uses.
pub fn num_threads() -> usize {
    match THREADS.load(Ordering::Relaxed) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    }
}

fn pool(threads: usize) -> Option<&'static rayon::ThreadPool> {
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

/// The number of rows of `len` numbers per item of work: at most `most`, and so few for long rows that cancellation
/// is quick. A multiple of the number of lanes.
pub fn block(most: usize, len: usize) -> usize {
    (most * 4 / len.max(4)).max(1).next_multiple_of(LANES).min(most)
}

/// Calls `work` on every item, on all cores if `parallel` is true. Stops early if the monitor is cancelled.
pub fn for_each<T: Send>(items: Vec<T>, parallel: bool, monitor: &Monitor, work: impl Fn(T) + Sync) {
    // To determine the number of cores the system reads files, which takes longer than a small fit.
    let cores = if parallel && items.len() > 1 { num_threads() } else { 1 };
    let threads = cores.min(items.len());
    let pool = if cores > 1 { pool(cores) } else { None };
    let Some(pool) = pool else {
        for item in items {
            if monitor.poll() {
                return;
            }
            work(item);
        }
        return;
    };
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::mpsc;

    #[test]
    fn two_items_run_concurrently() {
        set_num_threads(2);
        let quiet = |_| true;
        let both = (Mutex::new(0), Condvar::new());
        let met = AtomicUsize::new(0);
        // Each item waits for the other.
        for_each(vec![(); 2], true, &Monitor::new(&quiet), |()| {
            *both.0.lock().unwrap() += 1;
            both.1.notify_all();
            let here = both.0.lock().unwrap();
            let wait = both.1.wait_timeout_while(here, Duration::from_secs(5), |here| *here < 2);
            met.fetch_add(usize::from(!wait.unwrap().1.timed_out()), Ordering::Relaxed);
        });
        assert_eq!(met.into_inner(), 2);
    }

    #[test]
    fn a_panic_of_a_thread_reaches_the_caller_at_once() {
        set_num_threads(2);
        let (send, receive) = mpsc::channel();
        std::thread::spawn(move || {
            let quiet = |_| true;
            let begun = AtomicUsize::new(0);
            let work = |i: usize| {
                begun.fetch_add(1, Ordering::Relaxed);
                assert!(i != 3, "the fourth item");
                std::thread::sleep(Duration::from_millis(5));
            };
            let run = || for_each((0..10_000).collect(), true, &Monitor::new(&quiet), work);
            let failed = catch_unwind(AssertUnwindSafe(run)).is_err();
            // Nobody listens any more if this comes too late.
            let _ = send.send((failed, begun.load(Ordering::Relaxed)));
        });
        let (failed, begun) = receive.recv_timeout(Duration::from_secs(2)).expect("the call returns");
        // The other threads continue while the panic and its backtrace are printed, which takes some tenths of a
        // second.
        assert!(failed && begun < 1000);
    }
}
