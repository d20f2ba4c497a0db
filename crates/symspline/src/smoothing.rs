//! Curves close to noisy data.

use crate::curves::{Curves, rows, tables};
use crate::error::Error;
use crate::options::{Builder, End, Ends, Extrapolate};
use crate::point::Point;
use crate::space::Space;
use crate::spline::CubicSpline;
use std::ops::Deref;
use symspline_engine::fit::Status;
use symspline_engine::monitor::Monitor;
use symspline_engine::smoothing::{self as engine, Data, EndCondition, Observations, State, Tier};
use symspline_engine::space::{Ambient, Erased};
use symspline_engine::validate;

/// The cube of the time between the first and the last datum must not overflow.
const LONGEST: f64 = 1e100;
/// The C² residual that suffices for a curve through smoothed points.
const ENOUGH: f64 = 1e-8;

/// The criterion that chooses λ from the data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// Generalised cross-validation.
    #[default]
    Gcv,
    /// Restricted maximum likelihood.
    Reml,
    /// Mallows' C_p, for a known standard deviation of the noise.
    Cp,
}

/// The loss of a residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loss {
    /// Its square.
    #[default]
    Linear,
    /// Its square if it is small, and linear beyond: for data with outliers.
    Huber,
    /// It grows as the logarithm of large residuals: for data with many outliers.
    Cauchy,
}

/// A value for all factors of a space, or one per factor, of which `None` is chosen from the data.
#[derive(Clone, Debug, Default)]
pub struct FactorValues(Vec<Option<f64>>);

impl From<f64> for FactorValues {
    fn from(value: f64) -> Self {
        FactorValues(vec![Some(value)])
    }
}

impl<T: Into<Option<f64>>, const N: usize> From<[T; N]> for FactorValues {
    fn from(values: [T; N]) -> Self {
        FactorValues(values.map(T::into).into())
    }
}

impl<T: Into<Option<f64>>> From<Vec<T>> for FactorValues {
    fn from(values: Vec<T>) -> Self {
        FactorValues(values.into_iter().map(T::into).collect())
    }
}

impl FactorValues {
    /// One value per factor.
    fn in_factors(&self, what: &'static str, factors: usize) -> Result<Vec<Option<f64>>, Error> {
        match self.0[..] {
            [] => Ok(vec![None; factors]),
            [value] => Ok(vec![value; factors]),
            _ if self.0.len() == factors => Ok(self.0.clone()),
            _ => Err(Error::LengthMismatch { curve: 0, what, expected: factors, found: self.0.len() }),
        }
    }
}

/// The options of smoothing: the curve γ with the smallest `Σ wₖ d(yₖ, γ(tₖ))² + λ ∫ |∇γ'|² dt`.
///
/// # Examples
/// ```
/// use symspline::prelude::*;
///
/// // A quarter of a circle with noise.
/// let noise = |i: f64| 0.02 * (1e4 * (1.0 + i).sin()).fract();
/// let times: Vec<f64> = (0..40).map(|i| f64::from(i) / 39.0).collect();
/// let noisy: Vec<[f64; 3]> = times
///     .iter()
///     .map(|t| {
///         let (angle, height) = (1.5 * t + noise(*t), noise(7.0 + t));
///         [height.cos() * angle.cos(), height.cos() * angle.sin(), height.sin()]
///     })
///     .collect();
/// let soft = Smoothing::default().loss(Loss::Huber).fit(Sphere::<3>, &times, &noisy)?;
/// let direction = soft.at(0.5);
/// assert!((direction[0] - 0.75_f64.cos()).abs() < 0.02);
/// assert!(soft.std(0.5) < soft.smoothing_report().sigma);
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug)]
#[must_use = "the options do nothing before `fit`"]
pub struct Smoothing {
    criterion: Criterion,
    gamma: f64,
    loss: Loss,
    lam: FactorValues,
    sigma: FactorValues,
    weights: Option<Vec<f64>>,
    knots: Option<Vec<f64>>,
    periodic: bool,
    tol: f64,
    max_iter: usize,
    point_tol: f64,
    extrapolate: Extrapolate,
}

impl Default for Smoothing {
    fn default() -> Self {
        Smoothing {
            criterion: Criterion::Gcv,
            gamma: 1.2,
            loss: Loss::Linear,
            lam: FactorValues::default(),
            sigma: FactorValues::default(),
            weights: None,
            knots: None,
            periodic: false,
            tol: 1e-3,
            max_iter: 50,
            point_tol: 1e-8,
            extrapolate: Extrapolate::Error,
        }
    }
}

impl Smoothing {
    /// The criterion that chooses λ; by default [`Criterion::Gcv`].
    pub fn criterion(mut self, criterion: Criterion) -> Self {
        self.criterion = criterion;
        self
    }

    /// The factor of the degrees of freedom in generalised cross-validation, at least 1; by default 1.2, as in Python.
    /// With 1 the criterion is the classical one, which smooths too little in some samples.
    pub fn gamma(mut self, gamma: f64) -> Self {
        self.gamma = gamma;
        self
    }

    /// The loss of a residual; by default its square.
    pub fn loss(mut self, loss: Loss) -> Self {
        self.loss = loss;
        self
    }

    /// λ; by default it is chosen from the data, in each factor of a product. 0 is the curve of least squares. An array has
    /// one value per factor.
    pub fn lam(mut self, lam: impl Into<FactorValues>) -> Self {
        self.lam = lam.into();
        self
    }

    /// The standard deviation of the noise in a coordinate at weight one; by default it is estimated. An array has one
    /// value per factor.
    pub fn sigma(mut self, sigma: impl Into<FactorValues>) -> Self {
        self.sigma = sigma.into();
        self
    }

    /// One weight per point, proportional to the inverse variance of its noise; by default 1. Points with weight 0 are
    /// ignored, but must be on the space. All factors of a product have the same weights.
    pub fn weights(mut self, weights: &[f64]) -> Self {
        self.weights = Some(weights.to_vec());
        self
    }

    /// The knots of the curve, from the first to the last time; by default all times.
    pub fn knots(mut self, knots: &[f64]) -> Self {
        self.knots = Some(knots.to_vec());
        self
    }

    /// Makes the curve periodic, with the first and the last knot as one period.
    pub fn periodic(mut self) -> Self {
        self.periodic = true;
        self
    }

    /// The distance from the space at which a point is refused; by default 1e-8.
    pub fn point_tol(mut self, point_tol: f64) -> Self {
        self.point_tol = point_tol;
        self
    }

    /// The extrapolation policy for times outside the knots; by default such times are an error.
    pub fn extrapolate(mut self, extrapolate: Extrapolate) -> Self {
        self.extrapolate = extrapolate;
        self
    }

    /// Fits a curve close to noisy points. Times must not decrease, but may repeat.
    ///
    /// # Errors
    /// If the input is invalid, or if the data do not determine a curve.
    pub fn fit<S: Space, P: Point<S>>(
        &self,
        space: S,
        times: &[f64],
        points: &[P],
    ) -> Result<SmoothingSpline<S, P>, Error> {
        let point_tol = FactorValues::from(self.point_tol);
        for (name, values) in [("lam", &self.lam), ("sigma", &self.sigma), ("point_tol", &point_tol)] {
            let mut values = values.0.iter().flatten();
            if let Some(&value) = values.find(|value| !(**value >= 0.0 && value.is_finite())) {
                return Err(Error::InvalidOption { name, value, requirement: "a finite number >= 0" });
            }
        }
        if !(self.gamma >= 1.0 && self.gamma.is_finite()) {
            let (name, value) = ("gamma", self.gamma);
            return Err(Error::InvalidOption { name, value, requirement: "a finite number >= 1" });
        }
        let tables = tables(&space)?;
        let lam = self.lam.in_factors("values of lam", tables.len())?;
        let sigma = self.sigma.in_factors("values of sigma", tables.len())?;
        let (mut numbers, offsets) = rows(&space, &tables, &[points])?;
        let same_length = |what, found| match found == points.len() {
            true => Ok(()),
            false => Err(Error::LengthMismatch { curve: 0, what, expected: points.len(), found }),
        };
        same_length("times", times.len())?;
        let ones = vec![1.0; points.len()];
        let weights = self.weights.as_deref().unwrap_or(&ones);
        same_length("weights", weights.len())?;
        if let Some(index) = weights.iter().position(|w| !(*w >= 0.0 && w.is_finite())) {
            return Err(Error::InvalidWeight { index, weight: weights[index] });
        }
        not_decreasing(times)?;
        for (i, (table, numbers)) in tables.iter().zip(&mut numbers).enumerate() {
            validate::points(&Erased(&**table), numbers, &offsets, self.point_tol)
                .map_err(|invalid| Error::of_input(invalid).in_factor(&space.factors(), i))?;
        }
        let knots = self.knots_for(times, weights)?;
        let smooth = |i: usize| {
            let found =
                self.smooth(&Erased(&*tables[i]), times, &numbers[i], weights, &knots, lam[i], sigma[i]);
            failure(found.report.state).map_err(|error| error.in_factor(&space.factors(), i))?;
            Ok(found)
        };
        let smoothed = (0..tables.len()).map(smooth).collect::<Result<Vec<_>, Error>>()?;
        let builder: Builder<S, P> =
            CubicSpline::builder(space.clone()).ends(natural(self.periodic)).extrapolate(self.extrapolate);
        let (offsets, mut points, mut noise) = (vec![0, knots.len()], Vec::new(), Vec::new());
        for (found, sigma) in smoothed.into_iter().zip(sigma) {
            let report = found.report;
            points.push(found.points);
            noise.push(Noise {
                inverse: found.inverse,
                // A spline with other knots than the times of the data has no freedom between its knots.
                between: if self.knots.is_some() { 0.0 } else { report.band_lam },
                report: SmoothingReport {
                    lam: report.lam,
                    df: report.freedom,
                    sigma: sigma.unwrap_or(report.sigma),
                    iterations: report.iterations,
                },
            });
        }
        let (curves, mut reports) = Curves::through(&builder, tables, knots, true, points, offsets)?;
        let fits = curves.reports(&reports);
        // Knots that nearly coincide leave a residual of rounding errors, which is small compared with the noise.
        reports.iter_mut().flatten().filter(|report| report.residual < ENOUGH).for_each(|report| {
            report.status = Status::Converged;
        });
        if let Some(error) = curves.failure(&reports, ENOUGH) {
            return Err(error);
        }
        let spline = CubicSpline { curves, report: fits[0] };
        Ok(SmoothingSpline { spline, noise, ends: self.ends() })
    }

    /// Smooths the data in one factor.
    fn smooth(
        &self,
        space: &Erased,
        times: &[f64],
        points: &[f64],
        weights: &[f64],
        knots: &[f64],
        lam: Option<f64>,
        sigma: Option<f64>,
    ) -> engine::Smooth {
        let period = self.periodic.then(|| knots[knots.len() - 1] - knots[0]);
        let own = Observations::new(times, points, weights, &[], space.point_len(), period);
        let data = Data {
            times: &own.times,
            points: &own.points,
            weights: &own.weights,
            information: &[],
            knots,
            lam,
            profile: &[],
            sigma,
            ends: [&[], &[]],
            start: &[],
        };
        let options = engine::Options {
            criterion: match self.criterion {
                Criterion::Gcv => engine::Criterion::Gcv { gamma: self.gamma },
                Criterion::Reml => engine::Criterion::Reml,
                Criterion::Cp => engine::Criterion::Cp,
            },
            penalty: engine::Penalty::Acceleration,
            loss: match self.loss {
                Loss::Linear => engine::Loss::Linear,
                Loss::Huber => engine::Loss::Huber,
                Loss::Cauchy => engine::Loss::Cauchy,
            },
            tier: Tier::Auto,
            ends: self.ends(),
            tol: self.tol,
            max_iter: self.max_iter,
            raise_lam: lam.is_none(),
            adapt: engine::Adapt::default(),
        };
        engine::smooth(space, &[data], &options, &Monitor::new(&|_| true)).remove(0)
    }

    fn ends(&self) -> engine::EndConditions {
        if self.periodic {
            engine::EndConditions::Periodic
        } else {
            engine::EndConditions::Open([EndCondition::Natural; 2])
        }
    }

    /// The knots: those given, or all times of data with a weight.
    fn knots_for(&self, times: &[f64], weights: &[f64]) -> Result<Vec<f64>, Error> {
        let (start, end) = (times[0], times[times.len() - 1]);
        let knots = match &self.knots {
            Some(knots) => knots.clone(),
            None => {
                let mut knots = times.to_vec();
                knots.dedup();
                knots
            }
        };
        if knots.len() < 2
            || !weights.iter().zip(times).any(|(w, t)| *w > 0.0 && *t > first_used(times, weights))
        {
            return Err(Error::NotSmoothed {
                reason: "a curve needs data of positive weight at two or more times, and two or more knots",
            });
        }
        validate::knots(&knots, 0).map_err(Error::of_input)?;
        if knots[0] > start || knots[knots.len() - 1] < end {
            return Err(Error::NotSmoothed {
                reason: "knots must reach from the first to the last time of the data",
            });
        }
        Ok(knots)
    }
}

/// The first time of data with a weight.
fn first_used(times: &[f64], weights: &[f64]) -> f64 {
    times.iter().zip(weights).find(|(_, w)| **w > 0.0).map_or(f64::INFINITY, |(t, _)| *t)
}

fn natural<T>(periodic: bool) -> Ends<T> {
    if periodic { Ends::Periodic } else { Ends::Open([End::Natural, End::Natural]) }
}

/// Times are finite, do not decrease, and do not span too much.
fn not_decreasing(times: &[f64]) -> Result<(), Error> {
    if let Some(node) = times.iter().position(|t| !t.is_finite()) {
        return Err(Error::TimeNotFinite { curve: 0, node, time: times[node] });
    }
    match (1..times.len()).find(|&i| times[i] < times[i - 1]) {
        Some(node) => {
            Err(Error::UnsortedTimes { curve: 0, node, before: times[node - 1], time: times[node] })
        }
        None if times[times.len() - 1] - times[0] > LONGEST => Err(Error::TimesTooFarApart { curve: 0 }),
        None => Ok(()),
    }
}

/// The error of a curve that could not be smoothed.
fn failure(state: State) -> Result<(), Error> {
    let reason = match state {
        State::Converged => return Ok(()),
        State::Running | State::Unconverged => {
            "the smoothing did not converge: pass lam, or check units and signs"
        }
        State::Unsettled => "the choice of lam did not converge: pass lam, or another criterion",
        State::NoCurve => {
            "no spline joins the smoothed points: pass more knots in the gaps of the data, or a larger lam"
        }
        State::Undetermined => {
            "the data do not determine the curve: pass fewer knots, or remove tiny weights"
        }
    };
    Err(Error::NotSmoothed { reason })
}

/// Report of a smoothing fit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SmoothingReport {
    /// λ.
    pub lam: f64,
    /// Degrees of freedom per coordinate: 2 for a geodesic, the number of data for interpolation.
    pub df: f64,
    /// The standard deviation of the noise in a coordinate at weight one.
    pub sigma: f64,
    /// The number of iterations.
    pub iterations: usize,
}

/// A spline close to noisy points. It has the methods of [`CubicSpline`].
#[derive(Clone, Debug)]
pub struct SmoothingSpline<S: Space, P: Point<S>> {
    spline: CubicSpline<S, P>,
    noise: Vec<Noise>,
    ends: engine::EndConditions,
}

/// The report and the uncertainty of the curve in one factor.
#[derive(Clone, Debug)]
struct Noise {
    inverse: Vec<f64>,
    between: f64,
    report: SmoothingReport,
}

impl<S: Space, P: Point<S>> Deref for SmoothingSpline<S, P> {
    type Target = CubicSpline<S, P>;

    fn deref(&self) -> &CubicSpline<S, P> {
        &self.spline
    }
}

impl<S: Space, P: Point<S>> SmoothingSpline<S, P> {
    /// The curve without its data.
    pub fn into_spline(self) -> CubicSpline<S, P> {
        self.spline
    }

    /// Report of a smoothing fit, in each factor of a product.
    pub fn smoothing_report(&self) -> S::PerFactor<SmoothingReport> {
        S::per_factor(self.noise.iter().map(|noise| noise.report).collect())
    }

    /// The standard deviation of the curve at a time, in one coordinate of an orthonormal frame, in each factor of a
    /// product. Beyond the knots it is that of a curve that continues with constant velocity, or periodically. On a sphere
    /// and for rotations it is in radians. It is NaN if there are too few data to estimate the noise: then pass
    /// [`Smoothing::sigma`].
    ///
    /// # Panics
    /// If the time is NaN or infinite.
    #[track_caller]
    pub fn std(&self, time: f64) -> S::PerFactor<f64> {
        assert!(time.is_finite(), "the time is {time}, but times must be finite");
        let knots = self.spline.times();
        let std = |Noise { inverse, between, report }: &Noise| {
            let variance = engine::variance(knots, inverse, (*between, &[]), self.ends, &[time], 0);
            report.sigma * variance[0].sqrt()
        };
        S::per_factor(self.noise.iter().map(std).collect())
    }
}
