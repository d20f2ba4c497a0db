//! Small dense matrices over lanes, jets and duals, real and complex.
//!
//! An entry is `[S; D]`: a real number for D = 1, real and imaginary part for D = 2. Every formula is
//! written once for both.

mod base;
mod blocked;
mod compiled;
mod dense;
mod eigen;
mod entry;
mod function;
#[cfg(feature = "dense")]
mod general;
mod inverse;
#[cfg(feature = "dense")]
mod large;
mod moved;
mod products;
#[cfg(feature = "dense")]
mod schur;
mod select;
mod series;
mod storage;

pub use base::{Compiled, Dynamic, Matrix, Storage};
pub use dense::{cholesky, determinant, orthonormalize, reorthonormalize, solve_lower};
pub use eigen::{diagonalize, orthogonalize, sort_columns};
pub use entry::{Entry, multiply_add};
pub(crate) use function::GAUSS;
pub use function::{Unary, from_parts, function_of, parts_of, polar};
#[cfg(feature = "dense")]
pub use general::{exp_any_minus_one, log_any_one_plus};
pub use inverse::inverse;
pub use moved::Moved;
#[cfg(feature = "dense")]
pub use schur::{largest_argument, largest_imaginary};
pub use select::{Select, by_size};
pub use series::{
    SINE_LIMIT, arc, exp_minus_one, exp_skew_minus_one, has_angles, log_by_sine, log_one_plus,
    log_one_plus_alike, trig,
};
pub use storage::{Known, Small};
