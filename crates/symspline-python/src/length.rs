//! Lengths and bending energies of curves, called from Python.

use crate::arrays::in_order;
use crate::curve::Curve;
use crate::watch::watched;
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use symspline_engine::curve::{
    ArcLength as Table, Factor, Integrand, Outside, Quantity, Times, energies, evaluate_product, lengths,
};
use symspline_engine::monitor::Monitor;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
type NewArray<'py> = Bound<'py, PyArrayDyn<f64>>;

/// The norm of a derivative: that of curves of the core, or a function of times of shape (curves, m) in Python.
#[derive(FromPyObject)]
pub enum Norm {
    Curve(Py<Curve>),
    Function(Py<PyAny>),
}

/// Norms of curves of the core.
struct OfCurve<'a> {
    factors: &'a [Factor<'a>],
    quantity: Quantity,
    monitor: &'a Monitor<'a>,
}

impl Integrand for OfCurve<'_> {
    type Error = PyErr;

    fn at(&mut self, times: Times, values: &mut [f64]) -> PyResult<()> {
        evaluate_product(self.factors, &times, self.quantity, Outside::Continue, self.monitor, &mut [values]);
        // The exception of the signal replaces this one.
        if self.monitor.poll() { Err(PyKeyboardInterrupt::new_err(())) } else { Ok(()) }
    }
}

/// Norms that a function in Python computes.
struct OfFunction<'py> {
    function: Bound<'py, PyAny>,
}

impl Integrand for OfFunction<'_> {
    type Error = PyErr;

    fn at(&mut self, times: Times, values: &mut [f64]) -> PyResult<()> {
        let py = self.function.py();
        let x = PyArray1::from_slice(py, times.x).reshape([times.x.len() / times.count, times.count])?;
        let found: NewArray = self.function.call1((x,))?.extract()?;
        values.copy_from_slice(in_order(&found.readonly())?);
        Ok(())
    }
}

impl Norm {
    /// Calls `work` with the function to integrate.
    fn with<T: Send>(
        &self,
        py: Python,
        quantity: Quantity,
        work: impl Fn(&mut dyn Integrand<Error = PyErr>) -> PyResult<T> + Sync,
    ) -> PyResult<T> {
        match self {
            Norm::Function(function) => work(&mut OfFunction { function: function.bind(py).clone() }),
            Norm::Curve(curve) => {
                let borrowed = curve.get().borrowed(py);
                let factors = Curve::factors(&borrowed)?;
                watched(py, None, 1, Curve::is_heavy(&factors), |monitor| {
                    work(&mut OfCurve { factors: &factors, quantity, monitor })
                })?
            }
        }
    }
}

/// Rows of numbers as an array of some shape.
fn shaped<'py>(py: Python<'py>, numbers: Vec<f64>, shape: &[usize]) -> PyResult<NewArray<'py>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape)?.to_dyn().clone())
}

/// The lengths or, from norms of accelerations, the bending energies of curves between their knots, of shape (curves,
/// knots).
#[pyfunction]
pub fn integrals<'py>(
    py: Python<'py>,
    knots: Array<'py>,
    norm: Norm,
    quantity: &str,
    rtol: f64,
) -> PyResult<NewArray<'py>> {
    let (curves, knots) = (knots.shape()[0], in_order(&knots)?);
    let found = if quantity == "speed" {
        norm.with(py, Quantity::Speed, |speed| lengths(knots, curves, rtol, speed))?
    } else {
        norm.with(py, Quantity::AccelerationNorm, |bend| energies(knots, curves, rtol, bend))?
    };
    shaped(py, found, &[curves])
}

/// The arc length of curves, from a table of its values at the ends of short intervals.
#[pyclass(frozen, module = "symspline._core")]
pub struct ArcLength {
    table: Table,
    speed: Norm,
}

impl ArcLength {
    /// Calls a method of the table with times or lengths of shape (curves, m), and returns an array of this shape.
    fn call<'py>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        work: impl Fn(&Table, &mut dyn Integrand<Error = PyErr>) -> PyResult<Vec<f64>> + Sync,
    ) -> PyResult<NewArray<'py>> {
        shaped(py, self.speed.with(py, Quantity::Speed, |speed| work(&self.table, speed))?, shape)
    }
}

#[pymethods]
impl ArcLength {
    /// Knots have shape (curves, knots).
    #[new]
    fn new(py: Python, knots: Array, speed: Norm, rtol: f64) -> PyResult<Self> {
        let (curves, knots) = (knots.shape()[0], in_order(&knots)?);
        let table = speed.with(py, Quantity::Speed, |speed| Table::new(knots, curves, rtol, speed))?;
        Ok(ArcLength { table, speed })
    }

    /// Ends of the intervals, shape (curves, k), increasing; they include all knots.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<NewArray<'py>> {
        let curves = self.table.curves();
        shaped(py, self.table.times.clone(), &[curves, self.table.times.len() / curves])
    }

    /// Arc lengths from the first knot to these times. NaN for curves that failed.
    #[getter]
    fn lengths<'py>(&self, py: Python<'py>) -> PyResult<NewArray<'py>> {
        let curves = self.table.curves();
        shaped(py, self.table.lengths.clone(), &[curves, self.table.times.len() / curves])
    }

    /// Arc lengths from the first knot to times x.
    fn at<'py>(&self, py: Python<'py>, x: Array<'py>) -> PyResult<NewArray<'py>> {
        let numbers = in_order(&x)?;
        self.call(py, x.shape(), |table, speed| table.at(numbers, speed))
    }

    /// Lengths from times a to times b, which are not before a.
    fn between<'py>(&self, py: Python<'py>, a: Array<'py>, b: Array<'py>) -> PyResult<NewArray<'py>> {
        let (starts, stops) = (in_order(&a)?, in_order(&b)?);
        self.call(py, a.shape(), |table, speed| table.between(starts, stops, speed))
    }

    /// The first times at which the arc length is s, between 0 and the length of the curve; NaN on curves that failed.
    fn times_at<'py>(&self, py: Python<'py>, s: Array<'py>) -> PyResult<NewArray<'py>> {
        let lengths = in_order(&s)?;
        self.call(py, s.shape(), |table, speed| table.times_at(lengths, speed))
    }
}
