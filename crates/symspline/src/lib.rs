//! C² cubic splines on symmetric spaces.
//!
//! The method of Bogfjellmo, Modin and Verdier, *A Numerical Algorithm for C²-splines on Symmetric
//! Spaces* (2018, SIAM J. Numer. Anal. 56(4)). Equation numbers in these crates are that paper's.
//!
//! A curve consists of three arrays: knots t, points p and velocities u = γ'(t). [`fit`] computes the velocities,
//! [`curve`] evaluates curves, [`space`] contains the geometry, and [`spaces`] lists all spaces. [`derivative`]
//! computes the sensitivity of a curve to its data, [`smoothing`] fits curves close to noisy points.
//!
//! # A spline through unit quaternions
//!
//! Arrays are one-dimensional: the numbers of each point are adjacent, point after point.
//!
//! ```
//! use symspline::curve::{Curves, Outside, Quantity, Times, evaluate};
//! use symspline::fit::{End, Ends, Method, Options, Problem, Status, fit};
//! use symspline::monitor::Monitor;
//! use symspline::space::Erased;
//! use symspline::spaces::Sphere;
//!
//! let sphere = Sphere::new(3).unwrap();
//! let space = Erased(&sphere);
//! let go_on = |_| true; // is called from time to time; false stops the work
//!
//! // w, x, y, z at three times. Neighbours must have the same sign, w w' + … > 0.
//! let t = [0.0, 1.0, 2.5];
//! let points = [1.0, 0.0, 0.0, 0.0, 0.8, 0.6, 0.0, 0.0, 0.6, 0.64, 0.48, 0.0];
//!
//! let problem = Problem {
//!     t: &t,
//!     shared: true,
//!     points: &points,
//!     offsets: &[0, 3], // one curve of three points; more may follow, and are fitted in parallel
//!     ends: Ends::Open([End::Natural, End::NotAKnot]),
//! };
//! let options = Options { method: Method::Auto, tol: 1e-12, max_iter: None };
//! let mut velocities = [0.0; 12];
//! let reports = fit(&space, &problem, &options, &Monitor::new(&go_on), &mut velocities);
//! assert_eq!(reports[0].status, Status::Converged);
//!
//! let curves = Curves { t: &t, nodes: 3, points: &points, velocities: &velocities };
//! let x = [0.0, 0.5, 1.0, 2.0];
//! let times = Times { x: &x, count: x.len() };
//! let mut q = [0.0; 16];
//! evaluate(&space, &curves, &times, Quantity::Point, Outside::Continue, &Monitor::new(&go_on), &mut q);
//!
//! // The curve stays on the sphere and passes through the points.
//! for point in q.chunks(4) {
//!     let square: f64 = point.iter().map(|x| x * x).sum();
//!     assert!((square - 1.0).abs() < 1e-14);
//! }
//! assert!(q[8..12].iter().zip(&points[4..8]).all(|(a, b)| (a - b).abs() < 1e-14));
//! ```
//!
//! Rotations whose quaternions have any sign are points of [`spaces::Rotations`] as matrices.
//! [`spaces::AnySpace`] creates a space from a name, such as `"so"` with `[3]`.
//!
//! [`fit`] does not check its input: pass a problem to [`validate::validate`] first. It describes the first fault, or
//! returns the points projected onto their space.

pub mod spaces;

pub use symspline_smoothing as smoothing;

#[cfg(feature = "laws")]
pub use symspline_core::laws;
pub use symspline_core::{
    curve, derivative, fit, matrix, monitor, parallel, rows, scalar, space, special, validate,
};
