//! The iteration of an estimate: linearise all measurements, solve the banded problem, move the curve.

use crate::along::{Along, Bending};
use crate::body::Body;
use crate::estimation::{Estimate, Estimation, Factor, Matrices, Measurements};
use crate::motion::{BadRow, Motion};
use crate::path::{moved, positions};
use crate::posterior::Posterior;
use crate::problem::{Criterion, EndCondition, EndConditions, Loss, Penalty, Profile};
use crate::terms::{Columns, Linearised, Term};
use symspline_core::curve::{Curves, Outside, Quantity, Times, evaluate};
use symspline_core::fit::{Method, Options as FitOptions, Problem as Fit, Status, fit};
use symspline_core::monitor::{Monitor, checkpoint};
use symspline_core::space::{Ambient, Erased, Origin};

/// λ has converged if its logarithm changes by less than the first number; after so many rounds it is kept.
const SETTLED: f64 = 3e-3;
const ROUNDS: usize = 12;
/// Steps of more standard deviations than this lead from a linearisation that is not yet informative about λ.
const NEAR: f64 = 3.0;
/// The number of times that a step is halved.
const RETREATS: i32 = 6;
/// Steps whose ratio to the one before is below this number alternate in direction and are shortened.
const BACK: f64 = -0.3;
/// The relative accuracy of the objective: a step changes it by less where the gradient is that of the linear problem.
const ROUNDING: f64 = 1e-5;
/// Parameters are not determined if the measurements leave less than this fraction of their information.
const SINGULAR: f64 = 1e-12;
/// The steps of differences of the objective, as a fraction of a standard deviation.
const SMALL: f64 = 0.05;
/// The tolerance of the splines through the points.
const FIT: FitOptions = FitOptions { method: Method::Auto, tol: 1e-12, max_iter: None, certify: None };

/// An unknown constant number.
#[derive(Clone, Copy)]
pub struct Constant {
    /// The mean of its prior.
    pub mean: f64,
    /// The precision of its prior; 0 without a prior.
    pub precision: f64,
}

/// The problem of an estimate.
pub struct Problem<'a> {
    /// The parts of the space.
    pub spaces: &'a [Erased<'a>],
    /// Groups whose metric is invariant on both sides, by part.
    pub bodies: &'a [Option<Body<'a>>],
    /// Increasing knots.
    pub knots: &'a [f64],
    /// The measurements.
    pub terms: &'a [Term<'a>],
    /// The parameters.
    pub constants: &'a [Constant],
    /// The derivative whose square is penalised.
    pub penalty: Penalty,
    /// λ of every segment divided by λ, for each part; empty for one λ.
    pub profiles: &'a [Vec<f64>],
}

/// How to iterate.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// λ of each part; None to choose it.
    pub lams: &'a [Option<f64>],
    /// If the initial curve is close to the result, the λ near which the result has its λ; otherwise None.
    pub near: &'a [Option<f64>],
    /// The criterion that chooses λ.
    pub criterion: Criterion,
    /// The iteration ends when a step is below this number of standard deviations.
    pub tol: f64,
    /// Maximum number of iterations.
    pub max_iter: usize,
}

/// The curve in every part, and the values of the parameters.
#[derive(Clone, Default)]
pub struct State {
    /// Points at the knots.
    pub points: Vec<Vec<f64>>,
    /// Velocities there.
    pub velocities: Vec<Vec<f64>>,
    /// Parameters.
    pub values: Vec<f64>,
}

/// Why there is no result.
#[derive(Debug)]
pub enum Invalid {
    /// No spline joins the initial points.
    Start,
    /// A time offset moves a measurement beyond the knots.
    Outside(usize),
    /// An operation of a space failed.
    Row(BadRow),
    /// The measurements do not determine the parameters, about which they leave this information.
    Parameters(Vec<f64>),
}

impl From<BadRow> for Invalid {
    fn from(row: BadRow) -> Self {
        Invalid::Row(row)
    }
}

/// Why the iteration failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The measurements do not determine the curve.
    Undetermined,
    /// The linear problem has no finite solution.
    Infinite,
    /// No spline joins the points of the next iteration.
    NoCurve,
    /// The last step is not small.
    Unconverged,
}

/// The result of the iteration.
pub struct Solution {
    /// The curve and the parameters.
    pub state: State,
    /// The failure, if any.
    pub failure: Option<Failure>,
    /// The last linear problem, and its matrices.
    pub linear: Linear,
    /// Whitened residuals of each term, their derivatives, and the roots of the weights of a robust loss.
    pub terms: Vec<(Linearised, Vec<f64>)>,
    /// The sum of the losses of all measurements and of the priors.
    pub loss: f64,
    /// The number of iterations.
    pub iterations: usize,
    /// The last step in standard deviations, and its ratio to the one before.
    pub step: f64,
    /// The ratio of the last two steps.
    pub rate: f64,
    /// The largest distance that the curve covers between two knots, in units of the radius of curvature of its space.
    pub turn: f64,
}

/// The solution of the linear problem at a curve.
pub struct Linear {
    /// The solution.
    pub found: Estimate,
    /// The sum of squared residuals, and their number.
    pub squares: (f64, usize),
    /// A: band, side and corner.
    pub matrices: Matrices,
}

impl<'a> Problem<'a> {
    /// End conditions of the curves.
    pub fn ends(&self) -> EndConditions {
        EndConditions::Open(match self.penalty {
            Penalty::Acceleration => [EndCondition::Natural; 2],
            Penalty::Jerk => [EndCondition::NotAKnot; 2],
        })
    }

    /// The first coordinate of each part, and their number.
    fn first(&self) -> Vec<usize> {
        (0..=self.spaces.len()).map(|part| self.spaces[..part].iter().map(Origin::dim).sum()).collect()
    }

    fn spacing(&self) -> f64 {
        let last = self.knots.len() - 1;
        (self.knots[last] - self.knots[0]) / last as f64
    }

    /// The splines through points; None if one of them does not exist.
    pub fn fitted(&self, points: Vec<Vec<f64>>, values: Vec<f64>, monitor: &Monitor) -> Option<State> {
        let offsets = [0, self.knots.len()];
        let nothing = [(); 2].map(|_| Vec::new());
        let fitted = |(space, points): (&Erased, &Vec<f64>)| {
            let mut velocities = vec![0.0; points.len()];
            let ends = self.ends().of_fit(&nothing);
            let problem = Fit { t: self.knots, shared: true, points, offsets: &offsets, ends };
            let reports = fit(space, &problem, &FIT, monitor, &mut velocities);
            checkpoint();
            (reports[0].status == Status::Converged).then_some(velocities)
        };
        let velocities = self.spaces.iter().zip(&points).map(fitted).collect::<Option<Vec<_>>>()?;
        Some(State { points, velocities, values })
    }

    /// The frames along the curve in every part.
    pub fn along<'s>(&'s self, state: &'s State) -> Vec<Along<'s>> {
        let curves = self.spaces.iter().zip(&state.points).zip(&state.velocities);
        curves
            .map(|((space, points), velocities)| Along::new(space, self.knots, points, velocities))
            .collect()
    }

    fn evaluated(
        &self,
        state: &State,
        part: usize,
        x: &[f64],
        quantity: Quantity,
        monitor: &Monitor,
    ) -> Vec<f64> {
        let (points, velocities) = (&state.points[part], &state.velocities[part]);
        let curves = Curves { t: self.knots, nodes: self.knots.len(), points, velocities, before: &[] };
        let (space, times) = (&self.spaces[part], Times { x, count: x.len() });
        let mut out = vec![0.0; x.len() * quantity.len(space)];
        evaluate(space, &curves, &times, quantity, Outside::Continue, monitor, &mut out);
        out
    }

    /// The motion of a part at times x, with derivatives up to an order, and with or without frames.
    fn motion(
        &'a self,
        state: &State,
        along: &[Along],
        x: &[f64],
        (part, nu, with_frames): (usize, usize, bool),
        monitor: &Monitor,
    ) -> Result<Motion<'a>, Invalid> {
        let (begin, end) = (self.knots[0], self.knots[self.knots.len() - 1]);
        if let Some(at) = x.iter().position(|x| !(begin..=end).contains(x)) {
            return Err(Invalid::Outside(at));
        }
        let derivative = |order: usize, quantity: Quantity| {
            if nu < order { Vec::new() } else { self.evaluated(state, part, x, quantity, monitor) }
        };
        let p = derivative(0, Quantity::Point);
        let (v, a) = (derivative(1, Quantity::Velocity), derivative(2, Quantity::Acceleration));
        let frames = if with_frames { along[part].frames(x, &p) } else { Vec::new() };
        Ok(Motion { space: &self.spaces[part], p, v, a, frames })
    }

    /// Linearises all measurements.
    pub fn linearised(
        &'a self,
        state: &State,
        along: &[Along],
        monitor: &Monitor,
    ) -> Result<Vec<Linearised>, Invalid> {
        let first = self.first();
        let columns = Columns { first: &first, parameters: self.constants.len() };
        let motion_at = |x: &[f64], asked| self.motion(state, along, x, asked, monitor);
        let linearised =
            |term: &Term| term.linearised(&motion_at, &state.values, self.spacing(), &columns, monitor);
        self.terms.iter().map(linearised).collect()
    }

    /// The residuals of all measurements. Times beyond the knots are moved to the first or the last knot if `clipped`.
    pub fn residuals(
        &'a self,
        state: &State,
        clipped: bool,
        monitor: &Monitor,
    ) -> Result<Vec<Linearised>, Invalid> {
        let along = self.along(state);
        let (begin, end) = (self.knots[0], self.knots[self.knots.len() - 1]);
        let motion_at = |x: &[f64], asked| self.motion(state, &along, x, asked, monitor);
        let residuals = |term: &Term| {
            let mut times = term.shifted(&state.values);
            if clipped {
                times.iter_mut().for_each(|t| *t = t.clamp(begin, end));
            }
            term.residuals_at(&motion_at, &state.values, &times, monitor)
        };
        self.terms.iter().map(residuals).collect()
    }

    /// The roots of the weights of robust losses, and the sum of all losses.
    fn weighted(&self, linear: &[Linearised], values: &[f64]) -> (Vec<Vec<f64>>, f64) {
        let (mut weights, mut sum) = (Vec::new(), 0.0);
        for (own, term) in linear.iter().zip(self.terms) {
            let (squares, corner) = (own.squares(), term.loss.corner(own.size));
            sum += squares.iter().map(|square| term.loss.value(*square, corner)).sum::<f64>();
            weights.push(match term.loss {
                Loss::Linear => Vec::new(),
                loss => squares.iter().map(|square| loss.weight(square / (corner * corner)).sqrt()).collect(),
            });
        }
        let priors = self.constants.iter().zip(values);
        sum += priors.map(|(own, x)| own.precision * (x - own.mean).powi(2)).sum::<f64>();
        (weights, sum)
    }

    /// The integral of the squared acceleration or jerk of a part.
    fn energy(&self, state: &State, part: usize, bending: &Bending, monitor: &Monitor) -> f64 {
        let profile = &self.profiles[part];
        let weight = |(i, t): (usize, &[f64])| profile.get(i).unwrap_or(&1.0) * (t[1] - t[0]);
        let h = self.knots.windows(2).enumerate().map(weight);
        if self.penalty == Penalty::Jerk {
            let m = self.spaces[part].dim();
            let unit = self.spacing().powi(2);
            let jumps = bending.accelerations.windows(m + 1).map(|x| ((x[m] - x[0]) / unit).powi(2));
            let lengths = self.knots.windows(2).map(|t| t[1] - t[0]);
            // The integral of the squared difference quotient.
            let factors = h.zip(lengths).map(|(weight, h)| weight / (h * h));
            return jumps
                .zip(factors.flat_map(|x| std::iter::repeat_n(x, m)))
                .map(|(square, x)| square * x)
                .sum();
        }
        // Two points per segment.
        let root = 0.5 / 3f64.sqrt();
        let inner = self.knots.windows(2).map(|t| (t[0], t[1] - t[0]));
        let x: Vec<f64> = inner.flat_map(|(t, h)| [t + h * (0.5 - root), t + h * (0.5 + root)]).collect();
        let norms = self.evaluated(state, part, &x, Quantity::AccelerationNorm, monitor);
        norms.chunks_exact(2).zip(h).map(|(x, h)| 0.5 * h * (x[0] * x[0] + x[1] * x[1])).sum()
    }

    /// The sum of all losses and of the penalties.
    fn objective(&'a self, state: &State, lams: &[f64], monitor: &Monitor) -> Result<f64, Invalid> {
        let (_, loss) = self.weighted(&self.residuals(state, false, monitor)?, &state.values);
        let along = self.along(state);
        let energy = |part: usize| self.energy(state, part, &along[part].bending(), monitor);
        Ok(loss + lams.iter().enumerate().map(|(part, lam)| lam * energy(part)).sum::<f64>())
    }

    /// The linear problem at a curve, which is passed to a function.
    fn with_linear<T>(
        &self,
        (state, along, bending): (&State, &[Along], &[Bending]),
        (linear, weights): (&[Linearised], &[Vec<f64>]),
        monitor: &Monitor,
        work: impl FnOnce(&Estimation) -> T,
    ) -> T {
        let half_brackets = |part: usize| {
            let Some(body) = &self.bodies[part] else { return Vec::new() };
            let point = &state.points[part][..body.space.point_len()];
            // They are the same at all knots.
            body.half_brackets(point, &along[part].frames(&self.knots[..1], point), monitor)
        };
        let halves: Vec<Vec<f64>> = (0..self.spaces.len()).map(half_brackets).collect();
        let parts = self.spaces.iter().zip(bending).zip(&halves).zip(self.profiles);
        let factors = parts.map(|(((space, bending), halves), profile)| Factor {
            space,
            speeds: &bending.speeds,
            accelerations: &bending.accelerations,
            profile,
            halves,
        });
        let priors: Vec<(f64, f64)> =
            self.constants.iter().zip(&state.values).map(|(own, x)| (own.precision, x - own.mean)).collect();
        let mut problem = Estimation::new(self.knots, self.ends(), self.penalty, factors.collect(), &priors);
        for ((term, own), weights) in self.terms.iter().zip(linear).zip(weights) {
            let positions = positions(self.knots, &term.shifted(&state.values));
            let robust = (!weights.is_empty()).then(|| own.times(weights));
            let own = robust.as_ref().unwrap_or(own);
            problem.add(&Measurements {
                positions: &positions,
                residuals: &own.residuals,
                size: own.size,
                jacobians: own.jacobians.each_ref().map(|x| &x[..]),
                parameters: &own.parameters,
            });
        }
        work(&problem)
    }

    /// Solves the linear problem at a curve.
    fn solve(
        &self,
        at: (&State, &[Along], &[Bending]),
        measured: (&[Linearised], &[Vec<f64>]),
        (given, near): (&[Option<f64>], &[Option<f64>]),
        (criterion, monitor): (Criterion, &Monitor),
    ) -> Linear {
        self.with_linear(at, measured, monitor, |problem| {
            let found = problem.solve(given, near, criterion);
            let lams: Vec<f64> = found.lams.iter().map(|(lam, _)| *lam).collect();
            Linear { matrices: problem.matrices(&lams), squares: problem.residuals(), found }
        })
    }

    /// How λ varies in some parts, at a curve with one λ in each part.
    pub fn varying(
        &'a self,
        state: &State,
        lams: &[f64],
        parts: &[usize],
        monitor: &Monitor,
    ) -> Result<Vec<Profile>, Invalid> {
        let along = self.along(state);
        let linear = self.linearised(state, &along, monitor)?;
        let (weights, _) = self.weighted(&linear, &state.values);
        let bending: Vec<Bending> = along.iter().map(Along::bending).collect();
        let at = (state, &along[..], &bending[..]);
        let (begin, end) = (self.knots[0], self.knots[self.knots.len() - 1]);
        let measured = |part: usize| {
            let terms = self.terms.iter().filter(|term| term.parts.contains(&part));
            let times = terms.flat_map(|term| term.shifted(&state.values)).map(|t| t.clamp(begin, end));
            let mut times: Vec<f64> = times.collect();
            times.sort_by(f64::total_cmp);
            positions(self.knots, &times)
        };
        Ok(self.with_linear(at, (&linear, &weights), monitor, |problem| {
            parts.iter().map(|&part| problem.profile(part, lams, &measured(part))).collect()
        }))
    }

    /// The step at the knots, m numbers each, as tangent vectors in every part.
    fn tangents(&self, along: &[Along], step: &[f64]) -> Vec<Vec<f64>> {
        let first = &self.first();
        let m = first[self.spaces.len()];
        let own =
            |part: usize| step.chunks_exact(m).flat_map(move |x| &x[first[part]..first[part + 1]]).copied();
        along
            .iter()
            .enumerate()
            .map(|(part, along)| along.tangents(&own(part).collect::<Vec<f64>>()))
            .collect()
    }

    /// The largest distance that the curve covers between two knots, in units of the radius of curvature of its space.
    /// Spaces without curvature have none.
    fn turn(&self, bending: &[Bending]) -> f64 {
        let most = |(space, bending): (&Erased, &Bending)| {
            let radius = space.injectivity_radius();
            if space.curvature() == 0.0 || !radius.is_finite() {
                return 0.0;
            }
            let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt() / self.spacing();
            let speeds: Vec<f64> = bending.speeds.chunks_exact(space.dim()).map(norm).collect();
            let steps = self.knots.windows(2).map(|t| t[1] - t[0]);
            let each = speeds.windows(2).zip(steps).map(|(v, h)| v[0].max(v[1]) * h);
            each.fold(0.0, f64::max) * std::f64::consts::PI / radius
        };
        self.spaces.iter().zip(bending).map(most).fold(0.0, f64::max)
    }

    /// Iterates until the step is small. `progress` receives the number of each iteration.
    pub fn solved(
        &'a self,
        points: Vec<Vec<f64>>,
        values: Vec<f64>,
        options: &Options,
        progress: &dyn Fn(usize),
        monitor: &Monitor,
    ) -> Result<Solution, Invalid> {
        let mut choice = Choice::new(options.lams, options.near);
        let mut relaxation = Relaxation::default();
        let mut before: Option<Step> = None;
        let (mut objective, mut retreats) = (f64::INFINITY, 0);
        let (mut last, mut rate) = (f64::INFINITY, f64::NAN);
        let mut size = if options.near.contains(&None) { f64::INFINITY } else { NEAR };
        let mut state = self.fitted(points, values, monitor).ok_or(Invalid::Start)?;
        for number in 1.. {
            let along = self.along(&state);
            let linear = self.linearised(&state, &along, monitor)?;
            let (weights, loss) = self.weighted(&linear, &state.values);
            let bending: Vec<Bending> = along.iter().map(Along::bending).collect();
            let (given, near) = choice.asked(size);
            let at = (&state, &along[..], &bending[..]);
            let solved = self.solve(at, (&linear, &weights), (&given, &near), (options.criterion, monitor));
            let found = &solved.found;
            let energies =
                bending.iter().enumerate().map(|(part, own)| self.energy(&state, part, own, monitor));
            let value =
                loss + found.lams.iter().zip(energies).map(|((lam, _), energy)| lam * energy).sum::<f64>();
            checkpoint();
            progress(number);
            let mut next = Next::Curve;
            if !found.determined {
                next = Next::Failure(Failure::Undetermined);
            } else if is_singular(&found.information) {
                return Err(Invalid::Parameters(found.information.clone()));
            } else if !is_finite(found) {
                next = Next::Failure(Failure::Infinite);
            }
            let mut curve = None;
            if next == Next::Curve {
                let too_long = choice.settled && value > objective * (1.0 + ROUNDING) && retreats < RETREATS;
                if let Some(step) = before.as_ref().filter(|_| too_long) {
                    retreats += 1;
                    curve = self.moved(step, 0.5f64.powi(retreats), monitor);
                } else {
                    retreats = 0;
                    objective = if choice.settled { value } else { f64::INFINITY };
                    choice.update(&found.lams, size);
                    size = largest(found, self.knots.len());
                    let longest = found.step.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                    rate = if last > 0.0 && last.is_finite() { longest / last } else { f64::NAN };
                    last = longest;
                    if choice.settled && (size <= options.tol || longest == 0.0) {
                        next = Next::Converged;
                    } else {
                        let tangents = self.tangents(&along, &found.step);
                        let step = Step { from: state.clone(), tangents, changes: found.parameters.clone() };
                        curve = self.moved(&step, relaxation.factor(found), monitor);
                        before = Some(step);
                    }
                }
            }
            if next == Next::Curve {
                while let (None, Some(step), true) = (&curve, &before, retreats < RETREATS) {
                    retreats += 1;
                    curve = self.moved(step, 0.5f64.powi(retreats), monitor);
                }
                match curve {
                    None => next = Next::Failure(Failure::NoCurve),
                    Some(curve) => {
                        state = curve;
                        if number >= options.max_iter {
                            next = Next::Failure(Failure::Unconverged);
                        }
                    }
                }
            }
            if next != Next::Curve {
                let turn = self.turn(&bending);
                return Ok(Solution {
                    state,
                    failure: if let Next::Failure(failure) = next { Some(failure) } else { None },
                    linear: solved,
                    terms: linear.into_iter().zip(weights).collect(),
                    loss,
                    iterations: number,
                    step: size,
                    rate,
                    turn,
                });
            }
        }
        unreachable!("the number of iterations is limited")
    }

    /// Moves points and parameters by a part of a step; None if no splines join the points.
    fn moved(&self, step: &Step, factor: f64, monitor: &Monitor) -> Option<State> {
        let points = self.spaces.iter().zip(&step.from.points).zip(&step.tangents);
        let points = points.map(|((space, points), tangents)| {
            let way: Vec<f64> = tangents.iter().map(|x| factor * x).collect();
            moved(space, points, &way)
        });
        let values = step.from.values.iter().zip(&step.changes).map(|(x, change)| x + factor * change);
        self.fitted(points.collect(), values.collect(), monitor)
    }

    /// The distance from the minimum of the objective in standard deviations, the Newton decrement.
    ///
    /// The linear problem moves the curve by splines in frames along it. Where the curve turns far between knots, these
    /// differ from the splines through the moved points, and the minima differ as well. With samples ξ of the posterior
    /// N(0, A⁻¹) and the gradient g, the squared decrement gᵀA⁻¹g is the mean of (gᵀξ)².
    pub fn distance(
        &'a self,
        state: State,
        lams: &[f64],
        band: &[f64],
        normal: &[f64],
        monitor: &Monitor,
    ) -> Result<f64, Invalid> {
        let m = self.first()[self.spaces.len()];
        let posterior = Posterior::new(self.knots, self.ends(), m, [band, &[], &[]], &[]);
        let moves = posterior.samples(normal);
        let mut step = Step { changes: vec![0.0; self.constants.len()], tangents: Vec::new(), from: state };
        let (mut sum, mut count) = (0.0, 0.0f64);
        for own in moves.chunks_exact(self.knots.len() * m) {
            step.tangents = self.tangents(&self.along(&step.from), own);
            let sides = [SMALL, -SMALL].map(|size| self.moved(&step, size, monitor));
            if let [Some(after), Some(before)] = &sides {
                let [after, before] =
                    [self.objective(after, lams, monitor)?, self.objective(before, lams, monitor)?];
                sum += ((after - before) / (4.0 * SMALL)).powi(2);
                count += 1.0;
            }
        }
        Ok((sum / count.max(1.0)).sqrt())
    }
}

/// What an iteration leads to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Next {
    Curve,
    Converged,
    Failure(Failure),
}

/// A step: where it begins, tangent vectors at the points in every part, and changes of the parameters.
struct Step {
    from: State,
    tangents: Vec<Vec<f64>>,
    changes: Vec<f64>,
}

impl Linearised {
    /// Residuals and derivatives times weights.
    fn times(&self, weights: &[f64]) -> Linearised {
        let times = |x: &[f64]| -> Vec<f64> {
            let rows = x.chunks_exact((x.len() / weights.len()).max(1)).zip(weights);
            rows.flat_map(|(row, weight)| row.iter().map(move |x| x * weight)).collect()
        };
        Linearised {
            size: self.size,
            residuals: times(&self.residuals),
            jacobians: self.jacobians.each_ref().map(|x| times(x)),
            parameters: times(&self.parameters),
        }
    }
}

/// The choice of λ during the iteration.
struct Choice {
    lams: Vec<Option<f64>>,
    found: Vec<Option<f64>>,
    settled: bool,
    rounds: usize,
}

impl Choice {
    fn new(lams: &[Option<f64>], near: &[Option<f64>]) -> Self {
        let settled = lams.iter().all(Option::is_some);
        Choice { lams: lams.to_vec(), found: near.to_vec(), settled, rounds: 0 }
    }

    /// The λ that are fixed and those near which the others are chosen, after a step of a size.
    fn asked(&self, size: f64) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
        let nothing = vec![None; self.lams.len()];
        if self.settled {
            return (self.lams.iter().zip(&self.found).map(|(lam, found)| lam.or(*found)).collect(), nothing);
        }
        // Far from the solution, λ is chosen from its whole range.
        (self.lams.clone(), if size <= NEAR { self.found.clone() } else { nothing })
    }

    /// Records the λ that were chosen after a step of a size.
    fn update(&mut self, lams: &[(f64, bool)], size: f64) {
        if self.settled {
            return;
        }
        let near = size < NEAR;
        self.rounds += usize::from(near);
        let moved = |((lam, _), found): (&(f64, bool), &Option<f64>)| {
            found.map_or(f64::INFINITY, |found| (lam / found).ln().abs())
        };
        let chosen = lams.iter().zip(&self.found).zip(&self.lams).filter(|(_, given)| given.is_none());
        let steady = chosen.map(|(pair, _)| moved(pair)).all(|moved| moved < SETTLED);
        self.settled = near && steady || self.rounds >= ROUNDS;
        // If λ oscillates, the mean is used.
        let oscillates = self.rounds > ROUNDS / 2 && !self.settled;
        for (found, (lam, _)) in self.found.iter_mut().zip(lams) {
            *found = Some(found.filter(|_| oscillates).map_or(*lam, |found| (lam * found).sqrt()));
        }
    }
}

/// Shortens steps while the iteration oscillates.
///
/// The linear problem does not contain the interaction of a time offset with fast motion, so that steps may be twice as
/// long as the distance to the solution. The factor is that of the secant through two steps (Barzilai and Borwein 1988).
struct Relaxation {
    last: Vec<f64>,
    factor: f64,
}

impl Default for Relaxation {
    fn default() -> Self {
        Relaxation { last: Vec::new(), factor: 1.0 }
    }
}

impl Relaxation {
    /// The fraction of a step that is to be taken.
    fn factor(&mut self, found: &Estimate) -> f64 {
        let [of_points, of_parameters] = &found.variances;
        let numbers = found.step.iter().chain(&found.parameters).zip(of_points.iter().chain(of_parameters));
        let step: Vec<f64> = numbers.map(|(x, variance)| x / variance.sqrt()).collect();
        let last = std::mem::replace(&mut self.last, step);
        let square: f64 = last.iter().map(|x| x * x).sum();
        if !(square > 0.0 && square < f64::INFINITY) {
            return 1.0;
        }
        let ratio = self.last.iter().zip(&last).map(|(x, y)| x * y).sum::<f64>() / square;
        let shortened = self.factor < 1.0 || ratio < BACK;
        self.factor =
            if shortened && ratio < 1.0 { (self.factor / (1.0 - ratio)).clamp(0.1, 1.0) } else { 1.0 };
        self.factor
    }
}

/// Whether the measurements leave hardly any information about a combination of the parameters: whether the smallest
/// eigenvalue of the information, scaled to a unit diagonal, is below [`SINGULAR`]. Without that part of the diagonal,
/// the matrix then has no Cholesky factor.
fn is_singular(information: &[f64]) -> bool {
    let p = information.len().isqrt();
    if !information.iter().all(|x| x.is_finite()) {
        return false;
    }
    let size: Vec<f64> = (0..p).map(|i| information[i * p + i].max(0.0).sqrt()).collect();
    let mut factor = vec![0.0; p * p];
    for i in 0..p {
        checkpoint();
        for j in 0..=i {
            let (before, row) = factor.split_at_mut(i * p);
            let other = if j < i { &before[j * p..][..j] } else { &row[..j] };
            let known: f64 = row[..j].iter().zip(other).map(|(x, y)| x * y).sum();
            let rest = information[i * p + j] / size[i] / size[j] - known;
            if j < i {
                row[j] = rest / before[j * p + j];
            } else if rest > SINGULAR {
                row[j] = (rest - SINGULAR).sqrt();
            } else {
                return true;
            }
        }
    }
    false
}

fn is_finite(found: &Estimate) -> bool {
    let numbers =
        [&found.step, &found.parameters, &found.information, &found.variances[0], &found.variances[1]];
    numbers.iter().all(|own| own.iter().all(|x| x.is_finite()))
}

/// The largest step in standard deviations of the points and parameters.
fn largest(found: &Estimate, knots: usize) -> f64 {
    let [of_points, of_parameters] = &found.variances;
    let m = found.step.len() / knots;
    let of_point = |(step, variance): (&[f64], &[f64])| {
        (step.iter().map(|x| x * x).sum::<f64>() / variance.iter().sum::<f64>()).sqrt()
    };
    let of_parameter = |(change, variance): (&f64, &f64)| change.abs() / variance.sqrt();
    let points = found.step.chunks_exact(m).zip(of_points.chunks_exact(m)).map(of_point);
    let parameters = found.parameters.iter().zip(of_parameters).map(of_parameter);
    points.chain(parameters).fold(0.0, |most: f64, x| if x > most || x.is_nan() { x } else { most })
}
