//! Integrals along curves, accurate up to rounding errors: lengths, bending energies, and time as a function of length.
//!
//! The speed of a curve is no smooth function of time: it has a kink where the curve stops and turns. Its square is
//! smooth. It is therefore interpolated by polynomials first, whose roots are then integrated, without further values
//! of the curve.
//!
//! Arrays have one row per curve; all rows of an array are equally long.

use super::chebyshev::{LEVELS, MOST, is_flat, node, sizes};
use super::data::Times;
use crate::scalar::{LANES, Lane, few, lane, max_or_nan};
use std::iter::zip;
use std::sync::LazyLock;

/// The number of positive nodes of the Gauss–Legendre rule.
const PAIRS: usize = 5;
/// The number of [`Lane`]s that contain them.
const PARTS: usize = PAIRS.div_ceil(LANES);
/// Its nodes and weights on [−1, 1]; the others are symmetric.
const NODES: [f64; PAIRS] =
    [0.14887433898163122, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717];
const WEIGHTS: [f64; PAIRS] =
    [0.29552422471475287, 0.26926671930999635, 0.21908636251598204, 0.1494513491505806, 0.06667134430868814];
/// An interval is short enough for the rule if the square varies by no more than this factor. A root of the square, near
/// which it is (t − z)(t − z̄), is then at least 3.7 halves of the interval away from the middle, so that the error of
/// the rule is 7⁻²⁰ (Trefethen, *Approximation Theory and Approximation Practice*, 2013, theorem 19.3).
const VARIATION: f64 = 3.0;
/// The square of this is about the error if the coefficients of its root for the Legendre polynomials of the highest
/// degrees are no larger, relative to the root.
const CONVERGED: f64 = 1e-7;
/// Integrals and errors up to this are negligible, relative to the largest value on the curve times the longest segment.
const NEGLIGIBLE: f64 = 2e-16;
/// Rounding errors of a square, relative to its largest value.
const NOISE: f64 = 4.0 * f64::EPSILON;
/// If all values of a square are above this, relative to the largest one, rounding errors of its root are negligible.
const FAR_FROM_ZERO: f64 = 1e-2;
/// No tolerance is smaller.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Errors up to this, relative to the largest coefficient, are rounding errors if the coefficients do not decrease: those
/// of a function that converges so slowly would be larger.
const UNCERTAIN: f64 = 1e-10;
/// Rounds in which the error may fail to halve before the bisection ends.
const PATIENCE: usize = 3;
/// Values that are computed in one call.
const AT_ONCE: usize = 1 << 17;
/// Bisection alone takes at most this number of steps from any interval to two neighbouring floating-point numbers.
const STEPS: usize = 1100;

/// A non-negative function of time for every curve, such as its speed.
pub trait Integrand {
    /// Why values are missing.
    type Error;
    /// Replaces rows of times by values there.
    fn at(&mut self, times: Times, values: &mut [f64]) -> Result<(), Self::Error>;
}

/// The square of a function on an interval of time, relative to that of its largest value there: a Chebyshev series.
struct Square {
    start: f64,
    width: f64,
    largest: f64,
    /// The smallest value of the square at the nodes.
    low: f64,
    coefficients: Vec<f64>,
    /// What is negligible, relative to the largest value times the width.
    negligible: f64,
}

/// The functions whose integrals with a function are its coefficients for the Legendre polynomials of degrees 8 and 9, at
/// the positive nodes, with the weights of the rule; in the lanes of the nodes.
static LEGENDRE: LazyLock<[[Lane; PARTS]; 2]> = LazyLock::new(|| {
    [8, 9].map(|degree| {
        pairs(|i| {
            let (mut before, mut here) = (1.0, NODES[i]);
            for k in 1..degree {
                let k = k as f64;
                (before, here) = (here, ((2.0 * k + 1.0) * NODES[i] * here - k * before) / (k + 1.0));
            }
            (degree as f64 + 0.5) * WEIGHTS[i] * here
        })
    })
});

/// Lanes with numbers of the pairs of nodes, and 0.
fn pairs(value: impl Fn(usize) -> f64) -> [Lane; PARTS] {
    let value = |i: usize| if i < PAIRS { value(i) } else { 0.0 };
    few(|part| Lane::new(few(|l| value(part * LANES + l))))
}

/// The sum of products.
fn product(a: [Lane; PARTS], b: [Lane; PARTS]) -> f64 {
    zip(a, b).map(|(a, b)| (a * b).reduce_add()).sum()
}

impl Square {
    /// Values at positions in [0, 1], by Clenshaw's algorithm.
    fn at<const N: usize>(&self, positions: [Lane; N]) -> [Lane; N] {
        let y = positions.map(|x| x + x - Lane::ONE);
        let [mut b, mut c] = [[Lane::ZERO; N]; 2];
        for coefficient in self.coefficients[1..].iter().rev() {
            (b, c) = (few(|e| (y[e] + y[e]).mul_add(b[e], lane(*coefficient) - c[e])), b);
        }
        few(|e| max_or_nan(y[e].mul_add(b[e], lane(self.coefficients[0]) - c[e]), Lane::ZERO))
    }

    /// The integral over the interval.
    fn integral(&self) -> f64 {
        let even = self.coefficients.iter().step_by(2).enumerate();
        let sum: f64 = even.map(|(n, c)| c / (1.0 - 4.0 * (n * n) as f64)).sum();
        sum * self.width * self.largest * self.largest
    }

    /// The integral of the root over a part of [0, 1] by the rule, and whether it is accurate.
    fn rule(&self, [u, v]: [f64; 2]) -> (f64, bool) {
        let (middle, half) = (0.5 * (u + v), 0.5 * (v - u));
        // Unused lanes repeat a node.
        let node = |i: usize| half * NODES[i.min(PAIRS - 1)];
        let ahead: [Lane; PARTS] = few(|part| Lane::new(few(|l| node(part * LANES + l))));
        let squares: [Lane; 2 * PARTS] =
            self.at(few(|i| lane(middle) + if i < PARTS { -ahead[i] } else { ahead[i - PARTS] }));
        let roots = squares.map(|x| x.sqrt());
        let (even, odd) = (few(|i| roots[i] + roots[PARTS + i]), few(|i| roots[PARTS + i] - roots[i]));
        let sum = product(even, pairs(|i| WEIGHTS[i]));
        let all = squares.iter().flat_map(|x| x.to_array());
        let (low, high) =
            all.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)));
        let [eighth, ninth] = *LEGENDRE;
        let rest = product(even, eighth).abs().max(product(odd, ninth).abs());
        let rough = high > VARIATION * low || rest > CONVERGED * sum && half * rest > self.negligible;
        (half * sum, !rough || half * sum <= self.negligible)
    }

    /// Parts of [0, 1] in their order, and the integrals of the root over them. There are at least two, since tables of
    /// arc lengths serve the search for closest points, too.
    fn parts(&self) -> Vec<([f64; 2], f64)> {
        let mut parts = Vec::new();
        let mut rest = vec![[0.5, 1.0], [0.0, 0.5]];
        while let Some([u, v]) = rest.pop() {
            let (integral, accurate) = self.rule([u, v]);
            let middle = 0.5 * (u + v);
            if accurate {
                parts.push(([u, v], integral * self.largest * self.width));
            } else {
                rest.extend([[middle, v], [u, middle]]);
            }
        }
        parts
    }

    /// Whether rounding errors of the square are those of its root, too. Errors of a root of size s are 1/(2s) times as
    /// large, which matters where a curve stops and does not turn at once.
    fn has_root(&self) -> bool {
        let error = |([u, v], part): ([f64; 2], f64)| {
            let root = part / (self.largest * self.width * (v - u));
            (v - u) * root.min(NOISE / root)
        };
        self.low > FAR_FROM_ZERO
            || self.parts().into_iter().map(error).sum::<f64>() <= ROUNDING.max(64.0 * self.negligible)
    }

    /// The time at a position.
    fn time(&self, position: f64) -> f64 {
        self.start + self.width * position
    }
}

/// The columns of an array for which `kept` is true.
fn columns(array: &[f64], kept: &[bool]) -> Vec<f64> {
    array
        .chunks(kept.len())
        .flat_map(|row| row.iter().zip(kept).filter(|(_, kept)| **kept).map(|(x, _)| *x))
        .collect()
}

/// The columns of two arrays, side by side.
fn beside(first: &[f64], second: &[f64], curves: usize) -> Vec<f64> {
    let rows = first.chunks(first.len() / curves).zip(second.chunks(second.len() / curves));
    rows.flat_map(|(first, second)| [first, second].concat()).collect()
}

/// The integrals over intervals from a to b, in rows of `count`, by the Gauss–Legendre rule.
fn rule<F: Integrand + ?Sized>(a: &[f64], b: &[f64], count: usize, f: &mut F) -> Result<Vec<f64>, F::Error> {
    let mut result = vec![0.0; a.len()];
    if a.is_empty() {
        return Ok(result);
    }
    let curves = a.len() / count;
    let block = (AT_ONCE / (2 * PAIRS * curves)).max(1);
    for first in (0..count).step_by(block) {
        let width = block.min(count - first);
        let mut x = Vec::with_capacity(curves * width * 2 * PAIRS);
        for c in 0..curves {
            for i in c * count + first..c * count + first + width {
                let (middle, half) = (a[i] / 2.0 + b[i] / 2.0, (b[i] - a[i]) / 2.0);
                x.extend(NODES.iter().flat_map(|node| [middle - half * node, middle + half * node]));
            }
        }
        let mut values = vec![0.0; x.len()];
        f.at(Times { x: &x, count: width * 2 * PAIRS }, &mut values)?;
        for (k, values) in values.chunks(2 * PAIRS).enumerate() {
            let i = k / width * count + first + k % width;
            let sum = WEIGHTS.iter().zip(values.as_chunks::<2>().0).map(|(weight, [x, y])| weight * (x + y));
            result[i] = sum.sum::<f64>() * ((b[i] - a[i]) / 2.0);
        }
    }
    Ok(result)
}

/// A sum with errors that grow with the logarithm of the number of terms.
fn sum(terms: &[f64]) -> f64 {
    match terms.len() {
        0..=8 => terms.iter().sum(),
        n => sum(&terms[..n / 2]) + sum(&terms[n / 2..]),
    }
}

/// The interpolation of the squares of functions.
struct Resolver<'a, F: ?Sized, G> {
    f: &'a mut F,
    rtol: f64,
    /// Whether roots of the squares are integrated.
    roots: bool,
    /// Receives squares and their curves. The intervals of a curve are in any order.
    finished: G,
    /// For every curve, the largest value so far times the longest segment.
    scales: Vec<f64>,
}

impl<F: Integrand + ?Sized, G: FnMut(usize, Square)> Resolver<'_, F, G> {
    /// Interpolates on intervals that cover all segments.
    ///
    /// Segments are halved until polynomials interpolate the square to the relative tolerance `rtol`, for all curves if
    /// one of them needs it. An error that does not decrease for several rounds ends the bisection.
    fn segments(&mut self, knots: &[f64]) -> Result<(), F::Error> {
        let curves = self.scales.len();
        let nodes = knots.len() / curves;
        let block = (AT_ONCE / ((MOST + 1) * curves)).max(1);
        for first in (0..nodes - 1).step_by(block) {
            let last = (first + block).min(nodes - 1);
            let rows =
                |shift: usize| knots.chunks(nodes).flat_map(move |row| &row[first + shift..last + shift]);
            let (mut a, mut b): (Vec<f64>, Vec<f64>) =
                (rows(0).copied().collect(), rows(1).copied().collect());
            let (mut before, mut stalled) = (f64::INFINITY, 0);
            loop {
                let (rough, error) = self.intervals(&a, &b, stalled > PATIENCE)?;
                if !rough.contains(&true) {
                    break;
                }
                stalled += usize::from(error > before / 2.0);
                before = error;
                let [start, stop] = [&a, &b].map(|x| columns(x, &rough));
                let middle: Vec<f64> = zip(&start, &stop).map(|(a, b)| a / 2.0 + b / 2.0).collect();
                a = beside(&start, &middle, curves);
                b = beside(&middle, &stop, curves);
            }
        }
        Ok(())
    }

    /// Interpolates on intervals from a to b, with a row of them per curve, at the nodes of more and more levels. Returns
    /// the columns that are still rough, unless the last level is `accepted` for them, and their error.
    fn intervals(&mut self, a: &[f64], b: &[f64], accepted: bool) -> Result<(Vec<bool>, f64), F::Error> {
        let curves = self.scales.len();
        let count = a.len() / curves;
        let mut values = vec![0.0; a.len() * (MOST + 1)];
        let mut errors = vec![f64::INFINITY; a.len()];
        let mut rough = vec![true; count];
        for level in &*LEVELS {
            let open: Vec<usize> = (0..count).filter(|j| rough[*j]).collect();
            if open.is_empty() {
                break;
            }
            let places: Vec<usize> =
                (0..curves).flat_map(|c| open.iter().map(move |j| c * count + j)).collect();
            let nodes: Vec<usize> = level.new_nodes().collect();
            // At the ends, the speed may be that of the next or the previous segment.
            let time = |i: usize, k: usize| match k {
                0 => b[i].next_down().max(a[i]),
                MOST => a[i].next_up().min(b[i]),
                _ => a[i] + (b[i] - a[i]) * node(k),
            };
            let x: Vec<f64> = places.iter().flat_map(|&i| nodes.iter().map(move |&k| time(i, k))).collect();
            let mut more = vec![0.0; x.len()];
            self.f.at(Times { x: &x, count: open.len() * nodes.len() }, &mut more)?;
            for (&place, more) in places.iter().zip(more.chunks(nodes.len())) {
                let scale = &mut self.scales[place / count];
                for (k, value) in nodes.iter().zip(more) {
                    values[place * (MOST + 1) + k] = *value;
                    *scale = scale.max(value * (b[place] - a[place]));
                }
            }
            rough.fill(false);
            let mut squares = Vec::with_capacity(places.len());
            for place in places {
                let row = &values[place * (MOST + 1)..(place + 1) * (MOST + 1)];
                let largest = row.iter().fold(0.0, |most: f64, x| most.max(*x));
                let largest = if largest > 0.0 { largest } else { 1.0 };
                let row: Vec<f64> = row.iter().map(|x| (x / largest) * (x / largest)).collect();
                let (constant, others) = (level.constant(&row), level.coefficients(&row, 1));
                let [most, error] = sizes(&others);
                let noise = is_flat(&others) && error < UNCERTAIN * constant.max(most);
                errors[place] = error;
                let width = b[place] - a[place];
                let relative = self.scales[place / count] / (largest * width);
                // The root of a square below the square of the tolerance is below the tolerance.
                let tol = (self.rtol * constant.max(most)).max((self.rtol * relative).powi(2));
                let mut coefficients = vec![constant];
                coefficients.extend(others.iter().flat_map(|x| x.to_array()));
                let low = level.values(&row).fold(f64::INFINITY, f64::min);
                let negligible = NEGLIGIBLE * relative.max(1.0);
                let square = Square { start: a[place], width, largest, low, coefficients, negligible };
                rough[place % count] |= !noise && error > tol || self.roots && !square.has_root();
                squares.push((place, square));
            }
            if accepted && level.is_last() {
                rough.fill(false);
            }
            for (place, square) in squares.into_iter().filter(|(place, _)| !rough[place % count]) {
                (self.finished)(place / count, square);
            }
        }
        let error = (0..a.len()).filter(|i| rough[i % count]).map(|i| errors[i] * (b[i] - a[i]));
        Ok((rough.clone(), error.sum()))
    }
}

/// Calls `finished` with the squares of functions on intervals that cover all segments, and their curves. Where `roots`
/// of the squares are integrated, the intervals are short enough for these.
fn resolve<F: Integrand + ?Sized>(
    knots: &[f64],
    curves: usize,
    rtol: f64,
    f: &mut F,
    roots: bool,
    finished: impl FnMut(usize, Square),
) -> Result<(), F::Error> {
    let rtol = rtol.max(ROUNDING);
    Resolver { f, rtol, roots, finished, scales: vec![0.0; curves] }.segments(knots)
}

/// The integrals of a function over all segments of every curve, to the relative tolerance `rtol`.
pub fn lengths<F: Integrand + ?Sized>(
    knots: &[f64],
    curves: usize,
    rtol: f64,
    f: &mut F,
) -> Result<Vec<f64>, F::Error> {
    let mut parts = vec![Vec::new(); curves];
    resolve(knots, curves, rtol, f, true, |curve, square| {
        parts[curve].push(sum(&square.parts().into_iter().map(|(_, part)| part).collect::<Vec<_>>()));
    })?;
    Ok(parts.iter().map(|parts| sum(parts)).collect())
}

/// The bending energies ∫ |∇γ'|² dt, (1), given |∇γ'|.
pub fn energies<F: Integrand + ?Sized>(
    knots: &[f64],
    curves: usize,
    rtol: f64,
    f: &mut F,
) -> Result<Vec<f64>, F::Error> {
    let mut parts = vec![Vec::new(); curves];
    resolve(knots, curves, rtol, f, false, |curve, square| parts[curve].push(square.integral()))?;
    Ok(parts.iter().map(|parts| sum(parts)).collect())
}

/// The arc length of curves, from a table of its values at the ends of short intervals.
///
/// On each interval the Gauss–Legendre rule integrates the speed up to rounding errors, so that it does so from the
/// start of the interval to any time in it.
pub struct ArcLength {
    curves: usize,
    /// Ends of the intervals, increasing; they include all knots.
    pub times: Vec<f64>,
    /// Arc lengths from the first knot to these times. NaN for curves that failed.
    pub lengths: Vec<f64>,
}

impl ArcLength {
    /// Computes the table, for at least one curve.
    pub fn new<F: Integrand + ?Sized>(
        knots: &[f64],
        curves: usize,
        rtol: f64,
        speed: &mut F,
    ) -> Result<Self, F::Error> {
        let mut squares: Vec<Vec<Square>> = (0..curves).map(|_| Vec::new()).collect();
        resolve(knots, curves, rtol, speed, true, |curve, square| squares[curve].push(square))?;
        let starts = |square: &Square| -> Vec<f64> {
            square.parts().into_iter().map(|([start, _], _)| square.time(start)).collect()
        };
        let mut rows: Vec<Vec<f64>> =
            squares.iter().map(|row| row.iter().flat_map(starts).collect()).collect();
        let count = rows.iter().map(Vec::len).max().unwrap_or(0);
        let nodes = knots.len() / curves;
        let (mut times, mut stops) = (Vec::new(), Vec::new());
        for (row, knots) in zip(&mut rows, knots.chunks(nodes)) {
            row.sort_by(f64::total_cmp);
            row.push(knots[nodes - 1]);
            for (i, ends) in row.windows(2).enumerate() {
                // Other curves may have more intervals: some of these are divided, too.
                let pieces = count / (row.len() - 1) + usize::from(i < count % (row.len() - 1));
                times.extend((0..pieces).map(|k| ends[0] + (ends[1] - ends[0]) * (k as f64 / pieces as f64)));
            }
            stops.extend_from_slice(&times[stops.len() + 1..]);
            stops.push(knots[nodes - 1]);
        }
        // Close to a place where the curve stops, the speed has smaller relative errors than the root of its square.
        let parts = rule(&times, &stops, count, speed)?;
        let (mut ends, mut lengths) = (Vec::new(), Vec::new());
        for ((times, parts), knots) in zip(times.chunks(count), parts.chunks(count)).zip(knots.chunks(nodes))
        {
            let mut length = 0.0;
            for (time, part) in zip(times, parts) {
                ends.push(*time);
                lengths.push(length);
                length += part;
            }
            ends.push(knots[nodes - 1]);
            lengths.push(length);
        }
        Ok(ArcLength { curves, times: ends, lengths })
    }

    /// The number of curves.
    pub fn curves(&self) -> usize {
        self.curves
    }

    /// The rows of one curve in the table.
    fn row(&self, curve: usize) -> [&[f64]; 2] {
        let count = self.times.len() / self.curves;
        [&self.times, &self.lengths].map(|table| &table[curve * count..(curve + 1) * count])
    }

    /// Arc lengths from the first knot to times x.
    pub fn at<F: Integrand + ?Sized>(&self, x: &[f64], speed: &mut F) -> Result<Vec<f64>, F::Error> {
        let count = x.len() / self.curves;
        let place = |i: usize| {
            let [times, lengths] = self.row(i / count);
            let k = interval(times, |time| time <= x[i]);
            (times[k], lengths[k])
        };
        let (starts, before): (Vec<f64>, Vec<f64>) = (0..x.len()).map(place).unzip();
        let parts = rule(&starts, x, count, speed)?;
        Ok(before.iter().zip(&parts).map(|(before, part)| before + part).collect())
    }

    /// Lengths from times a to times b, which are not before a.
    ///
    /// They are sums of three lengths, not differences of two arc lengths, which would round to the accuracy of the
    /// whole length if both times are in one interval.
    pub fn between<F: Integrand + ?Sized>(
        &self,
        a: &[f64],
        b: &[f64],
        speed: &mut F,
    ) -> Result<Vec<f64>, F::Error> {
        let count = a.len() / self.curves;
        let (mut stops, mut starts, mut inner) = (b.to_vec(), b.to_vec(), vec![0.0; a.len()]);
        for i in 0..a.len() {
            let [times, lengths] = self.row(i / count);
            let (first, last) = (interval(times, |time| time <= a[i]), interval(times, |time| time <= b[i]));
            if first != last {
                (stops[i], starts[i]) = (times[first + 1], times[last]);
                inner[i] = lengths[last] - lengths[first + 1];
            }
        }
        let (first, last) = (rule(a, &stops, count, speed)?, rule(&starts, b, count, speed)?);
        Ok((0..a.len()).map(|i| first[i] + inner[i] + last[i]).collect())
    }

    /// The first times at which the arc length is s, by Newton's method with bisection as a safeguard.
    ///
    /// Arc lengths must be between 0 and the length of the curve. Times on curves that failed are NaN.
    pub fn times_at<F: Integrand + ?Sized>(&self, s: &[f64], speed: &mut F) -> Result<Vec<f64>, F::Error> {
        let count = s.len() / self.curves;
        let mut x = vec![f64::NAN; s.len()];
        let mut sought: Vec<Option<Bracket>> = Vec::with_capacity(s.len());
        for (i, s) in s.iter().enumerate() {
            let [times, lengths] = self.row(i / count);
            let total = lengths[lengths.len() - 1];
            // Rounding must not move a time from the start of a rest to its end.
            let reached = s - 4.0 * f64::EPSILON * total;
            let k = interval(lengths, |length| length < reached);
            let (a, b, low, high) = (times[k], times[k + 1], lengths[k], lengths[k + 1]);
            // The ends of an interval are known: the table has their arc lengths.
            if total.is_nan() {
                sought.push(None);
            } else if *s <= low || *s >= high {
                x[i] = if *s <= low { a } else { b };
                sought.push(None);
            } else {
                let ahead = s - low;
                x[i] = (a + (ahead / (high - low)).clamp(0.0, 1.0) * (b - a)).clamp(a, b);
                sought.push(Some(Bracket { start: a, ends: [a, b], ahead, tol: 4.0 * f64::EPSILON * total }));
            }
        }
        for _ in 0..STEPS {
            // Columns in which a time is sought for some curve.
            let active: Vec<usize> =
                (0..count).filter(|j| (0..self.curves).any(|c| sought[c * count + j].is_some())).collect();
            if active.is_empty() {
                break;
            }
            let places: Vec<usize> =
                (0..self.curves).flat_map(|c| active.iter().map(move |j| c * count + j)).collect();
            let at: Vec<f64> = places
                .iter()
                .map(|&i| if x[i].is_nan() { self.row(i / count)[0][0] } else { x[i] })
                .collect();
            let starts: Vec<f64> = places
                .iter()
                .zip(&at)
                .map(|(&i, x)| sought[i].as_ref().map_or(*x, |bracket| bracket.start))
                .collect();
            let lengths = rule(&starts, &at, active.len(), speed)?;
            let mut rates = vec![0.0; at.len()];
            speed.at(Times { x: &at, count: active.len() }, &mut rates)?;
            for (k, &i) in places.iter().enumerate() {
                if let Some(bracket) = &mut sought[i] {
                    let (next, done) = bracket.step(x[i], lengths[k], rates[k]);
                    x[i] = next;
                    if done {
                        sought[i] = None;
                    }
                }
            }
        }
        Ok(x)
    }
}

/// A time that is sought: the start of its interval, times on both sides of it, the length to it from the start, and
/// the tolerance of this length.
struct Bracket {
    start: f64,
    ends: [f64; 2],
    ahead: f64,
    tol: f64,
}

impl Bracket {
    /// The next estimate, given the length from the start to x and the speed there, and whether it is the last one.
    fn step(&mut self, x: f64, length: f64, speed: f64) -> (f64, bool) {
        let error = length - self.ahead;
        if error <= 0.0 {
            self.ends[0] = x;
        }
        if error >= 0.0 {
            self.ends[1] = x;
        }
        let [low, high] = self.ends;
        let step = x - error / speed;
        let next = if low < step && step < high { step } else { low / 2.0 + high / 2.0 };
        let near = x.abs().next_up() - x.abs();
        let done = error.abs() <= self.tol || (step - x).abs() <= near || high - low <= 2.0 * near;
        (if done { x } else { next }, done)
    }
}

/// The interval between the entries of a table that contains a value, given which entries lie before it.
fn interval(table: &[f64], before: impl Fn(f64) -> bool) -> usize {
    table.partition_point(|&entry| before(entry)).saturating_sub(1).min(table.len() - 2)
}
