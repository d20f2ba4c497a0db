//! Smoothing, called from Python.

use crate::arrays::{in_order, reserve, zeros};
use crate::curves::EndOf;
use crate::errors::{CutLocusError, invalid, number};
use crate::estimation::{criterion_named, ends_named, loss_named, penalty_named};
use crate::space::Handle;
use crate::validate::of_curve;
use crate::watch::{Progress, is_heavy, is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyListMethods, PyTuple, PyTupleMethods};
use symspline_engine::parallel;
use symspline_engine::smoothing::audit::{AtData, Recording, ResidualStatistics, Unequal};
use symspline_engine::smoothing::{
    Data, Observations, Options, Outcome, Report, Samples, Selection, Smooth, State, Tier, chi,
    fit_cumulative as fit, inverse_of_weights, process_variance as process, smooth as run,
    variance as variance_at,
};
use symspline_engine::space::{Ambient, Origin};

/// Points times the cube of the dimension from which one iteration may take tenths of a second.
const HEAVY_FACTORS: usize = 1_000_000;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Points at the knots, the band of A⁻¹, the columns of the report, and A: its band, the holonomy of closed curves, and
/// the number of coordinates that it couples.
type Smoothed<'py> =
    (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyTuple>, Systems<'py>);

type Systems<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, usize);

/// Smooths curves. `t` and `weights` contain all data, (N,) or (..., N); `information`, (..., N, m, m), contains
/// matrices whose mean diagonals are `weights`; `knots` is (K,) or (..., K). `lam` and `sigma` have one value per
/// curve, and NaN requests that λ is chosen. `start` contains initial points at the knots.
#[pyfunction]
pub fn smooth<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    weights: Array<'py>,
    information: Option<Array<'py>>,
    knots: Array<'py>,
    lam: Array<'py>,
    sigma: Array<'py>,
    ends: Option<[EndOf<'py>; 2]>,
    criterion: &str,
    gamma: f64,
    penalty: &str,
    loss: &str,
    method: &str,
    tol: f64,
    max_iter: usize,
    raise_lam: bool,
    start: Option<Array<'py>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Smoothed<'py>> {
    let options = Options {
        criterion: criterion_named(criterion, gamma)?,
        penalty: penalty_named(penalty)?,
        loss: loss_named(loss)?,
        tier: match method {
            "auto" => Tier::Auto,
            "linearized" => Tier::Linearized,
            "newton" => Tier::Newton,
            _ => {
                return Err(invalid(format!(
                    "method must be 'auto', 'linearized' or 'newton', not {method:?}"
                )));
            }
        },
        tol,
        max_iter,
        raise_lam,
        ends: ends_named(ends.as_ref().map(|kinds| [0, 1].map(|e| kinds[e].0.clone())))?,
    };
    let none: &[f64] = &[];
    let vectors: [&[f64]; 2] = match &ends {
        None => [none; 2],
        Some([a, b]) => [a.1.as_ref().map_or(Ok(none), in_order)?, b.1.as_ref().map_or(Ok(none), in_order)?],
    };
    let space = handle.space.get();
    let len = space.point_len();
    let lead = points.ndim() - handle.point_axes() - 1;
    let (n, count) = (points.shape()[lead], knots.shape()[knots.ndim() - 1]);
    let batch = &points.shape()[..lead];
    let curves: usize = batch.iter().product();
    // Shared by all curves, or one row per curve.
    let own = |row: &[f64], size: usize, curve: usize| if row.len() == size { 0 } else { curve * size };
    let (t, p, w, k) = (in_order(&t)?, in_order(&points)?, in_order(&weights)?, in_order(&knots)?);
    let (lam, sigma) = (in_order(&lam)?, in_order(&sigma)?);
    let first = start.as_ref().map_or(Ok(none), in_order)?;
    let matrices = information.as_ref().map_or(Ok(none), in_order)?;
    let entries = if matrices.is_empty() { 0 } else { space.dim() * space.dim() };
    drop(reserve::<f64>(p.len() + 2 * curves * n + matrices.len() + curves * count * (2 * len + 8))?);
    let data: Vec<Observations> = (0..curves)
        .map(|c| {
            let knots = &k[own(k, count, c)..][..count];
            Observations::new(
                &t[own(t, n, c)..][..n],
                &p[c * n * len..][..n * len],
                &w[own(w, n, c)..][..n],
                if entries == 0 { none } else { &matrices[c * n * entries..][..n * entries] },
                len,
                ends.is_none().then(|| knots[count - 1] - knots[0]),
            )
        })
        .collect();
    let data: Vec<Data> = data
        .iter()
        .enumerate()
        .map(|(c, data)| Data {
            times: &data.times,
            points: &data.points,
            weights: &data.weights,
            information: &data.information,
            knots: &k[own(k, count, c)..][..count],
            lam: Some(lam[c]).filter(|lam| !lam.is_nan()),
            sigma: Some(sigma[c]).filter(|sigma| !sigma.is_nan()),
            ends: vectors.map(|v| if v.is_empty() { none } else { &v[c * len..][..len] }),
            start: if first.is_empty() { none } else { &first[c * count * len..][..count * len] },
        })
        .collect();
    // One iteration factors banded matrices of three blocks for every knot.
    let heavy = is_heavy(&space) || count * space.dim().pow(3) > HEAVY_FACTORS;
    let found = watched(py, Progress::whole(progress), curves * count, heavy, |monitor| {
        run(&space, &data, &options, monitor)
    })?;

    let coefficients = count + if ends.is_none() { 2 } else { 0 };
    let shape = [batch, &[count], &points.shape()[lead + 1..]].concat();
    Ok((
        gathered(py, &shape, &found, |smooth| &smooth.points)?,
        gathered(py, &[batch, &[coefficients, 4]].concat(), &found, |smooth| &smooth.inverse)?,
        columns(py, &found)?,
        systems(py, batch, coefficients, space.dim(), ends.is_none(), &found)?,
    ))
}

/// A of all curves. It couples all coordinates if it does so for any of the curves.
fn systems<'py>(
    py: Python<'py>,
    batch: &[usize],
    coefficients: usize,
    m: usize,
    closed: bool,
    found: &[Smooth],
) -> PyResult<Systems<'py>> {
    let coupled = found.iter().filter_map(|smooth| smooth.known.as_ref()).map(|known| known.coupled);
    let size = coupled.max().unwrap_or(1).min(m.max(1));
    let turns = if closed { size } else { 0 };
    let matrix = zeros(py, &[batch, &[coefficients * size, 4 * size]].concat())?;
    let turn = zeros(py, &[batch, &[turns, turns]].concat())?;
    let (mut all, mut around) = (matrix.readwrite(), turn.readwrite());
    let (mut all, mut around) = (all.as_slice_mut()?, around.as_slice_mut()?);
    for smooth in found {
        let (own, own_turn);
        (own, all) = all.split_at_mut(coefficients * size * 4 * size);
        (own_turn, around) = around.split_at_mut(turns * turns);
        match smooth.known.as_ref().map(|known| known.of_all(size)) {
            Some(known) => {
                own.copy_from_slice(&known.matrix);
                own_turn.copy_from_slice(&known.turn);
            }
            None => own.fill(f64::NAN),
        }
    }
    Ok((matrix, turn, size))
}

/// One component of all curves in an array.
fn gathered<'py>(
    py: Python<'py>,
    shape: &[usize],
    found: &[Smooth],
    part: impl Fn(&Smooth) -> &Vec<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let out = zeros(py, shape)?;
    let mut write = out.readwrite();
    let mut rest = write.as_slice_mut()?;
    for smooth in found {
        let own;
        (own, rest) = rest.split_at_mut(part(smooth).len());
        own.copy_from_slice(part(smooth));
    }
    drop(write);
    Ok(out)
}

/// state, iterations, lam, band_lam, at_bound, freedom, sigma, step, rate, kappa, exact, selection, rejected,
/// objective.
fn columns<'py>(py: Python<'py>, found: &[Smooth]) -> PyResult<Bound<'py, PyTuple>> {
    let reports: Vec<Report> = found.iter().map(|smooth| smooth.report).collect();
    let column = |f: fn(&Report) -> f64| PyArray1::from_iter(py, reports.iter().map(f));
    let flag = |f: fn(&Report) -> bool| PyArray1::from_iter(py, reports.iter().map(f));
    let state = reports.iter().map(|r| match r.state {
        State::Converged => 0,
        State::Running | State::Unconverged => 1,
        State::NoCurve => 2,
        State::Undetermined => 3_i64,
        State::Unsettled => 4,
    });
    let iterations = PyArray1::from_iter(py, reports.iter().map(|r| r.iterations as i64));
    let [lam, band_lam, freedom] = [column(|r| r.lam), column(|r| r.band_lam), column(|r| r.freedom)];
    let [sigma, step, rate, kappa] =
        [column(|r| r.sigma), column(|r| r.step), column(|r| r.rate), column(|r| r.kappa)];
    let (at_bound, exact) = (flag(|r| r.at_bound), flag(|r| r.exact));
    let selection = reports.iter().map(|r| match r.selection {
        Selection::Sound => 0,
        Selection::Interpolated => 1,
        Selection::Unsettled => 2,
        Selection::Few => 3_i64,
        Selection::Pulled => 4,
    });
    let selection = PyArray1::from_iter(py, selection);
    let rejected = PyArray1::from_iter(py, reports.iter().map(|r| r.rejected as i64));
    let first = (PyArray1::from_iter(py, state), iterations, lam, band_lam, at_bound, freedom);
    let all = first.into_pyobject(py)?.to_list();
    let objective = column(|r| r.objective);
    let rest = (sigma, step, rate, kappa, exact, selection, rejected, objective);
    for item in rest.into_pyobject(py)?.iter() {
        all.append(item)?;
    }
    Ok(all.to_tuple())
}

/// Variances of a coordinate of one smoothed curve at given times, for noise of variance one. `kinds` are the kinds of
/// the ends; None for a closed curve.
#[pyfunction]
pub fn smoothing_variance<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    band: Array<'py>,
    lam: f64,
    x: Array<'py>,
    nu: usize,
    kinds: Option<[String; 2]>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let ends = ends_named(kinds)?;
    let (knots, band, x) = (in_order(&knots)?, in_order(&band)?, in_order(&x)?);
    let heavy = is_long(knots.len() + x.len());
    let found = watched(py, None, x.len(), heavy, |_| variance_at(knots, band, lam, ends, x, nu))?;
    Ok(PyArray1::from_vec(py, found))
}

/// The band of A⁻¹ for numbers as weights, (coefficients · 4,).
#[pyfunction]
pub fn smoothing_inverse<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    times: Array<'py>,
    weights: Array<'py>,
    lam: f64,
    penalty: &str,
    kinds: Option<[String; 2]>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (penalty, ends) = (penalty_named(penalty)?, ends_named(kinds)?);
    let (knots, times, weights) = (in_order(&knots)?, in_order(&times)?, in_order(&weights)?);
    Ok(PyArray1::from_vec(py, inverse_of_weights(knots, times, weights, lam, penalty, ends)))
}

/// The variance of a coordinate of the process that the jerk penalises, for noise of variance one.
#[pyfunction]
pub fn process_variance<'py>(
    py: Python<'py>,
    times: Array<'py>,
    weights: Array<'py>,
    lam: f64,
    period: Option<f64>,
    x: Array<'py>,
    nu: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (times, weights, x) = (in_order(&times)?, in_order(&weights)?, in_order(&x)?);
    Ok(PyArray1::from_vec(py, process(times, weights, lam, period, x, nu)))
}

/// The quantile of χ² with m degrees of freedom.
#[pyfunction]
pub fn chi_squared(m: usize, probability: f64) -> f64 {
    chi::quantile(m, probability)
}

/// Residuals (curves, N, d) at curves, in coordinates of the frames there, and deviations (curves, N) of data from their
/// neighbours: see [`AtData::residuals`]. Times and weights are (curves, N).
#[pyfunction]
pub fn residuals_at<'py>(
    py: Python<'py>,
    handle: &Handle,
    times: Array<'py>,
    at: Array<'py>,
    points: Array<'py>,
    weights: Array<'py>,
) -> PyResult<[Bound<'py, PyArrayDyn<f64>>; 2]> {
    let space = handle.space.get();
    let [curves, n] = [0, 1].map(|axis| times.shape()[axis]);
    let (len, m) = (space.point_len(), space.dim());
    let [times, at, points, weights] = [&times, &at, &points, &weights].map(in_order);
    let (times, at, points, weights) = (times?, at?, points?, weights?);
    let of = |c: usize| {
        let [times, weights] = [times, weights].map(|rows| &rows[c * n..][..n]);
        let [at, points] = [at, points].map(|rows| &rows[c * n * len..][..n * len]);
        AtData { times, at, points, weights }.residuals(&space)
    };
    let found =
        watched(py, None, curves, is_long(times.len() * m), |_| (0..curves).map(of).collect::<Vec<_>>())?;
    let out = [zeros(py, &[curves, n, m])?, zeros(py, &[curves, n])?];
    for (k, array) in out.iter().enumerate() {
        let mut write = array.readwrite();
        let rows = write.as_slice_mut()?;
        let size = rows.len() / curves.max(1);
        found
            .iter()
            .zip(rows.chunks_exact_mut(size.max(1)))
            .for_each(|(own, row)| row.copy_from_slice(&own[k]));
    }
    Ok(out)
}

/// [`AtData::bypassed`] for one curve: times, points of the curve, data, weights, and sizes of residuals.
#[pyfunction]
pub fn bypassed(
    py: Python<'_>,
    handle: &Handle,
    times: Array<'_>,
    at: Array<'_>,
    points: Array<'_>,
    weights: Array<'_>,
    sizes: Array<'_>,
) -> PyResult<Option<[usize; 2]>> {
    let space = handle.space.get();
    let [times, at, points, weights, sizes] = [&times, &at, &points, &weights, &sizes].map(in_order);
    let (data, sizes) = (AtData { times: times?, at: at?, points: points?, weights: weights? }, sizes?);
    watched(py, None, 1, is_long(sizes.len()), |_| data.bypassed(&space, sizes))
}

/// For every curve: two medians, the mean square, the mean product, and the number of products; the sizes.
type OfResiduals<'py> = ([Vec<f64>; 4], Vec<usize>, Bound<'py, PyArrayDyn<f64>>);

/// [`ResidualStatistics`] of residuals (curves, N, d), and deviations (curves, N). `limits` and `variances` have one
/// value per curve.
#[pyfunction]
pub fn residual_statistics<'py>(
    py: Python<'py>,
    rows: Array<'py>,
    neighbours: Array<'py>,
    limits: Array<'py>,
    variances: Array<'py>,
) -> PyResult<OfResiduals<'py>> {
    let [curves, n, d] = [0, 1, 2].map(|axis| rows.shape()[axis]);
    let beside = neighbours.shape()[1];
    let (rows, neighbours) = (in_order(&rows)?, in_order(&neighbours)?);
    let (limits, variances) = (in_order(&limits)?, in_order(&variances)?);
    let of = |c: usize| {
        let (own, near) = (&rows[c * n * d..][..n * d], &neighbours[c * beside..][..beside]);
        ResidualStatistics::new(own, d, near, limits[c], variances[c])
    };
    let found = watched(py, None, curves, is_long(rows.len()), |_| (0..curves).map(of).collect::<Vec<_>>())?;
    let column = |part: fn(&ResidualStatistics) -> f64| found.iter().map(part).collect();
    let numbers =
        [column(|x| x.medians[0]), column(|x| x.medians[1]), column(|x| x.square), column(|x| x.lagged)];
    let out = zeros(py, &[curves, n])?;
    let mut write = out.readwrite();
    let sizes = write.as_slice_mut()?;
    found.iter().zip(sizes.chunks_exact_mut(n.max(1))).for_each(|(x, row)| row.copy_from_slice(&x.sizes));
    drop(write);
    Ok((numbers, found.iter().map(|x| x.products).collect(), out))
}

/// The tests of constant smoothness and of constant noise for one curve: score, first and last datum, and ratio.
#[pyfunction]
pub fn unequal_bins(
    times: Array<'_>,
    leverages: Array<'_>,
    squares: Array<'_>,
    knots: Array<'_>,
    energy: Array<'_>,
    m: usize,
    least: f64,
) -> PyResult<[(f64, [usize; 2], f64); 2]> {
    let [times, leverages, squares, knots, energy] =
        [&times, &leverages, &squares, &knots, &energy].map(in_order);
    let (times, leverages, squares, knots, energy) = (times?, leverages?, squares?, knots?, energy?);
    let recording = Recording { times, leverages, squares, knots, energy, m };
    let of = |Unequal { score, place, ratio }| (score, place, ratio);
    Ok([of(recording.smoothness(least)), of(recording.noise(least))])
}

/// Control points, and of each curve whether it converged, its iterations, the last step, and the sum of squares.
type Fitted<'py> = (Bound<'py, PyArrayDyn<f64>>, Vec<bool>, Vec<usize>, Vec<f64>, Vec<f64>);

/// Fits cumulative B-splines to points (..., N, point) by least squares; `weights` has one row per curve.
#[pyfunction]
pub fn fit_cumulative<'py>(
    py: Python<'py>,
    handle: &Handle,
    knots: Array<'py>,
    degree: usize,
    t: Array<'py>,
    points: Array<'py>,
    weights: Array<'py>,
    tol: f64,
    max_iter: usize,
) -> PyResult<Fitted<'py>> {
    let axes = points.ndim() - handle.point_axes() - 1;
    let (batch, row) = (&points.shape()[..axes], &points.shape()[axes + 1..]);
    let (knots, t) = (in_order(&knots)?, in_order(&t)?);
    let (points, weights) = (in_order(&points)?, in_order(&weights)?);
    let (curves, count, size) =
        (batch.iter().product::<usize>(), knots.len() - degree - 1, row.iter().product::<usize>());
    let samples = |c: usize| Samples {
        knots,
        degree,
        t,
        points: &points[c * t.len() * size..][..t.len() * size],
        weights: &weights[c * t.len()..][..t.len()],
    };
    for c in 0..curves {
        if let Some(j) = samples(c).undetermined() {
            let (start, end) = (knots[j], knots[j + degree + 1]);
            return Err(invalid(format!(
                "knots: control point {j}{} acts on times from {} to {}, where too few data determine it. Use fewer \
                 knots there, or add data",
                of_curve(c, batch),
                number(start),
                number(end)
            )));
        }
    }
    let space = handle.space.get();
    let out = zeros(py, &[batch, &[count], row].concat())?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    let heavy = is_heavy(&space) || is_long(t.len() * size / curves.max(1) + count * size);
    let outcomes = watched(py, None, curves, heavy, |monitor| {
        let mut found: Vec<Option<Result<Outcome, usize>>> = vec![None; curves];
        let items = result.chunks_mut((count * size).max(1)).zip(&mut found).enumerate().collect();
        parallel::for_each(items, curves > 1, monitor, |(c, (out, found))| {
            let fitted = fit(&space, &samples(c), tol, max_iter, monitor);
            *found = Some(fitted.map(|(control, outcome)| {
                out.copy_from_slice(&control);
                outcome
            }));
        });
        found
    })?;
    drop(write);
    let mut columns = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (c, outcome) in outcomes.into_iter().enumerate() {
        let outcome = match outcome {
            Some(Ok(outcome)) => outcome,
            Some(Err(pair)) => {
                return Err(CutLocusError::new_err(format!(
                    "knots: the data near control points {pair} and {}{} are not joined by a unique shortest \
                     geodesic. Use more knots there, or check the data",
                    pair + 1,
                    of_curve(c, batch)
                )));
            }
            None => continue,
        };
        columns.0.push(outcome.converged);
        columns.1.push(outcome.iterations);
        columns.2.push(outcome.step);
        columns.3.push(outcome.cost);
    }
    Ok((out, columns.0, columns.1, columns.2, columns.3))
}
