//! Functions of matrices of any size, compiled once.
//!
//! Generic code is compiled again in every crate that calls it. All families of spaces call these functions for their
//! larger members, where a call through a pointer costs nothing beside them; without this table they were a tenth of the
//! machine code.

use super::{Dynamic, Matrix, Storage, series};
use crate::scalar::{Dual, Jet, Lane, Scalar};
use std::any::Any;

type Function<S, const D: usize, A> = fn(&Matrix<S, D, A>) -> Matrix<S, D, A>;
type Functions<S, const D: usize, A> = fn(&Matrix<S, D, A>) -> [Matrix<S, D, A>; 2];
type Product<S, const D: usize, A> = fn(&Matrix<S, D, A>, &Matrix<S, D, A>) -> Matrix<S, D, A>;
type Choice<S, const D: usize, A> = fn(Lane, &Matrix<S, D, A>, &Matrix<S, D, A>) -> Matrix<S, D, A>;

/// The functions, by their names; those that end with `_here` are compiled where they are called.
pub struct Compiled<S: Scalar, const D: usize, A: Storage> {
    pub(super) times: Product<S, D, A>,
    pub(super) adjoint_times: Product<S, D, A>,
    pub(super) times_adjoint: Product<S, D, A>,
    pub(super) times_adjoint_hermitian: Product<S, D, A>,
    pub(super) compose: Product<S, D, A>,
    pub(super) plus: Product<S, D, A>,
    pub(super) minus: Product<S, D, A>,
    pub(super) scaled: fn(&Matrix<S, D, A>, Lane) -> Matrix<S, D, A>,
    pub(super) select: Choice<S, D, A>,
    pub(super) trig: Functions<S, D, A>,
    pub(super) exp_minus_one: Function<S, D, A>,
    pub(super) log_one_plus: Function<S, D, A>,
    pub(super) arc: Function<S, D, A>,
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
