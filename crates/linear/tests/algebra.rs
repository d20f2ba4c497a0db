//! Bases of Lie algebras.

use symspline_core::matrix::Dynamic;
use symspline_linear::{Algebra, Members};

#[test]
fn a_basis_has_as_many_matrices_as_the_algebra_has_dimensions() {
    for members in [
        Members::All,
        Members::Affine,
        Members::Similarity,
        Members::Special,
        Members::Symplectic,
        Members::Lorentz,
        Members::PseudoOrthogonal(2),
    ] {
        for n in [4, 6] {
            let algebra: Algebra<1> = Algebra::new(n, members);
            assert_eq!(algebra.basis().len(), algebra.dim(), "{members:?}, {n}");
        }
    }
    assert_eq!(Algebra::<2, Dynamic>::new(3, Members::All).basis().len(), 18);
}
