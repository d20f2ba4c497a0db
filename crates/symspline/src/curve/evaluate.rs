//! Values and derivatives of spline curves at many times.

use super::bezier::Segment;
use super::locate::Locator;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{Dual, Jet, LANES, Lane, Scalar, gather, lane, max_or_nan, scatter};
use crate::space::Space;
use crate::with_size;
use std::ops::DerefMut;

/// Spline curves with equally many knots: the triple (t, p, u).
pub struct Curves<'a> {
    /// Knots of each curve, or of one for all.
    pub t: &'a [f64],
    /// Number of knots of a curve.
    pub nodes: usize,
    /// Points, curve after curve.
    pub points: &'a [f64],
    /// Velocities in the same layout.
    pub velocities: &'a [f64],
}

/// Times to evaluate at.
pub struct Times<'a> {
    /// The times, of each curve or of all.
    pub x: &'a [f64],
    /// Times of one curve.
    pub count: usize,
}

/// What to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// γ
    Point,
    /// γ'
    Velocity,
    /// ∇γ'
    Acceleration,
    /// |γ'|
    Speed,
    /// |∇γ'|
    Bend,
}

/// What happens at times outside the knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The last Bézier segment goes on.
    Continue,
    /// The curve goes on with constant velocity.
    Geodesic,
    /// Time wraps around.
    Wrap,
}

/// Samples evaluated by one thread at a time, at most.
const BLOCK: usize = 2048;
/// Samples times numbers from which threads pay.
const PARALLEL: usize = 1 << 16;

impl Curves<'_> {
    fn knots(&self, curve: usize) -> &[f64] {
        if self.t.len() == self.nodes {
            self.t
        } else {
            &self.t[curve * self.nodes..(curve + 1) * self.nodes]
        }
    }

    /// First and last knot of a curve.
    pub fn domain(&self, curve: usize) -> (f64, f64) {
        let t = self.knots(curve);
        (t[0], t[self.nodes - 1])
    }
}

/// Evaluates every curve at its times: `out` holds, curve by curve and time by time, a point or
/// vector, or one number for [`Quantity::Speed`] and [`Quantity::Bend`].
pub fn evaluate<M: Space>(
    space: &M,
    curves: &Curves,
    times: &Times,
    quantity: Quantity,
    outside: Outside,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let size = match quantity {
        Quantity::Speed | Quantity::Bend => 1,
        _ => space.point_len(),
    };
    let samples = out.len() / size;
    if samples == 0 {
        return;
    }
    // A table over the knots pays for itself once there are about as many times as knots.
    let shared = curves.t.len() == curves.nodes;
    let locator = shared.then(|| Locator::new(curves.t, samples > 8 && samples >= curves.nodes / 4));
    let length = parallel::block(BLOCK, space.point_len());
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(length * size).enumerate().collect();
    let parallel = samples * space.point_len() > PARALLEL;
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let locator = locator.as_ref();
        let job = Job { space, curves, times, quantity, outside, locator, first: block * length };
        match quantity {
            Quantity::Point => job.run::<Lane>(out, size),
            Quantity::Velocity | Quantity::Speed => job.run::<Dual>(out, size),
            Quantity::Acceleration | Quantity::Bend => job.run::<Jet>(out, size),
        }
        monitor.advance(out.len() / size);
    });
}

struct Job<'a, M> {
    space: &'a M,
    curves: &'a Curves<'a>,
    times: &'a Times<'a>,
    quantity: Quantity,
    outside: Outside,
    locator: Option<&'a Locator<'a>>,
    first: usize,
}

/// Where eight samples fall. It goes along the samples of a block in their order.
struct Places<'a, M> {
    job: &'a Job<'a, M>,
    /// The next sample: the i-th time of a curve.
    curve: usize,
    i: usize,
    /// Samples that are left in the block.
    left: usize,
    segment: usize,
    /// Where the data of each lane's segment begin.
    at: [usize; LANES],
    /// Times, first knots and lengths of the segments.
    x: Lane,
    knot: Lane,
    h: Lane,
    /// Times beyond the last (positive) or before the first knot.
    beyond: [f64; LANES],
    /// First and last knot of the segment, if all lanes are in the same one.
    shared: Option<[Lane; 2]>,
}

impl<'a, M: Space> Places<'a, M> {
    fn new(job: &'a Job<'a, M>, samples: usize) -> Self {
        let count = job.times.count;
        Places {
            job,
            curve: job.first / count,
            i: job.first % count,
            left: samples,
            segment: 0,
            at: [usize::MAX; LANES],
            x: Lane::ZERO,
            knot: Lane::ZERO,
            h: Lane::ONE,
            beyond: [0.0; LANES],
            shared: None,
        }
    }

    /// Goes to the next eight samples; lanes that are left over repeat the last one. Returns whether
    /// they fall in other segments than those before.
    #[inline(always)]
    fn advance(&mut self) -> bool {
        let Times { x, count } = *self.job.times;
        if let Some([from, to]) = self.shared
            && self.left >= LANES
            && self.i + LANES <= count
        {
            // Dense samples in order stay in a segment for a while.
            let row = if x.len() == count { self.i } else { self.curve * count + self.i };
            let next = Lane::new(std::array::from_fn(|l| x[row..][..LANES][l]));
            if (next.simd_ge(from) & next.simd_lt(to)).all() {
                self.x = next;
                self.step(LANES);
                return false;
            }
        }
        self.search()
    }

    #[inline(always)]
    fn step(&mut self, samples: usize) {
        self.left -= samples;
        self.i += samples;
        if self.i == self.job.times.count {
            (self.curve, self.i) = (self.curve + 1, 0);
            self.shared = None;
        }
    }

    fn search(&mut self) -> bool {
        let Job { curves, locator, outside, .. } = self.job;
        let Times { x, count } = *self.job.times;
        let len = self.job.space.point_len();
        let (mut at, mut xs, mut knots, mut ends) = (self.at, [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let mut x = if x.len() == count { x[self.i] } else { x[self.curve * count + self.i] };
            let t = curves.knots(self.curve);
            let (start, end) = (t[0], t[t.len() - 1]);
            self.beyond[l] = 0.0;
            if x < start || x > end {
                match outside {
                    Outside::Continue => {}
                    Outside::Geodesic => {
                        self.beyond[l] = if x < start { x - start } else { x - end };
                        x = x.max(start).min(end);
                    }
                    Outside::Wrap => x = (start + (x - start).rem_euclid(end - start)).max(start).min(end),
                }
            }
            let k = match locator {
                Some(locator) => locator.find(x, self.segment),
                None => Locator::new(t, false).find(x, self.segment),
            };
            self.segment = k;
            at[l] = (self.curve * curves.nodes + k) * len;
            (xs[l], knots[l], ends[l]) = (x, t[k], t[k + 1]);
            if self.left > 1 {
                self.step(1);
            }
        }
        let changed = at != self.at;
        self.at = at;
        self.x = Lane::new(xs);
        self.knot = Lane::new(knots);
        self.h = Lane::new(ends) - self.knot;
        // The next sample may be of another curve already.
        let alike = at == [at[0]; LANES] && self.beyond == [0.0; LANES] && self.i >= LANES;
        self.shared = alike.then(|| [self.knot, Lane::new(ends)]);
        changed
    }
}

impl<M: Space> Job<'_, M> {
    /// Evaluates a block of samples, eight at a time, whatever segments they fall in.
    fn run<S: Scalar>(&self, out: &mut [f64], size: usize) {
        match self.space.chart() {
            None => with_size!(M::VECTORS, self.space.point_len(), len => {
                self.run_sized::<S, M>(self.space, None, out, size, len)
            }),
            Some(chart) => {
                self.run_sized::<S, M::Chart>(&chart, Some(self.space), out, size, chart.point_len())
            }
        }
    }

    /// The same in a chart with points of `len` numbers: `curved` is the space if it is not the chart
    /// itself.
    #[inline(always)]
    fn run_sized<S: Scalar, C: Space>(
        &self,
        chart: &C,
        curved: Option<&M>,
        out: &mut [f64],
        size: usize,
        len: usize,
    ) {
        let mut segment = Segment::<S>::new(len);
        let mut gamma = vec![S::constant(Lane::ZERO); len];
        let mut vectors = vec![Lane::ZERO; 3 * len];
        let ambient = self.space.point_len();
        let mut buffer = vec![Lane::ZERO; if curved.is_some() { 4 * ambient } else { 0 }];
        let mut places = Places::new(self, out.len() / size);
        let mut rate = Lane::ONE;
        for out in out.chunks_mut(LANES * size) {
            if places.advance() {
                rate = Lane::ONE / places.h;
                match curved {
                    None => self.read(&places, len, &mut segment.ends, &mut segment.legs),
                    Some(space) => {
                        let (p, v) = buffer.split_at_mut(2 * ambient);
                        let [p0, p1] = two(p, ambient);
                        let [v0, v1] = two(v, ambient);
                        self.read(&places, ambient, &mut [&mut *p0, &mut *p1], &mut [&mut *v0, &mut *v1]);
                        let [y, z] = &mut segment.ends;
                        let [a, b] = &mut segment.legs;
                        space.enter([p0, p1], [v0, v1], [y, z], [a, b]);
                    }
                }
                segment.prepare(chart, len);
            }
            // Exactly 1 at the last knot.
            let tau = (places.x - places.knot) / places.h;
            segment.at(chart, len, S::from_parts([tau, rate, Lane::ZERO]), &mut gamma);
            if self.outside == Outside::Geodesic && places.beyond != [0.0; LANES] {
                go_straight(chart, &places, &segment, &mut gamma);
            }
            let (p, derivatives) = vectors.split_at_mut(len);
            let (d, dd) = derivatives.split_at_mut(len);
            let (d, dd) = (&mut d[..len], &mut dd[..len]);
            for (i, g) in gamma[..len].iter().enumerate() {
                [p[i], d[i], dd[i]] = g.parts();
            }
            match self.quantity {
                Quantity::Velocity | Quantity::Speed => chart.velocity(p, d),
                Quantity::Acceleration | Quantity::Bend => chart.acceleration(p, d, dd),
                Quantity::Point => {}
            }
            let vector = match self.quantity {
                Quantity::Point => None,
                Quantity::Velocity | Quantity::Speed => Some(&*d),
                Quantity::Acceleration | Quantity::Bend => Some(&*dd),
            };
            let norm = |p: &[Lane], v: &[Lane]| max_or_nan(self.space.inner(p, v, v), Lane::ZERO).sqrt();
            let lengths = matches!(self.quantity, Quantity::Speed | Quantity::Bend);
            match (curved, vector) {
                (None, Some(v)) if lengths => scatter(&[norm(p, v)], out),
                (None, vector) => scatter(vector.unwrap_or(p), out),
                (Some(space), vector) => {
                    let [point, result] = two(&mut buffer, ambient);
                    space.leave(p, vector, result);
                    if lengths {
                        space.leave(p, None, point);
                        scatter(&[norm(point, result)], out);
                    } else {
                        scatter(result, out);
                    }
                }
            }
        }
    }

    /// Gathers the ends of eight segments, and the legs there: h/3 times the velocities.
    #[inline(always)]
    fn read(
        &self,
        places: &Places<M>,
        len: usize,
        ends: &mut [impl DerefMut<Target = [Lane]>; 2],
        legs: &mut [impl DerefMut<Target = [Lane]>; 2],
    ) {
        let Places { at, h, .. } = places;
        let third = *h * lane(1.0 / 3.0);
        let (p, u) = (self.curves.points, self.curves.velocities);
        for e in 0..2 {
            gather(at.map(|i| &p[i + e * len..][..len]), &mut ends[e][..len]);
            gather(at.map(|i| &u[i + e * len..][..len]), &mut legs[e][..len]);
            legs[e].iter_mut().for_each(|u| *u *= third);
        }
    }
}

/// The first two rows of a buffer.
fn two(buffer: &mut [Lane], len: usize) -> [&mut [Lane]; 2] {
    let (a, b) = buffer.split_at_mut(len);
    [a, &mut b[..len]]
}

/// Replaces the lanes outside the knots by the geodesic that leaves the end.
#[cold]
fn go_straight<M: Space, C: Space, S: Scalar>(
    chart: &C,
    places: &Places<M>,
    segment: &Segment<S>,
    gamma: &mut [S],
) {
    let Segment { ends: [p0, p1], legs: [a, b], .. } = segment;
    let (beyond, third) = (Lane::new(places.beyond), places.h * lane(1.0 / 3.0));
    let (before, behind) = (beyond.simd_lt(Lane::ZERO), beyond.simd_gt(Lane::ZERO));
    let pick = |x: &[Lane], y: &[Lane]| -> Vec<Lane> {
        x.iter().zip(y).map(|(x, y)| before.select(*x, *y)).collect()
    };
    let velocity: Vec<Lane> = pick(a, b).iter().map(|leg| *leg / third).collect();
    let mut straight = gamma.to_vec();
    chart.ray(&pick(p0, p1), &velocity, S::from_parts([beyond, Lane::ONE, Lane::ZERO]), &mut straight);
    for (g, s) in gamma.iter_mut().zip(&straight) {
        *g = S::select(before | behind, *s, *g);
    }
}
