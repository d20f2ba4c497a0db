//! Algorithm 1 of the paper, on any knots: full steps, without line search or limit on the control points.
//!
//! One sweep evaluates the end velocities by (19) or (20) from the present inner velocities, and then updates all inner
//! nodes at once by (17), `vᵢ ← vᵢ + δᵢ/4` with `δᵢ = w⁺ − w⁻ − 2vᵢ`. In the unknowns `uᵢ = 3vᵢ/h` and with the C² residual
//! r of `condition.rs`, (17) is one step of Jacobi's iteration on the flat-space matrix T,
//! `uᵢ ← uᵢ + 3rᵢ/(2/hᵢ₋₁ + 2/hᵢ)`, which extends it to any knots and to closed curves.

use super::chain::Chain;
use super::condition::residual;
use super::convergence::Convergence;
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::ends::{ChainEnd, NotAKnot};
use super::node::NodeVectors;
use super::problem::Solver;
use super::solve::{Lanes, Limits, Outcome};
use super::vector::stretch_by;
use crate::scalar::{LANES, Lane, lane};
use crate::space::{Erased, Origin};

const THIRD: Lane = lane(1.0 / 3.0);
const HALF: Lane = lane(0.5);

/// Iterates on the unknowns of a chain until every lane stops. Lanes in `idle` do not change. The last iterate is
/// kept even if it did not converge.
pub fn solve(lanes: &mut Lanes, limits: Limits, idle: Lane) -> Outcome {
    let (space, ends, monitor) = (lanes.space, lanes.ends, lanes.monitor);
    let (chain, work) = (&mut *lanes.chain, &mut *lanes.work);
    work.t.build(chain, ends);
    let mut state = Convergence::new(chain, limits.tol, idle);
    // Lanes whose logarithm is undefined: a control point reached the cut locus.
    let mut broken = Lane::ZERO;
    for iteration in 1.. {
        if let ChainEnds::Open(kinds) = ends {
            set_end_velocities(space, chain, kinds, state.done, &mut work.vectors);
        }
        let found = residual(space, chain, ends, &mut work.vectors);
        state.note(iteration, found, chain.pace);
        broken |= !found.residual.is_finite() & !state.done;
        state.leave(broken | limits.reached(iteration));
        if state.done.all() || monitor.poll() {
            state.end();
            break;
        }
        let (done, t) = (state.done, &work.t);
        chain.update(space, |chain, u| {
            let m = chain.m;
            for (i, (u, r)) in u.chunks_exact_mut(m).zip(chain.r.chunks_exact(m)).enumerate() {
                let done = match ends {
                    ChainEnds::Open(kinds) if i == 0 => done | !of_kind(&kinds[0], EndKind::Both),
                    ChainEnds::Open(kinds) if i == chain.n => done | !of_kind(&kinds[1], EndKind::Both),
                    _ => done,
                };
                if done.all() {
                    continue;
                }
                let factor = lane(3.0) / t.diagonal[i];
                for c in 0..m {
                    u[c] = done.select(u[c], factor.mul_add(r[c], u[c]));
                }
            }
        });
    }
    let converged = state.converged;
    Outcome::of(space, chain, &state, Solver::FixedPoint, converged | broken)
}

/// Evaluates the velocities at both ends from those of their neighbours, on lanes that are not `done`.
fn set_end_velocities(
    space: &Erased,
    chain: &mut Chain,
    kinds: &[[EndKind; LANES]; 2],
    done: Lane,
    vectors: &mut NodeVectors<Lane>,
) {
    let (n, m) = (chain.n, chain.m);
    vectors.resize(m);
    let both = [0, 1].map(|which| end_velocity(space, chain, which, &kinds[which], vectors));
    chain.update(space, |_, u| {
        for (node, end) in [0, n].into_iter().zip(&both) {
            for (u, e) in u[node * m..(node + 1) * m].iter_mut().zip(end) {
                *u = done.select(*u, *e);
            }
        }
    });
}

fn end_velocity(
    space: &Erased,
    chain: &Chain,
    which: usize,
    kinds: &[EndKind; LANES],
    vectors: &mut NodeVectors<Lane>,
) -> Vec<Lane> {
    let (m, keep) = (chain.m, space.chord_len());
    let ChainEnd { node, next, near, far } = ChainEnd::of(which, chain.n);
    let (h, u) = (chain.h[near], chain.velocities());
    let (own, neighbour) = (&u[node * m..(node + 1) * m], &u[next * m..(next + 1) * m]);
    let given = &chain.end_values[which];
    // (19)
    let mut end = given.clone();
    let accelerated = of_kind(kinds, EndKind::Acceleration);
    if accelerated.any() {
        // (20), v = ½ log_p(q) with the neighbour's control point q: the condition w(v) = v of a natural end, w(v) =
        // log_p(E(−v)·q), holds there, because w(0) = 2v. With an acceleration A it is w(v) − v = (h²/6) S(v) A, and
        // v ← v + ½ (w(v) − v − (h²/6) S(v) A) from the present v.
        let NodeVectors { a, b, left, right, .. } = vectors;
        let curved = given.iter().fold(Lane::ZERO, |any, x| any | x.simd_ne(Lane::ZERO)) & accelerated;
        let sign = if which == 0 { Lane::ONE } else { -Lane::ONE };
        for c in 0..m {
            a[c] = curved.select(own[c] * h * THIRD, Lane::ZERO);
            b[c] = neighbour[c] * h * THIRD;
        }
        let (chord, prepared) = (&chain.chord[near * m..][..m], &chain.prepared[near * keep..][..keep]);
        if which == 0 {
            space.inner_handles(chord, prepared, a, b, left, right);
        } else {
            space.inner_handles(chord, prepared, b, a, right, left);
        }
        let mut pull = given.clone();
        if curved.any() {
            stretch_by(space, h * THIRD, own, &mut pull);
        }
        for c in 0..m {
            let bend = curved.select(pull[c] * h * h * lane(1.0 / 6.0), Lane::ZERO);
            let v = a[c] + HALF * (sign * (left[c] - bend) - a[c]);
            end[c] = accelerated.select(v * lane(3.0) / h, end[c]);
        }
    }
    let knot = of_kind(kinds, EndKind::NotAKnot);
    if knot.any() {
        let weights = NotAKnot::of(h, chain.h[far], chain.n, false);
        let chord = |i: usize| &chain.chord[i * m..(i + 1) * m];
        weights.velocity(space, chord(near), chord(far), neighbour, &mut vectors.b);
        for c in 0..m {
            end[c] = knot.select(vectors.b[c], end[c]);
        }
    }
    // The equation of an end with two conditions is solved like that of an inner node.
    let both = of_kind(kinds, EndKind::Both);
    end.iter_mut().zip(own).for_each(|(end, own)| *end = both.select(*own, *end));
    end
}
