//! Splines over grids: C² interpolation over several parameters.
//!
//! The value at `(x₀, …, x_{D−1})` is computed axis after axis. Splines along axis 0 through every row of nodes,
//! evaluated at x₀, give nodes over the other axes; splines along axis 1 through these, evaluated at x₁, give nodes
//! over the axes that are left, and so on. In flat space this is the tensor-product spline. As a composition of C² maps
//! the result is C² in every parameter.
//!
//! Nodes whose first number is NaN are missing. They divide rows into runs, each with its own spline; a value outside
//! the runs of a row is NaN, and is a missing node for the next axis.

mod axis;
mod batch;
mod grid;
mod midpoint;
mod product;
mod rows;
mod samples;
mod scattered;
mod stages;
mod summary;
mod window;

pub use axis::{Axis, Condition};
pub use grid::{Derivative, Grid};
pub use midpoint::midpoint;
pub use product::product;
pub use rows::fit_rows;
pub use scattered::scattered;
pub use summary::{AxisFault, Summary};
