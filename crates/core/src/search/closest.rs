//! The nearest points of curves, by bounds from the arc length and minima of the squared distance.

use super::roots::{Bracket, roots};

/// Intervals at which the search begins.
const COARSE: usize = 64;
/// Intervals that are divided in one call, which bounds the memory of the search.
const MOST: usize = 1 << 16;
/// Rounds in which intervals between samples are divided further.
const ROUNDS: usize = 8;
/// Largest part of the depth of a minimum by which its estimate from a cubic polynomial can be too high.
const MARGIN: f64 = 0.25;

/// Samples of curves, with equal numbers for all curves.
#[derive(Clone, Copy)]
pub struct TimeSamples<'a> {
    /// Number of samples per curve.
    pub count: usize,
    /// Increasing times, curve after curve; between two of them, the squared distance from a point is close to a cubic
    /// polynomial. They include all times at which the velocity jumps.
    pub times: &'a [f64],
    /// Arc lengths up to these times.
    pub lengths: &'a [f64],
}

/// Distances between curves and points, the targets.
pub trait Distances {
    /// An error stops the search.
    type Error;
    /// The distances between targets and samples of their curves.
    fn of_samples(&mut self, target: &[usize], number: &[usize]) -> Result<Vec<f64>, Self::Error>;
    /// The distances d between targets and points of their curves, and the derivatives of d²/2, which are −⟨log q, γ'⟩;
    /// they are NaN where there is no logarithm. Targets do not decrease.
    fn at(&mut self, target: &[usize], x: &[f64]) -> Result<[Vec<f64>; 2], Self::Error>;
}

/// The nearest point of a curve.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Its time.
    pub time: f64,
    /// Its distance.
    pub distance: f64,
}

/// Finds the nearest points to the targets `first`, `first + 1`, ..., which belong to some curves, in increasing order.
///
/// Let `d` and `d'` be the distances of a point from two samples, and `L` the length of the curve between these. By the
/// triangle inequality the distance from the curve between them is at least `(d + d' − L)/2`. Intervals in which this
/// bound is not below the distance from another sample are excluded, and the others are bisected down to single
/// intervals between samples. There, minima are roots of the derivative of the squared distance.
pub fn closest<D: Distances>(
    samples: TimeSamples,
    first: usize,
    curve: &[usize],
    distances: &mut D,
) -> Result<Vec<Nearest>, D::Error> {
    let found = curve
        .iter()
        .map(|c| Nearest { time: samples.times[c * samples.count], distance: f64::INFINITY })
        .collect();
    let mut search = Search { samples, first, curve, distances, found };
    search.run()?;
    Ok(search.found)
}

/// Samples of a curve between which the nearest point can be.
#[derive(Clone, Copy)]
struct Between {
    target: usize,
    /// Numbers of the samples.
    ends: [usize; 2],
    /// Distances from these.
    distances: [f64; 2],
}

/// An interval of time in which the nearest point can be.
#[derive(Clone, Copy)]
struct Interval {
    target: usize,
    ends: [f64; 2],
    distances: [f64; 2],
    /// Derivatives of d²/2 after the start and before the end.
    slopes: [f64; 2],
    /// An upper bound of the arc length.
    length: f64,
}

struct Search<'a, D> {
    samples: TimeSamples<'a>,
    first: usize,
    curve: &'a [usize],
    distances: &'a mut D,
    found: Vec<Nearest>,
}

impl<D: Distances> Search<'_, D> {
    fn run(&mut self) -> Result<(), D::Error> {
        let mut stack = vec![self.coarse()?];
        while let Some((stride, mut own)) = stack.pop() {
            own.retain(|i| self.is_open(i.target, i.distances, self.length(i.target, i.ends)));
            if own.len() > MOST {
                let rest = own.split_off(own.len() / 2);
                stack.extend([(stride, rest), (stride, own)]);
            } else if stride > 1 {
                stack.push((stride / 2, self.halves(&own, stride / 2)?));
            } else {
                self.in_intervals(&own)?;
            }
        }
        Ok(())
    }

    /// Few intervals that cover the curves, for all targets, and the number of samples from one to the next.
    fn coarse(&mut self) -> Result<(usize, Vec<Between>), D::Error> {
        let count = self.samples.count - 1;
        let stride = count.div_ceil(COARSE).next_power_of_two();
        let edges: Vec<usize> = (0..count).step_by(stride).chain([count]).collect();
        let targets = self.first..self.first + self.curve.len();
        let target: Vec<usize> = targets.clone().flat_map(|i| edges.iter().map(move |_| i)).collect();
        let number: Vec<usize> = targets.clone().flat_map(|_| edges.iter().copied()).collect();
        let distances = self.of_samples(&target, &number)?;
        let own = targets.zip(distances.chunks(edges.len()));
        let each = own.flat_map(|(target, d)| {
            (1..edges.len()).map({
                let edges = &edges;
                move |k| Between { target, ends: [edges[k - 1], edges[k]], distances: [d[k - 1], d[k]] }
            })
        });
        Ok((stride, each.collect()))
    }

    /// Divides intervals after `stride` samples. The last one of a curve can be shorter, and is kept whole.
    fn halves(&mut self, own: &[Between], stride: usize) -> Result<Vec<Between>, D::Error> {
        let long: Vec<&Between> = own.iter().filter(|i| i.ends[0] + stride < i.ends[1]).collect();
        let target: Vec<usize> = long.iter().map(|i| i.target).collect();
        let middle: Vec<usize> = long.iter().map(|i| i.ends[0] + stride).collect();
        let mut distances = self.of_samples(&target, &middle)?.into_iter();
        let mut halves = Vec::with_capacity(2 * own.len());
        for &i in own {
            let [start, stop] = i.ends;
            let middle = start + stride;
            if middle >= stop {
                halves.push(i);
                continue;
            }
            let d = distances.next().unwrap_or(f64::NAN);
            halves.push(Between { ends: [start, middle], distances: [i.distances[0], d], ..i });
            halves.push(Between { ends: [middle, stop], distances: [d, i.distances[1]], ..i });
        }
        Ok(halves)
    }

    /// The distances between targets and samples.
    fn of_samples(&mut self, target: &[usize], number: &[usize]) -> Result<Vec<f64>, D::Error> {
        let distances = self.distances.of_samples(target, number)?;
        for ((&target, &number), &distance) in target.iter().zip(number).zip(&distances) {
            self.improve(target, self.time(target, number), distance);
        }
        Ok(distances)
    }

    fn time(&self, target: usize, number: usize) -> f64 {
        self.samples.times[self.curve[target - self.first] * self.samples.count + number]
    }

    fn length(&self, target: usize, [start, stop]: [usize; 2]) -> f64 {
        let own = &self.samples.lengths[self.curve[target - self.first] * self.samples.count..];
        own[stop] - own[start]
    }

    /// Whether the curve can be nearer in an interval with these distances at its ends. Unknown distances can be.
    fn is_open(&self, target: usize, [d, e]: [f64; 2], length: f64) -> bool {
        !((d + e - length) / 2.0 >= self.found[target - self.first].distance)
    }

    /// Takes over a time that is nearer than all before. If several are equally near, the first counts.
    fn improve(&mut self, target: usize, time: f64, distance: f64) {
        let found = &mut self.found[target - self.first];
        if distance < found.distance {
            *found = Nearest { time, distance };
        }
    }

    /// Finds the minima of f = d²/2 in intervals between samples.
    fn in_intervals(&mut self, own: &[Between]) -> Result<(), D::Error> {
        if own.is_empty() {
            return Ok(());
        }
        let target: Vec<usize> = own.iter().flat_map(|i| [i.target; 2]).collect();
        let ends: Vec<f64> = own.iter().flat_map(|i| self.ends(i)).collect();
        // The velocity may jump at a knot, so that the derivative at the end of an interval is taken before it.
        let inside: Vec<f64> = ends.chunks(2).flat_map(|x| [x[0], before(x[1], x[0])]).collect();
        let [_, slopes] = self.distances.at(&target, &inside)?;
        let mut open: Vec<Interval> = own
            .iter()
            .zip(ends.chunks(2).zip(slopes.chunks(2)))
            .map(|(i, (x, s))| Interval {
                target: i.target,
                ends: [x[0], x[1]],
                distances: i.distances,
                slopes: [s[0], s[1]],
                length: self.length(i.target, i.ends),
            })
            .collect();
        for round in 0..ROUNDS {
            let (mut minima, mut rest) = (Vec::new(), Vec::new());
            for own in open {
                let (x, lowest) = own.cubic_minimum();
                if !self.can_be_nearer(&own, lowest) {
                    continue;
                }
                let bracketed = own.slopes[0] < 0.0 && own.slopes[1] > 0.0;
                if bracketed {
                    minima.push((own, x));
                } else {
                    // Estimates can remain on one side of the minimum; midpoints reach the other side.
                    rest.push((own, if round % 2 == 0 { x } else { own.ends[0].midpoint(own.ends[1]) }));
                }
            }
            self.minima(&minima)?;
            if rest.is_empty() {
                break;
            }
            open = self.divided(&rest)?;
        }
        Ok(())
    }

    fn ends(&self, own: &Between) -> [f64; 2] {
        own.ends.map(|number| self.time(own.target, number))
    }

    /// Whether an interval can contain a time that is nearer than all before, given an estimate of its lowest d²/2.
    fn can_be_nearer(&self, own: &Interval, lowest: f64) -> bool {
        let f = self.found[own.target - self.first].distance.powi(2) / 2.0;
        let depth = own.distances[0].max(own.distances[1]).powi(2) / 2.0 - lowest;
        let unknown = !(own.slopes[0] + own.slopes[1]).is_finite();
        // Differences that rounding errors explain are not minima.
        let flat = depth <= 1e-15 * f;
        self.is_open(own.target, own.distances, own.length)
            && (unknown || (lowest - MARGIN * depth < f && !flat))
    }

    /// Both parts of intervals that are divided at some times.
    fn divided(&mut self, own: &[(Interval, f64)]) -> Result<Vec<Interval>, D::Error> {
        let target: Vec<usize> = own.iter().map(|(i, _)| i.target).collect();
        let x: Vec<f64> = own.iter().map(|(_, x)| *x).collect();
        let [distances, slopes] = self.distances.at(&target, &x)?;
        let mut parts = Vec::with_capacity(2 * own.len());
        for (&(i, x), (&d, &s)) in own.iter().zip(distances.iter().zip(&slopes)) {
            self.improve(i.target, x, d);
            // The length of the interval bounds those of its parts.
            let Interval { ends: [start, stop], distances: [d0, d1], slopes: [s0, s1], .. } = i;
            parts.push(Interval { ends: [start, x], distances: [d0, d], slopes: [s0, s], ..i });
            parts.push(Interval { ends: [x, stop], distances: [d, d1], slopes: [s, s1], ..i });
        }
        Ok(parts)
    }

    /// Finds the root of the derivative in intervals in which it changes its sign from negative to positive.
    fn minima(&mut self, own: &[(Interval, f64)]) -> Result<(), D::Error> {
        if own.is_empty() {
            return Ok(());
        }
        let brackets: Vec<Bracket> = own
            .iter()
            .map(|(i, guess)| Bracket {
                ends: i.ends,
                values: i.slopes,
                guess: *guess,
                tol: 1e-14 * (i.ends[1] - i.ends[0]),
            })
            .collect();
        let target: Vec<usize> = own.iter().map(|(i, _)| i.target).collect();
        let distances = &mut *self.distances;
        let x = roots(&brackets, |index, x| {
            let target: Vec<usize> = index.iter().map(|&i| target[i]).collect();
            distances.at(&target, x).map(|[_, slopes]| slopes)
        })?;
        let [distances, _] = self.distances.at(&target, &x)?;
        for ((&target, &x), &d) in target.iter().zip(&x).zip(&distances) {
            self.improve(target, x, d);
        }
        Ok(())
    }
}

/// A time just before x, at which a curve belongs to the segment that ends at x.
fn before(x: f64, start: f64) -> f64 {
    start.max(x.next_down().min(x - 1e-12 * (x - start)))
}

impl Interval {
    /// The time and the value of the minimum of the cubic Hermite interpolant of d²/2 inside the interval. Without an
    /// interior minimum, the value is infinite. Without derivatives, the time is the midpoint.
    fn cubic_minimum(&self) -> (f64, f64) {
        let h = self.ends[1] - self.ends[0];
        let [f, g] = self.distances.map(|d| d * d / 2.0);
        let [a, b] = self.slopes.map(|s| h * s);
        // f + a τ + c τ² + e τ³, whose derivative is a + 2 c τ + 3 e τ²
        let (c, e) = (3.0 * (g - f) - 2.0 * a - b, 2.0 * (f - g) + a + b);
        let root = (c * c - 3.0 * a * e).sqrt();
        // The root with positive second derivative, without cancellation.
        let tau = if c > 0.0 { -a / (c + root) } else { (root - c) / (3.0 * e) };
        let inside = tau > 0.0 && tau < 1.0;
        let lowest = match inside {
            true => f + tau * (a + tau * (c + tau * e)),
            // A change of sign is a minimum, whatever rounding errors make of the polynomial.
            false if self.slopes[0] < 0.0 && self.slopes[1] > 0.0 => f.min(g),
            false => f64::INFINITY,
        };
        let x = self.ends[0] + if inside { tau } else { 0.5 } * h;
        (x.clamp(self.ends[0], self.ends[1]), lowest)
    }
}
