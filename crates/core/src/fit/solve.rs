//! The iteration that the solvers share: residual, convergence lane by lane, update.

use super::chain::Chain;
use super::condition::{ChainEnds, Defect, EndKind, NodeVectors, of_kind, residual};
use super::newton::{self, Newton};
use super::quasi_newton::Anderson;
use super::tridiagonal::Tridiagonal;
use super::{Method, Options, Solver, fixed_point, quasi_newton};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, dot, lane, mask_bits};
use crate::space::{Ambient, Erased, Origin};

/// Defects of this many ε times the condition of the chords are rounding: an iteration that stops
/// improving below has converged.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// Velocities below this part of |d|/h count as rest: defects are measured against it then.
const STANDSTILL: f64 = 1e-3;
/// But a residual above this is never called rounding.
const ROUNDING_MOST: f64 = 1e-9;
/// Residuals are brought to this part of the tolerance: the jump of the acceleration at a knot is
/// about twelve times the residual.
const AIM: f64 = 1.0 / 40.0;
/// By how much a mixed step may let the defect grow before it is taken back.
const GROWTH_MIXED: f64 = 2.0;
/// How often a step is halved before it is taken as it is.
const MAX_TRIES: f64 = 6.0;
/// So many iterations without lowering the residual by 30 % are a standstill.
const PATIENCE: f64 = 8.0;
/// Outer legs are kept within this part of the distance to the cut locus while iterating.
const LEG_LIMIT: f64 = 0.95;

/// From this iteration on the best iterate is kept, in case that the iteration fails.
const EASY: usize = 8;

/// How eight iterations ended.
pub struct Outcome {
    /// Residual evaluations.
    pub iterations: [usize; LANES],
    /// The C² defect, relative to the largest speed.
    pub residual: Lane,
    /// Whether the residual is below the tolerance or at the rounding floor.
    pub converged: [bool; LANES],
    /// Mean contraction per iteration.
    pub rate: Lane,
    /// The longest outer leg |h u/3|.
    pub leg: Lane,
    /// Which solver got there.
    pub solver: [Solver; LANES],
}

/// Memory of a solve, reused from fit to fit.
#[derive(Default)]
pub struct Workspace {
    t: Tridiagonal,
    vectors: NodeVectors<Lane>,
    anderson: Anderson,
    newton: Newton,
    step: Vec<Lane>,
    next_step: Vec<Lane>,
    best: Vec<Lane>,
}

/// Iterates on `chain.u` until every lane is done. Lanes in `idle` are left alone.
pub fn solve(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
) -> Outcome {
    let Workspace { t, vectors, anderson, newton, step, next_step, best } = work;
    t.build(chain, ends);
    anderson.restart();
    best.clear();
    for vector in [&mut *step, &mut *next_step] {
        vector.resize(chain.u.len(), Lane::ZERO);
    }
    let (tol, aim) = (lane(options.tol), lane(options.tol * AIM));
    let floor = (chain.condition * lane(ROUNDING)).min(lane(ROUNDING_MOST)).max(tol);
    let infinity = lane(f64::INFINITY);
    let limit = space.cut_angle() * LEG_LIMIT;

    let mut done = idle;
    let mut converged = Lane::ZERO;
    let mut residuals = infinity;
    let mut legs = Lane::ZERO;
    let mut iterations = [0; LANES];
    // Of the relative residual: the second one, the one to fall below, how long that has not
    // happened, and that of the kept iterate.
    let (mut second, mut mark, mut waiting, mut kept) = (infinity, infinity, Lane::ZERO, infinity);
    // Of the line search: the defect it must not exceed, how often it went back, and that defect's
    // quotient by the one before.
    let (mut last, mut tries, mut contraction) = (infinity, Lane::ZERO, Lane::ZERO);

    for iteration in 1.. {
        let Defect { defect, speed, leg } = residual(space, chain, ends, vectors);
        // A curve that stands still has neither speed nor defect; one that goes there and back may stand
        // still at every knot, where rounding is all that there is of its velocities.
        let speed = speed.max(chain.pace * lane(STANDSTILL));
        let now = defect.simd_eq(Lane::ZERO).select(Lane::ZERO, defect / speed);
        residuals = done.select(residuals, now);
        legs = done.select(legs, leg);
        mask_bits(done).iter().zip(&mut iterations).for_each(|(done, i)| *i += usize::from(!done));

        let fallen = now.simd_lt(mark * lane(0.7));
        (mark, waiting) = (fallen.select(now, mark), fallen.select(Lane::ZERO, waiting + Lane::ONE));
        second = if iteration == 2 { now } else { second };
        let stagnant = waiting.simd_ge(lane(PATIENCE)) & now.simd_le(floor);
        let arrived = (now.simd_le(aim) | stagnant) & !done;
        converged |= arrived;
        done |= arrived;
        let last_round = iteration >= options.max_iter() || monitor.poll();
        if done.all() || last_round {
            converged |= now.simd_le(tol) & !done;
            break;
        }
        if iteration > EASY || options.max_iter() <= EASY {
            let better = now.simd_lt(kept) & !done;
            keep_best(best, &chain.u, better);
            kept = better.select(now, kept);
        }

        let mixing = anderson.active();
        let allowed = last * mixing.select(lane(GROWTH_MIXED), Lane::ONE);
        let worse =
            !defect.simd_le(allowed) & !done & tries.simd_lt(lane(MAX_TRIES)) & iteration_mask(iteration);
        if !worse.all() {
            contraction = worse.select(contraction, defect / last);
            last = worse.select(last, defect);
            match options.method {
                Method::FixedPoint => fixed_point::update(space, chain, ends, t, next_step),
                Method::Newton => newton::update(space, chain, ends, newton, next_step),
                Method::Auto | Method::QuasiNewton => {
                    quasi_newton::update(space, chain, ends, t, next_step);
                    if iteration > 1 {
                        anderson.mix(contraction, worse, &chain.u, next_step);
                    }
                }
            }
        }
        if worse.any() {
            // Half of the last step is taken back.
            anderson.forget(worse);
            for (n, s) in next_step.iter_mut().zip(&*step) {
                *n = worse.select(*s * lane(-0.5), *n);
            }
        }
        tries = worse.select(tries + Lane::ONE, Lane::ZERO);
        for ((u, s), n) in chain.u.iter_mut().zip(&mut *step).zip(&*next_step) {
            *u = done.select(*u, *u + *n);
            // After going back, what is left of the step is as long as what was taken back.
            *s = worse.select(-*n, *n);
        }
        let long = legs.simd_gt(lane(0.5 * limit.min(space.injectivity_radius()))) & !done;
        if long.any() {
            shorten(space, chain, ends, limit, !long);
        }
    }
    if !best.is_empty() {
        let failed = !converged & !idle;
        let better = failed & !residuals.simd_le(kept) & kept.is_finite();
        for (u, b) in chain.u.iter_mut().zip(&*best) {
            *u = better.select(*b, *u);
        }
        residuals = better.select(kept, residuals);
    }
    let rate = mean_rate(second, residuals, &iterations);
    let solver = match options.method {
        Method::FixedPoint => Solver::FixedPoint,
        Method::Newton => Solver::Newton,
        Method::Auto | Method::QuasiNewton => Solver::QuasiNewton,
    };
    Outcome {
        iterations,
        residual: residuals,
        converged: mask_bits(converged),
        rate,
        leg: legs,
        solver: [solver; LANES],
    }
}

/// Scales velocities back whose outer legs would pass the cut locus: beyond it the C² condition
/// has spurious solutions.
fn shorten(space: &Erased, chain: &mut Chain, ends: &ChainEnds, limit: f64, done: Lane) {
    let m = chain.m;
    for i in 0..=chain.n {
        // A velocity that is given stays.
        let given = match ends {
            ChainEnds::Open(kinds) if i == 0 => of_kind(&kinds[0], EndKind::Velocity),
            ChainEnds::Open(kinds) if i == chain.n => of_kind(&kinds[1], EndKind::Velocity),
            _ => Lane::ZERO,
        };
        let done = done | given;
        let h = chain.h[i.max(1) - 1].max(chain.h[i.min(chain.n - 1)]);
        let u = &mut chain.u[i * m..(i + 1) * m];
        let third = h * lane(1.0 / 3.0);
        let length = dot(u, u).sqrt() * third;
        if !(length.simd_gt(lane(limit.min(space.injectivity_radius()))) & !done).any() {
            continue;
        }
        let leg = space.angle(&u.iter().map(|u| *u * third).collect::<Vec<_>>());
        let long = leg.simd_gt(lane(limit)) & !done;
        if long.any() {
            u.iter_mut().for_each(|x| *x = long.select(*x * lane(limit) / leg, *x));
        }
    }
}

/// The first two residuals belong to no step that could be judged.
fn iteration_mask(iteration: usize) -> Lane {
    crate::scalar::mask_from(|_| iteration > 2)
}

fn keep_best(best: &mut Vec<Lane>, u: &[Lane], lanes: Lane) {
    if lanes.any() {
        if best.is_empty() {
            best.extend_from_slice(u);
        }
        for (b, u) in best.iter_mut().zip(u) {
            *b = lanes.select(*u, *b);
        }
    }
}

/// Geometric mean of the contraction, from the second residual on: the first is that of u = 0.
fn mean_rate(first: Lane, last: Lane, iterations: &[usize; LANES]) -> Lane {
    let (first, last) = (first.to_array(), last.to_array());
    Lane::new(std::array::from_fn(|l| {
        let steps = iterations[l].saturating_sub(2);
        if steps == 0 { 0.0 } else { (last[l] / first[l]).powf(1.0 / steps as f64) }
    }))
}
