//! The iteration of quasi-Newton and Newton: residual, convergence of each lane, step.

use super::chain::Chain;
use super::condition::residual;
use super::convergence::{Best, Convergence};
use super::end_kind::ChainEnds;
use super::handles::{long_handles, shorten};
use super::line_search::{LineSearch, halve};
use super::newton::{self, Newton};
use super::node::NodeVectors;
use super::problem::{Solver, SolverSet, Status};
use super::quasi_newton::{self, Anderson};
use super::tridiagonal::Tridiagonal;
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, few, lane, mask_bits, mask_from};
use crate::space::{Ambient, Erased};

/// Outer handles stay within this fraction of the distance to the cut locus during the iteration.
const HANDLE_LIMIT: f64 = 0.95;

/// The limits of an iteration.
#[derive(Clone, Copy)]
pub struct Limits {
    /// The largest residual of a converged lane.
    pub tol: Lane,
    /// Largest number of residual evaluations of each lane.
    pub max_iter: Lane,
}

impl Limits {
    /// The lanes that have no evaluations left after this many.
    pub fn reached(&self, iteration: usize) -> Lane {
        self.max_iter.simd_le(lane(iteration as f64))
    }
}

/// The outcome of the iterations of all lanes.
#[derive(Clone)]
pub struct Outcome {
    /// Residual evaluations.
    pub iterations: [usize; LANES],
    /// The C² residual, relative to the largest speed.
    pub residual: Lane,
    /// Whether the residual is below the tolerance or at the rounding floor, and all handles are short enough.
    pub converged: [bool; LANES],
    /// Handles that are too long although the residual is small enough.
    pub fault: [Option<Status>; LANES],
    /// The longest outer handle |h u/3|.
    pub handle: Lane,
    /// Mean contraction per iteration.
    pub rate: Lane,
    /// The solver that found the curve.
    pub solver: [Solver; LANES],
    /// The lowest energy of other solutions, in the units of the chain; NaN without one.
    pub alternative: Lane,
    /// Solvers that would have cost too much.
    pub skipped: [SolverSet; LANES],
}

impl Outcome {
    /// The outcome of an iteration whose last iterate is in the chain.
    /// Control points are checked on the lanes of `suspect`.
    pub fn of(space: &Erased, chain: &mut Chain, state: &Convergence, solver: Solver, suspect: Lane) -> Self {
        let fault = long_handles(space, chain, state.handle, suspect);
        let converged = mask_bits(state.converged);
        Outcome {
            iterations: state.iterations,
            residual: state.residual,
            converged: few(|l| converged[l] && fault[l].is_none()),
            fault,
            handle: state.handle,
            rate: state.rate(),
            solver: [solver; LANES],
            alternative: lane(f64::NAN),
            skipped: Default::default(),
        }
    }

    /// Accepts the iterate in the chain on lanes where every solver failed, if it is within the tolerance. A solver aims
    /// far below the tolerance, and its best iterate may not be its last.
    pub fn judge(&mut self, lanes: &mut Lanes, tol: f64, idle: Lane) {
        let good = mask_from(|l| !self.converged[l] && self.fault[l].is_none());
        let good = good & self.residual.simd_le(lane(tol)) & !idle;
        if good.none() {
            return;
        }
        // The longest handle is that of the last iterate.
        let Lanes { space, chain, ends, work, .. } = lanes;
        let found = residual(space, chain, ends, &mut work.vectors);
        let fault = long_handles(space, chain, found.handle, good);
        self.handle = good.select(found.handle, self.handle);
        for (l, _) in mask_bits(good).iter().enumerate().filter(|(_, on)| **on) {
            self.fault[l] = fault[l];
            self.converged[l] = fault[l].is_none();
        }
    }

    /// The outcome of a solver that has not started on the lanes of a mask; other lanes are settled.
    pub fn afresh(&self, on: Lane) -> Self {
        let on_lane = mask_bits(on);
        Outcome {
            iterations: [0; LANES],
            residual: on.select(lane(f64::INFINITY), self.residual),
            converged: few(|l| !on_lane[l]),
            fault: [None; LANES],
            ..self.clone()
        }
    }

    /// The outcome of a solver that has not started.
    pub fn none(solver: Solver) -> Self {
        Outcome {
            iterations: [0; LANES],
            residual: lane(f64::INFINITY),
            converged: [false; LANES],
            fault: [None; LANES],
            handle: Lane::ZERO,
            rate: Lane::ZERO,
            solver: [solver; LANES],
            alternative: lane(f64::NAN),
            skipped: Default::default(),
        }
    }

    /// The lanes that need no further solver.
    pub fn settled(&self, idle: Lane) -> Lane {
        idle | mask_from(|l| self.converged[l])
    }

    /// Records a solver that would cost too much on some lanes.
    pub fn leave_out(&mut self, solver: Solver, lanes: Lane) {
        for (skipped, _) in self.skipped.iter_mut().zip(mask_bits(lanes)).filter(|(_, on)| *on) {
            skipped.0 |= 1 << solver as u8;
        }
    }

    /// Accepts the result of a further solver on some lanes, or restores the earlier one where that is better.
    pub fn take(&mut self, lanes: &mut Lanes, before: &[Lane], found: &Outcome, on: Lane) {
        let (old, new) = (self.residual.to_array(), found.residual.to_array());
        let on_lane = mask_bits(on);
        let better: [bool; LANES] =
            few(|l| on_lane[l] && (found.converged[l] || !(new[l] >= old[l])) && new[l].is_finite());
        self.adopt(lanes, before, found, mask_from(|l| better[l]), on);
    }

    /// Accepts the result of a further solver on the lanes of a mask, and restores the earlier one on others. The
    /// iterations of both count as work.
    pub fn adopt(&mut self, lanes: &mut Lanes, before: &[Lane], found: &Outcome, mask: Lane, on: Lane) {
        lanes.update(|_, u| u.iter_mut().zip(before).for_each(|(u, b)| *u = mask.select(*u, *b)));
        let (better, on) = (mask_bits(mask), mask_bits(on));
        self.residual = mask.select(found.residual, self.residual);
        self.rate = mask.select(found.rate, self.rate);
        self.handle = mask.select(found.handle, self.handle);
        for l in 0..LANES {
            self.iterations[l] += if on[l] { found.iterations[l] } else { 0 };
            if better[l] {
                self.converged[l] = found.converged[l];
                self.fault[l] = found.fault[l];
                self.solver[l] = found.solver[l];
            }
        }
    }
}

/// Curves to solve, one per lane, and the memory of the solvers.
pub struct Lanes<'a> {
    pub space: &'a Erased<'a>,
    pub chain: &'a mut Chain,
    pub ends: &'a ChainEnds,
    pub work: &'a mut Workspace,
    pub monitor: &'a Monitor<'a>,
}

impl Lanes<'_> {
    /// Updates the unknowns of the chain.
    pub fn update(&mut self, change: impl FnOnce(&Chain, &mut [Lane])) {
        self.chain.update(self.space, change);
    }
}

/// Memory of a solver, reused between fits.
#[derive(Default)]
pub struct Workspace {
    pub(super) t: Tridiagonal,
    pub(super) vectors: NodeVectors<Lane>,
    anderson: Anderson,
    pub(super) newton: Newton,
    step: Vec<Lane>,
    next_step: Vec<Lane>,
    best: Best,
}

/// Iterates on the unknowns of a chain until every lane stops: Newton's method, or with `Solver::QuasiNewton` the
/// quasi-Newton iteration. Lanes in `idle` do not change.
pub fn solve(lanes: &mut Lanes, solver: Solver, limits: Limits, idle: Lane) -> Outcome {
    let (space, ends, monitor) = (lanes.space, lanes.ends, lanes.monitor);
    let (chain, work) = (&mut *lanes.chain, &mut *lanes.work);
    let Workspace { t, vectors, anderson, newton, step, next_step, best } = work;
    t.build(chain, ends);
    anderson.restart();
    best.restart();
    for vector in [&mut *step, &mut *next_step] {
        vector.resize(chain.unknowns().len(), Lane::ZERO);
    }
    let limit = space.cut_angle() * HANDLE_LIMIT;
    let mut state = Convergence::new(chain, limits.tol, idle);
    let mut search = LineSearch::new();
    for iteration in 1.. {
        let found = residual(space, chain, ends, vectors);
        state.note(iteration, found, chain.pace);
        best.keep(iteration, limits.max_iter, chain.unknowns(), &state);
        state.leave(limits.reached(iteration));
        if state.done.all() || monitor.poll() {
            state.end();
            break;
        }

        let done = state.done;
        let worse = search.judge(iteration, found.residual, anderson.active(), done);
        if !worse.all() {
            match solver {
                Solver::QuasiNewton => {
                    quasi_newton::update(space, chain, ends, t, next_step);
                    if iteration > 1 {
                        anderson.mix(search.contraction, worse, chain.unknowns(), next_step);
                    }
                }
                _ => newton::update(space, chain, ends, newton, next_step),
            }
        }
        if worse.any() {
            anderson.forget(worse);
            halve(worse, step, next_step);
        }
        let long = state.handle.simd_gt(lane(0.5 * limit.min(space.injectivity_radius()))) & !done;
        chain.update(space, |chain, u| {
            for (u, n) in u.iter_mut().zip(&*next_step) {
                *u = done.select(*u, *u + *n);
            }
            if long.any() {
                shorten(space, chain, limit, |node| !long | ends.given(chain.n, node), u);
            }
        });
        std::mem::swap(step, next_step);
        if worse.any() {
            // After a step back, the rest of the step is as long as the part that was taken back.
            step.iter_mut().for_each(|s| *s = worse.select(-*s, *s));
        }
    }
    best.restore(space, chain, idle, &mut state);
    let converged = state.converged;
    Outcome::of(space, chain, &state, solver, converged)
}
