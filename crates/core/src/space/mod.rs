//! The traits of a symmetric space: the paper's §2.1–2.4, in three parts.
//!
//! * [`Ambient`]: arrays as users have them: exponential, logarithm, geodesic, transvection. Users call these
//!   functions, and they evaluate a curve.
//! * [`Frame`]: a *moving frame*, an element g of the group with g·o = p, transported in parallel from point to point.
//!   In frames every tangent vector is a coordinate vector of 𝔪 = T_oM and parallel transport is the identity.
//! * [`Origin`]: the origin o, in coordinates of 𝔪. The C² condition is solved there.
//!
//! A [`Space`] implements all three. Solvers use it as [`Erased`], through a table of function pointers in two
//! layers: [`Geometry`] contains the formulas, [`Kernels`] adds the loops over knots and samples that use them.

mod algebra;
mod delegate;
mod erased;
mod far_out;
mod isometric;
mod model;
mod part;
mod registry;
mod traits;

pub use algebra::{Algebra, stretch_series};
pub use erased::{Erased, Geometry, Kernels};
pub use far_out::far_out;
pub use isometric::{Isometric, Isometry};
pub use model::Model;
pub use part::{Part, Within};
pub use registry::{Entry, Made, table};
pub use traits::{
    Ambient, Covered, Evaluation, Frame, Origin, ROUNDING_SIZE, Space, below, pull_back_by_transport,
};
