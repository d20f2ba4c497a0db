//! The horizontal lift: continuous representatives of curves on quotient spaces.
//!
//! A point of RPⁿ, CPⁿ or Gr(k, n) is an array up to a unitary k × k factor on its right. Evaluation returns a
//! representative Y that is smooth within a segment and starts at the representative of its first point. The
//! horizontal lift is X = Y g with g' = −A g, where Y A is the vertical part of Y'. At a knot the representatives of
//! both sides differ by the unitary matrix Y₊*Y₋.

use super::bezier::Segment;
use super::collocation::{STAGES, end, legendre, nodes, solve, tail};
use super::data::{Curves, Outside, Quantity, Times};
use super::evaluate::evaluate;
use super::locate::Locator;
use super::sample_cursor::inside;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{Dual, LANES, Lane};
use crate::space::{Ambient, Erased};
use nalgebra::{Complex, DMatrix};

/// A k × k matrix that is unitary up to rounding.
type Factor = DMatrix<Complex<f64>>;

/// Maximum number of samples that one thread evaluates at a time.
const BLOCK: usize = 2048;
/// Number of segments whose factors one thread computes at a time.
const SEGMENTS: usize = 64;
/// The limit of the last two coefficients. Coefficients decrease by about a factor of ten, so that the polynomial is
/// then accurate to rounding.
const TAIL: f64 = 2e-13;
/// The maximum number of halvings of a segment: near the cut locus rounding errors exceed the limit above.
const DEEPEST: usize = 6;

/// A subinterval of a segment, and the Legendre coefficients of g there, k × k complex numbers each.
struct Interval {
    from: f64,
    length: f64,
    coefficients: Vec<f64>,
}

/// A segment of a curve on all lanes.
struct LiftedSegment<'a> {
    space: &'a Erased<'a>,
    segment: Segment<Dual>,
    gamma: Vec<Dual>,
    k: usize,
    len: usize,
}

impl<'a> LiftedSegment<'a> {
    fn new(space: &'a Erased<'a>) -> Self {
        let len = space.point_len();
        let gamma = vec![Dual { v: Lane::ZERO, d: Lane::ZERO }; len];
        LiftedSegment { space, segment: Segment::new(len), gamma, k: space.fiber_rank(), len }
    }

    /// Reads a segment of a curve.
    fn enter(&mut self, curves: &Curves, curve: usize, i: usize) {
        self.segment.read(curves, curve, i, self.len);
        self.segment.prepare(self.space, self.len);
    }

    fn at(&mut self, t: Lane) {
        self.segment.at(self.space, self.len, Dual { v: t, d: Lane::ONE }, &mut self.gamma);
    }

    /// A at several positions, one per lane.
    fn vertical(&mut self, t: [f64; LANES]) -> [Factor; LANES] {
        self.at(Lane::new(t));
        let y: Vec<Lane> = self.gamma.iter().map(|x| x.v).collect();
        let mut horizontal: Vec<Lane> = self.gamma.iter().map(|x| x.d).collect();
        self.space.velocity(&y, &mut horizontal);
        let vertical: Vec<Lane> = self.gamma.iter().zip(&horizontal).map(|(x, h)| x.d - *h).collect();
        std::array::from_fn(|l| {
            let y = self.matrix(|i| y[i].to_array()[l]);
            let a = y.adjoint() * self.matrix(|i| vertical[i].to_array()[l]);
            // Frames have orthonormal columns; a vector may have another length.
            if self.k == 1 { a / Complex::from(y.norm_squared()) } else { a }
        })
    }

    /// The n × k matrix of a point or vector.
    fn matrix(&self, entry: impl Fn(usize) -> f64) -> Factor {
        matrix(self.space, self.k, self.len, entry)
    }

    /// Continues g from one position of the segment to another through its subintervals; g is its value at the first
    /// position and is replaced by that at the second.
    fn follow(&mut self, from: f64, to: f64, depth: usize, g: &mut Factor, intervals: &mut Vec<Interval>) {
        let length = to - from;
        let t = nodes().map(|s| from + s * length);
        let a: Vec<Factor> = t.as_chunks::<LANES>().0.iter().flat_map(|t| self.vertical(*t)).collect();
        let found = solve(length, &a);
        if depth < DEEPEST && tail(&found) > TAIL {
            let middle = from + 0.5 * length;
            self.follow(from, middle, depth + 1, g, intervals);
            self.follow(middle, to, depth + 1, g, intervals);
            return;
        }
        let found: Vec<Factor> = found.iter().map(|c| c * &*g).collect();
        *g = unitary(end(&found));
        intervals.push(Interval { from, length, coefficients: found.iter().flat_map(numbers).collect() });
    }

    /// The factor from the representative of the first point of a segment to that of the second.
    fn across(&mut self, curves: &Curves, curve: usize, i: usize) -> Factor {
        self.enter(curves, curve, i);
        let mut g = Factor::identity(self.k, self.k);
        self.follow(0.0, 1.0, 0, &mut g, &mut Vec::new());
        self.at(Lane::ONE);
        let y = self.matrix(|i| self.gamma[i].v.to_array()[0]);
        let row = (curve * curves.nodes + i + 1) * self.len;
        let q = self.matrix(|j| curves.points[row + j]);
        matched(&q, &y) * g
    }
}

fn matrix(space: &Erased, k: usize, len: usize, entry: impl Fn(usize) -> f64) -> Factor {
    if space.is_complex() {
        Factor::from_fn(len / 2 / k, k, |i, j| {
            Complex::new(entry(2 * (i * k + j)), entry(2 * (i * k + j) + 1))
        })
    } else {
        Factor::from_fn(len / k, k, |i, j| Complex::from(entry(i * k + j)))
    }
}

/// The unitary g with q g = y for two representatives q and y of a point.
fn matched(q: &Factor, y: &Factor) -> Factor {
    unitary(q.adjoint() * y)
}

/// Removes rounding errors from a unitary matrix; the result for a number is its phase.
fn unitary(g: Factor) -> Factor {
    if g.nrows() == 1 {
        let size = g[(0, 0)].norm();
        return g.unscale(size);
    }
    let three = Factor::identity(g.nrows(), g.nrows()) * Complex::from(3.0);
    &g * (three - g.adjoint() * &g) * Complex::from(0.5)
}

fn numbers(g: &Factor) -> Vec<f64> {
    g.transpose().iter().flat_map(|z| [z.re, z.im]).collect()
}

fn factor(k: usize, numbers: &[f64]) -> Factor {
    Factor::from_fn(k, k, |i, j| Complex::new(numbers[2 * (i * k + j)], numbers[2 * (i * k + j) + 1]))
}

/// Computes the factors g at the knots, 1 at the first one: k × k complex numbers for every knot of every curve. At
/// the point p of a knot, the lift that starts at the given representative of the first point is p g.
pub fn lift_knots(space: &Erased, curves: &Curves, monitor: &Monitor, out: &mut [f64]) {
    let (k, nodes) = (space.fiber_rank(), curves.nodes);
    let size = 2 * k * k;
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(SEGMENTS * size).enumerate().collect();
    let parallel = blocks.len() > 1;
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let mut segment = LiftedSegment::new(space);
        for (i, out) in out.chunks_mut(size).enumerate() {
            let at = block * SEGMENTS + i;
            let (curve, i) = (at / nodes, at % nodes);
            let g = if i == 0 { Factor::identity(k, k) } else { segment.across(curves, curve, i - 1) };
            out.copy_from_slice(&numbers(&g));
            monitor.advance(1);
        }
    });
    for curve in out.chunks_mut(nodes * size) {
        for i in 1..nodes {
            let g =
                unitary(factor(k, &curve[i * size..][..size]) * factor(k, &curve[(i - 1) * size..][..size]));
            curve[i * size..][..size].copy_from_slice(&numbers(&g));
        }
    }
}

/// The position of a sample: its segment, the parameter there, the number of turns, and whether the curve is a
/// geodesic.
struct Sample {
    row: usize,
    segment: usize,
    turns: i32,
    t: f64,
    straight: bool,
}

/// Evaluates the horizontal lift and its derivatives: the result of [`evaluate`] at other representatives.
///
/// `knots` is the result of [`lift_knots`], and `start`, for every curve, the factor from the given representative of
/// the first point to the initial point of the lift.
pub fn lift(
    space: &Erased,
    curves: &Curves,
    times: &Times,
    quantity: Quantity,
    outside: Outside,
    [knots, start]: [&[f64]; 2],
    monitor: &Monitor,
    out: &mut [f64],
) {
    evaluate(space, curves, times, quantity, outside, monitor, out);
    let (len, k) = (space.point_len(), space.fiber_rank());
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(BLOCK * len).enumerate().collect();
    let parallel = blocks.len() > 1;
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let first = block * BLOCK;
        let mut samples: Vec<Sample> =
            (0..out.len() / len).map(|row| position(curves, times, outside, first, row)).collect();
        samples.sort_by_key(|s| (s.segment, s.turns));
        let mut segment = LiftedSegment::new(space);
        let mut turned = Turned { k, complex: space.is_complex(), entries: vec![[0.0; 2]; k * k] };
        for group in samples.chunk_by(|a, b| a.segment == b.segment && a.turns == b.turns) {
            let (curve, i) = (group[0].segment / curves.nodes, group[0].segment % curves.nodes);
            let right = turn(space, curves, [knots, start], curve, group[0].turns);
            let [here, next] = [i, i + 1]
                .map(|i| factor(k, &knots[(curve * curves.nodes + i) * 2 * k * k..][..2 * k * k]) * &right);
            segment.enter(curves, curve, i);
            let intervals =
                [intervals(&mut segment, group, &here, 1.0), intervals(&mut segment, group, &here, -1.0)];
            for s in group {
                let row = &mut out[s.row * len..][..len];
                if s.straight {
                    // A ray from an end point is horizontal.
                    turned.set(&numbers(if s.t < 0.5 { &here } else { &next }), &[1.0]);
                } else {
                    let ahead = &intervals[usize::from(s.t < 0.0)];
                    let size = s.t.abs();
                    let at = ahead.partition_point(|p| (p.from + p.length).abs() < size).min(ahead.len() - 1);
                    let Interval { from, length, coefficients } = &ahead[at];
                    turned.set(coefficients, &legendre((s.t - from) / length));
                }
                turned.apply(row);
            }
        }
    });
}

/// Subintervals of a segment after its first point (`way` = 1) or before it, as far as the samples require.
fn intervals(segment: &mut LiftedSegment, samples: &[Sample], here: &Factor, way: f64) -> Vec<Interval> {
    let (mut g, mut out) = (here.clone(), Vec::new());
    let most = samples.iter().filter(|s| !s.straight).map(|s| way * s.t).fold(-1.0, f64::max);
    let mut from = 0.0;
    while from < most || (from == 0.0 && way > 0.0) {
        segment.follow(way * from, way * (from + 1.0), 0, &mut g, &mut out);
        from += 1.0;
    }
    out
}

fn position(curves: &Curves, times: &Times, outside: Outside, first: usize, row: usize) -> Sample {
    let at = first + row;
    let (curve, i) = (at / times.count, at % times.count);
    let x = if times.x.len() == times.count { times.x[i] } else { times.x[at] };
    let t = curves.knots(curve);
    let (found, beyond) = inside(x, t, outside);
    let span = t[t.len() - 1] - t[0];
    let turns = if outside == Outside::Wrap { ((x - found) / span).round() as i32 } else { 0 };
    let k = Locator::new(t, false).find(found, 0);
    let t = (found - t[k]) / (t[k + 1] - t[k]);
    Sample { row, segment: curve * curves.nodes + k, turns, t, straight: beyond != 0.0 }
}

/// The factor from the representative of the first knot to that of the lift after given turns of a closed curve.
fn turn(space: &Erased, curves: &Curves, [knots, start]: [&[f64]; 2], curve: usize, turns: i32) -> Factor {
    let (len, k) = (space.point_len(), space.fiber_rank());
    let start = factor(k, &start[curve * 2 * k * k..][..2 * k * k]);
    if turns == 0 {
        return start;
    }
    let [p, q] = [0, curves.nodes - 1].map(|i| {
        let row = (curve * curves.nodes + i) * len;
        matrix(space, k, len, |j| curves.points[row + j])
    });
    let last = factor(k, &knots[(curve * curves.nodes + curves.nodes - 1) * 2 * k * k..][..2 * k * k]);
    let mut holonomy = matched(&p, &q) * last;
    if turns < 0 {
        holonomy = holonomy.adjoint();
    }
    unitary(holonomy.pow(turns.unsigned_abs())) * start
}

/// A factor, applied to points and vectors from the right.
struct Turned {
    k: usize,
    complex: bool,
    entries: Vec<[f64; 2]>,
}

impl Turned {
    /// The sum of coefficients times polynomials.
    fn set(&mut self, coefficients: &[f64], polynomials: &[f64]) {
        self.entries.fill([0.0; 2]);
        for (c, p) in coefficients.chunks_exact(2 * self.k * self.k).zip(polynomials) {
            for (entry, c) in self.entries.iter_mut().zip(c.as_chunks::<2>().0) {
                *entry = [c[0].mul_add(*p, entry[0]), c[1].mul_add(*p, entry[1])];
            }
        }
    }

    fn apply(&self, x: &mut [f64]) {
        let (k, g) = (self.k, &self.entries);
        let mut old = vec![[0.0; 2]; k];
        if self.complex {
            for row in x.as_chunks_mut::<2>().0.chunks_exact_mut(k) {
                old.copy_from_slice(row);
                for (j, x) in row.iter_mut().enumerate() {
                    *x = [0.0; 2];
                    for (i, [a, b]) in old.iter().enumerate() {
                        let [c, d] = g[i * k + j];
                        *x = [a * c - b * d + x[0], a * d + b * c + x[1]];
                    }
                }
            }
        } else {
            for row in x.chunks_exact_mut(k) {
                old.iter_mut().zip(&*row).for_each(|(old, x)| old[0] = *x);
                for (j, x) in row.iter_mut().enumerate() {
                    *x = (0..k).map(|i| old[i][0] * g[i * k + j][0]).sum();
                }
            }
        }
    }
}

const _: () = assert!(STAGES.is_multiple_of(LANES));
