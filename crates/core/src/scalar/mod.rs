//! The number types of formulas.
//!
//! Every formula is written once, generic over [`Scalar`]. A [`Lane`] consists of [`LANES`] floating-point numbers (of
//! as many samples, curves or sections of a curve) in SIMD lanes, a [`Jet`] has two derivatives in t, and a [`Dual`] one
//! derivative in any direction. A single number is padded to a lane, so that one curve and a batch of curves give
//! bit-identical results.

mod base;
mod dual;
mod few;
mod jet;
mod rows;
mod types;

pub use base::{Scalar, dot, lane, mask_bits, mask_from, max_or_nan};
pub use few::{Each, few};
pub use rows::{gather, scatter, scatter_apart};
pub use types::{Dual, Jet, LANES, Lane, Row, RowMut};

/// Runs an expression with the size of a space as a constant if it is a common small one: loops over coordinates are
/// then unrolled, and small vectors stay in registers. That is faster for spaces of vectors
/// ([`Space::VECTORS`](crate::space::Space::VECTORS)), and would only duplicate the code of others.
#[macro_export]
macro_rules! with_size {
    ($pays:expr, $size:expr, $m:ident => $body:expr) => {
        match $size {
            2 if $pays => {
                let $m = 2;
                $body
            }
            3 if $pays => {
                let $m = 3;
                $body
            }
            4 if $pays => {
                let $m = 4;
                $body
            }
            $m => $body,
        }
    };
}
