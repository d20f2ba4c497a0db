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
use symspline_engine::smoothing::audit::{AtData, Unequal, is_constant};
use symspline_engine::smoothing::examine::{Complaint, Examined, Finding, Residuals};
use symspline_engine::smoothing::turns::{Turn, usual_turn};
use symspline_engine::smoothing::{
    Adapt, CumulativeData, Data, EndConditions, Observations, Options, Outcome, Profile, Selection, Smooth,
    SmoothReport, State, Tier, chi, fit_cumulative as fit, inverse_of_weights, process_variance as process,
    smooth as run, variance as variance_at,
};
use symspline_engine::space::{Ambient, Origin};

/// Points times the cube of the dimension from which one iteration may take tenths of a second.
const HEAVY_FACTORS: usize = 1_000_000;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Points at the knots, the band of A⁻¹, the columns of the report, A (its band, the holonomy of closed curves, and the
/// number of coordinates that it couples), and how λ and σ vary.
type Smoothed<'py> = (
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyTuple>,
    Systems<'py>,
    Option<[Bound<'py, PyArrayDyn<f64>>; 6]>,
);

type Systems<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, usize);

/// One factor of a product: space, points (..., N, point), weights (N,) or (..., N), information matrices (..., N, m, m)
/// whose mean diagonals are the weights, λ and σ with one value per curve, of which NaN requests that it is chosen, ends,
/// initial points at the knots, λ of the segments (K − 1,) or (..., K − 1) divided by λ, and whether λ and σ vary if the data
/// require it.
type Factor<'py> = (
    PyRef<'py, Handle>,
    Array<'py>,
    Array<'py>,
    Option<Array<'py>>,
    Array<'py>,
    Array<'py>,
    Option<[EndOf<'py>; 2]>,
    Option<Array<'py>>,
    Option<Array<'py>>,
    (bool, bool),
);

/// Smooths curves in the factors of a product. `t` contains the times of all data, (N,) or (..., N); `knots` is (K,) or
/// (..., K).
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn smooth<'py>(
    py: Python<'py>,
    factors: Vec<Factor<'py>>,
    t: Array<'py>,
    knots: Array<'py>,
    criterion: &str,
    gamma: f64,
    penalty: &str,
    loss: &str,
    method: &str,
    tol: f64,
    max_iter: usize,
    raise_lam: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Smoothed<'py>>> {
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
        ends: EndConditions::Periodic,
        adapt: Adapt::default(),
    };
    let (t, knots) = (Rows::of(&t)?, Rows::of(&knots)?);
    let parts = factors.len();
    let each = factors.iter().enumerate().map(|(part, factor)| {
        let call = progress.as_ref().map(|call| call.clone_ref(py));
        smooth_factor(py, factor, t, knots, options, call.map(|call| Progress { call, part, parts }))
    });
    each.collect()
}

/// Numbers shared by all curves, or one row per curve.
#[derive(Clone, Copy)]
struct Rows<'a> {
    numbers: &'a [f64],
    size: usize,
}

impl<'a> Rows<'a> {
    fn of(array: &'a Array) -> PyResult<Self> {
        Ok(Rows { numbers: in_order(array)?, size: array.shape()[array.ndim() - 1] })
    }

    fn of_curve(self, curve: usize) -> &'a [f64] {
        let first = if self.numbers.len() == self.size { 0 } else { curve * self.size };
        &self.numbers[first..first + self.size]
    }
}

fn smooth_factor<'py>(
    py: Python<'py>,
    (handle, points, weights, information, lam, sigma, ends, start, profile, adapt): &Factor<'py>,
    t: Rows,
    knots: Rows,
    options: Options,
    progress: Option<Progress>,
) -> PyResult<Smoothed<'py>> {
    let kinds = ends.as_ref().map(|kinds| [0, 1].map(|e| kinds[e].0.clone()));
    let adapt = Adapt { lam: adapt.0, noise: adapt.1 };
    let options = Options { ends: ends_named(kinds)?, adapt, ..options };
    let none: &[f64] = &[];
    let vectors: [&[f64]; 2] = match ends {
        None => [none; 2],
        Some([a, b]) => [a.1.as_ref().map_or(Ok(none), in_order)?, b.1.as_ref().map_or(Ok(none), in_order)?],
    };
    let space = handle.space.get();
    let len = space.point_len();
    let lead = points.ndim() - handle.point_axes() - 1;
    let (n, count) = (points.shape()[lead], knots.size);
    let batch = &points.shape()[..lead];
    let curves: usize = batch.iter().product();
    let (p, weights) = (in_order(points)?, Rows::of(weights)?);
    let (lam, sigma) = (in_order(lam)?, in_order(sigma)?);
    let first = start.as_ref().map_or(Ok(none), in_order)?;
    let matrices = information.as_ref().map_or(Ok(none), in_order)?;
    let profile = profile.as_ref().map(Rows::of).transpose()?;
    let entries = if matrices.is_empty() { 0 } else { space.dim() * space.dim() };
    drop(reserve::<f64>(p.len() + 2 * curves * n + matrices.len() + curves * count * (2 * len + 8))?);
    let data: Vec<Observations> = (0..curves)
        .map(|c| {
            let knots = knots.of_curve(c);
            Observations::new(
                t.of_curve(c),
                &p[c * n * len..][..n * len],
                weights.of_curve(c),
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
            knots: knots.of_curve(c),
            lam: Some(lam[c]).filter(|lam| !lam.is_nan()),
            profile: profile.map_or(none, |rows| rows.of_curve(c)),
            sigma: Some(sigma[c]).filter(|sigma| !sigma.is_nan()),
            ends: vectors.map(|v| if v.is_empty() { none } else { &v[c * len..][..len] }),
            start: if first.is_empty() { none } else { &first[c * count * len..][..count * len] },
        })
        .collect();
    // One iteration factors banded matrices of three blocks for every knot.
    let heavy = is_heavy(&space)
        || count * space.dim().pow(3) > HEAVY_FACTORS
        || (adapt != Adapt::default() && is_long(p.len()));
    let found =
        watched(py, progress, curves * count, heavy, |monitor| run(&space, &data, &options, monitor))?;

    let coefficients = count + if ends.is_none() { 2 } else { 0 };
    let shape = [batch, &[count], &points.shape()[lead + 1..]].concat();
    Ok((
        gathered(py, &shape, &found, |smooth| &smooth.points)?,
        gathered(py, &[batch, &[coefficients, 4]].concat(), &found, |smooth| &smooth.inverse)?,
        columns(py, &found)?,
        systems(py, batch, coefficients, space.dim(), ends.is_none(), &found)?,
        if adapt == Adapt::default() { None } else { Some(profiles(py, batch, count, &found)?) },
    ))
}

/// λ of the segments divided by their geometric mean, ln σ² at the knots, the gain, one if the other function varies as well,
/// one if the data hardly decide which of them varies, and the time of an outlier, for all curves.
fn profiles<'py>(
    py: Python<'py>,
    batch: &[usize],
    knots: usize,
    found: &[Smooth],
) -> PyResult<[Bound<'py, PyArrayDyn<f64>>; 6]> {
    let column = |tail: &[usize], usual: f64, of: fn(&Profile) -> Vec<f64>| {
        let out = zeros(py, &[batch, tail].concat())?;
        let mut write = out.readwrite();
        let rows = write.as_slice_mut()?;
        rows.fill(usual);
        let size = tail.iter().product::<usize>();
        for (row, smooth) in rows.chunks_exact_mut(size.max(1)).zip(found) {
            if let Some(numbers) = smooth.profile.as_ref().map(of).filter(|numbers| !numbers.is_empty()) {
                row.copy_from_slice(&numbers);
            }
        }
        drop(write);
        PyResult::Ok(out)
    };
    Ok([
        column(&[knots - 1], 1.0, |profile| profile.lam.clone())?,
        column(&[knots], 0.0, |profile| profile.noise.clone())?,
        column(&[], f64::NAN, |profile| vec![profile.gain])?,
        column(&[], 0.0, |profile| vec![f64::from(u8::from(profile.other))])?,
        column(&[], 0.0, |profile| vec![f64::from(u8::from(profile.tie))])?,
        column(&[], f64::NAN, |profile| vec![profile.outlier])?,
    ])
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
    let reports: Vec<SmoothReport> = found.iter().map(|smooth| smooth.report).collect();
    let column = |f: fn(&SmoothReport) -> f64| PyArray1::from_iter(py, reports.iter().map(f));
    let flag = |f: fn(&SmoothReport) -> bool| PyArray1::from_iter(py, reports.iter().map(f));
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

/// Variances (..., n) of a coordinate of smoothed curves at given times, for noise of variance one. Knots (K,) and times x
/// (n,) are shared, or have one row per curve as the bands (..., K, 4); λ has one number per curve, and the profile (..., K −
/// 1) its factors for the segments. `kinds` are the kinds of the ends; None for closed curves.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn smoothing_variance<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    band: Array<'py>,
    lam: Array<'py>,
    profile: Option<Array<'py>>,
    x: Array<'py>,
    nu: usize,
    kinds: Option<[String; 2]>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let ends = ends_named(kinds)?;
    let batch = &band.shape()[..band.ndim() - 2];
    let curves: usize = batch.iter().product();
    let size = band.shape()[band.ndim() - 2] * 4;
    let (knots, x) = (Rows::of(&knots)?, Rows::of(&x)?);
    let shape = [batch, &[x.size]].concat();
    let (band, lam) = (in_order(&band)?, in_order(&lam)?);
    let profile = profile.as_ref().map(Rows::of).transpose()?;
    let of = |c: usize| {
        let lam = (lam[c], profile.map_or(&[][..], |rows| rows.of_curve(c)));
        variance_at(knots.of_curve(c), &band[c * size..][..size], lam, ends, x.of_curve(c), nu)
    };
    let heavy = is_long(curves * (knots.size + x.size));
    let found = watched(py, None, curves, heavy, |_| (0..curves).flat_map(of).collect::<Vec<f64>>())?;
    let out = zeros(py, &shape)?;
    out.readwrite().as_slice_mut()?.copy_from_slice(&found);
    Ok(out)
}

/// The band of A⁻¹ for numbers as weights, (coefficients · 4,).
#[pyfunction]
pub fn smoothing_inverse<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    times: Array<'py>,
    weights: Array<'py>,
    lam: f64,
    profile: Option<Array<'py>>,
    penalty: &str,
    kinds: Option<[String; 2]>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (penalty, ends) = (penalty_named(penalty)?, ends_named(kinds)?);
    let (knots, times, weights) = (in_order(&knots)?, in_order(&times)?, in_order(&weights)?);
    let profile = profile.as_ref().map_or(Ok(&[][..]), in_order)?;
    Ok(PyArray1::from_vec(py, inverse_of_weights(knots, times, weights, (lam, profile), penalty, ends)))
}

/// The variance of a coordinate of the process that the jerk penalises, for noise of variance one. The profile has knots and the
/// factors of λ between them.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn process_variance<'py>(
    py: Python<'py>,
    times: Array<'py>,
    weights: Array<'py>,
    lam: f64,
    profile: Option<[Array<'py>; 2]>,
    period: Option<f64>,
    x: Array<'py>,
    nu: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (times, weights, x) = (in_order(&times)?, in_order(&weights)?, in_order(&x)?);
    let none = &[][..];
    let [knots, profile] = match &profile {
        Some([knots, profile]) => [in_order(knots)?, in_order(profile)?],
        None => [none, none],
    };
    let factor = |t: f64| {
        let inner = knots.get(1..knots.len().saturating_sub(1)).unwrap_or(none);
        let turn = period.map_or(0.0, |period| ((t - times[0]) / period).floor() * period);
        profile.get(inner.partition_point(|knot| *knot <= t - turn)).copied().unwrap_or(1.0)
    };
    Ok(PyArray1::from_vec(py, process(times, weights, |t| lam * factor(t), period, x, nu)))
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

/// The result of the examination of one sensor, see [`Finding`].
type Found = (f64, f64, f64, bool, bool, bool, Option<usize>, Vec<usize>, f64, f64, Option<[usize; 2]>);

fn found(own: Finding) -> Found {
    let Finding { ratio, freedom, correlation, large, small, correlated, .. } = own;
    let Finding { step, outliers, largest, rejected, run, .. } = own;
    (ratio, freedom, correlation, large, small, correlated, step, outliers, largest, rejected, run)
}

/// Examines residuals (n, d) in standard deviations, see [`Residuals`].
#[pyfunction]
pub fn examine(
    py: Python<'_>,
    rows: Array<'_>,
    leverage: f64,
    between: f64,
    corner: Option<f64>,
    exact: bool,
) -> PyResult<Found> {
    let d = rows.shape()[1];
    let rows = in_order(&rows)?;
    let given = Residuals { rows, d, leverage, between, corner, exact };
    Ok(found(watched(py, None, 1, is_long(rows.len()), |_| given.examine())?))
}

/// The curve, and one of: the part that the loss bypasses; the finding for a given σ; ratio, correlation, outliers and run
/// for an estimated σ, see [`Estimated`].
type Complained =
    (usize, Option<[usize; 2]>, Option<Found>, Option<(f64, f64, (usize, usize, f64), Option<[usize; 2]>)>);

/// Examines the residuals of curves: their data as for [`residuals_at`], residuals and deviations as it returns them,
/// scaled to weight one, leverages, and σ, which is NaN where it is estimated. Returns the curves that failed a test.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn examine_curves(
    py: Python<'_>,
    handle: &Handle,
    data: [Array<'_>; 4],
    rows: Array<'_>,
    neighbours: Array<'_>,
    leverages: Array<'_>,
    sigmas: Array<'_>,
    corner: Option<f64>,
) -> PyResult<Vec<Complained>> {
    let space = handle.space.get();
    let [curves, n, d] = [0, 1, 2].map(|axis| rows.shape()[axis]);
    let len = space.point_len();
    let [times, at, points, weights] = data.each_ref().map(in_order);
    let (times, at, points, weights) = (times?, at?, points?, weights?);
    let [rows, neighbours, leverages, sigmas] = [&rows, &neighbours, &leverages, &sigmas].map(in_order);
    let (rows, neighbours, leverages, sigmas) = (rows?, neighbours?, leverages?, sigmas?);
    let of = |c: usize| {
        let [times, weights, neighbours] = [times, weights, neighbours].map(|rows| &rows[c * n..][..n]);
        let [at, points] = [at, points].map(|rows| &rows[c * n * len..][..n * len]);
        let rows = &rows[c * n * d..][..n * d];
        let data = AtData { times, at, points, weights };
        let sigma = Some(sigmas[c]).filter(|sigma| !sigma.is_nan());
        let own = Examined { data, rows, neighbours, leverage: leverages[c], sigma };
        own.complaint(&space, d, corner).map(|complaint| (c, complaint))
    };
    let complaints = watched(py, None, curves, is_long(rows.len()), |_| {
        (0..curves).filter_map(of).collect::<Vec<(usize, Complaint)>>()
    })?;
    let told = |(c, complaint)| match complaint {
        Complaint::Bypassed(part) => (c, Some(part), None, None),
        Complaint::Given(finding) => (c, None, Some(found(finding)), None),
        Complaint::Estimated(own) => {
            (c, None, None, Some((own.ratio, own.correlation, own.outliers, own.run)))
        }
    };
    Ok(complaints.into_iter().map(told).collect())
}

/// For each curve the tests of constant smoothness and of constant noise: score, first and last datum, and ratio; None if
/// there are too few data. All arrays are (curves, ...): see [`is_constant`].
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)]
pub fn are_constant(
    py: Python<'_>,
    times: Array<'_>,
    weights: Array<'_>,
    leverages: Array<'_>,
    squares: Array<'_>,
    knots: Array<'_>,
    energy: Array<'_>,
    m: usize,
) -> PyResult<Vec<Option<[(f64, [usize; 2], f64); 2]>>> {
    let (curves, n, count) = (times.shape()[0], times.shape()[1], knots.shape()[1]);
    let [times, weights, leverages, squares] = [&times, &weights, &leverages, &squares].map(in_order);
    let (times, weights, leverages, squares) = (times?, weights?, leverages?, squares?);
    let (knots, energy) = (in_order(&knots)?, in_order(&energy)?);
    let of = |c: usize| {
        let [times, weights, leverages, squares] =
            [times, weights, leverages, squares].map(|rows| &rows[c * n..][..n]);
        let course = [knots, energy].map(|rows| &rows[c * count..][..count]);
        let tests = is_constant(times, weights, leverages, squares, course, m)?;
        Some(tests.map(|Unequal { score, place, ratio }| (score, place, ratio)))
    };
    watched(py, None, curves, is_long(times.len()), |_| (0..curves).map(of).collect())
}

/// Paths (curves, n, d, d) that turn by the most frequent steps of rotations, and whether in the fixed frame: see
/// [`usual_turn`].
#[pyfunction]
pub fn usual_turns<'py>(
    py: Python<'py>,
    handle: &Handle,
    points: Array<'py>,
) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Vec<bool>)> {
    let space = handle.space.get();
    let shape = points.shape();
    let (curves, n, d) = (shape[0], shape[1], shape[2]);
    let numbers = in_order(&points)?;
    let turns = watched(py, None, curves, is_long(numbers.len()), |_| {
        let of = |c: usize| usual_turn(&space, &numbers[c * n * d * d..][..n * d * d], d);
        (0..curves).map(of).collect::<Vec<Turn>>()
    })?;
    let out = zeros(py, shape)?;
    let mut write = out.readwrite();
    let rows = write.as_slice_mut()?.chunks_exact_mut((n * d * d).max(1));
    turns.iter().zip(rows).for_each(|(turn, row)| row.copy_from_slice(&turn.path));
    drop(write);
    Ok((out, turns.iter().map(|turn| turn.fixed).collect()))
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
    let samples = |c: usize| CumulativeData {
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
