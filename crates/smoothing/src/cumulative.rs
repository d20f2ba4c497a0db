//! Least squares with cumulative B-splines on Lie groups, by Gauss and Newton.
//!
//! The control points move as p ← p exp(δ), and the residual of a datum y is `r = log(γ⁻¹y)`. With `φ(z) = (eᶻ − 1)/z`
//! and ad of ω in coordinates of the Lie algebra, the right Jacobian of exp is `φ(−ad ω)`, so that
//!
//! ```text
//! δω_j = φ(−ad ω_j)⁻¹ (δ_j − e^{−ad ω_j} δ_{j−1}),
//! δγ   = Ad(A_1 ⋯ A_d)⁻¹ δ₀ + Σ_j Ad(A_{j+1} ⋯ A_d)⁻¹ λ_j φ(−λ_j ad ω_j) δω_j,   A_j = exp(λ_j ω_j),
//! δr   = −φ(ad r)⁻¹ δγ
//! ```
//!
//! (Sommer, Usenko, Schubert, Demmel & Cremers 2020, section 4). In a vector space ad is zero, and the problem is linear.

use crate::banded::Banded;
use symspline_core::curve::{
    BSpline, Coordinates, Multiplication, Quantity, cumulative_basis, cumulative_steps, evaluate_bspline,
};
use symspline_core::matrix::{Matrix, inverse};
use symspline_core::monitor::{Monitor, checkpoint};
use symspline_core::scalar::{LANES, Lane, few, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased, Origin};

type Square = Matrix<Lane, 1>;

/// Noisy points of one curve.
pub struct CumulativeData<'a> {
    /// Knots of the curve, as for [`BSpline`].
    pub knots: &'a [f64],
    /// Degree of the curve.
    pub degree: usize,
    /// Non-decreasing times in the domain of the curve.
    pub t: &'a [f64],
    /// Points.
    pub points: &'a [f64],
    /// Weights, not negative.
    pub weights: &'a [f64],
}

/// The result of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Whether the last step was below the tolerance.
    pub converged: bool,
    /// Number of Gauss–Newton steps.
    pub iterations: usize,
    /// The largest coordinate of the last step, relative to the longest step between control points.
    pub step: f64,
    /// The weighted sum of squared distances.
    pub cost: f64,
}

/// Steps between neighbouring control points, and residuals.
struct State {
    control: Vec<f64>,
    /// Coordinates of ω.
    steps: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
}

/// Smallest fraction of a step that the line search tries, as a power of ½.
const HALVINGS: i32 = 12;

impl CumulativeData<'_> {
    fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// The first control point that the data do not determine, by the condition of Schoenberg and Whitney: there are
    /// increasing times of data of which the j-th lies in the support of the j-th basis function.
    pub fn undetermined(&self) -> Option<usize> {
        let (knots, degree) = (self.knots, self.degree);
        let (mut i, mut last) = (0, f64::NEG_INFINITY);
        for j in 0..self.count() {
            let (start, end) = (knots[j], knots[j + degree + 1]);
            // The support of a basis function includes its end if all other knots are there.
            let after = |t: f64| t > start || (t == start && knots[j + degree] == start);
            let before = |t: f64| t < end || (t == end && knots[j + 1] == end);
            while i < self.t.len() && !(self.weights[i] > 0.0 && self.t[i] > last && after(self.t[i])) {
                i += 1;
            }
            if i == self.t.len() || !before(self.t[i]) {
                return Some(j);
            }
            last = self.t[i];
        }
        None
    }

    /// Control points equal to the data nearest to the means of `degree` knots (Greville's abscissae).
    pub fn start(&self, len: usize) -> Vec<f64> {
        let mut control = Vec::with_capacity(self.count() * len);
        let good: Vec<usize> = (0..self.t.len()).filter(|&i| self.weights[i] > 0.0).collect();
        for m in 0..self.count() {
            let knots = &self.knots[m + 1..=m + self.degree];
            let site = knots.iter().map(|t| t / self.degree as f64).sum::<f64>();
            let k = good.partition_point(|&i| self.t[i] < site);
            let near = good[k.saturating_sub(1)..(k + 1).min(good.len())].iter();
            let best = near.min_by(|&&a, &&b| (self.t[a] - site).abs().total_cmp(&(self.t[b] - site).abs()));
            let best = best.copied().unwrap_or(0);
            control.extend_from_slice(&self.points[best * len..][..len]);
        }
        control
    }
}

/// Fits one curve. An error is the first pair of neighbouring control points of the start beyond the cut locus.
pub fn fit_cumulative(
    space: &Erased,
    samples: &CumulativeData,
    tol: f64,
    max_iter: usize,
    monitor: &Monitor,
) -> Result<(Vec<f64>, Outcome), usize> {
    let problem = Problem::new(space, samples, monitor);
    let mut state = problem.state(samples.start(space.point_len()))?;
    let mut outcome = Outcome { converged: false, iterations: 0, step: f64::INFINITY, cost: state.cost };
    while outcome.iterations < max_iter && !outcome.converged && !monitor.poll() {
        let (delta, decrease) = problem.step(&state);
        let largest = |x: &[f64]| x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let (size, unit) = (largest(&delta), largest(&state.steps));
        outcome.step = if size == 0.0 { 0.0 } else { size / unit };
        outcome.iterations += 1;
        let near = size <= tol * unit + 64.0 * f64::EPSILON * largest(&state.control);
        let next = (0..=HALVINGS).find_map(|k| {
            let moved = problem.moved(&state, &delta, 0.5_f64.powi(k));
            problem.state(moved).ok().filter(|next| next.cost < state.cost)
        });
        // Near the minimum, rounding errors of the sum of squares are larger than its decrease.
        outcome.converged = near || (next.is_none() && decrease <= 1e-10 * state.cost);
        match next {
            Some(next) => state = next,
            None => break,
        }
        outcome.cost = state.cost;
    }
    Ok((state.control, outcome))
}

struct Problem<'a> {
    space: &'a Erased<'a>,
    samples: &'a CumulativeData<'a>,
    monitor: &'a Monitor<'a>,
    group: Multiplication,
    coordinates: Coordinates,
    /// The bracket of basis elements a and b has coordinate c of this value: (a, b, c, value).
    brackets: Vec<(usize, usize, usize, f64)>,
    /// Intervals of the data.
    intervals: Vec<usize>,
    /// Coordinates that the normal equations couple, and independent columns of them: in vector spaces each coordinate
    /// has the same equations.
    coupled: usize,
    columns: usize,
}

impl<'a> Problem<'a> {
    fn new(space: &'a Erased<'a>, samples: &'a CumulativeData<'a>, monitor: &'a Monitor<'a>) -> Self {
        let (group, coordinates, dim) = (Multiplication::of(space), Coordinates::new(space), space.dim());
        let flat = group == Multiplication::Sum;
        let brackets = if flat { Vec::new() } else { brackets(space, group, &coordinates) };
        let curve = BSpline { knots: samples.knots, control: &[], degree: samples.degree, steps: &[] };
        let intervals = samples.t.iter().map(|&t| curve.interval(t)).collect();
        let (coupled, columns) = if flat { (1, dim) } else { (dim, 1) };
        Problem { space, samples, monitor, group, coordinates, brackets, intervals, coupled, columns }
    }

    /// Steps and residuals for control points; an error is a pair beyond the cut locus, or a number that is not finite.
    fn state(&self, control: Vec<f64>) -> Result<State, usize> {
        let (space, samples) = (self.space, self.samples);
        let (len, dim, count) = (space.point_len(), space.dim(), samples.count());
        let mut arrays = vec![0.0; (count - 1) * len];
        cumulative_steps(space, &control, count, &mut arrays).map_err(|(row, _)| row)?;
        let curve =
            BSpline { knots: samples.knots, control: &control, degree: samples.degree, steps: &arrays };
        let mut gamma = vec![0.0; samples.t.len() * len];
        evaluate_bspline(space, &curve, samples.t, Quantity::Point, self.monitor, &mut gamma);
        let mut steps = vec![0.0; (count - 1) * dim];
        let mut x = vec![Lane::ZERO; dim];
        self.rows([&arrays, &arrays], dim, &mut steps, |omega, _, _| {
            self.coordinates.of(space, omega, &mut x);
            x.clone()
        });
        let mut residuals = vec![0.0; samples.t.len() * dim];
        self.rows([&gamma, samples.points], dim, &mut residuals, |gamma, y, log| {
            space.log(gamma, y, log);
            self.group.left_quotient(gamma, log);
            self.coordinates.of(space, log, &mut x);
            x.clone()
        });
        let squares = residuals.chunks(dim).map(|r| r.iter().map(|x| x * x).sum::<f64>());
        let cost: f64 = squares.zip(samples.weights).map(|(r, &w)| if w > 0.0 { w * r } else { 0.0 }).sum();
        if cost.is_finite() { Ok(State { control, steps, residuals, cost }) } else { Err(0) }
    }

    /// A function of two arrays of points, a row per lane; it writes `size` numbers per row.
    fn rows(
        &self,
        [a, b]: [&[f64]; 2],
        size: usize,
        out: &mut [f64],
        mut f: impl FnMut(&[Lane], &[Lane], &mut [Lane]) -> Vec<Lane>,
    ) {
        let len = self.space.point_len();
        let rows = out.len() / size;
        let mut arrays = [(); 3].map(|()| vec![Lane::ZERO; len]);
        for (group, out) in out.chunks_mut(LANES * size).enumerate() {
            checkpoint();
            let [p, q, work] = &mut arrays;
            let at: [usize; LANES] = few(|l| (group * LANES + l).min(rows - 1));
            gather(few(|l| &a[at[l] * len..][..len]), p);
            gather(few(|l| &b[at[l] * len..][..len]), q);
            scatter(&f(p, q, work), out);
        }
    }

    /// p exp(s δ) for all control points p.
    fn moved(&self, state: &State, delta: &[f64], s: f64) -> Vec<f64> {
        let (space, len, dim) = (self.space, self.space.point_len(), self.space.dim());
        let mut control = state.control.clone();
        let (mut p, mut x) = (vec![Lane::ZERO; len], vec![Lane::ZERO; dim]);
        let (mut factor, mut work) = (p.clone(), p.clone());
        let rows = self.samples.count();
        for (group, out) in control.chunks_mut(LANES * len).enumerate() {
            let at: [usize; LANES] = few(|l| (group * LANES + l).min(rows - 1));
            gather(few(|l| &state.control[at[l] * len..][..len]), &mut p);
            gather(few(|l| &delta[at[l] * dim..][..dim]), &mut x);
            x.iter_mut().for_each(|x| *x *= lane(s));
            self.coordinates.exp(space, &x, &mut factor);
            self.group.multiply(&mut p, &factor, &mut work);
            space.project(&mut p);
            scatter(&p, out);
        }
        control
    }

    /// ad of elements with given coordinates.
    fn ad(&self, x: &[Lane]) -> Square {
        let mut m = Square::zeros(x.len(), x.len());
        for &(a, b, c, value) in &self.brackets {
            m[(c, b)][0] = x[a].mul_add(lane(value), m[(c, b)][0]);
        }
        m
    }

    /// For every pair of control points `φ(−ad ω)⁻¹` and `e^{−ad ω}`, row by row.
    fn pairs(&self, state: &State) -> Vec<f64> {
        let (dim, square) = (self.coupled, self.coupled * self.coupled);
        let rows = state.steps.len() / dim;
        let mut out = vec![0.0; rows * 2 * square];
        let mut x = vec![Lane::ZERO; dim];
        for (group, out) in out.chunks_mut(LANES * 2 * square).enumerate() {
            checkpoint();
            let at: [usize; LANES] = few(|l| (group * LANES + l).min(rows - 1));
            gather(few(|l| &state.steps[at[l] * dim..][..dim]), &mut x);
            let [e, phi] = exp_and_phi(&-self.ad(&x));
            let mut both = vec![Lane::ZERO; 2 * square];
            inverse(&phi).write(&mut both[..square]);
            e.write(&mut both[square..]);
            scatter(&both, out);
        }
        out
    }

    /// The Gauss–Newton step of all control points in coordinates, and the decrease of the cost in the linear model.
    fn step(&self, state: &State) -> (Vec<f64>, f64) {
        let (k, columns) = (self.coupled, self.columns);
        let (samples, dim) = (self.samples, k * columns);
        let (degree, count) = (samples.degree, samples.t.len());
        let size = samples.count() * k;
        let stride = (degree + 1) * k;
        let mut band = vec![0.0; size * stride];
        let mut right = vec![0.0; size * columns];
        let pairs = if columns == 1 { self.pairs(state) } else { Vec::new() };
        for group in 0..count.div_ceil(LANES) {
            checkpoint();
            let at: [usize; LANES] = few(|l| (group * LANES + l).min(count - 1));
            let jacobians = self.jacobians(state, &pairs, at);
            let jacobians: Vec<Vec<[f64; LANES]>> =
                jacobians.iter().map(|m| m.entries().iter().map(|x| x[0].to_array()).collect()).collect();
            for l in 0..LANES.min(count - group * LANES) {
                let (i, w) = (at[l], samples.weights[at[l]]);
                if !(w > 0.0) {
                    continue;
                }
                let r = &state.residuals[i * dim..][..dim];
                let first = (self.intervals[i] - degree) * k;
                for row in 0..stride {
                    let (m, a) = (row / k, row % k);
                    let left = |c: usize| w * jacobians[m][c * k + a][l];
                    for column in 0..=row {
                        let (n, b) = (column / k, column % k);
                        let sum: f64 = (0..k).map(|c| left(c) * jacobians[n][c * k + b][l]).sum();
                        band[(first + row) * stride + row - column] += sum;
                    }
                    for column in 0..columns {
                        let sum: f64 = (0..k).map(|c| left(c) * r[c * columns + column]).sum();
                        right[(first + row) * columns + column] -= sum;
                    }
                }
            }
        }
        let mut matrix = Banded::of(size, stride - 1, |at| band[at]);
        matrix.factor();
        let mut delta = right.clone();
        matrix.solve(columns, &mut delta);
        let decrease = delta.iter().zip(&right).map(|(x, g)| x * g).sum();
        (delta, decrease)
    }

    /// The derivatives of the residuals of a datum per lane with respect to the control points of their intervals.
    fn jacobians(&self, state: &State, pairs: &[f64], at: [usize; LANES]) -> Vec<Square> {
        let (samples, k) = (self.samples, self.coupled);
        let (degree, square) = (samples.degree, k * k);
        let curve = BSpline { knots: samples.knots, control: &[], degree, steps: &[] };
        let interval = at.map(|i| self.intervals[i]);
        let mut basis = vec![Lane::ZERO; degree + 1];
        cumulative_basis(&curve, interval, at.map(|i| samples.t[i]), &mut basis);
        if self.columns > 1 || self.brackets.is_empty() {
            // −B_m, in every coordinate.
            let after = |m: usize| if m < degree { basis[m + 1] } else { Lane::ZERO };
            return (0..=degree).map(|m| Square::identity(k).scaled(after(m) - basis[m])).collect();
        }
        let mut result = vec![Square::zeros(k, k); degree + 1];
        let mut after = Square::identity(k);
        let (mut x, mut both) = (vec![Lane::ZERO; k], vec![Lane::ZERO; 2 * square]);
        for j in (1..=degree).rev() {
            let pair = interval.map(|i| i - degree + j - 1);
            gather(few(|l| &state.steps[pair[l] * k..][..k]), &mut x);
            gather(few(|l| &pairs[pair[l] * 2 * square..][..2 * square]), &mut both);
            let [e, phi] = exp_and_phi(&self.ad(&x).scaled(-basis[j]));
            let turned = after.times(&phi).scaled(basis[j]).times(&Square::read(k, k, &both[..square]));
            result[j] = &result[j] + &turned;
            result[j - 1] = -turned.times(&Square::read(k, k, &both[square..]));
            after = after.times(&e);
        }
        result[0] = &result[0] + &after;
        gather(few(|l| &state.residuals[at[l] * k..][..k]), &mut x);
        let [_, phi] = exp_and_phi(&self.ad(&x));
        let outer = -inverse(&phi);
        result.iter().map(|m| outer.times(m)).collect()
    }
}

/// The structure constants of a Lie algebra that are not zero.
fn brackets(
    space: &Erased,
    group: Multiplication,
    coordinates: &Coordinates,
) -> Vec<(usize, usize, usize, f64)> {
    let (len, dim) = (space.point_len(), space.dim());
    let basis: Vec<Vec<Lane>> = (0..dim)
        .map(|a| {
            let mut unit = vec![Lane::ZERO; dim];
            unit[a] = Lane::ONE;
            let mut element = vec![Lane::ZERO; len];
            coordinates.element(space, &unit, &mut element);
            element
        })
        .collect();
    let mut found = Vec::new();
    let (mut work, mut x) = (vec![Lane::ZERO; len], vec![Lane::ZERO; dim]);
    for a in 0..dim {
        checkpoint();
        for b in 0..dim {
            let (mut ab, mut ba) = (basis[a].clone(), basis[b].clone());
            group.multiply(&mut ab, &basis[b], &mut work);
            group.multiply(&mut ba, &basis[a], &mut work);
            ab.iter_mut().zip(&ba).for_each(|(x, y)| *x -= *y);
            coordinates.of(space, &ab, &mut x);
            for (c, x) in x.iter().enumerate() {
                let value = x.as_array()[0];
                // Rounding errors of zero are far below, all other constants far above.
                if value.abs() > 1e-12 {
                    found.push((a, b, c, value));
                }
            }
        }
    }
    found
}

/// `eᵇ` and `φ(b) = (eᵇ − 1)/b`, by Taylor series of b/2ⁿ and doubling: `φ(2b) = φ(b)(eᵇ + 1)/2`.
fn exp_and_phi(b: &Square) -> [Square; 2] {
    // The first omitted term is below 1e-16.
    const SIZE: f64 = 0.5;
    const TERMS: usize = 14;
    let size = b.size().to_array().into_iter().fold(0.0, f64::max);
    let doublings = (size / SIZE).log2().ceil().clamp(0.0, 60.0) as i32;
    let b = b.scaled(lane(0.5_f64.powi(doublings)));
    let mut phi = Square::identity(b.rows());
    for n in (2..=TERMS).rev() {
        phi = b.times(&phi).scaled(lane(1.0 / n as f64)).plus_identity(Lane::ONE);
    }
    let mut e = b.times(&phi).plus_identity(Lane::ONE);
    for _ in 0..doublings {
        phi = phi.times(&e.clone().plus_identity(Lane::ONE)).scaled(lane(0.5));
        e = e.times(&e);
    }
    [e, phi]
}
