//! Spaces of your own: implement [`Model`], and use the space as [`Custom`].
//!
//! The example `custom_space` of this crate implements the circle of the angles of a joint.

use crate::error::Error;
use crate::point::Point;
use crate::space::{Factor, Table};
use std::fmt;
use std::sync::Arc;

#[doc(no_inline)]
pub use symspline_engine::scalar::{Lane, Scalar, lane};
#[doc(no_inline)]
pub use symspline_engine::space::Model;
#[doc(no_inline)]
pub use symspline_engine::special::Trig;

/// A space that is given by the formulas of a [`Model`]. Points are vectors of numbers.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Custom<M>(pub M);

impl<M> fmt::Debug for Custom<M> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Custom({})", std::any::type_name::<M>())
    }
}

impl<M: Model + 'static> Factor for Custom<M> {
    fn table(&self) -> Result<Table, Error> {
        Ok(Arc::new(self.0))
    }
}

impl<M: Model + 'static> Point<Custom<M>> for Vec<f64> {
    type Tangent = Vec<f64>;
}
