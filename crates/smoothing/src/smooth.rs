//! Many curves at a time: those that are not done go one step on together.

use crate::information;
use crate::loss::{self, Loss};
use crate::path::{Path, moved, places};
use crate::start::{Level, levels};
use crate::track::Track;
use crate::turns::{self, Turns};
use crate::{Data, Ends, Options, Smooth};
use std::ops::Range;
use symspline_core::fit::{End, Ends as FitEnds, Method, Options as FitOptions, Problem, Status, fit};
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::space::{Ambient, Erased, Origin};

/// Where that is not enough for a spline a shorter step is better than a longer search.
const FIT: FitOptions = FitOptions { method: Method::Auto, tol: 1e-12, max_iter: Some(200) };
const NATURAL: FitEnds<'static> = FitEnds::Open([End::Natural; 2]);
/// Knots times dimensions from which threads pay.
const PARALLEL: usize = 4096;

/// Smooths curves; they are independent of each other.
pub fn smooth(space: &Erased, data: &[Data], options: &Options, monitor: &Monitor) -> Vec<Smooth> {
    if options.ends == Ends::Periodic {
        let turns: Vec<Turns> = data.iter().map(Turns::of).collect();
        let unrolled: Vec<Data> = turns.iter().zip(data).map(|(turns, data)| turns.data(data)).collect();
        return smooth_all(space, &unrolled, options, monitor);
    }
    smooth_all(space, data, options, monitor)
}

fn smooth_all(space: &Erased, data: &[Data], options: &Options, monitor: &Monitor) -> Vec<Smooth> {
    let len = space.point_len();
    let work: usize = data.iter().map(|d| d.times.len()).sum::<usize>() * space.dim();
    let threads = data.len() > 1 && work > PARALLEL;
    let mut tracks = start(space, data, options, monitor, threads);
    while !monitor.cancelled() {
        let mut running: Vec<&mut Track> =
            tracks.iter_mut().flatten().filter(|track| !track.done()).collect();
        if running.is_empty() {
            break;
        }
        let ends: Vec<[Vec<f64>; 2]> = running.iter().map(|track| track.end_velocities(space)).collect();
        let ends = [0, 1].map(|e| ends.iter().flat_map(|own| own[e].iter().copied()).collect::<Vec<f64>>());
        let ends = options.ends.of_fit(&ends);
        let curves = running.iter().map(|track| {
            let Range { start, end } = track.curve();
            (&track.knots[start..end], &track.points[start * len..end * len])
        });
        let fitted = fit_all(space, curves, ends, monitor);
        let items: Vec<_> = running.iter_mut().zip(fitted).collect();
        parallel::for_each(items, threads, monitor, |(track, velocities)| match velocities {
            None => track.retreat(space),
            Some(velocities) => {
                track.take(velocities, len);
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
            let mut none =
                Track::new(*data, space.dim(), data.knots.to_vec(), points, options.ends, f64::INFINITY);
            none.retreat(space);
            none
        })
    });
    ended.map(|track| track.finish(len)).collect()
}

/// The velocities of the splines through points, where there are such splines.
fn fit_all<'a>(
    space: &Erased,
    curves: impl Iterator<Item = (&'a [f64], &'a [f64])>,
    ends: FitEnds,
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
    // Those who watch count curves, not the fits on the way to them.
    let silent = |_| !monitor.poll();
    let reports = fit(space, &problem, &FIT, &Monitor::new(&silent), &mut velocities);
    let own = |c: usize| velocities[offsets[c] * len..offsets[c + 1] * len].to_vec();
    reports.iter().enumerate().map(|(c, r)| (r.status == Status::Converged).then(|| own(c))).collect()
}

/// Curves to begin with; none where even the geodesic between the first and the last mean does not exist.
fn start<'a>(
    space: &Erased,
    data: &[Data<'a>],
    options: &Options,
    monitor: &Monitor,
    threads: bool,
) -> Vec<Option<Track<'a>>> {
    let mut pyramids: Vec<(Vec<Level>, f64)> = data.iter().map(|_| (Vec::new(), f64::INFINITY)).collect();
    parallel::for_each(pyramids.iter_mut().zip(data).collect(), threads, monitor, |(found, data)| {
        let weights = if data.information.is_empty() {
            data.weights.to_vec()
        } else {
            // Here a point is one, and as good as its directions on average.
            information::roots(data.information, space.dim()).iter().map(|root| root.weight).collect()
        };
        let data = Data { weights: &weights, ..*data };
        let [times, points, weights] = if options.loss == Loss::Linear {
            [data.times.to_vec(), data.points.to_vec(), weights.clone()]
        } else {
            let sigma = data.sigma.unwrap_or_else(|| loss::noise(space, &data));
            // Where nothing deviates nothing is an outlier.
            found.1 = if sigma > 0.0 { sigma * options.loss.corner(space.dim()) } else { f64::INFINITY };
            loss::plausible(space, &data)
        };
        found.0 = levels(space, &times, &points, &weights);
        found.0.reverse();
    });
    let mut tracks: Vec<Option<Track>> = data.iter().map(|_| None).collect();
    loop {
        let missing: Vec<usize> = (0..data.len()).filter(|&c| tracks[c].is_none()).collect();
        let tried: Vec<(usize, Level)> =
            missing.into_iter().filter_map(|c| Some((c, pyramids[c].0.pop()?))).collect();
        if tried.is_empty() || monitor.cancelled() {
            return tracks;
        }
        let levels = tried.iter().map(|(_, level)| (&level.times[..], &level.points[..]));
        let fitted = fit_all(space, levels, NATURAL, monitor);
        for ((c, level), velocities) in tried.iter().zip(fitted) {
            let Some(velocities) = velocities else { continue };
            let path = Path { t: &level.times, points: &level.points, velocities: &velocities };
            let knots = data[*c].knots;
            let mut points = prolonged(space, &path, knots);
            if options.ends == Ends::Periodic {
                turns::repeat(&mut points, space.point_len());
            }
            tracks[*c] =
                Some(Track::new(data[*c], space.dim(), knots.to_vec(), points, options.ends, pyramids[*c].1));
        }
    }
}

/// Points of a curve, which goes on straight beyond its ends.
fn prolonged(space: &Erased, path: &Path, times: &[f64]) -> Vec<f64> {
    let len = space.point_len();
    let last = path.t.len() - 1;
    let inside: Vec<f64> = times.iter().map(|t| t.clamp(path.t[0], path.t[last])).collect();
    let mut points = path.at(space, &places(path.t, &inside));
    let mut beyond = vec![0.0; points.len()];
    for (i, (t, near)) in times.iter().zip(&inside).enumerate() {
        let end = if *t < *near { 0 } else { last };
        for c in 0..len {
            beyond[i * len + c] = (t - near) * path.velocities[end * len + c];
        }
    }
    points = moved(space, &points, &beyond);
    points
}
