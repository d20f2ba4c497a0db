//! Statistics of the residuals of a curve, from which tests decide whether its assumptions hold.

use crate::chain;
use crate::frames::lanes_of;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{LANES, Lane, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// ∫(1 + x⁴)⁻² / ∫(1 + x⁴)⁻¹: the information per local degree of freedom.
const RATIO: f64 = 0.75;

/// Sizes of residuals, in standard deviations, from which data are far from a curve, and up to which they are near it.
const FAR: f64 = 4.0;
const NEAR: f64 = 3.0;
/// The number of data between parts that are far from the curve, and the number of such parts that are compared.
const BETWEEN: usize = 30;
const PARTS: usize = 3;
/// The ratio of squared distances from which on a datum is near another curve.
const NEARER: f64 = 0.1;

/// Statistics of the residuals of one curve, scaled to weight one.
pub struct ResidualStatistics {
    /// The median of the squared lengths of the residuals, and that of the squared deviations from neighbours.
    pub medians: [f64; 2],
    /// The mean square of a component, and the mean product of components of neighbours, without residuals beyond the
    /// limit.
    pub square: f64,
    /// See `square`.
    pub lagged: f64,
    /// The number of these products.
    pub products: usize,
    /// The largest component of every residual.
    pub sizes: Vec<f64>,
}

impl ResidualStatistics {
    /// For residuals with d components, which are NaN without information. `limit` is that of the largest component
    /// relative to the standard deviation, given the square of the latter divided by the first median.
    pub fn new(rows: &[f64], d: usize, neighbours: &[f64], limit: f64, variance: f64) -> Self {
        let rows = || rows.chunks_exact(d.max(1));
        let known = |row: &[f64]| row.iter().copied().filter(|x| x.is_finite()).collect::<Vec<f64>>();
        let square = |row: &[f64]| known(row).iter().map(|x| x * x).sum::<f64>();
        let lengths = rows().filter(|row| row.iter().any(|x| x.is_finite())).map(square).collect();
        let medians = [lengths, neighbours.to_vec()].map(median);
        let sizes: Vec<f64> =
            rows().map(|row| known(row).iter().map(|x| x.abs()).fold(0.0, f64::max)).collect();
        let most = limit * (variance * medians[0]).sqrt();
        // A median of zero has no limit.
        let inner = |size: &f64| !(*size > most) || medians[0] == 0.0;
        let (mut sums, mut counts, mut before) = ([0.0; 2], [0; 2], None);
        for (row, size) in rows().zip(&sizes) {
            let own = inner(size).then_some(row);
            for (c, x) in own.into_iter().flatten().enumerate().filter(|(_, x)| x.is_finite()) {
                (sums[0], counts[0]) = (sums[0] + x * x, counts[0] + 1);
                let earlier: Option<&[f64]> = before;
                if let Some(y) = earlier.map(|row| row[c]).filter(|y| y.is_finite()) {
                    (sums[1], counts[1]) = (sums[1] + x * y, counts[1] + 1);
                }
            }
            before = own;
        }
        let mean = |k: usize| sums[k] / counts[k].max(1) as f64;
        ResidualStatistics { medians, square: mean(0), lagged: mean(1), products: counts[1].max(1), sizes }
    }
}

/// The data of one curve and the points of the curve at their times.
pub struct AtData<'a> {
    /// Times of the data.
    pub times: &'a [f64],
    /// Points of the curve.
    pub at: &'a [f64],
    /// Data.
    pub points: &'a [f64],
    /// Their weights.
    pub weights: &'a [f64],
}

impl AtData<'_> {
    /// Coordinates of the residuals in frames at the curve, and the squared deviations of data from the geodesics between
    /// their neighbours, divided by their variances for noise of variance one at weight one. They are NaN for data
    /// without weight; deviations also at the ends.
    pub fn residuals(&self, space: &Erased) -> [Vec<f64>; 2] {
        checkpoint();
        let (n, len, m) = (self.times.len(), space.point_len(), space.dim());
        let row = |rows: &'_ [f64], i: usize| rows[i * len..][..len].iter().all(|x| x.is_finite());
        let used: Vec<usize> =
            (0..n).filter(|&i| self.weights[i] > 0.0 && row(self.at, i) && row(self.points, i)).collect();
        let [mut residuals, mut deviations] = [vec![f64::NAN; n * m], vec![f64::NAN; n]];
        let [mut p, mut q, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
        let (mut frame, mut x) = (vec![Lane::ZERO; space.frame_len()], vec![Lane::ZERO; m]);
        let mut rows = vec![0.0; LANES * m];
        for group in 0..used.len().div_ceil(LANES) {
            let at = lanes_of(group, used.len()).map(|k| used[k]);
            gather(at.map(|i| &self.at[i * len..][..len]), &mut p);
            gather(at.map(|i| &self.points[i * len..][..len]), &mut q);
            space.log(&p, &q, &mut v);
            space.lift(&p, &mut frame);
            space.coordinates(&frame, &p, &v, &mut x);
            scatter(&x, &mut rows);
            for (i, row) in at.iter().zip(rows.chunks_exact(m.max(1))) {
                residuals[i * m..][..m].copy_from_slice(row);
            }
        }
        let squares = chain::deviations(space, self.times, self.points, &used);
        for (square, own) in squares[1.min(squares.len())..].iter().zip(used.windows(3)) {
            let [a, b, c] = [0, 1, 2].map(|k| self.times[own[k]]);
            let [before, here, after] = [0, 1, 2].map(|k| 1.0 / self.weights[own[k]]);
            let share = (b - a) / (c - a);
            if c > a {
                let variance = here + share.powi(2) * after + (1.0 - share).powi(2) * before;
                deviations[own[1]] = square / variance;
            }
        }
        [residuals, deviations]
    }

    /// The first and the last datum of a part that a robust loss may have selected wrongly, given the sizes of all
    /// residuals in standard deviations: data before and after it are far from the curve, but near a curve without it.
    ///
    /// A smooth curve that follows a run of displaced data leaves the data beside them. So does one that follows a part
    /// of a motion that is too fast for it.
    pub fn bypassed(&self, space: &Erased, sizes: &[f64]) -> Option<[usize; 2]> {
        let used: Vec<usize> = (0..self.times.len()).filter(|&i| self.weights[i] > 0.0).collect();
        let size = |k: usize| sizes[used[k]];
        // Parts of data that are far from the curve; one datum nearby does not end a part.
        let mut parts: Vec<[usize; 2]> = Vec::new();
        for k in (0..used.len()).filter(|&k| size(k) > FAR) {
            match parts.last_mut().filter(|part| k - part[1] <= 2) {
                Some(part) => part[1] = k,
                None => parts.push([k, k]),
            }
        }
        let near = |k: usize| size(k) < NEAR;
        parts.iter().enumerate().find_map(|(number, first)| {
            let before = (1..first[0]).rev().find(|&k| near(k) && near(k - 1))?;
            parts[number + 1..].iter().take(PARTS).find_map(|last| {
                checkpoint();
                let after = (last[1] + 1..used.len() - 1).find(|&k| near(k) && near(k + 1))?;
                let inner = [first[1] + 1, last[0] - 1];
                if inner[1] - inner[0] >= BETWEEN {
                    return None;
                }
                let path = self.bridge(&used, [before - 1, after + 1])?;
                let nearer = |k: usize| {
                    let whole = self.distance(space, used[k], None);
                    size(k) > FAR && self.distance(space, used[k], Some(&path)) < NEARER * whole
                };
                let both = [first, last].iter().all(|part| (part[0]..=part[1]).any(nearer));
                both.then(|| inner.map(|k| used[k]))
            })
        })
    }

    /// Four points of the curve, from which a cubic passes over a part: the two nodes before and after it, one before them,
    /// and one after them, half as far away as the nodes are apart.
    fn bridge(&self, used: &[usize], nodes: [usize; 2]) -> Option<[usize; 4]> {
        let [from, to] = nodes.map(|k| self.times[used[k]]);
        let half = 0.5 * (to - from);
        let before = used[..nodes[0]].iter().rev().find(|&&i| self.times[i] <= from - half);
        let before = before.or(used.first()).copied()?;
        let after = used[nodes[1] + 1..].iter().find(|&&i| self.times[i] >= to + half);
        let after = after.or(used.last()).copied()?;
        let found = [before, used[nodes[0]], used[nodes[1]], after];
        found.windows(2).all(|pair| self.times[pair[1]] > self.times[pair[0]]).then_some(found)
    }

    /// The squared distance of a datum from the curve, or from the cubic through four of its points in the tangent space
    /// at the second of them.
    fn distance(&self, space: &Erased, datum: usize, nodes: Option<&[usize; 4]>) -> f64 {
        let len = space.point_len();
        let row =
            |rows: &[f64], i: usize| rows[i * len..][..len].iter().map(|x| lane(*x)).collect::<Vec<Lane>>();
        let y = row(self.points, datum);
        let mut v = vec![Lane::ZERO; len];
        let mut p = row(self.at, nodes.map_or(datum, |nodes| nodes[1]));
        if let Some(nodes) = nodes {
            let mut whole = vec![Lane::ZERO; len];
            for &node in nodes {
                let ratio = |other: &usize| {
                    (self.times[datum] - self.times[*other]) / (self.times[node] - self.times[*other])
                };
                let weight: f64 = nodes.iter().filter(|other| **other != node).map(ratio).product();
                if node != nodes[1] {
                    space.log(&p, &row(self.at, node), &mut v);
                    whole.iter_mut().zip(&v).for_each(|(sum, v)| *sum += lane(weight) * *v);
                }
            }
            let start = p.clone();
            space.ray(&start, &whole, Lane::ONE, &mut p);
        }
        let angle = space.log(&p, &y, &mut v);
        let apart = space.distance(&p, &y, &v, angle).as_array()[0];
        if apart.is_nan() { f64::INFINITY } else { apart * apart }
    }
}

/// The median of the finite numbers; NaN if there are none.
pub fn median(values: Vec<f64>) -> f64 {
    let mut own: Vec<f64> = values.into_iter().filter(|x| x.is_finite()).collect();
    if own.is_empty() {
        return f64::NAN;
    }
    let middle = own.len() / 2;
    let above = *own.select_nth_unstable_by(middle, f64::total_cmp).1;
    if own.len() % 2 == 1 {
        return above;
    }
    0.5 * (above + own[..middle].iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

/// A test of equal ratios of sums of squares to degrees of freedom in bins of data.
pub struct Unequal {
    /// χ² transformed to a standard normal score (Wilson & Hilferty 1931).
    pub score: f64,
    /// The first and the last datum of the bins with the largest ratios.
    pub place: [usize; 2],
    /// The ratio in these bins, divided by the ratio of all data.
    pub ratio: f64,
}

/// The smallest number of data, and of degrees of freedom of the curve and of the residuals per coordinate, for the tests.
const DATA: usize = 100;
const FREEDOM: f64 = 13.0;
/// The least number of local degrees of freedom of a bin.
const BIN: f64 = 6.0;

/// The tests of constant smoothness and of constant noise for a curve with the given knots and energies, see [`Recording`],
/// and data with weights; None if there are too few data. Leverages and squared residuals refer to weight one.
pub fn is_constant(
    times: &[f64],
    weights: &[f64],
    leverages: &[f64],
    squares: &[f64],
    [knots, energy]: [&[f64]; 2],
    m: usize,
) -> Option<[Unequal; 2]> {
    checkpoint();
    let used: Vec<usize> = (0..times.len()).filter(|&i| weights[i] > 0.0).collect();
    let weighted = |x: &[f64]| used.iter().map(|&i| weights[i] * x[i]).collect::<Vec<f64>>();
    let (times, leverages, squares) =
        (used.iter().map(|&i| times[i]).collect::<Vec<f64>>(), weighted(leverages), weighted(squares));
    let freedom: f64 = leverages.iter().sum();
    let total: f64 = squares.iter().sum();
    let enough = used.len() >= DATA && freedom >= FREEDOM && used.len() as f64 - freedom >= FREEDOM;
    if !enough || !total.is_finite() || total == 0.0 {
        return None;
    }
    let (times, leverages, squares) = (&times[..], &leverages[..], &squares[..]);
    let recording = Recording { times, leverages, squares, knots, energy, m };
    let of_data = |found: Unequal| Unequal { place: found.place.map(|k| used[k]), ..found };
    Some([recording.smoothness(BIN), recording.noise(BIN)].map(of_data))
}

/// A curve with its data: what the tests of constant smoothness and constant noise depend on.
pub struct Recording<'a> {
    /// Times of the data.
    pub times: &'a [f64],
    /// Leverages of the data.
    pub leverages: &'a [f64],
    /// Squared residuals, scaled to weight one.
    pub squares: &'a [f64],
    /// Knots, and the squared acceleration integrated up to each knot.
    pub knots: &'a [f64],
    /// See `knots`.
    pub energy: &'a [f64],
    /// The number of coordinates.
    pub m: usize,
}

impl Recording<'_> {
    /// The test of constant smoothness, in bins of at least so many local degrees of freedom.
    pub fn smoothness(&self, least: f64) -> Unequal {
        let ends = bins(self.leverages, least);
        let df: f64 = self.leverages.iter().sum();
        // Two degrees of freedom per coordinate belong to geodesics, which have no energy.
        let bent = (df - 2.0).max(0.0) / df;
        let freedom: Vec<f64> = sums(self.leverages, &ends).iter().map(|x| x * bent).collect();
        let information: Vec<f64> = freedom.iter().map(|x| self.m as f64 * x / RATIO).collect();
        // Bins end at the times midway between their last datum and the next one.
        let last = self.times.len() - 1;
        let until =
            |&end: &usize| self.energy_until(0.5 * (self.times[end] + self.times[(end + 1).min(last)]));
        let energies: Vec<f64> = ends.iter().map(until).collect();
        let before = [0.0].into_iter().chain(energies.iter().copied());
        let energies: Vec<f64> = energies.iter().zip(before).map(|(x, y)| x - y).collect();
        unequal(&energies, &freedom, &information, &ends, 0)
    }

    /// The same for the noise, and degrees of freedom of the residuals.
    pub fn noise(&self, least: f64) -> Unequal {
        let of = |factor: f64| self.leverages.iter().map(|h| 1.0 - factor * h).collect::<Vec<f64>>();
        let left = of(1.0);
        let ends = bins(&left, least);
        let freedom = sums(&left, &ends);
        let information = sums(&of(2.0 - RATIO), &ends);
        let of_bin = |(f, x): (&f64, f64)| self.m as f64 * f * f / x.max(1e-3 * f);
        let information: Vec<f64> = freedom.iter().zip(information).map(of_bin).collect();
        // The first and the last bin do not count, because natural ends cannot follow a motion that accelerates there.
        unequal(&sums(self.squares, &ends), &freedom, &information, &ends, 1)
    }

    fn energy_until(&self, time: f64) -> f64 {
        let after = self.knots.partition_point(|knot| *knot <= time).clamp(1, self.knots.len() - 1);
        let (a, b) = (self.knots[after - 1], self.knots[after]);
        let share = ((time - a) / (b - a)).clamp(0.0, 1.0);
        self.energy[after - 1] + share * (self.energy[after] - self.energy[after - 1])
    }
}

/// An isolated outlier, given the residuals of data of m coordinates in the order of time: it is far from its neighbours, which
/// agree without it.
pub fn isolated_outlier(times: &[f64], residuals: &[f64], deviations: &[f64], m: usize) -> Option<usize> {
    /// Data on either side that determine the noise, and the squared limits for the outlier and for its neighbours, in
    /// standard deviations of a coordinate.
    const BESIDE: usize = 20;
    const FAR: f64 = 64.0;
    const AGREE: f64 = 12.0;
    let used: Vec<usize> = (0..times.len()).filter(|&k| deviations[k].is_finite()).collect();
    let row = |k: usize| &residuals[k * m..][..m];
    // The squared deviation of b from the line through a and c, per coordinate and in the unit of the deviations.
    let off = |a: usize, b: usize, c: usize| {
        let whole = times[c] - times[a];
        let share = if whole > 0.0 { (times[b] - times[a]) / whole } else { 0.5 };
        let rest = row(b).iter().zip(row(a)).zip(row(c)).map(|((b, a), c)| b - share * c - (1.0 - share) * a);
        let variance = 1.0 + share * share + (1.0 - share) * (1.0 - share);
        rest.map(|x| x * x).sum::<f64>() / (m as f64 * variance)
    };
    let usual = median_of_chi_squared(m) / m as f64;
    let mut squares: Vec<f64> = vec![f64::NAN; used.len()];
    for i in 1..used.len().saturating_sub(1) {
        squares[i] = off(used[i - 1], used[i], used[i + 1]);
    }
    (3..used.len().saturating_sub(3))
        .find(|&i| {
            checkpoint();
            let near = &squares[i.saturating_sub(BESIDE)..(i + BESIDE + 1).min(squares.len())];
            let scale = median(near.to_vec()) / usual;
            let k = |offset: isize| used[i.wrapping_add_signed(offset)];
            let extra = 1.0 / m as f64;
            scale > 0.0
                && squares[i] > FAR * (1.0 + extra) / 2.0 * scale
                && off(k(-2), k(-1), k(1)) < AGREE * scale
                && off(k(-1), k(1), k(2)) < AGREE * scale
        })
        .map(|i| used[i])
}

/// The median of χ² with m degrees of freedom (Wilson and Hilferty 1931).
fn median_of_chi_squared(m: usize) -> f64 {
    let m = m as f64;
    m * (1.0 - 2.0 / (9.0 * m)).powi(3)
}

/// Whether the noise varies, from squared deviations of data from their neighbours in m coordinates, in which motion hardly
/// shows; NaN for unknown ones.
pub fn noise_varies(deviations: &[f64], m: usize) -> bool {
    /// The least number of squares of a bin, the limit of the score, and the ratio below which the noise hardly varies.
    const LEAST: f64 = 60.0;
    const SCORE: f64 = 4.75;
    const RATIO: f64 = 2.0;
    /// The variance of a mean of these squares, in units of that of independent ones: 1 + 2 Σ ρ² with the correlations −2/3 and
    /// 1/6 of deviations at equal steps.
    const CORRELATED: f64 = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0);
    if deviations.is_empty() {
        return false;
    }
    let known: Vec<f64> = deviations.iter().map(|x| f64::from(x.is_finite())).collect();
    let squares: Vec<f64> = deviations.iter().map(|x| if x.is_finite() { *x } else { 0.0 }).collect();
    let ends = bins(&known, LEAST / m as f64);
    let counts = sums(&known, &ends);
    let information: Vec<f64> = counts.iter().map(|count| m as f64 * count / CORRELATED).collect();
    let found = unequal(&sums(&squares, &ends), &counts, &information, &ends, 0);
    found.score > SCORE && found.ratio > RATIO
}

/// The last datum of each bin of at least so many degrees of freedom.
fn bins(freedom: &[f64], least: f64) -> Vec<usize> {
    let total: f64 = freedom.iter().sum();
    let count = ((total / least) as usize).max(1);
    let (mut ends, mut sum) = (Vec::with_capacity(count), 0.0);
    for (i, x) in freedom.iter().enumerate() {
        sum += x;
        if sum >= total * (ends.len() + 1) as f64 / count as f64 && ends.len() + 1 < count {
            ends.push(i);
        }
    }
    ends.push(freedom.len() - 1);
    ends.dedup();
    ends
}

/// The sums over bins.
fn sums(values: &[f64], ends: &[usize]) -> Vec<f64> {
    let starts = [0].into_iter().chain(ends.iter().map(|end| end + 1));
    starts.zip(ends).map(|(start, end)| values[start..=*end].iter().sum()).collect()
}

/// The test without `margin` bins at either end.
fn unequal(sums: &[f64], freedom: &[f64], information: &[f64], ends: &[usize], margin: usize) -> Unequal {
    let none = Unequal { score: 0.0, place: [0, 0], ratio: 1.0 };
    let count = sums.len();
    if count < 2 * margin + 2 {
        return none;
    }
    let own = margin..count - margin;
    let (sums, freedom, information) = (&sums[own.clone()], &freedom[own.clone()], &information[own]);
    let total = |x: &[f64]| x.iter().sum::<f64>();
    if !(total(sums) > 0.0) {
        return none;
    }
    let usual = total(sums) / total(freedom);
    let score = |(k, n): (usize, &f64)| {
        let variance = 2.0 / (9.0 * n);
        ((sums[k] / (freedom[k] * usual)).cbrt() - (1.0 - variance)) / variance.sqrt()
    };
    let mut z: Vec<f64> = information.iter().enumerate().map(score).collect();
    let roots: Vec<f64> = information.iter().map(|n| n.sqrt()).collect();
    let mean = z.iter().zip(&roots).map(|(z, root)| z * root).sum::<f64>() / total(&roots);
    z.iter_mut().for_each(|z| *z -= mean);
    let degrees = (z.len() - 1) as f64;
    let spread = 2.0 / (9.0 * degrees);
    let squares = z.iter().map(|z| z * z).sum::<f64>();
    let score = ((squares / degrees).cbrt() - (1.0 - spread)) / spread.sqrt();
    let largest = (0..z.len()).max_by(|&a, &b| z[a].total_cmp(&z[b])).unwrap_or(0);
    let (mut first, mut last) = (largest, largest);
    while first > 0 && z[first - 1] > 1.0 {
        first -= 1;
    }
    while last + 1 < z.len() && z[last + 1] > 1.0 {
        last += 1;
    }
    let ratio = total(&sums[first..=last]) / total(&freedom[first..=last]) / usual;
    let start = (first + margin).checked_sub(1).map_or(0, |bin| ends[bin] + 1);
    Unequal { score, place: [start, ends[last + margin]], ratio }
}
