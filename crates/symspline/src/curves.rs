//! Fitted curves as lists of numbers: validation, fit and evaluation.

use crate::error::Error;
use crate::options::{Builder, End, Ends, Extrapolate, Method};
use crate::point::{Point, Row};
use crate::samples::Samples;
use crate::space::{Space, Table};
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;
use symspline_engine::curve::{self, Quantity, Times};
use symspline_engine::fit::{self, Options, Problem, Report};
use symspline_engine::monitor::Monitor;
#[cfg(feature = "serde")]
use symspline_engine::rows::tangent_defects;
use symspline_engine::space::{Ambient, Erased};
use symspline_engine::validate::validate;

/// Times that exceed the last knot by this many spacings of floating-point numbers are taken for the knot.
const ROUNDING: f64 = 4.0;

/// Curves on a space, in the layout of the engine.
pub struct Curves<S, P> {
    pub space: S,
    table: Table,
    /// Knots: one row for all curves, or those of each curve one after the other.
    t: Arc<[f64]>,
    shared: bool,
    /// The number of nodes before each curve, and finally of all.
    offsets: Arc<[usize]>,
    points: Arc<[f64]>,
    velocities: Arc<[f64]>,
    extrapolate: Extrapolate,
    point: PhantomData<fn() -> P>,
}

impl<S: Clone, P> Clone for Curves<S, P> {
    fn clone(&self) -> Self {
        Curves {
            space: self.space.clone(),
            table: self.table.clone(),
            t: self.t.clone(),
            offsets: self.offsets.clone(),
            points: self.points.clone(),
            velocities: self.velocities.clone(),
            ..*self
        }
    }
}

impl<S: fmt::Debug, P> fmt::Debug for Curves<S, P> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (curves, nodes) = (self.offsets.len() - 1, self.offsets[self.offsets.len() - 1]);
        write!(f, "{:?}: {curves} curve(s) with {nodes} knots", self.space)
    }
}

/// The points of curves, one after the other, and the offsets of the curves.
pub fn rows<S: Space, P: Point<S>>(len: usize, curves: &[&[P]]) -> Result<(Vec<f64>, Vec<usize>), Error> {
    let mut rows = Vec::with_capacity(len * curves.iter().map(|c| c.len()).sum::<usize>());
    let mut offsets = vec![0];
    for (curve, points) in curves.iter().enumerate() {
        for (node, point) in points.iter().enumerate() {
            let before = rows.len();
            point.write(&mut rows);
            let found = rows.len() - before;
            if found != len {
                return Err(Error::PointLength { curve, node, expected: len, found });
            }
        }
        if points.len() < 2 {
            return Err(Error::TooFewPoints { curve, points: points.len() });
        }
        offsets.push(offsets[curve] + points.len());
    }
    Ok((rows, offsets))
}

impl<S: Space, P: Point<S>> Curves<S, P> {
    /// Fits curves with the same times, one row, or one row of times per curve.
    pub fn fit(
        builder: &Builder<S, P>,
        times: &[&[f64]],
        points: &[&[P]],
        shared: bool,
    ) -> Result<(Self, Vec<Report>), Error> {
        let Builder { tol, point_tol, max_iter, .. } = *builder;
        for (name, value) in [("tol", tol), ("point_tol", point_tol)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::InvalidOption { name, value, requirement: "a finite number >= 0" });
            }
        }
        if max_iter == Some(0) {
            return Err(Error::InvalidOption { name: "max_iter", value: 0.0, requirement: "at least 1" });
        }
        if points.is_empty() {
            return Err(Error::LengthMismatch { curve: 0, what: "curves", expected: 1, found: 0 });
        }
        let table = builder.space.table()?;
        let (rows, offsets) = rows::<S, P>(Erased(&*table).point_len(), points)?;
        for (curve, own) in points.iter().enumerate() {
            let (expected, found) = (own.len(), times[if shared { 0 } else { curve }].len());
            if found != expected {
                return Err(Error::LengthMismatch { curve, what: "times", expected, found });
            }
        }
        let t = times.concat();
        let (curves, reports) = Self::through(builder, table, t, shared, rows, offsets)?;
        let space = curves.table();
        let error = |(curve, report)| Error::of_fit(curve, report, &space, tol);
        match reports.iter().enumerate().find_map(error) {
            Some(error) => Err(error),
            None => Ok((curves, reports)),
        }
    }

    /// The curves through the numbers of their points, of which some may not exist: see the reports.
    pub fn through(
        builder: &Builder<S, P>,
        table: Table,
        t: Vec<f64>,
        shared: bool,
        rows: Vec<f64>,
        offsets: Vec<usize>,
    ) -> Result<(Self, Vec<Report>), Error> {
        let space = Erased(&*table);
        let vectors = end_vectors(builder, space.point_len(), &rows, &offsets)?;
        let ends = match &builder.ends {
            Ends::Periodic => fit::Ends::Periodic,
            Ends::Open(ends) => fit::Ends::Open([0, 1].map(|e| match ends[e] {
                End::Natural => fit::End::Natural,
                End::NotAKnot => fit::End::NotAKnot,
                End::Velocity(_) => fit::End::Velocity(&vectors[e]),
                End::Acceleration(_) => fit::End::Acceleration(&vectors[e]),
            })),
        };
        let problem = Problem { t: &t, shared, points: &rows, offsets: &offsets, ends };
        let points = validate(&space, &problem, builder.point_tol).map_err(Error::of_input)?;
        let method = match builder.method {
            Method::Auto => fit::Method::Auto,
            Method::FixedPoint => fit::Method::FixedPoint,
            Method::QuasiNewton => fit::Method::QuasiNewton,
            Method::Newton => fit::Method::Newton,
            Method::Homotopy => fit::Method::Homotopy,
        };
        let mut velocities = vec![0.0; points.len()];
        let go_on = |_| true;
        let options = Options { method, tol: builder.tol, max_iter: builder.max_iter };
        let problem = Problem { points: &points, ..problem };
        let reports = fit::fit(&space, &problem, &options, &Monitor::new(&go_on), &mut velocities);
        Ok((Curves::new(builder, table, t, shared, offsets, points, velocities), reports))
    }

    /// One curve from a file, after validation.
    #[cfg(feature = "serde")]
    pub fn stored(
        builder: &Builder<S, P>,
        t: Vec<f64>,
        points: Vec<f64>,
        velocities: Vec<f64>,
    ) -> Result<Self, Error> {
        let table = builder.space.table()?;
        let space = Erased(&*table);
        let (nodes, len) = (t.len(), space.point_len());
        if nodes < 2 {
            return Err(Error::TooFewPoints { curve: 0, points: nodes });
        }
        for (what, row) in [("numbers of points", &points), ("numbers of velocities", &velocities)] {
            let (expected, found) = (nodes * len, row.len());
            if found != expected {
                return Err(Error::LengthMismatch { curve: 0, what, expected, found });
            }
        }
        let ends = fit::Ends::Open([fit::End::Natural; 2]);
        let problem = Problem { t: &t, shared: true, points: &points, offsets: &[0, nodes], ends };
        let points = validate(&space, &problem, builder.point_tol).map_err(Error::of_input)?;
        let defects = tangent_defects(&space, &points, &velocities);
        if let Some(node) = defects.iter().position(|d| !(*d <= builder.point_tol)) {
            let condition = "its velocity is not tangent".into();
            return Err(Error::OffSpace { curve: 0, node, distance: defects[node], condition });
        }
        Ok(Curves::new(builder, table, t, true, vec![0, nodes], points, velocities))
    }

    /// The numbers of the velocities of a curve at its knots.
    #[cfg(feature = "serde")]
    pub fn velocity_rows(&self, curve: usize) -> &[f64] {
        &self.velocities[self.range(curve)]
    }

    /// Curves with given velocities.
    pub fn new(
        builder: &Builder<S, P>,
        table: Table,
        t: Vec<f64>,
        shared: bool,
        offsets: Vec<usize>,
        points: Vec<f64>,
        velocities: Vec<f64>,
    ) -> Self {
        Curves {
            space: builder.space.clone(),
            table,
            t: t.into(),
            shared,
            offsets: offsets.into(),
            points: points.into(),
            velocities: velocities.into(),
            extrapolate: builder.extrapolate,
            point: PhantomData,
        }
    }

    /// The number of curves.
    pub fn count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The knots of a curve.
    pub fn knots(&self, curve: usize) -> &[f64] {
        if self.shared { &self.t } else { &self.t[self.offsets[curve]..self.offsets[curve + 1]] }
    }

    /// First and last knot of a curve.
    pub fn domain(&self, curve: usize) -> (f64, f64) {
        let t = self.knots(curve);
        (t[0], t[t.len() - 1])
    }

    /// The operations of the space.
    pub fn table(&self) -> Erased<'_> {
        Erased(&*self.table)
    }

    /// The numbers of the points of a curve.
    pub fn point_rows(&self, curve: usize) -> &[f64] {
        &self.points[self.range(curve)]
    }

    fn range(&self, curve: usize) -> std::ops::Range<usize> {
        let len = self.table().point_len();
        self.offsets[curve] * len..self.offsets[curve + 1] * len
    }

    /// The points of a curve.
    pub fn at_knots(&self, curve: usize) -> Vec<P> {
        self.point_rows(curve).chunks(self.table().point_len()).map(P::read).collect()
    }

    /// The velocities of a curve at its knots.
    pub fn velocities_at_knots(&self, curve: usize) -> Vec<P::Tangent> {
        self.read_tangents(self.point_rows(curve), &self.velocities[self.range(curve)])
    }

    /// One of the curves.
    pub fn one(&self, curve: usize) -> Self {
        let range = self.range(curve);
        Curves {
            space: self.space.clone(),
            table: self.table.clone(),
            t: self.knots(curve).into(),
            shared: true,
            offsets: [0, self.offsets[curve + 1] - self.offsets[curve]].into(),
            points: self.points[range.clone()].into(),
            velocities: self.velocities[range].into(),
            extrapolate: self.extrapolate,
            point: PhantomData,
        }
    }

    /// The numbers of a quantity at times of all curves, curve by curve.
    pub fn evaluate(&self, times: &[f64], quantity: Quantity) -> Result<Vec<f64>, Error> {
        let space = self.table();
        let size = quantity.len(&space);
        let mut out = vec![0.0; self.count() * times.len() * size];
        let nodes = self.offsets[1];
        let equal = self.offsets.windows(2).all(|pair| pair[1] - pair[0] == nodes);
        let mut rest = &mut out[..];
        // Curves with equally many knots are evaluated together.
        for c in 0..if equal { 1 } else { self.count() } {
            let whole = 0..self.points.len();
            let range = if equal { whole } else { self.range(c) };
            let curves = curve::Curves {
                t: if equal { &self.t } else { self.knots(c) },
                nodes: self.offsets[c + 1] - self.offsets[c],
                points: &self.points[range.clone()],
                velocities: &self.velocities[range],
                before: &[],
            };
            let inside: Vec<f64>;
            let x = match self.extrapolate {
                Extrapolate::Error => {
                    inside = self.inside(if equal { 0..self.count() } else { c..c + 1 }, times)?;
                    &inside
                }
                _ => finite(times, self.domain(c))?,
            };
            let own;
            (own, rest) =
                if equal { (rest, [].as_mut_slice()) } else { rest.split_at_mut(times.len() * size) };
            let (times, go_on) = (Times { x, count: times.len() }, |_| true);
            let outside = self.extrapolate.policy();
            curve::evaluate(&space, &curves, &times, quantity, outside, &Monitor::new(&go_on), own);
        }
        Ok(out)
    }

    /// Points at times of all curves.
    pub fn sample(&self, times: &[f64]) -> Result<Samples<P>, Error> {
        let rows = self.evaluate(times, Quantity::Point)?;
        Ok(Samples::read(&rows, self.table().point_len(), times.len()))
    }

    /// Times that are inside the knots of some curves, up to rounding.
    fn inside(&self, mut curves: std::ops::Range<usize>, times: &[f64]) -> Result<Vec<f64>, Error> {
        if self.shared {
            curves.end = curves.start + 1;
        }
        let mut x = times.to_vec();
        for (start, end) in curves.map(|c| self.domain(c)) {
            let reach = ROUNDING * f64::EPSILON * start.abs().max(end.abs());
            for x in &mut x {
                if !(*x >= start - reach && *x <= end + reach) {
                    return Err(Error::OutsideDomain { time: *x, start, end });
                }
                *x = x.clamp(start, end);
            }
        }
        Ok(x)
    }

    /// Velocities or accelerations at times of all curves.
    pub fn tangents(&self, times: &[f64], quantity: Quantity) -> Result<Vec<P::Tangent>, Error> {
        let ambient = self.evaluate(times, quantity)?;
        Ok(self.read_tangents(&self.evaluate(times, Quantity::Point)?, &ambient))
    }

    fn read_tangents(&self, points: &[f64], ambient: &[f64]) -> Vec<P::Tangent> {
        let len = self.table().point_len();
        let mut row = Vec::with_capacity(len);
        let read = |(p, v)| {
            row.clear();
            self.space.write_velocity(p, v, &mut row);
            P::Tangent::read(&row)
        };
        points.chunks(len).zip(ambient.chunks(len)).map(read).collect()
    }
}

/// Times that are finite.
fn finite(times: &[f64], (start, end): (f64, f64)) -> Result<&[f64], Error> {
    match times.iter().find(|x| !x.is_finite()) {
        Some(&time) => Err(Error::OutsideDomain { time, start, end }),
        None => Ok(times),
    }
}

/// The ambient arrays of the vectors at both ends of every curve.
fn end_vectors<S: Space, P: Point<S>>(
    builder: &Builder<S, P>,
    len: usize,
    points: &[f64],
    offsets: &[usize],
) -> Result<[Vec<f64>; 2], Error> {
    let mut out = [Vec::new(), Vec::new()];
    let Ends::Open(ends) = &builder.ends else { return Ok(out) };
    for (e, (end, out)) in ends.iter().zip(&mut out).enumerate() {
        let (End::Velocity(vector) | End::Acceleration(vector)) = end else { continue };
        let mut row = Vec::new();
        vector.write(&mut row);
        for (curve, pair) in offsets.windows(2).enumerate() {
            let node = if e == 0 { pair[0] } else { pair[1] - 1 };
            let before = out.len();
            builder.space.write_ambient(&points[node * len..(node + 1) * len], &row, out);
            let found = out.len() - before;
            if found != len {
                return Err(Error::PointLength { curve, node: node - pair[0], expected: len, found });
            }
        }
    }
    Ok(out)
}
