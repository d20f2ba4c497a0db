//! The Newton matrix T of flat space, on transported velocities.
//!
//! In the frames transport is the identity and T is a scalar tridiagonal matrix with rows
//! `1/hᵢ₋₁, 2/hᵢ₋₁ + 2/hᵢ, 1/hᵢ`: the matrix of the classical cubic spline.

use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::ends;
use crate::scalar::{Lane, lane};
use crate::space::Erased;
use crate::with_size;

/// T, factored by elimination without pivoting. T is diagonally dominant except for not-a-knot rows, which are safe,
/// too: their first pivot is 1/h₀ + 1/h₁.
#[derive(Default)]
pub struct Tridiagonal {
    /// Diagonal, also the divisor of Algorithm 1.
    pub diagonal: Vec<Lane>,
    lower: Vec<Lane>,
    /// In rows that are factored, except for the last: divided by the pivot.
    upper: Vec<Lane>,
    inverse_pivot: Vec<Lane>,
    /// For closed curves: the solutions α, β for a unit velocity at the first and the last node.
    answers: [Vec<Lane>; 2],
    rhs: Vec<Lane>,
    x: Vec<Lane>,
}

const TWO: Lane = lane(2.0);

impl Tridiagonal {
    /// Builds and factors T.
    pub fn build(&mut self, chain: &Chain, ends: &ChainEnds) {
        let n = chain.n;
        for v in [&mut self.diagonal, &mut self.lower, &mut self.upper, &mut self.inverse_pivot] {
            v.resize(n + 1, Lane::ZERO);
        }
        let inverse = |i: usize| Lane::ONE / chain.h[i];
        for i in 0..=n {
            // A closed curve has a segment on both sides of every node.
            let left = inverse(if i == 0 { n - 1 } else { i - 1 });
            let right = inverse(if i == n { 0 } else { i });
            (self.lower[i], self.diagonal[i], self.upper[i]) = (left, TWO * (left + right), right);
        }
        if let ChainEnds::Open(kinds) = ends {
            (self.diagonal[0], self.upper[0]) = ends::row(chain, 0, &kinds[0]);
            (self.diagonal[n], self.lower[n]) = ends::row(chain, 1, &kinds[1]);
            self.factor(0, n);
        } else if n > 1 {
            self.factor(1, n - 1);
            for (end, node) in [(0, 1), (1, n - 1)] {
                let coupling = if end == 0 { self.lower[1] } else { self.upper[n - 1] };
                let mut answer = std::mem::take(&mut self.answers[end]);
                answer.clear();
                answer.resize(n + 1, Lane::ZERO);
                answer[node] = -coupling;
                self.solve_open(1, n - 1, 1, None, &mut answer);
                self.answers[end] = answer;
            }
        }
    }

    fn factor(&mut self, first: usize, last: usize) {
        self.inverse_pivot[first] = Lane::ONE / self.diagonal[first];
        for i in first + 1..=last {
            self.upper[i - 1] *= self.inverse_pivot[i - 1];
            self.inverse_pivot[i] = Lane::ONE / (self.diagonal[i] - self.lower[i] * self.upper[i - 1]);
        }
    }

    /// Solves on the rows `first..=last` for vectors of m numbers. The right-hand side is in `x`, or it is a factor
    /// times another vector.
    fn solve_open(
        &self,
        first: usize,
        last: usize,
        m: usize,
        right: Option<(Lane, &[Lane])>,
        x: &mut [Lane],
    ) {
        with_size!(true, m, m => match right {
            None => self.solve_rows(first, last, m, |_, x| x, x),
            Some((factor, right)) => self.solve_rows(first, last, m, |i, _| factor * right[i], x),
        });
    }

    /// The same with a function of an index and the number in `x`. To write the right-hand side to memory first takes as
    /// long as the elimination.
    #[inline(always)]
    fn solve_rows(
        &self,
        first: usize,
        last: usize,
        m: usize,
        right: impl Fn(usize, Lane) -> Lane,
        x: &mut [Lane],
    ) {
        for c in first * m..(first + 1) * m {
            x[c] = right(c, x[c]) * self.inverse_pivot[first];
        }
        for i in first + 1..=last {
            let (before, here) = x[(i - 1) * m..][..2 * m].split_at_mut(m);
            let (lower, pivot) = (self.lower[i], self.inverse_pivot[i]);
            for c in 0..m {
                here[c] = lower.mul_neg_add(before[c], right(i * m + c, here[c])) * pivot;
            }
        }
        for i in (first..last).rev() {
            let (here, behind) = x[i * m..][..2 * m].split_at_mut(m);
            let factor = self.upper[i];
            for c in 0..m {
                here[c] = factor.mul_neg_add(behind[c], here[c]);
            }
        }
    }

    /// Solves `T x = factor · r` for the residual r of the whole chain.
    pub fn solve(
        &mut self,
        space: &Erased,
        chain: &mut Chain,
        ends: &ChainEnds,
        factor: Lane,
        x: &mut [Lane],
    ) {
        match ends {
            ChainEnds::Open(_) => self.solve_open(0, chain.n, chain.m, Some((factor, &chain.r)), x),
            ChainEnds::Periodic => {
                x.iter_mut().zip(&chain.r).for_each(|(x, r)| *x = factor * *r);
                self.solve_closed(space, chain, x);
            }
        }
    }

    /// Eliminates all nodes but the first. With H the transport around the curve,
    /// `xᵢ = yᵢ + αᵢx₀ + βᵢHx₀` leaves `(A + c(H + H⁻¹)) x₀ = rhs`.
    fn solve_closed(&mut self, space: &Erased, chain: &mut Chain, f: &mut [Lane]) {
        let (n, m) = (chain.n, chain.m);
        if n > 1 {
            self.solve_open(1, n - 1, m, None, f);
            let [alpha, beta] = &self.answers;
            // rhs = f₀ − y₁/h₀ − H⁻¹ yₙ₋₁/hₙ₋₁
            self.rhs.clear();
            self.rhs.extend_from_slice(&f[(n - 1) * m..n * m]);
            chain.across_closure(space, false, &mut self.rhs);
            for c in 0..m {
                self.rhs[c] = f[c] - self.upper[0] * f[m + c] - self.lower[0] * self.rhs[c];
            }
            let pivot = self.diagonal[0] + self.upper[0] * alpha[1] + self.lower[0] * beta[n - 1];
            let coupling = self.upper[0] * beta[1];
            let inverse = Lane::ONE / pivot;
            // |2c/A| ≤ 1/7 on any knots, and the worst case has two equal segments. Twenty rounds of Richardson's
            // iteration therefore reach rounding.
            self.x.clear();
            self.x.extend(self.rhs.iter().map(|&x| x * inverse));
            for _ in 0..20 {
                f[..m].copy_from_slice(&self.x);
                chain.across_closure(space, true, &mut f[..m]);
                chain.across_closure(space, false, &mut self.x);
                for c in 0..m {
                    self.x[c] = (self.rhs[c] - coupling * (f[c] + self.x[c])) * inverse;
                }
            }
            f[..m].copy_from_slice(&self.x);
            chain.across_closure(space, true, &mut self.x);
            for i in 1..n {
                for c in 0..m {
                    f[i * m + c] += alpha[i] * f[c] + beta[i] * self.x[c];
                }
            }
        } else {
            // One segment from a point to itself is a constant curve.
            f.fill(Lane::ZERO);
        }
    }
}
