//! The motion of a curve at the times of measurements, and its moves in frames along it.

use crate::frames::{curvature_terms, lanes_of};
use symspline_core::matrix::{Matrix, inverse};
use symspline_core::monitor::Monitor;
use symspline_core::rows::{Operation, apply};
use symspline_core::scalar::{LANES, Lane, gather, scatter};
use symspline_core::space::{Ambient, Erased, Origin};

/// The relative step of central differences: their truncation and rounding errors are then both about 1e-11.
pub const STEP: f64 = 6e-6;

/// Two points that no unique geodesic joins, or a number that is not finite: the row, and the deciding angle with its
/// limit.
#[derive(Clone, Copy, Debug)]
pub struct BadRow {
    /// The row.
    pub row: usize,
    /// The deciding angle; NaN for numbers that are not finite.
    pub angle: f64,
    /// Its limit.
    pub limit: f64,
}

/// Applies an operation of a space to rows.
pub fn applied(
    space: &Erased,
    operation: Operation,
    inputs: &[&[f64]],
    monitor: &Monitor,
) -> Result<Vec<f64>, BadRow> {
    let mut out = vec![0.0; inputs[0].len()];
    apply(space, operation, inputs, &[], monitor, &mut out).map_err(|(row, angle)| BadRow {
        row,
        angle,
        limit: space.cut_angle(),
    })?;
    Ok(out)
}

/// The motion of a curve in a space that is not a product, at n times.
pub struct Motion<'a> {
    /// The space.
    pub space: &'a Erased<'a>,
    /// Points.
    pub p: Vec<f64>,
    /// Velocities; empty if no measurement needs them.
    pub v: Vec<f64>,
    /// Covariant accelerations; empty if no measurement needs them.
    pub a: Vec<f64>,
    /// Frames along the curve, m vectors per time.
    pub frames: Vec<f64>,
}

impl Motion<'_> {
    /// The points, the velocities or the accelerations.
    pub fn derivative(&self, nu: usize) -> &[f64] {
        [&self.p, &self.v, &self.a][nu]
    }

    /// The j-th vectors of the frames.
    pub fn vectors(&self, j: usize) -> Vec<f64> {
        let (m, len) = (self.space.dim(), self.space.point_len());
        let frames = self.frames.chunks_exact(m * len);
        frames.flat_map(|frame| &frame[j * len..(j + 1) * len]).copied().collect()
    }

    /// The motion after the derivative of order `nu` of the move has changed along the j-th vectors of the frames.
    ///
    /// If the point moves by ξ, parallel transport to the new point leaves the velocity unchanged, and the acceleration
    /// changes by R(ξ, γ')γ'. The result has no frames.
    pub fn moved(&self, j: usize, nu: usize, step: f64, monitor: &Monitor) -> Result<Self, BadRow> {
        let (space, vectors) = (self.space, self.vectors(j));
        let changed =
            |x: &[f64], by: &[f64]| x.iter().zip(by).map(|(x, e)| x + step * e).collect::<Vec<f64>>();
        let [mut p, mut v, mut a] = [&self.p, &self.v, &self.a].map(Vec::clone);
        match nu {
            2 => a = changed(&a, &vectors),
            1 => v = changed(&v, &vectors),
            _ => {
                let way: Vec<f64> = vectors.iter().map(|e| step * e).collect();
                p = applied(space, Operation::Exp, &[&self.p, &way], monitor)?;
                if !v.is_empty() {
                    v = applied(space, Operation::Transport, &[&self.p, &p, &v], monitor)?;
                }
                if !a.is_empty() {
                    let turned = changed(&a, &self.curvature(j));
                    a = applied(space, Operation::Transport, &[&self.p, &p, &turned], monitor)?;
                }
            }
        }
        Ok(Motion { space, p, v, a, frames: Vec::new() })
    }

    /// The derivatives of points, velocities and accelerations if that of order `nu` moves along the j-th vectors of the
    /// frames; empty where they vanish.
    pub fn change(&self, j: usize, nu: usize, monitor: &Monitor) -> Result<Vec<Vec<f64>>, BadRow> {
        let mut changes = [(); 3].map(|_| Vec::new());
        changes[nu] = self.vectors(j);
        if nu == 0 && !self.v.is_empty() {
            let [after, before] = [STEP, -STEP].map(|step| self.moved(j, 0, step, monitor));
            let (after, before) = (after?, before?);
            for (order, change) in changes.iter_mut().enumerate().skip(1) {
                let both = after.derivative(order).iter().zip(before.derivative(order));
                *change = both.map(|(a, b)| (a - b) / (2.0 * STEP)).collect();
            }
        }
        Ok(changes.into())
    }

    /// R(ξ, γ')γ' for the j-th vectors ξ of the frames.
    fn curvature(&self, j: usize) -> Vec<f64> {
        let (m, len) = (self.space.dim(), self.space.point_len());
        let mut out = vec![0.0; self.p.len()];
        if self.space.curvature() == 0.0 {
            return out;
        }
        let speeds = coordinates(self.space, &self.p, &self.frames, &self.v);
        let unit: Vec<f64> = (0..speeds.len()).map(|i| f64::from(i % m == j)).collect();
        let terms = curvature_terms(self.space, &speeds, &unit);
        let frames = self.frames.chunks_exact(m * len).zip(terms.chunks_exact(m));
        for (out, (frame, x)) in out.chunks_exact_mut(len).zip(frames) {
            for (vector, x) in frame.chunks_exact(len).zip(x) {
                out.iter_mut().zip(vector).for_each(|(out, e)| *out += x * e);
            }
        }
        out
    }

    /// The step of a difference in the derivative of order `nu`.
    pub fn step(&self, nu: usize) -> f64 {
        if nu == 0 && self.space.curvature() != 0.0 {
            return STEP;
        }
        let (vectors, len) = (self.derivative(nu), self.space.point_len());
        let count = (vectors.len() / len) as f64;
        let mut mean = vec![0.0; len];
        if nu == 0 {
            vectors
                .chunks_exact(len)
                .for_each(|x| mean.iter_mut().zip(x).for_each(|(sum, x)| *sum += x / count));
        }
        let square = |x: &[f64]| x.iter().zip(&mean).map(|(x, mean)| (x - mean).powi(2)).sum::<f64>();
        let numbers = count * (len as f64) / if self.space.is_complex() { 2.0 } else { 1.0 };
        STEP * (1.0 + (vectors.chunks_exact(len).map(square).sum::<f64>() / numbers).sqrt())
    }
}

/// Coordinates of tangent vectors at points p in frames there: m numbers each.
pub fn coordinates(space: &Erased, p: &[f64], frames: &[f64], vectors: &[f64]) -> Vec<f64> {
    let (m, len) = (space.dim(), space.point_len());
    let count = p.len() / len;
    let mut out = vec![0.0; count * m];
    let [mut at, mut vector] = [(); 2].map(|_| vec![Lane::ZERO; len]);
    let mut frame = vec![Lane::ZERO; m * len];
    let mut x = vec![Lane::ZERO; m];
    for (group, out) in out.chunks_mut(LANES * m).enumerate() {
        let rows = lanes_of(group, count);
        gather(rows.map(|i| &p[i * len..][..len]), &mut at);
        gather(rows.map(|i| &vectors[i * len..][..len]), &mut vector);
        gather(rows.map(|i| &frames[i * m * len..][..m * len]), &mut frame);
        if space.curvature().is_nan() {
            // Groups without a metric have frames that are not orthonormal.
            let frame = Matrix::<Lane, 1>::read(m, len, &frame);
            let right = frame.times(&Matrix::read(len, 1, &vector));
            inverse(&frame.times_adjoint(&frame)).times(&right).write(&mut x);
        } else {
            for (x, frame) in x.iter_mut().zip(frame.chunks_exact(len)) {
                *x = space.inner(&at, frame, &vector);
            }
        }
        scatter(&x, out);
    }
    out
}
