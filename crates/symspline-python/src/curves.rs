//! The curves of a call from Python: masks, validation, and projection of their points onto the space.

use crate::arrays::{in_order, reserve, zeros};
use crate::errors::{Invalid, invalid};
use crate::space::Handle;
use crate::validate::Names;
use crate::watch::{is_heavy, is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::borrow::Cow;
use symspline_engine::fit::{Both, End, Ends, Problem};
use symspline_engine::space::{Ambient, Erased};
use symspline_engine::validate;

pub type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
/// A kind, and the vectors that it prescribes: one per curve.
pub type EndOf<'py> = (String, Option<Array<'py>>);

/// A fault of one curve: its number in the batch, the kind, the node, the value there, its limit, and for invalid
/// points a message. `_base/faults.py` describes the other kinds.
pub type CurveFault = (usize, &'static str, Option<usize>, f64, f64, Option<String>);

/// Up to this many numbers are copied into a new array.
const FEW: usize = 1024;

/// Curves to fit. Points are contiguous, with the numbers of one point last.
pub struct CurvesToFit<'a> {
    pub space: Erased<'a>,
    t: Cow<'a, [f64]>,
    /// The knots with those that ends with two conditions add.
    knots: &'a [f64],
    /// The number of knots that each end adds.
    added: [usize; 2],
    /// Whether all curves have the same knots.
    pub shared: bool,
    points: &'a [f64],
    /// Nodes before each curve.
    pub offsets: Vec<usize>,
    ends: Ends<'a>,
    /// Axes of the batch.
    pub batch: Vec<usize>,
    /// The numbers of the curves to fit; None for all.
    pub chosen: Option<Vec<usize>>,
}

impl<'a> CurvesToFit<'a> {
    pub fn new(
        handle: &'a Handle,
        t: &'a Array<'_>,
        points: &'a Array<'_>,
        ends: &'a Option<[EndOf<'_>; 2]>,
        offsets: Option<Vec<usize>>,
        mask: Option<Vec<bool>>,
    ) -> PyResult<Self> {
        let space = handle.space.get();
        let nodes = points.len() / space.point_len();
        let different = offsets.is_some();
        let added = ends.as_ref().map_or([0, 0], |ends| [0, 1].map(|e| usize::from(ends[e].0 == "both")));
        let (offsets, shared) = match offsets {
            Some(offsets) => (offsets, false),
            None => {
                let n = t.shape()[t.ndim() - 1] - added[0] - added[1];
                ((0..=nodes / n).map(|c| c * n).collect(), t.ndim() == 1)
            }
        };
        let knots = in_order(t)?;
        let own_knots = match added {
            [0, 0] => Cow::Borrowed(knots),
            _ => {
                let (n, last) = (t.shape()[t.ndim() - 1], t.shape()[t.ndim() - 1] - 1);
                let is_added = |i: usize| (i == 1 && added[0] == 1) || (i + 1 == last && added[1] == 1);
                (0..knots.len()).filter(|i| !is_added(i % n)).map(|i| knots[i]).collect()
            }
        };
        let curves = offsets.len() - 1;
        let lead = points.ndim() - handle.point_axes() - 1;
        Ok(CurvesToFit {
            space,
            t: own_knots,
            knots,
            added,
            shared,
            points: in_order(points)?,
            batch: if different { vec![curves] } else { points.shape()[..lead].to_vec() },
            ends: match ends {
                None => Ends::Periodic,
                Some([a, b]) => Ends::Open([end(a)?, end(b)?]),
            },
            offsets,
            chosen: mask.map(|mask| (0..curves).filter(|&c| mask[c]).collect()),
        })
    }

    /// Whether a curve is to be fitted.
    pub fn fits(&self, curve: usize) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen.binary_search(&curve).is_ok())
    }

    /// Masks all curves except those in a list, and removes their points.
    pub fn keep(&mut self, valid: &[usize], points: &mut Vec<f64>) {
        let len = self.space.point_len();
        let (mut kept, mut start) = (Vec::new(), 0);
        for c in (0..self.offsets.len() - 1).filter(|&c| self.fits(c)) {
            let size = (self.offsets[c + 1] - self.offsets[c]) * len;
            if valid.binary_search(&c).is_ok() {
                kept.extend_from_slice(&points[start..start + size]);
            }
            start += size;
        }
        *points = kept;
        self.chosen = Some(valid.to_vec());
    }

    /// The nodes of the longest curve.
    pub fn longest(&self) -> usize {
        self.offsets.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0)
    }

    /// Knots, offsets and ends of the curves to fit, one curve after the other.
    pub fn gathered(&self) -> Gathered<'a> {
        let Some(chosen) = &self.chosen else {
            return Gathered {
                t: self.t.clone(),
                offsets: self.offsets.clone(),
                ends: match &self.ends {
                    Ends::Periodic => None,
                    Ends::Open(ends) => Some(ends.map(|end| parts(end, Cow::Borrowed))),
                },
            };
        };
        let mut offsets = vec![0];
        for &c in chosen {
            offsets.push(offsets[offsets.len() - 1] + self.offsets[c + 1] - self.offsets[c]);
        }
        let knots = |c: &usize| &self.t[self.offsets[*c]..self.offsets[c + 1]];
        Gathered {
            t: if self.shared { self.t.clone() } else { chosen.iter().flat_map(knots).copied().collect() },
            offsets,
            ends: match &self.ends {
                Ends::Periodic => None,
                Ends::Open(ends) => Some(ends.map(|end| parts(end, |v| self.rows(v)))),
            },
        }
    }

    /// The rows of the curves to fit, of an array with one row per curve.
    pub fn rows(&self, all: &'a [f64]) -> Cow<'a, [f64]> {
        let Some(chosen) = &self.chosen else { return Cow::Borrowed(all) };
        let size = all.len() / (self.offsets.len() - 1);
        chosen.iter().flat_map(|c| &all[c * size..(c + 1) * size]).copied().collect()
    }

    /// The knots of the curves to fit with the additional ones.
    pub fn all_knots(&self) -> Cow<'a, [f64]> {
        if self.shared { Cow::Borrowed(self.knots) } else { self.rows(self.knots) }
    }

    pub fn has_additional_knots(&self) -> bool {
        self.added != [0, 0]
    }

    /// Includes the additional points in the numbers of points; returns their number per curve.
    pub fn widen(&mut self) -> usize {
        let more = self.added[0] + self.added[1];
        self.offsets.iter_mut().enumerate().for_each(|(c, offset)| *offset += c * more);
        more
    }

    /// Their points.
    pub fn gather_points(&self, points: &mut Vec<f64>) -> PyResult<()> {
        let len = self.space.point_len();
        points.clear();
        match &self.chosen {
            None => {
                *points = reserve(self.points.len())?;
                points.extend_from_slice(self.points);
            }
            Some(chosen) => {
                for &c in chosen {
                    points.extend_from_slice(&self.points[self.offsets[c] * len..self.offsets[c + 1] * len]);
                }
            }
        }
        Ok(())
    }

    /// Writes the curves that were fitted into the batch, and NaN into the others.
    pub fn scatter(&self, found: &[f64], out: &mut [f64]) {
        let len = self.space.point_len();
        let Some(chosen) = &self.chosen else {
            return out.copy_from_slice(found);
        };
        out.fill(f64::NAN);
        let mut rest = found;
        for &c in chosen {
            let own = &mut out[self.offsets[c] * len..self.offsets[c + 1] * len];
            let (first, others) = rest.split_at(own.len());
            own.copy_from_slice(first);
            rest = others;
        }
    }

    /// The points of the whole batch as an array, with NaN for curves that were not fitted.
    pub fn points<'py>(
        &self,
        py: Python<'py>,
        own: Vec<f64>,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        // To take over memory takes longer than to copy a few numbers.
        if self.chosen.is_none() && own.len() > FEW {
            return Ok(PyArray1::from_vec(py, own).reshape(shape)?.to_dyn().clone());
        }
        let out = zeros(py, shape)?;
        self.scatter(&own, out.readwrite().as_slice_mut()?);
        Ok(out)
    }

    /// Validates the curves to fit and projects their points onto the space. With `skip`, curves with points off the space
    /// are masked, and their faults are returned.
    pub fn check(&mut self, points: &mut Vec<f64>, tol: f64, skip: bool) -> Result<Vec<CurveFault>, Invalid> {
        let mut own = self.gathered();
        let knots = |c: usize| &own.t[own.offsets[c]..own.offsets[c + 1]];
        if self.shared {
            validate::knots(&self.t, 0)
        } else {
            (0..own.offsets.len() - 1).try_for_each(|c| validate::knots(knots(c), c))
        }
        .map_err(|fault| self.names(tol).describe(fault))?;
        let mut faults = Vec::new();
        if let Err(first) = validate::points(&self.space, points, &own.offsets, tol) {
            if !skip {
                return Err(self.names(tol).describe(first));
            }
            faults = self.leave_out_invalid(tol);
            // Some points were projected before the invalid one was found, so start again from the input.
            own = self.gathered();
            let _ = self.gather_points(points);
            validate::points(&self.space, points, &own.offsets, tol)
                .map_err(|fault| self.names(tol).describe(fault))?;
        }
        let closed = match own.ends {
            None => validate::closed(&self.space, points, &own.offsets, tol),
            Some(_) => Ok(()),
        };
        closed
            .and_then(|()| validate::ends(&self.space, &own.problem(self.shared, points), tol))
            .map_err(|fault| self.names(tol).describe(fault))?;
        Ok(faults)
    }

    fn names(&self, tol: f64) -> Names<'_> {
        Names { batch: &self.batch, chosen: self.chosen.as_deref(), shared: self.shared, tol }
    }

    /// Masks the curves with points off the space, and returns their faults.
    fn leave_out_invalid(&mut self, tol: f64) -> Vec<CurveFault> {
        let len = self.space.point_len();
        let (mut valid, mut faults) = (Vec::new(), Vec::new());
        let wanted = self.chosen.take().unwrap_or_else(|| (0..self.offsets.len() - 1).collect());
        for number in wanted {
            let nodes = self.offsets[number]..self.offsets[number + 1];
            let mut copy = self.points[nodes.start * len..nodes.end * len].to_vec();
            match validate::points(&self.space, &mut copy, &[0, nodes.len()], tol) {
                Ok(()) => valid.push(number),
                Err(fault) => {
                    let one = [number];
                    let fault = Names { chosen: Some(&one), ..self.names(tol) }.describe(fault);
                    faults.push((number, "invalid", fault.node, f64::NAN, tol, Some(fault.message)));
                }
            }
        }
        self.chosen = Some(valid);
        faults
    }
}

/// The curves to fit of [`Curves`] without their points.
pub struct Gathered<'a> {
    t: Cow<'a, [f64]>,
    offsets: Vec<usize>,
    ends: Option<[(End<'static>, Cow<'a, [f64]>); 2]>,
}

impl Gathered<'_> {
    pub fn problem<'b>(&'b self, shared: bool, points: &'b [f64]) -> Problem<'b> {
        let ends = match &self.ends {
            None => Ends::Periodic,
            Some(ends) => Ends::Open([0, 1].map(|e| match ends[e].0 {
                End::Velocity(_) => End::Velocity(&ends[e].1),
                End::Acceleration(_) => End::Acceleration(&ends[e].1),
                End::Both(_) => End::Both(Both { vectors: &ends[e].1, apart: &[] }),
                End::Natural => End::Natural,
                End::NotAKnot => End::NotAKnot,
            })),
        };
        Problem { t: &self.t, shared, points, offsets: &self.offsets, ends }
    }
}

/// The kind of an end, and its vectors.
fn parts<'a>(end: End<'a>, part: impl Fn(&'a [f64]) -> Cow<'a, [f64]>) -> (End<'static>, Cow<'a, [f64]>) {
    match end {
        End::Velocity(v) => (End::Velocity(&[]), part(v)),
        End::Acceleration(v) => (End::Acceleration(&[]), part(v)),
        End::Both(both) => (End::Both(Both { vectors: &[], apart: &[] }), part(both.vectors)),
        End::Natural => (End::Natural, Cow::Borrowed(&[])),
        End::NotAKnot => (End::NotAKnot, Cow::Borrowed(&[])),
    }
}

/// Validates curves. Returns their points on the space, with NaN for masked curves, and the faults of skipped curves.
#[pyfunction]
#[pyo3(name = "validate", signature = (handle, t, points, ends, point_tol, offsets=None, mask=None, skip_invalid=false))]
pub fn check<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    ends: Option<[EndOf<'py>; 2]>,
    point_tol: f64,
    offsets: Option<Vec<usize>>,
    mask: Option<Vec<bool>>,
    skip_invalid: bool,
) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Vec<CurveFault>)> {
    let mut curves = CurvesToFit::new(handle, &t, &points, &ends, offsets, mask)?;
    require_memory_for_checks(handle, &curves)?;
    let mut own = Vec::new();
    curves.gather_points(&mut own)?;
    let heavy = is_heavy(&curves.space) || is_long(own.len());
    let faults = watched(py, None, 1, heavy, |_| curves.check(&mut own, point_tol, skip_invalid))?
        .map_err(|fault| fault.raise(py, &curves.batch))?;
    Ok((curves.points(py, own, points.shape())?, faults))
}

pub fn require_memory_for_checks(handle: &Handle, curves: &CurvesToFit) -> PyResult<()> {
    let len = handle.space.get().point_len();
    // Copies of ends, and the reports of curves.
    drop(reserve::<f64>(curves.points.len() / len + (curves.offsets.len() - 1) * (64 + 4 * len))?);
    Ok(())
}

pub fn end<'a>((kind, value): &'a EndOf<'a>) -> PyResult<End<'a>> {
    Ok(match (kind.as_str(), value) {
        ("natural", _) => End::Natural,
        ("not-a-knot", _) => End::NotAKnot,
        ("velocity", Some(v)) => End::Velocity(in_order(v)?),
        ("acceleration", Some(v)) => End::Acceleration(in_order(v)?),
        ("both", Some(v)) => End::Both(Both { vectors: in_order(v)?, apart: &[] }),
        _ => return Err(invalid(format!("unknown end condition {kind:?}"))),
    })
}
