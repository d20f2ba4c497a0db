//! All spaces, by name.

use std::sync::Arc;
use symspline_core::space::{Entry, Erased, Kernels};

#[cfg(feature = "forms")]
pub use symspline_forms::{LogEuclidean, PositiveDefinite, Siegel};
#[cfg(feature = "groups")]
pub use symspline_groups::{
    Rotations, SpecialEuclidean, conversions, matrix_of_quaternion, quaternion_of_matrix,
};
#[cfg(feature = "stiefel")]
pub use symspline_groups::{Stiefel, stiefel};
#[cfg(feature = "unitary")]
pub use symspline_groups::{UnitaryGroup, orthogonal, special_orthogonal};
#[cfg(feature = "linear")]
pub use symspline_linear::{GeneralLinear, IndefiniteGrassmannian, Members};
#[cfg(feature = "subspaces")]
pub use symspline_subspaces::{Lines, Subspaces};
#[cfg(feature = "vectors")]
pub use symspline_vectors::{AntiDeSitter, Curved, DeSitter, Euclidean, Hyperbolic, Sphere, Torus};

/// The families of spaces that were compiled. These are references to the statics of their crates: a copy of one would
/// contain its functions, with all their code.
static FAMILIES: &[&&[Entry]] = &[
    #[cfg(feature = "vectors")]
    &symspline_vectors::FAMILY,
    #[cfg(feature = "subspaces")]
    &symspline_subspaces::FAMILY,
    #[cfg(feature = "groups")]
    &symspline_groups::FAMILY,
    #[cfg(feature = "forms")]
    &symspline_forms::FAMILY,
    #[cfg(feature = "linear")]
    &symspline_linear::FAMILY,
];

/// Every kind of space.
pub fn all() -> impl Iterator<Item = &'static Entry> {
    FAMILIES.iter().copied().copied().flatten()
}

/// The upper limit of numbers in the name of a space, so that sizes of arrays do not overflow.
const LARGEST: usize = 1 << 24;

/// Any of the spaces.
#[derive(Clone)]
pub struct AnySpace {
    name: &'static str,
    parameters: Vec<usize>,
    table: Arc<dyn Kernels>,
}

impl AnySpace {
    /// The space with a name (short or long) and parameters, e.g. `"sphere"`, `[2]`.
    pub fn new(name: &str, parameters: &[usize]) -> Result<Self, String> {
        let Some(entry) = all().find(|entry| entry.names.contains(&name)) else {
            let known: Vec<String> = all().map(|entry| entry.names.join(" or ")).collect();
            return Err(format!("unknown space {name:?}; known are {}", known.join(", ")));
        };
        let names = entry.parameters;
        if names.len() != parameters.len() {
            return Err(format!(
                "{name} takes {} number(s) ({}), got {}",
                names.len(),
                names.join(", "),
                parameters.len()
            ));
        }
        if let Some(large) = parameters.iter().find(|&&n| n > LARGEST) {
            return Err(format!("{name}: {large} is too large; numbers up to {LARGEST} are allowed"));
        }
        let table = (entry.make)(parameters)?;
        Ok(AnySpace { name: entry.names[0], parameters: parameters.to_vec(), table })
    }

    /// The operations of the space.
    pub fn get(&self) -> Erased<'_> {
        Erased(&*self.table)
    }

    /// The same, for an owner.
    pub fn table(&self) -> Arc<dyn Kernels> {
        self.table.clone()
    }

    /// The canonical name and the parameters.
    pub fn name(&self) -> (&'static str, Vec<usize>) {
        (self.name, self.parameters.clone())
    }
}
