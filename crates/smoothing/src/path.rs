//! A curve and data near it: positions, points, accelerations, residuals.

use crate::frames::{Frames, lanes_of};
use symspline_core::curve::Segment;
use symspline_core::scalar::{Jet, LANES, Lane, Scalar, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased};

/// A position on a curve: the segment, and the fraction of it before the position.
pub type Position = (usize, f64);

/// A natural spline by its knots, points and velocities.
#[derive(Clone, Copy)]
pub struct Path<'a> {
    /// Knots.
    pub t: &'a [f64],
    /// Points at the knots.
    pub points: &'a [f64],
    /// Velocities there.
    pub velocities: &'a [f64],
}

/// The positions of times between the first and the last knot. Times that equal a knot up to rounding are moved to
/// it.
pub fn positions(t: &[f64], times: &[f64]) -> Vec<Position> {
    let last = t.len() - 2;
    let position = |x: &f64| {
        let segment = t[1..=last].partition_point(|t| t <= x);
        (segment, (x - t[segment]) / (t[segment + 1] - t[segment]))
    };
    times.iter().map(position).collect()
}

/// The nearest knot of a position.
pub fn nearest((segment, position): Position) -> usize {
    if position < 0.5 { segment } else { segment + 1 }
}

/// The knot at a position, if any.
fn at_knot((segment, position): Position) -> Option<usize> {
    (position == 0.0 || position == 1.0).then_some(segment + position as usize)
}

impl Path<'_> {
    /// Points at increasing times, continued by geodesics beyond the ends.
    pub fn prolonged(&self, space: &Erased, times: &[f64]) -> Vec<f64> {
        let len = space.point_len();
        let last = self.t.len() - 1;
        let inside: Vec<f64> = times.iter().map(|t| t.clamp(self.t[0], self.t[last])).collect();
        let points = self.at(space, &positions(self.t, &inside));
        let mut beyond = vec![0.0; points.len()];
        for (i, (t, near)) in times.iter().zip(&inside).enumerate() {
            let end = if *t < *near { 0 } else { last };
            for c in 0..len {
                beyond[i * len + c] = (t - near) * self.velocities[end * len + c];
            }
        }
        moved(space, &points, &beyond)
    }

    /// Evaluates positions in groups: `visit` receives the group, and the point with derivatives in units of
    /// the segment.
    fn each<S: Scalar>(
        &self,
        space: &Erased,
        positions: &[Position],
        mut visit: impl FnMut(usize, Lane, &[S]),
    ) {
        let len = space.point_len();
        let mut segment = Segment::<S>::new(len);
        let mut gamma = vec![S::constant(Lane::ZERO); len];
        for group in 0..positions.len().div_ceil(LANES) {
            let at = lanes_of(group, positions.len()).map(|i| positions[i]);
            let h = Lane::new(at.map(|(s, _)| self.t[s + 1] - self.t[s]));
            for e in 0..2 {
                gather(at.map(|(s, _)| &self.points[(s + e) * len..][..len]), &mut segment.ends[e]);
                gather(at.map(|(s, _)| &self.velocities[(s + e) * len..][..len]), &mut segment.handles[e]);
                segment.handles[e].iter_mut().for_each(|x| *x *= h * lane(1.0 / 3.0));
            }
            segment.prepare(space, len);
            let tau = Lane::new(at.map(|(_, position)| position));
            segment.at(space, len, S::from_parts([tau, Lane::ONE, Lane::ZERO]), &mut gamma);
            visit(group, h, &gamma);
        }
    }

    /// The points at given positions.
    pub fn at(&self, space: &Erased, positions: &[Position]) -> Vec<f64> {
        let len = space.point_len();
        if let Some(knots) =
            positions.iter().map(|&position| at_knot(position)).collect::<Option<Vec<usize>>>()
        {
            return knots.iter().flat_map(|i| &self.points[i * len..][..len]).copied().collect();
        }
        let mut out = vec![0.0; positions.len() * len];
        self.each::<Lane>(space, positions, |group, _, gamma| {
            let rows = &mut out[group * LANES * len..];
            let count = rows.len().min(LANES * len);
            scatter(gamma, &mut rows[..count]);
        });
        out
    }

    /// The covariant accelerations at given positions.
    pub fn accelerations(&self, space: &Erased, positions: &[Position]) -> Vec<f64> {
        let len = space.point_len();
        let mut out = vec![0.0; positions.len() * len];
        let [mut p, mut d, mut dd] = [(); 3].map(|_| vec![Lane::ZERO; len]);
        self.each::<Jet>(space, positions, |group, h, gamma| {
            for (i, g) in gamma.iter().enumerate() {
                [p[i], d[i], dd[i]] = g.parts();
            }
            space.acceleration(&p, &d, &mut dd);
            dd.iter_mut().for_each(|x| *x /= h * h);
            let rows = &mut out[group * LANES * len..];
            let count = rows.len().min(LANES * len);
            scatter(&dd, &mut rows[..count]);
        });
        out
    }

    /// The positions of all knots.
    pub fn knots(&self) -> Vec<Position> {
        let n = self.t.len() - 1;
        (0..=n).map(|i| if i < n { (i, 0.0) } else { (n - 1, 1.0) }).collect()
    }

    /// Vectors at positions with points `gammas`, transported to the nearest knots: coordinates in the frames there.
    pub fn at_knots(
        &self,
        space: &Erased,
        frames: &Frames,
        positions: &[Position],
        gammas: &[f64],
        vectors: &[f64],
    ) -> Vec<f64> {
        let len = space.point_len();
        let nearest = |i: usize| nearest(positions[i]);
        if positions.iter().all(|&position| at_knot(position).is_some()) {
            return frames.coordinates(vectors, nearest);
        }
        let mut transported = vec![0.0; vectors.len()];
        let [mut p, mut q, mut v, mut way, mut out] = [(); 5].map(|_| vec![Lane::ZERO; len]);
        for (group, transported) in transported.chunks_mut(LANES * len).enumerate() {
            let at = lanes_of(group, positions.len());
            gather(at.map(|i| &gammas[i * len..][..len]), &mut p);
            gather(at.map(|i| &self.points[nearest(i) * len..][..len]), &mut q);
            gather(at.map(|i| &vectors[i * len..][..len]), &mut v);
            space.log(&p, &q, &mut way);
            space.parallel_transport(&p, &q, &way, &v, &mut out);
            scatter(&out, transported);
        }
        frames.coordinates(&transported, nearest)
    }
}

/// `log_γ y` at points γ of a curve for data y, and the squared distances.
pub fn pulls(space: &Erased, gammas: &[f64], data: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let len = space.point_len();
    let count = gammas.len() / len;
    let (mut vectors, mut squares) = (vec![0.0; data.len()], vec![0.0; count]);
    let [mut p, mut y, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
    let rows = vectors.chunks_mut(LANES * len).zip(squares.chunks_mut(LANES));
    for (group, (vectors, squares)) in rows.enumerate() {
        let at = lanes_of(group, count);
        gather(at.map(|i| &gammas[i * len..][..len]), &mut p);
        gather(at.map(|i| &data[i * len..][..len]), &mut y);
        let angle = space.log(&p, &y, &mut v);
        let distance = space.distance(&p, &y, &v, angle);
        scatter(&v, vectors);
        squares.copy_from_slice(&(distance * distance).to_array()[..squares.len()]);
    }
    (vectors, squares)
}

/// Points moved along tangent vectors there.
pub fn moved(space: &Erased, points: &[f64], vectors: &[f64]) -> Vec<f64> {
    let len = space.point_len();
    let count = points.len() / len;
    let mut out = vec![0.0; points.len()];
    let [mut p, mut v, mut q] = [(); 3].map(|_| vec![Lane::ZERO; len]);
    for (group, out) in out.chunks_mut(LANES * len).enumerate() {
        let at = lanes_of(group, count);
        gather(at.map(|i| &points[i * len..][..len]), &mut p);
        gather(at.map(|i| &vectors[i * len..][..len]), &mut v);
        space.ray(&p, &v, Lane::ONE, &mut q);
        space.project(&mut q);
        scatter(&q, out);
    }
    out
}
