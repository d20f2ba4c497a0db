//! Spaces by name.

use super::erased::Kernels;
use std::sync::Arc;

/// A space with parameters, or why they are bad.
pub type Made = Result<Arc<dyn Kernels>, String>;

/// A kind of space, as a family lists it.
pub struct Entry {
    /// Its names, the canonical one first.
    pub names: &'static [&'static str],
    /// The names of its parameters.
    pub parameters: &'static [&'static str],
    /// Makes it; gets as many parameters as there are names. Here sizes that have code of their own get it.
    pub make: fn(&[usize]) -> Made,
}

/// A space as its table of operations.
pub fn table<M: Kernels + 'static>(space: Result<M, String>) -> Made {
    Ok(Arc::new(space?))
}
