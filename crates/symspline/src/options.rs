//! The options of a fit.

use crate::point::Point;
use crate::space::Space;
use symspline_engine::curve::Outside;

/// The condition at one end of a curve. `T` is the type of its velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum End<T> {
    /// The covariant acceleration is zero: the condition of the paper, which converges also for points that are far apart.
    #[default]
    Natural,
    /// The first two segments, at the other end the last two, are one cubic. A curve through two points is a geodesic. More
    /// accurate than [`Natural`](End::Natural) ends for dense samples of a smooth motion.
    NotAKnot,
    /// The velocity is given. It is tangent at the point; for rotations and poses it is that of the body frame.
    Velocity(T),
    /// The covariant acceleration is given.
    Acceleration(T),
}

/// The conditions at both ends. An [`End`] stands for the same condition at both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ends<T> {
    /// A condition at either end.
    Open([End<T>; 2]),
    /// The last point equals the first, and so do velocity and acceleration.
    Periodic,
}

impl<T> Default for Ends<T> {
    fn default() -> Self {
        Ends::Open([End::Natural, End::Natural])
    }
}

impl<T: Clone> From<End<T>> for Ends<T> {
    fn from(end: End<T>) -> Self {
        Ends::Open([end.clone(), end])
    }
}

impl<T> From<[End<T>; 2]> for Ends<T> {
    fn from(ends: [End<T>; 2]) -> Self {
        Ends::Open(ends)
    }
}

/// The solver of the C² condition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Several solvers. Points that are far apart may have several curves; the one with the lowest bending energy among
    /// those found is kept. The other methods return the first that they find.
    #[default]
    Auto,
    /// Algorithm 1 of the paper.
    FixedPoint,
    /// Tridiagonal systems on transported vectors, with Anderson mixing.
    QuasiNewton,
    /// Newton's method.
    Newton,
    /// Newton's method along a homotopy from flat space.
    Homotopy,
}

/// The extrapolation policy: the evaluation of a curve at times outside its knots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Extrapolate {
    /// Such times are an error.
    #[default]
    Error,
    /// The curve continues with constant velocity.
    Geodesic,
    /// The first or the last segment continues.
    Segment,
    /// The curve repeats.
    Periodic,
}

impl Extrapolate {
    pub(crate) fn policy(self) -> Outside {
        match self {
            Extrapolate::Error | Extrapolate::Segment => Outside::Continue,
            Extrapolate::Geodesic => Outside::Geodesic,
            Extrapolate::Periodic => Outside::Wrap,
        }
    }
}

/// The options of a fit. [`CubicSpline::builder`](crate::CubicSpline::builder) and
/// [`Batch::builder`](crate::Batch::builder) create it.
#[derive(Clone, Debug)]
#[must_use = "a builder does nothing before `fit`"]
pub struct Builder<S: Space, P: Point<S>> {
    pub(crate) space: S,
    pub(crate) ends: Ends<P::Tangent>,
    pub(crate) method: Method,
    pub(crate) tol: f64,
    pub(crate) max_iter: Option<usize>,
    pub(crate) point_tol: f64,
    pub(crate) extrapolate: Extrapolate,
}

impl<S: Space, P: Point<S>> Builder<S, P> {
    pub(crate) fn new(space: S) -> Self {
        Builder {
            space,
            ends: Ends::default(),
            method: Method::Auto,
            tol: 1e-12,
            max_iter: None,
            point_tol: 1e-8,
            extrapolate: Extrapolate::Error,
        }
    }

    /// The end conditions; by default [`End::Natural`] at both ends, as in the Python package. SciPy's default is
    /// [`End::NotAKnot`].
    ///
    /// # Examples
    /// ```
    /// use symspline::prelude::*;
    ///
    /// let (times, points) = ([0.0, 1.0, 3.0], [[0.0], [1.0], [0.0]]);
    /// let natural = CubicSpline::builder(Euclidean::<1>).fit(&times, &points)?;
    /// assert!(natural.acceleration(0.0)[0].abs() < 1e-14);
    /// let parabola = CubicSpline::builder(Euclidean::<1>).ends(End::NotAKnot).fit(&times, &points)?;
    /// assert!((parabola.acceleration(0.0)[0] + 1.0).abs() < 1e-14);
    /// let ends = [End::Velocity([2.0]), End::Velocity([0.0])];
    /// let clamped = CubicSpline::builder(Euclidean::<1>).ends(ends).fit(&times, &points)?;
    /// assert_eq!(clamped.velocity(0.0), [2.0]);
    ///
    /// // A pose at rest at both ends.
    /// let turn = [[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    /// let start = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    /// let path = CubicSpline::builder(Se3).ends(End::Velocity(Twist::default())).fit(&times[..2], &[start, turn])?;
    /// assert!(path.velocity(1.0).linear[0].abs() < 1e-12);
    /// # Ok::<(), Error>(())
    /// ```
    pub fn ends(mut self, ends: impl Into<Ends<P::Tangent>>) -> Self {
        self.ends = ends.into();
        self
    }

    /// The solver; by default [`Method::Auto`].
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// The largest relative C² residual of a converged fit; by default 1e-12.
    pub fn tol(mut self, tol: f64) -> Self {
        self.tol = tol;
        self
    }

    /// The largest number of iterations; by default it depends on the method.
    pub fn max_iter(mut self, max_iter: usize) -> Self {
        self.max_iter = Some(max_iter);
        self
    }

    /// The distance from the space at which a point is refused; by default 1e-8. Points nearer than that are projected.
    /// Points with the precision of `f32` need 1e-4.
    pub fn point_tol(mut self, point_tol: f64) -> Self {
        self.point_tol = point_tol;
        self
    }

    /// The extrapolation policy for times outside the knots; by default such times are an error.
    pub fn extrapolate(mut self, extrapolate: Extrapolate) -> Self {
        self.extrapolate = extrapolate;
        self
    }
}
