//! Jacobi's operator in the energy. If a curve moves by ξ, its acceleration changes by `ξ'' + Rξ` with `Rξ = −[u, [u,
//! ξ]]` at the velocity u. The linearised problem without R is inaccurate for curves that are nearly geodesic over
//! long distances: on a great circle it replaces `ξ'' + ξ` by `ξ''`, and assigns energy to a wave around it, which
//! has none.
//!
//! The jerk changes by the derivative of that and by `Qξ = R(ξ, u)a = [a, [ξ, u]]`, half of which belongs to either end
//! of a segment of length h. With the jerk as a difference of accelerations, it is as if R were `R ∓ hQ/2` there.
//!
//! These are changes with respect to frames that are parallel along the move. On a group, a body that is turned by ξ
//! keeps its acceleration in its own frame, but not in a parallel frame, which turns by half as much. The energy does
//! not depend on this, but its approximation of second order does: without the second derivative of the acceleration it
//! contains `|[a, ξ]|²/4`, as if the energy determined the attitude. [`JacobiOperator::in_moving_frame`] adds `[a, ξ]/2`
//! to the changes, so that they are those in the moving frame.

use crate::banded::stride;
use crate::frames::{curvature_terms, triples};
use crate::linearized::LinearProblem;
use crate::problem::Penalty;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{Lane, lane};
use symspline_core::space::{Erased, Origin};

/// The number of coefficients on which the accelerations at both ends of a segment depend.
const REACH: usize = 5;

/// Jacobi's operator along a curve, in coordinates of frames.
#[derive(Clone)]
pub struct JacobiOperator {
    m: usize,
    /// R at every knot as the first end of a segment, and as its last end: m × m numbers row by row.
    turns: [Vec<f64>; 2],
    /// (S + RP)ᵀM(S + RP), as the entries (i, i − d) at i · 4m + d; coordinates of a coefficient are adjacent. Empty before
    /// [`with_matrix`](JacobiOperator::with_matrix).
    pub penalty: Vec<f64>,
}

impl JacobiOperator {
    /// For velocities and accelerations at the knots, in units of the mean knot spacing.
    pub fn new(space: &Erased, linearized: &LinearProblem, speeds: &[f64], accelerations: &[f64]) -> Self {
        let (m, basis) = (space.dim(), &linearized.basis);
        let knots = basis.knots();
        let mut turns = [(); 2].map(|_| vec![0.0; knots * m * m]);
        for column in 0..m {
            let unit: Vec<f64> = (0..knots * m).map(|i| f64::from(i % m == column)).collect();
            let r = curvature_terms(space, speeds, &unit);
            let q = match linearized.penalised {
                Penalty::Acceleration => vec![0.0; r.len()],
                Penalty::Jerk => triples(space, [accelerations, &unit, speeds]),
            };
            for (at, (r, q)) in r.iter().zip(q).enumerate() {
                let (knot, entry) = (at / m, at * m + column);
                let half = |segment: usize| if segment < knots - 1 { 0.5 * basis.h(segment) } else { 0.0 };
                turns[0][entry] = r - half(knot) * q;
                turns[1][entry] = r + half(knot.wrapping_sub(1)) * q;
            }
        }
        // Natural ends have no acceleration that could change.
        for (end, knot) in [(0, 0), (1, knots - 1)] {
            if basis.is_natural(end) {
                turns.iter_mut().for_each(|turns| turns[knot * m * m..][..m * m].fill(0.0));
            }
        }
        JacobiOperator { m, turns, penalty: Vec::new() }
    }

    /// The operator for changes in the moving frame of a group. `halves` are the matrices of ξ ↦ [e, ξ]/2 for the m
    /// vectors e of the frame, which are the same at every knot.
    pub fn in_moving_frame(
        mut self,
        linearized: &LinearProblem,
        accelerations: &[f64],
        halves: &[f64],
    ) -> Self {
        let (m, knots) = (self.m, linearized.basis.knots());
        for (end, turns) in self.turns.iter_mut().enumerate() {
            for (knot, turns) in turns.chunks_exact_mut(m * m).enumerate() {
                let vector: Vec<f64> = match linearized.penalised {
                    Penalty::Acceleration => accelerations[knot * m..][..m].to_vec(),
                    // Half of the jerk times the length of the segment belongs to either end.
                    Penalty::Jerk => {
                        let other = if end == 0 { (knot + 1).min(knots - 1) } else { knot.saturating_sub(1) };
                        (0..m)
                            .map(|c| 0.5 * (accelerations[knot * m + c] - accelerations[other * m + c]))
                            .collect()
                    }
                };
                for (x, half) in vector.iter().zip(halves.chunks_exact(m * m)) {
                    turns.iter_mut().zip(half).for_each(|(sum, half)| *sum = x.mul_add(*half, *sum));
                }
            }
        }
        self
    }

    /// Computes the matrix of the energy.
    pub fn with_matrix(mut self, linearized: &LinearProblem) -> Self {
        let (m, basis, stride) = (self.m, &linearized.basis, stride(self.m));
        let count = basis.count();
        let mut out = vec![0.0; count * m * stride];
        // The rows of S + RP at both ends of a segment have at most five coefficients.
        let wide = REACH * m;
        let mut rows = [(); 2].map(|_| vec![0.0; m * wide]);
        for i in 0..basis.knots() - 1 {
            checkpoint();
            let first = linearized.values[i].first;
            for (end, rows) in rows.iter_mut().enumerate() {
                self.rows(linearized, (end, i + end), first, rows);
            }
            // With the sum x and the difference y of both, the energy is (a + b) |x|²/2 + (a − b) |y|²/2.
            let [left, right] = &mut rows;
            for (x, y) in left.iter_mut().zip(right) {
                (*x, *y) = (*x + *y, *x - *y);
            }
            let (own, other) = linearized.of_segment(i);
            for (rows, factor) in rows.iter().zip([0.5 * (own + other), 0.5 * (own - other)]) {
                if factor == 0.0 {
                    continue;
                }
                for row in rows.chunks_exact(wide) {
                    for (a, x) in row[..wide.min((count - first) * m)].iter().enumerate() {
                        let (x, from) = (factor * x, (a + 1).saturating_sub(stride));
                        let band = &mut out[(first * m + a) * stride..][..=a - from];
                        let others = band.iter_mut().rev().zip(&row[from..=a]);
                        others.for_each(|(sum, y)| *sum = x.mul_add(*y, *sum));
                    }
                }
            }
        }
        self.penalty = out;
        self
    }

    /// The rows of S + RP at an end of a segment, for the coefficients from `first` on.
    fn rows(&self, linearized: &LinearProblem, at: (usize, usize), first: usize, out: &mut [f64]) {
        let (m, turn) = (self.m, self.turn(at));
        let (values, accelerations) = (&linearized.values[at.1], &linearized.accelerations[at.1]);
        out.fill(0.0);
        for (row, (out, turn)) in out.chunks_exact_mut(REACH * m).zip(turn.chunks_exact(m)).enumerate() {
            for (k, (value, acceleration)) in values.factors.iter().zip(accelerations.factors).enumerate() {
                let out = &mut out[(values.first - first + k) * m..][..m];
                out.iter_mut().zip(turn).for_each(|(x, r)| *x += value * r);
                out[row] += acceleration;
            }
        }
    }

    /// Whether R depends on the end of a segment.
    pub fn differs(&self) -> bool {
        self.turns[0] != self.turns[1]
    }

    fn turn(&self, (end, knot): (usize, usize)) -> &[f64] {
        &self.turns[end][knot * self.m * self.m..][..self.m * self.m]
    }

    /// (S + RP)ᵀMa: half the gradient of the energy at accelerations a.
    pub fn pull(&self, linearized: &LinearProblem, accelerations: &[f64]) -> Vec<f64> {
        let m = self.m;
        let mut out = vec![0.0; linearized.basis.count() * m];
        for i in 0..linearized.basis.knots() - 1 {
            let (own, other) = linearized.of_segment(i);
            let [a, b] = [i, i + 1].map(|knot| &accelerations[knot * m..][..m]);
            for (end, [own, other]) in [[own, other], [other, own]].into_iter().enumerate() {
                let x: Vec<f64> = a.iter().zip(b).map(|(a, b)| own * a + other * b).collect();
                let turn = self.turn((end, i + end));
                let turned: Vec<f64> =
                    (0..m).map(|c| (0..m).map(|row| turn[row * m + c] * x[row]).sum()).collect();
                linearized.accelerations[i + end].spread(&x, &mut out);
                linearized.values[i + end].spread(&turned, &mut out);
            }
        }
        out
    }

    /// RPx: the contribution of curvature to coordinate c of the acceleration at a knot, which is the first or last end
    /// of a segment, if coefficients change by x.
    /// They have `all` coordinates, of which those of the operator begin at `first`.
    pub fn of_lanes(
        &self,
        linearized: &LinearProblem,
        (end, knot): (usize, usize),
        x: &[Lane],
        c: usize,
        (first, all): (usize, usize),
    ) -> Lane {
        let turns = &self.turns[end][(knot * self.m + c) * self.m..][..self.m];
        let row = &linearized.values[knot];
        let of = |(column, turn): (usize, &f64)| row.of_lanes(x, all, first + column) * lane(*turn);
        turns.iter().enumerate().fold(Lane::ZERO, |sum, each| sum + of(each))
    }
}
