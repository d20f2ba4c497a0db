//! A Bézier segment and how its points follow its control points.

use super::operators::{Few, Matrix, Vector, columns, unit};
use super::polygon::Node;
use super::segment::Segment;
use crate::scalar::{Dual, Jet, Lane, Scalar, lane};
use crate::space::Space;
use smallvec::smallvec;

/// Four control points, and a frame at each.
pub struct Bezier {
    points: [Few<Lane>; 4],
    /// The frames of the knots, carried to q⁺ and q⁻ in parallel: vectors as columns.
    bases: [Matrix; 4],
}

impl Bezier {
    pub fn new<M: Space>(space: &M, nodes: &[Node], segment: &Segment) -> Self {
        let len = space.point_len();
        let inner = |node: &Node, leg: &Vector, sign: f64| {
            let x: Few<Lane> = leg.iter().map(|&x| lane(sign * x)).collect();
            let zero: Few<Lane> = smallvec![Lane::ZERO; len];
            let (mut v, mut q, mut w) = (zero.clone(), zero.clone(), zero);
            space.tangent(&node.frame, &node.p, &x, &mut v);
            space.ray(&node.p, &v, Lane::ONE, &mut q);
            let basis = columns(len, space.dim(), |k, out| {
                node.tangent(space, k, &mut w);
                space.carry(&node.p, &q, &v, &w, out);
            });
            (q, basis)
        };
        let [p0, p1] = [&nodes[0], &nodes[1]];
        let (q0, b0) = inner(p0, &segment.legs[0], 1.0);
        let (q1, b1) = inner(p1, &segment.legs[1], -1.0);
        Bezier {
            points: [p0.p.clone(), q0, q1, p1.p.clone()],
            bases: [p0.basis(space), b0, b1, p1.basis(space)],
        }
    }

    /// De Casteljau's algorithm (8) with control points that may move.
    fn at<S: Scalar, M: Space>(space: &M, mut points: [Few<S>; 4], t: S) -> Few<S> {
        let mut next = points[0].clone();
        for level in (1..4).rev() {
            for i in 0..level {
                let (a, b) = points.split_at_mut(i + 1);
                space.geodesic(&a[i], &b[0], t, &mut next);
                a[i].copy_from_slice(&next);
            }
        }
        std::mem::take(&mut points[0])
    }

    /// The motions of the k-th control point in eight columns from `first` on.
    fn motion(&self, k: usize, row: usize, first: usize) -> Lane {
        let m = self.bases[k].ncols();
        Lane::new(std::array::from_fn(|l| {
            let column = (first + l).wrapping_sub(k * m);
            if column < m { self.bases[k][(row, column)] } else { 0.0 }
        }))
    }

    /// ∂γ for motions of the four control points along their frames, and in the last column for τ.
    pub fn point<M: Space>(&self, space: &M, tau: f64) -> Matrix {
        let (len, count) = (space.point_len(), self.count());
        columns(len, count, |first, out| {
            let points = std::array::from_fn(|k| {
                (0..len).map(|r| Dual { v: self.points[k][r], d: self.motion(k, r, first) }).collect()
            });
            let gamma = Self::at(space, points, Dual { v: lane(tau), d: unit(count - 1, first) });
            let (value, d): (Few<Lane>, Few<Lane>) = gamma.iter().map(|g| (g.v, g.d)).unzip();
            out.copy_from_slice(&d);
            space.velocity(&value, out);
        })
    }

    /// The same for the velocity ∂γ/∂τ: covariant derivatives.
    ///
    /// Along the line (τ + r, ε = sr) of a family of curves the covariant acceleration is
    /// `γ_ττ + 2s γ_τε + s² γ_εε`: a quarter of the difference of s = 1 and s = −1 is the mixed derivative.
    pub fn velocity<M: Space>(&self, space: &M, tau: f64) -> Matrix {
        let (len, count) = (space.point_len(), self.count());
        columns(len, count, |first, out| {
            let along = |s: f64| {
                let points = std::array::from_fn(|k| {
                    let v: Few<Lane> = (0..len).map(|r| self.motion(k, r, first)).collect();
                    let mut moving: Few<Jet> = smallvec![Jet::constant(Lane::ZERO); len];
                    space.ray(
                        &self.points[k],
                        &v,
                        Jet { v: Lane::ZERO, d: lane(s), dd: Lane::ZERO },
                        &mut moving,
                    );
                    moving
                });
                let rate = Lane::ONE + unit(count - 1, first) * lane(s);
                let gamma = Self::at(space, points, Jet { v: lane(tau), d: rate, dd: Lane::ZERO });
                let value: Few<Lane> = gamma.iter().map(|g| g.v).collect();
                let d: Few<Lane> = gamma.iter().map(|g| g.d).collect();
                let mut dd: Few<Lane> = gamma.iter().map(|g| g.dd).collect();
                space.acceleration(&value, &d, &mut dd);
                dd
            };
            let (forth, back) = (along(1.0), along(-1.0));
            for (out, (x, y)) in out.iter_mut().zip(forth.iter().zip(&back)) {
                *out = (*x - *y) * lane(0.25);
            }
        })
    }

    /// Columns of the derivatives.
    fn count(&self) -> usize {
        4 * self.bases[0].ncols() + 1
    }
}
