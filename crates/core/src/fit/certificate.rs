//! A certificate at real steps, after Newton and Kantorovich: a C² spline exists within r of the computed velocities, and
//! it is the only one within R.
//!
//! `docs/theory/certificate.md` derives all bounds. The map `u ↦ u + 3 T⁻¹F(u)` with the matrix T of flat space and the
//! residual F contracts by q < 1 where the blocks of −3 ∂F differ from those of T by less than T is diagonally dominant. In
//! these bounds only lengths enter: those of the handles, of the middle sides of the control polygons, and of the chords.
//! They cost one evaluation of the middle sides.

use super::chain::Chain;
use super::end_kind::{ChainEnds, EndKind, of_kind};
use super::node::NodeVectors;
use super::vector::length2;
use crate::scalar::{LANES, Lane, few, lane, mask_from};
use crate::space::{Erased, Origin};
use crate::special::Trig;
use std::f64::consts::PI;
use std::ops::Range;

/// The scale of the velocity next to a not-a-knot end, in the norm in which the map contracts.
const BESIDE: Lane = lane(1.25);
/// Rounding errors of a sweep, in units of those of the points and velocities.
const ROUNDING: f64 = 32.0 * f64::EPSILON;
/// Where the longest chord and handle prove a contraction by this or less, no other bounds are needed.
const NEAR: f64 = 0.05;
/// The radii that are tried decrease by this factor.
const SHRINK: f64 = 0.8;
const TRIES: usize = 32;

/// What the certificate needs of a curve or of a section of it.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// The contraction at the computed velocities.
    contraction: f64,
    /// The longest handle, and the longest middle side of a control polygon.
    handle: f64,
    middle: f64,
    /// The largest `K h₋³|w − v|/(h₊(h₋ + h₊))` on both sides of a knot together, where its segments differ.
    bend: f64,
    /// Whether S remains in the condition.
    uneven: bool,
    /// The largest scale of a velocity in the norm, and how much less than in flat space T is diagonally dominant in it.
    scale: f64,
    weakness: f64,
    /// With the scales g of the velocities at a knot and g' beside it, and the dominance σ there, the largest 2g²/σ,
    /// gΣg'/σ and Σg'²/σ.
    weights: [f64; 3],
    /// The factor by which an error of the velocity at a not-a-knot end counts.
    step: f64,
    /// The largest speed at a knot or between neighbours.
    speed: f64,
    /// The longest and the shortest segment.
    longest: f64,
    shortest: f64,
    /// The growth of rounding errors over chords.
    condition: f64,
}

impl Default for Bounds {
    /// No certificate.
    fn default() -> Self {
        Bounds { contraction: f64::INFINITY, ..Bounds::EMPTY }
    }
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        contraction: 0.0,
        handle: 0.0,
        middle: 0.0,
        bend: 0.0,
        uneven: false,
        scale: 1.0,
        weakness: 1.0,
        weights: [0.0; 3],
        step: 0.0,
        speed: 0.0,
        longest: 0.0,
        shortest: f64::INFINITY,
        condition: 1.0,
    };

    /// The bounds of a curve that consists of two sections.
    pub fn joined(self, other: Self) -> Self {
        Bounds {
            contraction: self.contraction.max(other.contraction),
            handle: self.handle.max(other.handle),
            middle: self.middle.max(other.middle),
            bend: self.bend.max(other.bend),
            uneven: self.uneven | other.uneven,
            scale: self.scale.max(other.scale),
            weakness: self.weakness.max(other.weakness),
            weights: few(|i| self.weights[i].max(other.weights[i])),
            step: self.step.max(other.step),
            speed: self.speed.max(other.speed),
            longest: self.longest.max(other.longest),
            shortest: self.shortest.min(other.shortest),
            condition: self.condition.max(other.condition),
        }
    }

    /// r and R for the curvature K of (22), the injectivity radius, the relative residual, and the rounding errors of points,
    /// in units of ε.
    pub fn certify(
        &self,
        curvature: f64,
        injectivity: f64,
        residual: f64,
        rounding: f64,
    ) -> Option<[f64; 2]> {
        if !(self.contraction < 1.0 && residual.is_finite()) {
            return None;
        }
        let size = if curvature > 0.0 { 1.0 / curvature } else { 1.0 };
        let errors = self.condition * (self.speed + rounding * size / self.shortest);
        let residual = residual * self.speed + ROUNDING * errors;
        let defect = (3.0 * self.weakness + 2.0 * self.step) * residual;
        // From velocities to handles.
        let third = self.longest / 3.0;
        let limit = injectivity.min(PI / curvature);
        if curvature == 0.0 {
            let room = (limit - self.middle) * (1.0 - 1e-9) / (2.0 * self.scale);
            return (room > 0.0).then_some([defect, room / third]);
        }
        let room = 1.0 - self.contraction;
        let mut handle = 0.35 * room / (self.scale * curvature);
        for _ in 0..TRIES {
            if let Some(slope) = self.slope(handle, curvature, limit)
                && slope * handle < room
            {
                // In a ball of twice the distance that is expected.
                let ball = (2.0 * defect / room * third).min(handle);
                let error = defect / (room - slope * ball);
                let (r, radius) = (error * self.scale + self.step * residual, handle / third);
                return (error * third <= ball && r < radius).then_some([r, radius]);
            }
            handle *= SHRINK;
        }
        None
    }

    /// The growth of the contraction with the change of handles, up to a change.
    fn slope(&self, change: f64, curvature: f64, limit: f64) -> Option<f64> {
        let change = self.scale * change;
        let handle = Even::new(curvature * (self.handle + change));
        let middle = self.middle + 2.0 * handle.s * change;
        if !(middle < limit) {
            return None;
        }
        let Second { by_a, by_b, aa, ab, bb } = Second::new(&handle, curvature * middle);
        let [own, mixed, other] = self.weights;
        let second = (own * aa + 2.0 * mixed * ab + other * bb) / self.longest;
        if !self.uneven {
            return Some(curvature * second);
        }
        let first = by_a + by_b + 1.0;
        let bend = self.bend / self.longest + first * curvature * change;
        let stretched =
            self.scale * self.scale * self.weakness * (2.0 * handle.ds * first + handle.dds * bend);
        Some(curvature * (handle.s * second + stretched))
    }
}

/// sinh x/x with two derivatives, and (cosh x − 1)/x with one.
struct Even {
    s: f64,
    ds: f64,
    dds: f64,
    c: f64,
    dc: f64,
}

impl Even {
    fn new(x: f64) -> Self {
        let square = x * x;
        if x < 0.03 {
            // The next terms are rounding errors.
            let series = |a: [f64; 4]| a.iter().rev().fold(0.0, |sum, a| sum * square + a);
            return Even {
                s: series([1.0, 1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0]),
                ds: x * series([1.0 / 3.0, 1.0 / 30.0, 1.0 / 840.0, 1.0 / 45360.0]),
                dds: series([1.0 / 3.0, 0.1, 1.0 / 168.0, 1.0 / 6480.0]),
                c: x * series([0.5, 1.0 / 24.0, 1.0 / 720.0, 1.0 / 40320.0]),
                dc: series([0.5, 0.125, 1.0 / 144.0, 1.0 / 5760.0]),
            };
        }
        let (sinh, cosh) = (x.sinh(), x.cosh());
        Even {
            s: sinh / x,
            ds: (cosh - sinh / x) / x,
            dds: (sinh - 2.0 * (cosh - sinh / x) / x) / x,
            c: (cosh - 1.0) / x,
            dc: (sinh - (cosh - 1.0) / x) / x,
        }
    }
}

/// Bounds of the derivatives of the logarithm w of the C² condition by the handles a and b at both ends of a segment.
struct Second {
    /// Of the first derivatives.
    by_a: f64,
    by_b: f64,
    /// Of the second derivatives.
    aa: f64,
    ab: f64,
    bb: f64,
}

impl Second {
    /// For handles up to a length, by the functions of it, and the middle side w.
    fn new(handle: &Even, w: f64) -> Self {
        let Even { s, ds, c, dc, .. } = *handle;
        // x/sin x and 2 − x cot x with derivatives, and tan(x/2).
        let (sin, cos) = w.sin_cos();
        let small = w < 1e-3;
        let t = if small { 1.0 + w * w / 6.0 } else { w / sin };
        let dt = if small { w / 3.0 } else { (1.0 - t * cos) / sin };
        let e = 2.0 - t * cos;
        let de = if small { 2.0 * w / 3.0 } else { (t - cos) / sin };
        let turn = c + (0.5 * w).tan() * s;
        let (by_a, by_b) = (e * s + w * c, t * s);
        let aa = de * by_a * s + e * ds + c * by_a + w * dc;
        let ab = s * (dt * by_a + t * turn);
        let bb = s * (dt * by_b + t * turn) + t * ds;
        Second { by_a, by_b, aa, ab, bb }
    }
}

/// One end of a segment.
#[derive(Clone, Copy)]
struct Side {
    /// Bounds of the derivatives of its logarithm w by its own handle, and by that at the other end.
    near: Lane,
    far: Lane,
    /// |w − v|
    bend: Lane,
    /// S of the handle: its norm, and the derivative.
    stretch: Lane,
    slope: Lane,
    /// The square of the length of the chord times K².
    chord: Lane,
}

const NONE: Side = Side {
    near: Lane::ZERO,
    far: Lane::ZERO,
    bend: Lane::ZERO,
    stretch: Lane::ONE,
    slope: Lane::ZERO,
    chord: Lane::ZERO,
};

/// The two ends of a segment, for squares of lengths times K², and |w − v| times K.
#[inline(always)]
fn sides(handles: [Lane; 2], middle: Lane, chord: Lane, bends: [Lane; 2]) -> [Side; 2] {
    let [a, b] = handles.map(|square| Trig::new(-square));
    let [x, y] = handles.map(|square| square.sqrt());
    // (cosh x − 1)/x
    let (ca, cb) = (-(a.k * x), -(b.k * y));
    let (w, of_middle) = (middle.sqrt(), Trig::new(middle));
    let shrink = Lane::ONE / of_middle.s;
    let coth = lane(2.0) - of_middle.c * shrink;
    let valid = w.simd_lt(lane(PI));
    let side = |here: &Trig<Lane>, x: Lane, c: Lane, there: &Trig<Lane>, bend: Lane| Side {
        near: valid.select(coth.mul_add(here.s, w * c), lane(f64::INFINITY)),
        far: shrink * there.s,
        bend,
        stretch: here.s,
        slope: -(here.k + here.j) * x,
        chord,
    };
    [side(&a, x, ca, &b, bends[0]), side(&b, y, cb, &a, bends[1])]
}

/// The bounds for points so near each other that the longest chord and the longest handle are enough.
fn of_near_points(
    space: &Erased,
    chain: &Chain,
    ends: &ChainEnds,
    (injectivity, handle): (f64, Lane),
) -> [Bounds; LANES] {
    let free = |which: usize, kinds: &[EndKind; LANES]| {
        let still = !length2(&chain.end_values[which]).simd_gt(Lane::ZERO);
        of_kind(kinds, EndKind::Velocity) | (of_kind(kinds, EndKind::Acceleration) & still)
    };
    let known = match ends {
        ChainEnds::Periodic => mask_from(|_| true),
        ChainEnds::Open([first, last]) => free(0, first) & free(1, last),
    };
    if known.none() {
        return [Bounds::default(); LANES];
    }
    let (mut longest, mut shortest, mut ratio) = (chain.h[0], chain.h[0], Lane::ONE);
    let mut before = if chain.closed { chain.h[chain.n - 1] } else { chain.h[0] };
    for &h in &chain.h[..chain.n] {
        (longest, shortest) = (longest.max(h), shortest.min(h));
        ratio = ratio.max(h / before).max(before / h);
        before = h;
    }
    let uneven = ratio.simd_gt(lane(1.0 + 4.0 * f64::EPSILON));
    let (length, time) = (Lane::ONE / chain.scale, Lane::ONE / chain.clock);
    few(|l| {
        let of = |x: Lane| x.as_array()[l];
        let (handle, chord) = (of(handle * length), of(chain.longest));
        let middle = chord + 2.0 * handle;
        let k = space.curvature();
        let even = Even::new(k * handle);
        let Second { by_a, by_b, .. } = Second::new(&even, k * middle);
        let (uneven, bend) = (of(uneven).to_bits() != 0, k * (middle + handle) * of(ratio));
        let (stretch, slope) = if uneven { (even.s, even.ds * bend) } else { (1.0, 0.0) };
        let contraction = stretch * (by_a + 1.0 + by_b) - 3.0 + 2.0 * slope;
        // In flat space the radius depends on the middle side alone.
        let inside =
            if k == 0.0 { injectivity.is_infinite() } else { k * middle < 1.0 && 2.0 * middle < injectivity };
        let near = of(known).to_bits() != 0 && inside && contraction <= NEAR;
        Bounds {
            contraction: if near { contraction } else { f64::INFINITY },
            handle,
            middle,
            bend: 2.0 * bend * of(longest * time),
            uneven,
            weights: [of(longest * time); 3],
            speed: (3.0 * handle / of(shortest * time)).max(of(chain.pace * length / time)),
            longest: of(longest * time),
            shortest: of(shortest * time),
            condition: of(chain.condition),
            ..Bounds::EMPTY
        }
    })
}

/// The bounds of the cores of sections, one per lane, for an injectivity radius and the longest handle.
pub fn bounds(
    space: &Erased,
    chain: &Chain,
    ends: &ChainEnds,
    (injectivity, handle): (f64, Lane),
    work: &mut NodeVectors<Lane>,
    cores: [Range<usize>; LANES],
) -> [Bounds; LANES] {
    // Curves of a batch have the certificates of single curves.
    let near = of_near_points(space, chain, ends, (injectivity, handle));
    if near.iter().all(|bounds| bounds.contraction < 1.0) {
        return near;
    }
    work.resize(chain.m);
    let mut walk = Walk::new(chain, ends, cores);
    measure(space, chain, &mut walk, work);
    let all = walk.finish(chain);
    few(|l| if near[l].contraction < 1.0 { near[l] } else { all[l] })
}

fn measure(space: &Erased, chain: &Chain, walk: &mut Walk, work: &mut NodeVectors<Lane>) {
    let (m, keep, u) = (chain.m, space.chord_len(), chain.velocities());
    let k = lane(space.curvature()) / chain.scale;
    let square = k * k;
    let NodeVectors { a, b, left, right, .. } = work;
    let (a, b, left, right) = (&mut a[..m], &mut b[..m], &mut left[..m], &mut right[..m]);
    let (mut before, mut first) = (NONE, NONE);
    for i in 0..chain.n {
        let third = chain.h[i] * lane(1.0 / 3.0);
        for c in 0..m {
            a[c] = u[i * m + c] * third;
            b[c] = u[(i + 1) * m + c] * third;
        }
        let chord = &chain.chord[i * m..][..m];
        space.inner_handles(chord, &chain.prepared[i * keep..][..keep], a, b, right, left);
        let (handles, middle) = ([length2(a), length2(b)], length2(right));
        for c in 0..m {
            right[c] -= a[c];
            left[c] += b[c];
        }
        let bends = [length2(right), length2(left)].map(|square| square.sqrt() * k);
        walk.measure(i, handles, middle, length2(&u[i * m..][..m]).max(length2(&u[(i + 1) * m..][..m])));
        let [start, end] =
            sides(handles.map(|x| x * square), middle * square, length2(chord) * square, bends);
        if i == 0 {
            first = start;
        } else {
            walk.node(chain, i, &before, &start);
        }
        before = end;
    }
    if chain.closed {
        walk.node(chain, 0, &before, &first);
    } else {
        walk.end(chain, 0, &first, k);
        walk.end(chain, 1, &before, k);
    }
}

/// The largest values so far.
struct Walk<'a> {
    ends: &'a ChainEnds,
    cores: [Range<usize>; LANES],
    contraction: Lane,
    handle: Lane,
    middle: Lane,
    bend: Lane,
    uneven: Lane,
    scale: Lane,
    weakness: Lane,
    weights: [Lane; 3],
    step: Lane,
    speed: Lane,
}

impl<'a> Walk<'a> {
    fn new(chain: &Chain, ends: &'a ChainEnds, cores: [Range<usize>; LANES]) -> Self {
        let pace = chain.pace * chain.pace;
        Walk {
            ends,
            cores,
            contraction: Lane::ZERO,
            handle: Lane::ZERO,
            middle: Lane::ZERO,
            bend: Lane::ZERO,
            uneven: Lane::ZERO,
            scale: Lane::ONE,
            weakness: Lane::ONE,
            weights: [Lane::ZERO; 3],
            step: Lane::ZERO,
            speed: pace,
        }
    }

    /// The lanes whose core contains one of some nodes.
    fn has(&self, nodes: Range<usize>) -> Lane {
        mask_from(|l| self.cores[l].start < nodes.end && nodes.start < self.cores[l].end)
    }

    /// The lanes with a kind of condition at an end.
    fn kind(&self, which: usize, kind: EndKind) -> Lane {
        match self.ends {
            ChainEnds::Periodic => Lane::ZERO,
            ChainEnds::Open(kinds) => of_kind(&kinds[which], kind),
        }
    }

    fn measure(&mut self, segment: usize, handles: [Lane; 2], middle: Lane, speed: Lane) {
        let here = self.has(segment..segment + 2);
        let most = |old: Lane, new: Lane| here.select(old.max(new), old);
        self.handle = most(self.handle, handles[0].max(handles[1]));
        self.middle = most(self.middle, middle);
        self.speed = most(self.speed, speed);
    }

    /// The row of T and of its differences to the derivatives, both for velocities with their scales: that of the knot, and
    /// the sum of those beside it and of their squares. An inner knot has two `sides`.
    fn row(
        &mut self,
        node: usize,
        differences: Lane,
        [dominance, flat]: [Lane; 2],
        [scale, sum, squares]: [Lane; 3],
        sides: f64,
    ) {
        let here = self.has(node..node + 1);
        let ratio = differences / dominance;
        // Comparisons with NaN are false.
        let valid = ratio.simd_ge(Lane::ZERO) & dominance.simd_gt(Lane::ZERO);
        let ratio = valid.select(ratio, lane(f64::INFINITY));
        self.contraction = here.select(self.contraction.max(ratio), self.contraction);
        self.weakness = here.select(self.weakness.max(flat / dominance), self.weakness);
        for (most, weight) in self.weights.iter_mut().zip([scale * scale * lane(sides), scale * sum, squares])
        {
            *most = here.select(most.max(weight / dominance), *most);
        }
    }

    /// The scale of the velocity at a node that is not next to the one whose row is considered.
    fn scale_at(&self, chain: &Chain, node: usize) -> Lane {
        if chain.closed {
            return Lane::ONE;
        }
        let mut scale = Lane::ONE;
        for (which, (end, beside)) in [(0, 1), (chain.n, chain.n - 1)].into_iter().enumerate() {
            if node == end {
                scale = self.kind(which, EndKind::Velocity).select(Lane::ZERO, scale);
            } else if node == beside {
                scale = self.kind(which, EndKind::NotAKnot).select(BESIDE, scale);
            }
        }
        scale
    }

    /// The condition at a node between two segments. The velocity at a not-a-knot end depends on that beside it alone, and is
    /// eliminated.
    #[inline(always)]
    fn node(&mut self, chain: &Chain, i: usize, left: &Side, right: &Side) {
        let n = chain.n;
        let segments = [if i == 0 { n - 1 } else { i - 1 }, i];
        let [h_left, h_right] = segments.map(|k| chain.h[k]);
        let (one, two) = (Lane::ONE, lane(2.0));
        let inverse = [one / h_left, one / h_right];
        let equal = (h_left - h_right).abs().simd_le(h_right * lane(4.0 * f64::EPSILON));
        let plain = chain.closed || (i > 2 && i + 2 < n);
        let scales = if plain { [one; 3] } else { [i - 1, i, i + 1].map(|node| self.scale_at(chain, node)) };
        let mut differences = Lane::ZERO;
        let mut dominance = two * (inverse[0] + inverse[1]) * scales[1];
        let (mut sum, mut squares) = (Lane::ZERO, Lane::ZERO);
        let pairs = [(left, right, h_right, scales[0], 0), (right, left, h_left, scales[2], 1)];
        for (side, other, other_h, neighbour, which) in pairs {
            let (h, w) = (if which == 0 { h_left } else { h_right }, inverse[which]);
            let stretch = equal.select(one, other.stretch);
            let near = stretch * (side.near + one) - two;
            let far = stretch * side.far - one;
            let slope = equal.select(Lane::ZERO, other.slope * other_h * side.bend * w * w);
            differences += (near * w + slope) * scales[1];
            let knot = if plain { Lane::ZERO } else { self.eliminated(chain, i, which) };
            let (mut through, mut opposite, mut scale) = (far * neighbour, neighbour, neighbour);
            if knot.any() {
                let (step, chord) = (one + h / other_h, Trig::new(-side.chord).s);
                through = knot.select(step * ((one + far) * chord - one) * scales[1], through);
                opposite = knot.select(step * scales[1], opposite);
                scale = knot.select(step * chord * scales[1], scale);
                let here = knot & self.has(i..i + 1);
                self.scale = here.select(self.scale.max(scale), self.scale);
                self.step = here.select(self.step.max(step), self.step);
            }
            differences += through * w;
            dominance -= opposite * w;
            sum += scale;
            squares = scale.mul_add(scale, squares);
        }
        self.row(i, differences, [dominance, inverse[0] + inverse[1]], [scales[1], sum, squares], 2.0);
        if !equal.all() {
            let bend = h_left * h_left * h_left * right.bend * inverse[1]
                + h_right * h_right * h_right * left.bend * inverse[0];
            let here = self.has(i..i + 1) & !equal;
            self.bend = here.select(self.bend.max(bend / (h_left + h_right)), self.bend);
            self.uneven |= here;
        }
    }

    /// The lanes in which the neighbour of a node on one side is a not-a-knot end.
    fn eliminated(&self, chain: &Chain, i: usize, which: usize) -> Lane {
        let at_end = if which == 0 { i == 1 } else { i + 1 == chain.n };
        if at_end { self.kind(which, EndKind::NotAKnot) } else { Lane::ZERO }
    }

    /// The condition at an open end.
    fn end(&mut self, chain: &Chain, which: usize, side: &Side, k: Lane) {
        let (node, next, segment) = if which == 0 { (0, 1, 0) } else { (chain.n, chain.n - 1, chain.n - 1) };
        let (h, one) = (chain.h[segment], Lane::ONE);
        let w = one / h;
        let pull = length2(&chain.end_values[which]).sqrt() * k * lane(1.0 / 6.0);
        let acceleration = self.kind(which, EndKind::Acceleration);
        let beside = self.scale_at(chain, next);
        let differences = (side.near - one + (side.far - one) * beside) * w + h * side.slope * pull;
        let dominance = (lane(2.0) - beside) * w;
        let [differences, beside] = [differences, beside].map(|x| acceleration.select(x, Lane::ZERO));
        let scales = [acceleration.select(one, Lane::ZERO), beside, beside * beside];
        self.row(node, differences, [acceleration.select(dominance, w), w], scales, 1.0);
        let here = self.has(node..node + 1);
        let pulled = here & acceleration & pull.simd_gt(Lane::ZERO);
        self.bend = pulled.select(self.bend.max(h * h * h * pull), self.bend);
        self.uneven |= pulled;
        let both = here & self.kind(which, EndKind::Both);
        self.contraction = both.select(lane(f64::INFINITY), self.contraction);
    }

    /// In the units of the points and knots; K is that of the space.
    fn finish(self, chain: &Chain) -> [Bounds; LANES] {
        let (length, time) = (Lane::ONE / chain.scale, Lane::ONE / chain.clock);
        let cores = self.cores.clone();
        let segments = |f: fn(f64, f64) -> f64, start: f64, l: usize| {
            let (from, to) = (cores[l].start.max(1) - 1, cores[l].end.min(chain.n));
            chain.h[from..to].iter().fold(start, |most, h| f(most, h.as_array()[l]))
        };
        few(|l| {
            let of = |x: Lane| x.as_array()[l];
            Bounds {
                contraction: of(self.contraction),
                handle: of(self.handle.sqrt() * length),
                middle: of(self.middle.sqrt() * length),
                bend: of(self.bend * time),
                uneven: of(self.uneven).to_bits() != 0,
                scale: of(self.scale),
                weakness: of(self.weakness),
                weights: self.weights.map(|weight| of(weight * time)),
                step: of(self.step),
                speed: of(self.speed.sqrt() * length / time),
                longest: segments(f64::max, 0.0, l) * of(time),
                shortest: segments(f64::min, f64::INFINITY, l) * of(time),
                condition: of(chain.condition),
            }
        })
    }
}
