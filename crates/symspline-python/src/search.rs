//! Searches along curves, called from Python.

use crate::arrays::in_order;
use crate::watch::{is_long, watched};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::search::{
    Bracket, Distances, Nearest, Path, TimeSamples, closest as run, roots as run_roots,
};

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type Numbers<'py> = Bound<'py, PyArray1<f64>>;

/// Targets of a general curve that are searched together.
const BLOCK: usize = 4096;

/// The times and distances of the nearest points of any curves to targets, which belong to curves in increasing order. Times
/// of samples and arc lengths have shape (curves, samples). `of_samples(target, number)` returns the distances between targets and samples, and
/// `at(target, x)` those from the points at times x, and the derivatives of half their squares.
#[pyfunction]
pub fn closest<'py>(
    py: Python<'py>,
    times: Array<'py>,
    lengths: Array<'py>,
    curve: PyReadonlyArray1<'py, i64>,
    of_samples: Bound<'py, PyAny>,
    at: Bound<'py, PyAny>,
) -> PyResult<[Numbers<'py>; 2]> {
    let curve = indices(&curve)?;
    let samples = samples_of(&times, &lengths)?;
    let mut found = Vec::with_capacity(curve.len());
    let mut distances = Called { of_samples, at };
    for (block, own) in curve.chunks(BLOCK).enumerate() {
        found.extend(run(samples, block * BLOCK, own, &mut distances)?);
    }
    Ok(columns(py, &found))
}

/// Roots of the functions `f(index, x)` by [`symspline_engine::search::roots`].
#[pyfunction]
pub fn roots<'py>(
    py: Python<'py>,
    f: Bound<'py, PyAny>,
    ends: [PyReadonlyArray1<'py, f64>; 2],
    values: [PyReadonlyArray1<'py, f64>; 2],
    guess: PyReadonlyArray1<'py, f64>,
) -> PyResult<Numbers<'py>> {
    let [a, b] = &ends;
    let [fa, fb] = &values;
    let [a, b, fa, fb, guess] = [a, b, fa, fb, &guess].map(|x| x.as_array());
    let brackets: Vec<Bracket> = (0..guess.len())
        .map(|i| Bracket { ends: [a[i], b[i]], values: [fa[i], fb[i]], guess: guess[i], tol: 0.0 })
        .collect();
    let found = run_roots(&brackets, |index, x| numbers(&f.call1((array(py, index), array_of(py, x)))?))?;
    Ok(PyArray1::from_vec(py, found))
}

/// The largest u at the first point of a grid from which the end of a path can be reached, and u at the whole grid for
/// the fastest traversal from `start`. Arrays are those of [`Path`].
#[pyfunction]
pub fn time_law<'py>(
    py: Python<'py>,
    h: Array<'py>,
    most: Array<'py>,
    forms: [Array<'py>; 3],
    limits: Array<'py>,
    start: Option<f64>,
) -> PyResult<(f64, Numbers<'py>)> {
    let [p, q, r] = &forms;
    let path = Path {
        h: in_order(&h)?,
        most: in_order(&most)?,
        forms: [in_order(p)?, in_order(q)?, in_order(r)?],
        limits: in_order(&limits)?,
    };
    let heavy = is_long(path.h.len() * path.limits.len());
    let (largest, values) = watched(py, None, 1, heavy, |_| {
        let (largest, following) = path.backward();
        let values = path.forward(&largest, &following, start);
        (largest[0], values)
    })?;
    Ok((largest, PyArray1::from_vec(py, values)))
}

/// Distances that functions in Python compute.
struct Called<'py> {
    of_samples: Bound<'py, PyAny>,
    at: Bound<'py, PyAny>,
}

impl Distances for Called<'_> {
    type Error = PyErr;

    fn of_samples(&mut self, target: &[usize], number: &[usize]) -> PyResult<Vec<f64>> {
        if target.is_empty() {
            return Ok(Vec::new());
        }
        let py = self.of_samples.py();
        numbers(&self.of_samples.call1((array(py, target), array(py, number)))?)
    }

    fn at(&mut self, target: &[usize], x: &[f64]) -> PyResult<[Vec<f64>; 2]> {
        let py = self.at.py();
        let found = self.at.call1((array(py, target), array_of(py, x)))?;
        let [distances, slopes]: [Bound<PyAny>; 2] = found.extract()?;
        Ok([numbers(&distances)?, numbers(&slopes)?])
    }
}

fn array<'py>(py: Python<'py>, index: &[usize]) -> Bound<'py, PyArray1<i64>> {
    PyArray1::from_iter(py, index.iter().map(|&i| i as i64))
}

fn array_of<'py>(py: Python<'py>, x: &[f64]) -> Numbers<'py> {
    PyArray1::from_slice(py, x)
}

fn numbers(array: &Bound<PyAny>) -> PyResult<Vec<f64>> {
    Ok(array.extract::<PyReadonlyArray1<f64>>()?.as_array().to_vec())
}

pub fn indices(array: &PyReadonlyArray1<i64>) -> PyResult<Vec<usize>> {
    Ok(array.as_array().iter().map(|&i| i as usize).collect())
}

pub fn samples_of<'a>(times: &'a Array, lengths: &'a Array) -> PyResult<TimeSamples<'a>> {
    Ok(TimeSamples { count: times.shape()[1], times: in_order(times)?, lengths: in_order(lengths)? })
}

pub fn columns<'py>(py: Python<'py>, found: &[Nearest]) -> [Numbers<'py>; 2] {
    let times = PyArray1::from_iter(py, found.iter().map(|nearest| nearest.time));
    [times, PyArray1::from_iter(py, found.iter().map(|nearest| nearest.distance))]
}
