//! The covariant jerk ∇∇γ'.
//!
//! On a segment, the array w of the acceleration is a smooth function of time. It is interpolated at Chebyshev nodes
//! and differentiated. The acceleration is L(γ'') + Q(γ', γ') for arrays γ, with a linear map L and a quadratic form Q that
//! depend on the space and the point: the connection is symmetric. The covariant derivative of w along γ is therefore
//! L(w') + Q(γ', w), where polarisation yields Q(γ', w).

use super::chebyshev::{LEVELS, MOST, differentiate, node, sizes};
use super::data::{Curves, Job, Outside, Quantity, Times};
use super::evaluate::evaluate;
use super::locate::Locator;
use super::sample_cursor::inside;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{LANES, Lane, few, gather, lane, max_or_nan, scatter};
use crate::space::{Ambient, Erased};

/// Coefficients of the highest degrees up to this, relative to the sizes of points and vectors, are rounding errors. An
/// error of the coefficient of degree n is multiplied by n².
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Half of the interval around a sample outside the knots.
const AROUND: f64 = 0.25;
/// Maximum number of samples that one thread evaluates at a time.
const BLOCK: usize = 2048;
/// Samples times numbers from which several threads are certainly faster.
const PARALLEL: usize = 1 << 12;

/// Where a sample lies: its curve, the segment, and the position in units of it.
#[derive(Clone, Copy)]
struct Place {
    curve: usize,
    segment: usize,
    tau: f64,
    /// Whether the curve continues there as a geodesic, whose jerk is zero.
    straight: bool,
}

impl Place {
    fn new(curves: &Curves, curve: usize, x: f64, outside: Outside, hint: usize) -> Self {
        let t = curves.knots(curve);
        let (x, beyond) = inside(x, t, outside);
        let segment = Locator::new(t, false).find(x, hint);
        let tau = (x - t[segment]) / (t[segment + 1] - t[segment]);
        Place { curve, segment, tau, straight: beyond != 0.0 }
    }

    /// The segment, if an interpolation on it serves the sample.
    fn shared(&self) -> Option<(usize, usize)> {
        (0.0 <= self.tau && self.tau <= 1.0).then_some((self.curve, self.segment))
    }
}

/// Whether the highest coefficients of every column are rounding errors of entries that are as large as the given ones.
fn is_resolved(coefficients: &[Lane], entries: &[f64]) -> bool {
    coefficients.chunks(coefficients.len() / entries.len()).zip(entries).all(|(column, entry)| {
        let [most, error] = sizes(column);
        error <= ROUNDING * (entry + most)
    })
}

/// Samples that are evaluated together.
struct Block<'a> {
    space: &'a Erased<'a>,
    curves: &'a Curves<'a>,
    len: usize,
    places: Vec<Place>,
    monitor: Monitor<'a>,
}

impl Block<'_> {
    /// Accelerations at positions in segments, segment by segment.
    fn accelerations(&self, segments: &[(usize, usize)], x: &[f64]) -> Vec<f64> {
        let Block { space, curves, len, .. } = *self;
        let mut points = Vec::with_capacity(segments.len() * 2 * len);
        let [mut after, mut before] = [0, 1].map(|_| Vec::with_capacity(points.capacity()));
        for &(curve, segment) in segments {
            let t = curves.knots(curve);
            let row = (curve * curves.nodes + segment) * len;
            points.extend_from_slice(&curves.points[row..row + 2 * len]);
            for (side, velocities) in [&mut after, &mut before].into_iter().zip(curves.one_sided()) {
                side.extend(velocities[row..row + 2 * len].iter().map(|u| u * (t[segment + 1] - t[segment])));
            }
        }
        let single =
            Curves { t: &[0.0, 1.0], nodes: 2, points: &points, velocities: &after, before: &before };
        let times = Times { x, count: x.len() };
        let mut values = vec![0.0; segments.len() * x.len() * len];
        evaluate(
            space,
            &single,
            &times,
            Quantity::Acceleration,
            Outside::Continue,
            &self.monitor,
            &mut values,
        );
        values
    }

    /// The sizes of the numbers from which the entries of accelerations are computed.
    fn entries(&self, (curve, segment): (usize, usize)) -> Vec<f64> {
        let Block { curves, len, .. } = *self;
        let (t, row) = (curves.knots(curve), (curve * curves.nodes + segment) * len);
        let h = t[segment + 1] - t[segment];
        let [after, before] = curves.one_sided();
        let size = |i: usize| {
            let next = i + len;
            curves.points[i].abs().max(curves.points[next].abs()) + h * after[i].abs().max(before[next].abs())
        };
        (row..row + len).map(size).collect()
    }

    /// The coefficients of the accelerations on segments.
    fn interpolated(&self, segments: &[(usize, usize)]) -> Vec<Vec<Lane>> {
        let row = (MOST + 1) * self.len;
        let mut values = vec![0.0; segments.len() * row];
        let mut coefficients = vec![Vec::new(); segments.len()];
        let entries: Vec<Vec<f64>> = segments.iter().map(|segment| self.entries(*segment)).collect();
        let mut rough: Vec<usize> = (0..segments.len()).collect();
        for level in &*LEVELS {
            let nodes: Vec<usize> = level.new_nodes().collect();
            let some: Vec<(usize, usize)> = rough.iter().map(|&i| segments[i]).collect();
            let more = self.accelerations(&some, &nodes.iter().map(|&k| node(k)).collect::<Vec<_>>());
            for (&i, more) in rough.iter().zip(more.chunks(nodes.len() * self.len)) {
                let values = &mut values[i * row..(i + 1) * row];
                for (k, value) in nodes.iter().zip(more.chunks(self.len)) {
                    values[k * self.len..][..self.len].copy_from_slice(value);
                }
                coefficients[i] = level.coefficients(values, self.len);
            }
            rough.retain(|&i| !is_resolved(&coefficients[i], &entries[i]));
        }
        coefficients
    }

    /// The derivatives of the arrays of accelerations, in units of the segments.
    fn derivatives(&self) -> Vec<f64> {
        let len = self.len;
        let mut out = vec![0.0; self.places.len() * len];
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        order.sort_by_key(|&i| self.places[i].shared());
        let (beyond, within) = order.split_at(order.partition_point(|&i| self.places[i].shared().is_none()));
        let [.., last] = &*LEVELS;
        for &i in beyond {
            let Place { curve, segment, tau, straight } = self.places[i];
            if !straight {
                let x: Vec<f64> = (0..=MOST).map(|k| tau + (2.0 * node(k) - 1.0) * AROUND).collect();
                let coefficients = last.coefficients(&self.accelerations(&[(curve, segment)], &x), len);
                let derivative = &mut out[i * len..][..len];
                differentiate(&coefficients, 0.5, derivative);
                derivative.iter_mut().for_each(|x| *x /= 2.0 * AROUND);
            }
        }
        let groups: Vec<&[usize]> =
            within.chunk_by(|&i, &j| self.places[i].shared() == self.places[j].shared()).collect();
        let segments: Vec<(usize, usize)> =
            groups.iter().filter_map(|group| self.places[group[0]].shared()).collect();
        for (group, coefficients) in groups.into_iter().zip(self.interpolated(&segments)) {
            group.iter().for_each(|&i| {
                differentiate(&coefficients, self.places[i].tau, &mut out[i * len..][..len]);
            });
        }
        out
    }

    /// The jerk at every place, given states: points, derivatives of their arrays, and accelerations.
    fn write(&self, states: &[f64], out: &mut [f64]) {
        let len = self.len;
        let derivatives = self.derivatives();
        let mut lanes = vec![Lane::ZERO; 3 * len];
        let [mut jerk, mut result] = [(); 2].map(|()| vec![Lane::ZERO; len]);
        let mut connection = Connection::new(len);
        for (k, out) in out.chunks_mut(LANES * len).enumerate() {
            let at: [usize; LANES] = few(|l| (k * LANES + l).min(self.places.len() - 1));
            gather(at.map(|i| &states[i * 3 * len..][..3 * len]), &mut lanes);
            gather(at.map(|i| &derivatives[i * len..][..len]), &mut jerk);
            let (p, vectors) = lanes.split_at(len);
            let (d, w) = vectors.split_at(len);
            let rate = Lane::new(at.map(|i| {
                let (t, segment) = (self.curves.knots(self.places[i].curve), self.places[i].segment);
                1.0 / (t[segment + 1] - t[segment])
            }));
            jerk.iter_mut().for_each(|x| *x *= rate * rate * rate);
            let curved = Lane::new(at.map(|i| if self.places[i].straight { 0.0 } else { 1.0 }));
            connection.along(self.space, p, d, w, &jerk, &mut result);
            result.iter_mut().for_each(|x| *x *= curved);
            scatter(&result, out);
        }
    }
}

/// L(w') + Q(γ', w), the covariant derivative of a vector field along a curve, from arrays; and memory for it.
pub struct Connection {
    zero: Vec<Lane>,
    sum: Vec<Lane>,
    form: Vec<Lane>,
}

impl Connection {
    /// For arrays of `len` numbers.
    pub fn new(len: usize) -> Self {
        let zeros = || vec![Lane::ZERO; len];
        Connection { zero: zeros(), sum: zeros(), form: zeros() }
    }

    /// The derivative of w, whose array has the derivative `slope`, along a curve with the derivative d.
    pub fn along(
        &mut self,
        space: &Erased,
        p: &[Lane],
        d: &[Lane],
        w: &[Lane],
        slope: &[Lane],
        out: &mut [Lane],
    ) {
        out.copy_from_slice(slope);
        self.linear(space, p, out);
        self.add_form(space, p, d, w, out);
    }

    /// L of an array.
    pub fn linear(&self, space: &Erased, p: &[Lane], out: &mut [Lane]) {
        space.acceleration(p, &self.zero, out);
    }

    /// Adds Q(d, w). The form is computed from vectors of equal size.
    pub fn add_form(&mut self, space: &Erased, p: &[Lane], d: &[Lane], w: &[Lane], out: &mut [Lane]) {
        let [(a, by_a), (b, by_b)] = [d, w].map(size);
        for sign in [1.0, -1.0] {
            for (sum, (u, v)) in self.sum.iter_mut().zip(d.iter().zip(w)) {
                *sum = (*v * by_b).mul_add(lane(sign), *u * by_a);
            }
            self.form.fill(Lane::ZERO);
            space.acceleration(p, &self.sum, &mut self.form);
            let size = a * b * lane(0.25 * sign);
            out.iter_mut().zip(&self.form).for_each(|(out, x)| *out = x.mul_add(size, *out));
        }
    }
}

/// The largest absolute value of some numbers and its reciprocal; 1 where that overflows.
fn size(v: &[Lane]) -> (Lane, Lane) {
    let largest = v.iter().fold(Lane::ZERO, |most, v| max_or_nan(most, v.abs()));
    let size = largest.simd_lt(lane(f64::MIN_POSITIVE)).select(Lane::ONE, largest);
    (size, Lane::ONE / size)
}

/// The jerk of every curve at its times, as in [`evaluate`](super::evaluate()). At a knot it is that of the segment
/// after it.
pub fn jerk(
    space: &Erased,
    curves: &Curves,
    times: &Times,
    outside: Outside,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let len = space.point_len();
    let (block, parallel) = (parallel::block(BLOCK, len), out.len() > PARALLEL);
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(block * len).enumerate().collect();
    parallel::for_each(blocks, parallel, monitor, |(k, out)| {
        let (first, samples) = (k * block, out.len() / len);
        let mut hint = 0;
        let places: Vec<Place> = (first..first + samples)
            .map(|sample| {
                let (curve, i) = (sample / times.count, sample % times.count);
                let x = if times.x.len() == times.count { times.x[i] } else { times.x[sample] };
                let place = Place::new(curves, curve, x, outside, hint);
                hint = place.segment;
                place
            })
            .collect();
        let (quantity, size) = (Quantity::Jet, Quantity::Jet.len(space));
        let job =
            Job { curves, times, quantity, outside, locator: None, first, apart: 1, size, len, last: None };
        let mut states = vec![0.0; samples * size];
        space.0.samples(&job, &mut states);
        // The monitor counts samples, and nodes are none.
        let go_on = |_| !monitor.poll();
        let together = Block { space, curves, len, places, monitor: Monitor::new(&go_on) };
        together.write(&states, out);
        monitor.advance(samples);
    });
}
