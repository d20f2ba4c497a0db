//! Functions of matrices of any size, compiled once.
//!
//! Generic code is compiled again in every crate that calls it. All families of spaces call these functions for their
//! larger members, where the cost of a call through a pointer is negligible. Without this table they were a tenth of
//! the machine code.

use super::base::{Compiled, Dynamic, Matrix, Storage};
use super::series;
use crate::scalar::{Dual, Jet, Lane, Scalar};
use smallvec::{SmallVec, smallvec};
use std::any::Any;

impl Storage for Dynamic {
    const ANY: bool = true;
    type Shape = (usize, usize);
    type Of<T: Copy> = SmallVec<[T; 16]>;
    fn shape(rows: usize, cols: usize) -> Self::Shape {
        (rows, cols)
    }
    #[inline(always)]
    fn size(shape: Self::Shape) -> (usize, usize) {
        shape
    }
    fn filled<T: Copy>((rows, cols): Self::Shape, x: T) -> Self::Of<T> {
        smallvec![x; rows * cols]
    }
    #[inline(always)]
    fn collected<T: Copy>((rows, cols): Self::Shape, _: T, f: impl FnMut(usize) -> T) -> Self::Of<T> {
        (0..rows * cols).map(f).collect()
    }
    #[inline(always)]
    fn compiled<S: Scalar, const D: usize>() -> &'static Compiled<S, D, Self> {
        Compiled::table()
    }
}

impl<S: Scalar, const D: usize> Compiled<S, D, Dynamic> {
    const fn new() -> Self {
        Compiled {
            times: Matrix::times_here,
            adjoint_times: Matrix::adjoint_times_here,
            times_adjoint: Matrix::times_adjoint_here,
            times_adjoint_hermitian: Matrix::times_adjoint_hermitian_here,
            compose: Matrix::compose_here,
            plus: Matrix::plus_here,
            minus: Matrix::minus_here,
            scaled: Matrix::scaled_here,
            select: Matrix::select_here,
            trig: series::trig_here,
            exp_minus_one: series::exp_minus_one_here,
            log_one_plus: series::log_one_plus_here,
            arc: series::arc_here,
        }
    }

    /// The table of matrices of any size.
    #[inline(always)]
    pub(super) fn table() -> &'static Self {
        macro_rules! one_of {
            ($($name:ident: $scalar:ty, $d:literal;)*) => {{
                $(static $name: Compiled<$scalar, $d, Dynamic> = Compiled::new();
                if let Some(own) = (&$name as &dyn Any).downcast_ref() {
                    return own;
                })*
                unreachable!("these are all kinds of numbers")
            }};
        }
        one_of! {
            REAL: Lane, 1;
            REAL_DUAL: Dual, 1;
            REAL_JET: Jet, 1;
            COMPLEX: Lane, 2;
            COMPLEX_DUAL: Dual, 2;
            COMPLEX_JET: Jet, 2;
        }
    }
}
