//! Curves: Bézier segments and their evaluation.

mod bezier;
mod bspline;
mod chebyshev;
mod collocation;
mod cumulative;
pub(crate) mod data;
mod evaluate;
mod jerk;
mod length;
#[cfg(feature = "dense")]
mod lift;
mod locate;
mod motion;
mod product;
#[cfg(feature = "dense")]
mod riemannian;
mod sample_cursor;
mod transport;

pub use bezier::Segment;
pub use bspline::evaluate_bspline;
pub use cumulative::{Coordinates, Multiplication, cumulative_basis, cumulative_steps};
pub use data::{BSpline, Curves, Job, LastSegment, Moving, Outside, Quantity, Times, motion_len};
pub use evaluate::{evaluate, evaluate_point};
#[cfg(feature = "dense")]
pub use jerk::Connection;
pub use length::{ArcLength, Integrand, energies, lengths};
#[cfg(feature = "dense")]
pub use lift::{lift, lift_knots};
#[doc(hidden)]
pub use locate::Locator;
pub use product::{Factor, evaluate_product};
#[cfg(feature = "dense")]
pub use riemannian::{CubicRule, Curvature, Segments};
pub use transport::transport;
