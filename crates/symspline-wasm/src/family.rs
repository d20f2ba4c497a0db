//! The spaces of the module. Each costs about a hundred kilobytes, so that only these are compiled.

use std::fmt;
use std::sync::Arc;
use symspline::{Error, Factor, Point, Product};
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

/// The spaces that a name lists, such as `"so:3"` and `"r:3"` in `"so:3 x r:3"`.
pub fn factors(name: &str) -> Result<Product<Family>, String> {
    name.split(" x ").map(Family::new).collect::<Result<_, _>>().map(Product)
}

impl Family {
    /// The space with a name and a size, such as `"so:3"`.
    pub fn new(name: &str) -> Result<Self, String> {
        let name = name.trim().to_lowercase();
        let (word, size) = name.split_once(':').unwrap_or((&name, ""));
        let Some((names, make)) = ENTRIES.iter().find(|(names, _)| names.contains(&word)) else {
            return Err(format!(
                "unknown space {word:?}; the JavaScript package contains {}",
                names().collect::<Vec<_>>().join(", ")
            ));
        };
        match size.trim().parse() {
            Ok(size) if size <= LARGEST => Ok(Family { name: names[0], size, table: make(size)? }),
            Ok(_) => Err(format!("{name} is too large; sizes up to {LARGEST} are allowed")),
            Err(_) => Err(format!(
                "{word} takes one size, a whole number, such as {word}:3, but the space is {name:?}. Put \" x \" \
                 between the factors of a product, as in \"so:3 x r:3\""
            )),
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

impl Factor for Family {
    fn table(&self) -> Result<Arc<dyn Kernels>, Error> {
        Ok(self.table.clone())
    }
}

impl Point<Family> for Vec<f64> {
    type Tangent = Vec<f64>;
}
