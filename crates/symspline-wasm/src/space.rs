//! The geometry of a space.

use crate::family::{self, Family};
use crate::fault::Fault;
use symspline_engine::monitor::Monitor;
use symspline_engine::rows::{Operation, apply};
use symspline_engine::space::{Ambient, Origin};
use wasm_bindgen::prelude::*;

/// A space that is not a product, by its name.
#[wasm_bindgen]
pub struct Space(Family);

#[wasm_bindgen]
impl Space {
    /// The space with a name, such as `"sphere:2"`.
    #[wasm_bindgen(constructor)]
    pub fn new(name: &str) -> Result<Space, Fault> {
        Family::new(name).map(Space).map_err(|why| Fault::invalid("space", None, why))
    }

    /// All names, separated by spaces.
    pub fn names() -> String {
        family::names().collect::<Vec<_>>().join(" ")
    }

    /// The shape of the array of a point.
    #[wasm_bindgen(getter, js_name = pointShape)]
    pub fn point_shape(&self) -> Vec<usize> {
        self.0.get().point_shape()
    }

    /// The dimension.
    #[wasm_bindgen(getter)]
    pub fn dim(&self) -> usize {
        self.0.get().dim()
    }

    /// The distance below which two points are joined by one shortest geodesic.
    #[wasm_bindgen(getter, js_name = injectivityRadius)]
    pub fn injectivity_radius(&self) -> f64 {
        self.0.get().injectivity_radius()
    }

    /// exp_p(v), row by row.
    pub fn exp(&self, p: &[f64], v: &[f64]) -> Result<Vec<f64>, Fault> {
        self.apply(Operation::Exp, &[p, v], &[])
    }

    /// log_p(q), row by row.
    pub fn log(&self, p: &[f64], q: &[f64]) -> Result<Vec<f64>, Fault> {
        self.apply(Operation::Log, &[p, q], &[])
    }

    /// Distances, row by row.
    pub fn distance(&self, p: &[f64], q: &[f64]) -> Result<Vec<f64>, Fault> {
        self.apply(Operation::Distance, &[p, q], &[])
    }

    /// Inner products of tangent vectors, row by row.
    pub fn inner(&self, p: &[f64], u: &[f64], v: &[f64]) -> Result<Vec<f64>, Fault> {
        self.apply(Operation::Inner, &[p, u, v], &[])
    }

    /// The closest points of the space, row by row.
    pub fn project(&self, x: &[f64]) -> Result<Vec<f64>, Fault> {
        self.apply(Operation::Project, &[x], &[])
    }

    /// The geodesic from p to q at all times t.
    pub fn geodesic(&self, p: &[f64], q: &[f64], t: &[f64]) -> Result<Vec<f64>, Fault> {
        self.apply(Operation::Geodesic, &[&p.repeat(t.len()), &q.repeat(t.len())], t)
    }
}

impl Space {
    /// Applies an operation to rows of points of equal number.
    fn apply(&self, operation: Operation, inputs: &[&[f64]], t: &[f64]) -> Result<Vec<f64>, Fault> {
        let space = self.0.get();
        let len = space.point_len();
        if !inputs[0].len().is_multiple_of(len) || inputs.iter().any(|row| row.len() != inputs[0].len()) {
            let message = format!("arrays must contain equally many points of {len} numbers");
            return Err(Fault::invalid("points", None, message));
        }
        let mut out = vec![0.0; inputs[0].len() / len * operation.row_len(len)];
        let go_on = |_| true;
        apply(&space, operation, inputs, t, &Monitor::new(&go_on), &mut out).map_err(|(row, angle)| {
            if angle.is_nan() {
                let message = format!("pair {row} contains NaN, an infinite number, or an array that is not a point");
                return Fault::invalid("points", Some(row), message);
            }
            let limit = space.cut_angle();
            let message = format!(
                "pair {row}: the points lie at or past each other's cut locus: angle {angle}, limit {limit}. The \
                 geodesic between them is not unique"
            );
            Fault::cut_locus("points", row, angle, limit, message)
        })?;
        Ok(out)
    }
}
