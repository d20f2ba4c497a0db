//! Curves of the core, as a Python class: one curve per factor of a product, at common times.

use crate::arrays::{count, in_order, unwritten, zeros};
use crate::errors::invalid;
use crate::evaluate::{check_times, policy_named, quantity_named};
use crate::search::{columns, indices, samples_of};
use crate::space::Handle;
use crate::watch::{Progress, is_heavy, is_long, watched};
use numpy::{
    PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::OnceLock;
use symspline_engine::curve::{Curves, Factor, Times, evaluate_product, lift, lift_knots, transport};
use symspline_engine::search::{Nearest, Targets, closest_on_curves};
use symspline_engine::space::Ambient;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type NewArray<'py> = Bound<'py, PyArrayDyn<f64>>;
/// The space of a factor, knots, points, velocities, and the velocities before the knots if they differ.
type FactorOf =
    (Py<Handle>, Py<PyArrayDyn<f64>>, Py<PyArrayDyn<f64>>, Py<PyArrayDyn<f64>>, Option<Py<PyArrayDyn<f64>>>);

/// Curves of a batch in every factor of a space; a space that is not a product is its only factor.
#[pyclass(frozen, module = "symspline._core")]
pub struct Curve {
    factors: Vec<FactorOf>,
    batch: Vec<usize>,
    /// Unitary factors of the horizontal lift at the knots, in each factor.
    lift_knots: OnceLock<Vec<Vec<f64>>>,
}

/// The arrays of a factor during a call.
pub struct Borrowed<'py> {
    handle: Bound<'py, Handle>,
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
    before: Option<Array<'py>>,
}

impl Borrowed<'_> {
    pub fn factor(&self) -> PyResult<Factor<'_>> {
        let curves = Curves {
            t: in_order(&self.t)?,
            nodes: self.t.shape()[self.t.ndim() - 1],
            points: in_order(&self.points)?,
            velocities: in_order(&self.velocities)?,
            before: self.before.as_ref().map_or(Ok(&[][..]), in_order)?,
        };
        Ok(Factor { space: self.handle.get().space.get(), curves })
    }

    fn point_shape(&self) -> &[usize] {
        &self.points.shape()[self.points.ndim() - self.handle.get().point_axes()..]
    }
}

impl Curve {
    pub fn borrowed<'py>(&self, py: Python<'py>) -> Vec<Borrowed<'py>> {
        let borrowed = |(handle, t, points, velocities, before): &FactorOf| Borrowed {
            handle: handle.bind(py).clone(),
            t: t.bind(py).readonly(),
            points: points.bind(py).readonly(),
            velocities: velocities.bind(py).readonly(),
            before: before.as_ref().map(|before| before.bind(py).readonly()),
        };
        self.factors.iter().map(borrowed).collect()
    }

    /// The factors of a call. Vectors of few factors are on the heap, which takes less time than to convert one array.
    pub fn factors<'a>(borrowed: &'a [Borrowed]) -> PyResult<Vec<Factor<'a>>> {
        borrowed.iter().map(Borrowed::factor).collect()
    }

    pub fn is_heavy(factors: &[Factor]) -> bool {
        factors.iter().any(|factor| is_heavy(&factor.space))
    }
}

#[pymethods]
impl Curve {
    #[new]
    fn new(py: Python, factors: Vec<FactorOf>) -> PyResult<Self> {
        let Some((handle, _, points, ..)) = factors.first() else {
            return Err(invalid("a curve needs a factor"));
        };
        let points = points.bind(py);
        let batch = points.shape()[..points.ndim() - handle.get().point_axes() - 1].to_vec();
        Ok(Curve { factors, batch, lift_knots: OnceLock::new() })
    }

    /// Shape of the batch axes.
    #[getter]
    fn batch<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.batch)
    }

    /// Evaluates a quantity. Results have the batch axes, the axes of the times of one curve and the axes of a point (or
    /// none): one array for a single factor and for lengths, otherwise a tuple with one per factor. They are written to
    /// `out` if that is given.
    #[pyo3(signature = (x, quantity, outside, per_curve, progress=None, out=None))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        quantity: &str,
        outside: &str,
        per_curve: bool,
        progress: Option<Py<PyAny>>,
        out: Option<Vec<NewArray<'py>>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.sampled(py, x, quantity, (outside, per_curve), progress, out, None)
    }

    /// Evaluates the horizontal lift of curves on quotient spaces, and its derivatives, like `evaluate`. `start` contains
    /// the factors of the initial representatives, (curves, k, k, 2), or None in spaces without them.
    #[pyo3(signature = (x, quantity, outside, per_curve, start, progress=None))]
    fn lift<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        quantity: &str,
        outside: &str,
        per_curve: bool,
        start: Vec<Option<Array<'py>>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let knots = self.knots_of_lift(py)?;
        let start = start
            .iter()
            .map(|start| start.as_ref().map_or(Ok(&[][..]), in_order))
            .collect::<PyResult<Vec<_>>>()?;
        let lifted: Vec<[&[f64]; 2]> =
            knots.iter().zip(start).map(|(knots, start)| [&knots[..], start]).collect();
        self.sampled(py, x, quantity, (outside, per_curve), progress, None, Some(&lifted))
    }

    /// Transports one tangent vector of every curve in parallel along the curve, from its point at one time to that at
    /// another, in each factor.
    fn transport<'py>(
        &self,
        py: Python<'py>,
        times: [f64; 2],
        outside: &str,
        vectors: Vec<Array<'py>>,
    ) -> PyResult<Vec<NewArray<'py>>> {
        let (policy, _) = policy_named(outside)?;
        let borrowed = self.borrowed(py);
        let mut moved = Vec::with_capacity(vectors.len());
        for (factor, vectors) in borrowed.iter().zip(&vectors) {
            let Factor { space, curves } = factor.factor()?;
            let out = zeros(py, vectors.shape())?;
            let mut write = out.readwrite();
            let result = write.as_slice_mut()?;
            result.copy_from_slice(in_order(vectors)?);
            let units = result.len() / space.point_len().max(1);
            let heavy = is_heavy(&space) || is_long(curves.points.len());
            watched(py, None, units, heavy, |monitor| {
                transport(&space, &curves, times, policy, monitor, result);
            })?;
            drop(write);
            moved.push(out);
        }
        Ok(moved)
    }

    /// The times and distances of the nearest points of the curves to targets, given in each factor together with points
    /// at the samples. Times of samples and arc lengths have shape (curves, samples); the targets belong to curves in
    /// increasing order.
    fn closest<'py>(
        &self,
        py: Python<'py>,
        times: Array<'py>,
        lengths: Array<'py>,
        samples: Vec<Array<'py>>,
        targets: Vec<Array<'py>>,
        curve: PyReadonlyArray1<'py, i64>,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
        let curve = indices(&curve)?;
        let borrowed = self.borrowed(py);
        let mut sought = Vec::with_capacity(targets.len());
        for (factor, (samples, points)) in Curve::factors(&borrowed)?.iter().zip(samples.iter().zip(&targets))
        {
            sought.push(Targets { curve: *factor, samples: in_order(samples)?, points: in_order(points)? });
        }
        let samples = samples_of(&times, &lengths)?;
        let mut found = vec![Nearest { time: f64::NAN, distance: f64::NAN }; curve.len()];
        let heavy = sought.iter().any(|targets| is_heavy(&targets.curve.space));
        watched(py, None, curve.len(), heavy, |monitor| {
            closest_on_curves(&sought, samples, &curve, monitor, &mut found);
        })?;
        Ok(columns(py, &found))
    }
}

impl Curve {
    /// The factors of the horizontal lift at the knots, (curves, knots, k, k, 2), computed once.
    fn knots_of_lift(&self, py: Python) -> PyResult<&[Vec<f64>]> {
        if let Some(known) = self.lift_knots.get() {
            return Ok(known);
        }
        let mut found = Vec::with_capacity(self.factors.len());
        for factor in &self.borrowed(py) {
            let Factor { space, curves } = factor.factor()?;
            let k = space.fiber_rank();
            let nodes = if k > 0 { curves.points.len() / space.point_len() } else { 0 };
            let mut knots = crate::arrays::reserve(nodes * k * k * 2)?;
            knots.resize(nodes * k * k * 2, 0.0);
            if k > 0 {
                let heavy = is_heavy(&space) || is_long(nodes);
                watched(py, None, nodes, heavy, |monitor| lift_knots(&space, &curves, monitor, &mut knots))?;
            }
            found.push(knots);
        }
        Ok(self.lift_knots.get_or_init(|| found))
    }

    /// Reads times, and computes a quantity of the curves, or of their lifts, for every sample.
    fn sampled<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        quantity: &str,
        (outside, per_curve): (&str, bool),
        progress: Option<Py<PyAny>>,
        out: Option<Vec<NewArray<'py>>>,
        lifted: Option<&[[&[f64]; 2]]>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let quantity = quantity_named(quantity)?;
        let (policy, strict) = policy_named(outside)?;
        let count_axes = if per_curve { &x.shape()[self.batch.len()..] } else { x.shape() };
        let borrowed = self.borrowed(py);
        let factors = Curve::factors(&borrowed)?;
        let times = Times { x: in_order(&x)?, count: count(count_axes) };
        check_times(&factors[0].curves, &times, &self.batch, x.shape(), strict)?;

        let samples_shape = [&self.batch, count_axes].concat();
        let samples = count(&samples_shape);
        let results = if quantity.is_length() { 1 } else { factors.len() };
        let mut arrays = Vec::with_capacity(results);
        for i in 0..results {
            let mut shape = samples_shape.clone();
            if quantity.is_of_body() {
                shape.push(quantity.len(&factors[i].space));
            } else if !quantity.is_length() {
                shape.extend_from_slice(borrowed[i].point_shape());
            }
            let array = match out.as_ref().and_then(|out| out.get(i)) {
                Some(out) => out.clone(),
                None => unwritten(py, &shape)?,
            };
            if array.shape() != shape {
                return Err(invalid(format!(
                    "out has shape {:?}, but the result has {shape:?}",
                    array.shape()
                )));
            }
            arrays.push(array);
        }
        let mut written = arrays.iter().map(|array| array.readwrite()).collect::<Vec<_>>();
        let mut results =
            written.iter_mut().map(|array| array.as_slice_mut()).collect::<Result<Vec<_>, _>>()?;
        let units = samples * factors.len();
        watched(py, Progress::whole(progress), units, Curve::is_heavy(&factors), |monitor| {
            let Some(lifted) = lifted else {
                return evaluate_product(&factors, &times, quantity, policy, monitor, &mut results);
            };
            for ((factor, lifted), out) in factors.iter().zip(lifted).zip(&mut results) {
                let Factor { space, curves } = factor;
                if space.fiber_rank() > 0 {
                    lift(space, curves, &times, quantity, policy, *lifted, monitor, out);
                } else {
                    evaluate_product(&[*factor], &times, quantity, policy, monitor, &mut [&mut **out]);
                }
            }
        })?;
        drop(written);
        if quantity.is_length() || factors.len() == 1 {
            let mut arrays = arrays;
            return Ok(arrays.swap_remove(0).into_any());
        }
        Ok(PyTuple::new(py, arrays)?.into_any())
    }
}
