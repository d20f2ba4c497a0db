//! The cheapest chain through the data, which selects data without outliers before a curve is known.
//!
//! Dynamic programming finds the subset of data with the lowest cost. Two successive data of the chain cost
//! `(d²/(4τ))²`, where d is their distance, and τ the scale of squared distances of pairs that are as far apart in
//! time. An omitted datum has a fixed cost. A run of outliers is omitted if the steps at its start and its end are
//! longer than the path moves in that time. Up to half of the data may be outliers, because τ is a low quantile.
//!
//! In a second chain, the error of the extrapolation from the last data of the chain replaces the distance where such
//! errors are smaller along the first chain. Precise data thus show runs of outliers that the path could reach.

use crate::frames::lanes_of;
use crate::problem::Data;
use symspline_core::scalar::{LANES, Lane, gather};
use symspline_core::space::{Ambient, Erased};

/// The number of data that may separate two neighbours of the chain.
const WINDOW: usize = 64;
/// The cost of an omitted datum.
const SKIPPED: f64 = 2.0;
/// The squared distance, in units of τ, of a pair of cost one.
const UNIT: f64 = 4.0;
/// The largest cost of a pair. It is finite, so that a chain exists.
const MOST: f64 = 1e6;
/// The number of intervals of the time between two data in which τ is estimated.
const BINS: usize = 40;
/// The number of pairs that suffice for τ.
const PAIRS: usize = 16_000;
/// Fewer data do not determine the scale, and all of them are selected.
const FEW: usize = 12;
/// The number of data before and after a datum from which its speed is estimated.
const AROUND: usize = 16;
/// The numbers of steps between the data of a pair from which the speed is estimated. They are small, so that few pairs
/// extend across the border of a run of outliers.
const SPEED: [usize; 2] = [3, 4];
/// The numbers of steps between the data of more distant pairs. If the data move, their squared distances exceed those
/// of neighbours at least by the ratio `MOVES`. The ratio is 25 for a steady motion, and 1 for noise and unrelated
/// points.
const DISTANT: [usize; 3] = [4, 5, 6];
const MOVES: f64 = 8.0;
/// The squared error of an extrapolation, relative to the expected one, of a pair of cost one.
const SURPRISE: f64 = 36.0;

/// Ones for the data of the chain, zeros for others and for data without weight.
pub fn chain(space: &Erased, data: &Data) -> Vec<f64> {
    let used: Vec<usize> = (0..data.times.len()).filter(|&i| data.weights[i] > 0.0).collect();
    let mut kept = vec![0.0; data.times.len()];
    let times: Vec<f64> = used.iter().map(|&i| data.times[i]).collect();
    if used.len() < FEW || times[0] == times[times.len() - 1] {
        used.iter().for_each(|&i| kept[i] = 1.0);
        return kept;
    }
    let apart = |pairs: &[(usize, usize)]| squares(space, data.points, &used, pairs);
    let window = WINDOW.min(used.len() - 1);
    let scale = Scale::new(&times, window, apart);
    let speeds = speeds(&times, apart);
    // Squared distances and squared errors of extrapolations of cost one.
    let near = |&(j, i): &(usize, usize)| {
        let time = times[i] - times[j];
        UNIT * scale.at(time).max(speeds[i].max(speeds[j]) * time * time)
    };
    let cost = |(square, limit): (f64, f64)| ((square / limit).powi(2)).min(MOST);
    let first = cheapest(used.len(), window, |pairs, _| {
        apart(pairs).into_iter().zip(pairs.iter().map(near)).map(cost).collect()
    });
    let mut steps = Steps::new(space, data.points, &used, &times);
    let surprise = Surprise::new(&mut steps, &first, resolution(space, data).powi(2));
    let second = cheapest(used.len(), window, |pairs, before| {
        let last = pairs[pairs.len() - 1];
        if last.0 + 1 == last.1 {
            steps.extend(last.0, before);
        }
        let sharper = |pair: &(usize, usize)| {
            let (limit, rule) = surprise.expected(&steps, *pair);
            let limit = (SURPRISE * limit).max(f64::MIN_POSITIVE);
            let plain = near(pair);
            if limit < plain { (limit, rule) } else { (plain, Rule::default()) }
        };
        let (limits, rules): (Vec<f64>, Vec<Rule>) = pairs.iter().map(sharper).unzip();
        steps.errors(pairs, &rules).into_iter().zip(limits).map(cost).collect()
    });
    second.into_iter().for_each(|i| kept[used[i]] = 1.0);
    kept
}

/// The chain of data with the lowest cost, in the order of time. `costs` returns the costs of pairs of data with the
/// same second datum; the predecessors of all data before it in their cheapest chains are known.
fn cheapest(
    count: usize,
    window: usize,
    mut costs: impl FnMut(&[(usize, usize)], &[Option<usize>]) -> Vec<f64>,
) -> Vec<usize> {
    let (mut totals, mut before) = (vec![0.0; count], vec![None; count]);
    for i in 1..count {
        // The chain may begin here if the window reaches the first datum.
        totals[i] = if i <= window { SKIPPED * i as f64 } else { f64::INFINITY };
        let first = i.saturating_sub(window);
        let mut end = i;
        // Near data come first: few omitted ones are usually cheaper than many, whatever the step costs.
        while end > first {
            let pairs: Vec<(usize, usize)> =
                (end.saturating_sub(LANES).max(first)..end).map(|j| (j, i)).collect();
            end = pairs[0].0;
            let without = |j: usize| totals[j] + SKIPPED * (i - j - 1) as f64;
            if pairs.iter().all(|(j, _)| without(*j) > totals[i]) {
                continue;
            }
            for ((j, _), cost) in pairs.iter().zip(costs(&pairs, &before)).rev() {
                let total = totals[*j] + SKIPPED * (i - j - 1) as f64 + cost;
                // Of several equally cheap chains, the one with the longest step is kept.
                if total < totals[i] || (total == totals[i] && before[i].is_some()) {
                    (totals[i], before[i]) = (total, Some(*j));
                }
            }
        }
    }
    let last = count - 1;
    let total = |i: &usize| totals[*i] + SKIPPED * (last - i) as f64;
    let mut at = (last - window..=last).min_by(|a, b| total(a).total_cmp(&total(b)));
    let mut chain: Vec<usize> = std::iter::from_fn(|| {
        let i = at?;
        at = before[i];
        Some(i)
    })
    .collect();
    chain.reverse();
    chain
}

/// Data, each with its two predecessors in a chain.
struct Steps<'a> {
    space: &'a Erased<'a>,
    points: &'a [f64],
    used: &'a [usize],
    times: &'a [f64],
    /// The times from the predecessors to the datum; 0 without predecessors.
    since: Vec<[f64; 2]>,
    /// The logarithms of the predecessors at the datum.
    back: [Vec<f64>; 2],
}

impl<'a> Steps<'a> {
    fn new(space: &'a Erased<'a>, points: &'a [f64], used: &'a [usize], times: &'a [f64]) -> Self {
        let back = [(); 2].map(|_| vec![0.0; used.len() * space.point_len()]);
        Steps { space, points, used, times, since: vec![[0.0; 2]; used.len()], back }
    }

    fn row(&self, i: usize) -> &[f64] {
        let len = self.space.point_len();
        &self.points[self.used[i] * len..][..len]
    }

    /// Stores the predecessors of a datum.
    fn extend(&mut self, i: usize, before: &[Option<usize>]) {
        let len = self.space.point_len();
        let one = before[i];
        let [mut p, mut q, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
        gather([self.row(i); LANES], &mut p);
        for (k, earlier) in [one, one.and_then(|j| before[j])].into_iter().enumerate() {
            self.since[i][k] = earlier.map_or(0.0, |j| self.times[i] - self.times[j]);
            let Some(j) = earlier else { continue };
            gather([self.row(j); LANES], &mut q);
            self.space.log(&p, &q, &mut v);
            let own = &mut self.back[k][i * len..][..len];
            own.iter_mut().zip(&v).for_each(|(x, v)| *x = v.as_array()[0]);
        }
    }

    /// The extrapolation of the second datum of a pair.
    fn rule(&self, degree: usize, (j, i): (usize, usize)) -> Option<Rule> {
        Rule::new(degree, self.times[i] - self.times[j], self.since[j])
    }

    /// The squared errors of extrapolations of the second datum of pairs from the first one and its predecessors;
    /// infinite beyond the cut locus. The default rule gives squared distances.
    fn errors(&self, pairs: &[(usize, usize)], rules: &[Rule]) -> Vec<f64> {
        let len = self.space.point_len();
        let [mut p, mut q, mut v, mut u] = [(); 4].map(|_| vec![Lane::ZERO; len]);
        let mut found = Vec::with_capacity(pairs.len());
        for group in 0..pairs.len().div_ceil(LANES) {
            let at = lanes_of(group, pairs.len());
            gather(at.map(|k| self.row(pairs[k].0)), &mut p);
            gather(at.map(|k| self.row(pairs[k].1)), &mut q);
            self.space.log(&p, &q, &mut v);
            for (order, back) in self.back.iter().enumerate() {
                gather(at.map(|k| &back[pairs[k].0 * len..][..len]), &mut u);
                let weight = Lane::new(at.map(|k| rules[k].weights[order]));
                v.iter_mut().zip(&u).for_each(|(v, u)| *v = (-weight).mul_add(*u, *v));
            }
            let own = self.space.inner(&p, &v, &v).to_array();
            found.extend(
                own.iter()
                    .take(pairs.len() - found.len())
                    .map(|x| if x.is_nan() { f64::INFINITY } else { *x }),
            );
        }
        found
    }
}

/// An extrapolation by a polynomial, in the tangent space of the last datum.
#[derive(Clone, Copy, Default)]
struct Rule {
    /// The weights of the predecessors of the last datum.
    weights: [f64; 2],
    /// The square of the polynomial that multiplies the divided difference of the path in the error.
    bend: f64,
    /// The variance of the error for noise of variance one.
    noise: f64,
}

impl Rule {
    /// The extrapolation of some degree, 1 or 2, by a time; None without enough data at different times.
    fn new(degree: usize, time: f64, [a, b]: [f64; 2]) -> Option<Self> {
        if degree == 1 {
            let w = time / a;
            let noise = 1.0 + w * w + (1.0 + w) * (1.0 + w);
            return (a > 0.0).then_some(Rule {
                weights: [-w, 0.0],
                bend: (time * (time + a)).powi(2),
                noise,
            });
        }
        let weights = [-time * (time + b) / (a * (b - a)), time * (time + a) / (b * (b - a))];
        let own = 1.0 - weights[0] - weights[1];
        let noise = 1.0 + own * own + weights.map(|w| w * w).iter().sum::<f64>();
        let bend = (time * (time + a) * (time + b)).powi(2);
        (a > 0.0 && b > a).then_some(Rule { weights, bend, noise })
    }
}

/// The usual squared errors of extrapolations along a chain, for every datum, and degrees 1 and 2.
struct Surprise {
    /// Divided by [`Rule::bend`], and by [`Rule::noise`].
    usual: [[Vec<f64>; 2]; 2],
}

impl Surprise {
    fn new(steps: &mut Steps, chain: &[usize], rounding: f64) -> Self {
        let mut before = vec![None; steps.times.len()];
        chain.windows(2).for_each(|pair| before[pair[1]] = Some(pair[0]));
        chain.iter().for_each(|&i| steps.extend(i, &before));
        let pairs: Vec<(usize, usize)> = chain.windows(2).map(|pair| (pair[0], pair[1])).collect();
        // The place in the chain of every datum.
        let place: Vec<usize> = (0..steps.times.len())
            .map(|i| chain.partition_point(|&k| k < i).clamp(1, pairs.len().max(1)) - 1)
            .collect();
        let usual = [1, 2].map(|degree| {
            let rules: Vec<Option<Rule>> = pairs.iter().map(|pair| steps.rule(degree, *pair)).collect();
            let known: Vec<Rule> = rules.iter().map(|rule| rule.unwrap_or_default()).collect();
            let errors = steps.errors(&pairs, &known);
            let by = |part: fn(&Rule) -> f64| -> Vec<f64> {
                let ratios: Vec<f64> = errors
                    .iter()
                    .zip(&rules)
                    .map(|(error, rule)| rule.map_or(f64::NAN, |rule| error / part(&rule)))
                    .collect();
                let whole = middle(&ratios);
                let own = around(ratios.len(), |own| Some(middle(&ratios[own])));
                place.iter().map(|&k| own.get(k).map_or(whole, |x| x.max(whole))).collect()
            };
            let [bend, mut noise] = [by(|rule| rule.bend), by(|rule| rule.noise)];
            noise.iter_mut().for_each(|x| *x = rounding.max(*x));
            [bend, noise]
        });
        Surprise { usual }
    }

    /// The expected squared error of the better extrapolation of a pair, which is infinite if there is none.
    fn expected(&self, steps: &Steps, (j, i): (usize, usize)) -> (f64, Rule) {
        let of = |degree: usize| {
            let rule = steps.rule(degree, (j, i))?;
            let [bend, noise] = [0, 1].map(|k| {
                let usual = &self.usual[degree - 1][k];
                usual[i].max(usual[j])
            });
            Some((bend * rule.bend + noise * rule.noise, rule))
        };
        let best = [of(1), of(2)].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        best.unwrap_or((f64::INFINITY, Rule::default()))
    }
}

/// The standard deviation, at weight one, of the rounding of the data.
pub fn rounding(space: &Erased, data: &Data) -> f64 {
    resolution(space, data) * data.weights.iter().copied().fold(0.0, f64::max).sqrt()
}

/// The standard deviation of the rounding of the data: to floating-point numbers, or to the decimals of a file if many
/// consecutive data are equal.
fn resolution(space: &Erased, data: &Data) -> f64 {
    /// The least shares of consecutive data that are equal, and that are different.
    const SAME: f64 = 0.25;
    const DIFFERENT: f64 = 0.05;
    let used: Vec<usize> = (0..data.times.len()).filter(|&i| data.weights[i] > 0.0).collect();
    let pairs: Vec<(usize, usize)> = (1..used.len()).map(|i| (i - 1, i)).collect();
    let mut steps = squares(space, data.points, &used, &pairs);
    steps.retain(|x| *x > 0.0);
    let different = steps.len() as f64 / pairs.len().max(1) as f64;
    // With half a unit of the last decimal, data that differ by one unit are kept.
    let digits = if different > DIFFERENT && different < 1.0 - SAME {
        0.5 * steps.into_iter().fold(f64::INFINITY, f64::min).sqrt()
    } else {
        0.0
    };
    digits.max(data.points.iter().map(|x| x.abs()).fold(0.0, f64::max) * f64::EPSILON)
}

/// The squared distances of pairs of data. Beyond the cut locus they are infinite.
fn squares(space: &Erased, points: &[f64], used: &[usize], pairs: &[(usize, usize)]) -> Vec<f64> {
    let len = space.point_len();
    let row = |i: usize| &points[used[i] * len..][..len];
    let [mut p, mut q, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
    let mut found = Vec::with_capacity(pairs.len());
    for group in 0..pairs.len().div_ceil(LANES) {
        let at = lanes_of(group, pairs.len()).map(|k| pairs[k]);
        gather(at.map(|(i, _)| row(i)), &mut p);
        gather(at.map(|(_, j)| row(j)), &mut q);
        let angle = space.log(&p, &q, &mut v);
        let apart = space.distance(&p, &q, &v, angle);
        let own = (apart * apart).to_array();
        found.extend(
            own.iter().take(pairs.len() - found.len()).map(|x| if x.is_nan() { f64::INFINITY } else { *x }),
        );
    }
    found
}

/// The squared distances of some of the data from the geodesic between the ones before and after; zero at both ends.
///
/// An isolated outlier is farther from its geodesic than its neighbours are from theirs, because it moves their
/// geodesics only by a fraction of its own distance.
pub fn deviations(space: &Erased, times: &[f64], points: &[f64], chosen: &[usize]) -> Vec<f64> {
    let (len, inner) = (space.point_len(), chosen.len().saturating_sub(2));
    let row = |i: usize| &points[chosen[i] * len..][..len];
    let share = |i: usize| {
        let [a, b, c] = [i, i + 1, i + 2].map(|i| times[chosen[i]]);
        if c > a { (b - a) / (c - a) } else { 0.5 }
    };
    let [mut p, mut q, mut y, mut v, mut between] = [(); 5].map(|_| vec![Lane::ZERO; len]);
    let mut found = vec![0.0];
    for group in 0..inner.div_ceil(LANES) {
        let at = lanes_of(group, inner);
        gather(at.map(row), &mut p);
        gather(at.map(|i| row(i + 1)), &mut y);
        gather(at.map(|i| row(i + 2)), &mut q);
        space.log(&p, &q, &mut v);
        space.ray(&p, &v, Lane::new(at.map(share)), &mut between);
        let angle = space.log(&between, &y, &mut v);
        let apart = space.distance(&between, &y, &v, angle);
        let own = (apart * apart).to_array();
        found.extend(
            own.iter().take(inner + 1 - found.len()).map(|x| if x.is_nan() { f64::INFINITY } else { *x }),
        );
    }
    found.resize(chosen.len(), 0.0);
    found
}

/// τ as a function of the time between two data.
struct Scale {
    /// Logarithms of times, and τ there.
    knots: Vec<(f64, f64)>,
}

impl Scale {
    fn new(times: &[f64], window: usize, apart: impl Fn(&[(usize, usize)]) -> Vec<f64>) -> Self {
        let every = (times.len() * window).div_ceil(PAIRS);
        let pairs: Vec<(usize, usize)> = (0..times.len())
            .step_by(every)
            .flat_map(|i| (i + 1..=(i + window).min(times.len() - 1)).map(move |j| (i, j)))
            .filter(|&(i, j)| times[j] > times[i])
            .collect();
        let mut lags: Vec<(f64, f64)> =
            pairs.iter().zip(apart(&pairs)).map(|(&(i, j), square)| (times[j] - times[i], square)).collect();
        lags.sort_by(|a, b| a.0.total_cmp(&b.0));
        let steps: Vec<f64> =
            pairs.iter().filter(|(i, j)| j - i == 1).map(|&(i, j)| times[j] - times[i]).collect();
        let step = quantile(steps, 0.5).unwrap_or(1.0);
        let near: Vec<(usize, usize)> = pairs.into_iter().filter(|(i, j)| j - i == 1).collect();
        let base = low(apart(&near));
        let mut largest = 0.0_f64;
        let mut knots: Vec<(f64, f64)> = Vec::new();
        let mut from = 0;
        for bin in 1..=BINS {
            let mut to = bin * lags.len() / BINS;
            // Equal times belong to the same interval.
            while to > from && to < lags.len() && lags[to].0 == lags[to - 1].0 {
                to += 1;
            }
            if to <= from {
                continue;
            }
            let own = &lags[from..to];
            let time = own[own.len() / 2].0;
            // Beyond the first step, at most that of a steady motion.
            let steady = base * (time / step).powi(2).max(1.0);
            largest = largest.max(low(own.iter().map(|lag| lag.1).collect()).min(steady));
            knots.push((time.ln(), largest));
            from = to;
        }
        Scale { knots }
    }

    /// τ for a time, by linear interpolation; at least the smallest positive number.
    fn at(&self, time: f64) -> f64 {
        let x = time.ln();
        let after = self.knots.partition_point(|knot| knot.0 <= x);
        let tau = match (after.checked_sub(1).map(|i| self.knots[i]), self.knots.get(after)) {
            (Some((a, low)), Some(&(b, high))) => low + (high - low) * (x - a) / (b - a),
            (Some((_, tau)), None) | (None, Some(&(_, tau))) => tau,
            (None, None) => 0.0,
        };
        tau.max(f64::MIN_POSITIVE)
    }
}

/// The squared speed around every datum, or zero where distances do not grow with time as those of a motion do. A
/// recording may rest in one part and move fast in another one.
fn speeds(times: &[f64], apart: impl Fn(&[(usize, usize)]) -> Vec<f64>) -> Vec<f64> {
    let n = times.len();
    // For every lag, the squared distances from the data before.
    let column = |lag: usize| {
        let pairs: Vec<(usize, usize)> = (lag..n).map(|i| (i - lag, i)).collect();
        (lag, [vec![f64::NAN; lag.min(n)], apart(&pairs)].concat())
    };
    let (near, distant, middle) = ([1].map(column), DISTANT.map(column), SPEED.map(column));
    around(n, |own| {
        let lower = |columns: &[(usize, Vec<f64>)]| {
            quantile(columns.iter().flat_map(|(_, squares)| squares[own.clone()].to_vec()).collect(), 0.25)
        };
        let speed = |(lag, squares): &(usize, Vec<f64>)| -> Vec<f64> {
            let squared = |i: usize| squares[i] / (times[i] - times[i.saturating_sub(*lag)]).powi(2);
            own.clone().map(squared).collect()
        };
        if lower(&distant)? < MOVES * lower(&near)? {
            return None;
        }
        quantile(middle.iter().flat_map(speed).collect(), 0.25)
    })
}

/// The largest values of a function of ranges of indices in the ranges that contain an index or begin after it, so that
/// either side of a change is represented.
fn around(n: usize, of: impl Fn(std::ops::RangeInclusive<usize>) -> Option<f64>) -> Vec<f64> {
    let found: Vec<f64> = (0..n).map(|last| of(last.saturating_sub(AROUND)..=last).unwrap_or(0.0)).collect();
    (0..n).map(|i| (0..=3).map(|k| found[(i + k * AROUND / 2).min(n - 1)]).fold(0.0, f64::max)).collect()
}

/// The median; that of the positive numbers if it is zero, as for rounded data.
fn middle(values: &[f64]) -> f64 {
    match quantile(values.to_vec(), 0.5) {
        Some(found) if found > 0.0 => found,
        _ => quantile(values.iter().copied().filter(|x| *x > 0.0).collect(), 0.5).unwrap_or(0.0),
    }
}

/// The lower quartile of squared distances; that of the positive ones if it is zero, as for rounded data.
fn low(squares: Vec<f64>) -> f64 {
    let positive: Vec<f64> = squares.iter().copied().filter(|x| *x > 0.0).collect();
    match quantile(squares, 0.25) {
        Some(found) if found > 0.0 => found,
        _ => quantile(positive, 0.25).unwrap_or(0.0),
    }
}

/// A quantile of finite numbers; None if there are none.
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.retain(|x| x.is_finite());
    let last = values.len().checked_sub(1)?;
    let at = (share * last as f64).round() as usize;
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}
