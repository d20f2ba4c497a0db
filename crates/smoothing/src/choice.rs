//! The choice of λ from the data.
//!
//! At a curve with residuals r and accelerations a, the smoothing problem in frames is a linear problem. Its solution
//! changes the coefficients by `δ(λ) = A⁻¹(BᵀWr − λ(SᵀMa + Pᵀg))` with the contribution g of curvature, or, with the
//! energy of [`JacobiOperator`], by the same with `(S + RP)ᵀMa`. Residuals and degrees of freedom for several λ at a time
//! cost one banded solve.

use crate::banded::Number;
use crate::cyclic::PeriodicCorrection;
use crate::jacobi_operator::JacobiOperator;
use crate::linearized::LinearProblem;
use crate::misfit::{Factors, Misfit, Whole};
use crate::problem::Criterion;
use symspline_core::scalar::{LANES, Lane, few, lane};

/// If the degrees of freedom exceed those of curves without energy by this little, every larger λ is equally good.
pub const STRAIGHT: f64 = 0.01;

/// The linearised problem at a curve: coordinates of m numbers, in units of the mean knot spacing.
pub struct Linear<'a> {
    /// The matrices B, P, S, and Ω.
    pub linearized: &'a LinearProblem,
    /// Dimension of the space.
    pub m: usize,
    /// Residuals at the data, and their weights.
    pub misfit: &'a Misfit<'a>,
    /// Jacobi's operator, if the curvature of the space is included in the matrix.
    pub jacobi: Option<&'a JacobiOperator>,
    /// The periodic continuation of a closed curve.
    pub periodic: Option<&'a PeriodicCorrection>,
    /// Accelerations at the knots.
    pub accelerations: &'a [f64],
    /// The standard deviation of the noise, for [`Criterion::Cp`].
    pub sigma: f64,
    /// BᵀWr.
    pub pull: Vec<f64>,
    /// SᵀMa + Pᵀg: the gradient of half the energy.
    pub stiffness: Vec<f64>,
}

impl<'a> Linear<'a> {
    /// `curvature` is g, the part of the energy's gradient that is due to curvature.
    pub fn new(
        linearized: &'a LinearProblem,
        m: usize,
        misfit: &'a Misfit<'a>,
        jacobi: Option<&'a JacobiOperator>,
        periodic: Option<&'a PeriodicCorrection>,
        accelerations: &'a [f64],
        curvature: &[f64],
        sigma: f64,
    ) -> Self {
        let mut pull = misfit.pull(linearized, m);
        let mut stiffness = match jacobi {
            Some(jacobi) => jacobi.pull(linearized, accelerations),
            None => linearized.stiffness(accelerations, curvature, m),
        };
        if let Some(periodic) = periodic {
            periodic.fold(&mut pull);
            periodic.fold(&mut stiffness);
        }
        Linear { linearized, m, misfit, jacobi, periodic, accelerations, sigma, pull, stiffness }
    }

    /// The step of the coefficients for one λ, given the factors of A.
    pub fn step(&self, lam: f64, factors: &Factors<f64>) -> Vec<f64> {
        let mut step: Vec<f64> =
            self.pull.iter().zip(&self.stiffness).map(|(pull, stiffness)| pull - lam * stiffness).collect();
        factors.solve(self.m, &mut step);
        if let Some(periodic) = self.periodic {
            periodic.extend(&mut step);
        }
        step
    }

    /// The energy of the present curve.
    pub fn energy(&self) -> f64 {
        let of = |c: usize| self.linearized.energy(false, |at| lane(self.accelerations[at.1 * self.m + c]));
        (0..self.m).fold(Lane::ZERO, |sum, c| sum + of(c)).as_array()[0]
    }

    /// A for one λ.
    pub fn matrix(&self, lam: f64) -> Whole<f64> {
        self.misfit.matrix(self.linearized, self.m, self.jacobi, self.periodic, lam)
    }

    /// A, factored.
    pub fn factored<T: Number>(&self, lam: T) -> Factors<T> {
        self.misfit.factored(self.linearized, self.m, self.jacobi, self.periodic, lam)
    }

    /// The scores and their components for the λ of all lanes.
    pub fn look(&self, lam: Lane) -> Look {
        let (m, linearized) = (self.m, self.linearized);
        let factors = self.factored(lam);
        let mut x: Vec<Lane> = self
            .pull
            .iter()
            .zip(&self.stiffness)
            .map(|(pull, stiffness)| (-lam).mul_add(lane(*stiffness), lane(*pull)))
            .collect();
        factors.solve(m, &mut x);
        if let Some(periodic) = self.periodic {
            periodic.extend_lanes(&mut x);
        }
        let freedom = self.misfit.freedom(linearized, &factors.inverse_band());
        let rss = self.misfit.rss(linearized, m, &x);
        // (a + Sδ)ᵀM(a + Sδ), with Jacobi's operator (a + (S + RP)δ)ᵀM(a + (S + RP)δ).
        let bend = |at: (usize, usize), c: usize| {
            let of_jacobi = |jacobi: &JacobiOperator| jacobi.of_lanes(linearized, at, &x, c, (0, m));
            let turned = self.jacobi.map_or(Lane::ZERO, of_jacobi);
            let flat = linearized.accelerations[at.1].of_lanes(&x, m, c);
            lane(self.accelerations[at.1 * m + c]) + flat + turned
        };
        let differ = self.jacobi.is_some_and(JacobiOperator::differs);
        let energy = (0..m).fold(Lane::ZERO, |sum, c| sum + linearized.energy(differ, |at| bend(at, c)));
        // A matrix that is rounding errors only may have impossible degrees of freedom.
        let least = lane(0.9 * linearized.null().min(linearized.free() as f64));
        let sound = factors.least_pivot().simd_gt(Lane::ZERO) & freedom.simd_gt(least);
        Look { freedom, rss, energy: lam * energy, sound, log_det: factors.log_det() }
    }

    /// The λ with the lowest score, near a guess or in the whole range, and whether it lies at a bound.
    pub fn choose(&self, criterion: Criterion, guess: Option<f64>) -> (f64, bool) {
        let linearized = self.linearized;
        let scoring = Scoring {
            criterion,
            count: self.misfit.count(self.m),
            coordinates: self.m as f64,
            free: linearized.free() as f64,
            null: linearized.null(),
            energies: linearized.null(),
            straight: Straight::At(linearized.null() + STRAIGHT),
            balance: linearized.balance(),
            most: f64::INFINITY,
            sigma: self.sigma,
        };
        choose(linearized, &scoring, |lam, _| self.look(lam), guess)
    }
}

/// The degrees of freedom below which every λ is equally good.
pub enum Straight {
    /// A number.
    At(f64),
    /// So many more than with the largest λ.
    Above(f64),
}

/// What a score depends on besides λ.
pub struct Scoring {
    /// The criterion.
    pub criterion: Criterion,
    /// The number of data per coordinate.
    pub count: f64,
    /// The number of coordinates that have the same matrix.
    pub coordinates: f64,
    /// The number of coefficients to which λ applies, per coordinate.
    pub free: f64,
    /// The degrees of freedom without energy, per coordinate: of all coefficients, ...
    pub null: f64,
    /// ... and of those to which λ applies.
    pub energies: f64,
    /// The degrees of freedom below which every λ is equally good.
    pub straight: Straight,
    /// The λ at which data and energy have about the same weight, and the largest one that may be chosen.
    pub balance: f64,
    pub most: f64,
    /// The standard deviation of the noise, for [`Criterion::Cp`].
    pub sigma: f64,
}

/// The λ with the lowest score, near a guess or in the whole range, and whether it lies at a bound. `look` receives
/// whether degrees of freedom are needed; otherwise, those that it returns may be NaN.
pub fn choose(
    linearized: &LinearProblem,
    scoring: &Scoring,
    look: impl Fn(Lane, bool) -> Look,
    guess: Option<f64>,
) -> (f64, bool) {
    /// The first step of the logarithm of λ on both sides of the best one in the last check.
    const STEP: f64 = 0.05;
    let freedoms = |lams: [f64; LANES]| {
        let found = look(Lane::new(lams), true);
        found.sound.select(found.freedom, lane(f64::NAN)).to_array()
    };
    if let Criterion::Reml = scoring.criterion {
        // The score does not depend on the degrees of freedom, of which most are the more expensive part. They show
        // whether the lowest score is sound and whether it is at a bound.
        let (lam, bound) = search(linearized, scoring, f64::NEG_INFINITY, |lam| look(lam, false), guess);
        let [own, stiffer, most, ..] = freedoms(few(|l| match l {
            0 => lam,
            1 => lam * (1.0 + STEP),
            _ => scoring.most,
        }));
        let straight = match scoring.straight {
            Straight::At(freedom) => freedom,
            Straight::Above(more) => most + more,
        };
        if !bound && stiffer > straight && own < scoring.count * (1.0 - 1e-6) {
            return (lam, false);
        }
    }
    let straight = match scoring.straight {
        Straight::At(freedom) => freedom,
        Straight::Above(more) => freedoms([scoring.most; LANES])[0] + more,
    };
    search(linearized, scoring, straight, |lam| look(lam, true), guess)
}

/// The search for the lowest score, with the degrees of freedom below which every λ is equally good.
fn search(
    linearized: &LinearProblem,
    scoring: &Scoring,
    straight: f64,
    look_at: impl Fn(Lane) -> Look,
    guess: Option<f64>,
) -> (f64, bool) {
    /// The range of λ in decades above the balance of data and energy (and below it on short segments, if
    /// segments are unequal), and the range around a guess.
    const RANGE: (f64, f64) = (-9.0, 12.5);
    const NEAR: f64 = 0.6;
    /// The number of evaluations in a range, and the decades that those of the first ranges cover.
    const AT_ONCE: usize = 8;
    const DECADES: f64 = 7.5;
    let start = scoring.balance.log10();
    let (mut from, mut to) = (
        start + RANGE.0 + f64::from(linearized.penalised.power()) * linearized.basis.short().log10(),
        (start + RANGE.1).min(scoring.most.log10()),
    );
    let bounds = (from, to);
    if let Some(guess) = guess {
        (from, to) = ((guess.log10() - NEAR).max(from), (guess.log10() + NEAR).min(to));
    }
    let passes = if guess.is_some() { 1 } else { ((to - from) / DECADES).ceil() as usize };
    let mut seen: Vec<(f64, f64, f64)> = Vec::new();
    let look = |seen: &mut Vec<(f64, f64, f64)>, from: f64, to: f64, part: usize, parts: usize| {
        let at: [f64; AT_ONCE] =
            few(|k| from + (to - from) * (k * parts + part) as f64 / (AT_ONCE * parts - 1) as f64);
        for at in at.as_chunks::<LANES>().0 {
            let lam = Lane::new(at.map(|x| 10f64.powf(x)));
            let found = look_at(lam);
            let scores = scoring.score(lam, &found).to_array();
            let freedom = found.sound.select(found.freedom, lane(f64::NAN)).to_array();
            (0..LANES).for_each(|l| seen.push((at[l], scores[l], freedom[l])));
        }
    };
    (0..passes).for_each(|part| look(&mut seen, from, to, part, passes));
    // The score may have a minimum between the roughest curve that has a score and its neighbours.
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(best) = lowest_of(&seen, 0..seen.len()).filter(|&best| best > 0 && rough(&seen, best)) {
        let (left, right) = (seen[best - 1].0, seen[(best + 1).min(seen.len() - 1)].0);
        look(&mut seen, left, right, 0, 1);
    }
    for _ in 0..4 {
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(best) = least(&seen, straight) else { return (10f64.powf(from), true) };
        let (left, right) = (best.saturating_sub(1), (best + 1).min(seen.len() - 1));
        (from, to) = (seen[left].0, seen[right].0);
        // At the boundary of the range around a guess, the search continues outside it.
        if best == 0 && from > bounds.0 {
            (from, to) = ((from - 4.0 * NEAR).max(bounds.0), from);
        } else if best == seen.len() - 1 && to < bounds.1 {
            (from, to) = (to, (to + 4.0 * NEAR).min(bounds.1));
        } else if to - from < 0.12 {
            break;
        }
        look(&mut seen, from, to, 0, 1);
    }
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    seen.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-9);
    let Some(best) = least(&seen, straight) else { return (10f64.powf(from), true) };
    let stiff = seen.get(best + 1).is_none_or(|next| next.2 <= straight);
    if stiff || rough(&seen, best) {
        return (10f64.powf(seen[best].0), true);
    }
    (10f64.powf(lowest([seen[best - 1], seen[best], seen[best + 1]].map(|(x, y, _)| (x, y)))), false)
}

impl Scoring {
    fn score(&self, lam: Lane, look: &Look) -> Lane {
        let (n, m) = (self.count, self.coordinates);
        // Without degrees of freedom, or if rounding errors make the matrix singular, there is no score.
        let known = look.freedom.simd_ge(lane(n * (1.0 - 1e-6))).select(Lane::ZERO, look.sound);
        let per = look.rss / lane(m);
        let score = match self.criterion {
            Criterion::Gcv { gamma } => {
                let left = lane(n) - look.freedom * lane(gamma);
                // With γ > 1 the denominator has a zero. Rougher curves than that are excluded.
                left.simd_gt(Lane::ZERO).select((per / (left * left)).ln(), lane(f64::INFINITY))
            }
            Criterion::Cp => per + look.freedom * lane(2.0 * self.sigma * self.sigma),
            Criterion::Reml => {
                lane(n - self.null) * (per + look.energy / lane(m)).ln() + look.log_det
                    - lane(self.free - self.energies) * lam.ln()
            }
        };
        known.select(score, lane(f64::INFINITY))
    }
}

/// The quantities that belong to one λ.
pub struct Look {
    /// Degrees of freedom per coordinate: tr A⁻¹BᵀWB. NaN if they are unknown.
    pub freedom: Lane,
    /// Σ w|r − Bδ|².
    pub rss: Lane,
    /// The penalty: λ times the energy.
    pub energy: Lane,
    /// ln det A.
    pub log_det: Lane,
    /// Whether A is numerically positive definite.
    pub sound: Lane,
}

/// The index of the lowest score among curves that are not geodesics, or the first geodesic if its score is lower. If
/// the score is lowest for the roughest curve, which interpolates the data, a local minimum between the bounds is
/// preferred: cross-validation has one if the data show noise, even if the score decreases beyond it.
fn least(seen: &[(f64, f64, f64)], straight: f64) -> Option<usize> {
    let end = seen.iter().position(|look| look.2 <= straight).map_or(seen.len(), |first| first + 1);
    let best = lowest_of(seen, 0..end)?;
    // Where the curve hardly changes, rounding errors create local minima.
    let below = |i: usize, j: usize| seen[j].1 - seen[i].1 > 1e-8 * (1.0 + seen[i].1.abs());
    let inside = |i: &usize| !rough(seen, *i) && below(*i, i - 1) && below(*i, i + 1);
    let between =
        if rough(seen, best) { lowest_of(seen, (0..end.saturating_sub(1)).filter(inside)) } else { None };
    between.or(Some(best))
}

/// The position with the lowest score.
fn lowest_of(seen: &[(f64, f64, f64)], positions: impl Iterator<Item = usize>) -> Option<usize> {
    positions.filter(|&i| seen[i].1.is_finite()).min_by(|&a, &b| seen[a].1.total_cmp(&seen[b].1))
}

/// Whether no rougher curve has a score.
fn rough(seen: &[(f64, f64, f64)], position: usize) -> bool {
    position == 0 || !seen[position - 1].1.is_finite()
}

/// The minimum of the parabola through three points, of which the middle one is the lowest.
fn lowest([(x0, y0), (x1, y1), (x2, y2)]: [(f64, f64); 3]) -> f64 {
    let (a, b) = (x1 - x0, x2 - x1);
    let (down, up) = ((y1 - y0) / a, (y2 - y1) / b);
    let bend = (up - down) / (a + b);
    if !(bend > 0.0) {
        return x1;
    }
    let at = 0.5 * (x0 + x1) - 0.5 * down / bend;
    at.clamp(x0, x2)
}
