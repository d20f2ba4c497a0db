//! Sensitivity of splines to their data: derivatives with respect to points, knots and end vectors.
//!
//! The velocities are defined by the C² condition F(u, data) = 0, so that their derivative is −F_u⁻¹ F_data (implicit
//! differentiation). All quantities are expressed in frames that move with the points.

mod bezier;
mod operators;
mod polygon;
mod rates;
mod segment;
mod solve;
mod system;

use crate::curve::{Curves, Moving, Outside, Quantity, Times, evaluate, motion_len};
use crate::fit::{End, EndKind, Ends};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, few, gather, lane};
use crate::space::{Ambient, Erased, Frame, Origin};
use bezier::{Bezier, Knot};
use operators::Few;
pub use operators::{Matrix, Vector};
use polygon::{Polygon, Runs};
use rates::Rates;
pub use system::Linearised;
use system::{Change, System};

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

/// The largest number of curves whose derivatives are computed together, one per lane.
pub const MOST_CURVES: usize = LANES;

/// The derivatives of spline curves with respect to their data. All arrays contain the numbers curve after curve.
pub struct Derivative<'a> {
    space: &'a Erased<'a>,
    t: &'a [f64],
    points: &'a [f64],
    velocities: &'a [f64],
    polygon: Polygon,
    system: System,
}

/// Derivatives of samples of one segment with respect to points and velocities of its two knots.
pub struct Motion<'a> {
    derivative: &'a Derivative<'a>,
    bezier: Bezier,
    segment: usize,
}

impl Motion<'_> {
    /// The derivatives of a point, in the frames of the knots: columns for ξ, υ of the first and ξ, υ of the last knot.
    /// The last knot of a closed curve equals the first, in its frame.
    pub fn point(&self, tau: f64) -> Matrix {
        self.derivative.at_knots(self.segment, &self.bezier.point(self.derivative.space, tau))
    }

    /// The same for ∇γ'.
    pub fn acceleration(&self, tau: f64) -> Matrix {
        let h = self.derivative.system.h[self.segment];
        let columns = self.bezier.acceleration(self.derivative.space, tau) / (h * h);
        self.derivative.at_knots(self.segment, &columns)
    }

    /// The array of the point at which the motions are tangent.
    pub fn gamma(&self, tau: f64) -> Vec<f64> {
        self.bezier.gamma(self.derivative.space, tau)
    }
}

impl<'a> Derivative<'a> {
    /// The derivative of the splines with these knots, points and velocities, which have equally many knots: one curve, or at
    /// most [`MOST_CURVES`].
    pub fn new(
        space: &'a Erased<'a>,
        t: &'a [f64],
        points: &'a [f64],
        velocities: &'a [f64],
        ends: &Ends,
        curves: usize,
    ) -> Self {
        let (m, knots) = (space.dim(), t.len() / curves);
        let runs = Runs::new(knots - 1, curves, matches!(ends, Ends::Periodic));
        let polygon = Polygon::new(space, points, velocities, runs);
        let h: Vec<f64> = t.chunks(knots).flat_map(|t| t.windows(2).map(|t| t[1] - t[0])).collect();
        let kinds = match ends {
            Ends::Periodic => None,
            Ends::Open(ends) => Some(std::array::from_fn(|e| {
                let at = |v: &[f64]| {
                    let x = coordinates_at_ends(space, &polygon, points, e, v);
                    let row = runs.curve_of_lanes().map(|curve| curve * m);
                    (0..m).map(|c| Lane::new(row.map(|row| x[row + c]))).collect()
                };
                match &ends[e] {
                    End::Natural => (EndKind::Acceleration, vec![Lane::ZERO; m]),
                    End::NotAKnot => (EndKind::NotAKnot, vec![Lane::ZERO; m]),
                    End::Velocity(v) => (EndKind::Velocity, at(v)),
                    End::Acceleration(v) => (EndKind::Acceleration, at(v)),
                    End::Both(both) => (EndKind::Velocity, at(&both.vectors[..curves * space.point_len()])),
                }
            })),
        };
        let system = System::new(space, &polygon, &h, kinds);
        Derivative { space, t, points, velocities, polygon, system }
    }

    fn curves(&self) -> usize {
        self.polygon.runs.curves()
    }

    /// The segments of a curve.
    fn segments(&self) -> usize {
        self.polygon.runs.segments_each()
    }

    fn bezier(&self, segment: usize) -> Bezier {
        Bezier::new(self.space, [0, 1].map(|e| self.knot(segment, e)))
    }

    /// A knot as an end of a segment.
    fn knot(&self, segment: usize, e: usize) -> Knot {
        let (m, len, size) = (self.space.dim(), self.space.point_len(), self.space.frame_len());
        let lanes = |x: &[f64]| -> Few<Lane> { x.iter().map(|&x| lane(x)).collect() };
        let slot = self.polygon.runs.slot(segment, e);
        let third = lane(self.system.h[segment] * if e == 0 { 1.0 } else { -1.0 } / 3.0);
        let u = &self.polygon.u[slot * m..][..m];
        Knot {
            p: lanes(&self.points[(segment + e) * len..][..len]),
            frame: lanes(&self.polygon.frames[slot * size..][..size]),
            handle: u.iter().map(|u| lane(*u) * third).collect(),
        }
    }

    /// cosh(ad) or S of the handle at an end of a segment.
    fn function(&self, segment: usize, e: usize, which: usize) -> Matrix {
        let m = self.space.dim();
        Matrix::from_row_slice(m, m, self.function_row(segment, e, which))
    }

    fn function_row(&self, segment: usize, e: usize, which: usize) -> &[f64] {
        let square = self.space.dim().pow(2);
        &self.system.functions[(4 * segment + 2 * e + which) * square..][..square]
    }

    /// From columns for the four control points to columns for the knots.
    fn at_knots(&self, segment: usize, columns: &Matrix) -> Matrix {
        let m = self.space.dim();
        let h = self.system.h[segment];
        let mut out = Matrix::zeros(columns.nrows(), 4 * m);
        for e in 0..2 {
            let third = if e == 0 { h / 3.0 } else { -h / 3.0 };
            let [cosh, stretch] = [0, 1].map(|k| self.function(segment, e, k));
            let inner = columns.columns((1 + e) * m, m);
            out.columns_mut(2 * e * m, m).copy_from(&(columns.columns(3 * e * m, m) + inner * cosh));
            out.columns_mut((2 * e + 1) * m, m).copy_from(&(inner * stretch * third));
        }
        let Polygon { runs, turns, .. } = &self.polygon;
        let run = runs.slot(segment, 0) - segment;
        if runs.first(run + 1) == segment + 1 && runs.joint(run).is_some() {
            let turn = turns[0].of_lane(run);
            for from in [2 * m, 3 * m] {
                let turned = out.columns(from, m) * &turn;
                out.columns_mut(from, m).copy_from(&turned);
            }
        }
        out
    }

    /// The derivatives of samples of one curve, in the frames to which their points are lifted, as the matrices of [`Motion::point`] or
    /// [`Motion::acceleration`], and the arrays of the points; None if reverse mode does not have them. A sample must lie
    /// within its segment.
    pub fn rows(&self, samples: &[(usize, f64)], of: Of) -> Option<(Vec<Matrix>, Vec<f64>)> {
        let (m, len, size) = (self.space.dim(), self.space.point_len(), motion_len(self.space.dim()));
        let inner = &self.t[1..self.segments()];
        let x: Vec<f64> = samples.iter().map(|&(i, tau)| self.t[i] + tau * self.system.h[i]).collect();
        if samples.iter().zip(&x).any(|((i, _), x)| inner.partition_point(|t| t <= x) != *i) {
            return None;
        }
        let mut points = vec![0.0; x.len() * len];
        let go_on = |_| true;
        let (times, monitor) = (Times { x: &x, count: x.len() }, Monitor::new(&go_on));
        let curve = self.moving(&x, of).curve;
        let outside = Outside::Continue;
        evaluate(self.space, &curve, &times, Quantity::Point, outside, &monitor, &mut points);
        // The gradients of coordinates with respect to arrays.
        let mut gradients = vec![0.0; x.len() * m * len];
        let zeros = |len: usize| vec![Lane::ZERO; len];
        let (mut p, mut frame) = (zeros(len), zeros(self.space.frame_len()));
        let (mut unit, mut coordinates) = (zeros(len), zeros(m));
        for first in (0..x.len()).step_by(LANES) {
            let at: [usize; LANES] = few(|l| (first + l).min(x.len() - 1));
            gather(at.map(|i| &points[i * len..][..len]), &mut p);
            self.space.lift(&p, &mut frame);
            for c in 0..len {
                unit[c] = Lane::ONE;
                self.space.coordinates(&frame, &p, &unit, &mut coordinates);
                unit[c] = Lane::ZERO;
                for (k, x) in coordinates.iter().enumerate() {
                    at.iter().zip(x.as_array()).for_each(|(i, x)| gradients[(i * m + k) * len + c] = *x);
                }
            }
        }
        let repeated: Vec<f64> = x.iter().flat_map(|&x| std::iter::repeat_n(x, m)).collect();
        let mut products = vec![0.0; repeated.len() * size];
        let moving = Moving { apart: true, ..self.moving(&repeated, of) };
        if !self.space.0.pull(&moving, &gradients, &mut products) {
            return None;
        }
        let matrix = |(i, rows): (usize, &[f64])| {
            self.at_knots(samples[i].0, &Matrix::from_fn(m, 4 * m, |r, c| rows[r * size + c]))
        };
        Some((products.chunks(m * size).enumerate().map(matrix).collect(), points))
    }

    /// The curves with their frames, for samples at times x.
    fn moving<'m>(&'m self, x: &'m [f64], of: Of) -> Moving<'m> {
        let Polygon { runs, frames, .. } = &self.polygon;
        Moving {
            curve: Curves {
                t: self.t,
                nodes: self.segments() + 1,
                points: self.points,
                velocities: self.velocities,
                before: &[],
            },
            times: Times { x, count: x.len() / self.curves() },
            frames,
            runs: runs.count / self.curves(),
            nu: of as usize,
            apart: false,
            dim: self.space.dim(),
            len: self.space.point_len(),
        }
    }

    /// Forward mode: the motion of the curve at times x for given changes of the data; `out` receives one tangent
    /// vector per quantity and time.
    pub fn push(&self, x: &[f64], quantities: &[Of], change: &Data, out: &mut [f64]) {
        let change = self.in_frames(change);
        let m = self.space.dim();
        let u = self.polygon.unfold(&self.system.velocities(&change), m);
        let points = self.polygon.unfold(&change.points, m);
        let (runs, size) = (self.polygon.runs, motion_len(m));
        let mut motions = Vec::with_capacity(self.t.len() * size);
        let mut handle = vec![0.0; m];
        for (i, &h) in self.system.h.iter().enumerate() {
            let knot = runs.knot(i, 0);
            // No segment begins at the last knot of a curve.
            motions.resize(knot * size, 0.0);
            let (dh, dt) = (change.lengths[i], change.knots[knot]);
            let at = |e: usize| self.polygon.runs.slot(i, e) * m;
            motions.extend_from_slice(&points[at(0)..][..m]);
            for e in 0..2 {
                // q⁺ = exp(h u/3), q⁻ = exp(−h u/3)
                let sign = if e == 0 { 1.0 } else { -1.0 } / 3.0;
                for (r, x) in handle.iter_mut().enumerate() {
                    *x = (u[at(e) + r] * h + self.polygon.u[at(e) + r] * dh) * sign;
                }
                let xi = &points[at(e)..][..m];
                let [cosh, stretch] = [0, 1].map(|which| self.function_row(i, e, which).chunks(m));
                let product = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
                motions.extend(cosh.zip(stretch).map(|(c, s)| product(c, xi) + product(s, &handle)));
            }
            motions.extend_from_slice(&points[at(1)..][..m]);
            motions.extend([dt, dh]);
        }
        motions.resize(self.t.len() * size, 0.0);
        let size = (out.len() / quantities.len()).max(1);
        for (&of, out) in quantities.iter().zip(out.chunks_mut(size)) {
            let moving = self.moving(x, of);
            if !self.space.0.push(&moving, &motions, out) {
                let parts =
                    motions.chunks(motions.len() / self.curves()).zip(out.chunks_mut(size / self.curves()));
                for (curve, (motions, out)) in parts.enumerate() {
                    Rates { space: self.space, moving: &moving.one(curve) }.push(motions, out);
                }
            }
        }
    }

    /// Reverse mode: the gradient of `Σ cotangent · curve` with respect to the data, tangent vectors at points and
    /// ends. There is one cotangent vector per quantity and time.
    pub fn pull(&self, x: &[f64], quantities: &[Of], cotangents: &[f64]) -> Data {
        let (runs, m) = (self.polygon.runs, self.space.dim());
        let size = motion_len(m);
        let mut products = vec![0.0; self.t.len() * size];
        for (&of, cotangents) in
            quantities.iter().zip(cotangents.chunks((x.len() * self.space.point_len()).max(1)))
        {
            let moving = self.moving(x, of);
            if !self.space.0.pull(&moving, cotangents, &mut products) {
                let size = products.len() / self.curves();
                let parts = cotangents.chunks((cotangents.len() / self.curves()).max(1));
                for (curve, (cotangents, products)) in parts.zip(products.chunks_mut(size)).enumerate() {
                    Rates { space: self.space, moving: &moving.one(curve) }.pull(cotangents, products);
                }
            }
        }
        let slots = self.polygon.runs.slots() * m;
        let (mut points, mut u) = (vec![0.0; slots], vec![0.0; slots]);
        let mut gradient = Change {
            points: Vec::new(),
            lengths: vec![0.0; runs.segments],
            ends: [0, 1].map(|_| vec![0.0; self.curves() * m]),
            knots: vec![0.0; self.t.len()],
        };
        for (i, &h) in self.system.h.iter().enumerate() {
            let row = &products[runs.knot(i, 0) * size..][..size];
            for e in 0..2 {
                let at = self.polygon.runs.slot(i, e) * m;
                let sign = if e == 0 { 1.0 } else { -1.0 } / 3.0;
                let inner = &row[(1 + e) * m..][..m];
                let [cosh, stretch] = [0, 1].map(|which| self.function_row(i, e, which).chunks(m));
                points[at..][..m].iter_mut().zip(&row[3 * e * m..]).for_each(|(sum, x)| *sum += x);
                for ((x, cosh), stretch) in inner.iter().zip(cosh).zip(stretch) {
                    for r in 0..m {
                        points[at + r] += cosh[r] * x;
                        let handle = stretch[r] * x * sign;
                        gradient.lengths[i] += handle * self.polygon.u[at + r];
                        u[at + r] += handle * h;
                    }
                }
            }
            gradient.knots[runs.knot(i, 0)] += row[4 * m];
            gradient.lengths[i] += row[4 * m + 1];
        }
        gradient.points = self.polygon.fold(&points, m);
        self.system.pull_back(&self.polygon.fold(&u, m), &mut gradient);
        self.ambient(&gradient)
    }

    /// The derivatives of samples of a segment with respect to its two knots.
    pub fn motion(&self, segment: usize) -> Motion<'_> {
        Motion { derivative: self, bezier: self.bezier(segment), segment }
    }

    /// The C² condition at a knot, linearised.
    pub fn condition(&self, node: usize) -> Linearised {
        self.system.condition(node)
    }

    /// The tangent vectors at all nodes of one curve with given coordinates in their frames, node after node.
    pub fn tangents(&self, x: &[f64]) -> Vec<f64> {
        self.polygon.tangents(self.space, self.points, x)
    }

    /// Converts changes to the frames of the linear system.
    fn in_frames(&self, change: &Data) -> Change {
        let (Derivative { space, points, polygon, .. }, len) = (self, self.space.point_len());
        let mut of_nodes = Vec::new();
        let mut vectors = &change.points;
        if self.curves() > 1 && polygon.runs.closed {
            let nodes = polygon.runs.nodes_each() * len;
            change.points.chunks(nodes + len).for_each(|x| of_nodes.extend_from_slice(&x[..nodes]));
            vectors = &of_nodes;
        }
        let knots = change.knots.chunks(self.segments() + 1);
        let ends = [0, 1].map(|e| {
            let v = &change.ends[e];
            let given = !v.is_empty() && !polygon.runs.closed;
            if given { coordinates_at_ends(space, polygon, points, e, v) } else { Vec::new() }
        });
        Change {
            points: polygon.coordinates(space, points, vectors),
            lengths: knots.flat_map(|t| t.windows(2).map(|t| t[1] - t[0])).collect(),
            ends,
            knots: change.knots.clone(),
        }
    }

    /// Converts a gradient to ambient arrays.
    fn ambient(&self, gradient: &Change) -> Data {
        let (Derivative { space, points, polygon, .. }, len) = (self, self.space.point_len());
        let (runs, m) = (polygon.runs, space.dim());
        let mut knots = gradient.knots.clone();
        for (i, g) in gradient.lengths.iter().enumerate() {
            knots[runs.knot(i, 0)] -= g;
            knots[runs.knot(i, 1)] += g;
        }
        let of_nodes = polygon.gradients(space, points, &gradient.points);
        let nodes = runs.nodes_each() * len;
        let mut by_points = Vec::with_capacity(points.len());
        for of_curve in of_nodes.chunks(nodes) {
            by_points.extend_from_slice(of_curve);
            // That of a closed curve's last knot is the first.
            by_points.resize(by_points.len() + (self.segments() + 1) * len - nodes, 0.0);
        }
        let ends = [0, 1].map(|e| {
            let curves = if runs.closed { 0 } else { self.curves() };
            let nodes = (0..curves).map(|curve| curve * runs.nodes_each() + e * self.segments());
            let rows = nodes.zip(gradient.ends[e].chunks(m));
            rows.flat_map(|(node, x)| polygon.gradient_at(space, points, node, x)).collect()
        });
        Data { points: by_points, knots, ends }
    }
}

/// The coordinates of a vector at one end of every open curve.
fn coordinates_at_ends(
    space: &Erased,
    polygon: &Polygon,
    points: &[f64],
    e: usize,
    vectors: &[f64],
) -> Vec<f64> {
    let runs = polygon.runs;
    let of_curve = |(curve, v): (usize, &[f64])| {
        let node = curve * runs.nodes_each() + e * runs.segments_each();
        polygon.coordinates_at(space, points, node, v)
    };
    vectors.chunks(space.point_len()).enumerate().flat_map(of_curve).collect()
}
