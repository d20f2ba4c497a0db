//! The linear smoothing problem of scalar splines: natural cubic B-splines, their values at data and knots, and their
//! energy.
//!
//! A spline with coefficients c has the values Bc at the data, Pc at the knots and second derivatives Sc there. Its
//! energy is cᵀΩc with Ω = SᵀMS. For ∫ x''², M is the mass matrix of hat functions; for ∫ x'''², it is their stiffness
//! matrix, because the third derivative is a difference of second derivatives. Times are divided by the mean knot
//! spacing.

use crate::banded::{Banded, Number, WIDTH};
use crate::problem::{EndCondition, EndConditions, Penalty};
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{Lane, lane};

const BAND: usize = WIDTH + 1;
/// The number of coefficients of a closed curve that are repeated after the last one.
pub const OVERLAP: usize = 3;

/// A row of B, P or S: four consecutive entries.
#[derive(Clone, Copy, Default)]
pub struct Stencil {
    /// The index of the first coefficient.
    pub first: usize,
    /// The factors of this coefficient and of the next ones.
    pub factors: [f64; 4],
}

impl Stencil {
    /// Adds the product of the row with coefficients of `m` numbers each to `out`.
    pub fn apply(&self, c: &[f64], out: &mut [f64]) {
        let m = out.len();
        for (factor, c) in self.factors.iter().zip(c[self.first * m..].chunks_exact(m)) {
            out.iter_mut().zip(c).for_each(|(out, c)| *out = factor.mul_add(*c, *out));
        }
    }

    /// Adds the product of the transposed row with x to coefficients.
    pub fn spread(&self, x: &[f64], c: &mut [f64]) {
        let m = x.len();
        for (factor, c) in self.factors.iter().zip(c[self.first * m..].chunks_exact_mut(m)) {
            c.iter_mut().zip(x).for_each(|(c, x)| *c = factor.mul_add(*x, *c));
        }
    }

    /// One number of the product of the row with coefficients of `m` numbers each.
    pub fn of_lanes(&self, x: &[Lane], m: usize, c: usize) -> Lane {
        let mut sum = Lane::ZERO;
        for (k, factor) in self.factors.iter().enumerate() {
            if let Some(x) = x.get((self.first + k) * m + c) {
                sum = x.mul_add(lane(*factor), sum);
            }
        }
        sum
    }

    /// row · Z · rowᵀ for a matrix of which the band is known.
    pub fn square<T: Number>(&self, z: &Banded<T>) -> T {
        let mut sum = T::ZERO;
        let count = 4.min(z.size);
        for a in 0..count {
            for b in 0..count {
                let factor = self.factors[a] * self.factors[b];
                if factor != 0.0 {
                    sum += z.at(self.first + a, self.first + b) * T::of(factor);
                }
            }
        }
        sum
    }
}

/// The splines on given knots.
#[derive(Clone)]
pub struct Basis {
    /// Knots, divided by their mean spacing.
    tau: Vec<f64>,
    /// The mean knot spacing.
    pub spacing: f64,
    /// The end conditions.
    pub ends: EndConditions,
}

impl Basis {
    /// Requires at least two increasing knots.
    pub fn new(knots: &[f64], ends: EndConditions) -> Self {
        let last = knots.len() - 1;
        let spacing = (knots[last] - knots[0]) / last as f64;
        Basis { tau: knots.iter().map(|t| (t - knots[0]) / spacing).collect(), spacing, ends }
    }

    /// Number of knots.
    pub fn knots(&self) -> usize {
        self.tau.len()
    }

    /// Number of coefficients, which equals the number of knots. In a closed curve the first [`OVERLAP`] are repeated
    /// at the end.
    pub fn count(&self) -> usize {
        self.tau.len() + if self.is_closed() { OVERLAP - 1 } else { 0 }
    }

    /// Whether the last knot equals the first.
    pub fn is_closed(&self) -> bool {
        self.ends == EndConditions::Periodic
    }

    /// Whether the second derivative vanishes at an end.
    pub fn is_natural(&self, end: usize) -> bool {
        matches!(self.ends, EndConditions::Open(ends) if ends[end] == EndCondition::Natural)
    }

    /// Whether the velocity at an end is given.
    pub fn has_velocity(&self, end: usize) -> bool {
        matches!(self.ends, EndConditions::Open(ends) if ends[end] == EndCondition::Velocity)
    }

    /// Length of a segment, divided by the mean.
    pub fn h(&self, segment: usize) -> f64 {
        self.tau[segment + 1] - self.tau[segment]
    }

    /// The length of a short segment (few segments are shorter), divided by the mean.
    pub fn short(&self) -> f64 {
        let mut lengths: Vec<f64> = self.tau.windows(2).map(|t| t[1] - t[0]).collect();
        lengths.sort_by(f64::total_cmp);
        lengths[lengths.len() / 10]
    }

    /// The knots, with three more copies of the first and the last one: the support of the i-th B-spline begins at
    /// the i-th. The knots of a closed curve continue periodically.
    fn extended(&self, i: usize) -> f64 {
        let last = self.tau.len() - 1;
        if self.is_closed() {
            let (turn, at) = ((i + last * 3 - 3) / last, (i + last * 3 - 3) % last);
            return self.tau[at] + (turn as f64 - 3.0) * self.tau[last];
        }
        self.tau[i.saturating_sub(3).min(last)]
    }

    /// Value (`nu` = 0) or derivative of a spline at a position between 0 and 1 in a segment.
    pub fn row(&self, segment: usize, position: f64, nu: usize) -> Stencil {
        self.folded(segment, self.unfolded(segment, position, nu))
    }

    /// The same for the four B-splines that do not vanish on the segment, before end conditions are applied.
    fn unfolded(&self, segment: usize, position: f64, nu: usize) -> [f64; 4] {
        let t = |k: usize| self.extended(segment + k);
        let x = t(3) + position * (t(4) - t(3));
        // B-splines of increasing degree that do not vanish on the segment: the j-th begins at t(3 − degree + j).
        let mut b = [1.0, 0.0, 0.0, 0.0];
        for degree in 1..=3 - nu {
            let mut next = [0.0; 4];
            for j in 0..degree {
                let (from, to) = (t(4 - degree + j), t(4 + j));
                let part = b[j] / (to - from);
                next[j] += (to - x) * part;
                next[j + 1] += (x - from) * part;
            }
            b = next;
        }
        // Derivatives: B'_j = degree (b_j/(…) − b_{j+1}/(…)).
        for degree in 4 - nu..=3 {
            let mut next = [0.0; 4];
            for j in 0..degree {
                let part = degree as f64 * b[j] / (t(4 + j) - t(4 - degree + j));
                next[j] -= part;
                next[j + 1] += part;
            }
            b = next;
        }
        b
    }

    /// Eliminates the outermost coefficients, which the end conditions determine.
    fn folded(&self, segment: usize, factors: [f64; 4]) -> Stencil {
        let n = self.tau.len() - 1;
        if self.is_closed() {
            return Stencil { first: segment, factors };
        }
        // Coefficients 1 to n + 1 are kept, and numbered from zero.
        let first = segment.saturating_sub(1).min((n + 1).saturating_sub(4));
        let mut row = Stencil { first, factors: [0.0; 4] };
        for (j, factor) in factors.into_iter().enumerate() {
            let full = segment + j;
            if full == 0 || full == n + 2 {
                let end = usize::from(full > 0);
                for (k, weight) in self.outermost(end).into_iter().enumerate().filter(|(_, w)| *w != 0.0) {
                    let kept = if end == 0 { k } else { n - k };
                    row.factors[kept - first] += factor * weight;
                }
            } else {
                row.factors[full - 1 - first] += factor;
            }
        }
        row
    }

    /// The outermost coefficient as a combination of the next four. A given velocity adds a constant, which does not
    /// enter changes.
    fn outermost(&self, end: usize) -> [f64; 4] {
        let n = self.tau.len() - 1;
        match self.ends {
            EndConditions::Open(ends) if ends[end] == EndCondition::Natural => {
                let (h, next) = if end == 0 { (0, 1) } else { (n - 1, n.saturating_sub(2)) };
                let both = self.h(h) + if n > 1 { self.h(next) } else { 0.0 };
                let ratio = self.h(h) / both;
                [1.0 + ratio, -ratio, 0.0, 0.0]
            }
            // The third derivative is the same on the last two segments.
            EndConditions::Open(ends) if ends[end] == EndCondition::NotAKnot => {
                let segments = if end == 0 { [0, 1] } else { [n - 1, n - 2] };
                let [mut far, mut near] = segments.map(|segment| self.unfolded(segment, 0.0, 3));
                if end == 1 {
                    far.reverse();
                    near.reverse();
                }
                let other = |k: usize| far.get(k + 1).copied().unwrap_or(0.0);
                std::array::from_fn(|k| (near[k] - other(k)) / far[0])
            }
            _ => [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// A derivative at every knot.
    pub fn at_knots(&self, nu: usize) -> Vec<Stencil> {
        let n = self.tau.len() - 1;
        (0..=n).map(|i| if i < n { self.row(i, 0.0, nu) } else { self.row(n - 1, 1.0, nu) }).collect()
    }
}

/// The entries of M that belong to a segment of length h: on the diagonal and beside it. `∫ a b` of functions that are
/// linear between knots, or `∫ a' b'`.
pub fn of_segment(penalty: Penalty, h: f64) -> (f64, f64) {
    match penalty {
        Penalty::Acceleration => (h / 3.0, h / 6.0),
        Penalty::Jerk => (1.0 / h, -1.0 / h),
    }
}

/// The energy of one segment with λ one: a quadratic function of the second derivatives at its ends, which depend on the
/// same four coefficients.
pub struct SegmentEnergy {
    /// Second derivatives at both ends.
    pub ends: [Stencil; 2],
    /// The entries of M: see [`of_segment`].
    metric: (f64, f64),
}

impl SegmentEnergy {
    /// For a segment.
    pub fn new(basis: &Basis, penalised: Penalty, segment: usize) -> Self {
        let ends = [0.0, 1.0].map(|position| basis.row(segment, position, 2));
        SegmentEnergy { ends, metric: of_segment(penalised, basis.h(segment)) }
    }

    /// The index of the first coefficient.
    pub fn first(&self) -> usize {
        self.ends[0].first
    }

    /// The entry of the matrix of the energy for two of the four coefficients.
    pub fn entry(&self, a: usize, b: usize) -> f64 {
        let ([l, r], (own, other)) = (&self.ends, self.metric);
        own * (l.factors[a] * l.factors[b] + r.factors[a] * r.factors[b])
            + other * (l.factors[a] * r.factors[b] + r.factors[a] * l.factors[b])
    }

    /// Half the derivative of the energy by a coefficient, for the second derivatives at both ends.
    pub fn pull(&self, a: usize, [left, right]: [f64; 2]) -> f64 {
        let ([l, r], (own, other)) = (&self.ends, self.metric);
        l.factors[a] * (own * left + other * right) + r.factors[a] * (other * left + own * right)
    }

    /// The energy for the second derivatives at both ends.
    pub fn value<T: Number>(&self, [left, right]: [T; 2]) -> T {
        let (own, other) = self.metric;
        (left * left + right * right) * T::of(own) + left * right * T::of(2.0 * other)
    }

    /// The trace of the matrix of the energy times a symmetric matrix, whose entries of four coefficients are given.
    pub fn trace<T: Number>(&self, count: usize, entry: impl Fn(usize, usize) -> T) -> T {
        let mut sum = T::ZERO;
        for a in 0..count.min(4) {
            for b in 0..=a {
                let twice = if a == b { 1.0 } else { 2.0 };
                sum += entry(self.first() + a, self.first() + b) * T::of(twice * self.entry(a, b));
            }
        }
        sum
    }
}

/// Σ factor · rowᵀ row, as the entries (i, i − d) at i · 4 + d.
fn gram(count: usize, rows: impl Iterator<Item = (Stencil, Stencil, f64)>) -> Vec<f64> {
    let mut out = vec![0.0; count * BAND];
    for (left, right, factor) in rows {
        checkpoint();
        for (a, x) in left.factors.iter().enumerate() {
            for (b, y) in right.factors.iter().enumerate() {
                let (i, j) = (left.first + a, right.first + b);
                let value = factor * x * y;
                // Products outside the band are zero, or NaN if 1/h overflows.
                if i >= j && i < count.min(j + BAND) && value != 0.0 {
                    out[i * BAND + i - j] += value;
                }
            }
        }
    }
    out
}

/// The linearised smoothing problem: the same linear problem for every coordinate.
#[derive(Clone)]
pub struct LinearProblem {
    /// The splines.
    pub basis: Basis,
    /// B: values at the data.
    pub data: Vec<Stencil>,
    /// P: values at the knots.
    pub values: Vec<Stencil>,
    /// S: second derivatives at the knots.
    pub accelerations: Vec<Stencil>,
    /// BᵀWB for scalar weights, as the entries (i, i − d) at i · 4 + d.
    pub gram: Vec<f64>,
    /// Ω, likewise.
    pub penalty: Vec<f64>,
    /// The derivative whose square Ω integrates.
    pub penalised: Penalty,
    /// λ of each segment, divided by λ. M contains these factors, and with it the energy.
    pub profile: Vec<f64>,
}

impl LinearProblem {
    /// The problem for data at positions in segments, with their weights.
    pub fn new(basis: Basis, positions: &[(usize, f64)], weights: &[f64], penalised: Penalty) -> Self {
        let count = basis.count();
        let data: Vec<Stencil> =
            positions.iter().map(|&(segment, position)| basis.row(segment, position, 0)).collect();
        let (values, accelerations) = (basis.at_knots(0), basis.at_knots(2));
        let profile = vec![1.0; basis.knots() - 1];
        let [gram, penalty] = [Vec::new(), Vec::new()];
        let mut linearized =
            LinearProblem { data, values, accelerations, gram, penalty, penalised, profile, basis };
        linearized.gram = linearized.gram_of(weights);
        linearized.penalty = linearized.energy_matrix(count);
        linearized
    }

    /// Sets λ of each segment, divided by λ.
    pub fn set_profile(&mut self, profile: &[f64]) {
        self.profile.copy_from_slice(profile);
        self.penalty = self.energy_matrix(self.basis.count());
    }

    fn energy_matrix(&self, count: usize) -> Vec<f64> {
        let hats = (0..self.profile.len()).flat_map(|i| {
            let (l, r) = (self.accelerations[i], self.accelerations[i + 1]);
            let (own, other) = self.of_segment(i);
            [(l, l, own), (r, r, own), (l, r, other), (r, l, other)]
        });
        gram(count, hats)
    }

    /// The entries of M that belong to a segment: on the diagonal and beside it.
    pub fn of_segment(&self, i: usize) -> (f64, f64) {
        let (own, other) = of_segment(self.penalised, self.basis.h(i));
        (self.profile[i] * own, self.profile[i] * other)
    }

    /// The product of M with vectors at the knots.
    pub fn times_metric(&self, a: &[f64], m: usize) -> Vec<f64> {
        let mut out = vec![0.0; a.len()];
        for i in 0..self.profile.len() {
            let (own, other) = self.of_segment(i);
            for c in 0..m {
                let (left, right) = (a[i * m + c], a[(i + 1) * m + c]);
                out[i * m + c] += own * left + other * right;
                out[(i + 1) * m + c] += other * left + own * right;
            }
        }
        out
    }

    /// BᵀWB for other weights.
    pub fn gram_of(&self, weights: &[f64]) -> Vec<f64> {
        gram(self.basis.count(), self.data.iter().zip(weights).map(|(row, w)| (*row, *row, *w)))
    }

    /// Half the gradient of the energy with respect to the coefficients, for accelerations a at the knots:
    /// SᵀMa + Pᵀg, with the contribution g of curvature.
    pub fn stiffness(&self, accelerations: &[f64], curvature: &[f64], m: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.basis.count() * m];
        let metric = self.times_metric(accelerations, m);
        for (rows, vectors) in [(&self.accelerations, &metric[..]), (&self.values, curvature)] {
            rows.iter().zip(vectors.chunks_exact(m)).for_each(|(row, x)| row.spread(x, &mut out));
        }
        out
    }

    /// The energy aᵀMa of one coordinate, given its acceleration at the first (0) or last (1) end of a segment, which is
    /// a knot. If `differ` is false, both are the same.
    pub fn energy(&self, differ: bool, acceleration: impl Fn((usize, usize)) -> Lane) -> Lane {
        let mut energy = Lane::ZERO;
        let mut left = acceleration((0, 0));
        for i in 0..self.basis.knots() - 1 {
            checkpoint();
            let right = acceleration((1, i + 1));
            let (own, other) = self.of_segment(i);
            energy += (left * left + right * right) * lane(own) + left * right * lane(2.0 * other);
            left = if differ { acceleration((0, i + 1)) } else { right };
        }
        energy
    }

    /// Degrees of freedom of the curves without energy: straight lines, and parabolas if the jerk is penalised. Given
    /// velocities and closed ends reduce them to constants.
    pub fn null(&self) -> f64 {
        let constant = self.basis.is_closed() || self.basis.has_velocity(0) || self.basis.has_velocity(1);
        match self.penalised {
            _ if constant => 1.0,
            Penalty::Acceleration => 2.0,
            Penalty::Jerk => 3.0,
        }
    }

    /// The number of coefficients without repetitions.
    pub fn free(&self) -> usize {
        self.basis.count() - if self.basis.is_closed() { OVERLAP } else { 0 }
    }

    /// The λ at which data and energy have about the same weight for splines that change direction at every knot: the
    /// mean weight of a coefficient divided by that of Ω on equal knots.
    pub fn balance(&self) -> f64 {
        self.gram.chunks(BAND).map(|row| row[0]).sum::<f64>()
            / (self.penalised.stiffness() * self.basis.count() as f64)
    }
}
