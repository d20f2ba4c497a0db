//! Groups as symmetric spaces: rotations, unitary matrices and rigid motions.

mod logarithm;
mod rigid;
mod rotations;
mod special_euclidean;
mod unitary;

pub use rotations::Rotations;
pub use special_euclidean::SpecialEuclidean;
pub use unitary::{UnitaryGroup, orthogonal, special_orthogonal};

use symspline_core::matrix::Known;
use symspline_core::space::{Entry, Made, table};

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry { names: &["so", "special-orthogonal"], parameters: &["n"], make: rotations },
    Entry { names: &["o", "orthogonal"], parameters: &["n"], make: |p| table(orthogonal(p[0])) },
    Entry { names: &["u", "unitary"], parameters: &["n"], make: |p| complex(p[0], false) },
    Entry { names: &["su", "special-unitary"], parameters: &["n"], make: |p| complex(p[0], true) },
    Entry {
        names: &["se", "special-euclidean"],
        parameters: &["n"],
        make: |p| table(SpecialEuclidean::new(p[0])),
    },
];

fn rotations(p: &[usize]) -> Made {
    if p[0] == 3 { table(Rotations::new()) } else { table(special_orthogonal(p[0])) }
}

/// U(n) and SU(n); common sizes are constants at compile time.
fn complex(n: usize, special: bool) -> Made {
    match n {
        2 => table(UnitaryGroup::<2, Known<2, 4>>::new(n, special)),
        4 => table(UnitaryGroup::<2, Known<4, 16>>::new(n, special)),
        _ => table(UnitaryGroup::<2>::new(n, special)),
    }
}
