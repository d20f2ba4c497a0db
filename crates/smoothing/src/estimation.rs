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

use crate::adaptive::{Adaptive, Sums, Track};
use crate::banded::{Banded, stride};
use crate::bordered::{Bordered, Inverse};
use crate::choice::{Look, STRAIGHT, Scoring, Straight, choose};
use crate::elimination::eliminate;
use crate::jacobi_operator::JacobiOperator;
use crate::linearized::{Basis, LinearProblem, SegmentEnergy, Stencil};
use crate::path::Position;
use crate::problem::{Adapt, Criterion, EndConditions, Penalty, Profile};
use std::borrow::Cow;
use symspline_core::memory;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{Dual, Lane, Scalar, lane};
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
    /// λ of every segment divided by λ; empty for one λ.
    pub profile: &'a [f64],
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
    /// Half the gradients of the energies of all factors, one number per coefficient: of the curve, and of the quadratic
    /// function that approximates them. They agree up to the distance of the knots.
    stiffness: [Vec<f64>; 2],
    /// These energies.
    energies: Vec<f64>,
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
        // The matrices of measurements and energies, their sum, and its inverse.
        let entries = (size * stride(m)) as f64 + 3.0 * p as f64 * (size as f64 + p as f64);
        memory::require(
            5.0 * entries,
            "the linear system of the estimation",
            "Use fewer knots, or estimate fewer constants",
        );
        let first: Vec<usize> =
            (0..factors.len()).map(|f| factors[..f].iter().map(Factor::dim).sum()).collect();
        let mut penalty = vec![0.0; size * stride(m)];
        let mut stiffness = [(); 2].map(|_| vec![0.0; size]);
        let mut energies = Vec::with_capacity(factors.len());
        let one = &linearized;
        for (own, first) in factors.iter().zip(&first) {
            let dim = own.dim();
            let mut linearized = Cow::Borrowed(one);
            if !own.profile.is_empty() {
                linearized.to_mut().set_profile(own.profile);
            }
            let linearized = &*linearized;
            let jacobi = (own.space.curvature() != 0.0)
                .then(|| JacobiOperator::new(own.space, linearized, own.speeds, own.accelerations));
            let gradient = |jacobi: Option<&JacobiOperator>| match jacobi {
                Some(jacobi) => jacobi.pull(linearized, own.accelerations),
                None => linearized.stiffness(own.accelerations, &vec![0.0; own.accelerations.len()], dim),
            };
            // The gradient of the energy does not depend on the frame, but its matrix does.
            let moving = jacobi.clone().filter(|_| !own.halves.is_empty());
            let moving =
                moving.map(|jacobi| jacobi.in_moving_frame(linearized, own.accelerations, own.halves));
            let gradients = [gradient(jacobi.as_ref()), gradient(moving.as_ref().or(jacobi.as_ref()))];
            for (stiffness, gradient) in stiffness.iter_mut().zip(gradients) {
                for (row, own) in stiffness.chunks_exact_mut(m).zip(gradient.chunks_exact(dim)) {
                    row[*first..first + dim].copy_from_slice(own);
                }
            }
            let energy = |c: usize| linearized.energy(false, |at| lane(own.accelerations[at.1 * dim + c]));
            energies.push((0..dim).map(|c| energy(c).as_array()[0]).sum());
            let jacobi = moving.or(jacobi).map(|jacobi| jacobi.with_matrix(linearized));
            add_penalty(linearized, dim, *first, jacobi.as_ref(), m, &mut penalty);
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
            energies,
            penalty,
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

    /// The factor of each coordinate.
    fn factors_of_coordinates(&self) -> Vec<usize> {
        (0..self.m).map(|c| self.factor_of(c)).collect()
    }

    /// An entry of ΣJᵀJ with the priors.
    fn corner(&self, a: usize, b: usize) -> f64 {
        self.corner[a * self.p + b] + if a == b { self.priors[a] } else { 0.0 }
    }

    /// A for the λ of all factors, in units of the mean knot spacing: band, side and corner.
    fn matrix(&self, lams: &[f64]) -> (Banded<f64>, Banded<f64>) {
        let (m, stride, of) = (self.m, stride(self.m), self.factors_of_coordinates());
        let band = Banded::of(self.gram.len() / stride, stride - 1, |at| {
            lams[of[at / stride % m]].mul_add(self.penalty[at], self.gram[at])
        });
        let mut corner = Banded::zeros(self.p, self.p.saturating_sub(1));
        for a in 0..self.p {
            (0..=a).for_each(|b| *corner.entry(a, b) = self.corner(a, b));
        }
        (band, corner)
    }

    /// The right-hand side: parameters first.
    fn right(&self, lams: &[f64]) -> Vec<f64> {
        let (m, of, mut right) = (self.m, self.factors_of_coordinates(), self.pull.clone());
        let coefficients = right[self.p..].iter_mut().zip(&self.stiffness[0]).enumerate();
        coefficients.for_each(|(at, (x, stiffness))| *x -= lams[of[at % m]] * stiffness);
        right
    }

    /// A product of an entry of the inverse with ΣLᵀL, ΣLᵀJ or ΣJᵀJ, where priors are rows of J, summed over each row:
    /// parameters first.
    fn freedoms(&self, inverse: &Inverse<f64>) -> Vec<f64> {
        let (p, stride, size) = (self.p, stride(self.m), inverse.band.size);
        let mut out = vec![0.0; p + size];
        for a in 0..p {
            out[a] = (0..p).map(|b| inverse.at(a, b) * self.corner(a, b)).sum();
        }
        for i in 0..size {
            checkpoint();
            for b in 0..p {
                let term = inverse.at(p + i, b) * self.side[i * p + b];
                out[b] += term;
                out[p + i] += term;
            }
            for d in 0..stride.min(i + 1) {
                let term = inverse.band.at(i, i - d) * self.gram[i * stride + d];
                out[p + i] += term;
                if d > 0 {
                    out[p + i - d] += term;
                }
            }
        }
        out
    }

    /// The scores and their components for the λ of all lanes of the factor `chosen`.
    ///
    /// The measurements are multiplied by a number g = 1. The derivative of the minimum of the objective with respect
    /// to g is the sum of squared residuals, and that of ln det A is the number of degrees of freedom. Without
    /// derivatives, only the sum of residuals and penalties is known, as `rss`.
    fn look<S: Scalar>(&self, chosen: usize, lams: &[(f64, bool)], lam: Lane) -> Look {
        let (m, p, stride, border) = (self.m, self.p, stride(self.m), self.p + 2);
        let lams: Vec<Lane> =
            (0..lams.len()).map(|f| if f == chosen { lam } else { lane(lams[f].0) }).collect();
        let of: Vec<Lane> = self.factors_of_coordinates().into_iter().map(|f| lams[f]).collect();
        // Of measurements, and of the energies.
        let number = |seen: f64, energy: Lane| S::from_parts([energy + lane(seen), lane(seen), Lane::ZERO]);
        let mut corner = vec![S::constant(Lane::ZERO); border * border];
        for a in 0..p {
            (0..=a).for_each(|b| corner[a * border + b] = number(self.corner(a, b), Lane::ZERO));
            for row in p..border {
                corner[row * border + a] = number(self.pull[a], Lane::ZERO);
            }
        }
        let zero = S::constant(Lane::ZERO);
        let found = eliminate(self.stiffness[0].len(), stride - 1, corner, 2, |i, row| {
            let (lam, at) = (of[i % m], i * stride);
            let (band, side) = row.split_at_mut(stride);
            for (d, x) in band.iter_mut().rev().enumerate() {
                *x = if d <= i { number(self.gram[at + d], lam * lane(self.penalty[at + d])) } else { zero };
            }
            for (x, seen) in side.iter_mut().zip(&self.side[i * p..][..p]) {
                *x = number(*seen, Lane::ZERO);
            }
            for (x, stiffness) in side[p..].iter_mut().zip(self.stiffness.iter().rev()) {
                *x = number(self.pull[p + i], -lam * lane(stiffness[i]));
            }
        });
        // The objective c − 2b'ᵀx + xᵀAx at x = A⁻¹b.
        let energy = lams.iter().zip(&self.energies).fold(Lane::ZERO, |sum, (lam, x)| sum + *lam * lane(*x));
        let [_, crossed, own] = [0, 1, 2].map(|at| found.rest[at].parts());
        let whole = lane(self.squares) + energy + lane(2.0) * crossed[0] - own[0];
        let positive = found.least.simd_gt(Lane::ZERO);
        let [log_det, freedom, _] = found.log_det.parts();
        if S::ORDER == 0 {
            return Look {
                freedom: lane(f64::NAN),
                rss: whole,
                energy: Lane::ZERO,
                sound: positive,
                log_det,
            };
        }
        let rss = lane(self.squares) + own[1];
        let sound = positive & freedom.simd_gt(lane(0.9 * self.null()));
        Look { freedom, rss, energy: whole - rss, sound, log_det }
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
                    straight: Straight::Above(STRAIGHT * dim),
                    balance: self.balance(f),
                    most: self.most(f),
                    sigma: 1.0,
                };
                let look = |lam: Lane, freedom: bool| {
                    if freedom { self.look::<Dual>(f, &lams, lam) } else { self.look::<Lane>(f, &lams, lam) }
                };
                let near = (sweep > 0).then_some(lams[f].0).or(guesses[f].map(|lam| lam / unit));
                let chosen = choose(&self.linearized, &scoring, look, near);
                lams[f] = chosen;
            }
        }
        let numbers: Vec<f64> = lams.iter().map(|(lam, _)| *lam).collect();
        let (band, corner) = self.matrix(&numbers);
        let factors = Bordered::new(band, self.side.clone(), corner);
        let mut x = self.right(&numbers);
        factors.solve(1, &mut x);
        let inverse = factors.inverse();
        let freedoms = self.freedoms(&inverse);
        let mut of_factors = vec![0.0; self.factors.len()];
        for (i, freedom) in freedoms[self.p..].iter().enumerate() {
            let f = self.factor_of(i % self.m);
            of_factors[f] += freedom / self.factors[f].dim() as f64;
        }
        let (parameters, coefficients) = x.split_at(self.p);
        let values = &self.linearized.values;
        let mut step = vec![0.0; values.len() * self.m];
        values.iter().zip(step.chunks_exact_mut(self.m)).for_each(|(row, x)| row.apply(coefficients, x));
        let variance = |at: usize| {
            let (row, c) = (values[at / self.m], at % self.m);
            let entry = |a: usize, b: usize| {
                let (i, j) = ((row.first + a) * self.m + c, (row.first + b) * self.m + c);
                row.factors[a] * row.factors[b] * inverse.band.at(i, j)
            };
            let count = values.len().min(4);
            (0..count).flat_map(|a| (0..count).map(move |b| (a, b))).map(|(a, b)| entry(a, b)).sum()
        };
        Estimate {
            lams: lams.into_iter().map(|(lam, bound)| (lam * unit, bound)).collect(),
            parameters: parameters.to_vec(),
            variances: [
                (0..step.len()).map(variance).collect(),
                (0..self.p).map(|a| inverse.at(a, a)).collect(),
            ],
            step,
            freedom: (of_factors, freedoms.iter().sum()),
            information: factors.schur(),
            determined: factors.band_pivot() > 0.0,
        }
    }

    /// How λ of a factor varies, given the λ of all factors in the unit of the times, and the positions at which it is
    /// measured.
    pub fn profile(&self, factor: usize, lams: &[f64], measured: &[Position]) -> Profile {
        let basis = &self.linearized.basis;
        let unit = self.linearized.penalised.unit(basis.spacing);
        let lams: Vec<f64> = lams.iter().map(|lam| lam / unit).collect();
        let segments = basis.knots() - 1;
        // In place of the data, whose number is not that of their coordinates, the knots have the degrees of freedom.
        let positions: Vec<Position> =
            (0..=segments).map(|i| if i < segments { (i, 0.0) } else { (i - 1, 1.0) }).collect();
        Adaptive {
            basis,
            penalised: self.linearized.penalised,
            m: self.factors[factor].dim(),
            left: None,
            process: self.linearized.free() as f64 - self.linearized.null(),
            positions: &positions,
            weights: &vec![self.balance(factor); positions.len()],
            deviations: &[],
            measured,
            lam: &vec![lams[factor]; segments],
            stiffest: self.most(factor),
            given: false,
            sums: &|tracks: &[Track]| tracks.iter().map(|track| self.sums(factor, &lams, track)).collect(),
        }
        .profile(Adapt { lam: true, noise: false })
    }

    /// The solution of the linear problem with another λ on every segment of a factor, whose curvature is neglected.
    fn sums(&self, factor: usize, lams: &[f64], track: &Track) -> Sums {
        let (m, p, linearized) = (self.m, self.p, &self.linearized);
        let (first, own) = (self.first[factor], &self.factors[factor]);
        let (dim, basis, penalised) = (own.dim(), &linearized.basis, linearized.penalised);
        let (count, segments) = (basis.count(), basis.knots() - 1);
        let wide = count.min(4);
        let others: Vec<f64> = (0..lams.len()).map(|f| if f == factor { 0.0 } else { lams[f] }).collect();
        let (mut band, corner) = self.matrix(&others);
        let mut right = self.right(&others);
        let energies: Vec<SegmentEnergy> =
            (0..segments).map(|i| SegmentEnergy::new(basis, penalised, i)).collect();
        let bends = |i: usize, c: usize| [i, i + 1].map(|knot| own.accelerations[knot * dim + c]);
        let mut before = 0.0;
        for (i, (energy, lam)) in energies.iter().zip(&track.lams).enumerate() {
            for c in 0..dim {
                for a in 0..wide {
                    let row = (energy.first() + a) * m + first + c;
                    for b in 0..=a {
                        *band.entry(row, row - (a - b) * m) += lam * energy.entry(a, b);
                    }
                    right[p + row] -= lam * energy.pull(a, bends(i, c));
                }
                before += lam * energy.value(bends(i, c));
            }
        }
        let factors = Bordered::new(band, self.side.clone(), corner);
        let mut x = right.clone();
        factors.solve(1, &mut x);
        let inverse = factors.inverse();
        let fixed: f64 = others.iter().zip(&self.energies).map(|(lam, energy)| lam * energy).sum();
        let gained: f64 = right.iter().zip(&x).map(|(b, x)| b * x).sum();
        let process = (linearized.free() as f64 - linearized.null()) / segments as f64;
        let moved = |row: &Stencil, c: usize| -> f64 {
            (0..wide).map(|a| row.factors[a] * x[p + (row.first + a) * m + first + c]).sum()
        };
        let value = |(i, energy): (usize, &SegmentEnergy)| -> f64 {
            let bend = |c: usize, e: usize| bends(i, c)[e] + moved(&energy.ends[e], c);
            (0..dim).map(|c| track.lams[i] * energy.value([bend(c, 0), bend(c, 1)])).sum()
        };
        let freedom_of = |(i, energy): (usize, &SegmentEnergy)| {
            let trace = |c: usize| {
                let at = |a: usize| a * m + first + c;
                energy.trace(count, |a, b| inverse.band.at(at(a), at(b)))
            };
            process - track.lams[i] * (0..dim).map(trace).sum::<f64>() / dim as f64
        };
        let freedom = self.freedoms(&inverse);
        let of_knot = |i: usize| freedom[p + i * m + first..][..dim].iter().sum::<f64>() / dim as f64;
        Sums {
            energies: energies.iter().enumerate().map(value).collect(),
            freedoms: energies.iter().enumerate().map(freedom_of).collect(),
            squares: Vec::new(),
            leverages: (0..count).map(of_knot).collect(),
            whole: self.squares + fixed + before - gained,
            log_det: factors.log_det() / dim as f64,
            sound: factors.least_pivot() > 0.0,
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

    /// The sum of squared residuals and their number, including distances from prior means.
    pub fn residuals(&self) -> (f64, usize) {
        (self.squares, self.count)
    }

    /// A for given λ, in the unit of the times.
    pub fn matrices(&self, lams: &[f64]) -> Matrices {
        let unit = self.linearized.penalised.unit(self.linearized.basis.spacing);
        let lams: Vec<f64> = lams.iter().map(|lam| lam / unit).collect();
        let (band, corner) = self.matrix(&lams);
        let rows = stride(self.m);
        let entry =
            |at: usize| if at % rows <= at / rows { band.at(at / rows, at / rows - at % rows) } else { 0.0 };
        let band = (0..self.gram.len()).map(entry).collect();
        let corner = (0..self.p * self.p).map(|at| corner.at(at / self.p, at % self.p)).collect();
        [band, self.side.clone(), corner]
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
