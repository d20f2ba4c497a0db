//! Values and derivatives of spline curves at many times.

use super::bezier::Segment;
use super::data::{Curves, Job, LastSegment, Outside, Quantity, Times};
use super::locate::Locator;
use super::sample_cursor::SampleCursor;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{Dual, Jet, LANES, Lane, Scalar, gather, lane, max_or_nan, scatter, scatter_apart};
use crate::space::{Ambient, Covered, Erased, Origin, Space};
use crate::with_size;
use std::any::Any;
use std::cell::Cell;
use std::ops::DerefMut;

/// Maximum number of samples that one thread evaluates at a time.
const BLOCK: usize = 2048;
/// The factor by which a block may be longer if it contains a curve per lane.
const TOGETHER: usize = 4;
/// The memory of an evaluation of points of at most this many numbers is kept.
const MOST_KEPT: usize = 128;
/// Samples times numbers from which several threads are certainly faster.
const PARALLEL: usize = 1 << 16;

impl Quantity {
    /// The number of entries of a result, for a space with points of `len` numbers.
    pub fn len(self, space: &Erased) -> usize {
        match self {
            _ if self.is_length() => 1,
            Quantity::Motion => 2 * space.dim() + space.point_len(),
            Quantity::State => 2 * space.point_len(),
            Quantity::Jet => 3 * space.point_len(),
            _ if self.is_of_body() => space.dim(),
            _ => space.point_len(),
        }
    }
}

/// Evaluates every curve at its times. `out` receives, curve by curve and time by time, a point, a vector, or the
/// number of entries given by [`Quantity::len`].
pub fn evaluate(
    space: &Erased,
    curves: &Curves,
    times: &Times,
    quantity: Quantity,
    outside: Outside,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let len = space.point_len();
    let size = quantity.len(space);
    let samples = out.len() / size;
    if samples == 0 {
        return;
    }
    // An index of the knots is faster if there are about as many times as knots.
    let shared = curves.t.len() == curves.nodes;
    let locator = shared.then(|| Locator::new(curves.t, samples > 8 && samples >= curves.nodes / 4));
    let length = parallel::block(BLOCK, len);
    // As many curves with common knots and times as there are lanes are evaluated together, segment by segment.
    let together = LANES * times.count;
    let groups = if shared && times.x.len() == times.count && together <= TOGETHER * length {
        samples / together
    } else {
        0
    };
    let (grouped, rest) = out.split_at_mut(groups * together * size);
    let long = together * (length / together).max(1);
    let grouped = grouped.chunks_mut(long * size).enumerate().map(|(k, out)| (k * long, times.count, out));
    let rest = rest.chunks_mut(length * size).enumerate();
    let rest = rest.map(|(k, out)| (groups * together + k * length, 1, out));
    let blocks: Vec<(usize, usize, &mut [f64])> = grouped.chain(rest).collect();
    let parallel = samples * len > PARALLEL;
    parallel::for_each(blocks, parallel, monitor, |(first, apart, out)| {
        let locator = locator.as_ref();
        let job = Job { curves, times, quantity, outside, locator, first, apart, size, len, last: None };
        space.0.samples(&job, out);
        monitor.advance(out.len() / size);
    });
}

/// Evaluates the point of one curve at a time. `last` belongs to the curve.
pub fn evaluate_point(
    space: &Erased,
    curve: &Curves,
    x: f64,
    outside: Outside,
    last: Option<&LastSegment>,
    out: &mut [f64],
) {
    let (times, len) = (Times { x: &[x], count: 1 }, space.point_len());
    let quantity = Quantity::Point;
    let job = Job {
        curves: curve,
        times: &times,
        quantity,
        outside,
        locator: None,
        first: 0,
        apart: 1,
        size: len,
        len,
        last,
    };
    space.0.samples(&job, out);
}

impl Job<'_> {
    /// Evaluates the block, a sample per lane, in any segments.
    pub fn run<M: Space>(&self, space: &M, out: &mut [f64]) {
        match self.quantity.order() {
            0 => self.run_with::<Lane, M>(space, out),
            1 => self.run_with::<Dual, M>(space, out),
            _ => self.run_with::<Jet, M>(space, out),
        }
    }

    /// The same, compiled once.
    pub fn run_by_table(&self, space: &Erased, out: &mut [f64]) {
        self.run(space, out);
    }

    fn run_with<S: Scalar, M: Space>(&self, space: &M, out: &mut [f64]) {
        with_size!(M::VECTORS, self.len, len => self.run_sized::<S, M>(space, out, len));
    }

    #[inline(always)]
    fn run_sized<S: Scalar, M: Space>(&self, space: &M, out: &mut [f64], len: usize) {
        self.each(
            out,
            len,
            |cursor, segment: &mut Segment<S>| {
                self.read(cursor, len, &mut segment.ends, &mut segment.handles);
                segment.prepare(space, len);
            },
            |cursor, segment, gamma, vectors, out| {
                let (p, vector) = self.sample(space, cursor, segment, gamma, vectors, len);
                match vector {
                    Some(v) if self.quantity.is_length() => out.write(&[norm(space, p, v)]),
                    Some(v) if matches!(self.quantity, Quantity::State | Quantity::Jet) => {
                        out.write_both(p, v)
                    }
                    vector => out.write(vector.unwrap_or(p)),
                }
            },
        );
    }

    /// The same in a space that covers this one.
    pub fn run_covered<C: Covered>(&self, space: &C, out: &mut [f64]) {
        match self.quantity.order() {
            0 => self.run_covered_with::<Lane, C>(space, out),
            1 => self.run_covered_with::<Dual, C>(space, out),
            _ => self.run_covered_with::<Jet, C>(space, out),
        }
    }

    fn run_covered_with<S: Scalar, C: Covered>(&self, space: &C, out: &mut [f64]) {
        let cover = space.cover();
        let (len, ambient) = (C::LEN, self.len);
        let mut buffer = vec![Lane::ZERO; 4 * ambient];
        let dim = (self.size.max(ambient) - ambient) / 2;
        let mut result = vec![Lane::ZERO; 2 * ambient.max(self.size)];
        self.each(
            out,
            len,
            |cursor, segment: &mut Segment<S>| {
                let (p, v) = buffer.split_at_mut(2 * ambient);
                let ([p0, p1], [v0, v1]) = (two(p, ambient), two(v, ambient));
                self.read(cursor, ambient, &mut [&mut *p0, &mut *p1], &mut [&mut *v0, &mut *v1]);
                let [y, z] = &mut segment.ends;
                let [a, b] = &mut segment.handles;
                segment.side = space.side(p0);
                space.enter([p0, p1], [v0, v1], [y, z], [a, b]);
                segment.prepare_chosen(&cover, len, |from, over| space.choose(from, over));
            },
            |cursor, segment, gamma, vectors, out| {
                let (p, vector) = self.sample(&cover, cursor, segment, gamma, vectors, len);
                if let (Quantity::Motion, Some(w)) = (self.quantity, vector) {
                    let (first, second) = w.split_at(len);
                    let (rates, point) = result[..self.size].split_at_mut(2 * dim);
                    space.body(p, first, &mut rates[..dim]);
                    space.body(p, second, &mut rates[dim..]);
                    space.leave(segment.side, p, None, point);
                    return out.write(&result[..self.size]);
                }
                if let (Quantity::Jet, Some(w)) = (self.quantity, vector) {
                    let (first, second) = w.split_at(len);
                    let rows = result.chunks_mut(ambient).zip([None, Some(first), Some(second)]);
                    rows.for_each(|(row, vector)| space.leave(segment.side, p, vector, row));
                    return out.write(&result[..self.size]);
                }
                let [point, result] = two(&mut result, ambient);
                if let (true, Some(w)) = (self.quantity.is_of_body(), vector) {
                    return out.write(space.body(p, w, result));
                }
                space.leave(segment.side, p, vector, result);
                if self.quantity == Quantity::State || self.quantity.is_length() {
                    space.leave(segment.side, p, None, point);
                }
                match self.quantity {
                    Quantity::State => out.write_both(point, result),
                    quantity if quantity.is_length() => out.write(&[norm(space, point, result)]),
                    _ => out.write(result),
                }
            },
        );
    }

    /// Iterates over the samples: `enter` reads a segment, `write` evaluates a sample per lane.
    #[inline(always)]
    fn each<S: Scalar>(
        &self,
        out: &mut [f64],
        len: usize,
        mut enter: impl FnMut(&SampleCursor, &mut Segment<S>),
        mut write: impl FnMut(&SampleCursor, &mut Segment<S>, &mut [S], &mut [Lane], Rows),
    ) {
        let kept =
            self.last.and_then(|last| last.0.take()).and_then(|last| last.downcast::<Memory<S>>().ok());
        let mut memory = kept.unwrap_or_else(|| Memory::take(len));
        let Memory { segment, at, gamma, vectors } = &mut *memory;
        let mut cursor = SampleCursor::new(self, out.len() / self.size);
        let stride = self.apart * self.size;
        for out in out.chunks_mut(LANES * stride) {
            let mut first = 0;
            while first < stride {
                if cursor.advance() && *at != cursor.at {
                    enter(&cursor, segment);
                    *at = cursor.at;
                }
                write(&cursor, segment, gamma, vectors, Rows { stride, out: &mut out[first..] });
                first += self.size;
            }
        }
        match self.last {
            Some(last) => last.0.set(Some(memory)),
            None => memory.put_back(),
        }
    }

    /// Points of a sample per lane, and vectors there if the quantity requires them; two for [`Quantity::Motion`]
    /// and [`Quantity::Jet`].
    #[inline(always)]
    fn sample<'v, S: Scalar, M: Ambient>(
        &self,
        space: &M,
        cursor: &SampleCursor,
        segment: &mut Segment<S>,
        gamma: &mut [S],
        vectors: &'v mut [Lane],
        len: usize,
    ) -> (&'v [Lane], Option<&'v [Lane]>) {
        // Exactly 1 at the last knot.
        let tau = (cursor.x - cursor.knot) / cursor.h;
        // Derivatives in units of the segment take fewer operations, because that of tau is the constant 1.
        segment.at(space, len, S::from_parts([tau, Lane::ONE, Lane::ZERO]), gamma);
        if self.outside == Outside::Geodesic && cursor.beyond != [0.0; LANES] {
            go_straight(space, cursor, segment, gamma);
        }
        let (p, derivatives) = vectors.split_at_mut(len);
        let (d, dd) = derivatives.split_at_mut(len);
        let (d, dd) = (&mut d[..len], &mut dd[..len]);
        for (i, g) in gamma[..len].iter().enumerate() {
            let [value, first, second] = g.parts();
            p[i] = value;
            if S::ORDER > 0 {
                d[i] = first * cursor.rate;
            }
            if S::ORDER > 1 {
                dd[i] = second * cursor.rate * cursor.rate;
            }
        }
        if self.quantity.order() == 2 {
            space.acceleration(p, d, dd);
        }
        if self.quantity.order() == 1 || self.quantity == Quantity::Motion {
            space.velocity(p, d);
        }
        let derivatives = match self.quantity.order() {
            0 => None,
            1 => Some(&derivatives[..len]),
            _ if matches!(self.quantity, Quantity::Motion | Quantity::Jet) => Some(&derivatives[..2 * len]),
            _ => Some(&derivatives[len..2 * len]),
        };
        (p, derivatives)
    }

    /// Gathers the ends of a segment per lane, and the handles there: h/3 times the velocities.
    #[inline(always)]
    fn read(
        &self,
        cursor: &SampleCursor,
        len: usize,
        ends: &mut [impl DerefMut<Target = [Lane]>; 2],
        handles: &mut [impl DerefMut<Target = [Lane]>; 2],
    ) {
        let SampleCursor { at, h, .. } = cursor;
        let third = *h * lane(1.0 / 3.0);
        let (p, u) = (self.curves.points, self.curves.one_sided());
        for e in 0..2 {
            gather(at.map(|i| &p[i + e * len..][..len]), &mut ends[e][..len]);
            gather(at.map(|i| &u[e][i + e * len..][..len]), &mut handles[e][..len]);
            handles[e].iter_mut().for_each(|u| *u *= third);
        }
    }
}

/// The index of no segment.
const NOWHERE: [usize; LANES] = [usize::MAX; LANES];

/// The memory of an evaluation, which a thread keeps: for a single sample, its allocation would take a third of the time.
struct Memory<S> {
    segment: Segment<S>,
    /// The index of the data of each lane's segment.
    at: [usize; LANES],
    gamma: Vec<S>,
    vectors: Vec<Lane>,
}

thread_local! {
    /// By the number of derivatives.
    static KEPT: [Cell<Option<Box<dyn Any + Send>>>; 3] = const { [const { Cell::new(None) }; 3] };
}

impl<S: Scalar> Memory<S> {
    /// Takes it out of its place, because evaluations may contain others.
    fn take(len: usize) -> Box<Self> {
        let kept = KEPT.with(|kept| kept[S::ORDER].take()).and_then(|kept| kept.downcast::<Self>().ok());
        let mut memory = kept.unwrap_or_else(|| {
            Box::new(Memory {
                segment: Segment::default(),
                at: NOWHERE,
                gamma: Vec::new(),
                vectors: Vec::new(),
            })
        });
        memory.at = NOWHERE;
        memory.segment.resize(len);
        memory.gamma.resize(len, S::constant(Lane::ZERO));
        memory.vectors.resize(3 * len, Lane::ZERO);
        memory
    }

    fn put_back(self: Box<Self>) {
        if self.gamma.len() <= MOST_KEPT {
            KEPT.with(|kept| kept[S::ORDER].set(Some(self)));
        }
    }
}

/// The output of a sample per lane.
struct Rows<'a> {
    stride: usize,
    out: &'a mut [f64],
}

impl Rows<'_> {
    #[inline(always)]
    fn write(self, lanes: &[Lane]) {
        // The length of a row is often a constant at compile time.
        if self.stride == lanes.len() {
            scatter(lanes, self.out);
        } else {
            scatter_apart(lanes, self.stride, self.out);
        }
    }

    /// Writes two arrays, one after the other.
    #[inline(always)]
    fn write_both(self, first: &[Lane], second: &[Lane]) {
        scatter_apart(first, self.stride, self.out);
        scatter_apart(second, self.stride, &mut self.out[first.len()..]);
    }
}

#[inline(always)]
fn norm<M: Ambient>(space: &M, p: &[Lane], v: &[Lane]) -> Lane {
    let square = max_or_nan(space.inner(p, v, v), Lane::ZERO);
    // A scaled norm whose squares neither overflow nor underflow.
    let plain = square.simd_ge(lane(1e-280)) & square.simd_le(lane(1e280));
    if plain.all() { square.sqrt() } else { plain.select(square.sqrt(), scaled_norm(space, p, v)) }
}

/// The norm of a vector of any size, computed from the vector divided by its largest entry.
#[cold]
#[inline(never)]
fn scaled_norm<M: Ambient>(space: &M, p: &[Lane], v: &[Lane]) -> Lane {
    let (v, largest) = scaled_down(v);
    max_or_nan(space.inner(p, &v, &v), Lane::ZERO).sqrt() * largest
}

/// Numbers divided by their largest absolute value, and this value.
fn scaled_down(v: &[Lane]) -> (Vec<Lane>, Lane) {
    let largest = v.iter().fold(Lane::ZERO, |most, v| max_or_nan(most, v.abs()));
    let zero = largest.simd_eq(Lane::ZERO);
    let unit = zero.select(Lane::ONE, largest);
    (v.iter().map(|v| *v / unit).collect(), largest)
}

/// The first two rows of a buffer.
fn two(buffer: &mut [Lane], len: usize) -> [&mut [Lane]; 2] {
    let (a, b) = buffer.split_at_mut(len);
    [a, &mut b[..len]]
}

/// Replaces the lanes outside the knots by the geodesic that continues the curve at its end, in units of the segment.
#[cold]
fn go_straight<S: Scalar, M: Ambient>(
    space: &M,
    cursor: &SampleCursor,
    segment: &Segment<S>,
    gamma: &mut [S],
) {
    let Segment { ends: [p0, p1], handles: [a, b], .. } = segment;
    let beyond = Lane::new(cursor.beyond);
    let (before, behind) = (beyond.simd_lt(Lane::ZERO), beyond.simd_gt(Lane::ZERO));
    let velocity = pick(before, a, b, lane(3.0));
    let mut straight = gamma.to_vec();
    space.ray(
        &pick(before, p0, p1, Lane::ONE),
        &velocity,
        S::from_parts([beyond / cursor.h, Lane::ONE, Lane::ZERO]),
        &mut straight,
    );
    for i in 0..gamma.len() {
        gamma[i] = S::select(before | behind, straight[i], gamma[i]);
    }
}

/// x on the lanes of a mask and y on the others, times a factor.
fn pick(mask: Lane, x: &[Lane], y: &[Lane], factor: Lane) -> Vec<Lane> {
    x.iter().zip(y).map(|(x, y)| mask.select(*x, *y) * factor).collect()
}
