//! Curves: Bézier segments and their evaluation.

mod bezier;
mod bspline;
mod evaluate;
mod locate;
mod places;

pub use bezier::Segment;
pub use bspline::{BSpline, evaluate_bspline};
pub use evaluate::{Curves, Job, Outside, Quantity, Times, evaluate};
