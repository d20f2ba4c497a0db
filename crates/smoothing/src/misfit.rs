//! The weighted distances of the data from a curve, and the matrix of the linearised problem, A = BᵀWB + λΩ.
//!
//! Scalar weights apply to all coordinates alike, and every coordinate has the same A. Information matrices couple
//! the coordinates, so that A is one matrix for all of them, with a band of blocks. The curvature of the space
//! couples them, too, if it is included: see [`JacobiOperator`].

use crate::audit;
use crate::banded::{Banded, Number, WIDTH, stride};
use crate::cyclic::{Factored, PeriodicCorrection};
use crate::information::Seen;
use crate::jacobi_operator::JacobiOperator;
use crate::linearized::{LinearProblem, OVERLAP, Stencil};
use crate::problem::Known;
use std::borrow::Cow;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{Lane, lane};

/// Residuals at a curve, in coordinates of frames along it, and their weights.
#[derive(Clone)]
pub enum Misfit<'a> {
    /// Scalar weights: `w|r|²`.
    Numbers {
        /// The weights w.
        weights: Cow<'a, [f64]>,
        /// The residuals r, m numbers each.
        residuals: Vec<f64>,
        /// BᵀWB, as the entries (i, i − d) at i · 4 + d.
        gram: Cow<'a, [f64]>,
    },
    /// Information matrices as weights.
    Matrices {
        /// The residuals.
        seen: Seen,
        /// BᵀNᵀNB: the entries (i, i − d) at i · 4m + d; coordinates of a coefficient are adjacent.
        gram: Vec<f64>,
    },
}

/// Coordinates are coupled only if the number of coefficients times the cube of the dimension does not exceed this.
pub const COUPLED: usize = 10_000_000;

/// The factored matrix A, for one λ or another one on each lane.
pub struct Factors<T = Lane> {
    matrix: Factored<T>,
    /// The number of coupled coordinates: m, or one if a single matrix serves all of them.
    coupled: usize,
}

/// The matrix A, before it is factored.
pub struct Whole<T = Lane> {
    /// Its band; of a closed curve that with repeated coefficients.
    pub matrix: Banded<T>,
    /// The number of coupled coordinates.
    pub coupled: usize,
    /// The continuation of a closed curve, for the coupled coordinates.
    pub periodic: Option<PeriodicCorrection>,
}

impl<T: Number> Whole<T> {
    /// The factored matrix.
    pub fn factored(self) -> Factors<T> {
        Factors { matrix: Factored::new(self.matrix, self.periodic.as_ref()), coupled: self.coupled }
    }
}

impl Whole<f64> {
    /// The matrix as plain numbers.
    pub fn known(&self) -> Known {
        let rows = stride(self.coupled);
        let entry = |at: usize| {
            let (i, d) = (at / rows, at % rows);
            if d <= i { self.matrix.at(i, i - d) } else { 0.0 }
        };
        let turn = self.periodic.as_ref().map_or_else(Vec::new, |periodic| periodic.turn.clone());
        Known { coupled: self.coupled, matrix: (0..self.matrix.size * rows).map(entry).collect(), turn }
    }
}

impl<'a> Misfit<'a> {
    /// For information matrices.
    pub fn matrices(linearized: &LinearProblem, m: usize, seen: Seen) -> Self {
        let gram = coupled_gram(linearized, m, &seen.rows);
        Misfit::Matrices { seen, gram }
    }

    /// Multiplies residuals by factors: the pseudo-data of a robust loss.
    pub fn soften(&mut self, factors: &[f64], m: usize) {
        match self {
            Misfit::Numbers { residuals, .. } => scale(residuals, factors, m),
            Misfit::Matrices { seen, .. } => {
                scale(&mut seen.residuals, factors, m);
                scale(&mut seen.pulls, factors, m);
            }
        }
    }

    /// Multiplies weights by factors; data with the factor zero are not counted.
    pub fn reweigh(&mut self, linearized: &LinearProblem, factors: &[f64], m: usize) {
        match self {
            Misfit::Numbers { weights, gram, .. } => {
                let own: Vec<f64> = weights.iter().zip(factors).map(|(w, factor)| w * factor).collect();
                *gram = Cow::Owned(linearized.gram_of(&own));
                *weights = Cow::Owned(own);
            }
            Misfit::Matrices { seen, gram } => {
                let roots: Vec<f64> = factors.iter().map(|factor| factor.sqrt()).collect();
                scale(&mut seen.rows, &roots, m * m);
                scale(&mut seen.residuals, &roots, m);
                scale(&mut seen.pulls, factors, m);
                seen.ranks
                    .iter_mut()
                    .zip(factors)
                    .filter(|(_, factor)| **factor == 0.0)
                    .for_each(|(r, _)| *r = 0);
                *gram = coupled_gram(linearized, m, &seen.rows);
            }
        }
    }

    /// BᵀWr.
    pub fn pull(&self, linearized: &LinearProblem, m: usize) -> Vec<f64> {
        let mut pull = vec![0.0; linearized.basis.count() * m];
        let mut weighed = vec![0.0; m];
        for (k, row) in linearized.data.iter().enumerate() {
            checkpoint();
            match self {
                Misfit::Numbers { weights, residuals, .. } => {
                    let r = &residuals[k * m..][..m];
                    weighed.iter_mut().zip(r).for_each(|(x, r)| *x = weights[k] * r);
                }
                Misfit::Matrices { seen, .. } => weighed.copy_from_slice(&seen.pulls[k * m..][..m]),
            }
            row.spread(&weighed, &mut pull);
        }
        pull
    }

    /// A, factored.
    pub fn factored<T: Number>(
        &self,
        linearized: &LinearProblem,
        m: usize,
        jacobi: Option<&JacobiOperator>,
        periodic: Option<&PeriodicCorrection>,
        lam: T,
    ) -> Factors<T> {
        self.matrix(linearized, m, jacobi, periodic, lam).factored()
    }

    /// A. The holonomy of a closed curve couples the coordinates, too.
    pub fn matrix<T: Number>(
        &self,
        linearized: &LinearProblem,
        m: usize,
        jacobi: Option<&JacobiOperator>,
        periodic: Option<&PeriodicCorrection>,
        lam: T,
    ) -> Whole<T> {
        self.whole(linearized, m, jacobi.is_some(), periodic, |coupled, at| {
            let stiff =
                jacobi.map_or_else(|| of_each(&linearized.penalty, coupled, at), |jacobi| jacobi.penalty[at]);
            lam.mul_add(T::of(stiff), T::of(self.gram(coupled, at)))
        })
    }

    /// The matrix with given entries, for a number of coupled coordinates and a position in the band. The coordinates are
    /// coupled if `together` is true.
    pub fn whole<T: Number>(
        &self,
        linearized: &LinearProblem,
        m: usize,
        together: bool,
        periodic: Option<&PeriodicCorrection>,
        entry: impl Fn(usize, usize) -> T,
    ) -> Whole<T> {
        let count = linearized.basis.count();
        // If the coupled matrix would be too large, the holonomy is omitted in the matrix, but not in its right-hand
        // side.
        let few = m.saturating_pow(3).saturating_mul(count) <= COUPLED;
        let turns = few && periodic.is_some_and(|correction| !correction.is_plain());
        let coupled = if together || turns || matches!(self, Misfit::Matrices { .. }) { m } else { 1 };
        let matrix = Banded::of(count * coupled, stride(coupled) - 1, |at| entry(coupled, at));
        let periodic = periodic.map(|given| {
            if given.m == coupled && few {
                given.clone()
            } else {
                PeriodicCorrection::plain(OVERLAP, coupled)
            }
        });
        Whole { matrix, coupled, periodic }
    }

    /// An entry of BᵀWB, either for each coordinate separately or for all of them.
    pub fn gram(&self, coupled: usize, at: usize) -> f64 {
        match self {
            Misfit::Numbers { gram, .. } => of_each(gram, coupled, at),
            Misfit::Matrices { gram, .. } => gram[at],
        }
    }

    /// The weighted square of the residual of a datum after the coefficients have changed by x.
    pub fn square(&self, row: &Stencil, k: usize, m: usize, x: &[Lane]) -> Lane {
        let mut sum = Lane::ZERO;
        match self {
            Misfit::Numbers { weights, residuals, .. } => {
                for c in 0..m {
                    let moved = lane(residuals[k * m + c]) - row.of_lanes(x, m, c);
                    sum = (moved * lane(weights[k])).mul_add(moved, sum);
                }
            }
            Misfit::Matrices { seen, .. } => {
                for (j, n) in seen.rows[k * m * m..][..m * m].chunks_exact(m).enumerate() {
                    let moved = (0..m).fold(lane(seen.residuals[k * m + j]), |rest, c| {
                        (-row.of_lanes(x, m, c)).mul_add(lane(n[c]), rest)
                    });
                    sum = moved.mul_add(moved, sum);
                }
            }
        }
        sum
    }

    /// The number of data per coordinate.
    pub fn count(&self, m: usize) -> f64 {
        match self {
            Misfit::Numbers { weights, .. } => weights.iter().filter(|w| **w > 0.0).count() as f64,
            Misfit::Matrices { seen, .. } => seen.ranks.iter().sum::<usize>() as f64 / m as f64,
        }
    }

    /// The leverage of a datum per coordinate, given the band of A⁻¹ and its mean over the coordinates.
    pub fn leverage(
        &self,
        row: &Stencil,
        k: usize,
        m: usize,
        inverse: &Banded<Lane>,
        mean: &Banded<Lane>,
    ) -> Lane {
        match self {
            Misfit::Numbers { weights, .. } => row.square(mean) * lane(weights[k]),
            Misfit::Matrices { seen, .. } => {
                let mut sum = Lane::ZERO;
                for n in seen.rows[k * m * m..][..m * m].chunks_exact(m) {
                    let count = 4.min(inverse.size / m);
                    let wide: Vec<f64> = (0..count * m).map(|u| row.factors[u / m] * n[u % m]).collect();
                    for (u, x) in wide.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                        for (v, y) in wide.iter().enumerate() {
                            sum += inverse.at(row.first * m + u, row.first * m + v) * lane(x * y);
                        }
                    }
                }
                sum * lane(1.0 / m as f64)
            }
        }
    }

    /// The weighted sum of squares after the coefficients have changed by x.
    pub fn rss(&self, linearized: &LinearProblem, m: usize, x: &[Lane]) -> Lane {
        (0..linearized.data.len()).fold(Lane::ZERO, |sum, k| sum + self.square(&linearized.data[k], k, m, x))
    }

    /// Squared deviations of residuals from those of the data before and after them, interpolated in time, per coordinate and
    /// in units of their variance; NaN at the ends and without weight.
    pub fn deviations(&self, weights: &[f64], times: &[f64], m: usize) -> Vec<f64> {
        let residuals = match self {
            Misfit::Numbers { residuals, .. } => residuals,
            Misfit::Matrices { seen, .. } => &seen.residuals,
        };
        let of_weights = |k: usize| match self {
            Misfit::Numbers { .. } => weights[k],
            // Whitened residuals have variance one.
            Misfit::Matrices { .. } => 1.0,
        };
        let used: Vec<usize> = (0..weights.len()).filter(|&k| weights[k] > 0.0).collect();
        let mut out = vec![f64::NAN; weights.len()];
        for near in used.windows(3) {
            let [a, b, c] = [0, 1, 2].map(|i| near[i]);
            let whole = times[c] - times[a];
            if whole > 0.0 {
                let share = (times[b] - times[a]) / whole;
                let at = |k: usize, i: usize| residuals[k * m + i];
                let deviation = |i: usize| at(b, i) - share * at(c, i) - (1.0 - share) * at(a, i);
                let square = (0..m).map(|i| deviation(i).powi(2)).sum::<f64>() / m as f64;
                let variance = 1.0 / of_weights(b)
                    + share.powi(2) / of_weights(c)
                    + (1.0 - share).powi(2) / of_weights(a);
                out[b] = square / variance;
            }
        }
        out
    }

    /// An isolated outlier: see [`audit::isolated_outlier`]. Weights are assumed to be nearly equal there.
    pub fn isolated_outlier(&self, times: &[f64], deviations: &[f64], m: usize) -> Option<usize> {
        let residuals = match self {
            Misfit::Numbers { weights, residuals, .. } => {
                let rows = residuals.chunks_exact(m).zip(weights.iter());
                rows.flat_map(|(row, w)| row.iter().map(|x| x * w.sqrt())).collect()
            }
            Misfit::Matrices { seen, .. } => seen.residuals.clone(),
        };
        audit::isolated_outlier(times, &residuals, deviations, m)
    }

    /// The present weighted sum of squares.
    pub fn rss_now(&self, m: usize) -> f64 {
        let square = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>();
        match self {
            Misfit::Numbers { weights, residuals, .. } => {
                weights.iter().zip(residuals.chunks_exact(m)).map(|(w, r)| w * square(r)).sum()
            }
            Misfit::Matrices { seen, .. } => square(&seen.residuals),
        }
    }

    /// tr A⁻¹BᵀWB divided by the number of coordinates, given the band of A⁻¹: the degrees of freedom per coordinate.
    pub fn freedom<T: Number>(&self, linearized: &LinearProblem, inverse: &Banded<T>) -> T {
        let (stride, coupled) = (inverse.width + 1, inverse.size / linearized.basis.count());
        let mut sum = T::ZERO;
        for i in 0..inverse.size {
            checkpoint();
            for j in i.saturating_sub(inverse.width)..(i + stride).min(inverse.size) {
                sum += inverse.at(i, j) * T::of(self.gram(coupled, i.max(j) * stride + i.abs_diff(j)));
            }
        }
        sum * T::of(1.0 / coupled as f64)
    }
}

/// Multiplies rows of `size` numbers by factors.
fn scale(rows: &mut [f64], factors: &[f64], size: usize) {
    for (row, factor) in rows.chunks_exact_mut(size).zip(factors) {
        row.iter_mut().for_each(|x| *x *= factor);
    }
}

/// BᵀNᵀNB for m × m matrices N.
fn coupled_gram(linearized: &LinearProblem, m: usize, rows: &[f64]) -> Vec<f64> {
    let stride = stride(m);
    let mut gram = vec![0.0; linearized.basis.count() * m * stride];
    let mut square = vec![0.0; m * m];
    for (b, n) in linearized.data.iter().zip(rows.chunks_exact(m * m)) {
        square.fill(0.0);
        for row in n.chunks_exact(m) {
            for (at, x) in square.iter_mut().enumerate() {
                *x = row[at / m].mul_add(row[at % m], *x);
            }
        }
        for (p, f) in b.factors.iter().enumerate() {
            for (q, g) in b.factors[..=p].iter().enumerate() {
                let factor = f * g;
                if factor == 0.0 {
                    continue;
                }
                for (at, x) in square.iter().enumerate() {
                    let (i, j) = ((b.first + p) * m + at / m, (b.first + q) * m + at % m);
                    if i >= j {
                        gram[i * stride + i - j] += factor * x;
                    }
                }
            }
        }
    }
    gram
}

/// The entry `at` of a matrix that is the same for every coordinate and does not couple them.
pub fn of_each<T: Number>(band: &[T], coupled: usize, at: usize) -> T {
    let (i, d) = (at / stride(coupled), at % stride(coupled));
    if d % coupled == 0 { band[i / coupled * (WIDTH + 1) + d / coupled] } else { T::ZERO }
}

impl<T: Number> Factors<T> {
    /// A⁻¹x in place, for coefficients of m numbers.
    pub fn solve(&self, m: usize, x: &mut [T]) {
        self.matrix.solve(m / self.coupled, x);
    }

    /// The smallest pivot. It is not positive if A is not numerically positive definite.
    pub fn least_pivot(&self) -> T {
        self.matrix.least_pivot()
    }

    /// ln det A per coordinate.
    pub fn log_det(&self) -> T {
        self.matrix.log_det() * T::of(1.0 / self.coupled as f64)
    }

    /// The band of A⁻¹.
    pub fn inverse_band(&self) -> Banded<T> {
        self.matrix.inverse_band()
    }

    /// The band of A⁻¹ of one coordinate: the mean over all coordinates.
    pub fn mean(&self, inverse: &Banded<T>) -> Banded<T> {
        let m = self.coupled;
        let entry = |at: usize| {
            let (i, d) = (at / (WIDTH + 1), at % (WIDTH + 1));
            if d > i {
                return T::ZERO;
            }
            let sum = (0..m).fold(T::ZERO, |sum, c| sum + inverse.at(i * m + c, (i - d) * m + c));
            sum * T::of(1.0 / m as f64)
        };
        Banded::of(inverse.size / m, WIDTH, entry)
    }
}
