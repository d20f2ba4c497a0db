//! Spaces whose points are vectors: flat space, tori, spheres, hyperbolic, de Sitter and anti-de Sitter space.

pub mod constant_curvature;
mod curved;
mod flat;
mod hyperbolic;
mod lorentzian;
mod sphere;

pub use curved::{AntiDeSitter, Curved, DeSitter, Hyperbolic, Sphere};
pub use flat::{Euclidean, Flat, Torus};

#[cfg(feature = "named")]
use symspline_core::space::{Entry, table};

/// The spaces of this family.
#[cfg(feature = "named")]
pub static FAMILY: &[Entry] = &[
    Entry { names: &["euclidean", "r"], parameters: &["n"], make: |p| table(Euclidean::new(p[0])) },
    Entry { names: &["torus"], parameters: &["n"], make: |p| table(Torus::new(p[0])) },
    Entry { names: &["sphere", "s"], parameters: &["n"], make: |p| table(Sphere::new(p[0])) },
    Entry { names: &["hyperbolic", "h"], parameters: &["n"], make: |p| table(Hyperbolic::new(p[0])) },
    Entry { names: &["ds", "de-sitter"], parameters: &["n"], make: |p| table(DeSitter::new(p[0])) },
    Entry { names: &["ads", "anti-de-sitter"], parameters: &["n"], make: |p| table(AntiDeSitter::new(p[0])) },
];
