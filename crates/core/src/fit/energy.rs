//! The bending energy ∫ |∇γ'|² dt of (1), which Riemannian cubics minimise.

use super::chain::Chain;
use crate::curve::Segment;
use crate::matrix::GAUSS;
use crate::scalar::{Jet, Lane, lane};
use crate::space::{Ambient, Erased, Frame};

/// The energy of each lane, and the length of its longest segment, in the units of the chain. Every segment is transported
/// in parallel to the first point, which preserves lengths if the space has a metric. Otherwise lengths are those of
/// coordinates in the frames.
pub fn bending(space: &Erased, chain: &mut Chain) -> (Lane, Lane) {
    let (n, m, len) = (chain.n, chain.m, space.point_len());
    let mut segment = Segment::<Jet>::new(len);
    let zeros = || vec![Lane::ZERO; len];
    let (mut along, mut behind) = (zeros(), zeros());
    let mut gamma = vec![Jet { v: Lane::ZERO, d: Lane::ZERO, dd: Lane::ZERO }; len];
    let (mut sum, mut longest) = (Lane::ZERO, Lane::ZERO);
    chain.with_velocities(|chain, u| {
        let (frame, p) = chain.home();
        for i in 0..n {
            let h = chain.h[i];
            let third = |i: usize| -> Vec<Lane> {
                u[i * m..(i + 1) * m].iter().map(|u| *u * h * lane(1.0 / 3.0)).collect()
            };
            space.tangent(frame, p, &chain.chord[i * m..(i + 1) * m], &mut along);
            segment.ends[0].copy_from_slice(p);
            let [_, q] = &mut segment.ends;
            space.ray(p, &along, Lane::ONE, q);
            space.tangent(frame, p, &third(i), &mut segment.handles[0]);
            space.tangent(frame, p, &third(i + 1), &mut behind);
            space.parallel_transport(p, &segment.ends[1], &along, &behind, &mut segment.handles[1]);
            segment.prepare(space, len);
            let mut length = Lane::ZERO;
            for (s, weight) in GAUSS {
                segment.at(space, len, Jet { v: lane(s), d: Lane::ONE, dd: Lane::ZERO }, &mut gamma);
                let part = |f: fn(&Jet) -> Lane| -> Vec<Lane> { gamma.iter().map(f).collect() };
                let (at, d, mut dd) = (part(|x| x.v), part(|x| x.d), part(|x| x.dd));
                space.acceleration(&at, &d, &mut dd);
                sum += lane(weight) * space.inner(&at, &dd, &dd) / (h * h * h);
                length += lane(weight) * space.inner(&at, &d, &d).sqrt();
            }
            longest = longest.max(length);
        }
    });
    (sum, longest)
}
