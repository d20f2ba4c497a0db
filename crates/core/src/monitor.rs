//! Long work that can be watched and stopped.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, ThreadId};

/// Counts finished units of work, and asks its owner from time to time whether to go on.
pub struct Monitor<'a> {
    cancelled: AtomicBool,
    finished: AtomicUsize,
    owner: ThreadId,
    go_on: &'a (dyn Fn(usize) -> bool + Sync),
}

impl<'a> Monitor<'a> {
    /// `go_on` gets the number of finished units and says whether to continue. It is called often,
    /// and only on the thread that made the monitor.
    pub fn new(go_on: &'a (dyn Fn(usize) -> bool + Sync)) -> Self {
        Monitor {
            cancelled: AtomicBool::new(false),
            finished: AtomicUsize::new(0),
            owner: thread::current().id(),
            go_on,
        }
    }

    /// Whether to stop; on the owner's thread it asks.
    pub fn poll(&self) -> bool {
        if thread::current().id() == self.owner && !(self.go_on)(self.finished.load(Ordering::Relaxed)) {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        self.cancelled()
    }

    /// Whether the work was stopped.
    pub fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Counts finished units.
    pub fn advance(&self, units: usize) {
        self.finished.fetch_add(units, Ordering::Relaxed);
    }
}
