//! Spaces whose points are vectors: flat space, spheres and hyperbolic space.

pub mod constant_curvature;
mod curved;
mod euclidean;
mod hyperbolic;
mod sphere;

pub use curved::Curved;
pub use euclidean::Euclidean;
pub use hyperbolic::Hyperbolic;
pub use sphere::Sphere;

use symspline_core::space::{Entry, table};

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry { names: &["euclidean", "r"], parameters: &["n"], make: |p| table(Euclidean::new(p[0])) },
    Entry { names: &["sphere", "s"], parameters: &["n"], make: |p| table(Sphere::new(p[0])) },
    Entry { names: &["hyperbolic", "h"], parameters: &["n"], make: |p| table(Hyperbolic::new(p[0])) },
];
