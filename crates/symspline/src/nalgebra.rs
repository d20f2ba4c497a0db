//! Points of nalgebra. Its matrices store columns, ours are written row by row.

#[cfg(any(feature = "positive-definite", feature = "subspaces", feature = "vectors"))]
use crate::point::Point;
use crate::point::Row;
#[cfg(feature = "subspaces")]
use crate::space::Grassmannian;
#[cfg(feature = "positive-definite")]
use crate::space::PositiveDefinite;
#[cfg(feature = "vectors")]
use crate::space::{Euclidean, Hyperbolic, Sphere};
use nalgebra::SMatrix;
#[cfg(feature = "vectors")]
use nalgebra::{Point as Position, SVector, Unit};

impl<const M: usize, const N: usize> Row for SMatrix<f64, M, N> {
    fn write(&self, row: &mut Vec<f64>) {
        row.extend((0..M).flat_map(|i| (0..N).map(move |j| self[(i, j)])));
    }
    fn read(row: &[f64]) -> Self {
        SMatrix::from_fn(|i, j| row[i * N + j])
    }
}

#[cfg(feature = "vectors")]
impl<const N: usize> Row for Position<f64, N> {
    fn write(&self, row: &mut Vec<f64>) {
        self.coords.write(row);
    }
    fn read(row: &[f64]) -> Self {
        SVector::<f64, N>::read(row).into()
    }
}

#[cfg(feature = "vectors")]
impl<const N: usize> Row for Unit<SVector<f64, N>> {
    fn write(&self, row: &mut Vec<f64>) {
        self.as_ref().write(row);
    }
    fn read(row: &[f64]) -> Self {
        Unit::new_unchecked(SVector::read(row))
    }
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Euclidean<N>> for SVector<f64, N> {
    type Tangent = SVector<f64, N>;
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Euclidean<N>> for Position<f64, N> {
    type Tangent = SVector<f64, N>;
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Sphere<N>> for SVector<f64, N> {
    type Tangent = SVector<f64, N>;
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Sphere<N>> for Unit<SVector<f64, N>> {
    type Tangent = SVector<f64, N>;
}

#[cfg(feature = "vectors")]
impl<const N: usize> Point<Hyperbolic<N>> for SVector<f64, N> {
    type Tangent = SVector<f64, N>;
}

#[cfg(feature = "positive-definite")]
impl<const N: usize> Point<PositiveDefinite<N>> for SMatrix<f64, N, N> {
    type Tangent = SMatrix<f64, N, N>;
}

#[cfg(feature = "subspaces")]
impl<const K: usize, const N: usize> Point<Grassmannian<K, N>> for SMatrix<f64, N, K> {
    type Tangent = SMatrix<f64, N, K>;
}

#[cfg(feature = "rotations")]
mod rotations {
    use crate::point::{Point, Row, Twist};
    use crate::space::{Se3, So3};
    use nalgebra::{
        Isometry3, Matrix3, Matrix4, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3,
    };
    use symspline_engine::spaces::{matrix_of_quaternion, quaternion_of_matrix};

    impl Row for UnitQuaternion<f64> {
        fn write(&self, row: &mut Vec<f64>) {
            row.extend(matrix_of_quaternion([self.w, self.i, self.j, self.k]));
        }
        fn read(row: &[f64]) -> Self {
            let [w, x, y, z] = quaternion_of_matrix(row);
            UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
        }
        fn align(&mut self, before: &Self) {
            if self.coords.dot(&before.coords) < 0.0 {
                *self = UnitQuaternion::new_unchecked(-self.into_inner());
            }
        }
    }

    impl Row for Rotation3<f64> {
        fn write(&self, row: &mut Vec<f64>) {
            self.matrix().write(row);
        }
        fn read(row: &[f64]) -> Self {
            Rotation3::from_matrix_unchecked(Matrix3::read(row))
        }
    }

    impl Row for Isometry3<f64> {
        fn write(&self, row: &mut Vec<f64>) {
            let mut rotation = Vec::with_capacity(9);
            self.rotation.write(&mut rotation);
            for i in 0..3 {
                row.extend_from_slice(&rotation[3 * i..3 * i + 3]);
                row.push(self.translation.vector[i]);
            }
            row.extend([0.0, 0.0, 0.0, 1.0]);
        }
        fn read(row: &[f64]) -> Self {
            let rotation: Vec<f64> = row.chunks(4).take(3).flat_map(|row| &row[..3]).copied().collect();
            let position = Translation3::new(row[3], row[7], row[11]);
            Isometry3::from_parts(position, UnitQuaternion::read(&rotation))
        }
        fn align(&mut self, before: &Self) {
            self.rotation.align(&before.rotation);
        }
    }

    impl Point<So3> for UnitQuaternion<f64> {
        type Tangent = Vector3<f64>;
    }

    impl Point<So3> for Rotation3<f64> {
        type Tangent = Vector3<f64>;
    }

    impl Point<So3> for Matrix3<f64> {
        type Tangent = Vector3<f64>;
    }

    impl Point<Se3> for Isometry3<f64> {
        type Tangent = Twist<Vector3<f64>>;
    }

    impl Point<Se3> for Matrix4<f64> {
        type Tangent = Twist<Vector3<f64>>;
    }
}
