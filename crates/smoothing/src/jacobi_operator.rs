//! Jacobi's operator in the energy. If a curve moves by ξ, its acceleration changes by `ξ'' + Rξ` with `Rξ = −[u, [u,
//! ξ]]` at the velocity u. The linearised problem without R is inaccurate for curves that are nearly geodesic over
//! long distances: on a great circle it replaces `ξ'' + ξ` by `ξ''`, and assigns energy to a wave around it, which
//! has none.

use crate::banded::stride;
use crate::frames::curvature_terms;
use crate::linearized::{LinearProblem, of_segment, times_metric};
use symspline_core::scalar::{Lane, lane};
use symspline_core::space::{Erased, Origin};

/// Jacobi's operator along a curve, in coordinates of frames.
pub struct JacobiOperator {
    m: usize,
    /// R at every knot, m × m numbers row by row.
    turns: Vec<f64>,
    /// (S + RP)ᵀM(S + RP), as the entries (i, i − d) at i · 4m + d; coordinates of a coefficient are adjacent.
    pub penalty: Vec<f64>,
}

impl JacobiOperator {
    /// For velocities at the knots, in units of the mean knot spacing.
    pub fn new(space: &Erased, linearized: &LinearProblem, speeds: &[f64]) -> Self {
        let m = space.dim();
        let knots = linearized.basis.knots();
        let mut turns = vec![0.0; knots * m * m];
        for column in 0..m {
            let unit: Vec<f64> = (0..knots * m).map(|i| f64::from(i % m == column)).collect();
            let found = curvature_terms(space, speeds, &unit);
            for (knot, x) in found.chunks_exact(m).enumerate() {
                (0..m).for_each(|row| turns[(knot * m + row) * m + column] = x[row]);
            }
        }
        // Natural ends have no acceleration that could change.
        for (end, knot) in [(0, 0), (1, knots - 1)] {
            if linearized.basis.is_natural(end) {
                turns[knot * m * m..][..m * m].fill(0.0);
            }
        }
        let mut jacobi =
            JacobiOperator { m, turns, penalty: vec![0.0; linearized.basis.count() * m * stride(m)] };
        for i in 0..knots - 1 {
            let (own, other) = of_segment(linearized.penalised, linearized.basis.h(i));
            for (left, right, factor) in
                [(i, i, own), (i + 1, i + 1, own), (i, i + 1, other), (i + 1, i, other)]
            {
                jacobi.add(linearized, left, right, factor);
            }
        }
        jacobi
    }

    fn turn(&self, knot: usize) -> &[f64] {
        &self.turns[knot * self.m * self.m..][..self.m * self.m]
    }

    /// Adds `factor · (row of one knot)ᵀ(row of another)`: with s and v of the rows of S and P the blocks
    /// `s s' + s v' R' + v s' Rᵀ + v v' RᵀR'`.
    fn add(&mut self, linearized: &LinearProblem, left: usize, right: usize, factor: f64) {
        let (m, stride) = (self.m, stride(self.m));
        let (r, other) = (self.turn(left), self.turn(right));
        let mut square = vec![0.0; m * m];
        for row in 0..m {
            for a in 0..m {
                for b in 0..m {
                    square[a * m + b] += r[row * m + a] * other[row * m + b];
                }
            }
        }
        let (transposed, other): (Vec<f64>, Vec<f64>) =
            ((0..m * m).map(|at| r[at % m * m + at / m]).collect(), other.to_vec());
        let rows = |knot: usize| [(&linearized.accelerations[knot], false), (&linearized.values[knot], true)];
        for (x, turns) in rows(left) {
            for (y, turns_too) in rows(right) {
                for (p, f) in x.factors.iter().enumerate() {
                    for (q, g) in y.factors.iter().enumerate() {
                        let product = factor * f * g;
                        if product == 0.0 {
                            continue;
                        }
                        for a in 0..m {
                            for b in 0..m {
                                let (i, j) = ((x.first + p) * m + a, (y.first + q) * m + b);
                                if i < j {
                                    continue;
                                }
                                let block = match (turns, turns_too) {
                                    (false, false) => f64::from(a == b),
                                    (false, true) => other[a * m + b],
                                    (true, false) => transposed[a * m + b],
                                    (true, true) => square[a * m + b],
                                };
                                self.penalty[i * stride + i - j] += product * block;
                            }
                        }
                    }
                }
            }
        }
    }

    /// (S + RP)ᵀMa: half the gradient of the energy at accelerations a. For the jerk, [`jerk_term`] is missing.
    ///
    /// [`jerk_term`]: crate::frames::jerk_term
    pub fn pull(&self, linearized: &LinearProblem, accelerations: &[f64]) -> Vec<f64> {
        let m = self.m;
        let mass = times_metric(&linearized.basis, linearized.penalised, accelerations, m);
        let mut out = vec![0.0; linearized.basis.count() * m];
        for (knot, x) in mass.chunks_exact(m).enumerate() {
            let turn = self.turn(knot);
            let turned: Vec<f64> =
                (0..m).map(|c| (0..m).map(|row| turn[row * m + c] * x[row]).sum()).collect();
            linearized.accelerations[knot].spread(x, &mut out);
            linearized.values[knot].spread(&turned, &mut out);
        }
        out
    }

    /// RPx: the contribution of curvature to coordinate c of the acceleration at a knot if coefficients change by x.
    /// They have `all` coordinates, of which those of the operator begin at `first`.
    pub fn of_lanes(
        &self,
        linearized: &LinearProblem,
        knot: usize,
        x: &[Lane],
        c: usize,
        (first, all): (usize, usize),
    ) -> Lane {
        let turns = &self.turns[(knot * self.m + c) * self.m..][..self.m];
        let row = &linearized.values[knot];
        let of = |(column, turn): (usize, &f64)| row.of_lanes(x, all, first + column) * lane(*turn);
        turns.iter().enumerate().fold(Lane::ZERO, |sum, each| sum + of(each))
    }
}
