//! Smoothing λ(t) and noise σ(t) that vary along a curve.
//!
//! The penalty is Σ λ_g |…|² with one λ per segment. ln λ is linear between a few nodes, and so is ln σ². At the nodes,
//! both are random walks, whose steps have a variance τ² that is estimated as well, so that there is no tuning parameter.
//! The restricted likelihood is maximised by Fisher scoring, in the linearised problem at a curve. For a node with the
//! hat function N, the energies E_g = λ_g|s_g c|² and d_g = (K − p)/S − λ_g s_gᵀA⁻¹s_g, the local degrees of freedom of the
//! process, its gradient with respect to ln λ is `(m/2) Σ N (d_g − E_g/(mσ²))`. That with respect to ln σ² is the same with
//! squared residuals and `1 − h`, with the leverages h of the data.
//!
//! One start is not enough: where one λ takes a burst for noise, the curve of this λ does not show the burst. The second
//! start is so rough that it shows every burst. The better result is taken if its likelihood is sufficiently larger than
//! that of one λ; otherwise λ does not vary. If both functions vary, each may take the other for itself. Further starts
//! are then the solutions with one of them, and noise estimated from the deviations of data from their neighbours, in which
//! motion hardly shows.
//!
//! Others estimate a few free values (Wood 2011; Rodríguez-Álvarez et al. 2019) or a spline with a penalty (Krivobokova et
//! al. 2008).

use crate::audit::noise_varies;
use crate::linearized::Basis;
use crate::path::{Position, positions};
use crate::problem::{Adapt, Penalty, Profile};
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::LANES;

/// Twice the logarithm of the likelihood must increase by more than this if one function varies, or both. A second function
/// gains a little from the jumps that the first one cannot follow.
const GAINS: [f64; 3] = [0.0, 6.0, 18.0];
/// The standard deviations of a step between nodes with which the two starts begin.
const STEPS: [f64; 2] = [0.5, 2.0];
/// Scoring steps with nodes at equal numbers of data, and with nodes at equal degrees of freedom; changes that end them, and
/// the largest change of a step.
const ROUNDS: [usize; 2] = [8, 12];
const SETTLED: f64 = 0.05;
const LONGEST: f64 = 2.5;
/// Data per node, and the smallest and largest number of intervals between nodes; likewise for degrees of freedom.
const DATA: (f64, f64, f64) = (8.0, 4.0, 64.0);
const FREEDOM: (f64, f64, f64) = (3.0, 8.0, 64.0);
/// The range of ln λ around the start.
const RANGE: f64 = 25.0;
/// The range of ln σ² around its mean: noise varies by at most ten times. Rounded data repeat, and without a limit their noise
/// would vanish.
const NOISE_RANGE: f64 = 4.6;
/// Likelihoods of one function and the other that differ by less than this hardly decide between them.
const TIE: f64 = 10.0;
/// The least variance of a step between nodes.
const LEAST_STEP: f64 = 1e-6;
/// Gaps longer than this multiple of the width of the smoother, of the median time step, and of the mean duration of a burst
/// are long. There, λ is the harmonic mean: that of two rests would promise another rest. Random times hardly ever have longer
/// gaps than ten steps, and a burst shows beside a gap that is shorter than an eighth of it.
const GAP: [f64; 3] = [3.3, 10.0, 0.125];
const GAP_OF_JERK: f64 = 3.0;

/// A linear problem at a curve, in which λ and σ may vary.
pub struct Adaptive<'a> {
    /// The knots.
    pub basis: &'a Basis,
    /// The derivative whose square is penalised.
    pub penalised: Penalty,
    /// The number of coordinates.
    pub m: usize,
    /// The degrees of freedom of the residuals, from which the variance of the noise is estimated; None if it is one.
    pub left: Option<f64>,
    /// The degrees of freedom per coordinate of the coefficients with energy.
    pub process: f64,
    /// The positions of the data, and the weight of a coordinate of each.
    pub positions: &'a [Position],
    /// See `positions`.
    pub weights: &'a [f64],
    /// Squared deviations of the data from their neighbours per coordinate, in units of the variance for one σ; NaN without
    /// neighbours. Empty if they are not known.
    pub deviations: &'a [f64],
    /// The positions of everything that was measured, in the order of time, between which there may be gaps.
    pub measured: &'a [Position],
    /// λ of every segment, and the largest λ that may be chosen.
    pub lam: &'a [f64],
    /// See `lam`.
    pub stiffest: f64,
    /// Whether λ was given.
    pub given: bool,
    /// Solves the linear problem for at most as many tracks as there are lanes.
    pub sums: &'a dyn Fn(&[Track]) -> Vec<Sums>,
}

/// Nodes at some of the knots, and hat functions: the nodes before segments and data, and their shares in the next one.
#[derive(Clone, Default)]
struct Nodes {
    knots: Vec<usize>,
    of_segments: Vec<(usize, f64)>,
    of_data: Vec<(usize, f64)>,
}

impl Nodes {
    fn new(knots: Vec<usize>, problem: &Adaptive) -> Self {
        let basis = problem.basis;
        let hat = |segment: usize, s: f64| {
            let j = knots.partition_point(|knot| *knot <= segment) - 1;
            let length = |from: usize, to: usize| (from..to).map(|i| basis.h(i)).sum::<f64>();
            let before = length(knots[j], segment) + s * basis.h(segment);
            (j, before / length(knots[j], knots[j + 1]))
        };
        let of_segments = (0..basis.knots() - 1).map(|i| hat(i, 0.5)).collect();
        let of_data = problem.positions.iter().map(|&(segment, s)| hat(segment, s)).collect();
        Nodes { knots, of_segments, of_data }
    }

    fn sums(&self, hats: &[(usize, f64)], values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sums = vec![0.0; self.knots.len()];
        for ((j, share), x) in hats.iter().zip(values) {
            sums[*j] += (1.0 - share) * x;
            sums[*j + 1] += share * x;
        }
        sums
    }
}

/// The values on the segments between other knots: those at their middles.
pub fn on_segments(knots: &[f64], values: &[f64], others: &[f64]) -> Vec<f64> {
    let at = |t: f64| values[knots.partition_point(|knot| *knot <= t).clamp(1, values.len()) - 1];
    others.windows(2).map(|ends| at(0.5 * (ends[0] + ends[1]))).collect()
}

/// Values at knots, interpolated linearly at other times, and constant beyond them.
pub fn at_times(knots: &[f64], values: &[f64], times: &[f64]) -> Vec<f64> {
    let value = |&(segment, s): &Position| at(values, &(segment, s));
    positions(knots, times).iter().map(value).collect()
}

/// How λ and σ vary, for other knots.
pub fn at_knots(profile: &Profile, knots: &[f64], others: &[f64]) -> Profile {
    let lam = if profile.lam.is_empty() { Vec::new() } else { on_segments(knots, &profile.lam, others) };
    let noise = if profile.noise.is_empty() { Vec::new() } else { at_times(knots, &profile.noise, others) };
    Profile { lam, noise, ..*profile }
}

fn at(values: &[f64], &(j, share): &(usize, f64)) -> f64 {
    (1.0 - share) * values[j] + share * values[j + 1]
}

/// A function at the nodes, and the variance of its steps.
#[derive(Clone, Default)]
struct Walk {
    x: Vec<f64>,
    variance: f64,
}

impl Walk {
    /// Moves along a gradient with a given information, and updates the variance (expectation maximisation). Returns the
    /// largest change.
    fn step(&mut self, gradient: &[f64], information: &[f64], [least, most]: [f64; 2]) -> f64 {
        let precision = 1.0 / self.variance;
        let pull = self.second_differences();
        let right: Vec<f64> = gradient.iter().zip(pull).map(|(g, d)| g - precision * d).collect();
        let factor = Tridiagonal::new(information, precision);
        let moves = factor.solve(right);
        let mut largest: f64 = 0.0;
        for (x, step) in self.x.iter_mut().zip(moves) {
            let moved = (*x + step.clamp(-LONGEST, LONGEST)).clamp(least, most);
            largest = largest.max((moved - *x).abs());
            *x = moved;
        }
        let steps = self.x.windows(2).map(|x| (x[1] - x[0]).powi(2));
        let squares = steps.zip(factor.variances_of_steps()).map(|(square, variance)| square + variance);
        self.variance = (squares.sum::<f64>() / (self.x.len() - 1) as f64).max(LEAST_STEP);
        largest
    }

    /// DᵀDx, with the differences D of neighbours.
    fn second_differences(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.x.len()];
        for (j, x) in self.x.windows(2).enumerate() {
            out[j] -= x[1] - x[0];
            out[j + 1] += x[1] - x[0];
        }
        out
    }

    /// Minus twice the logarithm of the likelihood of the walk, with its posterior (Laplace's approximation).
    fn score(&self, information: &[f64]) -> f64 {
        let steps: f64 = self.x.windows(2).map(|x| (x[1] - x[0]).powi(2)).sum();
        let count = (self.x.len() - 1) as f64;
        steps / self.variance
            + count * self.variance.ln()
            + Tridiagonal::new(information, 1.0 / self.variance).log_det()
    }
}

/// The factored matrix H + DᵀD/τ².
struct Tridiagonal {
    pivots: Vec<f64>,
    below: f64,
}

impl Tridiagonal {
    fn new(information: &[f64], precision: f64) -> Self {
        let last = information.len() - 1;
        let mut pivots: Vec<f64> = Vec::with_capacity(last + 1);
        for (j, h) in information.iter().enumerate() {
            let neighbours = if j == 0 || j == last { 1.0 } else { 2.0 };
            let before = pivots.last().map_or(0.0, |pivot| precision * precision / pivot);
            pivots.push(h + neighbours * precision + 1e-9 - before);
        }
        Tridiagonal { pivots, below: -precision }
    }

    fn solve(&self, mut x: Vec<f64>) -> Vec<f64> {
        for j in 1..x.len() {
            x[j] -= self.below / self.pivots[j - 1] * x[j - 1];
        }
        for j in (0..x.len()).rev() {
            let behind = if j + 1 < x.len() { self.below * x[j + 1] } else { 0.0 };
            x[j] = (x[j] - behind) / self.pivots[j];
        }
        x
    }

    fn log_det(&self) -> f64 {
        self.pivots.iter().map(|x| x.ln()).sum()
    }

    /// The posterior variances of the steps between nodes.
    fn variances_of_steps(&self) -> Vec<f64> {
        let mut behind = 1.0 / self.pivots[self.pivots.len() - 1];
        let mut out = Vec::with_capacity(self.pivots.len() - 1);
        for pivot in self.pivots.iter().rev().skip(1) {
            let ratio = self.below / pivot;
            let cross = -ratio * behind;
            let here = 1.0 / pivot + ratio * ratio * behind;
            out.push(here + behind - 2.0 * cross);
            behind = here;
        }
        out.reverse();
        out
    }
}

/// The solution of a linear problem, as far as the scoring needs it.
pub struct Sums {
    /// Energies times λ, and local degrees of freedom of the process per coordinate, by segment.
    pub energies: Vec<f64>,
    /// See `energies`.
    pub freedoms: Vec<f64>,
    /// Weighted squared residuals, and leverages per coordinate, by datum. Squares are needed for the noise only, and
    /// leverages also where nodes are placed.
    pub squares: Vec<f64>,
    /// See `squares`.
    pub leverages: Vec<f64>,
    /// The sum of all weighted squared residuals and energies.
    pub whole: f64,
    /// ln det A per coordinate, and whether A is positive definite.
    pub log_det: f64,
    /// See `log_det`.
    pub sound: bool,
}

/// The phase of a start.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The number of steps with nodes at equal numbers of data, and at equal degrees of freedom.
    Steps(usize, usize),
    Done,
}

/// The scoring from one start for some of the functions.
#[derive(Clone)]
pub struct Track {
    /// What varies.
    pub vary: Adapt,
    phase: Phase,
    nodes: Nodes,
    start: usize,
    lam: Walk,
    noise: Walk,
    /// The middle of the range of ln λ.
    middle: f64,
    /// λ of all segments, and the factors of the weights of all data.
    pub lams: Vec<f64>,
    /// See `lams`.
    pub factors: Vec<f64>,
    score: f64,
    settled: bool,
}

impl Track {
    /// Whether the next step places nodes.
    pub fn is_to_place(&self) -> bool {
        matches!(self.phase, Phase::Steps(0, steps) if steps == ROUNDS[0] || self.settled)
    }

    /// The number of functions that vary.
    fn functions(&self) -> usize {
        usize::from(self.vary.lam) + usize::from(self.vary.noise)
    }

    /// Places the nodes, with the functions at them unchanged.
    fn place(&mut self, nodes: Nodes, problem: &Adaptive) {
        let segments = problem.lam.len();
        let ln = |i: usize| self.lams[i].ln();
        // Between the middles of segments.
        let of_knot = |&knot: &usize| {
            if knot == 0 || knot == segments {
                ln(knot.min(segments - 1))
            } else {
                0.5 * (ln(knot - 1) + ln(knot))
            }
        };
        let x = nodes.knots.iter().map(of_knot).collect();
        let noise = self.noise_at_knots(problem);
        let variance = STEPS[self.start].powi(2);
        self.noise = Walk { x: nodes.knots.iter().map(|knot| noise[*knot]).collect(), variance };
        self.lam = Walk { x, variance };
        self.nodes = nodes;
    }

    /// Sets the noise to the deviations of data from their neighbours.
    fn start_noise(&mut self, deviations: &[f64]) {
        let known = |k: usize| deviations.get(k).copied().filter(|x| x.is_finite());
        let count = self.nodes.of_data.len();
        let sum = |f: &dyn Fn(usize) -> f64| self.nodes.sums(&self.nodes.of_data, (0..count).map(f));
        let squares = sum(&|k| known(k).unwrap_or(0.0));
        let counts = sum(&|k| known(k).map_or(0.0, |_| 1.0));
        if squares.iter().zip(&counts).any(|(square, count)| !(*square > 0.0 && *count > 0.0)) {
            return;
        }
        self.noise.x = squares.iter().zip(counts).map(|(square, count)| (square / count).ln()).collect();
        let mean = self.noise.x.iter().sum::<f64>() / self.noise.x.len() as f64;
        self.noise.x.iter_mut().for_each(|x| *x -= mean);
        self.factors = self.nodes.of_data.iter().map(|hat| (-at(&self.noise.x, hat)).exp()).collect();
    }

    /// ln σ² at the knots.
    fn noise_at_knots(&self, problem: &Adaptive) -> Vec<f64> {
        let basis = problem.basis;
        let mut out = vec![0.0; basis.knots()];
        if self.noise.x.is_empty() {
            return out;
        }
        for (j, ends) in self.nodes.knots.windows(2).enumerate() {
            let length: f64 = (ends[0]..ends[1]).map(|i| basis.h(i)).sum();
            let mut before = 0.0;
            for i in ends[0]..=ends[1] {
                out[i] = at(&self.noise.x, &(j, before / length));
                before += if i < ends[1] { basis.h(i) } else { 0.0 };
            }
        }
        out
    }

    /// One step, or the score at the end.
    fn advance(&mut self, problem: &Adaptive, sums: &Sums) {
        let Phase::Steps(mut stage, mut steps) = self.phase else { return };
        if !sums.sound {
            self.phase = Phase::Done;
            return;
        }
        if self.is_to_place() {
            self.place(problem.nodes_of_freedom(&sums.leverages), problem);
            (stage, steps, self.settled) = (1, 0, false);
        }
        let m = problem.m as f64;
        let variance = problem.left.map_or(1.0, |left| sums.whole / left);
        let nodes = &self.nodes;
        let of_segments = |x: &[f64]| nodes.sums(&nodes.of_segments, x.iter().copied());
        let (energies, freedoms) = (of_segments(&sums.energies), of_segments(&sums.freedoms));
        let gradient =
            energies.iter().zip(&freedoms).map(|(e, d)| 0.5 * m * (d.max(1e-6) - e / (m * variance)));
        let gradient: Vec<f64> = gradient.collect();
        let ratio = problem.ratio();
        let information: Vec<f64> = freedoms.iter().map(|d| 0.5 * m * ratio * d.max(1e-6)).collect();
        let used = |k: usize| problem.weights[k] > 0.0;
        let of_data = |f: &dyn Fn(usize) -> f64| {
            nodes.sums(&nodes.of_data, (0..problem.weights.len()).map(|k| if used(k) { f(k) } else { 0.0 }))
        };
        let of_noise: Vec<f64> = of_data(&|k| 1.0 - (2.0 - ratio) * sums.leverages[k])
            .iter()
            .map(|x| 0.5 * m * x.max(1e-3))
            .collect();
        if stage == 1 && (steps == ROUNDS[1] || self.settled) {
            let misfit = problem.left.map_or(sums.whole, |left| left * (sums.whole / m).ln());
            self.score = misfit + m * (sums.log_det - problem.log_penalty(&self.lams));
            if self.vary.lam {
                self.score += self.lam.score(&information);
            }
            if self.vary.noise {
                self.score -= m
                    * (0..self.factors.len()).filter(|k| used(*k)).map(|k| self.factors[k].ln()).sum::<f64>();
                self.score += self.noise.score(&of_noise);
            }
            self.phase = Phase::Done;
            return;
        }
        let mut largest: f64 = 0.0;
        if self.vary.noise {
            let squares = of_data(&|k| sums.squares[k]);
            let left = of_data(&|k| 1.0 - sums.leverages[k]);
            let gradient: Vec<f64> =
                squares.iter().zip(left).map(|(r, d)| 0.5 * m * (r / (m * variance) - d)).collect();
            largest = largest.max(self.noise.step(&gradient, &of_noise, [-NOISE_RANGE, NOISE_RANGE]));
            let mean = self.noise.x.iter().sum::<f64>() / self.noise.x.len() as f64;
            self.noise.x.iter_mut().for_each(|x| *x -= mean);
            self.factors = self.nodes.of_data.iter().map(|hat| (-at(&self.noise.x, hat)).exp()).collect();
        }
        if self.vary.lam {
            let bounds = [self.middle - RANGE, (self.middle + RANGE).min(problem.stiffest.ln())];
            largest = largest.max(self.lam.step(&gradient, &information, bounds));
        } else if !problem.given {
            let step = gradient.iter().sum::<f64>() / information.iter().sum::<f64>();
            let step = step.clamp(-LONGEST, LONGEST);
            self.lam.x.iter_mut().for_each(|x| *x += step);
            largest = largest.max(step.abs());
        }
        if self.vary.lam || !problem.given {
            self.lams = self.nodes.of_segments.iter().map(|hat| at(&self.lam.x, hat).exp()).collect();
        }
        self.settled = largest < SETTLED;
        self.phase = Phase::Steps(stage, steps + 1);
    }
}

impl Adaptive<'_> {
    /// The functions that are wanted, as far as they are accepted.
    pub fn profile(&self, vary: Adapt) -> Profile {
        let none = Profile {
            gain: 0.0,
            lam: Vec::new(),
            noise: Vec::new(),
            other: false,
            tie: false,
            outlier: f64::NAN,
        };
        if self.lam.len() < 2 || !self.lam.iter().all(|lam| lam.is_finite() && *lam > 0.0) {
            return none;
        }
        let kinds = [(false, false), (true, false), (false, true), (true, true)];
        let kinds = kinds.map(|(lam, noise)| Adapt { lam, noise }).into_iter();
        // Whether noise is motion shows only if both may vary.
        let kinds = kinds.filter(|kind| (vary.noise || !kind.noise) && !(self.given && kind.lam));
        let starts = if self.given { 1 } else { 2 };
        let mut tracks: Vec<Track> = kinds
            .flat_map(|kind| (0..starts).map(move |start| (kind, start)))
            .map(|(k, s)| self.track(k, s))
            .collect();
        self.run(&mut tracks);
        if vary.noise && !self.given {
            // Both together may take one for the other from a start at which neither varies.
            let mut again: Vec<Track> =
                [(true, false), (false, true)].iter().filter_map(|kind| Self::best(&tracks, *kind)).collect();
            again.extend((0..starts).map(|start| self.beside_neighbours(start)));
            self.run(&mut again);
            tracks.extend(again);
        }
        let (constant, tracks): (Vec<_>, Vec<_>) =
            tracks.into_iter().partition(|track| track.vary == Adapt::default());
        let alone = constant.iter().map(|track| track.score).fold(f64::INFINITY, f64::min);
        let gain = |track: &Track| alone - track.score;
        let surplus = |track: &Track| gain(track) - GAINS[track.functions()];
        let best_of = |wanted: bool| {
            let allowed = tracks.iter().filter(|track| (vary.lam || !track.vary.lam) == wanted);
            allowed.max_by(|a, b| surplus(a).total_cmp(&surplus(b)))
        };
        let Some(best) = best_of(true) else { return none };
        if !gain(best).is_finite() {
            return none;
        }
        let mut others: Vec<Track> = Vec::new();
        if !vary.noise && !self.given && noise_varies(self.deviations, self.m) {
            others.extend((0..starts).map(|start| self.beside_neighbours(start)));
            others.extend((0..starts).map(|start| self.track(Adapt { lam: false, noise: true }, start)));
            self.run(&mut others);
        }
        let more = best_of(false).into_iter().chain(&others).map(&surplus).fold(0.0, f64::max);
        let other = more > surplus(best).max(0.0);
        if surplus(best) <= 0.0 {
            return Profile { gain: gain(best), other, ..none };
        }
        let alone_by = |lam: bool, noise: bool| {
            let alike = tracks.iter().filter(|track| track.vary == Adapt { lam, noise });
            alike.map(&surplus).fold(f64::NEG_INFINITY, f64::max)
        };
        let tie = vary.lam
            && vary.noise
            && best.functions() == 1
            && alone_by(true, false).min(alone_by(false, true)) > (surplus(best) - TIE).max(0.0);
        let noise = if best.vary.noise { self.centred(best) } else { Vec::new() };
        let lam = if best.vary.lam { self.with_gaps(&best.lams) } else { Vec::new() };
        Profile { gain: gain(best), lam, noise, other, tie, outlier: f64::NAN }
    }

    /// Moves tracks until all are done.
    fn run(&self, tracks: &mut [Track]) {
        for group in tracks.chunks_mut(LANES) {
            while group.iter().any(|track| track.phase != Phase::Done) {
                checkpoint();
                let sums = (self.sums)(group);
                group.iter_mut().zip(&sums).for_each(|(track, sums)| track.advance(self, sums));
            }
        }
    }

    /// A start for both functions with the noise of neighbouring data.
    fn beside_neighbours(&self, start: usize) -> Track {
        let mut track = self.track(Adapt { lam: true, noise: true }, start);
        track.start_noise(self.deviations);
        track
    }

    /// The best track in which one of the functions varies, as a start for both.
    fn best(tracks: &[Track], (lam, noise): (bool, bool)) -> Option<Track> {
        let alike =
            tracks.iter().filter(|track| track.vary == Adapt { lam, noise } && track.score.is_finite());
        let best = alike.min_by(|a, b| a.score.total_cmp(&b.score))?;
        let mut both = best.clone();
        both.vary = Adapt { lam: true, noise: true };
        (both.phase, both.settled, both.score) = (Phase::Steps(1, 0), false, f64::INFINITY);
        Some(both)
    }

    /// ln σ² at the knots, with the mean zero over the data.
    fn centred(&self, track: &Track) -> Vec<f64> {
        let used = track.factors.iter().zip(self.weights).filter(|(_, w)| **w > 0.0);
        let (sum, count) = used.fold((0.0, 0.0), |(sum, count), (x, _)| (sum - x.ln(), count + 1.0));
        let mean = sum / count;
        track.noise_at_knots(self).into_iter().map(|x| x - mean).collect()
    }

    /// λ of all segments, divided by its geometric mean, with the harmonic mean in long gaps.
    fn with_gaps(&self, lams: &[f64]) -> Vec<f64> {
        let (basis, order) = (self.basis, self.order());
        let places = self.measured;
        let starts: Vec<f64> = [0.0]
            .into_iter()
            .chain((0..lams.len()).scan(0.0, |sum, i| {
                *sum += basis.h(i);
                Some(*sum)
            }))
            .collect();
        let time = |&(segment, s): &Position| starts[segment] + s * basis.h(segment);
        let apart: Vec<f64> = places.windows(2).map(|pair| time(&pair[1]) - time(&pair[0])).collect();
        let mut lams = lams.to_vec();
        let weight: f64 = self.weights.iter().sum();
        let mut sorted: Vec<f64> = apart.iter().copied().filter(|x| *x > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY);
        let factor = if order == 2 { GAP[0] } else { GAP_OF_JERK };
        let mut is_gap = vec![false; lams.len()];
        // The mean of 1/λ is that of the variance of the process, in the parts with data.
        for _ in 0..2 {
            let recorded = || (0..is_gap.len()).filter(|i| !is_gap[*i]);
            let length: f64 = recorded().map(|i| basis.h(i)).sum();
            let mean = length / recorded().map(|i| basis.h(i) / lams[i]).sum::<f64>();
            // λ is below its harmonic mean in bursts.
            let bursts = || (0..lams.len()).map(|i| lams[i] < mean && !is_gap[i]);
            let starts =
                bursts().scan(false, |before, burst| Some(burst && !std::mem::replace(before, burst)));
            let count = starts.filter(|start| *start).count().max(1) as f64;
            let duration: f64 =
                bursts().enumerate().filter(|(_, burst)| *burst).map(|(i, _)| basis.h(i)).sum::<f64>()
                    / count;
            let width = (mean * length / weight).powf(0.5 / order as f64);
            let longest = (factor * width).max(GAP[1] * usual).max(GAP[2] * duration);
            for (pair, apart) in places.windows(2).zip(&apart) {
                if *apart > longest {
                    let first = pair[0].0 + usize::from(pair[0].1 > 0.5);
                    let last = pair[1].0 + usize::from(pair[1].1 > 0.5);
                    is_gap[first..last].fill(true);
                }
            }
            lams.iter_mut().zip(&is_gap).filter(|(_, gap)| **gap).for_each(|(lam, _)| *lam = mean);
        }
        let mean = lams.iter().map(|lam| lam.ln()).sum::<f64>() / lams.len() as f64;
        lams.iter().map(|lam| (lam.ln() - mean).exp()).collect()
    }

    fn order(&self) -> usize {
        match self.penalised {
            Penalty::Acceleration => 2,
            Penalty::Jerk => 3,
        }
    }

    /// ∫(1 + x²ᵖ)⁻² / ∫(1 + x²ᵖ)⁻¹: the information of a degree of freedom.
    fn ratio(&self) -> f64 {
        1.0 - 0.5 / self.order() as f64
    }

    /// ln det of the penalty per coordinate, up to a constant.
    fn log_penalty(&self, lams: &[f64]) -> f64 {
        self.process * lams.iter().map(|lam| lam.ln()).sum::<f64>() / lams.len() as f64
    }

    fn track(&self, vary: Adapt, start: usize) -> Track {
        let used = self.weights.iter().filter(|w| **w > 0.0).count() as f64;
        let rough = || {
            let time = self.lam.len() as f64;
            let density = self.weights.iter().sum::<f64>() / time;
            density * (time / used).powi(2 * self.order() as i32)
        };
        let mean = self.lam.iter().map(|lam| lam.ln()).sum::<f64>() / self.lam.len() as f64;
        let lams = match (start, vary.lam) {
            (0, true) => self.lam.to_vec(),
            (0, false) => vec![mean.exp(); self.lam.len()],
            _ => vec![rough().min(self.stiffest); self.lam.len()],
        };
        let middle = lams.iter().map(|lam| lam.ln()).sum::<f64>() / lams.len() as f64;
        let mut track = Track {
            vary,
            phase: Phase::Steps(0, 0),
            nodes: Nodes::default(),
            start,
            lam: Walk::default(),
            noise: Walk::default(),
            middle,
            lams,
            factors: vec![1.0; self.weights.len()],
            score: f64::INFINITY,
            settled: false,
        };
        let ones: Vec<f64> = self.weights.iter().map(|w| f64::from(*w > 0.0)).collect();
        track.place(self.nodes_at(&ones, used, DATA), self);
        track
    }

    fn nodes_of_freedom(&self, leverages: &[f64]) -> Nodes {
        let freedom = leverages.iter().sum();
        self.nodes_at(leverages, freedom, FREEDOM)
    }

    /// Nodes at knots, with about equal shares of the values of the data between them.
    fn nodes_at(&self, values: &[f64], total: f64, (per, least, most): (f64, f64, f64)) -> Nodes {
        let last = self.lam.len();
        let count = (total / per).clamp(least, most).floor();
        let whole: f64 = values.iter().sum();
        let (mut knots, mut sum) = (vec![0], 0.0);
        for (&(segment, s), x) in self.positions.iter().zip(values) {
            sum += x;
            if sum >= whole * knots.len() as f64 / count {
                let knot = segment + usize::from(s > 0.5);
                if knot > knots[knots.len() - 1] && knot < last {
                    knots.push(knot);
                }
            }
        }
        knots.push(last);
        Nodes::new(knots, self)
    }
}
