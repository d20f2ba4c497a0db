//! Which solver runs: the one asked for, or one after the other until one converges.

use super::chain::Chain;
use super::ends::ChainEnds;
use super::solve::{Limits, Outcome, Workspace, solve};
use super::{Method, Options, Solver};
use super::{calm, homotopy};
use crate::monitor::Monitor;
use crate::scalar::Lane;
use crate::space::Erased;

/// Sweeps of the quasi-Newton iteration by itself.
pub const PATIENT: usize = 300;
/// Sweeps after which it hands over, and steps of Newton's method.
const QUICK: usize = 120;
const NEWTON: usize = 50;

/// Where Newton's method starts.
#[derive(Clone, Copy)]
enum Start {
    Here,
    Zero,
}

/// Solves by the method asked for: `whole` curves, or pieces of longer ones.
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
    let (solver, most) = match options.method {
        Method::Auto => {
            let mut outcome = in_turn(space, chain, ends, options, idle, work, monitor);
            // Pieces of one curve must not choose apart.
            if whole {
                calm::settle(space, chain, ends, options, idle, work, monitor, &mut outcome);
            }
            return outcome;
        }
        Method::Homotopy => {
            let mut outcome = Outcome::none(Solver::Homotopy);
            homotopy::follow(space, chain, ends, options, idle, work, monitor, &mut outcome);
            return outcome;
        }
        Method::FixedPoint => (Solver::FixedPoint, 2000),
        Method::QuasiNewton => (Solver::QuasiNewton, PATIENT),
        Method::Newton => (Solver::Newton, 100),
    };
    let limits = Limits { tol: options.tol, max_iter: options.max_iter.unwrap_or(most) };
    solve(space, chain, ends, solver, limits, idle, work, monitor)
}

/// Quasi-Newton, then Newton from its iterate, then the homotopy from flat space, each on the lanes that the one
/// before left.
fn in_turn(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
) -> Outcome {
    let left = |used: usize| options.max_iter.map(|n| n.saturating_sub(used));
    let within = |most: usize, used: usize| Limits {
        tol: options.tol,
        max_iter: left(used).map_or(most, |n| n.min(most)).max(1),
    };
    let mut outcome = solve(space, chain, ends, Solver::QuasiNewton, within(QUICK, 0), idle, work, monitor);
    let over =
        |o: &Outcome| o.settled(idle).all() || left(o.used()).is_some_and(|n| n == 0) || monitor.poll();
    // From where that came to, and from zero: near the cut locus either may lead away.
    for start in [Start::Here, Start::Zero] {
        if over(&outcome) {
            return outcome;
        }
        let (before, settled) = (chain.unknowns().to_vec(), outcome.settled(idle));
        if let Start::Zero = start {
            chain.update(space, |_, u| u.iter_mut().for_each(|u| *u = settled.select(*u, Lane::ZERO)));
        }
        let limits = within(NEWTON, outcome.used());
        let tried = solve(space, chain, ends, Solver::Newton, limits, settled, work, monitor);
        outcome.take(space, chain, &before, &tried, !settled);
    }
    if !over(&outcome) {
        homotopy::follow(space, chain, ends, options, idle, work, monitor, &mut outcome);
    }
    outcome
}
