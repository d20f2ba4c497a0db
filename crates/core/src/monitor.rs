//! Progress and cancellation of long computations.

use std::cell::RefCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, ThreadId};

/// Counts finished units of work, and asks its owner from time to time whether to continue.
pub struct Monitor<'a> {
    cancelled: Arc<AtomicBool>,
    finished: AtomicUsize,
    owner: ThreadId,
    go_on: &'a (dyn Fn(usize) -> bool + Sync),
}

impl<'a> Monitor<'a> {
    /// `go_on` receives the number of finished units and returns whether to continue. It is called often, and only on
    /// the thread that created the monitor. If this thread listens to another monitor, work that one cancels is
    /// cancelled here, too.
    pub fn new(go_on: &'a (dyn Fn(usize) -> bool + Sync)) -> Self {
        Monitor {
            cancelled: STOP.with_borrow(Clone::clone).unwrap_or_default(),
            finished: AtomicUsize::new(0),
            owner: thread::current().id(),
            go_on,
        }
    }

    /// Whether to stop. On the owner's thread this calls `go_on`.
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

    /// Connects [`checkpoint`] on this thread to this monitor for the lifetime of the result. It is for threads whose
    /// owner waits elsewhere; on the owner's own thread nothing would call `go_on` meanwhile.
    pub fn listen(&self) -> Listening {
        Listening(STOP.replace(Some(self.cancelled.clone())))
    }
}

thread_local! {
    static STOP: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Ends the effect of [`Monitor::listen`].
pub struct Listening(Option<Arc<AtomicBool>>);

impl Drop for Listening {
    fn drop(&mut self) {
        STOP.set(self.0.take());
    }
}

/// The payload with which a cancelled [`checkpoint`] unwinds.
pub struct Cancelled;

/// Must be called within long loops that cannot return early: products and factorisations of large matrices. If the
/// work was cancelled, it unwinds with [`Cancelled`], without a message.
pub fn checkpoint() {
    let stop = STOP.with_borrow(|stop| stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed)));
    if stop {
        resume_unwind(Box::new(Cancelled));
    }
}
