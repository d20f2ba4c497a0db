//! The choice of solvers: the requested one, or several in turn until one converges.

use super::budget::{self, Costs, NEWTON, left};
use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::problem::{Method, Options, Solver};
use super::solve::{Limits, Outcome, Workspace, solve};
use super::{fixed_point, homotopy, minimum_energy};
use crate::monitor::Monitor;
use crate::scalar::{Lane, few, lane};
use crate::space::Erased;

/// Residual evaluations after which Newton's method takes over from the quasi-Newton iteration.
const QUICK: f64 = 120.0;
/// Steps of Newton's method when it runs alone.
const NEWTON_ALONE: f64 = 100.0;

/// Where Newton's method starts.
#[derive(Clone, Copy)]
enum Start {
    Here,
    Zero,
}

/// Runs the requested solver on whole curves (`whole`) or on sections of longer ones.
pub fn run(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    idle: Lane,
    whole: bool,
    work: &mut Workspace,
    monitor: &Monitor,
) -> Outcome {
    let limits = |most: f64| Limits {
        tol: lane(options.tol),
        max_iter: lane(options.max_iter.map_or(most, |n| n as f64)),
    };
    match options.method {
        Method::Auto => {
            let costs = Costs::of(space, chain, ends);
            let (mut outcome, first) = in_turn(space, chain, ends, options, &costs, idle, work, monitor);
            // All sections of a curve must use the same solver.
            if whole {
                minimum_energy::select(
                    space,
                    chain,
                    ends,
                    options,
                    &costs,
                    first,
                    idle,
                    work,
                    monitor,
                    &mut outcome,
                );
            }
            outcome
        }
        Method::Homotopy => {
            let mut outcome = Outcome::none(Solver::Homotopy);
            homotopy::follow(space, chain, ends, limits(f64::INFINITY), idle, work, monitor, &mut outcome);
            outcome
        }
        Method::FixedPoint => {
            fixed_point::solve(space, chain, ends, limits(budget::SWEEPS_ALONE), idle, work, monitor)
        }
        Method::QuasiNewton => {
            let limits = limits(budget::PATIENT);
            solve(space, chain, ends, Solver::QuasiNewton, limits, idle, work, monitor)
        }
        Method::Newton => {
            solve(space, chain, ends, Solver::Newton, limits(NEWTON_ALONE), idle, work, monitor)
        }
    }
}

/// Quasi-Newton, then Newton from its iterate, then the homotopy from flat space. Each solver runs on the lanes where
/// the one before did not converge. Also returns the work on each lane.
fn in_turn(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    costs: &Costs,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
) -> (Outcome, Lane) {
    let within = |rest: Lane, most: f64| Limits { tol: lane(options.tol), max_iter: rest.min(lane(most)) };
    // Where Newton's method costs too much, no solver takes over.
    let most = if costs.can_rescue(NEWTON) { QUICK } else { budget::PATIENT };
    let limits = within(left(options, &Default::default()), most);
    let mut outcome = solve(space, chain, ends, Solver::QuasiNewton, limits, idle, work, monitor);
    let quick = outcome.iterations;
    let spent = |outcome: &Outcome| {
        Lane::new(few(|l| quick[l] as f64 + (outcome.iterations[l] - quick[l]) as f64 * costs.step))
    };
    // Newton's method starts from the iterate of the quasi-Newton iteration and then from zero: near the cut locus
    // either start may diverge.
    for start in [Start::Here, Start::Zero] {
        let rest = left(options, &outcome.iterations);
        let done = outcome.settled(idle) | rest.simd_le(Lane::ZERO);
        if done.all() || !costs.can_rescue(NEWTON) || monitor.poll() {
            return (outcome.clone(), spent(&outcome));
        }
        let before = chain.unknowns().to_vec();
        if let Start::Zero = start {
            chain.update(space, |_, u| u.iter_mut().for_each(|u| *u = done.select(*u, Lane::ZERO)));
        }
        let limits = within(rest, NEWTON);
        let tried = solve(space, chain, ends, Solver::Newton, limits, done, work, monitor);
        outcome.take(space, chain, &before, &tried, !done);
    }
    if !outcome.settled(idle).all() && !monitor.poll() {
        let limits = within(left(options, &outcome.iterations), (costs.for_rescue() / costs.step).floor());
        homotopy::follow(space, chain, ends, limits, idle, work, monitor, &mut outcome);
    }
    let spent = spent(&outcome);
    (outcome, spent)
}
