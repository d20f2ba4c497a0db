//! Random points, vectors and representatives, reproducible in every run.

use crate::scalar::{LANES, Lane, dot, lane, max_or_nan};
use crate::space::{Ambient, Erased, Frame, Origin};

/// The fractions of the largest step at which laws are tested.
pub const STEPS: [f64; 8] = [1e-9, 1e-6, 1e-3, 0.03, 0.2, 0.6, 0.95, 0.999];
/// The largest step in a space without cut locus.
const FAR: f64 = 3.0;
/// In directions with small angles, steps may be longer than the limit of angles by this factor.
const LONGEST: f64 = 3.0;

/// A source of random data.
pub struct Draw(u64);

impl Draw {
    /// Starts from a seed.
    pub fn new(seed: u64) -> Self {
        let mut draw = Draw(seed ^ 0x9e37_79b9_7f4a_7c15);
        // The first numbers of adjacent seeds are similar.
        for _ in 0..8 {
            draw.uniform();
        }
        draw
    }

    /// Between 0 and 1 (Knuth's generator).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// Standard normal numbers.
    pub fn noise(&mut self, len: usize) -> Vec<Lane> {
        (0..len).map(|_| Lane::new([(); LANES].map(|()| self.normal()))).collect()
    }

    /// A point.
    pub fn point(&mut self, space: &Erased) -> Vec<Lane> {
        let mut p = self.noise(space.point_len());
        space.random_point(&mut p);
        p
    }

    /// Coordinates of length one.
    pub fn unit(&mut self, space: &Erased) -> Vec<Lane> {
        let x = self.noise(space.dim());
        let scale = Lane::ONE / dot(&x, &x).sqrt();
        x.iter().map(|x| *x * scale).collect()
    }

    /// Coordinates whose deciding angle is this fraction of the largest.
    pub fn coordinates(&mut self, space: &Erased, part: f64) -> Vec<Lane> {
        let x = self.unit(space);
        let angle = space.angle(&x);
        let limit = space.cut_angle();
        // In directions without an angle (translations of motions, stretches of matrices), lengths are used.
        let scale = if limit.is_finite() {
            let far = lane(part * limit) / angle;
            far.simd_lt(lane(LONGEST * part * limit)).select(far, lane(part))
        } else {
            lane(part * FAR) / dot(&x, &x).sqrt()
        };
        x.iter().map(|x| *x * scale).collect()
    }

    /// A tangent vector at p whose deciding angle is this fraction of the largest.
    pub fn vector(&mut self, space: &Erased, p: &[Lane], part: f64) -> Vec<Lane> {
        let x = self.coordinates(space, part);
        tangent_at(space, p, &x)
    }

    /// The same point at another representative, if it has any: transported around a triangle. Otherwise the same
    /// array.
    pub fn representative(&mut self, space: &Erased, p: &[Lane]) -> Vec<Lane> {
        let mut q = p.to_vec();
        for _ in 0..3 {
            let v = self.vector(space, &q, 0.4);
            q = exp(space, &q, &v);
        }
        let back = log(space, &q, p).0;
        let mut near = exp(space, &q, &back);
        space.project(&mut near);
        // Rounding errors of the transport are removed, which are large far out in unbounded spaces.
        let other = exp(space, &near, &log(space, &near, p).0);
        if is_other(&other, p) { other } else { p.to_vec() }
    }
}

/// Whether two arrays of one point are different representatives.
pub fn is_other(q: &[Lane], p: &[Lane]) -> bool {
    norm(&minus(q, p)).simd_gt(lane(1e-3)).all()
}

/// The tangent vector with coordinates x in the frame that a point is lifted to.
pub fn tangent_at(space: &Erased, p: &[Lane], x: &[Lane]) -> Vec<Lane> {
    let (mut frame, mut v) = (vec![Lane::ZERO; space.frame_len()], vec![Lane::ZERO; space.point_len()]);
    space.lift(p, &mut frame);
    space.tangent(&frame, p, x, &mut v);
    v
}

pub fn exp(space: &Erased, p: &[Lane], v: &[Lane]) -> Vec<Lane> {
    let mut q = vec![Lane::ZERO; p.len()];
    space.ray(p, v, Lane::ONE, &mut q);
    q
}

/// The logarithm and the deciding angle.
pub fn log(space: &Erased, p: &[Lane], q: &[Lane]) -> (Vec<Lane>, Lane) {
    let mut v = vec![Lane::ZERO; p.len()];
    let angle = space.log(p, q, &mut v);
    (v, angle)
}

/// Length of a tangent vector; that of its array if the space has no metric.
pub fn length(space: &Erased, p: &[Lane], v: &[Lane]) -> Lane {
    max_or_nan(space.inner(p, v, v), Lane::ZERO).sqrt()
}

pub fn distance(space: &Erased, p: &[Lane], q: &[Lane]) -> Lane {
    let (v, angle) = log(space, p, q);
    space.distance(p, q, &v, angle)
}

pub fn combined(a: &[Lane], x: f64, b: &[Lane]) -> Vec<Lane> {
    a.iter().zip(b).map(|(a, b)| lane(x).mul_add(*b, *a)).collect()
}

pub fn scaled(a: &[Lane], x: f64) -> Vec<Lane> {
    a.iter().map(|a| *a * lane(x)).collect()
}

pub fn minus(a: &[Lane], b: &[Lane]) -> Vec<Lane> {
    combined(a, -1.0, b)
}

/// `a − b` of arrays of points close together. Angles in (−π, π] may differ by a whole turn, which is not a step.
pub fn step_between(a: &[Lane], b: &[Lane]) -> Vec<Lane> {
    let turn = lane(std::f64::consts::TAU);
    let turned = |d: Lane, a: Lane, b: Lane| {
        let angles = a.abs().max(b.abs()).simd_le(lane(std::f64::consts::PI));
        (angles & d.abs().simd_gt(lane(4.0))).select(d - turn * (d / turn).round(), d)
    };
    a.iter().zip(b).map(|(&a, &b)| turned(a - b, a, b)).collect()
}

pub fn norm(a: &[Lane]) -> Lane {
    dot(a, a).sqrt()
}

/// The number of rounding errors to allow at the points p and q, and over coordinates x, according to the space's own
/// condition and rounding.
pub fn rounding(space: &Erased, count: f64, points: &[&[Lane]], x: &[Lane]) -> Lane {
    let at = points.iter().fold(Lane::ONE, |most, p| most.max(space.rounding(p)));
    lane(count * f64::EPSILON) * at * space.condition(x)
}
