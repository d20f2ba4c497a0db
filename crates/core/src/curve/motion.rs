//! The motion of samples with the control points of their segments, and its transpose.
//!
//! A segment is given by its end points p₀, p₁ and its handles a, b. A *motion* of its control points p₀, q⁺, q⁻, p₁
//! consists of four tangent vectors: that of q⁺ is transported to p₀, that of q⁻ to p₁, and all are coordinates in the
//! frames of the two knots. Forward mode is de Casteljau's algorithm on dual numbers, reverse mode the transposes of its
//! six geodesics in reverse order (Bergmann and Gousenbourger, *A variational model for data fitting on manifolds by
//! minimizing the acceleration of a Bézier curve*, 2018, section 4).

use super::data::{Curves, Job, Outside, Quantity, Times};
use super::locate::Locator;
use super::sample_cursor::SampleCursor;
use crate::monitor::checkpoint;
use crate::scalar::{Dual, LANES, Lane, Scalar, few, gather, lane, scatter};
use crate::space::{Ambient, Covered, Erased, Frame, Space};
use crate::with_size;

/// The numbers of a motion: four coordinate vectors, and the changes of the first knot and of the length of the segment.
pub const fn motion_len(dim: usize) -> usize {
    4 * dim + 2
}

/// One curve, the frames of its knots, and the times of samples.
pub struct Moving<'a> {
    /// The curve.
    pub curve: Curves<'a>,
    /// The times.
    pub times: Times<'a>,
    /// The frames of the knots. Where a run of segments ends, the knot has two: that of the run comes first.
    pub frames: &'a [f64],
    /// The number of runs, of almost equal length; frames are transported in parallel within a run.
    pub runs: usize,
    /// The dimension of the space.
    pub dim: usize,
    /// The numbers of a point.
    pub len: usize,
}

/// Where the geodesics of a space are computed: in the space itself or in one that covers it.
trait Place {
    type Base: Space;
    type Inside: Ambient;
    fn base(&self) -> &Self::Base;
    fn inside(&self) -> &Self::Inside;
    /// Whether vectors change on entering.
    const COVERED: bool;
    /// See [`Covered`].
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]);
    fn choose(&self, from: &[Lane], qyw: [&mut [Lane]; 3]);
    fn side(&self, p: &[Lane]) -> Lane;
    fn leave(&self, side: Lane, y: &[Lane], w: &[Lane], out: &mut [Lane]);
}

struct Direct<'a, M>(&'a M);

impl<M: Space> Place for Direct<'_, M> {
    type Base = M;
    type Inside = M;
    const COVERED: bool = false;
    fn base(&self) -> &M {
        self.0
    }
    fn inside(&self) -> &M {
        self.0
    }
    #[inline(always)]
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]) {
        p.into_iter().zip(y).chain(v.into_iter().zip(w)).for_each(|(x, y)| y.copy_from_slice(x));
    }
    #[inline(always)]
    fn choose(&self, _from: &[Lane], _qyw: [&mut [Lane]; 3]) {}
    #[inline(always)]
    fn side(&self, _p: &[Lane]) -> Lane {
        Lane::ONE
    }
    #[inline(always)]
    fn leave(&self, _side: Lane, _y: &[Lane], w: &[Lane], out: &mut [Lane]) {
        out.copy_from_slice(w);
    }
}

struct Lifted<'a, C: Covered>(&'a C, C::Cover);

impl<C: Covered> Place for Lifted<'_, C> {
    type Base = C;
    type Inside = C::Cover;
    const COVERED: bool = true;
    fn base(&self) -> &C {
        self.0
    }
    fn inside(&self) -> &C::Cover {
        &self.1
    }
    #[inline(always)]
    fn enter(&self, p: [&[Lane]; 2], v: [&[Lane]; 2], y: [&mut [Lane]; 2], w: [&mut [Lane]; 2]) {
        self.0.enter(p, v, y, w);
    }
    #[inline(always)]
    fn choose(&self, from: &[Lane], qyw: [&mut [Lane]; 3]) {
        self.0.choose(from, qyw);
    }
    #[inline(always)]
    fn side(&self, p: &[Lane]) -> Lane {
        self.0.side(p)
    }
    #[inline(always)]
    fn leave(&self, side: Lane, y: &[Lane], w: &[Lane], out: &mut [Lane]) {
        self.0.leave(side, y, Some(w), out);
    }
}

fn zeros(len: usize) -> Vec<Lane> {
    vec![Lane::ZERO; len]
}

/// The control points of a segment on each lane, and its frames.
struct Controls {
    /// Numbers of a point inside, of a point of the space, and coordinates.
    len: usize,
    ambient: usize,
    m: usize,
    /// In the space.
    ends: [Vec<Lane>; 2],
    handles: [Vec<Lane>; 2],
    frames: [Vec<Lane>; 2],
    /// Inside: p₀, q⁺, q⁻, p₁ and the handles that point inwards.
    points: [Vec<Lane>; 4],
    inwards: [Vec<Lane>; 2],
    /// q⁻ and p₁ before a representative was chosen.
    raw: [Vec<Lane>; 2],
    side: Lane,
    /// Work memory.
    pair: [Vec<Lane>; 2],
    inside: [Vec<Lane>; 4],
}

impl Controls {
    fn new(len: usize, ambient: usize, m: usize, frame: usize) -> Self {
        let (inside, outside) = (|| zeros(len), || zeros(ambient));
        Controls {
            len,
            ambient,
            m,
            ends: [outside(), outside()],
            handles: [outside(), outside()],
            frames: [zeros(frame), zeros(frame)],
            points: [inside(), inside(), inside(), inside()],
            inwards: [inside(), inside()],
            raw: [inside(), inside()],
            side: Lane::ONE,
            pair: [outside(), outside()],
            inside: [inside(), inside(), inside(), inside()],
        }
    }

    /// Reads the segments of the lanes.
    #[inline(always)]
    fn read<P: Place>(&mut self, place: &P, moving: &Moving, cursor: &SampleCursor) {
        let (inside, len, ambient) = (place.inside(), self.len, self.ambient);
        let third = cursor.h * lane(1.0 / 3.0);
        let velocities = moving.curve.one_sided();
        let frame = self.frames[0].len();
        for e in 0..2 {
            gather(cursor.at.map(|i| &moving.curve.points[i + e * ambient..][..ambient]), &mut self.ends[e]);
            gather(cursor.at.map(|i| &velocities[e][i + e * ambient..][..ambient]), &mut self.handles[e]);
            self.handles[e].iter_mut().for_each(|u| *u *= third);
            let slot = |i: usize| moving.slot(i / ambient, e) * frame;
            gather(cursor.at.map(|i| &moving.frames[slot(i)..][..frame]), &mut self.frames[e]);
        }
        let [p0, p1] = &self.ends;
        let [a, b] = &self.handles;
        self.side = place.side(p0);
        let [y0, q0, q1, y1] = &mut self.points;
        let [start, end] = &mut self.inwards;
        place.enter([p0, p1], [a, b], [y0, y1], [start, end]);
        inside.ray(&y0[..len], &start[..len], Lane::ONE, &mut q0[..len]);
        end.iter_mut().for_each(|x| *x = -*x);
        inside.ray(&y1[..len], &end[..len], Lane::ONE, &mut q1[..len]);
        if P::COVERED {
            self.raw[0].copy_from_slice(q1);
            self.raw[1].copy_from_slice(y1);
            place.choose(q0, [q1, y1, end]);
        }
    }

    /// Lifts a tangent vector at each end to the place of the geodesics; the result is in `inside[0]` and `inside[1]`.
    #[inline(always)]
    fn lift<P: Place>(&mut self, place: &P, vectors: [&[Lane]; 2]) {
        let [v, w, y, q] = &mut self.inside;
        if !P::COVERED {
            v.copy_from_slice(vectors[0]);
            w.copy_from_slice(vectors[1]);
            return;
        }
        let [p0, p1] = &self.ends;
        place.enter([p0, p1], vectors, [q, y], [v, w]);
        q.copy_from_slice(&self.raw[0]);
        y.copy_from_slice(&self.raw[1]);
        place.choose(&self.points[1], [q, y, w]);
    }

    /// The tangent vectors at the ends with given coordinates, in `pair`.
    #[inline(always)]
    fn tangents<P: Place>(&mut self, place: &P, x: [&[Lane]; 2]) {
        for e in 0..2 {
            place.base().tangent(&self.frames[e], &self.ends[e], x[e], &mut self.pair[e]);
        }
    }

    /// Lifts the coordinates of a motion: tangent vectors at the four control points.
    #[inline(always)]
    fn motions<P: Place>(&mut self, place: &P, x: &[Lane], points: &mut [Vec<Dual>; 4]) {
        let (m, len) = (self.m, self.len);
        let mut carried = zeros(len);
        for (k, at) in [[0, 3], [1, 2]].into_iter().enumerate() {
            self.tangents(place, [&x[at[0] * m..][..m], &x[at[1] * m..][..m]]);
            let pair = std::mem::take(&mut self.pair);
            self.lift(place, [&pair[0], &pair[1]]);
            self.pair = pair;
            for e in 0..2 {
                let d: &[Lane] = if k == 0 {
                    &self.inside[e]
                } else {
                    let (from, to) = (&self.points[3 * e], &self.points[1 + e]);
                    place.inside().parallel_transport(from, to, &self.inwards[e], &self.inside[e], &mut carried);
                    &carried
                };
                let point = &self.points[at[e]];
                for i in 0..len {
                    points[at[e]][i] = Dual { v: point[i], d: d[i] };
                }
            }
        }
    }

    /// The products of cotangent vectors at the four control points with the frames: the transpose of
    /// [`motions`](Self::motions).
    #[inline(always)]
    fn products<P: Place>(&mut self, place: &P, cotangents: &[Vec<Lane>; 4], out: &mut [Lane]) {
        let (m, inside) = (self.m, place.inside());
        let mut carried = zeros(self.len);
        if !P::COVERED {
            for e in 0..2 {
                let (knot, control) = (3 * e, 1 + e);
                let base = place.base();
                base.products(&self.frames[e], &self.ends[e], &cotangents[knot], &mut out[knot * m..][..m]);
                let (from, to) = (&self.points[control], &self.points[knot]);
                // The way back is minus the velocity at the control point.
                let way = &self.inwards[e];
                base.parallel_transport(to, from, way, way, &mut carried);
                let back: Vec<Lane> = carried.iter().map(|x| -*x).collect();
                base.parallel_transport(from, to, &back, &cotangents[control], &mut carried);
                base.products(&self.frames[e], &self.ends[e], &carried, &mut out[control * m..][..m]);
            }
            return;
        }
        let mut unit = zeros(m);
        for k in 0..m {
            unit[k] = Lane::ONE;
            self.tangents(place, [&unit, &unit]);
            unit[k] = Lane::ZERO;
            let pair = std::mem::take(&mut self.pair);
            self.lift(place, [&pair[0], &pair[1]]);
            self.pair = pair;
            for e in 0..2 {
                let (knot, control) = (3 * e, 1 + e);
                let vector = &self.inside[e];
                out[knot * m + k] = inside.pairing(&self.points[knot], &cotangents[knot], vector);
                let (from, to) = (&self.points[knot], &self.points[control]);
                inside.parallel_transport(from, to, &self.inwards[e], vector, &mut carried);
                out[control * m + k] = inside.pairing(to, &cotangents[control], &carried);
            }
        }
    }
}

impl Moving<'_> {
    /// The index of the frame at an end of a segment.
    fn slot(&self, segment: usize, end: usize) -> usize {
        segment + ((segment + 1) * self.runs - 1) / (self.curve.nodes - 1) + end
    }

    fn job<'j>(&'j self, locator: &'j Locator) -> Job<'j> {
        Job {
            quantity: Quantity::Point,
            curves: &self.curve,
            times: &self.times,
            outside: Outside::Continue,
            locator: Some(locator),
            first: 0,
            apart: 1,
            size: self.len,
            len: self.len,
        }
    }

    fn locator(&self) -> Locator<'_> {
        Locator::new(self.curve.t, self.times.count > 8 && self.times.count >= self.curve.nodes / 4)
    }

    /// Forward mode: tangent vectors at the samples for motions of the control points of all segments.
    pub fn push<M: Space>(&self, space: &M, motions: &[f64], out: &mut [f64]) {
        with_size!(M::VECTORS, self.len, len => self.push_in(&Direct(space), len, len, motions, out));
    }

    /// The same, compiled once.
    pub fn push_by_table(&self, space: &Erased, motions: &[f64], out: &mut [f64]) {
        self.push(space, motions, out);
    }

    /// The same in a space that covers this one.
    pub fn push_covered<C: Covered>(&self, space: &C, motions: &[f64], out: &mut [f64]) {
        self.push_in(&Lifted(space, space.cover()), C::LEN, self.len, motions, out);
    }

    #[inline(always)]
    fn push_in<P: Place>(&self, place: &P, len: usize, ambient: usize, motions: &[f64], out: &mut [f64]) {
        let (m, size) = (self.dim, motion_len(self.dim));
        let (locator, inside) = (self.locator(), place.inside());
        let job = self.job(&locator);
        let mut cursor = SampleCursor::new(&job, self.times.count);
        let mut controls = Controls::new(len, ambient, m, place.base().frame_len());
        let fixed = || vec![Dual::constant(Lane::ZERO); len];
        let mut points = [fixed(), fixed(), fixed(), fixed()];
        let mut level = [fixed(), fixed(), fixed(), fixed()];
        let mut next = fixed();
        let mut x = zeros(size);
        let [mut value, mut d, mut result] = [zeros(len), zeros(len), zeros(ambient)];
        for out in out.chunks_mut(LANES * ambient) {
            checkpoint();
            if cursor.advance() {
                controls.read(place, self, &cursor);
                gather(cursor.at.map(|i| &motions[i / ambient * size..][..size]), &mut x);
                controls.motions(place, &x[..4 * m], &mut points);
            }
            let tau = (cursor.x - cursor.knot) / cursor.h;
            let t = Dual { v: tau, d: -x[4 * m + 1].mul_add(tau, x[4 * m]) / cursor.h };
            level.iter_mut().zip(&points).for_each(|(to, from)| to[..len].copy_from_slice(&from[..len]));
            for above in (1..4).rev() {
                for i in 0..above {
                    let (a, b) = level.split_at_mut(i + 1);
                    inside.geodesic(&a[i][..len], &b[0][..len], t, &mut next[..len]);
                    a[i][..len].copy_from_slice(&next[..len]);
                }
            }
            for i in 0..len {
                (value[i], d[i]) = (level[0][i].v, level[0][i].d);
            }
            inside.velocity(&value[..len], &mut d[..len]);
            place.leave(controls.side, &value[..len], &d[..len], &mut result[..ambient]);
            scatter(&result[..ambient], out);
        }
    }

    /// Reverse mode: adds the products of cotangent vectors at the samples, as gradients with respect to arrays, with
    /// motions of all segments.
    pub fn pull<M: Space>(&self, space: &M, cotangents: &[f64], out: &mut [f64]) {
        with_size!(M::VECTORS, self.len, len => self.pull_in(&Direct(space), len, len, cotangents, out));
    }

    /// The same, compiled once.
    pub fn pull_by_table(&self, space: &Erased, cotangents: &[f64], out: &mut [f64]) {
        self.pull(space, cotangents, out);
    }

    /// The same in a space that covers this one.
    pub fn pull_covered<C: Covered>(&self, space: &C, cotangents: &[f64], out: &mut [f64]) {
        self.pull_in(&Lifted(space, space.cover()), C::LEN, self.len, cotangents, out);
    }

    #[inline(always)]
    fn pull_in<P: Place>(&self, place: &P, len: usize, ambient: usize, cotangents: &[f64], out: &mut [f64]) {
        let (m, size, count) = (self.dim, motion_len(self.dim), self.times.count);
        let (locator, inside) = (self.locator(), place.inside());
        let job = self.job(&locator);
        let mut cursor = SampleCursor::new(&job, count);
        let mut controls = Controls::new(len, ambient, m, place.base().frame_len());
        let points = || [zeros(len), zeros(len), zeros(len), zeros(len)];
        // Levels 1 and 2 and the sample, their cotangent vectors, and those of the control points.
        let (mut first, mut second, mut gamma) = (points(), points(), zeros(len));
        let (mut back_first, mut back_second, mut back) = (points(), points(), points());
        let [mut cotangent, mut lifted, mut unit] = [zeros(ambient), zeros(len), zeros(len)];
        let mut image = zeros(ambient);
        let (mut sums, mut products) = ([Lane::ZERO; 2], zeros(size));
        let rest = vec![0.0; ambient];
        let mut at = None;
        for start in (0..count).step_by(LANES) {
            checkpoint();
            if cursor.advance() {
                if let Some(at) = at {
                    add(&mut controls, place, &back, sums, &mut products, at, out);
                }
                controls.read(place, self, &cursor);
                back.iter_mut().for_each(|x| x.fill(Lane::ZERO));
                sums = [Lane::ZERO; 2];
                at = Some(cursor.at.map(|i| i / ambient * size));
            }
            // Lanes beyond the last sample repeat it, without a cotangent vector.
            let rows: [&[f64]; LANES] =
                few(|l| if start + l < count { &cotangents[(start + l) * ambient..][..ambient] } else { &rest });
            gather(rows, &mut cotangent[..ambient]);
            let t = (cursor.x - cursor.knot) / cursor.h;
            let [y0, q0, q1, y1] = &controls.points;
            let ends = [(y0, q0), (q0, q1), (q1, y1)];
            for (i, (p, q)) in ends.into_iter().enumerate() {
                inside.geodesic(&p[..len], &q[..len], t, &mut first[i][..len]);
            }
            for i in 0..2 {
                inside.geodesic(&first[i][..len], &first[i + 1][..len], t, &mut second[i][..len]);
            }
            inside.geodesic(&second[0][..len], &second[1][..len], t, &mut gamma[..len]);
            if P::COVERED {
                for k in 0..len {
                    unit[k] = Lane::ONE;
                    place.leave(controls.side, &gamma[..len], &unit[..len], &mut image[..ambient]);
                    unit[k] = Lane::ZERO;
                    lifted[k] = crate::scalar::dot(&image[..ambient], &cotangent[..ambient]);
                }
            } else {
                lifted[..len].copy_from_slice(&cotangent[..len]);
            }
            inside.raise(&gamma[..len], &mut lifted[..len]);
            back_first.iter_mut().chain(&mut back_second).for_each(|x| x.fill(Lane::ZERO));
            let [x, y, ..] = &second;
            let [to_x, to_y, ..] = &mut back_second;
            let mut rate = inside.pull_back(
                &x[..len],
                &y[..len],
                t,
                &lifted[..len],
                &mut to_x[..len],
                &mut to_y[..len],
            );
            for i in 0..2 {
                let (a, b) = back_first.split_at_mut(i + 1);
                let (x, y) = (&first[i][..len], &first[i + 1][..len]);
                rate +=
                    inside.pull_back(x, y, t, &back_second[i][..len], &mut a[i][..len], &mut b[0][..len]);
            }
            for (i, (p, q)) in ends.into_iter().enumerate() {
                let (a, b) = back.split_at_mut(i + 1);
                rate += inside.pull_back(
                    &p[..len],
                    &q[..len],
                    t,
                    &back_first[i][..len],
                    &mut a[i][..len],
                    &mut b[0][..len],
                );
            }
            let rate = rate / cursor.h;
            sums[0] -= rate;
            sums[1] -= rate * t;
        }
        if let Some(at) = at {
            add(&mut controls, place, &back, sums, &mut products, at, out);
        }
    }
}

/// Adds the products of the lanes to those of their segments.
#[inline(always)]
fn add<P: Place>(
    controls: &mut Controls,
    place: &P,
    cotangents: &[Vec<Lane>; 4],
    sums: [Lane; 2],
    products: &mut [Lane],
    at: [usize; LANES],
    out: &mut [f64],
) {
    let size = products.len();
    controls.products(place, cotangents, products);
    products[size - 2..].copy_from_slice(&sums);
    for l in 0..LANES {
        for (sum, x) in out[at[l]..][..size].iter_mut().zip(&*products) {
            *sum += x.as_array()[l];
        }
    }
}
