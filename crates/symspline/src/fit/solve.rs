//! The iteration that the solvers share: residual, convergence lane by lane, update.

use super::chain::Chain;
use super::condition::{ChainEnds, Defect, NodeVectors, residual};
use super::quasi_newton::Anderson;
use super::tridiagonal::Tridiagonal;
use super::{Method, Options, fixed_point, quasi_newton};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, lane, mask_bits};
use crate::space::Space;

/// Defects of this many ε times the condition of the chords are rounding: an iteration that stops
/// improving below has converged.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// So many iterations without halving the residual are a standstill.
const PATIENCE: f64 = 4.0;
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
}

/// Memory of a solve, reused from fit to fit.
#[derive(Default)]
pub struct Workspace {
    t: Tridiagonal,
    vectors: NodeVectors,
    anderson: Anderson,
    step: Vec<Lane>,
    best: Vec<Lane>,
}

/// Iterates on `chain.u` until every lane is done. Lanes in `idle` are left alone.
pub fn solve<M: Space>(
    space: &M,
    chain: &mut Chain,
    ends: &ChainEnds,
    options: &Options,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
) -> Outcome {
    let Workspace { t, vectors, anderson, step, best } = work;
    t.new(chain, ends);
    anderson.restart();
    best.clear();
    step.resize(chain.u.len(), Lane::ZERO);
    let tol = lane(options.tol);
    let floor = chain.condition * lane(ROUNDING);
    let infinity = lane(f64::INFINITY);

    let mut done = idle;
    let mut converged = Lane::ZERO;
    let (mut first, mut last, mut lowest) = (infinity, infinity, infinity);
    let mut waiting = Lane::ZERO;
    let mut residuals = infinity;
    let mut kept = infinity;
    let mut legs = Lane::ZERO;
    let mut iterations = [0; LANES];
    let limit = space.cut_angle() * LEG_LIMIT;

    for iteration in 1.. {
        let Defect { defect, speed, leg } = residual(space, chain, ends, vectors);
        // A curve that stands still has neither speed nor defect.
        let now = defect.simd_eq(Lane::ZERO).select(Lane::ZERO, defect / speed);
        residuals = done.select(residuals, now);
        legs = done.select(legs, leg);
        mask_bits(done).iter().zip(&mut iterations).for_each(|(done, i)| *i += usize::from(!done));

        let improved = now.simd_lt(lowest * lane(0.5));
        waiting = improved.select(Lane::ZERO, waiting + Lane::ONE);
        if iteration > EASY || options.max_iter() <= EASY {
            let better = now.simd_lt(kept) & !done;
            keep_best(best, &chain.u, better);
            kept = better.select(now, kept);
        }
        lowest = now.simd_lt(lowest).select(now, lowest);
        let at_floor = waiting.simd_ge(lane(PATIENCE)) & lowest.simd_le(floor) & now.simd_le(floor);
        let arrived = (now.simd_le(tol) | at_floor) & !done;
        converged |= arrived;
        done |= arrived | now.is_nan();
        if done.all() || iteration >= options.max_iter() || monitor.poll() {
            break;
        }

        match options.method {
            Method::FixedPoint => fixed_point::update(space, chain, ends, t, step),
            Method::Auto | Method::QuasiNewton => {
                quasi_newton::update(space, chain, ends, t, step);
                let contraction = now / last;
                let lost = contraction.simd_gt(lane(10.0)) & !done;
                if lost.any() {
                    anderson.forget(lost);
                }
                if iteration > 1 {
                    anderson.mix(contraction, &chain.u, step);
                }
            }
        }
        first = if iteration == 2 { now } else { first };
        last = now;
        for (u, s) in chain.u.iter_mut().zip(&*step) {
            *u = done.select(*u, *u + *s);
        }
        if legs.simd_gt(lane(0.5 * limit)).any() {
            shorten(space, chain, limit, done);
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
    let rate = mean_rate(first, residuals, &iterations);
    Outcome { iterations, residual: residuals, converged: mask_bits(converged), rate, leg: legs }
}

/// Scales velocities back whose outer legs would pass the cut locus: beyond it the C² condition
/// has spurious solutions.
fn shorten<M: Space>(space: &M, chain: &mut Chain, limit: f64, done: Lane) {
    let m = chain.m;
    for i in 0..=chain.n {
        let h = chain.h[i.max(1) - 1].max(chain.h[i.min(chain.n - 1)]);
        let u = &mut chain.u[i * m..(i + 1) * m];
        let leg = space.norm2(u).sqrt() * h * lane(1.0 / 3.0);
        let long = leg.simd_gt(lane(limit)) & !done;
        if long.any() {
            u.iter_mut().for_each(|x| *x = long.select(*x * lane(limit) / leg, *x));
        }
    }
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
