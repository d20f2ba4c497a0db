//! What the spaces of symspline share: numbers, small matrices, the traits of a symmetric space, and the
//! fit, evaluation and differentiation of splines on any of them.
//!
//! Solvers know a space by its table of operations only ([`space::Erased`]), so that they are compiled once.

pub mod curve;
pub mod derivative;
pub mod fit;
#[cfg(feature = "laws")]
pub mod laws;
pub mod matrix;
pub mod monitor;
pub mod parallel;
pub mod rows;
pub mod scalar;
pub mod space;
pub mod special;
