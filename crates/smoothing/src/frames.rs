//! One frame at every knot of a curve, transported along the polygon of its points.
//!
//! The polygon is divided into runs, one per SIMD lane. At the start of each run, the transformation from its
//! frame to the frame at the end of the preceding run is stored, so that coordinates refer to one frame transported
//! along the whole polygon.

use crate::linearized::LinearProblem;
use crate::problem::Penalty;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{LANES, Lane, few, gather, scatter};
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// The number of steps after which rounding errors of a frame are removed.
const TIDY: usize = 8;

/// Frames along a polygon.
pub struct Frames<'a> {
    space: &'a Erased<'a>,
    points: &'a [f64],
    frames: Vec<f64>,
    /// The number of knots of a run.
    run: usize,
    /// Matrices that convert coordinates in the frames of a run to those in the frame transported from the first
    /// knot, and back; row by row. The first run has none.
    turns: Vec<[Vec<f64>; 2]>,
}

impl<'a> Frames<'a> {
    /// Transports frames along the polygon of some points.
    pub fn new(space: &'a Erased<'a>, points: &'a [f64]) -> Self {
        let (len, size, m) = (space.point_len(), space.frame_len(), space.dim());
        let count = points.len() / len;
        // Joining the runs costs about as much as 2m steps.
        let run = if 2 * m + count / LANES < count { count.div_ceil(LANES).max(4) } else { count };
        let runs = count.div_ceil(run);
        let last = count - 1;
        let point = |knot: usize| &points[knot.min(last) * len..][..len];
        let begin: [usize; LANES] = few(|l| l.min(runs - 1) * run);

        let mut frames = vec![0.0; count * size];
        let [mut p, mut q] = [(); 2].map(|_| vec![Lane::ZERO; len]);
        let (mut frame, mut chord) = (vec![Lane::ZERO; size], vec![Lane::ZERO; m]);
        let mut rows = vec![0.0; LANES * size];
        gather(begin.map(point), &mut p);
        space.lift(&p, &mut frame);
        for i in 0..=run {
            checkpoint();
            if i > 0 {
                gather(begin.map(|k| point(k + i)), &mut q);
                space.step(&mut frame, &p, &q, &mut chord);
                std::mem::swap(&mut p, &mut q);
                if i % TIDY == 0 {
                    space.reorthonormalize(&mut frame, &p);
                }
            }
            if i < run {
                scatter(&frame, &mut rows);
                for (l, row) in rows.chunks_exact(size.max(1)).enumerate().take(runs) {
                    if let Some(own) = frames.get_mut((begin[l] + i) * size..(begin[l] + i + 1) * size) {
                        own.copy_from_slice(row);
                    }
                }
            }
        }
        let mut found = Frames { space, points, frames, run, turns: Vec::new() };
        found.join(runs, &frame, &p);
        found
    }

    /// Compares the final frames of the runs, `frame` at `p`, with the first frames of the next ones.
    fn join(&mut self, runs: usize, frame: &[Lane], p: &[Lane]) {
        let (space, m, len) = (self.space, self.space.dim(), self.space.point_len());
        let next: [usize; LANES] = few(|l| (l + 1).min(runs - 1) * self.run);
        let mut fresh = vec![Lane::ZERO; frame.len()];
        gather(next.map(|k| &self.frames[k * frame.len()..][..frame.len()]), &mut fresh);
        // If frames are not orthonormal, the inverse is not the transpose.
        let mut steps = vec![[(); 2].map(|_| vec![0.0; m * m]); runs - 1];
        let (mut x, mut v) = (vec![Lane::ZERO; m], vec![Lane::ZERO; len]);
        for column in 0..m {
            for (way, (from, to)) in [(&fresh[..], frame), (frame, &fresh[..])].into_iter().enumerate() {
                x.fill(Lane::ZERO);
                x[column] = Lane::ONE;
                space.tangent(from, p, &x, &mut v);
                space.coordinates(to, p, &v, &mut x);
                for (l, step) in steps.iter_mut().enumerate() {
                    (0..m).for_each(|row| step[way][row * m + column] = x[row].as_array()[l]);
                }
            }
        }
        for [forth, back] in steps {
            let turn = match self.turns.last() {
                None => [forth, back],
                Some(before) => [product(&before[0], &forth, m), product(&back, &before[1], m)],
            };
            self.turns.push(turn);
        }
    }

    /// The holonomy of a closed polygon, m × m numbers row by row: maps coordinates at the first knot to coordinates
    /// at the last one.
    pub fn round(&self) -> Vec<f64> {
        let (m, len) = (self.space.dim(), self.len());
        let last = self.points.len() / len - 1;
        let mut out = vec![0.0; m * m];
        for column in 0..m {
            let mut x = vec![0.0; (last + 1) * m];
            x[column] = 1.0;
            let there = self.coordinates(&self.tangents(&x)[..len], |_| last);
            there.iter().enumerate().for_each(|(row, y)| out[row * m + column] = *y);
        }
        out
    }

    /// The number of entries of a point.
    fn len(&self) -> usize {
        self.space.point_len()
    }

    fn frame_rows(&self, knots: [usize; LANES], frame: &mut [Lane], p: &mut [Lane]) {
        let (size, len) = (frame.len(), p.len());
        gather(knots.map(|k| &self.frames[k * size..][..size]), frame);
        gather(knots.map(|k| &self.points[k * len..][..len]), p);
    }

    /// The frames of some knots and their points, and the coordinates in them of the vectors of the frame that is
    /// transported from the first knot: m numbers for each vector.
    pub fn at(&self, knots: [usize; LANES], frame: &mut [Lane], p: &mut [Lane], vectors: &mut [Lane]) {
        self.frame_rows(knots, frame, p);
        let m = self.space.dim();
        let turns = knots.map(|knot| self.turn(knot));
        for (j, vector) in vectors.chunks_exact_mut(m).enumerate() {
            for (row, x) in vector.iter_mut().enumerate() {
                let entry = |turn: Option<&[Vec<f64>; 2]>| {
                    turn.map_or(f64::from(row == j), |turn| turn[1][row * m + j])
                };
                *x = Lane::new(turns.map(entry));
            }
        }
    }

    /// Coordinates of vectors, of which the i-th is tangent at the knot `knots(i)`.
    pub fn coordinates(&self, vectors: &[f64], knots: impl Fn(usize) -> usize) -> Vec<f64> {
        let (len, m) = (self.len(), self.space.dim());
        let count = vectors.len() / len;
        let mut out = vec![0.0; count * m];
        let (mut frame, mut p) = (vec![Lane::ZERO; self.space.frame_len()], vec![Lane::ZERO; len]);
        let (mut v, mut x) = (vec![Lane::ZERO; len], vec![Lane::ZERO; m]);
        for (group, out) in out.chunks_mut(LANES * m).enumerate() {
            let at = lanes_of(group, count);
            self.frame_rows(at.map(&knots), &mut frame, &mut p);
            gather(at.map(|i| &vectors[i * len..][..len]), &mut v);
            self.space.coordinates(&frame, &p, &v, &mut x);
            scatter(&x, out);
            for (l, x) in out.chunks_exact_mut(m).enumerate() {
                if let Some(turn) = self.turn(knots(at[l])) {
                    multiply(&turn[0], x);
                }
            }
        }
        out
    }

    /// The tangent vectors at all knots with given coordinates.
    pub fn tangents(&self, coordinates: &[f64]) -> Vec<f64> {
        let (len, m) = (self.len(), self.space.dim());
        let count = coordinates.len() / m;
        let mut own = coordinates.to_vec();
        for (knot, x) in own.chunks_exact_mut(m).enumerate() {
            if let Some(turn) = self.turn(knot) {
                multiply(&turn[1], x);
            }
        }
        let mut out = vec![0.0; count * len];
        let (mut frame, mut p) = (vec![Lane::ZERO; self.space.frame_len()], vec![Lane::ZERO; len]);
        let (mut v, mut x) = (vec![Lane::ZERO; len], vec![Lane::ZERO; m]);
        for (group, out) in out.chunks_mut(LANES * len).enumerate() {
            let at = lanes_of(group, count);
            self.frame_rows(at, &mut frame, &mut p);
            gather(at.map(|i| &own[i * m..][..m]), &mut x);
            self.space.tangent(&frame, &p, &x, &mut v);
            scatter(&v, out);
        }
        out
    }

    fn turn(&self, knot: usize) -> Option<&[Vec<f64>; 2]> {
        (knot / self.run).checked_sub(1).map(|l| &self.turns[l])
    }
}

/// R(a, u)u = −[u, [u, a]]: the curvature term of the acceleration if a curve of velocity u moves by a.
pub fn curvature_terms(space: &Erased, speeds: &[f64], accelerations: &[f64]) -> Vec<f64> {
    let mut out = triples(space, [speeds, speeds, accelerations]);
    out.iter_mut().for_each(|x| *x = -*x);
    out
}

/// g, the contribution of curvature to half the gradient of the energy, for velocities u and accelerations a at the
/// knots.
///
/// If the curve moves by ξ, a changes by ξ'' + R(ξ, u)u, and ∇a by the derivative of that and by R(ξ, u)a. R is
/// symmetric in pairs, so that the gradients are R(a, u)u and, for the jerk j, R(Da, u)u + R(j, a)u, where D is the
/// stiffness matrix of hat functions.
pub fn curvature_gradient(
    space: &Erased,
    linearized: &LinearProblem,
    speeds: &[f64],
    accelerations: &[f64],
) -> Vec<f64> {
    let (m, basis, penalty) = (space.dim(), &linearized.basis, linearized.penalised);
    if penalty == Penalty::Acceleration {
        return linearized.times_metric(&curvature_terms(space, speeds, accelerations), m);
    }
    let mut out = curvature_terms(space, speeds, &linearized.times_metric(accelerations, m));
    let segments = basis.knots() - 1;
    let jerk = |at: usize| (accelerations[at + m] - accelerations[at]) / basis.h(at / m);
    let jerks: Vec<f64> = (0..segments * m).map(jerk).collect();
    // The integral over a segment by the trapezoidal rule: half of it belongs to either end.
    for end in 0..2 {
        let at = |x: &[f64]| x[end * m..][..segments * m].to_vec();
        let terms = triples(space, [&at(speeds), &jerks, &at(accelerations)]);
        for (i, x) in terms.iter().enumerate() {
            out[end * m + i] += 0.5 * linearized.profile[i / m] * basis.h(i / m) * x;
        }
    }
    out
}

/// The triple products [x, [y, z]] of coordinates, one after another.
pub fn triples(space: &Erased, arrays: [&[f64]; 3]) -> Vec<f64> {
    let m = space.dim();
    let count = arrays[0].len() / m;
    let mut out = vec![0.0; arrays[0].len()];
    let [mut x, mut y, mut z, mut product] = [(); 4].map(|_| vec![Lane::ZERO; m]);
    for (group, out) in out.chunks_mut(LANES * m).enumerate() {
        let at = lanes_of(group, count);
        for (own, array) in [&mut x, &mut y, &mut z].into_iter().zip(arrays) {
            gather(at.map(|i| &array[i * m..][..m]), own);
        }
        space.triple(&x, &y, &z, &mut product);
        scatter(&product, out);
    }
    out
}

/// The members of a group, one per lane; missing members repeat the last one. Every loop over groups calls this function, which
/// stops if the work was cancelled.
pub fn lanes_of(group: usize, count: usize) -> [usize; LANES] {
    checkpoint();
    few(|l| (group * LANES + l).min(count - 1))
}

/// a b for m × m matrices.
fn product(a: &[f64], b: &[f64], m: usize) -> Vec<f64> {
    let entry = |at: usize| (0..m).map(|k| a[at / m * m + k] * b[k * m + at % m]).sum();
    (0..m * m).map(entry).collect()
}

/// Replaces x by a x.
fn multiply(a: &[f64], x: &mut [f64]) {
    let (m, before) = (x.len(), x.to_vec());
    for (i, x) in x.iter_mut().enumerate() {
        *x = a[i * m..][..m].iter().zip(&before).map(|(a, b)| a * b).sum();
    }
}
