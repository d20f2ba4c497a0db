//! Curves: Bézier segments and their evaluation.

mod bezier;
mod evaluate;
mod locate;

pub use bezier::Segment;
pub use evaluate::{Curves, Outside, Quantity, Times, evaluate};
