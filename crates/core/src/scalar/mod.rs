//! The numbers a formula is written over.
//!
//! Every formula is written once, generic over [`Scalar`]: a [`Lane`] is eight doubles side by side
//! (eight samples, curves or sections of a curve), a [`Jet`] carries two derivatives in t along, a
//! [`Dual`] one derivative in any direction. A lone number is padded into a lane, so that one curve
//! and a batch of curves give bit-identical results.

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

/// Runs an expression with a size of a space as a constant where it is a common small one: inlined into
/// it, loops over coordinates unroll and small vectors stay in registers. That pays for spaces of
/// vectors ([`Space::VECTORS`](crate::space::Space::VECTORS)), and would only multiply the code of others.
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
