//! Independent items of work on all cores.

#[cfg(feature = "rayon")]
mod pool;

use crate::monitor::Monitor;
use crate::scalar::LANES;
use std::sync::atomic::{AtomicUsize, Ordering};
#[cfg(feature = "rayon")]
use std::time::{Duration, Instant};

static THREADS: AtomicUsize = AtomicUsize::new(0);

/// Limits the number of threads; 0 means all cores.
pub fn set_num_threads(n: usize) {
    THREADS.store(n, Ordering::Relaxed);
}

/// The number of threads that parallel work uses: 1 without the feature `rayon`.
pub fn num_threads() -> usize {
    if cfg!(not(feature = "rayon")) {
        return 1;
    }
    match THREADS.load(Ordering::Relaxed) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    }
}

/// The number of rows of `len` numbers per item of work: at most `most`, and so few for long rows that cancellation
/// is quick. A multiple of the number of lanes.
pub fn block(most: usize, len: usize) -> usize {
    (most * 4 / len.max(4)).max(1).next_multiple_of(LANES).min(most)
}

/// The time after which the calling thread decides whether the items that are left are worth other threads, and the
/// work that is: starting them takes some ten microseconds.
#[cfg(feature = "rayon")]
const TRIAL: Duration = Duration::from_micros(40);
#[cfg(feature = "rayon")]
const WORTH: f64 = 120e-6;

/// Calls `work` on every item, on all cores if that is faster: at once if `long` is true, otherwise if the first items
/// took so long that the others will, too. Stops early if the monitor is cancelled.
pub fn for_each<T: Send>(items: Vec<T>, long: bool, monitor: &Monitor, work: impl Fn(T) + Sync) {
    #[cfg_attr(not(feature = "rayon"), expect(unused_mut))]
    let mut items = items.into_iter();
    // Reading the clock takes as long as a small item.
    #[cfg(feature = "rayon")]
    if items.len() > 1 {
        let (start, count) = (Instant::now(), items.len());
        let mut tried = long;
        loop {
            if tried {
                let rest = items.len();
                let left = start.elapsed().as_secs_f64() / (count - rest).max(1) as f64 * rest as f64;
                // To determine the number of cores the system reads files, which takes longer than a small fit.
                // A thread of the pool that waited for others could wait for itself.
                if rest > 1
                    && (long || left > WORTH)
                    && !pool::is_member()
                    && let cores = num_threads()
                    && cores > 1
                    && let Some(pool) = pool::pool(cores)
                {
                    return pool::for_each(&pool, cores.min(rest), items.collect(), monitor, work);
                }
                break;
            }
            let Some(item) = items.next() else { return };
            if monitor.poll() {
                return;
            }
            work(item);
            tried = start.elapsed() > TRIAL;
        }
    }
    let _ = long;
    for item in items {
        if monitor.poll() {
            return;
        }
        work(item);
    }
}

#[cfg(all(test, feature = "rayon"))]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::{Condvar, Mutex, mpsc};

    /// Runs items of which the last two wait for each other; returns how many met the other one.
    fn meetings(items: usize, long: bool) -> usize {
        set_num_threads(2);
        let quiet = |_| true;
        let both = (Mutex::new(0), Condvar::new());
        let met = AtomicUsize::new(0);
        for_each((0..items).rev().collect(), long, &Monitor::new(&quiet), |item: usize| {
            if item > 1 {
                return std::thread::sleep(Duration::from_millis(2));
            }
            *both.0.lock().unwrap() += 1;
            both.1.notify_all();
            let here = both.0.lock().unwrap();
            let wait = both.1.wait_timeout_while(here, Duration::from_secs(5), |here| *here < 2);
            met.fetch_add(usize::from(!wait.unwrap().1.timed_out()), Ordering::Relaxed);
        });
        met.into_inner()
    }

    #[test]
    fn two_items_run_concurrently() {
        assert_eq!(meetings(2, true), 2);
    }

    #[test]
    fn work_within_work_ends() {
        set_num_threads(2);
        let quiet = |_| true;
        let (send, receive) = mpsc::channel();
        std::thread::spawn(move || {
            let monitor = Monitor::new(&quiet);
            for_each(vec![(); 4], true, &monitor, |()| {
                for_each(vec![(); 4], true, &monitor, |()| std::thread::sleep(Duration::from_millis(2)));
            });
            let _ = send.send(());
        });
        receive.recv_timeout(Duration::from_secs(5)).expect("the call returns");
    }

    #[test]
    fn items_run_concurrently_if_the_first_one_takes_long() {
        assert_eq!(meetings(3, false), 2);
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
