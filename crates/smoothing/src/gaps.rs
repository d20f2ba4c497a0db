//! Predictions of a fit for parts of a recording whose data are omitted, at the same λ. Their errors show how far the
//! posterior can be trusted in gaps.
//!
//! The coefficients c solve `Ac = BᵀWy` for data y with the matrix `A = BᵀWB + λΩ`. If data with rows b of B and
//! residuals r are omitted, the coefficients change by `δ = −(A − bᵀWb)⁻¹bᵀWr`, and their covariance is `(A − bᵀWb)⁻¹`.
//! The errors are the deleted residuals of neighbourhood cross-validation (Wood 2024, arXiv 2404.16490). Each lane
//! computes another neighbourhood. On curved spaces, coordinates in frames along the curve make the problem linear up
//! to terms of the curvature.
//!
//! If λ varies along the curve, nobody would know it in the omitted part. It is then replaced there by the same λ as in gaps,
//! which adds `Σ Δ_g Ω_g` to A and `−Σ Δ_g Ω_g c` to the right-hand side, with the changes Δ_g of λ in the segments.

use crate::banded::{Banded, stride};
use crate::bordered::Bordered;
use crate::cyclic::{Factored, PeriodicCorrection};
use crate::estimation::Matrices;
use crate::linearized::{Basis, OVERLAP, SegmentEnergy};
use crate::problem::EndConditions;
use crate::problem::Penalty;
use std::ops::Range;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{LANES, Lane, few};

/// Linear functions of the coefficients of a curve, and of parameters.
pub struct Functionals<'a> {
    /// The index of the first coefficient of each.
    pub firsts: &'a [usize],
    /// The factors of four coefficients, m numbers each.
    pub factors: &'a [f64],
    /// The factors of p parameters.
    pub sides: &'a [f64],
}

/// The system of a curve: its matrix A, and the holonomy of a closed curve.
pub struct System<'a> {
    /// The knots of the curve, and its ends.
    pub knots: &'a [f64],
    /// See `knots`.
    pub ends: EndConditions,
    count: usize,
    m: usize,
    p: usize,
    matrices: &'a Matrices,
    periodic: Option<PeriodicCorrection>,
    changes: Option<Changes<'a>>,
}

/// The changes of λ where data are omitted.
#[derive(Clone, Copy)]
pub struct Changes<'a> {
    /// Changes of λ by segment, in the unit of the times.
    pub lam: &'a [f64],
    /// Accelerations at the knots, in the coordinates of the residuals.
    pub accelerations: &'a [f64],
    /// The derivative whose square is penalised.
    pub penalised: Penalty,
}

/// Data that are omitted, functions that are predicted without them, and segments in which λ changes. The segments of a
/// closed curve may continue beyond the last one.
#[derive(Clone)]
pub struct Block<'a> {
    /// Indices of the data.
    pub omitted: &'a [usize],
    /// The functions.
    pub probes: Range<usize>,
    /// The segments.
    pub segments: Range<usize>,
}

/// Predictions without some of the data: values and variances of linear functions, for noise of variance one.
pub struct Predictions {
    /// The changes caused by the omission, one row of columns per function.
    pub values: Vec<f64>,
    /// The variances; NaN where the other data do not determine the curve.
    pub variances: Vec<f64>,
}

impl<'a> System<'a> {
    /// For a matrix that couples m coordinates.
    pub fn new(
        knots: &'a [f64],
        ends: EndConditions,
        m: usize,
        matrices: &'a Matrices,
        turn: &[f64],
    ) -> Self {
        let basis = Basis::new(knots, ends);
        let periodic =
            basis.is_closed().then(|| PeriodicCorrection { overlap: OVERLAP, m, turn: turn.to_vec() });
        let p = matrices[2].len().isqrt();
        System { knots, ends, count: basis.count(), m, p, matrices, periodic, changes: None }
    }

    /// With changes of λ where data are omitted.
    pub fn with_changes(self, changes: Option<Changes<'a>>) -> Self {
        System { changes, ..self }
    }

    /// Predicts the functions of each block without its data. The residuals are those of all data, `columns` numbers each;
    /// rows and residuals are divided by standard deviations.
    pub fn without(
        &self,
        data: &Functionals,
        residuals: &[f64],
        columns: usize,
        probes: &Functionals,
        blocks: &[Block],
    ) -> Predictions {
        let total = probes.firsts.len();
        let mut found = Predictions { values: vec![0.0; total * columns], variances: vec![f64::NAN; total] };
        for group in blocks.chunks(LANES) {
            checkpoint();
            self.of_lanes(data, residuals, columns, probes, group, &mut found);
        }
        found
    }

    /// Adds the changes of λ in segments to a matrix and a right-hand side.
    fn change(
        &self,
        changes: &Changes,
        segments: Range<usize>,
        columns: usize,
        matrix: &mut [f64],
        right: &mut [f64],
    ) {
        let basis = Basis::new(self.knots, self.ends);
        let unit = changes.penalised.unit(basis.spacing);
        let (m, rows, count) = (self.m, stride(self.m), self.knots.len() - 1);
        let d = m * columns;
        for i in segments.map(|i| i % count) {
            let lam = changes.lam[i] / unit;
            let energy = SegmentEnergy::new(&basis, changes.penalised, i);
            for a in 0..self.count.min(4) {
                let at = energy.first() + a;
                for b in 0..=a {
                    for c in 0..m {
                        matrix[(at * m + c) * rows + (a - b) * m] += lam * energy.entry(a, b);
                    }
                }
                for c in 0..d {
                    let bends = [i, i + 1].map(|k| changes.accelerations[k * d + c] * basis.spacing.powi(2));
                    right[at * d + c] -= lam * energy.pull(a, bends);
                }
            }
        }
    }

    fn of_lanes(
        &self,
        data: &Functionals,
        residuals: &[f64],
        columns: usize,
        probes: &Functionals,
        group: &[Block],
        found: &mut Predictions,
    ) {
        let (m, p, width) = (self.m, self.p, 4 * self.m);
        let size = self.count * m;
        let rows = stride(m);
        // Unused lanes repeat the first block.
        let of_lane = |l: usize| group.get(l).unwrap_or(&group[0]);
        let mut lanes: Vec<[Vec<f64>; 3]> = Vec::with_capacity(LANES);
        let mut rights: Vec<(Vec<f64>, Vec<f64>)> = Vec::with_capacity(LANES);
        for l in 0..LANES {
            let mut own = self.matrices.clone();
            let (mut right, mut border) = (vec![0.0; size * columns], vec![0.0; p * columns]);
            for &k in of_lane(l).omitted {
                let (start, factors) = (data.firsts[k] * m, &data.factors[k * width..][..width]);
                let side = &data.sides[k * p..][..p];
                let residual = &residuals[k * columns..][..columns];
                for (a, x) in factors.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                    for (b, y) in factors[..=a].iter().enumerate() {
                        own[0][(start + a) * rows + a - b] -= x * y;
                    }
                    side.iter().enumerate().for_each(|(b, y)| own[1][(start + a) * p + b] -= x * y);
                    let to = &mut right[(start + a) * columns..][..columns];
                    to.iter_mut().zip(residual).for_each(|(to, r)| *to -= x * r);
                }
                for (a, x) in side.iter().enumerate() {
                    side.iter().enumerate().for_each(|(b, y)| own[2][a * p + b] -= x * y);
                    let to = &mut border[a * columns..][..columns];
                    to.iter_mut().zip(residual).for_each(|(to, r)| *to -= x * r);
                }
            }
            if let Some(changes) = &self.changes {
                self.change(changes, of_lane(l).segments.clone(), columns, &mut own[0], &mut right);
            }
            if let Some(periodic) = &self.periodic {
                right = by_columns(&right, columns, m, |column| periodic.fold(column));
            }
            lanes.push(own);
            rights.push((border, right));
        }
        let at = |part: usize, i: usize| Lane::new(few(|l| lanes[l][part][i]));
        let band = Banded::of(size, rows - 1, |i| at(0, i));
        let matrix = if self.periodic.is_some() {
            Factored::new(band, self.periodic.as_ref())
        } else {
            let side = (0..size * p).map(|i| at(1, i)).collect();
            let corner = Banded::of(p, p.saturating_sub(1), |i| {
                let (row, d) = (i / p, i % p);
                if d <= row { at(2, row * p + row - d) } else { Lane::ZERO }
            });
            Factored::open(Bordered::new(band, side, corner))
        };
        let mut x: Vec<Lane> = (0..p * columns).map(|i| Lane::new(few(|l| rights[l].0[i]))).collect();
        x.extend((0..rights[0].1.len()).map(|i| Lane::new(few(|l| rights[l].1[i]))));
        matrix.solve(columns, &mut x);
        let inverse = matrix.inverse();
        let pivots = matrix.least_pivot().to_array();
        for (l, block) in group.iter().enumerate().filter(|(l, _)| pivots[*l] > 0.0) {
            let border: Vec<f64> = x[..p * columns].iter().map(|x| x.as_array()[l]).collect();
            let mut solved: Vec<f64> = x[p * columns..].iter().map(|x| x.as_array()[l]).collect();
            if let Some(periodic) = &self.periodic {
                solved = by_columns(&solved, columns, m, |column| periodic.extend(column));
            }
            for k in block.probes.clone() {
                let (start, factors) = (probes.firsts[k] * m, &probes.factors[k * width..][..width]);
                let side = &probes.sides[k * p..][..p];
                // The unknowns on which the function depends. Parameters come first.
                let own = side.iter().enumerate().map(|(a, x)| (a, *x));
                let own = own.chain(factors.iter().enumerate().map(|(a, x)| (p + start + a, *x)));
                let own: Vec<(usize, f64)> = own.filter(|(_, x)| *x != 0.0).collect();
                let value = &mut found.values[k * columns..][..columns];
                let mut variance = 0.0;
                for &(i, x) in &own {
                    let row = if i < p { &border[i * columns..] } else { &solved[(i - p) * columns..] };
                    value.iter_mut().zip(row).for_each(|(value, y)| *value += x * y);
                    for &(j, y) in &own {
                        variance += x * y * inverse.at(i, j).as_array()[l];
                    }
                }
                found.variances[k] = variance;
            }
        }
    }
}

/// Applies a function to each column of rows of numbers, m of which belong to a coefficient.
fn by_columns(rows: &[f64], columns: usize, m: usize, change: impl Fn(&mut Vec<f64>)) -> Vec<f64> {
    debug_assert!(rows.len().is_multiple_of(columns * m));
    let changed: Vec<Vec<f64>> = (0..columns)
        .map(|c| {
            let mut column = rows.iter().skip(c).step_by(columns).copied().collect();
            change(&mut column);
            column
        })
        .collect();
    (0..changed[0].len() * columns).map(|at| changed[at % columns][at / columns]).collect()
}
