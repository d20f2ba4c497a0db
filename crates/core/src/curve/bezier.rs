//! De Casteljau's algorithm with geodesics, (8).

use super::data::Curves;
use crate::scalar::{Lane, Scalar, lane};
use crate::space::Ambient;

/// One cubic Bézier segment on each lane, by its end points and outer handles; reused.
pub struct Segment<S> {
    /// `p_i` and `p_{i+1}`.
    pub ends: [Vec<Lane>; 2],
    /// `log_{p_i}(q⁺)` and `−log_{p_{i+1}}(q⁻)`: h/3 times the end velocities.
    pub handles: [Vec<Lane>; 2],
    /// The control points q⁺ and q⁻.
    controls: [Vec<Lane>; 2],
    /// `log_{q⁺}(q⁻)`.
    middle: Vec<Lane>,
    /// What [`Ambient::prepare_ray`](crate::space::Ambient::prepare_ray) computes for the geodesics of the first level.
    rays: [Vec<Lane>; 3],
    /// Lanes in which the inner handle is too long for a ray, see
    /// [`Ambient::longest_ray`](crate::space::Ambient::longest_ray).
    long: Lane,
    /// Those of them that are geodesics.
    straight: Lane,
    /// See [`Covered::side`](crate::space::Covered::side).
    pub side: Lane,
    level: [Vec<S>; 3],
}

impl<S> Default for Segment<S> {
    fn default() -> Self {
        Segment {
            ends: Default::default(),
            handles: Default::default(),
            controls: Default::default(),
            middle: Vec::new(),
            rays: Default::default(),
            long: Lane::ZERO,
            straight: Lane::ZERO,
            side: Lane::ONE,
            level: [Vec::new(), Vec::new(), Vec::new()],
        }
    }
}

impl<S: Scalar> Segment<S> {
    /// Reserves memory for points of `len` numbers.
    pub fn new(len: usize) -> Self {
        let mut segment = Segment::default();
        segment.resize(len);
        segment
    }

    /// Changes the size of the memory to points of `len` numbers.
    pub fn resize(&mut self, len: usize) {
        let Segment { ends: [p0, p1], handles: [a, b], controls: [q0, q1], middle, .. } = self;
        [p0, p1, a, b, q0, q1, middle].into_iter().for_each(|lanes| lanes.resize(len, Lane::ZERO));
        self.level.iter_mut().for_each(|points| points.resize(len, S::constant(Lane::ZERO)));
    }

    /// Reads a segment of a curve into all lanes.
    pub fn read(&mut self, curves: &Curves, curve: usize, segment: usize, len: usize) {
        let t = curves.knots(curve);
        let third = (t[segment + 1] - t[segment]) / 3.0;
        let velocities = curves.one_sided();
        for e in 0..2 {
            let row = (curve * curves.nodes + segment + e) * len;
            for j in 0..len {
                self.ends[e][j] = lane(curves.points[row + j]);
                self.handles[e][j] = lane(velocities[e][row + j] * third);
            }
        }
    }

    /// Computes control points and the inner handle from end points and outer handles.
    #[inline(always)]
    pub fn prepare<M: Ambient>(&mut self, space: &M, len: usize) {
        self.prepare_chosen(space, len, |_, _| {});
    }

    /// The same in a space that covers another one; `choose` selects one of the points over the second control point,
    /// see [`Covered::choose`](crate::space::Covered::choose).
    #[inline(always)]
    pub fn prepare_chosen<M: Ambient>(
        &mut self,
        space: &M,
        len: usize,
        choose: impl FnOnce(&[Lane], [&mut [Lane]; 3]),
    ) {
        let ([p0, p1], [a, b], [q0, q1]) = (&mut self.ends, &mut self.handles, &mut self.controls);
        let (p0, p1, a, b) = (&mut p0[..len], &mut p1[..len], &mut a[..len], &mut b[..len]);
        let (q0, q1) = (&mut q0[..len], &mut q1[..len]);
        let middle = &mut self.middle[..len];
        self.rays.iter_mut().for_each(|ray| ray.resize(space.ray_len(), Lane::ZERO));
        let [first, between, last] = &mut self.rays;
        space.prepare_ray(p0, a, first);
        space.prepared_ray(p0, a, first, Lane::ONE, q0);
        space.ray(p1, b, lane(-1.0), q1);
        choose(q0, [q1, p1, b]);
        let angle = space.log(q0, q1, middle);
        space.prepare_ray(q0, middle, between);
        space.prepare_ray(p1, b, last);
        // Most spaces have no such limit, which the compiler can see.
        if space.longest_ray().is_finite() {
            self.long = angle.simd_gt(lane(space.longest_ray()));
            self.straight =
                if self.long.any() { straight(space, [p0, p1], [a, b], self.long) } else { self.long };
        }
    }

    /// γ(t), for t in units of the segment.
    ///
    /// The first three geodesics start at fixed points with known velocities. No logarithm of an outer handle is
    /// computed, so that handles close to the cut locus remain exact.
    #[inline(always)]
    pub fn at<M: Ambient>(&mut self, space: &M, len: usize, t: S, gamma: &mut [S]) {
        let ([p0, p1], [a, b], [x, y, z]) = (&self.ends, &self.handles, &mut self.level);
        let (p0, p1, a, b) = (&p0[..len], &p1[..len], &a[..len], &b[..len]);
        let (x, y, z) = (&mut x[..len], &mut y[..len], &mut z[..len]);
        let gamma = &mut gamma[..len];
        let [first, middle, last] = &self.rays;
        space.prepared_ray(p0, a, first, t, x);
        space.prepared_ray(&self.controls[0][..len], &self.middle[..len], middle, t, y);
        if space.longest_ray().is_finite() && self.long.any() {
            between(space, &self.controls, self.long, t, y);
        }
        space.prepared_ray(p1, b, last, t - Lane::ONE, z);
        space.geodesic(x, y, t, gamma);
        space.geodesic(y, z, t, x);
        space.geodesic(gamma, x, t, y);
        gamma.copy_from_slice(y);
        if space.longest_ray().is_finite() && self.straight.any() {
            between(space, &self.ends, self.straight, t, gamma);
        }
    }
}

/// The lanes whose outer handles are a third of the geodesic between the end points, up to rounding. Control points on
/// a long geodesic have errors that its end points do not have.
#[cold]
#[inline(never)]
fn straight<M: Ambient>(space: &M, [p, q]: [&[Lane]; 2], [a, b]: [&[Lane]; 2], lanes: Lane) -> Lane {
    const ROUNDING: f64 = 16.0 * f64::EPSILON;
    let mut log = vec![Lane::ZERO; p.len()];
    let mut straight = lanes;
    for (from, to, handle, third) in [(p, q, a, 3.0), (q, p, b, -3.0)] {
        space.log(from, to, &mut log);
        let size = log.iter().fold(Lane::ZERO, |most, x| most.max(x.abs()));
        for (x, handle) in log.iter().zip(handle) {
            straight &= (*handle * lane(third) - *x).abs().simd_le(size * lane(ROUNDING));
        }
    }
    straight
}

/// Replaces points by those on the geodesic between two points.
#[cold]
#[inline(never)]
fn between<S: Scalar, M: Ambient>(space: &M, ends: &[Vec<Lane>; 2], lanes: Lane, t: S, y: &mut [S]) {
    let [mut p, mut q, mut x] = [y.to_vec(), y.to_vec(), y.to_vec()];
    for i in 0..y.len() {
        p[i] = S::constant(ends[0][i]);
        q[i] = S::constant(ends[1][i]);
    }
    space.geodesic(&p, &q, t, &mut x);
    for i in 0..y.len() {
        y[i] = S::select(lanes, x[i], y[i]);
    }
}
