//! C² cubic splines on symmetric spaces.
//!
//! The method of Bogfjellmo, Modin and Verdier, *A Numerical Algorithm for C²-splines on Symmetric
//! Spaces* (2018, SIAM J. Numer. Anal. 56(4)). Equation numbers in this crate are that paper's.
//!
//! A curve is three plain arrays: knots t, points p and velocities u = γ'(t). [`fit`] finds the
//! velocities, [`curve`] evaluates, [`space`] is the geometry.

pub mod curve;
pub mod derivative;
pub mod fit;
pub mod matrix;
pub mod monitor;
pub mod parallel;
pub mod rows;
pub mod scalar;
pub mod space;
pub mod special;
