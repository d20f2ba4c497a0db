//! Many curves.

use crate::curves::{Curves, Report};
use crate::error::Error;
use crate::options::Builder;
use crate::point::Point;
use crate::samples::Samples;
use crate::space::Space;
use crate::spline::CubicSpline;
use symspline_engine::curve::Quantity;

impl<S: Space, P: Point<S>> Builder<S, P> {
    /// Fits many curves whose points are at the same times, on all cores.
    ///
    /// # Errors
    /// As [`fit`](Builder::fit); the error names the first curve that fails.
    pub fn fit_shared(&self, times: &[f64], curves: &[impl AsRef<[P]>]) -> Result<Batch<S, P>, Error> {
        let points: Vec<&[P]> = curves.iter().map(AsRef::as_ref).collect();
        let (curves, reports) = Curves::fit(self, &[times], &points, true)?;
        Ok(Batch { curves, reports })
    }

    /// Fits many curves, each with times and points of its own, on all cores.
    ///
    /// # Errors
    /// As [`fit`](Builder::fit); the error names the first curve that fails.
    pub fn fit_each(&self, curves: &[(impl AsRef<[f64]>, impl AsRef<[P]>)]) -> Result<Batch<S, P>, Error> {
        let times: Vec<&[f64]> = curves.iter().map(|(t, _)| t.as_ref()).collect();
        let points: Vec<&[P]> = curves.iter().map(|(_, p)| p.as_ref()).collect();
        let (curves, reports) = Curves::fit(self, &times, &points, false)?;
        Ok(Batch { curves, reports })
    }
}

/// Many curves on a space, fitted and evaluated together on all cores.
///
/// # Examples
/// ```
/// use symspline::prelude::*;
///
/// let times = [0.0, 1.0, 2.0];
/// let many = [
///     vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
///     vec![[0.0, 1.0, 0.0], [0.6, 0.8, 0.0], [1.0, 0.0, 0.0]],
/// ];
/// let batch = Batch::fit_shared(Sphere::<3>, &times, &many)?;
/// let samples = batch.sample(&[0.0, 0.5, 1.0])?;
/// assert_eq!(samples[1][0], [0.0, 1.0, 0.0]); // curve 1, time 0
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Batch<S: Space, P: Point<S>> {
    curves: Curves<S, P>,
    reports: Vec<Report>,
}

impl<S: Space, P: Point<S>> Batch<S, P> {
    /// Fits curves whose points are at the same times.
    ///
    /// # Errors
    /// As [`Builder::fit`]; the error names the first curve that fails.
    pub fn fit_shared(space: S, times: &[f64], curves: &[impl AsRef<[P]>]) -> Result<Self, Error> {
        Self::builder(space).fit_shared(times, curves)
    }

    /// Fits curves, each with times and points of its own.
    ///
    /// # Errors
    /// As [`Builder::fit`]; the error names the first curve that fails.
    pub fn fit_each(space: S, curves: &[(impl AsRef<[f64]>, impl AsRef<[P]>)]) -> Result<Self, Error> {
        Self::builder(space).fit_each(curves)
    }

    /// The options of a fit.
    pub fn builder(space: S) -> Builder<S, P> {
        Builder::new(space)
    }

    /// The number of curves.
    pub fn len(&self) -> usize {
        self.curves.count()
    }

    /// Whether there is no curve. A batch has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of the curves.
    ///
    /// # Panics
    /// If the index is not less than the number of curves.
    pub fn curve(&self, index: usize) -> CubicSpline<S, P> {
        CubicSpline { curves: self.curves.one(index), report: self.reports[index] }
    }

    /// Reports of the fits, one per curve.
    pub fn reports(&self) -> &[Report] {
        &self.reports
    }

    /// Points of all curves at the same times, `samples[curve][time]`.
    ///
    /// # Errors
    /// [`Error::OutsideDomain`] if a time is NaN or infinite, or outside the knots without [`Builder::extrapolate`].
    pub fn sample(&self, times: &[f64]) -> Result<Samples<P>, Error> {
        self.curves.sample(times)
    }

    /// Velocities of all curves at the same times, `samples[curve][time]`.
    ///
    /// # Errors
    /// As [`sample`](Batch::sample).
    pub fn sample_velocity(&self, times: &[f64]) -> Result<Samples<P::Tangent>, Error> {
        Ok(Samples { values: self.curves.tangents(times, Quantity::Velocity)?, count: times.len() })
    }
}
