//! Derivatives with respect to the data, called from Python.

use crate::arrays::{in_order, require_memory, zeros};
use crate::curves::{EndOf, end};
use crate::errors::invalid;
use crate::space::Handle;
use crate::watch::{is_heavy, is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use symspline_engine::derivative::{Data, Derivative, Of};
use symspline_engine::fit::{End, Ends};
use symspline_engine::monitor::Monitor;
use symspline_engine::parallel;
use symspline_engine::scalar::LANES;
use symspline_engine::space::{Ambient, Erased, Frame, Origin};

/// The motions that a derivative in time takes for a few samples of a segment.
const NODES: usize = 16;
/// The numbers of matrices that are computed in the time of one number of other work.
const OPERATIONS: usize = 8;

type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Curves with equally many knots and times, all arrays curve after curve.
#[derive(FromPyObject)]
pub struct CurvesToDifferentiate<'py> {
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
    ends: Option<[EndOf<'py>; 2]>,
    x: Array<'py>,
    curves: usize,
    orders: Vec<usize>,
}

struct Slices<'a> {
    t: &'a [f64],
    points: &'a [f64],
    velocities: &'a [f64],
    ends: Ends<'a>,
    x: &'a [f64],
    curves: usize,
    quantities: Vec<Of>,
}

/// The part of an array that belongs to one of equally many curves.
fn part<T>(array: &[T], curve: usize, curves: usize) -> &[T] {
    let size = array.len() / curves;
    &array[curve * size..(curve + 1) * size]
}

fn quantity(nu: usize) -> PyResult<Of> {
    match nu {
        0 => Ok(Of::Point),
        1 => Ok(Of::Velocity),
        2 => Ok(Of::Acceleration),
        nu => Err(invalid(format!("nu must be 0, 1 or 2, not {nu}"))),
    }
}

impl<'py> CurvesToDifferentiate<'py> {
    fn slices(&self) -> PyResult<Slices<'_>> {
        Ok(Slices {
            t: in_order(&self.t)?,
            points: in_order(&self.points)?,
            velocities: in_order(&self.velocities)?,
            ends: match &self.ends {
                None => Ends::Periodic,
                Some([a, b]) => Ends::Open([end(a)?, end(b)?]),
            },
            x: in_order(&self.x)?,
            curves: self.curves,
            quantities: self.orders.iter().map(|&nu| quantity(nu)).collect::<PyResult<_>>()?,
        })
    }
}

impl Slices<'_> {
    fn derivative<'a>(&'a self, space: &'a Erased<'a>, c: usize) -> Derivative<'a> {
        let one = |end: End<'a>| match end {
            End::Velocity(v) => End::Velocity(part(v, c, self.curves)),
            End::Acceleration(v) => End::Acceleration(part(v, c, self.curves)),
            other => other,
        };
        let ends = match self.ends {
            Ends::Periodic => Ends::Periodic,
            Ends::Open(ends) => Ends::Open(ends.map(one)),
        };
        let own = |array| part(array, c, self.curves);
        Derivative::new(space, own(self.t), own(self.points), own(self.velocities), &ends)
    }

    /// Raises MemoryError unless memory is available for the matrices of the curves that run at the same time: ten per
    /// knot, the blocks of the solver on all lanes, and frames.
    fn require_memory(&self, space: &Erased) -> PyResult<()> {
        let at_once = parallel::num_threads().min(self.curves).max(1);
        let knots = self.t.len() / self.curves.max(1) * at_once;
        let (dim, frame) = (space.dim(), space.frame_len());
        let numbers = knots as f64 * ((10 + 3 * LANES) * dim * (dim + 1) + frame) as f64;
        require_memory(numbers + 4.0 * self.points.len() as f64, || {
            ("the derivatives of the curves".into(), "Use fewer knots, or curves on fewer threads")
        })
    }

    /// Whether the derivatives of one curve may take a long time: no signal is handled before its end.
    fn is_heavy(&self, space: &Erased) -> bool {
        let (dim, knots) = (space.dim(), (self.t.len() + self.x.len()) / self.curves.max(1));
        // Derivatives in time need many motions of nodes per segment.
        let passes = if self.quantities == [Of::Point] { 1 } else { NODES };
        let numbers = knots.saturating_mul(dim * space.point_len() * passes);
        is_heavy(space) || is_long(numbers / OPERATIONS)
    }

    fn times(&self, c: usize) -> &[f64] {
        part(self.x, c, self.curves)
    }
}

/// Runs `work` on every curve and its part of a result.
fn each<T: Send>(items: Vec<(usize, T)>, monitor: &Monitor, work: impl Fn(usize, T) + Sync) {
    parallel::for_each(items, true, monitor, |(curve, item)| {
        work(curve, item);
        monitor.advance(1);
    });
}

/// Forward mode: tangent vectors of curves for changes of points, knots and end vectors (empty for none), curve after curve
/// and order after order.
#[pyfunction]
pub fn push<'py>(
    py: Python<'py>,
    handle: &Handle,
    curves: CurvesToDifferentiate<'py>,
    points: Array<'py>,
    knots: Array<'py>,
    ends: [Array<'py>; 2],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let slices = curves.slices()?;
    let len = handle.space.get().point_len();
    let (points, knots) = (in_order(&points)?, in_order(&knots)?);
    let ends = [in_order(&ends[0])?, in_order(&ends[1])?];
    slices.require_memory(&handle.space.get())?;
    let heavy = slices.is_heavy(&handle.space.get());
    let out = zeros(py, &[slices.x.len() * slices.quantities.len() * len])?;
    let mut write = out.readwrite();
    let result = write.as_slice_mut()?;
    if !result.is_empty() {
        let size = result.len() / slices.curves;
        let items = result.chunks_mut(size).enumerate().collect();
        watched(py, None, slices.curves, heavy, |monitor| {
            each(items, monitor, |c, out| {
                let own = |array| part(array, c, slices.curves).to_vec();
                let change = Data { points: own(points), knots: own(knots), ends: ends.map(own) };
                let space = handle.space.get();
                let derivative = slices.derivative(&space, c);
                derivative.push(slices.times(c), &slices.quantities, &change, out);
            });
        })?;
    }
    drop(write);
    Ok(out)
}

/// Reverse mode: gradients of Σ cotangent · curve with respect to points, knots and the vectors at the ends.
#[pyfunction]
pub fn pull<'py>(
    py: Python<'py>,
    handle: &Handle,
    curves: CurvesToDifferentiate<'py>,
    cotangent: Array<'py>,
) -> PyResult<[Bound<'py, PyArray1<f64>>; 4]> {
    let slices = curves.slices()?;
    let cotangent = in_order(&cotangent)?;
    slices.require_memory(&handle.space.get())?;
    let heavy = slices.is_heavy(&handle.space.get());
    let mut gradients = vec![Data::default(); slices.curves];
    let items = gradients.iter_mut().enumerate().collect();
    watched(py, None, slices.curves, heavy, |monitor| {
        each(items, monitor, |c, out| {
            let own = part(cotangent, c, slices.curves);
            *out = slices.derivative(&handle.space.get(), c).pull(slices.times(c), &slices.quantities, own);
        });
    })?;
    let column =
        |f: fn(&Data) -> &[f64]| PyArray1::from_vec(py, gradients.iter().flat_map(f).copied().collect());
    Ok([column(|g| &g.points), column(|g| &g.knots), column(|g| &g.ends[0]), column(|g| &g.ends[1])])
}
