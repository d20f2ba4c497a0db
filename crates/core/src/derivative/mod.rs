//! Sensitivity of a spline to its data: derivatives with respect to points, knots and end vectors.
//!
//! The velocities are defined by the C² condition F(u, data) = 0, so that their derivative is −F_u⁻¹ F_data (implicit
//! differentiation). All quantities are expressed in frames that move with the points.

mod bezier;
mod operators;
mod polygon;
mod segment;
mod system;

use crate::curve::{Curves, Moving, Times, motion_len};
use crate::fit::{End, EndKind, Ends};
use crate::monitor::checkpoint;
use crate::space::{Ambient, Erased, Origin};
use bezier::Bezier;
pub use operators::{Matrix, Vector};
use polygon::Polygon;
use segment::LinearisedSegment;
use std::collections::BTreeMap;
pub use system::Linearised;
use system::{Change, System};

/// The number of Bézier segments that are stored.
const KEPT: usize = 256;

/// The data of a curve, small changes of them, or a gradient with respect to them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data {
    /// Points, or tangent vectors there.
    pub points: Vec<f64>,
    /// Knots.
    pub knots: Vec<f64>,
    /// The vectors that are prescribed at the ends; empty without one.
    pub ends: [Vec<f64>; 2],
}

/// The quantity to differentiate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// The point γ.
    Point,
    /// The velocity γ', covariantly.
    Velocity,
    /// The covariant acceleration ∇γ', covariantly.
    Acceleration,
}

/// The derivative of one spline curve with respect to its data.
pub struct Derivative<'a> {
    space: &'a Erased<'a>,
    t: &'a [f64],
    points: &'a [f64],
    velocities: &'a [f64],
    polygon: Polygon,
    system: System,
    beziers: BTreeMap<usize, Bezier>,
}

/// Derivatives of samples of one segment with respect to points and velocities of its two knots.
pub struct Motion<'a> {
    derivative: &'a Derivative<'a>,
    bezier: Bezier,
    segment: usize,
}

impl Motion<'_> {
    /// The derivatives of a sample, in the frames of the knots: columns for ξ, υ of the first and ξ, υ of the last
    /// knot. The last knot of a closed curve equals the first, in its frame.
    pub fn at(&self, tau: f64, of: Of) -> Matrix {
        let m = self.derivative.space.dim();
        let position = Position { segment: self.segment, tau };
        let (columns, _) = self.derivative.columns(&self.bezier, &position, of);
        let LinearisedSegment { h, functions, .. } = &self.derivative.system.segments[self.segment];
        let mut out = Matrix::zeros(columns.nrows(), 4 * m);
        for (e, f) in functions.iter().enumerate() {
            let third = if e == 0 { h / 3.0 } else { -h / 3.0 };
            let inner = columns.columns((1 + e) * m, m);
            out.columns_mut(2 * e * m, m).copy_from(&(columns.columns(3 * e * m, m) + inner * &f.cosh));
            out.columns_mut((2 * e + 1) * m, m).copy_from(&(inner * &f.stretch * third));
        }
        if let (Some(holonomy), true) =
            (&self.derivative.polygon.holonomy, self.segment + 1 == self.derivative.segments())
        {
            for from in [2 * m, 3 * m] {
                let turned = out.columns(from, m) * holonomy;
                out.columns_mut(from, m).copy_from(&turned);
            }
        }
        out
    }

    /// The array of the point at which the motions are tangent.
    pub fn point(&self, tau: f64) -> Vec<f64> {
        self.bezier.gamma(self.derivative.space, tau)
    }
}

/// The segment of a time, and the parameter there.
struct Position {
    segment: usize,
    tau: f64,
}

impl<'a> Derivative<'a> {
    /// The derivative of the spline with these knots, points and velocities. Vectors in `ends` are those of this
    /// curve.
    pub fn new(
        space: &'a Erased<'a>,
        t: &'a [f64],
        points: &'a [f64],
        velocities: &'a [f64],
        ends: &Ends,
    ) -> Self {
        let closed = matches!(ends, Ends::Periodic);
        let polygon = Polygon::new(space, points, velocities, closed);
        let h: Vec<f64> = t.windows(2).map(|t| t[1] - t[0]).collect();
        let kinds = match ends {
            Ends::Periodic => None,
            Ends::Open(ends) => Some(std::array::from_fn(|e| {
                let node = &polygon.nodes[e * h.len()];
                let at = |v: &[f64]| node.coordinates(space, v);
                match &ends[e] {
                    End::Natural => (EndKind::Acceleration, Vector::zeros(space.dim())),
                    End::NotAKnot => (EndKind::NotAKnot, Vector::zeros(space.dim())),
                    End::Velocity(v) => (EndKind::Velocity, at(v)),
                    End::Acceleration(v) => (EndKind::Acceleration, at(v)),
                    End::Both(both) => (EndKind::Velocity, at(&both.vectors[..space.point_len()])),
                }
            })),
        };
        let system = System::new(space, &polygon, &h, kinds);
        Derivative { space, t, points, velocities, polygon, system, beziers: BTreeMap::new() }
    }

    fn segments(&self) -> usize {
        self.t.len() - 1
    }

    fn position(&self, x: f64) -> Position {
        let segment = self.t[1..self.segments()].partition_point(|&t| t <= x);
        Position { segment, tau: (x - self.t[segment]) / (self.t[segment + 1] - self.t[segment]) }
    }

    fn bezier(&self, segment: usize) -> Bezier {
        Bezier::new(self.space, &self.polygon.nodes[segment..segment + 2], &self.system.segments[segment])
    }

    /// The derivatives of a sample: columns for the four control points and τ, and separately a factor for h.
    fn columns(&self, bezier: &Bezier, &Position { segment, tau }: &Position, of: Of) -> (Matrix, Vector) {
        let (space, inverse) = (self.space, 1.0 / self.system.segments[segment].h);
        // The last column, after those of the control points, is the derivative in τ.
        let along = |columns: Matrix, factor: f64| columns.column(columns.ncols() - 1) * factor;
        match of {
            Of::Point => (bezier.point(space, tau), Vector::zeros(space.point_len())),
            // γ' = γ_τ/h
            Of::Velocity => {
                let by_h = along(bezier.point(space, tau), -inverse * inverse);
                (bezier.velocity(space, tau) * inverse, by_h)
            }
            // ∇γ' = ∇γ_τ/h²
            Of::Acceleration => {
                let by_h = along(bezier.velocity(space, tau), -2.0 * inverse * inverse * inverse);
                (bezier.acceleration(space, tau) * (inverse * inverse), by_h)
            }
        }
    }

    /// The curve with its frames, for samples at times x.
    fn moving<'m>(&'m self, x: &'m [f64], frames: &'m [f64]) -> Moving<'m> {
        Moving {
            curve: Curves {
                t: self.t,
                nodes: self.t.len(),
                points: self.points,
                velocities: self.velocities,
                before: &[],
            },
            times: Times { x, count: x.len() },
            frames,
            run: usize::MAX,
            dim: self.space.dim(),
            len: self.space.point_len(),
        }
    }

    fn frames(&self) -> Vec<f64> {
        self.polygon.nodes.iter().flat_map(|node| node.frame.iter().map(|x| x.as_array()[0])).collect()
    }

    /// Forward mode: the motion of the curve at times x for given changes of the data; `out` receives one tangent
    /// vector per time.
    pub fn push(&mut self, x: &[f64], of: Of, change: &Data, out: &mut [f64]) {
        let change = self.in_frames(change);
        let mut u = self.system.velocities(&change);
        self.close(&mut u);
        let m = self.space.dim();
        let mut motions = Vec::with_capacity(self.segments() * motion_len(m));
        for (i, segment) in self.system.segments.iter().enumerate() {
            let (dh, dt) = (change.lengths[i], change.knots[i]);
            let inner = |e: usize| {
                // q⁺ = exp(h u/3), q⁻ = exp(−h u/3)
                let sign = if e == 0 { 1.0 } else { -1.0 } / 3.0;
                let handle = &u[i + e] * (segment.h * sign) + &self.polygon.u[i + e] * (dh * sign);
                let f = &segment.functions[e];
                &f.cosh * &change.points[i + e] + &f.stretch * handle
            };
            motions.extend_from_slice(change.points[i].as_slice());
            motions.extend_from_slice(inner(0).as_slice());
            motions.extend_from_slice(inner(1).as_slice());
            motions.extend_from_slice(change.points[i + 1].as_slice());
            motions.extend([dt, dh]);
        }
        if of == Of::Point {
            let frames = self.frames();
            return self.space.0.push(&self.moving(x, &frames), &motions, out);
        }
        for (&x, out) in x.iter().zip(out.chunks_mut(self.space.point_len())) {
            checkpoint();
            let position = self.position(x);
            let (columns, by_h) = self.kept(&position, of);
            let Position { segment: i, tau } = position;
            let row = &motions[i * motion_len(m)..][..motion_len(m)];
            let (dt, dh) = (row[4 * m], row[4 * m + 1]);
            let mut z = Vector::from_column_slice(&row[..4 * m + 1]);
            z[4 * m] = -(dt + tau * dh) / self.system.segments[i].h;
            let moved = columns * z + by_h * dh;
            out.copy_from_slice(moved.as_slice());
        }
    }

    /// Reverse mode: the gradient of `Σ cotangent · curve` with respect to the data, tangent vectors at points and
    /// ends.
    pub fn pull(&mut self, x: &[f64], of: Of, cotangent: &[f64]) -> Data {
        let (n, m, len) = (self.segments(), self.space.dim(), self.space.point_len());
        let size = motion_len(m);
        let mut products = vec![0.0; n * size];
        if of == Of::Point {
            let frames = self.frames();
            self.space.0.pull(&self.moving(x, &frames), cotangent, &mut products);
        } else {
            for (&x, cotangent) in x.iter().zip(cotangent.chunks(len)) {
                checkpoint();
                let position = self.position(x);
                let (columns, by_h) = self.kept(&position, of);
                let Position { segment: i, tau } = position;
                let cotangent = Vector::from_column_slice(cotangent);
                let z = columns.tr_mul(&cotangent);
                let row = &mut products[i * size..][..size];
                row.iter_mut().zip(&z.as_slice()[..4 * m]).for_each(|(sum, x)| *sum += x);
                let rate = z[4 * m] / self.system.segments[i].h;
                row[4 * m] -= rate;
                row[4 * m + 1] += by_h.dot(&cotangent) - tau * rate;
            }
        }
        let zero = || vec![Vector::zeros(m); n + 1];
        let mut gradient = Change {
            points: zero(),
            lengths: vec![0.0; n],
            ends: [Vector::zeros(m), Vector::zeros(m)],
            knots: vec![0.0; n + 1],
        };
        let mut u = zero();
        for (i, (segment, row)) in self.system.segments.iter().zip(products.chunks(size)).enumerate() {
            for e in 0..2 {
                let f = &segment.functions[e];
                let sign = if e == 0 { 1.0 } else { -1.0 } / 3.0;
                let inner = Vector::from_column_slice(&row[(1 + e) * m..][..m]);
                let knot = Vector::from_column_slice(&row[3 * e * m..][..m]);
                gradient.points[i + e] += knot + f.cosh.tr_mul(&inner);
                let handle = f.stretch.tr_mul(&inner) * sign;
                gradient.lengths[i] += handle.dot(&self.polygon.u[i + e]);
                u[i + e] += handle * segment.h;
            }
            gradient.knots[i] += row[4 * m];
            gradient.lengths[i] += row[4 * m + 1];
        }
        self.fold(&mut u);
        self.system.pull_back(u, &mut gradient);
        self.fold(&mut gradient.points);
        self.ambient(&gradient)
    }

    /// The same, with some Bézier segments stored for repeated use.
    fn kept(&mut self, position: &Position, of: Of) -> (Matrix, Vector) {
        let bezier = self.beziers.remove(&position.segment).unwrap_or_else(|| self.bezier(position.segment));
        let found = self.columns(&bezier, position, of);
        // Times usually increase, so that few segments are in use at any time.
        if self.beziers.len() == KEPT {
            self.beziers.clear();
        }
        self.beziers.insert(position.segment, bezier);
        found
    }

    /// The derivatives of samples of a segment with respect to its two knots.
    pub fn motion(&self, segment: usize) -> Motion<'_> {
        Motion { derivative: self, bezier: self.bezier(segment), segment }
    }

    /// The C² condition at a knot, linearised.
    pub fn condition(&self, node: usize) -> &Linearised {
        &self.system.rows[node]
    }

    /// The tangent vector at a knot with given coordinates in its frame.
    pub fn tangent(&self, node: usize, x: &[f64], v: &mut [f64]) {
        let v_at = self.polygon.nodes[node].basis(self.space) * Vector::from_column_slice(x);
        v.copy_from_slice(v_at.as_slice());
    }

    /// Converts changes to the frames of the linear system.
    fn in_frames(&self, change: &Data) -> Change {
        let (n, len) = (self.segments(), self.space.point_len());
        let at = |i: usize, v: &[f64]| self.polygon.nodes[i].coordinates(self.space, v);
        let mut points: Vec<Vector> = change.points.chunks(len).enumerate().map(|(i, v)| at(i, v)).collect();
        self.close(&mut points);
        let end = |e: usize| {
            let v = &change.ends[e];
            if v.is_empty() { Vector::zeros(self.space.dim()) } else { at(e * n, v) }
        };
        Change {
            points,
            lengths: change.knots.windows(2).map(|t| t[1] - t[0]).collect(),
            ends: [end(0), end(1)],
            knots: change.knots.clone(),
        }
    }

    /// The last node of a closed curve moves with the first.
    fn close(&self, x: &mut Vec<Vector>) {
        if let Some(holonomy) = &self.polygon.holonomy {
            x.resize(self.segments() + 1, Vector::zeros(self.space.dim()));
            let last = holonomy * &x[0];
            x[self.segments()] = last;
        }
    }

    /// The transpose of [`close`](Self::close).
    fn fold(&self, x: &mut [Vector]) {
        if let Some(holonomy) = &self.polygon.holonomy {
            let last = std::mem::replace(&mut x[self.segments()], Vector::zeros(self.space.dim()));
            x[0] += holonomy.tr_mul(&last);
        }
    }

    /// Converts a gradient to ambient arrays.
    fn ambient(&self, gradient: &Change) -> Data {
        let n = self.segments();
        let at = |i: usize, x: &Vector| self.polygon.nodes[i].gradient(self.space, x).as_slice().to_vec();
        let mut knots = gradient.knots.clone();
        for (i, g) in gradient.lengths.iter().enumerate() {
            knots[i] -= g;
            knots[i + 1] += g;
        }
        Data {
            points: gradient.points.iter().enumerate().flat_map(|(i, x)| at(i, x)).collect(),
            knots,
            ends: std::array::from_fn(|e| at(e * n, &gradient.ends[e])),
        }
    }
}
