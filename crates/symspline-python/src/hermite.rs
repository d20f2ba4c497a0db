//! Validation of curves with given velocities, called from Python.

use crate::arrays::{in_order, reserve};
use crate::curves::{Array, CurvesToFit, require_memory_for_checks};
use crate::errors::{CutLocusError, Invalid};
use crate::space::Handle;
use crate::validate;
use crate::watch::{is_heavy, is_long, watched};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use symspline_engine::rows::{Operation, apply, tangent_defects};
use symspline_engine::space::Ambient;

/// Validates points and velocities, and requires a unique geodesic between the inner control points of every segment,
/// except next to nodes without a velocity, which is NaN.
/// Returns the points on the space, the tangential parts of the velocities, and the longest distance between neighbours of
/// each curve.
#[pyfunction]
pub fn hermite<'py>(
    py: Python<'py>,
    handle: &Handle,
    t: Array<'py>,
    points: Array<'py>,
    velocities: Array<'py>,
    point_tol: f64,
    tangent_tol: f64,
) -> PyResult<[Bound<'py, PyArrayDyn<f64>>; 3]> {
    let natural = || ("natural".to_owned(), None);
    let ends = Some([natural(), natural()]);
    let mut curves = CurvesToFit::new(handle, &t, &points, &ends, None, None)?;
    require_memory_for_checks(handle, &curves)?;
    // Points, velocities and control points.
    drop(reserve::<f64>(10 * points.len())?);
    let (space, len) = (curves.space, curves.space.point_len());
    let mut own = Vec::new();
    curves.gather_points(&mut own)?;
    let given = in_order(&velocities)?;
    let mut tangent = reserve(given.len())?;
    tangent.resize(given.len(), 0.0);
    let t = in_order(&t)?;
    let heavy = is_heavy(&space) || is_long(own.len());
    let found = watched(py, None, own.len() / len, heavy, |monitor| {
        curves.check(&mut own, point_tol, false).map_err(Handles::Invalid)?;
        // An empty batch has nothing more to check.
        let nodes = curves.longest().max(1);
        if let Some((row, part)) =
            tangent_defects(&space, &own, given).into_iter().enumerate().find(|(row, d)| {
                !(*d <= tangent_tol) && !given[row * len..(row + 1) * len].iter().all(|v| v.is_nan())
            })
        {
            let node = row % nodes;
            let of = validate::of_curve(row / nodes, &curves.batch);
            let message = format!(
                "velocities[{node}]{of} is not tangent at its point: its normal component is {part:.3e} (allowed: \
                 {tangent_tol:.0e}); use space.project_tangent(p, v)"
            );
            return Err(Handles::Invalid(Invalid::new(row / nodes, Some(node), message)));
        }
        let _ = apply(&space, Operation::ProjectTangent, &[&own, given], &[], monitor, &mut tangent);
        // The inner control points of all segments, first those after nodes, then those before.
        let segments = own.len() / len / nodes * (nodes - 1);
        let mut inner = [vec![0.0; segments * len], vec![0.0; segments * len]];
        for (side, out) in inner.iter_mut().enumerate() {
            let mut at = Vec::with_capacity(segments * len);
            let mut handles = Vec::with_capacity(segments * len);
            for segment in 0..segments {
                let (curve, i) = (segment / (nodes - 1), segment % (nodes - 1));
                let knots = if curves.shared { t } else { &t[curve * nodes..(curve + 1) * nodes] };
                let third = (knots[i + 1] - knots[i]) / if side == 0 { 3.0 } else { -3.0 };
                let node = (curve * nodes + i + side) * len;
                at.extend_from_slice(&own[node..node + len]);
                handles.extend(tangent[node..node + len].iter().map(|v| v * third));
            }
            let _ = apply(&space, Operation::Exp, &[&at, &handles], &[], monitor, out);
        }
        let [first, second] = &mut inner;
        for (q, r) in first.chunks_exact_mut(len).zip(second.chunks_exact_mut(len)) {
            if q.iter().chain(&*r).any(|x| x.is_nan()) {
                q.copy_from_slice(&own[..len]);
                r.copy_from_slice(q);
            }
        }
        let mut between = vec![0.0; segments * len];
        apply(&space, Operation::Log, &[&inner[0], &inner[1]], &[], monitor, &mut between)
            .map_err(|(segment, angle)| Handles::Far { segment, angle, segments: nodes - 1 })?;
        let [here, next] = [0, 1].map(|side| {
            let of = |segment: usize| (segment / (nodes - 1) * nodes + segment % (nodes - 1) + side) * len;
            (0..segments).flat_map(|segment| own[of(segment)..][..len].iter().copied()).collect::<Vec<f64>>()
        });
        let mut steps = vec![0.0; segments];
        let _ = apply(&space, Operation::Distance, &[&here, &next], &[], monitor, &mut steps);
        let longest = |steps: &[f64]| steps.iter().fold(0.0, |most: f64, &step| most.max(step));
        Ok(steps.chunks(nodes.max(2) - 1).map(longest).collect::<Vec<f64>>())
    })?;
    let longest = found.map_err(|fault| match fault {
        Handles::Invalid(fault) => fault.raise(py, &curves.batch),
        Handles::Far { segment, angle, segments } => {
            let (curve, i, limit) = (segment / segments, segment % segments, space.cut_angle());
            let of = validate::of_curve(curve, &curves.batch);
            let after = i + 1;
            CutLocusError::new_err(format!(
                "segment {i}{of}, between t[{i}] and t[{after}]: its inner control points lie at or past each other's cut \
                 locus: angle {angle}, limit {limit}; the geodesic between them is not unique. Reduce the velocities \
                 at its ends, or allow the segment more time"
            ))
        }
    })?;
    let velocities = PyArray1::from_vec(py, tangent).reshape(points.shape())?.to_dyn().clone();
    let longest = PyArray1::from_vec(py, longest).to_dyn().clone();
    Ok([curves.points(py, own, points.shape())?, velocities, longest])
}

/// Why given velocities do not define a curve.
enum Handles {
    Invalid(Invalid),
    Far { segment: usize, angle: f64, segments: usize },
}
