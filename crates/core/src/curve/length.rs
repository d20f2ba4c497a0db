//! Integrals along curves, accurate up to rounding errors: lengths, bending energies, and time as a function of length.
//!
//! Arrays have one row per curve; all rows of an array are equally long.

use super::data::Times;

/// The number of positive nodes of the Gauss–Legendre rule, which is applied to an interval and to its halves.
const PAIRS: usize = 5;
/// Its nodes and weights on [−1, 1]; the others are symmetric.
const NODES: [f64; PAIRS] =
    [0.14887433898163122, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717];
const WEIGHTS: [f64; PAIRS] =
    [0.29552422471475287, 0.26926671930999635, 0.21908636251598204, 0.1494513491505806, 0.06667134430868814];
/// Rounds in which the error may fail to halve, before it counts as a rounding error.
const PATIENCE: usize = 5;
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

/// Intervals in columns, and the integrals over their two halves.
struct Panels {
    a: Vec<f64>,
    middle: Vec<f64>,
    b: Vec<f64>,
    left: Vec<f64>,
    right: Vec<f64>,
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

/// The integrals over intervals from a to b, in rows of `count`.
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
        for (k, own) in values.chunks(2 * PAIRS).enumerate() {
            let i = k / width * count + first + k % width;
            let sum = WEIGHTS.iter().zip(own.as_chunks::<2>().0).map(|(weight, [x, y])| weight * (x + y));
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

/// Calls `f` with intervals that cover all segments, in any order, and integrals to the relative tolerance `rtol`.
///
/// Intervals are halved until the integral over them is that over their halves, for all curves if one of them needs it.
/// The speed of a curve has a kink where the curve stops and turns; bisection then converges to the kink. An error that
/// does not decrease for several rounds is a rounding error, and ends the bisection.
fn panels<F: Integrand + ?Sized>(
    knots: &[f64],
    curves: usize,
    rtol: f64,
    f: &mut F,
    mut finished: impl FnMut(&Panels),
) -> Result<(), F::Error> {
    let nodes = knots.len() / curves;
    let mut a: Vec<f64> = knots.chunks(nodes).flat_map(|row| &row[..nodes - 1]).copied().collect();
    let mut b: Vec<f64> = knots.chunks(nodes).flat_map(|row| &row[1..]).copied().collect();
    let mut whole = rule(&a, &b, nodes - 1, f)?;
    let absolute = |row: &[f64]| sum(&row.iter().map(|x| x.abs()).collect::<Vec<_>>());
    let scale: Vec<f64> = whole.chunks(nodes - 1).map(absolute).collect();
    let (mut before, mut stalled) = (vec![f64::INFINITY; curves], vec![0; curves]);
    loop {
        let count = a.len() / curves;
        let middle: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a / 2.0 + b / 2.0).collect();
        // Both halves in one call.
        let halves = rule(&beside(&a, &middle, curves), &beside(&middle, &b, curves), 2 * count, f)?;
        let half =
            |e: usize| halves.chunks(2 * count).flat_map(|row| &row[e * count..][..count]).copied().collect();
        let [left, right]: [Vec<f64>; 2] = [half(0), half(1)];
        let mut rough = vec![false; count];
        for c in 0..curves {
            let row = c * count..(c + 1) * count;
            let errors: Vec<f64> = row.map(|i| (left[i] + right[i] - whole[i]).abs()).collect();
            let error = sum(&errors);
            stalled[c] +=
                usize::from(error.partial_cmp(&(before[c] / 2.0)).is_none_or(|order| order.is_gt()));
            before[c] = error;
            if stalled[c] <= PATIENCE {
                rough.iter_mut().zip(&errors).for_each(|(rough, error)| *rough |= *error > rtol * scale[c]);
            }
        }
        let found = Panels { a, middle, b, left, right };
        if !rough.contains(&true) {
            finished(&found);
            return Ok(());
        }
        let smooth: Vec<bool> = rough.iter().map(|rough| !rough).collect();
        let some = |kept: &[bool]| {
            let [a, middle, b, left, right] =
                [&found.a, &found.middle, &found.b, &found.left, &found.right].map(|x| columns(x, kept));
            Panels { a, middle, b, left, right }
        };
        if smooth.contains(&true) {
            finished(&some(&smooth));
        }
        let split = some(&rough);
        a = beside(&split.a, &split.middle, curves);
        b = beside(&split.middle, &split.b, curves);
        whole = beside(&split.left, &split.right, curves);
    }
}

/// The integrals of a function over all segments of every curve, to the relative tolerance `rtol`.
pub fn lengths<F: Integrand + ?Sized>(
    knots: &[f64],
    curves: usize,
    rtol: f64,
    f: &mut F,
) -> Result<Vec<f64>, F::Error> {
    let mut total = vec![0.0; curves];
    panels(knots, curves, rtol, f, |own| {
        let count = own.a.len() / total.len();
        let halves: Vec<f64> = own.left.iter().zip(&own.right).map(|(left, right)| left + right).collect();
        total.iter_mut().zip(halves.chunks(count)).for_each(|(total, row)| *total += sum(row));
    })?;
    Ok(total)
}

/// The square of a function, in units of the domain, in which it neither overflows nor underflows.
struct Power<'a, F: ?Sized> {
    root: &'a mut F,
    units: &'a [f64],
}

impl<F: Integrand + ?Sized> Integrand for Power<'_, F> {
    type Error = F::Error;

    fn at(&mut self, times: Times, values: &mut [f64]) -> Result<(), F::Error> {
        self.root.at(times, values)?;
        for (row, unit) in values.chunks_mut(times.count).zip(self.units) {
            for x in row {
                let bend = *x * unit * unit;
                *x = bend * bend / unit;
            }
        }
        Ok(())
    }
}

/// The bending energies ∫ |∇γ'|² dt, (1), given |∇γ'|.
pub fn energies<F: Integrand + ?Sized>(
    knots: &[f64],
    curves: usize,
    rtol: f64,
    f: &mut F,
) -> Result<Vec<f64>, F::Error> {
    let nodes = knots.len() / curves;
    let units: Vec<f64> = knots.chunks(nodes).map(|row| row[nodes - 1] - row[0]).collect();
    let found = lengths(knots, curves, rtol, &mut Power { root: f, units: &units })?;
    Ok(found.iter().zip(&units).map(|(energy, unit)| energy / unit / unit / unit).collect())
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
        let mut rows: Vec<Vec<(f64, f64)>> = vec![Vec::new(); curves];
        panels(knots, curves, rtol, speed, |own| {
            let count = own.a.len() / curves;
            for (c, row) in rows.iter_mut().enumerate() {
                let row_of = c * count..(c + 1) * count;
                row.extend(row_of.flat_map(|i| [(own.a[i], own.left[i]), (own.middle[i], own.right[i])]));
            }
        })?;
        let nodes = knots.len() / curves;
        let (mut times, mut lengths) = (Vec::new(), Vec::new());
        for (row, knots) in rows.iter_mut().zip(knots.chunks(nodes)) {
            row.sort_by(|x, y| x.0.total_cmp(&y.0));
            let mut length = 0.0;
            for (start, part) in row {
                times.push(*start);
                lengths.push(length);
                length += *part;
            }
            times.push(knots[nodes - 1]);
            lengths.push(length);
        }
        Ok(ArcLength { curves, times, lengths })
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
                .map(|(&i, x)| sought[i].as_ref().map_or(*x, |own| own.start))
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
