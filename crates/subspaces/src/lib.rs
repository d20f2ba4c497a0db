//! Lines and subspaces: Grassmannians, projective spaces and complex hyperbolic space.

mod complex_hyperbolic;
mod grassmannian;
mod logarithm;
mod quaternionic;

pub use complex_hyperbolic::ComplexHyperbolic;
pub use grassmannian::Subspaces;
pub use quaternionic::QuaternionicProjective;

use symspline_core::matrix::Small;
use symspline_core::space::{Entry, Made, Within, table};

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry {
        names: &["ch", "complex-hyperbolic"],
        parameters: &["n"],
        make: |p| table(ComplexHyperbolic::new(p[0])),
    },
    Entry { names: &["rp", "real-projective"], parameters: &["n"], make: |p| real(Subspaces::lines(p[0])) },
    Entry {
        names: &["cp", "complex-projective"],
        parameters: &["n"],
        make: |p| complex(Subspaces::lines(p[0])),
    },
    Entry {
        names: &["hp", "quaternionic-projective"],
        parameters: &["n"],
        make: |p| table(QuaternionicProjective::new(p[0]).map(Within)),
    },
    Entry {
        names: &["gr", "grassmannian"],
        parameters: &["k", "n"],
        make: |p| real(Subspaces::new(p[0], p[1])),
    },
    Entry {
        names: &["cgr", "complex-grassmannian"],
        parameters: &["k", "n"],
        make: |p| complex(Subspaces::new(p[0], p[1])),
    },
];

/// Storage for few numbers, mostly in registers.
fn real(space: Result<Subspaces<1>, String>) -> Made {
    let space = space?;
    match space.count() {
        ..=4 => table(Ok(space.stored::<Small<4>>())),
        5..=10 => table(Ok(space.stored::<Small<10>>())),
        _ => table(Ok(space)),
    }
}

fn complex(space: Result<Subspaces<2>, String>) -> Made {
    let space = space?;
    if space.count() <= 4 { table(Ok(space.stored::<Small<4>>())) } else { table(Ok(space)) }
}
