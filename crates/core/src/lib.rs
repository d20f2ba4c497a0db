//! The common basis of all spaces of symspline: numbers, small matrices, the traits of a symmetric space, and the
//! fit, evaluation and differentiation of splines on any of them.
//!
//! | module | content |
//! |---|---|
//! | [`scalar`] | numbers: the lanes of a SIMD register, with one derivative or two |
//! | [`special`], [`matrix`], [`tridiagonal`] | special functions, small matrices and their functions, tridiagonal systems |
//! | [`space`] | the traits of a symmetric space, and spaces made of others |
//! | [`rows`], [`validate`] | operations on arrays of points; validation of curves before a fit |
//! | [`fit`] | from points to velocities: the C² condition, its solvers, end conditions |
//! | [`curve`] | evaluation of curves, their derivatives, lengths and energies |
//! | [`search`] | closest points, roots, arrival times |
//! | `derivative` (feature `dense`) | derivatives of a spline with respect to its data |
//! | `laws` (feature `laws`) | tests that every space must pass |
//! | [`parallel`], [`monitor`], [`memory`] | threads, progress and interruption, memory limits |
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
