//! Positive definite matrices.

mod log_euclidean;
mod positive_definite;
mod siegel;

pub use log_euclidean::LogEuclidean;
pub use positive_definite::PositiveDefinite;
pub use siegel::{HalfPlane, Siegel};

use symspline_core::matrix::Known;
use symspline_core::space::{Entry, Isometric, Made, Within, table};

/// The spaces of this family.
pub static FAMILY: &[Entry] = &[
    Entry { names: &["spd", "symmetric-positive-definite"], parameters: &["n"], make: |p| real(p, false) },
    Entry {
        names: &["hpd", "hermitian-positive-definite"],
        parameters: &["n"],
        make: |p| match p[0] {
            2 => table(PositiveDefinite::<2, Known<2, 4>>::new(2, false)),
            n => table(PositiveDefinite::<2>::new(n, false)),
        },
    },
    Entry { names: &["sspd", "special-positive-definite"], parameters: &["n"], make: |p| real(p, true) },
    Entry {
        names: &["logspd", "log-euclidean"],
        parameters: &["n"],
        make: |p| table(LogEuclidean::new(p[0])),
    },
    Entry { names: &["siegel"], parameters: &["n"], make: |p| half_space(p[0]) },
];

fn half_space(n: usize) -> Made {
    if n == 1 { table(HalfPlane::new().map(Isometric)) } else { table(Siegel::new(n).map(Within)) }
}

/// Common sizes are constants at compile time.
fn real(p: &[usize], special: bool) -> Made {
    match p[0] {
        2 => table(PositiveDefinite::<1, Known<2, 4>>::new(2, special)),
        3 => table(PositiveDefinite::<1, Known<3, 9>>::new(3, special)),
        4 => table(PositiveDefinite::<1, Known<4, 16>>::new(4, special)),
        n => table(PositiveDefinite::<1>::new(n, special)),
    }
}
