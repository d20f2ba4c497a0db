//! The posterior of the coefficients of a curve, in frames along it: normal with the covariance A⁻¹.

use crate::banded::{Banded, stride};
use crate::bordered::Bordered;
use crate::cyclic::{Factored, PeriodicCorrection};
use crate::linearized::{Basis, OVERLAP, Stencil};
use crate::problem::EndConditions;
use crate::variance::row_at;
use symspline_core::memory;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{LANES, Lane, lane};

/// The posterior of a curve with noise of variance one.
pub struct Posterior<'a> {
    knots: &'a [f64],
    basis: Basis,
    /// The number of coordinates that A couples, and of parameters in its border.
    m: usize,
    p: usize,
    matrix: Factored,
    periodic: Option<PeriodicCorrection>,
}

impl<'a> Posterior<'a> {
    /// From A: its band, side and corner. `turn` is the holonomy of a closed curve, m × m numbers.
    pub fn new(knots: &'a [f64], ends: EndConditions, m: usize, matrices: [&[f64]; 3], turn: &[f64]) -> Self {
        let basis = Basis::new(knots, ends);
        let [band, side, corner] = matrices;
        let p = corner.len().isqrt();
        memory::require(
            2.0 * LANES as f64 * (band.len() + 2 * side.len() + 2 * corner.len()) as f64,
            "the posterior distribution of the curve",
            "Use fewer knots or parameters",
        );
        let band = Banded::of(basis.count() * m, stride(m) - 1, |at| lane(band[at]));
        let periodic =
            basis.is_closed().then(|| PeriodicCorrection { overlap: OVERLAP, m, turn: turn.to_vec() });
        let matrix = if periodic.is_some() {
            Factored::new(band, periodic.as_ref())
        } else {
            let mut square = Banded::zeros(p, p.saturating_sub(1));
            (0..p).for_each(|a| (0..=a).for_each(|b| *square.entry(a, b) = lane(corner[a * p + b])));
            Factored::open(Bordered::new(band, side.iter().map(|x| lane(*x)).collect(), square))
        };
        Posterior { knots, basis, m, p, matrix, periodic }
    }

    /// The covariances of the derivatives `orders` of the curve at times x: square matrices whose coordinates are those
    /// of the first derivative, then those of the next one.
    pub fn covariances(&self, x: &[f64], orders: &[usize]) -> Vec<f64> {
        let (m, size) = (self.m, orders.len() * self.m);
        require_result(x.len(), size);
        let inverse = self.matrix.inverse_band();
        let mut out = Vec::with_capacity(x.len() * size * size);
        for t in x {
            checkpoint();
            let rows: Vec<Stencil> =
                orders.iter().map(|nu| row_at(self.knots, &self.basis, *t, *nu)).collect();
            for u in 0..size {
                for v in 0..size {
                    let (r, s) = (rows[u / m], rows[v / m]);
                    let count = 4.min(self.basis.count());
                    let mut sum = 0.0;
                    for a in 0..count {
                        for b in 0..count {
                            let factor = r.factors[a] * s.factors[b];
                            if factor != 0.0 {
                                let (i, j) = ((r.first + a) * m + u % m, (s.first + b) * m + v % m);
                                sum += factor * inverse.at(i, j).as_array()[0];
                            }
                        }
                    }
                    out.push(sum);
                }
            }
        }
        out
    }

    /// The covariances of the curve at times x with the curve at times y: m × m numbers each, rows for x.
    pub fn between(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let m = self.m;
        let at = |t: f64| row_at(self.knots, &self.basis, t, 0);
        require_result(x.len(), m);
        let mut out = Vec::with_capacity(x.len() * m * m);
        for (x, y) in x.iter().zip(y) {
            checkpoint();
            let (r, s) = (at(*x), at(*y));
            // Rows of coefficients, with one column per coordinate of y.
            let unit: Vec<f64> = (0..m * m).map(|at| f64::from(at / m == at % m)).collect();
            let mut right = vec![0.0; self.basis.count() * m * m];
            s.spread(&unit, &mut right);
            if let Some(periodic) = &self.periodic {
                right = self.by_columns(right, |column| periodic.fold(column));
            }
            let mut lanes = vec![Lane::ZERO; self.p * m];
            lanes.extend(right.iter().map(|x| lane(*x)));
            self.matrix.solve(m, &mut lanes);
            let mut found: Vec<f64> = lanes[self.p * m..].iter().map(|x| x.as_array()[0]).collect();
            if let Some(periodic) = &self.periodic {
                found = self.by_columns(found, |column| periodic.extend(column));
            }
            let mut value = vec![0.0; m * m];
            r.apply(&found, &mut value);
            out.extend(value);
        }
        out
    }

    /// Applies a function to each of m columns of rows of m numbers.
    fn by_columns(&self, rows: Vec<f64>, change: impl Fn(&mut Vec<f64>)) -> Vec<f64> {
        let m = self.m;
        let columns: Vec<Vec<f64>> = (0..m)
            .map(|c| {
                let mut column = rows.iter().skip(c).step_by(m).copied().collect();
                change(&mut column);
                column
            })
            .collect();
        (0..columns[0].len() * m).map(|at| columns[at % m][at / m]).collect()
    }

    /// The number of independent normal numbers that a sample needs, for p parameters.
    pub fn freedom(knots: &[f64], ends: EndConditions, m: usize, p: usize) -> usize {
        freedom(&Basis::new(knots, ends), m, p)
    }

    /// Moves of the curve at its knots, m numbers each, for rows of independent normal numbers.
    pub fn samples(&self, normal: &[f64]) -> Vec<f64> {
        let rows = self.basis.at_knots(0);
        let freedom = freedom(&self.basis, self.m, self.p);
        let size = normal.len() / freedom.max(1) * rows.len() * self.m;
        memory::require(
            (size + 20 * freedom) as f64,
            "drawing samples of the curve",
            "Draw fewer samples at a time",
        );
        let mut out = Vec::with_capacity(size);
        for normal in normal.chunks_exact(freedom) {
            let mut x: Vec<Lane> = normal.iter().map(|x| lane(*x)).collect();
            self.matrix.sample(&mut x);
            let mut x: Vec<f64> = x[self.p..].iter().map(|x| x.as_array()[0]).collect();
            if let Some(periodic) = &self.periodic {
                periodic.extend(&mut x);
            }
            for row in &rows {
                let mut value = vec![0.0; self.m];
                row.apply(&x, &mut value);
                out.extend(value);
            }
        }
        out
    }
}

/// Memory for the covariances of `count` times, and for a copy of them.
fn require_result(count: usize, size: usize) {
    memory::require(
        2.0 * count as f64 * (size as f64).powi(2),
        "the covariances of the curve",
        "Pass fewer times in one call",
    );
}

fn freedom(basis: &Basis, m: usize, p: usize) -> usize {
    let repeated = if basis.is_closed() { OVERLAP } else { 0 };
    p + (basis.count() - repeated) * m
}
