//! Estimation from measurements of any kind, called from Python.

use crate::arrays::{count, in_order, zeros};
use crate::errors::invalid;
use crate::space::Handle;
use crate::watch::{is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::smoothing::along::Along;
use symspline_engine::smoothing::estimation::{Estimation, Factor, Matrices, Measurements};
use symspline_engine::smoothing::posterior::Posterior;
use symspline_engine::smoothing::{Criterion, EndCondition, Ends, Penalty, positions};
use symspline_engine::space::{Ambient, Origin};

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type Out<'py> = Bound<'py, PyArrayDyn<f64>>;

/// A measurement of one kind: times, whitened residuals (n, d), their derivatives with respect to the move of the
/// curve and its time derivatives, (n, d, m) each, and with respect to the parameters, (n, d, p).
type Term<'py> = (Array<'py>, Array<'py>, [Option<Array<'py>>; 3], Option<Array<'py>>);

/// The numbers of an array that may be omitted.
fn given<'a>(array: &'a Option<Array>) -> PyResult<&'a [f64]> {
    array.as_ref().map_or(Ok(&[]), in_order)
}

/// An array with the numbers of a slice.
fn array<'py>(py: Python<'py>, shape: &[usize], numbers: &[f64]) -> PyResult<Out<'py>> {
    let out = zeros(py, shape)?;
    out.readwrite().as_slice_mut()?.copy_from_slice(numbers);
    Ok(out)
}

/// The kind of the ends of a curve: "natural", "not-a-knot" or "periodic", and "velocity" for one with given velocities.
pub fn ends_named(kinds: Option<[String; 2]>) -> PyResult<Ends> {
    let one = |name: &String| match name.as_str() {
        "natural" => Ok(EndCondition::Natural),
        "velocity" => Ok(EndCondition::Velocity),
        "not-a-knot" => Ok(EndCondition::NotAKnot),
        _ => Err(invalid(format!("a smoothing spline cannot have the end condition {name:?}"))),
    };
    Ok(match &kinds {
        None => Ends::Periodic,
        Some([a, b]) => Ends::Open([one(a)?, one(b)?]),
    })
}

/// The penalty and the ends that belong to it.
pub fn penalty_named(name: &str) -> PyResult<Penalty> {
    match name {
        "acceleration" => Ok(Penalty::Acceleration),
        "jerk" => Ok(Penalty::Jerk),
        _ => Err(invalid(format!("penalty must be 'acceleration' or 'jerk', not {name:?}"))),
    }
}

/// The criterion of this name.
pub fn criterion_named(name: &str, gamma: f64) -> PyResult<Criterion> {
    Ok(match name {
        "gcv" => Criterion::Gcv { gamma },
        "reml" => Criterion::Reml,
        "cp" => Criterion::Cp,
        _ => {
            return Err(invalid(format!("criterion must be 'gcv', 'reml' or 'cp', not {name:?}")));
        }
    })
}

/// The ends of an open curve with a penalty.
fn free_ends(penalty: Penalty) -> Ends {
    Ends::Open(match penalty {
        Penalty::Acceleration => [EndCondition::Natural; 2],
        Penalty::Jerk => [EndCondition::NotAKnot; 2],
    })
}

/// Frames along one curve at times x with the points `gammas`: (n, m, numbers of a point).
#[pyfunction]
pub fn frames_along<'py>(
    py: Python<'py>,
    handle: &Handle,
    knots: Array<'py>,
    points: Array<'py>,
    x: Array<'py>,
    gammas: Array<'py>,
) -> PyResult<Out<'py>> {
    let space = handle.space.get();
    let slices = [&knots, &points, &x, &gammas].map(in_order);
    let [knots, points, x, gammas] = slices;
    let (knots, points, x, gammas) = (knots?, points?, x?, gammas?);
    let heavy = is_long((points.len() + gammas.len()) * space.dim());
    let found =
        watched(py, None, x.len(), heavy, |_| Along::new(&space, knots, points, &[]).frames(x, gammas))?;
    array(py, &[x.len(), space.dim(), space.point_len()], &found)
}

/// R(ξ, γ')γ' for velocities γ' and vectors ξ in coordinates of frames: (n, m) each.
#[pyfunction]
pub fn curvature_along<'py>(
    py: Python<'py>,
    handle: &Handle,
    velocities: Array<'py>,
    vectors: Array<'py>,
) -> PyResult<Out<'py>> {
    let space = handle.space.get();
    let (u, x) = (in_order(&velocities)?, in_order(&vectors)?);
    let found =
        watched(py, None, u.len(), is_long(u.len() * space.dim()), |_| Along::curvature(&space, u, x))?;
    array(py, velocities.shape(), &found)
}

/// Velocities and accelerations at the knots of a curve in the frames along it, (K, m) each, in units of the mean knot
/// spacing.
#[pyfunction]
pub fn bending<'py>(
    py: Python<'py>,
    handle: &Handle,
    knots: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
) -> PyResult<[Out<'py>; 2]> {
    let space = handle.space.get();
    let (knots, points, velocities) = (in_order(&knots)?, in_order(&points)?, in_order(&velocities)?);
    let heavy = is_long(points.len() * space.dim());
    let found =
        watched(py, None, knots.len(), heavy, |_| Along::new(&space, knots, points, velocities).bending())?;
    let shape = [knots.len(), space.dim()];
    Ok([array(py, &shape, &found.speeds)?, array(py, &shape, &found.accelerations)?])
}

/// λ and whether it is at a bound; the step at the knots (K, m) and of the parameters (p,); their variances; degrees of
/// freedom of each factor and of everything; the information about the parameters (p, p); whether the measurements
/// determine the curve; the sum of squares and the number of residuals; and A.
type Solved<'py> = (
    Out<'py>,
    Vec<bool>,
    Out<'py>,
    Out<'py>,
    [Out<'py>; 2],
    Out<'py>,
    f64,
    Out<'py>,
    bool,
    f64,
    usize,
    [Out<'py>; 3],
);

/// Solves the linear problem of measurements. `factors` are the space, the velocities and the accelerations of each
/// factor, as [`bending`] returns them, and the matrices (m, m, m) of half the bracket, if its moving frame matters;
/// `priors` (p, 2) the precision of each parameter and its distance from the
/// prior mean. λ that are NaN are chosen, near the guesses that are not NaN.
#[pyfunction]
pub fn estimate<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    penalty: &str,
    factors: Vec<(PyRef<'py, Handle>, Array<'py>, Array<'py>, Option<Array<'py>>)>,
    priors: Array<'py>,
    terms: Vec<Term<'py>>,
    lams: Array<'py>,
    guesses: Array<'py>,
    criterion: &str,
    gamma: f64,
) -> PyResult<Solved<'py>> {
    let (criterion, penalty) = (criterion_named(criterion, gamma)?, penalty_named(penalty)?);
    let knots = in_order(&knots)?;
    let priors: Vec<(f64, f64)> = in_order(&priors)?.chunks_exact(2).map(|x| (x[0], x[1])).collect();
    let spaces: Vec<_> = factors.iter().map(|(handle, ..)| handle.space.get()).collect();
    let m: usize = spaces.iter().map(Origin::dim).sum();
    let own = factors
        .iter()
        .zip(&spaces)
        .map(|((_, a, b, c), space)| {
            Ok(Factor { space, speeds: in_order(a)?, accelerations: in_order(b)?, halves: given(c)? })
        })
        .collect::<PyResult<Vec<_>>>()?;
    let mut read = Vec::new();
    for (x, residuals, [a, b, c], parameters) in &terms {
        let at = positions(knots, in_order(x)?);
        let size = residuals.shape()[1];
        read.push((at, size, in_order(residuals)?, [given(a)?, given(b)?, given(c)?], given(parameters)?));
    }
    let numbers = |array: &Array<'py>| -> PyResult<Vec<Option<f64>>> {
        Ok(in_order(array)?.iter().map(|x| Some(*x).filter(|x| !x.is_nan())).collect())
    };
    let (known, near) = (numbers(&lams)?, numbers(&guesses)?);
    let factor_count = own.len();
    // Every λ of the search factors a banded matrix with a border.
    let data: usize = terms.iter().map(|(x, ..)| x.len()).sum();
    let heavy = is_long((knots.len() * m + priors.len() + data) * (m + priors.len()));
    let (found, residuals, matrices) = watched(py, None, knots.len(), heavy, |_| {
        let mut problem = Estimation::new(knots, free_ends(penalty), penalty, own, &priors);
        for (at, size, residuals, jacobians, parameters) in &read {
            problem.add(&Measurements {
                positions: at,
                residuals,
                size: *size,
                jacobians: *jacobians,
                parameters,
            });
        }
        let found = problem.solve(&known, &near, criterion);
        let lams: Vec<f64> = found.lams.iter().map(|(lam, _)| *lam).collect();
        let matrices = problem.matrices(&lams);
        (found, problem.residuals(), matrices)
    })?;
    let (k, p) = (knots.len(), priors.len());
    let (lams, bounds): (Vec<f64>, Vec<bool>) = found.lams.into_iter().unzip();
    let [at_knots, of_parameters] = &found.variances;
    let [band, side, corner] = matrices;
    Ok((
        array(py, &[factor_count], &lams)?,
        bounds,
        array(py, &[k, m], &found.step)?,
        array(py, &[p], &found.parameters)?,
        [array(py, &[k, m], at_knots)?, array(py, &[p], of_parameters)?],
        array(py, &[factor_count], &found.freedom.0)?,
        found.freedom.1,
        array(py, &[p, p], &found.information)?,
        found.determined,
        residuals.0,
        residuals.1,
        [array(py, &[k * m, 4 * m], &band)?, array(py, &[k * m, p], &side)?, array(py, &[p, p], &corner)?],
    ))
}

/// A of one curve, and how the curve ends: the band, side and corner, the coordinates that it couples, the kinds of the
/// ends (None for a closed curve) and the holonomy of a closed curve.
pub type Known<'py> = ([Array<'py>; 3], usize, Option<[String; 2]>, Array<'py>);

/// The same, as slices.
struct Slices<'a> {
    knots: &'a [f64],
    matrices: [&'a [f64]; 3],
    m: usize,
    ends: Ends,
    turn: &'a [f64],
}

impl<'a> Slices<'a> {
    fn new(knots: &'a Array, known: &'a Known) -> PyResult<Self> {
        let ([band, side, corner], m, kinds, turn) = known;
        Ok(Slices {
            knots: in_order(knots)?,
            matrices: [in_order(band)?, in_order(side)?, in_order(corner)?],
            m: *m,
            ends: ends_named(kinds.clone())?,
            turn: in_order(turn)?,
        })
    }

    /// Factors A.
    fn posterior(&self) -> Posterior<'a> {
        Posterior::new(self.knots, self.ends, self.m, self.matrices, self.turn)
    }

    /// Whether a computation with A may take a long time, because of its size or that of the result.
    fn is_heavy(&self, numbers: usize) -> bool {
        let entries: usize = self.matrices.iter().map(|x| x.len()).sum();
        is_long(entries.saturating_mul(self.m)) || is_long(numbers)
    }
}

/// The band, side and corner of A, the coordinates that it couples, the ends and the holonomy.
pub fn matrices_of(known: &Known) -> PyResult<(Matrices, usize, Ends, Vec<f64>)> {
    let ([band, side, corner], m, kinds, turn) = known;
    let matrices = [in_order(band)?.to_vec(), in_order(side)?.to_vec(), in_order(corner)?.to_vec()];
    Ok((matrices, *m, ends_named(kinds.clone())?, in_order(turn)?.to_vec()))
}

/// Covariances at times x for noise of variance one: of the curve with itself at times y, or of its derivatives
/// `orders` at the same times.
#[pyfunction]
pub fn posterior_covariance<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    known: Known<'py>,
    x: Array<'py>,
    y: Option<Array<'py>>,
    orders: Vec<usize>,
) -> PyResult<Out<'py>> {
    let (own, times) = (Slices::new(&knots, &known)?, in_order(&x)?);
    let size = own.m * orders.len();
    let others = y.as_ref().map(in_order).transpose()?;
    let shape = [times.len(), size, size];
    let found = watched(py, None, times.len(), own.is_heavy(count(&shape)), |_| match others {
        Some(others) => own.posterior().between(times, others),
        None => own.posterior().covariances(times, &orders),
    })?;
    array(py, &shape, &found)
}

/// The number of independent normal numbers that a sample of the posterior needs.
#[pyfunction]
pub fn posterior_freedom(knots: Array, known: Known) -> PyResult<usize> {
    let own = Slices::new(&knots, &known)?;
    Ok(Posterior::freedom(own.knots, own.ends, own.m, own.matrices[2].len().isqrt()))
}

/// Moves of the curve at its knots, (samples, K, m), from independent normal numbers (samples, ...).
#[pyfunction]
pub fn posterior_samples<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    known: Known<'py>,
    normal: Array<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (own, numbers) = (Slices::new(&knots, &known)?, in_order(&normal)?);
    let heavy = own.is_heavy(numbers.len());
    let found = watched(py, None, normal.shape()[0], heavy, |_| own.posterior().samples(numbers))?;
    Ok(PyArray1::from_vec(py, found))
}
