//! Points of mint, through which other libraries exchange theirs.

#[cfg(feature = "vectors")]
use crate::point::Point;
use crate::point::Row;
#[cfg(feature = "vectors")]
use crate::space::{Euclidean, Hyperbolic, Sphere};
use mint::{Point2, Point3, Vector2, Vector3, Vector4};

macro_rules! rows {
    ($($vector:ty, $n:literal;)*) => {
        $(
            impl Row for $vector {
                fn write(&self, row: &mut Vec<f64>) {
                    row.extend(<[f64; $n]>::from(*self));
                }
                fn read(row: &[f64]) -> Self {
                    <[f64; $n]>::read(row).into()
                }
            }
        )*
    };
}

rows! {
    Vector2<f64>, 2;
    Vector3<f64>, 3;
    Vector4<f64>, 4;
    Point2<f64>, 2;
    Point3<f64>, 3;
}

#[cfg(feature = "vectors")]
macro_rules! vectors {
    ($($vector:ty, $n:literal;)*) => {
        $(
            impl Point<Euclidean<$n>> for $vector {
                type Tangent = $vector;
            }
            impl Point<Sphere<$n>> for $vector {
                type Tangent = $vector;
            }
            impl Point<Hyperbolic<$n>> for $vector {
                type Tangent = $vector;
            }
        )*
    };
}

#[cfg(feature = "vectors")]
vectors! {
    Vector2<f64>, 2;
    Vector3<f64>, 3;
    Vector4<f64>, 4;
}

#[cfg(feature = "vectors")]
impl Point<Euclidean<2>> for Point2<f64> {
    type Tangent = Vector2<f64>;
}

#[cfg(feature = "vectors")]
impl Point<Euclidean<3>> for Point3<f64> {
    type Tangent = Vector3<f64>;
}

#[cfg(feature = "rotations")]
mod rotations {
    use crate::point::{Point, Row, Twist};
    use crate::space::{Se3, So3};
    use mint::{ColumnMatrix3, ColumnMatrix4, Quaternion, RowMatrix3, RowMatrix4, Vector3};
    use symspline_engine::spaces::{matrix_of_quaternion, quaternion_of_matrix};

    impl Row for Quaternion<f64> {
        fn write(&self, row: &mut Vec<f64>) {
            row.extend(matrix_of_quaternion([self.s, self.v.x, self.v.y, self.v.z]));
        }
        fn read(row: &[f64]) -> Self {
            let [s, x, y, z] = quaternion_of_matrix(row);
            Quaternion { s, v: Vector3 { x, y, z } }
        }
        fn align(&mut self, before: &Self) {
            let (v, b) = (self.v, before.v);
            if self.s * before.s + v.x * b.x + v.y * b.y + v.z * b.z < 0.0 {
                *self = Quaternion { s: -self.s, v: Vector3 { x: -v.x, y: -v.y, z: -v.z } };
            }
        }
    }

    macro_rules! matrices {
        ($($matrix:ty as [[f64; $n:literal]; _], $rows:ident, $point:ty, $tangent:ty;)*) => {
            $(
                impl Row for $matrix {
                    fn write(&self, row: &mut Vec<f64>) {
                        let m: [[f64; $n]; $n] = $rows((*self).into());
                        m.write(row);
                    }
                    fn read(row: &[f64]) -> Self {
                        $rows(<[[f64; $n]; $n]>::read(row)).into()
                    }
                }
                impl Point<$point> for $matrix {
                    type Tangent = $tangent;
                }
            )*
        };
    }

    fn same<T>(m: T) -> T {
        m
    }

    fn transposed<const N: usize>(m: [[f64; N]; N]) -> [[f64; N]; N] {
        std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
    }

    matrices! {
        RowMatrix3<f64> as [[f64; 3]; _], same, So3, Vector3<f64>;
        ColumnMatrix3<f64> as [[f64; 3]; _], transposed, So3, Vector3<f64>;
        RowMatrix4<f64> as [[f64; 4]; _], same, Se3, Twist<Vector3<f64>>;
        ColumnMatrix4<f64> as [[f64; 4]; _], transposed, Se3, Twist<Vector3<f64>>;
    }

    impl Point<So3> for Quaternion<f64> {
        type Tangent = Vector3<f64>;
    }
}
