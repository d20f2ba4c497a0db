//! GL(n) and its subgroups: groups of invertible matrices, without an invariant metric, and the subspaces of an
//! indefinite form, represented by reflections.

mod algebra;
mod general_linear;
mod indefinite_grassmannian;
mod members;

#[doc(hidden)]
pub use algebra::Algebra;
pub use general_linear::GeneralLinear;
pub use indefinite_grassmannian::IndefiniteGrassmannian;
pub use members::Members;

use symspline_core::matrix::Known;
use symspline_core::space::{Entry, Made, Within, table};

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry { names: &["gl", "general-linear"], parameters: &["n"], make: |p| real(p, Members::All) },
    Entry {
        names: &["cgl", "complex-general-linear"],
        parameters: &["n"],
        make: |p| match p[0] {
            2 => table(GeneralLinear::<2, Known<2, 4>>::new(2, Members::All)),
            n => table(GeneralLinear::<2>::new(n, Members::All)),
        },
    },
    Entry { names: &["aff", "affine"], parameters: &["n"], make: |p| real(p, Members::Affine) },
    Entry { names: &["sim", "similarity"], parameters: &["n"], make: |p| real(p, Members::Similarity) },
    Entry { names: &["sl", "special-linear"], parameters: &["n"], make: |p| real(p, Members::Special) },
    Entry { names: &["sp", "symplectic"], parameters: &["n"], make: |p| real(p, Members::Symplectic) },
    Entry { names: &["lorentz"], parameters: &["n"], make: |p| real(p, Members::Lorentz) },
    Entry {
        names: &["igr", "indefinite-grassmannian"],
        parameters: &["a", "b", "p", "q"],
        make: |p| table(IndefiniteGrassmannian::new([p[0], p[1]], [p[2], p[3]]).map(Within)),
    },
];

/// Common sizes are constants at compile time.
fn real(p: &[usize], members: Members) -> Made {
    match members.rows(p[0])? {
        2 => table(GeneralLinear::<1, Known<2, 4>>::new(p[0], members)),
        3 => table(GeneralLinear::<1, Known<3, 9>>::new(p[0], members)),
        4 => table(GeneralLinear::<1, Known<4, 16>>::new(p[0], members)),
        _ => table(GeneralLinear::<1>::new(p[0], members)),
    }
}
