//! The choice of solvers: the requested one, or several in turn until one converges.

use super::budget::{self, Costs, NEWTON, left};
use super::problem::{Method, Options, Solver};
use super::solve::{Lanes, Limits, Outcome, solve};
use super::{fixed_point, homotopy, minimum_energy};
use crate::scalar::{Lane, few, lane};

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
pub fn run(lanes: &mut Lanes, options: &Options, idle: Lane, whole: bool) -> Outcome {
    let limits = |most: f64| Limits {
        tol: lane(options.tol),
        max_iter: lane(options.max_iter.map_or(most, |n| n as f64)),
    };
    match options.method {
        Method::Auto => {
            let costs = Costs::of(lanes.space, lanes.chain, lanes.ends);
            let (mut outcome, first) = in_turn(lanes, options, &costs, idle);
            // All sections of a curve must use the same solver.
            if whole {
                minimum_energy::select(lanes, options, &costs, first, idle, &mut outcome);
            }
            outcome
        }
        Method::Homotopy => {
            let mut outcome = Outcome::none(Solver::Homotopy);
            homotopy::follow(lanes, limits(f64::INFINITY), idle, &mut outcome);
            outcome
        }
        Method::FixedPoint => fixed_point::solve(lanes, limits(budget::SWEEPS_ALONE), idle),
        Method::QuasiNewton => {
            let limits = limits(budget::PATIENT);
            solve(lanes, Solver::QuasiNewton, limits, idle)
        }
        Method::Newton => solve(lanes, Solver::Newton, limits(NEWTON_ALONE), idle),
    }
}

/// Quasi-Newton, then Newton from its iterate, then the homotopy from flat space. Each solver runs on the lanes where
/// the one before did not converge. Also returns the work on each lane.
fn in_turn(lanes: &mut Lanes, options: &Options, costs: &Costs, idle: Lane) -> (Outcome, Lane) {
    let within = |rest: Lane, most: f64| Limits { tol: lane(options.tol), max_iter: rest.min(lane(most)) };
    // Where Newton's method costs too much, no solver takes over.
    let most = if costs.can_rescue(NEWTON) { QUICK } else { budget::PATIENT };
    let limits = within(left(options, &Default::default()), most);
    let mut outcome = solve(lanes, Solver::QuasiNewton, limits, idle);
    let quick = outcome.iterations;
    let spent = |outcome: &Outcome| {
        Lane::new(few(|l| quick[l] as f64 + (outcome.iterations[l] - quick[l]) as f64 * costs.step))
    };
    // Newton's method starts from the iterate of the quasi-Newton iteration and then from zero: near the cut locus
    // either start may diverge.
    for start in [Start::Here, Start::Zero] {
        let rest = left(options, &outcome.iterations);
        let done = outcome.settled(idle) | rest.simd_le(Lane::ZERO);
        if done.all() || !costs.can_rescue(NEWTON) || lanes.monitor.poll() {
            return (outcome.clone(), spent(&outcome));
        }
        let before = lanes.chain.unknowns().to_vec();
        if let Start::Zero = start {
            lanes.update(|_, u| u.iter_mut().for_each(|u| *u = done.select(*u, Lane::ZERO)));
        }
        let limits = within(rest, NEWTON);
        let tried = solve(lanes, Solver::Newton, limits, done);
        outcome.take(lanes, &before, &tried, !done);
    }
    if !outcome.settled(idle).all() && !lanes.monitor.poll() {
        let limits = within(left(options, &outcome.iterations), (costs.for_rescue() / costs.step).floor());
        homotopy::follow(lanes, limits, idle, &mut outcome);
    }
    let spent = spent(&outcome);
    (outcome, spent)
}
