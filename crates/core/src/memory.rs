//! Tests of the available memory before long computations, because Rust aborts the process if memory is exhausted.

use std::panic::resume_unwind;

/// Memory for up to this many numbers is assumed to be available.
const SMALL: f64 = (1 << 16) as f64;

/// The numbers that should be free before any computation, for all its small allocations together: 4 MiB.
pub const HEADROOM: f64 = (1 << 19) as f64;

/// The address space that a thread needs at its start, in numbers: the GNU C library reserves 64 MiB for its
/// allocations, aligned to 64 MiB. Without it, each small allocation would take a page, or the thread could not start.
pub const OF_THREAD: f64 = (144 << 17) as f64;

/// The payload with which [`require`] unwinds.
pub struct OutOfMemory {
    /// A description of the computation, such as "smoothing".
    pub work: &'static str,
    /// The approximate memory that it needs.
    pub bytes: f64,
    /// The remedy, as an imperative.
    pub remedy: &'static str,
}

/// The number of bytes of this many floating-point numbers.
pub fn bytes(numbers: f64) -> f64 {
    numbers * size_of::<f64>() as f64
}

/// Whether memory for approximately this many numbers is available.
pub fn is_free(numbers: f64) -> bool {
    numbers <= SMALL
        || bytes(numbers) < isize::MAX as f64 && Vec::<f64>::new().try_reserve_exact(numbers as usize).is_ok()
}

/// Unwinds with [`OutOfMemory`], without a message, unless memory for approximately this many numbers is available.
pub fn require(numbers: f64, work: &'static str, remedy: &'static str) {
    if !is_free(numbers) {
        resume_unwind(Box::new(OutOfMemory { work, bytes: bytes(numbers), remedy }));
    }
}
