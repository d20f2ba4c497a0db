//! Two conditions at one end: a velocity and an acceleration.
//!
//! On the given knots they would be one condition too many: they determine the first segment, and with it all others, and
//! errors grow by the factor 2 + √3 per segment. The curve therefore has an additional knot in its outer segment, whose
//! point is free.
//!
//! The conditions determine the control points b₁ and b₂ of the segment from the end p₀ to the additional point a:
//!
//! ```text
//! b₁ = exp_{p₀}(v),  b₂ = E(v) exp_{p₀}(v + (h'²/6) S(v) A),  v = h'u/3.
//! ```
//!
//! By the C¹ condition, a lies on the geodesic from b₂ to the first control point q of the next segment, and divides it
//! as the knot divides the time. The unknown is therefore q alone. As the handle z with q = `exp_{p₀}(z)` it takes the place
//! of the velocity at the end, which is prescribed: the equation at the next node depends on q in the same way as
//! on the handle of a segment that begins at p₀. The equation of the end is the C² condition at a. With c =
//! `log_{b₂}(q)`, y = `log_{b₂}(b₁)`, and Y the logarithm from q to the next control point, transported to b₂, it is
//!
//! ```text
//! S(λc)(Y − (1 − λ)c)/h² = S((1 − λ)c)(y + λc)/h'²,    λ = h'/(h' + h).
//! ```
//!
//! Its Jacobian is block tridiagonal like that of any other end. All solvers apply.

use super::chain::{Chain, Joint, Run};
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::ends::ChainEnd;
use super::node::NodeVectors;
use super::problem::Both;
use super::vector::{length2, stretch_by};
use crate::scalar::{LANES, Lane, Scalar, gather, lane};
use crate::space::{Ambient, Erased, Frame, Origin, Space, below};

const THIRD: Lane = lane(1.0 / 3.0);

/// The vectors that are prescribed at one end of the chains, and the distance in time of the additional knot.
#[derive(Clone, Copy)]
pub struct BothRows<'a> {
    velocities: [&'a [f64]; LANES],
    accelerations: [&'a [f64]; LANES],
    /// h'
    apart: Lane,
}

impl<'a> BothRows<'a> {
    /// The same for all lanes, from a velocity and an acceleration, one after the other.
    pub fn of_one(vectors: &'a [f64], apart: f64) -> Self {
        let (velocity, acceleration) = vectors.split_at(vectors.len() / 2);
        BothRows { velocities: [velocity; LANES], accelerations: [acceleration; LANES], apart: lane(apart) }
    }
}

impl Joint {
    fn new(
        space: &Erased,
        (frame, p): (&[Lane], &[Lane]),
        next: &[Lane],
        ends: &BothRows,
        sign: Lane,
    ) -> Self {
        let (m, len) = (space.dim(), space.point_len());
        let zeros = |size: usize| vec![Lane::ZERO; size];
        let [first, second] = control_points(space, (frame, p), ends, sign);
        let (mut here, mut chord) = (frame.to_vec(), zeros(m));
        space.step(&mut here, p, &second, &mut chord);
        let back = chord.iter().map(|x| -*x).collect();
        let (mut ambient, mut bend) = (zeros(len), zeros(m));
        space.log(&second, &first, &mut ambient);
        space.coordinates(&here, &second, &ambient, &mut bend);
        let mut along = frame.to_vec();
        space.step(&mut along, p, next, &mut chord);
        space.step(&mut here, &second, next, &mut chord);
        let (mut turn, mut unit, mut turned) = (zeros(m * m), zeros(m), zeros(m));
        for k in 0..m {
            unit[k] = Lane::ONE;
            space.tangent(&along, next, &unit, &mut ambient);
            space.coordinates(&here, next, &ambient, &mut turned);
            unit[k] = Lane::ZERO;
            turned.iter().enumerate().for_each(|(r, x)| turn[r * m + k] = *x);
        }
        Joint {
            chords: [back, chord],
            prepared: [zeros(space.chord_len()), zeros(space.chord_len())],
            turn,
            bend,
            apart: ends.apart,
        }
    }

    /// Scales all lengths, and prepares the chords.
    pub fn scaled(&self, space: &Erased, factor: Lane) -> Self {
        let mut joint = self.clone();
        for x in joint.chords.iter_mut().flatten().chain(&mut joint.bend) {
            *x *= factor;
        }
        for (chord, prepared) in joint.chords.iter().zip(&mut joint.prepared) {
            space.prepare(chord, prepared);
        }
        joint
    }

    /// λ
    fn share(&self, h: Lane) -> Lane {
        self.apart / (self.apart + h)
    }

    /// Whether both sides of the additional knot are of equal length, up to rounding.
    fn is_halved(&self, h: Lane) -> Lane {
        (self.apart - h).abs().simd_le(h * lane(16.0 * f64::EPSILON))
    }

    /// The diagonal of the end row of T; the other entry is 1/h.
    pub fn diagonal(&self, h: Lane) -> Lane {
        let inverse = Lane::ONE / h;
        let rest = self.share(h) * h * (Lane::ONE / (self.apart * self.apart) - inverse * inverse);
        lane(2.0) * inverse + self.is_halved(h).select(Lane::ZERO, rest)
    }

    /// The residual of the end; `u` is the unknown there, `next` the velocity at the next node.
    pub fn residual<S: Scalar>(
        &self,
        space: &Erased,
        h: Lane,
        sign: Lane,
        u: &[S],
        next: &[S],
        work: &mut NodeVectors<S>,
        out: &mut [S],
    ) {
        let m = u.len();
        let NodeVectors { a, b, left: c, right: scratch, .. } = work;
        let third = sign * h * THIRD;
        // z and its image c
        for i in 0..m {
            (a[i], b[i]) = (S::constant(Lane::ZERO), u[i] * -third);
        }
        space.inner_handles(&self.chords[0], &self.prepared[0], a, b, c, scratch);
        for (b, row) in b.iter_mut().zip(self.turn.chunks_exact(m)) {
            *b = next.iter().zip(row).fold(S::constant(Lane::ZERO), |sum, (x, t)| sum + *x * (*t * third));
        }
        space.inner_handles(&self.chords[1], &self.prepared[1], c, b, out, scratch);
        let (share, halved) = (self.share(h), self.is_halved(h));
        let (square, before) = (Lane::ONE / (h * h), Lane::ONE / (self.apart * self.apart));
        for i in 0..m {
            a[i] = (out[i] - c[i] - S::constant(self.bend[i])) * square;
            out[i] = (out[i] - c[i] * (Lane::ONE - share)) * square;
            b[i] = (c[i] * share + S::constant(self.bend[i])) * before;
        }
        if !halved.all() {
            stretch_by(space, share, c, out);
            stretch_by(space, Lane::ONE - share, c, b);
        }
        for i in 0..m {
            out[i] = S::select(halved, a[i], out[i] - b[i]) * sign;
        }
    }
}

/// b₁ and b₂. At the last point, where the sign is −1, time runs backwards. b₂ is NaN if it lies beyond the cut locus of b₁:
/// the geodesic between them would be another one.
pub fn control_points(
    space: &Erased,
    (frame, p): (&[Lane], &[Lane]),
    ends: &BothRows,
    sign: Lane,
) -> [Vec<Lane>; 2] {
    let (m, len) = (space.dim(), space.point_len());
    let zeros = |size: usize| vec![Lane::ZERO; size];
    let (h, mut handle, mut pull) = (sign * ends.apart, zeros(len), zeros(len));
    gather(ends.velocities, &mut handle);
    handle.iter_mut().for_each(|x| *x *= h * THIRD);
    gather(ends.accelerations, &mut pull);
    pull.iter_mut().for_each(|x| *x = *x * h * h * lane(1.0 / 6.0));
    let (mut v, mut w) = (zeros(m), zeros(m));
    space.coordinates(frame, p, &handle, &mut v);
    space.coordinates(frame, p, &pull, &mut w);
    space.stretch(&v, &mut w);
    w.iter_mut().zip(&v).for_each(|(w, v)| *w += *v);
    space.tangent(frame, p, &w, &mut pull);
    let [mut first, mut at, mut second] = [(); 3].map(|()| zeros(len));
    space.ray(p, &handle, Lane::ONE, &mut first);
    space.ray(p, &pull, Lane::ONE, &mut at);
    space.transvect(p, &handle, &at, &mut second);
    let near = space.angle_at(p, &pull).simd_lt(below(space.cut_angle()));
    second.iter_mut().for_each(|x| *x = near.select(*x, lane(f64::NAN)));
    [first, second]
}

impl Chain {
    /// Computes the joint at an end of the chain; the walker must be there.
    pub(super) fn join_end(
        &mut self,
        space: &Erased,
        which: usize,
        runs: &[Run; LANES],
        ends: Option<&BothRows>,
    ) {
        self.joints[which] = ends.map(|ends| {
            let ChainEnd { next, .. } = ChainEnd::of(which, self.n);
            let mut neighbour = vec![Lane::ZERO; space.point_len()];
            gather(runs.map(|r| r.point(next, space.point_len())), &mut neighbour);
            let sign = if which == 0 { Lane::ONE } else { -Lane::ONE };
            let at = (&self.walker.frame[..], &self.walker.p[..]);
            let mut joint = Joint::new(space, at, &neighbour, ends, sign);
            joint.apart *= self.clock;
            joint.scaled(space, self.scale)
        });
    }
}

impl ChainEnds {
    /// The lanes in which an end has two conditions that no segment satisfies.
    pub fn lost(&self, chain: &Chain) -> Lane {
        let ChainEnds::Open(kinds) = self else { return Lane::ZERO };
        chain.joints.iter().zip(kinds).fold(Lane::ZERO, |lost, (joint, kinds)| match joint {
            Some(joint) => lost | (of_kind(kinds, EndKind::Both) & !length2(&joint.bend).is_finite()),
            None => lost,
        })
    }
}

impl<'a> Both<'a> {
    /// The rows of these curves, for vectors of `len` numbers.
    pub(super) fn rows(&self, len: usize, curves: [usize; LANES]) -> BothRows<'a> {
        let rows = |which: usize| curves.map(|c| &self.vectors[(2 * c + which) * len..][..len]);
        let apart = Lane::new(curves.map(|c| self.apart[c]));
        BothRows { velocities: rows(0), accelerations: rows(1), apart }
    }
}
