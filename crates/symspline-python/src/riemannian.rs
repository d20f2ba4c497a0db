//! Initial value problems of Riemannian cubics.

use crate::arrays::{in_order, zeros};
use crate::space::Handle;
use crate::watch::{is_heavy, watched};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use symspline_engine::curve::{CubicRule, Curvature, Segments};
use symspline_engine::rows::map;
use symspline_engine::scalar::Lane;
use symspline_engine::space::Ambient;

/// The curvature tensor of a space.
#[pyclass(frozen, module = "symspline._core")]
pub struct CurvatureTensor {
    handle: Py<Handle>,
    curvature: Curvature,
}

#[pymethods]
impl CurvatureTensor {
    #[new]
    fn new(handle: Py<Handle>) -> Self {
        let curvature = Curvature::new(&handle.get().space.get());
        CurvatureTensor { handle, curvature }
    }

    /// Rows of [`Segments::shoot`] from points p to points q, for initial values `start`.
    ///
    /// `rule` is the Gauss points and the matrices of integrals to them and to the outputs.
    fn shoot<'py>(
        &self,
        py: Python<'py>,
        rule: [PyReadonlyArrayDyn<'py, f64>; 3],
        steps: usize,
        p: PyReadonlyArrayDyn<'py, f64>,
        q: PyReadonlyArrayDyn<'py, f64>,
        start: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let inputs = [in_order(&p)?, in_order(&q)?, in_order(&start)?];
        self.rows(
            py,
            &rule,
            steps,
            &inputs,
            |s| s.row_len(),
            |s, x, out| {
                s.shoot(&x[0], &x[1], &x[2], out);
            },
        )
    }

    /// Rows of [`Segments::points`].
    fn points<'py>(
        &self,
        py: Python<'py>,
        rule: [PyReadonlyArrayDyn<'py, f64>; 3],
        steps: usize,
        p: PyReadonlyArrayDyn<'py, f64>,
        start: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let inputs = [in_order(&p)?, in_order(&start)?];
        let len = |s: &Segments| s.space.point_len() * steps * (s.rule.outputs.len() / s.rule.c.len()) + 1;
        self.rows(py, &rule, steps, &inputs, len, |s, x, out| s.points(&x[0], &x[1], out))
    }
}

impl CurvatureTensor {
    /// A function of segments for every row of the inputs, the first of which are points.
    fn rows<'py>(
        &self,
        py: Python<'py>,
        rule: &[PyReadonlyArrayDyn<'py, f64>; 3],
        steps: usize,
        inputs: &[&[f64]],
        len: impl Fn(&Segments) -> usize,
        f: impl Fn(&Segments, &[Vec<Lane>], &mut [Lane]) + Sync,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let space = &self.handle.get().space.get();
        let rule =
            CubicRule { c: in_order(&rule[0])?, nodes: in_order(&rule[1])?, outputs: in_order(&rule[2])? };
        let segments = Segments { space, curvature: &self.curvature, rule, steps };
        let (rows, len) = (inputs[0].len() / space.point_len(), len(&segments));
        let out = zeros(py, &[rows, len])?;
        let mut write = out.readwrite();
        let result = write.as_slice_mut()?;
        watched(py, None, rows, is_heavy(space), |monitor| {
            map(len, inputs, monitor, result, |x, out| f(&segments, x, out));
        })?;
        drop(write);
        Ok(out)
    }
}
