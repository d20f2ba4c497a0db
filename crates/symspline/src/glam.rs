//! Points of glam, with its types of `f64`. Its matrices store columns, ours are written row by row.

#[cfg(feature = "vectors")]
use crate::point::Point;
use crate::point::Row;
#[cfg(feature = "vectors")]
use crate::space::{Euclidean, Hyperbolic, Sphere};
use glam::{DVec2, DVec3, DVec4};

macro_rules! vectors {
    ($($vector:ty, $n:literal;)*) => {
        $(
            impl Row for $vector {
                fn write(&self, row: &mut Vec<f64>) {
                    row.extend(self.to_array());
                }
                fn read(row: &[f64]) -> Self {
                    Self::from_slice(row)
                }
            }
            #[cfg(feature = "vectors")]
            impl Point<Euclidean<$n>> for $vector {
                type Tangent = $vector;
            }
            #[cfg(feature = "vectors")]
            impl Point<Sphere<$n>> for $vector {
                type Tangent = $vector;
            }
            #[cfg(feature = "vectors")]
            impl Point<Hyperbolic<$n>> for $vector {
                type Tangent = $vector;
            }
        )*
    };
}

vectors! {
    DVec2, 2;
    DVec3, 3;
    DVec4, 4;
}

#[cfg(feature = "rotations")]
mod rotations {
    use crate::point::{Point, Row, Twist};
    use crate::space::{Se3, So3};
    use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
    use symspline_engine::spaces::{matrix_of_quaternion, quaternion_of_matrix};

    impl Row for DQuat {
        fn write(&self, row: &mut Vec<f64>) {
            row.extend(matrix_of_quaternion([self.w, self.x, self.y, self.z]));
        }
        fn read(row: &[f64]) -> Self {
            let [w, x, y, z] = quaternion_of_matrix(row);
            DQuat::from_xyzw(x, y, z, w)
        }
        fn align(&mut self, before: &Self) {
            if self.dot(*before) < 0.0 {
                *self = -*self;
            }
        }
    }

    impl Row for DMat3 {
        fn write(&self, row: &mut Vec<f64>) {
            row.extend(self.transpose().to_cols_array());
        }
        fn read(row: &[f64]) -> Self {
            DMat3::from_cols_slice(row).transpose()
        }
    }

    impl Row for DMat4 {
        fn write(&self, row: &mut Vec<f64>) {
            row.extend(self.transpose().to_cols_array());
        }
        fn read(row: &[f64]) -> Self {
            DMat4::from_cols_slice(row).transpose()
        }
    }

    impl Row for DAffine3 {
        fn write(&self, row: &mut Vec<f64>) {
            DMat4::from(*self).write(row);
        }
        fn read(row: &[f64]) -> Self {
            DAffine3::from_mat4(DMat4::read(row))
        }
    }

    impl Point<So3> for DQuat {
        type Tangent = DVec3;
    }

    impl Point<So3> for DMat3 {
        type Tangent = DVec3;
    }

    impl Point<Se3> for DAffine3 {
        type Tangent = Twist<DVec3>;
    }

    impl Point<Se3> for DMat4 {
        type Tangent = Twist<DVec3>;
    }
}
