//! The common basis of all spaces of symspline: numbers, small matrices, the traits of a symmetric space, and the
//! fit, evaluation and differentiation of splines on any of them.
//!
//! Solvers call a space through its table of operations ([`space::Erased`]), so that they are compiled once. The loops
//! over knots and samples in that table are implemented in `kernels`, above `fit` and `curve`.

pub mod curve;
#[cfg(feature = "dense")]
pub mod derivative;
pub mod fit;
mod kernels;
#[cfg(feature = "laws")]
pub mod laws;
pub mod matrix;
pub mod memory;
pub mod monitor;
pub mod parallel;
pub mod rows;
pub mod scalar;
pub mod search;
pub mod space;
pub mod special;
pub mod tridiagonal;
pub mod validate;
