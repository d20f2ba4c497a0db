//! The linear problem of measurements of any kind: points, velocities, accelerations, and functions of them.
//!
//! At a curve, measurement k has the residual r. If the curve moves by ξ in frames along it, and the parameters θ by
//! δθ, the residual becomes `r + J₀ξ + J₁ξ' + J₂ξ'' + Jδθ`. With ξ = Bc the problem is
//!
//! ```text
//! min Σ |r + Lc + Jδθ|² + Σ λ |a + Sc|²,    L = J₀B + J₁B' + J₂B''
//! ```
//!
//! for coefficients c of all coordinates together. Its matrix is banded, with a border of one row per parameter. Each
//! factor of a product has its own λ.

use crate::banded::{Banded, stride};
use crate::bordered::{Bordered, Inverse};
use crate::choice::{Look, STRAIGHT, Scoring, choose};
use crate::jacobi_operator::JacobiOperator;
use crate::linearized::{Basis, LinearProblem, Stencil};
use crate::path::Position;
use crate::problem::{Criterion, EndConditions, Penalty};
use symspline_core::memory;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{LANES, Lane, lane};
use symspline_core::space::{Erased, Origin};

/// Measurements of one kind, whitened: their noise has variance one.
#[derive(Clone, Copy)]
pub struct Measurements<'a> {
    /// Positions in the order of time.
    pub positions: &'a [Position],
    /// Residuals, `size` numbers each.
    pub residuals: &'a [f64],
    /// The number of residuals of a measurement.
    pub size: usize,
    /// J₀, J₁ and J₂: `size` × m numbers each, or empty where they vanish.
    pub jacobians: [&'a [f64]; 3],
    /// J: `size` × p numbers each, or empty.
    pub parameters: &'a [f64],
}

/// A factor of a product.
#[derive(Clone, Copy)]
pub struct Factor<'a> {
    /// Its space.
    pub space: &'a Erased<'a>,
    /// The velocities at the knots in frames along the curve, in units of the mean knot spacing.
    pub speeds: &'a [f64],
    /// The accelerations, likewise.
    pub accelerations: &'a [f64],
    /// On a group whose moving frame the measurements refer to, the matrices of ξ ↦ [e, ξ]/2 for the vectors e of the
    /// frames; otherwise empty.
    pub halves: &'a [f64],
}

impl Factor<'_> {
    fn dim(&self) -> usize {
        self.space.dim()
    }
}

/// The linear problem at a curve.
pub struct Estimation<'a> {
    linearized: LinearProblem,
    factors: Vec<Factor<'a>>,
    /// Jacobi's operators of curved factors.
    jacobi: Vec<Option<JacobiOperator>>,
    /// The first coordinate of each factor.
    first: Vec<usize>,
    /// The number of coordinates, and of parameters.
    m: usize,
    p: usize,
    /// The matrices of the energies of all factors, as the entries (i, i − d) at i · 4m + d.
    penalty: Vec<f64>,
    /// ΣLᵀL, ΣLᵀJ and ΣJᵀJ: the entries (i, i − d) at i · 4m + d, and row by row.
    gram: Vec<f64>,
    side: Vec<f64>,
    corner: Vec<f64>,
    /// The precisions of the parameters before any measurement.
    priors: Vec<f64>,
    /// −Σ(J L)ᵀr: parameters first.
    pull: Vec<f64>,
    /// Σ|r|² and the number of residuals.
    squares: f64,
    count: usize,
    /// Half the gradients of the energies of all factors.
    stiffness: Vec<Vec<f64>>,
}

/// The solution of the linear problem.
pub struct Estimate {
    /// λ of each factor, in the unit of the times, and whether it lies at a bound.
    pub lams: Vec<(f64, bool)>,
    /// The move of the curve at the knots, m numbers each.
    pub step: Vec<f64>,
    /// The changes of the parameters.
    pub parameters: Vec<f64>,
    /// Variances of the coordinates at the knots, and of the parameters, for noise of variance one.
    pub variances: [Vec<f64>; 2],
    /// Degrees of freedom of each factor per coordinate, and of everything together.
    pub freedom: (Vec<f64>, f64),
    /// The Schur complement of the parameters: the information that the measurements leave about them.
    pub information: Vec<f64>,
    /// Whether the measurements determine the curve.
    pub determined: bool,
}

/// A symmetric banded matrix with a border, as plain numbers: band, side and corner.
pub type Matrices = [Vec<f64>; 3];

impl<'a> Estimation<'a> {
    /// Without measurements. `priors` holds the precision of each parameter, and its distance from the prior mean.
    pub fn new(
        knots: &[f64],
        ends: EndConditions,
        penalty: Penalty,
        factors: Vec<Factor<'a>>,
        priors: &[(f64, f64)],
    ) -> Self {
        let linearized = LinearProblem::new(Basis::new(knots, ends), &[], &[], penalty);
        let m = factors.iter().map(Factor::dim).sum();
        let (p, size) = (priors.len(), linearized.basis.count() * m);
        // The matrix, its factors and its inverse for the λ of all lanes; at most two blocks of each exist at the same time.
        let entries = (size * stride(m)) as f64 + 3.0 * p as f64 * (size as f64 + p as f64);
        memory::require(
            3.0 * LANES as f64 * entries,
            "the linear system of the estimation",
            "Use fewer knots, or estimate fewer constants",
        );
        let first: Vec<usize> =
            (0..factors.len()).map(|f| factors[..f].iter().map(Factor::dim).sum()).collect();
        let jacobi: Vec<Option<JacobiOperator>> = factors
            .iter()
            .map(|own| {
                let curved = own.space.curvature() != 0.0;
                curved.then(|| JacobiOperator::new(own.space, &linearized, own.speeds, own.accelerations))
            })
            .collect();
        let stiffness = factors
            .iter()
            .zip(&jacobi)
            .map(|(own, jacobi)| {
                let Some(jacobi) = jacobi else {
                    let flat = vec![0.0; own.accelerations.len()];
                    return linearized.stiffness(own.accelerations, &flat, own.dim());
                };
                jacobi.pull(&linearized, own.accelerations)
            })
            .collect();
        // The gradient of the energy does not depend on the frame.
        let jacobi: Vec<Option<JacobiOperator>> = factors
            .iter()
            .zip(jacobi)
            .map(|(own, jacobi)| match jacobi {
                Some(jacobi) if !own.halves.is_empty() => {
                    Some(jacobi.in_moving_frame(&linearized, own.accelerations, own.halves))
                }
                other => other,
            })
            .collect();
        let mut penalty = vec![0.0; linearized.basis.count() * m * stride(m)];
        for ((own, first), jacobi) in factors.iter().zip(&first).zip(&jacobi) {
            add_penalty(&linearized, own.dim(), *first, jacobi.as_ref(), m, &mut penalty);
        }
        let mut pull = vec![0.0; p + size];
        priors.iter().zip(&mut pull).for_each(|((precision, off), pull)| *pull = -precision * off);
        Estimation {
            gram: vec![0.0; size * stride(m)],
            side: vec![0.0; size * p],
            corner: vec![0.0; p * p],
            priors: priors.iter().map(|(precision, _)| *precision).collect(),
            pull,
            squares: priors.iter().map(|(precision, off)| precision * off * off).sum(),
            // A prior is a measurement of its parameter.
            count: priors.iter().filter(|(precision, _)| *precision > 0.0).count(),
            stiffness,
            penalty,
            jacobi,
            linearized,
            factors,
            first,
            m,
            p,
        }
    }

    /// Adds measurements.
    pub fn add(&mut self, own: &Measurements) {
        let (m, p, d) = (self.m, self.p, own.size);
        let wide = 4 * m;
        // The squares of all measurements of a segment are summed before they are added to the band.
        let mut square = vec![0.0; wide * wide];
        let mut rows = vec![0.0; d * wide];
        let mut at = None;
        for (k, &(segment, position)) in own.positions.iter().enumerate() {
            checkpoint();
            let basis = &self.linearized.basis;
            let values: [Stencil; 3] = std::array::from_fn(|nu| {
                if own.jacobians[nu].is_empty() {
                    Stencil::default()
                } else {
                    basis.row(segment, position, nu)
                }
            });
            let first = (0..3).find(|&nu| !own.jacobians[nu].is_empty()).map_or(0, |nu| values[nu].first);
            if at.is_some_and(|at| at != first) {
                self.spread(at.unwrap_or(0), &mut square);
            }
            at = Some(first);
            rows.fill(0.0);
            for (nu, (row, jacobian)) in values.iter().zip(own.jacobians).enumerate() {
                let Some(jacobian) = jacobian.get(k * d * m..(k + 1) * d * m) else { continue };
                let unit = self.linearized.basis.spacing.powi(-(nu as i32));
                for (i, own) in jacobian.chunks_exact(m).enumerate() {
                    for (block, factor) in rows[i * wide..][..wide].chunks_exact_mut(m).zip(row.factors) {
                        block.iter_mut().zip(own).for_each(|(x, j)| *x += unit * factor * j);
                    }
                }
            }
            let count = (self.linearized.basis.count() - first).min(4) * m;
            let jacobian =
                if own.parameters.is_empty() { own.parameters } else { &own.parameters[k * d * p..] };
            for i in 0..d {
                let (row, r) = (&rows[i * wide..][..count], own.residuals[k * d + i]);
                for (u, x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                    let square = &mut square[u * wide..][..=u];
                    square.iter_mut().zip(row).for_each(|(sum, y)| *sum = x.mul_add(*y, *sum));
                    self.pull[p + first * m + u] -= x * r;
                }
                if let Some(j) = jacobian.get(i * p..(i + 1) * p).filter(|_| p > 0) {
                    for (u, x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                        let side = &mut self.side[(first * m + u) * p..][..p];
                        side.iter_mut().zip(j).for_each(|(sum, y)| *sum = x.mul_add(*y, *sum));
                    }
                    for (a, x) in j.iter().enumerate() {
                        let corner = &mut self.corner[a * p..][..p];
                        corner.iter_mut().zip(j).for_each(|(sum, y)| *sum = x.mul_add(*y, *sum));
                        self.pull[a] -= x * r;
                    }
                }
                self.squares += r * r;
            }
        }
        if let Some(first) = at {
            self.spread(first, &mut square);
        }
        self.count += own.residuals.len();
    }

    /// Adds a square block of the coefficients from `first` on to the band, and clears it.
    fn spread(&mut self, first: usize, square: &mut [f64]) {
        let (wide, stride) = (4 * self.m, stride(self.m));
        let rows = self.linearized.basis.count() * self.m;
        for u in 0..wide.min(rows - first * self.m) {
            let i = first * self.m + u;
            for v in 0..=u {
                self.gram[i * stride + u - v] += square[u * wide + v];
            }
        }
        square.fill(0.0);
    }

    /// The factor of a coordinate.
    fn factor_of(&self, coordinate: usize) -> usize {
        self.first.partition_point(|first| *first <= coordinate) - 1
    }

    /// The λ at which measurements and energy of a factor have about the same weight.
    fn balance(&self, factor: usize) -> f64 {
        let (first, dim) = (self.first[factor], self.factors[factor].dim());
        let count = self.linearized.basis.count();
        let entry = |i: usize, c: usize| self.gram[(i * self.m + first + c) * stride(self.m)];
        let sum: f64 = (0..count).flat_map(|i| (0..dim).map(move |c| (i, c))).map(|(i, c)| entry(i, c)).sum();
        sum / (self.linearized.penalised.stiffness() * (count * dim) as f64)
    }

    /// A for the λ of all factors, in units of the mean knot spacing.
    fn matrix(&self, lams: &[Lane]) -> (Banded, Vec<Lane>, Banded) {
        let (m, stride) = (self.m, stride(self.m));
        let of: Vec<usize> = (0..m).map(|c| self.factor_of(c)).collect();
        let band = Banded::of(self.gram.len() / stride, stride - 1, |at| {
            lams[of[at / stride % m]].mul_add(lane(self.penalty[at]), lane(self.gram[at]))
        });
        let mut corner = Banded::zeros(self.p, self.p.saturating_sub(1));
        for a in 0..self.p {
            for b in 0..=a {
                let prior = if a == b { self.priors[a] } else { 0.0 };
                *corner.entry(a, b) = lane(self.corner[a * self.p + b] + prior);
            }
        }
        (band, self.side.iter().map(|x| lane(*x)).collect(), corner)
    }

    fn factored(&self, lams: &[Lane]) -> Bordered {
        let (band, side, corner) = self.matrix(lams);
        Bordered::new(band, side, corner)
    }

    /// The right-hand side: parameters first.
    fn right(&self, lams: &[Lane]) -> Vec<Lane> {
        let mut right: Vec<Lane> = self.pull.iter().map(|x| lane(*x)).collect();
        for (own, first, stiffness, lam) in self.each(lams) {
            for (k, row) in stiffness.chunks_exact(own.dim()).enumerate() {
                for (c, x) in row.iter().enumerate() {
                    right[self.p + k * self.m + first + c] -= lam * lane(*x);
                }
            }
        }
        right
    }

    /// Factors with their first coordinates, gradients and λ.
    fn each<'b>(
        &'b self,
        lams: &'b [Lane],
    ) -> impl Iterator<Item = (&'b Factor<'a>, usize, &'b [f64], Lane)> {
        let stiffness = self.stiffness.iter().map(|x| &x[..]);
        self.factors
            .iter()
            .zip(self.first.iter().copied())
            .zip(stiffness)
            .zip(lams)
            .map(|(((own, first), stiffness), lam)| (own, first, stiffness, *lam))
    }

    /// A product of an entry of the inverse with ΣLᵀL, ΣLᵀJ or ΣJᵀJ, where priors are rows of J, summed over each row:
    /// parameters first.
    fn freedoms(&self, inverse: &Inverse) -> Vec<Lane> {
        let (p, stride, size) = (self.p, stride(self.m), inverse.band.size);
        let mut out = vec![Lane::ZERO; p + size];
        for a in 0..p {
            let terms = (0..p).map(|b| inverse.at(a, b) * lane(self.corner[a * p + b]));
            out[a] = terms.fold(inverse.at(a, a) * lane(self.priors[a]), |sum, x| sum + x);
        }
        for i in 0..size {
            checkpoint();
            for b in 0..p {
                let term = inverse.at(p + i, b) * lane(self.side[i * p + b]);
                out[b] += term;
                out[p + i] += term;
            }
            for d in 0..stride.min(i + 1) {
                let term = inverse.band.at(i, i - d) * lane(self.gram[i * stride + d]);
                out[p + i] += term;
                if d > 0 {
                    out[p + i - d] += term;
                }
            }
        }
        out
    }

    /// Σ|r + Lc + Jδθ|² for the λ of all lanes.
    fn squares_at(&self, x: &[Lane]) -> Lane {
        let (p, stride) = (self.p, stride(self.m));
        let pulled = x.iter().zip(&self.pull).fold(Lane::ZERO, |sum, (x, pull)| x.mul_add(lane(*pull), sum));
        let mut form = Lane::ZERO;
        for a in 0..p {
            for b in 0..p {
                let prior = if a == b { self.priors[a] } else { 0.0 };
                form += x[a] * x[b] * lane(self.corner[a * p + b] + prior);
            }
        }
        for (i, own) in x[p..].iter().enumerate() {
            let mut sum = *own * lane(self.gram[i * stride]);
            for d in 1..stride.min(i + 1) {
                sum += x[p + i - d] * lane(2.0 * self.gram[i * stride + d]);
            }
            for b in 0..p {
                sum += x[b] * lane(2.0 * self.side[i * p + b]);
            }
            form = sum.mul_add(*own, form);
        }
        lane(self.squares) - lane(2.0) * pulled + form
    }

    /// The penalty, λ times the energy, of the factor `chosen` at changed coefficients.
    fn penalty_at(&self, chosen: usize, lam: Lane, x: &[Lane]) -> Lane {
        let (own, first, dim) = (self.factors[chosen], self.first[chosen], self.factors[chosen].dim());
        let (x, rows) = (&x[self.p..], &self.linearized.accelerations);
        let jacobi = self.jacobi[chosen].as_ref();
        let turned = |at: (usize, usize), c: usize| {
            jacobi.map_or(Lane::ZERO, |jacobi| jacobi.of_lanes(&self.linearized, at, x, c, (first, self.m)))
        };
        let bend = |at: (usize, usize), c: usize| {
            let i = at.1;
            lane(own.accelerations[i * dim + c]) + rows[i].of_lanes(x, self.m, first + c) + turned(at, c)
        };
        let differ = jacobi.is_some_and(JacobiOperator::differs);
        let energy = |c: usize| self.linearized.energy(differ, |at| bend(at, c));
        lam * (0..dim).fold(Lane::ZERO, |sum, c| sum + energy(c))
    }

    fn look(&self, chosen: usize, lams: &[Lane]) -> Look {
        let factors = self.factored(lams);
        let mut x = self.right(lams);
        factors.solve(1, &mut x);
        let freedom = self.freedoms(&factors.inverse()).into_iter().fold(Lane::ZERO, |sum, x| sum + x);
        let energy = self.penalty_at(chosen, lams[chosen], &x);
        Look {
            freedom,
            rss: self.squares_at(&x),
            energy,
            sound: factors.least_pivot().simd_gt(Lane::ZERO) & freedom.simd_gt(lane(0.9 * self.null())),
            log_det: factors.log_det(),
        }
    }

    /// Degrees of freedom without energy: of all coordinates, and parameters.
    fn null(&self) -> f64 {
        self.linearized.null() * self.m as f64 + self.p as f64
    }

    /// Solves the problem. λ that are None are chosen by the criterion, one factor after another, near the guesses if
    /// there are any; all of them are in the unit of the times.
    pub fn solve(&self, given: &[Option<f64>], guesses: &[Option<f64>], criterion: Criterion) -> Estimate {
        /// The number of times that each λ is chosen while there is no guess, if the factors depend on each other.
        const SWEEPS: usize = 2;
        let unit = self.linearized.penalised.unit(self.linearized.basis.spacing);
        let mut lams: Vec<(f64, bool)> = (0..self.factors.len())
            .map(|f| {
                let known = given[f].or(guesses[f]).map_or_else(|| self.balance(f), |lam| lam / unit);
                (known.min(self.most(f)), false)
            })
            .collect();
        let sweeps = if self.factors.len() > 1 && guesses.contains(&None) { SWEEPS } else { 1 };
        for sweep in 0..sweeps {
            for f in (0..self.factors.len()).filter(|&f| given[f].is_none()) {
                checkpoint();
                let dim = self.factors[f].dim() as f64;
                let scoring = Scoring {
                    criterion,
                    count: self.count as f64,
                    coordinates: 1.0,
                    free: self.linearized.free() as f64 * dim,
                    null: self.null(),
                    energies: self.linearized.null() * dim,
                    straight: self.straight(f, &lams),
                    balance: self.balance(f),
                    most: self.most(f),
                    sigma: 1.0,
                };
                let at = |lam: Lane| {
                    let mut all: Vec<Lane> = lams.iter().map(|(lam, _)| lane(*lam)).collect();
                    all[f] = lam;
                    self.look(f, &all)
                };
                let near = (sweep > 0).then_some(lams[f].0).or(guesses[f].map(|lam| lam / unit));
                let chosen = choose(&self.linearized, &scoring, at, near);
                lams[f] = chosen;
            }
        }
        let lanes: Vec<Lane> = lams.iter().map(|(lam, _)| lane(*lam)).collect();
        let factors = self.factored(&lanes);
        let mut x = self.right(&lanes);
        factors.solve(1, &mut x);
        let first = |x: Lane| x.as_array()[0];
        let inverse = factors.inverse();
        let freedoms: Vec<f64> = self.freedoms(&inverse).into_iter().map(first).collect();
        let mut of_factors = vec![0.0; self.factors.len()];
        for (i, freedom) in freedoms[self.p..].iter().enumerate() {
            let f = self.factor_of(i % self.m);
            of_factors[f] += freedom / self.factors[f].dim() as f64;
        }
        let numbers: Vec<f64> = x.into_iter().map(first).collect();
        let (parameters, coefficients) = numbers.split_at(self.p);
        let values = &self.linearized.values;
        let mut step = vec![0.0; values.len() * self.m];
        values.iter().zip(step.chunks_exact_mut(self.m)).for_each(|(row, x)| row.apply(coefficients, x));
        let variance = |at: usize| {
            let (row, c) = (values[at / self.m], at % self.m);
            let entry = |a: usize, b: usize| {
                let (i, j) = ((row.first + a) * self.m + c, (row.first + b) * self.m + c);
                row.factors[a] * row.factors[b] * first(inverse.band.at(i, j))
            };
            let count = values.len().min(4);
            (0..count).flat_map(|a| (0..count).map(move |b| (a, b))).map(|(a, b)| entry(a, b)).sum()
        };
        Estimate {
            lams: lams.into_iter().map(|(lam, bound)| (lam * unit, bound)).collect(),
            parameters: parameters.to_vec(),
            variances: [
                (0..step.len()).map(variance).collect(),
                (0..self.p).map(|a| first(inverse.at(a, a))).collect(),
            ],
            step,
            freedom: (of_factors, freedoms.iter().sum()),
            information: factors.schur().into_iter().map(first).collect(),
            determined: first(factors.band_pivot()) > 0.0,
        }
    }

    /// The largest λ of a factor, beyond which its curves have hardly any energy. The information about parameters is a
    /// small difference of large matrices, and rounding errors would exceed it for larger λ.
    fn most(&self, factor: usize) -> f64 {
        /// The share of the limit without parameters.
        const WITH_PARAMETERS: f64 = 1e-3;
        let most = self.balance(factor) * self.linearized.penalised.stiffest(self.linearized.basis.knots());
        if self.p > 0 { WITH_PARAMETERS * most } else { most }
    }

    /// The degrees of freedom below which λ of a factor hardly matters: those of the other factors, and of its curves
    /// without energy.
    fn straight(&self, chosen: usize, lams: &[(f64, bool)]) -> f64 {
        let mut lanes: Vec<Lane> = lams.iter().map(|(lam, _)| lane(*lam)).collect();
        lanes[chosen] = lane(self.most(chosen));
        let inverse = self.factored(&lanes).inverse();
        let freedom: f64 = self.freedoms(&inverse).into_iter().map(|x| x.as_array()[0]).sum();
        freedom + STRAIGHT * self.factors[chosen].dim() as f64
    }

    /// The sum of squared residuals and their number, including distances from prior means.
    pub fn residuals(&self) -> (f64, usize) {
        (self.squares, self.count)
    }

    /// A for given λ, in the unit of the times.
    pub fn matrices(&self, lams: &[f64]) -> Matrices {
        let unit = self.linearized.penalised.unit(self.linearized.basis.spacing);
        let lanes: Vec<Lane> = lams.iter().map(|lam| lane(lam / unit)).collect();
        let (band, side, corner) = self.matrix(&lanes);
        let first = |x: &Lane| x.as_array()[0];
        let rows = stride(self.m);
        let band =
            (0..self.gram.len())
                .map(|at| {
                    if at % rows <= at / rows {
                        first(&band.at(at / rows, at / rows - at % rows))
                    } else {
                        0.0
                    }
                })
                .collect();
        let corner = (0..self.p * self.p).map(|at| first(&corner.at(at / self.p, at % self.p))).collect();
        [band, side.iter().map(first).collect(), corner]
    }
}

/// Adds the matrix of the energy of a factor, whose coordinates begin at `first` of m.
fn add_penalty(
    linearized: &LinearProblem,
    dim: usize,
    first: usize,
    jacobi: Option<&JacobiOperator>,
    m: usize,
    out: &mut [f64],
) {
    let wide = stride(m);
    let own = jacobi.map_or(&linearized.penalty, |jacobi| &jacobi.penalty);
    let coupled = if jacobi.is_some() { dim } else { 1 };
    for (i, row) in own.chunks_exact(stride(coupled)).enumerate() {
        for (d, x) in row.iter().enumerate().filter(|(d, x)| *d <= i && **x != 0.0) {
            let j = i - d;
            // The same for every coordinate if they are not coupled.
            for c in 0..dim / coupled {
                let at = |k: usize| k / coupled * m + first + k % coupled + c;
                out[at(i) * wide + at(i) - at(j)] += x;
            }
        }
    }
}
