//! One curve on its way to the smoothing spline.

use crate::banded::Banded;
use crate::choice::Linear;
use crate::curved::Curved;
use crate::exact::{self, Pull};
use crate::flat::{Basis, Flat, FlatEnd, Own};
use crate::frames::{Frames, curvature_terms};
use crate::information::{self, Root};
use crate::loss;
use crate::path::{Path, Place, moved, places};
use crate::progress::{Progress, larger, length};
use crate::sight::Sight;
use crate::turns;
use crate::variance::rows_of;
use crate::{Data, Ends, Options, Report, Smooth, State};
use std::f64::consts::PI;
use std::ops::Range;
use symspline_core::fit::Ends as FitEnds;
use symspline_core::monitor::Monitor;
use symspline_core::scalar::{Lane, lane};
use symspline_core::space::{Ambient, Erased, Origin};

/// Steps are taken back and halved at most so often where no spline goes through the points they lead to.
const RETREATS: usize = 6;
/// Steps of the flat way that are longer than they may be, with a final λ, before it is given up: it does not contract,
/// and what it comes to in the end, if it does, is a minimum near other curves.
const ASTRAY: usize = 8;
/// Of data with unequal weights the weight that one in so many does not reach says how stiff a curve is.
const LIGHT: usize = 10;
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
    /// Points at the knots to begin with.
    first: Vec<f64>,
    /// Points at the knots.
    pub points: Vec<f64>,
    /// Velocities of the spline through them.
    pub velocities: Vec<f64>,
    /// Where the last step began, and the step.
    before: Option<(Vec<f64>, Vec<f64>)>,
    retreats: usize,
    /// Steps of the flat way that were too long.
    strays: usize,
    /// J on the exact way, at the last λ.
    objective: f64,
    /// The band of A⁻¹ at the end.
    inverse: Option<Banded>,
    progress: Progress,
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
        let roots = information::roots(data.information, m);
        let mut weights: Vec<f64> = roots.iter().map(|root| root.weight).collect();
        if weights.is_empty() {
            weights.extend_from_slice(data.weights);
        }
        let count = weights.len();
        let light = *weights.select_nth_unstable_by(count / LIGHT, f64::total_cmp).1;
        let density = light * count as f64 / (knots.len() - 1) as f64;
        Track {
            roots,
            data,
            places,
            flat,
            ends,
            corner,
            rescaled: corner.is_infinite() || data.sigma.is_some(),
            velocities: vec![0.0; points.len()],
            first: points.clone(),
            points,
            knots,
            before: None,
            retreats: 0,
            strays: 0,
            objective: f64::INFINITY,
            inverse: None,
            progress: Progress::new(lam.map(|lam| lam / unit), stiffest, density),
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
        let (data, flat) = (&self.data, &self.flat);
        let (m, spacing) = (space.dim(), flat.basis.spacing);
        self.progress.report.iterations += 1;
        let path = Path { t: &self.knots, points: &self.points, velocities: &self.velocities };
        let frames = Frames::new(space, &self.points);
        let mut sight = Sight::new(space, &path, &frames, &self.places, flat, data, &self.roots);
        let (factors, softness) = options.loss.pseudo(self.corner, &sight.squares, m);
        if self.progress.settled && self.progress.report.exact {
            let objective = self.value(space, options, &sight);
            let before = std::mem::replace(&mut self.objective, objective);
            if self.objective > before * (1.0 + ROUNDING) && self.retreats < RETREATS {
                self.objective = before;
                return self.retreat(space);
            }
        }
        self.retreats = 0;
        sight.soften(factors, m);
        let misfit = &sight.misfit;
        let mut bends = frames.coordinates(&path.bends(space, &path.knots()), |i| i);
        let mut speeds = frames.coordinates(&self.velocities, |i| i);
        bends.iter_mut().for_each(|x| *x *= spacing * spacing);
        speeds.iter_mut().for_each(|x| *x *= spacing);
        let curvature = curvature_terms(space, &speeds, &bends);
        let sigma = data.sigma.unwrap_or(f64::NAN);
        let seen_with = |curved| Linear::new(flat, m, misfit, curved, &bends, &curvature, sigma);
        let (curved, later);
        curved = self.progress.curved.then(|| Curved::new(space, flat, &speeds));
        let mut linear = seen_with(curved.as_ref());
        let mut lam = self.progress.weigh(space, &linear, &speeds, options, softness);
        if self.progress.curved && linear.curved.is_none() {
            later = Curved::new(space, flat, &speeds);
            linear = seen_with(Some(&later));
            lam = self.progress.weigh(space, &linear, &speeds, options, softness);
        }
        let system = linear.factored(lane(lam));
        if !(system.least_pivot().as_array()[0] > 0.0) {
            self.progress.report.state = State::Undetermined;
            return;
        }
        let band = system.inverse_band();
        let inverse = system.mean(&band);
        self.progress.note(&linear, &band, lam, softness);

        let exact = self.progress.takes_exact_way(space, options.tier, options.ends);
        if exact && self.strays > 0 {
            return self.begin_again();
        }
        if exact && !self.progress.report.exact {
            // What is known of steps is of the other way.
            (self.progress.last_step, self.progress.slow, self.objective) = (f64::INFINITY, 0, f64::INFINITY);
        }
        self.progress.report.exact = exact;
        let (step, ambient) = if exact {
            let lam = lam * spacing.powi(3);
            let ends = self.ends.of_fit(&velocities);
            let ambient = self.exact_step(space, ends, &sight, lam, monitor, alone);
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
        let small = self.progress.judge(own_step, &deviations[own], reach, options);
        self.inverse = Some(inverse);
        if self.progress.settled && small {
            if !self.rescaled {
                return self.rescale(options, &sight.squares, m);
            }
            self.progress.report.state =
                if self.progress.unsettled { State::Unsettled } else { State::Converged };
            return;
        }
        // Farther than the data are nothing is known.
        let farthest = sight.distances.iter().copied().fold(0.0, f64::max).sqrt() + 0.1 * reach;
        let longest = step.chunks_exact(m).map(length).fold(0.0, larger);
        let further = if self.progress.settled { self.progress.further(&step) } else { 1.0 };
        let limited = longest * further > farthest;
        self.strays += usize::from(limited && self.progress.settled && !exact);
        if self.strays > ASTRAY && self.progress.may_be_exact(space, options.tier, options.ends) {
            return self.begin_again();
        }
        if self.progress.report.iterations >= options.max_iter || self.strays > ASTRAY {
            self.progress.report.state = State::Unconverged;
            return;
        }
        let factor = if limited { farthest / longest } else { further };
        let mut ambient = ambient.unwrap_or_else(|| frames.tangents(&step));
        ambient.iter_mut().for_each(|x| *x *= factor);
        let before = self.points.clone();
        self.go(space, &before, &ambient);
        self.before = Some((before, ambient));
    }

    /// From the beginning by the exact way: to where the flat way went astray the exact one may go astray, too.
    fn begin_again(&mut self) {
        (self.strays, self.before, self.retreats) = (0, None, 0);
        (self.progress.last_step, self.progress.slow, self.objective) = (f64::INFINITY, 0, f64::INFINITY);
        self.progress.forced = true;
        if self.data.lam.is_none() {
            (self.progress.settled, self.progress.lam, self.progress.report.rounds) = (false, None, 0);
        }
        self.points = self.first.clone();
    }

    /// J of the curve as it is.
    fn value(&self, space: &Erased, options: &Options, sight: &Sight) -> f64 {
        let lam = self.progress.lam.unwrap_or(0.0) * self.flat.basis.spacing.powi(3);
        let own = &sight.squares[self.flat.own.data.clone()];
        let terms = own.iter().map(|square| options.loss.value(*square, self.corner));
        terms.sum::<f64>() + lam * exact::energy(space, &self.whole(space.point_len()))
    }

    /// The curve without the turns before and after it that a closed one has.
    fn whole(&self, len: usize) -> Path<'_> {
        let Range { start, end } = self.curve();
        Path {
            t: &self.knots[start..end],
            points: &self.points[start * len..end * len],
            velocities: &self.velocities[start * len..end * len],
        }
    }

    /// The step of the exact way, as tangent vectors.
    fn exact_step(
        &self,
        space: &Erased,
        ends: FitEnds,
        sight: &Sight,
        lam: f64,
        monitor: &Monitor,
        alone: bool,
    ) -> Vec<f64> {
        let (m, len) = (space.dim(), space.point_len());
        let (curve, seen) = (self.curve(), self.flat.own.data.clone());
        // What lies where one turn ends lies at the end of its last segment.
        let last = curve.end - 2;
        let of_place = |&(segment, tau): &Place| {
            if segment > last { (last - curve.start, 1.0) } else { (segment - curve.start, tau) }
        };
        let places: Vec<Place> = self.places[seen.clone()].iter().map(of_place).collect();
        let information = sight
            .carried
            .as_ref()
            .map(|carried| (&self.roots[seen.clone()], &carried[seen.start * m * len..seen.end * m * len]));
        let pull = Pull {
            places: &places,
            points: &sight.gammas[seen.start * len..seen.end * len],
            vectors: &sight.vectors[seen.start * len..seen.end * len],
            factors: &sight.factors[seen.clone()],
            weights: &self.data.weights[seen],
            information,
        };
        let own = exact::step(space, &self.whole(len), ends, &pull, lam, monitor, alone);
        let mut step = vec![0.0; self.points.len()];
        step[curve.start * len..curve.end * len].copy_from_slice(&own);
        if self.ends == Ends::Periodic {
            turns::repeat(&mut step, len);
        }
        step
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
