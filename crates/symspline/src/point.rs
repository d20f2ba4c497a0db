//! The types of points, as lists of numbers.

#[cfg(feature = "subspaces")]
use crate::space::Grassmannian;
#[cfg(feature = "positive-definite")]
use crate::space::PositiveDefinite;
use crate::space::{AnySpace, Space};
#[cfg(feature = "vectors")]
use crate::space::{Euclidean, Hyperbolic, Sphere};
#[cfg(feature = "rotations")]
use crate::space::{Se3, So3};

/// A value as a list of numbers: the entries of a vector, of a matrix row by row, or of the matrix of a quaternion.
pub trait Row: Sized {
    /// Appends the numbers of the value.
    fn write(&self, row: &mut Vec<f64>);
    /// The value with these numbers.
    fn read(row: &[f64]) -> Self;
    /// Replaces a quaternion q by −q, which represents the same rotation, if −q is closer to the quaternion `before`.
    /// Other values do not change.
    fn align(&mut self, _before: &Self) {}
}

/// A value as lists of numbers, one per factor of a space: a [`Row`], or a tuple or `Vec` of rows on a product.
pub trait Rows: Sized {
    /// Appends the numbers in each factor. Returns in how many factors the value has numbers.
    #[doc(hidden)]
    fn write_rows(&self, factors: &mut [Vec<f64>]) -> usize;
    /// The value with these numbers.
    #[doc(hidden)]
    fn read_rows(rows: &[&[f64]]) -> Self;
    /// See [`Row::align`].
    #[doc(hidden)]
    fn align_rows(&mut self, before: &Self);
}

impl<R: Row> Rows for R {
    fn write_rows(&self, factors: &mut [Vec<f64>]) -> usize {
        self.write(&mut factors[0]);
        1
    }
    fn read_rows(rows: &[&[f64]]) -> Self {
        R::read(rows[0])
    }
    fn align_rows(&mut self, before: &Self) {
        self.align(before);
    }
}

/// A type of the points of a space: an array of numbers, or a type of nalgebra, glam or mint. Points of a product are
/// tuples of these, or a `Vec` for a [`Product`](crate::Product).
pub trait Point<S: Space>: Rows {
    /// The type of velocities and accelerations at such points.
    type Tangent: Rows;
}

impl<const N: usize> Row for [f64; N] {
    fn write(&self, row: &mut Vec<f64>) {
        row.extend_from_slice(self);
    }
    fn read(row: &[f64]) -> Self {
        std::array::from_fn(|i| row[i])
    }
}

impl<const N: usize, const M: usize> Row for [[f64; N]; M] {
    fn write(&self, row: &mut Vec<f64>) {
        row.extend_from_slice(self.as_flattened());
    }
    fn read(row: &[f64]) -> Self {
        std::array::from_fn(|i| std::array::from_fn(|j| row[i * N + j]))
    }
}

impl Row for Vec<f64> {
    fn write(&self, row: &mut Vec<f64>) {
        row.extend_from_slice(self);
    }
    fn read(row: &[f64]) -> Self {
        row.to_vec()
    }
}

/// A velocity of a pose in its body frame.
#[cfg(feature = "rotations")]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Twist<V = [f64; 3]> {
    /// The angular velocity.
    pub angular: V,
    /// The linear velocity.
    pub linear: V,
}

#[cfg(feature = "rotations")]
impl<V: Row> Row for Twist<V> {
    fn write(&self, row: &mut Vec<f64>) {
        self.angular.write(row);
        self.linear.write(row);
    }
    fn read(row: &[f64]) -> Self {
        Twist { angular: V::read(&row[..3]), linear: V::read(&row[3..]) }
    }
}

impl Point<AnySpace> for Vec<f64> {
    type Tangent = Vec<f64>;
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Euclidean<N>> for [f64; N] {
    type Tangent = [f64; N];
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Sphere<N>> for [f64; N] {
    type Tangent = [f64; N];
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Hyperbolic<N>> for [f64; N] {
    type Tangent = [f64; N];
}

/// Rotation matrices.
#[cfg(feature = "rotations")]
impl Point<So3> for [[f64; 3]; 3] {
    type Tangent = [f64; 3];
}

/// Homogeneous matrices: rotation, position in the last column, and the row 0 0 0 1.
#[cfg(feature = "rotations")]
impl Point<Se3> for [[f64; 4]; 4] {
    type Tangent = Twist;
}

#[cfg(feature = "positive-definite")]
impl<const N: usize> Point<PositiveDefinite<N>> for [[f64; N]; N] {
    type Tangent = [[f64; N]; N];
}

#[cfg(feature = "subspaces")]
impl<const K: usize, const N: usize> Point<Grassmannian<K, N>> for [[f64; K]; N] {
    type Tangent = [[f64; K]; N];
}

/// Values from their numbers in each factor.
pub fn read<V: Rows>(arrays: &[impl AsRef<[f64]>], count: usize) -> impl Iterator<Item = V> {
    let mut rows = Vec::with_capacity(arrays.len());
    (0..count).map(move |i| {
        rows.clear();
        rows.extend(arrays.iter().map(|array| {
            let len = array.as_ref().len() / count;
            &array.as_ref()[i * len..][..len]
        }));
        V::read_rows(&rows)
    })
}
