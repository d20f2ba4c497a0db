//! Curves: Bézier segments and their evaluation.

mod bezier;
mod bspline;
mod collocation;
mod evaluate;
mod lift;
mod locate;
mod places;
mod transport;

pub use bezier::Segment;
pub use bspline::{BSpline, evaluate_bspline};
pub use evaluate::{Curves, Job, Outside, Quantity, Times, evaluate};
pub use lift::{lift, lift_knots};
pub use transport::transport;
