//! Values and derivatives of spline curves at many times.

use super::bezier::Segment;
use super::locate::Locator;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{Dual, Jet, LANES, Lane, Scalar, gather, lane, max_or_nan, scatter};
use crate::space::Space;
use crate::with_size;

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

/// Samples evaluated by one thread at a time.
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
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(BLOCK * size).enumerate().collect();
    let parallel = samples * space.point_len() > PARALLEL;
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        let locator = locator.as_ref();
        let job = Job { space, curves, times, quantity, outside, locator, first: block * BLOCK };
        match quantity {
            Quantity::Point => job.run::<Lane>(out, size),
            Quantity::Velocity | Quantity::Speed => job.run::<Dual>(out, size),
            Quantity::Acceleration | Quantity::Bend => job.run::<Jet>(out, size),
        }
        monitor.advance(out.len() / size);
    });
}

/// A scalar that carries derivatives in t.
trait Derivatives: Scalar {
    /// Time in units of a segment, and by how much it grows a unit of time.
    fn time(t: Lane, rate: Lane) -> Self;
    fn first(self) -> Lane;
    fn second(self) -> Lane;
}

impl Derivatives for Lane {
    #[inline(always)]
    fn time(t: Lane, _rate: Lane) -> Self {
        t
    }
    #[inline(always)]
    fn first(self) -> Lane {
        Lane::ZERO
    }
    #[inline(always)]
    fn second(self) -> Lane {
        Lane::ZERO
    }
}

impl Derivatives for Dual {
    #[inline(always)]
    fn time(t: Lane, rate: Lane) -> Self {
        Dual { v: t, d: rate }
    }
    #[inline(always)]
    fn first(self) -> Lane {
        self.d
    }
    #[inline(always)]
    fn second(self) -> Lane {
        Lane::ZERO
    }
}

impl Derivatives for Jet {
    #[inline(always)]
    fn time(t: Lane, rate: Lane) -> Self {
        Jet { v: t, d: rate, dd: Lane::ZERO }
    }
    #[inline(always)]
    fn first(self) -> Lane {
        self.d
    }
    #[inline(always)]
    fn second(self) -> Lane {
        self.dd
    }
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

/// Where one sample falls.
#[derive(Clone, Copy, Default)]
struct Place {
    curve: usize,
    segment: usize,
    h: f64,
    /// Time in units of the segment.
    tau: f64,
    /// Time beyond the last (positive) or before the first knot.
    beyond: f64,
}

impl<M: Space> Job<'_, M> {
    /// Where a sample falls: the i-th time of a curve.
    #[inline(always)]
    fn place(&self, curve: usize, i: usize, hint: usize) -> Place {
        let Times { x, count } = *self.times;
        let mut x = if x.len() == count { x[i] } else { x[curve * count + i] };
        let t = self.curves.knots(curve);
        let (start, end) = (t[0], t[t.len() - 1]);
        let mut beyond = 0.0;
        if x < start || x > end {
            match self.outside {
                Outside::Continue => {}
                Outside::Geodesic => {
                    beyond = if x < start { x - start } else { x - end };
                    x = x.max(start).min(end);
                }
                Outside::Wrap => x = (start + (x - start).rem_euclid(end - start)).max(start).min(end),
            }
        }
        let k = match self.locator {
            Some(locator) => locator.find(x, hint),
            None => Locator::new(t, false).find(x, hint),
        };
        let h = t[k + 1] - t[k];
        // Exactly 1 at the last knot.
        let tau = if x == t[k + 1] { 1.0 } else { (x - t[k]) / h };
        Place { curve, segment: k, h, tau, beyond }
    }

    /// Evaluates a block of samples, eight at a time, whatever segments they fall in.
    fn run<S: Derivatives>(&self, out: &mut [f64], size: usize) {
        with_size!(self.space.point_len(), len => self.run_sized::<S>(out, size, len));
    }

    #[inline(always)]
    fn run_sized<S: Derivatives>(&self, out: &mut [f64], size: usize, len: usize) {
        let (space, curves) = (self.space, self.curves);
        let mut segment = Segment::<S>::new(len);
        let mut gamma = vec![S::constant(Lane::ZERO); len];
        let mut vectors = vec![Lane::ZERO; 3 * len];
        let mut left = out.len() / size;
        let (mut curve, mut i) = (self.first / self.times.count, self.first % self.times.count);
        let mut places = [Place::default(); LANES];
        let mut loaded = [usize::MAX; LANES];
        let (mut h, mut rate) = (Lane::ONE, Lane::ONE);
        for out in out.chunks_mut(LANES * size) {
            let mut hint = places[LANES - 1].segment;
            for place in &mut places {
                *place = self.place(curve, i, hint);
                hint = place.segment;
                // Lanes that are left over repeat the last sample.
                if left > 1 {
                    left -= 1;
                    i += 1;
                    if i == self.times.count {
                        (curve, i) = (curve + 1, 0);
                    }
                }
            }
            let at = places.map(|p| (p.curve * curves.nodes + p.segment) * len);
            // Dense samples often fall in the segments of the samples before.
            if at != loaded {
                loaded = at;
                h = Lane::new(places.map(|p| p.h));
                rate = Lane::ONE / h;
                let third = h * lane(1.0 / 3.0);
                let Segment { ends: [p0, p1], legs: [a, b], .. } = &mut segment;
                let (p, u) = (curves.points, curves.velocities);
                gather(at.map(|i| &p[i..][..len]), &mut p0[..len]);
                gather(at.map(|i| &p[i + len..][..len]), &mut p1[..len]);
                gather(at.map(|i| &u[i..][..len]), &mut a[..len]);
                gather(at.map(|i| &u[i + len..][..len]), &mut b[..len]);
                a.iter_mut().chain(b).for_each(|u| *u *= third);
                segment.prepare(space, len);
            }
            let tau = Lane::new(places.map(|p| p.tau));
            segment.at(space, len, S::time(tau, rate), &mut gamma);
            if self.outside == Outside::Geodesic && places.iter().any(|p| p.beyond != 0.0) {
                self.go_straight(&places, h * lane(1.0 / 3.0), &segment, &mut gamma);
            }
            let (p, derivatives) = vectors.split_at_mut(len);
            let (d, dd) = derivatives.split_at_mut(len);
            let (d, dd) = (&mut d[..len], &mut dd[..len]);
            for (i, g) in gamma[..len].iter().enumerate() {
                (p[i], d[i], dd[i]) = (g.value(), g.first(), g.second());
            }
            let norm = |v: &[Lane]| max_or_nan(space.inner(p, v, v), Lane::ZERO).sqrt();
            match self.quantity {
                Quantity::Velocity | Quantity::Speed => space.velocity(p, d),
                Quantity::Acceleration | Quantity::Bend => space.acceleration(p, d, dd),
                Quantity::Point => {}
            }
            match self.quantity {
                Quantity::Point => scatter(p, out),
                Quantity::Velocity => scatter(d, out),
                Quantity::Acceleration => scatter(dd, out),
                Quantity::Speed => scatter(&[norm(d)], out),
                Quantity::Bend => scatter(&[norm(dd)], out),
            }
        }
    }

    /// Replaces the lanes outside the knots by the geodesic that leaves the end.
    #[cold]
    fn go_straight<S: Derivatives>(
        &self,
        places: &[Place; LANES],
        third: Lane,
        segment: &Segment<S>,
        gamma: &mut [S],
    ) {
        let Segment { ends: [p0, p1], legs: [a, b], .. } = segment;
        let beyond = Lane::new(places.map(|p| p.beyond));
        let (before, behind) = (beyond.simd_lt(Lane::ZERO), beyond.simd_gt(Lane::ZERO));
        let pick = |x: &[Lane], y: &[Lane]| -> Vec<Lane> {
            x.iter().zip(y).map(|(x, y)| before.select(*x, *y)).collect()
        };
        let velocity: Vec<Lane> = pick(a, b).iter().map(|leg| *leg / third).collect();
        let mut straight = gamma.to_vec();
        self.space.ray(&pick(p0, p1), &velocity, S::time(beyond, Lane::ONE), &mut straight);
        for (g, s) in gamma.iter_mut().zip(&straight) {
            *g = S::select(before | behind, *s, *g);
        }
    }
}
