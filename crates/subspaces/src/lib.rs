//! Lines and subspaces: Grassmannians, projective spaces and complex hyperbolic space.

mod grassmannian;
mod line_spaces;
mod lines;
mod logarithm;
mod quaternionic;

pub use grassmannian::Subspaces;
pub use line_spaces::{ComplexHyperbolic, ComplexProjective, Lines, QuaternionicProjective, RealProjective};

use symspline_core::matrix::Small;
use symspline_core::space::{Entry, Made, table};

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry {
        names: &["ch", "complex-hyperbolic"],
        parameters: &["n"],
        make: |p| table(ComplexHyperbolic::new(p[0])),
    },
    Entry {
        names: &["rp", "real-projective"],
        parameters: &["n"],
        make: |p| table(RealProjective::new(p[0])),
    },
    Entry {
        names: &["cp", "complex-projective"],
        parameters: &["n"],
        make: |p| table(ComplexProjective::new(p[0])),
    },
    Entry {
        names: &["hp", "quaternionic-projective"],
        parameters: &["n"],
        make: |p| table(QuaternionicProjective::new(p[0])),
    },
    Entry {
        names: &["gr", "grassmannian"],
        parameters: &["k", "n"],
        make: |p| match p[..] {
            [1, n] if n > 1 => table(RealProjective::new(n - 1).map(Lines::columns)),
            _ => stored(Subspaces::<1>::new(p[0], p[1])),
        },
    },
    Entry {
        names: &["cgr", "complex-grassmannian"],
        parameters: &["k", "n"],
        make: |p| match p[..] {
            [1, n] if n > 1 => table(ComplexProjective::new(n - 1).map(Lines::columns)),
            _ => stored(Subspaces::<2>::new(p[0], p[1])),
        },
    },
];

/// Storage for few numbers, mostly in registers.
fn stored<const D: usize>(space: Result<Subspaces<D>, String>) -> Made {
    let space = space?;
    if space.count() <= 10 { table(Ok(space.stored::<Small<10>>())) } else { table(Ok(space)) }
}
