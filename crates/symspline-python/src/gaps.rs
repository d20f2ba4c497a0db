//! Predictions without some of the data, called from Python.

use crate::arrays::{in_order, zeros};
use crate::estimation::{Known, matrices_of, penalty_named};
use crate::watch::{is_long, watched};
use numpy::{
    PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use symspline_engine::scalar::LANES;
use symspline_engine::smoothing::calibrate::{Calibration, Course, Evidence};
use symspline_engine::smoothing::gaps::{Block, Changes, Functionals, System};
use symspline_engine::smoothing::{chi, functional_at};

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type Out<'py> = Bound<'py, PyArrayDyn<f64>>;
/// Linear functions of coefficients and parameters: first coefficients, and factors (n, 4m) and (n, p).
type Rows<'py> = (PyReadonlyArray1<'py, i64>, Array<'py>, Array<'py>);

/// The factors of four coefficients, from the first one, in a derivative of a curve at times x.
#[pyfunction]
pub fn coefficient_factors<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    kinds: Option<[String; 2]>,
    x: Array<'py>,
    nu: usize,
) -> PyResult<(Bound<'py, PyArray1<i64>>, Out<'py>)> {
    let (knots, x) = (in_order(&knots)?, in_order(&x)?);
    let found = functional_at(knots, crate::estimation::ends_named(kinds)?, x, nu);
    let out = zeros(py, &[x.len(), 4])?;
    let all: Vec<f64> = found.iter().flat_map(|(_, factors)| *factors).collect();
    out.readwrite().as_slice_mut()?.copy_from_slice(&all);
    Ok((PyArray1::from_iter(py, found.iter().map(|(first, _)| *first as i64)), out))
}

/// Values (n, columns) and variances (n,) of the functions `probes` of one curve without some of its data. Every block
/// is the range of its omitted data in `omitted`, and that of its probes.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn predictions_without<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    known: Known<'py>,
    data: Rows<'py>,
    residuals: Array<'py>,
    probes: Rows<'py>,
    omitted: PyReadonlyArray1<'py, i64>,
    blocks: Vec<[usize; 4]>,
) -> PyResult<(Out<'py>, Out<'py>)> {
    let (matrices, m, ends, turn) = matrices_of(&known)?;
    let system = System::new(in_order(&knots)?, ends, m, &matrices, &turn);
    let index = |all: &PyReadonlyArray1<i64>| -> PyResult<Vec<usize>> {
        Ok(all.as_slice()?.iter().map(|i| *i as usize).collect())
    };
    let (of_data, of_probes) = (index(&data.0)?, index(&probes.0)?);
    let data = Functionals { firsts: &of_data, factors: in_order(&data.1)?, sides: in_order(&data.2)? };
    let probes =
        Functionals { firsts: &of_probes, factors: in_order(&probes.1)?, sides: in_order(&probes.2)? };
    let omitted = index(&omitted)?;
    let block = |&[a, b, c, d]: &[usize; 4]| Block { omitted: &omitted[a..b], probes: c..d, segments: 0..0 };
    let blocks: Vec<Block> = blocks.iter().map(block).collect();
    let residuals = in_order(&residuals)?;
    let columns = residuals.len() / of_data.len().max(1);
    let work = blocks.len().div_ceil(LANES) * matrices[0].len();
    let found =
        watched(py, None, work, false, |_| system.without(&data, residuals, columns, &probes, &blocks))?;
    let (values, variances) = (zeros(py, &[of_probes.len(), columns])?, zeros(py, &[of_probes.len()])?);
    values.readwrite().as_slice_mut()?.copy_from_slice(&found.values);
    variances.readwrite().as_slice_mut()?.copy_from_slice(&found.variances);
    Ok((values, variances))
}

/// Data linearised at a curve, see [`Evidence`]: times, first coefficients, factors of four coefficients (n, q, 4m) and of
/// parameters (n, q, p), residuals and errors (n, q, columns), which data count, weights, and numbers of observed
/// coordinates (n,); the number of coordinates.
type Linearised<'py> = (
    Array<'py>,
    PyReadonlyArray1<'py, i64>,
    [Array<'py>; 2],
    [Array<'py>; 2],
    PyReadonlyArray1<'py, bool>,
    [Array<'py>; 2],
    usize,
);

/// Calls a function with a calibration, on another thread if it takes long.
fn calibrated<T: Send>(
    py: Python,
    knots: &Array,
    known: &Known,
    evidence: &Linearised,
    (changes, period): (Option<Changes>, Option<f64>),
    work: impl FnOnce(&Calibration) -> T + Send,
) -> PyResult<T> {
    let (matrices, m, ends, turn) = matrices_of(known)?;
    let system = System::new(in_order(knots)?, ends, m, &matrices, &turn).with_changes(changes);
    let (times, firsts, [factors, sides], [residuals, errors], counts, [weights, observed], coordinates) =
        evidence;
    let count = factors.shape()[1];
    let firsts = firsts.as_slice()?.iter().flat_map(|first| vec![*first as usize; count]);
    let firsts: Vec<usize> = firsts.collect();
    let evidence = Evidence {
        times: in_order(times)?,
        rows: Functionals { firsts: &firsts, factors: in_order(factors)?, sides: in_order(sides)? },
        count,
        residuals: in_order(residuals)?,
        errors: in_order(errors)?,
        counts: counts.as_slice()?,
        weights: in_order(weights)?,
        observed: in_order(observed)?,
        coordinates: *coordinates,
    };
    let heavy = is_long(matrices[0].len());
    watched(py, None, 1, heavy, |_| work(&Calibration { system: &system, evidence: &evidence, period }))
}

/// The factor and the number of blocks for every gap (G, 2): see [`Calibration::factors_in_gaps`]. If λ varies, `changes` are
/// those of λ in omitted segments (K − 1,), accelerations at the knots (K, m), and the penalty.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn gap_factors<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    known: Known<'py>,
    evidence: Linearised<'py>,
    gaps: Vec<[f64; 2]>,
    width: f64,
    at_data: f64,
    period: Option<f64>,
    changes: Option<(Array<'py>, Array<'py>, String)>,
) -> PyResult<Vec<(f64, usize)>> {
    let changes = match &changes {
        None => None,
        Some((lam, accelerations, penalty)) => Some(Changes {
            lam: in_order(lam)?,
            accelerations: in_order(accelerations)?,
            penalised: penalty_named(penalty)?,
        }),
    };
    let how = (changes, period);
    calibrated(py, &knots, &known, &evidence, how, |own| own.factors_in_gaps(&gaps, width, at_data))
}

/// Distances beyond the ends with their factors, and the number of predictions: see [`Calibration::factors_beyond`]. The
/// course is that of a [`Course`]: roots (n, q, m), positions and velocities, order, λ and acceleration.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn end_factors<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    known: Known<'py>,
    evidence: Linearised<'py>,
    course: ([Array<'py>; 3], usize, f64, f64),
    usual: f64,
) -> PyResult<(Vec<[f64; 2]>, usize)> {
    let ([roots, positions, velocities], order, lam, acceleration) = &course;
    let course = Course {
        roots: in_order(roots)?,
        positions: in_order(positions)?,
        velocities: in_order(velocities)?,
        order: *order,
        lam: *lam,
        acceleration: *acceleration,
    };
    calibrated(py, &knots, &known, &evidence, (None, None), |own| own.factors_beyond(&course, usual))
}

/// The quantile of the ratio of χ² with m degrees of freedom to the mean square of n independent normal numbers.
#[pyfunction]
pub fn chi_squared_ratio(m: usize, n: usize, probability: f64) -> f64 {
    chi::ratio_quantile(m, n, probability)
}
