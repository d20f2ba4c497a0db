//! Factors by which the standard deviations of a curve in gaps, and beyond its data, are too small.
//!
//! The posterior standard deviation is too small where there are no data, because λ is optimal for the data and the true
//! motion is rarely a sample of the prior process. Parts of the recording as long as the gap are predicted without their
//! data; the errors of these predictions determine the factors.

use crate::chi;
use crate::gaps::{Block, Functionals, Predictions, System};
use crate::variance::functional_at;
use std::ops::Range;
use symspline_core::monitor::checkpoint;

/// Omitted data count only where their variance exceeds this multiple of that at data. The posterior is right at the edges
/// of a block, which would hide errors inside.
const INSIDE: f64 = 2.0;
/// The coverage for which the factors are calibrated.
pub const LEVEL: f64 = 0.95;
/// Largest numbers of blocks of one length, of lengths, and of predicted data per block; the least number of predictions.
const BLOCKS: usize = 24;
const LENGTHS: usize = 6;
const PREDICTED: usize = 200;
const FEW: usize = 3;
/// The fraction of a recording that is predicted beyond the end of a part of it, and the largest factor there.
const AHEAD: f64 = 1.0 / 3.0;
const MOST: f64 = 20.0;

/// Measurements of a curve in the order of time, linearised there and divided by their standard deviations. Each has the
/// same number of rows, and each row the same number of residuals.
pub struct Evidence<'a> {
    /// Times.
    pub times: &'a [f64],
    /// Rows of each measurement as functions of the coefficients and the parameters.
    pub rows: Functionals<'a>,
    /// The number of rows of a measurement.
    pub count: usize,
    /// Measurements minus their values at the curve; for a robust loss those of the pseudo-data.
    pub residuals: &'a [f64],
    /// The same for least squares.
    pub errors: &'a [f64],
    /// Whether each measurement is a point, and not an outlier.
    pub counts: &'a [bool],
    /// The mean weight of a coordinate that a point observes.
    pub weights: &'a [f64],
    /// The number of coordinates that each point observes, if A couples the coordinates, else one.
    pub observed: &'a [f64],
    /// The number of coordinates of a point.
    pub coordinates: usize,
}

/// What a prediction beyond the ends needs besides: the data are points.
pub struct Course<'a> {
    /// Roots of the weights, (rows, coordinates that A couples) numbers per datum.
    pub roots: &'a [f64],
    /// The curve and its velocity at the data in coordinates of frames along the curve, in standard deviations.
    pub positions: &'a [f64],
    /// See `positions`.
    pub velocities: &'a [f64],
    /// The order of the derivative that is penalised, its weight λ, and the mean square of a coordinate of the acceleration.
    pub order: usize,
    /// See `order`.
    pub lam: f64,
    /// See `order`.
    pub acceleration: f64,
}

impl Course<'_> {
    /// The variance of the deviation of the process from a line of constant velocity. A process with a penalty on its jerk
    /// also has an acceleration.
    fn drift(&self, d: f64) -> f64 {
        if self.order == 2 {
            d.powi(3) / (3.0 * self.lam)
        } else {
            d.powi(5) / (20.0 * self.lam) + self.acceleration * d.powi(4) / 4.0
        }
    }
}

/// A prediction without data: squared error and variance per coordinate in units of the noise, the variance at data, and
/// the distance from the data.
#[derive(Clone, Copy)]
pub struct Predicted {
    /// The squared error.
    pub square: f64,
    /// The variance.
    pub variance: f64,
    /// The variance at data.
    pub at_data: f64,
    /// The distance.
    pub distance: f64,
}

/// The factor k ≥ 1 for which `v + (k² − 1)(v − v₀)` are the variances of predictions with m coordinates; NaN without any.
/// As the factor is estimated from few `disjoint` blocks, the F distribution replaces χ².
pub fn factor_of(predictions: &[Predicted], m: usize, disjoint: f64) -> f64 {
    let inside = |p: &&Predicted| p.variance.is_finite() && p.variance > INSIDE * p.at_data;
    let own: Vec<&Predicted> = predictions.iter().filter(inside).collect();
    let count = own.len() as f64;
    if own.len() < FEW {
        return f64::NAN;
    }
    let surplus = |log_k: f64| {
        let more = (2.0 * log_k).exp_m1();
        let term = |p: &&Predicted| p.square / (p.variance + more * (p.variance - p.at_data) + 1.0);
        own.iter().map(term).sum::<f64>() / count - 1.0
    };
    let (mut low, mut high) = (0.0, 1.0);
    if surplus(low) > 0.0 {
        while surplus(high) > 0.0 {
            (low, high) = (high, 2.0 * high);
        }
        while high - low > 1e-3 {
            let middle = 0.5 * (low + high);
            (low, high) = if surplus(middle) > 0.0 { (middle, high) } else { (low, middle) };
        }
    } else {
        high = 0.0;
    }
    let plain = chi::quantile(m, LEVEL);
    checkpoint();
    let independent = disjoint.min(count).round_ties_even().max(1.0) as usize;
    let spread = (chi::ratio_quantile(m, m * independent, LEVEL) / plain).sqrt();
    // The factor for which the bands contain the required share of the errors. It protects against bursts.
    let needed = |p: &&Predicted| (m as f64 * p.square / plain - 1.0 - p.at_data) / (p.variance - p.at_data);
    let covering = quantile(own.iter().map(needed).collect(), LEVEL);
    (spread * high.exp()).max(covering.max(0.0).sqrt()).max(1.0)
}

fn quantile(mut values: Vec<f64>, level: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = level * (values.len() - 1) as f64;
    let (low, share) = (at as usize, at.fract());
    let high = (low + 1).min(values.len() - 1);
    values[low] + share * (values[high] - values[low])
}

/// Evenly distributed numbers, the first and the last among them.
fn evenly(first: f64, last: f64, count: usize) -> Vec<f64> {
    let step = (last - first) / count.saturating_sub(1).max(1) as f64;
    (0..count).map(|i| if i > 0 && i + 1 == count { last } else { first + i as f64 * step }).collect()
}

/// At most so many of some indices, evenly distributed.
fn some<T: Copy>(indices: &[T], most: usize) -> Vec<T> {
    let last = indices.len().saturating_sub(1) as f64;
    evenly(0.0, last, indices.len().min(most)).iter().map(|i| indices[*i as usize]).collect()
}

/// The value at x of the function that is linear in the logarithms of x and y between given points.
fn interpolated(x: f64, points: &[(f64, f64)]) -> f64 {
    let after = points.partition_point(|point| point.0 <= x);
    if after == 0 || after == points.len() {
        return points[after.min(points.len() - 1)].1;
    }
    let [(a, from), (b, to)] = [points[after - 1], points[after]].map(|(x, y)| (x.ln(), y.ln()));
    (from + (to - from) * (x.ln() - a) / (b - a)).exp()
}

/// Indices of omitted data, of data that are predicted without them, and of segments in which λ is not known without them.
type Part = (Vec<usize>, Vec<usize>, Range<usize>);

/// A recording and its linear system.
pub struct Calibration<'a> {
    /// The matrix.
    pub system: &'a System<'a>,
    /// The data.
    pub evidence: &'a Evidence<'a>,
    /// The period of a closed curve.
    pub period: Option<f64>,
}

/// The long gaps of a recording.
pub struct Gaps<'a> {
    recording: &'a Calibration<'a>,
    /// The first and the last time of each, also those of the next turn of a closed curve.
    all: Vec<[f64; 2]>,
    /// The width of the smoother, and the median variance at the data.
    width: f64,
    at_data: f64,
    /// The times of the data, of a closed curve in two turns, and the first and the last time of a block.
    times: Vec<f64>,
    span: [f64; 2],
}

impl Calibration<'_> {
    /// The factor and the number of blocks for every gap. The width is that of the smoother, `at_data` the median variance
    /// at the data.
    pub fn factors_in_gaps(&self, gaps: &[[f64; 2]], width: f64, at_data: f64) -> Vec<(f64, usize)> {
        let turn = |gap: &[f64; 2]| self.period.map(|period| gap.map(|t| t + period));
        let t = self.evidence.times;
        let again = self.period.into_iter().flat_map(|period| t.iter().map(move |t| t + period));
        Gaps {
            recording: self,
            all: gaps.iter().copied().chain(gaps.iter().filter_map(turn)).collect(),
            width,
            at_data,
            times: t.iter().copied().chain(again).collect(),
            span: [t[0], self.period.map_or(t[t.len() - 1], |period| t[0] + period)],
        }
        .factors(&gaps.iter().map(|gap| gap[1] - gap[0]).collect::<Vec<f64>>())
    }

    /// Rows of data.
    fn rows(&self, data: &[usize]) -> Vec<usize> {
        let count = self.evidence.count;
        data.iter().flat_map(|k| k * count..(k + 1) * count).collect()
    }

    /// Predicts probes, which belong to data in the order of the blocks, without the omitted data. Returns the means of the
    /// squared differences from `errors` and of the variances over the coordinates that each datum observes.
    fn without(&self, blocks: &[Part], probes: &Functionals, errors: &[f64]) -> Vec<[f64; 2]> {
        let own = self.evidence;
        let columns = own.residuals.len() / (own.times.len() * own.count);
        let omitted: Vec<Vec<usize>> = blocks.iter().map(|(omitted, ..)| self.rows(omitted)).collect();
        let mut first = 0;
        let lists: Vec<Block> = blocks
            .iter()
            .zip(&omitted)
            .map(|((_, probed, segments), omitted)| {
                let probes = first..first + probed.len() * own.count;
                first = probes.end;
                Block { omitted, probes, segments: segments.clone() }
            })
            .collect();
        let Predictions { values, variances } =
            self.system.without(&own.rows, own.residuals, columns, probes, &lists);
        let squares: Vec<f64> = errors.iter().zip(&values).map(|(x, y)| (x - y).powi(2)).collect();
        let data = blocks.iter().flat_map(|(_, probed, _)| probed);
        let of_rows = squares.chunks_exact(own.count * columns).zip(variances.chunks_exact(own.count));
        data.zip(of_rows)
            .map(|(&k, (squares, variances))| {
                let observed = own.observed[k];
                let square = squares.iter().sum::<f64>() / (columns as f64 * observed);
                [square, variances.iter().sum::<f64>() / observed]
            })
            .collect()
    }

    /// Distances beyond the ends with their factors, and the number of predictions. `usual` is the median time step.
    ///
    /// Each prediction omits all data after a datum in the last two thirds of the recording, and continues the curve from
    /// there with constant velocity. The same is done backwards in time.
    pub fn factors_beyond(&self, course: &Course, usual: f64) -> (Vec<[f64; 2]>, usize) {
        let own = self.evidence;
        let (t, n) = (own.times, own.times.len());
        let span = t[n - 1] - t[0];
        let reach = AHEAD * span;
        let mut blocks: Vec<Part> = Vec::new();
        let mut lines: Vec<(usize, usize)> = Vec::new();
        for direction in [1.0, -1.0] {
            let index: Vec<usize> = if direction > 0.0 { (0..n).collect() } else { (0..n).rev().collect() };
            let here: Vec<f64> = index.iter().map(|&k| direction * t[k]).collect();
            let until = here[n - 1] - (2.0 * usual).min(0.1 * span);
            let after = |time: f64| here.partition_point(|t| *t <= time);
            let mut cuts: Vec<usize> =
                evenly(here[0] + reach, until, BLOCKS / 2).into_iter().map(after).collect();
            cuts.sort_unstable();
            cuts.dedup();
            for cut in cuts {
                // The remaining data must determine more than a line.
                if cut < FEW.max(course.order + 1) || cut >= n {
                    continue;
                }
                let ahead: Vec<usize> = (cut..after(here[cut - 1] + reach)).collect();
                // The last probe of every block is the end itself.
                let probed: Vec<usize> =
                    some(&ahead, PREDICTED).into_iter().chain([cut - 1]).map(|i| index[i]).collect();
                lines.extend(probed.iter().map(|&k| (index[cut - 1], k)));
                // Beyond the end, the curve is a line for every λ.
                blocks.push((index[cut..].to_vec(), probed, 0..0));
            }
        }
        if blocks.is_empty() {
            return (Vec::new(), 0);
        }
        let (probes, errors) = self.along_lines(course, &lines);
        let found = self.without(&blocks, &probes.as_functionals(), &errors);
        let mut first = 0;
        let mut predicted = Vec::new();
        for (_, probed, _) in &blocks {
            let end = first + probed.len() - 1;
            let at_end = found[end][1] / own.weights[probed[probed.len() - 1]];
            for (&[square, variance], &(at, ahead)) in found[first..=end].iter().zip(&lines[first..=end]) {
                let (distance, weight) = ((t[ahead] - t[at]).abs(), own.weights[ahead]);
                if own.counts[ahead] && distance > 0.0 {
                    let variance = variance + weight * course.drift(distance);
                    predicted.push(Predicted { square, variance, at_data: at_end * weight, distance });
                }
            }
            first = end + 1;
        }
        let mut rungs = Vec::new();
        let mut high = reach;
        while high > usual.max(reach / f64::from(1 << LENGTHS)) {
            let near = |p: &&Predicted| p.distance > 0.5 * high && p.distance <= high;
            let near: Vec<Predicted> = predicted.iter().filter(near).copied().collect();
            let disjoint = (2.0 / 3.0 * span / high).min(blocks.len() as f64);
            let factor = factor_of(&near, own.coordinates, disjoint);
            if !factor.is_nan() {
                rungs.push([0.75 * high, factor.min(MOST)]);
            }
            high /= 2.0;
        }
        rungs.reverse();
        (rungs, blocks.len())
    }

    /// Rows of lines from one datum at the times of another, and the errors of the lines there.
    fn along_lines(&self, course: &Course, lines: &[(usize, usize)]) -> (OwnedRows, Vec<f64>) {
        let own = self.evidence;
        let (t, count) = (own.times, own.count);
        let m = course.roots.len() / (t.len() * count);
        let columns = own.residuals.len() / (t.len() * count);
        let [points, slopes] = [0, 1].map(|nu| functional_at(self.system.knots, self.system.ends, t, nu));
        let mut rows = OwnedRows { firsts: Vec::new(), factors: Vec::new() };
        let mut errors = Vec::new();
        let size = m * columns;
        for &(at, ahead) in lines {
            let d = t[ahead] - t[at];
            let vector = |x: &[f64], k: usize, i: usize| x[k * size + i];
            let (from, velocity) = (course.positions, course.velocities);
            let line = |i: usize| vector(from, at, i) + d * vector(velocity, at, i);
            let moved = |i: usize| vector(from, ahead, i) - line(i);
            let roots = &course.roots[ahead * count * m..][..count * m];
            for (q, root) in roots.chunks_exact(m).enumerate() {
                rows.firsts.push(points[at].0);
                for k in 0..4 {
                    let factor = points[at].1[k] + d * slopes[at].1[k];
                    rows.factors.extend(root.iter().map(|root| root * factor));
                }
                let whole = (0..columns).map(|c| {
                    let change: f64 = (0..m).map(|i| root[i] * moved(i * columns + c)).sum();
                    own.errors[(ahead * count + q) * columns + c] + change
                });
                errors.extend(whole);
            }
        }
        (rows, errors)
    }
}

/// The segments between two times. Those of a closed curve, whose times may be beyond its ends, have numbers of the next turn.
fn segments_between(knots: &[f64], [from, to]: [f64; 2]) -> Range<usize> {
    let (count, period) = (knots.len() - 1, knots[knots.len() - 1] - knots[0]);
    let place = |t: f64| {
        let turn = ((t - knots[0]) / period).floor().max(0.0);
        let inside = t - turn * period;
        (turn as usize * count, inside)
    };
    let ((before, first), (behind, last)) = (place(from), place(to));
    let first = before + knots.partition_point(|knot| *knot <= first).saturating_sub(1);
    let last = behind + knots.partition_point(|knot| *knot < last).min(count);
    first..last.max(first)
}

/// Rows without parameters.
struct OwnedRows {
    firsts: Vec<usize>,
    factors: Vec<f64>,
}

impl OwnedRows {
    fn as_functionals(&self) -> Functionals<'_> {
        Functionals { firsts: &self.firsts, factors: &self.factors, sides: &[] }
    }
}

impl Gaps<'_> {
    /// The factor and the number of blocks for gaps of these lengths.
    fn factors(&self, lengths: &[f64]) -> Vec<(f64, usize)> {
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        let steps = LENGTHS.min(((longest / shortest).log2() - 1e-9).ceil() as usize + 1);
        let mut ladder: Vec<f64> =
            evenly(shortest.log10(), longest.log10(), steps).into_iter().map(|x| 10f64.powf(x)).collect();
        ladder[0] = shortest;
        ladder[steps - 1] = longest;
        let known = |length: f64| self.factor(length).map(|(factor, blocks)| (length, factor, blocks));
        let mut found: Vec<(f64, f64, usize)> = ladder.into_iter().filter_map(known).collect();
        let mut shorter = shortest;
        while found.is_empty() && shorter > (2.0 * self.width).max(shortest / f64::from(1 << LENGTHS)) {
            // No block is as long as the shortest gap, so shorter ones are tried.
            shorter /= 2.0;
            found.extend(known(shorter));
        }
        if found.len() == 1 && found[0].0 < shortest {
            // The factor may increase with the length, so the maximum over shorter lengths is used.
            let more = [shorter / 2.0, shorter / 4.0];
            found.extend(more.into_iter().filter(|length| *length > self.width).filter_map(known));
        }
        if found.is_empty() {
            return lengths.iter().map(|length| self.any_factor(*length)).collect();
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let points: Vec<(f64, f64)> = found.iter().map(|&(length, factor, _)| (length, factor)).collect();
        let largest = points.iter().map(|point| point.1).fold(0.0, f64::max);
        let of_length = |&length: &f64| {
            if length > points[points.len() - 1].0 * (1.0 + 1e-9) {
                return (largest, 0);
            }
            let next = points.partition_point(|point| point.0 < length * (1.0 - 1e-9));
            (interpolated(length, &points), found[next].2)
        };
        lengths.iter().map(of_length).collect()
    }

    /// The factor for gaps of a length and the number of blocks, if there are any.
    fn factor(&self, length: f64) -> Option<(f64, usize)> {
        let edge = (2.0 * self.width).min(length);
        let margin = if self.recording.period.is_some() { 0.0 } else { edge };
        let (first, last) = (self.span[0] + margin, self.span[1] - length - margin);
        if last < first {
            return None;
        }
        let count = 1 + (8.0 * (last - first) / length).clamp(1.0, 4096.0) as usize;
        let is_free = |start: &f64| {
            let edges = [start - edge, *start, start + length, start + length + edge];
            let beside = |gap: &[f64; 2]| edges.iter().any(|t| *t > gap[0] && *t < gap[1]);
            let part = |gap: &[f64; 2]| (gap[1].min(start + length) - gap[0].max(*start)).max(0.0);
            !self.all.iter().any(beside) && self.all.iter().map(part).sum::<f64>() <= 0.5 * length
        };
        self.of(evenly(first, last, count).into_iter().filter(is_free).collect(), length)
    }

    /// The factor from blocks anywhere between the first and the last datum, including other gaps.
    fn any_factor(&self, length: f64) -> (f64, usize) {
        let starts = evenly(self.span[0], self.span[1] - length, 4 * BLOCKS);
        self.of(starts, length).unwrap_or((f64::NAN, 0))
    }

    /// The times of the data before and after a block. In a closed curve, they may be those of the next turn.
    fn around(&self, a: usize, b: usize) -> [f64; 2] {
        let count = self.recording.evidence.times.len();
        let period = self.recording.period.unwrap_or(0.0);
        let at = |k: usize| self.times.get(k).copied().unwrap_or_else(|| self.times[k - count] + period);
        if a > 0 { [at(a - 1), at(b)] } else { [at(count - 1), at(b + count)] }
    }

    fn of(&self, starts: Vec<f64>, length: f64) -> Option<(f64, usize)> {
        let evidence = self.recording.evidence;
        let count = evidence.times.len();
        let closed = self.recording.period.is_some();
        let mut ranges: Vec<[usize; 2]> = Vec::new();
        let (mut disjoint, mut reached) = (0.0, f64::NEG_INFINITY);
        for start in starts {
            let [a, b] = [start, start + length].map(|time| self.times.partition_point(|t| *t <= time));
            // A block needs data on both sides, and a datum in it that is not an outlier.
            let beside = if closed { b - a < count } else { a > 0 && b < self.times.len() };
            if beside && (a..b).any(|k| evidence.counts[k % count]) {
                ranges.push([a, b]);
                if start >= reached {
                    (disjoint, reached) = (disjoint + 1.0, start + length);
                }
            }
        }
        if ranges.is_empty() {
            return None;
        }
        let knots = self.recording.system.knots;
        let blocks: Vec<Part> = some(&ranges, BLOCKS)
            .into_iter()
            .map(|[a, b]| {
                let own: Vec<usize> = (a..b).map(|k| k % count).collect();
                let counting: Vec<usize> = own.iter().copied().filter(|&k| evidence.counts[k]).collect();
                (own, some(&counting, PREDICTED), segments_between(knots, self.around(a, b)))
            })
            .collect();
        let probed: Vec<usize> = blocks.iter().flat_map(|(_, probed, _)| probed.iter().copied()).collect();
        let rows = self.recording.rows(&probed);
        let columns = evidence.residuals.len() / (count * evidence.count);
        let picked = |all: &[f64], size: usize| -> Vec<f64> {
            rows.iter().flat_map(|k| &all[k * size..][..size]).copied().collect()
        };
        let all = &evidence.rows;
        let [wide, side] = [all.factors, all.sides].map(|x| x.len() / all.firsts.len());
        let firsts: Vec<usize> = rows.iter().map(|k| all.firsts[*k]).collect();
        let (factors, sides) = (picked(all.factors, wide), picked(all.sides, side));
        let probes = Functionals { firsts: &firsts, factors: &factors, sides: &sides };
        let found = self.recording.without(&blocks, &probes, &picked(evidence.errors, columns));
        let predicted: Vec<Predicted> = found
            .iter()
            .zip(&probed)
            .map(|(&[square, variance], &k)| {
                let at_data = self.at_data * evidence.weights[k];
                Predicted { square, variance, at_data, distance: 0.0 }
            })
            .collect();
        let factor = factor_of(&predicted, evidence.coordinates, disjoint);
        (!factor.is_nan()).then_some((factor, blocks.len()))
    }
}
