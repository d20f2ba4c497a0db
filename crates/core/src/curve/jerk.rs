//! The covariant jerk ∇∇γ'.
//!
//! On half a segment the array w of the acceleration is a smooth function of time. It is interpolated at Chebyshev nodes
//! and differentiated. The acceleration is L(γ'') + Q(γ', γ') for arrays γ, with a linear map L and a quadratic form Q that
//! depend on the space and the point: the connection is symmetric. The covariant derivative of w along γ is therefore
//! L(w') + Q(γ', w), where polarisation yields Q(γ', w).

use super::bezier::Segment;
use super::data::{Curves, Outside, Times};
use super::evaluate::scaled_down;
use super::locate::Locator;
use super::sample_cursor::inside;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{Jet, LANES, Lane, Scalar, few, lane, scatter};
use crate::space::{Ambient, Erased};
use std::f64::consts::PI;

/// Chebyshev nodes of half a segment.
const NODES: usize = 16;
const GROUPS: usize = NODES / LANES;
/// Maximum number of samples that one thread evaluates at a time.
const BLOCK: usize = 2048;
/// Samples times numbers from which several threads are certainly faster.
const PARALLEL: usize = 1 << 12;

/// Where a sample lies: its curve, segment and position in it, and the start of the half segment around it. Times and
/// lengths are in units of the segment.
#[derive(Clone, Copy)]
struct Place {
    curve: usize,
    segment: usize,
    tau: f64,
    start: f64,
    /// Whether the curve continues there as a geodesic, whose jerk is zero.
    straight: bool,
}

impl Place {
    fn new(curves: &Curves, curve: usize, x: f64, outside: Outside, hint: usize) -> Self {
        let t = curves.knots(curve);
        let (found, beyond) = inside(x, t, outside);
        let segment = Locator::new(t, false).find(found, hint);
        let tau = (found - t[segment]) / (t[segment + 1] - t[segment]);
        let start = match tau {
            _ if tau > 1.0 => tau,
            _ if tau < 0.0 => tau - 0.5,
            _ if tau < 0.5 => 0.0,
            _ => 0.5,
        };
        Place { curve, segment, tau, start, straight: beyond != 0.0 }
    }

    fn is_beside(&self, other: &Place) -> bool {
        (self.curve, self.segment) == (other.curve, other.segment) && self.start == other.start
    }
}

/// Half a segment: the Chebyshev coefficients of the array of its acceleration.
struct Half<'a> {
    space: &'a Erased<'a>,
    curves: &'a Curves<'a>,
    /// The Chebyshev polynomials at the nodes, which are those of order one.
    cosines: [[Lane; GROUPS]; NODES],
    segment: Segment<Jet>,
    gamma: Vec<Jet>,
    coefficients: Vec<f64>,
}

impl<'a> Half<'a> {
    fn new(space: &'a Erased<'a>, curves: &'a Curves<'a>) -> Self {
        let len = space.point_len();
        Half {
            space,
            curves,
            cosines: few(|n| {
                let cosine = |k: usize| (PI * n as f64 * (k as f64 + 0.5) / NODES as f64).cos();
                few(|g| Lane::new(few(|l| cosine(g * LANES + l))))
            }),
            segment: Segment::new(len),
            gamma: vec![Jet::constant(Lane::ZERO); len],
            coefficients: vec![0.0; NODES * len],
        }
    }

    /// Points, first derivatives of their arrays, and accelerations at eight positions.
    fn at(&mut self, tau: Lane) -> [Vec<Lane>; 3] {
        self.segment.at(
            self.space,
            self.gamma.len(),
            Jet { v: tau, d: Lane::ONE, dd: Lane::ZERO },
            &mut self.gamma,
        );
        let [p, d, mut dd] =
            [0, 1, 2].map(|order| self.gamma.iter().map(|x| x.parts()[order]).collect::<Vec<_>>());
        self.space.acceleration(&p, &d, &mut dd);
        [p, d, dd]
    }

    fn enter(&mut self, place: &Place) {
        let len = self.gamma.len();
        self.segment.read(self.curves, place.curve, place.segment, len);
        self.segment.prepare(self.space, len);
        let accelerations = self.cosines[1].map(|y| {
            let [_, _, w] = self.at(lane(place.start) + (y + Lane::ONE) * lane(0.25));
            w
        });
        for (row, cosines) in self.coefficients.chunks_mut(len).zip(&self.cosines) {
            for (j, c) in row.iter_mut().enumerate() {
                let sum = (0..GROUPS).fold(Lane::ZERO, |sum, g| accelerations[g][j].mul_add(cosines[g], sum));
                *c = 2.0 / NODES as f64 * sum.reduce_add();
            }
        }
    }

    /// The derivatives of the array of the acceleration at eight positions: Σ n cₙ Uₙ₋₁.
    fn derivatives(&self, tau: Lane, start: f64) -> Vec<Lane> {
        let len = self.gamma.len();
        let y = (tau - lane(start)) * lane(4.0) - Lane::ONE;
        let (mut before, mut u) = (Lane::ZERO, Lane::ONE);
        let mut sum = vec![Lane::ZERO; len];
        for (n, row) in self.coefficients.chunks(len).enumerate().skip(1) {
            let weight = u * lane(4.0 * n as f64);
            sum.iter_mut().zip(row).for_each(|(sum, c)| *sum = weight.mul_add(lane(*c), *sum));
            (before, u) = (u, (y + y).mul_sub(u, before));
        }
        sum
    }

    /// The jerk at up to eight places in this half segment, row by row.
    fn write(&mut self, places: &[Place], out: &mut [f64]) {
        let t = self.curves.knots(places[0].curve);
        let rate = 1.0 / (t[places[0].segment + 1] - t[places[0].segment]);
        let at: [&Place; LANES] = few(|l| &places[l.min(places.len() - 1)]);
        let tau = Lane::new(few(|l| at[l].tau));
        let [p, d, w] = self.at(tau);
        let mut jerk = self.derivatives(tau, places[0].start);
        self.space.acceleration(&p, &vec![Lane::ZERO; p.len()], &mut jerk);
        let form = self.polarised(&p, &d, &w);
        let cube = Lane::new(few(|l| if at[l].straight { 0.0 } else { 1.0 })) * lane(rate * rate * rate);
        jerk.iter_mut().zip(&form).for_each(|(jerk, form)| *jerk = (*jerk + *form) * cube);
        scatter(&jerk, out);
    }

    /// Q(d, w), from vectors of equal size.
    fn polarised(&self, p: &[Lane], d: &[Lane], w: &[Lane]) -> Vec<Lane> {
        let ((u, a), (v, b)) = (scaled_down(d), scaled_down(w));
        let form = |sign: f64| {
            let sum: Vec<Lane> = u.iter().zip(&v).map(|(u, v)| v.mul_add(lane(sign), *u)).collect();
            let mut form = vec![Lane::ZERO; p.len()];
            self.space.acceleration(p, &sum, &mut form);
            form
        };
        let size = a * b * lane(0.25);
        form(1.0).iter().zip(form(-1.0)).map(|(plus, minus)| (*plus - minus) * size).collect()
    }
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
    let parallel = out.len() > PARALLEL;
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(BLOCK * len).enumerate().collect();
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let mut half = Half::new(space, curves);
        let mut hint = 0;
        let samples = out.len() / len;
        let places: Vec<Place> = (block * BLOCK..block * BLOCK + samples)
            .map(|sample| {
                let (curve, i) = (sample / times.count, sample % times.count);
                let x = if times.x.len() == times.count { times.x[i] } else { times.x[sample] };
                let place = Place::new(curves, curve, x, outside, hint);
                hint = place.segment;
                place
            })
            .collect();
        let mut rest = out;
        for group in places.chunk_by(|a, b| a.is_beside(b)) {
            if monitor.poll() {
                return;
            }
            half.enter(&group[0]);
            for places in group.chunks(LANES) {
                let (rows, others) = rest.split_at_mut(places.len() * len);
                half.write(places, rows);
                rest = others;
            }
            monitor.advance(group.len());
        }
    });
}
