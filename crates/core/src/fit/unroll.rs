//! Transport along the polygon: unrolls points into a chain, and writes velocities back.

use super::chain::{Chain, Run, Visit, Walker};
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::joint::BothRows;
use crate::scalar::{LANES, Lane, Scalar, dot, few, gather, lane, max_or_nan};
use crate::space::{Ambient, Erased, Frame, Origin, Space, below};
use crate::with_size;

/// After this many steps the rounding errors of a frame are removed. This costs the cube of the dimension, whereas
/// one step costs its square.
fn reorthonormalize_every(dim: usize) -> usize {
    dim.max(8)
}

/// Within this fraction of the cut angle, rounding errors of the data determine the direction of the geodesic between
/// two points.
const ALMOST: f64 = 1e-5;

/// Whether frames preserve lengths along the polygon.
fn has_metric<M: Origin>(space: &M) -> bool {
    !space.curvature().is_nan()
}

impl Walker {
    fn start<M: Space>(&mut self, space: &M, runs: &[Run; LANES]) {
        let len = space.point_len();
        self.frame.resize(space.frame_len(), Lane::ZERO);
        self.p.resize(len, Lane::ZERO);
        self.q.resize(len, Lane::ZERO);
        self.node = 0;
        gather(runs.map(|r| r.point(0, len)), &mut self.p);
        space.lift(&self.p, &mut self.frame);
    }

    /// Moves one node on; returns the deciding angle of the chord.
    #[inline(always)]
    fn advance<M: Space>(&mut self, space: &M, runs: &[Run; LANES], len: usize, chord: &mut [Lane]) -> Lane {
        self.node += 1;
        gather(runs.map(|r| r.point(self.node, len)), &mut self.q[..len]);
        let angle = space.step(&mut self.frame, &self.p[..len], &self.q[..len], chord);
        std::mem::swap(&mut self.p, &mut self.q);
        if self.node.is_multiple_of(reorthonormalize_every(chord.len())) {
            space.reorthonormalize(&mut self.frame, &self.p);
        }
        angle
    }

    /// The squared length of the chord that led to the current point, computed at the point itself.
    fn measured<M: Space>(&mut self, space: &M, len: usize, chord: &[Lane]) -> Lane {
        // The point before is not needed any more.
        let Walker { frame, p, q: v, .. } = self;
        space.tangent(frame, &p[..len], chord, &mut v[..len]);
        space.inner(&p[..len], &v[..len], &v[..len])
    }
}

impl Chain {
    /// Unrolls `n` segments of the polygons. `values` are prescribed ambient vectors at the ends, and `both` those of ends
    /// with two conditions.
    pub fn unroll(
        &mut self,
        space: &Erased,
        runs: &[Run; LANES],
        n: usize,
        ends: &ChainEnds,
        values: [Option<[&[f64]; LANES]>; 2],
        both: [Option<BothRows>; 2],
    ) {
        let (m, len, keep) = (space.dim(), space.point_len(), space.chord_len());
        (self.n, self.m, self.closed) = (n, m, matches!(ends, ChainEnds::Periodic));
        for (vector, size) in [
            (&mut self.h, n),
            (&mut self.chord, n * m),
            (&mut self.prepared, n * keep),
            (&mut self.u, (n + 1) * m),
            (&mut self.r, (n + 1) * m),
            (&mut self.ambient, len),
        ] {
            vector.resize(size, Lane::ZERO);
        }
        self.u.fill(Lane::ZERO);
        (self.condition, self.pace) = (Lane::ONE, Lane::ZERO);
        (self.max_step, self.longest, self.widest) = (Lane::ZERO, Lane::ZERO, Lane::ZERO);
        (self.cut, self.almost_cut) = ([None; LANES], [None; LANES]);

        self.scale = if space.scales() { scale_of(space, runs, n) } else { Lane::ONE };
        self.clock = clock_of(runs);
        self.walker.start(space, runs);
        self.start.0.clone_from(&self.walker.frame);
        self.start.1.clone_from(&self.walker.p);
        self.read_end(space, 0, ends, values[0]);
        self.join_end(space, 0, runs, both[0].as_ref());
        space.0.walk(self, runs);
        self.longest = self.longest.sqrt() / self.scale;
        self.max_step = if has_metric(space) { self.longest } else { self.max_step.sqrt() };
        self.pace = self.pace.sqrt();
        self.read_end(space, 1, ends, values[1]);
        self.join_end(space, 1, runs, both[1].as_ref());
    }

    /// Moves along the polygon and stores its chords.
    pub fn walk<M: Space>(&mut self, space: &M, runs: &[Run; LANES]) {
        with_size!(M::VECTORS, space.point_len(), len => self.walk_sized(space, runs, len));
    }

    /// The same, compiled once.
    pub fn walk_by_table(&mut self, space: &Erased, runs: &[Run; LANES]) {
        self.walk(space, runs);
    }

    #[inline(always)]
    fn walk_sized<M: Space>(&mut self, space: &M, runs: &[Run; LANES], len: usize) {
        let (m, keep, limit) = (self.m, space.chord_len(), below(space.cut_angle()));
        let keeps_lengths = has_metric(space);
        let (scales, clear_of) = (space.scales(), lane(space.cut_angle() * (1.0 - ALMOST)));
        for i in 0..self.n {
            self.h[i] = Lane::new(few(|l| runs[l].h(i))) * self.clock;
            let d = &mut self.chord[i * m..(i + 1) * m];
            let angle = self.walker.advance(space, runs, len, d);
            self.widest = max_or_nan(self.widest, angle);
            if !keeps_lengths {
                self.max_step = max_or_nan(self.max_step, self.walker.measured(space, len, d));
            }
            if scales {
                d.iter_mut().for_each(|x| *x *= self.scale);
            }
            space.prepare(d, &mut self.prepared[i * keep..(i + 1) * keep]);
            let length2 = dot(d, d);
            self.longest = max_or_nan(self.longest, length2);
            self.pace = self.pace.max(length2 / (self.h[i] * self.h[i]));
            self.condition = max_or_nan(self.condition, space.condition(d));
            let clear = angle.simd_lt(clear_of);
            if !clear.all() {
                let inside = angle.simd_lt(limit).to_bitmask();
                for l in (0..LANES).filter(|l| clear.to_bitmask() >> l & 1 == 0) {
                    let found = if inside >> l & 1 == 1 { &mut self.almost_cut[l] } else { &mut self.cut[l] };
                    found.get_or_insert((i, angle.to_array()[l]));
                }
            }
        }
    }

    /// The prescribed vector at an end, in the frame there. The walker must be at that end.
    fn read_end(&mut self, space: &Erased, end: usize, ends: &ChainEnds, value: Option<[&[f64]; LANES]>) {
        let vector = &mut self.end_values[end];
        vector.resize(self.m, Lane::ZERO);
        let (ChainEnds::Open(kinds), Some(rows)) = (ends, value) else {
            vector.fill(Lane::ZERO);
            return;
        };
        gather(rows, &mut self.ambient);
        // Units of time are converted first: coordinates contain squares.
        let velocity = of_kind(&kinds[end], EndKind::Velocity);
        for x in &mut self.ambient {
            let once = *x / self.clock;
            *x = velocity.select(once, once / self.clock);
        }
        let Walker { frame, p, .. } = &self.walker;
        space.coordinates(frame, p, &self.ambient, vector);
        vector.iter_mut().for_each(|x| *x *= self.scale);
    }

    /// Updates the unknowns. The last velocity of a closed curve is the first, transported around the curve.
    pub fn update(&mut self, space: &Erased, change: impl FnOnce(&Self, &mut [Lane])) {
        let (count, mut u) = (self.count(), std::mem::take(&mut self.u));
        let (unknowns, last) = u.split_at_mut(count);
        change(self, unknowns);
        if self.closed {
            last.copy_from_slice(&unknowns[..self.m]);
            self.across_closure(space, true, last);
        }
        self.u = u;
    }

    /// Changes coordinates at the point where a closed curve closes: from the frame at its first node to that at its
    /// last, or back.
    pub fn across_closure<S: Scalar>(&mut self, space: &Erased, to_last: bool, x: &mut [S]) {
        let (first, last) = ((&self.start.0, &self.start.1), (&self.walker.frame, &self.walker.p));
        let (from, to) = if to_last { (first, last) } else { (last, first) };
        let [here, there, none] = &mut self.closure;
        for vector in [&mut *here, &mut *there, &mut *none] {
            vector.resize(space.point_len(), Lane::ZERO);
        }
        let mut parts = [(); 3].map(|_| vec![Lane::ZERO; self.m]);
        for (k, part) in parts.iter_mut().enumerate().take(S::ORDER + 1) {
            for (p, x) in part.iter_mut().zip(&*x) {
                *p = x.parts()[k];
            }
            space.tangent(from.0, from.1, part, here);
            // The same point, possibly another array.
            space.parallel_transport(from.1, to.1, none, here, there);
            space.coordinates(to.0, to.1, there, part);
        }
        for (i, x) in x.iter_mut().enumerate() {
            *x = S::from_parts([parts[0][i], parts[1][i], parts[2][i]]);
        }
    }

    /// Passes the velocities to a callback as ambient tangent vectors, node by node.
    pub fn roll_up(&mut self, space: &Erased, runs: &[Run; LANES], mut visit: impl FnMut(usize, &[Lane])) {
        space.0.walk_again(self, runs, &mut visit);
    }

    /// Moves along the polygon for [`roll_up`](Self::roll_up).
    pub fn walk_again<M: Space>(&mut self, space: &M, runs: &[Run; LANES], visit: Visit) {
        with_size!(M::VECTORS, space.point_len(), len => self.walk_again_sized(space, runs, len, visit));
    }

    /// The same, compiled once.
    pub fn walk_again_by_table(&mut self, space: &Erased, runs: &[Run; LANES], visit: Visit) {
        self.walk_again(space, runs, visit);
    }

    #[inline(always)]
    fn walk_again_sized<M: Space>(&mut self, space: &M, runs: &[Run; LANES], len: usize, visit: Visit) {
        let (m, scales) = (self.m, space.scales());
        self.walker.start(space, runs);
        for i in 0..=self.n {
            let Walker { frame, p, .. } = &self.walker;
            let ambient = &mut self.ambient[..len];
            space.tangent(frame, &p[..len], &self.u[i * m..(i + 1) * m], ambient);
            if scales {
                ambient.iter_mut().for_each(|x| *x /= self.scale);
            }
            ambient.iter_mut().for_each(|x| *x *= self.clock);
            visit(i, ambient);
            if i < self.n {
                // The chords are known, and the residual is no longer needed, so its memory receives them.
                self.walker.advance(space, runs, len, &mut self.r[..m]);
            }
        }
    }
}

/// The power of two that scales the longest chord of each lane to a length near one; 1 for chords of length zero.
fn scale_of(space: &Erased, runs: &[Run; LANES], n: usize) -> Lane {
    let len = space.point_len();
    Lane::new(runs.map(|run| {
        let difference = |i: usize| {
            let (p, q) = (run.point(i, len), run.point(i + 1, len));
            p.iter().zip(q).fold(0.0_f64, |m, (p, q)| m.max((q - p).abs()))
        };
        power_of_two_over((0..n).map(difference).fold(0.0, f64::max))
    }))
}

/// The power of two that scales the mean segment of the curve on each lane to a length near one. Squares of times
/// then neither overflow nor underflow, and scaling is exact.
fn clock_of(runs: &[Run; LANES]) -> Lane {
    Lane::new(runs.map(|Run { t, .. }| {
        let last = t.len() - 1;
        power_of_two_over((t[last] - t[0]) / last as f64)
    }))
}

/// The power of two that scales a number to a size near one; 1 for zero.
fn power_of_two_over(size: f64) -> f64 {
    let exponent = size.log2().round().clamp(-1000.0, 1000.0);
    if size > 0.0 && size.is_finite() { (-exponent).exp2() } else { 1.0 }
}
