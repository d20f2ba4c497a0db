//! Derivatives with respect to the data, called from Python.

use crate::arrays::{in_order, require_memory, zeros};
use crate::curves::{EndOf, end};
use crate::errors::invalid;
use crate::space::Handle;
use crate::watch::{is_heavy, is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use std::ops::Range;
use symspline_engine::derivative::{Data, Derivative, MOST_CURVES, Of};
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

/// The part of an array that belongs to some of the curves.
fn part<'a, T>(array: &'a [T], some: &Range<usize>, curves: usize) -> &'a [T] {
    let size = array.len() / curves;
    &array[some.start * size..some.end * size]
}

/// Curves whose derivatives are computed together: alone where few would fill the lanes.
fn groups(curves: usize) -> Vec<Range<usize>> {
    let full = curves / MOST_CURVES * MOST_CURVES;
    let mut groups: Vec<_> = (0..full).step_by(MOST_CURVES).map(|first| first..first + MOST_CURVES).collect();
    if 2 * (curves - full) > MOST_CURVES {
        groups.push(full..curves);
    } else {
        groups.extend((full..curves).map(|curve| curve..curve + 1));
    }
    groups
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
    fn derivative<'a>(&'a self, space: &'a Erased<'a>, some: &Range<usize>) -> Derivative<'a> {
        let of_some = |array| part(array, some, self.curves);
        let of_end = |end: End<'a>| match end {
            End::Velocity(v) => End::Velocity(of_some(v)),
            End::Acceleration(v) => End::Acceleration(of_some(v)),
            other => other,
        };
        let ends = match self.ends {
            Ends::Periodic => Ends::Periodic,
            Ends::Open(ends) => Ends::Open(ends.map(of_end)),
        };
        let [t, points, velocities] = [self.t, self.points, self.velocities].map(of_some);
        Derivative::new(space, t, points, velocities, &ends, some.len())
    }

    /// Raises MemoryError unless memory is available for the matrices of the curves that are computed at the same time: ten
    /// per knot, six in the solver, for several curves on all lanes, and frames.
    fn require_memory(&self, space: &Erased) -> PyResult<()> {
        let groups = groups(self.curves);
        let most = groups.first().map_or(0, Range::len);
        let at_once = parallel::num_threads().min(groups.len());
        let knots = self.t.len() / self.curves.max(1) * at_once;
        let (dim, frame) = (space.dim(), space.frame_len());
        let solver = 6 * if most > 1 { LANES } else { 1 };
        let of_knot = (10 * most + solver) * dim * (dim + 1) + most * frame;
        let numbers = knots as f64 * of_knot as f64;
        require_memory(numbers + 4.0 * self.points.len() as f64, || {
            ("the derivatives of the curves".into(), "Use fewer knots, or curves on fewer threads")
        })
    }

    /// Whether the derivatives of the curves of a group may take a long time: no signal is handled before its end.
    fn is_heavy(&self, space: &Erased) -> bool {
        let knots = (self.t.len() + self.x.len()) / self.curves.max(1) * self.curves.min(MOST_CURVES);
        let dim = space.dim();
        // Derivatives in time need many motions of nodes per segment.
        let passes = if self.quantities == [Of::Point] { 1 } else { NODES };
        let numbers = knots.saturating_mul(dim * space.point_len() * passes);
        is_heavy(space) || is_long(numbers / OPERATIONS)
    }

    fn times(&self, some: &Range<usize>) -> &[f64] {
        part(self.x, some, self.curves)
    }
}

/// Runs `work` on groups of curves and their parts of a result.
fn each<T: Send>(items: Vec<(Range<usize>, T)>, monitor: &Monitor, work: impl Fn(&Range<usize>, T) + Sync) {
    parallel::for_each(items, true, monitor, |(curves, item)| {
        work(&curves, item);
        monitor.advance(curves.len());
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
        let (size, orders) = (result.len() / slices.curves, slices.quantities.len());
        let mut rest = result;
        let mut items = Vec::new();
        for some in groups(slices.curves) {
            let (out, others) = rest.split_at_mut(some.len() * size);
            rest = others;
            items.push((some, out));
        }
        watched(py, None, slices.curves, heavy, |monitor| {
            each(items, monitor, |some, out| {
                let of_some = |array| part(array, some, slices.curves).to_vec();
                let change = Data { points: of_some(points), knots: of_some(knots), ends: ends.map(of_some) };
                let space = handle.space.get();
                let derivative = slices.derivative(&space, some);
                if orders == 1 {
                    return derivative.push(slices.times(some), &slices.quantities, &change, out);
                }
                let mut by_order = vec![0.0; out.len()];
                derivative.push(slices.times(some), &slices.quantities, &change, &mut by_order);
                transpose(&by_order, orders, some.len(), out);
            });
        })?;
    }
    drop(write);
    Ok(out)
}

/// Exchanges the first two axes of an array.
fn transpose(x: &[f64], rows: usize, columns: usize, out: &mut [f64]) {
    let size = x.len() / (rows * columns).max(1);
    for i in 0..rows {
        for j in 0..columns {
            out[(j * rows + i) * size..][..size].copy_from_slice(&x[(i * columns + j) * size..][..size]);
        }
    }
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
    let groups = groups(slices.curves);
    let mut gradients = vec![Data::default(); groups.len()];
    let items = groups.into_iter().zip(&mut gradients).collect();
    watched(py, None, slices.curves, heavy, |monitor| {
        each(items, monitor, |some, out| {
            let cotangents = part(cotangent, some, slices.curves);
            let mut by_order = vec![0.0; cotangents.len()];
            transpose(cotangents, some.len(), slices.quantities.len(), &mut by_order);
            let space = handle.space.get();
            *out = slices.derivative(&space, some).pull(slices.times(some), &slices.quantities, &by_order);
        });
    })?;
    let column =
        |f: fn(&Data) -> &[f64]| PyArray1::from_vec(py, gradients.iter().flat_map(f).copied().collect());
    Ok([column(|g| &g.points), column(|g| &g.knots), column(|g| &g.ends[0]), column(|g| &g.ends[1])])
}
