//! Parallel transport along a curve, (26a).
//!
//! Near a point q of the curve, tangent vectors are represented at q, by transport along geodesics to q. A vector
//! that is parallel along γ = exp_q(v) rotates there by x' = [[v, T w], x] with T = tanh(ad_v/2)/ad_v, where w is γ'
//! represented at q: [v, T w] is minus the component in 𝔥 of e^{−v}(e^v)' with S(v) v' = w (Lemma A.2).

use super::bezier::Segment;
use super::collocation::{STAGES, integrate, nodes};
use super::data::{Curves, Outside};
use super::locate::Locator;
use super::sample_cursor::inside;
use crate::monitor::{Monitor, checkpoint};
use crate::parallel;
use crate::scalar::{Dual, LANES, Lane, dot, lane};
use crate::space::{Ambient, Erased, Frame, Origin};

/// Taylor coefficients of tanh(z/2)/z in z².
const HALF_TANH: [f64; 9] = [
    1.0 / 2.0,
    -1.0 / 24.0,
    1.0 / 240.0,
    -17.0 / 40320.0,
    31.0 / 725760.0,
    -691.0 / 159667200.0,
    5461.0 / 12454041600.0,
    -929569.0 / 20922789888000.0,
    3202291.0 / 711374856192000.0,
];
/// The size of ad_v up to which these coefficients suffice: (0.4/π)¹⁸ is below rounding.
const NEAR: f64 = 0.4;
/// The maximum number of halvings of a segment.
const DEEPEST: usize = 12;
/// The maximum number of iterations; each reduces the error by a factor of ten.
const ITERATIONS: usize = 40;

/// A vector that is transported along segments of a curve.
struct Transport<'a> {
    space: &'a Erased<'a>,
    segment: Segment<Dual>,
    gamma: Vec<Dual>,
    /// The current point, and the vector there.
    position: Vec<Lane>,
    vector: Vec<Lane>,
}

impl<'a> Transport<'a> {
    fn new(space: &'a Erased<'a>) -> Self {
        let len = space.point_len();
        let lanes = || vec![Lane::ZERO; len];
        let gamma = vec![Dual { v: Lane::ZERO, d: Lane::ZERO }; len];
        Transport { space, segment: Segment::new(len), gamma, position: lanes(), vector: lanes() }
    }

    /// Points and velocities at several positions of the segment.
    fn at(&mut self, t: Lane) -> [Vec<Lane>; 2] {
        self.segment.at(self.space, self.position.len(), Dual { v: t, d: Lane::ONE }, &mut self.gamma);
        let y: Vec<Lane> = self.gamma.iter().map(|x| x.v).collect();
        let mut d: Vec<Lane> = self.gamma.iter().map(|x| x.d).collect();
        self.space.velocity(&y, &mut d);
        [y, d]
    }

    /// Transports the vector along the geodesic to another point.
    fn move_to(&mut self, q: &[Lane]) {
        let mut way = vec![Lane::ZERO; q.len()];
        self.space.log(&self.position, q, &mut way);
        let x = self.vector.clone();
        self.space.parallel_transport(&self.position, q, &way, &x, &mut self.vector);
        self.position.copy_from_slice(q);
    }

    /// Transports the vector along the segment from its position a to its position b.
    fn along(&mut self, a: f64, b: f64, depth: usize) {
        let space = self.space;
        let (dim, len) = (space.dim(), self.position.len());
        let q = self.position.clone();
        let mut frame = vec![Lane::ZERO; space.frame_len()];
        space.lift(&q, &mut frame);
        let steepness = if space.curvature().is_nan() { 1.0 } else { space.curvature() };
        // v and T w at the nodes.
        let mut turning: Vec<[Vec<Lane>; 2]> = Vec::new();
        for s in nodes().as_chunks::<LANES>().0 {
            let [y, d] = self.at(Lane::new(s.map(|s| a + s * (b - a))));
            let (mut way, mut seen) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
            space.log(&y, &q, &mut way);
            space.parallel_transport(&y, &q, &way, &d, &mut seen);
            let [mut v, mut w] = [(); 2].map(|_| vec![Lane::ZERO; dim]);
            space.coordinates(&frame, &q, &seen, &mut w);
            space.log(&q, &y, &mut way);
            space.coordinates(&frame, &q, &way, &mut v);
            let far = (dot(&v, &v).sqrt() * lane(steepness)).simd_gt(lane(NEAR)).any();
            if far && depth < DEEPEST {
                let middle = 0.5 * (a + b);
                self.along(a, middle, depth + 1);
                return self.along(middle, b, depth + 1);
            }
            let (mut u, mut term) = (vec![Lane::ZERO; dim], w);
            for (j, c) in HALF_TANH.iter().enumerate() {
                if j > 0 {
                    let last = term.clone();
                    space.triple(&v, &v, &last, &mut term);
                }
                u.iter_mut().zip(&term).for_each(|(u, x)| *u = x.mul_add(lane(c * (b - a)), *u));
            }
            turning.push([v, u]);
        }
        let mut start = vec![Lane::ZERO; dim];
        space.coordinates(&frame, &q, &self.vector, &mut start);
        let x = parallel_along(space, &turning, &start);
        space.tangent(&frame, &q, &x, &mut self.vector);
        let [end, _] = self.at(lane(b));
        self.move_to(&end);
    }
}

/// The final value of x' = [[v, u], x], for v and u at the nodes.
fn parallel_along(space: &Erased, turning: &[[Vec<Lane>; 2]], start: &[Lane]) -> Vec<Lane> {
    let dim = start.len();
    let mut rates = vec![[0.0; STAGES]; dim];
    let mut at = vec![vec![Lane::ZERO; dim]; turning.len()];
    let mut end = start.to_vec();
    for _ in 0..ITERATIONS {
        let found: Vec<_> = rates.iter().map(integrate).collect();
        let before = std::mem::take(&mut end);
        end = (0..dim).map(|i| start[i] + lane(found[i].1)).collect();
        let [mut p, mut n] = [(); 2].map(|_| vec![Lane::ZERO; dim]);
        for (group, [v, u]) in turning.iter().enumerate() {
            for i in 0..dim {
                at[group][i] = start[i] + Lane::new(found[i].0.as_chunks::<LANES>().0[group]);
            }
            space.triple(v, u, &at[group], &mut p);
            space.triple(u, v, &at[group], &mut n);
            for i in 0..dim {
                rates[i][group * LANES..][..LANES].copy_from_slice(&(p[i] - n[i]).to_array());
            }
        }
        let change: Vec<Lane> = end.iter().zip(&before).map(|(a, b)| *a - *b).collect();
        // The first round has no rates yet.
        let settled = lane(f64::EPSILON * f64::EPSILON) * dot(start, start);
        if rates.iter().flatten().all(|r| *r == 0.0)
            || (dot(&change, &change).simd_le(settled).all() && found.iter().any(|f| f.1 != 0.0))
        {
            break;
        }
    }
    end
}

/// Transports a tangent vector of every curve, at its point at time `from`, along the curve to time `to`. With
/// [`Outside::Wrap`] the transport continues around closed curves.
pub fn transport(
    space: &Erased,
    curves: &Curves,
    [from, to]: [f64; 2],
    outside: Outside,
    monitor: &Monitor,
    vectors: &mut [f64],
) {
    let len = space.point_len();
    let rows: Vec<(usize, &mut [f64])> = vectors.chunks_mut(len).enumerate().collect();
    let parallel = rows.len() > 1;
    parallel::for_each(rows, parallel, monitor, |(curve, vector)| {
        let mut transport = Transport::new(space);
        let segments = curves.nodes as i64 - 1;
        let [(first, a), (last, b)] = [from, to].map(|x| locate(curves.knots(curve), x, outside));
        let enter = |transport: &mut Transport, segment: i64| {
            transport.segment.read(curves, curve, segment.rem_euclid(segments) as usize, len);
            transport.segment.prepare(space, len);
        };
        enter(&mut transport, first);
        let [y, _] = transport.at(lane(a));
        transport.position.copy_from_slice(&y);
        transport.vector.iter_mut().zip(&*vector).for_each(|(x, v)| *x = lane(*v));
        let way = (last - first).signum();
        let (near, far) = if way < 0 { (1.0, 0.0) } else { (0.0, 1.0) };
        let mut segment = first;
        loop {
            checkpoint();
            let begin = if segment == first { a } else { near };
            let stop = if segment == last { b } else { far };
            if segment != first {
                enter(&mut transport, segment);
                let [y, _] = transport.at(lane(begin));
                transport.move_to(&y);
            }
            if begin != stop {
                transport.along(begin, stop, 0);
            }
            if segment == last {
                break;
            }
            segment += way;
        }
        vector.iter_mut().zip(&transport.vector).for_each(|(v, x)| *v = x.to_array()[0]);
        monitor.advance(1);
    });
}

/// The segment of a time, numbered on through the turns of a closed curve, and the position in it.
fn locate(t: &[f64], x: f64, outside: Outside) -> (i64, f64) {
    let (found, _) = inside(x, t, outside);
    let turns = ((x - found) / (t[t.len() - 1] - t[0])).round() as i64;
    let k = Locator::new(t, false).find(found, 0);
    (turns * (t.len() as i64 - 1) + k as i64, (found - t[k]) / (t[k + 1] - t[k]))
}
