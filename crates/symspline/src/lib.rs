//! C² cubic splines on symmetric spaces.
//!
//! The method of Bogfjellmo, Modin and Verdier, *A Numerical Algorithm for C²-splines on Symmetric
//! Spaces* (2018, SIAM J. Numer. Anal. 56(4)). Equation numbers in these crates are that paper's.
//!
//! A curve is three plain arrays: knots t, points p and velocities u = γ'(t). [`fit`] finds the
//! velocities, [`curve`] evaluates, [`space`] is the geometry, [`spaces`] the list of all spaces.

pub mod spaces;

pub use symspline_smoothing as smoothing;

pub use symspline_core::{
    curve, derivative, fit, laws, matrix, monitor, parallel, rows, scalar, space, special,
};
