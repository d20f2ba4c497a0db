//! C² cubic splines through points of curved spaces: rotations, poses, directions, subspaces, covariance matrices, and
//! all other symmetric spaces.
//!
//! Give times and points. The result is a curve that stays on the space, passes through every point, and has continuous
//! velocity and covariant acceleration. The method is that of Bogfjellmo, Modin and Verdier, *A Numerical Algorithm for
//! C²-splines on Symmetric Spaces* (2018), extended to any knots and more end conditions. In flat space the curve is the
//! classical cubic spline.
//!
//! # Directions
//!
//! ```
//! use symspline::prelude::*;
//!
//! let times = [0.0, 1.0, 2.5];
//! let directions = [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0], [0.6, 0.64, 0.48]];
//! let spline = CubicSpline::new(Sphere::<3>, &times, &directions)?;
//! let direction = spline.at(0.7);
//! let velocity = spline.velocity(0.7); // tangent: orthogonal to the direction
//! assert!(direction.iter().zip(velocity).map(|(p, v)| p * v).sum::<f64>().abs() < 1e-14);
//! # Ok::<(), Error>(())
//! ```
//!
//! # Rotations and poses
//!
//! With the features `nalgebra`, `glam` or `mint`, points have the types of these libraries; signs of quaternions need not
//! agree. Velocities are those of the body frame.
//!
//! ```
//! # #[cfg(feature = "nalgebra")] {
//! use nalgebra::{Isometry3, UnitQuaternion, Vector3};
//! use symspline::prelude::*;
//!
//! let times = [0.0, 1.0, 2.5];
//! let turns = [0.0, 0.4, 1.1].map(|angle| UnitQuaternion::from_euler_angles(0.2 * angle, 0.0, angle));
//! let spline = CubicSpline::builder(So3).ends(End::NotAKnot).fit(&times, &turns)?;
//! let rotation: UnitQuaternion<f64> = spline.at(0.7);
//! let rate: Vector3<f64> = spline.body_velocity(0.7); // radians per unit of time
//!
//! let poses = turns.map(|turn| Isometry3::from_parts(Vector3::new(turn.angle(), 0.0, 1.0).into(), turn));
//! let path = CubicSpline::new(Se3, &times, &poses)?;
//! let twist = path.body_velocity(1.0);
//! println!("{rotation} {rate} {} {}", twist.angular, twist.linear);
//! # }
//! # Ok::<(), symspline::Error>(())
//! ```
//!
//! # Products
//!
//! A tuple of spaces is their product. Its points, velocities and end vectors are tuples as well. Each factor has the curve
//! that it has alone, at common times, and the speed in the product is the root of the sum of the squared speeds.
//!
//! ```
//! use symspline::prelude::*;
//!
//! let times = [0.0, 1.0, 2.5];
//! let points = [0.0_f64, 0.4, 1.1].map(|angle| ([angle.cos(), angle.sin()], [angle, 0.0, 1.0]));
//! let spline = CubicSpline::new((Sphere::<2>, Euclidean::<3>), &times, &points)?;
//! let (direction, position) = spline.at(0.7);
//! let (turning, moving) = spline.velocity(0.7);
//! let speed = turning[0].hypot(turning[1]).hypot(moving[0]);
//! assert!((spline.speed(0.7) - speed).abs() < 1e-14);
//! # let _ = (direction, position);
//! # Ok::<(), Error>(())
//! ```
//!
//! [`Product`] has any number of factors of one type, such as spaces that are named when the program runs.
//!
//! # Errors
//!
//! Input is validated before any work is done. [`Error`] names the curve, the node and the numbers,
//! and the factor of a product.
//!
//! ```
//! use symspline::prelude::*;
//!
//! let opposite = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
//! match CubicSpline::new(Sphere::<3>, &[0.0, 1.0], &opposite) {
//!     Err(Error::CutLocus { node, angle, limit, .. }) => assert!(node == 0 && angle >= 0.999 * limit),
//!     other => panic!("{other:?}"),
//! }
//! ```
//!
//! # Layout of points
//!
//! Vectors are arrays. Matrices are arrays of rows, `[[f64; 3]; 3]`: the entry in row i and column j is `m[i][j]`. A pose is
//! a homogeneous matrix with the position in its last column. Libraries that store columns are converted.
//!
//! # Features
//!
//! | feature | adds |
//! |---|---|
//! | `vectors` | [`Euclidean`], [`Sphere`], [`Hyperbolic`] |
//! | `rotations` | [`So3`], [`Se3`] |
//! | `positive-definite` | [`PositiveDefinite`] |
//! | `subspaces` | [`Grassmannian`] |
//! | `all-spaces` | these, and all others by name: [`AnySpace`] |
//! | `smoothing` | [`Smoothing`] of noisy data |
//! | `rayon` | all cores |
//! | `nalgebra`, `glam`, `mint` | points of these libraries |
//! | `serde` | curves in files and messages |
//!
//! `all-spaces`, `smoothing` and `rayon` are on by default.

mod batch;
#[cfg(feature = "rotations")]
mod body;
mod curves;
pub mod custom;
mod error;
#[cfg(feature = "glam")]
mod glam;
#[cfg(feature = "mint")]
mod mint;
#[cfg(feature = "nalgebra")]
mod nalgebra;
mod options;
mod point;
mod product;
mod samples;
#[cfg(feature = "serde")]
mod serde;
#[cfg(feature = "smoothing")]
mod smoothing;
mod space;
mod spline;

pub use batch::Batch;
pub use curves::Report;
pub use error::Error;
pub use options::{Builder, End, Ends, Extrapolate, Method};
#[cfg(feature = "rotations")]
pub use point::Twist;
pub use point::{Point, Row, Rows};
pub use product::Product;
pub use samples::Samples;
#[cfg(feature = "smoothing")]
pub use smoothing::{Criterion, FactorValues, Loss, Smoothing, SmoothingReport, SmoothingSpline};
#[cfg(feature = "subspaces")]
pub use space::Grassmannian;
#[cfg(feature = "positive-definite")]
pub use space::PositiveDefinite;
pub use space::{AnySpace, Factor, Space};
#[cfg(feature = "rotations")]
pub use space::{BodyFrame, Se3, So3};
#[cfg(feature = "vectors")]
pub use space::{Euclidean, Hyperbolic, Sphere};
pub use spline::{CubicSpline, Evaluator};

/// Limits the number of threads; 0 means all cores, which is the default.
pub use symspline_engine::parallel::set_num_threads;

/// The names that most programs need: `use symspline::prelude::*`.
pub mod prelude {
    #[cfg(feature = "subspaces")]
    #[doc(no_inline)]
    pub use crate::Grassmannian;
    #[cfg(feature = "positive-definite")]
    #[doc(no_inline)]
    pub use crate::PositiveDefinite;
    #[doc(no_inline)]
    pub use crate::options::End::{Natural, NotAKnot};
    #[doc(no_inline)]
    pub use crate::{AnySpace, Batch, CubicSpline, End, Ends, Error, Extrapolate, Method, Product};
    #[cfg(feature = "smoothing")]
    #[doc(no_inline)]
    pub use crate::{Criterion, Loss, Smoothing};
    #[cfg(feature = "vectors")]
    #[doc(no_inline)]
    pub use crate::{Euclidean, Hyperbolic, Sphere};
    #[cfg(feature = "rotations")]
    #[doc(no_inline)]
    pub use crate::{Se3, So3, Twist};
}

/// The program in the README.
#[cfg(all(doctest, feature = "nalgebra"))]
#[doc = include_str!("../README.md")]
struct Readme;
