//! The linearised C² condition of a whole curve: the sensitivity of velocities to points, knots and end vectors.

use super::operators::{Functions, Matrix, Square};
use super::polygon::{Polygon, Runs};
use super::segment::{SegmentEnd, linearise, turn_last};
use super::solve::{Jacobian, solve};
use crate::fit::{EndKind, NotAKnot};
use crate::monitor::checkpoint;
use crate::scalar::{Dual, LANES, Lane, few, lane};
use crate::space::{Erased, Origin};

/// The derivatives of the condition at one knot with respect to velocities and points of knots.
#[derive(Default)]
pub struct Linearised {
    /// With respect to the velocities of knots.
    pub u: Vec<(usize, Matrix)>,
    /// With respect to the points of knots.
    pub points: Vec<(usize, Matrix)>,
}

/// The derivatives of the condition at an end with respect to velocities and points of nodes, lengths of segments, and the
/// prescribed vector, with a curve per lane. Nodes and segments are numbered within a curve.
#[derive(Default)]
struct EndRow {
    u: Vec<(usize, Square)>,
    points: Vec<(usize, Square)>,
    lengths: Vec<(usize, Vec<Lane>)>,
    vector: Option<Square>,
}

/// Small changes, in the frames of the nodes, or a gradient with respect to them; curve after curve.
#[derive(Clone)]
pub struct Change {
    /// Changes of points, node after node.
    pub points: Vec<f64>,
    /// Changes of the lengths of segments.
    pub lengths: Vec<f64>,
    /// Changes of the vectors at the ends.
    pub ends: [Vec<f64>; 2],
    /// Changes of the times at which segments begin and the last one ends. In a gradient, lengths are held fixed.
    pub knots: Vec<f64>,
}

/// The linearised conditions of curves.
pub struct System {
    pub runs: Runs,
    /// Lengths of segments.
    pub h: Vec<f64>,
    /// By segment, cosh(ad) and S of the handle at its first and at its last knot, row by row.
    pub functions: Vec<f64>,
    /// By node, the derivatives with respect to the velocities and points of its left neighbour, itself and its right
    /// neighbour, and the lengths of the two segments; zero at the ends of an open curve.
    rows: Vec<f64>,
    /// The rows at the ends of open curves.
    ends: [Option<EndRow>; 2],
    m: usize,
}

impl System {
    /// `ends` are kinds and prescribed vectors in the frames of the ends, with a curve per lane; None for closed curves.
    pub fn new(
        space: &Erased,
        polygon: &Polygon,
        h: &[f64],
        ends: Option<[(EndKind, Vec<Lane>); 2]>,
    ) -> Self {
        let (runs, m) = (polygon.runs, space.dim());
        // One segment from a point to itself is a constant curve for all changes.
        let nodes = if runs.closed && runs.segments_each() == 1 { 0 } else { runs.nodes() };
        let mut system = System {
            runs,
            h: h.to_vec(),
            functions: vec![0.0; h.len() * 4 * m * m],
            rows: vec![0.0; nodes * (6 * m * m + 2 * m)],
            ends: [None, None],
            m,
        };
        let lanes = runs.lanes();
        let [turn, back] = &polygon.turns;
        let u = |k: usize| &polygon.velocities[k * m..][..m];
        let new = || SegmentEnd::new(m);
        let (mut ends_here, mut before, mut first, mut last) = ([new(), new()], new(), new(), new());
        let mut row = Row::new(m);
        for k in 0..runs.longest() {
            checkpoint();
            let length = Lane::new(lanes.map(|run| h[runs.first(run) + k.min(runs.len(run) - 1)]));
            let chord = &polygon.chords[k * m..][..m];
            linearise(space, length, chord, [u(k), u(k + 1)], &mut ends_here);
            system.write_functions(k, &ends_here);
            let ending = runs.ending(k);
            if ending.any() && runs.has_joints() {
                // The end of an open curve has one frame only.
                let joints: [f64; LANES] = few(|l| f64::from(runs.joint(lanes[l]).is_some()));
                turn_last(&mut ends_here, ending & Lane::new(joints).simd_gt(Lane::ZERO), turn, back);
            }
            let [start, end] = &mut ends_here;
            if k == 0 {
                first = start.clone();
            } else {
                row.set(space, &before, start, &before.functions.stretch, u(k));
                runs.have(k).for_each(|run| system.write_row(runs.node(run, k), &row, run));
            }
            if ending.any() {
                last.replace(ending, end);
            }
            std::mem::swap(&mut before, end);
        }
        if let Some(ends) = &ends {
            let both = ends.iter().all(|(kind, _)| *kind == EndKind::NotAKnot);
            for (which, segment) in [&first, &last].into_iter().enumerate() {
                // One curve begins in the first run and ends in the last one.
                let run = if which == 0 { 0 } else { runs.count - 1 };
                let of_curves = (runs.curves() == 1).then(|| segment.permuted([run; LANES]));
                let segment = of_curves.as_ref().unwrap_or(segment);
                system.ends[which] = Some(system.end(space, polygon, which, &ends[which], segment, both));
            }
        }
        if nodes > 0 && runs.has_joints() {
            // The first nodes of runs follow the last segments of the runs before.
            let before = last.permuted(lanes.map(|run| runs.neighbours(run)[0]));
            let handle: Vec<Lane> = u(0).iter().map(|u| *u * before.h * lane(1.0 / 3.0)).collect();
            let mut stretched = Square::zeros(m);
            stretched.set_stretch(space, &handle);
            row.set(space, &before, &first, &stretched, u(0));
            let from = usize::from(!runs.closed);
            (from..runs.count).for_each(|run| system.write_row(runs.node(run, 0), &row, run));
        }
        system
    }

    fn write_functions(&mut self, k: usize, ends: &[SegmentEnd; 2]) {
        let (square, runs) = (self.m * self.m, self.runs);
        for run in runs.have(k) {
            let out = &mut self.functions[(runs.first(run) + k) * 4 * square..][..4 * square];
            let squares = ends.iter().flat_map(|end| [&end.functions.cosh, &end.functions.stretch]);
            let all = squares.flat_map(Square::numbers);
            out.iter_mut().zip(all).for_each(|(out, x)| *out = x.as_array()[run]);
        }
    }

    /// The derivatives of the conditions with respect to velocities.
    fn jacobian(&self) -> Jacobian<'_> {
        let m = self.m;
        let ends = self.ends.each_ref().map(|end| {
            let end = end.as_ref()?;
            let mut rows = vec![Lane::ZERO; 3 * m * m];
            let at = end.u[0].0;
            for (node, block) in &end.u {
                let sum = &mut rows[(node + 1 - at) * m * m..][..m * m];
                sum.iter_mut().zip(block.numbers()).for_each(|(sum, x)| *sum += *x);
            }
            Some(rows)
        });
        Jacobian { runs: self.runs, m, rows: &self.rows, ends }
    }

    fn row(&self, node: usize) -> &[f64] {
        let size = 6 * self.m * self.m + 2 * self.m;
        &self.rows[node * size..][..size]
    }

    fn write_row(&mut self, node: usize, row: &Row, l: usize) {
        let size = 6 * self.m * self.m + 2 * self.m;
        let blocks = row.u.iter().chain(&row.points).flat_map(Square::numbers);
        let all = blocks.chain(row.lengths.iter().flatten());
        self.rows[node * size..][..size].iter_mut().zip(all).for_each(|(out, x)| *out = x.as_array()[l]);
    }

    /// The curve of a node, and its number there.
    fn place(&self, node: usize) -> (usize, usize) {
        (node / self.runs.nodes_each(), node % self.runs.nodes_each())
    }

    /// The nodes of a row of an inner node.
    fn neighbours(&self, node: usize) -> [usize; 3] {
        let (nodes, (curve, i)) = (self.runs.nodes_each(), self.place(node));
        [(i + nodes - 1) % nodes, i, (i + 1) % nodes].map(|i| curve * nodes + i)
    }

    /// The two segments of an inner node.
    fn segments(&self, node: usize) -> [usize; 2] {
        let (n, (curve, i)) = (self.runs.segments_each(), self.place(node));
        [(i + n - 1) % n, i].map(|i| curve * n + i)
    }

    /// The end of open curves that a node is.
    fn end_of(&self, node: usize) -> Option<(usize, &EndRow)> {
        let which = match self.place(node).1 {
            0 => 0,
            i if i == self.runs.segments_each() => 1,
            _ => return None,
        };
        self.ends[which].as_ref().map(|end| (which, end))
    }

    /// The condition at a node of one curve.
    pub fn condition(&self, node: usize) -> Linearised {
        if let Some((_, end)) = self.end_of(node) {
            let matrices = |list: &[(usize, Square)]| list.iter().map(|(k, a)| (*k, a.of_lane(0))).collect();
            return Linearised { u: matrices(&end.u), points: matrices(&end.points) };
        }
        let (m, row) = (self.m, self.row(node));
        let block = |k: usize| Matrix::from_row_slice(m, m, &row[k * m * m..][..m * m]);
        let at = self.neighbours(node);
        Linearised {
            u: (0..3).map(|k| (at[k], block(k))).collect(),
            points: (0..3).map(|k| (at[k], block(3 + k))).collect(),
        }
    }

    fn end(
        &self,
        space: &Erased,
        polygon: &Polygon,
        which: usize,
        (kind, value): &(EndKind, Vec<Lane>),
        segment: &SegmentEnd,
        both_not_a_knot: bool,
    ) -> EndRow {
        let (n, m) = (self.runs.segments_each(), self.m);
        let (node, near, far) = if which == 0 { (0, 0, 1.min(n - 1)) } else { (n, n - 1, n.max(2) - 2) };
        let scaled = |square: &Square, factor: Lane| {
            let mut out = square.clone();
            out.scale(factor);
            out
        };
        let identity = Square::identity(m);
        let mut row = EndRow { u: vec![(node, identity.clone())], ..EndRow::default() };
        match kind {
            EndKind::Velocity | EndKind::Both => row.vector = Some(scaled(&identity, -Lane::ONE)),
            EndKind::Acceleration => {
                // The side of the only segment is S(handle) A/6.
                let mut slope = Square::zeros(m);
                let sixth: Vec<Lane> = value.iter().map(|x| *x * lane(1.0 / 6.0)).collect();
                slope.set_stretch_slope(space, &segment.handle, &sixth);
                let mut length = segment.side.length.clone();
                slope.act(lane(-1.0 / 3.0), &self.velocities_at(polygon, node), &mut length);
                slope.scale(segment.h * lane(-1.0 / 3.0));
                row.u = vec![(node, slope)];
                row.lengths.push((near, length));
                for (e, node) in [near, near + 1].into_iter().enumerate() {
                    row.u.push((node, segment.side.u[e].clone()));
                    row.points.push((node, segment.side.points[e].clone()));
                }
                row.vector = Some(scaled(&segment.functions.stretch, lane(-1.0 / 6.0)));
            }
            EndKind::NotAKnot => {
                let [near_h, far_h] = [near, far].map(|k| Lane::new(self.segments_at(k).map(|i| self.h[i])));
                // Differentiated with respect to the lengths of the two segments.
                let weights = [[Lane::ONE, Lane::ZERO], [Lane::ZERO, Lane::ONE]].map(|[d_near, d_far]| {
                    let (near, far) = (Dual { v: near_h, d: d_near }, Dual { v: far_h, d: d_far });
                    NotAKnot::of(near, far, n, both_not_a_knot)
                });
                self.not_a_knot(space, polygon, which, [near, far], &weights, &mut row);
            }
        }
        row
    }

    /// The k-th segments of the curves on the lanes.
    fn segments_at(&self, k: usize) -> [usize; LANES] {
        self.runs.curve_of_lanes().map(|curve| curve * self.runs.segments_each() + k)
    }

    /// The velocities at the k-th nodes, in their frames.
    fn velocities_at(&self, polygon: &Polygon, k: usize) -> Vec<Lane> {
        let nodes = self.runs.curve_of_lanes().map(|curve| curve * self.runs.nodes_each() + k);
        polygon.velocities_of(nodes, self.m)
    }

    /// The changes of velocities for given changes, node after node.
    pub fn velocities(&self, change: &Change) -> Vec<f64> {
        let m = self.m;
        let mut right = vec![0.0; self.runs.nodes() * m];
        if self.rows.is_empty() {
            return right;
        }
        for (node, right) in right.chunks_mut(m).enumerate() {
            let point = |k: usize| &change.points[k * m..][..m];
            if let Some((which, end)) = self.end_of(node) {
                let curve = self.place(node).0;
                let (nodes, segments) = (curve * self.runs.nodes_each(), curve * self.runs.segments_each());
                end.points.iter().for_each(|(k, a)| a.subtract_of_lane(curve, point(nodes + k), right));
                end.lengths.iter().for_each(|(k, a)| {
                    let length = change.lengths[segments + k];
                    right.iter_mut().zip(a).for_each(|(right, a)| *right -= a.as_array()[curve] * length);
                });
                let vector = &change.ends[which];
                if let (Some(a), false) = (&end.vector, vector.is_empty()) {
                    a.subtract_of_lane(curve, &vector[curve * m..][..m], right);
                }
                continue;
            }
            let (blocks, lengths) = self.row(node)[3 * m * m..].split_at(3 * m * m);
            for (block, k) in blocks.chunks(m * m).zip(self.neighbours(node)) {
                for (right, row) in right.iter_mut().zip(block.chunks(m)) {
                    *right -= row.iter().zip(point(k)).map(|(a, x)| a * x).sum::<f64>();
                }
            }
            for (column, k) in lengths.chunks(m).zip(self.segments(node)) {
                right.iter_mut().zip(column).for_each(|(right, a)| *right -= a * change.lengths[k]);
            }
        }
        solve(&self.jacobian(), &right, false)
    }

    /// Adds the contribution of a gradient with respect to velocities to a gradient with respect to changes.
    pub fn pull_back(&self, velocities: &[f64], gradient: &mut Change) {
        let m = self.m;
        if self.rows.is_empty() {
            return;
        }
        let multipliers = solve(&self.jacobian(), velocities, true);
        for (node, x) in multipliers.chunks(m).enumerate() {
            if let Some((which, end)) = self.end_of(node) {
                let curve = self.place(node).0;
                let (nodes, segments) = (curve * self.runs.nodes_each(), curve * self.runs.segments_each());
                for (k, a) in &end.points {
                    a.subtract_transposed_of_lane(curve, x, &mut gradient.points[(nodes + k) * m..][..m]);
                }
                for (k, a) in &end.lengths {
                    let by_length = x.iter().zip(a).map(|(x, a)| a.as_array()[curve] * x).sum::<f64>();
                    gradient.lengths[segments + k] -= by_length;
                }
                if let Some(a) = &end.vector {
                    a.subtract_transposed_of_lane(curve, x, &mut gradient.ends[which][curve * m..][..m]);
                }
                continue;
            }
            let (blocks, lengths) = self.row(node)[3 * m * m..].split_at(3 * m * m);
            for (block, k) in blocks.chunks(m * m).zip(self.neighbours(node)) {
                let gradient = &mut gradient.points[k * m..][..m];
                for (x, row) in x.iter().zip(block.chunks(m)) {
                    gradient.iter_mut().zip(row).for_each(|(g, a)| *g -= a * x);
                }
            }
            for (column, k) in lengths.chunks(m).zip(self.segments(node)) {
                gradient.lengths[k] -= column.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
            }
        }
    }
}

/// The derivatives of the condition at an inner node on each lane.
struct Row {
    u: [Square; 3],
    points: [Square; 3],
    lengths: [Vec<Lane>; 2],
    slopes: [Square; 2],
}

impl Row {
    fn new(m: usize) -> Self {
        let (square, vector) = (|| Square::zeros(m), || vec![Lane::ZERO; m]);
        Row {
            u: [square(), square(), square()],
            points: [square(), square(), square()],
            lengths: [vector(), vector()],
            slopes: [square(), square()],
        }
    }

    /// `S(hᵢ₋₁u/3) right − S(hᵢu/3) left`; `stretched` is S(hᵢ₋₁u/3).
    fn set(
        &mut self,
        space: &Erased,
        before: &SegmentEnd,
        behind: &SegmentEnd,
        stretched: &Square,
        u: &[Lane],
    ) {
        let third = lane(1.0 / 3.0);
        let Row { u: by_u, points, lengths, slopes } = self;
        let mut handle = u.to_vec();
        handle.iter_mut().for_each(|x| *x *= before.h * third);
        slopes[0].set_stretch_slope(space, &handle, &behind.side.value);
        slopes[1].set_stretch_slope(space, &behind.handle, &before.side.value);
        slopes[1].scale(-Lane::ONE);
        by_u.iter_mut().chain(&mut *points).for_each(|x| x.scale(Lane::ZERO));
        let factors = [(&behind.functions.stretch, -Lane::ONE, before), (stretched, Lane::ONE, behind)];
        for (k, (factor, sign, end)) in factors.into_iter().enumerate() {
            for e in 0..2 {
                by_u[k + e].add_product(sign, factor, &end.side.u[e]);
                points[k + e].add_product(sign, factor, &end.side.points[e]);
            }
            by_u[1].add(end.h * third, &slopes[k]);
            lengths[k].fill(Lane::ZERO);
            factor.act(sign, &end.side.length, &mut lengths[k]);
            slopes[k].act(third, u, &mut lengths[k]);
        }
    }
}

/// Functions of ad_v for the chord of a segment.
struct OfChord {
    functions: Functions,
    /// S⁻¹
    shrink: Square,
}

impl OfChord {
    fn of(space: &Erased, v: &[Lane]) -> Self {
        let mut functions = Functions::new(v.len());
        functions.set(space, v);
        let mut shrink = Square::identity(v.len());
        functions.stretch.divide(&mut [&mut shrink]);
        OfChord { functions, shrink }
    }
}

impl System {
    /// Adds minus the velocity of the not-a-knot condition: `S(x₀) c'(t₀)`, in the frame of the end. `weights` are
    /// differentiated with respect to the lengths of the near and of the far segment.
    ///
    /// The chord d from p₀ to p₁ changes by `−ad coth ξ + S⁻¹η` in the frame of p₀ and by `−S⁻¹ξ + ad coth η` in that
    /// of p₁, and the frames rotate by `tanh(ad_d/2)(ξ + η)` relative to each other along it.
    fn not_a_knot(
        &self,
        space: &Erased,
        polygon: &Polygon,
        which: usize,
        [near, far]: [usize; 2],
        weights: &[NotAKnot<Dual>; 2],
        row: &mut EndRow,
    ) {
        let m = self.m;
        let [d0, d1] = [near, far].map(|k| polygon.chords_of(self.segments_at(k), m));
        let (first, second) = (OfChord::of(space, &d0), OfChord::of(space, &d1));
        // The end, its neighbour, and the next node; all vectors change sign at the right end.
        let [end, next, third] = if which == 0 { [near, near + 1, far + 1] } else { [near + 1, near, far] };
        let next_u = self.velocities_at(polygon, next);
        let sign = lane(if which == 0 { 1.0 } else { -1.0 });
        // c'(t₀) for the weights, or its change with them.
        let velocity = |[u, near, far]: [Lane; 3]| -> Vec<Lane> {
            let terms = next_u.iter().zip(d0.iter().zip(&d1));
            terms.map(|(x, (d0, d1))| u.mul_add(*x, near.mul_add(*d0, far * *d1))).collect()
        };
        let NotAKnot { u, near: near_by, far: far_by } = &weights[0];
        let (u, near_by, far_by) = (u.v, near_by.v, far_by.v);
        let c = velocity([u, near_by, far_by]);
        let stretch = &first.functions.stretch;
        let mut target = vec![Lane::ZERO; m];
        stretch.act(Lane::ONE, &c, &mut target);
        // In the frame of the neighbour.
        let [mut slope, mut curvature, mut turn] = [(); 3].map(|()| Square::zeros(m));
        slope.set_stretch_slope(space, &d0, &c);
        slope.add(near_by, stretch);
        curvature.set_curvature(space, &d0, &target);
        turn.add_product(sign, &curvature, &first.functions.tanh);
        let [mut at_end, mut at_next] = [turn.clone(), turn];
        [&mut at_end, &mut at_next].into_iter().for_each(|x| x.scale(-Lane::ONE));
        at_end.add_product(sign, &slope, &first.shrink);
        at_next.add_product(-sign, &slope, &first.functions.coth);
        if far_by.simd_ne(Lane::ZERO).any() {
            at_next.add_product(far_by * sign, stretch, &second.functions.coth);
            let mut by_third = Square::zeros(m);
            by_third.add_product(-(far_by * sign), stretch, &second.shrink);
            // Where the first run of a curve ends with the second segment, the node has another frame.
            if which == 0 && self.runs.curves() == 1 && self.runs.len(0) == 2 && self.runs.joint(0).is_some()
            {
                let turn = polygon.turns[0].permuted([0; LANES]);
                by_third = by_third.times(&turn);
            }
            row.points.push((third, by_third));
        }
        row.points.push((end, at_end));
        row.points.push((next, at_next));
        if u.simd_ne(Lane::ZERO).any() {
            let mut by_u = stretch.clone();
            by_u.scale(-u);
            row.u.push((next, by_u));
        }
        for (k, weights) in [near, far].into_iter().zip(weights) {
            let mut by_length = vec![Lane::ZERO; m];
            let change = velocity([weights.u.d, weights.near.d, weights.far.d]);
            stretch.act(-Lane::ONE, &change, &mut by_length);
            row.lengths.push((k, by_length));
        }
    }
}
