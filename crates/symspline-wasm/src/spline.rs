//! Curves through points, and close to noisy points. Every space is a product, of one factor or more: the numbers of a
//! point are those in the first factor, then those in the second one, and so on.

use crate::family::{Family, factors};
use crate::fault::Fault;
use symspline::{
    CubicSpline, End, Ends as Both, Extrapolate, Loss, Method, Product, Smoothing, SmoothingReport,
    SmoothingSpline,
};
use symspline_engine::smoothing::chi;
use symspline_engine::space::Ambient;
use wasm_bindgen::prelude::*;

/// A point or a vector, with one list of numbers per factor.
type Row = Vec<Vec<f64>>;

/// End conditions.
#[wasm_bindgen]
pub struct Ends(Both<Row>);

#[wasm_bindgen]
impl Ends {
    /// A periodic curve.
    pub fn periodic() -> Ends {
        Ends(Both::Periodic)
    }

    /// A condition at either end: `natural`, `not-a-knot`, `velocity` or `acceleration`, and the vectors of the last two.
    pub fn open(
        space: &str,
        start: &str,
        start_vector: &[f64],
        end: &str,
        end_vector: &[f64],
    ) -> Result<Ends, Fault> {
        let space = space_of(space)?;
        Ok(Ends(Both::Open([one_end(&space, start, start_vector)?, one_end(&space, end, end_vector)?])))
    }
}

fn one_end(space: &Product<Family>, kind: &str, vector: &[f64]) -> Result<End<Row>, Fault> {
    match kind {
        "natural" => Ok(End::Natural),
        "not-a-knot" => Ok(End::NotAKnot),
        "velocity" => Ok(End::Velocity(row(space, vector))),
        "acceleration" => Ok(End::Acceleration(row(space, vector))),
        _ => Err(Fault::invalid("bcType", None, format!("unknown end condition {kind:?}"))),
    }
}

enum Curve {
    Through(CubicSpline<Product<Family>, Row>),
    Near(SmoothingSpline<Product<Family>, Row>),
}

/// A fitted curve.
#[wasm_bindgen]
pub struct Spline(Curve);

#[wasm_bindgen]
impl Spline {
    /// The curve through points.
    #[allow(clippy::too_many_arguments)]
    pub fn fit(
        t: &[f64],
        points: &[f64],
        space: &str,
        ends: &Ends,
        method: &str,
        tol: f64,
        atol: f64,
        extrapolate: &str,
    ) -> Result<Spline, Fault> {
        let space = space_of(space)?;
        let points = rows(&space, points);
        let spline = CubicSpline::builder(space)
            .ends(ends.0.clone())
            .method(method_of(method)?)
            .tol(tol)
            .point_tol(atol)
            .extrapolate(extrapolation(extrapolate)?)
            .fit(t, &points)?;
        Ok(Spline(Curve::Through(spline)))
    }

    /// The curve close to noisy points. λ and σ are one value for all factors or one per factor; no value, or NaN, lets
    /// generalised cross-validation choose λ, and estimates σ.
    #[allow(clippy::too_many_arguments)]
    pub fn smooth(
        t: &[f64],
        points: &[f64],
        space: &str,
        lam: Vec<f64>,
        weights: Option<Vec<f64>>,
        knots: Option<Vec<f64>>,
        sigma: Vec<f64>,
        gamma: f64,
        loss: &str,
        periodic: bool,
        atol: f64,
        extrapolate: &str,
    ) -> Result<Spline, Fault> {
        let space = space_of(space)?;
        let points = rows(&space, points);
        let loss = match loss {
            "linear" => Loss::Linear,
            "huber" => Loss::Huber,
            "cauchy" => Loss::Cauchy,
            _ => {
                let message = format!("loss must be \"linear\", \"huber\" or \"cauchy\", not {loss:?}");
                return Err(Fault::invalid("loss", None, message));
            }
        };
        let mut options = Smoothing::default().gamma(gamma).loss(loss).point_tol(atol);
        options = options.extrapolate(extrapolation(extrapolate)?);
        let given = |values: Vec<f64>| -> Vec<_> {
            values.into_iter().map(|value| Some(value).filter(|value| !value.is_nan())).collect()
        };
        options = options.lam(given(lam)).sigma(given(sigma));
        options = weights.iter().fold(options, |options, weights| options.weights(weights));
        options = knots.iter().fold(options, |options, knots| options.knots(knots));
        let options = if periodic { options.periodic() } else { options };
        Ok(Spline(Curve::Near(options.fit(space, t, &points)?)))
    }

    /// The points, velocities or accelerations at times, for `nu` 0, 1 or 2.
    pub fn evaluate(&self, x: &[f64], nu: u8) -> Result<Vec<f64>, Fault> {
        let found = match nu {
            0 => self.curve().sample(x),
            1 => self.curve().sample_velocity(x),
            2 => self.curve().sample_acceleration(x),
            _ => return Err(Fault::invalid("nu", None, format!("nu must be 0, 1 or 2, not {nu}"))),
        };
        Ok(found?.concat().concat())
    }

    /// The knots.
    #[wasm_bindgen(getter)]
    pub fn t(&self) -> Vec<f64> {
        self.curve().times().to_vec()
    }

    /// The points at the knots.
    #[wasm_bindgen(getter)]
    pub fn points(&self) -> Vec<f64> {
        self.curve().points().concat().concat()
    }

    /// The velocities at the knots.
    #[wasm_bindgen(getter)]
    pub fn velocities(&self) -> Vec<f64> {
        self.curve().velocities().concat().concat()
    }

    /// Iterations, C² residual and longest step of the fit.
    #[wasm_bindgen(getter)]
    pub fn report(&self) -> Vec<f64> {
        let report = self.curve().report();
        vec![report.iterations as f64, report.residual, report.max_step]
    }

    /// The name of the solver.
    #[wasm_bindgen(getter)]
    pub fn solver(&self) -> String {
        self.curve().report().solver.into()
    }

    /// λ, degrees of freedom, standard deviation of the noise, and iterations of a smoothing fit, for each factor; empty
    /// for others.
    #[wasm_bindgen(getter)]
    pub fn smoothing(&self) -> Vec<f64> {
        match &self.0 {
            Curve::Through(_) => Vec::new(),
            Curve::Near(near) => {
                let numbers = |report: &SmoothingReport| {
                    [report.lam, report.df, report.sigma, report.iterations as f64]
                };
                near.smoothing_report().iter().flat_map(numbers).collect()
            }
        }
    }

    /// The standard deviations of a smoothed curve at times, in each factor.
    pub fn std(&self, x: &[f64]) -> Result<Vec<f64>, Fault> {
        let Curve::Near(near) = &self.0 else { return Ok(Vec::new()) };
        // It checks that the times are allowed.
        near.sample(x)?;
        Ok(x.iter().flat_map(|x| near.std(*x)).collect())
    }
}

impl Spline {
    fn curve(&self) -> &CubicSpline<Product<Family>, Row> {
        match &self.0 {
            Curve::Through(through) => through,
            Curve::Near(near) => near,
        }
    }
}

/// The radius of the ball that contains a standard normal vector of `dim` entries with a probability.
#[wasm_bindgen(js_name = ballRadius)]
pub fn ball_radius(dim: usize, level: f64) -> f64 {
    chi::quantile(dim, level).sqrt()
}

/// The points of a product. A last point that is too short is an error of the fit.
fn rows(space: &Product<Family>, points: &[f64]) -> Vec<Row> {
    let len: usize = space.0.iter().map(|factor| factor.get().point_len()).sum();
    points.chunks(len).map(|point| row(space, point)).collect()
}

/// The numbers of a point in each factor.
fn row(space: &Product<Family>, mut numbers: &[f64]) -> Row {
    let part = |factor: &Family| {
        let (part, rest) = numbers.split_at(factor.get().point_len().min(numbers.len()));
        numbers = rest;
        part.to_vec()
    };
    space.0.iter().map(part).collect()
}

fn space_of(name: &str) -> Result<Product<Family>, Fault> {
    factors(name).map_err(|why| Fault::invalid("space", None, why))
}

fn method_of(name: &str) -> Result<Method, Fault> {
    match name {
        "auto" => Ok(Method::Auto),
        "fixed-point" => Ok(Method::FixedPoint),
        "quasi-newton" => Ok(Method::QuasiNewton),
        "newton" => Ok(Method::Newton),
        "homotopy" => Ok(Method::Homotopy),
        _ => Err(Fault::invalid("method", None, format!("unknown method {name:?}"))),
    }
}

fn extrapolation(policy: &str) -> Result<Extrapolate, Fault> {
    match policy {
        "raise" => Ok(Extrapolate::Error),
        "segment" => Ok(Extrapolate::Segment),
        "geodesic" => Ok(Extrapolate::Geodesic),
        "periodic" => Ok(Extrapolate::Periodic),
        _ => Err(Fault::invalid("extrapolate", None, format!("unknown extrapolation policy {policy:?}"))),
    }
}
