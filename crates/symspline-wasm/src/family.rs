//! The spaces of the module. Each costs about a hundred kilobytes, so that only these are compiled.

use std::fmt;
use std::sync::Arc;
use symspline::{Error, Point};
use symspline_engine::space::{Erased, Kernels, Made, table};
use symspline_engine::spaces::{
    Euclidean, Hyperbolic, PositiveDefinite, Rotations, SpecialEuclidean, Sphere,
};

/// Short and long name of a space, and its construction from its size.
type Entry = ([&'static str; 2], fn(usize) -> Made);

/// All spaces, with the names of the Python package.
static ENTRIES: &[Entry] = &[
    (["euclidean", "r"], |n| table(Euclidean::new(n))),
    (["sphere", "s"], |n| table(Sphere::new(n))),
    (["hyperbolic", "h"], |n| table(Hyperbolic::new(n))),
    (["so", "special-orthogonal"], |n| match n {
        3 => table(Rotations::new()),
        n => Err(format!("so:{n} is not part of the JavaScript package, which contains so:3")),
    }),
    (["se", "special-euclidean"], |n| table(SpecialEuclidean::new(n))),
    (["spd", "symmetric-positive-definite"], |n| table(PositiveDefinite::<1>::new(n, false))),
];

/// Sizes are limited so that the memory of 32-bit addresses suffices for a curve.
const LARGEST: usize = 1 << 12;

/// One of the spaces.
#[derive(Clone)]
pub struct Family {
    name: &'static str,
    size: usize,
    table: Arc<dyn Kernels>,
}

impl Family {
    /// The space with a name and a size.
    pub fn new(name: &str, sizes: &[usize]) -> Result<Self, String> {
        let Some((names, make)) = ENTRIES.iter().find(|(names, _)| names.contains(&name)) else {
            return Err(format!(
                "unknown space {name:?}; the JavaScript package contains {}",
                names().collect::<Vec<_>>().join(", ")
            ));
        };
        match sizes {
            &[size] if size <= LARGEST => Ok(Family { name: names[0], size, table: make(size)? }),
            [size] => Err(format!("{name}:{size} is too large; sizes up to {LARGEST} are allowed")),
            _ => Err(format!("{name} takes one size, such as {name}:3, but {} were given", sizes.len())),
        }
    }

    /// The operations of the space.
    pub fn get(&self) -> Erased<'_> {
        Erased(&*self.table)
    }
}

/// The names of all spaces.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|(names, _)| names[0])
}

impl fmt::Debug for Family {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}:{}", self.name, self.size)
    }
}

impl symspline::Space for Family {
    fn table(&self) -> Result<Arc<dyn Kernels>, Error> {
        Ok(self.table.clone())
    }
}

impl Point<Family> for Vec<f64> {
    type Tangent = Vec<f64>;
}
