//! One curve during the iteration to the smoothing spline.

use crate::adaptive::{Adaptive, Track, at_knots, at_times};
use crate::banded::Banded;
use crate::chain::deviations;
use crate::choice::Linear;
use crate::cyclic::PeriodicCorrection;
use crate::frames::{Frames, curvature_gradient};
use crate::gauss_newton::{self, Pull};
use crate::information::{self, Root};
use crate::jacobi_operator::JacobiOperator;
use crate::linearized::{Basis, LinearProblem, OVERLAP, Stencil};
use crate::local::Local;
use crate::misfit::Misfit;
use crate::path::{Path, Position, moved, positions};
use crate::problem::{
    Adapt, Data, EndConditions, Known, Options, Penalty, Profile, Selection, Smooth, SmoothReport, State,
};
use crate::progress::{Progress, larger, length};
use crate::residuals::Residuals;
use crate::robust::{AtCurve, Lam, Robust, Stage};
use crate::variance::rows_of;
use std::borrow::Cow;
use symspline_core::fit::Ends;
use symspline_core::monitor::Monitor;
use symspline_core::scalar::{Lane, lane};
use symspline_core::space::{Ambient, Erased, Origin};

/// The maximum number of times that a step is taken back and halved because no spline joins the points it leads to.
const RETREATS: usize = 6;
/// The number of steps of the linearised solver beyond their limit, with a final λ, after which it is abandoned: it
/// does not contract, and its limit, if any, is a minimum near other curves.
const ASTRAY: usize = 8;
/// If no spline joins the points of a chosen λ, λ is multiplied by at least this factor, at most this many times.
const STIFFER: f64 = 10.0;
const STIFFENINGS: usize = 4;
/// The quantile of the weights that determines the stiffness of a curve with unequal weights.
const LIGHT: usize = 10;
/// The number of times that the way in which λ and σ vary is found.
const ADAPTATIONS: usize = 2;
/// The relative accuracy of J.
const ROUNDING: f64 = 1e-12;

/// What follows an evaluation of the curve.
enum Next {
    /// The last step is halved, because it increased the objective.
    Retreat,
    /// The iteration restarts with full Gauss–Newton.
    BeginAgain,
    /// The next stage of a robust fit, from the squares of the residuals.
    Stage(Vec<f64>),
    /// λ and σ vary like this.
    Profile(Profile),
    /// The points move by these tangent vectors.
    Step(Vec<f64>),
    /// The iteration ends.
    End(State),
}

/// A curve, its data, and the state of its iteration.
pub struct CurveFit<'a> {
    data: Data<'a>,
    /// Knots.
    pub knots: Vec<f64>,
    positions: Vec<Position>,
    /// Whether there is a datum at a knot, or in a segment beside it.
    supported: Vec<bool>,
    /// Whether the points are already those of the result, so that only A and its inverse are computed.
    solved: bool,
    /// The weights of the data, with the factors of a noise level that varies.
    weights: Vec<f64>,
    /// Roots of the information matrices.
    roots: Vec<Root>,
    /// How λ and σ vary, once it is known, and the number of times that it is still to be found.
    profile: Option<Profile>,
    adaptations: usize,
    linearized: LinearProblem,
    ends: EndConditions,
    robust: Robust,
    /// Initial points at the knots.
    first: Vec<f64>,
    /// Present points at the knots.
    pub points: Vec<f64>,
    /// Velocities of the spline through them.
    pub velocities: Vec<f64>,
    /// The start of the last step, and the step.
    before: Option<(Vec<f64>, Vec<f64>)>,
    retreats: usize,
    stiffenings: usize,
    /// The number of steps of the linearised solver that were too long.
    strays: usize,
    /// J in full Gauss–Newton, at the last λ.
    objective: f64,
    /// The final band of A⁻¹, and A.
    inverse: Option<Banded<f64>>,
    known: Option<Known>,
    progress: Progress,
}

impl<'a> CurveFit<'a> {
    /// A curve with given knots through initial points.
    pub fn new(
        data: Data<'a>,
        m: usize,
        knots: Vec<f64>,
        points: Vec<f64>,
        options: &Options,
        robust: Robust,
    ) -> Self {
        let &Options { ends, penalty, .. } = options;
        let positions = positions(&knots, data.times);
        let mut supported = vec![false; knots.len()];
        for &(segment, position) in &positions {
            supported[segment] |= position < 1.0;
            supported[segment + 1] |= position > 0.0;
        }
        let basis = Basis::new(&knots, ends);
        let unit = penalty.unit(basis.spacing);
        let mut linearized = LinearProblem::new(basis, &positions, data.weights, penalty);
        if !data.profile.is_empty() {
            linearized.set_profile(data.profile);
        }
        let lam = data.lam;
        let balance = linearized.balance();
        let stiffest = balance * penalty.stiffest(knots.len());
        let roots = information::roots(data.information, m);
        let mut weights: Vec<f64> = roots.iter().map(|root| root.weight).collect();
        if weights.is_empty() {
            weights.extend_from_slice(data.weights);
        }
        let count = weights.len();
        let light = *weights.select_nth_unstable_by(count / LIGHT, f64::total_cmp).1;
        let density = light * count as f64 / (knots.len() - 1) as f64;
        let adaptations = if options.adapt == Adapt::default() { 0 } else { ADAPTATIONS };
        CurveFit {
            weights: data.weights.to_vec(),
            roots,
            profile: None,
            adaptations,
            data,
            positions,
            supported,
            solved: false,
            linearized,
            ends,
            robust,
            velocities: vec![0.0; points.len()],
            first: points.clone(),
            points,
            knots,
            before: None,
            retreats: 0,
            stiffenings: 0,
            strays: 0,
            objective: f64::INFINITY,
            inverse: None,
            known: None,
            progress: Progress::new(lam.map(|lam| lam / unit), stiffest, density, penalty),
        }
    }

    /// The same curve with more knots before and after it. It is continued by geodesics, which the smoothing spline with
    /// natural ends is beyond its data. [`CurveFit::conclude`] completes it.
    pub fn prolonged(self, space: &Erased, data: Data<'a>, options: &Options) -> Self {
        let report = self.report();
        let failed = matches!(report.state, State::NoCurve | State::Undetermined);
        let points = if failed {
            vec![f64::NAN; data.knots.len() * space.point_len()]
        } else {
            self.path().prolonged(space, data.knots)
        };
        let lam = data.lam.or(Some(report.lam));
        let given = Data { lam, ..data };
        let profile = self.profile.map(|profile| at_knots(&profile, &self.knots, data.knots));
        let mut long = CurveFit::new(given, space.dim(), data.knots.to_vec(), points, options, self.robust);
        if let Some(profile) = profile {
            long.vary(space.dim(), profile);
        }
        (long.solved, long.progress.report) = (true, report);
        long
    }

    /// Computes A and its inverse from the velocities of a prolonged curve; without them there is no such curve.
    pub fn conclude(
        &mut self,
        space: &Erased,
        options: &Options,
        monitor: &Monitor,
        velocities: Option<Vec<f64>>,
    ) {
        let report = self.report();
        if matches!(report.state, State::NoCurve | State::Undetermined) {
            return;
        }
        let Some(velocities) = velocities else {
            self.progress.report.state = State::NoCurve;
            return;
        };
        self.velocities = velocities;
        self.advance(space, options, monitor, true);
        if self.progress.report.state != State::Undetermined {
            self.progress.report = report;
        }
    }

    /// The present curve.
    pub fn finish(self) -> Smooth {
        let report = self.report();
        let inverse = match &self.inverse {
            Some(inverse) => rows_of(inverse),
            None => vec![f64::NAN; self.linearized.basis.count() * 4],
        };
        Smooth {
            knots: self.knots,
            points: self.points,
            velocities: self.velocities,
            inverse,
            known: self.known,
            profile: self.profile,
            report,
        }
    }

    /// The report so far.
    pub fn report(&self) -> SmoothReport {
        self.progress.report
    }

    /// Velocities at the ends, transported from the first and the last data point to the ends of the curve.
    pub fn end_velocities(&self, space: &Erased) -> [Vec<f64>; 2] {
        let len = space.point_len();
        std::array::from_fn(|e| {
            let velocity = self.data.ends[e];
            if velocity.is_empty() {
                return Vec::new();
            }
            let at = |x: &[f64]| -> Vec<Lane> {
                let row = if e == 0 { &x[..len] } else { &x[x.len() - len..] };
                row.iter().map(|&x| lane(x)).collect()
            };
            let (y, x) = (at(self.data.points), at(&self.points));
            let (mut way, mut out) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
            let v: Vec<Lane> = velocity.iter().map(|&v| lane(v)).collect();
            space.log(&y, &x, &mut way);
            space.parallel_transport(&y, &x, &way, &v, &mut out);
            out.iter().map(|x| x.as_array()[0]).collect()
        })
    }

    /// Whether the last step was within a few standard deviations of the points, and was not taken back.
    pub fn steps_are_short(&self) -> bool {
        self.before.is_some() && self.retreats == 0 && self.progress.report.step < 3.0
    }

    /// Whether it is the result of [`CurveFit::prolonged`].
    pub fn is_prolonged(&self) -> bool {
        self.solved
    }

    /// Whether the iteration has ended.
    pub fn done(&self) -> bool {
        self.progress.report.state != State::Running
    }

    /// Halves the last step, because no spline joins the points.
    pub fn retreat(&mut self, space: &Erased, options: &Options) {
        self.retreats += 1;
        let Some((points, step)) = self.before.as_mut().filter(|_| self.retreats <= RETREATS) else {
            self.stiffen(options);
            return;
        };
        step.iter_mut().for_each(|x| *x *= 0.5);
        let (points, step) = (points.clone(), step.clone());
        self.go(space, &points, &step);
    }

    /// Restarts with a lower bound for λ, if λ is to be chosen.
    fn stiffen(&mut self, options: &Options) {
        let allowed = options.raise_lam && self.data.lam.is_none() && self.stiffenings < STIFFENINGS;
        let lam = self.progress.lam.filter(|_| allowed);
        let (Some(lam), Some(_)) = (lam, &self.before) else {
            self.progress.report.state = State::NoCurve;
            return;
        };
        self.stiffenings += 1;
        self.progress.least = STIFFER * lam;
        // The last stage of a robust fit takes λ from the stage before.
        let settled = self.progress.settled && self.robust.reweighs();
        self.progress.restart(if settled { Lam::Times(STIFFER) } else { Lam::Anew });
        self.progress.forced = false;
        (self.strays, self.before, self.retreats, self.objective) = (0, None, 0, f64::INFINITY);
        self.points = self.first.clone();
    }

    /// One iteration from the spline through the points, or the end; on all cores if no other curve is active.
    pub fn advance(&mut self, space: &Erased, options: &Options, monitor: &Monitor, alone: bool) {
        self.progress.report.iterations += 1;
        match self.next(space, options, monitor, alone) {
            Next::Retreat => self.retreat(space, options),
            Next::BeginAgain => self.begin_again(),
            Next::Stage(squares) => self.go_on(space, &squares),
            Next::End(state) => self.progress.report.state = state,
            Next::Profile(profile) => self.adapt(space, profile),
            Next::Step(step) => {
                let before = self.points.clone();
                self.go(space, &before, &step);
                self.before = Some((before, step));
            }
        }
    }

    /// Linearises the problem at the present curve, and determines what follows.
    fn next(&mut self, space: &Erased, options: &Options, monitor: &Monitor, alone: bool) -> Next {
        let velocities = self.end_velocities(space);
        let (data, linearized) = (&Data { weights: &self.weights, ..self.data }, &self.linearized);
        let (m, spacing) = (space.dim(), linearized.basis.spacing);
        let path = Path { t: &self.knots, points: &self.points, velocities: &self.velocities };
        let frames = Frames::new(space, &self.points);
        let mut residuals =
            Residuals::new(space, &path, &frames, &self.positions, linearized, data, &self.roots);
        let factors = self.robust.factors(&residuals.squares);
        if self.progress.settled && self.progress.report.exact {
            let objective = self.value(space, &residuals);
            if objective > self.objective * (1.0 + ROUNDING) && self.retreats < RETREATS {
                return Next::Retreat;
            }
            self.objective = objective;
        }
        self.retreats = 0;
        let whole = factors.as_ref().map(|factors| {
            let whole = residuals.misfit.clone();
            residuals.misfit.reweigh(linearized, factors, m);
            whole
        });
        let misfit = &residuals.misfit;
        let mut accelerations = frames.coordinates(&path.accelerations(space, &path.knots()), |i| i);
        let mut speeds = frames.coordinates(&self.velocities, |i| i);
        accelerations.iter_mut().for_each(|x| *x *= spacing * spacing);
        speeds.iter_mut().for_each(|x| *x *= spacing);
        let curvature = curvature_gradient(space, linearized, &speeds, &accelerations);
        let sigma = data.sigma.unwrap_or(f64::NAN);
        let closed = self.ends == EndConditions::Periodic;
        let periodic = closed.then(|| PeriodicCorrection { overlap: OVERLAP, m, turn: frames.round() });
        let seen_with = |misfit, jacobi| {
            Linear::new(linearized, m, misfit, jacobi, periodic.as_ref(), &accelerations, &curvature, sigma)
        };
        let (jacobi, later);
        jacobi = self
            .progress
            .with_curvature
            .then(|| JacobiOperator::new(space, linearized, &speeds, &accelerations).with_matrix(linearized));
        let mut linear = seen_with(misfit, jacobi.as_ref());
        let mut lam = self.progress.weigh(space, &linear, &speeds, &self.robust, options.criterion);
        if self.progress.with_curvature && linear.jacobi.is_none() {
            later = JacobiOperator::new(space, linearized, &speeds, &accelerations).with_matrix(linearized);
            linear = seen_with(misfit, Some(&later));
            lam = self.progress.weigh(space, &linear, &speeds, &self.robust, options.criterion);
        }
        let system = linear.factored(lam);
        if !(system.least_pivot() > 0.0) {
            return Next::End(State::Undetermined);
        }
        let band = system.inverse_band();
        let inverse = system.mean(&band);
        self.progress.note(&linear, &band, lam, 1.0);
        self.progress.report.objective = self.robust.misfit(&residuals.squares) + lam * linear.energy();

        let exact = !self.solved && self.progress.takes_gauss_newton(space, options.tier);
        if exact && self.strays > 0 {
            return Next::BeginAgain;
        }
        if exact && !self.progress.report.exact {
            // Earlier steps belong to the other solver.
            (self.progress.last_step, self.progress.slow, self.objective) = (f64::INFINITY, 0, f64::INFINITY);
        }
        self.progress.report.exact = exact;
        let (step, ambient) = if exact {
            let lam = lam * options.penalty.unit(spacing);
            let ends = self.ends.of_fit(&velocities);
            let ambient =
                self.gauss_newton_step(space, ends, &residuals, factors.as_deref(), lam, monitor, alone);
            (frames.coordinates(&ambient, |i| i), Some(ambient))
        } else {
            let change = linear.step(lam, &system);
            let mut step = vec![0.0; linearized.values.len() * m];
            if !self.solved {
                linearized
                    .values
                    .iter()
                    .zip(step.chunks_exact_mut(m))
                    .for_each(|(row, x)| row.apply(&change, x));
            }
            (step, None)
        };
        let deviations: Vec<f64> =
            linearized.values.iter().map(|row| (row.square(&inverse) * m as f64).sqrt()).collect();
        let reach = speeds.chunks_exact(m).map(length).sum::<f64>();
        let tol = self.robust.tol(options.tol);
        let small = self.progress.judge(&step, &deviations, reach, tol, self.robust.reweighs());
        self.inverse = Some(inverse);
        self.known = Some(linear.matrix(lam).known());
        if self.progress.settled && small && self.is_to_adapt() {
            let (misfit, along) = (&residuals.misfit, (&accelerations[..], periodic.as_ref()));
            return Next::Profile(self.found_profile(
                misfit,
                factors.as_deref(),
                m,
                along,
                lam,
                options.adapt,
            ));
        }
        let taken = self.progress.report.iterations - self.progress.begun;
        let over = taken >= self.robust.most(options.max_iter);
        let left = small && self.robust.leaves(&residuals.squares);
        if self.progress.settled && (left || (!self.robust.last() && (small || over))) {
            return Next::Stage(residuals.squares);
        }
        if self.progress.settled && small {
            if let (Some(mut whole), Some((factors, softness))) =
                (whole, self.robust.pseudo(&residuals.squares))
            {
                // Degrees of freedom and deviations of the M-estimator are those of its pseudo-data (Cox 1983).
                whole.soften(&factors, m);
                let linear = seen_with(&whole, linear.jacobi);
                let system = linear.factored(lam / softness);
                let band = system.inverse_band();
                self.inverse = Some(system.mean(&band));
                self.known = Some(linear.matrix(lam / softness).known());
                self.progress.note(&linear, &band, lam / softness, softness);
                if self.robust.selection == Selection::Sound
                    && self.robust.is_pulled(&residuals.squares, &factors, &self.leverages())
                {
                    self.robust.selection = Selection::Pulled;
                }
            }
            (self.progress.report.selection, self.progress.report.rejected) =
                (self.robust.selection, self.robust.rejected());
            return Next::End(if self.progress.unsettled { State::Unsettled } else { State::Converged });
        }
        // Beyond this distance the estimate is not valid. In a Euclidean space it is exact, and the curve may have a
        // long way to go where there are no data.
        let farthest = residuals.distances.iter().copied().fold(0.0, f64::max).sqrt() + 0.1 * reach;
        let ambient = ambient.unwrap_or_else(|| frames.tangents(&step));
        self.limited_step(space, options, over, farthest, &step, ambient)
    }

    /// The step of the points, at most `farthest` long, or the end of an iteration that diverges or is `over`. `ambient` are
    /// the tangent vectors of the step.
    fn limited_step(
        &mut self,
        space: &Erased,
        options: &Options,
        over: bool,
        farthest: f64,
        step: &[f64],
        mut ambient: Vec<f64>,
    ) -> Next {
        let flat = space.curvature() == 0.0;
        let counted = step.chunks_exact(space.dim()).zip(&self.supported).filter(|(_, near)| **near || !flat);
        let longest = counted.map(|(x, _)| length(x)).fold(0.0, larger);
        let further =
            if self.progress.settled { self.progress.further(step, self.robust.reweighs()) } else { 1.0 };
        let limited = longest * further > farthest;
        self.strays += usize::from(limited && self.progress.settled && !self.progress.report.exact);
        if self.strays > ASTRAY && self.progress.may_take_gauss_newton(space, options.tier) {
            return Next::BeginAgain;
        }
        if over || self.strays > ASTRAY {
            return Next::End(State::Unconverged);
        }
        let factor = if limited { farthest / longest } else { further };
        ambient.iter_mut().for_each(|x| *x *= factor);
        Next::Step(ambient)
    }

    /// Restarts with full Gauss–Newton, which could fail from an iterate where the linearised solver diverged.
    fn begin_again(&mut self) {
        (self.strays, self.before, self.retreats) = (0, None, 0);
        (self.progress.last_step, self.progress.slow, self.objective) = (f64::INFINITY, 0, f64::INFINITY);
        self.progress.forced = true;
        if self.data.lam.is_none() {
            (self.progress.settled, self.progress.lam, self.progress.report.rounds) = (false, None, 0);
        }
        self.points = self.first.clone();
    }

    /// J of the present curve.
    fn value(&self, space: &Erased, residuals: &Residuals) -> f64 {
        let lam =
            self.progress.lam.unwrap_or(0.0) * Penalty::Acceleration.unit(self.linearized.basis.spacing);
        self.robust.misfit(&residuals.squares)
            + lam * gauss_newton::energy(space, &self.path(), &self.linearized.profile)
    }

    fn path(&self) -> Path<'_> {
        Path { t: &self.knots, points: &self.points, velocities: &self.velocities }
    }

    /// The step of full Gauss–Newton, as tangent vectors.
    fn gauss_newton_step(
        &self,
        space: &Erased,
        ends: Ends,
        residuals: &Residuals,
        factors: Option<&[f64]>,
        lam: f64,
        monitor: &Monitor,
        alone: bool,
    ) -> Vec<f64> {
        let pull = Pull {
            positions: &self.positions,
            points: &residuals.gammas,
            vectors: &residuals.vectors,
            factors,
            weights: &self.weights,
            information: residuals
                .transported
                .as_ref()
                .map(|transported| (&self.roots[..], &transported[..])),
        };
        let lam = (lam, &self.linearized.profile[..]);
        gauss_newton::step(space, &self.path(), ends, &pull, lam, monitor, alone)
    }

    /// Moves the points.
    fn go(&mut self, space: &Erased, from: &[f64], step: &[f64]) {
        self.points = moved(space, from, step);
        if self.ends == EndConditions::Periodic {
            let (len, last) = (space.point_len(), self.points.len() - space.point_len());
            self.points.copy_within(..len, last);
        }
    }

    /// Whether it is time to find how λ and σ vary: at a curve with one λ, and again at one where they vary. For a robust
    /// loss, the first time is that before data are rejected, because with one λ those of a burst would be outliers.
    fn is_to_adapt(&self) -> bool {
        let first = self.adaptations == ADAPTATIONS;
        self.adaptations > 0
            && !self.solved
            && match self.robust.stage {
                Stage::Plain | Stage::Chosen => true,
                Stage::Rejecting => first,
                Stage::Final => false,
            }
    }

    /// How λ and σ vary, from the residuals at the present curve.
    fn found_profile(
        &self,
        misfit: &Misfit,
        factors: Option<&[f64]>,
        m: usize,
        (accelerations, periodic): (&[f64], Option<&PeriodicCorrection>),
        lam: f64,
        vary: Adapt,
    ) -> Profile {
        let mut linearized = Cow::Borrowed(&self.linearized);
        let mut misfit = Cow::Borrowed(misfit);
        if self.profile.as_ref().is_some_and(Profile::varies) {
            let ones = vec![1.0; self.linearized.profile.len()];
            let base = if self.data.profile.is_empty() || vary.lam { &ones } else { self.data.profile };
            linearized.to_mut().set_profile(base);
            let back: Vec<f64> =
                self.data.weights.iter().zip(&self.weights).map(|(w, own)| w / own).collect();
            misfit.to_mut().reweigh(&linearized, &back, m);
        }
        let mut weights = self.data.weights.to_vec();
        if let Some(factors) = factors {
            weights.iter_mut().zip(factors).for_each(|(w, factor)| *w *= factor);
        }
        let penalty = linearized.penalised;
        let lam: Vec<f64> = self.linearized.profile.iter().map(|profile| lam * profile).collect();
        let used = self.positions.iter().zip(&weights).filter(|(_, w)| **w > 0.0);
        let measured: Vec<Position> = used.map(|(position, _)| *position).collect();
        let deviations = misfit.deviations(&weights, self.data.times, m);
        let local = Local { linearized: &linearized, m, misfit: &misfit, periodic, accelerations };
        let mut profile = Adaptive {
            basis: &linearized.basis,
            penalised: penalty,
            m,
            left: Some(m as f64 * (misfit.count(m) - linearized.null())),
            process: linearized.free() as f64 - linearized.null(),
            positions: &self.positions,
            weights: &weights,
            deviations: &deviations,
            measured: &measured,
            lam: &lam,
            stiffest: linearized.balance() * penalty.stiffest(self.knots.len()),
            given: self.data.lam.is_some(),
            sums: &|tracks: &[Track]| local.sums(tracks),
        }
        .profile(vary);
        if self.robust.stage == Stage::Plain {
            let outlier = misfit.isolated_outlier(self.data.times, &deviations, m);
            profile.outlier = outlier.map_or(f64::NAN, |k| self.data.times[k]);
        }
        profile
    }

    /// Continues with λ and σ that vary, or with one of each.
    fn adapt(&mut self, space: &Erased, profile: Profile) {
        let before = self.profile.as_ref().is_some_and(Profile::varies);
        self.adaptations -= 1;
        // The linear problem of a flat space does not depend on the curve.
        if self.robust.stage == Stage::Plain && (space.curvature() == 0.0 || !profile.varies()) {
            self.adaptations = 0;
        }
        if !profile.varies() && !before {
            self.profile = Some(profile);
            return;
        }
        self.vary(space.dim(), profile);
        // The iteration begins here if it has to begin again.
        self.first.clone_from(&self.points);
        self.progress.restart(if self.data.lam.is_some() { Lam::Same } else { Lam::Anew });
        (self.strays, self.before, self.retreats, self.objective) = (0, None, 0, f64::INFINITY);
    }

    /// Sets λ of the segments and the noise of the data.
    fn vary(&mut self, m: usize, profile: Profile) {
        if !profile.lam.is_empty() {
            self.linearized.set_profile(&profile.lam);
        } else if self.data.profile.is_empty() {
            self.linearized.set_profile(&vec![1.0; self.knots.len() - 1]);
        }
        self.weights = self.data.weights.to_vec();
        let mut information = self.data.information.to_vec();
        if !profile.noise.is_empty() {
            let noise = at_times(&self.knots, &profile.noise, self.data.times);
            let factors: Vec<f64> = noise.iter().map(|noise| (-noise).exp()).collect();
            self.weights.iter_mut().zip(&factors).for_each(|(w, factor)| *w *= factor);
            let matrices = information.chunks_exact_mut(m * m).zip(&factors);
            matrices.for_each(|(matrix, factor)| matrix.iter_mut().for_each(|x| *x *= factor));
        }
        self.roots = information::roots(&information, m);
        self.linearized.gram = self.linearized.gram_of(&self.weights);
        self.profile = Some(profile);
    }

    /// The variances of the curve at the data, divided by those of the data.
    fn leverages(&self) -> Vec<f64> {
        let leverage =
            |(row, w): (&Stencil, &f64)| self.inverse.as_ref().map_or(0.0, |inverse| w * row.square(inverse));
        self.linearized.data.iter().zip(&self.weights).map(leverage).collect()
    }

    /// Starts the next stage of a robust fit.
    fn go_on(&mut self, space: &Erased, squares: &[f64]) {
        let leverages = self.leverages();
        let freedom = self.progress.report.freedom;
        let lam = self.progress.lam;
        let data = self.data;
        let deviations = |chosen: &[usize]| deviations(space, data.times, data.points, chosen);
        let at = AtCurve {
            times: data.times,
            squares,
            leverages: &leverages,
            freedom,
            lam,
            deviations: &deviations,
        };
        let lam = self.robust.next(&at);
        self.progress.restart(lam);
        (self.objective, self.before, self.strays) = (f64::INFINITY, None, 0);
    }
}
