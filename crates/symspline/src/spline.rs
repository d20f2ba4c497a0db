//! One spline curve, and how to fit it.

use crate::batch::Batch;
use crate::curves::Curves;
use crate::error::{Error, name_of};
use crate::point::Point;
#[cfg(feature = "rotations")]
use crate::space::BodyFrame;
use crate::space::Space;
use symspline_engine::curve::{Outside, Quantity};
use symspline_engine::fit;

/// The condition at one end of a curve. `T` is the type of its velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum End<T> {
    /// The covariant acceleration is zero.
    Natural,
    /// The first two segments are one cubic.
    #[default]
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
        Ends::Open([End::NotAKnot, End::NotAKnot])
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
    /// Several solvers; the curve with the lowest bending energy is kept.
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

/// What a curve does at times outside its knots.
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

/// How a fit went. For a curve that was read from a file, residual and longest step are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// The number of iterations.
    pub iterations: usize,
    /// The relative C² residual.
    pub residual: f64,
    /// The longest distance between neighbours, D of (21).
    pub max_step: f64,
    /// The name of the solver that found the curve.
    pub solver: &'static str,
}

impl Report {
    /// The report of a curve that was not fitted here.
    #[cfg(feature = "serde")]
    pub(crate) fn unknown() -> Self {
        Report { iterations: 0, residual: f64::NAN, max_step: f64::NAN, solver: "none" }
    }

    pub(crate) fn new(report: &fit::Report) -> Self {
        Report {
            iterations: report.iterations,
            residual: report.residual,
            max_step: report.max_step,
            solver: name_of(report.solver),
        }
    }
}

/// The options of a fit. [`CubicSpline::builder`] and [`Batch::builder`] create it.
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

    /// The end conditions; by default [`End::NotAKnot`] at both ends.
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

    /// What the curve does at times outside its knots; by default they are an error.
    pub fn extrapolate(mut self, extrapolate: Extrapolate) -> Self {
        self.extrapolate = extrapolate;
        self
    }

    /// Fits the curve through points at increasing times.
    ///
    /// # Errors
    /// If the input is invalid, if points are too far apart for a curve, or if the solver does not converge.
    pub fn fit(&self, times: &[f64], points: &[P]) -> Result<CubicSpline<S, P>, Error> {
        let (curves, reports) = Curves::fit(self, &[times], &[points], false)?;
        Ok(CubicSpline { curves, report: Report::new(&reports[0]) })
    }

    /// Fits many curves whose points are at the same times, on all cores.
    ///
    /// # Errors
    /// As [`fit`](Builder::fit); the error names the first curve that fails.
    pub fn fit_shared(&self, times: &[f64], curves: &[impl AsRef<[P]>]) -> Result<Batch<S, P>, Error> {
        let points: Vec<&[P]> = curves.iter().map(AsRef::as_ref).collect();
        Batch::of(Curves::fit(self, &[times], &points, true)?)
    }

    /// Fits many curves, each with times and points of its own, on all cores.
    ///
    /// # Errors
    /// As [`fit`](Builder::fit); the error names the first curve that fails.
    pub fn fit_each(&self, curves: &[(impl AsRef<[f64]>, impl AsRef<[P]>)]) -> Result<Batch<S, P>, Error> {
        let times: Vec<&[f64]> = curves.iter().map(|(t, _)| t.as_ref()).collect();
        let points: Vec<&[P]> = curves.iter().map(|(_, p)| p.as_ref()).collect();
        Batch::of(Curves::fit(self, &times, &points, false)?)
    }
}

/// A C² cubic spline through points of a curved space: [`Space`] lists the spaces, [`Point`] the types of their points.
///
/// # Examples
/// ```
/// use symspline::prelude::*;
///
/// let times = [0.0, 1.0, 2.5];
/// let directions = [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0], [0.6, 0.64, 0.48]];
/// let spline = CubicSpline::new(Sphere::<3>, &times, &directions)?;
/// let [x, y, z] = spline.at(0.5);
/// assert!((x * x + y * y + z * z - 1.0).abs() < 1e-14);
/// assert!(spline.report().residual < 1e-12);
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CubicSpline<S: Space, P: Point<S>> {
    pub(crate) curves: Curves<S, P>,
    pub(crate) report: Report,
}

impl<S: Space, P: Point<S>> CubicSpline<S, P> {
    /// Fits the curve through points at increasing times, with [`End::NotAKnot`] at both ends.
    ///
    /// # Errors
    /// As [`Builder::fit`].
    pub fn new(space: S, times: &[f64], points: &[P]) -> Result<Self, Error> {
        Self::builder(space).fit(times, points)
    }

    /// The options of a fit.
    ///
    /// # Examples
    /// ```
    /// use symspline::prelude::*;
    ///
    /// let square = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    /// let spline = CubicSpline::builder(Sphere::<3>).ends(Ends::Periodic).fit(&[0.0, 1.0, 2.0, 3.0], &square)?;
    /// let (start, end) = (spline.velocity(0.0), spline.velocity(3.0));
    /// assert!(start.iter().zip(end).all(|(a, b)| (a - b).abs() < 1e-12));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn builder(space: S) -> Builder<S, P> {
        Builder::new(space)
    }

    /// The space.
    pub fn space(&self) -> &S {
        &self.curves.space
    }

    /// The knots.
    pub fn times(&self) -> &[f64] {
        self.curves.knots(0)
    }

    /// The points at the knots.
    pub fn points(&self) -> Vec<P> {
        self.curves.at_knots(0)
    }

    /// The velocities at the knots.
    pub fn velocities(&self) -> Vec<P::Tangent> {
        self.curves.velocities_at_knots(0)
    }

    /// First and last knot.
    pub fn domain(&self) -> (f64, f64) {
        self.curves.domain(0)
    }

    /// How the fit went.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The point at a time.
    ///
    /// # Panics
    /// If the time is NaN or infinite, or outside the knots without [`Builder::extrapolate`]. [`CubicSpline::try_at`]
    /// returns an error instead.
    ///
    /// # Examples
    /// ```
    /// use symspline::prelude::*;
    ///
    /// let line = CubicSpline::new(Euclidean::<2>, &[0.0, 1.0], &[[0.0, 0.0], [2.0, 4.0]])?;
    /// assert_eq!(line.at(0.5), [1.0, 2.0]);
    /// # Ok::<(), Error>(())
    /// ```
    #[track_caller]
    pub fn at(&self, time: f64) -> P {
        expect(self.try_at(time))
    }

    /// The point at a time, or why there is none.
    ///
    /// # Errors
    /// [`Error::OutsideDomain`] if the time is NaN or infinite, or outside the knots without [`Builder::extrapolate`].
    pub fn try_at(&self, time: f64) -> Result<P, Error> {
        Ok(P::read(&self.curves.evaluate(&[time], Quantity::Point)?))
    }

    /// The velocity at a time, a tangent vector at the point. For rotations and poses it is that of the body frame.
    ///
    /// # Panics
    /// As [`at`](CubicSpline::at).
    #[track_caller]
    pub fn velocity(&self, time: f64) -> P::Tangent {
        expect(self.tangent(time, Quantity::Velocity))
    }

    /// The covariant acceleration at a time.
    ///
    /// # Panics
    /// As [`at`](CubicSpline::at).
    #[track_caller]
    pub fn acceleration(&self, time: f64) -> P::Tangent {
        expect(self.tangent(time, Quantity::Acceleration))
    }

    /// The length of the velocity at a time.
    ///
    /// # Panics
    /// As [`at`](CubicSpline::at).
    #[track_caller]
    pub fn speed(&self, time: f64) -> f64 {
        expect(self.curves.evaluate(&[time], Quantity::Speed))[0]
    }

    /// Points at many times, on all cores. Quaternions are aligned: neighbours have the same sign.
    ///
    /// # Errors
    /// As [`try_at`](CubicSpline::try_at).
    pub fn sample(&self, times: &[f64]) -> Result<Vec<P>, Error> {
        Ok(self.curves.sample(times)?.into_vec())
    }

    /// Velocities at many times.
    ///
    /// # Errors
    /// As [`try_at`](CubicSpline::try_at).
    pub fn sample_velocity(&self, times: &[f64]) -> Result<Vec<P::Tangent>, Error> {
        self.curves.tangents(times, Quantity::Velocity)
    }

    /// Covariant accelerations at many times.
    ///
    /// # Errors
    /// As [`try_at`](CubicSpline::try_at).
    pub fn sample_acceleration(&self, times: &[f64]) -> Result<Vec<P::Tangent>, Error> {
        self.curves.tangents(times, Quantity::Acceleration)
    }

    fn tangent(&self, time: f64, quantity: Quantity) -> Result<P::Tangent, Error> {
        let mut all = self.curves.tangents(&[time], quantity)?;
        Ok(all.remove(0))
    }
}

#[cfg(feature = "rotations")]
impl<S: BodyFrame, P: Point<S>> CubicSpline<S, P> {
    /// The velocity in the body frame: [`velocity`](CubicSpline::velocity), under a name that says so.
    ///
    /// # Panics
    /// As [`at`](CubicSpline::at).
    #[track_caller]
    pub fn body_velocity(&self, time: f64) -> P::Tangent {
        self.velocity(time)
    }

    /// The derivative of the velocity in the body frame.
    ///
    /// # Panics
    /// As [`at`](CubicSpline::at).
    #[track_caller]
    pub fn body_acceleration(&self, time: f64) -> P::Tangent {
        self.acceleration(time)
    }
}

#[track_caller]
pub(crate) fn expect<T>(result: Result<T, Error>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}
