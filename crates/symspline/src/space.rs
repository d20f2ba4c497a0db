//! The spaces.

#[cfg(feature = "rotations")]
use crate::body;
use crate::error::Error;
use std::fmt;
use std::sync::Arc;
use symspline_engine::space::{Ambient, Kernels, Origin};
use symspline_engine::spaces as engine;

/// A curved space, or a product of curved spaces. [`Point`](crate::Point) lists the types of its points.
///
/// A tuple of spaces is their product: points of `(So3, Euclidean<3>)` are tuples of a rotation and a vector. Each factor
/// has a curve of its own, at common times, and squared distances add. [`Product`](crate::Product) has any number of
/// factors of one type.
pub trait Space: Clone + fmt::Debug + Send + Sync + 'static {
    /// One value per factor: an array for a tuple of spaces, a `Vec` for a [`Product`](crate::Product), and `T` itself
    /// for a space that is not a product.
    type PerFactor<T>;

    /// The factors, of which a space that is not a product is the only one.
    #[doc(hidden)]
    fn factors(&self) -> Vec<&dyn Factor>;

    #[doc(hidden)]
    fn per_factor<T>(values: Vec<T>) -> Self::PerFactor<T>;
}

impl<S: Factor + Clone> Space for S {
    type PerFactor<T> = T;

    fn factors(&self) -> Vec<&dyn Factor> {
        vec![self]
    }
    fn per_factor<T>(mut values: Vec<T>) -> T {
        values.swap_remove(0)
    }
}

/// A space that is not a product. It can be a factor of one, in which products do not nest:
///
/// ```
/// use symspline::{Space, prelude::*};
///
/// fn count(space: impl Space) -> usize {
///     space.factors().len()
/// }
/// assert_eq!(count((So3, Euclidean::<3>, Sphere::<3>)), 3);
/// ```
///
/// ```compile_fail,E0277
/// # use symspline::{Space, prelude::*};
/// # fn count(space: impl Space) -> usize {
/// #     space.factors().len()
/// # }
/// count(((So3, Euclidean::<3>), Sphere::<3>));
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a space, or is a product, which cannot be a factor",
    note = "a product lists all of its factors: `(A, B, C)`, not `((A, B), C)`"
)]
pub trait Factor: fmt::Debug + Send + Sync + 'static {
    /// The operations of the space.
    ///
    /// # Errors
    /// [`Error::InvalidSpace`] if there is no space with these sizes, such as `Sphere::<0>`.
    #[doc(hidden)]
    fn table(&self) -> Result<Table, Error>;

    /// Appends the numbers of a tangent vector as users see it, given its ambient array.
    #[doc(hidden)]
    fn write_velocity(&self, _point: &[f64], ambient: &[f64], velocity: &mut Vec<f64>) {
        velocity.extend_from_slice(ambient);
    }

    /// Appends the ambient array of a tangent vector, given its numbers as users see it.
    #[doc(hidden)]
    fn write_ambient(&self, _point: &[f64], velocity: &[f64], ambient: &mut Vec<f64>) {
        ambient.extend_from_slice(velocity);
    }
}

/// A space whose velocities are those of the body frame: [`So3`] and [`Se3`].
#[cfg(feature = "rotations")]
pub trait BodyFrame: Space {}

#[cfg(feature = "rotations")]
impl BodyFrame for So3 {}
#[cfg(feature = "rotations")]
impl BodyFrame for Se3 {}

/// The operations of a space.
#[doc(hidden)]
pub type Table = Arc<dyn Kernels>;

/// A space by its name, so that its code is compiled in its own crate only.
#[cfg(any(feature = "positive-definite", feature = "rotations", feature = "subspaces", feature = "vectors"))]
fn named(name: &str, sizes: &[usize]) -> Result<Table, Error> {
    AnySpace::new(name, sizes).map(|space| space.0.table())
}

/// Flat space: vectors of N numbers. Splines are the classical ones.
#[cfg(feature = "vectors")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Euclidean<const N: usize>;

/// The sphere of unit vectors with N entries: `Sphere::<3>` contains the directions in space.
#[cfg(feature = "vectors")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sphere<const N: usize>;

/// Hyperbolic space, as vectors x with N entries: `x₀² = 1 + x₁² + …` and `x₀ > 0`, the upper sheet of a hyperboloid.
#[cfg(feature = "vectors")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hyperbolic<const N: usize>;

/// Rotations of space. Velocities are angular velocities in the body frame: p' = p Ω for a rotation matrix p, where Ω x
/// is the cross product ω × x.
#[cfg(feature = "rotations")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct So3;

/// Rigid motions of space, or poses. Velocities are [twists](crate::Twist) in the body frame. Between poses with the same
/// velocity the curve is a screw motion.
#[cfg(feature = "rotations")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Se3;

/// Symmetric positive definite N × N matrices, such as covariances, with the affine invariant metric: the curve of
/// `m P mᵀ` is that of P, transformed, for every invertible m. Tangent vectors are symmetric matrices, the derivatives of the
/// entries.
#[cfg(feature = "positive-definite")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PositiveDefinite<const N: usize>;

/// Subspaces of K dimensions in N dimensions, as N × K matrices with orthonormal columns that span them. All bases of a
/// subspace are the same point.
#[cfg(feature = "subspaces")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Grassmannian<const K: usize, const N: usize>;

#[cfg(feature = "vectors")]
impl<const N: usize> Factor for Euclidean<N> {
    fn table(&self) -> Result<Table, Error> {
        named("euclidean", &[N])
    }
}

// The name contains the dimension of the space, one less than the number of entries. Dimension 0 is an error.
#[cfg(feature = "vectors")]
impl<const N: usize> Factor for Sphere<N> {
    fn table(&self) -> Result<Table, Error> {
        named("sphere", &[N.saturating_sub(1)])
    }
}

#[cfg(feature = "vectors")]
impl<const N: usize> Factor for Hyperbolic<N> {
    fn table(&self) -> Result<Table, Error> {
        named("hyperbolic", &[N.saturating_sub(1)])
    }
}

#[cfg(feature = "rotations")]
impl Factor for So3 {
    fn table(&self) -> Result<Table, Error> {
        named("so", &[3])
    }
    fn write_velocity(&self, point: &[f64], ambient: &[f64], velocity: &mut Vec<f64>) {
        velocity.extend(body::angular(point, ambient, 3));
    }
    fn write_ambient(&self, point: &[f64], velocity: &[f64], ambient: &mut Vec<f64>) {
        ambient.extend_from_slice(body::rotation_rate(point, first(velocity), 3).as_flattened());
    }
}

#[cfg(feature = "rotations")]
impl Factor for Se3 {
    fn table(&self) -> Result<Table, Error> {
        named("se", &[3])
    }
    fn write_velocity(&self, point: &[f64], ambient: &[f64], velocity: &mut Vec<f64>) {
        velocity.extend(body::angular(point, ambient, 4));
        velocity.extend(body::linear(point, ambient));
    }
    fn write_ambient(&self, point: &[f64], velocity: &[f64], ambient: &mut Vec<f64>) {
        ambient.extend(body::pose_rate(point, first(velocity), first(&velocity[3..])));
    }
}

#[cfg(feature = "rotations")]
fn first(x: &[f64]) -> [f64; 3] {
    [x[0], x[1], x[2]]
}

#[cfg(feature = "positive-definite")]
impl<const N: usize> Factor for PositiveDefinite<N> {
    fn table(&self) -> Result<Table, Error> {
        named("spd", &[N])
    }
}

#[cfg(feature = "subspaces")]
impl<const K: usize, const N: usize> Factor for Grassmannian<K, N> {
    fn table(&self) -> Result<Table, Error> {
        named("gr", &[K, N])
    }
}

/// A space that is chosen when the program runs, by its name. Points are vectors of numbers: matrices row by row, complex
/// numbers as pairs of real and imaginary part.
///
/// # Examples
/// ```
/// use symspline::{AnySpace, CubicSpline};
///
/// let space = AnySpace::new("sphere", &[2])?; // S², directions in space
/// assert_eq!((space.point_len(), space.dim()), (3, 2));
/// let points = [vec![1.0, 0.0, 0.0], vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 1.0]];
/// let spline = CubicSpline::new(space, &[0.0, 1.0, 2.0], &points)?;
/// assert_eq!(spline.at(0.0), points[0]);
/// # Ok::<(), symspline::Error>(())
/// ```
#[derive(Clone)]
pub struct AnySpace(engine::AnySpace);

impl AnySpace {
    /// The space with a name, short or long, and sizes: `("sphere", [2])` or `("s", [2])` is S².
    ///
    /// [`AnySpace::names`] lists the names.
    ///
    /// # Errors
    /// [`Error::InvalidSpace`] if there is no such space, or its family was not compiled.
    pub fn new(name: &str, sizes: &[usize]) -> Result<Self, Error> {
        engine::AnySpace::new(name, sizes).map(AnySpace).map_err(|reason| Error::InvalidSpace { reason })
    }

    /// The names of all spaces that were compiled, each with the names of its sizes.
    pub fn names() -> impl Iterator<Item = (&'static str, &'static [&'static str])> {
        engine::all().map(|entry| (entry.names[0], entry.parameters))
    }

    /// The name of the space.
    pub fn name(&self) -> &'static str {
        self.0.name().0
    }

    /// The sizes of the space.
    pub fn sizes(&self) -> Vec<usize> {
        self.0.name().1
    }

    /// How many numbers a point has.
    pub fn point_len(&self) -> usize {
        self.0.get().point_len()
    }

    /// The dimension of the space.
    pub fn dim(&self) -> usize {
        self.0.get().dim()
    }
}

impl fmt::Debug for AnySpace {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (name, sizes) = self.0.name();
        write!(f, "AnySpace({name:?}, {sizes:?})")
    }
}

impl PartialEq for AnySpace {
    fn eq(&self, other: &Self) -> bool {
        self.0.name() == other.0.name()
    }
}

impl Factor for AnySpace {
    fn table(&self) -> Result<Table, Error> {
        Ok(self.0.table())
    }
}
