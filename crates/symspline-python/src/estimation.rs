//! Estimation from measurements of any kind, called from Python.

use crate::arrays::{count, in_order, zeros};
use crate::errors::invalid;
use crate::space::{Handle, bad_row};
use crate::watch::{is_long, watched, watched_serving};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, Thread};
use symspline_engine::monitor::{Cancelled, Monitor};
use symspline_engine::smoothing::along::Along;
use symspline_engine::smoothing::body::Body;
use symspline_engine::smoothing::estimation::Matrices;
use symspline_engine::smoothing::iteration::{Constant, Failure, Invalid, Linear, Options, Problem};
use symspline_engine::smoothing::motion::{BadRow, Motion};
use symspline_engine::smoothing::posterior::Posterior;
use symspline_engine::smoothing::terms::{Change, Derivatives, Linearised, Residuals, Sensor, Term};
use symspline_engine::smoothing::{Criterion, EndCondition, EndConditions, Loss, Penalty, Profile};
use symspline_engine::space::{Ambient, Erased, Origin};

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type Out<'py> = Bound<'py, PyArrayDyn<f64>>;

/// An array with the numbers of a slice.
fn array<'py>(py: Python<'py>, shape: &[usize], numbers: &[f64]) -> PyResult<Out<'py>> {
    let out = zeros(py, shape)?;
    out.readwrite().as_slice_mut()?.copy_from_slice(numbers);
    Ok(out)
}

/// The kind of the ends of a curve: "natural", "not-a-knot" or "periodic", and "velocity" for one with given velocities.
pub fn ends_named(kinds: Option<[String; 2]>) -> PyResult<EndConditions> {
    let one = |name: &String| match name.as_str() {
        "natural" => Ok(EndCondition::Natural),
        "velocity" => Ok(EndCondition::Velocity),
        "not-a-knot" => Ok(EndCondition::NotAKnot),
        _ => Err(invalid(format!("a smoothing spline cannot have the end condition {name:?}"))),
    };
    Ok(match &kinds {
        None => EndConditions::Periodic,
        Some([a, b]) => EndConditions::Open([one(a)?, one(b)?]),
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

/// The loss of this name.
pub fn loss_named(name: &str) -> PyResult<Loss> {
    match name {
        "linear" => Ok(Loss::Linear),
        "huber" => Ok(Loss::Huber),
        "cauchy" => Ok(Loss::Cauchy),
        _ => Err(invalid(format!("loss must be 'linear', 'huber' or 'cauchy', not {name:?}"))),
    }
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

/// Measurements of one kind: the sensor, the parts of the space, times, standard deviations (n, d) or none, the loss, the
/// parameter that is added to the times, the arrays of the sensor, its other parameters (first and number), and the
/// function of the user with the highest derivative that it needs and the function that returns its derivatives, if any.
type TermOf<'py> = (
    String,
    Vec<usize>,
    Array<'py>,
    Array<'py>,
    String,
    Option<usize>,
    Vec<Array<'py>>,
    Vec<Option<(usize, usize)>>,
    Option<(Py<PyAny>, usize, Option<Py<PyAny>>)>,
);

/// A problem: the parts of the space; for those that are groups with a metric that is invariant on both sides, the array
/// `Body::inverse`; the knots; the penalty; the means and precisions (p, 2) of the parameters; the measurements; and for
/// each part λ of the segments (K − 1,) divided by λ, or None for one λ.
type ProblemOf<'py> = (
    Vec<PyRef<'py, Handle>>,
    Vec<Option<Array<'py>>>,
    Array<'py>,
    String,
    Array<'py>,
    Vec<TermOf<'py>>,
    Vec<Option<Array<'py>>>,
);

/// A call of Python that an estimate needs.
enum Request {
    /// The number of an iteration.
    Progress(usize),
    /// The function of a term: points, velocities and accelerations of its parts, and all parameters.
    Residuals { term: usize, states: Vec<Vec<Vec<f64>>>, values: Vec<f64> },
    /// The derivatives of that function with respect to changes of the motion and to its parameters.
    Derivatives { term: usize, states: Vec<Vec<Vec<f64>>>, values: Vec<f64>, changes: Vec<Change> },
}

/// Makes calls of Python in the thread of the user, which waits while another thread computes.
struct Desk<'a> {
    owner: Thread,
    requests: Sender<(Request, Sender<Residuals>)>,
    received: Mutex<Receiver<(Request, Sender<Residuals>)>>,
    call: &'a (dyn Fn(Python, Request) -> PyResult<Residuals> + Sync),
    error: Mutex<Option<PyErr>>,
}

impl<'a> Desk<'a> {
    fn new(call: &'a (dyn Fn(Python, Request) -> PyResult<Residuals> + Sync)) -> Self {
        let (requests, received) = channel();
        Desk {
            owner: thread::current(),
            requests,
            received: Mutex::new(received),
            call,
            error: Mutex::new(None),
        }
    }

    /// The answer to a request. Unwinds if the call raises an exception.
    fn ask(&self, request: Request) -> Residuals {
        let answer = if thread::current().id() == self.owner.id() {
            self.answer(request)
        } else {
            let (reply, answer) = channel();
            let sent = self.requests.send((request, reply));
            self.owner.unpark();
            sent.ok().and_then(|()| answer.recv().ok())
        };
        answer.unwrap_or_else(|| resume_unwind(Box::new(Cancelled)))
    }

    fn answer(&self, request: Request) -> Option<Residuals> {
        let found = Python::attach(|py| (self.call)(py, request));
        found.map_err(|error| self.error.lock().map(|mut first| *first = Some(error))).ok()
    }

    /// Answers the requests of the other thread.
    fn serve(&self) {
        let next = || self.received.lock().ok()?.try_recv().ok();
        while let Some((request, reply)) = next() {
            // Without an answer the other thread stops.
            if let Some(found) = self.answer(request) {
                let _ = reply.send(found);
            }
        }
    }
}

/// Runs work on a problem.
fn with_problem<T: Send>(
    py: Python,
    given: &ProblemOf,
    heavy: bool,
    progress: Option<&Py<PyAny>>,
    max_iter: usize,
    work: impl FnOnce(&Problem, &dyn Fn(usize), &Monitor) -> Result<T, Invalid> + Send,
) -> PyResult<Result<T, Vec<f64>>> {
    let (handles, groups, knots, penalty, constants, terms, profiles) = given;
    let (knots, penalty) = (in_order(knots)?, penalty_named(penalty)?);
    let spaces: Vec<Erased> = handles.iter().map(|handle| handle.space.get()).collect();
    let shapes: Vec<Vec<usize>> = spaces.iter().map(shape_of).collect();
    let functions: Vec<[Option<&Py<PyAny>>; 2]> = terms
        .iter()
        .map(|term| term.8.as_ref().map_or([None; 2], |own| [Some(&own.0), own.2.as_ref()]))
        .collect();
    let parts: Vec<&[usize]> = terms.iter().map(|term| &term.1[..]).collect();
    let call = |py: Python, request: Request| match request {
        Request::Progress(number) => {
            progress.map_or(Ok(()), |own| own.call1(py, (number, max_iter)).map(drop))?;
            Ok((Vec::new(), 0))
        }
        Request::Residuals { term, states, values } => {
            let states = motions(py, &shapes, parts[term], &states)?;
            let function = functions[term][0].ok_or_else(|| invalid("the measurement has no function"))?;
            let found = function.call1(py, (states, array(py, &[values.len()], &values)?))?;
            let found: Array = found.extract(py)?;
            Ok((in_order(&found)?.to_vec(), found.shape()[1]))
        }
        Request::Derivatives { term, states, values, changes } => {
            let states = motions(py, &shapes, parts[term], &states)?;
            let of_change = |(part, arrays): &Change| {
                let shape = &shapes[parts[term][*part]];
                let arrays =
                    arrays.iter().map(|x| of_points(py, shape, x)).collect::<PyResult<Vec<Out>>>()?;
                Ok((*part, arrays))
            };
            let changes = changes.iter().map(of_change).collect::<PyResult<Vec<_>>>()?;
            let function = functions[term][1].ok_or_else(|| invalid("the measurement has no derivatives"))?;
            let found = function.call1(py, (states, array(py, &[values.len()], &values)?, changes))?;
            let found: Array = found.extract(py)?;
            Ok((in_order(&found)?.to_vec(), found.shape()[1]))
        }
    };
    let desk = Desk::new(&call);
    let states = |motion: &[Motion], order: usize| -> Vec<Vec<Vec<f64>>> {
        (0..=order).map(|nu| motion.iter().map(|own| own.derivative(nu).to_vec()).collect()).collect()
    };
    let calls: Vec<(Box<ResidualsOf<'_>>, Box<DerivativesOf<'_>>)> = terms
        .iter()
        .enumerate()
        .map(|(number, term)| -> (Box<ResidualsOf<'_>>, Box<DerivativesOf<'_>>) {
            let (desk, order) = (&desk, term.8.as_ref().map_or(0, |own| own.1));
            let residuals = move |motion: &[Motion], values: &[f64]| {
                let (states, values) = (states(motion, order), values.to_vec());
                desk.ask(Request::Residuals { term: number, states, values })
            };
            let derivatives = move |motion: &[Motion], values: &[f64], changes: Vec<Change>| {
                let (states, values) = (states(motion, order), values.to_vec());
                desk.ask(Request::Derivatives { term: number, states, values, changes }).0
            };
            (Box::new(residuals), Box::new(derivatives))
        })
        .collect();
    let each = terms.iter().zip(&calls).map(|(term, call)| read_term(term, &spaces, call));
    let read = each.collect::<PyResult<Vec<Term>>>()?;
    let bodies = spaces.iter().zip(groups).map(|(space, inverse)| {
        Ok(inverse.as_ref().map(in_order).transpose()?.map(|inverse| Body { space, inverse }))
    });
    let bodies = bodies.collect::<PyResult<Vec<_>>>()?;
    let constants: Vec<Constant> =
        in_order(constants)?.chunks_exact(2).map(|x| Constant { mean: x[0], precision: x[1] }).collect();
    let profile =
        |array: &Option<Array>| array.as_ref().map_or(Ok(Vec::new()), |x| Ok(in_order(x)?.to_vec()));
    let profiles = profiles.iter().map(profile).collect::<PyResult<Vec<Vec<f64>>>>()?;
    let problem = Problem {
        spaces: &spaces,
        bodies: &bodies,
        knots,
        terms: &read,
        constants: &constants,
        penalty,
        profiles: &profiles,
    };
    let report = |number: usize| {
        if progress.is_some() {
            desk.ask(Request::Progress(number));
        }
    };
    let found =
        watched_serving(py, None, 1, heavy, &|| desk.serve(), |monitor| work(&problem, &report, monitor));
    if let Ok(Some(error)) = desk.error.lock().map(|mut error| error.take()) {
        return Err(error);
    }
    match found? {
        Ok(found) => Ok(Ok(found)),
        Err(Invalid::Parameters(information)) => Ok(Err(information)),
        Err(Invalid::Start) => {
            Err(invalid("No spline joins the initial points. Pass more knots, or `start`."))
        }
        Err(Invalid::Outside(at)) => Err(invalid(format!(
            "the time offset moves measurement {at} beyond the knots. Extend the knots beyond the measurements."
        ))),
        Err(Invalid::Row(BadRow { row, angle, limit })) => Err(bad_row(row, angle, limit)),
    }
}

/// The arrays of all derivatives of a motion, for each part of a term.
fn motions<'py>(
    py: Python<'py>,
    shapes: &[Vec<usize>],
    parts: &[usize],
    states: &[Vec<Vec<f64>>],
) -> PyResult<Vec<Vec<Out<'py>>>> {
    let arrays = |numbers: &Vec<Vec<f64>>| {
        numbers.iter().zip(parts).map(|(x, part)| of_points(py, &shapes[*part], x)).collect()
    };
    states.iter().map(arrays).collect()
}

/// The shape of the floating-point array of a point.
fn shape_of(space: &Erased) -> Vec<usize> {
    let mut shape = space.point_shape();
    if space.is_complex() {
        shape.last_mut().into_iter().for_each(|last| *last *= 2);
    }
    shape
}

/// Rows of points as an array.
fn of_points<'py>(py: Python<'py>, shape: &[usize], numbers: &[f64]) -> PyResult<Out<'py>> {
    let len: usize = shape.iter().product();
    array(py, &[&[numbers.len() / len.max(1)], shape].concat(), numbers)
}

/// Measurements from the arguments of Python.
fn read_term<'a>(
    term: &'a TermOf,
    spaces: &'a [Erased<'a>],
    (call, derivatives): &'a (Box<ResidualsOf<'a>>, Box<DerivativesOf<'a>>),
) -> PyResult<Term<'a>> {
    let (kind, parts, times, noise, loss, offset, arrays, constants, function) = term;
    let given = |at: usize| arrays.get(at).map_or(Ok(&[][..]), in_order);
    let first = |at: usize| constants.get(at).copied().flatten().map(|(first, _)| first);
    let space = &spaces[parts[0]];
    let sensor = match kind.as_str() {
        "points" => Sensor::Points { y: given(0)? },
        "information" => Sensor::Information { y: given(0)?, frames: given(1)?, roots: given(2)? },
        "velocities" => Sensor::Velocities { y: given(0)?, v: given(1)?, frames: given(2)? },
        "rates" => {
            Sensor::Rates { body: Body { space, inverse: given(1)? }, omega: given(0)?, bias: first(0) }
        }
        "directions" => {
            Sensor::Directions { body: Body { space, inverse: &[] }, seen: given(0)?, reference: given(1)? }
        }
        "force" => Sensor::Force {
            body: Body { space, inverse: &[] },
            f: given(0)?,
            gravity: given(1)?,
            arm: given(2)?,
            bias: first(0),
            unknown_arm: first(1),
        },
        _ => Sensor::Function {
            call,
            nu: function.as_ref().map_or(0, |own| own.1),
            derivatives: function
                .as_ref()
                .and_then(|own| own.2.as_ref())
                .map(|_| &**derivatives as Derivatives),
        },
    };
    Ok(Term {
        sensor,
        times: in_order(times)?,
        parts: parts.clone(),
        noise: in_order(noise)?,
        size: noise.shape().get(1).copied().unwrap_or(0),
        loss: loss_named(loss)?,
        offset: *offset,
        parameters: constants.iter().flatten().map(|(first, size)| *first..first + size).collect(),
    })
}

/// Whitened residuals (n, d) of one term, their derivatives with respect to the move of the curve and its time
/// derivatives, (n, d, m) each, and with respect to the parameters, (n, d, p), and the roots of robust weights, (n, 1).
type Rows<'py> = (Out<'py>, Vec<Option<Out<'py>>>, Option<Out<'py>>, Option<Out<'py>>);

fn rows<'py>(py: Python<'py>, own: &Linearised, roots: &[f64]) -> PyResult<Rows<'py>> {
    let n = own.residuals.len() / own.size.max(1);
    let given = |x: &[f64], shape: &[usize]| (!x.is_empty()).then(|| array(py, shape, x)).transpose();
    let third = |x: &[f64]| given(x, &[n, own.size, x.len() / own.residuals.len().max(1)]);
    Ok((
        array(py, &[n, own.size], &own.residuals)?,
        own.jacobians.iter().map(|x| third(x)).collect::<PyResult<_>>()?,
        third(&own.parameters)?,
        given(roots, &[n, 1])?,
    ))
}

/// The result of the iteration, as a dictionary; `_estimation/solve.py` reads it.
#[derive(IntoPyObject)]
pub struct Solved<'py> {
    failure: Option<&'static str>,
    points: Vec<Out<'py>>,
    values: Out<'py>,
    lams: Vec<f64>,
    at_bound: Vec<bool>,
    df: Vec<f64>,
    sigma: f64,
    iterations: usize,
    step: f64,
    rate: f64,
    information: Out<'py>,
    matrices: Vec<Out<'py>>,
    variances: Out<'py>,
    terms: Vec<Rows<'py>>,
    loss: f64,
    turn: f64,
}

/// Residuals of a term, from the motion of its parts and values of the parameters.
type ResidualsOf<'a> = dyn Fn(&[Motion], &[f64]) -> Residuals + Sync + 'a;
/// Their derivatives.
type DerivativesOf<'a> = dyn Fn(&[Motion], &[f64], Vec<Change>) -> Vec<f64> + Sync + 'a;

/// The result of the iteration, or the information about parameters that the measurements do not determine.
#[derive(IntoPyObject)]
#[allow(clippy::large_enum_variant, reason = "there is one per call")]
pub enum Estimated<'py> {
    Solved(Solved<'py>),
    Singular(Out<'py>),
}

/// Estimates a curve through initial points at the knots, in every part, with initial values of the parameters. λ that
/// are NaN are chosen, near those in `near` if all of these are given.
#[pyfunction]
#[pyo3(signature = (problem, points, values, lams, near, criterion, gamma, tol, max_iter, progress=None))]
pub fn estimate<'py>(
    py: Python<'py>,
    problem: ProblemOf<'py>,
    points: Vec<Array<'py>>,
    values: Array<'py>,
    lams: Vec<f64>,
    near: Vec<f64>,
    criterion: &str,
    gamma: f64,
    tol: f64,
    max_iter: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Estimated<'py>> {
    let (points, values) = (owned(&points)?, in_order(&values)?.to_vec());
    let [lams, near] = [lams, near].map(|lams| {
        let known = |x: &f64| Some(*x).filter(|x| !x.is_nan());
        lams.iter().map(known).collect::<Vec<Option<f64>>>()
    });
    let options =
        Options { lams: &lams, near: &near, criterion: criterion_named(criterion, gamma)?, tol, max_iter };
    let found = with_problem(py, &problem, true, progress.as_ref(), max_iter, |problem, report, monitor| {
        problem.solved(points, values, &options, report, monitor)
    })?;
    let p = in_order(&problem.4)?.len() / 2;
    let found = match found {
        Ok(found) => found,
        Err(information) => return Ok(Estimated::Singular(array(py, &[p, p], &information)?)),
    };
    let Linear { found: linear, squares: (squares, count), matrices: [band, side, corner] } = &found.linear;
    let knots = in_order(&problem.2)?.len();
    let size = linear.step.len();
    let left = *count as f64 - linear.freedom.1;
    let shapes = problem.0.iter().map(|handle| shape_of(&handle.space.get()));
    Ok(Estimated::Solved(Solved {
        failure: found.failure.map(|failure| match failure {
            Failure::Undetermined => "undetermined",
            Failure::Infinite => "infinite",
            Failure::NoCurve => "no curve",
            Failure::Unconverged => "unconverged",
        }),
        points: found
            .state
            .points
            .iter()
            .zip(shapes)
            .map(|(x, shape)| of_points(py, &shape, x))
            .collect::<PyResult<_>>()?,
        values: array(py, &[p], &found.state.values)?,
        lams: linear.lams.iter().map(|(lam, _)| *lam).collect(),
        at_bound: linear.lams.iter().map(|(_, bound)| *bound).collect(),
        df: linear.freedom.0.clone(),
        sigma: if left > 1e-9 * *count as f64 { (squares / left).sqrt() } else { f64::NAN },
        iterations: found.iterations,
        step: found.step,
        rate: found.rate,
        information: array(py, &[p, p], &linear.information)?,
        matrices: vec![
            array(py, &[size, 4 * size / knots], band)?,
            array(py, &[size, p], side)?,
            array(py, &[p, p], corner)?,
        ],
        variances: array(py, &[knots, size / knots], &linear.variances[0])?,
        terms: found.terms.iter().map(|(own, roots)| rows(py, own, roots)).collect::<PyResult<_>>()?,
        loss: found.loss,
        turn: found.turn,
    }))
}

fn owned(arrays: &[Array]) -> PyResult<Vec<Vec<f64>>> {
    arrays.iter().map(|x| Ok(in_order(x)?.to_vec())).collect()
}

/// The residuals of all terms at the spline through points, with their derivatives if `derivatives` is true; None if
/// there is no such spline. Without derivatives, times beyond the knots are moved to the first or the last knot.
#[pyfunction]
pub fn linearise<'py>(
    py: Python<'py>,
    problem: ProblemOf<'py>,
    points: Vec<Array<'py>>,
    values: Array<'py>,
    derivatives: bool,
) -> PyResult<Option<Vec<Rows<'py>>>> {
    let (points, values) = (owned(&points)?, in_order(&values)?.to_vec());
    let data: usize = problem.5.iter().map(|term| term.2.len()).sum();
    let heavy = is_long((data + in_order(&problem.2)?.len()) * 16);
    let found = with_problem(py, &problem, heavy, None, 0, |problem, _, monitor| {
        let Some(state) = problem.fitted(points, values, monitor) else { return Ok(None) };
        if derivatives {
            return problem.linearised(&state, &problem.along(&state), monitor).map(Some);
        }
        problem.residuals(&state, true, monitor).map(Some)
    })?;
    let found = found.ok().flatten();
    found.map(|found| found.iter().map(|own| rows(py, own, &[])).collect()).transpose()
}

/// How λ varies in some parts, at the spline through points with one λ in each part: gains, and λ of the segments divided by
/// their geometric mean, or None if λ does not vary.
#[pyfunction]
pub fn varying_lams<'py>(
    py: Python<'py>,
    problem: ProblemOf<'py>,
    points: Vec<Array<'py>>,
    values: Array<'py>,
    lams: Vec<f64>,
    parts: Vec<usize>,
) -> PyResult<Vec<(f64, Option<Out<'py>>)>> {
    let (points, values) = (owned(&points)?, in_order(&values)?.to_vec());
    let found = with_problem(py, &problem, true, None, 0, |problem, _, monitor| {
        let state = problem.fitted(points, values, monitor).ok_or(Invalid::Start)?;
        problem.varying(&state, &lams, &parts, monitor)
    })?;
    let profiles = found.unwrap_or_default();
    let of = |profile: &Profile| {
        let lam = &profile.lam;
        Ok((profile.gain, (!lam.is_empty()).then(|| array(py, &[lam.len()], lam)).transpose()?))
    };
    profiles.iter().map(of).collect()
}

/// The distance of an estimate from the minimum in standard deviations, from the band of A and rows of normal numbers.
#[pyfunction]
pub fn distance_from_minimum<'py>(
    py: Python<'py>,
    problem: ProblemOf<'py>,
    points: Vec<Array<'py>>,
    values: Array<'py>,
    lams: Vec<f64>,
    band: Array<'py>,
    normal: Array<'py>,
) -> PyResult<f64> {
    let (points, values) = (owned(&points)?, in_order(&values)?.to_vec());
    let (band, normal) = (in_order(&band)?, in_order(&normal)?);
    let found = with_problem(py, &problem, true, None, 0, |problem, _, monitor| {
        let state = problem.fitted(points, values, monitor).ok_or(Invalid::Start)?;
        problem.distance(state, &lams, band, normal, monitor)
    })?;
    Ok(found.unwrap_or(f64::NAN))
}

/// A of one curve, and how the curve ends: the band, side and corner, the coordinates that it couples, the kinds of the
/// ends (None for a closed curve) and the holonomy of a closed curve.
pub type Known<'py> = ([Array<'py>; 3], usize, Option<[String; 2]>, Array<'py>);

/// The same, as slices.
struct Slices<'a> {
    knots: &'a [f64],
    matrices: [&'a [f64]; 3],
    m: usize,
    ends: EndConditions,
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
pub fn matrices_of(known: &Known) -> PyResult<(Matrices, usize, EndConditions, Vec<f64>)> {
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
