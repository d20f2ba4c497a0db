//! The spaces of the core, as a Python class.

use crate::arrays::{in_order, require_memory, reserve, zeros};
use crate::errors::{CutLocusError, format_index, invalid};
use crate::watch::{is_heavy, is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::rows::{Operation, apply, memory, project_points, tangent_defects};
use symspline_engine::space::{Ambient, Origin};
use symspline_engine::spaces::{self, AnySpace};

/// A space of the core.
#[pyclass(frozen, module = "symspline._core")]
pub struct Handle {
    pub space: AnySpace,
}

impl Handle {
    /// The space for a message, such as "gl:3".
    pub fn described(&self) -> String {
        let (name, parameters) = self.space.name();
        format!("{name}:{}", parameters.iter().map(usize::to_string).collect::<Vec<_>>().join(","))
    }

    /// The number of axes of the floating-point array of a point.
    pub fn point_axes(&self) -> usize {
        self.space.get().point_shape().len()
    }
}

#[pymethods]
impl Handle {
    #[new]
    fn new(name: &str, parameters: Vec<usize>) -> PyResult<Self> {
        AnySpace::new(name, &parameters).map(|space| Handle { space }).map_err(invalid)
    }

    /// The canonical name and the parameters.
    fn name(&self) -> (&'static str, Vec<usize>) {
        self.space.name()
    }

    /// All names of all spaces.
    #[staticmethod]
    fn names() -> Vec<Vec<&'static str>> {
        spaces::all().map(|entry| entry.names.to_vec()).collect()
    }

    fn point_shape(&self) -> Vec<usize> {
        self.space.get().point_shape()
    }
    /// Whether numbers are complex: pairs of floating-point numbers in all arrays of this module.
    fn is_complex(&self) -> bool {
        self.space.get().is_complex()
    }
    /// See `Ambient::fiber_rank`.
    fn fibre(&self) -> usize {
        self.space.get().fiber_rank()
    }
    fn dim(&self) -> usize {
        self.space.get().dim()
    }
    fn injectivity_radius(&self) -> f64 {
        self.space.get().injectivity_radius()
    }
    fn curvature(&self) -> f64 {
        self.space.get().curvature()
    }

    /// Applies an operation to rows: arrays of equal shape (rows, numbers of a point).
    #[pyo3(signature = (operation, inputs, t=None))]
    fn apply<'py>(
        &self,
        py: Python<'py>,
        operation: &str,
        inputs: Vec<PyReadonlyArrayDyn<'py, f64>>,
        t: Option<PyReadonlyArrayDyn<'py, f64>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let operation = match operation {
            "exp" => Operation::Exp,
            "log" => Operation::Log,
            "geodesic" => Operation::Geodesic,
            "distance" => Operation::Distance,
            "cut_fraction" => Operation::CutFraction,
            "transvection" => Operation::Transvection,
            "transport" => Operation::Transport,
            "inner" => Operation::Inner,
            "rounding" => Operation::Rounding,
            "project" => Operation::Project,
            "project_tangent" => Operation::ProjectTangent,
            "scatter" => Operation::RandomPoint,
            "random_tangent" => Operation::RandomTangent,
            _ => return Err(invalid(format!("unknown operation {operation:?}"))),
        };
        let slices = inputs.iter().map(in_order).collect::<PyResult<Vec<_>>>()?;
        let t = t.as_ref().map_or(Ok(&[][..]), in_order)?;
        let len = self.space.get().point_len();
        let rows = slices.first().map_or(0, |first| first.len() / len);
        require_memory(memory(&self.space.get(), Some(operation)), || {
            (format!("this operation on {}", self.described()), "")
        })?;
        let out = zeros(py, &[rows * operation.row_len(len)])?;
        let mut write = out.readwrite();
        let result = write.as_slice_mut()?;
        let done = watched(py, None, rows, is_heavy(&self.space.get()), |monitor| {
            apply(&self.space.get(), operation, &slices, t, monitor, result)
        })?;
        drop(write);
        done.map_err(|(row, angle)| bad_row(row, angle, self.space.get().cut_angle()))?;
        Ok(out)
    }

    /// Raises unless every row is a point within `tol`; `shape` is the shape of the rows.
    #[pyo3(signature = (points, shape, tol, name=None))]
    fn check_points(
        &self,
        py: Python,
        points: PyReadonlyArrayDyn<f64>,
        shape: Vec<usize>,
        tol: f64,
        name: Option<&str>,
    ) -> PyResult<()> {
        let points = in_order(&points)?;
        require_memory(memory(&self.space.get(), None), || {
            (format!("checking points of {}", self.described()), "")
        })?;
        let mut copy = reserve(points.len())?;
        copy.extend_from_slice(points);
        let heavy = is_heavy(&self.space.get()) || is_long(copy.len());
        let done = watched(py, None, 1, heavy, |_| project_points(&self.space.get(), &mut copy, tol))?;
        done.map_err(|(row, off, why)| {
            let index = format_index(row, &shape);
            let which = match (name, shape.is_empty()) {
                (None, true) => "it".into(),
                (None, false) => format!("point {index}"),
                (Some(name), true) => name.into(),
                (Some(name), false) => format!("{name}[{index}]"),
            };
            invalid(off_space(&which, off, tol, &why))
        })
    }

    /// The normal components of vectors, relative to their length.
    fn tangent_defects<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArrayDyn<'py, f64>,
        vectors: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        require_memory(memory(&self.space.get(), None), || {
            (format!("checking vectors on {}", self.described()), "")
        })?;
        drop(reserve::<f64>(2 * points.shape()[0])?);
        let (p, v) = (in_order(&points)?, in_order(&vectors)?);
        let heavy = is_heavy(&self.space.get()) || is_long(p.len());
        let defects = watched(py, None, 1, heavy, |_| tangent_defects(&self.space.get(), p, v))?;
        let shape = [points.shape()[0]];
        PyArray1::from_vec(py, defects).reshape(shape).map(|a| a.to_dyn().clone())
    }
}

/// The exception for two points that no unique geodesic joins, or for a number that is not finite.
pub fn bad_row(row: usize, angle: f64, limit: f64) -> PyErr {
    if angle.is_nan() {
        return invalid(format!(
            "pair {row} contains a number that is not finite, or an array that is not a point of the space"
        ));
    }
    CutLocusError::new_err(format!(
        "pair {row}: the points lie at or past each other's cut locus: angle {angle}, limit {limit}; \
         the geodesic between them is not unique"
    ))
}

/// The message for a point that is off its space.
pub fn off_space(which: &str, off: f64, tol: f64, why: &str) -> String {
    if !off.is_finite() {
        // `space.project` fails, too.
        return format!("{which} is off the space: {why}. No point is close to it; correct it or remove it");
    }
    format!(
        "{which} is off the space by {off:.3e}: {why}. Points within {tol:.0e} are projected; use space.project(x) \
         if these are meant to be points"
    )
}
