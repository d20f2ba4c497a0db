//! Which solver runs: the one asked for, or one after the other until one converges.

use super::chain::Chain;
use super::condition::ChainEnds;
use super::homotopy;
use super::solve::{Outcome, Workspace, solve};
use super::{Method, Options, Solver};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, mask_bits, mask_from};
use crate::space::Erased;

/// Sweeps after which the quasi-Newton iteration hands over, and steps of Newton's method.
const QUICK: usize = 120;
const NEWTON: usize = 50;

/// Where Newton's method starts.
#[derive(Clone, Copy)]
enum Start {
    Here,
    Zero,
}

/// Solves by the method asked for. `Auto` is quasi-Newton, then Newton from its iterate, then the
/// homotopy from flat space, each on the lanes that the one before left.
pub fn run(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
) -> Outcome {
    if options.method != Method::Auto {
        return solve(space, chain, ends, options, idle, work, monitor);
    }
    let within = |method: Method, most: usize, used: usize| {
        let left = options.max_iter.map_or(most, |n| n.saturating_sub(used).min(most));
        Options { method, tol: options.tol, max_iter: Some(left.max(1)) }
    };
    let mut outcome = solve(space, chain, ends, &within(Method::QuasiNewton, QUICK, 0), idle, work, monitor);
    let used = |o: &Outcome| o.iterations.iter().max().copied().unwrap_or(0);
    let open = |o: &Outcome| !(idle | mask_from(|l| o.converged[l]));
    let spent = |o: &Outcome| options.max_iter.is_some_and(|n| used(o) >= n);
    if open(&outcome).none() || spent(&outcome) || monitor.poll() {
        return outcome;
    }
    // From where that came to, and from zero: near the cut locus either may lead away.
    for start in [Start::Here, Start::Zero] {
        let before = chain.u.clone();
        let lanes = open(&outcome);
        if let Start::Zero = start {
            chain.u.iter_mut().for_each(|u| *u = lanes.select(Lane::ZERO, *u));
        }
        let limits = within(Method::Newton, NEWTON, used(&outcome));
        let tried = solve(space, chain, ends, &limits, !lanes, work, monitor);
        for l in 0..LANES {
            outcome.iterations[l] += tried.iterations[l];
        }
        merge(chain, &before, &mut outcome, &tried, mask_bits(lanes), Solver::Newton);
        if open(&outcome).none() || spent(&outcome) || monitor.poll() {
            return outcome;
        }
    }
    let left = Options { max_iter: options.max_iter.map(|n| n.saturating_sub(used(&outcome))), ..*options };
    let done = !open(&outcome);
    homotopy::follow(space, chain, ends, &left, done, work, monitor, &mut outcome);
    outcome
}

/// Takes over what a further solver found on some lanes, or goes back to what was there where that is
/// better.
pub fn merge(
    chain: &mut Chain,
    before: &[Lane],
    outcome: &mut Outcome,
    found: &Outcome,
    lanes: [bool; LANES],
    solver: Solver,
) {
    let (old, new) = (outcome.residual.to_array(), found.residual.to_array());
    let better: [bool; LANES] = std::array::from_fn(|l| {
        lanes[l] && (found.converged[l] || !(new[l] >= old[l])) && new[l].is_finite()
    });
    let mask = mask_from(|l| better[l]);
    for (u, b) in chain.u.iter_mut().zip(before) {
        *u = mask.select(*u, *b);
    }
    outcome.residual = mask.select(found.residual, outcome.residual);
    outcome.rate = mask.select(found.rate, outcome.rate);
    outcome.leg = mask.select(found.leg, outcome.leg);
    for l in 0..LANES {
        if better[l] {
            outcome.converged[l] = found.converged[l];
            outcome.solver[l] = solver;
        }
    }
}
