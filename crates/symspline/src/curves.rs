//! Fitted curves as lists of numbers in each factor of their space: validation, fit and evaluation.

use crate::error::{Error, name_of};
use crate::options::{Builder, End, Ends, Extrapolate, Method};
use crate::point::{Point, Rows, read};
use crate::samples::Samples;
use crate::space::{Space, Table};
use smallvec::{SmallVec, smallvec};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::sync::Arc;
use symspline_engine::curve::{self, LastSegment, Quantity, Times, evaluate_product};
use symspline_engine::fit::{self, Options, Problem, Solver};
use symspline_engine::monitor::Monitor;
#[cfg(feature = "serde")]
use symspline_engine::rows::tangent_defects;
use symspline_engine::rows::{Operation, apply};
use symspline_engine::space::{Ambient, Erased};
use symspline_engine::validate::validate;

/// Times that exceed the last knot by this many spacings of floating-point numbers are taken for the knot.
const ROUNDING: f64 = 4.0;

/// Curves on a space, in the layout of the engine.
pub struct Curves<S, P> {
    pub space: S,
    factors: Arc<[Factor]>,
    /// Knots: one row for all curves, or those of each curve one after the other.
    t: Arc<[f64]>,
    shared: bool,
    /// The number of nodes before each curve, and finally of all.
    offsets: Arc<[usize]>,
    extrapolate: Extrapolate,
    point: PhantomData<fn() -> P>,
}

/// The curves in one factor.
struct Factor {
    table: Table,
    points: Vec<f64>,
    velocities: Vec<f64>,
}

/// Report of a fit. For a curve that was read from a file, residual and longest step are NaN. For a product, iterations,
/// residual and solver are the worst of the factors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// The number of iterations.
    pub iterations: usize,
    /// The relative C² residual.
    pub residual: f64,
    /// The longest distance between neighbouring points, D of (21) of the paper.
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

    /// The worst of the reports in each factor, with the longest step in the product.
    pub(crate) fn new<'a>(factors: impl IntoIterator<Item = &'a fit::Report>, max_step: f64) -> Self {
        let (mut iterations, mut residual, mut solver) = (0, 0.0_f64, Solver::FixedPoint);
        for report in factors {
            iterations = iterations.max(report.iterations);
            residual = residual.max(report.residual);
            solver = if report.solver as u8 > solver as u8 { report.solver } else { solver };
        }
        Report { iterations, residual, max_step, solver: name_of(solver) }
    }
}

/// Reports of the fits, by factor and curve.
pub type Reports = Vec<Vec<fit::Report>>;

// No method changes a curve, so that a panic leaves none half changed.
impl<S, P> UnwindSafe for Curves<S, P> {}
impl<S, P> RefUnwindSafe for Curves<S, P> {}

impl<S: Clone, P> Clone for Curves<S, P> {
    fn clone(&self) -> Self {
        Curves {
            space: self.space.clone(),
            factors: self.factors.clone(),
            t: self.t.clone(),
            offsets: self.offsets.clone(),
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

impl Factor {
    fn space(&self) -> Erased<'_> {
        Erased(&*self.table)
    }

    /// The numbers of some nodes.
    fn range(&self, nodes: &Range<usize>) -> Range<usize> {
        let len = self.space().point_len();
        nodes.start * len..nodes.end * len
    }
}

/// The operations of the factors of a space.
pub fn tables(space: &impl Space) -> Result<Vec<Table>, Error> {
    let factors = space.factors();
    if factors.is_empty() {
        return Err(Error::InvalidSpace { reason: "a product needs at least one factor".into() });
    }
    let table = |(i, factor): (usize, &&dyn crate::space::Factor)| {
        factor.table().map_err(|error| error.in_factor(&space.factors(), i))
    };
    factors.iter().enumerate().map(table).collect()
}

/// The points of curves in each factor, one after the other, and the offsets of the curves.
pub fn rows<S: Space, P: Point<S>>(
    space: &S,
    tables: &[Table],
    curves: &[&[P]],
) -> Result<(Vec<Vec<f64>>, Vec<usize>), Error> {
    let nodes: usize = curves.iter().map(|points| points.len()).sum();
    let lens: Vec<usize> = tables.iter().map(|table| Erased(&**table).point_len()).collect();
    let mut rows: Vec<Vec<f64>> = lens.iter().map(|len| Vec::with_capacity(len * nodes)).collect();
    let mut offsets = vec![0];
    for (curve, points) in curves.iter().enumerate() {
        for (node, point) in points.iter().enumerate() {
            let (expected, found) = (rows.len(), point.write_rows(&mut rows));
            if found != expected {
                return Err(Error::FactorCount { curve, node, expected, found });
            }
            for (factor, (row, &expected)) in rows.iter().zip(&lens).enumerate() {
                let found = row.len() - (offsets[curve] + node) * expected;
                if found != expected {
                    let error = Error::PointLength { curve, node, expected, found };
                    return Err(error.in_factor(&space.factors(), factor));
                }
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
        let tables = tables(&builder.space)?;
        let (rows, offsets) = rows(&builder.space, &tables, points)?;
        for (curve, own) in points.iter().enumerate() {
            let (expected, found) = (own.len(), times[if shared { 0 } else { curve }].len());
            if found != expected {
                return Err(Error::LengthMismatch { curve, what: "times", expected, found });
            }
        }
        let t = times.concat();
        let (curves, reports) = Self::through(builder, tables, t, shared, rows, offsets)?;
        match curves.failure(&reports, tol) {
            Some(error) => Err(error),
            None => {
                let reports = curves.reports(&reports);
                Ok((curves, reports))
            }
        }
    }

    /// The curves through the numbers of their points in each factor, of which some may not exist: see the reports.
    pub fn through(
        builder: &Builder<S, P>,
        tables: Vec<Table>,
        t: Vec<f64>,
        shared: bool,
        rows: Vec<Vec<f64>>,
        offsets: Vec<usize>,
    ) -> Result<(Self, Reports), Error> {
        let vectors = end_vectors(builder, &tables, &rows, &offsets)?;
        let ends = |factor: usize| match &builder.ends {
            Ends::Periodic => fit::Ends::Periodic,
            Ends::Open(ends) => fit::Ends::Open([0, 1].map(|e| match ends[e] {
                End::Natural => fit::End::Natural,
                End::NotAKnot => fit::End::NotAKnot,
                End::Velocity(_) => fit::End::Velocity(&vectors[e][factor]),
                End::Acceleration(_) => fit::End::Acceleration(&vectors[e][factor]),
            })),
        };
        let mut factors = Vec::with_capacity(tables.len());
        // All factors are validated before the first one is solved.
        for (i, (table, rows)) in tables.into_iter().zip(rows).enumerate() {
            let problem = Problem { t: &t, shared, points: &rows, offsets: &offsets, ends: ends(i) };
            let points = validate(&Erased(&*table), &problem, builder.point_tol)
                .map_err(|invalid| Error::of_input(invalid).in_factor(&builder.space.factors(), i))?;
            factors.push(Factor { table, velocities: vec![0.0; points.len()], points });
        }
        let method = match builder.method {
            Method::Auto => fit::Method::Auto,
            Method::FixedPoint => fit::Method::FixedPoint,
            Method::QuasiNewton => fit::Method::QuasiNewton,
            Method::Newton => fit::Method::Newton,
            Method::Homotopy => fit::Method::Homotopy,
        };
        let go_on = |_| true;
        let options = Options { method, tol: builder.tol, max_iter: builder.max_iter, certify: None };
        let solve = |(i, Factor { table, points, velocities }): (usize, &mut Factor)| {
            let problem = Problem { t: &t, shared, points, offsets: &offsets, ends: ends(i) };
            fit::fit(&Erased(&**table), &problem, &options, &Monitor::new(&go_on), velocities)
        };
        let reports = factors.iter_mut().enumerate().map(solve).collect();
        Ok((Curves::new(builder, factors, t, shared, offsets), reports))
    }

    /// The error of the first curve that does not exist.
    pub fn failure(&self, reports: &Reports, tol: f64) -> Option<Error> {
        let in_factor = |curve: usize, i: usize| {
            let error = Error::of_fit(curve, &reports[i][curve], &self.factors[i].space(), tol)?;
            Some(error.in_factor(&self.space.factors(), i))
        };
        (0..self.count()).find_map(|curve| (0..reports.len()).find_map(|i| in_factor(curve, i)))
    }

    /// The report of each curve. A product has the worst of its factors, and distances in the product.
    pub fn reports(&self, reports: &Reports) -> Vec<Report> {
        if let [reports] = &reports[..] {
            return reports.iter().map(|report| Report::new([report], report.max_step)).collect();
        }
        let nodes = self.offsets[self.count()];
        let mut steps = vec![0.0_f64; nodes - 1];
        let (mut part, go_on) = (vec![0.0; nodes - 1], |_| true);
        for factor in &*self.factors {
            let (space, points) = (factor.space(), &factor.points);
            let (first, second) =
                (&points[factor.range(&(0..nodes - 1))], &points[factor.range(&(1..nodes))]);
            // It is defined for all points.
            let _ =
                apply(&space, Operation::Distance, &[first, second], &[], &Monitor::new(&go_on), &mut part);
            steps.iter_mut().zip(&part).for_each(|(step, part)| *step = step.hypot(*part));
        }
        let longest = |curve: usize| {
            let nodes = self.nodes(curve);
            steps[nodes.start..nodes.end - 1].iter().copied().fold(0.0, f64::max)
        };
        let report = |curve| Report::new(reports.iter().map(|factor| &factor[curve]), longest(curve));
        (0..self.count()).map(report).collect()
    }

    /// One curve from a file, after validation. Points and velocities are those of the first factor, then those of the
    /// second one, and so on.
    #[cfg(feature = "serde")]
    pub fn stored(
        builder: &Builder<S, P>,
        t: Vec<f64>,
        points: &[f64],
        velocities: &[f64],
    ) -> Result<Self, Error> {
        let (tables, nodes) = (tables(&builder.space)?, t.len());
        if nodes < 2 {
            return Err(Error::TooFewPoints { curve: 0, points: nodes });
        }
        let expected = tables.iter().map(|table| nodes * Erased(&**table).point_len()).sum();
        for (what, row) in [("numbers of points", points), ("numbers of velocities", velocities)] {
            let found = row.len();
            if found != expected {
                return Err(Error::LengthMismatch { curve: 0, what, expected, found });
            }
        }
        let (mut factors, mut first) = (Vec::with_capacity(tables.len()), 0);
        for (i, table) in tables.into_iter().enumerate() {
            let space = Erased(&*table);
            let range = first..first + nodes * space.point_len();
            first = range.end;
            let (points, velocities) = (&points[range.clone()], velocities[range].to_vec());
            let ends = fit::Ends::Open([fit::End::Natural; 2]);
            let problem = Problem { t: &t, shared: true, points, offsets: &[0, nodes], ends };
            let points = validate(&space, &problem, builder.point_tol)
                .map_err(|invalid| Error::of_input(invalid).in_factor(&builder.space.factors(), i))?;
            let defects = tangent_defects(&space, &points, &velocities);
            if let Some(node) = defects.iter().position(|d| !(*d <= builder.point_tol)) {
                let condition = "its velocity is not tangent".into();
                let error = Error::OffSpace { curve: 0, node, distance: defects[node], condition };
                return Err(error.in_factor(&builder.space.factors(), i));
            }
            factors.push(Factor { table, points, velocities });
        }
        Ok(Curves::new(builder, factors, t, true, vec![0, nodes]))
    }

    /// The numbers of the points and of the velocities of one curve, as [`Curves::stored`] reads them.
    #[cfg(feature = "serde")]
    pub fn to_store(&self) -> [Vec<f64>; 2] {
        let nodes = self.nodes(0);
        let all = |rows: fn(&Factor) -> &[f64]| {
            self.factors.iter().flat_map(|factor| &rows(factor)[factor.range(&nodes)]).copied().collect()
        };
        [all(|factor| &factor.points), all(|factor| &factor.velocities)]
    }

    fn new(
        builder: &Builder<S, P>,
        factors: Vec<Factor>,
        t: Vec<f64>,
        shared: bool,
        offsets: Vec<usize>,
    ) -> Self {
        Curves {
            space: builder.space.clone(),
            factors: factors.into(),
            t: t.into(),
            shared,
            offsets: offsets.into(),
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
        if self.shared { &self.t } else { &self.t[self.nodes(curve)] }
    }

    /// First and last knot of a curve.
    pub fn domain(&self, curve: usize) -> (f64, f64) {
        let t = self.knots(curve);
        (t[0], t[t.len() - 1])
    }

    /// The nodes of a curve among those of all curves.
    fn nodes(&self, curve: usize) -> Range<usize> {
        self.offsets[curve]..self.offsets[curve + 1]
    }

    /// The points of a curve in each factor.
    fn points(&self, curve: usize) -> Vec<&[f64]> {
        let nodes = self.nodes(curve);
        self.factors.iter().map(|factor| &factor.points[factor.range(&nodes)]).collect()
    }

    /// The points of a curve.
    pub fn at_knots(&self, curve: usize) -> Vec<P> {
        read(&self.points(curve), self.nodes(curve).len()).collect()
    }

    /// The velocities of a curve at its knots.
    pub fn velocities_at_knots(&self, curve: usize) -> Vec<P::Tangent> {
        let nodes = self.nodes(curve);
        let velocities: Vec<&[f64]> =
            self.factors.iter().map(|factor| &factor.velocities[factor.range(&nodes)]).collect();
        self.read_tangents(&self.points(curve), &velocities, nodes.len())
    }

    /// One of the curves.
    pub fn one(&self, curve: usize) -> Self {
        let nodes = self.nodes(curve);
        let part = |factor: &Factor| Factor {
            table: factor.table.clone(),
            points: factor.points[factor.range(&nodes)].to_vec(),
            velocities: factor.velocities[factor.range(&nodes)].to_vec(),
        };
        Curves {
            space: self.space.clone(),
            factors: self.factors.iter().map(part).collect(),
            t: self.knots(curve).into(),
            shared: true,
            offsets: [0, nodes.len()].into(),
            extrapolate: self.extrapolate,
            point: PhantomData,
        }
    }

    /// The numbers of a quantity at times of all curves, curve by curve: one array per factor, or one for lengths.
    pub fn evaluate(&self, times: &[f64], quantity: Quantity) -> Result<Vec<Vec<f64>>, Error> {
        let results = if quantity.is_length() { 1 } else { self.factors.len() };
        let factors = &self.factors[..results];
        let sizes: Vec<usize> = factors.iter().map(|f| times.len() * quantity.len(&f.space())).collect();
        let mut out: Vec<Vec<f64>> = sizes.iter().map(|size| vec![0.0; self.count() * size]).collect();
        let equal = self.offsets.windows(2).all(|pair| pair[1] - pair[0] == self.offsets[1]);
        // Curves with equally many knots are evaluated together.
        let together = if equal { self.count() } else { 1 };
        for first in (0..self.count()).step_by(together) {
            let nodes = self.offsets[first]..self.offsets[first + together];
            let mut factors = Vec::with_capacity(self.factors.len());
            for factor in &*self.factors {
                let curves = curve::Curves {
                    t: if equal { &self.t } else { self.knots(first) },
                    nodes: nodes.len() / together,
                    points: &factor.points[factor.range(&nodes)],
                    velocities: &factor.velocities[factor.range(&nodes)],
                    before: &[],
                };
                factors.push(curve::Factor { space: factor.space(), curves });
            }
            let inside: Vec<f64>;
            let x = match self.extrapolate {
                Extrapolate::Error => {
                    inside = self.inside(first..first + together, times)?;
                    &inside
                }
                _ => finite(times, self.domain(first))?,
            };
            let (times, go_on) = (Times { x, count: times.len() }, |_| true);
            let rows = out.iter_mut().zip(&sizes);
            let mut rows: Vec<&mut [f64]> =
                rows.map(|(out, size)| &mut out[first * size..(first + together) * size]).collect();
            let outside = self.extrapolate.policy();
            evaluate_product(&factors, &times, quantity, outside, &Monitor::new(&go_on), &mut rows);
        }
        Ok(out)
    }

    /// The point of the first curve at a time, without arrays for several curves and times. `last` has a segment per factor, or
    /// is empty.
    pub fn point(&self, time: f64, last: &[LastSegment]) -> Result<P, Error> {
        let domain = self.domain(0);
        let x = match self.extrapolate {
            Extrapolate::Error => inside(time, domain)?,
            _ => finite(&[time], domain)?[0],
        };
        let (t, nodes) = (self.knots(0), self.nodes(0));
        let lens = || self.factors.iter().map(|factor| factor.space().point_len());
        let mut numbers: SmallVec<[f64; 32]> = smallvec![0.0; lens().sum()];
        let mut rest = &mut numbers[..];
        for (i, factor) in self.factors.iter().enumerate() {
            let space = factor.space();
            let (out, others) = rest.split_at_mut(space.point_len());
            rest = others;
            let (points, velocities) = (&factor.points, &factor.velocities);
            let curves = curve::Curves { t, nodes: nodes.len(), points, velocities, before: &[] };
            curve::evaluate_point(&space, &curves, x, self.extrapolate.policy(), last.get(i), out);
        }
        if let [_] = &*self.factors {
            return Ok(P::read_rows(&[&numbers]));
        }
        let mut rest = &numbers[..];
        let rows = lens().map(|len| {
            let (row, others) = rest.split_at(len);
            rest = others;
            row
        });
        Ok(P::read_rows(&rows.collect::<Vec<_>>()))
    }

    /// No segment yet, for each factor.
    pub fn last_segments(&self) -> Vec<LastSegment> {
        self.factors.iter().map(|_| LastSegment::default()).collect()
    }

    /// Points at times of all curves.
    pub fn sample(&self, times: &[f64]) -> Result<Samples<P>, Error> {
        let rows = self.evaluate(times, Quantity::Point)?;
        Ok(Samples::read(&rows, self.count(), times.len()))
    }

    /// Times that are inside the knots of some curves, up to rounding.
    fn inside(&self, mut curves: Range<usize>, times: &[f64]) -> Result<Vec<f64>, Error> {
        if self.shared {
            curves.end = curves.start + 1;
        }
        let mut x = times.to_vec();
        for domain in curves.map(|c| self.domain(c)) {
            for x in &mut x {
                *x = inside(*x, domain)?;
            }
        }
        Ok(x)
    }

    /// Velocities or accelerations at times of all curves.
    pub fn tangents(&self, times: &[f64], quantity: Quantity) -> Result<Vec<P::Tangent>, Error> {
        let ambient = self.evaluate(times, quantity)?;
        let points = self.evaluate(times, Quantity::Point)?;
        Ok(self.read_tangents(&points, &ambient, self.count() * times.len()))
    }

    /// Tangent vectors from their ambient arrays in each factor.
    fn read_tangents(
        &self,
        points: &[impl AsRef<[f64]>],
        ambient: &[impl AsRef<[f64]>],
        count: usize,
    ) -> Vec<P::Tangent> {
        let mut vectors = Vec::with_capacity(ambient.len());
        for (i, factor) in self.space.factors().iter().enumerate() {
            let len = self.factors[i].space().point_len();
            let (points, ambient) = (points[i].as_ref(), ambient[i].as_ref());
            let mut rows = Vec::with_capacity(ambient.len());
            for (point, vector) in points.chunks_exact(len).zip(ambient.chunks_exact(len)) {
                factor.write_velocity(point, vector, &mut rows);
            }
            vectors.push(rows);
        }
        read(&vectors, count).collect()
    }
}

/// A time that is inside the knots, up to rounding.
fn inside(time: f64, (start, end): (f64, f64)) -> Result<f64, Error> {
    let reach = ROUNDING * f64::EPSILON * start.abs().max(end.abs());
    if !(time >= start - reach && time <= end + reach) {
        return Err(Error::OutsideDomain { time, start, end });
    }
    Ok(time.clamp(start, end))
}

/// Times that are finite.
fn finite(times: &[f64], (start, end): (f64, f64)) -> Result<&[f64], Error> {
    match times.iter().find(|x| !x.is_finite()) {
        Some(&time) => Err(Error::OutsideDomain { time, start, end }),
        None => Ok(times),
    }
}

/// The ambient arrays of the vectors at both ends of every curve, in each factor.
fn end_vectors<S: Space, P: Point<S>>(
    builder: &Builder<S, P>,
    tables: &[Table],
    points: &[Vec<f64>],
    offsets: &[usize],
) -> Result<[Vec<Vec<f64>>; 2], Error> {
    let mut out = [0, 1].map(|_| vec![Vec::new(); tables.len()]);
    let Ends::Open(ends) = &builder.ends else { return Ok(out) };
    for (e, (end, out)) in ends.iter().zip(&mut out).enumerate() {
        let (End::Velocity(vector) | End::Acceleration(vector)) = end else { continue };
        let node = |pair: &[usize]| if e == 0 { pair[0] } else { pair[1] - 1 };
        let mut rows = vec![Vec::new(); tables.len()];
        let (expected, found) = (rows.len(), vector.write_rows(&mut rows));
        if found != expected {
            return Err(Error::FactorCount { curve: 0, node: node(offsets), expected, found });
        }
        for (i, factor) in builder.space.factors().iter().enumerate() {
            let len = Erased(&*tables[i]).point_len();
            for (curve, pair) in offsets.windows(2).enumerate() {
                let (node, before) = (node(pair), out[i].len());
                factor.write_ambient(&points[i][node * len..(node + 1) * len], &rows[i], &mut out[i]);
                let found = out[i].len() - before;
                if found != len {
                    let error = Error::PointLength { curve, node: node - pair[0], expected: len, found };
                    return Err(error.in_factor(&builder.space.factors(), i));
                }
            }
        }
    }
    Ok(out)
}
