//! The violation of a law.

use crate::scalar::Lane;

/// The violation that a law found.
pub type Verdict = Result<(), String>;

/// The largest lane of `found`, if it exceeds `allowed`.
pub fn within(found: Lane, allowed: Lane, what: &str) -> Verdict {
    let (found, allowed) = (found.to_array(), allowed.to_array());
    for (f, a) in found.into_iter().zip(allowed) {
        if !(f <= a) {
            return Err(format!("{what}: {f:.2e} where {a:.2e} is allowed"));
        }
    }
    Ok(())
}
