//! The minimum-energy solution. If points are far apart, or no curve was found yet, further solvers run, and the
//! solution with the lowest bending energy is kept.

use super::budget::{
    Costs, ENERGY, FEWEST_STEPS, FEWEST_SWEEPS, NEWTON, PATIENT, SWEEPS, SWEEPS_TO_RESCUE, left,
};
use super::chain::Chain;
use super::energy::bending;
use super::problem::{Options, Solver};
use super::solve::{Lanes, Limits, Outcome, solve};
use super::{fixed_point, homotopy, trust_region};
use crate::scalar::{LANES, Lane, few, lane, mask_from};
use crate::space::{Ambient, Erased};

/// Points may have several curves if steps exceed this fraction of the distance to the cut locus, ...
const FAR: f64 = 0.55;
/// ... or if they exceed this fraction and the first solver needed this many iterations. Of 900 sets of points on
/// spheres, SO(3), CPⁿ and Gr(2, 4) with steps of 0.3 to 0.6, 60 have a curve of lower bending energy than the first
/// one that was found. Their steps are at least 0.44 and their iterations at least 20. Of 1000 other sets, one with a
/// step of 0.58 needed 17.
pub const HALF_WAY: f64 = 0.4;
const SLOW: usize = 16;
/// A curve goes around the space if a segment is longer than the distance to the cut locus by this factor, as on the
/// longer way around a sphere between points that are near each other: less than 0.3 of this distance. It is an alternative
/// to a curve that does not, even if its energy is lower, because rounding errors determine whether a solver finds it.
const AROUND: f64 = 1.7;
/// Solutions whose relative difference of energies is at most this belong to the same curve.
const SAME: f64 = 1e-6;
/// So do energies below this fraction of the square of the speed, for a curve that is a geodesic.
const STRAIGHT: f64 = 1e-12;

/// The solvers in their order, and their starting points.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Algorithm1,
    QuasiNewton,
    Homotopy,
    Newton,
    FromZero,
    FromAlgorithm1,
    FromBest,
}

const WAYS: [Way; 7] = [
    Way::Algorithm1,
    Way::QuasiNewton,
    Way::Homotopy,
    Way::Newton,
    Way::FromZero,
    Way::FromAlgorithm1,
    Way::FromBest,
];

impl Way {
    fn solver(self) -> Solver {
        match self {
            Way::Algorithm1 => Solver::FixedPoint,
            Way::QuasiNewton => Solver::QuasiNewton,
            Way::Homotopy => Solver::Homotopy,
            Way::Newton => Solver::Newton,
            Way::FromZero | Way::FromAlgorithm1 | Way::FromBest => Solver::TrustRegion,
        }
    }

    /// The maximum and the minimum number of its iterations.
    fn iterations(self, costs: &Costs) -> [f64; 2] {
        match self {
            Way::Algorithm1 => [SWEEPS, FEWEST_SWEEPS],
            Way::QuasiNewton => [PATIENT, FEWEST_SWEEPS],
            // It stops without a limit.
            Way::Homotopy => [f64::INFINITY, FEWEST_STEPS],
            Way::Newton | Way::FromZero | Way::FromAlgorithm1 | Way::FromBest => [costs.steps, FEWEST_STEPS],
        }
    }
}

/// The lanes whose points may have several curves.
fn far_apart(space: &Erased, chain: &Chain, outcome: &Outcome) -> Lane {
    let beyond = |part: f64| chain.widest.simd_gt(lane(part * space.cut_angle()));
    beyond(FAR) | beyond(HALF_WAY) & mask_from(|l| outcome.iterations[l] >= SLOW)
}

/// Runs further solvers on the lanes whose points are far apart or that are not settled, and keeps the minimum-energy
/// solution. `first` is the work spent on each lane.
pub fn select(
    lanes: &mut Lanes,
    options: &Options,
    costs: &Costs,
    mut first: Lane,
    idle: Lane,
    outcome: &mut Outcome,
) {
    let (space, monitor) = (lanes.space, lanes.monitor);
    let candidates = (far_apart(space, lanes.chain, outcome) | !outcome.settled(idle)) & !idle;
    if candidates.none() {
        return;
    }
    let infinity = lane(f64::INFINITY);
    // Energies, and where curves go around the space; where there is no curve, every one is better.
    let energy = |chain: &mut Chain, on: Lane| {
        let (energy, longest) = bending(space, chain);
        let most = lane(AROUND * space.cut_angle()) * chain.longest;
        (on.select(energy, infinity), !on | (longest * chain.widest).simd_gt(most))
    };
    let mut spent = Lane::ZERO;
    // Energies are computed only when there are two solutions to compare.
    let mut least = None;
    let mut second = infinity;
    let quick: [bool; LANES] = few(|l| {
        !costs.can_rescue(NEWTON) || outcome.converged[l] && outcome.solver[l] == Solver::QuasiNewton
    });
    let before_homotopy = outcome.solver;
    // The result of Algorithm 1, on the lanes where it did not converge.
    let (mut sweeps_end, mut swept) = (Vec::new(), Lane::ZERO);
    for way in WAYS {
        if monitor.poll() {
            break;
        }
        let settled = outcome.settled(idle);
        let applies = candidates
            & match way {
                Way::Homotopy => mask_from(|l| before_homotopy[l] != Solver::Homotopy),
                // The first solver must have converged quickly.
                Way::QuasiNewton => mask_from(|l| !quick[l]),
                Way::FromAlgorithm1 => swept,
                Way::FromBest => !settled,
                _ => candidates,
            };
        let rest = left(options, &outcome.iterations);
        let cost = costs.iteration(way.solver());
        let afforded = settled.select(costs.for_search(first) - spent, lane(costs.for_rescue()));
        let afforded = ((afforded - lane(ENERGY)) * lane(1.0 / cost)).max(Lane::ZERO).floor();
        let [most, fewest] = way.iterations(costs);
        let enough = afforded.simd_ge(lane(fewest)) & mask_from(|_| cost == 1.0 || costs.fits);
        outcome.leave_out(way.solver(), applies & !enough);
        let on = applies & enough & rest.simd_gt(Lane::ZERO);
        if on.none() {
            continue;
        }
        if least.is_none() {
            least = Some(energy(lanes.chain, settled & candidates));
        }
        let before = lanes.chain.unknowns().to_vec();
        // If handles come close to the cut locus, which line searches avoid, residuals are amplified in the
        // acceleration.
        let sweeps = if way == Way::Algorithm1 { candidates } else { Lane::ZERO };
        // Where Newton's method costs too much, no other solver would find a curve.
        let last = if costs.can_rescue(NEWTON) { Lane::ZERO } else { sweeps & !settled };
        let tol = (sweeps & !last).select(lane(0.1 * options.tol), lane(options.tol));
        let most = last.select(lane(SWEEPS_TO_RESCUE), lane(most));
        let limits = Limits { tol, max_iter: rest.min(afforded).min(most) };
        let start = |i: usize| if way == Way::FromAlgorithm1 { sweeps_end[i] } else { Lane::ZERO };
        if way != Way::FromBest {
            lanes.update(|_, u| {
                u.iter_mut().enumerate().for_each(|(i, u)| *u = on.select(start(i), *u));
            });
        }
        let found = match way {
            Way::Algorithm1 => fixed_point::solve(lanes, limits, !on),
            Way::Homotopy => {
                let mut found = outcome.afresh(on);
                homotopy::follow(lanes, limits, !on, &mut found);
                found
            }
            Way::QuasiNewton | Way::Newton => solve(lanes, way.solver(), limits, !on),
            Way::FromZero | Way::FromAlgorithm1 | Way::FromBest => trust_region::solve(lanes, limits, !on),
        };
        let iterations = Lane::new(found.iterations.map(|n| n as f64));
        spent += on.select(iterations * lane(cost) + lane(ENERGY), Lane::ZERO);
        let arrived = on & mask_from(|l| found.converged[l]);
        let cut_short = on & !arrived & iterations.simd_ge(afforded) & afforded.simd_lt(most);
        outcome.leave_out(way.solver(), cut_short);
        if way == Way::Algorithm1 {
            swept = on & !arrived;
            sweeps_end = lanes.chain.unknowns().to_vec();
        }
        let (bends, around) = energy(lanes.chain, arrived);
        let (known, known_around) = least.unwrap_or((infinity, !Lane::ZERO));
        // The energies of geodesics are rounding errors.
        let rounding = lane(STRAIGHT) * lanes.chain.pace * lanes.chain.pace;
        let other = arrived & !(bends - known).abs().simd_le(lane(SAME) * bends + rounding);
        let better = (known_around & !around) | (!(around & !known_around) & bends.simd_lt(known));
        let lower = other & better;
        second = lower.select(second.min(known), other.select(second.min(bends), second));
        least = Some((lower.select(bends, known), lower.select(around, known_around)));
        // A solution with a control point beyond the cut locus is spurious.
        let nearer = on
            & !settled
            & found.residual.simd_lt(outcome.residual)
            & mask_from(|l| found.fault[l].is_none());
        outcome.adopt(lanes, &before, &found, lower | nearer, on);
        // The work that led to the first curve determines the budget of the search for others.
        let now = outcome.settled(idle) & !settled;
        (first, spent) = (now.select(first + spent, first), now.select(Lane::ZERO, spent));
    }
    outcome.alternative = second.simd_lt(infinity).select(second, lane(f64::NAN));
}
