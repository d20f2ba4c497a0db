//! Frames along a curve: those at its knots, transported along geodesics to positions nearby.

use crate::frames::{Frames, lanes_of};
use crate::path::{Path, nearest, positions};
use symspline_core::memory;
use symspline_core::scalar::{LANES, Lane, gather, scatter};
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// Velocities and accelerations at the knots, in coordinates of the frames there and in units of the mean knot spacing.
pub struct Bending {
    /// γ'.
    pub speeds: Vec<f64>,
    /// ∇γ'.
    pub accelerations: Vec<f64>,
}

/// A curve with frames, transported along the polygon of its knots.
pub struct Along<'a> {
    space: &'a Erased<'a>,
    path: Path<'a>,
    frames: Frames<'a>,
}

impl<'a> Along<'a> {
    /// The frames of a curve.
    pub fn new(space: &'a Erased<'a>, t: &'a [f64], points: &'a [f64], velocities: &'a [f64]) -> Self {
        Along { space, path: Path { t, points, velocities }, frames: Frames::new(space, points) }
    }

    /// The frames at points of the curve at times x: m vectors each.
    pub fn frames(&self, x: &[f64], points: &[f64]) -> Vec<f64> {
        let (m, len) = (self.space.dim(), self.space.point_len());
        memory::require(
            (2 * x.len() + self.path.t.len()) as f64 * (m * len) as f64,
            "the frames along the curve",
            "Use fewer measurements, or average them",
        );
        let near: Vec<usize> = positions(self.path.t, x).into_iter().map(nearest).collect();
        let mut out = vec![0.0; x.len() * m * len];
        let [mut p, mut q, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
        let (mut frame, mut chord) = (vec![Lane::ZERO; self.space.frame_len()], vec![Lane::ZERO; m]);
        let mut coordinates = vec![Lane::ZERO; m * m];
        let mut rows = vec![0.0; LANES * len];
        for group in 0..x.len().div_ceil(LANES) {
            let at = lanes_of(group, x.len());
            self.frames.at(at.map(|i| near[i]), &mut frame, &mut p, &mut coordinates);
            gather(at.map(|i| &points[i * len..][..len]), &mut q);
            self.space.step(&mut frame, &p, &q, &mut chord);
            for (j, x) in coordinates.chunks_exact(m).enumerate() {
                self.space.tangent(&frame, &q, x, &mut v);
                scatter(&v, &mut rows);
                for (i, row) in at.iter().zip(rows.chunks_exact(len)) {
                    out[(i * m + j) * len..][..len].copy_from_slice(row);
                }
            }
        }
        out
    }

    /// The tangent vectors at all knots with given coordinates in the frames there.
    pub fn tangents(&self, coordinates: &[f64]) -> Vec<f64> {
        self.frames.tangents(coordinates)
    }

    /// The motion of the curve at its knots.
    pub fn bending(&self) -> Bending {
        let last = self.path.t.len() - 1;
        let spacing = (self.path.t[last] - self.path.t[0]) / last as f64;
        let in_frames = |vectors: &[f64], unit: f64| -> Vec<f64> {
            self.frames.coordinates(vectors, |i| i).into_iter().map(|x| x * unit).collect()
        };
        let accelerations = self.path.accelerations(self.space, &self.path.knots());
        Bending {
            speeds: in_frames(self.path.velocities, spacing),
            accelerations: in_frames(&accelerations, spacing * spacing),
        }
    }
}
