//! Many curves at a time: those that are not done go one step on together.

use crate::flat::FlatEnd;
use crate::loss::{self, Loss};
use crate::path::{Path, moved, places};
use crate::start::{Level, levels};
use crate::track::Track;
use crate::variance::rows_of;
use crate::{Data, Options, Report, Smooth, State};
use symspline_core::fit::{End, Ends, Method, Options as FitOptions, Problem, Status, fit};
use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::space::{Ambient, Erased, Origin};

const FIT: FitOptions = FitOptions { method: Method::Auto, tol: 1e-12, max_iter: None };
/// Ends without acceleration.
pub const NATURAL: Ends<'static> = Ends::Open([End::Natural; 2]);
/// Knots times dimensions from which threads pay.
const PARALLEL: usize = 4096;

/// Smooths curves; they are independent of each other.
pub fn smooth(space: &Erased, data: &[Data], options: &Options, monitor: &Monitor) -> Vec<Smooth> {
    let work: usize = data.iter().map(|d| d.times.len()).sum::<usize>() * space.dim();
    let threads = data.len() > 1 && work > PARALLEL;
    let mut tracks = start(space, data, options, monitor, threads);
    while !monitor.cancelled() {
        let mut running: Vec<&mut Track> =
            tracks.iter_mut().flatten().filter(|track| !track.done()).collect();
        if running.is_empty() {
            break;
        }
        let fitted =
            fit_all(space, running.iter().map(|track| (&track.knots[..], &track.points[..])), monitor);
        let items: Vec<_> = running.iter_mut().zip(fitted).collect();
        parallel::for_each(items, threads, monitor, |(track, velocities)| match velocities {
            None => track.retreat(space),
            Some(velocities) => {
                track.velocities = velocities;
                track.advance(space, options);
                if track.done() {
                    monitor.advance(track.knots.len());
                }
            }
        });
    }
    let nothing = |data: &Data| {
        let report = Report { state: State::NoCurve, ..Report::default() };
        let none = vec![f64::NAN; data.knots.len() * space.point_len()];
        Smooth {
            knots: data.knots.to_vec(),
            points: none.clone(),
            velocities: none,
            inverse: vec![f64::NAN; data.knots.len() * 4],
            report,
        }
    };
    tracks
        .into_iter()
        .zip(data)
        .map(|(track, data)| track.map_or_else(|| nothing(data), Track::finish))
        .collect()
}

/// The velocities of the natural splines through points, where there are such splines.
fn fit_all<'a>(
    space: &Erased,
    curves: impl Iterator<Item = (&'a [f64], &'a [f64])>,
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
    let problem = Problem { t: &t, shared: false, points: &points, offsets: &offsets, ends: NATURAL };
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
        let (mut times, mut points, mut weights) =
            (data.times.to_vec(), data.points.to_vec(), data.weights.to_vec());
        if options.loss != Loss::Linear {
            let sigma = data.sigma.unwrap_or_else(|| loss::noise(space, data));
            found.1 = sigma * options.loss.corner(space.dim());
            [times, points, weights] = loss::plausible(space, data);
        }
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
        let fitted = fit_all(space, levels, monitor);
        for ((c, level), velocities) in tried.iter().zip(fitted) {
            let Some(velocities) = velocities else { continue };
            let path = Path { t: &level.times, points: &level.points, velocities: &velocities };
            let knots = data[*c].knots;
            let points = prolonged(space, &path, knots);
            let ends = [FlatEnd::Natural; 2];
            tracks[*c] =
                Some(Track::new(data[*c], knots.to_vec(), points, ends, data[*c].lam, pyramids[*c].1));
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

impl Track<'_> {
    fn finish(self) -> Smooth {
        let inverse = match &self.inverse {
            Some(inverse) => rows_of(inverse),
            None => vec![f64::NAN; self.knots.len() * 4],
        };
        let report = self.report();
        Smooth { knots: self.knots, points: self.points, velocities: self.velocities, inverse, report }
    }
}
