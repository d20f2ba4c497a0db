//! The linearised C² condition of a whole curve: the sensitivity of velocities to points, knots and end vectors.

use super::operators::{Functions, Matrix, Square, Vector, splat, unit, vector_of_lane};
use super::polygon::{Polygon, Runs};
use super::segment::{SegmentEnd, linearise, turn_last};
use crate::fit::{Blocks, EndKind, NotAKnot};
use crate::monitor::checkpoint;
use crate::scalar::{Dual, LANES, Lane, few, lane};
use crate::space::{Erased, Origin};

/// The derivatives of the condition at one knot with respect to velocities and points of knots, lengths of segments,
/// and the prescribed vector at an end.
#[derive(Default)]
pub struct Linearised {
    /// With respect to the velocities of knots.
    pub u: Vec<(usize, Matrix)>,
    /// With respect to the points of knots.
    pub points: Vec<(usize, Matrix)>,
    lengths: Vec<(usize, Vector)>,
    end: Option<(usize, Matrix)>,
}

/// Small changes, in the frames of the nodes, or a gradient with respect to them.
#[derive(Clone)]
pub struct Change {
    /// Changes of points, node after node.
    pub points: Vec<f64>,
    /// Changes of the lengths of segments.
    pub lengths: Vec<f64>,
    /// Changes of the vectors at the ends.
    pub ends: [Vector; 2],
    /// Changes of the times at which segments begin and the last one ends. In a gradient, lengths are held fixed.
    pub knots: Vec<f64>,
}

/// The linearised conditions of one curve.
pub struct System {
    pub runs: Runs,
    /// Lengths of segments.
    pub h: Vec<f64>,
    /// By segment, cosh(ad) and S of the handle at its first and at its last knot, row by row.
    pub functions: Vec<f64>,
    /// By node, the derivatives with respect to the velocities and points of its left neighbour, itself and its right
    /// neighbour, and the lengths of the two segments; zero at the ends of an open curve.
    rows: Vec<f64>,
    /// The rows at the ends of an open curve.
    ends: [Option<Linearised>; 2],
    m: usize,
}

impl System {
    /// `ends` are kinds and prescribed vectors in the frames of the ends; None for a closed curve.
    pub fn new(space: &Erased, polygon: &Polygon, h: &[f64], ends: Option<[(EndKind, Vector); 2]>) -> Self {
        let (runs, m) = (polygon.runs, space.dim());
        // One segment from a point to itself is a constant curve for all changes.
        let nodes = if runs.closed && h.len() == 1 { 0 } else { runs.nodes() };
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
            if ending.any() && (runs.closed || runs.count > 1) {
                // The end of an open curve has one frame only.
                let joints: [f64; LANES] = few(|l| f64::from(runs.joint(lanes[l]).is_some()));
                turn_last(&mut ends_here, ending & Lane::new(joints).simd_gt(Lane::ZERO), turn, back);
            }
            let [start, end] = &mut ends_here;
            if k == 0 {
                first = start.clone();
            } else {
                row.set(space, &before, start, &before.functions.stretch, u(k));
                runs.have(k).for_each(|run| system.write_row(runs.first(run) + k, &row, run));
            }
            if ending.any() {
                last.replace(ending, end);
            }
            std::mem::swap(&mut before, end);
        }
        if let Some(ends) = &ends {
            let both = ends.iter().all(|(kind, _)| *kind == EndKind::NotAKnot);
            for (which, (segment, l)) in [(&first, 0), (&last, runs.count - 1)].into_iter().enumerate() {
                system.ends[which] =
                    Some(system.end(space, polygon, which, &ends[which], (segment, l), both));
            }
        }
        if nodes > 0 && (runs.closed || runs.count > 1) {
            // The first nodes of runs follow the last segments of the runs before.
            let before = last.permuted(lanes.map(|run| (run + runs.count - 1) % runs.count));
            let handle: Vec<Lane> = u(0).iter().map(|u| *u * before.h * lane(1.0 / 3.0)).collect();
            let mut stretched = Square::zeros(m);
            stretched.set_stretch(space, &handle);
            row.set(space, &before, &first, &stretched, u(0));
            let from = usize::from(!runs.closed);
            (from..runs.count).for_each(|run| system.write_row(runs.first(run), &row, run));
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

    /// The nodes of a row of an inner node.
    fn neighbours(&self, node: usize) -> [usize; 3] {
        let nodes = self.runs.nodes();
        [(node + nodes - 1) % nodes, node, (node + 1) % nodes]
    }

    /// The two segments of an inner node.
    fn segments(&self, node: usize) -> [usize; 2] {
        let n = self.h.len();
        [(node + n - 1) % n, node]
    }

    /// The end of an open curve that a node is.
    fn end_of(&self, node: usize) -> Option<&Linearised> {
        match node {
            0 => self.ends[0].as_ref(),
            i if i == self.h.len() => self.ends[1].as_ref(),
            _ => None,
        }
    }

    /// The condition at a node.
    pub fn condition(&self, node: usize) -> Linearised {
        if let Some(end) = self.end_of(node) {
            return Linearised { u: end.u.clone(), points: end.points.clone(), ..Linearised::default() };
        }
        let (m, row) = (self.m, self.row(node));
        let block = |k: usize| Matrix::from_row_slice(m, m, &row[k * m * m..][..m * m]);
        let at = self.neighbours(node);
        Linearised {
            u: (0..3).map(|k| (at[k], block(k))).collect(),
            points: (0..3).map(|k| (at[k], block(3 + k))).collect(),
            ..Linearised::default()
        }
    }

    fn end(
        &self,
        space: &Erased,
        polygon: &Polygon,
        which: usize,
        (kind, value): &(EndKind, Vector),
        (segment, l): (&SegmentEnd, usize),
        both_not_a_knot: bool,
    ) -> Linearised {
        let (n, m) = (self.h.len(), self.m);
        let (node, near, far) = if which == 0 { (0, 0, 1.min(n - 1)) } else { (n, n - 1, n.max(2) - 2) };
        let identity = Matrix::identity(m, m);
        let mut row = Linearised { u: vec![(node, identity.clone())], ..Linearised::default() };
        match kind {
            EndKind::Velocity | EndKind::Both => row.end = Some((which, -identity)),
            EndKind::Acceleration => {
                // The side of the only segment is S(handle) A/6.
                let slope = slope_of(space, &vector_of_lane(&segment.handle, l), &(value / 6.0));
                let u = self.velocity(polygon, node);
                row.u = vec![(node, &slope * (-self.h[near] / 3.0))];
                row.lengths.push((near, &slope * u / -3.0 + vector_of_lane(&segment.side.length, l)));
                for (e, node) in [near, near + 1].into_iter().enumerate() {
                    row.u.push((node, segment.side.u[e].of_lane(l)));
                    row.points.push((node, segment.side.points[e].of_lane(l)));
                }
                row.end = Some((which, segment.functions.stretch.of_lane(l) / -6.0));
            }
            EndKind::NotAKnot => {
                // Differentiated with respect to the lengths of the two segments, one per lane.
                let h = |segment: usize, k| Dual { v: lane(self.h[segment]), d: unit(k, 0) };
                let weights = NotAKnot::of(h(near, 0), h(far, 1), n, both_not_a_knot);
                row.not_a_knot(space, polygon, which, [near, far], &weights);
            }
        }
        row
    }

    /// The velocity at a node, in its frame.
    fn velocity(&self, polygon: &Polygon, node: usize) -> Vector {
        Vector::from_column_slice(&polygon.u[self.runs.slot_of(node) * self.m..][..self.m])
    }

    /// The changes of velocities for given changes, node after node.
    pub fn velocities(&self, change: &Change) -> Vec<f64> {
        let (m, nodes) = (self.m, self.runs.nodes());
        let mut right = vec![0.0; nodes * m];
        if self.rows.is_empty() {
            return right;
        }
        for (node, right) in right.chunks_mut(m).enumerate() {
            let point = |k: usize| &change.points[k * m..][..m];
            if let Some(end) = self.end_of(node) {
                let mut sum = Vector::zeros(m);
                end.points.iter().for_each(|(k, a)| sum -= a * Vector::from_column_slice(point(*k)));
                end.lengths.iter().for_each(|(k, a)| sum -= a * change.lengths[*k]);
                end.end.iter().for_each(|(k, a)| sum -= a * &change.ends[*k]);
                right.copy_from_slice(sum.as_slice());
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
        self.solve(&right, false)
    }

    /// Adds the contribution of a gradient with respect to velocities to a gradient with respect to changes.
    pub fn pull_back(&self, velocities: &[f64], gradient: &mut Change) {
        let m = self.m;
        if self.rows.is_empty() {
            return;
        }
        let multipliers = self.solve(velocities, true);
        for (node, x) in multipliers.chunks(m).enumerate() {
            if let Some(end) = self.end_of(node) {
                let x = Vector::from_column_slice(x);
                for (k, a) in &end.points {
                    let by_point = a.tr_mul(&x);
                    gradient.points[k * m..][..m].iter_mut().zip(&by_point).for_each(|(g, x)| *g -= x);
                }
                end.lengths.iter().for_each(|(k, a)| gradient.lengths[*k] -= a.dot(&x));
                end.end.iter().for_each(|(k, a)| gradient.ends[*k] -= a.tr_mul(&x));
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

    /// J⁻¹ x, or J⁻ᵀ x.
    fn solve(&self, x: &[f64], transposed: bool) -> Vec<f64> {
        let (nodes, m, closed) = (self.runs.nodes(), self.m, self.runs.closed);
        let mut blocks = Blocks::default();
        blocks.clear(nodes, m);
        let mut add = |i: usize, j: usize, a: &dyn Fn(usize, usize) -> f64| {
            let (row, column) = if transposed { (j, i) } else { (i, j) };
            let side = if row == column {
                1
            } else if column + 1 == row || (closed && row == 0 && column + 1 == nodes) {
                0
            } else {
                2
            };
            let block = &mut blocks.sides[side][row * m * m..][..m * m];
            for r in 0..m {
                for c in 0..m {
                    block[r * m + c] += lane(if transposed { a(c, r) } else { a(r, c) });
                }
            }
        };
        for i in 0..nodes {
            if let Some(end) = self.end_of(i) {
                end.u.iter().for_each(|(j, a)| add(i, *j, &|r, c| a[(r, c)]));
                continue;
            }
            for (block, j) in self.row(i).chunks(m * m).zip(self.neighbours(i)) {
                add(i, j, &|r, c| block[r * m + c]);
            }
        }
        let mut lanes: Vec<Lane> = x.iter().map(|&x| lane(x)).collect();
        if closed {
            blocks.solve_cyclic(nodes, m, &mut lanes);
        } else {
            blocks.solve(nodes, m, 1, &mut lanes);
        }
        lanes.iter().map(|x| x.as_array()[0]).collect()
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

/// The derivative of S(v)x in v, for one v.
fn slope_of(space: &Erased, v: &Vector, x: &Vector) -> Matrix {
    let mut slope = Square::zeros(v.len());
    slope.set_stretch_slope(space, &splat(v), &splat(x));
    slope.of_lane(0)
}

/// `z ↦ [[a, z], w]`, for one a.
fn turned_by(space: &Erased, a: &Vector, w: &Vector) -> Matrix {
    let mut curvature = Square::zeros(a.len());
    curvature.set_curvature(space, &splat(a), &splat(w));
    curvature.of_lane(0)
}

/// Functions of ad_v as matrices of one lane.
struct OfChord {
    stretch: Matrix,
    shrink: Matrix,
    coth: Matrix,
    tanh: Matrix,
}

impl OfChord {
    fn of(space: &Erased, v: &Vector) -> Self {
        let mut functions = Functions::new(v.len());
        functions.set(space, &splat(v));
        let mut shrink = Square::identity(v.len());
        functions.stretch.divide(&mut [&mut shrink]);
        let Functions { stretch, coth, tanh, .. } = functions;
        let [stretch, shrink, coth, tanh] = [stretch, shrink, coth, tanh].map(|x| x.of_lane(0));
        OfChord { stretch, shrink, coth, tanh }
    }
}

impl Linearised {
    /// Adds minus the velocity of the not-a-knot condition: `S(x₀) c'(t₀)`, in the frame of the end.
    ///
    /// The chord d from p₀ to p₁ changes by `−ad coth ξ + S⁻¹η` in the frame of p₀ and by `−S⁻¹ξ + ad coth η` in that
    /// of p₁, and the frames rotate by `tanh(ad_d/2)(ξ + η)` relative to each other along it.
    fn not_a_knot(
        &mut self,
        space: &Erased,
        polygon: &Polygon,
        which: usize,
        [near, far]: [usize; 2],
        weights: &NotAKnot<Dual>,
    ) {
        let m = space.dim();
        let [d0, d1] = [near, far].map(|segment| Vector::from_vec(polygon.chord(segment, m)));
        let (d0, d1) = (&d0, &d1);
        // Value, and derivatives.
        let [u, near_by, far_by] = [weights.u, weights.near, weights.far]
            .map(|w| [w.v.as_array()[0], w.d.as_array()[0], w.d.as_array()[1]]);
        let (first, second) = (OfChord::of(space, d0), OfChord::of(space, d1));
        // The end, its neighbour, and the next node; all vectors change sign at the right end.
        let [end, next, third] = if which == 0 { [near, near + 1, far + 1] } else { [near + 1, near, far] };
        let next_u = Vector::from_column_slice(&polygon.u[polygon.runs.slot_of(next) * m..][..m]);
        let sign = if which == 0 { 1.0 } else { -1.0 };
        let c = &next_u * u[0] + d0 * near_by[0] + d1 * far_by[0];
        let target = &first.stretch * &c;
        // In the frame of the neighbour.
        let slope = slope_of(space, d0, &c) + &first.stretch * near_by[0];
        let turn = turned_by(space, d0, &target) * &first.tanh * sign;
        let own = &slope * &first.shrink * -sign + &turn;
        let mut neighbour = &slope * &first.coth * sign + &turn;
        if far_by[0] != 0.0 {
            let far_slope = &first.stretch * far_by[0];
            neighbour -= &far_slope * &second.coth * sign;
            let by_third = &far_slope * &second.shrink * -sign;
            // Where the first run ends with the second segment, the node has another frame.
            let turned = which == 0 && polygon.runs.len(0) == 2 && polygon.runs.joint(0).is_some();
            let turn = polygon.turns[0].of_lane(0);
            self.points.push((third, if turned { by_third * turn } else { by_third }));
        }
        self.points.push((end, -own));
        self.points.push((next, -neighbour));
        if u[0] != 0.0 {
            self.u.push((next, &first.stretch * -u[0]));
        }
        for (k, segment) in [near, far].into_iter().enumerate() {
            let change = &next_u * u[1 + k] + d0 * near_by[1 + k] + d1 * far_by[1 + k];
            self.lengths.push((segment, &first.stretch * change * -1.0));
        }
    }
}
