//! Spaces by name.

use super::erased::Kernels;
use std::sync::Arc;

/// A space with parameters, or why they are invalid.
pub type Made = Result<Arc<dyn Kernels>, String>;

/// A kind of space, as an entry in the list of a family.
pub struct Entry {
    /// Its names, the canonical one first.
    pub names: &'static [&'static str],
    /// The names of its parameters.
    pub parameters: &'static [&'static str],
    /// Creates the space from as many parameters as there are names. Common sizes select specialised code.
    pub make: fn(&[usize]) -> Made,
}

/// A space as its table of operations.
pub fn table<M: Kernels + 'static>(space: Result<M, String>) -> Made {
    Ok(Arc::new(space?))
}
