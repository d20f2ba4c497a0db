//! A homotopy from the spline in flat space, for points that are far apart.
//!
//! All steps of the polygon, unrolled into its frames, are scaled by λ. At λ = 0 the spline is that of flat space, at
//! λ = 1 it is the requested one, and Newton's method follows it in between. Points that are far apart have several
//! splines; this one is the continuation of the spline through points that are close together.

use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::problem::Solver;
use super::solve::{Limits, Outcome, Workspace, solve};
use crate::monitor::Monitor;
use crate::scalar::{LANES, Lane, lane, mask_from};
use crate::space::{Erased, Origin};

/// The first step of λ, and the step at which a lane is abandoned.
const FIRST: f64 = 0.25;
const LEAST: f64 = 1.0 / 512.0;
/// Newton steps for one λ. If they do not suffice, the step of λ was too long.
const CORRECTIONS: usize = 12;
/// The tolerance of intermediate curves.
const LOOSE: f64 = 1e-8;

/// Solves the lanes that are neither `idle` nor settled, and updates their outcome.
pub fn follow(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    limits: Limits,
    idle: Lane,
    work: &mut Workspace,
    monitor: &Monitor,
    outcome: &mut Outcome,
) {
    let idle = outcome.settled(idle);
    // Intermediate curves need not be accurate.
    let within = |used: Lane, most: usize, tol: f64| Limits {
        tol: limits.tol.max(lane(tol)),
        max_iter: (limits.max_iter - used).min(lane(most as f64)),
    };
    let (chords, values) = (chain.chord.clone(), chain.end_values.clone());
    let best = chain.unknowns().to_vec();
    // The current and the next λ of each lane, and the last two curves with their λ.
    let (mut at, mut ahead) = (Lane::ZERO, lane(FIRST));
    let mut curves = [vec![Lane::ZERO; best.len()], vec![Lane::ZERO; best.len()]];
    let mut positions = [Lane::ZERO; 2];
    let mut lost = Lane::ZERO;
    let mut used = Lane::ZERO;
    loop {
        lost |= limits.max_iter.simd_le(used) & !idle;
        let done = idle | lost | at.simd_ge(Lane::ONE);
        if done.all() || monitor.poll() {
            break;
        }
        let goal = (at + ahead).min(Lane::ONE);
        scale(space, chain, &chords, &values, goal);
        chain.update(space, |_, u| predict(u, &curves, positions, goal));
        let within = within(used, CORRECTIONS, LOOSE);
        let found = solve(space, chain, ends, Solver::Homotopy, within, done, work, monitor);
        used += done.select(Lane::ZERO, Lane::new(found.iterations.map(|n| n as f64)));
        let reached = mask_from(|l| found.converged[l]) & !done;
        let failed = !reached & !done;
        for (i, u) in chain.unknowns().iter().enumerate() {
            curves[0][i] = reached.select(curves[1][i], curves[0][i]);
            curves[1][i] = reached.select(*u, curves[1][i]);
        }
        positions = [reached.select(positions[1], positions[0]), reached.select(goal, positions[1])];
        at = reached.select(goal, at);
        ahead = reached.select(ahead * lane(1.5), failed.select(ahead * lane(0.4), ahead));
        lost |= ahead.simd_lt(lane(LEAST)) & !done;
        for l in 0..LANES {
            outcome.iterations[l] += found.iterations[l];
        }
    }
    // The last stage, with the requested tolerance, from the last intermediate curve.
    scale(space, chain, &chords, &values, Lane::ONE);
    let arrived = at.simd_ge(Lane::ONE) & limits.max_iter.simd_gt(used) & !idle;
    chain.update(space, |_, u| {
        for ((u, b), c) in u.iter_mut().zip(&best).zip(&curves[1]) {
            *u = arrived.select(*c, *b);
        }
    });
    if arrived.none() {
        return;
    }
    let within = within(used, 2 * CORRECTIONS, 0.0);
    let last = solve(space, chain, ends, Solver::Homotopy, within, !arrived, work, monitor);
    outcome.take(space, chain, &best, &last, arrived);
}

/// Scales the polygon and the prescribed end vectors by λ.
fn scale(space: &Erased, chain: &mut Chain, chords: &[Lane], values: &[Vec<Lane>; 2], at: Lane) {
    let (m, keep) = (chain.m, space.chord_len());
    for (d, c) in chain.chord.iter_mut().zip(chords) {
        *d = *c * at;
    }
    for i in 0..chain.n {
        space.prepare(&chain.chord[i * m..(i + 1) * m], &mut chain.prepared[i * keep..(i + 1) * keep]);
    }
    for (value, all) in chain.end_values.iter_mut().zip(values) {
        for (v, a) in value.iter_mut().zip(all) {
            *v = *a * at;
        }
    }
}

/// The secant through the last two curves; u/λ is nearly constant.
fn predict(u: &mut [Lane], curves: &[Vec<Lane>; 2], positions: [Lane; 2], goal: Lane) {
    let slope = |i: usize| {
        let started = positions[i].simd_gt(Lane::ZERO);
        started.select(Lane::ONE / positions[i], Lane::ZERO)
    };
    let (before, now) = (slope(0), slope(1));
    // u/λ is extrapolated in λ; with one curve it is kept.
    let twice = positions[0].simd_gt(Lane::ZERO);
    let gap = twice.select(positions[1] - positions[0], Lane::ONE);
    let weight = twice.select((goal - positions[1]) / gap, Lane::ZERO);
    for (i, u) in u.iter_mut().enumerate() {
        let (b, n) = (curves[0][i] * before, curves[1][i] * now);
        *u = goal * (n + weight * (n - b));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The prediction for λ = `goal` from the curves at two values of λ; λ is 0 where no curve exists yet.
    fn predicted(curve: impl Fn(f64) -> f64, positions: [f64; 2], goal: f64) -> f64 {
        let mut u = [lane(0.0)];
        predict(&mut u, &positions.map(|at| vec![lane(curve(at))]), positions.map(lane), lane(goal));
        u[0].to_array()[0]
    }

    #[test]
    fn the_secant_of_velocities_over_lambda_is_followed() {
        let quadratic = |at: f64| at * (3.0 - 2.0 * at);
        for (positions, goal) in [([0.25, 0.625], 1.0), ([0.25, 0.3], 0.31), ([0.5, 0.75], 1.0)] {
            let found = predicted(quadratic, positions, goal);
            assert!((found - quadratic(goal)).abs() < 1e-14, "{positions:?}, {goal}: {found}");
        }
        // One curve predicts a line through zero, and no curve predicts zero.
        assert!((predicted(quadratic, [0.0, 0.25], 0.625) - 2.5 * quadratic(0.25)).abs() < 1e-15);
        assert_eq!(predicted(quadratic, [0.0, 0.0], 0.25), 0.0);
    }
}
