//! A homotopy from the spline in flat space, for points that are far apart.
//!
//! All steps of the polygon, unrolled into its frames, are scaled by λ. At λ = 0 the spline is that of flat space, at
//! λ = 1 it is the requested one, and Newton's method follows it in between. Points that are far apart have several
//! splines; this one is the continuation of the spline through points that are close together.

use super::chain::{Chain, Joint};
use super::problem::Solver;
use super::solve::{Lanes, Limits, Outcome, solve};
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
pub fn follow(lanes: &mut Lanes, limits: Limits, idle: Lane, outcome: &mut Outcome) {
    let (space, monitor) = (lanes.space, lanes.monitor);
    let idle = outcome.settled(idle);
    // Intermediate curves need not be accurate.
    let within = |used: Lane, most: usize, tol: f64| Limits {
        tol: limits.tol.max(lane(tol)),
        max_iter: (limits.max_iter - used).min(lane(most as f64)),
    };
    let whole = Polygon {
        chords: lanes.chain.chord.clone(),
        values: lanes.chain.end_values.clone(),
        joints: lanes.chain.joints.clone(),
    };
    let best = lanes.chain.unknowns().to_vec();
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
        whole.scale(space, lanes.chain, goal);
        lanes.update(|_, u| predict(u, &curves, positions, goal));
        let within = within(used, CORRECTIONS, LOOSE);
        let found = solve(lanes, Solver::Homotopy, within, done);
        used += done.select(Lane::ZERO, Lane::new(found.iterations.map(|n| n as f64)));
        let reached = mask_from(|l| found.converged[l]) & !done;
        let failed = !reached & !done;
        for (i, u) in lanes.chain.unknowns().iter().enumerate() {
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
    whole.scale(space, lanes.chain, Lane::ONE);
    let arrived = at.simd_ge(Lane::ONE) & limits.max_iter.simd_gt(used) & !idle;
    lanes.update(|_, u| {
        for ((u, b), c) in u.iter_mut().zip(&best).zip(&curves[1]) {
            *u = arrived.select(*c, *b);
        }
    });
    if arrived.none() {
        return;
    }
    let within = within(used, 2 * CORRECTIONS, 0.0);
    let last = solve(lanes, Solver::Homotopy, within, !arrived);
    outcome.take(lanes, &best, &last, arrived);
}

/// The given polygon and its ends.
struct Polygon {
    chords: Vec<Lane>,
    values: [Vec<Lane>; 2],
    joints: [Option<Joint>; 2],
}

impl Polygon {
    /// Scales the polygon of a chain and its end vectors by λ.
    fn scale(&self, space: &Erased, chain: &mut Chain, at: Lane) {
        let (m, keep) = (chain.m, space.chord_len());
        for (d, c) in chain.chord.iter_mut().zip(&self.chords) {
            *d = *c * at;
        }
        for i in 0..chain.n {
            space.prepare(&chain.chord[i * m..(i + 1) * m], &mut chain.prepared[i * keep..(i + 1) * keep]);
        }
        for (value, all) in chain.end_values.iter_mut().zip(&self.values) {
            for (v, a) in value.iter_mut().zip(all) {
                *v = *a * at;
            }
        }
        for (joint, whole) in chain.joints.iter_mut().zip(&self.joints) {
            *joint = whole.as_ref().map(|whole| whole.scaled(space, at));
        }
    }
}

/// The secant through the last two curves; u/λ is nearly constant.
pub fn predict(u: &mut [Lane], curves: &[Vec<Lane>; 2], positions: [Lane; 2], goal: Lane) {
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
