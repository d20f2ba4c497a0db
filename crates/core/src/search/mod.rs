//! Searches along curves: the nearest points, roots of functions of time, and the fastest traversal.

mod closest;
mod on_curves;
mod roots;
mod time_law;

pub use closest::{Distances, Nearest, TimeSamples, closest};
pub use on_curves::{Targets, closest_on_curves};
pub use roots::{Bracket, roots};
pub use time_law::Path;
