//! The linearised C² condition of a whole curve: the sensitivity of velocities to points, knots and end vectors.

use super::operators::{Functions, Matrix, Vector, curvature, splat, stretch, stretch_slope, unit};
use super::polygon::Polygon;
use super::segment::{LinearisedSegment, Side};
use crate::fit::{Blocks, EndKind, NotAKnot};
use crate::monitor::checkpoint;
use crate::scalar::{Dual, Lane, lane};
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

/// Small changes, in the frames of the knots.
#[derive(Clone)]
pub struct Change {
    /// Changes of points.
    pub points: Vec<Vector>,
    /// Changes of the lengths of segments.
    pub lengths: Vec<f64>,
    /// Changes of the vectors at the ends.
    pub ends: [Vector; 2],
    /// Changes of the times at which segments begin and the last one ends. In a gradient, lengths are held fixed.
    pub knots: Vec<f64>,
}

/// The linearised conditions of one curve.
pub struct System {
    pub segments: Vec<LinearisedSegment>,
    pub rows: Vec<Linearised>,
    m: usize,
    closed: bool,
    both_not_a_knot: bool,
}

impl System {
    /// `ends` are kinds and prescribed vectors in the frames of the ends; None for a closed curve.
    pub fn new(space: &Erased, polygon: &Polygon, h: &[f64], ends: Option<[(EndKind, Vector); 2]>) -> Self {
        let (n, m) = (h.len(), space.dim());
        let segments: Vec<LinearisedSegment> = (0..n)
            .map(|i| {
                checkpoint();
                LinearisedSegment::new(space, h[i], &polygon.chords[i], [&polygon.u[i], &polygon.u[i + 1]])
            })
            .collect();
        let closed = ends.is_none();
        let both_not_a_knot =
            ends.as_ref().is_some_and(|e| e.iter().all(|(kind, _)| *kind == EndKind::NotAKnot));
        let mut system = System { segments, rows: Vec::new(), m, closed, both_not_a_knot };
        if let (true, Some(holonomy)) = (closed, &polygon.holonomy) {
            system.close(holonomy);
        }
        let row = |i: usize| {
            checkpoint();
            match &ends {
                Some([first, _]) if i == 0 => system.end(space, polygon, 0, first),
                Some([_, last]) if i == n => system.end(space, polygon, 1, last),
                _ => system.inner(space, polygon, i),
            }
        };
        // One segment from a point to itself is a constant curve for all changes.
        let nodes = if !closed {
            n + 1
        } else if n > 1 {
            n
        } else {
            0
        };
        system.rows = (0..nodes).map(row).collect();
        system
    }

    /// Transports the last node's side of a closed curve to the frame of the first node.
    fn close(&mut self, holonomy: &Matrix) {
        let Some(back) = holonomy.clone().try_inverse() else { return };
        let Some(last) = self.segments.last_mut() else { return };
        let [start, end] = &mut last.sides;
        for block in [&mut start.u[1], &mut start.points[1], &mut end.u[1], &mut end.points[1]] {
            *block = &*block * holonomy;
        }
        for block in end.u.iter_mut().chain(&mut end.points) {
            *block = &back * &*block;
        }
        end.value = &back * &end.value;
        end.length = &back * &end.length;
    }

    fn node(&self, i: usize) -> usize {
        if self.closed { i % self.segments.len() } else { i }
    }

    /// `S(hᵢ₋₁u/3) right − S(hᵢu/3) left`
    fn inner(&self, space: &Erased, polygon: &Polygon, i: usize) -> Linearised {
        let n = self.segments.len();
        let (l, r) = ((i + n - 1) % n, i);
        let (before, behind) = (&self.segments[l], &self.segments[r]);
        let u = &polygon.u[i];
        let (left, right) = (&before.sides[1], &behind.sides[0]);
        let mut row = Linearised::default();
        let handles = [u * (before.h / 3.0), u * (behind.h / 3.0)];
        // The two frames of a closed curve differ by its holonomy.
        let stretched = [
            if i > 0 { before.functions[1].stretch.clone() } else { stretch(space, &handles[0]) },
            behind.functions[0].stretch.clone(),
        ];
        let slopes = [
            stretch_slope(space, &handles[0], &right.value),
            -stretch_slope(space, &handles[1], &left.value),
        ];
        row.side(&stretched[0], right, [r, r + 1].map(|k| self.node(k)), r);
        row.side(&-&stretched[1], left, [l, l + 1].map(|k| self.node(k)), l);
        for (slope, (segment, h)) in slopes.iter().zip([(l, before.h), (r, behind.h)]) {
            row.u.push((i, slope * (h / 3.0)));
            row.lengths.push((segment, slope * u / 3.0));
        }
        row
    }

    fn end(
        &self,
        space: &Erased,
        polygon: &Polygon,
        which: usize,
        (kind, value): &(EndKind, Vector),
    ) -> Linearised {
        let n = self.segments.len();
        let (node, near, far) = if which == 0 { (0, 0, 1.min(n - 1)) } else { (n, n - 1, n.max(2) - 2) };
        let identity = Matrix::identity(self.m, self.m);
        let mut row = Linearised { u: vec![(node, identity.clone())], ..Linearised::default() };
        match kind {
            EndKind::Velocity | EndKind::Both => row.end = Some((which, -identity)),
            EndKind::Acceleration => {
                // The side of the only segment is S(handle) A/6.
                let segment = &self.segments[near];
                let (sixth, handle) = (value / 6.0, &segment.handles[which]);
                let slope = stretch_slope(space, handle, &sixth);
                row.u = vec![(node, &slope * (-segment.h / 3.0))];
                row.lengths.push((near, &slope * &polygon.u[node] / -3.0));
                row.side(&identity, &segment.sides[which], [near, near + 1], near);
                row.end = Some((which, &segment.functions[which].stretch / -6.0));
            }
            EndKind::NotAKnot => {
                // Differentiated with respect to the lengths of the two segments, one per lane.
                let h = |segment: usize, k| Dual { v: lane(self.segments[segment].h), d: unit(k, 0) };
                let weights = NotAKnot::of(h(near, 0), h(far, 1), n, self.both_not_a_knot);
                row.not_a_knot(space, polygon, which, [near, far], &weights);
            }
        }
        row
    }

    /// The changes of velocities for given changes.
    pub fn velocities(&self, change: &Change) -> Vec<Vector> {
        let right: Vec<Vector> = self
            .rows
            .iter()
            .map(|row| {
                let mut sum = Vector::zeros(self.m);
                row.points.iter().for_each(|(k, a)| sum -= a * &change.points[*k]);
                row.lengths.iter().for_each(|(k, a)| sum -= a * change.lengths[*k]);
                row.end.iter().for_each(|(k, a)| sum -= a * &change.ends[*k]);
                sum
            })
            .collect();
        self.solve(right, false)
    }

    /// Adds the contribution of a gradient with respect to velocities to a gradient with respect to changes.
    pub fn pull_back(&self, velocities: Vec<Vector>, gradient: &mut Change) {
        let multipliers = self.solve(velocities, true);
        for (row, x) in self.rows.iter().zip(&multipliers) {
            row.points.iter().for_each(|(k, a)| gradient.points[*k] -= a.tr_mul(x));
            row.lengths.iter().for_each(|(k, a)| gradient.lengths[*k] -= a.dot(x));
            row.end.iter().for_each(|(k, a)| gradient.ends[*k] -= a.tr_mul(x));
        }
    }

    /// J⁻¹ x, or J⁻ᵀ x.
    fn solve(&self, x: Vec<Vector>, transposed: bool) -> Vec<Vector> {
        let (nodes, m) = (self.rows.len(), self.m);
        if nodes == 0 {
            return x;
        }
        let mut blocks = Blocks::default();
        blocks.clear(nodes, m);
        for (i, row) in self.rows.iter().enumerate() {
            for (j, a) in &row.u {
                let (row, column) = if transposed { (*j, i) } else { (i, *j) };
                let side = if row == column {
                    1
                } else if column + 1 == row || (self.closed && row == 0 && column + 1 == nodes) {
                    0
                } else {
                    2
                };
                let block = &mut blocks.sides[side][row * m * m..][..m * m];
                for r in 0..m {
                    for c in 0..m {
                        block[r * m + c] += lane(if transposed { a[(c, r)] } else { a[(r, c)] });
                    }
                }
            }
        }
        let mut lanes: Vec<Lane> = x.iter().flat_map(splat).collect();
        if self.closed {
            blocks.solve_cyclic(nodes, m, &mut lanes);
        } else {
            blocks.solve(nodes, m, 1, &mut lanes);
        }
        lanes.chunks(m).map(|x| Vector::from_iterator(m, x.iter().map(|x| x.as_array()[0]))).collect()
    }
}

impl Linearised {
    /// Adds a matrix times a side of a segment between two nodes.
    fn side(&mut self, factor: &Matrix, side: &Side, nodes: [usize; 2], segment: usize) {
        for (e, node) in nodes.into_iter().enumerate() {
            self.u.push((node, factor * &side.u[e]));
            self.points.push((node, factor * &side.points[e]));
        }
        self.lengths.push((segment, factor * &side.length));
    }

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
        let (d0, d1) = (&polygon.chords[near], &polygon.chords[far]);
        // Value, and derivatives.
        let [u, near_by, far_by] = [weights.u, weights.near, weights.far]
            .map(|w| [w.v.as_array()[0], w.d.as_array()[0], w.d.as_array()[1]]);
        let (first, second) = (Functions::of(space, d0), Functions::of(space, d1));
        // The end, its neighbour, and the next node; all vectors change sign at the right end.
        let [end, next, third] = if which == 0 { [near, near + 1, far + 1] } else { [near + 1, near, far] };
        let sign = if which == 0 { 1.0 } else { -1.0 };
        let c = &polygon.u[next] * u[0] + d0 * near_by[0] + d1 * far_by[0];
        let target = &first.stretch * &c;
        // In the frame of the neighbour.
        let slope = stretch_slope(space, d0, &c) + &first.stretch * near_by[0];
        let turn = curvature(space, d0, &target) * &first.tanh * sign;
        let own = &slope * &first.shrink * -sign + &turn;
        let mut neighbour = &slope * &first.coth * sign + &turn;
        if far_by[0] != 0.0 {
            let far_slope = &first.stretch * far_by[0];
            neighbour -= &far_slope * &second.coth * sign;
            self.points.push((third, &far_slope * &second.shrink * -sign));
        }
        self.points.push((end, -own));
        self.points.push((next, -neighbour));
        if u[0] != 0.0 {
            self.u.push((next, &first.stretch * -u[0]));
        }
        for (k, segment) in [near, far].into_iter().enumerate() {
            let change = &polygon.u[next] * u[1 + k] + d0 * near_by[1 + k] + d1 * far_by[1 + k];
            self.lengths.push((segment, &first.stretch * change * -1.0));
        }
    }
}
