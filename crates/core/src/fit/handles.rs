//! Whether the handles of a curve's Bézier segments are inside the cut locus, and short enough for floating-point
//! numbers.

use super::chain::{Chain, Run};
use super::problem::Status;
use crate::scalar::{LANES, Lane, dot, gather, lane, scatter};
use crate::space::{Ambient, Erased, Origin, below};

const THIRD: Lane = lane(1.0 / 3.0);

/// Shortens velocities whose outer handles would exceed the `limit`: beyond the cut locus the C² condition has
/// spurious solutions. `fixed` contains the lanes that do not change, node by node.
pub fn shorten(
    space: &Erased,
    chain: &Chain,
    limit: f64,
    fixed: impl Fn(usize) -> Lane,
    unknowns: &mut [Lane],
) {
    for (i, u) in unknowns.chunks_exact_mut(chain.m).enumerate() {
        let (fixed, third) = (fixed(i), chain.longer(i) * THIRD);
        let length = dot(u, u).sqrt() * third;
        if !(length.simd_gt(lane(limit.min(space.injectivity_radius()))) & !fixed).any() {
            continue;
        }
        let handle = space.angle(&u.iter().map(|u| *u * third).collect::<Vec<_>>());
        let long = handle.simd_gt(lane(limit)) & !fixed;
        if long.any() {
            u.iter_mut().for_each(|x| *x = long.select(*x * lane(limit) / handle, *x));
        }
    }
}

/// The first handle that is too long on each of the `lanes`, by deciding angle. `longest` is the length of the longest
/// outer handle.
pub fn long_handles(
    space: &Erased,
    chain: &mut Chain,
    longest: Lane,
    lanes: Lane,
) -> [Option<Status>; LANES] {
    let mut found = [None; LANES];
    let radius = lane(space.injectivity_radius());
    // The inner handle is at most as long as the path along the other handles, so most curves need no further check.
    let around = chain.longest + longest * lane(2.0);
    if (longest.simd_lt(lane(space.longest_handle())) & around.simd_lt(radius) | !lanes).all() {
        return found;
    }
    chain.with_velocities(|chain, u| {
        let m = chain.m;
        let handle = |node: usize, h: Lane| -> Vec<Lane> {
            u[node * m..(node + 1) * m].iter().map(|u| *u * (h * THIRD)).collect()
        };
        let mut note = |angle: Lane, limit: Lane, status: &dyn Fn(f64) -> Status| {
            let long = !angle.simd_lt(limit) & lanes;
            for l in (0..LANES).filter(|l| long.to_bitmask() >> l & 1 == 1) {
                found[l].get_or_insert(status(angle.to_array()[l]));
            }
        };
        let (mut plus, mut minus) = (vec![Lane::ZERO; m], vec![Lane::ZERO; m]);
        for i in 0..=chain.n {
            let outer = handle(i, chain.longer(i));
            if !(dot(&outer, &outer).sqrt().simd_lt(radius.min(lane(space.longest_handle())))).all() {
                note(space.angle(&outer), lane(space.longest_handle()), &|angle| Status::LongHandle {
                    index: i,
                    angle,
                });
            }
            if i == chain.n {
                break;
            }
            let (chord, keep) = (&chain.chord[i * m..][..m], space.chord_len());
            let (a, b) = (handle(i, chain.h[i]), handle(i + 1, chain.h[i]));
            let around = [chord, &a, &b].iter().fold(Lane::ZERO, |sum, x| sum + dot(x, x).sqrt());
            if !around.simd_lt(radius).all() {
                space.inner_handles(
                    chord,
                    &chain.prepared[i * keep..][..keep],
                    &a,
                    &b,
                    &mut plus,
                    &mut minus,
                );
                note(space.angle(&plus), below(space.cut_angle()), &|angle| Status::InnerHandle {
                    index: i,
                    angle,
                });
            }
        }
    });
    found
}

/// The first control point of each lane that floating-point numbers represent with too few significant digits. This
/// occurs where rays amplify rounding errors. `longest` is the length of the longest outer handle.
pub fn noisy_handles(
    space: &Erased,
    chain: &mut Chain,
    runs: &[Run; LANES],
    longest: Lane,
) -> [Option<Status>; LANES] {
    /// Handles up to this length keep control points close to their nodes.
    const SHORT: f64 = 1.5;
    let mut found = [None; LANES];
    let far = !longest.simd_le(lane(SHORT));
    if space.longest_ray().is_infinite() || far.none() {
        return found;
    }
    let (n, len) = (chain.n, space.point_len());
    let h: Vec<Lane> = (0..n).map(|i| chain.duration(i) * THIRD).collect();
    let (mut p, mut q, mut rows) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len], vec![0.0; LANES * len]);
    chain.roll_up(space, runs, |i, u| {
        gather(runs.map(|run| run.point(i, len)), &mut p);
        let before = (i > 0).then(|| -h[i.max(1) - 1]);
        let behind = (i < n).then(|| h[i.min(n - 1)]);
        for third in before.into_iter().chain(behind) {
            space.ray(&p, u, third, &mut q);
            scatter(&q, &mut rows);
            let length = (space.inner(&p, u, u).sqrt() * third).abs().to_array();
            for (l, q) in rows.chunks_exact(len).enumerate().filter(|(l, _)| far.to_bitmask() >> l & 1 == 1) {
                if space.imprecise_point(q).is_some() {
                    found[l].get_or_insert(Status::LongHandle { index: i, angle: length[l] });
                }
            }
        }
    });
    found
}
