//! The motion of samples with the control points of their segments, and its transpose.
//!
//! A segment is given by its end points p₀, p₁ and its handles a, b. A *motion* of its control points p₀, q⁺, q⁻, p₁
//! consists of four tangent vectors: that of q⁺ is transported to p₀, that of q⁻ to p₁, and all are coordinates in the
//! frames of the two knots. Forward mode is de Casteljau's algorithm on dual numbers, reverse mode the transposes of its
//! six geodesics in reverse order (Bergmann and Gousenbourger, *A variational model for data fitting on manifolds by
//! minimizing the acceleration of a Bézier curve*, 2018, section 4).

use super::data::{Curves, Job, Moving, Outside, Quantity, Times, motion_len};
use super::locate::Locator;
use super::sample_cursor::SampleCursor;
use crate::monitor::checkpoint;
use crate::scalar::{Dual, Jet, LANES, Lane, Row, RowMut, Scalar, few, gather, lane, scatter};
use crate::space::{Ambient, Covered, Erased, Frame, Space};
use crate::with_size;

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
    fn lower(&self, side: Lane, y: &[Lane], gradient: &[Lane], image: &mut [Lane], out: &mut [Lane]);
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
    #[inline(always)]
    fn lower(&self, _side: Lane, _y: &[Lane], gradient: &[Lane], _image: &mut [Lane], out: &mut [Lane]) {
        out.copy_from_slice(gradient);
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
    #[inline(always)]
    fn lower(&self, side: Lane, y: &[Lane], gradient: &[Lane], image: &mut [Lane], out: &mut [Lane]) {
        self.0.lower(side, y, gradient, image, out);
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
                    place.inside().parallel_transport(
                        from,
                        to,
                        &self.inwards[e],
                        &self.inside[e],
                        &mut carried,
                    );
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
    /// The index of the frame at an end of the segment that begins at a knot.
    pub fn slot(&self, knot: usize, end: usize) -> usize {
        let (curve, segment) = (knot / self.curve.nodes, knot % self.curve.nodes);
        let segments = self.curve.nodes - 1;
        curve * (segments + self.runs) + segment + ((segment + 1) * self.runs - 1) / segments + end
    }

    /// One of the curves.
    pub fn one(&self, curve: usize) -> Moving<'_> {
        let Curves { t, nodes, points, velocities, .. } = self.curve;
        let part = |array: &'_ [f64], size: usize| -> std::ops::Range<usize> {
            let size = size.min(array.len());
            if array.len() == size { 0..size } else { curve * size..(curve + 1) * size }
        };
        let (count, row) = (self.times.count, nodes * self.len);
        let frames = self.frames.len() / (points.len() / row);
        Moving {
            curve: Curves {
                t: &t[part(t, nodes)],
                nodes,
                points: &points[part(points, row)],
                velocities: &velocities[part(velocities, row)],
                before: &[],
            },
            times: Times { x: &self.times.x[part(self.times.x, count)], count },
            frames: &self.frames[part(self.frames, frames)],
            ..*self
        }
    }

    /// The number of samples of all curves.
    fn samples(&self) -> usize {
        self.curve.points.len() / (self.curve.nodes * self.len) * self.times.count
    }

    fn job<'j>(&'j self, locator: &'j Option<Locator>) -> Job<'j> {
        Job {
            quantity: Quantity::Point,
            curves: &self.curve,
            times: &self.times,
            outside: Outside::Continue,
            locator: locator.as_ref(),
            first: 0,
            apart: 1,
            size: self.len,
            len: self.len,
            last: None,
        }
    }

    fn locator(&self) -> Option<Locator<'_>> {
        let index = self.times.count > 8 && self.times.count >= self.curve.nodes / 4;
        (self.curve.t.len() == self.curve.nodes).then(|| Locator::new(self.curve.t, index))
    }

    /// Forward mode: changes of the samples, tangent vectors, for motions of the control points of all segments. For ν = 1
    /// and 2 they are covariant derivatives of γ' and ∇γ'. Returns whether it exists: derivatives in time need a space that
    /// is [`SMOOTH`](Ambient::SMOOTH).
    pub fn push<M: Space>(&self, space: &M, motions: &[f64], out: &mut [f64]) -> bool {
        if self.nu > 0 {
            return self.push_derivatives(&Direct(space), self.len, motions, out);
        }
        with_size!(M::VECTORS, self.len, len => self.push_in(&Direct(space), len, len, motions, out));
        true
    }

    /// The same, compiled once.
    pub fn push_by_table(&self, space: &Erased, motions: &[f64], out: &mut [f64]) -> bool {
        self.push(space, motions, out)
    }

    /// The same in a space that covers this one.
    pub fn push_covered<C: Covered>(&self, space: &C, motions: &[f64], out: &mut [f64]) -> bool {
        let place = Lifted(space, space.cover());
        if self.nu > 0 {
            return self.push_derivatives(&place, C::LEN, motions, out);
        }
        self.push_in(&place, C::LEN, self.len, motions, out);
        true
    }

    fn push_derivatives<P: Place>(&self, place: &P, len: usize, motions: &[f64], out: &mut [f64]) -> bool {
        if !P::Inside::SMOOTH {
            return false;
        }
        if self.nu == 1 {
            self.push_along::<Dual, _>(place, len, motions, out);
        } else {
            self.push_along::<Jet, _>(place, len, motions, out);
        }
        true
    }

    #[inline(always)]
    fn push_in<P: Place>(&self, place: &P, len: usize, ambient: usize, motions: &[f64], out: &mut [f64]) {
        let (m, size) = (self.dim, motion_len(self.dim));
        let (locator, inside) = (self.locator(), place.inside());
        let job = self.job(&locator);
        let mut cursor = SampleCursor::new(&job, self.samples());
        let mut controls = Controls::new(len, ambient, m, place.base().frame_len());
        let mut points = fixed::<Dual>(len);
        let mut casteljau = Casteljau::new(len);
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
            let gamma = casteljau.at(inside, &points, t, len);
            for i in 0..len {
                (value[i], d[i]) = (gamma[i].v, gamma[i].d);
            }
            inside.velocity(&value[..len], &mut d[..len]);
            place.leave(controls.side, &value[..len], &d[..len], &mut result[..ambient]);
            scatter(&result[..ambient], out);
        }
    }

    /// For ν = 1 and 2: De = D_ε γ_τ and D²e + R(e, γ_τ)γ_τ = D_ε ∇γ_τ for the motion e of the curve in units of the segment, by
    /// numbers with derivatives in τ. A projected derivative of arrays is a covariant one in these spaces.
    fn push_along<S: Scalar, P: Place>(&self, place: &P, len: usize, motions: &[f64], out: &mut [f64]) {
        let (m, size, ambient) = (self.dim, motion_len(self.dim), self.len);
        let (locator, inside) = (self.locator(), place.inside());
        let job = self.job(&locator);
        let mut cursor = SampleCursor::new(&job, self.samples());
        let mut controls = Controls::new(len, ambient, m, place.base().frame_len());
        let mut moved = fixed::<Dual>(len);
        let [mut points, mut changes] = [fixed::<S>(len), fixed::<S>(len)];
        let [mut level, mut moving] = [fixed::<S>(len), fixed::<S>(len)];
        let zero = S::constant(Lane::ZERO);
        let (mut next, mut step) = (vec![zero; len], vec![zero; len]);
        let mut x = zeros(size);
        let [mut result, mut bent, mut change, mut rate] =
            [zeros(ambient), zeros(len), zeros(len), zeros(len)];
        for out in out.chunks_mut(LANES * ambient) {
            checkpoint();
            if cursor.advance() {
                controls.read(place, self, &cursor);
                gather(cursor.at.map(|i| &motions[i / ambient * size..][..size]), &mut x);
                controls.motions(place, &x[..4 * m], &mut moved);
                for k in 0..4 {
                    for i in 0..len {
                        points[k][i] = S::constant(moved[k][i].v);
                        changes[k][i] = S::constant(moved[k][i].d);
                    }
                }
            }
            let tau = (cursor.x - cursor.knot) / cursor.h;
            let t = S::from_parts([tau, Lane::ONE, Lane::ZERO]);
            let shift = S::constant(-x[4 * m + 1].mul_add(tau, x[4 * m]) / cursor.h);
            level.clone_from(&points);
            moving.clone_from(&changes);
            for above in (1..4).rev() {
                for i in 0..above {
                    inside.geodesic(&level[i], &level[i + 1], t, &mut next);
                    inside.push_along(
                        [&level[i], &level[i + 1]],
                        t,
                        [&moving[i], &moving[i + 1]],
                        shift,
                        &mut step,
                    );
                    level[i].copy_from_slice(&next);
                    moving[i].copy_from_slice(&step);
                }
            }
            let (gamma, e) = (&level[0], &moving[0]);
            let p: Vec<Lane> = gamma.iter().map(|x| x.value()).collect();
            for i in 0..len {
                change[i] = e[i].parts()[S::ORDER];
                rate[i] = gamma[i].parts()[S::ORDER];
            }
            if S::ORDER > 1 {
                let (velocity, value): (Vec<Lane>, Vec<Lane>) =
                    gamma.iter().zip(e).map(|(x, e)| (x.parts()[1], e.value())).unzip();
                inside.bend(&velocity, &value, &mut bent);
                change.iter_mut().zip(&bent).for_each(|(x, y)| *x += *y);
            }
            // Of the factor h^−ν.
            let by_h = x[4 * m + 1] / cursor.h * lane(S::ORDER as f64);
            change.iter_mut().zip(&rate).for_each(|(x, rate)| *x = by_h.mul_neg_add(*rate, *x));
            inside.velocity(&p, &mut change);
            place.leave(controls.side, &p, &change, &mut result);
            let scale = (0..S::ORDER).fold(Lane::ONE, |scale, _| scale * cursor.rate);
            result.iter_mut().for_each(|x| *x *= scale);
            scatter(&result, out);
        }
    }

    /// Reverse mode: adds the products of cotangent vectors at the samples, as gradients with respect to arrays, with
    /// motions of all segments. Returns whether it exists, as [`push`](Self::push).
    pub fn pull<M: Space>(&self, space: &M, cotangents: &[f64], out: &mut [f64]) -> bool {
        if self.nu > 0 {
            return self.pull_derivatives(&Direct(space), self.len, cotangents, out);
        }
        with_size!(M::VECTORS, self.len, len => {
            self.pull_in::<Lane, _>(&Direct(space), len, len, cotangents, out);
        });
        true
    }

    /// The same, compiled once.
    pub fn pull_by_table(&self, space: &Erased, cotangents: &[f64], out: &mut [f64]) -> bool {
        self.pull(space, cotangents, out)
    }

    /// The same in a space that covers this one.
    pub fn pull_covered<C: Covered>(&self, space: &C, cotangents: &[f64], out: &mut [f64]) -> bool {
        let place = Lifted(space, space.cover());
        if self.nu > 0 {
            return self.pull_derivatives(&place, C::LEN, cotangents, out);
        }
        self.pull_in::<Lane, _>(&place, C::LEN, self.len, cotangents, out);
        true
    }

    fn pull_derivatives<P: Place>(&self, place: &P, len: usize, cotangents: &[f64], out: &mut [f64]) -> bool {
        if !P::Inside::SMOOTH {
            return false;
        }
        if self.nu == 1 {
            self.pull_in::<Dual, _>(place, len, self.len, cotangents, out);
        } else {
            self.pull_in::<Jet, _>(place, len, self.len, cotangents, out);
        }
        true
    }

    /// ⟨λ, D_ε γ_τ⟩ is the derivative in τ of ⟨λ, e⟩ for a parallel λ, and ⟨λ, D_ε ∇γ_τ⟩ the second one where the second
    /// derivative of λ is R(λ, γ_τ)γ_τ: the pass of ν = 0 on numbers with derivatives in τ.
    #[inline(always)]
    fn pull_in<S: Scalar, P: Place>(
        &self,
        place: &P,
        len: usize,
        ambient: usize,
        cotangents: &[f64],
        out: &mut [f64],
    ) {
        let (m, size, count) = (self.dim, motion_len(self.dim), self.samples());
        let (locator, inside) = (self.locator(), place.inside());
        let job = self.job(&locator);
        let mut cursor = SampleCursor::new(&job, count);
        let mut controls = Controls::new(len, ambient, m, place.base().frame_len());
        // Levels 0 to 2 and the sample, and their cotangent vectors.
        let [mut level, mut first, mut second] = [fixed::<S>(len), fixed::<S>(len), fixed::<S>(len)];
        let [mut back, mut back_first, mut back_second] = [fixed::<S>(len), fixed::<S>(len), fixed::<S>(len)];
        let zero = S::constant(Lane::ZERO);
        let (mut gamma, mut top) = (vec![zero; len], vec![zero; len]);
        let [mut cotangent, mut image] = [zeros(ambient), zeros(ambient)];
        let [mut p, mut lifted, mut bent] = [(); 3].map(|()| zeros(len));
        let (mut sums, mut products) = ([Lane::ZERO; 2], zeros(size));
        let rest = vec![0.0; ambient];
        let mut at = None;
        let mut scale = Lane::ONE;
        let flush = |controls: &mut Controls,
                     back: &[Vec<S>; 4],
                     sums: [Lane; 2],
                     scale: Lane,
                     products: &mut [Lane]| {
            let part = |x: &Vec<S>| x.iter().map(|x| x.parts()[S::ORDER] * scale).collect::<Vec<Lane>>();
            let [a, b, c, d] = back;
            controls.products(place, &[part(a), part(b), part(c), part(d)], products);
            products[size - 2..].copy_from_slice(&sums);
        };
        for start in (0..count).step_by(LANES) {
            checkpoint();
            let changed = cursor.advance();
            if let (true, Some(at)) = (changed || self.apart, at) {
                flush(&mut controls, &back, sums, scale, &mut products);
                add(&products, at, out);
            }
            if changed {
                controls.read(place, self, &cursor);
                for (level, p) in level.iter_mut().zip(&controls.points) {
                    level.iter_mut().zip(p).for_each(|(x, p)| *x = S::constant(*p));
                }
            }
            if changed || self.apart {
                back.iter_mut().for_each(|x| x.fill(zero));
                sums = [Lane::ZERO; 2];
                scale = (0..S::ORDER).fold(Lane::ONE, |scale, _| scale * cursor.rate);
                at = Some(if self.apart {
                    few(|l| (start + l).min(count - 1) * size)
                } else {
                    cursor.at.map(|i| i / ambient * size)
                });
            }
            // Lanes beyond the last sample repeat it, without a cotangent vector.
            let rows: [&[f64]; LANES] =
                few(
                    |l| {
                        if start + l < count {
                            &cotangents[(start + l) * ambient..][..ambient]
                        } else {
                            &rest
                        }
                    },
                );
            gather(rows, &mut cotangent[..ambient]);
            let tau = (cursor.x - cursor.knot) / cursor.h;
            let t = S::from_parts([tau, Lane::ONE, Lane::ZERO]);
            for i in 0..3 {
                inside.geodesic(&level[i][..len], &level[i + 1][..len], t, &mut first[i][..len]);
            }
            for i in 0..2 {
                inside.geodesic(&first[i][..len], &first[i + 1][..len], t, &mut second[i][..len]);
            }
            inside.geodesic(&second[0][..len], &second[1][..len], t, &mut gamma[..len]);
            p[..len].iter_mut().zip(&gamma).for_each(|(p, x)| *p = x.value());
            let (image, lowered) = (&mut image[..ambient], &mut lifted[..len]);
            place.lower(controls.side, &p[..len], &cotangent[..ambient], image, lowered);
            inside.raise(&p[..len], &mut lifted[..len]);
            if S::ORDER > 0 {
                inside.velocity(&p[..len], &mut lifted[..len]);
            }
            if S::ORDER > 1 {
                let velocity: Vec<Lane> = gamma.iter().map(|x| x.parts()[1]).collect();
                inside.bend(&velocity, &lifted, &mut bent);
            }
            for i in 0..len {
                top[i] = S::from_parts([lifted[i], Lane::ZERO, bent[i]]);
            }
            back_first.iter_mut().chain(&mut back_second).for_each(|x| x.fill(zero));
            let [to_x, to_y, ..] = &mut back_second;
            let mut rate = transposed(inside, &second[0], &second[1], t, &top, to_x, to_y, len);
            for i in 0..2 {
                let (a, b) = back_first.split_at_mut(i + 1);
                let (x, y) = (&first[i], &first[i + 1]);
                rate = rate + transposed(inside, x, y, t, &back_second[i], &mut a[i], &mut b[0], len);
            }
            for i in 0..3 {
                let (a, b) = back.split_at_mut(i + 1);
                let (x, y) = (&level[i], &level[i + 1]);
                rate = rate + transposed(inside, x, y, t, &back_first[i], &mut a[i], &mut b[0], len);
            }
            let rate = rate.parts()[S::ORDER] * scale * cursor.rate;
            sums[0] -= rate;
            sums[1] -= rate * tau;
            if S::ORDER > 0 {
                // Of the factor h^−ν.
                let derivative: Vec<Lane> = gamma.iter().map(|x| x.parts()[S::ORDER]).collect();
                let along = inside.pairing(&p[..len], &lifted[..len], &derivative[..len]);
                sums[1] -= along * scale * cursor.rate * lane(S::ORDER as f64);
            }
        }
        if let Some(at) = at {
            flush(&mut controls, &back, sums, scale, &mut products);
            add(&products, at, out);
        }
    }
}

fn fixed<S: Scalar>(len: usize) -> [Vec<S>; 4] {
    let points = || vec![S::constant(Lane::ZERO); len];
    [points(), points(), points(), points()]
}

/// De Casteljau's algorithm (8) with control points that may move.
struct Casteljau<S> {
    level: [Vec<S>; 4],
    next: Vec<S>,
}

impl<S: Scalar> Casteljau<S> {
    fn new(len: usize) -> Self {
        Casteljau { level: fixed(len), next: vec![S::constant(Lane::ZERO); len] }
    }

    #[inline(always)]
    fn at<M: Ambient>(&mut self, space: &M, points: &[Vec<S>; 4], t: S, len: usize) -> &[S] {
        let Casteljau { level, next } = self;
        level.iter_mut().zip(points).for_each(|(to, from)| to[..len].copy_from_slice(&from[..len]));
        for above in (1..4).rev() {
            for i in 0..above {
                let (a, b) = level.split_at_mut(i + 1);
                space.geodesic(&a[i][..len], &b[0][..len], t, &mut next[..len]);
                a[i][..len].copy_from_slice(&next[..len]);
            }
        }
        &level[0]
    }
}

/// The transpose of a geodesic, for any kind of number where the space has it, see [`Ambient::pull_back`].
#[inline(always)]
fn transposed<M: Ambient, S: Scalar>(
    space: &M,
    p: &[S],
    q: &[S],
    t: S,
    cotangent: &[S],
    to_p: &mut [S],
    to_q: &mut [S],
    len: usize,
) -> S {
    let (p, q, cotangent) = (&p[..len], &q[..len], &cotangent[..len]);
    let (to_p, to_q) = (&mut to_p[..len], &mut to_q[..len]);
    if M::SMOOTH {
        return space.pull_back_along(p, q, t, cotangent, to_p, to_q);
    }
    match (S::row(p), S::row(q), S::row(cotangent), S::row_mut(to_p), S::row_mut(to_q)) {
        (Row::Lane(p), Row::Lane(q), Row::Lane(cotangent), RowMut::Lane(to_p), RowMut::Lane(to_q)) => {
            S::constant(space.pull_back(p, q, t.value(), cotangent, to_p, to_q))
        }
        _ => unreachable!("the space has no transposes for points that move"),
    }
}

/// Adds the products of the lanes to those of their segments.
#[inline(always)]
fn add(products: &[Lane], at: [usize; LANES], out: &mut [f64]) {
    for l in 0..LANES {
        for (sum, x) in out[at[l]..][..products.len()].iter_mut().zip(products) {
            *sum += x.as_array()[l];
        }
    }
}
