//! Least squares of the C² residual in a trust region: Powell's dogleg (1970) with the block tridiagonal Jacobian.
//!
//! From zero velocities this method reaches a curve where Newton's method diverges: every step reduces the residual,
//! within the region where its linear model is accurate.

use super::chain::Chain;
use super::condition::residual;
use super::convergence::Convergence;
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::handles::shorten;
use super::newton;
use super::node::C2Residual;
use super::problem::Solver;
use super::solve::{Lanes, Limits, Outcome, Workspace};
use crate::scalar::{Lane, dot, lane};
use crate::space::{Ambient, Erased};

/// Outer handles stay within this fraction of the distance to the cut locus.
const HANDLE_LIMIT: f64 = 0.999;
/// The fractions of the predicted reduction from which a step is accepted, and the region is enlarged or reduced.
const TAKEN: f64 = 1e-4;
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;
/// The radius of the first region, relative to the largest distance over time. Larger first steps pass the cut locus.
const FIRST: f64 = 0.1;
/// A region that is smaller than this fraction of the velocities ends the iteration.
const SMALLEST: f64 = 1e-12;

/// The linear model of the residual at the current iterate.
struct Model {
    /// Half the gradient of the squared residual, and the product of the Jacobian with it.
    gradient: Vec<Lane>,
    image2: Lane,
    /// The step of Newton's method.
    newton: Vec<Lane>,
}

/// Iterates from the unknowns of a chain. Lanes in `idle` do not change.
pub fn solve(lanes: &mut Lanes, limits: Limits, idle: Lane) -> Outcome {
    let (space, ends, monitor) = (lanes.space, lanes.ends, lanes.monitor);
    let (chain, work) = (&mut *lanes.chain, &mut *lanes.work);
    let count = chain.unknowns().len();
    let weights = weights(chain, ends);
    let limit = space.cut_angle() * HANDLE_LIMIT;
    let mut state = Convergence::new(chain, limits.tol, idle);
    let zeros = || vec![Lane::ZERO; count];
    let mut model = Model { gradient: zeros(), image2: Lane::ONE, newton: zeros() };
    let mut here = chain.unknowns().to_vec();
    let infinity = lane(f64::INFINITY);
    let mut reached = C2Residual { residual: infinity, speed: Lane::ONE, handle: Lane::ZERO };
    let (mut square, mut gain, mut length) = (infinity, infinity, Lane::ZERO);
    let mut radius = chain.pace * lane(FIRST);
    let least = chain.pace * lane(SMALLEST);
    for iteration in 1.. {
        let found = residual(space, chain, ends, &mut work.vectors);
        let now = weighted2(&chain.r[..count], &weights, chain.m);
        // The first iterate is accepted as it is.
        let part = square.simd_eq(infinity).select(Lane::ONE, (square - now) / gain);
        let taken = part.simd_gt(lane(TAKEN)) & now.simd_lt(infinity) & !state.done;
        let keep = |new: Lane, old: Lane| taken.select(new, old);
        reached = C2Residual {
            residual: keep(found.residual, reached.residual),
            speed: keep(found.speed, reached.speed),
            handle: keep(found.handle, reached.handle),
        };
        for (h, u) in here.iter_mut().zip(chain.unknowns()) {
            *h = keep(*u, *h);
        }
        square = keep(now, square);
        let shrunk = !part.simd_ge(lane(POOR));
        let grown = part.simd_gt(lane(GOOD)) & length.simd_gt(radius * lane(0.99));
        radius = shrunk.select(length * lane(POOR), grown.select(radius * lane(2.0), radius));
        state.note(iteration, reached, chain.pace);
        state.leave(radius.simd_le(least) | limits.reached(iteration));
        if state.done.all() || monitor.poll() {
            state.end();
            break;
        }
        if taken.any() {
            linearise(space, chain, ends, work, &weights, taken, &mut model);
        }
        let step = dogleg(&model, square, radius);
        (gain, length) = (step.gain, step.length);
        let done = state.done;
        chain.update(space, |chain, u| {
            for (i, u) in u.iter_mut().enumerate() {
                let s = step.newton * model.newton[i] - step.gradient * model.gradient[i];
                *u = done.select(here[i], here[i] + s);
            }
            shorten(space, chain, limit, |node| done | ends.given(chain.n, node), u);
        });
    }
    chain.update(space, |_, u| u.copy_from_slice(&here));
    let converged = state.converged;
    Outcome::of(space, chain, &state, Solver::TrustRegion, converged)
}

/// The factor that converts the residual of a node to a velocity.
fn weights(chain: &Chain, ends: &ChainEnds) -> Vec<Lane> {
    let n = chain.n;
    let joint = |a: usize, b: usize| chain.h[a] * chain.h[b] / (chain.h[a] + chain.h[b]);
    let mut weights: Vec<Lane> = (0..=n).map(|i| joint((i + n - 1) % n, i % n)).collect();
    if let ChainEnds::Open(kinds) = ends {
        for (node, segment, kinds) in [(0, 0, &kinds[0]), (n, n - 1, &kinds[1])] {
            // At this end the residual is a velocity, or a third of one.
            let given = of_kind(kinds, EndKind::Velocity) | of_kind(kinds, EndKind::NotAKnot);
            weights[node] = given.select(lane(3.0), chain.h[segment]);
        }
    }
    weights
}

fn weighted2(r: &[Lane], weights: &[Lane], m: usize) -> Lane {
    r.chunks_exact(m).zip(weights).fold(Lane::ZERO, |sum, (r, w)| sum + dot(r, r) * *w * *w)
}

/// Computes the model of the residual in `chain.r` on the lanes of a mask.
fn linearise(
    space: &Erased,
    chain: &mut Chain,
    ends: &ChainEnds,
    work: &mut Workspace,
    weights: &[Lane],
    lanes: Lane,
    model: &mut Model,
) {
    let (m, closed) = (chain.m, matches!(ends, ChainEnds::Periodic));
    let nodes = model.gradient.len() / m;
    work.newton.differentiate(space, chain, ends);
    let scaled: Vec<Lane> = chain.r[..nodes * m]
        .chunks_exact(m)
        .zip(weights)
        .flat_map(|(r, w)| r.iter().map(|r| *r * *w * *w).collect::<Vec<_>>())
        .collect();
    let (mut gradient, mut image) = (vec![Lane::ZERO; nodes * m], vec![Lane::ZERO; nodes * m]);
    work.newton.blocks.transposed_times(nodes, m, closed, &scaled, &mut gradient);
    work.newton.blocks.times(nodes, m, closed, &gradient, &mut image);
    let mut step = vec![Lane::ZERO; nodes * m];
    newton::solve(chain, ends, &mut work.newton, &mut step);
    for (old, new) in [(&mut model.gradient, &gradient), (&mut model.newton, &step)] {
        old.iter_mut().zip(new).for_each(|(old, new)| *old = lanes.select(*new, *old));
    }
    model.image2 = lanes.select(weighted2(&image, weights, m), model.image2);
}

/// A step `newton · n − gradient · g`, its length, and the reduction of the squared residual that the model predicts.
struct Step {
    newton: Lane,
    gradient: Lane,
    length: Lane,
    gain: Lane,
}

fn dogleg(model: &Model, square: Lane, radius: Lane) -> Step {
    let (g, n) = (&model.gradient[..], &model.newton[..]);
    let (gg, nn, gn) = (dot(g, g), dot(n, n), dot(g, n));
    // The minimum of the model along the gradient.
    let cauchy = gg / model.image2;
    let down = (cauchy * cauchy * gg).sqrt();
    // The intersection of the path from there to Newton's step with the boundary: |c + τ(n − c)| = radius with c =
    // −cauchy · g.
    let cn = -(cauchy * gn);
    let (a, b, c) = (nn - cn * lane(2.0) + down * down, cn - down * down, down * down - radius * radius);
    let tau = (-c) / (b + (b * b - a * c).max(Lane::ZERO).sqrt());
    let whole = nn.sqrt().simd_le(radius);
    let short = !down.simd_lt(radius) | !nn.is_finite();
    let newton = whole.select(Lane::ONE, short.select(Lane::ZERO, tau));
    let steepest = short.select(radius.min(down) / gg.sqrt(), cauchy * (Lane::ONE - tau));
    let gradient = whole.select(Lane::ZERO, steepest);
    let moved = newton.simd_eq(Lane::ZERO).select(
        gradient * gradient * gg,
        newton * newton * nn - newton * gradient * gn * lane(2.0) + gradient * gradient * gg,
    );
    // r + J s = (1 − newton) r − gradient · J g, and r · J g = |g|².
    let rest = Lane::ONE - newton;
    let left = rest * rest * square - lane(2.0) * rest * gradient * gg + gradient * gradient * model.image2;
    Step { newton, gradient, length: moved.sqrt(), gain: square - left }
}
