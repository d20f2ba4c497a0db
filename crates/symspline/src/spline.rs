//! Spline curves and their fit.

use crate::curves::{Curves, Report};
use crate::error::Error;
use crate::options::Builder;
use crate::point::Point;
#[cfg(feature = "rotations")]
use crate::space::BodyFrame;
use crate::space::Space;
use symspline_engine::curve::{LastSegment, Quantity};

impl<S: Space, P: Point<S>> Builder<S, P> {
    /// Fits the curve through points at increasing times.
    ///
    /// # Errors
    /// If the input is invalid, if points are too far apart for a curve, or if the solver does not converge.
    pub fn fit(&self, times: &[f64], points: &[P]) -> Result<CubicSpline<S, P>, Error> {
        let (curves, reports) = Curves::fit(self, &[times], &[points], false)?;
        Ok(CubicSpline { curves, report: reports[0] })
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

/// The points of a curve at one time after the other: [`CubicSpline::evaluator`]. It keeps what it computed of the last
/// segment.
pub struct Evaluator<'a, S, P> {
    curves: &'a Curves<S, P>,
    last: Vec<LastSegment>,
}

impl<S: Space, P: Point<S>> Evaluator<'_, S, P> {
    /// The point at a time.
    ///
    /// # Panics
    /// As [`CubicSpline::at`].
    #[track_caller]
    pub fn at(&mut self, time: f64) -> P {
        expect(self.try_at(time))
    }

    /// The point at a time, or an error.
    ///
    /// # Errors
    /// As [`CubicSpline::try_at`].
    pub fn try_at(&mut self, time: f64) -> Result<P, Error> {
        self.curves.point(time, &self.last)
    }
}

impl<S: Space, P: Point<S>> CubicSpline<S, P> {
    /// Fits the curve through points at increasing times, with [`End::Natural`](crate::End::Natural) at both ends.
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

    /// Report of the fit.
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

    /// The point at a time, or an error.
    ///
    /// # Errors
    /// [`Error::OutsideDomain`] if the time is NaN or infinite, or outside the knots without [`Builder::extrapolate`].
    pub fn try_at(&self, time: f64) -> Result<P, Error> {
        self.curves.point(time, &[])
    }

    /// Evaluates points one after the other, in two thirds of the time where many lie in the same segment.
    ///
    /// # Examples
    /// ```
    /// use symspline::prelude::*;
    ///
    /// let line = CubicSpline::new(Euclidean::<1>, &[0.0, 1.0, 2.0], &[[0.0], [1.0], [4.0]])?;
    /// let mut evaluator = line.evaluator();
    /// let path: Vec<f64> = (0..=4).map(|i| evaluator.at(f64::from(i) / 4.0)[0]).collect();
    /// assert_eq!((path[0], path[4]), (0.0, 1.0));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn evaluator(&self) -> Evaluator<'_, S, P> {
        Evaluator { curves: &self.curves, last: self.curves.last_segments() }
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
        expect(self.curves.evaluate(&[time], Quantity::Speed))[0][0]
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
