//! Which of several curves: where points are far apart, and where none was found, more ways are tried, and of the
//! curves that they lead to the one that bends least is kept.

use super::auto::PATIENT;
use super::chain::Chain;
use super::ends::ChainEnds;
use super::energy::bending;
use super::solve::{Limits, Outcome, Workspace, solve};
use super::{Options, Solver, homotopy, trust_region};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, few, lane, mask_from};
use crate::space::{Ambient, Erased};

/// Steps beyond this part of the way to the cut locus may have several curves.
const FAR: f64 = 0.6;
/// Energies that differ by no more than this part are those of one curve.
const SAME: f64 = 1e-6;
/// So does, of a curve that is straight, this part of the square of the speed.
const STRAIGHT: f64 = 1e-12;
/// Steps of Newton's method or in a trust region, and of Algorithm 1 before it, up to this dimension; beyond it they cost
/// as much more as its square.
const STEPS: usize = 120;
const SWEEPS: usize = 2000;
const DIMENSION: usize = 4;
/// With fewer steps than these only curves that are not there yet are looked for, and those with no fewer.
const ENOUGH: usize = 20;
const FEW_SWEEPS: usize = 200;

/// The ways that are tried, in turn.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Homotopy,
    QuasiNewton,
    Newton,
    FromZero,
    FromAlgorithm1,
    FromBest,
}

/// Tries further ways on the lanes that are far apart or not settled.
pub fn settle(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
    outcome: &mut Outcome,
) {
    let far = chain.widest.simd_gt(lane(FAR * space.cut_angle()));
    let lanes = (far | !outcome.settled(idle)) & !idle;
    if lanes.none() {
        return;
    }
    let part = |most: usize| (most * DIMENSION * DIMENSION / (chain.m * chain.m).max(1)).min(most);
    let (enough, steps, sweeps) =
        (part(STEPS) >= ENOUGH, part(STEPS).max(ENOUGH), part(SWEEPS).max(FEW_SWEEPS));
    let infinity = lane(f64::INFINITY);
    let energy = |chain: &mut Chain, on: Lane| on.select(bending(space, chain), infinity);
    let mut least = energy(chain, outcome.settled(idle) & lanes);
    let mut second = infinity;
    let quick: [bool; LANES] = few(|l| outcome.converged[l] && outcome.solver[l] == Solver::QuasiNewton);
    for way in
        [Way::Homotopy, Way::QuasiNewton, Way::Newton, Way::FromZero, Way::FromAlgorithm1, Way::FromBest]
    {
        let left = options.max_iter.map(|n| n.saturating_sub(outcome.used()));
        if left == Some(0) || monitor.poll() {
            break;
        }
        let on = lanes
            & match way {
                Way::Homotopy => mask_from(|l| outcome.solver[l] != Solver::Homotopy),
                // Before, it had to be quick.
                Way::QuasiNewton => mask_from(|l| !quick[l]),
                Way::Newton | Way::FromZero | Way::FromAlgorithm1 if enough => lanes,
                _ => !outcome.settled(idle),
            };
        if on.none() {
            continue;
        }
        let before = chain.unknowns().to_vec();
        let within = |most: usize, used: usize| Limits {
            tol: options.tol,
            max_iter: left.map_or(most, |n| n.saturating_sub(used).min(most)),
        };
        let limits = |most: usize| within(most, 0);
        if way != Way::FromBest {
            chain.update(space, |_, u| u.iter_mut().for_each(|u| *u = on.select(Lane::ZERO, *u)));
        }
        let found = match way {
            Way::Homotopy => {
                let mut found = outcome.afresh(on);
                let options = Options { max_iter: left, ..*options };
                homotopy::follow(space, chain, ends, &options, !on, work, monitor, &mut found);
                found
            }
            Way::QuasiNewton => {
                solve(space, chain, ends, Solver::QuasiNewton, limits(PATIENT), !on, work, monitor)
            }
            Way::Newton => solve(space, chain, ends, Solver::Newton, limits(steps), !on, work, monitor),
            Way::FromZero | Way::FromBest => {
                trust_region::solve(space, chain, ends, limits(steps), !on, work, monitor)
            }
            Way::FromAlgorithm1 => {
                let before =
                    solve(space, chain, ends, Solver::FixedPoint, limits(sweeps), !on, work, monitor);
                let rest = within(steps, before.used());
                if rest.max_iter == 0 {
                    before
                } else {
                    let mut found = trust_region::solve(space, chain, ends, rest, !on, work, monitor);
                    found.iterations = few(|l| found.iterations[l] + before.iterations[l]);
                    found
                }
            }
        };
        let arrived = on & mask_from(|l| found.converged[l]);
        let bends = energy(chain, arrived);
        // Of geodesics energies are rounding errors.
        let rounding = lane(STRAIGHT) * chain.pace * chain.pace;
        let other = arrived & !(bends - least).abs().simd_le(lane(SAME) * bends + rounding);
        let calmer = other & bends.simd_lt(least);
        second = calmer.select(least, other.select(second.min(bends), second));
        least = calmer.select(bends, least);
        let nearer = on & !outcome.settled(idle) & found.residual.simd_lt(outcome.residual);
        outcome.adopt(space, chain, &before, &found, calmer | nearer, on);
    }
    outcome.alternative = second.simd_lt(infinity).select(second, lane(f64::NAN));
}
