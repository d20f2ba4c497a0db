//! A Bézier segment and the derivatives of its points with respect to its control points.

use super::operators::{Few, Matrix, columns, unit};
use crate::scalar::{Dual, Jet, Lane, Scalar, few, lane};
use crate::space::{Ambient, Erased, Frame, Origin};
use smallvec::smallvec;

/// A knot: its point, its frame, and the handle there that points into the segment, in the frame.
pub struct Knot {
    pub p: Few<Lane>,
    pub frame: Few<Lane>,
    pub handle: Few<Lane>,
}

impl Knot {
    /// Vectors of the frame on the lanes, from the k-th on.
    fn tangent(&self, space: &Erased, k: usize, out: &mut [Lane]) {
        let x: Few<Lane> = (0..space.dim()).map(|r| unit(r, k)).collect();
        space.tangent(&self.frame, &self.p, &x, out);
    }
}

/// Four control points, and a frame at each.
pub struct Bezier {
    points: [Few<Lane>; 4],
    /// The frames of the knots, transported to q⁺ and q⁻ in parallel, with vectors as columns.
    bases: [Matrix; 4],
    /// The unit of motions of the points: one, or the length of the handles in flat space, which avoids cancellation
    /// beside large numbers.
    reach: f64,
}

impl Bezier {
    pub fn new(space: &Erased, knots: [Knot; 2]) -> Self {
        let len = space.point_len();
        let inner = |knot: &Knot| {
            let zero: Few<Lane> = smallvec![Lane::ZERO; len];
            let (mut v, mut q, mut w) = (zero.clone(), zero.clone(), zero);
            space.tangent(&knot.frame, &knot.p, &knot.handle, &mut v);
            space.ray(&knot.p, &v, Lane::ONE, &mut q);
            let basis = columns(len, space.dim(), |k, out| {
                knot.tangent(space, k, &mut w);
                space.parallel_transport(&knot.p, &q, &v, &w, out);
            });
            (q, basis)
        };
        let [first, last] = &knots;
        let (q0, b0) = inner(first);
        let (q1, b1) = inner(last);
        let basis = |knot: &Knot| columns(len, space.dim(), |k, out| knot.tangent(space, k, out));
        let reach = if space.scales() {
            let square = |knot: &Knot| knot.handle.iter().map(|x| x.as_array()[0].powi(2)).sum::<f64>();
            knots.iter().map(square).fold(1.0, f64::max).sqrt()
        } else {
            1.0
        };
        Bezier {
            points: [first.p.clone(), q0, q1, last.p.clone()],
            bases: [basis(first), b0, b1, basis(last)],
            reach,
        }
    }

    /// De Casteljau's algorithm (8) with control points that may move.
    fn at<S: Scalar>(space: &Erased, mut points: [Few<S>; 4], t: S) -> Few<S> {
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

    /// γ(τ).
    pub fn gamma(&self, space: &Erased, tau: f64) -> Vec<f64> {
        Self::at(space, self.points.clone(), lane(tau)).iter().map(|x| x.as_array()[0]).collect()
    }

    /// Motions of the k-th control point in as many columns as there are lanes, from `first` on.
    fn motion(&self, k: usize, row: usize, first: usize) -> Lane {
        let m = self.bases[k].ncols();
        Lane::new(few(|l| {
            let column = (first + l).wrapping_sub(k * m);
            if column < m { self.bases[k][(row, column)] } else { 0.0 }
        }))
    }

    /// ∂γ for motions of the four control points along their frames.
    pub fn point(&self, space: &Erased, tau: f64) -> Matrix {
        let (len, count) = (space.point_len(), self.count());
        columns(len, count, |first, out| {
            let points = std::array::from_fn(|k| {
                (0..len).map(|r| Dual { v: self.points[k][r], d: self.motion(k, r, first) }).collect()
            });
            let gamma = Self::at(space, points, Dual::constant(lane(tau)));
            let (value, d): (Few<Lane>, Few<Lane>) = gamma.iter().map(|g| (g.v, g.d)).unzip();
            out.copy_from_slice(&d);
            space.velocity(&value, out);
        })
    }

    /// The same for the covariant acceleration of ∂γ/∂τ: by central differences of order eight, which are accurate to
    /// twelve significant digits for analytic functions at this step.
    pub fn acceleration(&self, space: &Erased, tau: f64) -> Matrix {
        const STEP: f64 = 0.015;
        const WEIGHTS: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
        let (len, count) = (space.point_len(), self.count());
        let zero: Few<Lane> = smallvec![Lane::ZERO; len];
        let (mut way, mut back) = (zero.clone(), zero);
        columns(len, count, |first, out| {
            let here = Self::at(space, self.moved(space, first, Lane::ZERO), lane(tau));
            out.fill(Lane::ZERO);
            for (k, sign) in (0..8).map(|k| (k / 2, if k % 2 == 0 { 1.0 } else { -1.0 })) {
                let r = lane(sign * STEP * (k + 1) as f64);
                let points =
                    self.moved(space, first, r).map(|p| p.iter().map(|&x| Jet::constant(x)).collect());
                let gamma = Self::at(space, points, Jet { v: lane(tau), d: Lane::ONE, dd: Lane::ZERO });
                let [value, d, mut dd] = parts(&gamma);
                space.acceleration(&value, &d, &mut dd);
                space.log(&value, &here, &mut way);
                space.parallel_transport(&value, &here, &way, &dd, &mut back);
                let weight = lane(sign * WEIGHTS[k] / (STEP * self.reach));
                out.iter_mut().zip(&back).for_each(|(out, x)| *out += *x * weight);
            }
        })
    }

    /// The control points moved by r along their frames.
    fn moved(&self, space: &Erased, first: usize, r: Lane) -> [Few<Lane>; 4] {
        std::array::from_fn(|k| {
            let v: Few<Lane> =
                (0..space.point_len()).map(|row| self.motion(k, row, first) * lane(self.reach)).collect();
            let mut out: Few<Lane> = smallvec![Lane::ZERO; v.len()];
            space.ray(&self.points[k], &v, r, &mut out);
            out
        })
    }

    /// Columns of the derivatives.
    fn count(&self) -> usize {
        4 * self.bases[0].ncols()
    }
}

/// Values, first and second derivatives.
fn parts(x: &[Jet]) -> [Few<Lane>; 3] {
    std::array::from_fn(|k| x.iter().map(|x| x.parts()[k]).collect())
}
