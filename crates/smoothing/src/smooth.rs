//! Smoothing of many curves at a time: every iteration advances all curves that have not converged.

use crate::adaptive::on_segments;
use crate::banded::stride;
use crate::chain::{chain, rounding};
use crate::curve_fit::CurveFit;
use crate::information;
use crate::path::Path;
use crate::problem::{Data, EndCondition, EndConditions, Loss, Options, Penalty, Smooth, State};
use crate::robust::Robust;
use crate::start::{Level, levels};
use symspline_core::fit::{End, Ends, Method, Options as FitOptions, Problem, Report, Status, fit};
use symspline_core::memory;
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::scalar::LANES;
use symspline_core::space::{Ambient, Erased, Frame, Origin};

/// The maximum number of iterations of an intermediate fit. If it does not converge, a shorter step is better than
/// more iterations ...
const FIT: FitOptions = FitOptions { method: Method::Auto, tol: 1e-12, max_iter: Some(200), certify: None };
/// ... unless the step is already short.
const LONG_FIT: FitOptions = FitOptions { max_iter: None, ..FIT };
/// The C² residual that suffices for an intermediate spline.
const ENOUGH: f64 = 1e-8;
const NATURAL: Ends<'static> = Ends::Open([End::Natural; 2]);
/// The number of segments in a gap, about. A curve without data is smooth, so that 32 segments represent it with an error
/// far below its standard error.
const IN_GAP: f64 = 32.0;
/// Knots times dimensions from which several threads are faster.
const PARALLEL: usize = 4096;

/// Smooths curves; they are independent of each other.
pub fn smooth(space: &Erased, data: &[Data], options: &Options, monitor: &Monitor) -> Vec<Smooth> {
    let numbers: usize = data.iter().map(|data| size(space, data)).sum();
    memory::require(numbers as f64, "smoothing", "Use fewer knots, or smooth the data in parts");
    let knots: Vec<Vec<f64>> = data.iter().map(|data| knots_near_data(data, options)).collect();
    let starts: Vec<Vec<f64>> =
        data.iter().zip(&knots).map(|(data, knots)| at_knots(data, knots, space.point_len())).collect();
    let profiles: Vec<Vec<f64>> = data
        .iter()
        .zip(&knots)
        .map(|(data, knots)| match data.profile {
            [] => Vec::new(),
            profile => on_segments(data.knots, profile, knots),
        })
        .collect();
    let near: Vec<Data> = data
        .iter()
        .zip(&knots)
        .zip(starts.iter().zip(&profiles))
        .map(|((data, knots), (start, profile))| Data { knots, start, profile, ..*data })
        .collect();
    let mut tracks: Vec<CurveFit> = solve(space, &near, options, monitor)
        .into_iter()
        .zip(data)
        .map(|(track, data)| {
            let whole = track.knots.len() == data.knots.len();
            if whole { track } else { track.prolonged(space, *data, options) }
        })
        .collect();
    let mut long: Vec<&mut CurveFit> = tracks.iter_mut().filter(|track| track.is_prolonged()).collect();
    if !long.is_empty() && !monitor.cancelled() {
        let shared: Vec<&CurveFit> = long.iter().map(|track| &**track).collect();
        let fitted = fit_tracks(space, &shared, options, &LONG_FIT, monitor);
        let items: Vec<_> = long.iter_mut().zip(fitted).collect();
        parallel::for_each(items, data.len() > 1, monitor, |(track, velocities)| {
            track.conclude(space, options, monitor, velocities);
        });
    }
    tracks.into_iter().map(CurveFit::finish).collect()
}

/// The approximate count of floating-point numbers in memory while a curve is smoothed: band matrices of several λ, and
/// several vectors per knot and per datum. Those of full Gauss–Newton are not included.
fn size(space: &Erased, data: &Data) -> usize {
    let (knots, count) = (data.knots.len(), data.times.len());
    let per_knot = 300 + 24 * space.point_len() + 2 * space.frame_len();
    let coupled = if data.information.is_empty() { 0 } else { 3 * stride(space.dim()) * space.dim() * LANES };
    knots * (per_knot + coupled) + count * (4 * space.point_len() + 16) + 2 * data.information.len()
}

/// The knots of the iteration. Beyond the first and the last datum, a curve with natural ends is a geodesic and needs no
/// knots. In gaps, it needs some of them.
///
/// Data hardly determine the points at other knots, and the iteration would diverge on curved spaces.
fn knots_near_data(data: &Data, options: &Options) -> Vec<f64> {
    let EndConditions::Open(kinds) = options.ends else { return data.knots.to_vec() };
    let [Some(first), Some(last)] = [data.times.first(), data.times.last()] else {
        return data.knots.to_vec();
    };
    let knots = data.knots;
    let geodesic =
        kinds.map(|kind| kind == EndCondition::Natural && options.penalty == Penalty::Acceleration);
    let start = if geodesic[0] { knots.partition_point(|t| t <= first).saturating_sub(1) } else { 0 };
    let stop = if geodesic[1] { knots.partition_point(|t| t < last) } else { knots.len() - 1 };
    let stop = stop.min(knots.len() - 1);
    if stop <= start { knots.to_vec() } else { thinned_in_gaps(&knots[start..=stop], data.times) }
}

/// The points of a given initial curve at some of the knots.
fn at_knots(data: &Data, knots: &[f64], len: usize) -> Vec<f64> {
    if data.start.is_empty() {
        return Vec::new();
    }
    let place = |t: &f64| data.knots.partition_point(|knot| knot < t);
    knots.iter().flat_map(|t| &data.start[place(t) * len..][..len]).copied().collect()
}

/// Knots without most of those in gaps. Two neighbours in a gap are apart by at least half of the distance to the nearest
/// datum, or by the length of the gap divided by [`IN_GAP`].
fn thinned_in_gaps(knots: &[f64], times: &[f64]) -> Vec<f64> {
    let mut kept = vec![knots[0]];
    for &t in &knots[1..knots.len() - 1] {
        let after = times.partition_point(|x| *x <= t);
        let (before, next) = (times[after.saturating_sub(1)], times[after.min(times.len() - 1)]);
        let least = (0.5 * (t - before).min(next - t)).min((next - before) / IN_GAP);
        if t - kept[kept.len() - 1] >= least {
            kept.push(t);
        }
    }
    kept.push(knots[knots.len() - 1]);
    kept
}

/// Iterates until all curves have converged or failed.
fn solve<'a>(space: &Erased, data: &[Data<'a>], options: &Options, monitor: &Monitor) -> Vec<CurveFit<'a>> {
    let len = space.point_len();
    let work: usize = data.iter().map(|d| d.times.len()).sum::<usize>() * space.dim();
    let threads = data.len() > 1 && work > PARALLEL;
    let mut beginnings = beginnings(space, data, options, monitor, threads);
    let mut tracks: Vec<Option<CurveFit>> = data.iter().map(|_| None).collect();
    start(space, data, options, monitor, &mut beginnings, &mut tracks);
    while !monitor.cancelled() {
        // If no spline joins the initial points, smoother initial points are tried.
        for track in &mut tracks {
            track.take_if(|track| track.report().state == State::NoCurve && track.report().iterations == 0);
        }
        start(space, data, options, monitor, &mut beginnings, &mut tracks);
        let mut running: Vec<&mut CurveFit> =
            tracks.iter_mut().flatten().filter(|track| !track.done()).collect();
        if running.is_empty() {
            break;
        }
        let mut fitted =
            fit_tracks(space, &running.iter().map(|t| &**t).collect::<Vec<_>>(), options, &FIT, monitor);
        let again =
            |(track, found): (&&mut CurveFit, &Option<Vec<f64>>)| found.is_none() && track.steps_are_short();
        let again: Vec<bool> = running.iter().zip(&fitted).map(again).collect();
        if again.contains(&true) {
            let chosen: Vec<&CurveFit> =
                running.iter().zip(&again).filter(|(_, again)| **again).map(|(t, _)| &**t).collect();
            let found = fit_tracks(space, &chosen, options, &LONG_FIT, monitor);
            let positions = fitted.iter_mut().zip(&again).filter(|(_, again)| **again);
            positions.zip(found).for_each(|((position, _), found)| *position = found);
        }
        let items: Vec<_> = running.iter_mut().zip(fitted).collect();
        parallel::for_each(items, threads, monitor, |(track, velocities)| match velocities {
            None => track.retreat(space, options),
            Some(velocities) => {
                track.velocities = velocities;
                track.advance(space, options, monitor, !threads);
                if track.done() {
                    monitor.advance(track.knots.len());
                }
            }
        });
    }
    let ended = tracks.into_iter().zip(data).map(|(track, data)| {
        track.unwrap_or_else(|| {
            let points = vec![f64::NAN; data.knots.len() * len];
            let plain = Robust::plain(space.dim());
            let mut none = CurveFit::new(*data, space.dim(), data.knots.to_vec(), points, options, plain);
            none.retreat(space, options);
            none
        })
    });
    ended.collect()
}

/// The velocities of the splines through the points of curves.
fn fit_tracks(
    space: &Erased,
    tracks: &[&CurveFit],
    options: &Options,
    how: &FitOptions,
    monitor: &Monitor,
) -> Vec<Option<Vec<f64>>> {
    let ends: Vec<[Vec<f64>; 2]> = tracks.iter().map(|track| track.end_velocities(space)).collect();
    let ends = [0, 1].map(|e| ends.iter().flat_map(|own| own[e].iter().copied()).collect::<Vec<f64>>());
    let curves = tracks.iter().map(|track| (&track.knots[..], &track.points[..]));
    fit_all(space, curves, options.ends.of_fit(&ends), how, monitor)
}

/// The velocities of the splines through the points, where such splines exist.
fn fit_all<'a>(
    space: &Erased,
    curves: impl Iterator<Item = (&'a [f64], &'a [f64])>,
    ends: Ends,
    how: &FitOptions,
    monitor: &Monitor,
) -> Vec<Option<Vec<f64>>> {
    let len = space.point_len();
    let (mut t, mut points, mut offsets) = (Vec::new(), Vec::new(), vec![0]);
    for (knots, own) in curves {
        t.extend_from_slice(knots);
        points.extend_from_slice(own);
        offsets.push(t.len());
    }
    let mut velocities = vec![0.0; points.len()];
    let problem = Problem { t: &t, shared: false, points: &points, offsets: &offsets, ends };
    // Progress counts curves, not intermediate fits.
    let silent = |_| !monitor.poll();
    let reports = fit(space, &problem, how, &Monitor::new(&silent), &mut velocities);
    let own = |c: usize| velocities[offsets[c] * len..offsets[c + 1] * len].to_vec();
    // Knots that nearly coincide leave a residual of rounding errors. It exceeds the tolerance, but is small compared
    // with noise.
    let fitted = |r: &Report| {
        let failed = matches!(r.status, Status::Unconverged | Status::Imprecise);
        r.status == Status::Converged || (failed && r.residual < ENOUGH)
    };
    reports.iter().enumerate().map(|(c, r)| fitted(r).then(|| own(c))).collect()
}

/// Initial curves of the iteration.
#[derive(Default)]
struct Beginning {
    /// Means of the data, the best last.
    levels: Vec<Level>,
    /// For a robust loss: the data that agree with their neighbours.
    kept: Vec<f64>,
}

fn beginnings(
    space: &Erased,
    data: &[Data],
    options: &Options,
    monitor: &Monitor,
    threads: bool,
) -> Vec<Beginning> {
    let mut all: Vec<Beginning> = data.iter().map(|_| Beginning::default()).collect();
    parallel::for_each(all.iter_mut().zip(data).collect(), threads, monitor, |(found, data)| {
        let weights = if data.information.is_empty() {
            data.weights.to_vec()
        } else {
            // A point is one observation here, with the average weight of its directions.
            information::roots(data.information, space.dim()).iter().map(|root| root.weight).collect()
        };
        let data = Data { weights: &weights, ..*data };
        let period = data.knots[data.knots.len() - 1] - data.knots[0];
        let density = weights.iter().sum::<f64>() / period;
        let exponent = 1.0 / f64::from(options.penalty.power() + 1);
        let averaged = data.lam.map(|lam| (lam / density).powf(exponent));
        let given = !data.start.is_empty();
        let [times, points, weights] = if options.loss == Loss::Linear {
            [data.times.to_vec(), data.points.to_vec(), weights.clone()]
        } else {
            found.kept = chain(space, &data);
            chosen(space, &data, &found.kept)
        };
        found.levels = match options.ends {
            _ if given => vec![Level::of(data.knots, data.start)],
            EndConditions::Open(_) => levels(space, &times, &points, &weights, averaged),
            // One period before and one after, so that the initial curve closes.
            EndConditions::Periodic => {
                let turns = |x: f64| move |t: &f64| t + x * period;
                let times =
                    [-1.0, 0.0, 1.0].map(|x| times.iter().map(turns(x)).collect::<Vec<f64>>()).concat();
                levels(space, &times, &points.repeat(3), &weights.repeat(3), averaged)
            }
        };
        found.levels.reverse();
    });
    all
}

/// The times, points and weights of the selected data; of all data if they do not span any time.
fn chosen(space: &Erased, data: &Data, kept: &[f64]) -> [Vec<f64>; 3] {
    let len = space.point_len();
    let used: Vec<usize> = (0..kept.len()).filter(|&k| kept[k] > 0.0).collect();
    let spans = matches!((used.first(), used.last()), (Some(&a), Some(&b)) if data.times[a] < data.times[b]);
    let used = if spans { used } else { (0..kept.len()).collect() };
    [
        used.iter().map(|&k| data.times[k]).collect(),
        used.iter().flat_map(|&k| data.points[k * len..][..len].to_vec()).collect(),
        used.iter().map(|&k| data.weights[k]).collect(),
    ]
}

/// Initial curves for the curves without one; none if even the geodesic between the first and the last mean does not
/// exist.
fn start<'a>(
    space: &Erased,
    data: &[Data<'a>],
    options: &Options,
    monitor: &Monitor,
    beginnings: &mut [Beginning],
    tracks: &mut [Option<CurveFit<'a>>],
) {
    loop {
        let missing: Vec<usize> = (0..data.len()).filter(|&c| tracks[c].is_none()).collect();
        let tried: Vec<(usize, Level)> =
            missing.into_iter().filter_map(|c| Some((c, beginnings[c].levels.pop()?))).collect();
        if tried.is_empty() || monitor.cancelled() {
            return;
        }
        let levels = tried.iter().map(|(_, level)| (&level.times[..], &level.points[..]));
        let fitted = fit_all(space, levels, NATURAL, &FIT, monitor);
        for ((c, level), velocities) in tried.iter().zip(fitted) {
            let Some(velocities) = velocities else { continue };
            let path = Path { t: &level.times, points: &level.points, velocities: &velocities };
            let knots = data[*c].knots;
            let mut points = path.prolonged(space, knots);
            if options.ends == EndConditions::Periodic {
                let (len, last) = (space.point_len(), points.len() - space.point_len());
                points.copy_within(..len, last);
            }
            let (m, own) = (space.dim(), data[*c]);
            let robust = if options.loss == Loss::Linear {
                Robust::plain(m)
            } else {
                let (kept, rounding) = (beginnings[*c].kept.clone(), rounding(space, &own));
                Robust::new(options.loss, m, own.sigma, own.lam, kept, own.weights, rounding)
            };
            tracks[*c] = Some(CurveFit::new(own, m, knots.to_vec(), points, options, robust));
        }
    }
}
