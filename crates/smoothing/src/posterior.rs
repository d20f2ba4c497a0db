//! The posterior of the coefficients of a curve, in frames along it: normal with the covariance A⁻¹.

use crate::banded::{Banded, stride};
use crate::bordered::Bordered;
use crate::cyclic::{Factored, PeriodicCorrection};
use crate::linearized::{Basis, OVERLAP, Stencil};
use crate::problem::EndConditions;
use crate::variance::row_at;
use symspline_core::memory;
use symspline_core::monitor::checkpoint;

/// The number of pairs of times whose covariances are computed at once.
const PAIRS: usize = 8;

/// The posterior of a curve with noise of variance one.
pub struct Posterior<'a> {
    knots: &'a [f64],
    basis: Basis,
    /// The number of coordinates that A couples, and of parameters in its border.
    m: usize,
    p: usize,
    matrix: Factored<f64>,
    periodic: Option<PeriodicCorrection>,
}

impl<'a> Posterior<'a> {
    /// From A: its band, side and corner. `turn` is the holonomy of a closed curve, m × m numbers.
    pub fn new(knots: &'a [f64], ends: EndConditions, m: usize, matrices: [&[f64]; 3], turn: &[f64]) -> Self {
        let basis = Basis::new(knots, ends);
        let [band, side, corner] = matrices;
        let p = corner.len().isqrt();
        memory::require(
            3.0 * (band.len() + 2 * side.len() + 2 * corner.len()) as f64,
            "the posterior distribution of the curve",
            "Use fewer knots or parameters",
        );
        let band = Banded::of(basis.count() * m, stride(m) - 1, |at| band[at]);
        let periodic =
            basis.is_closed().then(|| PeriodicCorrection { overlap: OVERLAP, m, turn: turn.to_vec() });
        let matrix = if periodic.is_some() {
            Factored::new(band, periodic.as_ref())
        } else {
            let mut square = Banded::zeros(p, p.saturating_sub(1));
            (0..p).for_each(|a| (0..=a).for_each(|b| *square.entry(a, b) = corner[a * p + b]));
            Factored::open(Bordered::new(band, side.to_vec(), square))
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
                                sum += factor * inverse.at(i, j);
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
        let unit: Vec<f64> = (0..m * m).map(|at| f64::from(at / m == at % m)).collect();
        // Several pairs share a pass through the matrix: rows of coefficients, with one column per pair and coordinate.
        for (x, y) in x.chunks(PAIRS).zip(y.chunks(PAIRS)) {
            checkpoint();
            let columns = x.len() * m;
            let mut rows = vec![0.0; self.p * columns];
            let mut rights: Vec<Vec<f64>> = Vec::with_capacity(x.len());
            for y in y {
                let mut right = vec![0.0; self.basis.count() * m * m];
                at(*y).spread(&unit, &mut right);
                rights.push(match &self.periodic {
                    Some(periodic) => self.by_columns(right, |column| periodic.fold(column)),
                    None => right,
                });
            }
            for i in 0..rights[0].len() / m {
                rights.iter().for_each(|right| rows.extend(&right[i * m..][..m]));
            }
            self.matrix.solve(columns, &mut rows);
            for (k, x) in x.iter().enumerate() {
                let solved = rows[self.p * columns..].chunks_exact(columns);
                let mut found: Vec<f64> = solved.flat_map(|row| &row[k * m..][..m]).copied().collect();
                if let Some(periodic) = &self.periodic {
                    found = self.by_columns(found, |column| periodic.extend(column));
                }
                let mut value = vec![0.0; m * m];
                at(*x).apply(&found, &mut value);
                out.extend(value);
            }
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
            let mut x = normal.to_vec();
            self.matrix.sample(&mut x);
            x.drain(..self.p);
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
