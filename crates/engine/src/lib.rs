//! All spaces of symspline by name, and its solvers, for bindings to other languages.
//!
//! A curve consists of three arrays: knots t, points p and velocities u = γ'(t). [`fit`] computes the velocities,
//! [`curve`] evaluates curves, [`space`] contains the geometry, and [`spaces`] lists all spaces. [`derivative`]
//! computes the sensitivity of a curve to its data, [`search`] finds its nearest points to others, [`smoothing`] fits curves close to noisy points, [`grid`]
//! interpolates over several parameters. Arrays are
//! one-dimensional: the numbers of each point are adjacent, matrices row by row, point after point.
//!
//! [`fit`] does not check its input: pass a problem to [`validate::validate`] first. It describes the first fault, or
//! returns the points projected onto their space. Programs in Rust use the crate `symspline`, which does that.

pub mod spaces;

#[cfg(feature = "grid")]
pub use symspline_grid as grid;
#[cfg(feature = "smoothing")]
pub use symspline_smoothing as smoothing;

#[cfg(feature = "dense")]
pub use symspline_core::derivative;
#[cfg(feature = "laws")]
pub use symspline_core::laws;
pub use symspline_core::{
    curve, fit, matrix, memory, monitor, parallel, rows, scalar, search, space, special, tridiagonal,
    validate,
};
