//! The knots of a curve in frames that are transported along its polygon, as in the fit.
//!
//! Each lane walks along one *run* of segments, and each run begins with a frame of its own. A knot between two runs
//! therefore has two frames; the *nodes* use that of the run which begins there, the *slots* are the ends of all segments
//! of all runs. Alternatively each run is a curve of its own.

use super::operators::{Few, Square};
use crate::monitor::checkpoint;
use crate::scalar::{LANES, Lane, dot, few, gather, lane, scatter};
use crate::space::{Ambient, Erased, Frame, Origin};
use smallvec::smallvec;

/// How segments are divided into runs of almost equal length: those of one curve into two segments or more if there are as
/// many, those of several curves into the curves.
#[derive(Clone, Copy)]
pub struct Runs {
    /// Segments.
    pub segments: usize,
    /// Runs.
    pub count: usize,
    pub closed: bool,
    /// Whether the runs are curves of their own.
    apart: bool,
}

impl Runs {
    /// For curves of equally many segments, at most one per lane.
    pub fn new(segments: usize, curves: usize, closed: bool) -> Self {
        let apart = curves > 1;
        let count = if apart { curves } else { (segments / 2).clamp(1, LANES) };
        Runs { segments: curves * segments, count, closed, apart }
    }

    /// The number of curves.
    pub fn curves(&self) -> usize {
        if self.apart { self.count } else { 1 }
    }

    /// The curve of each lane.
    pub fn curve_of_lanes(&self) -> [usize; LANES] {
        few(|l| if self.apart && l < self.count { l } else { 0 })
    }

    /// Segments and nodes of a curve.
    pub fn segments_each(&self) -> usize {
        self.segments / self.curves()
    }

    pub fn nodes_each(&self) -> usize {
        self.segments_each() + usize::from(!self.closed)
    }

    /// The node at the start of the k-th segment of a run.
    pub fn node(&self, run: usize, k: usize) -> usize {
        if self.apart { run * self.nodes_each() + k } else { self.first(run) + k }
    }

    /// The knot at an end of a segment. Of the knots of a closed curve, the last is no node.
    pub fn knot(&self, segment: usize, end: usize) -> usize {
        segment + segment / self.segments_each() + end
    }

    /// The knot of a node.
    pub fn knot_of(&self, node: usize) -> usize {
        node + if self.closed { node / self.nodes_each() } else { 0 }
    }

    /// The run before and behind a run, whose frames meet.
    pub fn neighbours(&self, run: usize) -> [usize; 2] {
        if self.apart { [run, run] } else { [(run + self.count - 1) % self.count, (run + 1) % self.count] }
    }

    /// Whether a node has two frames, or one segment follows the last.
    pub fn has_joints(&self) -> bool {
        self.closed || (self.count > 1 && !self.apart)
    }

    /// The first segment of a run.
    pub fn first(&self, run: usize) -> usize {
        run * self.segments / self.count
    }

    pub fn len(&self, run: usize) -> usize {
        self.first(run + 1) - self.first(run)
    }

    /// The length of the longest run.
    pub fn longest(&self) -> usize {
        self.segments.div_ceil(self.count)
    }

    /// The nodes: the last knot of a closed curve is its first.
    pub fn nodes(&self) -> usize {
        self.curves() * self.nodes_each()
    }

    pub fn slots(&self) -> usize {
        self.segments + self.count
    }

    /// The slot at the end of a segment.
    pub fn slot(&self, segment: usize, end: usize) -> usize {
        segment + ((segment + 1) * self.count - 1) / self.segments + end
    }

    /// The slot of a node.
    pub fn slot_of(&self, node: usize) -> usize {
        match self.apart {
            true => self.knot_of(node),
            false if node < self.segments => self.slot(node, 0),
            false => self.slots() - 1,
        }
    }

    /// The node at the end of a run, if its slot there has another frame.
    pub fn joint(&self, run: usize) -> Option<usize> {
        if self.apart {
            return self.closed.then(|| self.node(run, 0));
        }
        let end = self.first(run + 1);
        match end < self.segments {
            true => Some(end),
            false => self.closed.then_some(0),
        }
    }

    /// The run of each lane; lanes that are not needed repeat the first.
    pub fn lanes(&self) -> [usize; LANES] {
        few(|l| if l < self.count { l } else { 0 })
    }

    /// The lanes whose run has the k-th segment.
    pub fn have(&self, k: usize) -> impl Iterator<Item = usize> {
        let runs = *self;
        (0..self.count).filter(move |&l| k < runs.len(l))
    }

    /// The lanes whose run ends with the k-th segment, as a mask.
    pub fn ending(&self, k: usize) -> Lane {
        let ends: [f64; LANES] = few(|l| if l < self.count && self.len(l) == k + 1 { 1.0 } else { 0.0 });
        Lane::new(ends).simd_gt(Lane::ZERO)
    }
}

/// Knots, chords and velocities of curves.
pub struct Polygon {
    pub runs: Runs,
    /// Frames, slot by slot.
    pub frames: Vec<f64>,
    /// Velocities in these frames.
    pub u: Vec<f64>,
    /// Chords in the frames of their first nodes, and velocities at both, step by step along the runs.
    pub chords: Vec<Lane>,
    pub velocities: Vec<Lane>,
    /// By run: from the frame of the node where it ends to that of its last slot, and back.
    pub turns: [Square; 2],
}

impl Polygon {
    pub fn new(space: &Erased, points: &[f64], velocities: &[f64], runs: Runs) -> Self {
        let (m, len, size) = (space.dim(), space.point_len(), space.frame_len());
        let lanes = runs.lanes();
        let zeros = |len: usize| -> Few<Lane> { smallvec![Lane::ZERO; len] };
        // Shorter runs stay at their last node.
        let row = |k: usize| lanes.map(|run| (runs.knot(runs.first(run), 0) + k.min(runs.len(run))) * len);
        let (mut p, mut q, mut v) = (zeros(len), zeros(len), zeros(len));
        let (mut frame, mut chord, mut x) = (zeros(size), zeros(m), zeros(m));
        gather(row(0).map(|i| &points[i..i + len]), &mut p);
        space.lift(&p, &mut frame);
        let start = (p.clone(), frame.clone());
        let mut end = start.clone();
        let mut out = Polygon {
            runs,
            frames: vec![0.0; runs.slots() * size],
            u: vec![0.0; runs.slots() * m],
            chords: Vec::with_capacity(runs.longest() * m),
            velocities: Vec::with_capacity((runs.longest() + 1) * m),
            turns: [Square::identity(m), Square::identity(m)],
        };
        for k in 0..=runs.longest() {
            checkpoint();
            if k > 0 {
                gather(row(k).map(|i| &points[i..i + len]), &mut q);
                space.step(&mut frame, &p, &q, &mut chord);
                space.reorthonormalize(&mut frame, &q);
                out.chords.extend_from_slice(&chord);
                std::mem::swap(&mut p, &mut q);
                let ending = runs.ending(k - 1);
                for (end, here) in end.0.iter_mut().zip(&p).chain(end.1.iter_mut().zip(&frame)) {
                    *end = ending.select(*here, *end);
                }
            }
            gather(row(k).map(|i| &velocities[i..i + len]), &mut v);
            space.coordinates(&frame, &p, &v, &mut x);
            out.velocities.extend_from_slice(&x);
            for run in (0..runs.count).filter(|&run| k <= runs.len(run)) {
                let slot = runs.first(run) + run + k;
                for (to, x) in out.frames[slot * size..][..size].iter_mut().zip(&frame) {
                    *to = x.as_array()[run];
                }
                for (to, x) in out.u[slot * m..][..m].iter_mut().zip(&x) {
                    *to = x.as_array()[run];
                }
            }
        }
        if runs.has_joints() {
            let next = |x: &[Lane]| -> Few<Lane> {
                x.iter().map(|x| Lane::new(lanes.map(|run| x.as_array()[runs.neighbours(run)[1]]))).collect()
            };
            let (there, next_frame) = (next(&start.0), next(&start.1));
            let still = zeros(len);
            let (mut from, mut to) = (zeros(len), zeros(len));
            for k in 0..m {
                x.fill(Lane::ZERO);
                x[k] = Lane::ONE;
                space.tangent(&next_frame, &there, &x, &mut from);
                // The same point, possibly another array.
                space.parallel_transport(&there, &end.0, &still, &from, &mut to);
                space.coordinates(&end.1, &end.0, &to, &mut x);
                let column = out.turns[0].numbers_mut()[k..].iter_mut().step_by(m);
                column.zip(&x).for_each(|(out, x)| *out = *x);
            }
            let [turn, back] = &mut out.turns;
            turn.divide(&mut [back]);
        }
        out
    }

    /// The chords of segments on the lanes.
    pub fn chords_of(&self, segments: [usize; LANES], m: usize) -> Vec<Lane> {
        let at = segments.map(|segment| {
            let run = self.runs.slot(segment, 0) - segment;
            ((segment - self.runs.first(run)) * m, run)
        });
        (0..m).map(|c| Lane::new(at.map(|(row, run)| self.chords[row + c].as_array()[run]))).collect()
    }

    /// The velocities at nodes on the lanes.
    pub fn velocities_of(&self, nodes: [usize; LANES], m: usize) -> Vec<Lane> {
        let at = nodes.map(|node| self.runs.slot_of(node) * m);
        (0..m).map(|c| Lane::new(at.map(|row| self.u[row + c]))).collect()
    }

    /// The numbers of the turn at the end of a run, row by row.
    fn turn(&self, run: usize) -> impl Iterator<Item = f64> {
        self.turns[0].numbers().iter().map(move |x| x.as_array()[run])
    }

    /// Coordinates at the nodes in the frames of the slots.
    pub fn unfold(&self, x: &[f64], m: usize) -> Vec<f64> {
        let runs = self.runs;
        let mut out = vec![0.0; runs.slots() * m];
        for node in 0..runs.nodes() {
            out[runs.slot_of(node) * m..][..m].copy_from_slice(&x[node * m..][..m]);
        }
        for run in 0..runs.count {
            if let Some(node) = runs.joint(run) {
                let x = &x[node * m..][..m];
                let slot = runs.slot(runs.first(run + 1) - 1, 1);
                for (i, a) in self.turn(run).enumerate() {
                    out[slot * m + i / m] += a * x[i % m];
                }
            }
        }
        out
    }

    /// The transpose of [`unfold`](Self::unfold).
    pub fn fold(&self, x: &[f64], m: usize) -> Vec<f64> {
        let runs = self.runs;
        let mut out = vec![0.0; runs.nodes() * m];
        for node in 0..runs.nodes() {
            out[node * m..][..m].copy_from_slice(&x[runs.slot_of(node) * m..][..m]);
        }
        for run in 0..runs.count {
            if let Some(node) = runs.joint(run) {
                let slot = runs.slot(runs.first(run + 1) - 1, 1);
                for (i, a) in self.turn(run).enumerate() {
                    out[node * m + i % m] += a * x[slot * m + i / m];
                }
            }
        }
        out
    }

    /// Passes points and frames of nodes to a function on the lanes, which computes from a row of numbers another one.
    fn at_nodes(
        &self,
        space: &Erased,
        points: &[f64],
        nodes: std::ops::Range<usize>,
        (x, from, to): (&[f64], usize, usize),
        mut f: impl FnMut(&[Lane], &[Lane], &[Lane], &mut [Lane]),
    ) -> Vec<f64> {
        let (len, size, count) = (space.point_len(), space.frame_len(), nodes.len());
        let zeros = |len: usize| -> Few<Lane> { smallvec![Lane::ZERO; len] };
        let (mut p, mut frame, mut row, mut result) = (zeros(len), zeros(size), zeros(from), zeros(to));
        let mut out = vec![0.0; count * to];
        for (group, out) in out.chunks_mut(LANES * to).enumerate() {
            checkpoint();
            let at: [usize; LANES] = few(|l| (group * LANES + l).min(count - 1));
            let slot = |i: usize| self.runs.slot_of((nodes.start + i).min(self.runs.nodes() - 1));
            gather(at.map(|i| &points[self.runs.knot_of(nodes.start + i) * len..][..len]), &mut p);
            gather(at.map(|i| &self.frames[slot(i) * size..][..size]), &mut frame);
            gather(at.map(|i| &x[i * from..][..from]), &mut row);
            f(&p, &frame, &row, &mut result);
            scatter(&result, out);
        }
        out
    }

    /// Coordinates of tangent vectors at the nodes.
    pub fn coordinates(&self, space: &Erased, points: &[f64], vectors: &[f64]) -> Vec<f64> {
        self.coordinates_in(space, points, 0..self.runs.nodes(), vectors)
    }

    /// The same at one node.
    pub fn coordinates_at(&self, space: &Erased, points: &[f64], knot: usize, vector: &[f64]) -> Vec<f64> {
        self.coordinates_in(space, points, knot..knot + 1, vector)
    }

    fn coordinates_in(
        &self,
        space: &Erased,
        points: &[f64],
        nodes: std::ops::Range<usize>,
        v: &[f64],
    ) -> Vec<f64> {
        let sizes = (v, space.point_len(), space.dim());
        self.at_nodes(space, points, nodes, sizes, |p, frame, v, x| space.coordinates(frame, p, v, x))
    }

    /// The tangent vectors at the nodes with given coordinates.
    pub fn tangents(&self, space: &Erased, points: &[f64], x: &[f64]) -> Vec<f64> {
        let sizes = (x, space.dim(), space.point_len());
        self.at_nodes(space, points, 0..self.runs.nodes(), sizes, |p, frame, x, v| {
            space.tangent(frame, p, x, v)
        })
    }

    /// The tangent vectors g with `Σ g δ = gradient · coordinates(δ)` for all tangent vectors δ: the shortest solutions of
    /// `basisᵀ g = gradient`. They are computed from an orthonormal basis, because normal equations would square the condition
    /// number.
    pub fn gradients(&self, space: &Erased, points: &[f64], gradient: &[f64]) -> Vec<f64> {
        self.gradients_in(space, points, 0..self.runs.nodes(), gradient)
    }

    /// The same at one node.
    pub fn gradient_at(&self, space: &Erased, points: &[f64], knot: usize, gradient: &[f64]) -> Vec<f64> {
        self.gradients_in(space, points, knot..knot + 1, gradient)
    }

    fn gradients_in(
        &self,
        space: &Erased,
        points: &[f64],
        nodes: std::ops::Range<usize>,
        gradient: &[f64],
    ) -> Vec<f64> {
        let (m, len) = (space.dim(), space.point_len());
        let mut basis = vec![Lane::ZERO; m * len];
        let mut x: Few<Lane> = smallvec![Lane::ZERO; m];
        self.at_nodes(space, points, nodes, (gradient, m, len), |p, frame, gradient, out| {
            for (k, e) in basis.chunks_mut(len).enumerate() {
                x.fill(Lane::ZERO);
                x[k] = Lane::ONE;
                space.tangent(frame, p, &x, e);
            }
            solve_transposed(&mut basis, gradient, out);
        })
    }
}

/// The shortest g with `e · g = x` for all rows e of a basis and numbers x: Gram and Schmidt, twice, on the rows and the
/// numbers.
fn solve_transposed(basis: &mut [Lane], x: &[Lane], g: &mut [Lane]) {
    let len = g.len();
    g.fill(Lane::ZERO);
    for (k, x) in x.iter().enumerate() {
        let (before, e) = basis.split_at_mut(k * len);
        let e = &mut e[..len];
        let mut rest = *x;
        let mut left = lane(0.0);
        for _ in 0..2 {
            for b in before.chunks(len) {
                let along = dot(b, e);
                rest -= along * dot(b, g);
                e.iter_mut().zip(b).for_each(|(e, b)| *e = along.mul_neg_add(*b, *e));
            }
            left = dot(e, e).sqrt();
        }
        e.iter_mut().for_each(|e| *e /= left);
        g.iter_mut().zip(&*e).for_each(|(g, e)| *g = (rest / left).mul_add(*e, *g));
    }
}
