//! B-spline curves by de Boor's algorithm with geodesics in place of straight lines.
//!
//! A Bézier curve of degree d is the B-spline on the knots 0, …, 0, 1, …, 1 (d + 1 of each), for which de
//! Boor's algorithm is de Casteljau's.

use super::cumulative::Factors;
use super::data::{BSpline, Quantity};
use crate::monitor::{Monitor, checkpoint};
use crate::parallel;
use crate::scalar::{Dual, Jet, LANES, Lane, Scalar, few, gather, max_or_nan, scatter};
use crate::space::{Ambient, Erased, Frame, Origin};

/// Maximum number of samples that one thread evaluates at a time.
const BLOCK: usize = 512;
/// SampleBlock times numbers from which several threads are certainly faster.
const PARALLEL: usize = 1 << 14;

/// Evaluates every curve at all times x: points or vectors, curve by curve and time by time.
pub fn evaluate_bspline(
    space: &Erased,
    curve: &BSpline,
    x: &[f64],
    quantity: Quantity,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let size = quantity.len(space);
    let parallel = out.len() / size * space.point_len() * curve.degree.max(1) > PARALLEL;
    let length = parallel::block(BLOCK, space.point_len());
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(length * size).enumerate().collect();
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let first = block * length;
        match quantity.order() {
            0 => SampleBlock::<Lane>::new(space, curve).write(x, first, quantity, out),
            1 => SampleBlock::<Dual>::new(space, curve).write(x, first, quantity, out),
            _ => SampleBlock::<Jet>::new(space, curve).write(x, first, quantity, out),
        }
        monitor.advance(out.len() / size);
    });
}

/// SampleBlock of curves, one per lane, and memory for them.
struct SampleBlock<'a, S> {
    space: &'a Erased<'a>,
    curve: &'a BSpline<'a>,
    /// The points of de Boor's algorithm; of a cumulative B-spline the first one only.
    points: Vec<Vec<S>>,
    next: Vec<S>,
    factors: Option<Factors<S>>,
    row: Vec<Lane>,
    parts: [Vec<Lane>; 3],
    frame: Vec<Lane>,
    body: Vec<Lane>,
}

impl<'a, S: Scalar> SampleBlock<'a, S> {
    fn new(space: &'a Erased<'a>, curve: &'a BSpline<'a>) -> Self {
        let len = space.point_len();
        let factors = (!curve.steps.is_empty()).then(|| Factors::new(space, curve.degree));
        let points = if factors.is_some() { 1 } else { curve.degree + 1 };
        let (zeros, lanes) = (|| vec![S::constant(Lane::ZERO); len], |n: usize| vec![Lane::ZERO; n]);
        let (parts, frame) = ([(); 3].map(|()| lanes(len)), lanes(space.frame_len()));
        let points = (0..points).map(|_| zeros()).collect();
        let (row, body) = (lanes(len), lanes(space.dim()));
        SampleBlock { space, curve, points, next: zeros(), factors, row, parts, frame, body }
    }

    /// Writes consecutive samples: times x of one curve after another.
    fn write(&mut self, x: &[f64], first: usize, quantity: Quantity, out: &mut [f64]) {
        let size = quantity.len(self.space);
        let samples = out.len() / size;
        let mut last = self.curve.degree;
        for (group, out) in out.chunks_mut(LANES * size).enumerate() {
            let at: [usize; LANES] = few(|l| first + (group * LANES + l).min(samples - 1));
            let times = at.map(|i| x[i % x.len()]);
            let interval = few(|l| {
                last = self.curve.interval_near(times[l], last);
                last
            });
            self.points(at.map(|i| i / x.len()), interval, times);
            self.finish(quantity, out);
        }
    }

    /// The points of a sample per lane, in any intervals of any curves.
    fn points(&mut self, curves: [usize; LANES], interval: [usize; LANES], times: [f64; LANES]) {
        let (space, curve) = (self.space, self.curve);
        let (len, degree, t) = (space.point_len(), curve.degree, curve.knots);
        for (j, point) in self.points.iter_mut().enumerate() {
            let row = |l: usize| (curves[l] * curve.count() + interval[l] - degree + j) * len;
            gather(few(|l| &curve.control[row(l)..][..len]), &mut self.row);
            point.iter_mut().zip(&self.row).for_each(|(x, &row)| *x = S::constant(row));
        }
        if let Some(factors) = &mut self.factors {
            return factors.evaluate(space, curve, curves, interval, times, &mut self.points[0]);
        }
        for r in 1..=degree {
            checkpoint();
            for j in (r..=degree).rev() {
                let from = Lane::new(few(|l| t[interval[l] + j - degree]));
                let to = Lane::new(few(|l| t[interval[l] + j + 1 - r]));
                let rate = Lane::ONE / (to - from);
                let alpha = S::from_parts([(Lane::new(times) - from) / (to - from), rate, Lane::ZERO]);
                space.geodesic(&self.points[j - 1], &self.points[j], alpha, &mut self.next);
                self.points[j].copy_from_slice(&self.next);
            }
        }
    }

    /// Writes the quantity of the last points.
    fn finish(&mut self, quantity: Quantity, out: &mut [f64]) {
        let space = self.space;
        let [p, d, dd] = &mut self.parts;
        if let Some(gamma) = self.points.last() {
            for (i, x) in gamma.iter().enumerate() {
                [p[i], d[i], dd[i]] = x.parts();
            }
        }
        let vector = match quantity.order() {
            0 => return scatter(p, out),
            1 => {
                space.velocity(p, d);
                d
            }
            _ => {
                space.acceleration(p, d, dd);
                dd
            }
        };
        if quantity.is_length() {
            scatter(&[max_or_nan(space.inner(p, vector, vector), Lane::ZERO).sqrt()], out);
        } else if quantity.is_of_body() {
            // A frame of a group at its identity is the same at every point.
            space.lift(p, &mut self.frame);
            space.coordinates(&self.frame, p, vector, &mut self.body);
            scatter(&self.body, out);
        } else {
            scatter(vector, out);
        }
    }
}
