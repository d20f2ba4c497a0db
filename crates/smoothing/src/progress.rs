//! The state of the iteration for one curve: its λ, its steps, and its end.

use crate::banded::Banded;
use crate::choice::Linear;
use crate::misfit::COUPLED;
use crate::problem::{Criterion, Penalty, SmoothReport, Tier};
use crate::robust::{Lam, Robust};
use symspline_core::space::{Erased, Origin};

/// The contraction of the linearised solver, measured or expected, from which it includes curvature in its matrix, or
/// full Gauss–Newton replaces it.
const SLOW: f64 = 0.5;
/// The same limit while λ and the curve are still inaccurate.
const HOPELESS: f64 = 2.0;
/// The largest dimension in which full Gauss–Newton is chosen automatically.
const LARGE: usize = 64;
/// λ has converged if it changes by less than this between rounds, in natural logarithms.
const SETTLED: f64 = 3e-3;
/// λ has not been found if it changes by more than this after the last round.
const UNSETTLED: f64 = 0.7;
/// The maximum number of rounds that choose λ.
const ROUNDS: usize = 12;

/// λ and the state of the iteration.
pub struct Progress {
    /// λ, for times divided by the mean knot spacing, once it is given or chosen.
    pub lam: Option<f64>,
    /// Whether it is final.
    pub settled: bool,
    /// The length of the last step.
    pub last_step: f64,
    /// The last step, unless it was extrapolated.
    last: Vec<f64>,
    /// The size of residuals, the scale of steps.
    scale: f64,
    /// The number of consecutive iterations in which the step hardly decreased.
    pub slow: usize,
    /// Whether the matrix of the linearised solver includes curvature.
    pub with_curvature: bool,
    /// Whether the search for λ failed to converge.
    pub unsettled: bool,
    /// Whether the linearised solver was abandoned.
    pub forced: bool,
    /// The smallest λ that may be chosen, because no spline joined the points of smaller ones.
    pub least: f64,
    /// The number of iterations before this stage of the fit.
    pub begun: usize,
    density: f64,
    penalty: Penalty,
    /// The report so far.
    pub report: SmoothReport,
}

impl Progress {
    /// For a given λ, unless it is too large, or for a λ to be chosen. `density` is the weight per knot where data
    /// are sparse.
    pub fn new(lam: Option<f64>, stiffest: f64, density: f64, penalty: Penalty) -> Self {
        let report =
            SmoothReport { at_bound: lam.is_some_and(|lam| lam > stiffest), ..SmoothReport::default() };
        Progress {
            lam: lam.map(|lam| lam.min(stiffest)),
            settled: lam.is_some(),
            last_step: f64::INFINITY,
            last: Vec::new(),
            scale: f64::NAN,
            slow: 0,
            with_curvature: false,
            unsettled: false,
            forced: false,
            least: 0.0,
            begun: 0,
            density,
            penalty,
            report,
        }
    }

    /// The factor by which a step is extended if steps shrink slowly in one direction: the limit of their geometric
    /// series (Aitken).
    ///
    /// Steps of reweighted least squares shrink steadily but slowly. Other iterations whose steps do not shrink are
    /// abandoned.
    pub fn further(&mut self, step: &[f64], reweighs: bool) -> f64 {
        let most = if reweighs { 0.99 } else { 0.9 };
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let ratio = product(step, &self.last) / product(&self.last, &self.last);
        if self.last.len() == step.len() && ratio > 0.3 && ratio < most {
            self.last.clear();
            return 1.0 / (1.0 - ratio);
        }
        self.last = step.to_vec();
        1.0
    }

    /// Starts with another problem, and possibly another λ.
    pub fn restart(&mut self, lam: Lam) {
        (self.last_step, self.slow, self.begun) = (f64::INFINITY, 0, self.report.iterations);
        self.last.clear();
        match lam {
            Lam::Same => {}
            Lam::Anew => (self.settled, self.lam, self.report.rounds) = (false, None, 0),
            Lam::Near => (self.settled, self.report.rounds) = (false, 0),
            Lam::To(lam) => self.lam = Some(lam),
            Lam::Times(factor) => self.lam = self.lam.map(|lam| lam * factor),
        }
    }

    /// Whether to use full Gauss–Newton.
    pub fn takes_gauss_newton(&self, space: &Erased, tier: Tier) -> bool {
        let limit = if self.settled { SLOW } else { HOPELESS };
        let known = self.forced || (self.settled && self.report.exact);
        // With curvature in its matrix the linearised solver contracts.
        let hopeless = known || (!self.with_curvature && self.report.kappa > limit) || self.slow > 1;
        tier == Tier::Newton || (hopeless && self.may_take_gauss_newton(space, tier))
    }

    /// Whether full Gauss–Newton is allowed.
    pub fn may_take_gauss_newton(&self, space: &Erased, tier: Tier) -> bool {
        // In flat space the linearised solver equals full Gauss–Newton, whose dense blocks would limit the dimension.
        self.penalty == Penalty::Acceleration
            && tier == Tier::Auto
            && space.curvature() != 0.0
            && space.dim() <= LARGE
    }

    /// Updates λ at a curve, unless it is given or has converged, and the expected contraction of the linearised
    /// solver.
    pub fn weigh(
        &mut self,
        space: &Erased,
        linear: &Linear,
        speeds: &[f64],
        robust: &Robust,
        asked: Criterion,
    ) -> f64 {
        if !self.settled {
            self.choose(linear, robust.criterion(asked));
        }
        let lam = self.lam.unwrap_or(0.0);
        self.expect(space, speeds, lam, &linear.linearized.profile);
        lam
    }

    fn choose(&mut self, linear: &Linear, criterion: Criterion) {
        let (mut lam, mut at_bound) = linear.choose(criterion, self.lam);
        if lam < self.least {
            (lam, at_bound) = (self.least, true);
        }
        self.report.rounds += 1;
        let moved = self.lam.map_or(f64::INFINITY, |before| (lam / before).ln().abs());
        // If λ oscillates, the mean is used.
        if let Some(before) = self.lam.filter(|_| self.report.rounds > ROUNDS / 2 && !at_bound) {
            lam = (lam * before).sqrt();
        }
        self.settled = moved < SETTLED || self.report.rounds >= ROUNDS;
        self.unsettled = moved > UNSETTLED && self.settled;
        self.report.at_bound = at_bound;
        self.lam = Some(lam);
    }

    /// The expected contraction of the linearised solver without curvature in its matrix: `K²|γ'|²√(λ/w)`, with the
    /// mean squared speed and the weight w per time where data are sparse. √(λ/w) is the square of the time over which
    /// the data are averaged; for the jerk it is the cube root. If λ varies, the largest contraction of a segment counts.
    fn expect(&mut self, space: &Erased, speeds: &[f64], lam: f64, profile: &[f64]) {
        let m = space.dim();
        let knots = speeds.len() / m;
        // Groups without a metric have no curvature bound K.
        let k = if space.curvature().is_nan() { 1.0 } else { space.curvature() };
        let exponent = 2.0 / f64::from(self.penalty.power() + 1);
        let square = if profile.iter().all(|x| *x == 1.0) {
            speeds.iter().map(|u| u * u).sum::<f64>() / knots as f64
        } else {
            let of_segment = |(u, x): (&[f64], &f64)| u.iter().map(|u| u * u).sum::<f64>() * x.powf(exponent);
            speeds.chunks_exact(m).zip(profile).map(of_segment).fold(0.0, larger)
        };
        self.report.kappa = k * k * square * (lam / self.density).powf(exponent);
        self.with_curvature |=
            self.report.kappa > SLOW && m.saturating_pow(3).saturating_mul(knots) <= COUPLED;
    }

    /// Records λ, degrees of freedom and noise of the present curve.
    ///
    /// `softness` is the slope of a robust loss: λ of its pseudo-data is λ of the curve divided by it.
    pub fn note(&mut self, linear: &Linear, inverse: &Banded<f64>, lam: f64, softness: f64) {
        let Linear { linearized, m, misfit, .. } = linear;
        let (count, rss) = (misfit.count(*m), misfit.rss_now(*m));
        let unit = self.penalty.unit(linearized.basis.spacing);
        let freedom = misfit.freedom(linearized, inverse);
        // If λ hardly affects the curve, as for a geodesic, its best value fluctuates.
        self.settled |= self.report.rounds > 1 && (freedom - self.report.freedom).abs() < SETTLED * freedom;
        self.report.freedom = freedom;
        self.report.lam = lam * softness * unit;
        self.report.band_lam = lam * unit;
        // A curve that interpolates the data has no residuals to estimate the noise from.
        let left = count - freedom;
        self.report.sigma = if left > 1e-9 * count { (rss / (*m as f64 * left)).sqrt() } else { f64::NAN };
        self.scale = (rss / (*m as f64 * left.max(1.0))).sqrt();
    }

    /// Whether a step is small compared with the standard deviations of the points.
    pub fn judge(&mut self, step: &[f64], deviations: &[f64], reach: f64, tol: f64, reweighs: bool) -> bool {
        /// Steps below this fraction of the path that no longer shrink are rounding errors.
        const FLOOR: f64 = 1e-8;
        const STILL: f64 = 1e-13;
        let lengths: Vec<f64> = step.chunks_exact(step.len() / deviations.len()).map(length).collect();
        let longest = lengths.iter().copied().fold(0.0, larger);
        let relative = lengths.iter().zip(deviations).map(|(x, d)| x / (d * self.scale)).fold(0.0, larger);
        let rate = longest / self.last_step;
        if self.last_step.is_finite() {
            self.report.rate = rate;
            // Steps after a change of λ or of weights do not measure the contraction, but they must not grow.
            let slow = rate > if self.settled && !reweighs { SLOW } else { 1.0 };
            self.slow = if slow { self.slow + 1 } else { 0 };
        }
        self.last_step = longest;
        self.report.step = relative;
        // Squares that overflow or underflow are not informative.
        let known = self.scale.is_finite() && (longest > 0.0 || step.iter().all(|x| *x == 0.0));
        known && (relative <= tol || longest <= STILL * reach || (longest <= FLOOR * reach && rate > SLOW))
    }
}

/// |x|.
pub fn length(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The larger of two numbers, or NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
