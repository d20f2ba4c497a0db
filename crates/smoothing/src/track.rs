//! One curve on its way to the smoothing spline.

use crate::banded::Banded;
use crate::choice::Linear;
use crate::exact::{self, Pull};
use crate::flat::{Basis, Flat, FlatEnd, Own};
use crate::frames::{Frames, lanes_of};
use crate::information::{self, Root};
use crate::loss;
use crate::misfit::Misfit;
use crate::path::{Path, Place, moved, places, pulls};
use crate::turns;
use crate::variance::rows_of;
use crate::{Data, Ends, Options, Report, Smooth, State, Tier};
use std::f64::consts::PI;
use std::ops::Range;
use symspline_core::fit::{End, Ends as FitEnds};
use symspline_core::monitor::Monitor;
use symspline_core::scalar::{LANES, Lane, few, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased, Origin};

/// Contraction of the flat tier, known or expected, from which the exact one takes over.
const SLOW: f64 = 0.5;
/// The same while λ and the curve are still rough guesses.
const HOPELESS: f64 = 2.0;
/// Dimension up to which the exact way is taken by itself.
const LARGE: usize = 64;
/// λ moves by less than this between rounds when it is settled, in natural logarithms.
const SETTLED: f64 = 3e-3;
/// Rounds of choosing λ, at most.
const ROUNDS: usize = 12;
/// Steps are taken back and halved at most so often where no spline goes through the points they lead to.
const RETREATS: usize = 6;
/// J is known to this part of it.
const ROUNDING: f64 = 1e-12;

/// A curve, its data, and how far it has come.
pub struct Track<'a> {
    data: Data<'a>,
    /// Knots.
    pub knots: Vec<f64>,
    places: Vec<Place>,
    /// Roots of weights that are matrices.
    roots: Vec<Root>,
    flat: Flat,
    ends: Ends,
    /// The residual from which a robust loss counts less.
    corner: f64,
    /// Whether that has its final size.
    rescaled: bool,
    /// Points at the knots.
    pub points: Vec<f64>,
    /// Velocities of the spline through them.
    pub velocities: Vec<f64>,
    /// Where the last step began, and the step.
    before: Option<(Vec<f64>, Vec<f64>)>,
    retreats: usize,
    /// J on the exact way, at the last λ.
    objective: f64,
    /// The band of A⁻¹ at the end.
    inverse: Option<Banded>,
    progress: Progress,
}

/// λ, and how the search goes.
struct Progress {
    /// λ, with times divided by the mean knot spacing; known once it was given or chosen.
    lam: Option<f64>,
    settled: bool,
    last_step: f64,
    /// The last step, unless it was lengthened.
    last: Vec<f64>,
    /// The size of residuals, by which steps are judged.
    scale: f64,
    /// Iterations in a row in which the step hardly shrank.
    slow: usize,
    report: Report,
}

impl<'a> Track<'a> {
    /// A curve with given knots through first points.
    ///
    /// `corner` is the residual from which a robust loss counts less.
    pub fn new(data: Data<'a>, m: usize, knots: Vec<f64>, points: Vec<f64>, ends: Ends, corner: f64) -> Self {
        let places = places(&knots, data.times);
        let (kinds, own) = match ends {
            Ends::Open(kinds) => (kinds, Own::all(data.times.len(), knots.len())),
            Ends::Periodic => ([FlatEnd::Natural; 2], Own::turn(data.times.len(), knots.len())),
        };
        let basis = Basis::new(&knots, kinds);
        let unit = basis.spacing.powi(3);
        let flat = Flat::new(basis, &places, data.weights, own);
        let lam = data.lam;
        let balance = flat.balance();
        // From here on curves are geodesics; with larger λ rounding would make A forget the data.
        let stiffest = balance * (1e6 * (knots.len() as f64 / PI).powi(4)).max(1e8);
        Track {
            roots: information::roots(data.information, m),
            data,
            places,
            flat,
            ends,
            corner,
            rescaled: corner.is_infinite() || data.sigma.is_some(),
            velocities: vec![0.0; points.len()],
            points,
            knots,
            before: None,
            retreats: 0,
            objective: f64::INFINITY,
            inverse: None,
            progress: Progress {
                lam: lam.map(|lam| (lam / unit).min(stiffest)),
                settled: lam.is_some(),
                last_step: f64::INFINITY,
                last: Vec::new(),
                scale: f64::NAN,
                slow: 0,
                report: Report {
                    at_bound: lam.is_some_and(|lam| lam / unit > stiffest),
                    ..Report::default()
                },
            },
        }
    }

    /// The curve as it is.
    pub fn finish(self, len: usize) -> Smooth {
        let report = self.report();
        let curve = self.curve();
        let inverse = match &self.inverse {
            Some(inverse) => rows_of(inverse)[curve.start * 4..curve.end * 4].to_vec(),
            None => vec![f64::NAN; curve.len() * 4],
        };
        let part = |x: &[f64], size: usize| x[curve.start * size..curve.end * size].to_vec();
        Smooth {
            knots: part(&self.knots, 1),
            points: part(&self.points, len),
            velocities: part(&self.velocities, len),
            inverse,
            report,
        }
    }

    /// How it goes.
    pub fn report(&self) -> Report {
        self.progress.report
    }

    /// The part of the knots that is the curve.
    pub fn curve(&self) -> Range<usize> {
        let Own { segments, .. } = &self.flat.own;
        segments.start..segments.end + 1
    }

    /// Velocities at the ends, carried from the first and the last of the data to the ends of the curve.
    pub fn end_velocities(&self, space: &Erased) -> [Vec<f64>; 2] {
        let len = space.point_len();
        std::array::from_fn(|e| {
            let velocity = self.data.ends[e];
            if velocity.is_empty() {
                return Vec::new();
            }
            let at = |x: &[f64]| -> Vec<Lane> {
                let row = if e == 0 { &x[..len] } else { &x[x.len() - len..] };
                row.iter().map(|&x| lane(x)).collect()
            };
            let (y, x) = (at(self.data.points), at(&self.points));
            let (mut way, mut out) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
            let v: Vec<Lane> = velocity.iter().map(|&v| lane(v)).collect();
            space.log(&y, &x, &mut way);
            space.carry(&y, &x, &way, &v, &mut out);
            out.iter().map(|x| x.as_array()[0]).collect()
        })
    }

    /// Takes the velocities of the fitted curve.
    pub fn take(&mut self, velocities: Vec<f64>, len: usize) {
        match self.ends {
            Ends::Open(_) => self.velocities = velocities,
            Ends::Periodic => {
                let start = self.curve().start * len;
                self.velocities[start..start + velocities.len()].copy_from_slice(&velocities);
                turns::repeat(&mut self.velocities, len);
            }
        }
    }

    /// Whether nothing is left to do.
    pub fn done(&self) -> bool {
        self.progress.report.state != State::Running
    }

    /// No spline goes through the points: back by half of the step.
    pub fn retreat(&mut self, space: &Erased) {
        self.retreats += 1;
        let Some((points, step)) = self.before.as_mut().filter(|_| self.retreats <= RETREATS) else {
            self.progress.report.state = State::NoCurve;
            return;
        };
        step.iter_mut().for_each(|x| *x *= 0.5);
        let (points, step) = (points.clone(), step.clone());
        self.go(space, &points, &step);
    }

    /// One step from the spline through the points, or the end; on all cores if no other curve is worked on.
    pub fn advance(&mut self, space: &Erased, options: &Options, monitor: &Monitor, alone: bool) {
        let velocities = self.end_velocities(space);
        let curve = self.curve();
        let Track { data, flat, progress, .. } = self;
        let (m, spacing, weights) = (space.dim(), flat.basis.spacing, data.weights);
        progress.report.iterations += 1;
        let path = Path { t: &self.knots, points: &self.points, velocities: &self.velocities };
        // The same without the turns before and after it that a closed curve has.
        let len = space.point_len();
        let whole = Path {
            t: &self.knots[curve.clone()],
            points: &self.points[curve.start * len..curve.end * len],
            velocities: &self.velocities[curve.start * len..curve.end * len],
        };
        let seen = flat.own.data.clone();
        let frames = Frames::new(space, &self.points);
        let gammas = path.at(space, &self.places);
        let (vectors, distances) = pulls(space, &gammas, data.points);
        let carried =
            (!self.roots.is_empty()).then(|| information::carried_frames(space, &gammas, data.points));
        let mut residuals = path.at_knots(space, &frames, &self.places, &gammas, &vectors);
        let informed = carried.as_ref().map(|carried| {
            let vectors = |j: usize| information::members(carried, j, m, len);
            let columns: Vec<Vec<f64>> =
                (0..m).map(|j| path.at_knots(space, &frames, &self.places, &gammas, &vectors(j))).collect();
            information::at_data(space, &self.roots, &columns, &residuals)
        });
        let squares: Vec<f64> = match &informed {
            None => distances.iter().zip(weights).map(|(square, w)| square * w).collect(),
            Some(found) => found.residuals.chunks_exact(m).map(|s| s.iter().map(|x| x * x).sum()).collect(),
        };
        let (factors, softness) = options.loss.pseudo(self.corner, &squares, m);
        if progress.report.exact && progress.settled {
            let lam = progress.lam.unwrap_or(0.0) * spacing.powi(3);
            let terms = squares[seen.clone()].iter().map(|square| options.loss.value(*square, self.corner));
            let before = std::mem::replace(
                &mut self.objective,
                terms.sum::<f64>() + lam * exact::energy(space, &whole),
            );
            if self.objective > before * (1.0 + ROUNDING) && self.retreats < RETREATS {
                self.objective = before;
                return self.retreat(space);
            }
        }
        self.retreats = 0;
        let softened = |x: &mut [f64]| {
            for (x, factor) in x.chunks_exact_mut(m).zip(&factors) {
                x.iter_mut().for_each(|x| *x *= factor);
            }
        };
        let misfit = match informed {
            None => {
                softened(&mut residuals);
                Misfit::Numbers { weights, residuals }
            }
            Some(mut found) => {
                softened(&mut found.residuals);
                softened(&mut found.pulls);
                Misfit::matrices(flat, m, found)
            }
        };
        let mut bends = frames.coordinates(&path.bends(space, &path.knots()), |i| i);
        let mut speeds = frames.coordinates(&self.velocities, |i| i);
        bends.iter_mut().for_each(|x| *x *= spacing * spacing);
        speeds.iter_mut().for_each(|x| *x *= spacing);
        let curvature = curvature_terms(space, &speeds, &bends);
        let linear = Linear::new(flat, m, &misfit, &bends, &curvature, data.sigma.unwrap_or(f64::NAN));

        progress.choose(&linear, options, softness);
        // The pseudo-data have the original weights, and their λ is softer by their slope.
        let lam = progress.lam.unwrap_or(0.0) / softness;
        let system = misfit.factored(flat, m, lane(lam));
        if !(system.least_pivot().as_array()[0] > 0.0) {
            progress.report.state = State::Undetermined;
            return;
        }
        let band = system.inverse_band();
        let inverse = system.mean(&band);
        let before = progress.report.freedom;
        progress.note(&linear, &band, lam, softness);
        // Where λ hardly matters, as for a geodesic, its best value wanders.
        progress.settled |= progress.report.rounds > 1
            && (progress.report.freedom - before).abs() < SETTLED * progress.report.freedom;
        progress.expect(space, &speeds, weights, lam);

        let exact = progress.takes_exact_way(space, options.tier);
        if exact && !progress.report.exact {
            // What is known of steps is of the other way.
            (progress.last_step, progress.slow, self.objective) = (f64::INFINITY, 0, f64::INFINITY);
        }
        progress.report.exact = exact;
        let (step, ambient) = if exact {
            let unit = spacing.powi(3);
            // What lies where one turn ends lies at the end of its last segment.
            let last = curve.end - 2;
            let of_place = |&(segment, tau): &Place| {
                if segment > last { (last - curve.start, 1.0) } else { (segment - curve.start, tau) }
            };
            let places: Vec<Place> = self.places[seen.clone()].iter().map(of_place).collect();
            let information = carried.as_ref().map(|carried| {
                (&self.roots[seen.clone()], &carried[seen.start * m * len..seen.end * m * len])
            });
            let pull = Pull {
                places: &places,
                points: &gammas[seen.start * len..seen.end * len],
                vectors: &vectors[seen.start * len..seen.end * len],
                factors: &factors[seen.clone()],
                weights: &weights[seen.clone()],
                information,
            };
            let ends = match self.ends {
                Ends::Periodic => FitEnds::Periodic,
                open => FitEnds::Open(few(|e| end_of(open, e, &velocities[e]))),
            };
            let own = exact::step(space, &whole, ends, &pull, lam * unit, monitor, alone);
            let mut ambient = vec![0.0; self.points.len()];
            ambient[curve.start * len..curve.end * len].copy_from_slice(&own);
            if self.ends == Ends::Periodic {
                turns::repeat(&mut ambient, len);
            }
            (frames.coordinates(&ambient, |i| i), Some(ambient))
        } else {
            let change = linear.step(lam, &system);
            let mut step = vec![0.0; change.len()];
            flat.values.iter().zip(step.chunks_exact_mut(m)).for_each(|(row, x)| row.apply(&change, x));
            (step, None)
        };
        let deviations: Vec<f64> =
            flat.values.iter().map(|row| (row.square(&inverse).as_array()[0] * m as f64).sqrt()).collect();
        let reach = speeds.chunks_exact(m).map(length).sum::<f64>();
        let own = flat.own.knots.clone();
        let own_step = &step[own.start * m..own.end * m];
        let small = progress.judge(own_step, &deviations[own], reach, options);
        self.inverse = Some(inverse);
        if progress.settled && small {
            if !self.rescaled {
                return self.rescale(options, &squares, m);
            }
            progress.report.state = State::Converged;
            return;
        }
        if progress.report.iterations >= options.max_iter {
            progress.report.state = State::Unconverged;
            return;
        }
        // Farther than the data are nothing is known.
        let farthest = distances.iter().copied().fold(0.0, f64::max).sqrt() + 0.1 * reach;
        let longest = step.chunks_exact(m).map(length).fold(0.0, larger);
        let further = if progress.settled { progress.further(&step) } else { 1.0 };
        let factor = if longest * further > farthest { farthest / longest } else { further };
        let mut ambient = ambient.unwrap_or_else(|| frames.tangents(&step));
        ambient.iter_mut().for_each(|x| *x *= factor);
        let before = self.points.clone();
        self.go(space, &before, &ambient);
        self.before = Some((before, ambient));
    }

    /// Moves the points.
    fn go(&mut self, space: &Erased, from: &[f64], step: &[f64]) {
        self.points = moved(space, from, step);
        if self.ends == Ends::Periodic {
            turns::repeat(&mut self.points, space.point_len());
        }
    }

    /// Once more with the noise beside the curve, which is never taken to be larger, nor much smaller.
    fn rescale(&mut self, options: &Options, squares: &[f64], m: usize) {
        let own = self.flat.own.data.clone();
        let freedom = self.progress.report.freedom;
        let noise = loss::noise_beside(&squares[own], freedom, m);
        self.corner = (noise * options.loss.corner(m)).clamp(0.5 * self.corner, self.corner);
        (self.rescaled, self.objective) = (true, f64::INFINITY);
        (self.progress.settled, self.progress.report.rounds) = (self.data.lam.is_some(), 0);
    }
}

impl Progress {
    /// How far to go along a step if steps shrink slowly in one direction: the limit of their geometric series (Aitken).
    fn further(&mut self, step: &[f64]) -> f64 {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let ratio = product(step, &self.last) / product(&self.last, &self.last);
        if self.last.len() == step.len() && ratio > 0.3 && ratio < 0.9 {
            self.last.clear();
            return 1.0 / (1.0 - ratio);
        }
        self.last = step.to_vec();
        1.0
    }

    /// Whether the exact way is to be taken.
    fn takes_exact_way(&self, space: &Erased, tier: Tier) -> bool {
        match tier {
            Tier::Flat => false,
            Tier::Newton => true,
            // In flat space the flat way is the exact one; and the blocks of the other have a limit.
            Tier::Auto if space.curvature() == 0.0 || space.dim() > LARGE => false,
            Tier::Auto => {
                let limit = if self.settled { SLOW } else { HOPELESS };
                let known = self.settled && self.report.exact;
                known || self.report.kappa > limit || self.slow > 1
            }
        }
    }

    /// A better λ, unless it is given or settled.
    fn choose(&mut self, linear: &Linear, options: &Options, softness: f64) {
        if self.settled {
            return;
        }
        let (lam, at_bound) = linear.choose(options.criterion, self.lam.map(|lam| lam / softness));
        let lam = lam * softness;
        self.report.rounds += 1;
        let moved = self.lam.map_or(f64::INFINITY, |before| (lam / before).ln().abs());
        self.settled = moved < SETTLED || self.report.rounds >= ROUNDS;
        self.report.at_bound = at_bound;
        self.lam = Some(lam);
    }

    /// λ, degrees of freedom and noise of the curve as it is.
    fn note(&mut self, linear: &Linear, inverse: &Banded, lam: f64, softness: f64) {
        let Linear { flat, m, misfit, .. } = linear;
        let own = flat.own.data.clone();
        let count = misfit.count(own.clone(), *m);
        let rss = misfit.rss_now(own, *m);
        let unit = flat.basis.spacing.powi(3);
        let freedom = misfit.freedom(flat, *m, inverse).as_array()[0];
        self.report.freedom = freedom;
        self.report.lam = lam * softness * unit;
        self.report.band_lam = lam * unit;
        // A curve through all data says nothing of noise.
        let left = count - freedom;
        self.report.sigma = if left > 1e-9 * count { (rss / (*m as f64 * left)).sqrt() } else { f64::NAN };
        self.scale = (rss / (*m as f64 * left.max(1.0))).sqrt();
    }

    /// The contraction that the flat way is expected to have: `K²|γ'|²√(λ/w)`, with the mean
    /// squared speed and w the weight per time.
    fn expect(&mut self, space: &Erased, speeds: &[f64], weights: &[f64], lam: f64) {
        let m = space.dim();
        let knots = speeds.len() / m;
        let square = speeds.iter().map(|u| u * u).sum::<f64>() / knots as f64;
        let density = weights.iter().sum::<f64>() / (knots - 1) as f64;
        self.report.kappa = space.curvature().powi(2) * square * (lam / density).sqrt();
    }

    /// Whether a step is small beside the standard deviations of the points.
    fn judge(&mut self, step: &[f64], deviations: &[f64], reach: f64, options: &Options) -> bool {
        /// Steps that are this part of the path, and no longer shrink, are rounding.
        const FLOOR: f64 = 1e-8;
        const STILL: f64 = 1e-13;
        let lengths: Vec<f64> = step.chunks_exact(step.len() / deviations.len()).map(length).collect();
        let longest = lengths.iter().copied().fold(0.0, larger);
        let relative = lengths.iter().zip(deviations).map(|(x, d)| x / (d * self.scale)).fold(0.0, larger);
        let rate = longest / self.last_step;
        if self.last_step.is_finite() {
            self.report.rate = rate;
            // Steps of new λ are no contraction; but they do not grow.
            let slow = rate > if self.settled { SLOW } else { 1.0 };
            self.slow = if slow { self.slow + 1 } else { 0 };
        }
        self.last_step = longest;
        self.report.step = relative;
        // Squares that are too large or too small for doubles say nothing.
        let known = self.scale.is_finite() && (longest > 0.0 || step.iter().all(|x| *x == 0.0));
        known
            && (relative <= options.tol
                || longest <= STILL * reach
                || (longest <= FLOOR * reach && rate > SLOW))
    }
}

/// The condition at an end.
pub fn end_of(ends: Ends, e: usize, velocity: &[f64]) -> End<'_> {
    match ends {
        Ends::Open(kinds) if kinds[e] == FlatEnd::Velocity => End::Velocity(velocity),
        _ => End::Natural,
    }
}

/// ρ = −[u, [u, a]]: what curvature adds to the gradient of the energy.
fn curvature_terms(space: &Erased, speeds: &[f64], bends: &[f64]) -> Vec<f64> {
    let m = space.dim();
    let count = bends.len() / m;
    let mut out = vec![0.0; bends.len()];
    let [mut u, mut a, mut rho] = [(); 3].map(|_| vec![Lane::ZERO; m]);
    for (group, out) in out.chunks_mut(LANES * m).enumerate() {
        let at = lanes_of(group, count);
        gather(at.map(|i| &speeds[i * m..][..m]), &mut u);
        gather(at.map(|i| &bends[i * m..][..m]), &mut a);
        space.triple(&u, &u, &a, &mut rho);
        rho.iter_mut().for_each(|x| *x = -*x);
        scatter(&rho, out);
    }
    out
}

fn length(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The larger of two numbers, or NaN.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
