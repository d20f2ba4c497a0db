//! symspline for JavaScript: the compiled module of the npm package `symspline`.
//!
//! Arrays are flat: the numbers of each point are adjacent, point after point. The package's own JavaScript, in
//! `packaging/npm`, accepts nested arrays, reads options and turns a [`Fault`] into an exception.

mod family;
mod fault;
mod space;
mod spline;

pub use fault::Fault;
pub use space::Space;
pub use spline::{Ends, Spline};
