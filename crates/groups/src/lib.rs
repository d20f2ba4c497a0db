//! Groups as symmetric spaces: rotations, unitary matrices and rigid motions.

pub mod conversions;
#[cfg(feature = "stiefel")]
mod frame_pairs;
#[cfg(feature = "unitary")]
mod isometries;
mod logarithm;
mod motions;
#[cfg(feature = "unitary")]
mod pair_forms;
#[cfg(feature = "unitary")]
mod pairs;
mod rigid;
mod rotations;
mod special_euclidean;
#[cfg(feature = "stiefel")]
mod stiefel;
#[cfg(feature = "unitary")]
mod two_spheres;
mod unitary;

#[cfg(feature = "stiefel")]
pub use crate::stiefel::Stiefel;
pub use rotations::Rotations;
pub use special_euclidean::SpecialEuclidean;
#[cfg(feature = "unitary")]
pub use unitary::{UnitaryGroup, orthogonal, special_orthogonal};

#[cfg(feature = "unitary")]
use isometries::{Phases, PlaneRotations, UnitQuaternions};
#[cfg(feature = "unitary")]
use pairs::Pairs;
#[cfg(feature = "unitary")]
use symspline_core::matrix::Known;
use symspline_core::scalar::{few, lane};
#[cfg(feature = "unitary")]
use symspline_core::space::Isometric;
use symspline_core::space::{Entry, Made, table};

/// The rotation matrix of a unit quaternion w, x, y, z, row by row; for any quaternion, |q|² times a rotation matrix, so
/// that a wrong norm is noticed.
pub fn matrix_of_quaternion(q: [f64; 4]) -> [f64; 9] {
    let excess = q.iter().map(|x| x * x).sum::<f64>() - 1.0;
    let r = rigid::to_matrix(q.map(lane)).map(|x| x.as_array()[0]);
    few(|i| if i % 4 == 0 { r[i] + excess } else { r[i] })
}

/// The unit quaternion w, x, y, z of a rotation matrix, with w ≥ 0 up to rounding.
pub fn quaternion_of_matrix(r: &[f64]) -> [f64; 4] {
    let minus_identity: [f64; 9] = few(|i| r[i] - if i % 4 == 0 { 1.0 } else { 0.0 });
    let q = rigid::of_matrix(minus_identity.map(lane)).map(|x| x.as_array()[0]);
    if q[0] < 0.0 { q.map(|x| -x) } else { q }
}

#[cfg(feature = "stiefel")]
/// The manifold of n × k matrices of orthonormal columns, with 1 ≤ k < n.
pub fn stiefel(k: usize, n: usize) -> Result<Box<dyn Stiefel>, String> {
    if (k, n) == (2, 4) {
        return Ok(Box::new(frame_pairs::FramePairs));
    }
    Ok(stiefel::stiefel(k, n, rotations(&[n.min(2 * k)])?))
}

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry { names: &["so", "special-orthogonal"], parameters: &["n"], make: rotations },
    #[cfg(feature = "unitary")]
    Entry { names: &["o", "orthogonal"], parameters: &["n"], make: |p| with_reflections(p[0]) },
    #[cfg(feature = "unitary")]
    Entry { names: &["u", "unitary"], parameters: &["n"], make: |p| complex(p[0], false) },
    #[cfg(feature = "unitary")]
    Entry { names: &["su", "special-unitary"], parameters: &["n"], make: |p| complex(p[0], true) },
    Entry {
        names: &["se", "special-euclidean"],
        parameters: &["n"],
        make: |p| table(SpecialEuclidean::new(p[0])),
    },
];

fn rotations(p: &[usize]) -> Made {
    match p[0] {
        3 => table(Rotations::new()),
        #[cfg(feature = "unitary")]
        2 => table(PlaneRotations::new().map(Isometric)),
        #[cfg(feature = "unitary")]
        4 => table(Pairs::rotations()),
        #[cfg(feature = "unitary")]
        5 => table(UnitaryGroup::<1, Known<5, 25>>::new(5, true)),
        #[cfg(feature = "unitary")]
        n => table(special_orthogonal(n)),
        #[cfg(not(feature = "unitary"))]
        n => Err(format!("SpecialOrthogonal({n}) was not compiled: it needs the feature \"unitary\"")),
    }
}

#[cfg(feature = "unitary")]
fn with_reflections(n: usize) -> Made {
    match n {
        3 => table(Rotations::with_reflections()),
        n => table(orthogonal(n)),
    }
}

/// U(n) and SU(n); common sizes are constants at compile time.
#[cfg(feature = "unitary")]
fn complex(n: usize, special: bool) -> Made {
    match n {
        1 if !special => table(Phases::new().map(Isometric)),
        2 if special => table(UnitQuaternions::new().map(Isometric)),
        2 => table(Pairs::unitary()),
        3 => table(UnitaryGroup::<2, Known<3, 9>>::new(n, special)),
        4 => table(UnitaryGroup::<2, Known<4, 16>>::new(n, special)),
        _ => table(UnitaryGroup::<2>::new(n, special)),
    }
}
