//! Fitting, called from Python.

use crate::arrays::{in_order, require_memory, reserve, zeros};
use crate::curves::{Array, CurveFault, CurvesToFit, EndOf, require_memory_for_checks};
use crate::errors::{in_factor, invalid};
use crate::space::Handle;
use crate::watch::{Progress, is_heavy, is_long, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::fit::{
    InnerVelocities, Method, Options, Report, Solver, Status, fit as solve, fit_with_conditions, memory,
};
use symspline_engine::space::{Ambient, Erased};

/// Points on the space, velocities, the columns of the report, and faults.
type Fitted<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, Columns<'py>, Vec<CurveFault>);
/// Velocities at inner nodes, one per curve.
type Inner<'py> = Option<Vec<(usize, Array<'py>)>>;
/// Curves in one factor of a product: the space, points, ends, the tolerance of points (None without validation),
/// velocities at inner nodes, and the injectivity radius of a quotient. The knots include those that ends with two
/// conditions add.
type Factor<'py> =
    (PyRef<'py, Handle>, Array<'py>, Option<[EndOf<'py>; 2]>, Option<f64>, Inner<'py>, Option<f64>);

/// Fits curves in every factor of a product; a space that is not a product is its only factor. All factors are validated
/// before the first is solved. `offsets` are the nodes before each curve when they differ in length (then points are one
/// long list). Curves whose `mask` is false are NaN. With `skip_invalid`, so are curves with points off the space in any
/// factor.
#[pyfunction]
#[pyo3(signature = (
    factors, t, method, tol, max_iter, offsets=None, mask=None, skip_invalid=false, progress=None
))]
pub fn fit<'py>(
    py: Python<'py>,
    factors: Vec<Factor<'py>>,
    t: Array<'py>,
    method: &str,
    tol: f64,
    max_iter: Option<usize>,
    offsets: Option<Vec<usize>>,
    mask: Option<Vec<bool>>,
    skip_invalid: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Fitted<'py>>> {
    let options = options(method, tol, max_iter)?;
    let count = factors.len();
    let mut tasks = Vec::with_capacity(count);
    for (i, (handle, points, ends, point_tol, inner, _)) in factors.iter().enumerate() {
        let curves = CurvesToFit::new(handle, &t, points, ends, offsets.clone(), mask.clone())?;
        require_memory_for_checks(handle, &curves)?;
        require_memory(memory(&curves.space, curves.longest(), options.method), || {
            let least = match options.method {
                Method::Newton | Method::Homotopy => "Pass method='quasi-newton', which needs far less",
                _ => "",
            };
            (
                format!(
                    "fitting {} points on {} with method='{method}'",
                    curves.longest(),
                    handle.described()
                ),
                least,
            )
        })?;
        let mut task = Task { curves, points: Vec::new(), faults: Vec::new(), inner: Vec::new() };
        for (node, velocities) in inner.iter().flatten() {
            task.inner.push((*node, in_order(velocities)?));
        }
        task.curves.gather_points(&mut task.points)?;
        if let Some(point_tol) = *point_tol {
            let heavy = is_heavy(&task.curves.space) || is_long(task.points.len());
            task.faults = watched(py, None, 1, heavy, |_| {
                task.curves.check(&mut task.points, point_tol, skip_invalid)
            })?
            .map_err(|fault| in_factor(py, fault.raise(py, &task.curves.batch), i, count))?;
        }
        tasks.push(task);
    }
    if count > 1 && tasks.iter().any(|task| !task.faults.is_empty()) {
        // A curve that is skipped in one factor is masked in all.
        let all = 0..tasks[0].curves.offsets.len() - 1;
        let valid: Vec<usize> = all.filter(|c| tasks.iter().all(|task| task.curves.fits(*c))).collect();
        tasks.iter_mut().for_each(|task| task.curves.keep(&valid, &mut task.points));
    }
    tasks
        .into_iter()
        .zip(&factors)
        .enumerate()
        .map(|(i, (task, factor))| {
            let progress =
                progress.as_ref().map(|p| Progress { call: p.clone_ref(py), part: i, parts: count });
            let radius = factor.5.unwrap_or_else(|| factor.0.space.get().injectivity_radius());
            let options = Options { certify: Some(radius), ..options };
            task.solve(py, &options, factor.1.shape(), progress)
        })
        .collect()
}

/// Curves in one space, their points on it, and the faults of skipped curves.
struct Task<'a> {
    curves: CurvesToFit<'a>,
    points: Vec<f64>,
    faults: Vec<CurveFault>,
    inner: Vec<(usize, &'a [f64])>,
}

impl Task<'_> {
    fn solve<'py>(
        self,
        py: Python<'py>,
        options: &Options,
        shape: &[usize],
        progress: Option<Progress>,
    ) -> PyResult<Fitted<'py>> {
        if self.curves.has_additional_knots() || !self.inner.is_empty() {
            return self.solve_with_conditions(py, options, shape, progress);
        }
        let Task { curves, points, faults, .. } = self;
        let space = curves.space;
        let velocities = zeros(py, shape)?;
        let gathered = curves.gathered();
        let problem = gathered.problem(curves.shared, &points);
        let nodes = points.len() / space.point_len();
        let mut velocities_write = velocities.readwrite();
        let u = velocities_write.as_slice_mut()?;
        let found = match &curves.chosen {
            None => watched(py, progress, nodes, is_heavy(&space), |monitor| {
                solve(&space, &problem, options, monitor, u)
            })?,
            Some(_) => {
                let mut own_velocities = reserve(points.len())?;
                own_velocities.resize(points.len(), 0.0);
                let found = watched(py, progress, nodes, is_heavy(&space), |monitor| {
                    solve(&space, &problem, options, monitor, &mut own_velocities)
                })?;
                curves.scatter(&own_velocities, u);
                found
            }
        };
        drop((velocities_write, gathered));
        let out = curves.points(py, points, shape)?;
        let (columns, faults) = reported(py, &curves, &found, faults)?;
        Ok((out, velocities, columns, faults))
    }

    /// Solves curves with velocities at inner nodes, or with two conditions at an end.
    fn solve_with_conditions<'py>(
        self,
        py: Python<'py>,
        options: &Options,
        shape: &[usize],
        progress: Option<Progress>,
    ) -> PyResult<Fitted<'py>> {
        let Task { mut curves, points, faults, inner } = self;
        let (space, gathered, knots) = (curves.space, curves.gathered(), curves.all_knots());
        let problem = gathered.problem(curves.shared, &points);
        let rows: Vec<_> = inner.iter().map(|(node, all)| (*node, curves.rows(all))).collect();
        let inner: Vec<InnerVelocities> =
            rows.iter().map(|(node, velocities)| InnerVelocities { node: *node, velocities }).collect();
        let nodes = points.len() / space.point_len();
        let found = watched(py, progress, nodes, is_heavy(&space), |monitor| {
            fit_with_conditions(
                &space,
                &problem,
                &knots,
                &inner,
                &Options { certify: None, ..*options },
                monitor,
            )
        })?;
        drop((gathered, points));
        let axis = curves.batch.len();
        let mut shape = shape.to_vec();
        shape[axis] += curves.widen();
        let points = curves.points(py, found.points, &shape)?;
        let velocities = curves.points(py, found.velocities, &shape)?;
        let (columns, faults) = reported(py, &curves, &found.reports, faults)?;
        Ok((points, velocities, columns, faults))
    }
}

/// The columns of the report, and faults; `faults` are those of skipped curves.
fn reported<'py>(
    py: Python<'py>,
    curves: &CurvesToFit,
    found: &[Report],
    mut faults: Vec<CurveFault>,
) -> PyResult<(Columns<'py>, Vec<CurveFault>)> {
    let all = curves.offsets.len() - 1;
    let numbers: Vec<usize> = curves.chosen.clone().unwrap_or_else(|| (0..all).collect());
    faults.extend(
        numbers.iter().zip(found).filter_map(|(&number, report)| fault(&curves.space, number, report)),
    );
    faults.sort_by_key(|fault| fault.0);
    let mut reports: Vec<Option<&Report>> = vec![None; all];
    numbers.iter().zip(found).for_each(|(&number, report)| reports[number] = Some(report));
    Ok((columns(py, &reports)?, faults))
}

fn options(method: &str, tol: f64, max_iter: Option<usize>) -> PyResult<Options> {
    let method = match method {
        "auto" => Method::Auto,
        "fixed-point" => Method::FixedPoint,
        "quasi-newton" => Method::QuasiNewton,
        "newton" => Method::Newton,
        "homotopy" => Method::Homotopy,
        _ => {
            return Err(invalid(format!(
                "method must be 'auto', 'fixed-point', 'quasi-newton', 'newton' or 'homotopy', not {method:?}"
            )));
        }
    };
    if !(tol >= 0.0 && tol.is_finite()) {
        return Err(invalid(format!("tol must be a number >= 0, not {tol}")));
    }
    if max_iter == Some(0) {
        return Err(invalid("max_iter must be at least 1"));
    }
    Ok(Options { method, tol, max_iter, certify: None })
}

/// The report as two tables with a row for each field, in the order of `INTEGERS` and `NUMBERS` in _base/report.py, and a column
/// for each curve.
type Columns<'py> = (Bound<'py, PyArrayDyn<i64>>, Bound<'py, PyArrayDyn<f64>>);

fn columns<'py>(py: Python<'py>, reports: &[Option<&Report>]) -> PyResult<Columns<'py>> {
    const INTEGERS: [fn(&Report) -> i64; 4] = [
        |r| i64::from(r.status == Status::Converged),
        |r| r.iterations as i64,
        |r| r.solver as i64,
        |r| i64::from(r.skipped.0),
    ];
    const NUMBERS: [fn(&Report) -> f64; 9] = [
        |r| r.residual,
        |r| r.max_step,
        |r| r.rate,
        |r| r.invariant_radius,
        |r| r.contraction_bound,
        |r| r.guaranteed_sweeps,
        |r| r.alternative,
        |r| r.existence_radius,
        |r| r.uniqueness_radius,
    ];
    let integer = |f: &fn(&Report) -> i64, r: &Option<&Report>| r.map_or(0, f);
    let number = |f: &fn(&Report) -> f64, r: &Option<&Report>| r.map_or(f64::NAN, f);
    // New arrays that are filled take half the time of those made from iterators and reshaped.
    let integers = PyArrayDyn::zeros(py, [INTEGERS.len(), reports.len()].as_slice(), false);
    let numbers = PyArrayDyn::zeros(py, [NUMBERS.len(), reports.len()].as_slice(), false);
    let found = INTEGERS.iter().flat_map(|f| reports.iter().map(move |r| integer(f, r)));
    integers.readwrite().as_slice_mut()?.iter_mut().zip(found).for_each(|(x, found)| *x = found);
    let found = NUMBERS.iter().flat_map(|f| reports.iter().map(move |r| number(f, r)));
    numbers.readwrite().as_slice_mut()?.iter_mut().zip(found).for_each(|(x, found)| *x = found);
    Ok((integers, numbers))
}

/// The fault of a curve that was solved, if it has one.
fn fault(space: &Erased, curve: usize, report: &Report) -> Option<CurveFault> {
    let limit = space.cut_angle();
    let at = |kind, (node, angle)| Some((curve, kind, Some(node), angle, limit, None));
    match report.status {
        Status::Stopped => None,
        Status::Unattained => Some((curve, "unattained", None, f64::NAN, f64::NAN, None)),
        Status::Converged => at("almost-cut", report.almost_cut?),
        Status::CutLocus { index, angle } => at("cut-locus", (index, angle)),
        Status::LongHandle { index, angle } => at("outer-handle", (index, angle)),
        Status::InnerHandle { index, angle } => at("inner-handles", (index, angle)),
        Status::Unconverged | Status::Imprecise => {
            let kind = match report.solver {
                _ if report.status == Status::Imprecise && report.residual.is_finite() => "imprecise",
                Solver::Homotopy if report.residual.is_infinite() => "homotopy",
                _ if !report.residual.is_finite() => "overflow",
                _ => "unconverged",
            };
            Some((curve, kind, None, report.residual, f64::NAN, None))
        }
    }
}
